use crate::contact::{ContactProblem, Law, Vec2};
use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// The complementarity form of friction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Form {
    /// 3 numbers per frictional contact: Glocker & Studer (2005).
    Three,
    /// 4 numbers per frictional contact: Stewart & Trinkle (1996), Anitescu & Potra (1997).
    Four,
}

/// Eigenvalues of the bilateral block below this ratio to the largest count as redundant rows. The
/// rows have unit mean diagonal, so round-off is near 1e-16 times their number.
const RANK_TOLERANCE: f64 = 1e-12;

/// The rows of a contact problem in scaled units, with the bilateral constraints eliminated.
///
/// Every block is scaled so that its diagonal has mean 1, `P = d P̃`, `ξ̃ = d ξ`,
/// `d² = 2 / (tr G_ii + R_i)` for two rows, `1 / (G_ii + R_i)` for one: one factor a block keeps μ.
/// With F the rows that stay and B the bilateral ones,
///
/// ```text
/// P_B = −G_BB⁺ (G_BF P_F + b_B),  G' = G_FF − G_FB G_BB⁺ G_BF,  b' = b_F − G_FB G_BB⁺ b_B   (1)
/// ```
///
/// `G` is positive semidefinite, so `G_BF` lies in the range of `G_BB` and the pseudo-inverse is
/// exact. Redundant pins get the least impulses. For pins that contradict each other the residual
/// tells that there is no solution.
pub(super) struct Rows<'a> {
    problem: &'a ContactProblem,
    scale: Vec<f64>,
    /// First row of each block.
    first: Vec<usize>,
    operator: DMatrix<f64>,
    free: DVector<f64>,
    remaining: Vec<usize>,
    bilateral: Vec<usize>,
    inverse: DMatrix<f64>,
    reduced: DMatrix<f64>,
    reduced_free: DVector<f64>,
}

/// One complementary pair `0 ≤ z ⟂ w ≥ 0`.
struct Pair {
    /// Impulse rows that depend on z, `P = P₀ + S z`: (row, coefficient).
    impulse: Vec<(usize, f64)>,
    /// Velocity row in w, and its sign; none for a bound.
    velocity: Option<(usize, f64)>,
    /// Other pairs in w: (pair, coefficient).
    others: Vec<(usize, f64)>,
    /// Constant in w.
    constant: f64,
}

/// `M` and `q`, and the map from `z` to impulses.
pub(super) struct Lcp {
    pub matrix: DMatrix<f64>,
    pub q: DVector<f64>,
    pairs: Vec<Pair>,
    start: DVector<f64>,
}

impl<'a> Rows<'a> {
    pub(super) fn new(problem: &'a ContactProblem) -> Self {
        let laws = &problem.laws;
        let (mut operator, first) = problem.operator.assemble(laws);
        let size = operator.nrows();
        let mut row_scale = DVector::zeros(size);
        let mut free = DVector::zeros(size);
        let (mut remaining, mut bilateral) = (Vec::new(), Vec::new());
        let mut scale = Vec::with_capacity(laws.len());
        for (i, law) in laws.iter().enumerate() {
            let (row, rows) = (first[i], law.rows());
            operator[(row, row)] += law.compliance();
            let mean = (row..row + rows).map(|r| operator[(r, r)]).sum::<f64>() / rows as f64;
            let d = 1.0 / mean.sqrt();
            scale.push(d);
            for r in 0..rows {
                row_scale[row + r] = d;
                free[row + r] = d * problem.free[i][r];
            }
            let side = if is_bilateral(law, d) {
                &mut bilateral
            } else {
                &mut remaining
            };
            side.extend(row..row + rows);
        }
        operator.component_mul_assign(&(&row_scale * row_scale.transpose()));
        let inverse = pseudo_inverse(operator.select_rows(&bilateral).select_columns(&bilateral));
        let coupling = operator.select_rows(&remaining).select_columns(&bilateral);
        let push = &coupling * &inverse;
        let reduced = operator.select_rows(&remaining).select_columns(&remaining)
            - &push * coupling.transpose();
        let reduced_free = free.select_rows(&remaining) - &push * free.select_rows(&bilateral);
        Rows {
            problem,
            scale,
            first,
            operator,
            free,
            remaining,
            bilateral,
            inverse,
            reduced,
            reduced_free,
        }
    }

    /// Whether bilateral rows had to be factorised.
    pub(super) fn has_bilateral(&self) -> bool {
        !self.bilateral.is_empty()
    }

    /// The complementarity problem of the remaining rows.
    ///
    /// A contact gives `0 ≤ P_N ⟂ ξ_N ≥ 0`. Friction and bounds share two patterns. Between
    /// limits that z moves (form of 3, `P_T = a − μ P_N`):
    ///
    /// ```text
    /// 0 ≤ a ⟂ ξ_T + λ ≥ 0,   0 ≤ λ ⟂ 2 μ P_N − a ≥ 0                           (2)
    /// ```
    ///
    /// Split about a point (form of 4, `P_T = β⁺ − β⁻`, with one λ for both):
    ///
    /// ```text
    /// 0 ≤ β± ⟂ ±ξ_T + λ ≥ 0,   0 ≤ λ ⟂ μ P_N − β⁺ − β⁻ ≥ 0                     (3)
    /// ```
    ///
    /// A bounded row is split about the allowed impulse nearest to 0, `P = P₀ + β⁺ − β⁻`, with a
    /// λ of its own for each finite side, `0 ≤ λ± ⟂ width± − β± ≥ 0`: far bounds cost no digits
    /// and a side of no width costs no pair.
    pub(super) fn complementarity(&self, form: Form) -> Lcp {
        let mut pairs: Vec<Pair> = Vec::new();
        let mut start = DVector::zeros(self.remaining.len());
        let mut row = 0;
        for (i, law) in self.problem.laws.iter().enumerate() {
            match *law {
                Law::Pin => {}
                Law::Contact { friction, .. } => {
                    push_contact(&mut pairs, row, friction, form);
                    row += law.rows();
                }
                Law::Bounded { .. } => {
                    if is_bilateral(law, self.scale[i]) {
                        continue;
                    }
                    let (lower, upper) = bounds(law, self.scale[i]);
                    let anchor = lower.max(0.0).min(upper);
                    start[row] = anchor;
                    push_sides(&mut pairs, row, [upper - anchor, anchor - lower]);
                    row += 1;
                }
            }
        }
        let n = pairs.len();
        let velocity_at_start = &self.reduced * &start + &self.reduced_free;
        let mut matrix = DMatrix::zeros(n, n);
        let mut q = DVector::zeros(n);
        for (k, pair) in pairs.iter().enumerate() {
            q[k] = pair.constant;
            for &(l, value) in &pair.others {
                matrix[(k, l)] += value;
            }
            if let Some((row, sign)) = pair.velocity {
                q[k] += sign * velocity_at_start[row];
                for (l, other) in pairs.iter().enumerate() {
                    for &(column, value) in &other.impulse {
                        matrix[(k, l)] += sign * self.reduced[(row, column)] * value;
                    }
                }
            }
        }
        Lcp {
            matrix,
            q,
            pairs,
            start,
        }
    }

    /// Impulses [N s] of every block from the solution of `lcp`, inside their cone or interval.
    pub(super) fn impulses(&self, lcp: &Lcp, z: &DVector<f64>) -> Vec<Vec2> {
        let mut remaining = lcp.start.clone();
        for (pair, z) in lcp.pairs.iter().zip(z.iter()) {
            for &(row, value) in &pair.impulse {
                remaining[row] += value * z;
            }
        }
        let mut p = DVector::zeros(self.free.len());
        for (k, &row) in self.remaining.iter().enumerate() {
            p[row] = remaining[k];
        }
        // the second pass is iterative refinement
        for _ in 0..2 {
            let velocity = &self.operator * &p + &self.free;
            let change = &self.inverse * velocity.select_rows(&self.bilateral);
            for (k, &row) in self.bilateral.iter().enumerate() {
                p[row] -= change[k];
            }
        }
        let laws = self.problem.laws.iter().enumerate();
        laws.map(|(i, law)| {
            let (row, d) = (self.first[i], self.scale[i]);
            let second = if law.rows() == 2 { d * p[row + 1] } else { 0.0 };
            clip(law, Vec2::new(d * p[row], second))
        })
        .collect()
    }
}

/// Bounds of a bounded row in scaled impulses; a bound that overflows counts as infinite.
fn bounds(law: &Law, scale: f64) -> (f64, f64) {
    match law {
        Law::Bounded { lower, upper, .. } => (lower / scale, upper / scale),
        _ => (f64::NEG_INFINITY, f64::INFINITY),
    }
}

fn is_bilateral(law: &Law, scale: f64) -> bool {
    let (lower, upper) = bounds(law, scale);
    !matches!(law, Law::Contact { .. }) && lower.is_infinite() && upper.is_infinite()
}

/// An impulse row `sign · z` against its velocity.
fn velocity(row: usize, sign: f64, others: Vec<(usize, f64)>) -> Pair {
    Pair {
        impulse: vec![(row, sign)],
        velocity: Some((row, sign)),
        others,
        constant: 0.0,
    }
}

/// The pairs of a contact: its normal and, with friction, (2) or (3) of [`Rows::complementarity`].
fn push_contact(pairs: &mut Vec<Pair>, row: usize, friction: f64, form: Form) {
    let k = pairs.len();
    pairs.push(velocity(row, 1.0, vec![]));
    if friction <= 0.0 {
        return;
    }
    let tangent = row + 1;
    let limit = match form {
        Form::Three => {
            pairs[k].impulse.push((tangent, -friction));
            pairs.push(velocity(tangent, 1.0, vec![(k + 2, 1.0)]));
            vec![(k, 2.0 * friction), (k + 1, -1.0)]
        }
        Form::Four => {
            pairs.push(velocity(tangent, 1.0, vec![(k + 3, 1.0)]));
            pairs.push(velocity(tangent, -1.0, vec![(k + 3, 1.0)]));
            vec![(k, friction), (k + 1, -1.0), (k + 2, -1.0)]
        }
    };
    pairs.push(bound(limit, 0.0));
}

/// The pairs of a bounded row, whose interval extends by `widths` above and below its anchor.
fn push_sides(pairs: &mut Vec<Pair>, row: usize, widths: [f64; 2]) {
    for (sign, width) in [1.0, -1.0].into_iter().zip(widths) {
        if width <= 0.0 {
            continue;
        }
        let k = pairs.len();
        let finite = width.is_finite();
        let others = if finite { vec![(k + 1, 1.0)] } else { vec![] };
        pairs.push(velocity(row, sign, others));
        if finite {
            pairs.push(bound(vec![(k, -1.0)], width));
        }
    }
}

/// A multiplier: `w` is the distance to a limit.
fn bound(others: Vec<(usize, f64)>, constant: f64) -> Pair {
    Pair {
        impulse: vec![],
        velocity: None,
        others,
        constant,
    }
}

/// Projects impulses that round-off left outside of the law's set. Not `clamp`, which panics on an
/// overflow.
fn clip(law: &Law, p: Vec2) -> Vec2 {
    match *law {
        Law::Contact { friction, .. } => {
            let n = p.x.max(0.0);
            Vec2::new(n, p.y.max(-friction * n).min(friction * n))
        }
        Law::Pin => p,
        Law::Bounded { lower, upper, .. } => Vec2::new(p.x.max(lower).min(upper), 0.0),
    }
}

/// Moore-Penrose inverse of a symmetric positive semidefinite matrix; 0 if the computation fails,
/// which the residual then shows.
fn pseudo_inverse(matrix: DMatrix<f64>) -> DMatrix<f64> {
    if matrix.is_empty() {
        return matrix;
    }
    let n = matrix.nrows();
    let most_iterations = 100 * (n + 1);
    let Some(eigen) = SymmetricEigen::try_new(matrix, f64::EPSILON, most_iterations) else {
        return DMatrix::zeros(n, n);
    };
    let cut = RANK_TOLERANCE * eigen.eigenvalues.amax();
    let mut scaled = eigen.eigenvectors.clone();
    for (mut column, &value) in scaled.column_iter_mut().zip(eigen.eigenvalues.iter()) {
        column *= if value > cut { 1.0 / value } else { 0.0 };
    }
    scaled * eigen.eigenvectors.transpose()
}
