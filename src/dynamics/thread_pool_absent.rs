//! Replaces the thread pool if the feature `parallel` is off.

use super::island::Worker;
use super::phases::PhaseClock;
use super::settings::{MOST_THREADS, StepError};
use crate::solver::SolverTable;

/// A type without values.
pub(super) enum SolverPool {}

impl SolverPool {
    /// `None` for one thread.
    ///
    /// # Errors
    /// [`StepError::Threads`] for any other number.
    pub fn new(threads: usize, _: &str, _: SolverTable) -> Result<Option<SolverPool>, StepError> {
        if threads != MOST_THREADS {
            return Err(StepError::Threads(threads));
        }
        Ok(None)
    }

    pub fn shares(&mut self, _: impl Iterator<Item = usize>) -> bool {
        match *self {}
    }

    pub fn solve<J: Send, R: Send>(
        &mut self,
        _: &mut Worker,
        _: &mut PhaseClock,
        _: Vec<J>,
        _: impl Fn(&mut Worker, &mut PhaseClock, J) -> R + Sync,
    ) -> Vec<R> {
        match *self {}
    }
}
