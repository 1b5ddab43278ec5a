use super::engine::prelude::*;
use super::widen;
use crate::contact::{Vec2, Vec3};
use crate::dynamics::ModelError;
use crate::dynamics::Pose64;
use rustc_hash::FxHashMap;

/// Mass \[kg\] and moment of inertia about the centre of mass [kg m²] in `f64`, where rapier's
/// `f32` ones are not good enough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExactBody {
    pub mass: f64,
    pub inertia: f64,
}

/// One rapier body as the stepper sees it.
#[derive(Debug, Clone)]
pub(super) struct Shadow {
    pub handle: RigidBodyHandle,
    pub pose: Pose64,
    /// Centre of mass in the body frame \[m\].
    pub center: Vec2,
    /// Farthest collider point from it \[m\].
    pub radius: f64,
    /// Where the user sends a position-driven body in this step.
    target: Option<Pose>,
    pub kind: RigidBodyType,
    /// What rapier was last given; anything else found there was put there by the user.
    written_pose: Pose,
    written_velocity: (Vector, Real),
    /// `None` until it is first read, and again when an exact mass was given.
    mass_seen: Option<(Real, Real, Vector, LockedAxes)>,
    seen: bool,
}

/// All enabled bodies of a world, in rapier's order.
#[derive(Debug, Clone, Default)]
pub(super) struct Bodies {
    pub list: Vec<Shadow>,
    pub velocities: Vec<Vec3>,
    pub inverse_mass: Vec<Vec3>,
    exact: FxHashMap<RigidBodyHandle, ExactBody>,
    index: FxHashMap<RigidBodyHandle, u32>,
    /// Changes whenever bodies get other numbers or another centre of mass.
    pub numbering: u64,
}

impl Bodies {
    /// Number of the body in the model, if it is enabled and known.
    pub fn index_of(&self, handle: RigidBodyHandle) -> Option<u32> {
        self.index.get(&handle).copied()
    }

    /// Takes over what the user changed since the last step: new, removed, moved, re-massed
    /// bodies, and the velocities of kinematic ones.
    ///
    /// # Errors
    /// [`ModelError`] for a body that is not finite, has no mass, or uses what is not supported.
    pub fn sync(&mut self, world: &mut PhysicsWorld, dt: f64) -> Result<(), ModelError> {
        let handles: Vec<RigidBodyHandle> = world
            .bodies
            .iter()
            .filter(|(_, body)| body.is_enabled())
            .map(|(handle, _)| handle)
            .collect();
        if !handles.iter().eq(self.list.iter().map(|s| &s.handle)) {
            self.rebuild(world, &handles);
        }
        self.list.iter_mut().for_each(|s| s.target = None);
        for k in 0..self.list.len() {
            self.sync_one(world, k, dt)?;
        }
        Ok(())
    }

    fn rebuild(&mut self, world: &mut PhysicsWorld, handles: &[RigidBodyHandle]) {
        let mut old: FxHashMap<RigidBodyHandle, (Shadow, Vec3, Vec3)> = self
            .list
            .drain(..)
            .zip(self.velocities.drain(..).zip(self.inverse_mass.drain(..)))
            .map(|(shadow, (u, w))| (shadow.handle, (shadow, u, w)))
            .collect();
        self.index.clear();
        self.numbering += 1;
        for &handle in handles {
            self.index.insert(handle, self.list.len() as u32);
            let (shadow, u, w) = old.remove(&handle).unwrap_or_else(|| {
                // a new body: rapier computes its mass only when it steps
                if let Some(body) = world.bodies.get_mut(handle) {
                    body.recompute_mass_properties_from_colliders(&world.colliders);
                }
                (Shadow::unseen(handle), Vec3::zeros(), Vec3::zeros())
            });
            self.list.push(shadow);
            self.velocities.push(u);
            self.inverse_mass.push(w);
        }
        self.exact
            .retain(|handle, _| self.index.contains_key(handle));
    }

    fn sync_one(&mut self, world: &PhysicsWorld, k: usize, dt: f64) -> Result<(), ModelError> {
        let shadow = &mut self.list[k];
        let body = &world.bodies[shadow.handle];
        let name = || format!("body {k} (handle {:?})", body_id(shadow.handle));
        refuse_unsupported(body, name)?;
        let pose = *body.position();
        let first = !shadow.seen;
        shadow.seen = true;
        if first || pose != shadow.written_pose {
            if !pose.translation.is_finite() || !pose.rotation.re.is_finite() {
                return Err(ModelError::Invalid(format!(
                    "{} has a position that is not finite",
                    name()
                )));
            }
            shadow.pose = Pose64::from_rapier(&pose);
            shadow.written_pose = pose;
        }
        let velocity = (body.linvel(), body.angvel());
        if first || velocity != shadow.written_velocity {
            if !velocity.0.is_finite() || !velocity.1.is_finite() {
                return Err(ModelError::Invalid(format!(
                    "{} has a velocity that is not finite",
                    name()
                )));
            }
            self.velocities[k] =
                Vec3::new(widen(velocity.0.x), widen(velocity.0.y), widen(velocity.1));
            shadow.written_velocity = velocity;
        }
        let local = &body.mass_properties().local_mprops;
        let seen = (
            local.inv_mass,
            local.inv_principal_inertia,
            local.local_com,
            body.locked_axes(),
        );
        if shadow.mass_seen != Some(seen) || shadow.kind != body.body_type() {
            shadow.mass_seen = Some(seen);
            self.numbering += 1;
            shadow.kind = body.body_type();
            shadow.center = Vec2::new(widen(seen.2.x), widen(seen.2.y));
            self.inverse_mass[k] = match self.exact.get(&shadow.handle) {
                _ if !body.is_dynamic() => Vec3::zeros(),
                Some(exact) => locked(seen.3, 1.0 / exact.mass, 1.0 / exact.inertia),
                None => {
                    // rapier stores inverses; the decimal lies in the mass itself
                    let invert = |w: Real| if w > 0.0 { 1.0 / widen(1.0 / w) } else { 0.0 };
                    locked(seen.3, invert(seen.0), invert(seen.1))
                }
            };
            let free = !seen.3.contains(LockedAxes::TRANSLATION_LOCKED);
            if body.is_dynamic()
                && free
                && self.inverse_mass[k].x.max(self.inverse_mass[k].y) <= 0.0
            {
                return Err(ModelError::Invalid(format!(
                    "{} is dynamic but has no mass: give it a collider with a density or a mass",
                    name()
                )));
            }
        }
        if shadow.kind == RigidBodyType::KinematicPositionBased {
            shadow.target = Some(*body.next_position());
            let next = Pose64::from_rapier(body.next_position());
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

    /// Gives a body a mass of its own, from the next step on.
    pub fn set_exact(&mut self, handle: RigidBodyHandle, exact: ExactBody) {
        self.exact.insert(handle, exact);
        if let Some(k) = self.index_of(handle) {
            self.list[k as usize].mass_seen = None;
        }
    }

    /// `q ← q + u dt` of one body.
    pub fn shift(&mut self, body: usize, u: &Vec3, dt: f64) {
        if *u != Vec3::zeros() {
            let shadow = &mut self.list[body];
            shadow.pose.advance(u, shadow.center, dt);
        }
    }

    /// Gives rapier the poses, rounded, and where `velocities` is set the velocities too.
    pub fn write(&mut self, world: &mut PhysicsWorld, velocities: bool) {
        for (shadow, u) in self.list.iter_mut().zip(&self.velocities) {
            if shadow.kind == RigidBodyType::Fixed {
                continue;
            }
            let pose = shadow.pose.to_rapier();
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
                // a position-driven body takes no velocity; what rapier keeps is what we compare
                body.set_linvel(velocity.0, false);
                body.set_angvel(velocity.1, false);
                shadow.written_velocity = (body.linvel(), body.angvel());
            }
        }
    }

    /// Gives rapier back what a step that failed has moved.
    pub fn give_back(&mut self, world: &mut PhysicsWorld) {
        self.write(world, true);
        for shadow in &self.list {
            // setting a pose sets the target as well
            if let (Some(target), Some(body)) = (shadow.target, world.bodies.get_mut(shadow.handle))
            {
                body.set_next_kinematic_position(target);
            }
        }
    }

    /// Sets a body's state in `f64`; rapier gets it rounded.
    pub fn place(
        &mut self,
        world: &mut PhysicsWorld,
        handle: RigidBodyHandle,
        pose: Pose64,
        velocity: Vec3,
    ) -> bool {
        let Some(k) = self.index_of(handle).map(|k| k as usize) else {
            return false;
        };
        let shadow = &mut self.list[k];
        shadow.pose = pose;
        self.velocities[k] = velocity;
        if let Some(body) = world.bodies.get_mut(handle) {
            body.set_position(pose.to_rapier(), false);
            let linear = Vector::new(velocity.x as Real, velocity.y as Real);
            body.set_linvel(linear, false);
            body.set_angvel(velocity.z as Real, false);
            shadow.written_pose = *body.position();
            shadow.written_velocity = (body.linvel(), body.angvel());
        }
        true
    }
}

impl Shadow {
    fn unseen(handle: RigidBodyHandle) -> Self {
        Shadow {
            handle,
            pose: Pose64::new(Vec2::zeros(), 0.0),
            center: Vec2::zeros(),
            radius: 0.0,
            target: None,
            kind: RigidBodyType::Fixed,
            written_pose: Pose::IDENTITY,
            written_velocity: (Vector::ZERO, 0.0),
            mass_seen: None,
            seen: false,
        }
    }
}

/// Index and generation of a handle, for messages.
pub(super) fn body_id(handle: RigidBodyHandle) -> (u32, u32) {
    handle.into_raw_parts()
}

fn locked(axes: LockedAxes, inverse_mass: f64, inverse_inertia: f64) -> Vec3 {
    let free = |axis, value: f64| if axes.contains(axis) { 0.0 } else { value };
    Vec3::new(
        free(LockedAxes::TRANSLATION_LOCKED_X, inverse_mass),
        free(LockedAxes::TRANSLATION_LOCKED_Y, inverse_mass),
        free(LockedAxes::ROTATION_LOCKED, inverse_inertia),
    )
}

fn refuse_unsupported(body: &RigidBody, name: impl Fn() -> String) -> Result<(), ModelError> {
    let refuse = |what: &str| Err(ModelError::Unsupported(format!("{}: {what}", name())));
    if body.dominance_group() != 0 && body.is_dynamic() {
        return refuse("dominance groups are not supported yet");
    }
    if body.is_ccd_enabled() {
        return refuse("continuous collision detection is not supported yet");
    }
    if body.soft_ccd_prediction() > 0.0 {
        return refuse("soft-CCD prediction is not supported yet");
    }
    Ok(())
}
