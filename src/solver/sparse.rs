//! Block sparse LDU factorisation over the graph of bodies, 3 × 3 blocks.

use nalgebra::Matrix3;

use crate::contact::Vec3;

type Mat3 = Matrix3<f64>;

/// Place of a coupling in a [`BlockLdu`].
#[derive(Debug, Clone, Copy)]
pub struct Place {
    entry: usize,
    /// Whether the first node is eliminated after the second, so that `K_ab` is in the lower part.
    first_is_row: bool,
}

/// A square matrix of 3 × 3 blocks with a symmetric pattern, and its factors in place.
///
/// ```text
/// K = L D U,   L unit lower, U unit upper, D block diagonal                  (1)
/// ```
///
/// The values need not be symmetric: sliding contacts make them so. The symbolic phase (an
/// approximate minimum degree ordering and the fill) is kept until the set of coupled pairs
/// changes.
///
/// # Source
/// Duff, Erisman & Reid, *Direct Methods for Sparse Matrices* (2017), ch. 10; the ordering is
/// Amestoy, Davis & Duff (1996), crate `amd`.
#[derive(Debug, Clone, Default)]
pub struct BlockLdu {
    size: usize,
    pairs: Vec<(u32, u32)>,
    /// Elimination position of each node, and the reverse.
    position: Vec<usize>,
    node: Vec<usize>,
    /// Column k holds entries `start\[k\]..start[k + 1]`, their rows `row` ascending.
    start: Vec<usize>,
    row: Vec<usize>,
    /// For column k: the entry that each update (a, b), a < b, of its structure lands on.
    target: Vec<usize>,
    target_start: Vec<usize>,
    diagonal: Vec<Mat3>,
    lower: Vec<Mat3>,
    upper: Vec<Mat3>,
    work: Vec<Vec3>,
}

impl BlockLdu {
    /// Prepares a matrix of `size` nodes coupled by `pairs` (each `a < b`, sorted, unique).
    ///
    /// Returns whether the symbolic phase had to be done again.
    pub fn prepare(&mut self, size: usize, pairs: &[(u32, u32)]) -> bool {
        let changed = self.size != size || self.pairs != pairs;
        if changed {
            self.size = size;
            self.pairs.clear();
            self.pairs.extend_from_slice(pairs);
            self.analyse();
        }
        changed
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        for values in [&mut self.diagonal, &mut self.lower, &mut self.upper] {
            values.fill(Mat3::zeros());
        }
    }

    fn analyse(&mut self) {
        let n = self.size;
        let mut neighbours = vec![Vec::new(); n];
        for &(a, b) in &self.pairs {
            neighbours[a as usize].push(b as usize);
            neighbours[b as usize].push(a as usize);
        }
        self.node = minimum_degree(&neighbours);
        self.position = vec![0; n];
        for (k, &v) in self.node.iter().enumerate() {
            self.position[v] = k;
        }
        // fill: the structure of a column is its own neighbours and what its children pass on
        let mut structure: Vec<Vec<usize>> = vec![Vec::new(); n];
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); n];
        for k in 0..n {
            let mut rows: Vec<usize> = neighbours[self.node[k]]
                .iter()
                .map(|&v| self.position[v])
                .filter(|&p| p > k)
                .collect();
            for &child in &children[k] {
                rows.extend(structure[child].iter().filter(|&&p| p > k));
            }
            rows.sort_unstable();
            rows.dedup();
            if let Some(&parent) = rows.first() {
                children[parent].push(k);
            }
            structure[k] = rows;
        }
        self.start.clear();
        self.row.clear();
        self.start.push(0);
        for rows in &structure {
            self.row.extend_from_slice(rows);
            self.start.push(self.row.len());
        }
        self.target.clear();
        self.target_start.clear();
        for rows in &structure {
            self.target_start.push(self.target.len());
            for (x, &a) in rows.iter().enumerate() {
                for &b in &rows[x + 1..] {
                    let column = &self.row[self.start[a]..self.start[a + 1]];
                    // fill guarantees the entry; a missing one would be a bug of `analyse`
                    let offset = column.partition_point(|&r| r < b);
                    self.target.push(self.start[a] + offset);
                }
            }
        }
        self.diagonal = vec![Mat3::zeros(); n];
        self.lower = vec![Mat3::zeros(); self.row.len()];
        self.upper = vec![Mat3::zeros(); self.row.len()];
        self.work = vec![Vec3::zeros(); n];
    }

    /// `K_aa += m` for node `a`.
    pub fn add_diagonal(&mut self, a: usize, m: &Mat3) {
        self.diagonal[self.position[a]] += m;
    }

    /// Where the blocks of two different nodes of a declared pair lie.
    pub fn place(&self, a: usize, b: usize) -> Place {
        let (i, j) = (self.position[a], self.position[b]);
        let (column, row) = (i.min(j), i.max(j));
        let rows = &self.row[self.start[column]..self.start[column + 1]];
        Place {
            entry: self.start[column] + rows.partition_point(|&r| r < row),
            first_is_row: i > j,
        }
    }

    /// `K_ab += ab`, `K_ba += ba` for the nodes (a, b) of `place`.
    pub fn add_coupling(&mut self, place: Place, ab: &Mat3, ba: &Mat3) {
        let (lower, upper) = if place.first_is_row {
            (ab, ba)
        } else {
            (ba, ab)
        };
        self.lower[place.entry] += lower;
        self.upper[place.entry] += upper;
    }

    /// Factorises in place. `false` if a pivot block is singular.
    pub fn factorise(&mut self) -> bool {
        for k in 0..self.size {
            let Some(inverse) = inverse(&self.diagonal[k]) else {
                return false;
            };
            self.diagonal[k] = inverse;
            let (from, to) = (self.start[k], self.start[k + 1]);
            let mut target = self.target_start[k];
            for a in from..to {
                let lower = self.lower[a] * inverse;
                let i = self.row[a];
                self.diagonal[i] -= lower * self.upper[a];
                self.lower[a] = lower;
            }
            for a in from..to {
                for b in a + 1..to {
                    // entry (row b, column a) below the diagonal, (row a, column b) above it
                    let entry = self.target[target];
                    target += 1;
                    let (la, lb) = (self.lower[a], self.lower[b]);
                    let (ua, ub) = (self.upper[a], self.upper[b]);
                    self.lower[entry] -= lb * ua;
                    self.upper[entry] -= la * ub;
                }
            }
        }
        true
    }

    /// Solves `K x = rhs` in place, one vector a node.
    pub fn solve(&mut self, rhs: &mut [Vec3]) {
        for (k, &v) in self.node.iter().enumerate() {
            self.work[k] = rhs[v];
        }
        for k in 0..self.size {
            let y = self.work[k];
            for a in self.start[k]..self.start[k + 1] {
                let i = self.row[a];
                self.work[i] -= self.lower[a] * y;
            }
        }
        for k in (0..self.size).rev() {
            let mut y = self.work[k];
            for a in self.start[k]..self.start[k + 1] {
                y -= self.upper[a] * self.work[self.row[a]];
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
fn inverse(m: &Mat3) -> Option<Mat3> {
    let (mut left, mut right) = (*m, Mat3::identity());
    for k in 0..3 {
        let mut pivot = k;
        for i in k + 1..3 {
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
        for j in 0..3 {
            left[(k, j)] *= scale;
            right[(k, j)] *= scale;
        }
        for i in (0..3).filter(|&i| i != k) {
            let f = left[(i, k)];
            for j in 0..3 {
                left[(i, j)] -= f * left[(k, j)];
                right[(i, j)] -= f * right[(k, j)];
            }
        }
    }
    Some(right)
}

/// Approximate minimum degree ordering; the natural order should the ordering refuse the graph.
fn minimum_degree(neighbours: &[Vec<usize>]) -> Vec<usize> {
    let n = neighbours.len();
    let mut start = vec![0isize];
    let mut index = Vec::new();
    for (v, list) in neighbours.iter().enumerate() {
        let mut rows: Vec<isize> = list.iter().map(|&w| w as isize).collect();
        rows.push(v as isize);
        rows.sort_unstable();
        index.extend(rows);
        start.push(index.len() as isize);
    }
    match amd::order(n as isize, &start, &index, &amd::Control::default()) {
        Ok((order, _, _)) => order.into_iter().map(|v| v as usize).collect(),
        Err(_) => (0..n).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

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

    /// Against nalgebra's dense LU on random graphs, nonsymmetric values.
    #[test]
    fn agrees_with_a_dense_factorisation() {
        let mut seed = 7u64;
        let mut random = move || {
            seed = seed
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (seed >> 33) as f64 / (1u64 << 31) as f64 - 0.5
        };
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
            assert!(sparse.prepare(size, &pairs));
            assert!(!sparse.prepare(size, &pairs), "symbolic phase is kept");
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
