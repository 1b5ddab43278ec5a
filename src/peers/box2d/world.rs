use super::super::peer::{self, PeerContact, Touch};
use super::super::simulation::{BodyId as Named, Simulation};
use super::{Box2dSettings, joints, shapes};
use crate::dynamics::record::StepRecord;
use crate::dynamics::{ModelError, StepError};
use crate::rapier::engine::prelude::*;
use crate::rapier::widen;
use boxdd::{BodyId, BodyType, Foundation, MassData, ShapeId, World};
use rustc_hash::{FxHashMap, FxHashSet};
use std::fmt::Display;
use std::time::Instant;

/// A copy of a rapier world in Box2D, see [`Box2dSettings`].
pub struct Box2d {
    world: World,
    /// All movable bodies, in rapier's order.
    moving: Vec<(RigidBodyHandle, BodyId)>,
    surfaces: FxHashMap<ShapeId, Face>,
    substeps: i32,
}

/// The rapier collider of a Box2D shape.
struct Face {
    collider: ColliderHandle,
    /// Edge of a polyline, else 0.
    cell: u32,
}

impl Box2d {
    /// Copies the present state of the world.
    ///
    /// # Arguments
    /// - `names`: names of bodies for errors; other bodies are named by their numbers.
    ///
    /// # Errors
    /// [`ModelError::Unsupported`] names what Box2D does not have; [`ModelError::Invalid`] for
    /// numbers that it does not accept.
    pub fn copy(
        simulation: &Simulation,
        settings: &Box2dSettings,
        names: &[(Named, String)],
    ) -> Result<Box2d, ModelError> {
        let names: FxHashMap<_, _> = names.iter().map(|(body, name)| (body.0, name)).collect();
        let called = |handle: &RigidBodyHandle| match names.get(handle) {
            Some(name) => (*name).clone(),
            None if names.is_empty() => handle.into_raw_parts().0.to_string(),
            // a body without a name is the ground of joints
            None => "world".to_owned(),
        };
        let rapier = &simulation.world;
        if rapier.multibody_joints.multibodies().next().is_some() {
            return Err(lacks("multibody joints"));
        }
        let foundation = Foundation::initialize_default().map_err(box2d_error("start"))?;
        let builder = foundation
            .world_builder()
            .gravity([narrow(rapier.gravity.x), narrow(rapier.gravity.y)])
            .contact_hertz(settings.contact_frequency as f32)
            .enable_sleep(false);
        let define = || foundation.create_world(builder.build()?);
        let mut world = define().map_err(box2d_error("world"))?;
        if rapier.colliders.iter().any(|(_, c)| c.parent().is_none()) {
            return Err(lacks("colliders without a body"));
        }
        let rules = shapes::Rules::of(rapier);
        rules.install(&mut world)?;
        let mut bodies = FxHashMap::default();
        let (mut moving, mut surfaces) = (Vec::new(), FxHashMap::default());
        let laws: FxHashMap<_, _> = simulation.pipeline.surfaces().collect();
        for (handle, body) in rapier.bodies.iter() {
            let name = format!("body {}", called(&handle));
            let id = body_like(&mut world, body, &name)?;
            for &handle in body.colliders() {
                let collider = &rapier.colliders[handle];
                if simulation.hooks.one_way.contains_key(&handle) {
                    return Err(lacks(&format!("one-way surfaces ({name})")));
                }
                let law = laws.get(&handle).copied().unwrap_or_default();
                let found = shapes::add(&mut world, id, collider, &law, &name)?;
                let faces = found.into_iter().enumerate().map(|(k, shape)| {
                    let cell = k as u32;
                    (
                        shape,
                        Face {
                            collider: handle,
                            cell,
                        },
                    )
                });
                surfaces.extend(faces);
            }
            set_motion(&mut world, id, body).map_err(box2d_error(&name))?;
            if !body.is_fixed() {
                moving.push((handle, id));
            }
            bodies.insert(handle, id);
        }
        for (_, joint) in rapier.impulse_joints.iter() {
            let ends = [joint.body1(), joint.body2()];
            let [a, b] = [&ends[0], &ends[1]].map(called);
            let name = format!("joint {a}-{b}");
            let ids = ends.map(|h| bodies.get(&h).copied());
            let [Some(a), Some(b)] = ids else {
                return Err(ModelError::Invalid(format!(
                    "{name}: a body is not in the world"
                )));
            };
            let ends = ends.map(|h| &rapier.bodies[h]);
            joints::add(&mut world, [a, b], ends, &joint.data, &name)?;
        }
        Ok(Box2d {
            world,
            moving,
            surfaces,
            substeps: i32::try_from(settings.substeps).unwrap_or(i32::MAX),
        })
    }

    /// One step of Box2D; writes its poses and velocities into the rapier world.
    ///
    /// [`Simulation::peer_seconds`] counts only Box2D's own step. Contacts have the normal impulse
    /// of the whole step. Box2D keeps the friction impulse of the last substep only; the whole step
    /// is assumed to have the same ratio to the normal impulse. Slip is `Δt γ_T` at the end of the
    /// step. Box2D finds gaps and positions at the start of the step; they move with the bodies to
    /// its end, along the normal n of the start:
    /// ```text
    /// gap = separation + n·(Δc_B − Δc_A)                                          (1)
    /// ```
    /// where Δc is the motion in the step of the contact point with each body; for a round shape,
    /// which may rotate without a change of its gap, the motion of its core. The position is half
    /// way between the two moved points, and so off by half of the slip. Box2D at times gives a
    /// contact of a plain polyline a normal that is no unit vector. The contacts of such a body
    /// cannot be read, except from the other body's side, and [`StepRecord::unread`] counts the
    /// bodies.
    ///
    /// # Errors
    /// [`StepError::Model`] if Box2D fails, or a body was removed from the rapier world.
    pub fn step(&mut self, simulation: &mut Simulation) -> Result<StepRecord, StepError> {
        let rapier = &mut simulation.world;
        let dt = widen(rapier.integration_parameters.dt);
        let before = peer::energies(rapier);
        let start = |&(handle, _): &(RigidBodyHandle, BodyId)| {
            let body = rapier.bodies.get(handle)?;
            Some((handle, (centre(body), *body.rotation())))
        };
        let starts: Starts = self.moving.iter().filter_map(start).collect();
        let clock = Instant::now();
        let done = self.world.step(dt as f32, self.substeps);
        simulation.peer_seconds = clock.elapsed().as_secs_f64();
        simulation.peer_time += dt;
        done.and_then(|done| done.into_result().map(drop))
            .map_err(box2d_error("step"))?;
        for &(handle, id) in &self.moving {
            let body = rapier.bodies.get_mut(handle).ok_or_else(|| {
                ModelError::Invalid("a body that Box2D steps is not in the world".to_owned())
            })?;
            read_motion(&mut self.world, id, body).map_err(box2d_error("pose"))?;
        }
        if !simulation.peer_records {
            return Ok(StepRecord::default());
        }
        let mut record = peer::record(rapier, simulation.peer_time, dt, before);
        self.contacts(rapier, &starts, &mut record)
            .map_err(box2d_error("contacts"))?;
        Ok(record)
    }

    fn contacts(
        &mut self,
        rapier: &PhysicsWorld,
        starts: &Starts,
        record: &mut StepRecord,
    ) -> boxdd::Result<()> {
        let mut read = Vec::with_capacity(self.moving.len());
        for &(handle, id) in &self.moving {
            match self.world.body(id)?.contact_data() {
                // Box2D at times makes a normal that is no unit vector, and steps on
                Err(boxdd::Error::InvalidNativeOutput {
                    output: "manifold", ..
                }) => record.unread += 1,
                found => read.push((handle, found?)),
            }
        }
        let readable: FxHashSet<RigidBodyHandle> = read.iter().map(|(handle, _)| *handle).collect();
        for (handle, found) in read {
            for contact in found {
                let shapes = [contact.shape_id_a, contact.shape_id_b];
                let [Some(a), Some(b)] = shapes.map(|s| self.surfaces.get(&s)) else {
                    continue;
                };
                let colliders = [a.collider, b.collider];
                let parents = colliders.map(|c| rapier.colliders[c].parent());
                // both bodies list a contact: take it from the first that could be read
                let first = parents
                    .into_iter()
                    .flatten()
                    .filter(|h| readable.contains(h))
                    .min_by_key(|h| h.into_raw_parts().0);
                if first != Some(handle) {
                    continue;
                }
                let [Some(a_moves), Some(b_moves)] = parents.map(|h| Moves::of(rapier, starts, h?))
                else {
                    continue;
                };
                let n = vector(contact.manifold.normal.x, contact.manifold.normal.y);
                // from a surface to its core
                let inward = [(a, -n), (b, n)].map(|(side, into)| {
                    into * peer::rounding(&rapier.colliders[side.collider], side.cell) as Real
                });
                for point in contact.manifold.points() {
                    let total = f64::from(point.total_normal_impulse);
                    let last = f64::from(point.normal_impulse);
                    let arms = [point.anchor_a, point.anchor_b].map(|arm| vector(arm.x, arm.y));
                    let first = a_moves.way(arms[0] + inward[0]);
                    let second = b_moves.way(arms[1] + inward[1]);
                    let start = a_moves.start + arms[0];
                    let contact = PeerContact {
                        colliders,
                        cells: [a.cell, b.cell],
                        touch: Touch {
                            place: start + (first + second) * 0.5,
                            normal: peer::wide(n),
                            gap: f64::from(point.separation) + f64::from(n.dot(second - first)),
                        },
                        impulse_n: total,
                        // Box2D's tangent is the normal turned by -90 degrees
                        impulse_t: match last > 0.0 {
                            true => -f64::from(point.tangent_impulse) * total / last,
                            false => 0.0,
                        },
                        friction: shapes::friction(colliders.map(|c| &rapier.colliders[c])),
                    };
                    contact.add(rapier, record);
                }
            }
        }
        Ok(())
    }
}

/// Centre of mass and rotation of every movable body at the start of a step.
type Starts = FxHashMap<RigidBodyHandle, (Vector, Rotation)>;

/// Motion of a body in a step.
struct Moves {
    /// Centre of mass at the start, and its displacement.
    start: Vector,
    shift: Vector,
    turn: Rotation,
}

impl Moves {
    fn of(world: &PhysicsWorld, starts: &Starts, body: RigidBodyHandle) -> Option<Moves> {
        let now = world.bodies.get(body)?;
        let (centre, rotation) = (centre(now), *now.rotation());
        let (start, before) = starts.get(&body).copied().unwrap_or((centre, rotation));
        Some(Moves {
            start,
            shift: centre - start,
            turn: rotation * before.inverse(),
        })
    }

    /// The displacement of the point at `arm` from the centre of mass at the start.
    fn way(&self, arm: Vector) -> Vector {
        self.shift + self.turn * arm - arm
    }
}

/// The origin of arms in Box2D: it stores no centre of mass for bodies that impulses do not move.
fn centre(body: &RigidBody) -> Vector {
    match body.is_dynamic() {
        true => body.center_of_mass(),
        false => body.translation(),
    }
}

/// A body without shapes at the pose of `body`.
fn body_like(world: &mut World, body: &RigidBody, name: &str) -> Result<BodyId, ModelError> {
    let kind = match body.body_type() {
        RigidBodyType::Dynamic => BodyType::Dynamic,
        RigidBodyType::Fixed => BodyType::Static,
        RigidBodyType::KinematicVelocityBased => BodyType::Kinematic,
        RigidBodyType::KinematicPositionBased => {
            return Err(lacks(&format!(
                "bodies that are box2d_error their poses ({name})"
            )));
        }
        RigidBodyType::SoftFrame => return Err(lacks(&format!("soft bodies ({name})"))),
    };
    let has_not = [
        (body.dominance_group() != 0, "dominance"),
        (
            body.user_force() != Vector::ZERO || body.user_torque() != 0.0,
            "forces set by the user",
        ),
        (!body.locked_axes().is_empty(), "locked axes"),
        (!body.is_enabled(), "disabled bodies"),
    ];
    if let Some((_, what)) = has_not.iter().find(|(has, _)| *has) {
        return Err(lacks(&format!("{what} ({name})")));
    }
    let place = body.translation();
    let builder = world
        .body_builder()
        .body_type(kind)
        .position([narrow(place.x), narrow(place.y)])
        .angle(narrow(body.rotation().angle()))
        .gravity_scale(narrow(body.gravity_scale()))
        .linear_damping(narrow(body.linear_damping()))
        .angular_damping(narrow(body.angular_damping()))
        .bullet(body.is_ccd_enabled());
    let made = builder.build().and_then(|body| world.create_body(body));
    made.map_err(box2d_error(name))
}

/// Sets mass and velocity of `body`, in place of those that its shapes gave.
fn set_motion(world: &mut World, id: BodyId, body: &RigidBody) -> boxdd::Result<()> {
    let mut copy = world.body(id)?;
    if body.is_dynamic() {
        let mass = &body.mass_properties().local_mprops;
        let centre = [narrow(mass.local_com.x), narrow(mass.local_com.y)];
        let inertia = mass.principal_inertia();
        copy.set_mass_data(MassData::new(
            narrow(mass.mass()),
            centre.into(),
            narrow(inertia),
        )?)?;
    }
    if !body.is_fixed() {
        let v = body.linvel();
        copy.set_linear_velocity([narrow(v.x), narrow(v.y)])?;
        copy.set_angular_velocity(narrow(body.angvel()))?;
    }
    Ok(())
}

fn read_motion(world: &mut World, id: BodyId, body: &mut RigidBody) -> boxdd::Result<()> {
    let copy = world.body(id)?;
    let (pose, v, spin) = (
        copy.transform()?,
        copy.linear_velocity()?,
        copy.angular_velocity()?,
    );
    let (place, turn) = (pose.position(), pose.rotation());
    let turn = Rotation::from_cos_sin_unchecked(widened(turn.cosine()), widened(turn.sine()));
    body.set_position(Pose::from_parts(vector(place.x, place.y), turn), false);
    body.set_linvel(vector(v.x, v.y), false);
    body.set_angvel(widened(spin), false);
    Ok(())
}

/// Rounded for Box2D.
pub(super) fn narrow(x: Real) -> f32 {
    f64::from(x) as f32
}

/// In rapier's precision.
pub(super) fn widened(x: f32) -> Real {
    f64::from(x) as Real
}

fn vector(x: f32, y: f32) -> Vector {
    Vector::new(widened(x), widened(y))
}

pub(super) fn lacks(what: &str) -> ModelError {
    ModelError::Unsupported(format!("Box2D has no {what}"))
}

/// A Box2D error about `what`.
pub(super) fn box2d_error<E: Display>(what: &str) -> impl FnOnce(E) -> ModelError + '_ {
    move |error| ModelError::Invalid(format!("Box2D, {what}: {error}"))
}
