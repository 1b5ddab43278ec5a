//! What is done where no rigid impulses are found for an island: its contacts give way a little.
//!
//! With `ξ_N + R P_N`, `R = softness G_NN`, there is a solution whatever is posed (the operator is
//! strictly copositive), and it is bounded.

use super::interval::{Interval, Source};
use super::island_problem::IslandProblem;
use crate::contact::{ContactProblem, Law, Vec2};
use crate::solver::SolveReport;
use serde::{Deserialize, Serialize};

/// Blocks above which an island without rigid impulses gives way at once: another rigid solve costs
/// seconds, and ends where the first one did.
pub(super) const LARGE: usize = 500;

/// Share of the island's own velocities that the best rigid impulses may leave unsolved and still
/// be used. An island that has given way goes on giving way until one solve is certified: what is
/// only close is seldom close in the next step, and costs as much as what fails.
const CLOSE: f64 = 1e-4;

/// Share of the island's own velocities beyond which the best impulses leave a problem unsolved that
/// may have no solution: one without leaves about all of them.
const HOPELESS: f64 = 0.01;

/// Steps without a rigid solve after the first one that fails. Each further failure doubles them, up
/// to the longest.
const FIRST: u8 = 4;
const LONGEST: u8 = 32;

/// Relative residual at which soft contacts of a large island count as solved: what they give way by
/// is a hundred times as much.
pub(super) const ENOUGH: f64 = 1e-4;

/// Share of a contact's own inverse mass by which it gives way.
const SOFTNESS: f64 = 0.01;

/// How often the rigid problem of a large island has failed, one step after the other, and for how
/// many steps it is not tried again: 4, 8, 16 and 32.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(super) struct Fallback {
    failed: u8,
    wait: u8,
}

impl Fallback {
    /// Whether the island gave way in the last step.
    pub fn active(self) -> bool {
        self.failed > 0
    }

    /// Whether the rigid problem is left out in this step.
    pub fn waits(self) -> bool {
        self.wait > 0
    }

    /// The same within a step: an island that gave way waits to the end of the step.
    pub fn within(self) -> Fallback {
        Fallback {
            wait: self.wait.max(u8::from(self.active())),
            ..self
        }
    }

    /// The state after a step in which `report` came of the rigid problem, or of the impulses to
    /// start from where it was left out. The island has to give way if it is active.
    pub fn after(self, report: &SolveReport) -> Fallback {
        let left = &report.residual;
        let close = left.velocity <= CLOSE * left.velocity_scale;
        if report.solved() {
            Fallback::default()
        } else if self.waits() {
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

/// The problem of an island whose contacts give way.
pub(super) fn softened(problem: &ContactProblem) -> ContactProblem {
    let mut soft = problem.clone();
    soften(&mut soft, |_| SOFTNESS);
    soft
}

/// Has the contacts of a `soft` problem that gave way in the last step pushed out again:
///
/// ```text
/// b_N = −min(−g/Δt, max(−γ_A, R P_N,before))    of contacts with g < 0           (1)
/// ```
///
/// Without it a load that stays sinks in by `R P_N Δt` every other step. With it a contact is a
/// spring: from step to step it gives back at most `R (P²_before − P²)/2` \[J\], which it took
/// before. `P_before` is the impulse to start from.
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

/// Takes the impulses `found` of the soft problem into `impulses`, which held the best rigid ones.
/// `spent` is the report of that solve, with the work of all before it. The report returned is of the
/// rigid `problem`.
///
/// Rigid boxes that wedge each other in can hold any self-stress. Where the best impulses found are
/// not quite a solution, theirs is multiplied from step to step, until what is left of it throws the
/// heap about. The soft problem bounds it. Where it is not solved either, what is used is never worse
/// than no impulses at all.
pub(super) fn take_soft(
    problem: &ContactProblem,
    spent: &SolveReport,
    found: &[Vec2],
    impulses: &mut [Vec2],
    tolerance: f64,
) -> SolveReport {
    let none = vec![Vec2::zeros(); impulses.len()];
    let left = |p: &[Vec2]| SolveReport::judged(problem, p, tolerance).residual.velocity;
    if spent.solved() {
        impulses.copy_from_slice(found);
    } else {
        let (own, nothing) = (left(impulses), left(&none));
        if own > nothing || own.is_nan() {
            impulses.copy_from_slice(&none);
        }
    }
    SolveReport::judged(problem, impulses, tolerance).after(spent)
}
