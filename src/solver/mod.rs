//! Impulse solvers: one trait, one file a method, one table of all.
//!
//! Every result is judged by [`crate::contact::natural_map`] from the problem and the impulses
//! alone; a solver's own word is never reported.
//!
//! | solver | for |
//! |---|---|
//! | [`Auto`] | every island; the default: the others in a fixed order |
//! | [`Enumeration`] | 1 to 4 frictional contacts: exact, and a stated one of several solutions |
//! | [`Nsgs`] | large, well-conditioned islands at a coarse tolerance; a start for `direct` |
//! | [`Direct`] | towers, mass ratios, arches, wedges, sliding heaps; 1e-9 |
//!
//! `moreau2d bench --solvers` measures them on `tests/data/problems`: 146 frozen problems, from a
//! single contact to drums of 470. Of the 140 known to be solvable `auto` and `direct` solve all to
//! 1e-9 from nothing.
//!
//! # What is not unique
//! Redundant contacts share a load in many ways; [`Uniqueness`] counts them, and [`Sharing`] takes
//! the least. Velocities are unique while friction is small. Where it is not, the branch is the one
//! that the order of `auto` comes to first: for up to four blocks that of [`Enumeration`], else that
//! of the stages of [`Direct`], which start from the last step's impulses. Everything repeats bit
//! for bit.
//!
//! ```
//! use moreau2d::contact::{Vec2, examples};
//! use moreau2d::solver::{Auto, ImpulseSolver, Uniqueness};
//!
//! let problem = examples::pyramid(5, 0.5).problem();
//! let mut impulses = vec![Vec2::zeros(); problem.len()];
//! let report = Auto::default().solve(&problem, &mut impulses, 1e-9);
//! assert!(report.solved());
//! // 50 contacts of two rows, 15 boxes of three coordinates
//! assert!(Uniqueness::of(&problem, &impulses).self_stress >= Some(55));
//! ```

mod auto;
mod best;
mod carried;
mod continuation;
mod direct;
mod enumeration;
mod four_sweep;
mod groups;
mod interior_point;
mod judged;
mod nsgs;
mod pairs;
mod response;
mod shares;
mod status_newton;

#[cfg(test)]
mod direct_tests;

pub use auto::Auto;
pub use carried::Carried;
pub(crate) use carried::CarriedState;
pub use direct::Direct;
pub use enumeration::Enumeration;
pub(crate) use judged::Judged;
#[cfg(test)]
pub(crate) use nsgs::tests as nsgs_tests;
pub use nsgs::{LocalStep, Nsgs};
pub use shares::{Shares, Sharing, Uniqueness};

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
    fn of(residual: Residual, tolerance: f64) -> Self {
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
    fn solve_on(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        _carried: &mut Carried,
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
    fn of(judge: &Judge) -> Velocities<'_> {
        Velocities {
            blocks: judge.velocities(),
            bodies: judge.bodies(),
        }
    }
}

/// A start that is not finite is no start.
fn drop_unless_finite(impulses: &mut [Vec2]) {
    for p in impulses {
        if !(p.x.is_finite() && p.y.is_finite()) {
            *p = Vec2::zeros();
        }
    }
}

/// Names of all solvers here, in the order the help shows them.
pub const SOLVERS: [&str; 4] = ["auto", "enumeration", "nsgs", "direct"];

/// A table of solvers by name: [`solver_by_name`], or one of the user's own.
pub type SolverTable = fn(&str) -> Option<Box<dyn ImpulseSolver>>;

/// The solver of that name, or `None`.
pub fn solver_by_name(name: &str) -> Option<Box<dyn ImpulseSolver>> {
    Some(match name {
        "auto" => Box::new(Auto::default()),
        "enumeration" => Box::new(Enumeration::default()),
        "direct" => Box::new(Direct::default()),
        "nsgs" => Box::new(Nsgs::default()),
        _ => return None,
    })
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
