use super::{Direct, Enumeration, FactorCache, ImpulseSolver, Lemke, SolveReport, Velocities};
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
/// 3. Not solved and up to [`Auto::lemke_limit`] blocks: [`Lemke`], in up to some 0.3 s. It solves what
///    nothing else does: without it 6 steps in place of 2 of the scene `card-house` are unsolved.
///
/// The best impulses met are returned, flagged when nothing certified them.
#[derive(Debug, Clone)]
pub struct Auto {
    /// Largest island, in blocks, that is handed to Lemke's dense tableau.
    pub lemke_limit: usize,
    enumeration: Enumeration,
    direct: Direct,
    /// Whether the impulses returned are those of `direct`.
    direct_last: bool,
}

/// Blocks up to which enumeration comes first: its systems are dense, and pins add no combination.
const ENUMERATED: usize = 8;

impl Default for Auto {
    fn default() -> Self {
        Auto {
            lemke_limit: 130,
            enumeration: Enumeration::default(),
            direct: Direct::default(),
            direct_last: false,
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
        let mut report = if few {
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
        if !report.solved() && problem.len() <= self.lemke_limit {
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
