use super::body_checks::{body_id, not_there};
use super::changes::ColliderWatch;
use super::engine::prelude::*;
use super::queries::forget_gone;
use super::shadow::Shadow;
use super::sleeping::Sleepers;
use crate::contact::{NO_BODY, Vec3};
use crate::dynamics::ModelError;
use crate::dynamics::{BodyRoles, CachedContact, ContactKey, Pose64};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

/// Mass \[kg\] and moment of inertia about the centre of mass [kg m²] in `f64`, for uses in which
/// rapier's `f32` values are not accurate enough.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ExactBody {
    pub mass: f64,
    pub inertia: f64,
}

/// All enabled bodies of a world, in rapier's order.
#[derive(Clone, Default)]
pub(super) struct Bodies {
    pub list: Vec<Shadow>,
    pub velocities: Vec<Vec3>,
    /// `M⁻¹` with damping, see [`damped`](super::shadow::damped).
    pub inverse_mass: Vec<Vec3>,
    pub roles: BodyRoles,
    /// Whether each body is at rest in this step, see [`MultibodyModel::set_resting`]; empty if none
    /// is.
    ///
    /// [`MultibodyModel::set_resting`]: crate::dynamics::MultibodyModel::set_resting
    pub resting: Vec<bool>,
    /// Whether a body has damping.
    pub(super) damping: bool,
    pub(super) exact: FxHashMap<RigidBodyHandle, ExactBody>,
    /// Bodies that got an exact mass since the last step.
    newly_exact: Vec<RigidBodyHandle>,
    index: FxHashMap<RigidBodyHandle, u32>,
    pub watch: ColliderWatch,
    /// Bodies that the user placed elsewhere since detection last read this list.
    pub placed: Vec<RigidBodyHandle>,
    pub sleepers: Sleepers,
    /// Bodies that rapier or the user has put to sleep.
    pub slept: Vec<usize>,
    /// Number of colliders removed since rapier's notes were last emptied.
    gone: usize,
    /// Changes whenever bodies get other numbers or another centre of mass.
    pub numbering: u64,
    /// For each body the number it had at the last step, or [`NO_BODY`], if the list has been rebuilt since.
    pub renumbered: Option<Vec<u32>>,
}

impl Bodies {
    /// Number of the body in the model, if it is enabled and known.
    pub fn index_of(&self, handle: RigidBodyHandle) -> Option<u32> {
        self.index.get(&handle).copied()
    }

    /// Reads what the user changed since the last step: new, removed, moved and re-massed bodies,
    /// and the velocities of kinematic ones. Stored contact impulses of islands that wake go to
    /// `woken`, on an error too.
    ///
    /// # Errors
    /// [`ModelError`] for a body that is not finite, has an impossible mass, or uses an unsupported
    /// feature;
    /// for a collider, see [`ColliderWatch::scan`]. Invalid state is not read.
    pub fn sync(
        &mut self,
        world: &mut PhysicsWorld,
        dt: f64,
        stay_awake: bool,
        woken: &mut Vec<(ContactKey, CachedContact)>,
    ) -> Result<(), ModelError> {
        for handle in std::mem::take(&mut self.newly_exact) {
            if !world.bodies.contains(handle) {
                self.exact.remove(&handle);
                return Err(not_there(handle));
            }
        }
        let usual = self.read_usual(world, dt, stay_awake);
        if !usual {
            self.update_list(world);
        }
        let scanned = self.watch.scan(&world.colliders);
        if usual && self.watch.changed.is_empty() && self.watch.gone.is_empty() {
            self.forget_removed(world);
            self.clear_equal_dominance();
            return scanned;
        }
        // rapier computes masses only when it steps
        let reported = self.watch.changed.iter().chain(&self.watch.gone);
        let mut parents: Vec<_> = reported.filter_map(|(_, parent)| *parent).collect();
        parents.sort_unstable_by_key(|parent| body_id(*parent));
        parents.dedup();
        for parent in parents {
            if let Some(body) = world.bodies.get_mut(parent) {
                body.recompute_mass_properties_from_colliders(&world.colliders);
            }
            if let Some(k) = self.index_of(parent) {
                self.list[k as usize].thickness = None;
            }
        }
        self.forget_removed(world);
        // a scan reports each change once, so mark islands before any error returns
        self.mark_changed(world);
        scanned?;
        self.follow_user_sleep(world, dt, stay_awake)?;
        self.wake_marked(world, woken);
        self.begin_reading();
        for k in 0..self.list.len() {
            self.sync_one(world, k, dt)?;
            self.read_role(&world.bodies[self.list[k].handle], &world.colliders, k, dt);
        }
        self.clear_equal_dominance();
        Ok(())
    }

    /// Empties rapier's notes of removed colliders, which only its own step would do.
    fn forget_removed(&mut self, world: &mut PhysicsWorld) {
        self.gone += self.watch.gone.len();
        if self.gone > 64 + world.bodies.len() / 4 {
            self.gone = 0;
            forget_gone(world);
            // visiting all bodies mutably makes rapier write its notes anew
            world.bodies.iter_mut().for_each(drop);
            world.colliders.iter_mut().for_each(drop);
        }
    }

    /// Rebuilds the list from the enabled bodies of the world.
    fn update_list(&mut self, world: &mut PhysicsWorld) {
        if self.list_is_current(world) {
            return;
        }
        let mut old: FxHashMap<RigidBodyHandle, (Shadow, Vec3, Vec3)> = self
            .list
            .drain(..)
            .zip(self.velocities.drain(..).zip(self.inverse_mass.drain(..)))
            .map(|(shadow, (u, w))| (shadow.handle, (shadow, u, w)))
            .collect();
        let numbers = std::mem::take(&mut self.index);
        self.numbering += 1;
        let on = |h: &ColliderHandle| world.colliders.get(*h).is_some_and(|c| c.is_enabled());
        let waits = |(h, body): (RigidBodyHandle, &RigidBody)| {
            body.is_enabled() && !old.contains_key(&h) && !body.colliders().iter().all(on)
        };
        if world.bodies.iter().any(waits) {
            // only rapier knows whether a collider was disabled itself or with its body
            world.collision_pipeline.step(
                0.0,
                &mut world.islands,
                &mut world.broad_phase,
                &mut world.narrow_phase,
                &mut world.bodies,
                &mut world.colliders,
                &(),
                &(),
            );
        }
        for (handle, _) in world.bodies.iter().filter(|(_, body)| body.is_enabled()) {
            let (shadow, u, w) = old
                .remove(&handle)
                .unwrap_or_else(|| Shadow::unread(handle));
            self.index.insert(handle, self.list.len() as u32);
            self.list.push(shadow);
            self.velocities.push(u);
            self.inverse_mass.push(w);
        }
        let before = (self.list.iter()).map(|s| numbers.get(&s.handle).copied().unwrap_or(NO_BODY));
        self.renumbered = Some(before.collect());
        // islands of which a body was removed
        for (shadow, _, _) in old.values() {
            self.sleepers.mark_to_wake(shadow.group);
            let colliders = world.bodies.get(shadow.handle).map(RigidBody::colliders);
            for handle in colliders.into_iter().flatten() {
                self.sleepers.mark_touching(handle.into_raw_parts().0);
            }
        }
        self.exact
            .retain(|handle, _| world.bodies.contains(*handle));
        self.list_is_current(world);
    }

    /// Whether the list is the enabled bodies of the world; also stores which bodies fell asleep.
    fn list_is_current(&mut self, world: &PhysicsWorld) -> bool {
        self.slept.clear();
        let mut known = self.list.iter().enumerate();
        for (handle, body) in world.bodies.iter().filter(|(_, body)| body.is_enabled()) {
            match known.next() {
                Some((k, shadow)) if shadow.handle == handle => {
                    if body.is_sleeping() && body.is_dynamic() && shadow.group == 0 {
                        self.slept.push(k);
                    }
                }
                _ => return false,
            }
        }
        known.next().is_none()
    }

    /// Kinetic energy \[J\] with the bodies' own masses, if damping changes the masses of the step.
    pub fn kinetic_energy(&self, velocities: &[Vec3]) -> Option<f64> {
        let of = |(u, shadow): (&Vec3, &Shadow)| {
            let w = shadow.inverse_mass;
            let terms = (0..3).filter(|&i| w[i] > 0.0);
            terms.map(|i| 0.5 * u[i] * u[i] / w[i]).sum::<f64>()
        };
        self.damping
            .then(|| velocities.iter().zip(&self.list).map(of).sum())
    }

    /// Sets an exact mass, from the next step on.
    pub fn set_exact(&mut self, handle: RigidBodyHandle, exact: ExactBody) {
        self.exact.insert(handle, exact);
        self.newly_exact.push(handle);
        if let Some(k) = self.index_of(handle) {
            self.list[k as usize].mass_seen = None;
        }
    }

    /// All exact masses.
    pub fn exact(&self) -> impl Iterator<Item = (RigidBodyHandle, ExactBody)> + '_ {
        self.exact.iter().map(|(handle, exact)| (*handle, *exact))
    }

    pub fn restore_exact(&mut self, handle: RigidBodyHandle, exact: ExactBody) {
        self.exact.insert(handle, exact);
    }

    /// Appends a saved body; [`Bodies::sync`] reads the rest from the world.
    pub fn restore(
        &mut self,
        handle: RigidBodyHandle,
        pose: Pose64,
        last: Pose64,
        velocity: Vec3,
        written: (Pose, (Vector, Real)),
    ) {
        let (mut shadow, _, w) = Shadow::unread(handle);
        (shadow.pose, shadow.last, shadow.seen) = (pose, last, true);
        (shadow.written_pose, shadow.written_velocity) = written;
        self.index.insert(handle, self.list.len() as u32);
        self.list.push(shadow);
        self.velocities.push(velocity);
        self.inverse_mass.push(w);
    }

    /// `q ← q + u dt` of one body.
    pub fn shift(&mut self, body: usize, u: &Vec3, dt: f64) {
        if *u != Vec3::zeros() {
            let shadow = &mut self.list[body];
            shadow.pose.advance(u, shadow.center, dt);
        }
    }

    /// Writes the rounded poses to rapier, and the velocities if `velocities` is set.
    pub fn write(&mut self, world: &mut PhysicsWorld, velocities: bool) {
        for (shadow, u) in self.list.iter_mut().zip(&self.velocities) {
            if shadow.kind == RigidBodyType::Fixed {
                continue;
            }
            let pose = shadow.shown_pose().to_rapier();
            let u = shadow.shown_velocity(*u);
            let velocity = (Vector::new(u.x as Real, u.y as Real), u.z as Real);
            let new_velocity = velocities && velocity != shadow.written_velocity;
            if pose == shadow.written_pose && !new_velocity {
                continue;
            }
            let Some(body) = world.bodies.get_mut(shadow.handle) else {
                continue;
            };
            body.set_position(pose, false);
            shadow.written_pose = pose;
            if new_velocity {
                // rapier refuses a velocity for a position-based kinematic body; compare with what
                // rapier stores
                body.set_linvel(velocity.0, false);
                body.set_angvel(velocity.1, false);
                shadow.written_velocity = (body.linvel(), body.angvel());
            }
        }
    }

    /// Restores rapier's poses after a failed step.
    pub fn undo_step(&mut self, world: &mut PhysicsWorld) {
        self.write(world, true);
        for shadow in &self.list {
            // setting a pose sets the target as well
            if let (Some(target), Some(body)) = (shadow.target, world.bodies.get_mut(shadow.handle))
            {
                body.set_next_kinematic_position(target);
            }
        }
    }

    /// Sets a body's state in `f64` and writes it to rapier rounded.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] for a body that is not there, or a state that is not finite.
    pub fn place(
        &mut self,
        world: &mut PhysicsWorld,
        handle: RigidBodyHandle,
        pose: Pose64,
        velocity: Vec3,
    ) -> Result<(), ModelError> {
        let body = world.bodies.get_mut(handle).ok_or(not_there(handle))?;
        let turn = pose.cos.hypot(pose.sin);
        if !(pose.translation.iter().chain(&velocity)).all(|x| x.is_finite())
            || (turn - 1.0).abs() > 1e-6
            || !turn.is_finite()
        {
            return Err(ModelError::Invalid(format!(
                "body (handle {:?}): pose {pose:?} and velocity {velocity:?} must be finite, and \
                 the rotation a unit",
                body_id(handle)
            )));
        }
        // for callers that read rapier's mass before the first step
        body.recompute_mass_properties_from_colliders(&world.colliders);
        body.set_position(pose.to_rapier(), false);
        let linear = Vector::new(velocity.x as Real, velocity.y as Real);
        body.set_linvel(linear, false);
        body.set_angvel(velocity.z as Real, false);
        body.wake_up(true);
        let slots: Vec<u32> = (body.colliders().iter())
            .map(|h| h.into_raw_parts().0)
            .collect();
        slots
            .iter()
            .for_each(|slot| self.sleepers.mark_touching(*slot));
        // a new body comes last until the next step sorts the list
        let k = self.index_of(handle).unwrap_or(self.list.len() as u32);
        if k as usize == self.list.len() {
            let (shadow, u, w) = Shadow::unread(handle);
            self.numbering += 1;
            self.index.insert(handle, k);
            self.list.push(shadow);
            self.velocities.push(u);
            self.inverse_mass.push(w);
        }
        let shadow = &mut self.list[k as usize];
        self.sleepers.mark_to_wake(shadow.group);
        self.placed.push(handle);
        (shadow.pose, shadow.shown) = (pose, None);
        shadow.written_pose = *body.position();
        shadow.written_velocity = (body.linvel(), body.angvel());
        shadow.seen = true;
        self.velocities[k as usize] = velocity;
        Ok(())
    }
}

/// Dominance of fixed and kinematic bodies: above that of any dynamic body.
pub(super) const IMMOVABLE: i16 = i8::MAX as i16 + 1;
