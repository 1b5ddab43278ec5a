//! Closing velocities of redundant joints.

use super::island_problem::IslandProblem;
use crate::contact::Vec2;
use crate::solver::SolveReport;

/// Share of the largest closing velocity of an island by which [`settle_closings`] may change those
/// of its joints. A closing takes back the error of earlier steps: a thousandth of it may as well
/// wait for the next one. Joints that cannot close at all contradict each other by far more.
const SHARE: f64 = 1e-3;

/// Replaces closing velocities that contradict each other.
///
/// The closing velocities `c = (g + n/2)/h` of pins and locked axes, see (1) of
/// [`super::joint_rules`], agree with each other if there is one motion that closes all gaps. With
/// redundant joints, as in a net of pins, they do so only up to second order in the turn of the
/// bodies, and then no impulses give all of them. If `impulses` leave velocities `ξ` with
///
/// ```text
/// |ξ_i| ≤ 1e-3 max_j |c_j|   in all pins and locks,                              (1)
/// ```
///
/// the problem of the step gets `c − ξ`, the closing velocities of a motion. The judge then decides
/// again about the impulses. Contacts, limits and motors keep their `b`.
///
/// Returns the report for the changed problem. `None` leaves the problem as it is: if the report is
/// already that of a solution, if (1) does not hold, or if the changed problem is not solved either.
///
/// # Source
/// Own construction.
pub(super) fn settle_closings(
    island: &mut IslandProblem,
    impulses: &[Vec2],
    report: &SolveReport,
    tolerance: f64,
) -> Option<SolveReport> {
    if report.solved() || island.bilateral.is_empty() {
        return None;
    }
    let problem = &mut island.problem;
    let mut velocities = Vec::new();
    problem.velocities(impulses, &mut velocities);
    let blocks = || island.bilateral.iter().map(|joint| joint.block);
    let closing = |k: usize| (problem.free[k] - island.terms[k].gamma_f).norm();
    let most = SHARE * blocks().map(closing).fold(0.0, f64::max);
    if !blocks().all(|k| velocities[k].norm() <= most) {
        return None;
    }
    let posed = problem.free.clone();
    for k in blocks() {
        problem.free[k] -= velocities[k];
    }
    let settled = SolveReport::judged(problem, impulses, tolerance);
    if !settled.solved() {
        problem.free = posed;
        return None;
    }
    Some(settled.after(report))
}

#[cfg(test)]
mod tests {
    use super::super::contact_cache::JointEnergy;
    use super::super::island_problem::{BilateralJoint, Terms};
    use super::*;
    use crate::contact::{
        BodyOperator, ContactProblem, Delassus, Law, NO_BODY, Rows, Vec3, natural_map,
    };
    use crate::solver::{Direct, ImpulseSolver};

    /// A body of 1 kg on two pins at the same place. The second closes faster by `more` \[m/s\].
    fn twice_pinned(more: f64) -> IslandProblem {
        let rows = Rows {
            bodies: [NO_BODY, 0],
            jacobian: [[Vec3::zeros(); 2], [Vec3::x(), Vec3::y()]],
        };
        let gamma_f = Vec2::new(0.0, -0.2);
        let free = [0.0, more].map(|more| gamma_f + Vec2::new(0.1 + more, 0.0));
        let terms = free.map(|bias| Terms {
            gamma_a: gamma_f,
            gamma_f,
            bias,
            rigid: false,
            bilateral: true,
            impact: false,
            pressed_before: false,
        });
        let joint = |block| BilateralJoint {
            block,
            joint: block,
            energy: JointEnergy::default(),
        };
        IslandProblem {
            problem: ContactProblem {
                operator: Delassus::Bodies(BodyOperator {
                    inverse_mass: vec![Vec3::new(1.0, 1.0, 0.0)],
                    rows: vec![rows; 2],
                }),
                free: free.to_vec(),
                laws: vec![Law::Pin; 2],
            },
            terms: terms.to_vec(),
            bilateral: vec![joint(0), joint(1)],
            ..IslandProblem::default()
        }
    }

    /// Bug: a net of 10 x 10 pinned discs was unsolved in 71 of 300 steps. Its closing velocities
    /// contradicted each other by 2e-9 m/s of 6e-5, which no impulses can mend.
    #[test]
    fn closings_that_nearly_agree_are_settled() {
        for (more, settles) in [(0.0, false), (2e-5, true), (2e-3, false)] {
            let mut island = twice_pinned(more);
            let (posed, mut impulses) = (island.problem.clone(), vec![Vec2::zeros(); 2]);
            let report = Direct::default().solve(&posed, &mut impulses, 1e-8);
            assert_eq!(report.solved(), more == 0.0, "{more}");
            let settled = settle_closings(&mut island, &impulses, &report, 1e-8);
            assert_eq!(settled.is_some(), settles, "{more}");
            let changed = island.problem.free[1] - posed.free[1];
            if let Some(settled) = settled {
                // half way between both
                assert!((changed.x + 0.5 * more).abs() < 1e-9, "{changed}");
                assert!(natural_map(&island.problem, &impulses).certified(1e-8));
                assert!(settled.factorisations == report.factorisations);
            } else {
                assert_eq!(changed, Vec2::zeros(), "{more}");
            }
        }
    }
}
