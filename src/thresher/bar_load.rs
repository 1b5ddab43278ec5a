//! The load on a bar over its angle.

use super::rows::BarLoadRow;
use super::world::{Part, ThreshingWorld};
use crate::dynamics::record::StepRecord;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Width of an interval of angles \[degrees\].
const WIDTH: f64 = 2.0;
const COUNT: usize = 180;

/// Impulses on all bars by the angle of the bar, in intervals of 2 degrees, over measured time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BarLoad {
    /// Normal and friction impulse [N s] and time of a bar \[s\] of each interval, of the slice.
    intervals: Vec<[f64; 3]>,
}

impl Default for BarLoad {
    fn default() -> Self {
        BarLoad {
            intervals: vec![[0.0; 3]; COUNT],
        }
    }
}

impl BarLoad {
    /// Adds a step of `dt` \[s\].
    pub(super) fn add(&mut self, record: &StepRecord, world: &ThreshingWorld, bars: u32, dt: f64) {
        // in the middle of the step, where detection finds the contacts
        let cylinder = world.angle() - 0.5 * dt * world.speed();
        let interval = |bar: usize| {
            let angle = cylinder + TAU * bar as f64 / f64::from(bars);
            let at = angle.rem_euclid(TAU).to_degrees() / WIDTH;
            (at as usize).min(COUNT - 1)
        };
        for bar in 0..bars as usize {
            self.intervals[interval(bar)][2] += dt;
        }
        for contact in &record.contacts {
            if let Some(Part::Tooth(bar)) = world.part(contact) {
                let sums = &mut self.intervals[interval(bar)];
                sums[0] += contact.impulse_n;
                sums[1] += contact.impulse_t.abs();
            }
        }
    }

    /// Mean forces on one bar \[N\], machine totals, in the middle of each interval that a bar
    /// passed.
    ///
    /// # Arguments
    /// - `teeth`: named in every row.
    /// - `width`: of the machine \[m\].
    pub fn rows(&self, teeth: &str, width: f64) -> Vec<BarLoadRow> {
        let passed = self
            .intervals
            .iter()
            .enumerate()
            .filter(|(_, sums)| sums[2] > 0.0);
        passed
            .map(|(k, [normal, friction, time])| BarLoadRow {
                teeth: teeth.to_owned(),
                angle_deg: (k as f64 + 0.5) * WIDTH,
                normal_n: normal / time * width,
                friction_n: friction / time * width,
            })
            .collect()
    }
}
