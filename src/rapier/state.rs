//! Everything of a pipeline that the next step depends on, to be saved and resumed.

use super::bodies::ExactBody;
use super::body_checks::not_there;
use super::changes::ColliderWatch;
use super::detection::SurfaceLaw;
use super::engine::prelude::*;
use super::joints::Joints;
use super::pipeline::{MoreauPipeline, MoreauSettings};
use super::sleeping::Sleepers;
use super::{PRECISION, widen};
use crate::contact::Vec3;
use crate::dynamics::{Configuration, ModelError, Pose64, StepError, StepperState};
use crate::solver::{SolverTable, solver_by_name};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Format version of [`PipelineState`].
const VERSION: u32 = 8;

/// A pipeline between two steps, as plain data for serde.
///
/// [`MoreauPipeline::resume`] continues bit for bit from a state and the world that was saved at
/// the same time. Saving the world is up to the user: rapier's own types are serialisable with this
/// crate's feature `serde-serialize`, or can be cloned.
///
/// ```
/// use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
/// use rapier2d::prelude::*;
///
/// let mut world = PhysicsWorld::new();
/// world.insert(RigidBodyBuilder::dynamic(), ColliderBuilder::ball(0.5));
/// let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
/// pipeline.step(&mut world)?;
/// let saved = serde_json::to_string(&pipeline.state())?;
/// let mut resumed = MoreauPipeline::resume(&serde_json::from_str(&saved)?, &mut world)?;
/// assert_eq!(resumed.time(), pipeline.time());
/// resumed.step(&mut world)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Serialize, Deserialize)]
pub struct PipelineState {
    version: u32,
    precision: String,
    settings: MoreauSettings,
    stepper: StepperState,
    bodies: Vec<BodyState>,
    exact: Vec<(Handle, ExactBody)>,
    surfaces: Vec<(Handle, SurfaceLaw)>,
    sleepers: Sleepers,
    /// Pairs of colliders whose events have begun: touching, above the force threshold,
    /// intersecting.
    #[serde(rename = "told")]
    reported: [Vec<[Handle; 2]>; 3],
    /// Values that the user's hook stored on pairs of parts of colliders.
    #[serde(default)]
    marks: Vec<([u32; 4], u32)>,
    /// Sides on which pairs of parts touch two-sided segments.
    #[serde(default)]
    faces: Vec<([u32; 4], u32)>,
    /// Those of the bodies that the world no longer had.
    #[serde(default)]
    removed: Vec<Handle>,
}

impl PipelineState {
    /// This state with the settings of `pipeline` in place of its own: to go on from one state with several
    /// settings.
    pub fn with_settings_of(self, pipeline: &MoreauPipeline) -> Self {
        PipelineState {
            settings: pipeline.settings.clone(),
            ..self
        }
    }
}

/// Index and generation.
type Handle = (u32, u32);

/// The handle of a collider as index and generation, whether or not rapier's types are serialisable.
pub(crate) mod raw_handle {
    use super::ColliderHandle;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(handle: &ColliderHandle, to: S) -> Result<S::Ok, S::Error> {
        handle.into_raw_parts().serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<ColliderHandle, D::Error> {
        let (index, generation) = super::Handle::deserialize(from)?;
        Ok(ColliderHandle::from_raw_parts(index, generation))
    }
}

#[derive(Clone, Serialize, Deserialize)]
struct BodyState {
    handle: Handle,
    pose: Configuration,
    velocity: [f64; 3],
    /// Pose last written to rapier: x, y, cos, sin; then the velocity.
    written_pose: [f64; 4],
    written_velocity: [f64; 3],
    group: u32,
    last: Configuration,
    /// Pose and velocity that are shown, where they are others.
    #[serde(default)]
    shown: Option<(Configuration, [f64; 3])>,
}

/// Why a state cannot be resumed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StateError {
    /// Saved by another version of this crate.
    #[error("the state has version {found}, this crate reads version {expected}")]
    Version { found: u32, expected: u32 },
    /// Saved with the other precision of rapier.
    #[error("the state was saved with rapier in {found}, this is {expected}")]
    Precision {
        found: String,
        expected: &'static str,
    },
    /// The world is not the one that was saved with the state.
    #[error(transparent)]
    World(#[from] ModelError),
    #[error(transparent)]
    Settings(#[from] StepError),
}

/// Whether an enabled body has this handle.
fn is_in(world: &PhysicsWorld, (index, generation): Handle) -> bool {
    let handle = RigidBodyHandle::from_raw_parts(index, generation);
    world
        .bodies
        .get(handle)
        .is_some_and(|body| body.is_enabled())
}

/// Colliders, joints and surface laws when a state was resumed: islands at rest go on resting only
/// if the user changes none of them before the first step.
pub(super) struct Resumed {
    colliders: ColliderWatch,
    joints: Joints,
    laws: Option<u64>,
}

impl Resumed {
    fn of(world: &PhysicsWorld, pipeline: &MoreauPipeline) -> Result<Resumed, ModelError> {
        let mut found = Resumed {
            colliders: ColliderWatch::default(),
            joints: Joints::default(),
            laws: pipeline.detector.revision(),
        };
        found.colliders.scan(&world.colliders)?;
        found.joints.refresh(world, &pipeline.bodies)?;
        Ok(found)
    }

    /// Whether anything has changed since.
    pub fn differs(mut self, world: &PhysicsWorld, pipeline: &MoreauPipeline) -> bool {
        let counts = [self.colliders.revision, self.joints.revision];
        let scanned = self.colliders.scan(&world.colliders);
        let read = self.joints.refresh(world, &pipeline.bodies);
        scanned.is_err()
            || read.is_err()
            || counts != [self.colliders.revision, self.joints.revision]
            || self.laws != pipeline.detector.revision()
    }
}

impl MoreauPipeline {
    /// Everything that the next step depends on, besides the world. See [`MoreauPipeline::state_in`] if
    /// bodies may have been removed since the last step.
    pub fn state(&self) -> PipelineState {
        let raw = |h: RigidBodyHandle| h.into_raw_parts();
        let bodies = self.bodies.list.iter().zip(&self.bodies.velocities);
        let mut exact: Vec<(Handle, ExactBody)> =
            self.bodies.exact().map(|(h, e)| (raw(h), e)).collect();
        exact.sort_by_key(|(handle, _)| *handle);
        let surfaces = self.detector.surfaces();
        let mut surfaces: Vec<(Handle, SurfaceLaw)> =
            surfaces.map(|(h, law)| (h.into_raw_parts(), law)).collect();
        surfaces.sort_by_key(|(handle, _)| *handle);
        PipelineState {
            version: VERSION,
            precision: PRECISION.to_owned(),
            settings: self.settings.clone(),
            stepper: self.stepper.state(),
            bodies: bodies
                .map(|(shadow, u)| {
                    let (pose, velocity) = shadow.written();
                    let (at, turn) = (pose.translation, pose.rotation);
                    BodyState {
                        handle: raw(shadow.handle),
                        pose: shadow.pose.numbers(),
                        velocity: [u.x, u.y, u.z],
                        written_pose: [at.x, at.y, turn.re, turn.im].map(f64::from),
                        written_velocity: [velocity.0.x, velocity.0.y, velocity.1].map(f64::from),
                        group: shadow.group,
                        last: shadow.last.numbers(),
                        shown: (shadow.shown).map(|(pose, u)| (pose.numbers(), [u.x, u.y, u.z])),
                    }
                })
                .collect(),
            exact,
            surfaces,
            sleepers: self.bodies.sleepers.clone(),
            reported: self.reporter.state().map(|pairs| {
                let raw = |pair: [ColliderHandle; 2]| pair.map(|h| h.into_raw_parts());
                pairs.into_iter().map(raw).collect()
            }),
            marks: self.detector.marks(),
            faces: self.detector.faces(),
            removed: Vec::new(),
        }
    }

    /// As [`MoreauPipeline::state`], and which bodies have been removed from `world`, or disabled, since the
    /// last step: a resumed pipeline does not miss them.
    pub fn state_in(&self, world: &PhysicsWorld) -> PipelineState {
        let mut state = self.state();
        let handles = state.bodies.iter().map(|body| body.handle);
        state.removed = handles.filter(|handle| !is_in(world, *handle)).collect();
        state
    }

    /// A pipeline that continues from `state`, with the world as it was at that time.
    ///
    /// # Errors
    /// [`StateError`]; the world is then unchanged.
    pub fn resume(state: &PipelineState, world: &mut PhysicsWorld) -> Result<Self, StateError> {
        MoreauPipeline::resume_with_solvers(state, world, solver_by_name)
    }

    /// Like [`MoreauPipeline::resume`], with the solver that `table` has under the name in the
    /// saved settings.
    ///
    /// # Errors
    /// Those of [`MoreauPipeline::resume`].
    pub fn resume_with_solvers(
        state: &PipelineState,
        world: &mut PhysicsWorld,
        table: SolverTable,
    ) -> Result<Self, StateError> {
        if state.version != VERSION {
            return Err(StateError::Version {
                found: state.version,
                expected: VERSION,
            });
        }
        if state.precision != PRECISION {
            return Err(StateError::Precision {
                found: state.precision.clone(),
                expected: PRECISION,
            });
        }
        let mut pipeline = MoreauPipeline::with_solvers(state.settings.clone(), table)?;
        pipeline.stepper.restore(&state.stepper);
        for ((index, generation), law) in &state.surfaces {
            let handle = ColliderHandle::from_raw_parts(*index, *generation);
            pipeline.detector.set_surface(handle, *law);
        }
        pipeline
            .reporter
            .restore(state.reported.clone().map(|pairs| {
                let handles =
                    |pair: [Handle; 2]| pair.map(|(i, g)| ColliderHandle::from_raw_parts(i, g));
                pairs.into_iter().map(handles).collect()
            }));
        pipeline.detector.restore_marks(&state.marks);
        pipeline.detector.restore_faces(&state.faces);
        let bodies = &mut pipeline.bodies;
        for (handle, exact) in &state.exact {
            bodies.restore_exact(RigidBodyHandle::from_raw_parts(handle.0, handle.1), *exact);
        }
        bodies.watch.scan(&world.colliders)?;
        for saved in &state.bodies {
            let handle = RigidBodyHandle::from_raw_parts(saved.handle.0, saved.handle.1);
            if !is_in(world, saved.handle) && !state.removed.contains(&saved.handle) {
                return Err(not_there(handle).into());
            }
            let [x, y, re, im] = saved.written_pose.map(|v| v as Real);
            let [vx, vy, spin] = saved.written_velocity.map(|v| v as Real);
            let pose =
                Pose::from_parts(Vector::new(x, y), Rotation::from_cos_sin_unchecked(re, im));
            bodies.restore(
                handle,
                Pose64::from_numbers(&saved.pose),
                Pose64::from_numbers(&saved.last),
                Vec3::from(saved.velocity),
                (pose, (Vector::new(vx, vy), spin)),
            );
            let shown = saved.shown.as_ref();
            if let Some(own) = bodies.list.last_mut() {
                own.shown = shown.map(|(pose, u)| (Pose64::from_numbers(pose), Vec3::from(*u)));
            }
        }
        let dt = widen(world.integration_parameters.dt);
        for (k, saved) in state.bodies.iter().enumerate() {
            if is_in(world, saved.handle) {
                bodies.sync_one(world, k, dt)?;
            }
            bodies.velocities[k] = Vec3::from(saved.velocity);
            bodies.list[k].group = saved.group;
        }
        bodies.sleepers = state.sleepers.clone();
        pipeline.resumed = Some(Resumed::of(world, &pipeline)?);
        Ok(pipeline)
    }
}
