//! Impulse solvers: one trait, one file per method, one table of all.
//!
//! [`crate::contact::natural_map`] judges every result from the problem and the impulses alone. The
//! solvers here report its figure; the stepper asks it again for any other solver. Where an energy
//! bound blends two solutions, the step reports the worse figure of the two, not that of the blend.
//!
//! | solver | use |
//! |---|---|
//! | [`Auto`] | every island; the default: tries the others in a fixed order |
//! | [`Enumeration`] | 1 to 4 frictional contacts: exact, with a documented choice among several solutions |
//! | [`Nsgs`] | large, well-conditioned islands at a coarse tolerance; a start for `direct` |
//! | [`Lemke`] | up to 130 blocks: the last resort of `auto` |
//! | [`Direct`] | towers, mass ratios, arches, wedges, sliding heaps; 1e-9 |
//!
//! `moreau2d bench --solvers` measures the solvers on `tests/data/problems`: 147 frozen problems,
//! from a single contact to drums of 470 contacts. 141 of them are known to be solvable; `auto` and
//! `direct` solve all of these to 1e-9 from a cold start.
//!
//! # What is not unique
//! Redundant contacts can share a load in many ways. [`Uniqueness`] counts these ways, and
//! [`Sharing`] finds the impulses of minimum norm. Velocities are unique while friction is small.
//! Where velocities are not unique, `auto` returns the first solution in its fixed order. For up to
//! four contacts this is the choice of [`Enumeration`]; else it is the result of the stages of
//! [`Direct`], which start from the impulses of the last step. Where there are none, it looks first
//! for a solution in which no contact that carries load moves. Results repeat bit for bit.
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

mod anderson;
mod auto;
mod best;
mod block_status;
mod continuation;
mod crowd;
mod crowd_four;
mod crowd_near;
mod crowd_part;
mod crowd_sweep;
mod direct;
mod enumeration;
mod factor_cache;
mod four_sides;
mod four_sweep;
mod groups;
mod impulse_solver;
mod interior_point;
mod judged;
#[allow(dead_code)] // oracles follow further paths with it
pub(crate) mod lemke;
mod momentum;
mod nsgs;
mod pairs;
mod parts;
pub(crate) use parts::SEVERAL;
mod response;
mod shares;
mod status_newton;
mod table;

#[cfg(test)]
mod direct_tests;

pub use auto::{Auto, SMALL};
pub(crate) use crowd::Crowd;
pub use direct::Direct;
pub use enumeration::Enumeration;
pub use factor_cache::FactorCache;
pub(crate) use factor_cache::FactorState;
use impulse_solver::drop_unless_finite;
#[cfg(test)]
pub(crate) use impulse_solver::solve_cold;
pub use impulse_solver::{ImpulseSolver, SolveReport, SolveStatus, Velocities};
pub(crate) use judged::Judged;
pub use lemke::{LcpError, LcpOptions, LcpSolution, LcpStatus, Lemke};
#[cfg(test)]
pub(crate) use nsgs::tests as nsgs_tests;
pub use nsgs::{LocalStep, Nsgs};
pub use shares::{Shares, Sharing, Uniqueness};
pub(crate) use table::find_solver;
pub use table::{SOLVERS, SolverTable, solver_by_name};
