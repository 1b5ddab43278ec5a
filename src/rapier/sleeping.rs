//! Sleeping: islands at rest that cost nothing until they wake.
//!
//! A body is ready to sleep when its farthest point has moved less than its thresholds allow for as
//! long as rapier's [`RigidBodyActivation`] says. An island of bodies that touch or are joined
//! falls asleep when all its bodies are ready, and wakes as a whole. Sleeping bodies do not move by
//! a single bit and act as if they had infinite mass. The impulses of their contacts are stored
//! until they wake.

use super::bodies::Bodies;
use super::engine::prelude::*;
use super::joints::fingerprint;
use super::shadow::Shadow;
use crate::contact::{NO_BODY, Vec2, Vec3};
use crate::dynamics::record::ContactRecord;
use crate::dynamics::{CachedContact, ContactKey, Detection, Islands, ModelError, NormalLaw};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Displacement in a step up to which a body that is moved out of an overlap may fall asleep, as a
/// share of its size. A fifth of the overlap or more is undone in a step: what is left is too small to
/// be seen.
const PARTED: f64 = 1e-6;

/// Overlap of a contact with which its bodies do not fall asleep, as a share of its distance from the centre
/// of mass: they are moved apart first.
const DEEP: f64 = 1e-5;

/// A sleeping island.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Group {
    /// Colliders that the island touched, by the index of their handle; `None` if unknown, so that
    /// any collider may matter.
    touched: Option<BTreeSet<u32>>,
    joints: BTreeMap<u32, u64>,
    memory: Vec<(ContactKey, CachedContact)>,
}

/// All sleeping islands. Number 0 means awake.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct Sleepers {
    groups: BTreeMap<u32, Group>,
    last: u32,
    /// Islands that wake before the next step.
    #[serde(skip)]
    to_wake: BTreeSet<u32>,
    /// Bodies and colliders that touched or were joined in the last step.
    #[serde(skip)]
    links: Vec<([u32; 2], [u32; 2])>,
    /// Bodies that overlapped in the last step.
    #[serde(skip)]
    overlapping: Vec<u32>,
}

impl Sleepers {
    pub fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// Marks an island to wake at the next [`Bodies::wake_marked`].
    pub fn mark_to_wake(&mut self, group: u32) {
        if group != 0 {
            self.to_wake.insert(group);
        }
    }

    pub fn any_to_wake(&self) -> bool {
        !self.to_wake.is_empty()
    }

    fn add(&mut self, group: Group) -> u32 {
        self.last += 1;
        self.groups.insert(self.last, group);
        self.last
    }
}

impl Bodies {
    /// Whether a body can neither be pushed nor moves.
    pub fn still(&self, number: u32) -> bool {
        number == NO_BODY || self.rests(number) || {
            let k = number as usize;
            self.inverse_mass[k] == Vec3::zeros() && self.velocities[k] == Vec3::zeros()
        }
    }

    /// Whether a body is at rest in this step: it is awake, but nothing about it changes.
    pub fn rests(&self, number: u32) -> bool {
        self.resting.get(number as usize) == Some(&true)
    }

    /// Whether one of these bodies sleeps or is at rest.
    pub fn sleeps_or_rests(&self, numbers: [u32; 2]) -> bool {
        let group = |b: u32| self.list.get(b as usize).map_or(0, |s| s.group);
        numbers.iter().any(|b| group(*b) != 0 || self.rests(*b))
    }

    /// Makes an island of the bodies that the user put to sleep; with `stay_awake`, marks all
    /// islands to wake.
    ///
    /// # Errors
    /// Those of reading a body that falls asleep.
    pub(super) fn follow_user_sleep(
        &mut self,
        world: &mut PhysicsWorld,
        dt: f64,
        stay_awake: bool,
    ) -> Result<(), ModelError> {
        if stay_awake {
            let all: Vec<u32> = self.sleepers.groups.keys().copied().collect();
            all.iter()
                .for_each(|&group| self.sleepers.mark_to_wake(group));
        } else {
            let slept = std::mem::take(&mut self.slept);
            for &k in &slept {
                self.sync_one(world, k, dt)?;
            }
            if !slept.is_empty() {
                let group = self.sleepers.add(Group::default());
                slept.iter().for_each(|&k| self.list[k].group = group);
            }
        }
        Ok(())
    }

    /// Marks the islands that a change by the user wakes.
    pub(super) fn mark_changed(&mut self, world: &PhysicsWorld) {
        if self.sleepers.is_empty() {
            return;
        }
        for shadow in &self.list {
            let body = &world.bodies[shadow.handle];
            if shadow.group != 0 {
                if !body.is_sleeping() || shadow.differs(body) {
                    self.sleepers.mark_to_wake(shadow.group);
                }
            } else if !(body.is_dynamic() && shadow.kind == RigidBodyType::Dynamic)
                && shadow.differs(body)
            {
                // islands that the body touched, or may touch now
                let slots = body.colliders().iter().map(|h| h.into_raw_parts().0);
                slots.for_each(|slot| self.sleepers.mark_touching(slot));
            }
        }
        for (handle, parent) in self.watch.changed.iter().chain(&self.watch.gone) {
            self.sleepers.mark_touching(handle.into_raw_parts().0);
            if let Some(k) = parent.and_then(|h| self.index_of(h)) {
                self.sleepers.mark_to_wake(self.list[k as usize].group);
            }
        }
        for k in 0..self.watch.changed.len() {
            self.mark_overlapping(world, self.watch.changed[k].0);
        }
        self.mark_changed_joints(world);
    }

    /// Marks the islands that overlap a new or changed collider.
    fn mark_overlapping(&mut self, world: &PhysicsWorld, handle: ColliderHandle) {
        let place = |h: ColliderHandle| {
            let collider = world.colliders.get(h)?;
            let pose = match collider.parent().and_then(|h| world.bodies.get(h)) {
                Some(body) => body.position() * collider.position_wrt_parent()?,
                None => *collider.position(),
            };
            Some(collider.shape().compute_aabb(&pose))
        };
        let Some(new) = place(handle) else { return };
        for shadow in self.list.iter().filter(|s| s.group != 0) {
            let own = world.bodies[shadow.handle].colliders().iter();
            if own.filter_map(|h| place(*h)).any(|a| a.intersects(&new)) {
                self.sleepers.mark_to_wake(shadow.group);
            }
        }
    }

    fn mark_changed_joints(&mut self, world: &PhysicsWorld) {
        let mut met: BTreeMap<u32, usize> = BTreeMap::new();
        for (handle, joint) in world.impulse_joints.iter() {
            let group = |h| self.index_of(h).map_or(0, |k| self.list[k as usize].group);
            let groups = [group(joint.body1()), group(joint.body2())];
            let apart = 1 + usize::from(groups[0] != groups[1]);
            for &group in groups[..apart].iter().filter(|g| **g != 0) {
                *met.entry(group).or_default() += 1;
                let known = self.sleepers.groups.get(&group);
                let known = known.and_then(|g| g.joints.get(&handle.into_raw_parts().0));
                if known != Some(&fingerprint(&joint.data)) {
                    self.sleepers.mark_to_wake(group);
                }
            }
        }
        for (group, own) in &self.sleepers.groups {
            if own.joints.len() > met.get(group).copied().unwrap_or(0) {
                self.sleepers.to_wake.insert(*group);
            }
        }
    }

    /// Wakes the marked islands. Their stored contact impulses go to `memory`.
    pub fn wake_marked(
        &mut self,
        world: &mut PhysicsWorld,
        memory: &mut Vec<(ContactKey, CachedContact)>,
    ) {
        let to_wake = std::mem::take(&mut self.sleepers.to_wake);
        if to_wake.is_empty() {
            return;
        }
        for shadow in self.list.iter_mut().filter(|s| to_wake.contains(&s.group)) {
            shadow.group = 0;
            if let Some(body) = world.bodies.get_mut(shadow.handle) {
                body.wake_up(true);
            }
        }
        for group in to_wake {
            let group = self.sleepers.groups.remove(&group);
            memory.extend(group.into_iter().flat_map(|g| g.memory));
        }
    }

    /// Stores which bodies and colliders touch in this step, and marks the islands that a contact
    /// wakes.
    ///
    /// A moving body wakes a sleeping one if their gap would close in this step. A kinematic body
    /// that moves wakes a sleeping one that it touches. `found` has no contacts of islands at rest,
    /// which are `resting`. `free` [m/s, m/s, rad/s] are the velocities
    /// at the end of the step as if nothing touched.
    pub fn note_contacts<'a>(
        &mut self,
        found: &Detection,
        resting: impl Iterator<Item = &'a ContactRecord>,
        free: &[Vec3],
        drop: f64,
        dt: f64,
    ) {
        self.sleepers.links.clear();
        let links = resting.map(|contact| (contact.bodies, contact.surfaces));
        self.sleepers.links.extend(links);
        self.sleepers.overlapping.clear();
        for contact in &found.contacts {
            let rigid = matches!(contact.law, NormalLaw::Rigid { .. });
            for (body, [n, t]) in contact.rows.bodies.iter().zip(contact.rows.jacobian) {
                if rigid && -contact.gap > DEEP * n.z.hypot(t.z) {
                    self.sleepers.overlapping.push(*body);
                }
            }
            let touch = 2.0 * contact.gap_noise + drop;
            let sides = contact.rows.bodies;
            if contact.gap <= touch {
                self.sleepers.links.push((sides, contact.surfaces));
            }
            let group = |b: u32| self.list.get(b as usize).map_or(0, |s| s.group);
            let (one, two) = (group(sides[0]), group(sides[1]));
            let asleep = one.max(two);
            if asleep == 0 || one == two {
                continue;
            }
            let other = if one == asleep { sides[1] } else { sides[0] };
            let closing = -contact.rows.velocity(free).x;
            let driven = self.inverse_mass.get(other as usize) == Some(&Vec3::zeros());
            let near = if driven { touch } else { 0.0 };
            if !self.still(other) && contact.gap - dt * closing.max(0.0) < near {
                self.sleepers.mark_to_wake(asleep);
            }
        }
        for joint in &found.joints {
            let sides = joint.rows.bodies;
            self.sleepers.links.push((sides, [NO_BODY; 2]));
        }
    }

    /// Updates how long every body has been still after a step of `dt` \[s\], and finds the islands
    /// that are ready to sleep. Returns the island's number for each body, or 0.
    ///
    /// A body is not ready as long as it overlaps another one, or is moved out of an overlap, by the
    /// displacements `parted`.
    pub fn ready(&mut self, world: &mut PhysicsWorld, parted: &[(u32, Vec3)], dt: f64) -> Vec<u32> {
        let unit = f64::from(world.integration_parameters.length_unit);
        let mut ready = vec![false; self.list.len()];
        let mut any = false;
        for (k, shadow) in self.list.iter_mut().enumerate() {
            let last = std::mem::replace(&mut shadow.last, shadow.pose);
            if shadow.kind != RigidBodyType::Dynamic || shadow.group != 0 {
                continue;
            }
            let body = &world.bodies[shadow.handle];
            let rest = body.activation();
            let extent = f64::from(body.mass_properties().max_extent());
            let rests = is_still(rest, shadow, last, self.velocities[k].z, extent, unit, dt);
            let since = rest.time_since_can_sleep;
            let now = if rests { since + dt as Real } else { 0.0 };
            ready[k] = rests && now >= rest.time_until_sleep;
            any |= ready[k];
            if now != since
                && let Some(body) = world.bodies.get_mut(shadow.handle)
            {
                body.activation_mut().time_since_can_sleep = now;
            }
        }
        for (k, d) in parted {
            let body = &world.bodies[self.list[*k as usize].handle];
            let extent = f64::from(body.mass_properties().max_extent());
            ready[*k as usize] &= d.xy().norm() + d.z.abs() * extent <= PARTED * extent;
        }
        for body in &self.sleepers.overlapping {
            if let Some(ready) = ready.get_mut(*body as usize) {
                *ready = false;
            }
        }
        let mut group = vec![0; self.list.len()];
        if any {
            self.group(world, &ready, &mut group);
        }
        group
    }

    fn group(&mut self, world: &PhysicsWorld, ready: &[bool], group: &mut [u32]) {
        let links = std::mem::take(&mut self.sleepers.links);
        let dynamic = |b: u32| {
            let shadow = self.list.get(b as usize);
            shadow.is_some_and(|s| s.kind == RigidBodyType::Dynamic && s.group == 0)
        };
        // a body without contacts and joints is an island as well
        let alone = (0..ready.len() as u32)
            .filter(|b| dynamic(*b))
            .map(|b| [b, b]);
        let own = |b: u32| if dynamic(b) { b } else { NO_BODY };
        let pairs: Vec<[u32; 2]> = alone
            .chain(links.iter().map(|(sides, _)| sides.map(own)))
            .filter(|sides| *sides != [NO_BODY; 2])
            .collect();
        let mut awake = vec![false; ready.len()];
        for (sides, _) in &links {
            for (b, other) in [(sides[0], sides[1]), (sides[1], sides[0])] {
                if dynamic(b) && !dynamic(other) && !self.still(other) {
                    awake[b as usize] = true;
                }
            }
        }
        let mut islands = Islands::default();
        islands.build(ready.len(), pairs.iter().copied());
        for island in 0..islands.len() {
            let members = || {
                let pairs = islands.blocks(island).iter().map(|&i| pairs[i as usize]);
                pairs.flatten().filter(|b| *b != NO_BODY)
            };
            if members().all(|b| ready[b as usize] && !awake[b as usize]) {
                let number = self.sleepers.add(Group {
                    touched: Some(BTreeSet::new()),
                    ..Group::default()
                });
                members().for_each(|b| group[b as usize] = number);
            }
        }
        let of = |b: u32| group.get(b as usize).copied().unwrap_or(0);
        for (sides, surfaces) in &links {
            let number = of(sides[0]).max(of(sides[1]));
            if let Some(own) = self.sleepers.groups.get_mut(&number)
                && let Some(touched) = &mut own.touched
            {
                touched.extend(surfaces.iter().filter(|s| **s != NO_BODY));
            }
        }
        for (handle, joint) in world.impulse_joints.iter() {
            for body in [joint.body1(), joint.body2()] {
                let number = self.index_of(body).map_or(0, of);
                if let Some(own) = self.sleepers.groups.get_mut(&number) {
                    let joint = fingerprint(&joint.data);
                    own.joints.insert(handle.into_raw_parts().0, joint);
                }
            }
        }
        self.sleepers.links = links;
    }

    /// Puts bodies to sleep in their islands, and stores the impulses of their contacts.
    pub fn fall_asleep(
        &mut self,
        world: &mut PhysicsWorld,
        group: &[u32],
        memory: Vec<(u32, ContactKey, CachedContact)>,
    ) {
        for (k, shadow) in self.list.iter_mut().enumerate() {
            if group[k] == 0 {
                continue;
            }
            shadow.group = group[k];
            shadow.adopt_shown();
            self.velocities[k] = Vec3::zeros();
            if let Some(body) = world.bodies.get_mut(shadow.handle) {
                body.sleep();
                shadow.note_velocity(body);
            }
        }
        for (number, key, contact) in memory {
            if let Some(group) = self.sleepers.groups.get_mut(&number) {
                group.memory.push((key, contact));
            }
        }
    }
}

impl Sleepers {
    /// Marks the islands that touch a collider.
    pub fn mark_touching(&mut self, slot: u32) {
        for (number, group) in &self.groups {
            if group.touched.as_ref().is_none_or(|t| t.contains(&slot)) {
                self.to_wake.insert(*number);
            }
        }
    }
}

/// rapier's measure of rest: compares the motion of the farthest point in the step with the
/// thresholds.
fn is_still(
    rest: &RigidBodyActivation,
    shadow: &Shadow,
    last: crate::dynamics::Pose64,
    spin: f64,
    extent: f64,
    unit: f64,
    dt: f64,
) -> bool {
    let (linear, angular) = (
        f64::from(rest.normalized_linear_threshold),
        f64::from(rest.angular_threshold),
    );
    if linear < 0.0 || angular < 0.0 {
        return false;
    }
    let turns = if extent > 0.0 {
        std::f64::consts::FRAC_PI_2
    } else {
        angular
    };
    let moved: Vec2 = shadow.pose.apply(shadow.center) - last.apply(shadow.center);
    let turned = (shadow.pose.cos - last.cos).hypot(shadow.pose.sin - last.sin);
    spin.abs() < turns && 0.5 * (moved.norm() + extent * turned) < linear * unit * dt
}
