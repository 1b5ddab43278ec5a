//! Chooses the cheapest setting that holds an accuracy, from trials with step doubling.

use super::super::reference::Size;
use super::super::simulate::RunError;
use super::trial::{INSTANTS, Part, Trial, worst};
use crate::report::{Progress, number, step_length};
use crate::scene::{Scene, Scheme, Step};
use serde::Serialize;

/// The accuracies that can be asked for.
pub const ACCURACIES: [f64; 2] = [1e-6, 0.1];
/// The expected error must be smaller by this factor than what is asked.
const SAFETY: f64 = 2.0;
/// The coarsest step in steps of the scene.
const COARSEST: f64 = 4.0;
/// Halvings of the coarsest step, with it: the finest is 1/512 of the scene's.
const LEVELS: usize = 12;
/// Trials in a row over which the error must become less than half.
const PATIENCE: usize = 3;
/// No error of a method here falls faster than this when the step is halved: pins keep energy to third order.
const FASTEST: f64 = 8.0;
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
struct Mode {
    scheme: Scheme,
    events: bool,
    trials: Vec<Option<Trial>>,
    open: bool,
    /// Whether another mode is better.
    beaten: bool,
    /// The level that holds the accuracy.
    held: Option<usize>,
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
/// `asked`; see [the module](super).
///
/// # Arguments
/// - `asked`: relative, within [`ACCURACIES`].
/// - `progress`: advanced once for each step of a trial.
///
/// # Errors
/// [`RunError::Unfit`] if `asked` is out of range, or if no setting holds it: the error names the measure
/// and how near it came. [`RunError::Step`] if the scene cannot be built.
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

/// Reads errors from the differences of trials.
struct Judge {
    asked: f64,
    /// Names of the values that some trial found.
    names: Vec<&'static str>,
    motion: bool,
}

impl Judge {
    fn of(modes: &[Mode; 3], asked: f64) -> Judge {
        let trials = || modes.iter().flat_map(|mode| mode.trials.iter().flatten());
        let mut names: Vec<&'static str> = Vec::new();
        for measure in trials().flat_map(|trial| &trial.found) {
            if measure.size != Size::Motion && !names.contains(&measure.name) {
                names.push(measure.name);
            }
        }
        let motion = names.is_empty() || trials().any(Trial::has_motion);
        Judge {
            asked,
            names,
            motion,
        }
    }

    /// The differences of the trials `k` and `k + 1`; infinite ones if either failed.
    fn doubled(&self, mode: &Mode, k: usize) -> Vec<Part> {
        match (mode.trials.get(k), mode.trials.get(k + 1)) {
            (Some(Some(a)), Some(Some(b))) => a.differences(b, &self.names, self.motion),
            _ => {
                let of = |name: &&'static str| (*name, f64::INFINITY);
                let mut parts: Vec<Part> = self.names.iter().map(of).collect();
                if self.motion {
                    parts.push(("trajectory", f64::INFINITY));
                }
                parts
            }
        }
    }

    /// Expected errors of trial `k`, see (1) of [the module](super).
    fn errors(&self, mode: &Mode, k: usize) -> Vec<Part> {
        let doubled: Vec<Vec<Part>> = (0..=k.max(1)).map(|j| self.doubled(mode, j)).collect();
        let error = |m: usize| {
            let (name, apart) = doubled[k][m];
            if !apart.is_finite() {
                return (name, apart);
            }
            let pair = k.max(1);
            let order = (doubled[pair - 1][m].1 / doubled[pair][m].1).log2();
            let order = if order.is_nan() {
                0.5
            } else {
                order.clamp(0.5, 2.0)
            };
            let here = apart / (1.0 - (-order).exp2());
            // a first difference that nothing precedes is not smaller than the next
            let here = if k == 0 {
                here.max(doubled[1][m].1)
            } else {
                here
            };
            // what was wrong by all of it counts as such
            let before = (0..k).map(|j| doubled[j][m].1.min(1.0) / FASTEST.powi((k - j) as i32));
            (name, before.fold(here, f64::max))
        };
        (0..doubled[k].len()).map(error).collect()
    }

    /// Whether trial `k` of a mode and the finest judged trial of another are farther apart than their
    /// expected errors allow: one of them is wrong.
    fn contradicted(&self, modes: &[Mode; 3], j: usize, k: usize) -> bool {
        let Some(Some(mine)) = modes[j].trials.get(k) else {
            return false;
        };
        let errors = self.errors(&modes[j], k);
        let others = modes
            .iter()
            .enumerate()
            .filter(|(i, other)| *i != j && !other.beaten);
        others.into_iter().any(|(_, other)| {
            let last = other.trials.len().saturating_sub(2);
            let Some(Some(theirs)) = other.trials.get(last) else {
                return false;
            };
            let apart = mine.differences(theirs, &self.names, self.motion);
            let allowed = errors.iter().zip(self.errors(other, last));
            let mut pairs = apart.iter().zip(allowed);
            pairs.any(|((_, apart), ((_, a), (_, b)))| {
                *apart > SAFETY * (a + b) + f64::from(f32::EPSILON)
            })
        })
    }

    /// Finds the coarsest trial of each open mode that holds the accuracy, and closes what no longer gets
    /// better.
    fn hold(&self, modes: &mut [Mode; 3], level: usize, own: Scheme) {
        self.settle(modes, level, own);
        for j in 0..modes.len() {
            if modes[j].open {
                let holds = |k: &usize| {
                    self.needed(&modes[j], *k).1 <= self.asked && !self.contradicted(modes, j, *k)
                };
                modes[j].held = (0..level).find(holds);
            }
        }
        for mode in modes.iter_mut().filter(|mode| mode.open) {
            mode.open = mode.held.is_none() && self.falls(mode, level - 1);
        }
    }

    /// Drops the other schemes where they contradict that of the scene although it holds the accuracy by
    /// itself at [`PATIENCE`] levels: they converge to another motion.
    fn settle(&self, modes: &mut [Mode; 3], level: usize, own: Scheme) {
        let Some(first) = level.checked_sub(PATIENCE) else {
            return;
        };
        let stands = |j: usize| {
            let mode = &modes[j];
            mode.scheme == own
                && mode.trials.len() > level
                && (first..level).all(|k| self.needed(mode, k).1 <= self.asked)
                && self.contradicted(modes, j, level - 1)
        };
        if (0..modes.len()).any(stands) {
            for mode in modes.iter_mut().filter(|mode| mode.scheme != own) {
                (mode.open, mode.beaten, mode.held) = (false, true, None);
            }
        }
    }

    /// Closes a mode whose first two trials are those of another: nothing sets them apart in this scene.
    fn close_twins(&self, modes: &mut [Mode; 3]) {
        for j in (1..modes.len()).rev() {
            let same = |a: &Option<Trial>, b: &Option<Trial>| match (a, b) {
                (Some(a), Some(b)) => {
                    let apart = a.differences(b, &self.names, true);
                    a.seen.work == b.seen.work && worst(apart.into_iter()).1 == 0.0
                }
                _ => false,
            };
            let twin = (0..j).any(|i| {
                let pairs = modes[i].trials.iter().zip(&modes[j].trials);
                pairs.into_iter().all(|(a, b)| same(a, b))
            });
            if twin {
                (modes[j].open, modes[j].beaten) = (false, true);
            }
        }
    }

    /// All that trial `k` must keep below the accuracy: expected errors times [`SAFETY`], and what it
    /// measured itself.
    fn all_needed(&self, mode: &Mode, k: usize) -> Vec<Part> {
        let mut parts = self.errors(mode, k);
        for part in &mut parts {
            part.1 *= SAFETY;
        }
        if let Some(Some(trial)) = mode.trials.get(k) {
            parts.extend(&trial.known);
        }
        parts
    }

    fn needed(&self, mode: &Mode, k: usize) -> Part {
        worst(self.all_needed(mode, k).into_iter())
    }

    /// Whether the error still falls: after [`PATIENCE`] halvings it must be less than half.
    fn falls(&self, mode: &Mode, k: usize) -> bool {
        let Some(before) = k.checked_sub(PATIENCE) else {
            return true;
        };
        // what is good enough waits for what contradicts it
        let now = self.needed(mode, k).1;
        now <= self.asked || now < 0.5 * self.needed(mode, before).1
    }

    /// Closes what can no longer be the cheapest: a mode whose next setting costs more than one that
    /// holds, and one that another beat at the last two levels in error and work.
    fn close(&self, modes: &mut [Mode; 3]) {
        let held = modes.iter().filter_map(|mode| Some(self.refined(mode)?.1));
        let cheapest = held.min().unwrap_or(usize::MAX);
        let at = |mode: &Mode, k: usize| -> Option<(f64, usize)> {
            let work = mode.trials.get(k)?.as_ref()?.seen.work;
            Some((self.needed(mode, k).1, work))
        };
        for k in (0..modes.len()).rev() {
            if !modes[k].open {
                continue;
            }
            let last = modes[k].trials.len() - 1;
            let work = at(&modes[k], last).map_or(0, |(_, work)| work);
            let beaten = |other: &Mode| {
                [last - 1, last - 2].iter().all(|&level| {
                    match (at(&modes[k], level), at(other, level)) {
                        (Some(mine), Some(yours)) => yours.0 <= mine.0 && yours.1 <= mine.1,
                        (mine, yours) => mine.is_none() && yours.is_some(),
                    }
                })
            };
            let others = (0..modes.len()).filter(|j| *j != k && !modes[*j].beaten);
            let dominated = others.into_iter().any(|j| beaten(&modes[j]))
                && !self.contradicted(modes, k, last - 1);
            modes[k].beaten = dominated;
            modes[k].open = work < cheapest && !dominated;
        }
    }

    /// The fewest steps expected to hold, between the level that does and the one before, and their
    /// work; see (3) of [the module](super).
    fn refined(&self, mode: &Mode) -> Option<(usize, usize)> {
        let k = mode.held?;
        let trial = mode.trials[k].as_ref()?;
        let mut longer: f64 = 2.0;
        if k == 0 {
            longer = 1.0;
        } else {
            let coarse = self.all_needed(mode, k - 1);
            for ((_, fine), (_, coarse)) in self.all_needed(mode, k).iter().zip(&coarse) {
                let order = (coarse / fine).log2();
                let order = match order {
                    // another regime: what a setting between them does is not known
                    o if o > 4.0 && *coarse > self.asked => f64::INFINITY,
                    o if o >= 1.0 => o,
                    _ => 2.0,
                };
                longer = longer.min((self.asked / fine).powf(1.0 / order).max(1.0));
            }
        }
        let coarser = if k == 0 { 0 } else { trial.steps / 2 };
        let steps = (trial.steps as f64 / longer / INSTANTS as f64).ceil() as usize * INSTANTS;
        let steps = steps.clamp(coarser + INSTANTS, trial.steps.max(coarser + INSTANTS));
        let work = trial.seen.work as f64 * steps as f64 / trial.steps as f64;
        Some((steps, work.ceil() as usize))
    }

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
        // the error of half the step is half of it or less
        let spare = errors.iter().map(|(name, e)| (*name, 0.5 * e)).collect();
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
                "its error no longer halves in three halvings of the step, as with impacts in another order, or chaos"
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
