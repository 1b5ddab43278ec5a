use super::super::simulate::Engine;
use crate::contact::{Vec2, Vec3};
use crate::dynamics::Pose64;
use crate::dynamics::record::{ContactRecord, ContactStatus, StepRecord};
use crate::scene::Built;
use serde::{Deserialize, Serialize};

/// A loaded contact: its position \[m\] and impulse `(P_N, P_T)` [N s].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Touch {
    pub position: Vec2,
    pub impulse: Vec2,
}

/// Data of a run that the closed forms need, step by step.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Samples {
    /// Time \[s\] and states of all bodies, at the start and at the end of each step.
    pub(super) time: Vec<f64>,
    pub(super) states: Vec<Vec<(Pose64, Vec3)>>,
    /// Kinetic and potential energy at the same instants \[J\].
    pub(super) energy: Vec<f64>,
    /// For each step: the sums of |P_T| and P_N, and whether any loaded contact sticks.
    tangent: Vec<f64>,
    normal: Vec<f64>,
    pub(super) sticks: Vec<bool>,
    /// Sum of all contacts' `load_slip` over the run \[N m\]; wear is proportional to it.
    pub(super) load_slip: f64,
    /// Time of the last impact that was located inside a step \[s\].
    pub(super) settled: Option<f64>,
    /// The loaded contacts of each step.
    pub(super) contacts: Vec<Vec<Touch>>,
}

impl Samples {
    /// Samples with the state at the start.
    pub fn start(built: &Built, engine: Engine) -> Samples {
        let mut samples = Samples::default();
        samples.time.push(0.0);
        samples.states.push(states(built, engine));
        samples
    }

    /// Adds one step.
    pub fn add(&mut self, record: &StepRecord, built: &Built, engine: Engine) {
        self.time.push(record.time);
        let energy = &record.energy;
        if self.energy.is_empty() {
            self.energy
                .push(energy.kinetic_start + energy.potential_start);
        }
        self.energy.push(energy.kinetic_end + energy.potential_end);
        self.states.push(states(built, engine));
        let loaded = record.contacts.iter().filter(|c| c.impulse_n > 0.0);
        self.tangent
            .push(loaded.clone().map(|c| c.impulse_t.abs()).sum());
        self.normal.push(loaded.clone().map(|c| c.impulse_n).sum());
        self.sticks
            .push(loaded.clone().any(|c| c.status == ContactStatus::Stick));
        self.load_slip += record.contacts.iter().map(|c| c.load_slip).sum::<f64>();
        let located =
            |c: &&ContactRecord| c.status == ContactStatus::Impact && c.time < record.time;
        let impacts = loaded.clone().filter(located);
        let settled = impacts.map(|c| c.time).reduce(f64::max);
        self.settled = settled.or(self.settled);
        let touch = |c: &ContactRecord| Touch {
            position: c.position,
            impulse: Vec2::new(c.impulse_n, c.impulse_t),
        };
        self.contacts.push(loaded.map(touch).collect());
    }

    /// States of all bodies at the end.
    pub(super) fn last(&self) -> &[(Pose64, Vec3)] {
        self.states.last().map_or(&[], Vec::as_slice)
    }

    /// Time at the end \[s\].
    pub(super) fn end(&self) -> f64 {
        self.time.last().copied().unwrap_or(0.0)
    }

    /// Number of steps.
    pub(super) fn steps(&self) -> usize {
        self.time.len() - 1
    }

    /// Largest distance \[m\] of a `point` of body `k` \[m, in its frame\] from its start. Infinite if
    /// its position was ever not finite.
    pub(super) fn motion(&self, k: usize, point: Vec2) -> f64 {
        let start = self.states[0][k].0.apply(point);
        let way = |s: &Vec<(Pose64, Vec3)>| (s[k].0.apply(point) - start).norm();
        let far = |d: f64| if d.is_finite() { d } else { f64::INFINITY };
        self.states.iter().map(way).map(far).fold(0.0, f64::max)
    }

    /// Mean force \[N\] `(|N|, |T|)` of the contacts within `reach` \[m\] of `place`, over the last
    /// tenth of the run.
    pub(super) fn force(&self, place: Vec2, reach: f64) -> Vec2 {
        let from = self.steps() * 9 / 10;
        let near = |t: &&Touch| (t.position - place).norm() < reach;
        let impulse: Vec2 = self.contacts[from..]
            .iter()
            .flatten()
            .filter(near)
            .map(|t| t.impulse)
            .sum();
        impulse.abs() / (self.end() - self.time[from])
    }

    /// Largest `|E − E₀|/scale` over the run.
    pub(super) fn energy_drift(&self, scale: f64) -> f64 {
        let start = self.energy[0];
        let drift = |e: &f64| (e - start).abs() / scale;
        self.energy.iter().map(drift).fold(0.0, f64::max)
    }

    pub(super) fn step_length(&self, k: usize) -> f64 {
        self.time[k + 1] - self.time[k]
    }

    /// Time \[s\] at which sliding ends: in the first step that sticks, after the share
    /// `|P_T| / (μ P_N)` of that step.
    pub(super) fn first_stick(&self, friction: f64) -> Option<f64> {
        let k = self.sticks.iter().position(|s| *s)?;
        let share = self.tangent[k] / (friction * self.normal[k]);
        Some(self.time[k] + self.step_length(k) * share)
    }
}

fn states(built: &Built, engine: Engine) -> Vec<(Pose64, Vec3)> {
    let unknown = (Pose64::new(Vec2::zeros(), 0.0), Vec3::repeat(f64::NAN));
    (0..built.bodies())
        .map(|k| engine.state(built, k).unwrap_or(unknown))
        .collect()
}
