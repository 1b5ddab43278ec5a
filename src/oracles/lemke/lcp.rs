use super::infeasible::certificate;
use super::pivot::{PathEnd, Tableau};
use super::{restart, tree};
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
    /// Whether a proof, other paths and a tree follow a ray, see [`solve_lcp`].
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

/// How [`solve_lcp`] ended. Failure to solve is an outcome, not an error.
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
    /// `y` of [`proves_infeasible`], scaled to a largest number of 1; with
    /// [`LcpStatus::Infeasible`] only.
    ///
    /// [`proves_infeasible`]: super::proves_infeasible
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

/// Linear complementarity problem by Lemke's method with lexicographic ties.
///
/// ```text
/// find z ≥ 0 with w = M z + q ≥ 0 and zᵀ w = 0                               (1)
/// ```
///
/// The path follows `w = M z + q + z₀ (1, …, 1)` from `z₀ = −min q` down to `z₀ = 0`. Ties in the
/// ratio test go to the lexicographically least row of `[q, B⁻¹]`, so degenerate problems do not
/// cycle. The last basis is solved again from the original data.
///
/// # After a ray
/// After a ray, or a basis spoilt by round-off, these follow, up to the first that succeeds, all on
/// rows and columns scaled to like size:
/// 1. up to n = 500 a linear programme for a proof that (1) has no `z ≥ 0` with `w ≥ 0`, see
///    [`proves_infeasible`](super::proves_infeasible);
/// 2. paths from `z = 0` with the covering vectors 1, i/n, 1 − (i − 1)/n and `max(−q, 0)`;
/// 3. paths from other complementary bases: principal pivots on every `M_ii`, then on every block
///    of rows and columns i < j, each nonsingular; from each with the unit vectors of the block, as
///    far as they cover (Lemke & Howson's start in a bimatrix game), then with 1;
/// 4. up to n = 40 a tree: a linear programme of `z, w ≥ 0` decides at each node which `z_i` or
///    `w_i` is set to 0 next; up to 2000 nodes.
///
/// # Arguments
/// - `matrix`: `M`, n × n, any. Rows and columns should be of like size: on the first path only a
///   common factor of `M` and one of `q` is scaled away.
/// - `q`: n.
///
/// # Returns
/// See [`LcpSolution`]. The work is O(n²) a pivot.
///
/// # Errors
/// [`LcpError::Shape`] unless `M` is n × n and `q` has length n; [`LcpError::NonFinite`].
///
/// # Source
/// Lemke (1965); Lemke & Howson (1964); Cottle, Pang & Stone, *The Linear Complementarity Problem*
/// (1992), §2.3, §4.4 and §4.9; the tree: Al-Khayyal, *An implicit enumeration procedure for the
/// general linear complementarity problem*, Math. Program. Study 31 (1987).
pub fn solve_lcp(
    matrix: &DMatrix<f64>,
    q: &DVector<f64>,
    options: &LcpOptions,
) -> Result<LcpSolution, LcpError> {
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
        return Ok(LcpSolution {
            z: DVector::zeros(n),
            w: q.clone(),
            status: LcpStatus::Solved,
            pivots: 0,
            paths: 0,
            programmes: 0,
            exhausted: false,
            residual: 0.0,
            certificate: None,
        });
    }
    let mean = mean_diagonal(matrix);
    let scaled = (matrix / mean).map(representable);
    let mut search = Search::new(scaled, (q / depth).map(representable), *options);
    let tableau = Tableau::new(&search.matrix, &search.free, options.pivot_tolerance);
    let end = search.follow(tableau, options.max_pivots);
    let mut status = match end {
        PathEnd::Complementary if search.solved() => LcpStatus::Solved,
        PathEnd::Complementary => LcpStatus::Inaccurate,
        PathEnd::Ray => LcpStatus::Ray,
        PathEnd::Limit => LcpStatus::PivotLimit,
    };
    let (mut proof, mut exhausted) = (None, false);
    if options.fallbacks && matches!(status, LcpStatus::Ray | LcpStatus::Inaccurate) {
        let balanced = restart::Balanced::new(&search);
        // a ray may start from a point that is good enough; the other paths may have a better one
        if !search.solved() {
            proof = certificate(matrix, q, &balanced, &mut search.programmes);
        }
        if proof.is_some() {
            status = LcpStatus::Infeasible;
        } else {
            restart::other_paths(&mut search, &balanced);
            if !search.solved() {
                exhausted = tree::enumerate(&mut search, &balanced);
            }
            if search.solved() {
                status = LcpStatus::Solved;
                exhausted = false;
            }
        }
    }
    let best = search.best;
    let z = (best.z * representable(depth / mean)).map(representable);
    let w = (best.w * depth).map(representable);
    Ok(LcpSolution {
        z,
        w,
        status,
        pivots: search.pivots,
        paths: search.paths,
        programmes: search.programmes,
        exhausted,
        residual: best.residual,
        certificate: proof,
    })
}

/// The scaled problem, the best point so far and the work so far.
pub(super) struct Search {
    pub(super) matrix: DMatrix<f64>,
    pub(super) free: DVector<f64>,
    pub(super) options: LcpOptions,
    best: Candidate,
    pub(super) pivots: usize,
    /// Number of singular starting bases.
    pub(super) refused: usize,
    paths: usize,
    pub(super) programmes: usize,
}

impl Search {
    fn new(matrix: DMatrix<f64>, free: DVector<f64>, options: LcpOptions) -> Self {
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
        }
    }

    /// Whether the best point is a solution.
    pub(super) fn solved(&self) -> bool {
        self.best.residual <= self.options.tolerance
    }

    /// The work that counts against [`LcpOptions::max_pivots`]: each unit is O(n²).
    pub(super) fn spent(&self) -> usize {
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

    /// Counts a path from a scaled copy, and offers its end `z` (unscaled) if it is complementary.
    pub(super) fn followed(
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

    /// Stores `z` if it is better than the best so far.
    pub(super) fn offer(&mut self, z: DVector<f64>) {
        let candidate = Candidate::new(&self.matrix, &self.free, z);
        if candidate.residual <= self.best.residual {
            self.best = candidate;
        }
    }

    /// Computes the `z` of a basis from the data and stores it if it is better.
    pub(super) fn offer_basis(&mut self, support: &[usize]) {
        if let Some(z) = solve_basis(&self.matrix, &self.free, support) {
            self.offer(z);
        }
    }
}

/// How far `z` is from solving the problem (1) of [`solve_lcp`], from the data alone.
///
/// # Returns
/// `max_i |min(m z_i, w_i)| / max(max_i(−q_i), m max_i z_i)`, no unit, with `w = M z + q` and `m`
/// the mean of `|M_ii|`; 0 where no `min` differs from 0, NaN where a number is.
pub fn complementarity_residual(matrix: &DMatrix<f64>, q: &DVector<f64>, z: &DVector<f64>) -> f64 {
    let mean = mean_diagonal(matrix);
    let w = matrix * z + q;
    // `min` and `max` drop NaN; NaN in z gives NaN in w, except for columns of zeros
    if w.iter().chain(z.iter()).any(|x| x.is_nan()) {
        return f64::NAN;
    }
    let (mut worst, mut scale) = (0.0f64, 0.0f64);
    for i in 0..q.len() {
        let impulse = mean * z[i];
        worst = worst.max(impulse.min(w[i]).abs());
        scale = scale.max(-q[i]).max(impulse);
    }
    if worst == 0.0 { 0.0 } else { worst / scale }
}

fn mean_diagonal(matrix: &DMatrix<f64>) -> f64 {
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
fn solve_basis(
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

#[cfg(test)]
#[path = "lcp_tests.rs"]
mod tests;
