use super::RunArgs;
use crate::experiment::RunError;
use crate::problems::{StoredProblem, to_json};
use crate::report::OutputFolder;
use crate::scene::Built;
use std::path::PathBuf;

/// Writes for `--dump-problems`: each contact problem of every N-th step, with its impulses, to a
/// file.
pub(super) struct Dump {
    folder: OutputFolder,
    every: usize,
    step: usize,
    count: usize,
}

impl Dump {
    /// `None` without `--dump-problems`.
    ///
    /// # Errors
    /// Those of [`OutputFolder::create`].
    pub fn create(args: &RunArgs) -> Result<Option<Dump>, RunError> {
        let Some(target) = &args.dump_problems else {
            return Ok(None);
        };
        Ok(Some(Dump {
            folder: OutputFolder::create(target)?,
            every: args.dump_every.map_or(1, |n| n as usize),
            step: 0,
            count: 0,
        }))
    }

    /// Writes the problems of one step if it is an N-th one.
    pub fn add(&mut self, built: &Built) -> Result<(), RunError> {
        self.step += 1;
        if !self.step.is_multiple_of(self.every) {
            return Ok(());
        }
        for (island, solved) in built.problems().iter().enumerate() {
            let name = format!("step-{:06}-island-{:04}.json", self.step, island + 1);
            let stored = StoredProblem::Contact {
                problem: solved.problem.clone(),
                solution: Some(solved.impulses.clone()),
            };
            let text = to_json(&stored).map_err(|source| RunError::Problem {
                path: self.folder.target().join(&name),
                source,
            })?;
            self.folder.write(&name, text)?;
            self.count += 1;
        }
        Ok(())
    }

    /// Moves the files to their final folder; returns their number and the folder.
    pub fn finish(self) -> Result<(usize, PathBuf), RunError> {
        Ok((self.count, self.folder.commit()?))
    }
}
