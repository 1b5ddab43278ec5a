//! A rapier world as the stepper sees it.

use super::bodies::Bodies;
use super::detection::{Detector, Hooks};
use super::engine::prelude::*;
use super::joints::Joints;
use super::shadow::thickness;
use crate::contact::{Vec2, Vec3};
use crate::dynamics::record::ContactRecord;
use crate::dynamics::{
    BodyRoles, Configuration, ContactPoint, Detection, JointRow, ModelError, MultibodyModel,
    Pose64, Shown,
};

/// A rapier world as a multibody model, for the duration of one step.
pub(super) struct RapierModel<'a> {
    pub world: &'a mut PhysicsWorld,
    /// Whether bodies may fall asleep.
    pub sleeps: bool,
    pub hooks: &'a dyn PhysicsHooks,
    pub bodies: &'a mut Bodies,
    pub detector: &'a mut Detector,
    pub joints: &'a Joints,
    pub gravity: Vec2,
    /// Length of the whole step \[s\].
    pub dt: f64,
}

impl RapierModel<'_> {
    /// Largest acceleration \[m/s²\] of any body by gravity and the user's forces.
    fn acceleration(&self) -> f64 {
        let gravity = self.gravity.norm();
        let all = self.bodies.list.iter().zip(&self.bodies.inverse_mass);
        all.filter(|(_, w)| **w != Vec3::zeros())
            .map(|(shadow, w)| {
                let load = &shadow.load;
                let pushed = match load.force == Vec2::zeros() {
                    true => 0.0,
                    false => load.force.norm() * w.xy().amax(),
                };
                gravity * load.scale.abs() + pushed
            })
            .fold(0.0, f64::max)
    }

    /// [`MultibodyModel::detect`], at the midpoint of a step of this length \[s\] or at any time.
    pub fn find(
        &mut self,
        dt: f64,
        step: Option<f64>,
        out: &mut Detection,
    ) -> Result<(), ModelError> {
        let acceleration = self.acceleration();
        if !acceleration.is_finite() {
            // the search for contacts would have no bound
            return Err(ModelError::Invalid(
                "a force is too large for the mass of its body: the acceleration is not finite"
                    .to_owned(),
            ));
        }
        let hooks = Hooks {
            hooks: self.hooks,
            world: self.world,
        };
        self.detector
            .detect(hooks, self.bodies, (acceleration, step), dt, out)?;
        self.joints.rows(self.bodies, self.dt, &mut out.joints);
        Ok(())
    }

    /// Whether contacts press on a sleeping body, which then has to wake before the step.
    pub fn wakes_sleepers<'a>(
        &mut self,
        found: &Detection,
        resting: impl Iterator<Item = &'a ContactRecord>,
    ) -> bool {
        if !self.sleeps && self.bodies.sleepers.is_empty() {
            return false;
        }
        let mut free = Vec::new();
        if !self.bodies.sleepers.is_empty() {
            free.resize(self.bodies.list.len(), Vec3::zeros());
            self.forces(0.0, &mut free);
            let masses = self.bodies.velocities.iter().zip(&self.bodies.inverse_mass);
            for (h, (u, w)) in free.iter_mut().zip(masses) {
                *h = u + h.component_mul(w) * self.dt;
            }
        }
        let drop = self.gravity.norm() * self.dt * self.dt;
        (self.bodies).note_contacts(found, resting, &free, drop, self.dt);
        self.bodies.sleepers.any_to_wake()
    }
}

impl MultibodyModel for RapierModel<'_> {
    fn roles(&self) -> Option<&BodyRoles> {
        Some(&self.bodies.roles)
    }

    fn revision(&self) -> Option<u64> {
        let laws = self.detector.revision()?;
        let (joints, bodies) = (self.joints.revision, self.bodies.numbering);
        // none of them ever falls, so that the sum changes with each
        Some(laws + joints + bodies + self.bodies.watch.revision)
    }

    fn set_resting(&mut self, resting: &[bool]) {
        self.bodies.resting.clear();
        self.bodies.resting.extend_from_slice(resting);
    }

    fn kinetic_energy(&self, velocities: &[Vec3]) -> Option<f64> {
        self.bodies.kinetic_energy(velocities)
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
            if self.bodies.inverse_mass[k] == Vec3::zeros() {
                continue;
            }
            let (w, load) = (self.bodies.list[k].inverse_mass, &self.bodies.list[k].load);
            let u = self.bodies.velocities[k];
            for i in 0..2 {
                if w[i] > 0.0 {
                    let pull = load.scale * self.gravity[i] - load.damping.0 * u[i];
                    h[i] = pull / w[i] + load.force[i];
                }
            }
            if w.z > 0.0 {
                h.z = load.torque - load.damping.1 * u.z / w.z;
            }
        }
    }

    fn shift(&mut self, body: usize, velocity: &Vec3, dt: f64) {
        self.bodies.shift(body, velocity, dt);
    }

    fn configuration(&self, body: usize) -> Configuration {
        self.bodies.list[body].pose.numbers()
    }

    fn centre(&self, body: usize) -> Option<Vec2> {
        let body = &self.bodies.list[body];
        Some(body.pose.apply(body.center))
    }

    fn half_width(&self, surface: u32) -> f64 {
        let Some((collider, _)) = self.world.colliders.get_unknown_gen(surface) else {
            return f64::INFINITY;
        };
        let body = collider.parent().and_then(|h| self.world.bodies.get(h));
        let width = match body.is_some_and(|body| body.is_dynamic()) {
            true => {
                let half = collider.shape().compute_local_aabb().half_extents();
                f64::from(half.x.min(half.y))
            }
            // infinite for meshes: terrain may be flat
            false => thickness(collider.shape()),
        };
        if width > 0.0 { width } else { f64::INFINITY }
    }

    fn set_configuration(&mut self, body: usize, configuration: &Configuration) {
        self.bodies.list[body].pose = Pose64::from_numbers(configuration);
    }

    fn detect(&mut self, dt: f64, out: &mut Detection) -> Result<(), ModelError> {
        self.find(dt, Some(self.dt), out)
    }

    fn reaches(&self, body: usize, moved: &Vec3) -> bool {
        self.detector.reaches(body as u32, moved)
    }

    fn detect_pairs(
        &mut self,
        pairs: &[[u32; 2]],
        dt: f64,
        out: &mut Detection,
    ) -> Result<(), ModelError> {
        let hooks = Hooks {
            hooks: self.hooks,
            world: self.world,
        };
        self.detector
            .detect_pairs(hooks, self.bodies, pairs, dt, out);
        Ok(())
    }

    fn detect_driven(
        &mut self,
        ends: &[Vec3],
        dt: f64,
        known: &[ContactPoint],
        out: &mut Detection,
    ) {
        let hooks = Hooks {
            hooks: self.hooks,
            world: self.world,
        };
        self.detector.detect_driven(hooks, (ends, dt), known, out);
    }

    fn detect_joints(&mut self, _dt: f64, out: &mut Vec<JointRow>) -> Result<(), ModelError> {
        self.joints.rows(self.bodies, self.dt, out);
        Ok(())
    }

    fn potential_energy(&self) -> f64 {
        self.bodies
            .list
            .iter()
            .map(|shadow| {
                let w = shadow.inverse_mass;
                let scale = shadow.load.scale;
                let center = shadow.pose.apply(shadow.center);
                let of = |i: usize| match w[i] > 0.0 {
                    true => -scale * self.gravity[i] * center[i] / w[i],
                    // changes no sum
                    false => -0.0,
                };
                of(0) + of(1)
            })
            .sum()
    }

    fn show(&mut self, shown: &[Shown]) {
        self.bodies.list.iter_mut().for_each(|s| s.shown = None);
        for own in shown {
            let (k, body) = (own.body as usize, &mut self.bodies.list[own.body as usize]);
            let mut pose = body.pose;
            pose.advance(&own.displacement, body.center, 1.0);
            body.shown = Some((pose, self.bodies.velocities[k] + own.velocity));
        }
    }

    fn end_step(&mut self) {
        self.bodies.write(self.world, true);
        self.world
            .bodies
            .propagate_modified_body_positions_to_colliders(&mut self.world.colliders);
    }
}
