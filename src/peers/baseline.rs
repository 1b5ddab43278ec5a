//! rapier's own solver on the same world, with the same record.

use super::peer::{self, PeerContact, Surface};
use super::simulation::{BodyId, Simulation};
use crate::contact::Vec3;
use crate::dynamics::Pose64;
use crate::dynamics::record::StepRecord;
use crate::rapier::engine::prelude::*;
use crate::rapier::parry::utils::PoseOpt;
use crate::rapier::widen;
use std::fmt;
use std::time::Instant;

/// Settings of rapier's solver that determine how stiff its contacts are.
///
/// rapier resolves contacts as damped springs. It divides the step Δt into `substeps` of `h = Δt /
/// substeps`, each with `iterations` sweeps of projected Gauss-Seidel. The rows reduce a
/// penetration at the rate
/// ```text
/// ω / (h ω + 2 ζ),   ω = 2π f,   ζ = 10                                     (1)
/// ```
/// relative to the penetration, and are softened accordingly: the frequency f bounds the stiffness
/// of a contact, and the substeps determine how much of that stiffness is effective. Contacts with
/// a fixed body have a frequency of their own, here always rapier's ratio
/// [`BaselineSettings::FIXED_RATIO`] to the other.
///
/// # Source
/// rapier2d 0.36, `IntegrationParameters`: `contact_softness`, `static_contact_softness`,
/// `num_solver_iterations` (which are the substeps), `num_internal_pgs_iterations`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaselineSettings {
    /// Natural frequency f \[Hz\] of contacts between moving bodies.
    pub contact_frequency: f64,
    /// Substeps of a step; rapier calls them solver iterations.
    pub substeps: usize,
    /// Sweeps of projected Gauss-Seidel in a substep.
    pub iterations: usize,
}

impl BaselineSettings {
    /// Natural frequency of a contact at a fixed body over that of one between moving bodies.
    pub const FIXED_RATIO: f64 = 2.0;
    /// rapier's defaults.
    pub const DEFAULT: BaselineSettings = BaselineSettings {
        contact_frequency: 30.0,
        substeps: 4,
        iterations: 1,
    };
    /// The stiff preset of all comparisons, not tuned to any scene.
    pub const STIFF: BaselineSettings = BaselineSettings {
        contact_frequency: 500.0,
        substeps: 40,
        iterations: 1,
    };
}

impl Default for BaselineSettings {
    fn default() -> Self {
        BaselineSettings::DEFAULT
    }
}

/// All settings, as tables and charts print them.
impl fmt::Display for BaselineSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} Hz, x{} at fixed bodies, {} substeps, {} PGS",
            self.contact_frequency,
            BaselineSettings::FIXED_RATIO,
            self.substeps,
            self.iterations
        )
    }
}

impl Simulation {
    /// Applies rapier's solver settings to the world.
    pub fn set_baseline(&mut self, settings: &BaselineSettings) {
        let parameters = &mut self.world.integration_parameters;
        let fixed = settings.contact_frequency * BaselineSettings::FIXED_RATIO;
        parameters.contact_softness.natural_frequency = settings.contact_frequency as Real;
        parameters.static_contact_softness.natural_frequency = fixed as Real;
        parameters.num_solver_iterations = settings.substeps;
        parameters.num_internal_pgs_iterations = settings.iterations;
        self.hooks.belts = true;
        for &handle in self.hooks.speeds.keys() {
            if let Some(collider) = self.world.colliders.get_mut(handle) {
                collider.set_active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
            }
        }
    }

    /// One step of rapier's own solver.
    ///
    /// Contacts have rapier's impulses. Their position and gap are at the end of the step: they
    /// move with the bodies from where rapier found them, possibly in an earlier step (contact
    /// recycling). Their slip is `Δt γ_T` at the end of the step, as the velocity at its start is
    /// unknown.
    pub fn step_with_rapier(&mut self) -> StepRecord {
        let dt = widen(self.world.integration_parameters.dt);
        let before = (self.peer_records).then(|| peer::energies(&self.world));
        let start = Instant::now();
        self.world.step_with_events(&self.hooks, &());
        self.peer_seconds = start.elapsed().as_secs_f64();
        self.peer_time += dt;
        let Some(before) = before else {
            return StepRecord::default();
        };
        let mut record = peer::record(&self.world, self.peer_time, dt, before);
        for pair in self.world.narrow_phase.contact_pairs() {
            for manifold in pair.solver_manifolds() {
                contacts(&self.world, pair, manifold, &mut record);
            }
        }
        record
    }

    /// Wall time of the last step of rapier or another peer \[s\], without the time for the record.
    pub fn peer_seconds(&self) -> f64 {
        self.peer_seconds
    }

    /// Pose of a body's frame in rapier.
    pub fn rapier_pose(&self, body: BodyId) -> Option<Pose64> {
        let body = self.world.bodies.get(body.0)?;
        Some(Pose64::from_rapier(body.position()))
    }

    /// Velocity of a body's centre of mass in rapier.
    pub fn rapier_velocity(&self, body: BodyId) -> Option<Vec3> {
        let body = self.world.bodies.get(body.0)?;
        let v = body.linvel();
        Some(Vec3::new(v.x.into(), v.y.into(), body.angvel().into()))
    }
}

fn contacts(
    world: &PhysicsWorld,
    pair: &crate::rapier::engine::geometry::ContactPair,
    manifold: &crate::rapier::engine::geometry::ContactManifold,
    record: &mut StepRecord,
) {
    let colliders = [pair.collider1, pair.collider2];
    let parts = [manifold.subshape1, manifold.subshape2];
    let poses = [
        (manifold.subshape_pos1()).prepend_to(&peer::pose(world, colliders[0])),
        (manifold.subshape_pos2()).prepend_to(&peer::pose(world, colliders[1])),
    ];
    let normals = [manifold.local_n1, manifold.local_n2];
    for point in &manifold.points {
        let locals = [point.local_p1, point.local_p2];
        let touch = peer::touch(
            world,
            colliders,
            std::array::from_fn(|k| Surface {
                pose: poses[k],
                part: parts[k],
                point: locals[k],
                normal: normals[k],
            }),
        );
        let mut contact = PeerContact {
            colliders,
            cells: parts,
            touch,
            impulse_n: f64::from(point.data.impulse),
            impulse_t: 0.0,
            friction: f64::from(manifold.data.friction),
        };
        // rapier's friction always opposes the slip; its sign refers to rapier's own tangent
        let size = f64::from(point.data.tangent_impulse.x).abs();
        contact.impulse_t = -contact.slip_velocity(world).signum() * size;
        contact.add(world, record);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Vec2;

    /// "Default" is what rapier ships, in every release.
    #[test]
    fn the_default_is_rapiers_own() {
        let mut expected = IntegrationParameters::default();
        let mut simulation =
            Simulation::new(Default::default(), Vec2::new(0.0, -9.81), 0.01).unwrap();
        simulation.set_baseline(&BaselineSettings::DEFAULT);
        let found = simulation.world.integration_parameters;
        // a property of the scene, not of the solver
        expected.dt = found.dt;
        assert_eq!(found, expected);
    }

    /// A body of a ball or a compound of two boxes, pressed 1 mm into a floor and spun or slid:
    /// gaps belong to its pose at the end of every step, though rapier recycles its manifolds.
    #[test]
    fn gaps_and_places_are_of_the_end_of_the_step() {
        let feet = || {
            let foot = |x| (Pose::translation(x, 0.0), SharedShape::cuboid(0.1, 0.5));
            SharedShape::compound(vec![foot(-0.4), foot(0.4)])
        };
        for (shape, spin, speed) in [
            (SharedShape::ball(0.5), 20.0, 0.0),
            (SharedShape::ball(0.5), -3.0, 2.0),
            (feet(), 0.0, 0.7),
            (SharedShape::round_cuboid(0.3, 0.4, 0.1), 0.0, -0.7),
        ] {
            let kind = shape.shape_type();
            let mut simulation =
                Simulation::new(Default::default(), Vec2::new(0.0, -9.81), 0.01).unwrap();
            simulation.set_baseline(&BaselineSettings::DEFAULT);
            let world = &mut simulation.world;
            let floor = ColliderBuilder::cuboid(10.0, 1.0).translation(Vector::new(0.0, -1.0));
            world.colliders.insert(floor);
            let body = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.499));
            // a body with faces must not tilt, or the gaps of its two ends differ
            let upright = match spin == 0.0 {
                true => body.lock_rotations(),
                false => body.angvel(spin),
            };
            let body = (world.bodies).insert(upright.linvel(Vector::new(speed, 0.0)));
            let collider = ColliderBuilder::new(shape).friction(0.1);
            (world.colliders).insert_with_parent(collider, body, &mut world.bodies);
            let mut seen = 0;
            for _ in 0..30 {
                let record = simulation.step_with_rapier();
                let place = simulation.world.bodies[body].translation();
                for contact in &record.contacts {
                    seen += 1;
                    let gap = f64::from(place.y) - 0.5;
                    assert!(
                        (contact.gap - gap).abs() < 2e-6,
                        "{kind:?}: {} {gap}",
                        contact.gap
                    );
                    let side = (contact.position.x - f64::from(place.x)).abs();
                    // rapier keeps a point of the floor until the body has slid by 5 cm
                    assert!(side < 0.55, "{kind:?}: {side}");
                    let foot = matches!(kind, ShapeType::Compound);
                    assert!(!foot || side > 0.25, "{kind:?}: {side}");
                    assert!(contact.position.y.abs() < 2e-3, "{kind:?}");
                }
            }
            assert!(seen >= 30, "{kind:?}: {seen}");
        }
    }
}
