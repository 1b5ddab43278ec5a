use super::factor_cache::FactorCache;
use crate::contact::{ContactProblem, Judge, Residual, Vec2, Vec3, natural_map};

/// How a solve ended. Not converging is an outcome, not an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolveStatus {
    /// The judge certifies the impulses at the tolerance asked for.
    Solved,
    /// The budget ran out or the method does not apply; the best impulses found are returned.
    Unsolved,
}

/// What a solve did, and how good its impulses are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveReport {
    pub status: SolveStatus,
    /// Passes over all blocks (Gauss-Seidel and kin).
    pub sweeps: usize,
    /// Factorisations of a linear system.
    pub factorisations: usize,
    /// Pivots of a complementary pivoting method.
    pub pivots: usize,
    /// The judge's figure for the impulses returned.
    pub residual: Residual,
}

impl SolveReport {
    /// Lets the judge decide whether `impulses` solve `problem` at `tolerance`.
    pub fn judged(problem: &ContactProblem, impulses: &[Vec2], tolerance: f64) -> Self {
        SolveReport::of(natural_map(problem, impulses), tolerance)
    }

    /// The report of no work at all, with the judge's figure.
    pub(super) fn of(residual: Residual, tolerance: f64) -> Self {
        SolveReport {
            status: if residual.certified(tolerance) {
                SolveStatus::Solved
            } else {
                SolveStatus::Unsolved
            },
            sweeps: 0,
            factorisations: 0,
            pivots: 0,
            residual,
        }
    }

    /// Whether the judge certified the impulses.
    pub fn solved(&self) -> bool {
        self.status == SolveStatus::Solved
    }

    /// Adds the work of an earlier attempt at the same problem.
    pub fn after(mut self, earlier: &SolveReport) -> Self {
        self.sweeps += earlier.sweeps;
        self.factorisations += earlier.factorisations;
        self.pivots += earlier.pivots;
        self
    }
}

/// A method that finds the impulses of one contact problem.
pub trait ImpulseSolver: Send {
    /// The name a user types.
    fn name(&self) -> &'static str;

    /// Solves `problem` to `Residual::certified(tolerance)`.
    ///
    /// # Arguments
    /// - `problem`: valid ([`ContactProblem::validate`]).
    /// - `impulses`: one pair a block [N s]; the start on entry (zeros when cold), the result on
    ///   return. The result is finite whenever the problem is.
    /// - `tolerance`: relative, no unit, see [`Residual::certified`].
    ///
    /// # Panics
    /// If `impulses` has fewer pairs than the problem has blocks.
    fn solve(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
    ) -> SolveReport;

    /// The same for the next problem of an island, with what was carried from the ones before.
    ///
    /// A step calls this one for islands of 16 blocks and more, each with its own `carried`, and
    /// [`ImpulseSolver::solve`] for all else; who carries nothing has nothing to do here.
    fn solve_next(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        _carried: &mut FactorCache,
    ) -> SolveReport {
        self.solve(problem, impulses, tolerance)
    }

    /// Velocities at the impulses last returned, where the method has them at hand: nobody need find
    /// them again then. Blocks and bodies are numbered as in the problem. Of a solver of the user's
    /// own the judge's figures are used in their place.
    fn velocities(&self) -> Option<Velocities<'_>> {
        None
    }
}

/// What impulses lead to.
#[derive(Debug, Clone, Copy)]
pub struct Velocities<'a> {
    /// `G P + b` \[m/s\], one a block.
    pub blocks: &'a [Vec2],
    /// `M⁻¹ Jᵀ P` \[m/s, rad/s\], one a body; none of an explicit operator.
    pub bodies: &'a [Vec3],
}

impl Velocities<'_> {
    /// At the impulses that `judge` saw last.
    pub(super) fn of(judge: &Judge) -> Velocities<'_> {
        Velocities {
            blocks: judge.velocities(),
            bodies: judge.bodies(),
        }
    }
}

/// A start that is not finite is no start.
pub(super) fn drop_unless_finite(impulses: &mut [Vec2]) {
    for p in impulses {
        if !(p.x.is_finite() && p.y.is_finite()) {
            *p = Vec2::zeros();
        }
    }
}

/// Solves from zero with a new solver; checks that the solver's word is the judge's.
#[cfg(test)]
pub(crate) fn solve_cold<S: ImpulseSolver + Default>(
    problem: &ContactProblem,
    tolerance: f64,
) -> (Vec<Vec2>, SolveReport) {
    let mut impulses = vec![Vec2::zeros(); problem.len()];
    let report = S::default().solve(problem, &mut impulses, tolerance);
    let residual = natural_map(problem, &impulses);
    assert_eq!(residual, report.residual);
    assert_eq!(
        residual.certified(tolerance),
        report.status == SolveStatus::Solved
    );
    (impulses, report)
}
