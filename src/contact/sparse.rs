//! Block sparse LDU factorisation, N × N blocks: over the graph of bodies (3), over that of
//! contacts (2).

use super::ordering::{minimum_degree, neighbours};
use nalgebra::{Const, DimMin, SMatrix, SVector, ToTypenum};

/// Most blocks that a factor may have below its diagonal: as many as a full matrix of 7071 block
/// rows has. Blocks of 2 × 2 take 1.6 GB with those above.
pub const MOST_FILL: usize = 25_000_000;

/// Place of a block in a [`BlockLdu`].
#[derive(Debug, Clone, Copy)]
pub struct Place {
    entry: usize,
    /// Whether its row is eliminated after its column.
    below: bool,
}

/// A square matrix of N × N blocks with a symmetric pattern, and its factors in place.
///
/// ```text
/// K = L D U,   L unit lower, U unit upper, D block diagonal                  (1)
/// ```
///
/// The values need not be symmetric: sliding contacts make them so. The symbolic phase (an
/// approximate minimum degree ordering and the fill) is kept until the set of coupled pairs
/// changes. No pivots are sought beyond a block.
///
/// # Source
/// Duff, Erisman & Reid, *Direct Methods for Sparse Matrices* (2017), ch. 10; the ordering is
/// Amestoy, Davis & Duff (1996), crate `amd`.
#[derive(Debug, Clone, Default)]
pub struct BlockLdu<const N: usize> {
    size: usize,
    pairs: Vec<(u32, u32)>,
    /// Elimination position of each node, and the reverse.
    position: Vec<usize>,
    node: Vec<usize>,
    /// Column k holds entries `start\[k\]..start[k + 1]`, their rows `row` ascending.
    start: Vec<usize>,
    row: Vec<u32>,
    /// Row k holds entries `across\[across_start\[k\]..across_start[k + 1]\]`, with their columns,
    /// ascending.
    across_start: Vec<usize>,
    across: Vec<(u32, u32)>,
    /// Where in the present column a row has its entry.
    offset: Vec<u32>,
    diagonal: Vec<SMatrix<f64, N, N>>,
    lower: Vec<SMatrix<f64, N, N>>,
    upper: Vec<SMatrix<f64, N, N>>,
    work: Vec<SVector<f64, N>>,
}

/// The factors of a matrix would have more than [`MOST_FILL`] blocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooMuchFill;

impl<const N: usize> BlockLdu<N> {
    /// Prepares a matrix of `size` nodes coupled by `pairs` (each `a < b`, sorted, unique).
    ///
    /// Returns whether the symbolic phase had to be done again.
    ///
    /// # Errors
    /// [`TooMuchFill`]; there is no matrix then.
    pub fn prepare(&mut self, size: usize, pairs: &[(u32, u32)]) -> Result<bool, TooMuchFill> {
        let changed = self.size != size || self.pairs != pairs;
        if changed {
            if let Err(error) = self.analyse(size, pairs) {
                *self = BlockLdu::default();
                return Err(error);
            }
            self.size = size;
            self.pairs.clear();
            self.pairs.extend_from_slice(pairs);
        }
        Ok(changed)
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        for values in [&mut self.diagonal, &mut self.lower, &mut self.upper] {
            values.fill(SMatrix::zeros());
        }
    }

    fn analyse(&mut self, n: usize, pairs: &[(u32, u32)]) -> Result<(), TooMuchFill> {
        let (first, neighbour) = neighbours(n, pairs);
        self.node = minimum_degree(&first, &neighbour);
        self.position = vec![0; n];
        for (k, &v) in self.node.iter().enumerate() {
            self.position[v] = k;
        }
        // fill: the structure of a column is its own neighbours and what its children pass on
        let (mut child, mut sibling) = (vec![usize::MAX; n], vec![usize::MAX; n]);
        let mut rows: Vec<u32> = Vec::new();
        self.row.clear();
        self.start.clear();
        self.start.push(0);
        for k in 0..n {
            let v = self.node[k];
            let own = &neighbour[first[v] as usize..first[v + 1] as usize];
            rows.clear();
            rows.extend(own.iter().map(|&v| self.position[v as usize] as u32));
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
        self.lower = vec![SMatrix::zeros(); self.row.len()];
        self.upper = vec![SMatrix::zeros(); self.row.len()];
        self.work = vec![SVector::zeros(); n];
        Ok(())
    }

    /// Lists the entries of every row.
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
    pub fn add_diagonal(&mut self, a: usize, m: &SMatrix<f64, N, N>) {
        self.diagonal[self.position[a]] += m;
    }

    /// Where `K_ab` lies, for two different nodes of a declared pair.
    pub fn place(&self, a: usize, b: usize) -> Place {
        let (i, j) = (self.position[a], self.position[b]);
        let (column, row) = (i.min(j), i.max(j) as u32);
        let rows = &self.row[self.start[column]..self.start[column + 1]];
        Place {
            entry: self.start[column] + rows.partition_point(|&r| r < row),
            below: i > j,
        }
    }

    /// `K_ab += m` for the place of (a, b).
    pub fn add(&mut self, place: Place, m: &SMatrix<f64, N, N>) {
        let values = if place.below {
            &mut self.lower
        } else {
            &mut self.upper
        };
        values[place.entry] += m;
    }

    /// `K_ab += ab`, `K_ba += ba` for the place of (a, b).
    pub fn add_coupling(&mut self, place: Place, ab: &SMatrix<f64, N, N>, ba: &SMatrix<f64, N, N>) {
        self.add(place, ab);
        let mirror = Place {
            below: !place.below,
            ..place
        };
        self.add(mirror, ba);
    }

    /// Factorises in place, column by column. `false` if a pivot block is singular.
    pub fn factorise(&mut self) -> bool {
        for j in 0..self.size {
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
            let Some(inverse) = inverse(&self.diagonal[j]) else {
                return false;
            };
            self.diagonal[j] = inverse;
            for lower in present_lower {
                *lower *= inverse;
            }
        }
        true
    }

    /// Whether the matrix, symmetric and factorised, is positive definite: all its pivots are.
    pub fn is_positive(&self) -> bool
    where
        Const<N>: ToTypenum + DimMin<Const<N>, Output = Const<N>>,
    {
        self.diagonal
            .iter()
            .all(|inverse| inverse.cholesky().is_some())
    }

    /// Solves `K x = rhs` in place, one vector a node.
    pub fn solve(&mut self, rhs: &mut [SVector<f64, N>]) {
        for (k, &v) in self.node.iter().enumerate() {
            self.work[k] = rhs[v];
        }
        for k in 0..self.size {
            let y = self.work[k];
            for a in self.start[k]..self.start[k + 1] {
                let i = self.row[a] as usize;
                self.work[i] -= self.lower[a] * y;
            }
        }
        for k in (0..self.size).rev() {
            let mut y = self.work[k];
            for a in self.start[k]..self.start[k + 1] {
                y -= self.upper[a] * self.work[self.row[a] as usize];
            }
            self.work[k] = self.diagonal[k] * y;
        }
        for (k, &v) in self.node.iter().enumerate() {
            rhs[v] = self.work[k];
        }
    }
}

/// Inverse by elimination with row pivots; `None` if singular.
///
/// Not by cofactors: a stiff row adds 1e8 times a rank-one matrix, whose determinant cancels to
/// nothing in f64.
fn inverse<const N: usize>(m: &SMatrix<f64, N, N>) -> Option<SMatrix<f64, N, N>> {
    let (mut left, mut right) = (*m, SMatrix::<f64, N, N>::identity());
    for k in 0..N {
        let mut pivot = k;
        for i in k + 1..N {
            if left[(i, k)].abs() > left[(pivot, k)].abs() {
                pivot = i;
            }
        }
        left.swap_rows(k, pivot);
        right.swap_rows(k, pivot);
        let d = left[(k, k)];
        if d == 0.0 || d.is_nan() {
            return None;
        }
        let scale = 1.0 / d;
        for j in 0..N {
            left[(k, j)] *= scale;
            right[(k, j)] *= scale;
        }
        for i in (0..N).filter(|&i| i != k) {
            let f = left[(i, k)];
            for j in 0..N {
                left[(i, j)] -= f * left[(k, j)];
                right[(i, j)] -= f * right[(k, j)];
            }
        }
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    type Mat3 = SMatrix<f64, 3, 3>;
    type Vec3 = SVector<f64, 3>;

    /// Numbers in [-0.5, 0.5).
    fn numbers() -> impl FnMut() -> f64 {
        let mut seed = 7u64;
        move || {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / (1u64 << 31) as f64 - 0.5
        }
    }

    /// Cofactors lose every digit of this one: found by a drum whose Newton steps went astray.
    #[test]
    fn inverse_of_a_stiff_rank_one_block_keeps_its_digits() {
        let v = Vec3::new(0.6, -0.3, 0.7);
        let m = Mat3::identity() + v * v.transpose() * 1e8;
        // Sherman & Morrison
        let exact = Mat3::identity() - v * v.transpose() * (1e8 / (1.0 + 1e8 * v.norm_squared()));
        // 1e8 cancels against 1 once: 1e8 ulp
        assert!((inverse(&m).unwrap() - exact).amax() < 1e-7);
        assert!(inverse(&Mat3::zeros()).is_none());
    }

    /// A refusal leaves nothing behind, and another matrix may follow.
    #[test]
    fn factors_that_are_too_many_are_refused() {
        let mut random = numbers();
        // six couplings a node, to any other: half of all pairs are filled
        let nodes = 24_000;
        let mut node = || ((random() + 0.5) * f64::from(nodes)) as u32;
        let mut pairs: Vec<(u32, u32)> = (0..3 * nodes)
            .map(|_| (node(), node()))
            .map(|(a, b)| (a.min(b), a.max(b)))
            .filter(|(a, b)| a < b)
            .collect();
        pairs.sort_unstable();
        pairs.dedup();
        let mut sparse = BlockLdu::<2>::default();
        assert_eq!(sparse.prepare(nodes as usize, &pairs), Err(TooMuchFill));
        let pairs = [(0, 1), (0, 2), (1, 2)];
        assert_eq!(sparse.prepare(3, &pairs), Ok(true));
        sparse.clear();
        for a in 0..3 {
            sparse.add_diagonal(a, &SMatrix::identity());
        }
        assert!(sparse.factorise() && sparse.is_positive());
        // a symmetric matrix with one negative pivot
        sparse.clear();
        for a in 0..3 {
            sparse.add_diagonal(a, &SMatrix::identity());
        }
        let two = SMatrix::from_diagonal_element(2.0);
        sparse.add_coupling(sparse.place(2, 0), &two, &two);
        assert!(sparse.factorise() && !sparse.is_positive());
    }

    /// Against nalgebra's dense LU on random graphs, nonsymmetric values.
    #[test]
    fn agrees_with_a_dense_factorisation() {
        let mut random = numbers();
        let mut sparse = BlockLdu::default();
        for size in [1usize, 2, 5, 17, 40] {
            let mut pairs = Vec::new();
            for a in 0..size as u32 {
                for b in a + 1..size as u32 {
                    if b == a + 1 || random() > 0.42 {
                        pairs.push((a, b));
                    }
                }
            }
            assert_eq!(sparse.prepare(size, &pairs), Ok(true));
            assert_eq!(
                sparse.prepare(size, &pairs),
                Ok(false),
                "symbolic phase is kept"
            );
            sparse.clear();
            let mut dense = DMatrix::zeros(3 * size, 3 * size);
            let mut put = |a: usize, b: usize, m: Mat3| {
                let mut view = dense.fixed_view_mut::<3, 3>(3 * a, 3 * b);
                view += m;
            };
            for a in 0..size {
                let m = Mat3::from_fn(|_, _| random()) + Mat3::identity() * (size as f64);
                sparse.add_diagonal(a, &m);
                put(a, a, m);
            }
            for &(a, b) in &pairs {
                let (a, b) = (a as usize, b as usize);
                let ab = Mat3::from_fn(|_, _| random());
                let ba = Mat3::from_fn(|_, _| random());
                sparse.add_coupling(sparse.place(a, b), &ab, &ba);
                put(a, b, ab);
                put(b, a, ba);
            }
            let rhs = DVector::from_fn(3 * size, |_, _| random());
            let expected = dense.lu().solve(&rhs).unwrap();
            let mut x: Vec<Vec3> = (0..size)
                .map(|a| rhs.fixed_rows::<3>(3 * a).into_owned())
                .collect();
            assert!(sparse.factorise());
            sparse.solve(&mut x);
            for (a, x) in x.iter().enumerate() {
                // well conditioned by construction: a few hundred ulp
                assert!((x - expected.fixed_rows::<3>(3 * a)).norm() < 1e-12);
            }
        }
    }
}
