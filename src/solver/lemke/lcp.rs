use super::pivot::Tableau;
use nalgebra::{DMatrix, DVector};
use thiserror::Error;

/// What a solve of a linear complementarity problem may spend, and when it counts as solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LcpOptions {
    /// Smallest pivot taken, once the mean of `|M_ii|` is scaled to 1; no unit.
    pub pivot_tolerance: f64,
    /// Most pivots; the method is exponential in the worst case.
    pub max_pivots: usize,
    /// Solved means [`LcpSolution::residual`] ≤ this; no unit.
    pub tolerance: f64,
}

impl Default for LcpOptions {
    fn default() -> Self {
        LcpOptions {
            pivot_tolerance: 1e-8,
            max_pivots: 5000,
            tolerance: 1e-9,
        }
    }
}

/// How [`solve_lcp`] ended. Not solving is an outcome, not an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LcpStatus {
    /// The residual of the returned `z` is within the tolerance.
    Solved,
    /// A secondary ray: no solution along this path. If `M` is copositive-plus, there is none.
    Ray,
    /// [`LcpOptions::max_pivots`] ran out.
    PivotLimit,
    /// A complementary basis was found, but round-off leaves its residual above the tolerance.
    Inaccurate,
}

/// The last point of the path of pivots; always finite, `z ≥ 0`.
#[derive(Debug, Clone, PartialEq)]
pub struct LcpSolution {
    /// `z`.
    pub z: DVector<f64>,
    /// `w = M z + q`, computed from the original data.
    pub w: DVector<f64>,
    pub status: LcpStatus,
    pub pivots: usize,
    /// `max_i |min(m z_i, w_i)| / max(max_i(−q_i), m max_i z_i)`, no unit, with `m` the mean of
    /// `|M_ii|`; 0 where `q ≥ 0`.
    pub residual: f64,
}

/// What is wrong with a linear complementarity problem.
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
    /// Row `row` of the matrix or of `q` holds NaN or infinity.
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
/// # Arguments
/// - `matrix`: `M`, n × n, any. Rows and columns should be of like size: only a common factor of
///   `M` and one of `q` is scaled away.
/// - `q`: n.
///
/// # Returns
/// See [`LcpSolution`]. The work is O(n²) a pivot.
///
/// # Errors
/// [`LcpError::Shape`] unless `M` is n × n and `q` has length n; [`LcpError::NonFinite`].
///
/// # Source
/// Lemke (1965); Cottle, Pang & Stone, *The Linear Complementarity Problem* (1992), §4.4 and §4.9.
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
    // Not max |q|: one long bound in q must not hide the rows that drive the path.
    let depth = q.iter().fold(0.0f64, |depth, &x| depth.max(-x));
    if depth == 0.0 {
        return Ok(LcpSolution {
            z: DVector::zeros(n),
            w: q.clone(),
            status: LcpStatus::Solved,
            pivots: 0,
            residual: 0.0,
        });
    }
    let mean = mean_diagonal(matrix);
    let scaled = matrix / mean;
    let free = q / depth;

    let mut tableau = Tableau::new(&scaled, &free, options.pivot_tolerance);
    let end = tableau.run(options.max_pivots);
    let mut best = Candidate::new(&scaled, &free, tableau.z());
    if end == LcpStatus::Solved
        && let Some(z) = solve_basis(&scaled, &free, &tableau.support())
    {
        let polished = Candidate::new(&scaled, &free, z);
        if polished.residual <= best.residual {
            best = polished;
        }
    }
    let status = match end {
        LcpStatus::Solved if best.residual > options.tolerance => LcpStatus::Inaccurate,
        end => end,
    };
    Ok(LcpSolution {
        z: best.z * (depth / mean),
        w: best.w * depth,
        status,
        pivots: tableau.pivots,
        residual: best.residual,
    })
}

/// How far `z` is from solving the problem (1) of [`solve_lcp`], from the data alone.
///
/// # Returns
/// `max_i |min(m z_i, w_i)| / max(max_i(−q_i), m max_i z_i)`, no unit, with `w = M z + q` and `m`
/// the mean of `|M_ii|`; 0 where no `min` differs from 0, NaN where a number is.
pub fn complementarity_residual(matrix: &DMatrix<f64>, q: &DVector<f64>, z: &DVector<f64>) -> f64 {
    let mean = mean_diagonal(matrix);
    let w = matrix * z + q;
    // `min` and `max` drop NaN; and NaN in z is NaN in w, but for columns of zeros
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

/// A point judged from the scaled data alone.
struct Candidate {
    z: DVector<f64>,
    w: DVector<f64>,
    residual: f64,
}

impl Candidate {
    fn new(matrix: &DMatrix<f64>, free: &DVector<f64>, mut z: DVector<f64>) -> Self {
        if z.iter().any(|x| !x.is_finite()) {
            z.fill(0.0);
        }
        let w = matrix * &z + free;
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
mod tests {
    use super::*;

    fn solve(matrix: &DMatrix<f64>, q: &[f64]) -> LcpSolution {
        solve_lcp(matrix, &DVector::from_row_slice(q), &LcpOptions::default()).unwrap()
    }

    /// Two unit loads on `M = [2 1; 1 2]`: by symmetry z = (1, 1)/3, 2 z₁ + z₂ = 1.
    #[test]
    fn textbook_problem() {
        let m = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
        let s = solve(&m, &[-1.0, -1.0]);
        assert_eq!(s.status, LcpStatus::Solved);
        // round-off of a 2 x 2 solve
        assert!((s.z[0] - 1.0 / 3.0).abs() < 1e-15 && (s.z[1] - 1.0 / 3.0).abs() < 1e-15);
        // q ≥ 0 is its own answer
        assert_eq!(solve(&m, &[0.0, 3.0]).pivots, 0);
    }

    /// The judge sees what the solver sees, and what it never returns.
    #[test]
    fn residual_of_any_point() {
        let m = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
        let q = DVector::from_row_slice(&[-1.0, -1.0]);
        let at = |z: [f64; 2]| complementarity_residual(&m, &q, &DVector::from_row_slice(&z));
        // round-off of 1/3
        assert!(at([1.0 / 3.0; 2]) < 1e-15);
        // w = −1 of a depth of 1; w = (1, 0), m z = (2, 0) with m = 2; z₂ < 0
        assert_eq!((at([0.0; 2]), at([1.0, 0.0])), (1.0, 0.5));
        assert_eq!(at([1.0, -1.0]), 1.0);
        assert!(at([f64::NAN, 0.0]).is_nan());
        // nothing pushes, nothing answers
        let free = DVector::from_row_slice(&[1.0, 0.0]);
        assert_eq!(complementarity_residual(&m, &free, &DVector::zeros(2)), 0.0);
    }

    #[test]
    fn problem_without_a_solution_ends_on_a_ray() {
        // w₁ = −z₂ − 1 < 0 whatever z
        let m = DMatrix::from_row_slice(2, 2, &[0.0, -1.0, 1.0, 0.0]);
        let s = solve(&m, &[-1.0, 0.0]);
        assert_eq!(s.status, LcpStatus::Ray);
        assert!(s.residual > 0.1 && s.z.iter().all(|x| x.is_finite()));
    }

    /// Murty's family: 1 on the diagonal, 2 below it, q = −1 takes 2ⁿ pivots.
    #[test]
    fn murty_family_is_exponential_and_the_limit_stops_it() {
        let family = |n| {
            DMatrix::from_fn(n, n, |i: usize, j: usize| match i.cmp(&j) {
                std::cmp::Ordering::Equal => 1.0,
                std::cmp::Ordering::Greater => 2.0,
                std::cmp::Ordering::Less => 0.0,
            })
        };
        for n in 1..=8 {
            let s = solve(&family(n), &vec![-1.0; n]);
            assert_eq!((s.status, s.pivots), (LcpStatus::Solved, 1 << n));
            assert_eq!(s.z[0], 1.0);
        }
        let options = LcpOptions {
            max_pivots: 100,
            ..LcpOptions::default()
        };
        let q = DVector::from_element(8, -1.0);
        let s = solve_lcp(&family(8), &q, &options).unwrap();
        assert_eq!((s.status, s.pivots), (LcpStatus::PivotLimit, 100));
    }

    /// A positive definite plus a skew matrix is a P-matrix: the solution is unique and known.
    #[test]
    fn random_p_matrices_return_the_known_solution() {
        let mut random = super::super::tests::Random(7);
        for case in 0..60 {
            let n = 1 + case;
            let a = DMatrix::from_fn(n, n, |_, _| random.between(-1.0, 1.0));
            let s = DMatrix::from_fn(n, n, |_, _| random.between(-1.0, 1.0));
            let m =
                &a * a.transpose() / n as f64 + DMatrix::identity(n, n) * 0.1 + &s - s.transpose();
            let z = DVector::from_fn(n, |_, _| random.between(-1.0, 1.0));
            let w = z.map(|x| (-x).max(0.0));
            let z = z.map(|x| x.max(0.0));
            let q = &w - &m * &z;
            let found = solve_lcp(&m, &q, &LcpOptions::default()).unwrap();
            assert_eq!(found.status, LcpStatus::Solved, "n = {n}");
            // condition number below 1e4 here, times round-off
            assert!((found.z - z).amax() < 1e-11, "n = {n}");
        }
    }

    #[test]
    fn answer_scales_with_the_data() {
        let m = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]) * 1e12;
        let s = solve(&m, &[-1e-6, -1e-6]);
        assert_eq!(s.status, LcpStatus::Solved);
        // relative round-off
        assert!((s.z[0] * 3e18 - 1.0).abs() < 1e-14);
    }

    #[test]
    fn wrong_shapes_and_nan_are_refused() {
        let options = LcpOptions::default();
        let q = DVector::from_element(2, -1.0);
        assert_eq!(
            solve_lcp(&DMatrix::zeros(2, 3), &q, &options),
            Err(LcpError::Shape {
                rows: 2,
                columns: 3,
                free: 2
            })
        );
        let mut m = DMatrix::identity(2, 2);
        m[(1, 0)] = f64::NAN;
        assert_eq!(
            solve_lcp(&m, &q, &options),
            Err(LcpError::NonFinite { row: 1 })
        );
    }
}
