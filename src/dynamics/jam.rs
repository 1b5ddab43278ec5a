//! Large islands that no rigid impulses are found for: their contacts give way a little.

use super::cap::is_rigid;
use super::model::ContactKey;
use super::stage::{Source, Stage};
use crate::contact::{ContactProblem, Law, Vec2};
use crate::solver::SolveReport;
use serde::{Deserialize, Serialize};

/// Blocks above which an island that jams gives way at once: another rigid solve costs seconds, and
/// ends where the first one did.
pub(super) const LARGE: usize = 500;

/// Share of the island's own velocities that the best rigid impulses may leave unsolved and still
/// be used.
const CLOSE: f64 = 1e-4;

/// Steps without a rigid solve after the first one that fails; each further one doubles them, up to
/// the longest.
const FIRST: u8 = 4;
const LONGEST: u8 = 32;

/// Relative residual at which soft contacts count as solved: what they give way by is a hundred
/// times as much.
pub(super) const ENOUGH: f64 = 1e-4;

/// Share of a contact's own inverse mass by which it gives way.
pub(super) const SOFTNESS: f64 = 0.01;

/// How often the rigid problem of a large island has failed, one step after the other, and for how
/// many steps it is not tried again: 4, 8, 16 and 32.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(super) struct Jam {
    failed: u8,
    wait: u8,
}

impl Jam {
    /// Whether the island gave way in the last step.
    pub fn jammed(self) -> bool {
        self.failed > 0
    }

    /// Whether the rigid problem is left out in this step.
    pub fn waits(self) -> bool {
        self.wait > 0
    }

    /// Takes note of a step, with what the rigid solve made of it where it was tried. Whether the
    /// island has to give way.
    pub fn note(&mut self, report: &SolveReport) -> bool {
        let left = &report.residual;
        if report.solved() || left.velocity <= CLOSE * left.velocity_scale {
            *self = Jam::default();
        } else if self.waits() {
            self.wait -= 1;
        } else {
            self.failed = self.failed.saturating_add(1);
            let doublings = u32::from(self.failed - 1).min(3);
            self.wait = (FIRST << doublings).min(LONGEST);
        }
        self.jammed()
    }
}

/// What islands are remembered by, and how they jam.
pub(super) type Jams = Vec<(ContactKey, Jam)>;

/// Adds to the rigid contacts of a problem `ξ_N + R P_N`, `R = softness G_NN`.
pub(super) fn soften(problem: &mut ContactProblem, softness: f64) {
    for i in 0..problem.len() {
        let block = problem.operator.diagonal(i);
        if let Law::Contact { compliance, .. } = &mut problem.laws[i]
            && *compliance == 0.0
        {
            *compliance = softness * block[(0, 0)];
        }
    }
}

/// Has what gave way in the last step, with the impulses `before`, pushed out again:
///
/// ```text
/// b_N = −min(−g/Δt, max(−γ_A, R P_N,before))    of contacts with g < 0           (1)
/// ```
///
/// Without it a load that stays sinks in by `R P_N Δt` every other step. With it a contact is a
/// spring: from step to step it gives back at most `R (P²_before − P²)/2` \[J\], which it took
/// before.
pub(super) fn push_back(
    problem: &mut ContactProblem,
    stage: &Stage,
    members: &[u32],
    before: impl Fn(u32) -> Vec2,
) {
    for (k, &i) in members.iter().enumerate() {
        let block = &stage.blocks[i as usize];
        let (Source::Contact(index), Law::Contact { compliance, .. }, true) = (
            block.source,
            problem.laws[k],
            is_rigid(&stage.laws[i as usize]),
        ) else {
            continue;
        };
        let contact = &stage.detection.contacts[index];
        let depth = -(contact.gap + contact.gap_noise);
        if depth > 0.0 && !block.impact {
            let most = (compliance * before(i).x).max(-block.gamma_a.x).max(0.0);
            let push = block.gamma_f.x - most.min(depth / stage.length);
            problem.free[k].x = problem.free[k].x.min(push);
        }
    }
}

/// Takes for a large island that jams the impulses `found` of its soft problem, of whose solve, and of
/// all before it, `spent` tells.
///
/// Rigid boxes that wedge each other in can hold any self-stress: where the best impulses found
/// are not quite a solution, theirs is multiplied from step to step, until what is left of it
/// throws the heap about. The soft problem bounds it. Where it is not solved either, what is used
/// is never worse than no impulses at all. It is the rigid problem that the report speaks of.
pub(super) fn yield_to(
    problem: &ContactProblem,
    spent: &SolveReport,
    found: &[Vec2],
    impulses: &mut [Vec2],
    tolerance: f64,
) -> SolveReport {
    let none = vec![Vec2::zeros(); impulses.len()];
    let left = |p: &[Vec2]| SolveReport::judged(problem, p, tolerance).residual.velocity;
    let nothing = left(&none);
    if spent.solved() {
        impulses.copy_from_slice(found);
    } else if left(impulses) > nothing || left(impulses).is_nan() {
        impulses.copy_from_slice(&none);
    }
    SolveReport::judged(problem, impulses, tolerance).after(spent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Residual;
    use crate::solver::SolveStatus;

    fn report(status: SolveStatus, velocity: f64) -> SolveReport {
        SolveReport {
            status,
            sweeps: 0,
            factorisations: 0,
            pivots: 0,
            residual: Residual {
                velocity,
                velocity_scale: 1.0,
                ..Residual::default()
            },
        }
    }

    /// A problem that keeps failing is tried less and less often, one that is solved or nearly so
    /// at once again.
    #[test]
    fn what_fails_is_tried_again_after_ever_more_steps() {
        let fails = report(SolveStatus::Unsolved, 0.1);
        let mut jam = Jam::default();
        let tried: Vec<usize> = (0..200)
            .filter(|_| {
                let tries = !jam.waits();
                assert!(jam.note(&fails) && jam.jammed());
                tries
            })
            .collect();
        assert_eq!(tried, [0, 5, 14, 31, 64, 97, 130, 163, 196]);
        for good in [
            report(SolveStatus::Solved, 0.0),
            report(SolveStatus::Unsolved, 1e-5),
        ] {
            let mut jam = jam;
            assert!(!jam.note(&good));
            assert_eq!(jam, Jam::default());
        }
    }
}
