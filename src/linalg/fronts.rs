//! Fronts of a sparse matrix: nodes that are eliminated together, and the nodes that they are
//! coupled to.

use super::ordering::Graph;
use super::panel::ALIGN;

/// Columns of a panel, in nodes. This number of rows of a large front fits the innermost cache.
pub const PANEL: usize = 8;

/// Fronts of up to this number of nodes are always merged, however many zeros this stores.
const SMALL: usize = 2;
/// Largest share of stored zeros in a larger front.
const ZEROS: f64 = 0.1;

const NONE: u32 = u32::MAX;

/// Nodes that are eliminated consecutively and are coupled to the same rows below them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Front {
    /// Its first column, and the number of columns.
    pub first: usize,
    pub width: usize,
    /// Its rows below these are `rows\[start..start + below\]` of [`Fronts`].
    pub start: usize,
    pub below: usize,
    /// Start of its panels.
    pub values: usize,
    /// Start of its update in the stack of its level: even or odd.
    pub update: usize,
    pub odd: bool,
    /// Its children are `children\[from..to\]` of [`Fronts`].
    pub children: (usize, usize),
}

/// Some columns of a front, with the rows from the first of these columns on.
#[derive(Debug, Clone, Copy)]
pub struct Panel {
    /// First column in the front, and the number of columns.
    pub from: usize,
    pub width: usize,
    /// Start of its numbers, and the stride of its columns.
    pub begin: usize,
    pub stride: usize,
}

impl Front {
    /// Number of rows and columns together.
    pub fn height(&self) -> usize {
        self.width + self.below
    }

    /// Panel of the column `k` of the front, with blocks of N × N.
    #[inline(always)]
    pub fn panel<const N: usize>(&self, k: usize) -> Panel {
        const { assert!((N * PANEL).is_multiple_of(ALIGN)) }
        let p = k / PANEL;
        let whole = stride::<N>(self.height());
        // size of the panels before it: p trapezoids of PANEL columns
        let before = p * whole - N * PANEL * (p * p.saturating_sub(1) / 2);
        Panel {
            from: p * PANEL,
            width: PANEL.min(self.width - p * PANEL),
            begin: self.values + N * PANEL * before,
            stride: whole - N * PANEL * p,
        }
    }

    /// Stride of a column of the whole front, padded.
    #[inline(always)]
    pub fn stride<const N: usize>(&self) -> usize {
        stride::<N>(self.height())
    }

    /// Stride of the front's update.
    pub fn update_stride<const N: usize>(&self) -> usize {
        stride::<N>(self.below)
    }

    /// Start of the block of a row and a column, and its stride.
    #[inline(always)]
    pub fn entry<const N: usize>(&self, row: usize, column: usize) -> (usize, usize) {
        let panel = self.panel::<N>(column);
        let (i, j) = (N * (row - panel.from), N * (column - panel.from));
        (panel.begin + j * panel.stride + i, panel.stride)
    }
}

/// Stride of a column of blocks, padded.
fn stride<const N: usize>(rows: usize) -> usize {
    (N * rows).next_multiple_of(ALIGN)
}

/// The fronts of a matrix in postorder: children before parents, each parent right after its last
/// child.
#[derive(Debug, Clone, Default)]
pub struct Fronts {
    /// Elimination position of each node, and the reverse.
    pub position: Vec<usize>,
    pub node: Vec<usize>,
    pub fronts: Vec<Front>,
    /// The front of each position.
    pub of: Vec<u32>,
    /// Positions of the rows below the columns of every front, ascending.
    pub rows: Vec<u32>,
    /// Index of each of these rows in the parent, which counts its columns first, then its rows.
    pub local: Vec<u32>,
    pub children: Vec<u32>,
    /// Total size of all panels.
    pub values: usize,
    /// Largest size of the two stacks.
    pub stacks: [usize; 2],
    /// Largest [`Front::height`].
    pub tallest: usize,
}

/// Chains of columns, before they are merged to fronts.
#[derive(Default)]
struct Chains {
    first: Vec<u32>,
    /// Rows of chain s, including its own later columns: `rows\[start\[s\]..start[s + 1]\]`.
    start: Vec<usize>,
    rows: Vec<u32>,
    /// Parent of each chain.
    parent: Vec<u32>,
}

impl Fronts {
    /// Positions of the rows of a front below its columns, ascending.
    pub fn rows(&self, front: &Front) -> &[u32] {
        &self.rows[front.start..front.start + front.below]
    }

    /// Symbolic factorisation of a graph, with its nodes eliminated approximately in the given
    /// order and blocks of N × N. `None` if the factors would have more than `most` blocks below
    /// the diagonal.
    pub fn new<const N: usize>(graph: &Graph, order: &[usize], most: usize) -> Option<Fronts> {
        let n = order.len();
        let own = |v: usize| graph.of(v);
        let (order, parent) = postorder(order, own);
        let mut position = vec![0; n];
        for (k, &v) in order.iter().enumerate() {
            position[v] = k;
        }
        let later = |k: usize| {
            let all = own(order[k]).iter();
            all.map(|&v| position[v as usize] as u32)
                .filter(move |&p| p as usize > k)
        };
        let chains = Chains::find(&parent, later, most)?;
        let mut fronts = chains.join(&order);
        fronts.lay_out::<N>();
        Some(fronts)
    }
}

/// Renumbers an elimination order to a postorder: every node comes right after the subtree of its
/// last child in the elimination tree. Returns the order and the parents in it.
///
/// # Source
/// Liu, *The role of elimination trees in sparse factorization* (1990).
fn postorder<'a>(order: &[usize], own: impl Fn(usize) -> &'a [isize]) -> (Vec<usize>, Vec<u32>) {
    let n = order.len();
    let mut position = vec![0u32; n];
    for (k, &v) in order.iter().enumerate() {
        position[v] = k as u32;
    }
    let (mut parent, mut ancestor) = (vec![NONE; n], vec![NONE; n]);
    for (k, &v) in order.iter().enumerate() {
        for &u in own(v) {
            let mut i = position[u as usize] as usize;
            // climb the tree; path compression shortens the next climb
            while i < k {
                let above = std::mem::replace(&mut ancestor[i], k as u32);
                if above == NONE {
                    parent[i] = k as u32;
                    break;
                }
                i = above as usize;
            }
        }
    }
    let (mut child, mut sibling) = (vec![NONE; n], vec![NONE; n]);
    for k in (0..n).rev() {
        if parent[k] != NONE {
            sibling[k] = std::mem::replace(&mut child[parent[k] as usize], k as u32);
        }
    }
    let (mut new, mut stack) = (Vec::with_capacity(n), Vec::new());
    for root in (0..n).filter(|&k| parent[k] == NONE) {
        stack.push(root as u32);
        while let Some(&k) = stack.last() {
            let next = std::mem::replace(&mut child[k as usize], NONE);
            if next == NONE {
                stack.pop();
                new.push(k);
            } else {
                child[k as usize] = sibling[next as usize];
                stack.push(next);
            }
        }
    }
    let mut place = vec![0; n];
    for (k, &old) in new.iter().enumerate() {
        place[old as usize] = k as u32;
    }
    let parent = |&old: &u32| match parent[old as usize] {
        NONE => NONE,
        above => place[above as usize],
    };
    let parents = new.iter().map(parent).collect();
    let order = new.iter().map(|&old| order[old as usize]).collect();
    (order, parents)
}

impl Chains {
    /// Finds chains of consecutive columns with the same rows.
    fn find<I: Iterator<Item = u32>>(
        parent: &[u32],
        later: impl Fn(usize) -> I,
        most: usize,
    ) -> Option<Chains> {
        let n = parent.len();
        let mut chains = Chains::default();
        let mut children = vec![0u32; n];
        for &p in parent.iter().filter(|&&p| p != NONE) {
            children[p as usize] += 1;
        }
        // lists of the chains that end below a column
        let (mut head, mut next) = (vec![NONE; n], Vec::new());
        let mut seen = vec![NONE; n];
        let mut of = vec![0u32; n];
        let mut fill = 0;
        let mut count = 0;
        for k in 0..n {
            let present = chains.first.len().wrapping_sub(1) as u32;
            let follows = k > 0
                && parent[k - 1] == k as u32
                && children[k] == 1
                && later(k).all(|i| seen[i as usize] == present);
            if follows {
                count -= 1;
            } else {
                if k > 0 && parent[k - 1] != NONE {
                    next[present as usize] =
                        std::mem::replace(&mut head[parent[k - 1] as usize], present);
                }
                let chain = chains.first.len() as u32;
                let start = chains.rows.len();
                chains.first.push(k as u32);
                chains.start.push(start);
                next.push(NONE);
                for i in later(k) {
                    seen[i as usize] = chain;
                    chains.rows.push(i);
                }
                let mut child = head[k];
                while child != NONE {
                    let c = child as usize;
                    // the last chain ends at the start of this one
                    for at in chains.start[c]..chains.start[c + 1] {
                        let i = chains.rows[at];
                        if i as usize > k && seen[i as usize] != chain {
                            seen[i as usize] = chain;
                            chains.rows.push(i);
                        }
                    }
                    child = next[c];
                }
                count = chains.rows.len() - start;
            }
            of[k] = chains.first.len() as u32 - 1;
            fill += count;
            if fill > most {
                return None;
            }
        }
        chains.start.push(chains.rows.len());
        chains.first.push(n as u32);
        chains.parent = (chains.first.windows(2))
            .map(|w| match parent[w[1] as usize - 1] {
                NONE => NONE,
                p => of[p as usize],
            })
            .collect();
        Some(chains)
    }

    /// Merges chains to fronts where this stores few zeros, and computes the layout.
    fn join(self, order: &[usize]) -> Fronts {
        let count = self.parent.len();
        let n = order.len();
        // for each chain its front, and for each front: columns, rows below, stored zeros
        let mut front: Vec<u32> = (0..count as u32).collect();
        let mut size: Vec<(usize, usize, usize)> = (0..count)
            .map(|s| {
                let width = (self.first[s + 1] - self.first[s]) as usize;
                (width, self.start[s + 1] - self.start[s] + 1 - width, 0)
            })
            .collect();
        for s in 0..count {
            let p = self.parent[s];
            if p == NONE {
                continue;
            }
            // parents come later, so p is not merged yet
            let ((width, below, zeros), (w, b, z)) = (size[p as usize], size[s]);
            let zeros = zeros + z + w * (width + below - b);
            let width = width + w;
            let stored = width * (width + 1) / 2 + width * below;
            if width <= SMALL || (zeros as f64) < ZEROS * stored as f64 {
                front[s] = p;
                size[p as usize] = (width, below, zeros);
            }
        }
        for s in (0..count).rev() {
            front[s] = front[front[s] as usize];
        }
        // sort chains by front: in the order of their last chains, still a postorder
        let mut begin = vec![0u32; count + 1];
        for &f in &front {
            begin[f as usize + 1] += 1;
        }
        for f in 0..count {
            begin[f + 1] += begin[f];
        }
        let mut chain = vec![0u32; count];
        let mut at = begin.clone();
        for (s, &f) in front.iter().enumerate() {
            chain[at[f as usize] as usize] = s as u32;
            at[f as usize] += 1;
        }
        let mut position = vec![0u32; n];
        let mut result = Fronts {
            node: Vec::with_capacity(n),
            of: Vec::with_capacity(n),
            ..Fronts::default()
        };
        for f in (0..count).filter(|&f| front[f] == f as u32) {
            let first = result.node.len();
            for &s in &chain[begin[f] as usize..begin[f + 1] as usize] {
                for k in self.first[s as usize]..self.first[s as usize + 1] {
                    position[k as usize] = result.node.len() as u32;
                    result.node.push(order[k as usize]);
                    result.of.push(result.fronts.len() as u32);
                }
            }
            result.fronts.push(Front {
                first,
                width: result.node.len() - first,
                start: f,
                ..Front::default()
            });
        }
        for front in &mut result.fronts {
            let (f, last) = (front.start, (front.first + front.width) as u32);
            front.start = result.rows.len();
            let rows = self.rows[self.start[f]..self.start[f + 1]].iter();
            let rows = rows.map(|&i| position[i as usize]);
            result.rows.extend(rows.filter(|&i| i >= last));
            result.rows[front.start..].sort_unstable();
            front.below = result.rows.len() - front.start;
        }
        result.position = vec![0; n];
        for (k, &v) in result.node.iter().enumerate() {
            result.position[v] = k;
        }
        result
    }
}

impl Fronts {
    /// Finds the children, and the positions of panels and updates.
    fn lay_out<const N: usize>(&mut self) {
        let count = self.fronts.len();
        self.local = vec![0; self.rows.len()];
        let mut parent = vec![NONE; count];
        for (front, parent) in self.fronts.iter().zip(&mut parent) {
            let rows = &self.rows[front.start..front.start + front.below];
            let Some(&first) = rows.first() else {
                continue;
            };
            *parent = self.of[first as usize];
            let above = self.fronts[*parent as usize];
            let end = above.first + above.width;
            let mut at = above.start;
            for (local, &row) in self.local[front.start..].iter_mut().zip(rows) {
                *local = if (row as usize) < end {
                    row - above.first as u32
                } else {
                    while self.rows[at] < row {
                        at += 1;
                    }
                    (above.width + at - above.start) as u32
                };
            }
        }
        let mut from = vec![0usize; count + 1];
        for &p in parent.iter().filter(|&&p| p != NONE) {
            from[p as usize + 1] += 1;
        }
        for f in 0..count {
            from[f + 1] += from[f];
            self.fronts[f].children = (from[f], from[f]);
        }
        self.children = vec![0; from[count]];
        for (f, &p) in parent.iter().enumerate() {
            if p != NONE {
                let to = &mut self.fronts[p as usize].children.1;
                self.children[*to] = f as u32;
                *to += 1;
            }
        }
        for f in (0..count).rev() {
            if parent[f] != NONE {
                self.fronts[f].odd = !self.fronts[parent[f] as usize].odd;
            }
        }
        let mut top = [0; 2];
        for f in 0..count {
            let front = &mut self.fronts[f];
            front.values = self.values;
            let last = front.panel::<N>(front.width - 1);
            self.values = last.begin + N * last.width * last.stride;
            self.tallest = self.tallest.max(front.height());
            // a front's update goes on one stack, and those of its children then leave the other
            let own = usize::from(front.odd);
            front.update = top[own];
            top[own] += N * front.below * front.update_stride::<N>();
            self.stacks[own] = self.stacks[own].max(top[own]);
            let (from, to) = front.children;
            if from < to {
                top[1 - own] = self.fronts[self.children[from] as usize].update;
            }
        }
    }
}
