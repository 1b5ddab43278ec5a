use super::factor_cache::FactorCache;
use crate::contact::{ContactProblem, Judge, Residual, Vec2, Vec3, natural_map};

/// How a solve ended. Not converging is an outcome, not an error.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolveStatus {
    /// The judge certifies the impulses at the given tolerance.
    Solved,
    /// The budget ran out or the method does not apply; the best impulses found are returned.
    Unsolved,
}

/// The work of a solve, and the residual of its impulses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolveReport {
    pub status: SolveStatus,
    /// Passes over all blocks (Gauss-Seidel and similar methods).
    pub sweeps: usize,
    /// Factorisations of a linear system.
    pub factorisations: usize,
    /// Pivots of a complementary pivoting method.
    pub pivots: usize,
    /// The judge's residual of the impulses returned.
    pub residual: Residual,
}

impl SolveReport {
    /// Judges `impulses` for `problem` at `tolerance`; the work counts are zero.
    pub fn judged(problem: &ContactProblem, impulses: &[Vec2], tolerance: f64) -> Self {
        SolveReport::of(natural_map(problem, impulses), tolerance)
    }

    /// A report of a known residual; the work counts are zero.
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
    /// The name of the method on the command line and in settings.
    fn name(&self) -> &'static str;

    /// Solves `problem` to `Residual::certified(tolerance)`.
    ///
    /// # Arguments
    /// - `problem`: valid ([`ContactProblem::validate`]).
    /// - `impulses`: one pair per block [N s]; the start on entry (zeros for a cold start), the
    ///   result on return. The result is finite whenever the problem is.
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

    /// Solves the next problem of an island, with the factors stored by its earlier problems.
    ///
    /// The stepper calls this for islands of 16 blocks and more, each with its own `cache`, and
    /// [`ImpulseSolver::solve`] for all others. The default ignores the cache.
    fn solve_next(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        _cache: &mut FactorCache,
    ) -> SolveReport {
        self.solve(problem, impulses, tolerance)
    }

    /// Velocities at the impulses returned last, if the method has computed them; else `None`.
    /// Blocks and bodies are numbered as in the problem. For a user's own solver the stepper uses
    /// the judge's velocities instead.
    fn velocities(&self) -> Option<Velocities<'_>> {
        None
    }
}

/// Velocities that result from impulses.
#[derive(Debug, Clone, Copy)]
pub struct Velocities<'a> {
    /// `G P + b` \[m/s\], one per block.
    pub blocks: &'a [Vec2],
    /// `M⁻¹ Jᵀ P` \[m/s, rad/s\], one per body; empty if not known, and for an explicit operator.
    pub bodies: &'a [Vec3],
}

impl Velocities<'_> {
    /// Velocities at the impulses that `judge` evaluated last.
    pub(super) fn of(judge: &Judge) -> Velocities<'_> {
        Velocities {
            blocks: judge.velocities(),
            bodies: judge.bodies(),
        }
    }
}

/// Replaces impulses that are not finite by zero.
pub(super) fn drop_unless_finite(impulses: &mut [Vec2]) {
    for p in impulses {
        if !(p.x.is_finite() && p.y.is_finite()) {
            *p = Vec2::zeros();
        }
    }
}

/// Solves from zero with a new solver, and checks that its report agrees with the judge.
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
