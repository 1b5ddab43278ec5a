use super::{Direct, Enumeration, FactorCache, ImpulseSolver, Lemke, SolveReport, Velocities};
use crate::contact::{ContactProblem, Law, Vec2};

/// Chooses the method by the size of the island, and falls back in a fixed order.
///
/// 1. Up to four frictional contacts, in up to eight blocks: [`Enumeration`]. From a cold start it
///    costs up to twice as much as `direct`, a microsecond or two, but its choice among several
///    solutions is documented. With the statuses of the last step it solves one linear system.
/// 2. Larger problems, and those that enumeration did not solve: [`Direct`]. Its stages depend on
///    how well the impulses of the last step still fit; at rest it only certifies them, which costs
///    almost nothing. From five blocks on no other method is cheaper (`moreau2d bench --solvers`).
/// 3. Still unsolved, not of joints alone, and up to [`Auto::lemke_limit`] blocks: [`Lemke`], in up to some 0.3 s. It solves
///    problems that nothing else does: without it 6 in place of 2 of the 600 steps of the scene
///    `card-house` are unsolved.
///
/// Returns the best impulses found. The status says `Unsolved` where the judge certified none.
#[derive(Debug, Clone)]
pub struct Auto {
    /// Largest island, in blocks, that is handed to Lemke's dense tableau.
    pub lemke_limit: usize,
    enumeration: Enumeration,
    direct: Direct,
    /// What has certified the impulses returned last.
    last: Last,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Last {
    Enumeration,
    Direct,
    Other,
}

/// Most blocks for enumeration. Its systems are dense, and pins add no combinations to the count.
pub const SMALL: usize = 8;

impl Default for Auto {
    fn default() -> Self {
        Auto {
            lemke_limit: 130,
            enumeration: Enumeration::default(),
            direct: Direct::default(),
            last: Last::Other,
        }
    }
}

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
        cache: &mut FactorCache,
    ) -> SolveReport {
        self.run(problem, impulses, tolerance, Some(cache))
    }

    fn velocities(&self) -> Option<Velocities<'_>> {
        match self.last {
            Last::Enumeration => self.enumeration.velocities(),
            Last::Direct => self.direct.velocities(),
            Last::Other => None,
        }
    }
}

impl Auto {
    fn run(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        cache: Option<&mut FactorCache>,
    ) -> SolveReport {
        self.last = Last::Other;
        let few = problem.len() <= SMALL
            && Enumeration::combinations(&problem.laws) <= self.enumeration.max_combinations;
        let mut report = if few {
            let report = self.enumeration.solve(problem, impulses, tolerance);
            if report.solved() {
                self.last = Last::Enumeration;
                return report;
            }
            let again = self.direct.solve(problem, impulses, tolerance);
            again.after(&report)
        } else {
            self.direct.run(problem, impulses, tolerance, cache)
        };
        if !few && report.solved() {
            self.last = Last::Direct;
        }
        let linear = problem.laws.iter().all(Law::is_bilateral);
        if !report.solved() && !linear && problem.len() <= self.lemke_limit {
            let mut trial = impulses.to_vec();
            let lemke = Lemke::default().solve(problem, &mut trial, tolerance);
            if lemke.residual.merit() < report.residual.merit() {
                impulses.copy_from_slice(&trial);
                report = lemke.after(&report);
            } else {
                report.pivots += lemke.pivots;
            }
        }
        report
    }
}
