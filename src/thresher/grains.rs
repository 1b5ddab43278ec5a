//! The crop of grains: discs fed at a constant mass flow.

use super::grain_parameters::Grains;
use super::parameters::Thresher;
use super::shapes::{SPAWN, TABLE, clearance, grain_surface, turned, unit};
use super::strip::{Passed, spin_of};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::StepError;
use crate::peers::{BodyId, MassSpec, Motion, ShapeSpec, Simulation};
use crate::rapier::Pose64;
use crate::scene::random::SplitMix64;
use serde::{Deserialize, Serialize};

/// Places that are tried for a grain in one step, before it waits for the next one.
const TRIES: usize = 20;
/// Distance kept from other grains and from the table at the inlet \[m\]: contact shapes are rounded to
/// single precision, some 3e-8 m at this distance from the axle.
const CLEAR: f64 = 1e-6;

/// A grain in the machine.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Grain {
    pub body: BodyId,
    /// \[m\]
    pub radius: f64,
    /// Whether a tooth has met it.
    pub met: bool,
}

/// The grains in the machine, and the feeder.
///
/// A grain is due once the mass fed before it and its own are `feed · t`. It enters across the line of
/// the inlet at a random height, where no other grain is: by as much further on as it is due earlier in
/// the step. If no place is free, it waits, and all after it. The mass that has entered is then that of
/// the feed less at most one grain and what waits.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct GrainCrop {
    /// In the order of entry.
    inside: Vec<Grain>,
    /// State of the random numbers.
    random: u64,
    /// Radius of the next grain \[m\].
    next: f64,
    /// Steps taken; mass that has entered \[kg\], of the slice.
    steps: u64,
    fed: f64,
    passed: Passed,
}

impl GrainCrop {
    /// An empty machine.
    pub fn new(grains: &Grains) -> GrainCrop {
        let mut crop = GrainCrop {
            inside: Vec::new(),
            random: u64::from(grains.seed),
            next: 0.0,
            steps: 0,
            fed: 0.0,
            passed: Passed::default(),
        };
        crop.next = crop.draw_radius(grains);
        crop
    }

    fn draw(&mut self) -> f64 {
        let mut random = SplitMix64(self.random);
        let drawn = random.symmetric();
        self.random = random.0;
        drawn
    }

    fn draw_radius(&mut self, grains: &Grains) -> f64 {
        grains.radius * (1.0 + grains.spread * self.draw())
    }

    pub fn inside(&self) -> &[Grain] {
        &self.inside
    }

    pub fn take_passed(&mut self) -> Passed {
        std::mem::take(&mut self.passed)
    }

    /// Mass in the machine \[kg\].
    pub fn mass(&self, grains: &Grains) -> f64 {
        self.inside.iter().map(|g| grains.mass(g.radius).0).sum()
    }

    /// Kinetic energy of the grains in the machine \[J\].
    pub fn energy(&self, simulation: &Simulation, grains: &Grains) -> f64 {
        let each = self.inside.iter();
        each.map(|g| kinetic(simulation, grains, g)).sum()
    }

    /// Angular momentum of the grains in the machine about the axle [N m s].
    pub fn spin(&self, simulation: &Simulation, grains: &Grains) -> f64 {
        let each = self.inside.iter();
        each.map(|g| spin(simulation, grains, g)).sum()
    }

    /// Notes the grains whose numbers are in `met`.
    pub fn note_met(&mut self, simulation: &Simulation, met: &[u32]) {
        if met.is_empty() {
            return;
        }
        for grain in self.inside.iter_mut().filter(|g| !g.met) {
            let number = simulation.number(grain.body);
            grain.met = number.is_some_and(|number| met.contains(&number));
        }
    }

    /// Mass that is due and has not entered \[kg\].
    pub fn waiting(&self, p: &Thresher, dt: f64) -> f64 {
        self.steps as f64 * dt * p.per_metre(p.feed_rate) - self.fed
    }

    /// Lets the grains in that are due in a step of `dt` \[s\]. `tips` is the radius of the tooth tips for
    /// which the concave is set \[m\].
    pub fn feed(
        &mut self,
        simulation: &mut Simulation,
        p: &Thresher,
        grains: &Grains,
        tips: f64,
        dt: f64,
    ) -> Result<(), StepError> {
        self.steps += 1;
        let out = unit(p.concave_start_deg);
        let along = turned(out);
        let inlet = out * (tips + p.clearance_inlet) - along * SPAWN;
        let feed = p.per_metre(p.feed_rate);
        // those near the inlet
        let reach = 4.0 * grains.radius * (1.0 + grains.spread) + p.entry_speed * dt;
        let mut near: Vec<(Vec2, f64)> = (self.inside.iter())
            .filter_map(|g| Some((simulation.pose(g.body)?.translation, g.radius)))
            .filter(|(at, _)| (at - inlet).dot(&along).abs() < reach)
            .collect();
        loop {
            let radius = self.next;
            let (mass, inertia) = grains.mass(radius);
            let early = (self.waiting(p, dt) - mass) / feed;
            if early < 0.0 {
                return Ok(());
            }
            let line = inlet + along * (p.entry_speed * early.min(dt));
            let room = 0.5 * p.crop_thickness - radius - CLEAR;
            let free = (0..TRIES).find_map(|_| {
                let height = 0.5 * p.crop_thickness + room * self.draw();
                let at = line - out * height;
                let apart = |(other, r): &(Vec2, f64)| (at - other).norm() > radius + r + CLEAR;
                near.iter().all(apart).then_some(at)
            });
            let Some(at) = free else {
                return Ok(());
            };
            let velocity = along * p.entry_speed;
            let (body, _) = simulation.add_body(
                Motion::Dynamic,
                Pose64::new(at, 0.0),
                Vec3::new(velocity.x, velocity.y, 0.0),
                &ShapeSpec::Ball { radius },
                &grain_surface(grains),
                Some(MassSpec::Given { mass, inertia }),
            )?;
            let grain = Grain {
                body,
                radius,
                met: false,
            };
            near.push((at, radius));
            self.inside.push(grain);
            self.fed += mass;
            self.passed.mass_in += mass;
            self.passed.energy_in += kinetic(simulation, grains, &grain);
            self.passed.spin_in += spin(simulation, grains, &grain);
            self.next = self.draw_radius(grains);
        }
    }

    /// Removes the grains that have left: `exit_distance` behind the outlet, thrown back past the table of
    /// the inlet, or behind the steel.
    pub fn remove_what_left(
        &mut self,
        simulation: &mut Simulation,
        p: &Thresher,
        grains: &Grains,
        tips: f64,
    ) {
        let GrainCrop { inside, passed, .. } = self;
        inside.retain(|grain| {
            let Some(pose) = simulation.pose(grain.body) else {
                return false;
            };
            let Some(way) = way_out(p, tips, pose.translation) else {
                return true;
            };
            let (mass, _) = grains.mass(grain.radius);
            match way {
                WayOut::Outlet => passed.mass_out += mass,
                WayOut::Inlet => passed.mass_back += mass,
                WayOut::Steel => passed.through_steel += 1,
            }
            passed.grains_out += 1;
            passed.met_out += usize::from(grain.met);
            passed.energy_out += kinetic(simulation, grains, grain);
            passed.spin_out += spin(simulation, grains, grain);
            simulation.remove_body(grain.body);
            false
        });
    }
}

/// Where a grain leaves the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum WayOut {
    Outlet,
    Inlet,
    /// Its centre is behind the concave or the table.
    Steel,
}

/// The way by which a grain with its centre at `at` has left, if it has.
fn way_out(p: &Thresher, tips: f64, at: Vec2) -> Option<WayOut> {
    let r = at.norm();
    let arc = p.concave_end_deg - p.concave_start_deg;
    let angle = at.y.atan2(at.x).to_degrees() - p.concave_start_deg;
    let angle = angle.rem_euclid(360.0);
    if angle < arc {
        return (r > tips + clearance(p, angle / arc)).then_some(WayOut::Steel);
    }
    let out = unit(p.concave_start_deg);
    let before = -turned(out).dot(&at);
    let behind = out.dot(&at) > tips + p.clearance_inlet;
    if behind && (0.0..TABLE).contains(&before) {
        return Some(WayOut::Steel);
    }
    if angle < 0.5 * (arc + 360.0) {
        let far = (tips + p.clearance_outlet).hypot(p.exit_distance);
        return (r > far).then_some(WayOut::Outlet);
    }
    (r > (tips + p.clearance_inlet).hypot(TABLE)).then_some(WayOut::Inlet)
}

fn kinetic(simulation: &Simulation, grains: &Grains, grain: &Grain) -> f64 {
    let (mass, inertia) = grains.mass(grain.radius);
    simulation.velocity(grain.body).map_or(0.0, |u| {
        0.5 * (mass * u.xy().norm_squared() + inertia * u.z * u.z)
    })
}

fn spin(simulation: &Simulation, grains: &Grains, grain: &Grain) -> f64 {
    let (mass, inertia) = grains.mass(grain.radius);
    spin_of(simulation, grain.body, mass, inertia)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grains_leave_by_the_outlet_the_inlet_or_through_steel() {
        let p = Thresher::default();
        let at = |degrees: f64, r: f64| way_out(&p, p.tip_radius, unit(degrees) * r);
        // the concave lies from 215 to 325 degrees, 16 to 8 mm from the tips at 0.25 m
        assert_eq!(at(270.0, 0.2619), None);
        assert_eq!(at(270.0, 0.2621), Some(WayOut::Steel));
        assert_eq!(at(0.0, 0.32), None);
        assert_eq!(at(0.0, 0.33), Some(WayOut::Outlet));
        // at 160 degrees above the table of the inlet, at 180 behind it
        assert_eq!(at(160.0, 0.32), None);
        assert_eq!(at(160.0, 0.34), Some(WayOut::Inlet));
        assert_eq!(at(180.0, 0.34), Some(WayOut::Steel));
        let table = |height: f64| {
            let out = unit(p.concave_start_deg);
            way_out(
                &p,
                p.tip_radius,
                out * (0.266 - height) - turned(out) * SPAWN,
            )
        };
        assert_eq!(table(1e-4), None);
        assert_eq!(table(-1e-4), Some(WayOut::Steel));
    }
}
