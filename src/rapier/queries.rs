//! rapier's own queries between our steps.

use super::body_checks::{body_id, refuse_bad};
use super::changes::check;
use super::engine::prelude::*;
use super::pipeline::MoreauPipeline;
use crate::dynamics::ModelError;
use rustc_hash::FxHashSet;

impl MoreauPipeline {
    /// Brings rapier's query tree and contact graph up to the present poses. Call it before
    /// `world.cast_ray` and its kin, `world.contact_pairs()` and `world.intersection_pairs()`.
    ///
    /// A step of [`MoreauPipeline`] finds its contacts itself and updates neither of the two: in a
    /// world that rapier has never stepped they are empty. Poses of bodies and colliders need no
    /// refresh.
    ///
    /// The contact graph has rapier's gaps and no impulses: those are in the record of the step.
    /// `hooks` filters pairs (`&()` for none). No pose and no velocity changes, no event is sent, and
    /// `world.step()` works afterwards as before. Bodies sleep on, unless they touch one that is
    /// awake: rapier's islands sleep as a whole. Where all bodies have moved a
    /// refresh costs about two steps of rapier: call it only before a query. rapier keeps a note of
    /// every pair that has parted from one refresh to the next, until a step of its own.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] names a body or collider whose state is not finite, which rapier
    /// would disable silently; nothing has changed then.
    ///
    /// ```
    /// use moreau2d::rapier::engine::prelude::*;
    /// use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
    ///
    /// let mut world = PhysicsWorld::new();
    /// let (_, floor) = world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(10.0, 0.5));
    /// let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
    /// pipeline.step(&mut world)?;
    /// let down = Ray::new(Vector::new(0.0, 2.0), Vector::new(0.0, -1.0));
    /// let cast = |world: &PhysicsWorld| world.cast_ray(&down, 10.0, true, QueryFilter::default());
    /// assert!(cast(&world).is_none());
    /// MoreauPipeline::refresh_queries(&mut world, &())?;
    /// assert_eq!(cast(&world), Some((floor, 1.5)));
    /// # Ok::<(), moreau2d::dynamics::StepError>(())
    /// ```
    pub fn refresh_queries(
        world: &mut PhysicsWorld,
        hooks: &dyn PhysicsHooks,
    ) -> Result<(), ModelError> {
        for (handle, body) in world.bodies.iter().filter(|(_, body)| body.is_enabled()) {
            refuse_bad(body, || format!("body (handle {:?})", body_id(handle)))?;
        }
        for (handle, collider) in world.colliders.iter() {
            check(handle, collider)?;
        }
        let parameters = IntegrationParameters {
            dt: 0.0,
            // a recycled manifold may be off by a millimetre
            contact_recycling: false,
            ..world.integration_parameters
        };
        let rests = rests(world);
        set_up_islands(world);
        // new contacts wake sleepers in rapier's islands, which must then not hold them as asleep:
        // rapier would move them without their contacts
        for (_, body) in world.bodies.iter_mut().filter(|(_, b)| b.is_sleeping()) {
            body.wake_up(true);
        }
        // a step of zero length may move the tree aside to optimise it; a second one, with nothing
        // to do, moves it back
        for _ in 0..2 {
            world.physics_pipeline.step(
                world.gravity,
                &parameters,
                &mut world.islands,
                &mut world.broad_phase,
                &mut world.narrow_phase,
                &mut world.bodies,
                &mut world.colliders,
                &mut world.impulse_joints,
                &mut world.multibody_joints,
                &mut world.soft_bodies,
                &mut world.ccd_solver,
                hooks,
                &(),
            );
        }
        let whole =
            |handle: &RigidBodyHandle| world.islands.persistent_island_of(&world.bodies, *handle);
        let awake = rests.iter().filter(|(_, rest)| !rest.sleeping);
        let awake: FxHashSet<u32> = awake.filter_map(|(handle, _)| whole(handle)).collect();
        // rapier's islands sleep as a whole: who touches an awake body wakes
        let rests = rests.into_iter().filter(|(handle, rest)| {
            !rest.sleeping || whole(handle).is_none_or(|island| !awake.contains(&island))
        });
        restore_sleep(world, rests.collect());
        Ok(())
    }
}

/// Lets rapier set up its islands before it sees a body. Its first step would take bodies that
/// sleep in our steps for members of sleeping islands while it keeps them in its list of moving ones,
/// and they would fall without contacts.
fn set_up_islands(world: &mut PhysicsWorld) {
    let mut bodies = world.bodies.iter();
    if bodies.any(|(h, _)| {
        world
            .islands
            .persistent_island_of(&world.bodies, h)
            .is_some()
    }) {
        return;
    }
    let mut empty = PhysicsWorld::new();
    std::mem::swap(&mut empty.islands, &mut world.islands);
    empty.step();
    std::mem::swap(&mut empty.islands, &mut world.islands);
}

type Rest = (RigidBodyHandle, RigidBodyActivation);

/// Sleep state of all bodies. rapier wakes modified bodies and resets how long they have been
/// still.
fn rests(world: &PhysicsWorld) -> Vec<Rest> {
    let bodies = world.bodies.iter();
    bodies
        .map(|(handle, body)| (handle, *body.activation()))
        .collect()
}

fn restore_sleep(world: &mut PhysicsWorld, rests: Vec<Rest>) {
    for (handle, rest) in rests {
        if world.bodies[handle].activation() != &rest {
            *world.bodies[handle].activation_mut() = rest;
        }
    }
}

/// Removes deleted colliders from rapier's query tree and contact graph, and from the notes for its
/// own step. Bodies and sleep states do not change.
pub(super) fn forget_gone(world: &mut PhysicsWorld) {
    let gone = world.colliders.take_removed();
    if gone.is_empty() {
        return;
    }
    let rests = rests(world);
    // no collider counts as modified, so that the tree reports no new pairs
    world.broad_phase.update(
        &world.integration_parameters,
        &world.colliders,
        &world.bodies,
        &[],
        &gone,
        &mut Vec::new(),
    );
    world.narrow_phase.handle_user_changes(
        Some(&mut world.islands),
        &[],
        &gone,
        &mut world.colliders,
        &mut world.bodies,
        &(),
    );
    restore_sleep(world, rests);
}
