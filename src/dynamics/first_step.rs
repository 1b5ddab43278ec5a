//! Contacts that touch when a simulation starts: their velocities, and how their rows turn.
//!
//! Later steps expect the turning of the rows from their midpoint to their end by a straight line
//! through that of the two steps before. The first step has but its own first half, which lacks what the
//! forces change: its force would be off by `a dt` in place of `a dt²`. So it is solved twice.

use super::contact_cache::{CachedContact, CachedContacts, JointEnergy, Left, PulledLink};
use super::events::detect_at;
use super::interval::{Interval, Source};
use super::model::{
    Configuration, ContactKey, ContactPoint, ModelError, MultibodyModel, NormalLaw,
};
use super::pulled_links::{find_links, stiffen};
use super::record::StepRecord;
use super::rules::{Rules, Span, reference_acceleration, rest_velocity};
use super::settings::StepError;
use super::solution::Solution;
use super::stepper::MoreauStepper;
use crate::contact::{NO_BODY, Vec2, Vec3};
use rustc_hash::FxHashMap;

/// Largest gap of a touching contact, as a share of the distance that the reference acceleration
/// covers in a step. Poses in single precision leave gaps of 1e-8 m between bodies that touch.
const TOUCHES: f64 = 1e-2;

/// Change of `c` within the first step, as a share of the reference acceleration, below which the step is
/// not solved again.
const STEADY: f64 = 1e-4;

/// Largest turn of a link in the first step \[rad\] that counts as rest.
const AT_REST: f64 = 1e-6;

/// Caches the velocities of contacts that touch and neither open nor close at the start, as if a
/// step had just ended there. The first step can then use the change of their rows since the start,
/// as later steps do.
///
/// Contacts of a body that moves as prescribed are left out: it may accelerate, and rows do not
/// contain its acceleration.
///
/// # Errors
/// Those of the model.
pub(super) fn cache_touching(
    model: &mut dyn MultibodyModel,
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

impl MoreauStepper {
    /// Solves the first step once more if links begin to turn in it that its solution shows to be under
    /// tension: see [`super::pulled_links`]. Links that turn already would be braked within the step.
    pub(super) fn stiffen_first(
        &mut self,
        model: &dyn MultibodyModel,
        rules: &Rules,
        record: &mut StepRecord,
    ) -> Result<(), StepError> {
        let (dt, w) = (record.dt, model.inverse_mass());
        let links = find_links(&self.stiff, &self.interval, &self.solution, w, dt);
        let (start, end) = (&self.interval.start, &self.solution.end);
        let turns = |(body, _): &(usize, _)| end[*body].z.abs() * dt > AT_REST;
        let rests = |(body, _): &(usize, _)| start[*body].z == 0.0;
        if !self.stiff.is_empty() || !links.iter().all(rests) || !links.iter().any(turns) {
            return Ok(());
        }
        let mut links: Vec<_> = links.into_iter().map(|(_, link)| link).collect();
        links.sort_unstable_by_key(PulledLink::name);
        let interval = &mut self.interval;
        self.stiff = stiffen(&links, false, interval, &mut self.inverse_mass, dt);
        interval.apply_forces(model, &self.inverse_mass, self.time + 0.5 * dt);
        interval.free_velocities(&self.inverse_mass, dt);
        self.solve_anew(rules, FxHashMap::default(), record)
    }

    /// Solves the first step once more with the turning of the rows that its first solution predicts. If
    /// the second solution does not confirm it, the first one is restored.
    pub(super) fn solve_again(
        &mut self,
        model: &mut dyn MultibodyModel,
        rules: &Rules,
        record: &mut StepRecord,
    ) -> Result<(), StepError> {
        let dt = record.dt;
        let ahead = look_ahead(model, &self.interval, &self.solution, dt)?;
        if !ahead.differs {
            return Ok(());
        }
        self.solve_anew(rules, ahead.turning.clone(), record)?;
        let again = look_ahead(model, &self.interval, &self.solution, dt)?;
        if ahead.is_confirmed_by(&again) {
            return Ok(());
        }
        self.solve_anew(rules, FxHashMap::default(), record)
    }

    /// Solves the interval of the first step with `turning` as its [`Interval::ahead`].
    fn solve_anew(
        &mut self,
        rules: &Rules,
        turning: FxHashMap<ContactKey, Vec2>,
        record: &mut StepRecord,
    ) -> Result<(), StepError> {
        for outcome in &self.solution.outcomes {
            outcome.count_work(record);
        }
        self.solver.cache.drop_step();
        self.solver.cache.begin();
        let (interval, w) = (&mut self.interval, self.inverse_mass.as_slice());
        interval.ahead = turning;
        let (cache, span) = (&self.cache.contacts, Span::whole(record.dt));
        interval.collect(rules, cache, None, w, span, &self.threads);
        self.solve(rules, record.dt)
    }
}

/// How the rows of the contacts that touched at the start and have an impulse turn in the first step.
struct Ahead {
    /// `c` \[m/s²\] of [`Situation`](super::rules::Situation) in the first half of the step.
    before: FxHashMap<ContactKey, Vec2>,
    /// The same from the midpoint to the end, along the path of a solution.
    turning: FxHashMap<ContactKey, Vec2>,
    /// Whether they differ.
    differs: bool,
}

impl Ahead {
    /// Whether `again`, along the path of the solution that used these, is nearer to them than they are
    /// to those of the first half. Where a rod slides near the friction at which it jams, a small turn
    /// decides its impulse.
    fn is_confirmed_by(&self, again: &Ahead) -> bool {
        let far = |from: &FxHashMap<ContactKey, Vec2>| {
            let missing = Vec2::repeat(f64::INFINITY);
            let one = |(key, c): (_, &Vec2)| (from.get(key).unwrap_or(&missing) - c).norm();
            self.turning.iter().map(one).fold(0.0, f64::max)
        };
        far(&again.turning) <= 0.5 * far(&self.before)
    }
}

/// Follows the path of `solution` from the midpoint of the first step to its end.
///
/// # Errors
/// Those of the model.
fn look_ahead(
    model: &mut dyn MultibodyModel,
    interval: &Interval,
    solution: &Solution,
    dt: f64,
) -> Result<Ahead, ModelError> {
    let end = &solution.end;
    let (mut pairs, mut bodies): (Vec<[u32; 2]>, Vec<u32>) = (Vec::new(), Vec::new());
    let mut middle: FxHashMap<ContactKey, Vec2> = FxHashMap::default();
    let mut ahead = Ahead {
        before: FxHashMap::default(),
        turning: FxHashMap::default(),
        differs: false,
    };
    for (block, p) in interval.blocks.iter().zip(&solution.impulses) {
        let Source::Contact(index) = block.source else {
            continue;
        };
        let contact = &interval.detection.contacts[index];
        if !block.on_surface || p.x <= 0.0 || moving(contact, end).next().is_none() {
            continue;
        }
        middle.insert(contact.key, contact.rows.velocity(end));
        let before = block.turning.unwrap_or_default();
        ahead.before.insert(contact.key, before);
        pairs.push(contact.surfaces);
        bodies.extend(moving(contact, end));
    }
    if pairs.is_empty() {
        return Ok(ahead);
    }
    pairs.dedup();
    let mut places = FxHashMap::default();
    for &body in &bodies {
        let here = model.configuration(body as usize);
        model.shift(body as usize, &end[body as usize], 0.5 * dt);
        places.insert(body, model.configuration(body as usize));
        model.set_configuration(body as usize, &here);
    }
    let place = |body: u32| places.get(&body).copied();
    for contact in detect_at(model, &pairs, bodies, place, dt)?.contacts {
        let (Some(gamma), Some(before)) =
            (middle.get(&contact.key), ahead.before.get(&contact.key))
        else {
            continue;
        };
        let c = (contact.rows.velocity(end) - gamma) / (0.5 * dt);
        let a = reference_acceleration(&contact, end, &interval.accelerations);
        ahead.differs |= (c - before).norm() > STEADY * a;
        ahead.turning.insert(contact.key, c);
    }
    Ok(ahead)
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
