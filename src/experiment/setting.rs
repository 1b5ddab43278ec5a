use super::baseline::Baseline;
use super::simulate::Engine;
use crate::scene::{ImpactLaw, Step};
use crate::solver::Shares;

/// One point of an experiment: who steps, how, and how finely.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    pub engine: Engine,
    /// Step length and simulated time \[s\]; of ours scheme, solver, tolerance and threads as well.
    pub step: Step,
    /// A peer's solver settings where a peer steps.
    pub baseline: Option<Baseline>,
}

impl Setting {
    /// `engine` with its own preset.
    pub fn new(engine: Engine, step: &Step) -> Setting {
        Setting {
            engine,
            step: step.clone(),
            baseline: engine.baseline(),
        }
    }

    /// The same with steps of `dt` \[s\].
    pub fn with_dt(&self, dt: f64) -> Setting {
        let mut other = self.clone();
        other.step.dt = dt;
        other
    }

    /// Engine and scheme, as tables head their columns.
    pub fn name(&self) -> String {
        let events = match self.engine {
            Engine::Moreau if self.step.events => "events",
            _ => "",
        };
        let words = [self.engine.name(), self.scheme(), events];
        words.join(" ").trim_end().to_owned()
    }

    /// Everything that `results.csv` has no column of its own for, in parts separated by `", "`:
    /// for ours the tolerance and what differs from the default, for a peer frequency, substeps
    /// and what else it has.
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
        if self.step.shares != Shares::default() {
            label.push_str(&format!(", {} shares", self.step.shares.name()));
        }
        label
    }

    /// The scheme's name; empty where the engine has only its own.
    pub fn scheme(&self) -> &'static str {
        match self.engine {
            Engine::Moreau => self.step.scheme.name(),
            Engine::Rapier | Engine::RapierStiff | Engine::Box2d => "",
        }
    }

    /// The impulse solver's name; `soft` for a peer's.
    pub fn solver(&self) -> &str {
        match self.engine {
            Engine::Moreau => &self.step.solver,
            Engine::Rapier | Engine::RapierStiff | Engine::Box2d => "soft",
        }
    }

    /// Threads that step: one of a peer, built as it is here.
    pub fn threads(&self) -> usize {
        match self.engine {
            Engine::Moreau => self.step.threads,
            _ => 1,
        }
    }

    /// Of the state that is stepped.
    pub fn precision(&self) -> &'static str {
        match self.engine {
            Engine::Moreau => "f64",
            Engine::Rapier | Engine::RapierStiff => crate::rapier::PRECISION,
            Engine::Box2d => "f32",
        }
    }
}

/// Steps of `step.dt` that cover `step.time`.
pub fn step_count(step: &Step) -> usize {
    // a time that is a whole number of steps up to rounding is that many steps
    (step.time / step.dt * (1.0 - 1e-12)).ceil() as usize
}
