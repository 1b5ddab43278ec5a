//! Settings of a stepper, and why a step cannot be taken.

use super::model::ModelError;
use super::rules::{ImpactLaw, Rules, Scheme};
use crate::contact::Vec3;
use crate::solver::Shares;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Most threads of a stepper: one without the feature `parallel`.
pub const MOST_THREADS: usize = if cfg!(feature = "parallel") { 1024 } else { 1 };

/// What the error of another number adds.
const WHY: &str = if cfg!(feature = "parallel") {
    ""
} else {
    ": more need the feature `parallel`"
};

/// How a [`MoreauStepper`](super::stepper::MoreauStepper) steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepperSettings {
    pub scheme: Scheme,
    /// Impacts are located in time inside the step; needs [`Scheme::Staggered`].
    pub events: bool,
    /// What impacts return; the published scheme has no bound.
    pub impact_law: ImpactLaw,
    /// Whether pairs that start overlapped are moved apart; [`Scheme::Moreau`] never does.
    pub recovery: bool,
    /// How a load is shared out among redundant contacts.
    pub shares: Shares,
    /// A name of [`crate::solver::SOLVERS`].
    pub solver: String,
    /// Relative natural-map residual at which an island counts as solved.
    pub tolerance: f64,
    /// Threads that islands are shared out among, 1 to [`MOST_THREADS`]; nothing that is computed depends on it.
    ///
    /// It pays from some hundred contacts in several islands on: one island is solved on one thread,
    /// and so are islands with dominance and all that a solver of the user's own solves.
    #[serde(default = "one")]
    pub threads: usize,
}

fn one() -> usize {
    1
}

impl Default for StepperSettings {
    fn default() -> Self {
        StepperSettings {
            scheme: Scheme::Staggered,
            events: false,
            impact_law: ImpactLaw::Capped,
            recovery: true,
            shares: Shares::Found,
            solver: "auto".to_owned(),
            tolerance: 1e-8,
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
    /// No number of threads.
    #[error("threads are {0}, must be 1 to {MOST_THREADS}{WHY}")]
    Threads(usize),
    /// The system does not give so many threads.
    #[error("{threads} threads cannot be started: {why}")]
    Spawn { threads: usize, why: String },
    /// Event location with a scheme that ignores gaps.
    #[error("event location needs the scheme 'staggered'; 'moreau' ignores gaps")]
    Events,
    /// A velocity or position is NaN or infinite; the model stands as it did before.
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
