//! The book of the crop's mass.

use super::shapes::arc_length;
use super::strip::Passed;
use super::world::ThreshingWorld;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

/// Mass of the crop over measured revolutions \[kg\], machine totals.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Flow {
    /// Feed times time.
    pub due: f64,
    pub entered: f64,
    /// Left behind the outlet, and thrown back at the inlet.
    pub left: f64,
    pub thrown_back: f64,
    /// In the machine at the start and at the end, and in the mean of the steps.
    pub inside_start: f64,
    pub inside_end: f64,
    pub inside_mean: f64,
    /// Due at the end of the revolutions, and without room at the inlet.
    pub waiting: f64,
    /// Bodies of crop at once: the most, and the mean of the steps.
    pub bodies_most: usize,
    pub bodies_mean: f64,
    /// Share of the grains above the concave that reach within the circle of the tips, mean of the steps.
    pub reach_tips: f64,
    /// Share of the grains that left whom a tooth has met at least once.
    pub met_share: f64,
    /// Mean depth \[m\] that the grains above the concave would have as a solid layer.
    pub solid_depth: f64,
    /// Bodies found behind the steel, which must be 0.
    pub through_steel: usize,
}

impl Flow {
    /// At the start of measured revolutions.
    pub(super) fn start(world: &ThreshingWorld) -> Flow {
        Flow {
            inside_start: world.crop_mass(),
            ..Flow::default()
        }
    }

    /// Counts the crop in the machine after a step.
    pub(super) fn count(&mut self, world: &ThreshingWorld) {
        let bodies = world.crop_bodies();
        self.bodies_most = self.bodies_most.max(bodies);
        self.bodies_mean += bodies as f64;
        self.inside_mean += world.crop_mass();
        let (all, reach, area) = world.layer();
        self.reach_tips += reach as f64 / all.max(1) as f64;
        self.solid_depth += area;
    }

    /// At the end of `steps` steps that took `time` \[s\].
    pub(super) fn close(
        self,
        world: &ThreshingWorld,
        passed: &Passed,
        steps: usize,
        time: f64,
    ) -> Flow {
        let p = world.parameters();
        let width = p.machine_width;
        Flow {
            due: p.feed_rate * time,
            entered: width * passed.mass_in,
            left: width * passed.mass_out,
            thrown_back: width * passed.mass_back,
            inside_start: width * self.inside_start,
            inside_end: width * world.crop_mass(),
            inside_mean: width * self.inside_mean / steps as f64,
            waiting: width * world.waiting(),
            bodies_mean: self.bodies_mean / steps as f64,
            reach_tips: self.reach_tips / steps as f64,
            met_share: passed.met_out as f64 / passed.grains_out.max(1) as f64,
            solid_depth: self.solid_depth / (steps as f64 * arc_length(p)),
            through_steel: passed.through_steel,
            ..self
        }
    }

    /// What came in less what went out and what the machine gained \[kg\]: round-off, unless crop was lost
    /// through the steel.
    pub fn imbalance(&self) -> f64 {
        let gained = self.inside_end - self.inside_start;
        self.entered - self.left - self.thrown_back - gained
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "due_kg": self.due,
            "entered_kg": self.entered,
            "left_kg": self.left,
            "thrown_back_kg": self.thrown_back,
            "inside_start_kg": self.inside_start,
            "inside_end_kg": self.inside_end,
            "inside_mean_kg": self.inside_mean,
            "waiting_kg": self.waiting,
            "bodies_most": self.bodies_most,
            "bodies_mean": self.bodies_mean,
            "reach_tips_share": self.reach_tips,
            "met_a_tooth_share": self.met_share,
            "solid_depth_m": self.solid_depth,
            "through_steel": self.through_steel,
            "imbalance_kg": self.imbalance(),
        })
    }
}
