//! New contacts of discs at corners that cannot move.
//!
//! The row of a contact has the normal of the midpoint. Where a disc moves past a corner, the normal turns as fast
//! as its centre moves around that corner, so that a row found before the disc gets there pushes it back too early
//! and too hard: rolling at 8 m/s onto a plate of 0.1 mm, a disc of 0.2 m lost an eighth of its speed in a step of
//! 1/60 s, where `2 h / r = 0.1 %` is right. Such impacts are located in time, as [`late_rebounds`] are.
//!
//! [`late_rebounds`]: super::late_rebounds

use super::events::detect_at;
use super::interval::{Interval, Source, movable};
use super::model::{Configuration, ContactPoint, ModelError, MultibodyModel};
use super::solution::Solution;
use crate::contact::{NO_BODY, Vec3};

/// Least angle \[rad\] between the normals of the start and of the midpoint. The share of the speed that an impact
/// takes is wrong by up to the square of twice this.
const TURN: f64 = 0.02;

/// Lever arm of a normal force about a disc's centre, as a share of half its width.
const CENTRAL: f64 = 1e-9;

/// The movable bodies of these contacts, of discs that come down on bodies that stay where they are: what was open at the
/// start, and is loaded or overlaps at the midpoint. There the bodies are; `origin` is where they started.
///
/// # Errors
/// [`ModelError`] of the detection.
pub(super) fn turned_impacts(
    model: &mut dyn MultibodyModel,
    interval: &Interval,
    solution: &Solution,
    inverse_mass: &[Vec3],
    origin: &[Configuration],
) -> Result<Vec<[u32; 2]>, ModelError> {
    let (h, contacts) = (interval.length, &interval.detection.contacts);
    let overlaps = |c: &ContactPoint| c.gap < -c.gap_noise;
    let blocks = interval.blocks.iter().zip(&solution.impulses);
    let loaded = blocks.filter_map(|(block, impulse)| match block.source {
        Source::Contact(index) if impulse.x > 0.0 && !block.pressed_before => {
            Some(&contacts[index])
        }
        _ => None,
    });
    let overlapping = contacts.iter().filter(|c| overlaps(c));
    let mut all = Vec::new();
    for contact in loaded.filter(|c| !overlaps(c)).chain(overlapping) {
        let pair = movable(contact.rows.bodies, inverse_mass);
        let (side, body) = match pair {
            [NO_BODY, body] if body != NO_BODY => (1, body),
            [body, NO_BODY] if body != NO_BODY => (0, body),
            _ => continue,
        };
        // what moves as prescribed would have another corner at the start
        let start = &interval.start;
        let other = start.get(contact.rows.bodies[1 - side] as usize);
        if other.is_some_and(|u| *u != Vec3::zeros()) {
            continue;
        }
        let half = model.half_width(contact.surfaces[side]);
        let is_disc = |c: &ContactPoint| c.rows.jacobian[side][0].z.abs() <= CENTRAL * half;
        // of its centre along the surface: its spin turns no normal
        let spin = contact.rows.jacobian[side][1].z * start[body as usize].z;
        let way = 0.5 * h * (contact.rows.velocity(start).y - spin).abs();
        if !half.is_finite() || !is_disc(contact) || way < TURN * half {
            continue;
        }
        let place = |b: u32| origin.get(b as usize).copied();
        let found = detect_at(model, &[contact.surfaces], vec![body], place, h)?;
        let turned = |c: &ContactPoint| c.normal.dot(&contact.normal) < TURN.cos();
        let open = |c: &ContactPoint| c.gap > c.gap_noise;
        let mut found = found.contacts.iter();
        if found.len() > 0 && found.all(|c| open(c) && turned(c)) {
            all.push(pair);
        }
    }
    Ok(all)
}
