//! The broad phase: fat bounding boxes in a hierarchical grid.
//!
//! Every leaf has a bound of the distance that its points have travelled, and its fat box is valid
//! up to a limit of that distance. The grid looks at a leaf's box only when the limit is passed. A
//! fat box lies in the square cell of its lower corner, on the level whose cells are at most as
//! wide as the box and more than half as wide. A new box looks into the cells around it on all
//! levels.
//!
//! A cell has no storage of its own. A hash of its position assigns it to one of the lists, of
//! which there are at least as many as boxes.
//!
//! The grid does not report a pair again that overlapped before and still does.
//!
//! Source: Ericson, *Real-Time Collision Detection* (2005), §7.2 (hierarchical grids).

/// Low x, low y, high x, high y \[m\].
type Box4 = [f64; 4];

/// A box that overlaps no other.
const NOWHERE: Box4 = [
    f64::INFINITY,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NEG_INFINITY,
];

fn overlap(a: &Box4, b: &Box4) -> bool {
    // all four comparisons at once: a branch per comparison would be mispredicted
    (a[0] <= b[2]) & (b[0] <= a[2]) & (a[1] <= b[3]) & (b[1] <= a[3])
}

/// The cells of a level are `2^level` \[m\] wide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Cell {
    level: i32,
    at: [i64; 2],
}

/// Cells in a row of a level that have different hash names; cells farther away share names. A
/// query over that many cells visits all leaves instead.
const NAMED: i64 = 1 << 26;

/// Bounds of the levels, so that cell widths and their inverses are normal numbers. Boxes on the
/// coarsest level may have any size, and queries test all of them; a half-plane that rotates has
/// such a box.
const LEVELS: i32 = 1000;

/// No leaf.
const NONE: u32 = u32::MAX;

impl Cell {
    fn of(fat: &Box4) -> Cell {
        let exponent = ((extent(fat).to_bits() >> 52) & 0x7ff) as i32 - 1023;
        let level = exponent.clamp(-LEVELS, LEVELS);
        let at = [fat[0], fat[1]].map(|x| number(x, level));
        Cell { level, at }
    }

    fn name(&self) -> u64 {
        let [x, y] = self.at.map(|i| (i & (NAMED - 1)) as u64);
        u64::from((self.level + LEVELS) as u32) << 52 | x << 26 | y
    }
}

/// The longer side \[m\].
fn extent(fat: &Box4) -> f64 {
    (fat[2] - fat[0]).max(fat[3] - fat[1])
}

/// Number of the cell of a coordinate. Exact, so that it never decreases as the coordinate grows.
fn number(x: f64, level: i32) -> i64 {
    let inverse = f64::from_bits(((1023 - level) as u64) << 52);
    let scaled = x * inverse;
    // a cast instead of `floor`, which is a library call on processors without a rounding
    // instruction
    let whole = scaled as i64;
    whole.saturating_sub(i64::from(whole as f64 > scaled))
}

#[derive(Clone, Copy)]
struct Node {
    fat: Box4,
    /// Hash name of its cell.
    name: u64,
    /// Next leaf in the same list.
    next: u32,
    before: u32,
    /// Index of the leaf in the list of its level.
    rank: u32,
    /// Travelled distance \[m\] up to which the fat box is valid; −∞ for a leaf without a box.
    limit: f64,
}

const EMPTY: Node = Node {
    fat: NOWHERE,
    name: 0,
    next: NONE,
    before: NONE,
    rank: 0,
    limit: f64::NEG_INFINITY,
};

/// A level in use.
struct Level {
    level: i32,
    /// Size of the widest box so far on this level \[m\].
    extent: f64,
    list: Vec<u32>,
}

#[derive(Default)]
pub(super) struct Grid {
    nodes: Vec<Node>,
    /// The first leaf of each list.
    lists: Vec<u32>,
    levels: Vec<Level>,
    /// Leaves whose fat boxes are new in this call, with their former boxes.
    changed: Vec<(u32, Box4)>,
    /// Whether each leaf is in `changed`.
    moved: Vec<bool>,
}

impl Grid {
    pub fn remove(&mut self, leaf: u32) {
        let node = &self.nodes[leaf as usize];
        if node.limit != f64::NEG_INFINITY {
            self.unlink(leaf, Cell::of(&node.fat));
        }
        self.nodes[leaf as usize] = EMPTY;
    }

    /// Starts a call over leaves numbered below `count`.
    pub fn begin(&mut self, count: usize) {
        for (leaf, _) in self.changed.drain(..) {
            self.moved[leaf as usize] = false;
        }
        self.moved.resize(count, false);
        self.nodes.resize(count, EMPTY);
        if self.lists.len() < count {
            self.lists.clear();
            self.lists.resize(2 * count.next_power_of_two(), NONE);
            let placed = |k: &u32| self.nodes[*k as usize].limit != f64::NEG_INFINITY;
            for leaf in (0..count as u32).filter(placed).collect::<Vec<_>>() {
                self.push_front(leaf);
            }
        }
    }

    /// The list of a cell.
    fn list(&self, name: u64) -> usize {
        // Fibonacci hashing: the upper half of the product depends on all of the name
        (name.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & (self.lists.len() - 1)
    }

    /// Puts a leaf at the head of the list of its cell.
    fn push_front(&mut self, leaf: u32) {
        let list = self.list(self.nodes[leaf as usize].name);
        let first = std::mem::replace(&mut self.lists[list], leaf);
        if let Some(next) = self.nodes.get_mut(first as usize) {
            next.before = leaf;
        }
        let node = &mut self.nodes[leaf as usize];
        (node.before, node.next) = (NONE, first);
    }

    /// Whether a leaf that has travelled `travel` \[m\] and looks `growth` \[m\] ahead is still
    /// within its fat box.
    pub fn holds(&self, leaf: usize, travel: f64, growth: f64) -> bool {
        travel + growth <= self.nodes[leaf].limit
    }

    /// Gives `leaf` a fat box that contains `tight` grown by `growth`. `ahead` \[m\] is its motion
    /// in the next steps. Call it at most once a call.
    pub fn place(&mut self, leaf: usize, tight: Box4, travel: f64, growth: f64, ahead: [f64; 2]) {
        let node = &mut self.nodes[leaf];
        let old = node.fat;
        let slack = (tight[0] - old[0])
            .min(tight[1] - old[1])
            .min(old[2] - tight[2])
            .min(old[3] - tight[3]);
        if slack >= growth {
            node.limit = travel + slack;
            return;
        }
        let size = (tight[2] - tight[0]).max(tight[3] - tight[1]);
        let margin = growth + 0.08 * size.min(1e3);
        // margin for the rounding of boxes and gaps
        let far = tight.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let grown = margin + 1e-12 * far;
        // finite, as an infinite box would overlap even `NOWHERE`
        let low = |k: usize| (tight[k] - grown + ahead[k].min(0.0)).max(f64::MIN);
        let high = |k: usize| (tight[k + 2] + grown + ahead[k].max(0.0)).min(f64::MAX);
        let fat = [low(0), low(1), high(0), high(1)];
        let new = node.limit == f64::NEG_INFINITY;
        (node.fat, node.limit) = (fat, travel + margin);
        self.moved[leaf] = true;
        self.changed.push((leaf as u32, old));
        let cell = Cell::of(&fat);
        if new {
            self.link(leaf as u32, cell);
        } else if Cell::of(&old) != cell {
            self.unlink(leaf as u32, Cell::of(&old));
            self.link(leaf as u32, cell);
        } else if let Some(level) = self.level(cell) {
            level.extent = level.extent.max(extent(&fat));
        }
    }

    fn level(&mut self, cell: Cell) -> Option<&mut Level> {
        self.levels.iter_mut().find(|l| l.level == cell.level)
    }

    fn link(&mut self, leaf: u32, cell: Cell) {
        let node = &mut self.nodes[leaf as usize];
        node.name = cell.name();
        let extent = extent(&node.fat);
        self.push_front(leaf);
        let rank = match self.level(cell) {
            Some(level) => {
                level.extent = level.extent.max(extent);
                level.list.push(leaf);
                level.list.len() - 1
            }
            None => {
                self.levels.push(Level {
                    level: cell.level,
                    extent,
                    list: vec![leaf],
                });
                0
            }
        };
        self.nodes[leaf as usize].rank = rank as u32;
    }

    /// Removes a leaf from its cell.
    fn unlink(&mut self, leaf: u32, cell: Cell) {
        let Node {
            next, before, rank, ..
        } = self.nodes[leaf as usize];
        if let Some(node) = self.nodes.get_mut(next as usize) {
            node.before = before;
        }
        match self.nodes.get_mut(before as usize) {
            Some(node) => node.next = next,
            None => {
                let list = self.list(cell.name());
                self.lists[list] = next;
            }
        }
        if let Some(k) = self.levels.iter().position(|l| l.level == cell.level) {
            let list = &mut self.levels[k].list;
            list.swap_remove(rank as usize);
            if let Some(last) = list.get(rank as usize) {
                self.nodes[*last as usize].rank = rank;
            }
            if list.is_empty() {
                self.levels.swap_remove(k);
            }
        }
    }

    /// Whether the fat box of a leaf is new in this call.
    pub fn moved(&self, leaf: u32) -> bool {
        self.moved[leaf as usize]
    }

    /// Whether two fat boxes overlap.
    pub fn overlap(&self, a: u32, b: u32) -> bool {
        overlap(&self.nodes[a as usize].fat, &self.nodes[b as usize].fat)
    }

    /// Calls `found` once for every pair of leaves whose fat boxes overlap now and did not before
    /// this call.
    pub fn pairs(&self, mut found: impl FnMut(u32, u32)) {
        // former boxes of the leaves that moved
        let mut former = vec![];
        if self.changed.len() > 1 {
            former.resize(self.nodes.len(), NOWHERE);
            for (leaf, old) in &self.changed {
                former[*leaf as usize] = *old;
            }
        }
        for &(a, old) in &self.changed {
            self.near(&self.nodes[a as usize].fat, |b, node| {
                if !self.moved[b as usize] {
                    if !overlap(&old, &node.fat) {
                        found(a, b);
                    }
                } else if a < b && !overlap(&old, &former[b as usize]) {
                    found(a, b);
                }
            });
        }
    }

    /// Calls `visit` for all leaves whose fat boxes overlap that of a leaf.
    pub fn near_leaf(&self, leaf: u32, mut visit: impl FnMut(u32)) {
        self.near(&self.nodes[leaf as usize].fat, |other, _| {
            if other != leaf {
                visit(other);
            }
        });
    }

    /// Calls `visit` for all leaves whose fat boxes overlap `room`.
    fn near<'a>(&'a self, room: &Box4, mut visit: impl FnMut(u32, &'a Node)) {
        let mut ask = |b: u32, node: &'a Node| {
            if overlap(room, &node.fat) {
                visit(b, node);
            }
        };
        for Level {
            level,
            extent,
            list,
        } in &self.levels
        {
            // a box that reaches into a cell begins at most the rounded extent before it
            let range = |k: usize| {
                let back = (1.0 + 1e-12) * extent + 1e-12 * room[k].abs();
                (number(room[k] - back, *level), number(room[k + 2], *level))
            };
            let count = |(first, last): (i64, i64)| last.saturating_sub(first).saturating_add(1);
            let (columns, lines) = (range(0), range(1));
            let cells = count(columns).saturating_mul(count(lines));
            if *level == LEVELS || cells > (list.len() as i64).min(NAMED) {
                list.iter().for_each(|b| ask(*b, &self.nodes[*b as usize]));
                continue;
            }
            for x in columns.0..=columns.1 {
                for y in lines.0..=lines.1 {
                    let cell = Cell {
                        level: *level,
                        at: [x, y],
                    };
                    let name = cell.name();
                    let mut b = self.lists[self.list(name)];
                    while let Some(node) = self.nodes.get(b as usize) {
                        // leaves of another cell may be in the same list
                        if node.name == name {
                            ask(b, node);
                        }
                        b = node.next;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// A repeatable series of numbers in [0, 1).
    fn series() -> impl FnMut() -> f64 {
        let mut state = 7u64;
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
            (state >> 33) as f64 / (1u64 << 31) as f64
        }
    }

    /// Boxes of six sizes up to a factor of 1000 apart jump, go and come. The pairs reported and
    /// not parted since are the pairs that overlap, and no pair is reported twice.
    #[test]
    fn tells_of_every_pair_that_has_come_to_overlap_once() {
        const COUNT: u32 = 300;
        let mut random = series();
        let mut grid = Grid::default();
        let mut known: BTreeSet<[u32; 2]> = BTreeSet::new();
        let (mut reported, mut overlapping) = (0, 0);
        for call in 0..60 {
            if call % 7 == 3 {
                let there = grid.nodes.len() as u32;
                for leaf in (0..there).filter(|leaf| leaf % 5 == call % 5) {
                    grid.remove(leaf);
                    known.retain(|pair| !pair.contains(&leaf));
                }
            }
            // a growing count, so that the lists are rebuilt
            let count = (20 * call + 20).min(COUNT);
            grid.begin(count as usize);
            for leaf in 0..count as usize {
                let new = grid.nodes[leaf].limit == f64::NEG_INFINITY;
                if new || random() < 0.3 {
                    let size = 0.02 * 4f64.powi((leaf % 6) as i32);
                    let (x, y) = (20.0 * random() - 10.0, 20.0 * random() - 10.0);
                    grid.place(leaf, [x, y, x + size, y + size], 0.0, 0.01, [0.3, 0.0]);
                }
            }
            grid.pairs(|a, b| {
                reported += 1;
                assert!(known.insert([a.min(b), a.max(b)]), "{a} {b} is known");
            });
            known.retain(|[a, b]| grid.overlap(*a, *b));
            let all = (0..count).flat_map(|b| (0..b).map(move |a| [a, b]));
            let all: BTreeSet<_> = all.filter(|[a, b]| grid.overlap(*a, *b)).collect();
            overlapping += all.len();
            assert!(known == all, "call {call}");
        }
        assert!(
            reported > 5_000 && overlapping > 20_000,
            "{reported} {overlapping}"
        );
        let leaves: usize = grid.levels.iter().map(|level| level.list.len()).sum();
        assert_eq!(leaves, COUNT as usize);
    }

    #[test]
    fn boxes_without_end_overlap_all() {
        for growth in [1e300, 1e306, f64::MAX, f64::INFINITY] {
            let mut grid = Grid::default();
            grid.begin(3);
            grid.place(0, [-1e15, -1e15, 1e15, 1e15], 0.0, growth, [0.0; 2]);
            grid.place(1, [3.0, 3.0, 4.0, 4.0], 0.0, 0.1, [0.0; 2]);
            grid.place(2, [-9.0, 3.0, -8.0, 4.0], 0.0, growth, [0.0; 2]);
            let mut reported = BTreeSet::new();
            grid.pairs(|a, b| assert!(reported.insert([a.min(b), a.max(b)])));
            assert_eq!(reported.len(), 3, "{growth}");
            // a leaf that comes later is found as well
            grid.begin(4);
            grid.place(3, [30.0, 3.0, 31.0, 4.0], 0.0, 0.1, [0.0; 2]);
            grid.pairs(|a, b| assert!(reported.insert([a.min(b), a.max(b)])));
            assert_eq!(reported.len(), 5, "{growth}");
        }
    }

    /// Cells so far apart that they share a name, and with it a list: a leaf in one of them is
    /// reported once, and only to its neighbour.
    #[test]
    fn cells_of_one_name_are_no_neighbours() {
        let far = NAMED as f64;
        let mut grid = Grid::default();
        grid.begin(96);
        for leaf in 0..96 {
            let x = [0.0, far, 0.3][leaf % 3];
            let y = 3.0 * (leaf / 3) as f64;
            grid.place(leaf, [x, y, x + 1.1, y + 1.1], 0.0, 0.1, [0.0; 2]);
        }
        let name = |leaf: usize| grid.nodes[leaf].name;
        assert!((0..32).all(|k| name(3 * k) == name(3 * k + 1)));
        let mut reported = Vec::new();
        grid.pairs(|a, b| reported.push([a.min(b), a.max(b)]));
        reported.sort_unstable();
        let neighbours: Vec<_> = (0..32).map(|k| [3 * k, 3 * k + 2]).collect();
        assert_eq!(reported, neighbours);
    }

    /// Cells are half-open, their numbers exact, and a coordinate without a number has a cell as
    /// well.
    #[test]
    fn numbers_of_cells_grow_with_the_coordinate() {
        assert_eq!(
            [-2.0, -1.9, 0.0, 1.9, 2.0].map(|x| number(x, 1)),
            [-1, -1, 0, 0, 1]
        );
        assert_eq!(number(-0.0, 0), 0);
        assert_eq!(number(f64::NEG_INFINITY, 0), i64::MIN);
        assert_eq!(number(f64::INFINITY, 0), i64::MAX);
        let wide = Cell::of(&[0.0, 0.0, 1e308, 1.0]);
        assert_eq!(wide.level, LEVELS);
        assert_eq!(Cell::of(&[3.0, 3.0, 3.0, 3.0]).level, -LEVELS);
        // a box of exactly a power of two is on that level
        assert_eq!(Cell::of(&[0.0, 0.0, 2.0, 1.0]).level, 1);
        assert_eq!(Cell::of(&[0.0, 0.0, 1.9, 1.0]).level, 0);
    }
}
