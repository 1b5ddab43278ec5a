//! Chooses the cheapest setting that holds an accuracy, from trials with step doubling.

use super::super::simulate::RunError;
use super::judge::Judge;
use super::trial::{INSTANTS, Part, Trial, worst};
use crate::report::{Progress, number, step_length};
use crate::scene::{Scene, Scheme, Step};
use serde::Serialize;

/// The accuracies that can be asked for.
pub const ACCURACIES: [f64; 2] = [1e-6, 0.1];
/// The expected error must be smaller by this factor than what is asked.
pub(super) const SAFETY: f64 = 2.0;
/// The coarsest step in steps of the scene.
const COARSEST: f64 = 4.0;
/// Halvings of the coarsest step, with it: the finest is 1/512 of the scene's.
const LEVELS: usize = 12;
/// Trials in a row over which the error must become less than half.
pub(super) const PATIENCE: usize = 4;
/// The solver's tolerance as a share of the accuracy.
const DIGITS: f64 = 1e-2;

/// Schemes with and without event location, in the order in which they are tried.
pub(super) const MODES: [(Scheme, bool); 3] = [
    (Scheme::Staggered, false),
    (Scheme::Staggered, true),
    (Scheme::Moreau, false),
];

/// A trial as it is told.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TrialRow {
    pub scheme: &'static str,
    pub events: bool,
    pub dt_s: f64,
    pub steps: usize,
    /// Steps, events, sweeps, factorisations and pivots.
    pub work: usize,
    /// Expected error in the worst measure; null for the last of its kind and for a failed trial.
    pub error: Option<f64>,
    pub measure: &'static str,
}

/// All trials of a scheme, with or without events.
pub(super) struct Mode {
    pub scheme: Scheme,
    events: bool,
    pub trials: Vec<Option<Trial>>,
    pub open: bool,
    /// Whether another mode is better.
    pub beaten: bool,
    /// The level that holds the accuracy.
    pub held: Option<usize>,
}

/// The setting chosen for a scene, and what a run needs to be held to the accuracy.
pub struct Choice {
    pub asked: f64,
    /// The step of the run.
    pub step: Step,
    pub steps: usize,
    /// The expected error in the worst measure.
    pub expected: f64,
    pub measure: &'static str,
    pub trials: Vec<TrialRow>,
    /// Work of all trials, and of runs that were tightened.
    pub work: usize,
    /// Why a run was not kept, and what was changed.
    pub tightened: Vec<String>,
    /// The trial with half of the step at which the accuracy is known to hold, and its expected errors.
    pub(super) finest: Trial,
    pub(super) spare: Vec<Part>,
    pub(super) names: Vec<&'static str>,
    pub(super) motion: bool,
    /// Steps of the trial that holds the accuracy, and the scene's own tolerance.
    level_steps: usize,
    own_tolerance: f64,
}

/// Chooses step, scheme, events and tolerance for `scene` such that no measure is off by more than
/// `asked`.
///
/// # What is held
/// An accuracy R is relative. Each measure has a size, which does not depend on the closed form:
/// - a value that the closed form of the scene is compared with, such as a stopping time or a force: itself,
///   or what the scene names in place of it, such as the speed of a striker; a length: that of the scene
///   below; an angle: 1 rad;
/// - the trajectory, of a scene without such a value: the largest way of a body and its own size, L. It is the
///   largest distance of a body from where it should be at ten instants, or half its size times the angle;
/// - overlap and joint gap: L. Energy that nothing supplied: the energy of the scene, that is the largest
///   kinetic energy, the range of the potential energy and the weight of the bodies times L.
///
/// The last three should be 0 and are known from one run. A body that passes through another and an island that
/// failed hold no accuracy. Of the others only the computed values are used, never the exact ones (where two
/// sides of `three-discs` differ, the worse one is computed with their help).
///
/// # How it is chosen
/// Trials run over the whole time, with 4, 2, 1, 1/2, ... times the scene's step, in the scheme `staggered`, in
/// the same with events, and in `moreau`. Let `d_k` be the difference of a measure between the trials k and
/// k + 1, and p the observed order `log₂(d_{k−1}/d_k)` within 1/2 to 2. The expected error of trial k is
///
/// ```text
/// e_k = max( d_k/(1 − 2^−p),  max_{j<k} min(d_j, 1)/8^{k−j} )                (1)
/// 2 e_k ≤ R, and what is known from one run ≤ R                              (2)
/// ```
///
/// The second part of (1): no error of these methods falls faster than by 8 when the step is halved, so a
/// difference that does is chance. Two wrong runs that agree are met in two more ways. Three trials at least
/// are run of each scheme. And where two schemes are farther apart than twice the sum of their expected errors,
/// neither is believed until further trials say which is wrong; if the scheme of the scene holds (2) at three
/// levels and the others still contradict it, they converge to another motion and are dropped. A scheme
/// that another beats in error and work at two levels is dropped, and so is one whose error does not halve in
/// four halvings of the step.
///
/// Between the coarsest trial k that fulfils (2) and the one before, the step is the longest with
///
/// ```text
/// 2 e_k (Δt/Δt_k)^q ≤ R,   q = log₂(e_{k−1}/e_k) within 1 to 4                (3)
/// ```
///
/// The scheme of least work is taken. Work is the number of steps, located events, sweeps, factorisations and
/// pivots: it depends on no clock. The solver's tolerance is R/100, or the scene's if that is larger: an impulse
/// needs no digit that its step does not have.
///
/// # How it is held
/// The run is compared with the trial k + 1, [`Held`](super::Held): their distance and the expected error of that trial,
/// at most `e_k/2`, must stay below R. Where it does not, the run starts anew, first with the scene's
/// tolerance, then with the step of trial k.
///
/// # What it cannot see
/// An event that all trials of all schemes miss. A motion that depends on the smallest change, as that of many
/// bodies that tumble: trials never agree there, and the accuracy is refused with how near it came.
///
/// # Arguments
/// - `asked`: relative, within [`ACCURACIES`].
/// - `progress`: advanced once for each step of a trial.
///
/// # Errors
/// [`RunError::Unfit`] if `asked` is out of range, or if no setting holds it: the error names the measure
/// and how near it came. [`RunError::Step`] if the scene cannot be built.
///
/// # Source
/// Step doubling: Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, section II.4.
pub fn choose(scene: &Scene, asked: f64, progress: &Progress) -> Result<Choice, RunError> {
    let [least, most] = ACCURACIES;
    if !(least..=most).contains(&asked) {
        return Err(RunError::Unfit(format!(
            "--accuracy {asked}: must be {least:e} to {most}"
        )));
    }
    if scene.step.time <= 0.0 {
        return Err(RunError::Unfit(format!(
            "--accuracy {asked}: scene {} takes no time: step.time is 0",
            scene.name
        )));
    }
    let first = coarsest_steps(&scene.step);
    let mut modes = MODES.map(|(scheme, events)| Mode {
        scheme,
        events,
        trials: Vec::new(),
        open: true,
        beaten: false,
        held: None,
    });
    for level in 0..LEVELS {
        for mode in modes.iter_mut().filter(|mode| mode.open) {
            let scene = with(scene, mode, first << level);
            let trial = Trial::run(&scene, first << level, progress)?;
            mode.trials.push(trial);
        }
        let judge = Judge::of(&modes, asked);
        // two runs agree by chance sooner than three
        match level {
            0 => continue,
            1 => judge.close_twins(&mut modes),
            _ => {
                judge.hold(&mut modes, level, scene.step.scheme);
                judge.close(&mut modes);
            }
        }
        if modes.iter().all(|mode| !mode.open) {
            break;
        }
    }
    Judge::of(&modes, asked).choice(scene, modes)
}

/// Steps of the coarsest trial.
pub(super) fn coarsest_steps(step: &Step) -> usize {
    // a step of a scene is 1 s at most
    let steps = step.time / (COARSEST * step.dt).min(1.0) * (1.0 - 1e-12);
    INSTANTS * ((steps / INSTANTS as f64).ceil() as usize).max(1)
}

fn with(scene: &Scene, mode: &Mode, steps: usize) -> Scene {
    let mut scene = scene.clone();
    scene.step.scheme = mode.scheme;
    scene.step.events = mode.events;
    scene.step.dt = scene.step.time / steps as f64;
    scene
}

impl Judge {
    fn rows(&self, modes: &[Mode; 3]) -> Vec<TrialRow> {
        let mut rows = Vec::new();
        for mode in modes {
            for (k, trial) in mode.trials.iter().enumerate() {
                let Some(trial) = trial else { continue };
                let parts = self.errors(mode, k).into_iter();
                let (measure, error) = worst(parts.chain(trial.known.iter().copied()));
                let judged = k + 1 < mode.trials.len();
                rows.push(TrialRow {
                    scheme: mode.scheme.name(),
                    events: mode.events,
                    dt_s: trial.step.dt,
                    steps: trial.steps,
                    work: trial.seen.work,
                    error: Some(error).filter(|e| judged && e.is_finite()),
                    measure: if judged { measure } else { "" },
                });
            }
        }
        rows
    }

    fn choice(self, scene: &Scene, modes: [Mode; 3]) -> Result<Choice, RunError> {
        let trials = self.rows(&modes);
        let all = (0..modes.len()).filter_map(|j| Some((self.refined(&modes[j])?, j)));
        let Some(((steps, _), j)) = all.min_by_key(|((_, work), j)| (*work, *j)) else {
            return Err(self.not_reached(scene, &modes));
        };
        let mode = &modes[j];
        let k = mode.held.unwrap_or(0);
        let errors = self.errors(mode, k);
        let known = mode.trials[k].iter().flat_map(|t| t.known.iter().copied());
        let longer = mode.trials[k]
            .as_ref()
            .map_or(1.0, |t| t.steps as f64 / steps as f64);
        let (measure, error) = worst(errors.iter().copied().chain(known));
        // the error of half the step is half of it or less, and estimated like that of the trial
        let spare = errors.iter().map(|(name, e)| (*name, 0.5 * SAFETY * e));
        let spare = spare.collect();
        let level_steps = mode.trials[k].as_ref().map_or(steps, |t| t.steps);
        let mut step = with(scene, mode, steps).step;
        step.tolerance = step.tolerance.max(DIGITS * self.asked);
        let (asked, names, motion) = (self.asked, self.names, self.motion);
        let [a, b, c] = modes;
        let finest = [a, b, c]
            .into_iter()
            .nth(j)
            .and_then(|mut mode| mode.trials.swap_remove(k + 1));
        let Some(finest) = finest else {
            return Err(RunError::Unfit(format!(
                "--accuracy {asked}: a trial is missing"
            )));
        };
        Ok(Choice {
            asked,
            step,
            steps,
            // of first order at least where the step is longer than that of the trial
            expected: error * longer,
            measure,
            work: trials.iter().map(|row| row.work).sum(),
            trials,
            tightened: Vec::new(),
            finest,
            spare,
            names,
            motion,
            level_steps,
            own_tolerance: scene.step.tolerance,
        })
    }

    /// The error for an accuracy that no trial holds.
    fn not_reached(&self, scene: &Scene, modes: &[Mode; 3]) -> RunError {
        let nearest = modes
            .iter()
            .flat_map(|mode| (0..mode.trials.len().saturating_sub(1)).map(move |k| (mode, k)))
            .min_by(|a, b| {
                let size = |(mode, k): (&Mode, usize)| self.needed(mode, k).1;
                size(*a).total_cmp(&size(*b))
            });
        let asked = self.asked;
        let name = &scene.name;
        let Some((mode, k)) = nearest else {
            return RunError::Unfit(format!("--accuracy {asked}: scene {name} has no trial"));
        };
        let (measure, needed) = self.needed(mode, k);
        let dt = step_length(mode.trials[k].as_ref().map_or(scene.step.dt, |t| t.step.dt));
        let setting = words(mode.scheme, mode.events);
        let near = match needed.is_finite() {
            true if needed <= asked => {
                return RunError::Unfit(format!(
                    "--accuracy {asked}: not reached on scene {name}: {setting} agrees with itself to {} at dt {dt}, \
                     but another scheme converges to another motion",
                    number(needed, 2)
                ));
            }
            true => format!(
                "{measure} comes to {} at best, with a factor of {SAFETY} for safety",
                number(needed, 2)
            ),
            false => format!("{measure} never agrees between two trials"),
        };
        let why = match k + 2 < LEVELS {
            true => {
                "its error no longer halves in four halvings of the step, as with impacts in another order, or chaos"
            }
            false => "shorter steps are not tried",
        };
        RunError::Unfit(format!(
            "--accuracy {asked}: not reached on scene {name}: {near} ({setting}, dt {dt}, the most accurate of \
             {} trials); {why}",
            self.rows(modes).len()
        ))
    }
}

fn words(scheme: Scheme, events: bool) -> String {
    let with = if events { " with events" } else { "" };
    format!("scheme {}{with}", scheme.name())
}

impl Choice {
    /// Makes the setting finer after a run was not held, for the reason `why`: first the tolerance, then
    /// the step. False if it is that of the trial already, which held.
    pub(super) fn tighten(&mut self, why: &str, work: usize) -> bool {
        let what = if self.step.tolerance > self.own_tolerance {
            self.step.tolerance = self.own_tolerance;
            format!("tolerance {:e}", self.own_tolerance)
        } else if self.steps < self.level_steps {
            self.step.dt *= self.steps as f64 / self.level_steps as f64;
            self.steps = self.level_steps;
            format!("dt {}", step_length(self.step.dt))
        } else {
            return false;
        };
        self.work += work;
        self.tightened.push(format!("{why}: {what}"));
        true
    }

    /// The choice and its reason in a sentence.
    pub fn sentence(&self) -> String {
        format!(
            "accuracy {}: {}, dt {}, tolerance {:e}: the cheapest setting that holds it by {} trials; expected \
             error {}{}",
            self.asked,
            words(self.step.scheme, self.step.events),
            step_length(self.step.dt),
            self.step.tolerance,
            self.trials.len(),
            number(self.expected, 2),
            named(self.measure),
        )
    }
}

/// A measure in brackets; nothing where all errors are 0.
pub(super) fn named(measure: &str) -> String {
    match measure {
        "" => String::new(),
        measure => format!(" ({measure})"),
    }
}
