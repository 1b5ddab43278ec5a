//! Linear complementarity problems: Lemke's method, and what follows where its first path fails.

mod infeasible;
mod restart;
mod tree;

pub use infeasible::proves_infeasible;

use crate::solver::lemke::{first_path, mean_diagonal};
use crate::solver::{LcpError, LcpOptions, LcpSolution, LcpStatus};
use infeasible::certificate;
use nalgebra::{DMatrix, DVector};

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
/// A ray, or a basis that round-off spoils, is followed by these, up to the first that answers,
/// all on rows and columns scaled to like size:
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
    let mut search = first_path(matrix, q, options)?;
    let (mut proof, mut exhausted) = (None, false);
    if options.fallbacks && matches!(search.status, LcpStatus::Ray | LcpStatus::Inaccurate) {
        let balanced = restart::Balanced::new(&search);
        // a ray may start from a point that is good enough; the other paths may have a better one
        if !search.solved() {
            proof = certificate(matrix, q, &balanced, &mut search.programmes);
        }
        if proof.is_some() {
            search.status = LcpStatus::Infeasible;
        } else {
            restart::other_paths(&mut search, &balanced);
            if !search.solved() {
                exhausted = tree::enumerate(&mut search, &balanced);
            }
            if search.solved() {
                search.status = LcpStatus::Solved;
                exhausted = false;
            }
        }
    }
    Ok(search.into_solution(proof, exhausted))
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

#[cfg(test)]
#[path = "lcp_tests.rs"]
mod tests;
