use super::pivot::{PathEnd, Tableau};
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

/// Limits and tolerances of a solve of a linear complementarity problem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LcpOptions {
    /// Smallest accepted pivot, after scaling the mean of `|M_ii|` to 1; no unit.
    pub pivot_tolerance: f64,
    /// Most pivots of the first path, and of all paths after a ray together, singular starts
    /// included; the method is exponential in the worst case.
    pub max_pivots: usize,
    /// Solved means [`LcpSolution::residual`] ≤ this; no unit.
    pub tolerance: f64,
    /// Whether a ray is followed by other methods, where the caller has any.
    pub fallbacks: bool,
}

impl Default for LcpOptions {
    fn default() -> Self {
        LcpOptions {
            pivot_tolerance: 1e-8,
            max_pivots: 5000,
            tolerance: 1e-9,
            fallbacks: true,
        }
    }
}

/// How a solve of a linear complementarity problem ended. Not solving is an outcome, not an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LcpStatus {
    /// The residual of the returned `z` is within the tolerance.
    Solved,
    /// A secondary ray, and no fallback found a solution or a proof that there is none. If `M` is
    /// copositive-plus, there is no solution.
    Ray,
    /// There is no `z ≥ 0` with `M z + q ≥ 0`: [`LcpSolution::certificate`] proves it.
    Infeasible,
    /// [`LcpOptions::max_pivots`] ran out.
    PivotLimit,
    /// A complementary basis was found, but round-off leaves its residual above the tolerance.
    Inaccurate,
}

/// The best point found; always finite, `z ≥ 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct LcpSolution {
    /// `z`.
    pub z: DVector<f64>,
    /// `w = M z + q`, computed from the original data.
    pub w: DVector<f64>,
    pub status: LcpStatus,
    /// Pivots of all paths.
    pub pivots: usize,
    /// Number of paths.
    pub paths: usize,
    /// Number of linear programmes: the proof and the nodes of the tree.
    pub programmes: usize,
    /// With [`LcpStatus::Ray`]: whether the tree was searched to its end. Then there is no solution
    /// except by round-off, but this is no proof.
    pub exhausted: bool,
    /// `max_i |min(m z_i, w_i)| / max(max_i(−q_i), m max_i z_i)`, no unit, with `m` the mean of
    /// `|M_ii|`; 0 where `q ≥ 0`.
    pub residual: f64,
    /// `y ≥ 0` with `Mᵀ y ≤ 0` and `qᵀ y < 0`, its largest number 1; with
    /// [`LcpStatus::Infeasible`] only.
    pub certificate: Option<DVector<f64>>,
}

/// Errors of a linear complementarity problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum LcpError {
    /// The matrix is not square, or `q` has another length.
    #[error(
        "complementarity problem: matrix of {rows} x {columns} with q of {free}, must be n x n and n"
    )]
    Shape {
        rows: usize,
        columns: usize,
        free: usize,
    },
    /// Row `row` of the matrix or of `q` has NaN or infinity.
    #[error("complementarity problem: row {row} holds a number that is not finite")]
    NonFinite { row: usize },
}

/// One path of Lemke's method on a linear complementarity problem, with lexicographic ties.
///
/// ```text
/// find z ≥ 0 with w = M z + q ≥ 0 and zᵀ w = 0                               (1)
/// ```
///
/// The path follows `w = M z + q + z₀ (1, …, 1)` from `z₀ = −min q` down to `z₀ = 0`. Ties in the
/// ratio test go to the lexicographically least row of `[q, B⁻¹]`, so degenerate problems do not
/// cycle. The last basis is solved again from the original data.
///
/// # Arguments
/// - `matrix`: `M`, n × n, any, with rows and columns of like size; `q`: n.
///
/// # Returns
/// The search where the path ended; its status says how. The work is O(n²) a pivot.
///
/// # Errors
/// [`LcpError::Shape`] unless `M` is n × n and `q` has length n; [`LcpError::NonFinite`].
///
/// # Source
/// Lemke (1965); Cottle, Pang & Stone, *The Linear Complementarity Problem* (1992), §4.4 and §4.9.
pub(crate) fn first_path(
    matrix: &DMatrix<f64>,
    q: &DVector<f64>,
    options: &LcpOptions,
) -> Result<Search, LcpError> {
    let n = q.len();
    if matrix.nrows() != n || matrix.ncols() != n {
        return Err(LcpError::Shape {
            rows: matrix.nrows(),
            columns: matrix.ncols(),
            free: n,
        });
    }
    let finite = |i: &usize| q[*i].is_finite() && matrix.row(*i).iter().all(|x| x.is_finite());
    if let Some(row) = (0..n).find(|i| !finite(i)) {
        return Err(LcpError::NonFinite { row });
    }
    // Not max |q|: one long bound in q must not hide the rows that determine the path.
    let depth = q.iter().fold(0.0f64, |depth, &x| depth.max(-x));
    if depth == 0.0 {
        let mut search = Search::new(DMatrix::zeros(0, 0), DVector::zeros(0), *options);
        search.best = Candidate {
            z: DVector::zeros(n),
            w: q.clone(),
            residual: 0.0,
        };
        return Ok(search);
    }
    let mean = mean_diagonal(matrix);
    let scaled = (matrix / mean).map(representable);
    let mut search = Search::new(scaled, (q / depth).map(representable), *options);
    (search.depth, search.mean) = (depth, mean);
    let tableau = Tableau::new(&search.matrix, &search.free, options.pivot_tolerance);
    search.status = match search.follow(tableau, options.max_pivots) {
        PathEnd::Complementary if search.solved() => LcpStatus::Solved,
        PathEnd::Complementary => LcpStatus::Inaccurate,
        PathEnd::Ray => LcpStatus::Ray,
        PathEnd::Limit => LcpStatus::PivotLimit,
    };
    Ok(search)
}

/// The scaled problem, the best point so far and the work so far.
pub(crate) struct Search {
    pub(crate) matrix: DMatrix<f64>,
    pub(crate) free: DVector<f64>,
    pub(crate) options: LcpOptions,
    best: Candidate,
    pub(crate) pivots: usize,
    /// Starting bases that were singular.
    pub(crate) refused: usize,
    paths: usize,
    pub(crate) programmes: usize,
    pub(crate) status: LcpStatus,
    /// What `q` and `M` were divided by.
    depth: f64,
    mean: f64,
}

impl Search {
    pub(crate) fn new(matrix: DMatrix<f64>, free: DVector<f64>, options: LcpOptions) -> Self {
        let best = Candidate::new(&matrix, &free, DVector::zeros(free.len()));
        Search {
            matrix,
            free,
            options,
            best,
            pivots: 0,
            refused: 0,
            paths: 0,
            programmes: 0,
            status: LcpStatus::Solved,
            depth: 1.0,
            mean: 1.0,
        }
    }

    /// The best point found, in the scale of the data.
    ///
    /// # Arguments
    /// - `certificate`: the proof that there is no solution, if one was found.
    /// - `exhausted`: whether all bases were searched.
    pub(crate) fn into_solution(
        self,
        certificate: Option<DVector<f64>>,
        exhausted: bool,
    ) -> LcpSolution {
        LcpSolution {
            z: (self.best.z * representable(self.depth / self.mean)).map(representable),
            w: (self.best.w * self.depth).map(representable),
            status: self.status,
            pivots: self.pivots,
            paths: self.paths,
            programmes: self.programmes,
            exhausted,
            residual: self.best.residual,
            certificate,
        }
    }

    /// Whether the best point is a solution.
    pub(crate) fn solved(&self) -> bool {
        self.best.residual <= self.options.tolerance
    }

    /// What counts against [`LcpOptions::max_pivots`]: each is O(n²).
    pub(crate) fn spent(&self) -> usize {
        self.pivots + self.refused
    }

    /// Runs a path of the unscaled problem and offers its end.
    fn follow(&mut self, mut tableau: Tableau, max_pivots: usize) -> PathEnd {
        let end = tableau.run(max_pivots);
        self.pivots += tableau.pivots;
        self.paths += 1;
        // where the path ends otherwise, its last point is no worse than another
        self.best = Candidate::new(&self.matrix, &self.free, tableau.z());
        if end == PathEnd::Complementary {
            self.offer_basis(&tableau.support());
        }
        end
    }

    /// Counts a path from a scaled copy, and offers its end, `z` here, if that is complementary.
    pub(crate) fn followed(
        &mut self,
        end: PathEnd,
        pivots: usize,
        z: DVector<f64>,
        basis: &[usize],
    ) {
        self.pivots += pivots;
        self.paths += 1;
        if end == PathEnd::Complementary {
            self.offer(z);
            self.offer_basis(basis);
        }
    }

    /// Keeps `z` if it is better than the best so far.
    pub(crate) fn offer(&mut self, z: DVector<f64>) {
        let candidate = Candidate::new(&self.matrix, &self.free, z);
        if candidate.residual <= self.best.residual {
            self.best = candidate;
        }
    }

    /// Solves for the `z` of a basis from the data and keeps them if they are better.
    pub(crate) fn offer_basis(&mut self, support: &[usize]) {
        if let Some(z) = solve_basis(&self.matrix, &self.free, support) {
            self.offer(z);
        }
    }
}

pub(crate) fn mean_diagonal(matrix: &DMatrix<f64>) -> f64 {
    let n = matrix.nrows() as f64;
    let mean = matrix.diagonal().iter().map(|x| x.abs() / n).sum::<f64>();
    if mean > 0.0 {
        mean
    } else if matrix.amax() > 0.0 {
        matrix.amax()
    } else {
        1.0
    }
}

/// Replaces numbers beyond the largest finite one by it.
fn representable(x: f64) -> f64 {
    x.clamp(-f64::MAX, f64::MAX)
}

/// A point with its residual, from the scaled data alone.
struct Candidate {
    z: DVector<f64>,
    w: DVector<f64>,
    residual: f64,
}

impl Candidate {
    fn new(matrix: &DMatrix<f64>, free: &DVector<f64>, mut z: DVector<f64>) -> Self {
        z.apply(|x| *x = x.max(0.0));
        let mut w = (matrix * &z + free).map(representable);
        // w may overflow for a bound that is practically infinite; NaN comes from z
        if z.iter().any(|x| !x.is_finite()) || w.iter().any(|x| x.is_nan()) {
            z.fill(0.0);
            w.copy_from(free);
        }
        let worst = z.iter().zip(w.iter()).fold(0.0f64, |worst, (z, w)| {
            let gap = z.min(*w).abs();
            if gap > worst { gap } else { worst }
        });
        let residual = worst / z.amax().max(1.0);
        Candidate { z, w, residual }
    }
}

/// `z` with `M_αα z_α = −q_α` on the support α, 0 elsewhere; one step of iterative refinement.
pub(crate) fn solve_basis(
    matrix: &DMatrix<f64>,
    free: &DVector<f64>,
    support: &[usize],
) -> Option<DVector<f64>> {
    let mut z = DVector::zeros(free.len());
    if support.is_empty() {
        return Some(z);
    }
    let block = matrix.select_rows(support).select_columns(support);
    let lu = block.clone().lu();
    let rhs = -free.select_rows(support);
    let first = lu.solve(&rhs)?;
    let correction = lu.solve(&(&rhs - &block * &first))?;
    for (k, &i) in support.iter().enumerate() {
        z[i] = (first[k] + correction[k]).max(0.0);
    }
    Some(z)
}
