use super::{Direct, Enumeration, FactorCache, ImpulseSolver, SolveReport, Velocities};
use crate::contact::{ContactProblem, Vec2};

/// Chooses the method by the size of the island, and falls back in a fixed order.
///
/// 1. Up to four frictional contacts, in up to eight blocks: [`Enumeration`]. From nothing it costs
///    up to twice what `direct` does, a microsecond or two; but it says which of several solutions it
///    takes, and from the statuses of the last step it is one linear system.
/// 2. Larger, or not solved by it: [`Direct`], whose own stages go by how far the last step's
///    impulses still fit: a certificate of them costs next to nothing at rest. From five blocks on
///    no other method is cheaper (`moreau2d bench --solvers`).
///
/// The best impulses met are returned, flagged when nothing certified them.
#[derive(Debug, Clone, Default)]
pub struct Auto {
    enumeration: Enumeration,
    direct: Direct,
    /// Whether the impulses returned are those of `direct`.
    direct_last: bool,
}

/// Blocks up to which enumeration comes first: its systems are dense, and pins add no combination.
const ENUMERATED: usize = 8;

impl ImpulseSolver for Auto {
    fn name(&self) -> &'static str {
        "auto"
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
    ) -> SolveReport {
        self.run(problem, impulses, tolerance, None)
    }

    fn solve_next(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        carried: &mut FactorCache,
    ) -> SolveReport {
        self.run(problem, impulses, tolerance, Some(carried))
    }

    fn velocities(&self) -> Option<Velocities<'_>> {
        self.direct.velocities().filter(|_| self.direct_last)
    }
}

impl Auto {
    fn run(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        carried: Option<&mut FactorCache>,
    ) -> SolveReport {
        self.direct_last = false;
        let few = problem.len() <= ENUMERATED
            && Enumeration::combinations(&problem.laws) <= self.enumeration.max_combinations;
        let report = if few {
            let report = self.enumeration.solve(problem, impulses, tolerance);
            if report.solved() {
                return report;
            }
            let again = self.direct.solve(problem, impulses, tolerance);
            again.after(&report)
        } else {
            self.direct.run(problem, impulses, tolerance, carried)
        };
        self.direct_last = !few && report.solved();
        report
    }
}
