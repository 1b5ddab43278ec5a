//! How well joints hold: gaps, their order, and energy over time.

use super::*;
use approx::assert_relative_eq;
use moreau2d::dynamics::{JointCoordinate as Axis, JointPart as Part};
use moreau2d::rapier::engine::dynamics::SpringCoefficients;
use std::f64::consts::PI;

/// Two rods, let go level; a worst gap, at midpoints and at the ends of steps.
fn swing(dt: f64, time: f64, events: bool) -> ([f64; 2], [f64; 2], f64) {
    let mut bench = Bench::new([0.0, -G], dt, events);
    let (ground, upper, lower) = (bench.ground(), bench.body(0.5, 0.0), bench.body(1.5, 0.0));
    let mut joint = RevoluteJointBuilder::new().build().into();
    bench.join(ground, upper, at(&mut joint, [0.0, 0.0], [-0.5, 0.0]));
    bench.join(upper, lower, at(&mut joint, [0.5, 0.0], [-0.5, 0.0]));
    let (mut middle, mut end, mut rise) = (0.0f64, 0.0f64, 0.0f64);
    for _ in 0..(time / dt).round() as usize {
        let record = bench.step();
        assert_eq!(record.joints_capped, 0);
        middle = middle.max(record.joint_gap);
        let energy = record.energy.kinetic_end + record.energy.potential_end;
        rise = rise.max(energy.abs());
        let [p, q] = [upper, lower].map(|k| bench.pipeline.pose(k).unwrap());
        let half = Vec2::new(0.5, 0.0);
        end = end.max(p.apply(-half).norm());
        end = end.max((q.apply(-half) - p.apply(half)).norm());
    }
    let [x, y, _] = bench.place(lower);
    ([middle, end], [x, y], rise)
}

#[test]
fn pins_of_a_double_pendulum_hold_at_order_two() {
    let rates = [240.0, 480.0, 960.0, 1920.0];
    let runs = rates.map(|rate| swing(1.0 / rate, 1.5, false));
    let gaps = runs.map(|(gap, _, _)| gap[0]);
    let p = order(&gaps);
    assert!((p - 2.0).abs() < 0.2, "order {p}: {gaps:?}");
    // what is shown has the pins closed, but for 1e-9 of an arm
    for ([middle, end], _, _) in runs {
        assert!(end < (1e-4 * middle).max(1e-9), "{middle} {end}");
    }
    let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let steps: Vec<f64> = (0..3).map(|k| apart(runs[k].1, runs[k + 1].1)).collect();
    let p = order(&steps);
    assert!((p - 2.0).abs() < 0.25, "trajectory, order {p}: {steps:?}");
    // its error is of third order, its rise in the first second of second
    let energy = runs.map(|(_, _, rise)| rise);
    assert!(order(&energy) > 1.8, "{energy:?}");
}

/// A minute at 1/240 s: all the energy, m g (1 + 3) = 40 J and J ω²/2, could turn a body by 18 rad/s, and
/// a gap of `(ω Δt)² r/2` is 1.4 mm.
#[test]
fn pins_of_a_double_pendulum_do_not_drift_in_a_minute() {
    for events in [false, true] {
        let ([middle, end], _, rise) = swing(1.0 / 240.0, 60.0, events);
        assert!(middle < 1.4e-3 && end < 1.4e-6, "{middle} {end}");
        assert!(rise < 0.02 * 40.0, "{rise}");
    }
}

#[test]
fn pins_at_rest_hold_to_a_nanometre() {
    let mut bench = Bench::down(1.0 / 240.0);
    let (ground, upper, lower) = (bench.ground(), bench.body(0.0, -0.5), bench.body(0.0, -1.5));
    let mut joint = RevoluteJointBuilder::new().build().into();
    bench.join(ground, upper, at(&mut joint, [0.0, 0.0], [0.0, 0.5]));
    bench.join(upper, lower, at(&mut joint, [0.0, -0.5], [0.0, 0.5]));
    for _ in 0..2400 {
        let record = bench.step();
        assert!(record.joint_gap < 1e-9);
    }
}

/// Bug: pins whose bodies turned by a radian in a step fed energy without end.
#[test]
fn a_pin_that_turns_a_radian_in_a_step_feeds_no_energy() {
    for (dt, spin) in [(1.0 / 60.0, 60.0), (1.0 / 30.0, 60.0), (1.0 / 30.0, 300.0)] {
        let mut bench = Bench::new([0.0, 0.0], dt, false);
        let ground = bench.ground();
        let bodies = [0.5, 1.5, 2.5].map(|x| bench.body(x, 0.0));
        let mut joint = RevoluteJointBuilder::new().build().into();
        let mut before = ground;
        for (k, &body) in bodies.iter().enumerate() {
            let first = if k == 0 { [0.0, 0.0] } else { [0.5, 0.0] };
            bench.join(before, body, at(&mut joint, first, [-0.5, 0.0]));
            before = body;
        }
        bench.world.bodies[bodies[2]].set_angvel(spin as Real, true);
        let start = 0.125 * spin * spin;
        for _ in 0..(20.0 / dt) as usize {
            let record = bench.step();
            let kinetic = record.energy.kinetic_end;
            assert!(kinetic <= 1.25 * start, "{dt} {spin}: {kinetic} of {start}");
        }
    }
}

/// A joint that is built half a metre apart is drawn together without a bang.
#[test]
fn a_joint_built_apart_is_closed_without_energy() {
    let mut bench = Bench::new([0.0, 0.0], DT, false);
    let (a, b) = (bench.body(0.0, 0.0), bench.body(1.5, 0.3));
    let mut joint = RevoluteJointBuilder::new().build().into();
    bench.join(a, b, at(&mut joint, [0.5, 0.0], [-0.5, 0.0]));
    let record = bench.run(0.1);
    assert!(record.joint_gap < 1e-9, "{}", record.joint_gap);
    assert!(record.energy.kinetic_end < 1e-12, "{:?}", record.energy);
}

/// A pendulum on a pin that moves by itself keeps the pin's way.
#[test]
fn joints_follow_a_body_that_moves_by_itself() {
    let mut bench = Bench::down(DT);
    let rail = RigidBodyBuilder::kinematic_velocity_based().linvel(vector([0.5, 0.0]));
    let rail = bench.world.bodies.insert(rail);
    let load = bench.body(0.0, -0.5);
    let mut joint = FixedJointBuilder::new().build().into();
    bench.join(rail, load, at(&mut joint, [0.0, 0.0], [0.0, 0.5]));
    bench.run(2.0);
    let [x, y, _] = bench.place(load);
    // half a step of the first one is spent to take up the speed
    assert_relative_eq!(x, 1.0, epsilon = 1e-9);
    assert_relative_eq!(y, -0.5, epsilon = 1e-9);
}

#[test]
fn a_softness_of_its_own_makes_springs_of_locked_axes() {
    let mut bench = Bench::down(DT);
    let (ground, load) = (bench.ground(), bench.body(0.0, 0.0));
    let softness = SpringCoefficients {
        natural_frequency: 2.0,
        damping_ratio: 1.0,
    };
    let joint = FixedJointBuilder::new().softness(softness).build();
    let id = bench.join(ground, load, joint);
    let record = bench.run(10.0);
    // g / ω², ω = 4π
    let sag = 10.0 / (4.0 * PI * 4.0 * PI);
    assert_relative_eq!(-bench.place(load)[1], sag, max_relative = 1e-5);
    let force = record.joint_force(id, Part::Lock(Axis::Y)).x;
    assert_relative_eq!(force, 20.0, max_relative = 1e-6);
}

/// A limit that is passed from the start is closed by position, without a launch.
#[test]
fn a_limit_passed_at_the_start_is_closed_without_energy() {
    let mut bench = Bench::new([0.0, 0.0], DT, false);
    let (ground, slider) = (bench.ground(), bench.body(0.5, 0.0));
    let joint = PrismaticJointBuilder::new(Vector::X).limits([-0.2, 0.2]);
    bench.join(ground, slider, joint.build());
    let (a, b) = (bench.body(0.0, 3.0), bench.body(1.5, 3.0));
    bench.join(a, b, RopeJointBuilder::new(1.0).build());
    let record = bench.run(0.1);
    assert_relative_eq!(bench.place(slider)[0], 0.2, epsilon = 1e-7);
    let apart = bench.place(b)[0] - bench.place(a)[0];
    assert_relative_eq!(apart, 1.0, epsilon = 1e-9);
    assert!(record.energy.kinetic_end < 1e-20, "{:?}", record.energy);
}
