use super::{
    BodyOperator, ContactProblem, Delassus, Law, Mat2, Rows, SweepState, Vec2, Vec3,
    project_onto_cone,
};

/// How far impulses are from solving a contact problem. Every solver is judged by it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Residual {
    /// `max_i |F_i|` [N s].
    pub absolute: f64,
    /// `max_i |F_i| / max_i max(|P_i|, ρ_i |b_i|)`, no unit; 0 where both are 0.
    pub relative: f64,
    /// `max_i |F_i| / ρ_i` \[m/s\]; unlike `relative` it is sensitive to light bodies next to heavy
    /// ones.
    pub velocity: f64,
    /// Velocity scale of the island \[m/s\]: `max_i max(|b_i|, |ξ_i|)`. A bounded row that `ξ_i`
    /// holds at its bound adds `|P_i| / ρ_i`, because its impulse may be the only drive. No other
    /// impulse counts: in a wedge without a solution impulses can grow until any residual is small
    /// beside them.
    pub velocity_scale: f64,
    /// Round-off of `ξ` that is granted \[m/s\]: `64 ε max_i |P_i| / ρ_i`, but at most 1e-4 times
    /// `velocity_scale`, and 0 if the work of what is left, `Σ |P_i · F_i| / ρ_i`, is above a hundredth of
    /// `Σ |P_i · b_i|`: in a nearly singular problem impulses can turn round-off into energy.
    pub round_off: f64,
}

/// Number of roundings, each of the largest `|P_i| / ρ_i` of the island, that a velocity may be off
/// by.
const ROUNDINGS: f64 = 64.0 * f64::EPSILON;

/// Largest round-off that is granted, as a share of the island's velocity scale. The impulses of a
/// problem without a solution can grow until their round-off explains any velocity. With this bound
/// the certificate of any impulses, however large, says that velocities are right to four digits.
const MOST_ROUND_OFF: f64 = 1e-4;

/// Largest work of a residual up to which its round-off is granted, as a share of that of the free
/// velocities.
const MOST_WORK: f64 = 1e-2;

impl Residual {
    /// Whether `relative ≤ tolerance` and `velocity ≤ max(tolerance · velocity_scale, round_off)`.
    /// NaN fails.
    pub fn certified(&self, tolerance: f64) -> bool {
        self.relative <= tolerance
            && (self.velocity <= tolerance * self.velocity_scale || self.velocity <= self.round_off)
    }

    /// The smallest tolerance at which the impulses are certified, up to round-off: `relative`, or
    /// `velocity / velocity_scale` if that is larger and not round-off; no unit. NaN stays NaN.
    pub fn merit(&self) -> f64 {
        if self.velocity <= self.round_off {
            self.relative
        } else {
            worse(self.relative, self.velocity / self.velocity_scale)
        }
    }
}

/// The larger number; NaN if either is NaN. `f64::max` drops NaN, but the judge must not.
fn worse(a: f64, b: f64) -> f64 {
    if b.is_nan() || b > a { b } else { a }
}

/// Natural-map residual of a planar Coulomb contact problem.
///
/// With `ξ = G P + b + (R P_N, 0)` and `û = ξ + (μ |ξ_T|, 0)`, `P` solves the problem iff
///
/// ```text
/// F_i(P) = P_i − Π_K(P_i − ρ_i û_i) = 0   for every block i                  (1)
/// ```
///
/// where `ρ_i = 2 / (tr(G_ii) + 2 R_i)` \[kg\] for two rows, `1 / (G_ii + R_i)` for one, turns
/// velocity into impulse. `K` is the friction cone of a contact, the plane of a pin, the interval
/// of a bounded row.
///
/// # Arguments
/// - `problem`: n blocks; `G` symmetric positive semidefinite [1/kg]; `b` \[m/s\].
/// - `impulses`: n pairs [N s], (n, t); need not lie in the cone.
///
/// # Returns
/// See [`Residual`]. A large residual is a result, not an error. NaN input gives a NaN residual.
/// `relative` is NaN if the squares of velocities or impulses overflow. NaN is never certified.
///
/// # Source
/// De Saxcé & Feng (1998); Acary & Brogliato (2008), ch. 13. The scaling by ρ is ours.
pub fn natural_map(problem: &ContactProblem, impulses: &[Vec2]) -> Residual {
    Judge::new(problem).natural_map(problem, impulses)
}

/// How far impulses are from the constraints of a contact problem, without its complementarity.
///
/// For a blend of two solutions of problems that differ in `b` alone: a contact may push where it
/// opens, and slide against less than its friction, but
///
/// ```text
/// P_i ∈ K_i,   ξ_N ≥ 0 of contacts,   ξ = 0 of pins and of rows without bounds     (1)
/// ```
///
/// hold by convexity. `F_i` is the violation of (1), velocities times `ρ_i`; the scales are those
/// of [`natural_map`].
pub(crate) fn feasibility(problem: &ContactProblem, impulses: &[Vec2]) -> Residual {
    let mut velocities = Vec::new();
    problem.velocities(impulses, &mut velocities);
    let mut squares = Squares::default();
    for (i, law) in problem.laws.iter().enumerate() {
        let (p, b) = (impulses[i], problem.free[i]);
        let mut xi = velocities[i];
        xi.x += law.compliance() * p.x;
        let stiff = stiffness(law, &problem.operator.diagonal(i));
        let rho = stiff.recip();
        let f = match *law {
            Law::Contact { friction, .. } => {
                let outside = (p - project_onto_cone(p, friction)).norm();
                // not `max`, which would drop NaN
                let closing = if xi.x >= 0.0 { 0.0 } else { -xi.x };
                Vec2::new(outside, rho * closing)
            }
            Law::Pin => rho * xi,
            Law::Bounded { lower, upper, .. } => {
                let holds = lower == f64::NEG_INFINITY && upper == f64::INFINITY;
                let open = if holds { rho * xi.x } else { 0.0 };
                Vec2::new(p.x - p.x.clamp(lower, upper) + open, p.y)
            }
        };
        let [p, b, xi] = scales(law, [p, b, xi]);
        squares.add(f.norm_squared(), p, b, xi, stiff * stiff);
    }
    squares.residual()
}

/// `1/ρ` of a block [1/kg].
fn stiffness(law: &Law, block: &Mat2) -> f64 {
    let rigid = match law.rows() {
        2 => block.trace() / 2.0,
        _ => block[(0, 0)],
    };
    rigid + law.compliance()
}

/// Squares of the numbers of a block; one row has one number.
fn scales(law: &Law, pairs: [Vec2; 3]) -> [f64; 3] {
    match law.rows() {
        2 => pairs.map(|v| v.norm_squared()),
        _ => pairs.map(|v| v.x * v.x),
    }
}

/// [`natural_map`] with reusable buffers, for solvers that call it often. Gives the same numbers to
/// the last bit, without allocation.
#[derive(Debug, Clone, Default)]
pub struct Judge {
    diagonal: Vec<Mat2>,
    state: SweepState,
    velocities: Vec<Vec2>,
}

impl Judge {
    /// A judge of `problem`.
    pub fn new(problem: &ContactProblem) -> Judge {
        let mut judge = Judge::default();
        judge.prepare(problem);
        judge
    }

    /// Switches to another problem and reads its diagonal blocks.
    pub fn prepare(&mut self, problem: &ContactProblem) {
        self.diagonal.clear();
        self.diagonal
            .extend((0..problem.len()).map(|i| problem.operator.diagonal(i)));
    }

    /// The blocks `G_ii` [1/kg] of the problem last prepared.
    pub fn diagonal(&self) -> &[Mat2] {
        &self.diagonal
    }

    /// `G P + b` \[m/s\] of every block at the impulses judged last.
    pub(crate) fn velocities(&self) -> &[Vec2] {
        &self.velocities
    }

    /// Velocities `M⁻¹ Jᵀ P` of the bodies at the impulses judged last; empty for an explicit
    /// operator.
    pub(crate) fn bodies(&self) -> &[Vec3] {
        self.state.bodies()
    }

    /// See [`natural_map`]; `problem` is the one prepared last (its free term may differ).
    pub fn natural_map(&mut self, problem: &ContactProblem, impulses: &[Vec2]) -> Residual {
        problem.operator.restart(impulses, &mut self.state);
        self.judge(problem, impulses)
    }

    /// [`Judge::prepare`] and [`Judge::natural_map`] in one pass over the rows of the problem.
    pub(crate) fn begin(&mut self, problem: &ContactProblem, impulses: &[Vec2]) -> Residual {
        let Delassus::Bodies(op) = &problem.operator else {
            self.prepare(problem);
            return self.natural_map(problem, impulses);
        };
        let diagonal = &mut self.diagonal;
        diagonal.clear();
        self.state.restart(op, |i, rows| {
            diagonal.push(rows.diagonal(&op.inverse_mass));
            impulses[i]
        });
        self.judge(problem, impulses)
    }

    /// [`Judge::natural_map`] at impulses that `next` computes from the rows of each block, in one
    /// pass.
    pub(crate) fn natural_map_of(
        &mut self,
        problem: &ContactProblem,
        op: &BodyOperator,
        impulses: &mut [Vec2],
        next: impl Fn(usize, &Rows) -> Vec2,
    ) -> Residual {
        self.state.restart(op, |i, rows| {
            impulses[i] = next(i, rows);
            impulses[i]
        });
        self.judge(problem, impulses)
    }

    /// The residual, once the state of the operator belongs to the impulses.
    fn judge(&mut self, problem: &ContactProblem, impulses: &[Vec2]) -> Residual {
        let operator = &problem.operator;
        let mut squares = Squares::default();
        self.velocities.clear();
        for (i, law) in problem.laws.iter().enumerate() {
            let block = &self.diagonal[i];
            let (p, b) = (impulses[i], problem.free[i]);
            let mut xi = operator.read(i, &self.state) + b;
            self.velocities.push(xi);
            xi.x += law.compliance() * p.x;
            let stiff = stiffness(law, block);
            let rho = stiff.recip();
            let mut driven = 0.0;
            let f = match *law {
                Law::Contact { friction, .. } if friction > 0.0 => {
                    let shifted = Vec2::new(xi.x + friction * xi.y.abs(), xi.y);
                    p - project_onto_cone(p - rho * shifted, friction)
                }
                Law::Contact { .. } => {
                    let z = p.x - rho * xi.x;
                    // not `max`, which would drop NaN
                    let f = p.x - if z < 0.0 { 0.0 } else { z };
                    Vec2::new(worse(f.abs(), p.y.abs()), 0.0)
                }
                Law::Pin => rho * xi,
                Law::Bounded { lower, upper, .. } => {
                    let f = p.x - (p.x - rho * xi.x).clamp(lower, upper);
                    // at a bound without a velocity that holds it there, the row drives nothing
                    if f == 0.0 && (p.x == lower || p.x == upper) {
                        driven = (p.x * stiff).powi(2);
                    }
                    Vec2::new(worse(f.abs(), p.y.abs()), 0.0)
                }
            };
            squares.work_left += p.dot(&f).abs() * stiff;
            squares.work += p.dot(&b).abs();
            let [p, b, scale] = scales(law, [p, b, xi]);
            squares.add(f.norm_squared(), p, b, scale.max(driven), stiff * stiff);
        }
        squares.residual()
    }
}

/// Largest squares of a residual. Roots are taken of the maxima only, not per block.
#[derive(Default)]
struct Squares {
    absolute: f64,
    velocity: f64,
    scale: f64,
    velocity_scale: f64,
    round_off: f64,
    /// `Σ |P_i · F_i| / ρ_i` and `Σ |P_i · b_i|` \[J\], no squares.
    work_left: f64,
    work: f64,
}

impl Squares {
    /// Adds a block: `|F|²`, `|P|²`, `|b|²`, its velocity scale, `1/ρ²`.
    fn add(&mut self, f: f64, p: f64, b: f64, scale: f64, stiff: f64) {
        self.absolute = worse(self.absolute, f);
        self.velocity = worse(self.velocity, f * stiff);
        self.scale = self.scale.max(p).max(b / stiff);
        self.velocity_scale = self.velocity_scale.max(b).max(scale);
        self.round_off = self.round_off.max(p * stiff);
    }

    fn residual(self) -> Residual {
        let absolute = self.absolute.sqrt();
        let most_round_off = MOST_ROUND_OFF * self.velocity_scale.sqrt();
        // beyond that no digit of a velocity is known: impulses may cancel to any value
        let one_rounding = f64::EPSILON * self.round_off.sqrt();
        let unknown = match one_rounding > most_round_off {
            true => one_rounding,
            false => 0.0,
        };
        let velocity = worse(self.velocity.sqrt(), unknown);
        let granted = (ROUNDINGS * self.round_off.sqrt()).min(most_round_off);
        let costly = self.work_left > MOST_WORK * self.work;
        Residual {
            absolute,
            relative: if !(self.scale.is_finite() && self.velocity_scale.is_finite()) {
                // any residual is small relative to an overflow
                f64::NAN
            } else if absolute == 0.0 {
                0.0
            } else {
                absolute / self.scale.sqrt()
            },
            velocity,
            velocity_scale: self.velocity_scale.sqrt(),
            round_off: if costly { 0.0 } else { granted },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Delassus;
    use nalgebra::DMatrix;

    /// Painlevé's block has three solutions. All three pass; a fourth point does not.
    #[test]
    fn painleve_block_has_three_certified_solutions() {
        let problem = ContactProblem {
            operator: Delassus::dense(DMatrix::from_row_slice(2, 2, &[1.6, -1.2, -1.2, 3.4])),
            free: vec![Vec2::new(0.05, -3.0)],
            laws: vec![Law::Contact {
                friction: 2.0,
                compliance: 0.0,
            }],
        };
        // the stick solution is printed to four digits, so solve it here
        let det = 1.6 * 3.4 - 1.44;
        let stick = Vec2::new(
            (-0.05 * 3.4 + 3.0 * 1.2) / det,
            (3.0 * 1.6 - 0.05 * 1.2) / det,
        );
        for p in [Vec2::zeros(), Vec2::new(0.0625, 0.125), stick] {
            assert!(natural_map(&problem, &[p]).certified(1e-14), "{p}");
        }
        assert!(natural_map(&problem, &[Vec2::new(0.3, 0.1)]).relative > 1e-2);
    }

    #[test]
    fn what_is_not_finite_is_never_certified() {
        let contact = |friction| Law::Contact {
            friction,
            compliance: 0.0,
        };
        let bounded = Law::Bounded {
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            compliance: 0.0,
        };
        for law in [contact(0.5), contact(0.0), Law::Pin, bounded] {
            let problem = ContactProblem {
                operator: Delassus::dense(DMatrix::identity(2, 2)),
                free: vec![Vec2::new(-1.0, 0.0)],
                laws: vec![law],
            };
            for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let residual = natural_map(&problem, &[Vec2::new(x, 0.0)]);
                assert!(!residual.certified(1.0), "{law:?} {x}: {residual:?}");
            }
        }
    }

    /// Two motors on one body. At their upper bounds they act against each other, and both are
    /// wrong by the whole free velocity. At their lower bounds the law is fulfilled.
    #[test]
    fn bounds_that_nothing_asks_for_set_no_scale() {
        let mut operator = DMatrix::identity(4, 4);
        (operator[(0, 2)], operator[(2, 0)]) = (-1.0, -1.0);
        let bound = 1e10;
        let law = Law::Bounded {
            lower: -bound,
            upper: bound,
            compliance: 0.0,
        };
        let problem = ContactProblem {
            operator: Delassus::dense(operator),
            free: vec![Vec2::new(1.0, 0.0); 2],
            laws: vec![law; 2],
        };
        let at = |p: f64| natural_map(&problem, &[Vec2::new(p, 0.0); 2]);
        assert!(at(-bound).certified(1e-15));
        assert!(!at(bound).certified(1e-8), "{:?}", at(bound));
    }

    /// Bug: two equal rows that must move apart have no solution, but impulses of 1e20 N s against
    /// each other were certified, because their round-off explains any velocity.
    #[test]
    fn huge_impulses_are_no_certificate() {
        let mut operator = DMatrix::identity(4, 4);
        (operator[(0, 2)], operator[(2, 0)]) = (1.0, 1.0);
        let law = Law::Bounded {
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            compliance: 0.0,
        };
        let problem = ContactProblem {
            operator: Delassus::dense(operator),
            free: vec![Vec2::x(), -Vec2::x()],
            laws: vec![law; 2],
        };
        let at = |p: f64| natural_map(&problem, &[Vec2::new(p, 0.0), Vec2::new(-p, 0.0)]);
        for p in [0.0, 1.0, 1e10, 1e20] {
            assert!(!at(p).certified(1e-8), "{p}: {:?}", at(p));
        }
    }

    /// A contact that opens may push in a blend, but none may close, and none may pull.
    #[test]
    fn feasible_is_what_neither_closes_nor_pulls() {
        let problem = |b: f64| ContactProblem {
            operator: Delassus::dense(DMatrix::identity(2, 2)),
            free: vec![Vec2::new(b, 0.0)],
            laws: vec![Law::Contact {
                friction: 0.5,
                compliance: 0.0,
            }],
        };
        let of = |b: f64, n: f64, t: f64| feasibility(&problem(b), &[Vec2::new(n, t)]);
        assert!(of(-1.0, 2.0, 1.0).certified(1e-15));
        assert!(!natural_map(&problem(-1.0), &[Vec2::new(2.0, 1.0)]).certified(0.1));
        for (b, n, t) in [(-1.0, 0.5, 0.0), (-1.0, 2.0, 1.1), (3.0, -1.0, 0.0)] {
            assert!(!of(b, n, t).certified(1e-2), "{b} {n} {t}");
        }
        assert!(!of(f64::NAN, 1.0, 0.0).certified(1.0));
    }

    /// The second number of a bounded row moves the other rows, so it must be 0.
    #[test]
    fn a_bounded_row_has_no_tangential_impulse() {
        let mut operator = DMatrix::identity(4, 4);
        (operator[(1, 2)], operator[(2, 1)]) = (0.5, 0.5);
        let law = Law::Bounded {
            lower: -5.0,
            upper: 5.0,
            compliance: 0.0,
        };
        let problem = ContactProblem {
            operator: Delassus::dense(operator),
            free: vec![Vec2::new(-1.0, 0.0); 2],
            laws: vec![law; 2],
        };
        let certified = |p: [Vec2; 2]| natural_map(&problem, &p).certified(1e-8);
        assert!(certified([Vec2::x(), Vec2::x()]));
        assert!(!certified([Vec2::new(1.0, 4.0), -Vec2::x()]));
    }

    /// Bug: zero impulses do not stop a body of 1e308 kg with 1e308 m/s, but they were certified,
    /// because every residual is small relative to an infinite velocity.
    #[test]
    fn an_overflow_is_never_certified() {
        let problem = ContactProblem {
            operator: Delassus::dense(DMatrix::identity(2, 2) * 1e-308),
            free: vec![Vec2::new(-1e308, 1e308)],
            laws: vec![Law::Contact {
                friction: 2.0,
                compliance: 0.0,
            }],
        };
        assert!(!natural_map(&problem, &[Vec2::zeros()]).certified(1e-2));
    }

    /// Two pins that pull at a body in opposite directions by 1e9 N s, and move it by a rounding of that. Beside
    /// free velocities of 1e-3 m/s the work of the rounding is nothing, beside 1e-6 m/s a tenth.
    #[test]
    fn round_off_that_does_work_is_not_granted() {
        for (free, granted) in [(1e-3, true), (1e-6, false)] {
            // the third block gives the scale, 1 m/s
            let along =
                DMatrix::from_row_slice(3, 3, &[1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
            let both = along.kronecker(&DMatrix::identity(2, 2));
            let problem = ContactProblem {
                operator: Delassus::dense(both),
                free: vec![Vec2::x() * free, Vec2::x() * free, Vec2::x()],
                laws: vec![Law::Pin; 3],
            };
            let impulses = [1e9, -1e9 - free, -1.0].map(|p| Vec2::new(p, 0.0));
            let residual = natural_map(&problem, &impulses);
            let off = residual.velocity;
            assert!((1e-8..1e-6).contains(&off), "{off} m/s");
            assert_eq!(residual.certified(1e-8), granted, "{free}: {residual:?}");
        }
    }
}
