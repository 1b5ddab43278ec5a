//! Collision and contact-force events, with the impulses of this crate's solvers.
//!
//! Two colliders start to touch in the step in which one of their contacts has an impulse or is
//! closed. They touch until all their contacts are open by more than rapier's prediction distance,
//! so that a contact that opens by a rounding does not flicker. Sensors intersect where they
//! overlap at the end of a step. The contact pair that a handler receives holds our impulses; a
//! force is an impulse over the length of the step.

use super::bodies::Bodies;
use super::detection::{Detector, EventContact};
use super::engine::geometry::{
    CollisionEventFlags, ContactManifold, ContactManifoldData, PairContacts,
};
use super::engine::prelude::*;
use super::joints::OUTSIDE;
use super::widen;
use crate::contact::Vec2;
use crate::dynamics::record::{ContactRecord, StepRecord};
use crate::rapier::parry::query::TrackedContact;
use crate::rapier::parry::shape::PackedFeatureId;
use std::collections::BTreeMap;

type Pair = [ColliderHandle; 2];

/// Sort key of events: index, then generation.
fn order(pair: &Pair) -> [(u32, u32); 2] {
    pair.map(|h| h.into_raw_parts())
}

/// Pairs of colliders whose events have begun and not ended.
#[derive(Default)]
pub(super) struct Reporter {
    /// Pairs that touch.
    touching: BTreeMap<[(u32, u32); 2], Pair>,
    /// Pairs whose force was above the threshold in the last step.
    loaded: BTreeMap<[(u32, u32); 2], Pair>,
    /// Sensors and the colliders that they overlap.
    crossing: BTreeMap<[(u32, u32); 2], Pair>,
    /// One of rapier's pairs with its force event already started; only rapier can make one.
    continuing: Option<Box<ContactPair>>,
}

/// Contacts of one pair in this step.
#[derive(Default)]
struct Met<'a> {
    contacts: Vec<&'a ContactRecord>,
    gap: f64,
    load: f64,
}

impl Reporter {
    /// The pairs that touch, that are above the force threshold, and that intersect.
    pub fn state(&self) -> [Vec<Pair>; 3] {
        [&self.touching, &self.loaded, &self.crossing]
            .map(|pairs| pairs.values().copied().collect())
    }

    /// Continues from a saved [`Reporter::state`].
    pub fn restore(&mut self, [touching, loaded, crossing]: [Vec<Pair>; 3]) {
        let map = |pairs: Vec<Pair>| pairs.into_iter().map(|p| (order(&p), p)).collect();
        (self.touching, self.loaded, self.crossing) = (map(touching), map(loaded), map(crossing));
    }

    /// See [`super::MoreauPipeline::intersections`].
    pub fn intersections(&self) -> impl Iterator<Item = Pair> + '_ {
        self.crossing.values().copied()
    }

    /// Sends `handler` an event for everything that began or ended in a step.
    pub fn report(
        &mut self,
        world: &PhysicsWorld,
        bodies: &Bodies,
        detector: &Detector,
        crossing: Vec<Pair>,
        record: &StepRecord,
        handler: &dyn EventHandler,
    ) {
        if !(crossing.is_empty() && self.crossing.is_empty()) {
            self.cross(world, crossing, handler);
        }
        let met = gather(world, record, detector.event_contacts());
        if met.is_empty() && self.touching.is_empty() && self.loaded.is_empty() {
            return;
        }
        self.touch(world, bodies, &met, handler);
        self.push(world, &met, record.dt, handler);
    }

    fn cross(&mut self, world: &PhysicsWorld, crossing: Vec<Pair>, handler: &dyn EventHandler) {
        let now: BTreeMap<_, Pair> = crossing.into_iter().map(|p| (order(&p), p)).collect();
        let tell = |pair: &Pair, started: bool| {
            if wants(world, pair, ActiveEvents::COLLISION_EVENTS) {
                let flags = CollisionEventFlags::SENSOR;
                handler.handle_collision_event(
                    &world.bodies,
                    &world.colliders,
                    event(world, pair, started, flags),
                    None,
                );
            }
        };
        let ended = self.crossing.iter().filter(|(k, _)| !now.contains_key(*k));
        ended.for_each(|(_, pair)| tell(pair, false));
        let began = now.iter().filter(|(k, _)| !self.crossing.contains_key(*k));
        began.for_each(|(_, pair)| tell(pair, true));
        self.crossing = now;
    }

    fn touch(
        &mut self,
        world: &PhysicsWorld,
        bodies: &Bodies,
        met: &BTreeMap<[(u32, u32); 2], (Pair, Met)>,
        handler: &dyn EventHandler,
    ) {
        let near = widen(world.integration_parameters.prediction_distance());
        let touches = |key: &[(u32, u32); 2], met: &Met| {
            let limit = if self.touching.contains_key(key) {
                near
            } else {
                0.0
            };
            met.load > 0.0 || met.gap <= limit
        };
        let wanted = met
            .iter()
            .filter(|(_, (pair, _))| wants(world, pair, ActiveEvents::COLLISION_EVENTS));
        let mut now: BTreeMap<_, Pair> = wanted
            .filter(|(key, (_, met))| touches(key, met))
            .map(|(key, (pair, _))| (*key, *pair))
            .collect();
        // pairs of sleeping bodies keep touching
        let slept = self
            .touching
            .iter()
            .filter(|(_, pair)| asleep(world, bodies, pair));
        let slept: Vec<_> = slept.map(|(key, pair)| (*key, *pair)).collect();
        now.extend(slept);
        let none = CollisionEventFlags::empty();
        for (_, pair) in self.touching.iter().filter(|(k, _)| !now.contains_key(*k)) {
            // a removed collider wants no events, but the other collider of the pair may
            if wants(world, pair, ActiveEvents::COLLISION_EVENTS) {
                let event = event(world, pair, false, none);
                handler.handle_collision_event(&world.bodies, &world.colliders, event, None);
            }
        }
        for (key, pair) in now.iter().filter(|(k, _)| !self.touching.contains_key(*k)) {
            let contacts = fill(ContactPair::default(), world, pair, &met[key].1);
            let event = event(world, pair, true, none);
            let contacts = Some(&contacts);
            handler.handle_collision_event(&world.bodies, &world.colliders, event, contacts);
        }
        self.touching = now;
    }

    fn push(
        &mut self,
        world: &PhysicsWorld,
        met: &BTreeMap<[(u32, u32); 2], (Pair, Met)>,
        dt: f64,
        handler: &dyn EventHandler,
    ) {
        let mut now = BTreeMap::new();
        for (key, (pair, met)) in met {
            let force = met.load / dt;
            let threshold = pair
                .iter()
                .filter_map(|h| world.colliders.get(*h))
                .filter(|c| {
                    c.active_events()
                        .contains(ActiveEvents::CONTACT_FORCE_EVENTS)
                })
                .map(|c| widen(c.contact_force_event_threshold()))
                .reduce(f64::min);
            if threshold.is_none_or(|least| force <= least) {
                continue;
            }
            let base = if self.loaded.contains_key(key) {
                let known = self.continuing.get_or_insert_with(continuing);
                ContactPair::clone(known)
            } else {
                ContactPair::default()
            };
            let contacts = fill(base, world, pair, met);
            handler.handle_contact_force_event(
                dt as Real,
                &world.bodies,
                &world.colliders,
                &contacts,
                force as Real,
            );
            now.insert(*key, *pair);
        }
        self.loaded = now;
    }
}

/// Whether neither body of a pair moves and one of them sleeps or is at rest: detection skips their
/// contacts.
fn asleep(world: &PhysicsWorld, bodies: &Bodies, pair: &Pair) -> bool {
    let number = |h: &ColliderHandle| match world.colliders.get(*h)?.parent() {
        Some(body) => bodies.index_of(body),
        None => Some(OUTSIDE),
    };
    let [Some(a), Some(b)] = [number(&pair[0]), number(&pair[1])] else {
        return false;
    };
    bodies.sleeps_or_rests([a, b]) && bodies.still(a) && bodies.still(b)
}

/// Whether one collider of the pair that still exists has switched one of `events` on.
fn wants(world: &PhysicsWorld, pair: &Pair, events: ActiveEvents) -> bool {
    pair.iter()
        .filter_map(|h| world.colliders.get(*h))
        .any(|c| c.active_events().intersects(events))
}

fn event(
    world: &PhysicsWorld,
    pair: &Pair,
    started: bool,
    mut flags: CollisionEventFlags,
) -> CollisionEvent {
    if pair.iter().any(|h| world.colliders.get(*h).is_none()) {
        flags |= CollisionEventFlags::REMOVED;
    }
    match started {
        true => CollisionEvent::Started(pair[0], pair[1], flags),
        false => CollisionEvent::Stopped(pair[0], pair[1], flags),
    }
}

/// The contacts of a step, grouped by pairs of colliders of which one wants events.
fn gather<'a>(
    world: &PhysicsWorld,
    record: &'a StepRecord,
    event_contacts: &[EventContact],
) -> BTreeMap<[(u32, u32); 2], (Pair, Met<'a>)> {
    let mut met: BTreeMap<_, (Pair, Met)> = BTreeMap::new();
    if !world
        .colliders
        .iter()
        .any(|(_, c)| !c.active_events().is_empty())
    {
        return met;
    }
    let any = ActiveEvents::all();
    let fresh = |pair: Pair| {
        let gap = f64::INFINITY;
        let met = Met {
            gap,
            ..Met::default()
        };
        (pair, met)
    };
    for contact in &record.contacts {
        let found = contact
            .surfaces
            .map(|slot| Some(world.colliders.get_unknown_gen(slot)?.1));
        let [Some(one), Some(two)] = found else {
            continue;
        };
        let pair = [one, two];
        if wants(world, &pair, any) {
            let (_, met) = met.entry(order(&pair)).or_insert_with(|| fresh(pair));
            met.gap = met.gap.min(contact.gap);
            met.load += contact.impulse_n;
            met.contacts.push(contact);
        }
    }
    for contact in event_contacts
        .iter()
        .filter(|t| wants(world, &t.colliders, any))
    {
        let pair = contact.colliders;
        let (_, met) = met.entry(order(&pair)).or_insert_with(|| fresh(pair));
        met.gap = met.gap.min(contact.gap);
    }
    met
}

/// A contact pair of rapier's type with our contacts in it, two to a manifold.
fn fill(mut pair: ContactPair, world: &PhysicsWorld, handles: &Pair, met: &Met) -> ContactPair {
    [pair.collider1, pair.collider2] = *handles;
    let PairContacts::Rigid(rigid) = &mut pair.contacts else {
        return pair;
    };
    rigid.manifolds.clear();
    rigid.solver_clusters.clear();
    let colliders = handles.map(|h| world.colliders.get(h));
    let [Some(c1), Some(c2)] = colliders else {
        return pair;
    };
    let real = |v: Vec2| Vector::new(v.x as Real, v.y as Real);
    let mut rest = met.contacts.as_slice();
    while let Some(first) = rest.first() {
        let together = rest.iter().take(2);
        let count = together.take_while(|c| c.normal == first.normal).count();
        let (now, later) = rest.split_at(count);
        rest = later;
        let mut data = ContactManifoldData::default();
        (data.rigid_body1, data.rigid_body2) = (c1.parent(), c2.parent());
        data.normal = real(first.normal);
        let [part1, part2] = first.cells();
        let mut manifold = ContactManifold::with_data(part1, part2, data);
        manifold.local_n1 = c1.position().rotation.inverse() * real(first.normal);
        manifold.local_n2 = c2.position().rotation.inverse() * real(-first.normal);
        for contact in now {
            let half = 0.5 * contact.gap * contact.normal;
            let local =
                |collider: &Collider, p: Vec2| collider.position().inverse_transform_point(real(p));
            let mut point = TrackedContact::new(
                local(c1, contact.position - half),
                local(c2, contact.position + half),
                PackedFeatureId::UNKNOWN,
                PackedFeatureId::UNKNOWN,
                contact.gap as Real,
            );
            let data: &mut ContactData = &mut point.data;
            data.impulse = contact.impulse_n as Real;
            data.tangent_impulse.x = contact.impulse_t as Real;
            manifold.points.push(point);
        }
        rigid.manifolds.push(manifold);
    }
    pair
}

/// Makes a pair whose force event has already started: a ball that lies on another one for two
/// steps.
fn continuing() -> Box<ContactPair> {
    let mut world = PhysicsWorld::new();
    let ball = || {
        ColliderBuilder::ball(0.5)
            .active_events(ActiveEvents::CONTACT_FORCE_EVENTS)
            .contact_force_event_threshold(0.0)
    };
    world.insert(RigidBodyBuilder::fixed(), ball());
    let above = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.99));
    world.insert(above, ball());
    for _ in 0..2 {
        world.step();
    }
    let pair = world.narrow_phase.contact_pairs().next();
    Box::new(pair.cloned().unwrap_or_default())
}
