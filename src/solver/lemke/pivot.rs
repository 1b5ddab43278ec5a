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

/// Where a variable stands in the tableau.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    Row(usize),
    Column(usize),
}

/// Two ratios closer than this, relative to the larger of themselves and 1, tie. Far above the
/// round-off of a few hundred pivots, far below the judge's tolerance.
const TIE: f64 = 1e-12;

/// Dictionary of `w − M z − z₀ = q`: only columns of nonbasic variables are stored.
///
/// Variables are numbered w: 0..n, z: n..2n, z₀: 2n. `B⁻¹` needs no columns of its own: column j
/// of it is the column of `w_j`, a unit vector while `w_j` is basic.
struct Tableau {
    n: usize,
    /// n rows of n + 2 numbers: the nonbasic columns, then the right-hand side.
    cells: Vec<f64>,
    basis: Vec<usize>,
    nonbasic: Vec<usize>,
    place: Vec<Place>,
    pivot_tolerance: f64,
    pivots: usize,
}

impl Tableau {
    fn new(matrix: &DMatrix<f64>, free: &DVector<f64>, pivot_tolerance: f64) -> Self {
        let n = free.len();
        let mut cells = Vec::with_capacity(n * (n + 2));
        for i in 0..n {
            cells.extend(matrix.row(i).iter().map(|x| -x));
            cells.extend([-1.0, free[i]]);
        }
        Tableau {
            n,
            cells,
            basis: (0..n).collect(),
            nonbasic: (n..=2 * n).collect(),
            place: (0..n)
                .map(Place::Row)
                .chain((0..=n).map(Place::Column))
                .collect(),
            pivot_tolerance,
            pivots: 0,
        }
    }

    fn at(&self, row: usize, column: usize) -> f64 {
        self.cells[row * (self.n + 2) + column]
    }

    fn artificial(&self) -> usize {
        2 * self.n
    }

    /// Pivots until z₀ leaves, a ray, or the limit.
    fn run(&mut self, max_pivots: usize) -> LcpStatus {
        let n = self.n;
        let all: Vec<usize> = (0..n).collect();
        let mut row = self.least_row(n, all);
        let mut column = n;
        loop {
            if self.pivots == max_pivots {
                return LcpStatus::PivotLimit;
            }
            let left = self.exchange(row, column);
            if left == self.artificial() {
                return LcpStatus::Solved;
            }
            // the complement of what left is always nonbasic
            let entering = if left < n { left + n } else { left - n };
            let Place::Column(next) = self.place[entering] else {
                return LcpStatus::Ray;
            };
            column = next;
            let candidates = self.ratio_candidates(column);
            if candidates.is_empty() {
                return LcpStatus::Ray;
            }
            row = self.least_row(column, candidates);
        }
    }

    fn ratio_candidates(&self, column: usize) -> Vec<usize> {
        (0..self.n)
            .filter(|&i| self.at(i, column) > self.pivot_tolerance)
            .collect()
    }

    /// Rows of `candidates` whose ratio is least, ties included.
    fn keep_least(candidates: &mut Vec<usize>, ratio: impl Fn(usize) -> f64) {
        let least = candidates
            .iter()
            .fold(f64::INFINITY, |least, &i| least.min(ratio(i)));
        let limit = least + TIE * least.abs().max(1.0);
        candidates.retain(|&i| ratio(i) <= limit);
    }

    /// The row with the lexicographically least `[q, B⁻¹] / pivot`; z₀ goes first if it ties in q.
    fn least_row(&self, column: usize, mut candidates: Vec<usize>) -> usize {
        // before z₀ has entered, the divisor is the covering vector 1
        let divisor = |i: usize| self.at(i, column).abs();
        Self::keep_least(&mut candidates, |i| self.at(i, self.n + 1) / divisor(i));
        if let Place::Row(row) = self.place[self.artificial()]
            && candidates.contains(&row)
        {
            return row;
        }
        for j in 0..self.n {
            if candidates.len() < 2 {
                break;
            }
            match self.place[j] {
                Place::Row(row) => Self::keep_least(&mut candidates, |i| {
                    if i == row { 1.0 / divisor(i) } else { 0.0 }
                }),
                Place::Column(c) => {
                    Self::keep_least(&mut candidates, |i| self.at(i, c) / divisor(i));
                }
            }
        }
        candidates.first().copied().unwrap_or(0)
    }

    /// Swaps the basic variable of `row` with the nonbasic one of `column`; returns what left.
    fn exchange(&mut self, row: usize, column: usize) -> usize {
        let width = self.n + 2;
        let (before, rest) = self.cells.split_at_mut(row * width);
        let (pivot_row, after) = rest.split_at_mut(width);
        let inverse = 1.0 / pivot_row[column];
        pivot_row[column] = 1.0;
        for x in pivot_row.iter_mut() {
            *x *= inverse;
        }
        for other in before
            .chunks_exact_mut(width)
            .chain(after.chunks_exact_mut(width))
        {
            let factor = other[column];
            if factor != 0.0 {
                other[column] = 0.0;
                for (x, p) in other.iter_mut().zip(pivot_row.iter()) {
                    *x -= factor * p;
                }
            }
        }
        let (left, entered) = (self.basis[row], self.nonbasic[column]);
        self.basis[row] = entered;
        self.nonbasic[column] = left;
        self.place[entered] = Place::Row(row);
        self.place[left] = Place::Column(column);
        self.pivots += 1;
        left
    }

    /// Indices of the basic z.
    fn support(&self) -> Vec<usize> {
        (0..self.n)
            .filter(|i| matches!(self.place[self.n + i], Place::Row(_)))
            .collect()
    }

    fn z(&self) -> DVector<f64> {
        DVector::from_fn(self.n, |i, _| match self.place[self.n + i] {
            Place::Row(row) => self.at(row, self.n + 1).max(0.0),
            Place::Column(_) => 0.0,
        })
    }
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

    /// Degenerate at every pivot. Taking the first row of a tie, the path returns to an earlier
    /// basis (checked here with the same tableau); the lexicographic rule ends it in 3 pivots.
    #[test]
    fn degenerate_problem_cycles_only_without_the_lexicographic_rule() {
        let m = DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 3.0, 3.0, 1.0, 0.0, 0.0, -1.0, 1.0]);
        let q = [-1.0; 3];

        let mut t = Tableau::new(&m, &DVector::from_row_slice(&q), 1e-8);
        let (mut row, mut column) = (0, 3);
        let mut seen = std::collections::HashSet::new();
        let cycled = loop {
            let left = t.exchange(row, column);
            if left == t.artificial() || t.pivots > 100 {
                break false;
            }
            if !seen.insert((t.basis.clone(), left)) {
                break true;
            }
            let Place::Column(next) = t.place[(left + t.n) % (2 * t.n)] else {
                unreachable!()
            };
            column = next;
            let mut candidates = t.ratio_candidates(column);
            Tableau::keep_least(&mut candidates, |i| t.at(i, t.n + 1) / t.at(i, column));
            let artificial = t.artificial();
            let z0 = candidates
                .iter()
                .copied()
                .find(|&i| t.basis[i] == artificial);
            row = z0.unwrap_or(candidates[0]);
        };
        assert!(cycled);

        let s = solve(&m, &q);
        assert_eq!((s.status, s.pivots), (LcpStatus::Solved, 3));
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
