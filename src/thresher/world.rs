//! The threshing cylinder as rapier bodies: bars, concave, and a strip of crop fed through them.
//!
//! A slice one metre deep: only this module divides machine totals by the machine's width. The
//! cylinder turns counter-clockwise about the origin. The tooth frame of bar k has its x axis along
//! the motion and its y axis outward, `y = 0` on the base line at radius `l`, so that the ramp
//! (toe, large x) leads.

use super::blocks::Tooth;
use super::crop::{Crop, placed};
use super::governor;
use super::grains::Grain;
use super::parameters::{ConcaveSetting, Thresher};
use super::shapes::{
    base_radius, concave_chain, concave_surface, hub, steel_law, teeth_surface, tooth_chain,
};
use super::strip::{Passed, Strip, StripWork};
use crate::checkpoint::{CheckpointError, Reader, Writer};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::record::{ContactRecord, JointRecord, StepRecord, SurfacePoint};
use crate::dynamics::{JointPart, ModelError, StepError};
use crate::peers::{BodyId, ColliderId, JointSpec, MassSpec, Motion, Simulation};
use crate::rapier::Pose64;
use crate::scene::Scene;
use crate::wear::{Profile, WearError};
use serde::{Deserialize, Serialize};

/// Radius of gyration \[m\] for the mass of the cylinder; any will do, as the axle supports it.
const AXLE_RADIUS: f64 = 0.2;

/// Errors in building or stepping the threshing cylinder.
#[derive(Debug, thiserror::Error)]
pub enum ThreshingError {
    #[error(transparent)]
    Step(#[from] StepError),
    #[error(transparent)]
    Wear(#[from] WearError),
}

impl From<ModelError> for ThreshingError {
    fn from(error: ModelError) -> Self {
        ThreshingError::Step(error.into())
    }
}

/// The machine in motion.
pub struct ThreshingWorld {
    pub simulation: Simulation,
    parameters: Thresher,
    tooth: Tooth,
    /// Of all teeth.
    profile: Profile,
    /// Present Winkler modulus of the crop \[Pa/m\].
    stiffness: f64,
    /// Radius \[m\] of the tooth tips for which the concave is set.
    tips: f64,
    cylinder: BodyId,
    bars: Vec<ColliderId>,
    concave: ColliderId,
    concave_body: BodyId,
    /// Between the bars, with a crop of grains.
    hub: Option<ColliderId>,
    crop: Crop,
    gravity: Vec2,
    dt: f64,
}

/// Outlines for a picture of the machine \[m\].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outlines {
    /// Closed; each begins with the cells of the tooth.
    pub teeth: Vec<Vec<Vec2>>,
    /// Cells of a tooth.
    #[serde(default)]
    pub cells: usize,
    pub crop: Vec<Vec<Vec2>>,
    pub concave: Vec<Vec2>,
}

/// The steel part of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The tooth of this bar, from 0.
    Tooth(usize),
    Concave,
    /// The core of the cylinder between its bars.
    Hub,
}

impl ThreshingWorld {
    /// The machine with its teeth as in `profiles` (one for all bars, or one a bar), the strip's
    /// first segment at the inlet.
    ///
    /// # Errors
    /// [`ThreshingError`] for a scene without the block, a profile that is worn through, or
    /// settings that the stepper refuses.
    pub fn new(
        scene: &Scene,
        parameters: &Thresher,
        tooth: &Tooth,
        profile: &Profile,
        stiffness: f64,
    ) -> Result<Self, ThreshingError> {
        let gravity = Vec2::from(scene.gravity);
        let mut simulation = Simulation::new(scene.step.stepper(), gravity, scene.step.dt)?;
        let p = parameters;
        let inertia = p.per_metre(p.inertia);
        let outline = tooth_chain(p, tooth, profile, 0)?;
        let (cylinder, first) = simulation.add_body(
            Motion::Dynamic,
            Pose64::new(Vec2::zeros(), 0.0),
            Vec3::new(0.0, 0.0, p.speed),
            &outline,
            &teeth_surface(p, stiffness, 0),
            Some(MassSpec::Given {
                mass: inertia / (AXLE_RADIUS * AXLE_RADIUS),
                inertia,
            }),
        )?;
        let mut bars = vec![first];
        for k in 1..p.bars as usize {
            let chain = tooth_chain(p, tooth, profile, k)?;
            let surface = teeth_surface(p, stiffness, k);
            bars.push(simulation.add_collider(cylinder, &chain, &surface)?);
        }
        // a strip bridges the bars and never meets it
        let hub = match &p.grains {
            Some(_) => {
                let surface = teeth_surface(p, stiffness, usize::MAX);
                Some(simulation.add_collider(cylinder, &hub(p, tooth), &surface)?)
            }
            None => None,
        };
        simulation.add_joint(&JointSpec {
            drive: Some(governor::drive(p, p.speed)),
            ..JointSpec::revolute([None, Some(cylinder)], [Vec2::zeros(); 2])
        })?;
        let (concave_body, concave) = simulation.add_body(
            Motion::Fixed,
            Pose64::new(Vec2::zeros(), 0.0),
            Vec3::zeros(),
            &concave_chain(p, p.tip_radius),
            &concave_surface(p, stiffness),
            None,
        )?;
        let crop = Crop::new(&mut simulation, p)?;
        Ok(ThreshingWorld {
            simulation,
            parameters: p.clone(),
            tooth: *tooth,
            profile: profile.clone(),
            stiffness,
            tips: p.tip_radius,
            cylinder,
            bars,
            concave,
            concave_body,
            hub,
            crop,
            gravity,
            dt: scene.step.dt,
        })
    }

    /// Saves all that the next step depends on.
    ///
    /// # Errors
    /// [`CheckpointError::Write`].
    pub fn save(&self, to: &mut Writer) -> Result<(), CheckpointError> {
        self.simulation.save(to)?;
        to.put(&(&self.profile, self.stiffness, self.tips))?;
        to.put(&(self.cylinder, &self.bars, self.concave, self.concave_body))?;
        to.put(&(self.hub, &self.crop))
    }

    /// Goes on from what [`ThreshingWorld::save`] saved of the same scene, bit for bit.
    ///
    /// # Errors
    /// [`CheckpointError::Read`]: the machine is then neither the one nor the other.
    pub fn load(&mut self, from: &mut Reader) -> Result<(), CheckpointError> {
        self.simulation.load(from)?;
        (self.profile, self.stiffness, self.tips) = from.take()?;
        (self.cylinder, self.bars, self.concave, self.concave_body) = from.take()?;
        (self.hub, self.crop) = from.take()?;
        Ok(())
    }

    /// One step: feeds the crop, steps the machine, removes the crop that has left.
    ///
    /// # Errors
    /// [`StepError`].
    pub fn step(&mut self) -> Result<StepRecord, StepError> {
        let p = &self.parameters;
        if p.governor.is_some() {
            let drive = governor::drive(p, self.speed());
            self.simulation.set_drive(self.cylinder, drive);
        }
        self.crop
            .feed(&mut self.simulation, p, self.tips, self.dt)?;
        let record = self.simulation.step()?;
        self.note_met(&record);
        self.crop
            .remove_what_left(&mut self.simulation, &self.parameters, self.tips);
        Ok(record)
    }

    /// Gives all bars the worn `profile`; the concave follows their tips if the scene says so.
    ///
    /// # Errors
    /// As [`ThreshingWorld::new`]; the old teeth then remain.
    pub fn set_profile(&mut self, profile: &Profile) -> Result<(), ThreshingError> {
        let p = &self.parameters;
        for k in 0..self.bars.len() {
            let surface = teeth_surface(p, self.stiffness, k);
            let chain = tooth_chain(p, &self.tooth, profile, k)?;
            self.bars[k] =
                self.simulation
                    .replace_collider(self.bars[k], self.cylinder, &chain, &surface)?;
        }
        if p.concave == ConcaveSetting::Follows {
            self.tips = base_radius(p, &self.tooth) + profile.height();
        }
        let surface = concave_surface(p, self.stiffness);
        let chain = concave_chain(p, self.tips);
        self.concave =
            self.simulation
                .replace_collider(self.concave, self.concave_body, &chain, &surface)?;
        self.profile = profile.clone();
        Ok(())
    }

    /// Changes the crop's Winkler modulus \[Pa/m\].
    pub fn set_stiffness(&mut self, stiffness: f64) {
        self.stiffness = stiffness;
        let law = steel_law(&self.parameters, stiffness);
        for collider in self.bars.iter().chain([&self.concave]) {
            self.simulation.set_law(*collider, law);
        }
    }

    /// The crop's Winkler modulus \[Pa/m\].
    pub fn stiffness(&self) -> f64 {
        self.stiffness
    }

    /// How far the concave has moved in \[m\].
    pub fn concave_moved(&self) -> f64 {
        self.parameters.tip_radius - self.tips
    }

    /// The steel that a contact is on; `None` for any other contact.
    pub fn part(&self, contact: &ContactRecord) -> Option<Part> {
        contact.surfaces.iter().find_map(|&surface| {
            if surface == self.concave.number() {
                return Some(Part::Concave);
            }
            if self.hub.is_some_and(|hub| surface == hub.number()) {
                return Some(Part::Hub);
            }
            let bar = self.bars.iter().position(|b| b.number() == surface)?;
            Some(Part::Tooth(bar))
        })
    }

    /// The bar, from 0, and the place on its profile that a contact wears, by detection. `None` for
    /// a contact on no bar, and on the sides and the back of a bar, which do not wear.
    pub fn worn_place(
        &self,
        contact: &ContactRecord,
        profile: &Profile,
    ) -> Option<(usize, SurfacePoint)> {
        let mut bars = self.bars.iter().enumerate();
        let (bar, place) = bars.find_map(|(bar, b)| Some((bar, contact.place_on(b.number())?)))?;
        // the outline of a bar starts with its profile, see `tooth_chain`
        ((place.edge as usize) + 1 < profile.node_count()).then_some((bar, place))
    }

    /// The place on the concave and its table that a contact is on, edge 0 at the outlet.
    pub(super) fn concave_place(&self, contact: &ContactRecord) -> Option<SurfacePoint> {
        contact.place_on(self.concave.number())
    }

    /// Angular impulse of a contact on the cylinder [N m s]; 0 for one that is not on it.
    pub(super) fn moment(&self, contact: &ContactRecord) -> f64 {
        let cylinder = self.simulation.number(self.cylinder);
        let side = contact.bodies.iter().position(|b| Some(*b) == cylinder);
        side.and_then(|side| contact.moments[side]).unwrap_or(0.0)
    }

    /// The corners of the concave and its table \[m\], from the outlet on.
    pub(super) fn concave_nodes(&self) -> Vec<Vec2> {
        let still = Pose64::new(Vec2::zeros(), 0.0);
        placed(concave_chain(&self.parameters, self.tips), still)
    }

    /// Work \[J\] of the drive in a step, without the work of the strip's springs.
    pub fn drive_work(&self, record: &StepRecord) -> f64 {
        let cylinder = self.simulation.number(self.cylinder);
        let on_cylinder = |j: &&JointRecord| j.bodies.iter().any(|b| Some(*b) == cylinder);
        let drives = record.joints.iter().filter(on_cylinder);
        drives
            .filter(|j| matches!(j.part, JointPart::Drive(_)))
            .map(|j| j.work)
            .sum()
    }

    /// Angular impulse [N m s] of the drive in a step.
    pub(super) fn drive_moment(&self, record: &StepRecord) -> f64 {
        let cylinder = self.simulation.number(self.cylinder);
        let drives = (record.joints.iter())
            .filter(|j| matches!(j.part, JointPart::Drive(_)))
            .filter(|j| j.bodies.iter().any(|b| Some(*b) == cylinder));
        drives
            .map(|j| if Some(j.bodies[1]) == cylinder { 1.0 } else { -1.0 } * j.impulse.x)
            .sum()
    }

    /// Moment of gravity about the axle on the free crop [N m], of the slice.
    pub(super) fn gravity_moment(&self) -> f64 {
        self.crop
            .mass_moment(&self.simulation, &self.parameters)
            .perp(&self.gravity)
    }

    /// The side of a contact on the concave that the concave is.
    pub(super) fn concave_side(&self, contact: &ContactRecord) -> usize {
        usize::from(contact.surfaces[1] == self.concave.number())
    }

    pub(super) fn parameters(&self) -> &Thresher {
        &self.parameters
    }

    /// Numbers of the cylinder and of the concave in the record.
    pub(super) fn steel(&self) -> [Option<u32>; 2] {
        [self.cylinder, self.concave_body].map(|body| self.simulation.number(body))
    }

    /// Whether one of two bodies, by their numbers in the record, is the cylinder or the concave.
    pub fn is_on_steel(&self, bodies: [u32; 2]) -> bool {
        let steel = self.steel();
        bodies.iter().any(|body| steel.contains(&Some(*body)))
    }

    /// Number of segments or grains in the machine.
    pub fn crop_bodies(&self) -> usize {
        self.crop.bodies().len()
    }

    /// Centre and radius of every grain \[m\]; empty for a strip.
    pub fn grains(&self) -> Vec<(Vec2, f64)> {
        self.crop.discs(&self.simulation)
    }

    /// Mass of crop in the machine \[kg\], of the slice.
    pub fn crop_mass(&self) -> f64 {
        self.crop.mass(&self.parameters)
    }

    /// See [`Crop::layer`].
    pub(super) fn layer(&self) -> (usize, usize, f64) {
        self.crop
            .layer(&self.simulation, &self.parameters, self.tips)
    }

    /// Mass of grains that are due at the inlet and found no room \[kg\], of the slice.
    pub fn waiting(&self) -> f64 {
        self.crop.waiting(&self.parameters, self.dt)
    }

    /// Crop in the machine over that of a strip laid end to end.
    pub fn filled(&self) -> f64 {
        self.crop_mass() / Strip::full_mass(&self.parameters)
    }

    /// Kinetic energy of the cylinder and of the free crop \[J\], of the slice.
    pub fn kinetic_energy(&self) -> f64 {
        let inertia = self.parameters.per_metre(self.parameters.inertia);
        0.5 * inertia * self.speed().powi(2) + self.crop_energy()
    }

    /// Kinetic energy of the crop in the machine \[J\], of the slice.
    pub fn crop_energy(&self) -> f64 {
        self.crop.energy(&self.simulation, &self.parameters)
    }

    /// Angular momentum of the cylinder and of the free crop about the axle [N m s], of the slice.
    pub(super) fn spin(&self) -> f64 {
        let inertia = self.parameters.per_metre(self.parameters.inertia);
        inertia * self.speed() + self.crop.spin(&self.simulation, &self.parameters)
    }

    /// Notes the grains that a tooth meets in a step.
    fn note_met(&mut self, record: &StepRecord) {
        if self.parameters.grains.is_none() {
            return;
        }
        let on_teeth = record.contacts.iter().filter(|contact| {
            contact.impulse_n > 0.0 && matches!(self.part(contact), Some(Part::Tooth(_)))
        });
        let met: Vec<u32> = on_teeth.flat_map(|contact| contact.bodies).collect();
        self.crop.note_met(&self.simulation, &met);
    }

    /// What passed the ends of the machine since the last call.
    pub(super) fn take_passed(&mut self) -> Passed {
        self.crop.take_passed()
    }

    /// Work in the strip in a step.
    pub(super) fn strip_work(&self, record: &StepRecord) -> StripWork {
        let (s, p) = (&self.simulation, &self.parameters);
        self.crop.work(s, p, self.cylinder, record)
    }

    /// Angle of the cylinder, and so of bar 0, from +x \[rad\].
    pub fn angle(&self) -> f64 {
        self.cylinder_pose().angle()
    }

    /// Spin of the cylinder \[rad/s\].
    pub fn speed(&self) -> f64 {
        self.simulation.velocity(self.cylinder).map_or(0.0, |u| u.z)
    }

    /// The cylinder and all crop: their numbers in the record, poses and
    /// velocities.
    pub fn bodies(&self) -> Vec<(u32, Pose64, Vec3)> {
        let s = &self.simulation;
        std::iter::once(self.cylinder)
            .chain(self.crop.bodies())
            .filter_map(|b| Some((s.number(b)?, s.pose(b)?, s.velocity(b)?)))
            .collect()
    }

    /// Numbers of the grains, and their radii \[m\].
    pub fn radii(&self) -> Vec<(u32, f64)> {
        let Crop::Grains { crop, .. } = &self.crop else {
            return Vec::new();
        };
        let of = |grain: &Grain| Some((self.simulation.number(grain.body)?, grain.radius));
        crop.inside().iter().filter_map(of).collect()
    }

    /// Outlines for a picture \[m\]: teeth, crop, and the concave's line.
    ///
    /// # Errors
    /// [`WearError`]: none for the teeth that the machine has.
    pub fn outlines(&self) -> Result<Outlines, WearError> {
        let p = &self.parameters;
        let teeth = (0..self.bars.len())
            .map(|k| {
                let chain = tooth_chain(p, &self.tooth, &self.profile, k)?;
                Ok(placed(chain, self.cylinder_pose()))
            })
            .collect::<Result<_, WearError>>()?;
        Ok(Outlines {
            teeth,
            cells: self.profile.node_count() - 1,
            crop: self.crop.outlines(&self.simulation, p),
            concave: self.concave_nodes(),
        })
    }

    fn cylinder_pose(&self) -> Pose64 {
        self.simulation
            .pose(self.cylinder)
            .unwrap_or(Pose64::new(Vec2::zeros(), 0.0))
    }
}
