//! Block sparse LDU factorisation with N × N blocks: N = 3 for bodies, N = 2 for contacts.

use super::columns::Columns;
use super::fill::{Place, TooMuchFill};
use super::frontal::Frontal;
use super::ordering::{Graph, minimum_degree};
use nalgebra::{SMatrix, SVector};

/// Block products of a symmetric factorisation above which fronts are used. At 7 000 (a heap of
/// 200) fronts are faster with symmetric values, but not yet with others.
const MANY: usize = 10_000;

/// A square matrix of N × N blocks with a symmetric pattern, factorised in place.
///
/// ```text
/// K = L D U,   L unit lower, U unit upper, D block diagonal                  (1)
/// ```
///
/// The values need not be symmetric: those of sliding contacts are not. The symbolic factorisation
/// (an approximate minimum degree ordering and the fill) is reused until the set of coupled pairs
/// changes. Pivoting is only within a block.
///
/// # Source
/// Duff, Erisman & Reid, *Direct Methods for Sparse Matrices* (2017), ch. 10 to 12; the ordering
/// is Amestoy, Davis & Duff (1996), crate `amd`.
#[derive(Debug, Clone, Default)]
pub struct BlockLdu<const N: usize> {
    size: usize,
    pairs: Vec<(u32, u32)>,
    factors: Factors<N>,
}

#[derive(Debug, Clone)]
enum Factors<const N: usize> {
    Columns(Columns<N>),
    Fronts(Frontal<N>),
}

impl<const N: usize> Default for Factors<N> {
    fn default() -> Self {
        Factors::Columns(Columns::default())
    }
}

impl<const N: usize> BlockLdu<N> {
    /// Prepares a matrix of `size` nodes coupled by `pairs` (each `a < b`, sorted, unique).
    ///
    /// Returns whether the symbolic factorisation was done anew.
    ///
    /// # Errors
    /// [`TooMuchFill`]; the matrix is then empty.
    pub fn prepare(&mut self, size: usize, pairs: &[(u32, u32)]) -> Result<bool, TooMuchFill> {
        self.prepare_for(size, pairs, MANY)
    }

    /// Like `prepare`, with fronts from this number of block products on.
    fn prepare_for(
        &mut self,
        size: usize,
        pairs: &[(u32, u32)],
        many: usize,
    ) -> Result<bool, TooMuchFill> {
        let changed = self.size != size || self.pairs != pairs;
        if changed {
            if let Err(error) = self.analyse(size, pairs, many) {
                *self = BlockLdu::default();
                return Err(error);
            }
            self.size = size;
            self.pairs.clear();
            self.pairs.extend_from_slice(pairs);
        }
        Ok(changed)
    }

    fn analyse(&mut self, n: usize, pairs: &[(u32, u32)], many: usize) -> Result<(), TooMuchFill> {
        let graph = Graph::new(n, pairs);
        let (order, products) = minimum_degree(&graph);
        if products >= many {
            let mut frontal = match std::mem::take(&mut self.factors) {
                Factors::Fronts(frontal) => frontal,
                Factors::Columns(_) => Frontal::default(),
            };
            if frontal.analyse(&graph, &order) {
                self.factors = Factors::Fronts(frontal);
                return Ok(());
            }
        }
        let mut columns = match std::mem::take(&mut self.factors) {
            Factors::Columns(columns) => columns,
            Factors::Fronts(_) => Columns::default(),
        };
        let done = columns.analyse(&graph, order);
        self.factors = Factors::Columns(columns);
        done
    }

    /// Sets every entry to zero. For a `symmetric` matrix only one factor may be computed.
    pub fn clear(&mut self, symmetric: bool) {
        match &mut self.factors {
            Factors::Columns(columns) => columns.clear(symmetric),
            Factors::Fronts(frontal) => frontal.clear(symmetric),
        }
    }

    /// `K_aa += m` for node `a`.
    #[inline(always)]
    pub fn add_diagonal(&mut self, a: usize, m: &SMatrix<f64, N, N>) {
        match &mut self.factors {
            Factors::Columns(columns) => columns.add_diagonal(a, m),
            Factors::Fronts(frontal) => frontal.add_diagonal(a, m),
        }
    }

    /// Position of `K_ab`, for two different nodes of a declared pair.
    pub fn place(&self, a: usize, b: usize) -> Place {
        match &self.factors {
            Factors::Columns(columns) => columns.place(a, b),
            Factors::Fronts(frontal) => frontal.place(a, b),
        }
    }

    /// `K_ab += m` at the position of (a, b).
    #[inline(always)]
    pub fn add(&mut self, place: Place, m: &SMatrix<f64, N, N>) {
        match &mut self.factors {
            Factors::Columns(columns) => columns.add(place, m),
            Factors::Fronts(frontal) => frontal.add(place, m),
        }
    }

    /// `K_ab += ab`, `K_ba += ba` at the position of (a, b).
    #[inline(always)]
    pub fn add_coupling(&mut self, place: Place, ab: &SMatrix<f64, N, N>, ba: &SMatrix<f64, N, N>) {
        let mirror = Place {
            below: !place.below,
            ..place
        };
        match &mut self.factors {
            Factors::Columns(columns) => {
                columns.add(place, ab);
                columns.add(mirror, ba);
            }
            Factors::Fronts(frontal) => {
                frontal.add(place, ab);
                frontal.add(mirror, ba);
            }
        }
    }

    /// Factorises in place. Returns `false` if a pivot block is singular.
    pub fn factorise(&mut self) -> bool {
        match &mut self.factors {
            Factors::Columns(columns) => columns.factorise(),
            Factors::Fronts(frontal) => frontal.factorise(),
        }
    }

    /// Whether the matrix is positive definite, that is if all its pivots are. It must have been
    /// cleared as symmetric and factorised.
    #[allow(dead_code)] // asked by readers of stored problems only
    pub fn is_positive(&self) -> bool {
        match &self.factors {
            Factors::Columns(columns) => columns.is_positive(),
            Factors::Fronts(frontal) => frontal.is_positive(),
        }
    }

    /// Solves `K x = rhs` in place, with one vector per node.
    pub fn solve(&mut self, rhs: &mut [SVector<f64, N>]) {
        match &mut self.factors {
            Factors::Columns(columns) => columns.solve(rhs),
            Factors::Fronts(frontal) => frontal.solve(rhs),
        }
    }
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

    /// A rejected matrix leaves no data behind; another one can follow.
    #[test]
    fn factors_that_are_too_many_are_refused() {
        let mut random = numbers();
        // six couplings per node to random nodes: half of all pairs are filled
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
        sparse.clear(true);
        for a in 0..3 {
            sparse.add_diagonal(a, &SMatrix::identity());
        }
        assert!(sparse.factorise());
    }

    /// The identity is positive definite. With one coupling larger than its diagonal it is not.
    #[test]
    fn a_negative_pivot_is_seen() {
        for many in [usize::MAX, 0] {
            let mut sparse = BlockLdu::<2>::default();
            (sparse.prepare_for(3, &[(0, 1), (0, 2), (1, 2)], many)).unwrap();
            for (coupling, positive) in [(0.0, true), (2.0, false)] {
                sparse.clear(true);
                for a in 0..3 {
                    sparse.add_diagonal(a, &SMatrix::identity());
                }
                let m = SMatrix::from_diagonal_element(coupling);
                sparse.add_coupling(sparse.place(2, 0), &m, &m);
                assert!(sparse.factorise());
                assert_eq!(sparse.is_positive(), positive);
            }
        }
    }

    /// A random matrix over a graph, sparse and dense, symmetric if requested.
    fn random(
        sparse: &mut BlockLdu<3>,
        (size, pairs): (usize, &[(u32, u32)]),
        symmetric: bool,
        random: &mut impl FnMut() -> f64,
    ) -> DMatrix<f64> {
        sparse.clear(symmetric);
        let mut dense = DMatrix::zeros(3 * size, 3 * size);
        let mut put = |a: usize, b: usize, m: Mat3| {
            let mut view = dense.fixed_view_mut::<3, 3>(3 * a, 3 * b);
            view += m;
        };
        for a in 0..size {
            let mut m = Mat3::from_fn(|_, _| random());
            if symmetric {
                m += m.transpose();
            }
            m += Mat3::identity() * (size as f64);
            sparse.add_diagonal(a, &m);
            put(a, a, m);
        }
        for &(a, b) in pairs {
            let (a, b) = (a as usize, b as usize);
            let ab = Mat3::from_fn(|_, _| random());
            let ba = if symmetric {
                ab.transpose()
            } else {
                Mat3::from_fn(|_, _| random())
            };
            sparse.add_coupling(sparse.place(a, b), &ab, &ba);
            put(a, b, ab);
            put(b, a, ba);
        }
        dense
    }

    /// Graphs of all shapes: one node, no couplings, all couplings, a chain, a star from either
    /// end, a grid, two components, and random ones.
    fn graphs() -> Vec<(usize, Vec<(u32, u32)>)> {
        let mut random = numbers();
        let full = |n: u32| (0..n).flat_map(move |a| (a + 1..n).map(move |b| (a, b)));
        let mut graphs = vec![
            (1, vec![]),
            (7, vec![]),
            (2, vec![(0, 1)]),
            (40, full(40).collect()),
            (30, (0..29).map(|a| (a, a + 1)).collect()),
            (30, (1..30).map(|b| (0, b)).collect()),
            (30, (0..29).map(|a| (a, 29)).collect()),
            (31, full(13).chain([(20, 21), (20, 25), (21, 30)]).collect()),
        ];
        let mut grid: Vec<(u32, u32)> = (0..400u32)
            .flat_map(|a| [(a, a + 1, a % 20 < 19), (a, a + 20, a < 380)])
            .filter_map(|(a, b, inside)| inside.then_some((a, b)))
            .collect();
        grid.sort_unstable();
        graphs.push((400, grid));
        for size in [5, 17, 40] {
            let pairs = full(size).filter(|(a, b)| *b == a + 1 || random() > 0.42);
            graphs.push((size as usize, pairs.collect()));
        }
        graphs
    }

    /// Compares with nalgebra's dense LU, by columns and by fronts, with symmetric values and
    /// others.
    #[test]
    fn agrees_with_a_dense_factorisation() {
        let mut next = numbers();
        for (size, pairs) in graphs() {
            for (many, symmetric) in [(usize::MAX, false), (0, false), (0, true)] {
                let mut sparse = BlockLdu::default();
                assert_eq!(sparse.prepare_for(size, &pairs, many), Ok(true));
                assert_eq!(
                    sparse.prepare_for(size, &pairs, many),
                    Ok(false),
                    "symbolic phase is kept"
                );
                assert_eq!(matches!(sparse.factors, Factors::Fronts(_)), many == 0);
                // the second time with the buffers of the first
                for _ in 0..2 {
                    let dense = random(&mut sparse, (size, &pairs), symmetric, &mut next);
                    let rhs = DVector::from_fn(3 * size, |_, _| next());
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
    }

    /// A node without a diagonal entry is a zero pivot block, first or last in the order.
    #[test]
    fn a_singular_pivot_is_reported() {
        for (many, symmetric) in [(usize::MAX, false), (0, false), (0, true)] {
            for left_out in 0..3 {
                let mut sparse = BlockLdu::<3>::default();
                sparse.prepare_for(3, &[(0, 1)], many).unwrap();
                sparse.clear(symmetric);
                for a in (0..3).filter(|a| *a != left_out) {
                    sparse.add_diagonal(a, &Mat3::identity());
                }
                assert!(!sparse.factorise());
            }
        }
    }

    /// A pivot block whose first number is zero needs its rows swapped.
    #[test]
    fn rows_of_a_pivot_block_are_swapped() {
        let swap = Mat3::new(0.0, 2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 4.0);
        for many in [usize::MAX, 0] {
            let mut sparse = BlockLdu::<3>::default();
            sparse.prepare_for(2, &[(0, 1)], many).unwrap();
            sparse.clear(false);
            sparse.add_diagonal(0, &swap);
            sparse.add_diagonal(1, &Mat3::identity());
            sparse.add_coupling(sparse.place(0, 1), &Mat3::identity(), &Mat3::zeros());
            assert!(sparse.factorise());
            let mut x = [Vec3::new(3.0, 5.0, 9.0), Vec3::new(1.0, 1.0, 1.0)];
            sparse.solve(&mut x);
            assert_eq!(x, [Vec3::new(4.0, 1.0, 2.0), Vec3::new(1.0, 1.0, 1.0)]);
        }
    }
}
