//! Runs: a scene, an engine, settings, and what comes of them.
//!
//! One loop steps every engine; a wear experiment wraps it in load cycles and jumps. Everything
//! printed, drawn and written is made of what these return.

mod compare;
mod equilibrium;
mod reference;
mod simulate;
mod stall;
mod study;
mod threshing;

mod wear_history;

pub use compare::{Comparison, compare};
pub use equilibrium::{EquilibriumError, Joint, Load, stands};
pub use reference::{Measure, Samples, measures};
pub use simulate::{Engine, RunError, Totals, simulate};
pub use stall::Stall;
pub use study::{PublishedPoint, StudyOutcome, oracle_load_slip, run_study};

pub use threshing::{Observer, PowerBudget, ThreshingOutcome, run_threshing};
pub use wear_history::WearHistory;
