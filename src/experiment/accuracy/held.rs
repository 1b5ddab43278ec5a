//! Keeps a run to the accuracy for which its setting was chosen.

use super::super::reference::Measure;
use super::super::simulate::{RunError, Totals};
use super::choice::Choice;
use super::trial::{Observer, Trial, worst};
use crate::dynamics::record::StepRecord;
use crate::report::number;
use crate::scene::{Built, Scene};

/// Watches a run of the chosen setting: at each of ten instants and at the end it must be no farther
/// from the finest trial than the accuracy less the expected error of that trial.
pub struct Held<'a> {
    choice: &'a Choice,
    seen: Observer,
}

impl Held<'_> {
    /// # Arguments
    /// - `scene`: with the chosen step.
    /// - `built`: not yet stepped.
    pub fn start<'a>(choice: &'a Choice, scene: &Scene, built: &Built) -> Held<'a> {
        Held {
            choice,
            seen: Observer::start(scene, built, choice.steps),
        }
    }

    /// Adds a step.
    ///
    /// # Errors
    /// [`RunError::Strayed`] if the accuracy is no longer held.
    pub fn add(&mut self, record: &StepRecord, built: &Built) -> Result<(), RunError> {
        let instant = self.seen.add(record, built);
        if !record.passed.is_empty() {
            return self.strayed("a body passed through another".to_owned(), record.time);
        }
        if instant && self.choice.motion {
            let finest = &self.choice.finest;
            let apart = self.seen.apart(&finest.seen, finest.length);
            let error = apart + self.spare("trajectory");
            if error.is_nan() || error > self.choice.asked {
                return self.strayed(
                    format!("trajectory is off by {}", number(error, 2)),
                    record.time,
                );
            }
        }
        Ok(())
    }

    /// Judges the whole run by what it `found`.
    ///
    /// # Returns
    /// The worst measure and its estimated error: the distance from the finest trial and the expected
    /// error of that.
    ///
    /// # Errors
    /// [`RunError::Strayed`].
    pub fn end(self, scene: &Scene, found: &[Measure], totals: &Totals) -> Result<Ended, RunError> {
        let choice = self.choice;
        let work = self.seen.work;
        let run = Trial::of(scene, self.seen, found.to_vec(), totals);
        let apart = run.differences(&choice.finest, &choice.names, choice.motion);
        let spare = |name: &str| spare(choice, name);
        let errors = apart
            .into_iter()
            .map(|(name, apart)| (name, apart + spare(name)));
        let (measure, error) = worst(errors.chain(run.known.iter().copied()));
        if error > choice.asked {
            return Err(RunError::Strayed {
                why: format!("{measure} is off by {}", number(error, 2)),
                work,
            });
        }
        Ok(Ended {
            measure,
            error,
            work,
            judged: run.error(),
        })
    }

    fn spare(&self, name: &str) -> f64 {
        spare(self.choice, name)
    }

    fn strayed(&self, what: String, time: f64) -> Result<(), RunError> {
        Err(RunError::Strayed {
            why: format!("{what} at {} s", number(time, 3)),
            work: self.seen.work,
        })
    }
}

fn spare(choice: &Choice, name: &str) -> f64 {
    let found = choice.spare.iter().find(|(known, _)| *known == name);
    found.map_or(0.0, |(_, error)| *error)
}

/// A run that was held.
#[derive(Debug, Clone, Copy)]
pub struct Ended {
    /// The worst measure, and its error estimated from the finest trial.
    pub measure: &'static str,
    pub error: f64,
    pub work: usize,
    /// Worst measure and error against the closed form, which had no part in the choice; of what is known
    /// to be 0 alone if the scene has none.
    pub judged: (&'static str, f64),
}

impl Choice {
    /// Runs `attempt` with the chosen setting, and again with a finer one while it is not held.
    ///
    /// # Arguments
    /// - `attempt`: runs the scene with the chosen step under a [`Held`].
    ///
    /// # Errors
    /// Those of `attempt` but [`RunError::Strayed`], which leads to a finer setting while there is one.
    pub fn hold<T>(
        &mut self,
        scene: &Scene,
        mut attempt: impl FnMut(&Scene, &Choice) -> Result<T, RunError>,
    ) -> Result<T, RunError> {
        loop {
            let scene = Scene {
                step: self.step.clone(),
                ..scene.clone()
            };
            match attempt(&scene, self) {
                Err(RunError::Strayed { why, work }) if self.tighten(&why, work) => {}
                ended => return ended,
            }
        }
    }
}
