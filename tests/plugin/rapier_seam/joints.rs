//! Joints between bodies of the peers' simulation.

use super::{DT, UNIT, at, pipeline, simulation, world};
use moreau2d::contact::{Vec2, Vec3};
use moreau2d::peers::{JointDrive, JointSpec, MassSpec, Motion, ShapeSpec, Surface};
use moreau2d::rapier::engine::prelude::*;

#[test]
fn a_motor_holds_its_speed_and_keeps_within_its_torque() {
    let rod = ShapeSpec::Box {
        half: Vec2::new(0.5, 0.05),
    };
    let inertia = 0.3;
    let spec = Some(MassSpec::Given { mass: 2.0, inertia });
    let mut s = simulation(0.0);
    let (body, _) = s
        .add_body(
            Motion::Dynamic,
            at(0.0, 0.0),
            Vec3::zeros(),
            &rod,
            &Surface::default(),
            spec,
        )
        .unwrap();
    let motor = JointDrive::Motor {
        speed: 4.0,
        max_force: 1.5,
    };
    s.add_joint(&JointSpec {
        drive: Some(motor),
        ..JointSpec::revolute([None, Some(body)], [Vec2::zeros(), Vec2::zeros()])
    })
    .unwrap();
    // spins up at T/J = 5 rad/s2 and reaches 4 rad/s after 0.8 s = 96 steps
    for k in 1..=60 {
        let record = s.step().unwrap();
        let expected = 1.5 / inertia * DT * f64::from(k);
        let spin = s.velocity(body).unwrap().z;
        assert!(
            (spin - expected).abs() < 1e-9,
            "step {k}: {spin} for {expected}"
        );
        assert!(record.energy.motors > 0.0);
    }
    for _ in 0..60 {
        s.step().unwrap();
    }
    let u = s.velocity(body).unwrap();
    assert!((u.z - 4.0).abs() < 1e-9, "{}", u.z);
    assert!(u.xy().norm() < 1e-9);
    assert!(s.pose(body).unwrap().translation.norm() < 1e-9);
}

#[test]
fn a_pendulum_stays_on_its_pin() {
    let mut s = simulation(-9.81);
    let bob = ShapeSpec::Ball { radius: 0.1 };
    let (body, _) = s
        .add_body(
            Motion::Dynamic,
            at(1.0, 0.0),
            Vec3::zeros(),
            &bob,
            &Surface::default(),
            UNIT,
        )
        .unwrap();
    let anchors = [Vec2::zeros(), Vec2::new(-1.0, 0.0)];
    s.add_joint(&JointSpec::revolute([None, Some(body)], anchors))
        .unwrap();
    let (mut worst, mut lowest) = (0.0f64, 0.0f64);
    for _ in 0..240 {
        s.step().unwrap();
        let p = s.pose(body).unwrap().translation;
        worst = worst.max((p.norm() - 1.0).abs());
        lowest = lowest.min(p.y);
    }
    // half of the bend (κ/2)(u Δt)² is left at midpoints, and half of that at the ends of steps;
    // u² = 2 m g l² / (J + m l²) at the bottom
    let bound = 1.0 / 8.0 * (2.0 * 9.81 / 1.2) * DT * DT;
    assert!(worst <= 1.01 * bound, "{worst} against {bound}");
    assert!(lowest < -0.99, "{lowest}");
}

#[test]
fn jointed_bodies_touch_only_if_the_joint_lets_them() {
    for enabled in [false, true] {
        let mut world = world(0.0);
        let body = |x: Real| RigidBodyBuilder::dynamic().translation(Vector::new(x, 0.0));
        let (a, _) = world.insert(body(0.0), ColliderBuilder::cuboid(0.5, 0.5));
        let (b, _) = world.insert(body(0.9), ColliderBuilder::cuboid(0.5, 0.5));
        let joint = RevoluteJointBuilder::new()
            .local_anchor1(Vector::new(0.45, 0.0))
            .local_anchor2(Vector::new(-0.45, 0.0))
            .contacts_enabled(enabled);
        world.insert_impulse_joint(a, b, joint);
        let record = pipeline().step(&mut world).unwrap();
        assert_eq!(!record.contacts.is_empty(), enabled);
    }
}
