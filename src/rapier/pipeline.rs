use super::bodies::{Bodies, ExactBody};
use super::body_checks::body_id;
use super::detection::{DetectionDrive, Detector, Hooks, SurfaceLaw};
use super::engine::prelude::*;
use super::joints::Joints;
use super::model::RapierModel;
use super::reporter::Reporter;
use super::state::Resumed;
use super::widen::{widen, widen_step};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::record::StepRecord;
use crate::dynamics::{
    Clock, Detection, ModelError, MoreauStepper, Phases, Pose64, Scheme, SolvedProblem, StepError,
    StepperSettings,
};
use crate::solver::{ImpulseSolver, SolverTable, solver_by_name};
use serde::{Deserialize, Serialize};

/// Settings of a [`MoreauPipeline`].
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct MoreauSettings {
    pub stepper: StepperSettings,
    /// Gravity in `f64` \[m/s²\]; `None` takes the world's own.
    #[serde(with = "crate::dynamics::saved::some_pair")]
    pub gravity: Option<Vec2>,
    /// Step length in `f64` \[s\]; `None` takes the world's own.
    pub dt: Option<f64>,
    /// How detection finds the pairs of colliders that are near each other.
    pub detection: DetectionDrive,
    /// Disables sleeping: every body is stepped, whatever its activation settings say.
    pub stay_awake: bool,
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
/// # What it supports
/// Dynamic, fixed and kinematic bodies, forces, gravity scale, damping, locked axes, dominance,
/// every collider of parry, collision groups, and every impulse joint with its limits, motors,
/// coupled axes and softness. The pipeline refuses anything else by name: multibody joints and soft
/// bodies, for example. [`StepRecord::joints`] holds the impulses of the joints. rapier lets nobody
/// write `linvel()` of a position-based kinematic body; [`MoreauPipeline::velocity`] returns its
/// velocity.
///
/// # Fast bodies
/// The pipeline computes the time of impact of contacts that a body with `ccd_enabled` closes by
/// more than half its thickness in a step; the other body may have the flag as well. For a fast
/// body without the flag it does so against bodies that nothing moves, where rapier sweeps as well; in a heap of more
/// than 32 bodies only where it rebounds, or would be deep in them by the middle of the step. Such heaps are stepped in
/// four parts where that is fine enough.
/// Every pair has soft prediction anyway. Speeds are not limited. A thin bar that turns by more
/// than some 10 degrees a step can still pass through.
///
/// # Sleeping
/// Islands fall asleep by rapier's own activation settings, unless [`MoreauSettings::stay_awake`]
/// is set. A sleeping island does not move by a single bit, costs next to nothing and is in no
/// record. The pipeline stores its contact impulses and warm starts with them when the island
/// wakes. An island wakes when a body presses on it, when a kinematic body that touches it moves,
/// on `wake_up`, and on any change of its bodies, colliders and joints or of the colliders that it
/// touches. Bodies that the user puts to sleep within one step wake together. An island may fall
/// asleep with speeds below rapier's thresholds; the kinetic energy of that motion is lost.
///
/// # Rest
/// An island that is at rest but awake keeps its impulses until something about it changes. It is in
/// every record ([`StepRecord::resting`] counts it) and costs next to nothing.
/// [`StepperSettings::keep_rest`] switches this off. As long as any collider has hooks, every island is
/// solved in every step.
///
/// # Memory
/// rapier keeps a note of every removed collider for its own next step. From time to time the
/// pipeline takes these colliders out of rapier's query tree and contact graph, and drops the
/// notes. A joint that is added and removed leaves some 150 bytes in notes that only `world.step()`
/// or [`MoreauPipeline::refresh_queries`] empties.
///
/// # Precision
/// The pipeline stores poses, velocities and masses in `f64` and writes them to rapier rounded.
/// When rapier's pose or velocity differs from the value last written, the user has set it, and the
/// pipeline reads it back.
pub struct MoreauPipeline {
    pub(super) stepper: MoreauStepper,
    pub(super) settings: MoreauSettings,
    pub(super) bodies: Bodies,
    pub(super) detector: Detector,
    joints: Joints,
    pub(super) reporter: Reporter,
    /// What a resumed state rests on, until the first step.
    pub(super) resumed: Option<Resumed>,
    /// The world to which [`MoreauPipeline::step_sets`] lends its sets for the time of a step.
    pub(super) lent: Option<Box<PhysicsWorld>>,
}

impl MoreauPipeline {
    /// A pipeline that has stepped nothing yet.
    ///
    /// # Errors
    /// Those of [`MoreauStepper::new`]; [`StepError::Dt`] for a bad step length.
    pub fn new(settings: MoreauSettings) -> Result<Self, StepError> {
        MoreauPipeline::with_solvers(settings, solver_by_name)
    }

    /// Like [`MoreauPipeline::new`], with solvers of your own, see [`MoreauStepper::with_solvers`].
    ///
    /// # Errors
    /// Those of [`MoreauPipeline::new`].
    pub fn with_solvers(settings: MoreauSettings, table: SolverTable) -> Result<Self, StepError> {
        if let Some(dt) = settings.dt
            && !(dt > 0.0 && dt.is_finite())
        {
            return Err(StepError::Dt(dt));
        }
        let stepper = MoreauStepper::with_solvers(settings.stepper.clone(), table)?;
        Ok(MoreauPipeline {
            detector: Detector::new(settings.detection, stepper.threads()),
            stepper,
            settings,
            bodies: Bodies::default(),
            joints: Joints::default(),
            reporter: Reporter::default(),
            resumed: None,
            lent: None,
        })
    }

    /// One step.
    ///
    /// # Errors
    /// [`StepError`]; the world is then as it was before the step.
    pub fn step(&mut self, world: &mut PhysicsWorld) -> Result<StepRecord, StepError> {
        let dt = self.step_length(world);
        self.step_by(world, dt)
    }

    fn step_length(&self, world: &PhysicsWorld) -> f64 {
        let fixed = self.settings.dt;
        fixed.unwrap_or_else(|| widen_step(world.integration_parameters.dt))
    }

    fn model<'a>(
        &'a mut self,
        world: &'a mut PhysicsWorld,
        hooks: &'a dyn PhysicsHooks,
        dt: f64,
    ) -> RapierModel<'a> {
        RapierModel {
            gravity: gravity(&self.settings, world),
            world,
            hooks,
            sleeps: !self.settings.stay_awake,
            bodies: &mut self.bodies,
            detector: &mut self.detector,
            joints: &self.joints,
            dt,
        }
    }

    /// One step with the user's hooks and a handler of collision and contact-force events.
    ///
    /// # Errors
    /// As [`MoreauPipeline::step`].
    pub fn step_with_events(
        &mut self,
        world: &mut PhysicsWorld,
        hooks: &dyn PhysicsHooks,
        events: &dyn EventHandler,
    ) -> Result<StepRecord, StepError> {
        let dt = self.step_length(world);
        self.run(world, dt, hooks, events)
    }

    /// Reads what the user changed in the world.
    fn sync(&mut self, world: &mut PhysicsWorld, dt: f64) -> Result<(), ModelError> {
        refuse_world(world, gravity(&self.settings, world))?;
        let mut woken = Vec::new();
        let stay_awake = self.settings.stay_awake;
        let synced = self.bodies.sync(world, dt, stay_awake, &mut woken);
        self.stepper.take_back(&woken);
        if let Some(before) = self.bodies.renumbered.take() {
            self.stepper.renumber(&before);
        }
        for (handle, _) in &self.bodies.watch.gone {
            self.detector.forget_surface(*handle);
        }
        synced?;
        self.joints.refresh(world, &self.bodies)?;
        if let Some(resumed) = self.resumed.take()
            && resumed.differs(world, self)
        {
            self.stepper.end_rest();
        }
        if self.stepper.settings().scheme == Scheme::Moreau
            && let Some(k) = self.bodies.roles.sweeps.iter().position(|s| s.all)
        {
            return Err(ModelError::Unsupported(format!(
                "body {k} (handle {:?}): continuous collision detection needs the scheme \
                 'staggered', 'moreau' ignores gaps",
                body_id(self.bodies.list[k].handle)
            )));
        }
        Ok(())
    }

    /// One step of length `dt` \[s\], whatever the settings say.
    ///
    /// # Errors
    /// As [`MoreauPipeline::step`].
    pub fn step_by(&mut self, world: &mut PhysicsWorld, dt: f64) -> Result<StepRecord, StepError> {
        self.run(world, dt, &(), &())
    }

    fn run(
        &mut self,
        world: &mut PhysicsWorld,
        dt: f64,
        hooks: &dyn PhysicsHooks,
        events: &dyn EventHandler,
    ) -> Result<StepRecord, StepError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(StepError::Dt(dt));
        }
        loop {
            self.stepper.clock().start();
            self.sync(world, dt)?;
            self.stepper.clock().lap(|t| &mut t.detection);
            let mut model = RapierModel {
                gravity: gravity(&self.settings, world),
                world,
                hooks,
                sleeps: !self.settings.stay_awake,
                bodies: &mut self.bodies,
                detector: &mut self.detector,
                joints: &self.joints,
                dt,
            };
            let mut begun = match self.stepper.begin(&mut model, dt) {
                Ok(begun) => begun,
                Err(error) => {
                    self.bodies.undo_step(world);
                    return Err(error);
                }
            };
            // a sleeping body that is pressed on wakes before the solve: cancel, wake it and begin
            // again
            let resting = self.stepper.resting_contacts();
            if model.wakes_sleepers(self.stepper.detection(), resting) {
                self.stepper.cancel(&mut model);
                self.bodies.undo_step(world);
                continue;
            }
            if let Err(error) = self.stepper.finish(&mut model, &mut begun) {
                self.bodies.undo_step(world);
                return Err(error);
            }
            let record = begun.record;
            let hooks = Hooks { hooks, world };
            let crossing = self.detector.intersections(hooks, &self.bodies);
            let (bodies, detector) = (&self.bodies, &self.detector);
            self.reporter
                .report(world, bodies, detector, crossing, &record, events);
            self.put_to_sleep(world, dt);
            self.stepper.clock().lap(|t| &mut t.record);
            return Ok(record);
        }
    }

    fn put_to_sleep(&mut self, world: &mut PhysicsWorld, dt: f64) {
        if self.settings.stay_awake {
            return;
        }
        let group = self.bodies.ready(world, self.stepper.parted(), dt);
        if group.iter().any(|g| *g != 0) {
            let memory = self.stepper.set_aside(|body| group[body as usize]);
            self.bodies.fall_asleep(world, &group, memory);
        }
    }

    /// Contacts and joint rows at the present poses, without a step: all contacts that may close
    /// within one step. Empties `out` first. Reuse `out` from call to call, it is large.
    ///
    /// # Errors
    /// [`StepError::Model`] if the pipeline cannot read the world.
    pub fn find_contacts(
        &mut self,
        world: &mut PhysicsWorld,
        out: &mut Detection,
    ) -> Result<(), StepError> {
        let dt = self.step_length(world);
        self.bodies.resting.clear();
        loop {
            self.sync(world, dt)?;
            let mut model = self.model(world, &(), dt);
            out.contacts.clear();
            out.joints.clear();
            model.find(dt, None, out)?;
            // sleeping bodies that are pressed on wake and then have contacts
            if !model.wakes_sleepers(out, std::iter::empty()) {
                return Ok(());
            }
        }
    }

    /// Time at the end of the last step \[s\].
    pub fn time(&self) -> f64 {
        self.stepper.time()
    }

    /// See [`MoreauStepper::set_solver`], and [`crate::guide::own_solver`].
    pub fn set_solver(&mut self, solver: Box<dyn ImpulseSolver>) {
        self.stepper.set_solver(solver);
    }

    /// See [`MoreauStepper::set_threads`].
    ///
    /// # Errors
    /// [`StepError::Threads`], [`StepError::Spawn`]; nothing is changed then.
    pub fn set_threads(&mut self, threads: usize) -> Result<(), StepError> {
        self.stepper.set_threads(threads)?;
        self.detector.set_threads(self.stepper.threads());
        self.settings.stepper.threads = threads;
        Ok(())
    }

    /// See [`MoreauStepper::keep_problems`].
    pub fn keep_problems(&mut self, keep: bool) {
        self.stepper.keep_problems(keep);
    }

    /// See [`MoreauStepper::problems`].
    pub fn problems(&self) -> &[SolvedProblem] {
        self.stepper.problems()
    }

    /// See [`MoreauStepper::time_phases`].
    pub fn time_phases(&mut self, clock: Option<Clock>) {
        self.stepper.time_phases(clock);
    }

    /// See [`MoreauStepper::phases`].
    pub fn phases(&self) -> Phases {
        self.stepper.phases()
    }

    /// Sets the properties of a collider's surface that rapier cannot store: compliance, belt
    /// speed, cells.
    pub fn set_surface(&mut self, collider: ColliderHandle, law: SurfaceLaw) {
        self.detector.set_surface(collider, law);
    }

    /// All surface laws set with [`MoreauPipeline::set_surface`].
    pub fn surfaces(&self) -> impl Iterator<Item = (ColliderHandle, SurfaceLaw)> + '_ {
        self.detector.surfaces()
    }

    /// Pairs of colliders that overlapped at the end of the last step, one of them a sensor.
    pub fn intersections(&self) -> impl Iterator<Item = [ColliderHandle; 2]> + '_ {
        self.reporter.intersections()
    }

    /// Drops the surface law of a collider that was removed.
    pub fn forget_surface(&mut self, collider: ColliderHandle) {
        self.detector.forget_surface(collider);
    }

    /// Sets the mass and inertia of a body in `f64`.
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
    /// [`ModelError::Invalid`] if the body is not in the world, or a number is not finite.
    pub fn place(
        &mut self,
        world: &mut PhysicsWorld,
        body: RigidBodyHandle,
        pose: Pose64,
        velocity: Vec3,
    ) -> Result<(), ModelError> {
        self.bodies.place(world, body, pose, velocity)
    }

    /// `f64` pose of a body's frame, as rapier has it rounded. Of a body with joints it is the one with
    /// these closed, as far as turning opened them: the next step goes on from one that differs by some
    /// `r (ω Δt)²/8`.
    pub fn pose(&self, body: RigidBodyHandle) -> Option<Pose64> {
        let k = self.bodies.index_of(body)?;
        Some(self.bodies.list[k as usize].shown_pose())
    }

    /// `f64` velocity of a body: (v_x, v_y) of its centre of mass \[m/s\] and spin \[rad/s\].
    /// With [`MoreauPipeline::pose`] it has the momenta of the state.
    pub fn velocity(&self, body: RigidBodyHandle) -> Option<Vec3> {
        let k = self.bodies.index_of(body)?;
        let own = self.bodies.velocities[k as usize];
        Some(self.bodies.list[k as usize].shown_velocity(own))
    }

    /// The body with this number in the records of the last step.
    pub fn body(&self, number: u32) -> Option<RigidBodyHandle> {
        Some(self.bodies.list.get(number as usize)?.handle)
    }

    /// The collider with this number in the records of the last step.
    pub fn collider(&self, number: u32) -> Option<ColliderHandle> {
        self.bodies.watch.handle(number)
    }

    /// The number of a body in the records, once the pipeline has stepped it.
    pub fn number(&self, body: RigidBodyHandle) -> Option<u32> {
        self.bodies.index_of(body)
    }
}

fn gravity(settings: &MoreauSettings, world: &PhysicsWorld) -> Vec2 {
    let own = || Vec2::new(widen(world.gravity.x), widen(world.gravity.y));
    settings.gravity.unwrap_or_else(own)
}

/// Refuses what cannot be stepped, whatever the bodies are.
fn refuse_world(world: &PhysicsWorld, gravity: Vec2) -> Result<(), ModelError> {
    if world.soft_bodies.iter().next().is_some() {
        return Err(ModelError::Unsupported(
            "soft bodies are not supported".to_owned(),
        ));
    }
    if !(gravity.x + gravity.y).is_finite() {
        return Err(ModelError::Invalid(format!(
            "gravity is ({}, {}) m/s2, must be finite",
            gravity.x, gravity.y
        )));
    }
    Ok(())
}
