//! Newton's restitution without invented energy.

use crate::contact::{ContactProblem, Law, Vec2};
use crate::solver::{ImpulseSolver, SolveReport};

/// What an island's rigid contacts did to the energy.
pub(super) struct Capped {
    pub report: SolveReport,
    /// Whether the impulses were blended down.
    pub capped: bool,
}

/// One block of the island as the cap sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct CapBlock {
    /// Relative velocity at the start of the step \[m/s\].
    pub gamma_a: Vec2,
    /// What the rule added to `γ_F`: `b = γ_F + free`.
    pub free: Vec2,
    /// A rigid unilateral contact; others store or feed energy rightly and are exempt.
    pub rigid: bool,
    /// A pin or locked axis, which is to close its gap no more than others are pushed out.
    pub held: bool,
    /// A rebounding impact.
    pub impact: bool,
}

/// Bounds the energy that rigid contacts add,
///
/// ```text
/// W(P) = Σ Pᵀ (γ_A + γ_E)/2 ≤ 0                                              (1)
/// ```
///
/// Where a solved island has `W > 0` (in a step with an impact; else above 2 % of `Σ P² G/2`) it
/// is solved again without restitution and push-out, and the two answers are blended with the
/// largest share of the first that keeps (1). Both lie in the cone and keep the bodies apart, and
/// so does the blend, by convexity. `velocities` is `G P + b` \[m/s\] at the first answer.
///
/// # Source
/// Own construction; see Glocker, *Energetic consistency conditions for standard impacts* (2013)
/// for why Newton's law needs it.
pub(super) fn cap(
    solver: &mut dyn ImpulseSolver,
    problem: &ContactProblem,
    blocks: &[CapBlock],
    (impulses, velocities): (&mut [Vec2], &[Vec2]),
    report: SolveReport,
    tolerance: f64,
) -> Capped {
    let impact = blocks.iter().any(|b| b.impact);
    // without an impact or a push-out nothing can feed energy in
    if !impact && blocks.iter().all(|b| b.free.x >= 0.0 && b.free.y == 0.0) {
        return Capped {
            report,
            capped: false,
        };
    }
    let gamma_1 = |i: usize| velocities[i] - blocks[i].free;
    let rigid = (0..impulses.len()).filter(|&i| blocks[i].rigid);
    let work = work_of(blocks, impulses, gamma_1);
    if work <= 0.0 {
        return Capped {
            report,
            capped: false,
        };
    }
    // impulses of a wedge can be huge beside what they change: round-off goes with the products
    let allowed: f64 = if impact {
        let product =
            |i: usize| impulses[i].norm() * (blocks[i].gamma_a.norm() + gamma_1(i).norm());
        1e-13 * rigid.map(product).sum::<f64>()
    } else {
        let change = |i: usize| impulses[i].norm_squared() * problem.operator.diagonal(i).trace();
        0.02 * rigid.map(|i| 0.5 * change(i)).sum::<f64>()
    };
    if work <= allowed {
        return Capped {
            report,
            capped: false,
        };
    }
    let first = impulses.to_vec();
    let mut plain = problem.clone();
    let calm = |i: usize| {
        if blocks[i].rigid {
            Vec2::new(blocks[i].free.x.max(0.0), 0.0)
        } else if blocks[i].held {
            Vec2::zeros()
        } else {
            blocks[i].free
        }
    };
    for (i, b) in plain.free.iter_mut().enumerate() {
        *b += calm(i) - blocks[i].free;
    }
    let mut zero = vec![Vec2::zeros(); first.len()];
    let second = solver.solve(&plain, &mut zero, tolerance);
    let mut plain_velocities = Vec::new();
    plain.velocities(&zero, &mut plain_velocities);
    let gamma_0 = |i: usize| plain_velocities[i] - calm(i);
    let at = |s: f64| {
        let p: Vec<Vec2> = zero.iter().zip(&first).map(|(a, b)| a.lerp(b, s)).collect();
        let g = |i: usize| gamma_0(i).lerp(&gamma_1(i), s);
        (work_of(blocks, &p, g), p)
    };
    let share = largest_share([at(0.0).0, at(0.5).0, at(1.0).0]);
    impulses.copy_from_slice(&at(share).1);
    // the blend solves neither problem to the letter: it is as good as the worse of the two
    let mut report = report.after(&second);
    if !second.solved() {
        report.status = second.status;
        report.residual = second.residual;
    }
    Capped {
        report,
        capped: true,
    }
}

/// `W` of equation (1) of [`cap`] \[J\].
fn work_of(blocks: &[CapBlock], impulses: &[Vec2], gamma_end: impl Fn(usize) -> Vec2) -> f64 {
    (0..impulses.len())
        .filter(|&i| blocks[i].rigid)
        .map(|i| 0.5 * impulses[i].dot(&(blocks[i].gamma_a + gamma_end(i))))
        .sum()
}

/// Energy \[J\] that the rigid contacts of an island add by impulses that lead to `G P + b`.
pub(super) fn work(blocks: &[CapBlock], impulses: &[Vec2], velocities: &[Vec2]) -> f64 {
    work_of(blocks, impulses, |i| velocities[i] - blocks[i].free)
}

/// Largest `s` in [0, 1] with `w(s) ≤ 0`, `w` the parabola through (0, ½, 1).
pub(super) fn largest_share([w0, wh, w1]: [f64; 3]) -> f64 {
    let curvature = 2.0 * (w0 + w1) - 4.0 * wh;
    let slope = w1 - w0 - curvature;
    if w1 <= 0.0 {
        return 1.0;
    }
    if w0 >= 0.0 {
        return 0.0;
    }
    // exactly one crossing in (0, 1): w0 < 0 < w1
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let s = 0.5 * (low + high);
        if w0 + s * (slope + s * curvature) <= 0.0 {
            low = s;
        } else {
            high = s;
        }
    }
    low
}

/// Whether a law is a rigid unilateral contact.
pub(super) fn is_rigid(law: &Law) -> bool {
    matches!(law, Law::Contact { compliance, .. } if *compliance == 0.0)
}
