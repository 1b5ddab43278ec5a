use super::{Carried, ImpulseSolver, SolveReport};
use crate::contact::{ContactProblem, Vec2};

/// A solver whose word does not count: whatever it reports, the judge's figure and status stand.
pub(crate) struct Judged(pub Box<dyn ImpulseSolver>);

impl ImpulseSolver for Judged {
    fn name(&self) -> &'static str {
        self.0.name()
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
    ) -> SolveReport {
        let work = self.0.solve(problem, impulses, tolerance);
        SolveReport::judged(problem, impulses, tolerance).after(&work)
    }

    fn solve_on(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        carried: &mut Carried,
    ) -> SolveReport {
        let work = self.0.solve_on(problem, impulses, tolerance, carried);
        SolveReport::judged(problem, impulses, tolerance).after(&work)
    }
}
