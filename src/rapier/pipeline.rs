use super::bodies::{Bodies, ExactBody, body_id};
use super::detection::{Detector, SurfaceLaw};
use super::dispatcher::FreshManifolds;
use super::engine::prelude::*;
use super::joints::joint_rows;
use super::widen;
use crate::contact::{Vec2, Vec3};
use crate::dynamics::record::StepRecord;
use crate::dynamics::{
    Configuration, Detection, ModelError, MoreauStepper, MultibodyModel, Pose64, SolvedProblem,
    StepError, StepperSettings,
};

/// Settings of a [`MoreauPipeline`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MoreauSettings {
    pub stepper: StepperSettings,
    /// Gravity in `f64` \[m/s²\]; the world's own where `None`.
    pub gravity: Option<Vec2>,
    /// Step length in `f64` \[s\]; the world's own where `None`.
    pub dt: Option<f64>,
}

/// Steps a [`PhysicsWorld`] nonsmoothly, in place of `world.step()`.
///
/// ```
/// use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
/// use rapier2d::prelude::*;
///
/// let mut world = PhysicsWorld::new();
/// world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(10.0, 0.5));
/// let (ball, _) = world.insert(
///     RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 3.0)),
///     ColliderBuilder::ball(0.5),
/// );
/// let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
/// for _ in 0..120 {
///     let record = pipeline.step(&mut world)?; // in place of world.step()
///     assert_eq!(record.unsolved, 0);
/// }
/// assert!((world.bodies[ball].translation().y - 1.0).abs() < 1e-6);
/// # Ok::<(), moreau2d::dynamics::StepError>(())
/// ```
///
/// # What it takes
/// Dynamic, fixed and kinematic bodies, forces, gravity scale, damping, locked axes, any collider
/// parry has, groups, every impulse joint with its limits, motors, coupled axes and softness. Anything
/// else is refused by name: multibody joints and soft bodies, for example. What joints carry is in
/// [`StepRecord::joints`].
/// Sleeping is ignored: every body is stepped.
///
/// # Precision
/// Poses, velocities and masses are kept in `f64` and written to rapier rounded; a pose or
/// velocity that differs from what was written was set by the user, and is read back.
pub struct MoreauPipeline {
    stepper: MoreauStepper,
    settings: MoreauSettings,
    bodies: Bodies,
    detector: Detector,
    dispatcher_set: bool,
}

impl MoreauPipeline {
    /// A pipeline with no memory.
    ///
    /// # Errors
    /// Those of [`MoreauStepper::new`]; [`StepError::Dt`] for a bad step length.
    pub fn new(settings: MoreauSettings) -> Result<Self, StepError> {
        if let Some(dt) = settings.dt
            && !(dt > 0.0 && dt.is_finite())
        {
            return Err(StepError::Dt(dt));
        }
        Ok(MoreauPipeline {
            stepper: MoreauStepper::new(settings.stepper.clone())?,
            settings,
            bodies: Bodies::default(),
            detector: Detector::default(),
            dispatcher_set: false,
        })
    }

    /// One step.
    ///
    /// # Errors
    /// [`StepError`]; the world then stands as it did before the step.
    pub fn step(&mut self, world: &mut PhysicsWorld) -> Result<StepRecord, StepError> {
        let dt = self
            .settings
            .dt
            .unwrap_or_else(|| widen(world.integration_parameters.dt));
        self.step_by(world, dt)
    }

    /// One step of length `dt` \[s\], whatever the settings say.
    ///
    /// # Errors
    /// As [`MoreauPipeline::step`].
    pub fn step_by(&mut self, world: &mut PhysicsWorld, dt: f64) -> Result<StepRecord, StepError> {
        if !self.dispatcher_set {
            world.narrow_phase.set_query_dispatcher(FreshManifolds);
            self.dispatcher_set = true;
        }
        let gravity = self
            .settings
            .gravity
            .unwrap_or_else(|| Vec2::new(widen(world.gravity.x), widen(world.gravity.y)));
        let mut model = RapierModel {
            world,
            bodies: &mut self.bodies,
            detector: &mut self.detector,
            gravity,
            dt,
        };
        let result = self.stepper.step(&mut model, dt);
        if result.is_err() {
            self.bodies.give_back(world);
        }
        result
    }

    /// Time at the end of the last step \[s\].
    pub fn time(&self) -> f64 {
        self.stepper.time()
    }

    /// See [`MoreauStepper::keep_problems`].
    pub fn keep_problems(&mut self, keep: bool) {
        self.stepper.keep_problems(keep);
    }

    /// See [`MoreauStepper::problems`].
    pub fn problems(&self) -> &[SolvedProblem] {
        self.stepper.problems()
    }

    /// Gives a collider what rapier cannot store: compliance, belt speed, cells.
    pub fn set_surface(&mut self, collider: ColliderHandle, law: SurfaceLaw) {
        self.detector.surfaces.insert(collider, law);
    }

    /// Forgets a collider that was removed.
    pub(super) fn forget_surface(&mut self, collider: ColliderHandle) {
        self.detector.surfaces.remove(&collider);
    }

    /// Gives a body mass and inertia in `f64`.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] unless both are finite and positive.
    pub fn set_exact_mass(
        &mut self,
        body: RigidBodyHandle,
        exact: ExactBody,
    ) -> Result<(), ModelError> {
        if !(exact.mass > 0.0
            && exact.mass.is_finite()
            && exact.inertia > 0.0
            && exact.inertia.is_finite())
        {
            return Err(ModelError::Invalid(format!(
                "body (handle {:?}): mass {} kg and inertia {} kg m2 must be finite and above 0",
                body_id(body),
                exact.mass,
                exact.inertia
            )));
        }
        self.bodies.set_exact(body, exact);
        Ok(())
    }

    /// Places a body in `f64`: pose of its frame, velocity of its centre of mass and spin.
    ///
    /// # Errors
    /// [`ModelError`] if the world cannot be taken over or does not hold the body.
    pub fn place(
        &mut self,
        world: &mut PhysicsWorld,
        body: RigidBodyHandle,
        pose: Pose64,
        velocity: Vec3,
    ) -> Result<(), ModelError> {
        self.bodies.sync(world, 1.0)?;
        if self.bodies.place(world, body, pose, velocity) {
            Ok(())
        } else {
            Err(ModelError::Invalid(format!(
                "body (handle {:?}) is not in the world",
                body_id(body)
            )))
        }
    }

    /// `f64` pose of a body's frame.
    pub fn pose(&self, body: RigidBodyHandle) -> Option<Pose64> {
        let k = self.bodies.index_of(body)?;
        Some(self.bodies.list[k as usize].pose)
    }

    /// `f64` velocity of a body: (v_x, v_y) of its centre of mass \[m/s\] and spin \[rad/s\].
    pub fn velocity(&self, body: RigidBodyHandle) -> Option<Vec3> {
        let k = self.bodies.index_of(body)?;
        Some(self.bodies.velocities[k as usize])
    }

    /// The number that records use for a body, if it has been stepped.
    pub fn number(&self, body: RigidBodyHandle) -> Option<u32> {
        self.bodies.index_of(body)
    }
}

/// A rapier world as a multibody model, for the time of one step.
struct RapierModel<'a> {
    world: &'a mut PhysicsWorld,
    bodies: &'a mut Bodies,
    detector: &'a mut Detector,
    gravity: Vec2,
    /// Of the whole step \[s\].
    dt: f64,
}

impl RapierModel<'_> {
    /// Largest acceleration \[m/s²\] of any body by gravity and the user's forces.
    fn acceleration(&self) -> f64 {
        (0..self.bodies.list.len())
            .filter(|&k| self.bodies.inverse_mass[k] != Vec3::zeros())
            .map(|k| {
                let body = &self.world.bodies[self.bodies.list[k].handle];
                let w = self.bodies.inverse_mass[k].xy().amax();
                let push = f64::from(body.user_force().length()) * w;
                self.gravity.norm() * f64::from(body.gravity_scale()).abs() + push
            })
            .fold(0.0, f64::max)
    }
}

impl MultibodyModel for RapierModel<'_> {
    fn begin_step(&mut self, dt: f64) -> Result<(), ModelError> {
        if self.world.soft_bodies.iter().next().is_some() {
            return Err(ModelError::Unsupported(
                "soft bodies are not supported".to_owned(),
            ));
        }
        self.bodies.sync(self.world, dt)
    }

    fn velocities(&self) -> &[Vec3] {
        &self.bodies.velocities
    }

    fn set_velocities(&mut self, velocities: &[Vec3]) {
        self.bodies.velocities.copy_from_slice(velocities);
    }

    fn inverse_mass(&self) -> &[Vec3] {
        &self.bodies.inverse_mass
    }

    /// Weight, the user's forces and torques, and damping `−d m v` as rapier defines `d` [1/s].
    fn forces(&self, _time: f64, out: &mut [Vec3]) {
        for (k, h) in out.iter_mut().enumerate() {
            let w = self.bodies.inverse_mass[k];
            if w == Vec3::zeros() {
                continue;
            }
            let body = &self.world.bodies[self.bodies.list[k].handle];
            let u = self.bodies.velocities[k];
            let (force, torque) = (body.user_force(), body.user_torque());
            let scale = widen(body.gravity_scale());
            let drag = widen(body.linear_damping());
            let push = Vec2::new(widen(force.x), widen(force.y));
            for i in 0..2 {
                if w[i] > 0.0 {
                    h[i] = (scale * self.gravity[i] - drag * u[i]) / w[i] + push[i];
                }
            }
            if w.z > 0.0 {
                h.z = widen(torque) - widen(body.angular_damping()) * u.z / w.z;
            }
        }
    }

    fn shift(&mut self, body: usize, velocity: &Vec3, dt: f64) {
        self.bodies.shift(body, velocity, dt);
    }

    fn configuration(&self, body: usize) -> Configuration {
        self.bodies.list[body].pose.numbers()
    }

    fn set_configuration(&mut self, body: usize, configuration: &Configuration) {
        self.bodies.list[body].pose = Pose64::from_numbers(configuration);
    }

    fn detect(&mut self, dt: f64, out: &mut Detection) -> Result<(), ModelError> {
        self.bodies.write(self.world, false);
        let acceleration = self.acceleration();
        self.detector
            .detect(self.world, self.bodies, acceleration, dt, out)?;
        joint_rows(self.world, self.bodies, self.dt, out)
    }

    fn detect_pairs(
        &mut self,
        pairs: &[[u32; 2]],
        dt: f64,
        out: &mut Detection,
    ) -> Result<(), ModelError> {
        self.detector
            .detect_pairs(self.world, self.bodies, pairs, dt, out);
        joint_rows(self.world, self.bodies, self.dt, out)
    }

    fn potential_energy(&self) -> f64 {
        self.bodies
            .list
            .iter()
            .zip(&self.bodies.inverse_mass)
            .map(|(shadow, w)| {
                let scale = widen(self.world.bodies[shadow.handle].gravity_scale());
                let center = shadow.pose.apply(shadow.center);
                (0..2)
                    .filter(|&i| w[i] > 0.0)
                    .map(|i| -scale * self.gravity[i] * center[i] / w[i])
                    .sum::<f64>()
            })
            .sum()
    }

    fn end_step(&mut self) {
        self.bodies.write(self.world, true);
        self.world
            .bodies
            .propagate_modified_body_positions_to_colliders(&mut self.world.colliders);
    }
}
