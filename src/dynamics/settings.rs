//! Settings of a stepper, and its errors.

use super::model::ModelError;
use super::rules::{Effort, ImpactLaw, Rules, Scheme};
use crate::contact::Vec3;
use crate::solver::Shares;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Most threads of a stepper; 1 without the feature `parallel`.
pub const MOST_THREADS: usize = if cfg!(feature = "parallel") { 1024 } else { 1 };

/// Explanation that the error of the number of threads adds.
const WHY: &str = if cfg!(feature = "parallel") {
    ""
} else {
    ": more need the feature `parallel`"
};

/// Settings of a [`MoreauStepper`](super::stepper::MoreauStepper).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepperSettings {
    pub scheme: Scheme,
    /// Whether all impacts and ends of slides are located in time inside the step; needs
    /// [`Scheme::Staggered`]. Without, only impacts of bodies with CCD or that are fast, and those that would
    /// leave a few bodies overlapped.
    pub events: bool,
    /// The impact law; the published scheme has no energy bound.
    pub impact_law: ImpactLaw,
    /// Whether pairs that overlap at the start are moved apart; [`Scheme::Moreau`] never does this.
    pub recovery: bool,
    /// Whether islands at rest keep their impulses from step to step, as long as nothing about them
    /// changes, instead of being solved in every step: see [`StepRecord::resting`](super::record::StepRecord::resting).
    #[serde(default = "yes")]
    pub keep_rest: bool,
    /// Whether bodies that contacts and joints connect are solved by themselves, instead of all blocks
    /// in one problem. With event location, swept bodies or dominance they always are.
    #[serde(default = "yes")]
    pub split_islands: bool,
    /// Whether contacts that the impulses of the others do not close are left out of the solve, see
    /// the working set in the crate's glossary.
    #[serde(default = "yes")]
    pub skip_distant: bool,
    /// Whether contacts without friction have one row. The second row is otherwise solved with a
    /// friction of 1e-12.
    #[serde(default = "yes")]
    pub skip_tangents: bool,
    /// How redundant contacts share a load.
    pub shares: Shares,
    /// A name of [`crate::solver::SOLVERS`].
    pub solver: String,
    /// Relative natural-map residual at which an island counts as solved.
    pub tolerance: f64,
    /// How hard the impulses of large islands in motion are looked for.
    #[serde(default)]
    pub effort: Effort,
    /// Number of threads that share a step, 1 to [`MOST_THREADS`]; no result depends on it.
    ///
    /// They share the detection of contacts and the choice of their rules from some thousand contacts
    /// on, and the islands to solve from some hundred contacts in several islands on. An island of
    /// more than 6000 contacts in motion is swept in parts on all threads, any other is solved on one
    /// thread: a step of `tumbler`, 9400 contacts near enough to close, takes two threads 0.76 of its time
    /// on one. Islands with dominance, and all islands with a user's own solver, are
    /// solved on the caller's thread; so is the detection in a world with hooks, or in which
    /// fewer than half of the bodies move.
    #[serde(default = "one")]
    pub threads: usize,
}

fn one() -> usize {
    1
}

fn yes() -> bool {
    true
}

impl Default for StepperSettings {
    fn default() -> Self {
        StepperSettings {
            scheme: Scheme::Staggered,
            events: false,
            impact_law: ImpactLaw::Capped,
            recovery: true,
            keep_rest: true,
            split_islands: true,
            skip_distant: true,
            skip_tangents: true,
            shares: Shares::Found,
            solver: "auto".to_owned(),
            tolerance: 1e-8,
            effort: Effort::Fast,
            threads: one(),
        }
    }
}

impl StepperSettings {
    pub(super) fn rules(&self) -> Rules {
        Rules {
            scheme: self.scheme,
            law: self.impact_law,
            shares: self.shares,
            events: self.events,
            sweeps: false,
            effort: self.effort,
            one_problem: !self.split_islands,
            distant: !self.skip_distant,
            tangents: !self.skip_tangents,
        }
    }

    pub(super) fn recovers(&self) -> bool {
        self.recovery && self.scheme == Scheme::Staggered
    }
}

/// Why a step could not be taken.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StepError {
    /// The step length is not a positive finite number.
    #[error("step length is {0} s, must be finite and above 0")]
    Dt(f64),
    /// Settings name a solver that does not exist.
    #[error("unknown solver '{0}'")]
    Solver(String),
    /// The tolerance is not a positive finite number.
    #[error("solver tolerance is {0}, must be finite and above 0")]
    Tolerance(f64),
    /// The number of threads is out of range.
    #[error("threads are {0}, must be 1 to {MOST_THREADS}{WHY}")]
    Threads(usize),
    /// The system cannot start that many threads.
    #[error("{threads} threads cannot be started: {why}")]
    Spawn { threads: usize, why: String },
    /// Event location with a scheme that ignores gaps.
    #[error("event location needs the scheme 'staggered'; 'moreau' ignores gaps")]
    Events,
    /// A velocity or position is NaN or infinite. The model is unchanged.
    #[error("body {body} has a velocity that is not finite at t = {time} s")]
    NonFinite { body: usize, time: f64 },
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// # Errors
/// [`StepError::NonFinite`] names the first body whose velocity is not finite.
pub(super) fn check_finite(velocities: &[Vec3], time: f64) -> Result<(), StepError> {
    match velocities
        .iter()
        .position(|u| u.iter().any(|x| !x.is_finite()))
    {
        Some(body) => Err(StepError::NonFinite { body, time }),
        None => Ok(()),
    }
}
