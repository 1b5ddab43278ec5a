//! Your own impulse solver: write it, judge it, compare it with `auto`, and use it in a step.
//!
//! # The problem
//! A solver gets a [`ContactProblem`] and returns one pair (n, t) of impulses per block. The problem
//! is a plain value: the operator `G`, the free term `b` and one law per block, see
//! [`crate::contact`]. It does not refer to a simulation, so you can try a solver on towers and heaps
//! without one: [`crate::contact::examples`] makes problems of any size,
//! [`MoreauPipeline::keep_problems`] stores those of a world, `moreau2d run SCENE --dump-problems DIR`
//! writes those of a scene, and [`crate::problems`] reads them.
//!
//! # A solver
//! The fixed point of the natural map, block after block: `P_i ← Π_i(P_i − ρ_i ξ̂_i)` with
//! `ξ̂ = ξ + (μ |ξ_T|, 0)` and the projection `Π_i` on what the law of the block admits. Twenty lines are
//! enough; [`SweepState`] updates `G P` when a single impulse changes.
//!
//! ```
//! use moreau2d::contact::{ContactProblem, Law, SweepState, Vec2, examples, natural_map};
//! use moreau2d::contact::project_onto_cone;
//! use moreau2d::solver::{Auto, ImpulseSolver, SolveReport};
//!
//! #[derive(Default)]
//! struct FixedPoint {
//!     state: SweepState,
//! }
//!
//! impl ImpulseSolver for FixedPoint {
//!     fn name(&self) -> &'static str {
//!         "fixed-point"
//!     }
//!
//!     fn solve(
//!         &mut self,
//!         problem: &ContactProblem,
//!         impulses: &mut [Vec2],
//!         tolerance: f64,
//!     ) -> SolveReport {
//!         let operator = &problem.operator;
//!         let mut sweeps = 0;
//!         // the start may be last step's impulses, or zeros
//!         operator.restart(impulses, &mut self.state);
//!         while sweeps < 20_000 {
//!             for (i, law) in problem.laws.iter().enumerate() {
//!                 let (old, block) = (impulses[i], operator.diagonal(i));
//!                 let mut xi = operator.read(i, &self.state) + problem.free[i];
//!                 xi.x += law.compliance() * old.x;
//!                 let size = if law.rows() == 2 { 0.5 * block.trace() } else { block[(0, 0)] };
//!                 let rho = 1.0 / (size + law.compliance());
//!                 let new = match *law {
//!                     Law::Contact { friction, .. } if friction > 0.0 => {
//!                         xi.x += friction * xi.y.abs();
//!                         project_onto_cone(old - rho * xi, friction)
//!                     }
//!                     Law::Contact { .. } => Vec2::new((old.x - rho * xi.x).max(0.0), 0.0),
//!                     Law::Pin => old - rho * xi,
//!                     Law::Bounded { lower, upper, .. } => {
//!                         Vec2::new((old.x - rho * xi.x).clamp(lower, upper), 0.0)
//!                     }
//!                 };
//!                 operator.push(i, new - old, &mut self.state);
//!                 impulses[i] = new;
//!             }
//!             sweeps += 1;
//!             // only the judge decides
//!             if sweeps % 20 == 0 && natural_map(problem, impulses).certified(tolerance) {
//!                 break;
//!             }
//!         }
//!         SolveReport { sweeps, ..SolveReport::judged(problem, impulses, tolerance) }
//!     }
//! }
//!
//! // a tower of five boxes, each on two points
//! let problem = examples::tower(5, 0.5, |_| 1.0).problem();
//! problem.validate()?;
//! let mut ours = vec![Vec2::zeros(); problem.len()];
//! let report = FixedPoint::default().solve(&problem, &mut ours, 1e-6);
//! assert!(report.solved() && report.sweeps > 20);
//!
//! let mut reference = ours.clone();
//! reference.fill(Vec2::zeros());
//! let auto = Auto::default().solve(&problem, &mut reference, 1e-9);
//! assert!(auto.solved() && auto.sweeps + auto.factorisations < report.sweeps);
//! // velocities are unique here, and agree; how a box shares its load between its feet is not
//! let (a, b) = (problem.local_velocity(&ours), problem.local_velocity(&reference));
//! let apart = a.iter().zip(&b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
//! assert!(apart < 1e-5, "{apart}");
//!
//! // where it ends: below 1e5 times their weight 20 000 sweeps are not enough
//! let problem = examples::tower(5, 0.5, |k| if k == 4 { 1e5 } else { 1.0 }).problem();
//! let mut impulses = vec![Vec2::zeros(); problem.len()];
//! let report = FixedPoint::default().solve(&problem, &mut impulses, 1e-6);
//! assert!(!report.solved() && report.residual.relative > 1e-6);
//! impulses.fill(Vec2::zeros());
//! assert!(Auto::default().solve(&problem, &mut impulses, 1e-9).solved());
//! # Ok::<(), moreau2d::contact::ContactError>(())
//! ```
//!
//! # Requirements on a solver
//! - **The residual decides.** [`SolveReport::judged`] sets the status from the problem and the
//!   impulses. The stepper checks the impulses of your solver again, whatever it reports.
//! - Return finite impulses whenever the problem is finite: the best found, not the last.
//! - The start is a warm start: zeros, or the last step's impulses. Ignore one that is not finite.
//! - Every [`Law`] can occur: a pin has two free rows, a bounded row one between its bounds, a
//!   contact without friction has one row and a zero second number.
//! - `G` is singular as soon as a box stands on two points with friction: a method that inverts it
//!   must handle this. Problems without a solution exist (a disc driven between two plates): stop
//!   within a budget.
//! - The same problem gives the same bytes: no clock, no unordered map.
//!
//! # In a step
//! [`MoreauPipeline::set_solver`] (or [`MoreauStepper::set_solver`] for a model of one's own) takes
//! it in place of the one named in the settings. A state saved does not hold it: set it again after
//! resuming. It is one object, so that all islands are solved on the caller's thread, whatever the
//! number of threads.
//!
//! ```
//! use moreau2d::contact::{ContactProblem, Vec2};
//! use moreau2d::rapier::engine::prelude::*;
//! use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
//! use moreau2d::solver::{Direct, ImpulseSolver, Nsgs, SolveReport};
//!
//! /// Sweeps first, a factorisation where they do not arrive.
//! #[derive(Default)]
//! struct SweepsFirst {
//!     sweeps: Option<Nsgs>,
//!     direct: Direct,
//! }
//!
//! impl ImpulseSolver for SweepsFirst {
//!     fn name(&self) -> &'static str {
//!         "sweeps-first"
//!     }
//!
//!     fn solve(
//!         &mut self,
//!         problem: &ContactProblem,
//!         impulses: &mut [Vec2],
//!         tolerance: f64,
//!     ) -> SolveReport {
//!         let sweeps = self.sweeps.get_or_insert_with(|| Nsgs::with_budget(30));
//!         let report = sweeps.solve(problem, impulses, tolerance);
//!         if report.solved() {
//!             return report;
//!         }
//!         // reports the work of both
//!         self.direct.solve(problem, impulses, tolerance).after(&report)
//!     }
//! }
//!
//! let mut world = PhysicsWorld::new();
//! world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(10.0, 0.5));
//! for k in 0..8 {
//!     let body = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 1.0 + k as Real));
//!     world.insert(body, ColliderBuilder::cuboid(0.5, 0.5));
//! }
//! let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
//! pipeline.set_solver(Box::new(SweepsFirst::default()));
//! pipeline.keep_problems(true);
//! let record = pipeline.step(&mut world)?;
//! assert_eq!(record.unsolved, 0);
//! assert!(record.sweeps == 30 && record.factorisations > 0);
//!
//! // the problem of this very step, to be solved again by anything else
//! let kept = &pipeline.problems()[0];
//! assert_eq!(kept.problem.len(), 16);
//! let mut again = vec![Vec2::zeros(); 16];
//! assert!(Direct::default().solve(&kept.problem, &mut again, 1e-9).solved());
//! # Ok::<(), moreau2d::dynamics::StepError>(())
//! ```
//!
//! To have it in the tables of `moreau2d bench --solvers` and under a name in scene files, add it
//! to [`SOLVERS`](crate::oracles::SOLVERS) and
//! [`solver_by_name`](crate::oracles::solver_by_name): 147 frozen problems, from a single contact to
//! drums of 470, then say how far it can be trusted.
//!
//! [`ContactProblem`]: crate::contact::ContactProblem
//! [`Direct`]: crate::solver::Direct
//! [`ImpulseSolver::solve_next`]: crate::solver::ImpulseSolver::solve_next
//! [`Law`]: crate::contact::Law
//! [`SweepState`]: crate::contact::SweepState
//! [`SolveReport::judged`]: crate::solver::SolveReport::judged
//! [`MoreauPipeline::keep_problems`]: crate::rapier::MoreauPipeline::keep_problems
//! [`MoreauPipeline::set_solver`]: crate::rapier::MoreauPipeline::set_solver
//! [`MoreauStepper::set_solver`]: crate::dynamics::MoreauStepper::set_solver
