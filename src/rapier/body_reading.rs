//! Reads what the user set on the bodies of a world.

use super::bodies::{Bodies, IMMOVABLE};
use super::body_checks::{body_id, check_mass, is_surely_finite, refuse_bad};
use super::engine::prelude::*;
use super::shadow::{Settings, damped, locked, mass_of, thickness};
use super::widen::{widen, widen_state};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::{ModelError, Pose64, Sweep};

impl Bodies {
    pub(super) fn begin_reading(&mut self) {
        self.damping = false;
        self.roles.dominance.clear();
        self.roles.sweeps.clear();
    }

    /// Fast path: reads all bodies in one pass over rapier's memory. Returns `false` if a body was
    /// added or removed, sleeps, changed its mass or kind, or is invalid. [`Bodies::sync_one`] must
    /// then read all bodies one by one.
    pub(super) fn read_usual(&mut self, world: &PhysicsWorld, dt: f64, stay_awake: bool) -> bool {
        if !self.sleepers.is_empty() {
            return false;
        }
        self.slept.clear();
        self.begin_reading();
        let mut k = 0;
        for (handle, body) in world.bodies.iter().filter(|(_, body)| body.is_enabled()) {
            let usual = self.list.get(k).is_some_and(|shadow| {
                shadow.handle == handle
                    && shadow.seen
                    && shadow.has_kind_and_mass_of(body)
                    && (stay_awake || !(body.is_sleeping() && body.is_dynamic()))
            });
            if !usual || self.read(body, k, dt).is_err() {
                return false;
            }
            self.read_role(body, &world.colliders, k, dt);
            k += 1;
        }
        k == self.list.len()
    }

    /// Clears the dominances if all bodies have the same.
    pub(super) fn clear_equal_dominance(&mut self) {
        let mut levels = self.roles.dominance.iter().filter(|l| **l != IMMOVABLE);
        let first = levels.next();
        if levels.all(|l| Some(l) == first) {
            self.roles.dominance.clear();
        }
    }

    /// Reads the dominance of a body, and whether its time of impact is computed.
    pub(super) fn read_role(
        &mut self,
        body: &RigidBody,
        colliders: &ColliderSet,
        k: usize,
        dt: f64,
    ) {
        let count = self.velocities.len();
        if !body.is_dynamic() {
            // above all others, as if it had the highest dominance
            if let Some(level) = self.roles.dominance.get_mut(k) {
                *level = IMMOVABLE;
            }
            return;
        }
        let group = i16::from(body.dominance_group());
        if group != 0 && self.roles.dominance.is_empty() {
            let earlier = self.list[..k].iter().map(|s| s.kind);
            let immovable = |kind| {
                if kind == RigidBodyType::Dynamic {
                    0
                } else {
                    IMMOVABLE
                }
            };
            self.roles.dominance.extend(earlier.map(immovable));
            self.roles.dominance.resize(count, 0);
        }
        if group != 0 {
            self.roles.dominance[k] = group;
        }
        let shadow = &mut self.list[k];
        let thickness = *shadow.thickness.get_or_insert_with(|| {
            let own = body.colliders().iter();
            own.filter_map(|h| colliders.get(*h))
                .filter(|c| c.is_enabled() && !c.is_sensor())
                .map(|c| thickness(c.shape()))
                .fold(f64::INFINITY, f64::min)
        });
        let u = self.velocities[k];
        let extent = f64::from(body.mass_properties().max_extent());
        let fast = (u.xy().norm() + u.z.abs() * extent) * dt > 0.5 * thickness;
        if fast || body.is_ccd_enabled() {
            self.roles.sweeps.resize(count, Sweep::NONE);
            self.roles.sweeps[k] = Sweep {
                thickness,
                all: body.is_ccd_enabled(),
            };
        }
    }

    pub(super) fn sync_one(
        &mut self,
        world: &mut PhysicsWorld,
        k: usize,
        dt: f64,
    ) -> Result<(), ModelError> {
        let shadow = &mut self.list[k];
        if shadow.group != 0 {
            self.inverse_mass[k] = Vec3::zeros();
            self.velocities[k] = Vec3::zeros();
            return Ok(());
        }
        let body = &world.bodies[shadow.handle];
        let added = body.mass_properties().additional_local_mprops.as_deref();
        if shadow.added_mass.as_ref() != added {
            shadow.added_mass = added.copied();
            world.bodies[shadow.handle].recompute_mass_properties_from_colliders(&world.colliders);
        }
        self.read(&world.bodies[self.list[k].handle], k, dt)
    }

    /// Reads what the user set on one body.
    fn read(&mut self, body: &RigidBody, k: usize, dt: f64) -> Result<(), ModelError> {
        let shadow = &mut self.list[k];
        let name = || format!("body {k} (handle {:?})", body_id(shadow.handle));
        let settings = Settings::of(body);
        let as_before = shadow.settings == Some(settings);
        if !as_before || !is_surely_finite(body) {
            refuse_bad(body, name)?;
        }
        let pose = *body.position();
        let first = !shadow.seen;
        let velocity = (body.linvel(), body.angvel());
        let seen = mass_of(body);
        if shadow.mass_seen != Some(seen) || shadow.kind != body.body_type() {
            self.numbering += 1;
            shadow.inverse_mass = match self.exact.get(&shadow.handle) {
                _ if !body.is_dynamic() => Vec3::zeros(),
                Some(exact) => locked(seen.3, 1.0 / exact.mass, 1.0 / exact.inertia),
                None => {
                    check_mass(body, name)?;
                    // rapier stores inverses; the user typed the mass itself
                    let invert = |w: Real| if w > 0.0 { 1.0 / widen(1.0 / w) } else { 0.0 };
                    locked(seen.3, invert(seen.0), invert(seen.1))
                }
            };
            // one that the user changes may not move any more; one that was resumed goes on
            if shadow.mass_seen.is_some() {
                shadow.adopt_shown();
            }
            shadow.mass_seen = Some(seen);
            shadow.kind = body.body_type();
            shadow.center = Vec2::new(widen(seen.2.x), widen(seen.2.y));
        }
        if first {
            shadow.last = Pose64::from_rapier_body(&pose);
        }
        if !first && pose != shadow.written_pose {
            self.placed.push(shadow.handle);
        }
        if first || pose != shadow.written_pose {
            shadow.pose = Pose64::from_rapier_body(&pose);
            shadow.shown = None;
            shadow.written_pose = pose;
        }
        if first || velocity != shadow.written_velocity {
            self.velocities[k] = [velocity.0.x, velocity.0.y, velocity.1]
                .map(widen_state)
                .into();
            shadow.written_velocity = velocity;
            let own = self.velocities[k];
            shadow.shown = shadow.shown.map(|(pose, _)| (pose, own));
        }
        shadow.seen = true;
        if !as_before {
            shadow.load = settings.load();
            shadow.settings = Some(settings);
        }
        let damping = shadow.load.damping;
        self.inverse_mass[k] = if damping == (0.0, 0.0) || shadow.inverse_mass == Vec3::zeros() {
            shadow.inverse_mass
        } else {
            self.damping = true;
            damped(shadow.inverse_mass, damping, dt)
        };
        shadow.target = None;
        if shadow.kind == RigidBodyType::KinematicPositionBased {
            shadow.target = Some(*body.next_position());
            let next = Pose64::from_rapier_body(body.next_position());
            let turned = Pose64 {
                translation: Vec2::zeros(),
                cos: shadow.pose.cos * next.cos + shadow.pose.sin * next.sin,
                sin: shadow.pose.cos * next.sin - shadow.pose.sin * next.cos,
            }
            .angle();
            let moved = next.apply(shadow.center) - shadow.pose.apply(shadow.center);
            self.velocities[k] = Vec3::new(moved.x / dt, moved.y / dt, turned / dt);
        }
        if shadow.kind == RigidBodyType::Fixed {
            self.velocities[k] = Vec3::zeros();
        }
        Ok(())
    }
}
