//! The strip of crop: segments joined end to end by slots that slide at the strength of the mat.

use super::parameters::Thresher;
use super::shapes::{
    SPAWN, arc_length, bending, parting, segment_faces, segment_mass, strip_pose, turned, unit,
};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::record::{JointRecord, StepRecord};
use crate::dynamics::{JointCoordinate, JointPart, StepError};
use crate::peers::{BodyId, JointShape, JointSpec, MassSpec, Motion, Simulation};
use crate::rapier::Pose64;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// The segments in the machine, and the feeder's present one.
///
/// The feeder moves one segment at the entry speed. Once that segment has advanced by its length it
/// becomes free crop, and the next one follows: the mass flow at the inlet is constant. The end of
/// every segment slides in a slot along the axis of the one behind it, against a Coulomb force, the
/// strength of the mat: below it the strip is stiff, above it the strip parts, or slides into
/// itself where it is pushed together.
#[derive(Default, Serialize, Deserialize)]
pub(super) struct Strip {
    /// From the feeder (newest) to the tip.
    segments: VecDeque<BodyId>,
    passed: Passed,
}

/// What passed the ends of the machine since the last reading, of the slice.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Passed {
    /// Kinetic energy \[J\] that crop brought in and took away.
    pub energy_in: f64,
    pub energy_out: f64,
    /// Angular momentum about the axle [N m s] that it brought in and took away.
    pub spin_in: f64,
    pub spin_out: f64,
    /// Mass \[kg\] that came in, left behind the outlet, and was thrown back at the inlet.
    pub mass_in: f64,
    pub mass_out: f64,
    pub mass_back: f64,
    /// Grains that left, and those of them that had met a tooth.
    pub grains_out: usize,
    pub met_out: usize,
    /// Grains that were behind steel: 0, unless the contacts failed.
    pub through_steel: usize,
}

/// Work in the strip in one step \[J\], of the slice.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct StripWork {
    /// Supplied by the feeder.
    pub feeder: f64,
    /// Dissipated where the mat parts or slides into itself.
    pub parting: f64,
    /// Dissipated and stored by bending.
    pub bending: f64,
}

impl Strip {
    /// Lays the strip on the concave from behind the outlet to the feeder, moving at its speed.
    pub fn lay(simulation: &mut Simulation, p: &Thresher) -> Result<Strip, StepError> {
        let mut strip = Strip::default();
        let count = Strip::full(p);
        for k in (0..count).rev() {
            let (centre, along) =
                strip_pose(p, p.segment_length * (k as f64 + p.feed_phase) - SPAWN);
            strip.push(simulation, p, centre, along, 0.0)?;
        }
        Ok(strip)
    }

    /// Number of segments of a strip laid end to end.
    fn full(p: &Thresher) -> usize {
        let covered = arc_length(p) + SPAWN + 0.5 * p.exit_distance;
        (covered / p.segment_length).ceil() as usize
    }

    /// Mass \[kg\] of a strip laid end to end.
    pub fn full_mass(p: &Thresher) -> f64 {
        Strip::full(p) as f64 * segment_mass(p).0
    }

    pub fn segments(&self) -> impl Iterator<Item = BodyId> + '_ {
        self.segments.iter().copied()
    }

    /// Mass in the machine \[kg\], with the feeder's segment.
    pub fn mass(&self, p: &Thresher) -> f64 {
        self.segments.len() as f64 * segment_mass(p).0
    }

    pub fn take_passed(&mut self) -> Passed {
        std::mem::take(&mut self.passed)
    }

    /// Kinetic energy of the free segments \[J\].
    pub fn energy(&self, simulation: &Simulation, p: &Thresher) -> f64 {
        let free = self.segments.iter().skip(1);
        free.map(|&s| kinetic(simulation, p, s)).sum()
    }

    /// Angular momentum of the free segments about the axle [N m s].
    pub fn spin(&self, simulation: &Simulation, p: &Thresher) -> f64 {
        let free = self.segments.iter().skip(1);
        free.map(|&s| spin(simulation, p, s)).sum()
    }

    /// Once the newest segment has advanced by its length, releases it as crop and adds the next
    /// one behind it. `inlet` is the middle of the strip at the inlet \[m\].
    pub fn feed(
        &mut self,
        simulation: &mut Simulation,
        p: &Thresher,
        inlet: Vec2,
    ) -> Result<(), StepError> {
        let d = turned(unit(p.concave_start_deg));
        let length = p.segment_length;
        let start = inlet - d * SPAWN;
        let newest = self.segments.front();
        let Some(pose) = newest.and_then(|&s| simulation.pose(s)) else {
            return Ok(());
        };
        let advanced = (pose.translation - start).dot(&d);
        // with a tolerance for rounding: the feed is a whole number of steps per segment
        if advanced < length * (1.0 - 1e-9) {
            return Ok(());
        }
        let centre = pose.translation - d * length;
        // if the line of the inlet has moved, the feeder drifts to it over one segment
        let drift = turned(d).dot(&(inlet - centre)) / length;
        self.push(simulation, p, centre, d, drift)
    }

    /// Removes segments `exit_distance` behind the outlet, and with them their joint. `tips` is the
    /// radius of the tooth tips for which the concave is set \[m\].
    pub fn remove_what_left(&mut self, simulation: &mut Simulation, p: &Thresher, tips: f64) {
        let outlet = (tips + p.clearance_outlet) * unit(p.concave_end_deg);
        let along = turned(unit(p.concave_end_deg));
        while self.segments.len() > 1 {
            let tip = self.segments[self.segments.len() - 1];
            let Some(pose) = simulation.pose(tip) else {
                break;
            };
            let d = pose.translation - outlet;
            let gone = along.dot(&d) > p.exit_distance || d.norm() > 3.0 * p.exit_distance.max(1.0);
            // a segment still inside the arc is on the other side of the machine
            if !gone || pose.translation.dot(&unit(p.concave_end_deg)) < 0.0 {
                break;
            }
            self.passed.energy_out += kinetic(simulation, p, tip);
            self.passed.spin_out += spin(simulation, p, tip);
            self.passed.mass_out += segment_mass(p).0;
            simulation.remove_body(tip);
            self.segments.pop_back();
        }
    }

    /// Work of the step of `record`, without that of the drive of `cylinder`.
    pub fn work(
        &self,
        simulation: &Simulation,
        p: &Thresher,
        cylinder: BodyId,
        record: &StepRecord,
    ) -> StripWork {
        let cylinder = simulation.number(cylinder);
        let in_strip = |j: &&JointRecord| j.bodies.iter().all(|b| Some(*b) != cylinder);
        let feeder = self.segments.front().and_then(|&s| simulation.number(s));
        let mut work = StripWork {
            // the feeder is the only moving support
            feeder: record.energy.joints,
            ..StripWork::default()
        };
        for joint in record.joints.iter().filter(in_strip) {
            match joint.part {
                JointPart::Drive(JointCoordinate::Angle) => work.bending -= joint.work,
                JointPart::Drive(_) => {
                    work.parting -= joint.work;
                    // the slider takes the difference of the two speeds
                    if feeder == Some(joint.bodies[0]) {
                        let supplied = joint.impulse.x * p.entry_speed;
                        work.feeder += supplied;
                        work.parting += supplied;
                    }
                }
                _ => {}
            }
        }
        work
    }

    /// Adds a feeder segment behind the strip that moves along `along`, and across at `drift` times
    /// that speed; the segment before it becomes free crop.
    fn push(
        &mut self,
        simulation: &mut Simulation,
        p: &Thresher,
        centre: Vec2,
        along: Vec2,
        drift: f64,
    ) -> Result<(), StepError> {
        let velocity = (along + turned(along) * drift) * p.entry_speed;
        let [(above, surface), (below, other)] = segment_faces(p);
        let (next, _) = simulation.add_body(
            Motion::Kinematic,
            Pose64::new(centre, along.y.atan2(along.x)),
            Vec3::new(velocity.x, velocity.y, 0.0),
            &above,
            &surface,
            None,
        )?;
        simulation.add_collider(next, &below, &other)?;
        if let Some(&newest) = self.segments.front() {
            let (mass, inertia) = segment_mass(p);
            simulation.release(newest, &above, MassSpec::Given { mass, inertia })?;
            self.passed.energy_in += kinetic(simulation, p, newest);
            self.passed.spin_in += spin(simulation, p, newest);
            self.passed.mass_in += mass;
            let half = Vec2::new(0.5 * p.segment_length, 0.0);
            simulation.add_joint(&JointSpec {
                shape: JointShape::PinSlot,
                drive: Some(parting(p)),
                turn: Some(bending(p)),
                ..JointSpec::revolute([Some(next), Some(newest)], [half, -half])
            })?;
        }
        self.segments.push_front(next);
        Ok(())
    }
}

fn kinetic(simulation: &Simulation, p: &Thresher, segment: BodyId) -> f64 {
    let (mass, inertia) = segment_mass(p);
    simulation.velocity(segment).map_or(0.0, |u| {
        0.5 * (mass * u.xy().norm_squared() + inertia * u.z * u.z)
    })
}

fn spin(simulation: &Simulation, p: &Thresher, segment: BodyId) -> f64 {
    let (mass, inertia) = segment_mass(p);
    spin_of(simulation, segment, mass, inertia)
}

/// Angular momentum of a body about the axle [N m s].
pub(super) fn spin_of(simulation: &Simulation, body: BodyId, mass: f64, inertia: f64) -> f64 {
    let state = simulation.pose(body).zip(simulation.velocity(body));
    state.map_or(0.0, |(pose, u)| {
        mass * pose.translation.perp(&u.xy()) + inertia * u.z
    })
}
