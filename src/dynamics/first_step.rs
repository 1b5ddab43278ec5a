//! Contacts that touch when a simulation starts.

use super::contact_cache::{CachedContact, CachedContacts, JointEnergy, Left};
use super::events::detect_at;
use super::interval::Interval;
use super::model::{Configuration, ContactPoint, ModelError, MultibodyModel, NormalLaw};
use super::rules::{reference_acceleration, rest_velocity};
use crate::contact::{NO_BODY, Vec2, Vec3};

/// Largest gap of a touching contact, as a share of the distance that the reference acceleration
/// covers in a step. Poses in single precision leave gaps of 1e-8 m between bodies that touch.
const TOUCHES: f64 = 1e-2;

/// Caches the velocities of contacts that touch and neither open nor close at the start, as if a
/// step had just ended there. The first step can then use the change of their rows since the start,
/// as later steps do.
///
/// Contacts of a body that moves as prescribed are left out: it may accelerate, and rows do not
/// contain its acceleration.
///
/// # Errors
/// Those of the model.
pub(super) fn cache_touching<M: MultibodyModel + ?Sized>(
    model: &mut M,
    interval: &Interval,
    origin: &[Configuration],
    cache: &mut CachedContacts,
    dt: f64,
) -> Result<(), ModelError> {
    let (mut pairs, mut bodies): (Vec<[u32; 2]>, Vec<u32>) = (Vec::new(), Vec::new());
    // contacts of bodies at rest are at the midpoint as at the start
    let mut found: Vec<ContactPoint> = Vec::new();
    for contact in &interval.detection.contacts {
        if !matches!(contact.law, NormalLaw::Rigid { .. })
            || is_driven(contact, &interval.start, model.inverse_mass())
        {
            continue;
        }
        if moving(contact, &interval.start).next().is_none() {
            found.push(*contact);
            continue;
        }
        pairs.push(contact.surfaces);
        bodies.extend(contact.rows.bodies.iter().filter(|b| **b != NO_BODY));
    }
    if !pairs.is_empty() {
        pairs.dedup();
        let place = |body: u32| Some(origin[body as usize]);
        found.extend(detect_at(model, &pairs, bodies, place, dt)?.contacts);
    }
    let first = cache.entries().is_empty();
    for contact in &found {
        let a = reference_acceleration(contact, &interval.start, &interval.accelerations);
        let touch = (2.0 * contact.gap_noise).max(TOUCHES * rest_velocity(a, dt) * dt);
        let surface = Vec2::new(0.0, contact.surface_velocity);
        let gamma = contact.rows.velocity(&interval.start) + surface;
        if contact.gap.abs() > touch || gamma.x.abs() * dt > touch {
            continue;
        }
        let left = Left {
            gamma,
            ago: 0.0,
            turning: None,
            on_surface: true,
            held: 0.0,
        };
        let known = CachedContact {
            impulse: Vec2::zeros(),
            dt: f64::INFINITY,
            stuck: gamma.y.abs() * dt <= touch,
            left: Some(left),
            rebounded: false,
            energy: JointEnergy::default(),
        };
        if first {
            cache.push(contact.key, known);
        } else {
            cache.insert(contact.key, known);
        }
    }
    Ok(())
}

/// The bodies of a contact that move.
fn moving<'a>(contact: &'a ContactPoint, velocities: &'a [Vec3]) -> impl Iterator<Item = u32> + 'a {
    let bodies = contact.rows.bodies.iter().filter(|b| **b != NO_BODY);
    bodies
        .copied()
        .filter(|b| velocities[*b as usize] != Vec3::zeros())
}

/// Whether any body moves as prescribed.
pub(super) fn drives(velocities: &[Vec3], inverse_mass: &[Vec3]) -> bool {
    let mut bodies = velocities.iter().zip(inverse_mass);
    bodies.any(|(u, w)| *w == Vec3::zeros() && *u != Vec3::zeros())
}

/// Whether a body of the contact moves as prescribed.
pub(super) fn is_driven(
    contact: &ContactPoint,
    velocities: &[Vec3],
    inverse_mass: &[Vec3],
) -> bool {
    moving(contact, velocities).any(|b| inverse_mass[b as usize] == Vec3::zeros())
}
