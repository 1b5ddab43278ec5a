//! The fallback for an island without rigid impulses: its contacts are softened a little.
//!
//! With `ξ_N + R P_N`, `R = softness G_NN`, every problem has a solution (the operator is strictly
//! copositive), and it is bounded.

use super::interval::{Interval, Source};
use super::island_problem::IslandProblem;
use crate::contact::{ContactProblem, Law, Vec2};
use crate::solver::SolveReport;
use serde::{Deserialize, Serialize};

/// An island with more blocks uses the fallback at once. Another rigid solve would take seconds and
/// end at the same residual.
pub(super) const LARGE: usize = 500;

/// Share of the island's velocity scale that the best rigid impulses may leave unsolved and still
/// be used. Once an island uses the fallback, it does so until a rigid solve is certified: nearly
/// solved impulses are rarely nearly solved in the next step, and cost as much as a failed solve.
const CLOSE: f64 = 1e-4;

/// Above this unsolved share of the island's velocity scale, the problem may have no solution. A
/// problem without a solution leaves about all of it unsolved.
const HOPELESS: f64 = 0.01;

/// Steps without a rigid solve after the first failure. Each further failure doubles them, up to
/// `LONGEST`.
const FIRST: u8 = 4;
const LONGEST: u8 = 32;

/// Relative residual at which softened contacts of a large island count as solved. The softening
/// itself is a hundred times as large.
pub(super) const ENOUGH: f64 = 1e-4;

/// Compliance of a softened contact, as a share of its own inverse mass.
const SOFTNESS: f64 = 0.01;

/// The number of consecutive failures of a large island's rigid problem, and the remaining steps
/// until the next try: 4, 8, 16 and 32.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(super) struct Fallback {
    failed: u8,
    wait: u8,
}

impl Fallback {
    /// Whether the last step used the fallback.
    pub fn active(self) -> bool {
        self.failed > 0
    }

    /// Whether this step leaves out the rigid problem.
    pub fn skips_rigid(self) -> bool {
        self.wait > 0
    }

    /// The state within a step: an island in fallback does not try its rigid problem again before
    /// the end of the step.
    pub fn within(self) -> Fallback {
        Fallback {
            wait: self.wait.max(u8::from(self.active())),
            ..self
        }
    }

    /// The state after a step. `report` is that of the rigid problem, or of the start impulses if
    /// it was left out. The island must use the fallback if the new state is active.
    pub fn after(self, report: &SolveReport) -> Fallback {
        let left = &report.residual;
        let close = left.velocity <= CLOSE * left.velocity_scale;
        if report.solved() {
            Fallback::default()
        } else if self.skips_rigid() {
            Fallback {
                wait: self.wait - 1,
                ..self
            }
        } else if self.active() || !close {
            let doublings = u32::from(self.failed).min(3);
            Fallback {
                failed: self.failed.saturating_add(1),
                wait: (FIRST << doublings).min(LONGEST),
            }
        } else {
            self
        }
    }
}

/// Whether an island may have no solution at all.
pub(super) fn hopeless(report: &SolveReport) -> bool {
    let left = &report.residual;
    !report.solved() && left.velocity > HOPELESS * left.velocity_scale
}

/// Adds `ξ_N + R P_N`, `R = softness(i) G_NN`, to the rigid contacts of a problem.
pub(super) fn soften(problem: &mut ContactProblem, softness: impl Fn(usize) -> f64) {
    for i in 0..problem.len() {
        let block = problem.operator.diagonal(i);
        if let Law::Contact { compliance, .. } = &mut problem.laws[i]
            && *compliance == 0.0
        {
            *compliance = softness(i) * block[(0, 0)];
        }
    }
}

/// The problem of an island with softened contacts.
pub(super) fn softened(problem: &ContactProblem) -> ContactProblem {
    let mut soft = problem.clone();
    soften(&mut soft, |_| SOFTNESS);
    soft
}

/// Adds push-out to the contacts of a softened problem that were already soft in the last step:
///
/// ```text
/// b_N = −min(−g/Δt, max(−γ_A, R P_N,before))    of contacts with g < 0           (1)
/// ```
///
/// Without it a persistent load sinks in by `R P_N Δt` every other step. With it a contact is a
/// spring. From step to step it returns at most `R (P²_before − P²)/2` \[J\], which it absorbed
/// before. `P_before` is the start impulse.
pub(super) fn push_back(
    soft: &mut ContactProblem,
    island: &IslandProblem,
    interval: &Interval,
    members: &[u32],
) {
    for (k, &i) in members.iter().enumerate() {
        let terms = &island.terms[k];
        let (Source::Contact(index), Law::Contact { compliance, .. }, true) = (
            interval.blocks[i as usize].source,
            soft.laws[k],
            terms.rigid && !terms.impact,
        ) else {
            continue;
        };
        let contact = &interval.detection.contacts[index];
        let depth = -(contact.gap + contact.gap_noise);
        if depth > 0.0 {
            let before = interval.warm[i as usize].x;
            let most = (compliance * before).max(-terms.gamma_a.x).max(0.0);
            let push = terms.gamma_f.x - most.min(depth / interval.length);
            soft.free[k].x = soft.free[k].x.min(push);
        }
    }
}

/// Chooses the impulses of an island in fallback. `impulses` holds the best rigid ones on entry,
/// `found` those of the softened problem, which are used if they solve it. `total` is the report of
/// that solve, including the work of all earlier ones. Returns the report for the rigid `problem`.
///
/// Rigid boxes wedged between each other can hold any self-stress. If the best rigid impulses are
/// not quite a solution, their self-stress is amplified from step to step until its residual
/// scatters the heap. The softened problem bounds it. If that is not solved either, the impulses
/// used are never worse than zero impulses.
pub(super) fn choose_softened(
    problem: &ContactProblem,
    total: &SolveReport,
    found: &[Vec2],
    impulses: &mut [Vec2],
    tolerance: f64,
) -> SolveReport {
    let none = vec![Vec2::zeros(); impulses.len()];
    let left = |p: &[Vec2]| SolveReport::judged(problem, p, tolerance).residual.velocity;
    if total.solved() {
        impulses.copy_from_slice(found);
    } else {
        let (own, nothing) = (left(impulses), left(&none));
        if own > nothing || own.is_nan() {
            impulses.copy_from_slice(&none);
        }
    }
    SolveReport::judged(problem, impulses, tolerance).after(total)
}
