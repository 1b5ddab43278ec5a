//! Which parts come near each other: boxes with a margin in a grid.
//!
//! A part's box is looked at only when it may have left its fat one: every body carries the length
//! of the way that any of its points can have gone, and a fat box says up to which length it
//! holds. Fat boxes lie in square cells by their lower corner, on the level whose cells are no wider
//! than the box, by less than twice; a new one asks the cells around it on all levels.
//!
//! Cells have no memory of their own: what lies in them hangs in lists, at least as many as there are
//! boxes, to which cells are dealt out by a hash of their place.
//!
//! Two boxes that overlap and did before are a pair that is known: nobody is told of it.
//!
//! Source: Ericson, *Real-Time Collision Detection* (2005), §7.2 (hierarchical grids).

/// Low x, low y, high x, high y \[m\].
type Box4 = [f64; 4];

/// A box that overlaps none.
const NOWHERE: Box4 = [
    f64::INFINITY,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NEG_INFINITY,
];

fn overlap(a: &Box4, b: &Box4) -> bool {
    // not one by one: which of them fails is anybody's guess
    (a[0] <= b[2]) & (b[0] <= a[2]) & (a[1] <= b[3]) & (b[1] <= a[3])
}

/// Its level's cells are `2^level` \[m\] wide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Cell {
    level: i32,
    at: [i64; 2],
}

/// Cells in a line of a level that have names of their own; farther ones share theirs, and a look
/// at so many at once goes over all leaves instead.
const NAMED: i64 = 1 << 26;

/// Nothing coarser or finer is told apart: keeps the widths of cells and their inverses normal
/// numbers. Of the coarsest level, whose boxes may be of any size, cells say nothing; a half-plane
/// that turns has such a box.
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

/// Number of the cell of a coordinate. Exact, so that it never falls while the coordinate grows.
fn number(x: f64, level: i32) -> i64 {
    let inverse = f64::from_bits(((1023 - level) as u64) << 52);
    let scaled = x * inverse;
    // not `floor`, which is a call where the processor is not known to have it
    let whole = scaled as i64;
    whole.saturating_sub(i64::from(whole as f64 > scaled))
}

#[derive(Clone, Copy)]
struct Node {
    fat: Box4,
    /// Its cell's.
    name: u64,
    /// Others in the same list.
    next: u32,
    before: u32,
    /// Its place among those of its level.
    rank: u32,
    /// The way \[m\] up to which its fat box holds it; none is placed at −∞.
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
    /// Of the widest box that it has held \[m\].
    extent: f64,
    list: Vec<u32>,
}

#[derive(Default)]
pub(super) struct Grid {
    nodes: Vec<Node>,
    /// The first leaf of each list.
    lists: Vec<u32>,
    levels: Vec<Level>,
    /// Leaves of this call whose fat boxes are new, with the former ones.
    changed: Vec<(u32, Box4)>,
    /// Whether a leaf is among them.
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
                self.hang(leaf);
            }
        }
    }

    /// The list of a cell.
    fn list(&self, name: u64) -> usize {
        // Fibonacci hashing: the upper half of the product depends on all of the name
        (name.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32) as usize & (self.lists.len() - 1)
    }

    /// Puts a leaf at the head of the list of its cell.
    fn hang(&mut self, leaf: u32) {
        let list = self.list(self.nodes[leaf as usize].name);
        let first = std::mem::replace(&mut self.lists[list], leaf);
        if let Some(next) = self.nodes.get_mut(first as usize) {
            next.before = leaf;
        }
        let node = &mut self.nodes[leaf as usize];
        (node.before, node.next) = (NONE, first);
    }

    /// Whether a leaf that has gone the way `way` and looks `growth` \[m\] ahead is still within
    /// its fat box.
    pub fn holds(&self, leaf: usize, way: f64, growth: f64) -> bool {
        way + growth <= self.nodes[leaf].limit
    }

    /// Sees to it that the fat box of `leaf` holds `tight` grown by `growth`; `ahead` \[m\] is
    /// where it moves in the next steps. Once a call.
    pub fn place(&mut self, leaf: usize, tight: Box4, way: f64, growth: f64, ahead: [f64; 2]) {
        let node = &mut self.nodes[leaf];
        let old = node.fat;
        let slack = (tight[0] - old[0])
            .min(tight[1] - old[1])
            .min(old[2] - tight[2])
            .min(old[3] - tight[3]);
        if slack >= growth {
            node.limit = way + slack;
            return;
        }
        let size = (tight[2] - tight[0]).max(tight[3] - tight[1]);
        let margin = growth + 0.08 * size.min(1e3);
        // room for the rounding of boxes and gaps
        let far = tight.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let grown = margin + 1e-12 * far;
        // finite, as an infinite box would overlap even the one that is nowhere
        let low = |k: usize| (tight[k] - grown + ahead[k].min(0.0)).max(f64::MIN);
        let high = |k: usize| (tight[k + 2] + grown + ahead[k].max(0.0)).min(f64::MAX);
        let fat = [low(0), low(1), high(0), high(1)];
        let new = node.limit == f64::NEG_INFINITY;
        (node.fat, node.limit) = (fat, way + margin);
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
        self.hang(leaf);
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

    /// Takes a leaf out of its cell.
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

    /// Whether the fat box of a leaf is of this call.
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
        // former boxes of leaves that moved
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
            // a box that reaches into a cell begins at most its extent before, which is rounded
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
                        // another cell may share the list, and be asked as well
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

    /// Boxes of six sizes, a thousandfold apart, that jump, go and come: those told of and not
    /// parted since are those that overlap, and none is told of while it is known.
    #[test]
    fn tells_of_every_pair_that_has_come_to_overlap_once() {
        const COUNT: u32 = 300;
        let mut random = series();
        let mut grid = Grid::default();
        let mut known: BTreeSet<[u32; 2]> = BTreeSet::new();
        let (mut told, mut overlapping) = (0, 0);
        for call in 0..60 {
            if call % 7 == 3 {
                let there = grid.nodes.len() as u32;
                for leaf in (0..there).filter(|leaf| leaf % 5 == call % 5) {
                    grid.remove(leaf);
                    known.retain(|pair| !pair.contains(&leaf));
                }
            }
            // more and more, so that lists are dealt out anew
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
                told += 1;
                assert!(known.insert([a.min(b), a.max(b)]), "{a} {b} is known");
            });
            known.retain(|[a, b]| grid.overlap(*a, *b));
            let all = (0..count).flat_map(|b| (0..b).map(move |a| [a, b]));
            let all: BTreeSet<_> = all.filter(|[a, b]| grid.overlap(*a, *b)).collect();
            overlapping += all.len();
            assert!(known == all, "call {call}");
        }
        assert!(told > 5_000 && overlapping > 20_000, "{told} {overlapping}");
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
            let mut told = BTreeSet::new();
            grid.pairs(|a, b| assert!(told.insert([a.min(b), a.max(b)])));
            assert_eq!(told.len(), 3, "{growth}");
            // who comes later is met as well
            grid.begin(4);
            grid.place(3, [30.0, 3.0, 31.0, 4.0], 0.0, 0.1, [0.0; 2]);
            grid.pairs(|a, b| assert!(told.insert([a.min(b), a.max(b)])));
            assert_eq!(told.len(), 5, "{growth}");
        }
    }

    /// Cells that are so many apart that they share a name, and with it a list: who lies in one of
    /// them is told of once, and only to its neighbour.
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
        let mut told = Vec::new();
        grid.pairs(|a, b| told.push([a.min(b), a.max(b)]));
        told.sort_unstable();
        let neighbours: Vec<_> = (0..32).map(|k| [3 * k, 3 * k + 2]).collect();
        assert_eq!(told, neighbours);
    }

    /// Cells are halves open, their numbers exact, and what has no number has a cell all the same.
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
        // exactly a power of two wide belongs to that level
        assert_eq!(Cell::of(&[0.0, 0.0, 2.0, 1.0]).level, 1);
        assert_eq!(Cell::of(&[0.0, 0.0, 1.9, 1.0]).level, 0);
    }
}
