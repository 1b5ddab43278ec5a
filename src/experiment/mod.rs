//! Runs: a scene, an engine, settings, and what comes of them.
//!
//! One loop steps every engine. Everything printed, drawn and written is made of what these return.
//!
//! # A comparison and its pictures
//!
//! [`run_settings`] runs every [`Setting`] of a [`Comparison`] and gives rows of `results.csv`;
//! table and pictures are drawn from that file and from nothing else. Every value is an error or
//! a cost: less is better, 0 is exact, NaN is a run that failed (`verdict`, `mode` say how).
//!
//! The setting of a peer is spelled in full: natural frequency of its contacts, the factor on it at
//! fixed bodies, substeps of a step, sweeps of projected Gauss-Seidel (PGS) in a substep, see
//! [`crate::peers::BaselineSettings`] and, with the feature `box2d`,
//! [`crate::peers::Box2dSettings`], which says what Box2D is given of a scene and what it is not. No single measure tells: contacts that never touch do not
//! penetrate.
//!
//! - `work-precision.svg`: error against wall time for a simulated second, a panel a measure.
//!   A point is *dominated* where another lies below it and to its left. Lines join the step
//!   lengths of one setting; single points are the sweep of a peer's settings, labelled with the
//!   numbers that the legend lists, as far as there is room. A time is the median of the repeats;
//!   the column `spread` is half their range over it, and differences within it mean nothing.
//! - `convergence.svg`: error against step length Δt. A method of order p has
//!   `error ≈ C Δt^p`, a straight line of slope p; the legend gives the slope fitted by least
//!   squares with its standard error. An event (a stop, an impact) falls anywhere in its step, so
//!   that the errors of single runs scatter about the line.
//! - `energy.svg`: the measures of energy in the same way. A rise is work that no force did.
//!
//! Zeros stand on a line marked 0 under a log axis. What lies below 1e-12 is round-off, and has
//! no order. A picture without a value above 0 is not written.
//!
//! # A chart over many scenes
//!
//! [`ChartPlan`] runs the same points on one scene after the other, with more of ours (tolerances
//! and solvers at the scene's step); `moreau2d chart` writes
//! - `results.csv`, a row a point and measure, and `SCENE.svg`, a work-precision panel for every
//!   measure that a peer shows as well. The
//!   stairs are the Pareto fronts: at a given time nothing of that side is more accurate. What
//!   failed, or was not solved to its tolerance, is named beneath its panel with its setting, and
//!   neither drawn nor part of a front.
//! - `domination.csv`, how many points of the peers ours dominate in each measure, and
//!   `undominated.csv`, every one that they do not, the nearest of ours, and the cause
//!   ([`crate::report::Domination`] has the definition): `accuracy`, none of ours is as accurate;
//!   `step`, all of ours take longer, whatever their accuracy; `time`, ours as accurate take
//!   longer and ours as fast are less accurate.
//! - `points.csv`, the command that runs each point again by itself: the same values bit for bit,
//!   other times.
//!
//! What a value is measured against is in the column `reference`. `closed form` is mathematics.
//! `0` is what an ideal contact, joint or conservative system has. `self-converged ±e until t` is
//! our own run at three steps below all others ([`SelfReference`]): it says where the bodies go
//! as far as the three agree, errors are compared up to t alone and never said to be less than e.
//! Where they do not agree there is no trajectory to compare: chaos, and a note says so. Such a
//! reference is of the race it judges, in the finest steps of one of its runners; a peer that
//! converges to another motion shows there as an error that does not fall with its step.
//!
//! The energy of a scene with a motor, a belt or a body that moves as it is told rises as it
//! should, so that `energy-rise` is no error there and left out. Bodies that start in each other, as
//! the cards of `card-house` do by rapier's dimensions, must be lifted off each other: `energy-rise`
//! holds that too, of every engine, and `energy-recovery` says how much of ours it is.
//!
//! The measure `wear` of blocks and discs that slide is the sum of `load_slip` against its closed
//! form; a peer's is its impulse times the slip velocity at the end of the step, as it does not give
//! the one at the start.
//!
//! **A scene** is added as a file of `scenes/` and a line of the catalogue. With a
//! `[reference]` it is in the chart from then on; a new closed form is a function beside the others
//! of [`measures`]. Without one, `moreau2d chart FILE` takes it as it is. An entry of the atlas is a
//! file too, see [`crate::scene::atlas`].
//!
//! **An engine** is added as a variant of [`Engine`]: its name, how it is stepped, and whose peer it
//! is. Its settings are a variant of [`Baseline`], spelled in full and taken by a world, or refused
//! by it; their ladder goes to [`Comparison::settings`]. One that keeps a world of its own copies
//! rapier's and writes poses and velocities back, as Box2D does. Everything behind that reads rows.
//!
//! # Throughput
//!
//! [`Throughput`] times the steps of [`Workload`]s: each engine has its own copy of the world, and
//! they take turns of ten steps. Beside the time of a step stand what it went into
//! ([`crate::dynamics::Phases`]) and what it is worth: penetration, residual, unsolved islands. An
//! engine's `contacts` are those that it counts itself: a peer's have an impulse or overlap, ours
//! are all that close within the step. [`growth`] is the power of the number of contacts with
//! which the time grows through the sizes of a scene; 1 is proportional.
//!
//! # Solvers against each other
//!
//! [`bench_solvers`] solves stored problems with every solver; [`crate::report::Performance`] reads
//! the rows and draws the performance profile of Dolan & Moré (2002): how large a share of all
//! problems a solver solves within τ times the time of the fastest solver of each. A problem
//! that a solver does not solve counts as never solved; one that no solver solves counts too, so
//! that no curve reaches 1. `auto` hands over to others, so that between it and those a win is
//! chance; what the choice costs is its curve's distance from the best.

mod assembly;
mod atlas;
mod baseline;
mod bench;
mod chart;
mod compare;
mod equilibrium;
mod joint_gap;
mod reference;
mod results;
mod self_reference;
mod setting;
mod simulate;
mod throughput;

pub use assembly::{can_stand, limit};
pub use atlas::{Atlas, AtlasResults, MachineFigures, MachineRun, ReadRung};
pub use baseline::Baseline;
pub use bench::{NamedProblem, bench_solvers};
pub use chart::{ChartPlan, charted_scenes};
pub use compare::Comparison;
pub use equilibrium::{EquilibriumError, Joint, Load, stands};
pub use reference::{Measure, Samples, measures};
pub use results::{Results, run_settings};
pub(crate) use results::{interleave, median_and_spread, row};
pub use self_reference::SelfReference;
pub use setting::{Setting, step_count};
pub use simulate::{Engine, RunError, Totals, simulate};
pub use throughput::{Throughput, Workload, growth};
