//! Steps over sets that the caller keeps apart, as `PhysicsPipeline::step` takes them.

use super::engine::prelude::*;
use super::pipeline::MoreauPipeline;
use crate::dynamics::StepError;
use crate::dynamics::record::StepRecord;
use std::mem::swap;

impl MoreauPipeline {
    /// One step over borrowed sets, in place of rapier's `PhysicsPipeline::step` and with its
    /// arguments: for programs that keep the sets themselves, and for engines that wrap them.
    ///
    /// The step length is `parameters.dt` unless [`super::MoreauSettings::dt`] sets one, and gravity
    /// is `gravity` unless [`super::MoreauSettings::gravity`] does. Use a pipeline for one group of
    /// sets only: it remembers their bodies.
    ///
    /// # Errors
    /// As [`MoreauPipeline::step`]; the sets are then as they were before the step.
    ///
    /// ```
    /// use moreau2d::rapier::engine::prelude::*;
    /// use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
    ///
    /// let mut bodies = RigidBodySet::new();
    /// let mut colliders = ColliderSet::new();
    /// colliders.insert(ColliderBuilder::cuboid(100.0, 0.1));
    /// let ball = bodies.insert(RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 2.0)));
    /// colliders.insert_with_parent(ColliderBuilder::ball(0.5), ball, &mut bodies);
    ///
    /// let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
    /// let mut islands = IslandManager::new();
    /// let mut broad_phase = BroadPhaseBvh::new();
    /// let mut narrow_phase = NarrowPhase::new();
    /// let mut impulse_joints = ImpulseJointSet::new();
    /// let mut multibody_joints = MultibodyJointSet::new();
    /// let mut soft_bodies = SoftBodySet::new();
    /// let mut ccd_solver = CCDSolver::new();
    /// for _ in 0..120 {
    ///     pipeline.step_sets(
    ///         Vector::new(0.0, -9.81),
    ///         &IntegrationParameters::default(),
    ///         &mut islands,
    ///         &mut broad_phase,
    ///         &mut narrow_phase,
    ///         &mut bodies,
    ///         &mut colliders,
    ///         &mut impulse_joints,
    ///         &mut multibody_joints,
    ///         &mut soft_bodies,
    ///         &mut ccd_solver,
    ///         &(),
    ///         &(),
    ///     )?;
    /// }
    /// assert!((bodies[ball].translation().y - 0.6).abs() < 1e-6);
    /// # Ok::<(), moreau2d::dynamics::StepError>(())
    /// ```
    ///
    /// # With bevy_rapier
    /// bevy_rapier2d 0.37 keeps the sets of rapier2d 0.36 in public fields of its components. With
    /// `TimestepMode::Variable { time_scale: 0.0, .. }` it takes no step of its own, and writes back all the
    /// same; a system in `PhysicsSet::StepSimulation` takes the step in its place. Its messages of
    /// collisions are then not sent: pass an event handler of your own.
    ///
    /// ```ignore
    /// fn step(
    ///     mut moreau: ResMut<Moreau>, // struct Moreau(MoreauPipeline), a resource
    ///     mut contexts: Query<(
    ///         &mut RapierContextSimulation,
    ///         &mut RapierContextColliders,
    ///         &mut RapierContextJoints,
    ///         &mut RapierRigidBodySet,
    ///         &RapierConfiguration,
    ///     )>,
    /// ) -> Result {
    ///     for (mut s, mut colliders, mut joints, mut bodies, configuration) in &mut contexts {
    ///         let (s, joints, bodies) = (&mut *s, &mut *joints, &mut *bodies);
    ///         let parameters = IntegrationParameters { dt: 1.0 / 60.0, ..s.integration_parameters };
    ///         moreau.0.step_sets(
    ///             configuration.gravity,
    ///             &parameters,
    ///             &mut s.islands,
    ///             &mut s.broad_phase,
    ///             &mut s.narrow_phase,
    ///             &mut bodies.bodies,
    ///             &mut colliders.colliders,
    ///             &mut joints.impulse_joints,
    ///             &mut joints.multibody_joints,
    ///             &mut bodies.soft_bodies,
    ///             &mut s.ccd_solver,
    ///             &(),
    ///             &(),
    ///         )?;
    ///     }
    ///     Ok(())
    /// }
    /// ```
    /// This block is not compiled with the crate, as bevy 0.20 asks for a newer Rust than the crate does. What
    /// is tested is a small engine that keeps its sets in the same way (`tests/plugin/borrowed.rs`).
    // the arguments of rapier's own step, in its order
    #[allow(clippy::too_many_arguments)]
    pub fn step_sets(
        &mut self,
        gravity: Vector,
        parameters: &IntegrationParameters,
        islands: &mut IslandManager,
        broad_phase: &mut BroadPhaseBvh,
        narrow_phase: &mut NarrowPhase,
        bodies: &mut RigidBodySet,
        colliders: &mut ColliderSet,
        impulse_joints: &mut ImpulseJointSet,
        multibody_joints: &mut MultibodyJointSet,
        soft_bodies: &mut SoftBodySet,
        ccd_solver: &mut CCDSolver,
        hooks: &dyn PhysicsHooks,
        events: &dyn EventHandler,
    ) -> Result<StepRecord, StepError> {
        let mut world = self.lent.take().unwrap_or_default();
        world.gravity = gravity;
        world.integration_parameters = *parameters;
        let mut exchange = |world: &mut PhysicsWorld| {
            swap(&mut world.islands, islands);
            swap(&mut world.broad_phase, broad_phase);
            swap(&mut world.narrow_phase, narrow_phase);
            swap(&mut world.bodies, bodies);
            swap(&mut world.colliders, colliders);
            swap(&mut world.impulse_joints, impulse_joints);
            swap(&mut world.multibody_joints, multibody_joints);
            swap(&mut world.soft_bodies, soft_bodies);
            swap(&mut world.ccd_solver, ccd_solver);
        };
        exchange(&mut world);
        let result = self.step_with_events(&mut world, hooks, events);
        exchange(&mut world);
        self.lent = Some(world);
        result
    }
}
