use super::baseline::Baseline;
use super::reductions::REDUCTIONS;
use super::simulate::Engine;
use crate::dynamics::Effort;
use crate::scene::{ImpactLaw, Step};
use crate::solver::Shares;

/// In a label: islands at rest are solved in every step.
pub(crate) const REST_SOLVED: &str = "rest solved";

/// One point of an experiment: engine, step and settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    pub engine: Engine,
    /// Step length and simulated time \[s\]; for our engine also scheme, solver, tolerance, threads.
    pub step: Step,
    /// The solver settings of a peer.
    pub baseline: Option<Baseline>,
}

impl Setting {
    /// `engine` with its preset.
    pub fn new(engine: Engine, step: &Step) -> Setting {
        Setting {
            engine,
            step: step.clone(),
            baseline: engine.baseline(),
        }
    }

    /// The same setting with steps of `dt` \[s\].
    pub fn with_dt(&self, dt: f64) -> Setting {
        let mut other = self.clone();
        other.step.dt = dt;
        other
    }

    /// Engine and scheme: the column title of tables.
    pub fn name(&self) -> String {
        let events = match self.engine {
            Engine::Moreau if self.step.events => "events",
            _ => "",
        };
        let words = [self.engine.name(), self.scheme(), events];
        words.join(" ").trim_end().to_owned()
    }

    /// All settings without a column of their own in `results.csv`, separated by `", "`: for our
    /// engine the tolerance and what differs from the default, for a peer all its settings.
    pub fn label(&self) -> String {
        if let Some(settings) = &self.baseline {
            return settings.to_string();
        }
        let mut label = format!("tolerance {:e}", self.step.tolerance);
        if self.step.events {
            label.push_str(", events");
        }
        if self.step.impact_law != ImpactLaw::default() {
            label.push_str(&format!(", {} impacts", self.step.impact_law.name()));
        }
        if !self.step.recovery {
            label.push_str(", no recovery");
        }
        if !self.step.keep_rest {
            label.push_str(", ");
            label.push_str(REST_SOLVED);
        }
        for reduction in REDUCTIONS.iter().skip(1).filter(|r| !(r.is_on)(&self.step)) {
            label.push_str(&format!(", {} = false", reduction.key));
        }
        if self.step.shares != Shares::default() {
            label.push_str(&format!(", {} shares", self.step.shares.name()));
        }
        if self.step.effort != Effort::default() {
            label.push_str(&format!(", {} effort", self.step.effort.name()));
        }
        label
    }

    /// The scheme's name; empty for a peer.
    pub fn scheme(&self) -> &'static str {
        match self.engine {
            Engine::Moreau => self.step.scheme.name(),
            Engine::Rapier | Engine::RapierStiff | Engine::Box2d => "",
        }
    }

    /// The impulse solver's name; `soft` for a peer.
    pub fn solver(&self) -> &str {
        match self.engine {
            Engine::Moreau => &self.step.solver,
            Engine::Rapier | Engine::RapierStiff | Engine::Box2d => "soft",
        }
    }

    /// Number of threads that step; 1 for a peer, as it is built here.
    pub fn threads(&self) -> usize {
        match self.engine {
            Engine::Moreau => self.step.threads,
            _ => 1,
        }
    }

    /// Precision of the state that is stepped.
    pub fn precision(&self) -> &'static str {
        match self.engine {
            Engine::Moreau => "f64",
            Engine::Rapier | Engine::RapierStiff => crate::rapier::PRECISION,
            Engine::Box2d => "f32",
        }
    }
}

/// Number of steps of `step.dt` that cover `step.time`.
pub fn step_count(step: &Step) -> usize {
    // a time that is a whole number of steps up to rounding is that many steps
    (step.time / step.dt * (1.0 - 1e-12)).ceil() as usize
}
