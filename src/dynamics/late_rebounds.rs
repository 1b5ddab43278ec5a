//! Rebounds that leave an overlap.
//!
//! A contact that rebounds takes part in a step if its bodies would overlap at the end without it, and starts
//! with the velocities of the step's start. So
//!
//! - an impact at `v` may leave an overlap of up to `(1 − e) v Δt/2`;
//! - a contact that only another impact of the same step closes takes no part. By the next step its bodies
//!   may be as deep in each other as they move in a step. One problem can't hold both impacts: the second
//!   rebound needs the velocity that the first one leaves.
//!
//! Where such an overlap is no small part of a body, the bodies are stepped again by themselves, with their
//! impacts located in time, or in parts if they are many.

use super::interval::{Interval, movable};
use super::model::{ContactPoint, MultibodyModel};
use super::solution::Solution;
use crate::contact::Vec3;

/// Overlap at the end of a step that is left to the position pass, as a share of half the width of the
/// thinner body. Less costs more located impacts.
const LEFT: f64 = 0.05;

/// The movable bodies of the rebounding contacts that are open at the start of the step and overlap at its end.
/// With the gap `g` of the midpoint that is
///
/// ```text
/// g − Δt γ_A/2 ≥ 0   and   g + Δt γ_E/2 < −δ
/// ```
pub(super) fn late_rebounds(
    model: &dyn MultibodyModel,
    interval: &Interval,
    solution: &Solution,
    inverse_mass: &[Vec3],
) -> Vec<[u32; 2]> {
    let half = 0.5 * interval.length;
    let late = |contact: &&ContactPoint| {
        let gap = |moved: f64| contact.gap + half * moved;
        let end = gap(contact.rows.velocity(&solution.end).x);
        let start = gap(-contact.rows.velocity(&interval.start).x);
        end < 0.0 && start >= -contact.gap_noise && {
            let widths = contact.surfaces.map(|surface| model.half_width(surface));
            end < -LEFT * widths[0].min(widths[1])
        }
    };
    let all = interval.rebounding.iter();
    all.map(|&index| &interval.detection.contacts[index])
        .filter(late)
        .map(|contact| movable(contact.rows.bodies, inverse_mass))
        .collect()
}
