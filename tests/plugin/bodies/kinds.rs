//! Kinds of bodies: driven, disabled, changed, without mass.

use super::*;
use moreau2d::contact::{Vec2, Vec3};

/// A platform that is driven by its position carries what lies on it, and its velocity is that
/// of the way it makes in a step.
#[test]
fn a_platform_driven_by_position_carries_its_load() {
    let mut world = world(-9.81);
    let (plate, _) = world.insert(
        RigidBodyBuilder::kinematic_position_based(),
        ColliderBuilder::cuboid(5.0, 0.5),
    );
    let (load, _) = world.insert(
        free().translation(Vector::new(0.0, 1.0)),
        ColliderBuilder::cuboid(0.5, 0.5).friction(1.0),
    );
    let mut p = pipeline();
    steps(&mut p, &mut world, 30);
    // accelerates upwards with 2 m/s², stays then where it is
    let mut expected = 0.0;
    for k in 1..=60 {
        let t = f64::from(k) * DT;
        expected = t * t;
        world.bodies[plate].set_next_kinematic_translation(Vector::new(0.0, expected as Real));
        let record = steps(&mut p, &mut world, 1);
        if k > 5 {
            let force: f64 = record.contacts.iter().map(|c| c.impulse_n).sum::<f64>() / DT;
            // rapier's precision of a position, twice differenced
            let noise = if cfg!(feature = "f64") { 1e-9 } else { 4e-2 };
            near(force, G + 2.0, noise, "load");
        }
    }
    assert_eq!(world.bodies[plate].translation().y, expected as Real);
    let up = p.velocity(plate).unwrap().y;
    near(up, 2.0 * 59.5 * DT, 1e-3, "speed");
    let ride = p.pose(load).unwrap().translation.y - p.pose(plate).unwrap().translation.y;
    // gaps are closed at midpoints: at the ends of steps a Δt²/4 is left
    near(ride, 1.0, 0.51 * DT * DT, "ride");
    // no new target: it stands
    steps(&mut p, &mut world, 1);
    assert_eq!(p.velocity(plate).unwrap(), Vec3::zeros());
}

#[test]
fn a_body_driven_by_velocity_turns_about_its_centre() {
    let mut world = world(-9.81);
    let (body, _) = world.insert(
        RigidBodyBuilder::kinematic_velocity_based()
            .linvel(Vector::new(0.5, 0.0))
            .angvel(2.0),
        ColliderBuilder::cuboid(0.5, 0.5).translation(Vector::new(1.0, 0.0)),
    );
    let mut p = pipeline();
    steps(&mut p, &mut world, 60);
    let t = 60.0 * DT;
    let pose = p.pose(body).unwrap();
    near(pose.angle(), 2.0 * t, 1e-12, "angle");
    let centre = pose.apply(Vec2::new(1.0, 0.0));
    assert!((centre - Vec2::new(1.0 + 0.5 * t, 0.0)).norm() < 1e-12);
}

#[test]
fn the_kind_of_a_body_can_change() {
    use RigidBodyType::{Dynamic, Fixed, KinematicPositionBased, KinematicVelocityBased};
    let mut world = world(-9.81);
    let (body, _) = world.insert(free(), ColliderBuilder::ball(0.5));
    let mut p = pipeline();
    let mut speed = 0.0;
    let mut height = 0.0;
    for (kind, falls) in [
        (Dynamic, true),
        (KinematicVelocityBased, false),
        (Dynamic, true),
        (Fixed, false),
        (Dynamic, true),
        (KinematicPositionBased, false),
        (Dynamic, true),
    ] {
        world.bodies[body].set_body_type(kind, true);
        steps(&mut p, &mut world, 2);
        let (u, pose) = (p.velocity(body).unwrap(), p.pose(body).unwrap());
        if falls {
            // what is fixed or driven by its position has no velocity to go on with
            near(u.y, speed - 2.0 * G * DT, 1e-13, "speed");
        } else if kind == KinematicVelocityBased {
            near(u.y, speed, 0.0, "speed");
        } else {
            assert_eq!(u, Vec3::zeros());
            near(pose.translation.y, height, 1e-6, "height");
        }
        speed = u.y;
        height = pose.translation.y;
    }
}

/// Switched off it is not there, and stays where it was; switched on it goes on.
#[test]
fn disabled_bodies_are_not_there() {
    let mut world = world(-9.81);
    let (ground, _) = world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(5.0, 0.5));
    let at = |y| free().translation(Vector::new(0.0, y)).can_sleep(false);
    let (low, _) = world.insert(at(1.0), ColliderBuilder::cuboid(0.5, 0.5));
    let (high, _) = world.insert(at(2.0), ColliderBuilder::cuboid(0.5, 0.5));
    let mut p = pipeline();
    steps(&mut p, &mut world, 60);
    world.bodies[low].set_enabled(false);
    let kept = *world.bodies[low].position();
    steps(&mut p, &mut world, 120);
    assert_eq!(*world.bodies[low].position(), kept);
    assert_eq!((p.pose(low), p.number(low)), (None, None));
    near(p.pose(high).unwrap().translation.y, 1.0, 1e-6, "through it");
    world.bodies[high].set_translation(Vector::new(0.0, 4.0), true);
    world.bodies[low].set_enabled(true);
    steps(&mut p, &mut world, 240);
    near(p.pose(low).unwrap().translation.y, 1.0, 1e-6, "low");
    near(p.pose(high).unwrap().translation.y, 2.0, 1e-6, "on it");
    world.bodies[ground].set_enabled(false);
    steps(&mut p, &mut world, 30);
    assert!(p.pose(low).unwrap().translation.y < 0.8);
}

#[test]
fn disabled_colliders_touch_nothing() {
    let mut world = world(-9.81);
    world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(5.0, 0.5));
    let (body, collider) = world.insert(
        free()
            .translation(Vector::new(0.0, 1.0))
            .additional_mass(1.0),
        ColliderBuilder::ball(0.5),
    );
    let mut p = pipeline();
    steps(&mut p, &mut world, 30);
    near(p.pose(body).unwrap().translation.y, 1.0, 1e-6, "rests");
    world.colliders[collider].set_enabled(false);
    let record = steps(&mut p, &mut world, 30);
    assert!(record.contacts.is_empty());
    let fallen = 0.5 * G * (30.0 * DT) * (30.0 * DT);
    near(p.pose(body).unwrap().translation.y, 1.0 - fallen, 1e-6, "y");
}

/// A dynamic body without mass goes on at its velocity as in rapier: through floors, and pushing what
/// it meets like a wall. The world around it steps on.
#[test]
fn a_body_without_mass_is_carried_along_as_in_rapier() {
    let after = |ours: bool| {
        let mut world = PhysicsWorld::new();
        world.integration_parameters.dt = 1.0 / 120.0;
        let floor = RigidBodyBuilder::fixed().translation(Vector::new(0.0, -0.5));
        world.insert(floor, ColliderBuilder::cuboid(10.0, 0.5));
        let mut insert = |x: Real, y: Real, v: Vector, density: Real| {
            let body = RigidBodyBuilder::dynamic()
                .translation(Vector::new(x, y))
                .linvel(v);
            world
                .insert(body, ColliderBuilder::cuboid(0.5, 0.5).density(density))
                .0
        };
        let handles = [
            insert(-5.0, 4.0, Vector::new(1.0, 0.5), 0.0),
            insert(-2.0, 0.5, Vector::ZERO, 0.0),
            insert(0.0, 0.5, Vector::ZERO, 1.0),
            insert(-2.0, 2.0, Vector::ZERO, 1.0),
        ];
        let mut p = pipeline();
        for _ in 0..240 {
            match ours {
                true => assert_eq!(p.step(&mut world).unwrap().unsolved, 0),
                false => world.step(),
            }
        }
        handles.map(|h| world.bodies[h].translation())
    };
    let (ours, rapiers) = (after(true), after(false));
    for (k, (a, b)) in ours.iter().zip(&rapiers).enumerate() {
        // a rapier box sinks into the floor by some tenths of a millimetre
        assert!((a - b).length() < 2e-3, "body {k}: {a} and {b}");
    }
    assert!(
        (ours[0] - Vector::new(-3.0, 5.0)).length() < 1e-5,
        "{}",
        ours[0]
    );
}
