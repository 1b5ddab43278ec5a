//! The cheapest setting that holds an accuracy, `run --accuracy`: [`choose`].

mod choice;
mod held;
mod judge;
mod search;
mod trial;

pub use choice::{ACCURACIES, Choice, TrialRow, choose};
pub use held::{Ended, Held};
pub use search::against_search;
