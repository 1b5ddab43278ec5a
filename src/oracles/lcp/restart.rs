use crate::solver::lemke::Search;
use crate::solver::lemke::Tableau;
use nalgebra::{DMatrix, DVector};

/// The problem with rows and columns scaled to like size, exactly, as by powers of two: `M' = D M
/// E`, `q' = D q / depth`, `z = depth E z'`. It has the solutions of the original.
pub(super) struct Balanced {
    pub(super) matrix: DMatrix<f64>,
    pub(super) free: DVector<f64>,
    /// Diagonal of `D`.
    pub(super) rows: DVector<f64>,
    /// Diagonal of `E`, times the depth.
    columns: DVector<f64>,
}

/// Passes of Ruiz's scaling: each halves the distance of all sizes from 1, in digits.
const PASSES: usize = 8;

impl Balanced {
    pub(super) fn new(search: &Search) -> Self {
        let n = search.free.len();
        let mut matrix = search.matrix.clone();
        let (mut rows, mut columns) = (DVector::repeat(n, 1.0), DVector::repeat(n, 1.0));
        for _ in 0..PASSES {
            let row: Vec<f64> = (0..n).map(|i| factor(matrix.row(i).amax())).collect();
            let column: Vec<f64> = (0..n).map(|j| factor(matrix.column(j).amax())).collect();
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                matrix[(i, j)] *= row[i] * column[j];
            }
            for i in 0..n {
                rows[i] *= row[i];
                columns[i] *= column[i];
            }
        }
        let mut free = search.free.component_mul(&rows);
        let depth = free.iter().fold(0.0f64, |depth, &x| depth.max(-x));
        if depth > 0.0 {
            free /= depth;
            columns *= depth;
        }
        Balanced {
            matrix,
            free,
            rows,
            columns,
        }
    }

    /// Whether all scaled numbers are finite.
    pub(super) fn finite(&self) -> bool {
        let parts = [&self.free, &self.rows, &self.columns];
        let mut numbers = parts.into_iter().flat_map(|x| x.iter());
        numbers.all(|x| x.is_finite()) && self.matrix.iter().all(|x| x.is_finite())
    }

    /// `z` of the unscaled problem.
    pub(super) fn unscaled(&self, z: &DVector<f64>) -> DVector<f64> {
        z.component_mul(&self.columns)
    }
}

/// The power of two nearest to `1/√size`; 1 for sizes of 0 or out of range.
fn factor(size: f64) -> f64 {
    if size > 0.0 && size.is_finite() {
        (-0.5 * size.log2()).round().exp2()
    } else {
        1.0
    }
}

/// Most pivots of a further path per row: a path that ends well needs few per row.
const PIVOTS_A_ROW: usize = 10;

/// The paths of the second and third of the fallbacks of `solve_lcp`, until a solution or until
/// they have spent `max_pivots`; a singular block counts as one pivot, for the copy of the tableau.
pub(super) fn other_paths(search: &mut Search, balanced: &Balanced) {
    if !balanced.finite() {
        return;
    }
    let n = balanced.free.len();
    let mut paths = Paths {
        limit: search.spent() + search.options.max_pivots,
        search,
        balanced,
    };
    let tolerance = paths.search.options.pivot_tolerance;
    let start = Tableau::new(&balanced.matrix, &balanced.free, tolerance);
    let share = |i: usize| (i + 1) as f64 / n as f64;
    let coverings: [&dyn Fn(usize) -> f64; 4] = [&|_| 1.0, &share, &|i| share(n - 1 - i), &|i| {
        (-balanced.free[i]).max(0.0)
    }];
    for covering in coverings {
        let mut tableau = start.clone();
        tableau.cover(covering);
        if paths.done(tableau) {
            return;
        }
    }
    let singles = (0..n).map(|i| vec![i]);
    let pairs = (0..n).flat_map(|j| (0..j).map(move |i| vec![i, j]));
    for block in singles.chain(pairs) {
        let mut tableau = start.clone();
        let regular = tableau.swap(&block);
        paths.search.pivots += std::mem::take(&mut tableau.pivots);
        paths.search.refused += usize::from(!regular);
        if paths.spent() {
            return;
        }
        if !regular {
            continue;
        }
        if tableau.feasible() {
            let z = balanced.unscaled(&tableau.z());
            paths.search.offer(z);
            paths.search.offer_basis(&tableau.support());
            if paths.search.solved() {
                return;
            }
            continue;
        }
        for &k in &block {
            let mut unit = tableau.clone();
            if unit.cover_by(k) && paths.done(unit) {
                return;
            }
        }
        if paths.done(tableau) {
            return;
        }
    }
}

struct Paths<'a> {
    search: &'a mut Search,
    balanced: &'a Balanced,
    /// Limit of [`Search::spent`].
    limit: usize,
}

impl Paths<'_> {
    fn spent(&self) -> bool {
        self.search.spent() >= self.limit
    }

    /// Runs a path; `true` if the search is over.
    fn done(&mut self, mut tableau: Tableau) -> bool {
        let n = self.balanced.free.len();
        let left = self.limit.saturating_sub(self.search.spent());
        let end = tableau.run(left.min(PIVOTS_A_ROW * (n + PIVOTS_A_ROW)));
        let z = self.balanced.unscaled(&tableau.z());
        let (pivots, basis) = (tableau.pivots, tableau.support());
        self.search.followed(end, pivots, z, &basis);
        self.search.solved() || self.spent()
    }
}
