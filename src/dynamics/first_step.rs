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

/// Caches the velocities of moving contacts that touch and neither open nor close at the start, as
/// if a step had just ended there. The first step can then use the change of their rows since the
/// start, as later steps do.
///
/// Contacts of a body with prescribed motion are left out: the body may accelerate, and rows do not
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
    let moving = |c: &&ContactPoint| moves_freely(c, &interval.start, model.inverse_mass());
    let contacts = interval.detection.contacts.iter().filter(moving);
    let (mut pairs, mut bodies): (Vec<[u32; 2]>, Vec<u32>) = (Vec::new(), Vec::new());
    for contact in contacts {
        pairs.push(contact.surfaces);
        bodies.extend(contact.rows.bodies.iter().filter(|b| **b != NO_BODY));
    }
    if pairs.is_empty() {
        return Ok(());
    }
    pairs.dedup();
    let place = |body: u32| Some(origin[body as usize]);
    let found = detect_at(model, &pairs, bodies, place, dt)?;
    for contact in &found.contacts {
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
            on_surface: true,
            held: 0.0,
        };
        let known = CachedContact {
            impulse: Vec2::zeros(),
            dt: f64::INFINITY,
            stuck: (gamma.y.abs() * dt <= touch).then_some(gamma.y),
            left: Some(left),
            rebounded: false,
            energy: JointEnergy::default(),
        };
        cache.insert(contact.key, known);
    }
    Ok(())
}

/// Whether a contact is rigid, some body of it moves, and none of its moving bodies has a prescribed
/// motion.
fn moves_freely(contact: &ContactPoint, velocities: &[Vec3], inverse_mass: &[Vec3]) -> bool {
    let bodies = contact.rows.bodies.iter().filter(|b| **b != NO_BODY);
    let moving = |b: &&u32| velocities[**b as usize] != Vec3::zeros();
    let mut moving = bodies.filter(moving).peekable();
    matches!(contact.law, NormalLaw::Rigid { .. })
        && moving.peek().is_some()
        && moving.all(|b| inverse_mass[*b as usize] != Vec3::zeros())
}
