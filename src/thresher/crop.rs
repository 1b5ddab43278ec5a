//! The crop of a machine: a strip, or grains.

use super::grain_parameters::Grains;
use super::grains::GrainCrop;
use super::parameters::Thresher;
use super::shapes::{disc_outline, segment_mass, segment_shape, unit};
use super::strip::{Passed, Strip, StripWork};
use crate::contact::Vec2;
use crate::dynamics::StepError;
use crate::dynamics::record::StepRecord;
use crate::peers::{BodyId, ShapeSpec, Simulation};
use crate::rapier::Pose64;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// What is fed through the machine.
#[derive(Serialize, Deserialize)]
pub(super) enum Crop {
    Strip(Strip),
    Grains { grains: Grains, crop: GrainCrop },
}

impl Crop {
    /// A strip laid through the machine, or no grains yet.
    pub fn new(simulation: &mut Simulation, p: &Thresher) -> Result<Crop, StepError> {
        Ok(match &p.grains {
            None => Crop::Strip(Strip::lay(simulation, p)?),
            Some(grains) => Crop::Grains {
                grains: grains.clone(),
                crop: GrainCrop::new(grains),
            },
        })
    }

    /// Feeds what is due in a step of `dt` \[s\]; `tips` is the radius of the tooth tips for which the concave
    /// is set \[m\].
    pub fn feed(
        &mut self,
        simulation: &mut Simulation,
        p: &Thresher,
        tips: f64,
        dt: f64,
    ) -> Result<(), StepError> {
        match self {
            Crop::Strip(strip) => {
                let r = tips + p.clearance_inlet - 0.5 * p.crop_thickness;
                strip.feed(simulation, p, r * unit(p.concave_start_deg))
            }
            Crop::Grains { grains, crop } => crop.feed(simulation, p, grains, tips, dt),
        }
    }

    pub fn remove_what_left(&mut self, simulation: &mut Simulation, p: &Thresher, tips: f64) {
        match self {
            Crop::Strip(strip) => strip.remove_what_left(simulation, p, tips),
            Crop::Grains { grains, crop } => crop.remove_what_left(simulation, p, grains, tips),
        }
    }

    /// All bodies, segments from the feeder on, grains in the order of entry.
    pub fn bodies(&self) -> Vec<BodyId> {
        match self {
            Crop::Strip(strip) => strip.segments().collect(),
            Crop::Grains { crop, .. } => crop.inside().iter().map(|g| g.body).collect(),
        }
    }

    /// Mass in the machine \[kg\], of the slice.
    pub fn mass(&self, p: &Thresher) -> f64 {
        match self {
            Crop::Strip(strip) => strip.mass(p),
            Crop::Grains { grains, crop } => crop.mass(grains),
        }
    }

    /// Mass that is due at the inlet and has not entered \[kg\], of the slice.
    pub fn waiting(&self, p: &Thresher, dt: f64) -> f64 {
        match self {
            Crop::Strip(_) => 0.0,
            Crop::Grains { crop, .. } => crop.waiting(p, dt),
        }
    }

    /// Kinetic energy of the free crop \[J\].
    pub fn energy(&self, simulation: &Simulation, p: &Thresher) -> f64 {
        match self {
            Crop::Strip(strip) => strip.energy(simulation, p),
            Crop::Grains { grains, crop } => crop.energy(simulation, grains),
        }
    }

    /// Angular momentum of the free crop about the axle [N m s].
    pub fn spin(&self, simulation: &Simulation, p: &Thresher) -> f64 {
        match self {
            Crop::Strip(strip) => strip.spin(simulation, p),
            Crop::Grains { grains, crop } => crop.spin(simulation, grains),
        }
    }

    /// Sum of mass times place of the free crop [kg m].
    pub fn mass_moment(&self, simulation: &Simulation, p: &Thresher) -> Vec2 {
        let at = |body| {
            simulation
                .pose(body)
                .map_or(Vec2::zeros(), |pose| pose.translation)
        };
        match self {
            Crop::Strip(strip) => {
                let free = strip.segments().skip(1);
                free.map(|s| segment_mass(p).0 * at(s)).sum()
            }
            Crop::Grains { grains, crop } => (crop.inside().iter())
                .map(|g| grains.mass(g.radius).0 * at(g.body))
                .sum(),
        }
    }

    /// Notes the grains with these numbers as met by a tooth.
    pub fn note_met(&mut self, simulation: &Simulation, met: &[u32]) {
        if let Crop::Grains { crop, .. } = self {
            crop.note_met(simulation, met);
        }
    }

    pub fn take_passed(&mut self) -> Passed {
        match self {
            Crop::Strip(strip) => strip.take_passed(),
            Crop::Grains { crop, .. } => crop.take_passed(),
        }
    }

    /// Work inside a strip in the step of `record`; grains have no joints.
    pub fn work(
        &self,
        simulation: &Simulation,
        p: &Thresher,
        cylinder: BodyId,
        record: &StepRecord,
    ) -> StripWork {
        match self {
            Crop::Strip(strip) => strip.work(simulation, p, cylinder, record),
            Crop::Grains { .. } => StripWork::default(),
        }
    }

    /// Of the grains above the concave: how many they are, how many reach within the circle of the tips, and
    /// the sum of the areas \[m²\].
    pub fn layer(&self, simulation: &Simulation, p: &Thresher, tips: f64) -> (usize, usize, f64) {
        let [start, end] = [p.concave_start_deg, p.concave_end_deg].map(f64::to_radians);
        let mut found = (0, 0, 0.0);
        for (at, radius) in self.discs(simulation) {
            if (at.y.atan2(at.x) - start).rem_euclid(TAU) < end - start {
                found.0 += 1;
                found.1 += usize::from(at.norm() - radius < tips);
                found.2 += PI * radius * radius;
            }
        }
        found
    }

    /// The outline of every body \[m\].
    pub fn outlines(&self, simulation: &Simulation, p: &Thresher) -> Vec<Vec<Vec2>> {
        match self {
            Crop::Strip(strip) => {
                let poses = strip.segments().filter_map(|s| simulation.pose(s));
                poses.map(|pose| placed(segment_shape(p), pose)).collect()
            }
            Crop::Grains { crop, .. } => {
                let discs = crop.inside().iter();
                discs
                    .filter_map(|g| Some((simulation.pose(g.body)?.translation, g.radius)))
                    .map(|(at, radius)| disc_outline(at, radius))
                    .collect()
            }
        }
    }

    /// Centre and radius of every grain \[m\], in the order of [`Crop::bodies`]; empty for a strip.
    pub fn discs(&self, simulation: &Simulation) -> Vec<(Vec2, f64)> {
        match self {
            Crop::Strip(_) => Vec::new(),
            Crop::Grains { crop, .. } => (crop.inside().iter())
                .filter_map(|g| Some((simulation.pose(g.body)?.translation, g.radius)))
                .collect(),
        }
    }
}

/// The corners of a chain or a box at a pose \[m\].
pub(super) fn placed(shape: ShapeSpec, pose: Pose64) -> Vec<Vec2> {
    match shape {
        ShapeSpec::Chain { points, .. } => points.iter().map(|&p| pose.apply(p)).collect(),
        ShapeSpec::Box { half } => [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
            .map(|(x, y)| pose.apply(half.component_mul(&Vec2::new(x, y))))
            .to_vec(),
        _ => Vec::new(),
    }
}
