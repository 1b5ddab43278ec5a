//! The calibration of the wear coefficient to a published depth.

use super::blocks::Calibration;
use super::parameters::{Hold, Thresher};
use crate::report::{number, quantity};
use crate::wear::WearState;
use serde_json::{Value, json};

/// What a run gives at a published point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibrated {
    pub target: Calibration,
    /// Largest depth \[m\] after the point's cycles; `None` if the run ends before.
    pub depth: Option<f64>,
    /// Wear coefficient [m²/N] with which this run has the point's depth after its cycles; `None` if
    /// the run ends before. Jumps are bounded by depths, so that the course of the wear does not
    /// depend on the coefficient, and the cycles are in inverse proportion to it.
    pub coefficient: Option<f64>,
}

impl Calibrated {
    /// `None` for a run without a point, at another torque or speed, or whose torque is not held.
    pub(super) fn of(p: &Thresher, state: &WearState) -> Option<Calibrated> {
        let target = p.calibrate?;
        let elsewhere = target.speed != p.speed || target.torque != p.operating_torque;
        if elsewhere || p.hold != Hold::Torque {
            return None;
        }
        let points = state.life().points().iter();
        let course: Vec<(f64, f64)> = points
            .map(|q| (q.cycles, q.depth.iter().copied().fold(0.0, f64::max)))
            .collect();
        let inverse: Vec<(f64, f64)> = course.iter().map(|(n, h)| (*h, *n)).collect();
        Some(Calibrated {
            target,
            depth: at(&course, target.cycles),
            coefficient: at(&inverse, target.depth)
                .map(|cycles| state.law().coefficient * cycles / target.cycles),
        })
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "depth_m": self.depth,
            "published_depth_m": self.target.depth,
            "cycles": self.target.cycles,
            "coefficient_m2_n": self.coefficient,
        })
    }

    pub(super) fn describe(&self) -> String {
        let Calibration { depth, cycles, .. } = self.target;
        let published = quantity(depth, "m", 3);
        match (self.depth, self.coefficient) {
            (Some(depth), Some(coefficient)) => format!(
                "wear is {} after {cycles:.0} revolutions, published {published}: K = {} m2/N gives that",
                quantity(depth, "m", 3),
                number(coefficient, 3)
            ),
            _ => format!(
                "the run ends before the published {published} after {cycles:.0} revolutions"
            ),
        }
    }
}

/// `y` at `x` on the straight lines between points of ascending `x`; `None` past the last.
fn at(points: &[(f64, f64)], x: f64) -> Option<f64> {
    let k = points.iter().position(|p| p.0 >= x)?;
    let (a, b) = (points[k.saturating_sub(1)], points[k]);
    let share = if b.0 > a.0 {
        (x - a.0) / (b.0 - a.0)
    } else {
        0.0
    };
    Some(a.1 + share * (b.1 - a.1))
}
