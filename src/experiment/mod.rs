//! Runs: a scene, an engine, settings, and what comes of them.
//!
//! One loop steps every engine; a wear experiment wraps it in load cycles and jumps. Everything
//! printed, drawn and written is made of what these return.
//!
//! # A comparison and its pictures
//!
//! [`run_settings`] runs every [`Setting`] of a [`Comparison`] and gives rows of `results.csv`;
//! table and pictures are drawn from that file and from nothing else. Every value is an error or
//! a cost: less is better, 0 is exact, NaN is a run that failed (`verdict`, `mode` say how).
//!
//! The setting of a peer is spelled in full: natural frequency of its contacts, the factor on it at
//! fixed bodies, substeps of a step, sweeps of projected Gauss-Seidel (PGS) in a substep, see
//! [`crate::rapier::BaselineSettings`]. No single measure tells: contacts that never touch do not
//! penetrate.
//!
//! - `work-precision.svg`: error against wall time for a simulated second, a panel a measure.
//!   A point is *dominated* where another lies below it and to its left. Lines join the step
//!   lengths of one setting; single points are the sweep of rapier's settings, labelled with the
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
//! # Solvers against each other
//!
//! [`bench_solvers`] solves stored problems with every solver; [`crate::report::Performance`] reads
//! the rows and draws the performance profile of Dolan & Moré (2002): how large a share of all
//! problems a solver solves within τ times the time of the fastest solver of each. A problem
//! that a solver does not solve counts as never solved; one that no solver solves counts too, so
//! that no curve reaches 1. `auto` hands over to others, so that between it and those a win is
//! chance; what the choice costs is its curve's distance from the best.

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
mod stall;
mod study;
mod threshing;
mod throughput;

mod wear_history;

pub use bench::{NamedProblem, bench_solvers};
pub use chart::{ChartPlan, charted_scenes};
pub use compare::Comparison;
pub use equilibrium::{EquilibriumError, Joint, Load, stands};
pub use reference::{Measure, Samples, measures};
pub use results::{Results, run_settings};
pub use self_reference::SelfReference;
pub use setting::{Setting, step_count};
pub use simulate::{Engine, RunError, Totals, simulate};
pub use stall::Stall;
pub use study::{PublishedPoint, StudyOutcome, oracle_load_slip, run_study};

pub use threshing::{Observer, PowerBudget, ThreshingOutcome, run_threshing};
pub use throughput::{Throughput, Workload, growth};
pub use wear_history::WearHistory;
