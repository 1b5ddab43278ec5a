//! Reads errors from the differences of trials, and closes what can no longer be the cheapest.

use super::super::reference::Size;
use super::choice::{Mode, PATIENCE, SAFETY};
use super::trial::{INSTANTS, Part, ROUND_OFF, Trial, worst};
use crate::scene::Scheme;

/// No error of a method here falls faster than this when the step is halved: pins keep energy to third order.
const FASTEST: f64 = 8.0;

/// Reads errors from the differences of trials.
pub(super) struct Judge {
    pub asked: f64,
    /// Names of the values that some trial found.
    pub names: Vec<&'static str>,
    pub motion: bool,
}

impl Judge {
    pub fn of(modes: &[Mode; 3], asked: f64) -> Judge {
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

    /// Expected errors of trial `k`, see (1) of [`choose`](super::choose).
    pub fn errors(&self, mode: &Mode, k: usize) -> Vec<Part> {
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
            pairs.any(|((_, apart), ((_, a), (_, b)))| *apart > SAFETY * (a + b) + ROUND_OFF)
        })
    }

    /// Finds the coarsest trial of each open mode that holds the accuracy, and closes what no longer gets
    /// better.
    pub fn hold(&self, modes: &mut [Mode; 3], level: usize, own: Scheme) {
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
    pub fn close_twins(&self, modes: &mut [Mode; 3]) {
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

    pub fn needed(&self, mode: &Mode, k: usize) -> Part {
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
    pub fn close(&self, modes: &mut [Mode; 3]) {
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
    /// work; see (3) of [`choose`](super::choose).
    pub fn refined(&self, mode: &Mode) -> Option<(usize, usize)> {
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
}
