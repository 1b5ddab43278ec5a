//! Experiments: run a scene with an engine and settings, and measure the results.
//!
//! One loop steps every engine. All tables, charts and files are made from the rows it returns.
//!
//! # A comparison and its pictures
//!
//! [`run_settings`] runs every [`Setting`] of a [`Comparison`] and returns the rows of
//! `results.csv`. Table and pictures are made from that file alone. Every value is an error or a
//! cost: less is better, 0 is exact, NaN is a run that failed (`verdict` and `mode` say how).
//!
//! The setting of a peer names all its parameters: natural frequency of its contacts, the factor on
//! it at fixed bodies, substeps of a step, sweeps of projected Gauss-Seidel (PGS) in a substep. See
//! [`crate::peers::BaselineSettings`] and, with the feature `box2d`,
//! [`crate::peers::Box2dSettings`], which says which parts of a scene Box2D can represent. No single
//! measure is enough: bodies that never touch do not penetrate.
//!
//! - `work-precision.svg`: error against wall time for a simulated second, one panel for each
//!   measure. A point is *dominated* if another lies below it and to its left. Lines join the step
//!   lengths of one setting. Single points are the sweep of a peer's settings; the legend explains
//!   the numbers of their labels. A time is the median of the repeats. The column `spread` is half
//!   the range of the repeats over their median; differences within it are not significant.
//! - `convergence.svg`: error against step length Δt. A method of order p has
//!   `error ≈ C Δt^p`, a straight line of slope p; the legend gives the slope fitted by least
//!   squares with its standard error. An event (a stop, an impact) can occur anywhere in its step,
//!   so that the errors of single runs scatter about the line.
//! - `energy.svg`: the measures of energy in the same way. A rise is energy that no force supplied.
//!
//! A log axis shows zeros on a separate line marked 0. Errors below 1e-12 are round-off and have no
//! order. A picture without a value above 0 is not written.
//!
//! # A chart over many scenes
//!
//! [`ChartPlan`] runs the same points on one scene after the other, and further points of our engine
//! (other tolerances and solvers at the scene's step). `moreau2d chart` writes
//! - `results.csv`, one row for each point and measure, and `SCENE.svg`, one work-precision panel for
//!   every measure that a peer has as well. The stairs are the Pareto fronts: at a given time no
//!   point of that side is more accurate. Points that failed, or that were not solved to their
//!   tolerance, are listed beneath the panel; they are not drawn and not part of a front.
//! - `domination.csv`, the number of the peers' points that ours dominate in each measure, and
//!   `undominated.csv`, every other point of the peers with the nearest of ours and the cause
//!   ([`crate::report::Domination`] has the definition): `accuracy`, no point of ours is as accurate;
//!   `step`, all points of ours take longer, whatever their accuracy; `time`, our points of the same
//!   accuracy take longer and our points of the same time are less accurate.
//! - `points.csv`, the command that runs each point again by itself. It gives the same values bit for
//!   bit; only the times differ.
//!
//! The column `reference` says what a value is compared with. `closed form` is an exact solution.
//! `0` is the value of an ideal contact, joint or conservative system. `self-converged ±e until t` is
//! our own run at three steps finer than all others ([`SelfReference`]). It gives the trajectories as
//! far as the three runs agree: errors are compared up to t only and are never reported below e.
//! If the three runs do not agree, the motion is chaotic and no trajectory is compared; a note says
//! so. Such a reference is not independent of our engine. A peer that converges to another motion
//! shows an error that does not fall with its step.
//!
//! In a scene with a motor, a belt or a body of prescribed motion the energy may rise, so
//! `energy-rise` is left out. Bodies that overlap at the start, as the cards of `card-house` do with
//! rapier's dimensions, must be lifted off each other: `energy-rise` includes that work for every
//! engine, and `energy-recovery` is its part for our engine.
//!
//! The measure `wear` of sliding blocks and discs compares the sum of `load_slip` with its closed
//! form. A peer's is its impulse times the slip velocity at the end of the step, as it does not
//! report the velocity at the start.
//!
//! **To add a scene**, add a file to `scenes/` and a line to the catalogue. A scene with a
//! `[reference]` is part of the chart; a new closed form is a new function of [`measures`].
//! `moreau2d chart FILE` runs a scene without one. An entry of the atlas is a file too, see
//! [`crate::scene::atlas`].
//!
//! **To add an engine**, add a variant to [`Engine`]: its name, how it steps, and its peer. Its
//! settings are a variant of [`Baseline`], which applies them to a world or refuses the world. The
//! sweep of its settings goes to [`Comparison::settings`]. An engine with a world of its own copies
//! rapier's and writes poses and velocities back, as Box2D does. All later stages only read rows.
//!
//! # Throughput
//!
//! [`Throughput`] times the steps of [`Workload`]s. Each engine has its own copy of the world, and
//! the engines take turns of ten steps. The rows hold the time of a step, the time of its phases
//! ([`crate::dynamics::Phases`]), and its quality: penetration, residual, unsolved islands. Each
//! engine counts its own `contacts`: a peer those with an impulse or overlap, ours all that close
//! within the step. [`growth`] is the exponent of the number of contacts with which the time grows
//! over the sizes of a scene; 1 is proportional.
//!
//! # Comparison of the impulse solvers
//!
//! [`bench_solvers`] solves stored problems with every solver. [`crate::report::Performance`] reads
//! the rows and draws the performance profile of Dolan & Moré (2002): the share of all problems that
//! a solver solves within τ times the time of the fastest solver of each. A problem that a solver
//! does not solve counts as never solved. Problems that no solver solves count too, so that the
//! curves may stay below 1. `auto` calls the other solvers, so that a win between it and the solver
//! it calls is chance; the distance of its curve from the best is the cost of its choice.

mod accuracy;
mod assembly;
mod atlas;
mod baseline;
mod bench;
mod calibration;
mod chart;
mod compare;
mod equilibrium;
mod explain;
mod freedoms;
mod joint_gap;
mod reductions;
mod reference;
mod results;
mod self_reference;
mod setting;
mod simulate;
mod throughput;
mod trial;
mod verdict;
mod wear;

pub use accuracy::{ACCURACIES, Choice, Ended, Held, TrialRow, against_search, choose};
pub use assembly::{can_stand, limit};
pub use atlas::{Atlas, AtlasResults, MachineFigures, MachineRun, Preset, ReadRung};
pub use baseline::Baseline;
pub use bench::{NamedProblem, bench_solvers};
pub use calibration::{
    CalibrationError, Course, Fit, Measured, Second, normal_quantile, student_quantile,
};
pub use chart::{ChartPlan, charted_scenes};
pub use compare::Comparison;
pub use equilibrium::{EquilibriumError, Joint, Load, stands};
pub use explain::{Expected, Explanation, LeftOut, StepFor, TimeScale, explain};
pub use reductions::{REDUCTIONS, Reduction, against_full};
pub use reference::{Measure, Samples, Size, measures};
pub use results::{Results, run_settings};
pub(crate) use results::{interleave, median_and_spread, row};
pub use self_reference::SelfReference;
pub(crate) use setting::REST_SOLVED;
pub use setting::{Setting, step_count};
pub use simulate::{Engine, RunError, Totals, go_on, simulate};
pub use throughput::{Throughput, Workload, growth};
pub use trial::Trial;
pub use verdict::{Check, Judge, Passage, Verdict};
pub use wear::{CellRow, JumpRow, NodeRow, WearOutcome};
