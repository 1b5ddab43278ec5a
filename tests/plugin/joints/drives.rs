//! Springs, dampers and motors in motion, against closed forms.

use super::*;
use approx::assert_relative_eq;
use moreau2d::dynamics::{JointCoordinate as Axis, JointPart as Part};
use std::f64::consts::TAU;

/// m g / k below its rest length, and no lower.
#[test]
fn a_spring_at_rest_is_stretched_by_the_weight() {
    for model in [MotorModel::ForceBased, MotorModel::AccelerationBased] {
        let mut bench = Bench::down(DT);
        let (ground, load) = (bench.ground(), bench.body(0.0, -1.0));
        let joint = SpringJointBuilder::new(0.5, 400.0, 60.0)
            .spring_model(model)
            .build();
        let id = bench.join(ground, load, joint);
        let record = bench.run(20.0);
        // per mass k is 400 1/s²
        let stretch = match model {
            MotorModel::ForceBased => 20.0 / 400.0,
            MotorModel::AccelerationBased => 10.0 / 400.0,
        };
        let y = bench.place(load)[1];
        assert_relative_eq!(-y - 0.5, stretch, max_relative = 1e-6);
        let force = record.joint_force(id, Part::Drive(Axis::Distance)).x;
        assert_relative_eq!(force, -20.0, max_relative = 1e-6);
    }
}

/// Two bodies on a spring: `x = x₀ cos ω t`, `ω² = 2 k/m`, and damped by `c` as `e^{−δt}`.
#[test]
fn springs_and_dampers_converge_at_order_two_and_gain_nothing() {
    for damping in [0.0, 8.0] {
        let errors: Vec<f64> = [60.0, 120.0, 240.0, 480.0]
            .into_iter()
            .map(|rate| {
                let mut bench = Bench::new([0.0, 0.0], 1.0 / rate, false);
                let (a, b) = (bench.body(0.0, 0.0), bench.body(1.25, 0.0));
                let joint = SpringJointBuilder::new(1.0, 100.0, damping as Real);
                bench.join(a, b, joint.build());
                bench.run(2.0);
                let (k, m, c) = (100.0f64, 2.0, damping);
                let (delta, omega0) = (c / m, (2.0 * k / m).sqrt());
                let omega = (omega0 * omega0 - delta * delta).sqrt();
                let (sin, cos) = (2.0 * omega).sin_cos();
                let x = 0.25 * (-2.0 * delta).exp() * (cos + delta / omega * sin);
                let found = bench.place(b)[0] - bench.place(a)[0] - 1.0;
                (found - x).abs()
            })
            .collect();
        let p = order(&errors);
        assert!((p - 2.0).abs() < 0.2, "damping {damping}: {p}, {errors:?}");
    }
    // however stiff: no energy is made
    for stiffness in [1e2, 1e6, 1e10] {
        let mut bench = Bench::new([0.0, 0.0], 1.0 / 60.0, false);
        let (a, b) = (bench.body(0.0, 0.0), bench.body(1.001, 0.0));
        bench.join(
            a,
            b,
            SpringJointBuilder::new(1.0, stiffness as Real, 0.0).build(),
        );
        let stored = 0.5 * stiffness * 1e-6;
        for _ in 0..600 {
            let record = bench.step();
            // f32 places the second body to 1e-7 m
            assert!(record.energy.kinetic_end <= 1.01 * stored, "{stiffness}");
        }
    }
}

/// Alone a damper decays as it should at any step, and a strong one holds its speed.
#[test]
fn a_damper_decays_exactly() {
    for (damping, dt) in [(0.01, 0.1), (3.0, 0.1), (200.0, 0.1), (1e9, 0.1)] {
        let mut bench = Bench::new([0.0, 0.0], dt, false);
        let (ground, wheel) = (bench.ground(), bench.body(0.0, 0.0));
        // per mass: the rate is 1/s
        let joint = RevoluteJointBuilder::new().motor_velocity(2.0, damping as Real);
        bench.join(ground, wheel, joint.build());
        for k in 1..=5 {
            bench.step();
            let expected = 2.0 * (1.0 - (-damping * dt * f64::from(k)).exp());
            let spin = bench.pipeline.velocity(wheel).unwrap().z;
            assert_relative_eq!(spin, expected, max_relative = 1e-7);
        }
    }
}

/// What rapier itself does with a motor without gain: it drives, as hard as it may.
#[test]
fn a_motor_without_gain_holds_its_speed_as_in_rapier() {
    let mut bench = Bench::new([0.0, 0.0], DT, false);
    let (ground, wheel) = (bench.ground(), bench.body(0.0, 0.0));
    let joint = RevoluteJointBuilder::new().motor_velocity(3.0, 0.0);
    bench.join(ground, wheel, joint.build());
    bench.world.gravity = Vector::ZERO;
    let mut rapier = PhysicsWorld::new();
    rapier.gravity = Vector::ZERO;
    let ground = rapier.bodies.insert(RigidBodyBuilder::fixed());
    let properties = MassProperties::new(Vector::ZERO, 2.0, 0.25);
    let same = rapier
        .bodies
        .insert(RigidBodyBuilder::dynamic().additional_mass_properties(properties));
    rapier
        .impulse_joints
        .insert(ground, same, joint.build(), true);
    bench.run(0.2);
    for _ in 0..12 {
        rapier.step();
    }
    let spin = bench.pipeline.velocity(wheel).unwrap().z;
    assert_relative_eq!(spin, 3.0, max_relative = 1e-12);
    assert!((f64::from(rapier.bodies[same].angvel()) - 3.0).abs() < 1e-3);
}

/// A servo turns to its angle by the shorter way, and holds it against a load of k Δθ.
#[test]
fn a_position_motor_takes_the_shorter_way() {
    let mut bench = Bench::new([0.0, 0.0], DT, false);
    let (ground, wheel) = (bench.ground(), bench.body(0.0, 0.0));
    let target = 3.0;
    let joint = RevoluteJointBuilder::new()
        .motor_model(MotorModel::ForceBased)
        .motor_position(target as Real, 10.0, 3.0);
    bench.join(ground, wheel, joint.build());
    let turned = RigidBodyBuilder::dynamic().rotation(-3.0).build();
    let pose = *turned.position();
    bench.world.bodies[wheel].set_position(pose, true);
    let mut least = 0.0f64;
    for _ in 0..1200 {
        bench.step();
        let spin = bench.pipeline.velocity(wheel).unwrap().z;
        least = least.min(spin);
    }
    // 2π − 6 rad backwards, not 6 rad forwards
    assert!(least < -0.1, "{least}");
    let angle = bench.place(wheel)[2].rem_euclid(TAU);
    assert!((angle - target).abs() < 1e-6, "{angle}");
}

/// A motor that is not bounded does not fight the limit it runs into.
#[test]
fn a_motor_stops_at_its_limit() {
    let mut bench = Bench::down(DT);
    let (ground, slider) = (bench.ground(), bench.body(0.0, 0.0));
    let joint = PrismaticJointBuilder::new(Vector::X)
        .limits([-1.0, 0.7])
        .motor_velocity(2.0, 1e12);
    let id = bench.join(ground, slider, joint.build());
    let record = bench.run(1.0);
    assert_relative_eq!(bench.place(slider)[0], 0.7, epsilon = 1e-7);
    assert!(record.joint_force(id, Part::Upper(Axis::X)).x.abs() < 1e-6);
}

/// A motor between two free bodies: equal and opposite, its work the energy they have.
#[test]
fn a_motor_between_free_bodies_gives_its_work_and_no_momentum() {
    let mut bench = Bench::new([0.0, 0.0], DT, false);
    let (a, b) = (bench.body(-0.3, 0.0), bench.body(0.3, 0.1));
    let mut joint = RevoluteJointBuilder::new()
        .motor_velocity(4.0, 1e12)
        .motor_max_force(1.5)
        .build()
        .into();
    let joint = at(&mut joint, [0.3, 0.0], [-0.3, -0.1]);
    bench.join(a, b, joint);
    let (mut motors, mut pins) = (0.0, 0.0);
    for _ in 0..240 {
        let record = bench.step();
        motors += record.energy.motors;
        pins += record.energy.joints + record.energy.returned;
        let told: f64 = record.joints.iter().map(|j| j.work).sum();
        assert_relative_eq!(
            told,
            record.energy.joints + record.energy.motors,
            epsilon = 1e-14
        );
    }
    let [u, v] = [a, b].map(|k| bench.pipeline.velocity(k).unwrap());
    assert!((u.xy() + v.xy()).norm() < 1e-12);
    assert_relative_eq!(v.z - u.z, 4.0, max_relative = 1e-9);
    let kinetic = |u: moreau2d::contact::Vec3| u.xy().norm_squared() + 0.125 * u.z * u.z;
    assert_relative_eq!(motors + pins, kinetic(u) + kinetic(v), max_relative = 1e-12);
    assert!(pins.abs() < 1e-3 * motors, "{pins} of {motors}");
}
