use super::restart::Balanced;
use microlp::{
    ComparisonOp, Error, LinearExpr, OptimizationDirection, Problem, SolveOptions, SolveOutcome,
    Variable,
};
use nalgebra::{DMatrix, DVector};

/// Tolerated round-off of a sum, relative to the sum of its absolute terms.
const ROUND_OFF: f64 = 1e-14;

/// Least `−qᵀ y / Σ |q_i| y_i` of a proof: well above the round-off of the data and of the sums.
const MARGIN: f64 = 1e-10;

/// Whether `y` proves that no `z ≥ 0` has `M z + q ≥ 0`, and so that the complementarity problem
/// has no solution. By Farkas' lemma this holds iff there is a `y` with
///
/// ```text
/// y ≥ 0,   Mᵀ y ≤ 0,   qᵀ y < 0                                              (1)
/// ```
///
/// since `0 ≤ yᵀ (M z + q) = (Mᵀ y)ᵀ z + qᵀ y < 0` is a contradiction.
///
/// # Returns
/// `true` if (1) holds in floating point: `(Mᵀ y)_j ≤ 1e-14 Σ_i |M_ij| y_i` for all j and `qᵀ y ≤
/// −1e-10 Σ_i |q_i| y_i < 0`. `false` for wrong lengths and numbers that are not finite. The first
/// tolerance times `z` may compensate the second: if both are at their limits, a solution with `z`
/// 1e4 times the scale of `q` is not excluded.
///
/// # Source
/// Farkas (1902); Cottle, Pang & Stone (1992), §2.7.
pub fn proves_infeasible(matrix: &DMatrix<f64>, q: &DVector<f64>, y: &DVector<f64>) -> bool {
    let n = q.len();
    if matrix.shape() != (n, n) || y.len() != n || y.iter().any(|x| !(0.0..).contains(x)) {
        return false;
    }
    // the sum of x_i y_i, and of their absolute values
    let sums = |x: &mut dyn Iterator<Item = f64>| {
        x.zip(y.iter())
            .map(|(x, y)| x * y)
            .fold((0.0, 0.0), |(sum, size): (f64, f64), x| {
                (sum + x, size + x.abs())
            })
    };
    let (value, size) = sums(&mut q.iter().copied());
    let falls = value < 0.0 && size.is_finite() && value <= -MARGIN * size;
    falls
        && matrix.column_iter().all(|column| {
            let (sum, size) = sums(&mut column.iter().copied());
            size.is_finite() && sum <= ROUND_OFF * size
        })
}

/// `y` of [`proves_infeasible`] by the linear programme `min qᵀ y` with `Mᵀ y ≤ 0`, `0 ≤ y ≤ 1`,
/// which has the solution 0. `None` if that is the only one, or the proof fails in floating point.
/// Counts the programme in `programmes`.
pub(super) fn certificate(
    matrix: &DMatrix<f64>,
    q: &DVector<f64>,
    balanced: &Balanced,
    programmes: &mut usize,
) -> Option<DVector<f64>> {
    if q.len() > MAX_ROWS || !balanced.finite() {
        return None;
    }
    *programmes += 1;
    let size = balanced.free.amax();
    let mut programme = Problem::new(OptimizationDirection::Minimize);
    let cost = |i: usize| balanced.free[i] / size;
    let shares: Vec<Variable> = (0..q.len())
        .map(|i| programme.add_var(cost(i), (0.0, 1.0)))
        .collect();
    for column in balanced.matrix.column_iter() {
        let row = expression(&shares, column.iter().copied());
        programme.add_constraint(row, ComparisonOp::Le, 0.0);
    }
    let Optimum::At(y) = solve(&programme, &shares) else {
        return None;
    };
    // first with numbers near 0 set to 0, then unchanged
    [SNAP, 0.0].into_iter().find_map(|least| {
        let y = y.map(|x| if x > least { x } else { 0.0 });
        let y = y.component_mul(&balanced.rows);
        let y = &y / y.amax();
        proves_infeasible(matrix, q, &y).then_some(y)
    })
}

/// Largest problem for which a proof is sought: the programme is dense, and its time grows faster
/// than n³ (measured: 0.4 s for 300 rows, 42 s for 1000).
const MAX_ROWS: usize = 500;

/// Parts of `y ≤ 1` below this are first set to 0.
const SNAP: f64 = 1e-9;

/// Numbers below this, in a row scaled to 1, are left out of a linear programme: its solver
/// requires a range of at most six orders of magnitude, and its result is checked with the problem
/// itself.
const NEGLIGIBLE: f64 = 1e-10;

/// `Σ numbers_k variables_k`.
pub(super) fn expression(variables: &[Variable], numbers: impl Iterator<Item = f64>) -> LinearExpr {
    let mut sum = LinearExpr::empty();
    for (&variable, x) in variables.iter().zip(numbers) {
        if x.abs() > NEGLIGIBLE {
            sum.add(variable, x);
        }
    }
    sum
}

/// Result of a linear programme.
pub(super) enum Optimum {
    /// Values of the variables.
    At(DVector<f64>),
    /// No point satisfies the constraints.
    Empty,
    /// The solver failed by round-off.
    Unknown,
}

pub(super) fn solve(programme: &Problem, variables: &[Variable]) -> Optimum {
    let mut options = SolveOptions::default();
    options.tolerances.feasibility = 1e-9;
    match programme.solve_with(options) {
        Ok(SolveOutcome::Solution(solution)) => {
            let values = variables.iter().map(|x| solution.var_value(*x));
            Optimum::At(DVector::from_iterator(variables.len(), values))
        }
        Err(Error::Infeasible) => Optimum::Empty,
        _ => Optimum::Unknown,
    }
}
