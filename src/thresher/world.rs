//! The threshing cylinder as rapier bodies: bars, concave, and a strip of crop fed through them.
//!
//! A slice one metre deep: only this module divides machine totals by the machine's width. The
//! cylinder turns counter-clockwise about the origin. The tooth frame of bar k has its x axis along
//! the motion and its y axis outward, `y = 0` on the base line at radius `l`, so that the ramp
//! (toe, large x) leads.

use super::blocks::Tooth;
use super::parameters::{ConcaveSetting, Thresher};
use super::shapes::{
    CROP, STEEL, arc_length, base_radius, bending, concave_chain, segment_mass, segment_shape,
    steel, steel_law, strip_pose, tooth_chain, turned, unit,
};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::record::{ContactRecord, JointRecord, StepRecord, SurfacePoint};
use crate::dynamics::{JointPart, ModelError, StepError};
use crate::peers::{
    BodyId, ColliderId, FrictionRule, JointDrive, JointSpec, MassSpec, Motion, ShapeSpec,
    Simulation, Surface,
};
use crate::rapier::Pose64;
use crate::scene::Scene;
use crate::wear::{Profile, WearError};
use std::collections::VecDeque;

/// New segments appear this far before the inlet \[m\].
const SPAWN: f64 = 0.06;
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
    /// Present Winkler modulus of the crop \[Pa/m\].
    stiffness: f64,
    /// Radius \[m\] of the tooth tips for which the concave is set.
    tips: f64,
    cylinder: BodyId,
    bars: Vec<ColliderId>,
    concave: ColliderId,
    concave_body: BodyId,
    /// From the feeder (newest) to the tip.
    strip: VecDeque<BodyId>,
    /// Kinetic energy \[J\] that segments brought in and took away since the last reading.
    entered: f64,
    left: f64,
}

/// Outlines for a picture of the machine \[m\].
#[derive(Debug, Clone, PartialEq)]
pub struct Outlines {
    pub teeth: Vec<Vec<Vec2>>,
    pub crop: Vec<Vec<Vec2>>,
    pub concave: Vec<Vec2>,
}

/// The steel part of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The tooth of this bar, from 0.
    Tooth(usize),
    Concave,
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
        let law = steel_law(p, stiffness);
        let outline = tooth_chain(p, tooth, profile, 0)?;
        let (cylinder, first) = simulation.add_body(
            Motion::Dynamic,
            Pose64::new(Vec2::zeros(), 0.0),
            Vec3::new(0.0, 0.0, p.speed),
            &outline,
            &steel(p.friction_steel, law),
            Some(MassSpec::Given {
                mass: inertia / (AXLE_RADIUS * AXLE_RADIUS),
                inertia,
            }),
        )?;
        let mut bars = vec![first];
        for k in 1..p.bars as usize {
            let chain = tooth_chain(p, tooth, profile, k)?;
            bars.push(simulation.add_collider(cylinder, &chain, &steel(p.friction_steel, law))?);
        }
        simulation.add_joint(&JointSpec {
            drive: Some(JointDrive::Motor {
                speed: p.speed,
                max_force: p.drive_torque_factor * p.per_metre(p.operating_torque),
            }),
            ..JointSpec::revolute([None, Some(cylinder)], [Vec2::zeros(); 2])
        })?;
        let (concave_body, concave) = simulation.add_body(
            Motion::Fixed,
            Pose64::new(Vec2::zeros(), 0.0),
            Vec3::zeros(),
            &concave_chain(p, p.tip_radius),
            &steel(p.friction_concave, law),
            None,
        )?;
        let mut world = ThreshingWorld {
            simulation,
            parameters: p.clone(),
            tooth: *tooth,
            stiffness,
            tips: p.tip_radius,
            cylinder,
            bars,
            concave,
            concave_body,
            strip: VecDeque::new(),
            entered: 0.0,
            left: 0.0,
        };
        world.fill()?;
        Ok(world)
    }

    /// One step: feeds the strip, steps the machine, removes the segments that have left.
    ///
    /// # Errors
    /// [`StepError`].
    pub fn step(&mut self) -> Result<StepRecord, StepError> {
        self.feed()?;
        let record = self.simulation.step()?;
        self.remove_what_left();
        Ok(record)
    }

    /// Gives all bars the worn `profile`; the concave follows their tips if the scene says so.
    ///
    /// # Errors
    /// As [`ThreshingWorld::new`]; the old teeth then remain.
    pub fn set_profile(&mut self, profile: &Profile) -> Result<(), ThreshingError> {
        let p = &self.parameters;
        let surface = steel(p.friction_steel, steel_law(p, self.stiffness));
        for k in 0..self.bars.len() {
            let chain = tooth_chain(p, &self.tooth, profile, k)?;
            self.bars[k] =
                self.simulation
                    .replace_collider(self.bars[k], self.cylinder, &chain, &surface)?;
        }
        if p.concave == ConcaveSetting::Follows {
            self.tips = base_radius(p, &self.tooth) + profile.height();
        }
        let surface = steel(p.friction_concave, steel_law(p, self.stiffness));
        let chain = concave_chain(p, self.tips);
        self.concave =
            self.simulation
                .replace_collider(self.concave, self.concave_body, &chain, &surface)?;
        Ok(())
    }

    /// Changes the crop's Winkler modulus \[Pa/m\].
    ///
    /// # Errors
    /// As [`ThreshingWorld::set_profile`].
    pub fn set_stiffness(
        &mut self,
        stiffness: f64,
        profile: &Profile,
    ) -> Result<(), ThreshingError> {
        self.stiffness = stiffness;
        self.set_profile(profile)
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

    /// Number of segments in the machine.
    pub fn segments(&self) -> usize {
        self.strip.len()
    }

    /// Kinetic energy of the crop in the machine \[J\], of the slice.
    pub fn crop_energy(&self) -> f64 {
        self.strip.iter().skip(1).map(|&s| self.kinetic(s)).sum()
    }

    /// Energy \[J\] that segments brought in and took away since the last call, of the slice.
    pub fn take_exchanged_energy(&mut self) -> (f64, f64) {
        let exchanged = (self.entered, self.left);
        (self.entered, self.left) = (0.0, 0.0);
        exchanged
    }

    /// Angle of the cylinder, and so of bar 0, from +x \[rad\].
    pub fn angle(&self) -> f64 {
        self.cylinder_pose().angle()
    }

    /// Spin of the cylinder \[rad/s\].
    pub fn speed(&self) -> f64 {
        self.simulation.velocity(self.cylinder).map_or(0.0, |u| u.z)
    }

    /// The cylinder and all segments, newest first: their numbers in the record, poses and
    /// velocities.
    pub fn bodies(&self) -> Vec<(u32, Pose64, Vec3)> {
        let s = &self.simulation;
        std::iter::once(self.cylinder)
            .chain(self.strip.iter().copied())
            .filter_map(|b| Some((s.number(b)?, s.pose(b)?, s.velocity(b)?)))
            .collect()
    }

    /// Outlines for a picture \[m\]: teeth with `profile`, crop segments, and the concave's line.
    ///
    /// # Errors
    /// [`WearError`] for a profile that is worn through.
    pub fn outlines(&self, profile: &Profile) -> Result<Outlines, WearError> {
        let place = |shape: ShapeSpec, pose: Pose64| match shape {
            ShapeSpec::Chain { points, .. } => points.iter().map(|&p| pose.apply(p)).collect(),
            ShapeSpec::Box { half } => [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
                .map(|(x, y)| pose.apply(half.component_mul(&Vec2::new(x, y))))
                .to_vec(),
            _ => Vec::new(),
        };
        let p = &self.parameters;
        let teeth = (0..self.bars.len())
            .map(|k| {
                let chain = tooth_chain(p, &self.tooth, profile, k)?;
                Ok(place(chain, self.cylinder_pose()))
            })
            .collect::<Result<_, WearError>>()?;
        let still = Pose64::new(Vec2::zeros(), 0.0);
        Ok(Outlines {
            teeth,
            crop: self
                .strip
                .iter()
                .filter_map(|&s| Some(place(segment_shape(p), self.simulation.pose(s)?)))
                .collect(),
            concave: place(concave_chain(p, self.tips), still),
        })
    }

    fn cylinder_pose(&self) -> Pose64 {
        self.simulation
            .pose(self.cylinder)
            .unwrap_or(Pose64::new(Vec2::zeros(), 0.0))
    }

    fn kinetic(&self, segment: BodyId) -> f64 {
        let (mass, inertia) = segment_mass(&self.parameters);
        self.simulation.velocity(segment).map_or(0.0, |u| {
            0.5 * (mass * u.xy().norm_squared() + inertia * u.z * u.z)
        })
    }

    /// Middle of the strip at the inlet.
    fn inlet(&self) -> Vec2 {
        let p = &self.parameters;
        let r = self.tips + p.clearance_inlet - 0.5 * p.crop_thickness;
        r * unit(p.concave_start_deg)
    }

    fn feed_direction(&self) -> Vec2 {
        turned(unit(self.parameters.concave_start_deg))
    }

    /// A segment that the feeder moves along `d`, and across at `drift` times that speed.
    fn new_segment(&mut self, centre: Vec2, d: Vec2, drift: f64) -> Result<BodyId, StepError> {
        let velocity = (d + turned(d) * drift) * self.parameters.entry_speed;
        let surface = Surface {
            // the friction of the pair is set on the steel
            friction: 0.0,
            friction_rule: FrictionRule::Larger,
            groups: (CROP, STEEL),
            ..Surface::default()
        };
        let (segment, _) = self.simulation.add_body(
            Motion::Kinematic,
            Pose64::new(centre, d.y.atan2(d.x)),
            Vec3::new(velocity.x, velocity.y, 0.0),
            &segment_shape(&self.parameters),
            &surface,
            None,
        )?;
        Ok(segment)
    }

    /// Lays the strip on the concave from behind the outlet to the feeder, moving at its speed.
    fn fill(&mut self) -> Result<(), StepError> {
        let p = self.parameters.clone();
        let pose_at = |s: f64| strip_pose(&p, s);
        let arc = arc_length(&p);
        let count = ((arc + SPAWN + 0.5 * p.exit_distance) / p.segment_length).ceil() as usize;
        for k in (0..count).rev() {
            let place = (k as f64 + p.feed_phase) * p.segment_length;
            let (centre, along) = pose_at(place - SPAWN);
            self.push_segment(centre, along, 0.0)?;
        }
        Ok(())
    }

    /// Adds a feeder segment behind the strip; the segment before it becomes free crop.
    fn push_segment(&mut self, centre: Vec2, along: Vec2, drift: f64) -> Result<(), StepError> {
        let next = self.new_segment(centre, along, drift)?;
        if let Some(&newest) = self.strip.front() {
            let (mass, inertia) = segment_mass(&self.parameters);
            let spec = MassSpec::Given { mass, inertia };
            let shape = segment_shape(&self.parameters);
            self.simulation.release(newest, &shape, spec)?;
            self.entered += self.kinetic(newest);
            let half = Vec2::new(0.5 * self.parameters.segment_length, 0.0);
            let spring = bending(&self.parameters);
            let bodies = [Some(next), Some(newest)];
            self.simulation.add_joint(&JointSpec {
                drive: Some(spring),
                ..JointSpec::revolute(bodies, [half, -half])
            })?;
        }
        self.strip.push_front(next);
        Ok(())
    }

    /// Once the newest segment has advanced by its length, releases it as crop and adds the next
    /// one behind it.
    fn feed(&mut self) -> Result<(), StepError> {
        let d = self.feed_direction();
        let length = self.parameters.segment_length;
        let start = self.inlet() - d * SPAWN;
        let newest = self.strip[0];
        let Some(pose) = self.simulation.pose(newest) else {
            return Ok(());
        };
        let advanced = (pose.translation - start).dot(&d);
        // with a tolerance for rounding: the feed is a whole number of steps per segment
        if advanced < length * (1.0 - 1e-9) {
            return Ok(());
        }
        let centre = pose.translation - d * length;
        // if the line of the inlet has moved, the feeder drifts to it over one segment
        let drift = turned(d).dot(&(self.inlet() - centre)) / length;
        self.push_segment(centre, d, drift)
    }

    /// Removes segments `exit_distance` behind the outlet, and with them their pin.
    fn remove_what_left(&mut self) {
        let p = &self.parameters;
        let outlet = (self.tips + p.clearance_outlet) * unit(p.concave_end_deg);
        let along = turned(unit(p.concave_end_deg));
        while self.strip.len() > 1 {
            let tip = self.strip[self.strip.len() - 1];
            let Some(pose) = self.simulation.pose(tip) else {
                break;
            };
            let d = pose.translation - outlet;
            let gone = along.dot(&d) > p.exit_distance || d.norm() > 3.0 * p.exit_distance.max(1.0);
            // a segment still inside the arc is on the other side of the machine
            if !gone || pose.translation.dot(&unit(p.concave_end_deg)) < 0.0 {
                break;
            }
            self.left += self.kinetic(tip);
            self.simulation.remove_body(tip);
            self.strip.pop_back();
        }
    }
}
