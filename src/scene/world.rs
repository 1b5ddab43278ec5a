//! The world of a scene, which can be stepped, on any of the three models.

use super::lasting::Deepest;
use super::overlap::{Measured, Overlaps};
use super::passing::Via;
use crate::checkpoint::{CheckpointError, Reader, Writer};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::record::StepRecord;
use crate::dynamics::{
    Clock, ModelError, MoreauStepper, MultibodyModel, Phases, Pose64, SolvedProblem, StepError,
};
use crate::models::{Linear, Planar};
use crate::peers::{BodyId, Box2d, Box2dSettings, Simulation, seconds};

/// A scene's world; bodies are counted in the scene's order, coordinates of a `[linear]` block
/// count as bodies.
pub struct Built {
    pub(super) world: World,
    /// Of the bodies of a rapier world, for errors.
    pub(super) names: Vec<String>,
    /// The rapier world and its bodies, if the scene is built on one.
    pub(super) overlaps: Option<Overlaps>,
    /// The same world in Box2D, from [`Built::set_box2d`] on.
    pub(super) box2d: Option<Box2d>,
}

pub(super) enum World {
    Rapier {
        simulation: Box<Simulation>,
        bodies: Vec<BodyId>,
    },
    Planar(HandWritten<Planar>),
    Linear(HandWritten<Linear>),
}

/// A model without rapier, and its stepper.
pub(super) struct HandWritten<M> {
    pub model: M,
    pub stepper: MoreauStepper,
    /// \[s\]
    pub dt: f64,
}

impl<M: MultibodyModel> HandWritten<M> {
    fn step(&mut self) -> Result<StepRecord, StepError> {
        self.stepper.step(&mut self.model, self.dt)
    }

    fn load(&mut self, from: &mut Reader) -> Result<(), CheckpointError> {
        self.stepper.restore(&from.take()?);
        Ok(())
    }
}

impl Built {
    /// Number of bodies.
    pub fn bodies(&self) -> usize {
        match &self.world {
            World::Rapier { bodies, .. } => bodies.len(),
            World::Planar(planar) => planar.model.velocities().len(),
            World::Linear(linear) => linear.model.coordinates(),
        }
    }

    /// One nonsmooth step of the scene's length.
    ///
    /// # Errors
    /// [`StepError`].
    pub fn step(&mut self) -> Result<StepRecord, StepError> {
        match &mut self.world {
            World::Rapier { simulation, .. } => simulation.step(),
            World::Planar(planar) => planar.step(),
            World::Linear(linear) => linear.step(),
        }
    }

    /// Saves all that the next nonsmooth step, and what is measured after it, depends on.
    ///
    /// # Errors
    /// [`CheckpointError::Write`].
    pub fn save(&self, to: &mut Writer) -> Result<(), CheckpointError> {
        match &self.world {
            World::Rapier { simulation, .. } => simulation.save(to)?,
            World::Planar(planar) => {
                to.put(&planar.stepper.state())?;
                to.put(&planar.model.state())?;
            }
            World::Linear(linear) => {
                to.put(&linear.stepper.state())?;
                to.put(&linear.model.state())?;
            }
        }
        to.put(&self.overlaps)
    }

    /// Goes on from what [`Built::save`] saved of the same scene, bit for bit.
    ///
    /// # Errors
    /// [`CheckpointError::Read`]: the world is then neither the one nor the other.
    pub fn load(&mut self, from: &mut Reader) -> Result<(), CheckpointError> {
        match &mut self.world {
            World::Rapier { simulation, .. } => simulation.load(from)?,
            World::Planar(planar) => {
                planar.load(from)?;
                let set = planar.model.set_state(from.take()?);
                set.map_err(CheckpointError::unfit)?;
            }
            World::Linear(linear) => {
                linear.load(from)?;
                linear.model.set_state(from.take()?);
            }
        }
        match (&mut self.overlaps, from.take()?) {
            (Some(overlaps), Some(saved)) => overlaps.resume(saved).map_err(CheckpointError::unfit),
            (None, None) => Ok(()),
            _ => Err(CheckpointError::unfit("it is of another model")),
        }
    }

    /// Whether to store the contact problems of every step for [`Built::problems`].
    pub fn keep_problems(&mut self, keep: bool) {
        match &mut self.world {
            World::Rapier { simulation, .. } => simulation.pipeline.keep_problems(keep),
            World::Planar(planar) => planar.stepper.keep_problems(keep),
            World::Linear(linear) => linear.stepper.keep_problems(keep),
        }
    }

    /// Whether to measure the time of nonsmooth steps for [`Built::phases`] from now on.
    pub fn time_phases(&mut self, on: bool) {
        let clock: Option<Clock> = on.then_some(seconds);
        match &mut self.world {
            World::Rapier { simulation, .. } => simulation.pipeline.time_phases(clock),
            World::Planar(planar) => planar.stepper.time_phases(clock),
            World::Linear(linear) => linear.stepper.time_phases(clock),
        }
    }

    /// Times of the phases of nonsmooth steps, see [`MoreauStepper::phases`].
    pub fn phases(&self) -> Phases {
        match &self.world {
            World::Rapier { simulation, .. } => simulation.pipeline.phases(),
            World::Planar(planar) => planar.stepper.phases(),
            World::Linear(linear) => linear.stepper.phases(),
        }
    }

    /// The contact problems of the last nonsmooth step, see [`MoreauStepper::problems`].
    pub fn problems(&self) -> &[SolvedProblem] {
        match &self.world {
            World::Rapier { simulation, .. } => simulation.pipeline.problems(),
            World::Planar(planar) => planar.stepper.problems(),
            World::Linear(linear) => linear.stepper.problems(),
        }
    }

    /// Pose and velocity of body `k`: of its frame, and of its centre of mass with the spin. A
    /// coordinate of a `[linear]` block is the x of both.
    pub fn state(&self, k: usize) -> Option<(Pose64, Vec3)> {
        match &self.world {
            World::Rapier { simulation, bodies } => {
                let body = *bodies.get(k)?;
                Some((simulation.pose(body)?, simulation.velocity(body)?))
            }
            World::Planar(planar) => Some((planar.model.pose(k)?, planar.model.velocity(k)?)),
            World::Linear(linear) => (k < linear.model.coordinates()).then(|| {
                let place = Vec2::new(linear.model.position()[k], 0.0);
                let velocity = Vec3::new(linear.model.velocity()[k], 0.0, 0.0);
                (Pose64::new(place, 0.0), velocity)
            }),
        }
    }

    /// The number of body `k` in contact records; `None` for the coordinates of a `[linear]` block.
    pub fn number(&self, k: usize) -> Option<u32> {
        match &self.world {
            World::Rapier { simulation, bodies } => simulation.number(*bodies.get(k)?),
            World::Planar(planar) => (k < planar.model.velocities().len()).then_some(k as u32),
            World::Linear(_) => None,
        }
    }

    /// Measures the bodies at the poses that `state` gives them after a step, from geometry alone:
    /// the worst overlap, and who passed through whom. `None` for other worlds than rapier's, whose
    /// records hold closed forms.
    ///
    /// An overlap that exists at the first call counts only as far as it has grown since. Pairs that
    /// a joint connects are left out.
    pub fn measure(
        &mut self,
        state: impl Fn(&Built, usize) -> Option<(Pose64, Vec3)>,
    ) -> Option<Measured> {
        self.measure_along(state, &Via::default())
    }

    fn measure_along(
        &mut self,
        state: impl Fn(&Built, usize) -> Option<(Pose64, Vec3)>,
        via: &Via,
    ) -> Option<Measured> {
        let mut overlaps = self.overlaps.take()?;
        let measured = overlaps.measure(|k| Some(state(self, k)?.0), via);
        self.overlaps = Some(overlaps);
        Some(measured)
    }

    /// The places of the scene's bodies inside a step.
    fn via(&self, record: &StepRecord) -> Via {
        let mut via = Via::default();
        let count = match &self.world {
            World::Rapier { bodies, .. } if !record.waypoints.is_empty() => bodies.len(),
            _ => return via,
        };
        for k in 0..count {
            let number = self.number(k);
            let own = record.waypoints.iter().filter(|w| Some(w.body) == number);
            let share = |time: f64| (1.0 - (record.time - time) / record.dt).clamp(0.0, 1.0);
            let own = own.map(|w| (share(w.time), Pose64::from_numbers(&w.place)));
            let own: Vec<_> = own.collect();
            if !own.is_empty() {
                via.insert(k as u32, own);
            }
        }
        via
    }

    /// As [`Built::measure`], into the record of the step.
    pub fn measure_into(
        &mut self,
        record: &mut StepRecord,
        state: impl Fn(&Built, usize) -> Option<(Pose64, Vec3)>,
    ) {
        let via = self.via(record);
        let Some(measured) = self.measure_along(state, &via) else {
            return;
        };
        record.penetration = measured.worst;
        let number = |k: u32| self.number(k as usize);
        let numbers = |[a, b]: [u32; 2]| Some([number(a)?, number(b)?]);
        record.passed = measured.passed.into_iter().filter_map(numbers).collect();
    }

    /// The worst overlap that lasted [`LASTING`](super::LASTING) or for all of a shorter run, over the size of the
    /// smaller body, and the two bodies; after [`Built::measure`] in each step.
    pub fn lasting_overlap(&self) -> Option<(f64, Option<[u32; 2]>)> {
        Some(self.overlaps.as_ref()?.lasting())
    }

    /// The deepest overlap at the end of any step; after [`Built::measure`] in each step.
    pub fn deepest_overlap(&self) -> Option<Deepest> {
        self.overlaps.as_ref()?.deepest()
    }

    /// Diameter \[m\] of a circle round the origin of body `k` that holds it; `None` for other
    /// worlds than rapier's.
    pub fn size(&self, k: usize) -> Option<f64> {
        Some(self.overlaps.as_ref()?.size(k))
    }

    /// The rapier world and its bodies; `None` if the scene is not built on one.
    pub fn simulation(&self) -> Option<(&Simulation, &[BodyId])> {
        match &self.world {
            World::Rapier { simulation, bodies } => Some((simulation, bodies)),
            _ => None,
        }
    }

    /// As [`Built::simulation`], mutable.
    pub fn simulation_mut(&mut self) -> Option<&mut Simulation> {
        match &mut self.world {
            World::Rapier { simulation, .. } => Some(simulation),
            _ => None,
        }
    }

    /// The rapier world, for a peer to step it.
    ///
    /// # Errors
    /// [`ModelError::Unsupported`] if there is none.
    pub fn peer(&mut self) -> Result<&mut Simulation, ModelError> {
        let none = || ModelError::Unsupported("the scene is not built on a rapier world".into());
        self.simulation_mut().ok_or_else(none)
    }

    /// Copies the rapier world into Box2D for [`Built::step_with_box2d`].
    ///
    /// # Errors
    /// Those of [`Built::peer`] and [`Box2d::copy`].
    pub fn set_box2d(&mut self, settings: &Box2dSettings) -> Result<(), ModelError> {
        let names: Vec<(BodyId, String)> = match &self.world {
            World::Rapier { bodies, .. } => bodies
                .iter()
                .copied()
                .zip(self.names.iter().cloned())
                .collect(),
            _ => Vec::new(),
        };
        self.box2d = Some(Box2d::copy(self.peer()?, settings, &names)?);
        Ok(())
    }

    /// One step of Box2D, see [`Box2d::step`].
    ///
    /// # Errors
    /// [`StepError::Model`] without [`Built::set_box2d`]; those of [`Box2d::step`].
    pub fn step_with_box2d(&mut self) -> Result<StepRecord, StepError> {
        let mut box2d = self.box2d.take().ok_or_else(|| {
            ModelError::Invalid("the world has not been copied into Box2D".to_owned())
        })?;
        let record = box2d.step(self.peer()?);
        self.box2d = Some(box2d);
        record
    }
}
