//! Contacts that a step leaves deep.
//!
//! A contact that lands without rebound stays as deep as it is at the midpoint, up to half of its way in the step. One
//! that persists between bodies that turn by a part of a radian is off its tangent. Where such an overlap is no small
//! part of a body, it may be pushed out on the wrong side, and the bodies pass through each other. They are stepped
//! again by themselves, as for [`late_rebounds`](super::late_rebounds).

use super::interval::{Interval, Source, movable};
use super::model::{MultibodyModel, NormalLaw};
use super::recording::end_gap;
use super::rules::turning;
use super::solution::Solution;
use crate::contact::Vec3;

/// Overlap that a step adds and that is left to the position pass, as a share of half the width of the thinner body.
const LEFT: f64 = 0.25;

/// Turn in a step \[rad\] above which a body turns far.
const FAR: f64 = 0.5;

/// The movable bodies of the contacts whose overlap grows by more than this. With the gap `g` of the midpoint that is
///
/// ```text
/// min(g − Δt γ_A/2, 0) − (g + Δt γ_E/2) > δ
/// ```
pub(super) fn deep_impacts(
    model: &dyn MultibodyModel,
    interval: &Interval,
    solution: &Solution,
    inverse_mass: &[Vec3],
) -> Vec<[u32; 2]> {
    let mut found = Vec::new();
    for (i, block) in interval.blocks.iter().enumerate() {
        let Source::Contact(index) = block.source else {
            continue;
        };
        let contact = &interval.detection.contacts[index];
        let straight = contact.gap - 0.5 * interval.length * block.gamma_a.x;
        // of a contact that began with a gap of 0 and turns far, the straight line does not lead to the start
        let mut spins = turning(contact, &interval.start).map(|(omega, _)| omega.abs());
        let start = match block.on_surface && spins.any(|omega| omega * interval.length > FAR) {
            true => 0.0,
            false => straight.min(0.0),
        };
        let grown = start - end_gap(interval, solution, i, contact);
        if grown <= contact.gap_noise
            || !matches!(contact.law, NormalLaw::Rigid { .. })
            || interval.known_overlaps.contains(contact.key.pair)
        {
            continue;
        }
        let widths = contact.surfaces.map(|surface| model.half_width(surface));
        if grown > LEFT * widths[0].min(widths[1]) {
            found.push(movable(contact.rows.bodies, inverse_mass));
        }
    }
    found
}
