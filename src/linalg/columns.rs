//! Factorisation by columns, for matrices with few entries per column.

use super::fill::{MOST_FILL, Place, TooMuchFill};
use super::ordering::Graph;
use super::pivot::Pivot;
use nalgebra::{SMatrix, SVector};

/// Factors of a [`BlockLdu`](super::sparse::BlockLdu), entry by entry.
///
/// # Source
/// Duff, Erisman & Reid, *Direct Methods for Sparse Matrices* (2017), ch. 10.
#[derive(Debug, Clone, Default)]
pub(super) struct Columns<const N: usize> {
    symmetric: bool,
    /// Elimination position of each node, and the reverse.
    position: Vec<usize>,
    node: Vec<usize>,
    /// Column k holds entries `start\[k\]..start[k + 1]`, their rows `row` ascending.
    start: Vec<usize>,
    row: Vec<u32>,
    /// Row k holds entries `across\[across_start\[k\]..across_start[k + 1]\]` with their columns,
    /// ascending.
    across_start: Vec<usize>,
    across: Vec<(u32, u32)>,
    /// Position of each row's entry in the current column.
    offset: Vec<u32>,
    diagonal: Vec<SMatrix<f64, N, N>>,
    pivots: Vec<Pivot<N>>,
    lower: Vec<SMatrix<f64, N, N>>,
    upper: Vec<SMatrix<f64, N, N>>,
    work: Vec<SVector<f64, N>>,
}

impl<const N: usize> Columns<N> {
    /// Sets every entry to zero.
    pub fn clear(&mut self, symmetric: bool) {
        self.symmetric = symmetric;
        for values in [&mut self.diagonal, &mut self.lower, &mut self.upper] {
            values.fill(SMatrix::zeros());
        }
    }

    /// Symbolic factorisation of a graph, with its nodes eliminated in the order of `node`.
    ///
    /// # Errors
    /// [`TooMuchFill`].
    pub fn analyse(&mut self, graph: &Graph, node: Vec<usize>) -> Result<(), TooMuchFill> {
        let n = node.len();
        self.node = node;
        self.position = vec![0; n];
        for (k, &v) in self.node.iter().enumerate() {
            self.position[v] = k;
        }
        // fill: a column has the rows of its own neighbours and those of its children in the
        // elimination tree
        let (mut child, mut sibling) = (vec![usize::MAX; n], vec![usize::MAX; n]);
        let mut rows: Vec<u32> = Vec::new();
        self.row.clear();
        self.start.clear();
        self.start.push(0);
        for k in 0..n {
            let v = self.node[k];
            rows.clear();
            rows.extend(
                graph
                    .of(v)
                    .iter()
                    .map(|&v| self.position[v as usize] as u32),
            );
            let mut next = child[k];
            while next != usize::MAX {
                rows.extend_from_slice(&self.row[self.start[next]..self.start[next + 1]]);
                next = sibling[next];
            }
            rows.retain(|&p| p as usize > k);
            rows.sort_unstable();
            rows.dedup();
            if let Some(&parent) = rows.first() {
                sibling[k] = std::mem::replace(&mut child[parent as usize], k);
            }
            self.row.extend_from_slice(&rows);
            self.start.push(self.row.len());
            if self.row.len() > MOST_FILL {
                return Err(TooMuchFill);
            }
        }
        self.find_rows(n);
        self.offset = vec![0; n];
        self.diagonal = vec![SMatrix::zeros(); n];
        self.pivots = vec![Pivot::default(); n];
        self.lower = vec![SMatrix::zeros(); self.row.len()];
        self.upper = vec![SMatrix::zeros(); self.row.len()];
        self.work = vec![SVector::zeros(); n];
        Ok(())
    }

    /// Lists the entries of each row.
    fn find_rows(&mut self, n: usize) {
        self.across_start = vec![0; n + 1];
        for &i in &self.row {
            self.across_start[i as usize + 1] += 1;
        }
        for k in 0..n {
            self.across_start[k + 1] += self.across_start[k];
        }
        let mut next = self.across_start.clone();
        self.across = vec![(0, 0); self.row.len()];
        for k in 0..n {
            for entry in self.start[k]..self.start[k + 1] {
                let place = &mut next[self.row[entry] as usize];
                self.across[*place] = (k as u32, entry as u32);
                *place += 1;
            }
        }
    }

    /// `K_aa += m` for node `a`.
    #[inline(always)]
    pub fn add_diagonal(&mut self, a: usize, m: &SMatrix<f64, N, N>) {
        self.diagonal[self.position[a]] += m;
    }

    /// Position of `K_ab`, for two different nodes of a declared pair.
    pub fn place(&self, a: usize, b: usize) -> Place {
        let (i, j) = (self.position[a], self.position[b]);
        let (column, row) = (i.min(j), i.max(j) as u32);
        let rows = &self.row[self.start[column]..self.start[column + 1]];
        Place {
            entry: self.start[column] + rows.partition_point(|&r| r < row),
            stride: 0,
            below: i > j,
        }
    }

    /// `K_ab += m` at the position of (a, b).
    #[inline(always)]
    pub fn add(&mut self, place: Place, m: &SMatrix<f64, N, N>) {
        let values = if place.below {
            &mut self.lower
        } else {
            &mut self.upper
        };
        values[place.entry] += m;
    }

    /// Factorises in place, column by column. Returns `false` if a pivot block is singular.
    ///
    /// Pivots are stored as factors `P D = L' U'`. So a block below a pivot becomes `K U'⁻¹`, and a
    /// block right of it `L'⁻¹ P K`.
    pub fn factorise(&mut self) -> bool {
        for j in 0..self.node.len() {
            let from = self.start[j];
            let rows = &self.row[from..self.start[j + 1]];
            for (offset, &i) in rows.iter().enumerate() {
                self.offset[i as usize] = offset as u32;
            }
            let (lower, present) = self.lower.split_at_mut(from);
            let present_lower = &mut present[..rows.len()];
            let (upper, present) = self.upper.split_at_mut(from);
            let present_upper = &mut present[..rows.len()];
            for &(k, entry) in &self.across[self.across_start[j]..self.across_start[j + 1]] {
                let (a, end) = (entry as usize, self.start[k as usize + 1]);
                // entries (row i, column j) below the diagonal, (row j, column i) above it
                let (la, ua) = (lower[a], upper[a]);
                self.diagonal[j] -= la * ua;
                let rows = &self.row[a + 1..end];
                for ((&i, lb), ub) in rows.iter().zip(&lower[a + 1..end]).zip(&upper[a + 1..end]) {
                    let offset = self.offset[i as usize] as usize;
                    present_lower[offset] -= lb * ua;
                    present_upper[offset] -= la * ub;
                }
            }
            let pivot = &mut self.pivots[j];
            if !pivot.set(self.diagonal[j].as_slice(), N, self.symmetric) {
                return false;
            }
            for (lower, upper) in present_lower.iter_mut().zip(present_upper) {
                pivot.divide_blocks(lower, upper);
            }
        }
        true
    }

    /// Whether the matrix is positive definite, if it is symmetric and was factorised as symmetric.
    pub fn is_positive(&self) -> bool {
        self.symmetric && self.pivots.iter().all(Pivot::is_positive)
    }

    /// Solves `K x = rhs` in place, with one vector per node.
    pub fn solve(&mut self, rhs: &mut [SVector<f64, N>]) {
        for (k, &v) in self.node.iter().enumerate() {
            self.work[k] = rhs[v];
        }
        for k in 0..self.node.len() {
            self.pivots[k].forward(&mut self.work[k].data.0[0]);
            let y = self.work[k];
            for a in self.start[k]..self.start[k + 1] {
                let i = self.row[a] as usize;
                self.work[i] -= self.lower[a] * y;
            }
        }
        for k in (0..self.node.len()).rev() {
            let mut y = self.work[k];
            for a in self.start[k]..self.start[k + 1] {
                y -= self.upper[a] * self.work[self.row[a] as usize];
            }
            self.pivots[k].backward(&mut y.data.0[0]);
            self.work[k] = y;
        }
        for (k, &v) in self.node.iter().enumerate() {
            rhs[v] = self.work[k];
        }
    }
}
