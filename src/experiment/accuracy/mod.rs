//! `--accuracy`.

mod choice;
mod held;
mod search;
mod trial;

pub use choice::{ACCURACIES, Choice, TrialRow, choose};
pub use held::{Ended, Held};
pub use search::against_search;
