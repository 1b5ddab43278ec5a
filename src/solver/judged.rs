use super::{FactorCache, ImpulseSolver, SolveReport, Velocities};
use crate::contact::{ContactProblem, Judge, Vec2};

/// Wraps a user's solver: the judge, not the solver, provides residual, status and velocities.
pub(crate) struct Judged {
    solver: Box<dyn ImpulseSolver>,
    judge: Judge,
}

impl Judged {
    pub fn new(solver: Box<dyn ImpulseSolver>) -> Judged {
        Judged {
            solver,
            judge: Judge::default(),
        }
    }

    fn judge(
        &mut self,
        problem: &ContactProblem,
        impulses: &[Vec2],
        tolerance: f64,
        work: &SolveReport,
    ) -> SolveReport {
        self.judge.prepare(problem);
        let residual = self.judge.natural_map(problem, impulses);
        SolveReport::of(residual, tolerance).after(work)
    }
}

impl ImpulseSolver for Judged {
    fn name(&self) -> &'static str {
        self.solver.name()
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
    ) -> SolveReport {
        let work = self.solver.solve(problem, impulses, tolerance);
        self.judge(problem, impulses, tolerance, &work)
    }

    fn solve_next(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        cache: &mut FactorCache,
    ) -> SolveReport {
        let work = self.solver.solve_next(problem, impulses, tolerance, cache);
        self.judge(problem, impulses, tolerance, &work)
    }

    fn velocities(&self) -> Option<Velocities<'_>> {
        // the judge's velocities, so that the bits do not depend on the solver
        let known = self.solver.velocities()?;
        let judged = Velocities::of(&self.judge);
        Some(match known.bodies {
            [] => Velocities {
                bodies: &[],
                ..judged
            },
            _ => judged,
        })
    }
}
