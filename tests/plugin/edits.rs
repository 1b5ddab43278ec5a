//! What a user does to a world between steps, in the corners: errors, sleep, tilted half-planes.

use crate::common::at;
use moreau2d::contact::{Vec2, Vec3};
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{DetectionDrive, MoreauPipeline, MoreauSettings, Pose64};
use std::sync::Mutex;

fn pipeline() -> MoreauPipeline {
    MoreauPipeline::new(MoreauSettings::default()).unwrap()
}

fn steps(p: &mut MoreauPipeline, world: &mut PhysicsWorld, n: usize) {
    for _ in 0..n {
        p.step(world).unwrap();
    }
}

/// A box asleep on a slab of this kind.
fn asleep(slab: RigidBodyBuilder) -> (PhysicsWorld, MoreauPipeline, [RigidBodyHandle; 2]) {
    let mut world = PhysicsWorld::new();
    let (slab, _) = world.insert(
        slab.translation(at(0.0, -0.5)),
        ColliderBuilder::cuboid(5.0, 0.5).density(1.0),
    );
    let (body, _) = world.insert(
        RigidBodyBuilder::dynamic().translation(at(0.0, 0.5)),
        ColliderBuilder::cuboid(0.5, 0.5).active_events(ActiveEvents::COLLISION_EVENTS),
    );
    let mut p = pipeline();
    steps(&mut p, &mut world, 200);
    assert!(world.bodies[body].is_sleeping());
    (world, p, [slab, body])
}

#[test]
fn a_mass_changed_beside_a_bad_collider_is_not_forgotten() {
    let mut world = PhysicsWorld::new();
    world.gravity = at(0.0, 0.0);
    let body = || RigidBodyBuilder::dynamic();
    let (bad, wrong) = world.insert(body().translation(at(9.0, 0.0)), ColliderBuilder::ball(0.5));
    let (good, right) = world.insert(body(), ColliderBuilder::ball(0.5));
    let (late, last) = world.insert(
        body().translation(at(-9.0, 0.0)),
        ColliderBuilder::ball(0.5),
    );
    let mut p = pipeline();
    steps(&mut p, &mut world, 1);
    let _ = (bad, late);
    for (changed, broken) in [(right, last), (right, wrong)] {
        let before = world.bodies[good].mass();
        let density = world.colliders[changed].density();
        world.colliders[changed].set_density(2.0 * density);
        let place = *world.colliders[broken].position_wrt_parent().unwrap();
        let nan = Pose::new(at(f64::NAN, 0.0), 0.0);
        world.colliders[broken].set_position_wrt_parent(nan);
        p.step(&mut world).unwrap_err();
        world.colliders[broken].set_position_wrt_parent(place);
        steps(&mut p, &mut world, 1);
        let ratio = world.bodies[good].mass() / before;
        assert!((ratio - 2.0).abs() < 1e-5, "{ratio}");
    }
}

#[test]
fn a_slab_that_becomes_dynamic_takes_its_sleeper_along() {
    for slab in [
        RigidBodyBuilder::fixed(),
        RigidBodyBuilder::kinematic_velocity_based(),
    ] {
        let (mut world, mut p, [slab, body]) = asleep(slab);
        world.bodies[slab].set_body_type(RigidBodyType::Dynamic, true);
        steps(&mut p, &mut world, 30);
        let y = p.pose(body).unwrap().translation.y;
        assert!(y < 0.0, "{y}");
    }
}

#[test]
fn who_is_placed_wakes_and_so_does_who_lay_on_it() {
    let (mut world, mut p, [slab, body]) = asleep(RigidBodyBuilder::fixed());
    let high = Pose64::new(Vec2::new(0.0, 3.0), 0.0);
    p.place(&mut world, body, high, Vec3::zeros()).unwrap();
    steps(&mut p, &mut world, 30);
    let y = p.pose(body).unwrap().translation.y;
    assert!(y < 2.0, "{y}");
    steps(&mut p, &mut world, 200);
    assert!(world.bodies[body].is_sleeping());
    let low = Pose64::new(Vec2::new(0.0, -5.0), 0.0);
    p.place(&mut world, slab, low, Vec3::zeros()).unwrap();
    steps(&mut p, &mut world, 30);
    let y = p.pose(body).unwrap().translation.y;
    assert!(y < 0.0, "{y}");
}

/// Bug: the side of a closed chain on which a body lay was kept when the user placed it on the other one, where nothing
/// held it.
#[test]
fn who_is_placed_inside_of_a_ring_stays_inside() {
    for exact in [false, true] {
        let mut world = PhysicsWorld::new();
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        let corners = corners.map(|[x, y]| at(x, y)).to_vec();
        let edges = vec![[0, 1], [1, 2], [2, 3], [3, 0]];
        world.insert(
            RigidBodyBuilder::fixed(),
            ColliderBuilder::polyline(corners, Some(edges)),
        );
        let (body, _) = world.insert(
            RigidBodyBuilder::dynamic().translation(at(0.0, 1.15)),
            ColliderBuilder::cuboid(0.1, 0.1),
        );
        let mut p = pipeline();
        steps(&mut p, &mut world, 30);
        let y = p.pose(body).unwrap().translation.y;
        assert!((y - 1.1).abs() < 1e-3, "outside, {y}");
        for (place, rests) in [([0.0, -0.8995], -0.9), ([0.0, 1.1005], 1.1)] {
            let place = Vec2::from(place);
            match exact {
                true => {
                    let pose = Pose64::new(place, 0.0);
                    p.place(&mut world, body, pose, Vec3::zeros()).unwrap();
                }
                false => {
                    world.bodies[body].set_translation(at(place.x, place.y), true);
                }
            }
            steps(&mut p, &mut world, 60);
            let y = p.pose(body).unwrap().translation.y;
            assert!(
                (y - rests).abs() < 1e-3,
                "placed at {place}, exact {exact}: {y}"
            );
        }
    }
}

#[derive(Default)]
struct Log(Mutex<Vec<CollisionEvent>>);

impl EventHandler for Log {
    fn handle_collision_event(
        &self,
        _: &RigidBodySet,
        _: &ColliderSet,
        event: CollisionEvent,
        _: Option<&ContactPair>,
    ) {
        self.0.lock().unwrap().push(event);
    }

    fn handle_contact_force_event(
        &self,
        _: Real,
        _: &RigidBodySet,
        _: &ColliderSet,
        _: &ContactPair,
        _: Real,
    ) {
    }

    fn handle_soft_body_tear_event(&self, _: &SoftBodySet, _: &SoftBodyTearEvent) {}
}

fn told(slab: RigidBodyBuilder) -> (PhysicsWorld, MoreauPipeline, [RigidBodyHandle; 2], Log) {
    let mut world = PhysicsWorld::new();
    let (slab, _) = world.insert(
        slab.translation(at(0.0, -0.5)),
        ColliderBuilder::cuboid(5.0, 0.5),
    );
    let (body, _) = world.insert(
        RigidBodyBuilder::dynamic().translation(at(0.0, 0.6)),
        ColliderBuilder::cuboid(0.5, 0.5).active_events(ActiveEvents::COLLISION_EVENTS),
    );
    let (mut p, log) = (pipeline(), Log::default());
    for _ in 0..240 {
        p.step_with_events(&mut world, &(), &log).unwrap();
    }
    assert!(world.bodies[body].is_sleeping());
    (world, p, [slab, body], log)
}

#[test]
fn who_sleeps_on_a_kinematic_slab_touches_on() {
    let (_, _, _, log) = told(RigidBodyBuilder::kinematic_velocity_based());
    let seen = log.0.lock().unwrap();
    assert_eq!(seen.len(), 1, "{seen:?}");
}

#[test]
fn a_sleeper_that_is_switched_off_touches_no_more() {
    let (mut world, mut p, [_, body], log) = told(RigidBodyBuilder::fixed());
    world.bodies[body].set_enabled(false);
    for _ in 0..3 {
        p.step_with_events(&mut world, &(), &log).unwrap();
    }
    let seen = log.0.lock().unwrap();
    assert_eq!(seen.len(), 2, "{seen:?}");
    assert!(seen[1].stopped());
}

/// A half-plane reaches to the end of the world: turned, it has gone a long way, of which a small
/// step of what comes near is no part to round-off.
#[test]
fn a_tilted_half_plane_carries() {
    for detection in [DetectionDrive::Exhaustive, DetectionDrive::Tree] {
        let mut world = PhysicsWorld::new();
        world.gravity = at(0.0, 0.0);
        let (ground, _) = world.insert(
            RigidBodyBuilder::fixed().rotation(0.5),
            ColliderBuilder::new(SharedShape::halfspace(Vector::Y)),
        );
        let radius = 0.005;
        let bodies: Vec<_> = (0..100)
            .map(|k| {
                let start = at(-0.5 * f64::from(k), 0.03 + 0.003 * f64::from(k));
                let body = RigidBodyBuilder::dynamic().translation(start);
                let body = body.linvel(at(0.0, -0.05));
                world.insert(body, ColliderBuilder::ball(radius as Real)).0
            })
            .collect();
        let settings = MoreauSettings {
            detection,
            ..MoreauSettings::default()
        };
        let mut p = MoreauPipeline::new(settings).unwrap();
        steps(&mut p, &mut world, 2);
        world.bodies[ground].set_rotation(Rotation::new(0.0), true);
        for _ in 0..400 {
            p.step(&mut world).unwrap();
            for body in &bodies {
                let y = p.pose(*body).unwrap().translation.y;
                assert!(y > radius - 1e-6, "{detection:?}: {y}");
            }
        }
    }
}

#[test]
fn a_half_plane_that_turns_carries() {
    for drive in [DetectionDrive::Exhaustive, DetectionDrive::Tree] {
        let mut world = PhysicsWorld::new();
        world.insert(
            RigidBodyBuilder::kinematic_velocity_based().angvel(0.01),
            ColliderBuilder::new(SharedShape::halfspace(Vector::Y)),
        );
        let (ball, _) = world.insert(
            RigidBodyBuilder::dynamic().translation(at(0.5, 1.0)),
            ColliderBuilder::ball(0.1),
        );
        let settings = MoreauSettings {
            detection: drive,
            ..MoreauSettings::default()
        };
        let mut p = MoreauPipeline::new(settings).unwrap();
        steps(&mut p, &mut world, 60);
        let y = p.pose(ball).unwrap().translation.y;
        assert!((0.09..0.2).contains(&y), "{drive:?}: {y}");
    }
}
