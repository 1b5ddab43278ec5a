//! The fallback for an island whose rigid problem has no solution, or none that the solver finds.
//! Its problem is regularised: each rigid contact gets a small compliance.
//!
//! With `ξ_N + R P_N` in place of `ξ_N`, `R = compliance · G_NN`, every problem has a solution (the
//! operator is strictly copositive), and this solution is bounded.

use super::interval::{Interval, Source};
use super::island_problem::IslandProblem;
use crate::contact::{ContactProblem, Law, Vec2};
use crate::solver::SolveReport;
use serde::{Deserialize, Serialize};

/// An island with more blocks uses the fallback at once. Another rigid solve would take seconds and
/// end at the same residual.
pub(super) const LARGE: usize = 500;

/// Largest residual of the best rigid impulses, as a share of the island's velocity scale, at which
/// they are still used. An island in fallback stays there until a rigid solve is certified: impulses
/// that nearly solve one step rarely nearly solve the next, and they cost as much as a failed solve.
const CLOSE: f64 = 1e-4;

/// Residual, as a share of the island's velocity scale, above which the problem may have no
/// solution. The residual of a problem without a solution is about as large as the velocity scale.
const HOPELESS: f64 = 0.01;

/// Steps without a rigid solve after the first failure. Each further failure doubles them, up to
/// `LONGEST`.
const FIRST: u8 = 4;
const LONGEST: u8 = 32;

/// Relative residual at which the regularised problem of a large island counts as solved. The
/// regularisation itself, [`COMPLIANCE`], is a hundred times as large.
pub(super) const ENOUGH: f64 = 1e-4;

/// Compliance of a regularised contact, as a share of its own inverse mass `G_NN`.
const COMPLIANCE: f64 = 0.01;

/// Fallback state of a large island: the number of consecutive failures of its rigid problem, and
/// the number of steps left until the next rigid solve. That is 4, 8, 16 and then 32 steps.
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

    /// The state after a step. `report` judges the impulses of the rigid problem, or the start
    /// impulses if the rigid problem was left out. The island must use the fallback if the new
    /// state is active.
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

/// Gives the rigid contacts of a problem `ξ_N + R P_N` in place of `ξ_N`, with
/// `R = compliance_of(i) · G_NN`.
pub(super) fn regularise(problem: &mut ContactProblem, compliance_of: impl Fn(usize) -> f64) {
    for i in 0..problem.len() {
        let block = problem.operator.diagonal(i);
        if let Law::Contact { compliance, .. } = &mut problem.laws[i]
            && *compliance == 0.0
        {
            *compliance = compliance_of(i) * block[(0, 0)];
        }
    }
}

/// The regularised problem of an island.
pub(super) fn regularised(problem: &ContactProblem) -> ContactProblem {
    let mut regularised = problem.clone();
    regularise(&mut regularised, |_| COMPLIANCE);
    regularised
}

/// Adds push-outs to a regularised problem, for contacts that were regularised in the last step too:
///
/// ```text
/// b_N = −min(−g/Δt, max(−γ_A, R P_N,before))    of contacts with g < 0           (1)
/// ```
///
/// Without it a persistent load sinks in by `R P_N Δt` every other step. With it a contact is a
/// spring. From step to step it returns at most `R (P²_before − P²)/2` \[J\], which it absorbed
/// before. `P_before` is the start impulse.
pub(super) fn push_back(
    regularised: &mut ContactProblem,
    island: &IslandProblem,
    interval: &Interval,
    members: &[u32],
) {
    for (k, &i) in members.iter().enumerate() {
        let terms = &island.terms[k];
        let (Source::Contact(index), Law::Contact { compliance, .. }, true) = (
            interval.blocks[i as usize].source,
            regularised.laws[k],
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
            regularised.free[k].x = regularised.free[k].x.min(push);
        }
    }
}

/// Chooses the impulses of an island in fallback. `impulses` holds the best rigid ones on entry,
/// `found` those of the regularised problem, which are used if they solve it. `total` is the report
/// of that solve, including the work of all earlier ones. Returns the report for the rigid `problem`.
///
/// Rigid boxes wedged between each other can hold any self-stress. If the best rigid impulses are
/// not quite a solution, their self-stress is amplified from step to step until its residual
/// scatters the heap. The regularised problem bounds the self-stress. If that is not solved either,
/// the impulses used are never worse than zero impulses.
pub(super) fn choose_regularised(
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
