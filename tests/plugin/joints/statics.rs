//! What joints carry at rest, against statics.

use super::*;
use approx::assert_relative_eq;
use moreau2d::dynamics::{JointCoordinate as Axis, JointPart as Part};
use std::f64::consts::PI;

/// A lever of arm 0.5 m held level: m g l = 10 N m, and its weight on the pin.
#[test]
fn a_motor_holds_a_lever_and_gives_way_beyond_its_torque() {
    for (model, gain) in [
        (MotorModel::AccelerationBased, 1e12),
        (MotorModel::ForceBased, 1e12),
        (MotorModel::ForceBased, 0.0),
    ] {
        for swap in [false, true] {
            let mut bench = Bench::down(DT);
            let (ground, lever) = (bench.ground(), bench.body(0.75, 1.0));
            let mut joint = RevoluteJointBuilder::new()
                .motor_model(model)
                .motor_velocity(0.0, gain as Real)
                .motor_max_force(30.0)
                .build()
                .into();
            let joint = at(&mut joint, [0.25, 1.0], [-0.5, 0.0]);
            let id = if swap {
                bench.join(lever, ground, swapped(&joint))
            } else {
                bench.join(ground, lever, joint)
            };
            let sign = if swap { -1.0 } else { 1.0 };
            let record = bench.run(0.5);
            let torque = record.joint_force(id, Part::Drive(Axis::Angle)).x;
            assert_relative_eq!(torque, sign * 10.0, max_relative = 1e-6);
            let pin = record.joint_force(id, Part::Pin);
            assert!(pin.x.abs() < 1e-5, "{pin}");
            assert_relative_eq!(pin.y, sign * 20.0, max_relative = 1e-6);
            assert!(bench.place(lever)[2].abs() < 1e-6);
            // too weak: it carries all it can, and the lever falls
            let joint = bench.world.impulse_joints.iter().next().unwrap().0;
            let joint = bench.world.impulse_joints.get_mut(joint, true).unwrap();
            joint.data.set_motor_max_force(JointAxis::AngX, 4.0);
            let record = bench.run(0.2);
            let torque = record.joint_force(id, Part::Drive(Axis::Angle)).x;
            assert_relative_eq!(torque, sign * 4.0, max_relative = 1e-12);
            // J + m l² = 0.75: (10 - 4)/0.75 rad/s² for 0.2 s, from level
            let turned = bench.place(lever)[2];
            assert!((turned + 0.16).abs() < 2e-3, "{turned}");
        }
    }
}

#[test]
fn limits_of_a_pin_carry_a_lever_on_both_sides() {
    for events in [false, true] {
        for (limits, part, swap) in [
            ([0.0, 1.0], Part::Lower(Axis::Angle), false),
            ([-1.0, 0.0], Part::Upper(Axis::Angle), true),
            // both at once: locked
            ([0.0, 0.0], Part::Lock(Axis::Angle), false),
        ] {
            let mut bench = Bench::new([0.0, -G], DT, events);
            let (ground, lever) = (bench.ground(), bench.body(0.5, 0.0));
            let mut joint = RevoluteJointBuilder::new()
                .limits(limits.map(|x| x as Real))
                .build()
                .into();
            let joint = at(&mut joint, [0.0, 0.0], [-0.5, 0.0]);
            let id = if swap {
                bench.join(lever, ground, swapped(&joint))
            } else {
                bench.join(ground, lever, joint)
            };
            let record = bench.run(0.5);
            // it keeps the lever from turning clockwise, in the sense in which a limit pushes
            let carried = record.joint_force(id, part).x;
            assert_relative_eq!(carried, 10.0, max_relative = 1e-6);
            assert!(bench.place(lever)[2].abs() < 1e-7);
        }
    }
}

/// Falls onto its limit at 45 degrees below level, and stays there.
#[test]
fn a_lever_lands_on_its_limit_and_rests() {
    for events in [false, true] {
        let mut bench = Bench::new([0.0, -G], DT, events);
        let (ground, lever) = (bench.ground(), bench.body(0.5, 0.0));
        let mut joint = RevoluteJointBuilder::new()
            .limits([-PI as Real / 4.0, 1.0])
            .build()
            .into();
        let joint = at(&mut joint, [0.0, 0.0], [-0.5, 0.0]);
        let id = bench.join(ground, lever, joint);
        let mut lowest = 0.0f64;
        for _ in 0..240 {
            bench.step();
            lowest = lowest.min(bench.place(lever)[2]);
        }
        let record = bench.step();
        // an angle does not bend: the limit is met exactly, but for its own f32
        assert!(lowest > -PI / 4.0 - 1e-7, "{lowest}");
        assert!((bench.place(lever)[2] + PI / 4.0).abs() < 1e-7);
        let carried = record.joint_force(id, Part::Lower(Axis::Angle)).x;
        assert_relative_eq!(carried, 10.0 * (PI / 4.0).cos(), max_relative = 1e-6);
    }
}

/// A slider on an incline of 3 : 4, so that sin = 0.6 and cos = 0.8 of 20 N.
#[test]
fn a_slider_on_an_incline_stands_on_its_limit_or_its_motor() {
    let axis = vector([0.8, 0.6]);
    for (motor, swap) in [(false, false), (false, true), (true, false), (true, true)] {
        let mut bench = Bench::down(DT);
        let (ground, slider) = (bench.ground(), bench.body(0.0, 0.0));
        let mut joint = PrismaticJointBuilder::new(axis);
        joint = if motor {
            joint.motor_velocity(0.0, 1e12).motor_max_force(50.0)
        } else {
            joint.limits([0.0, 2.0])
        };
        let mut joint: GenericJoint = joint.build().into();
        // both frames along the incline: the slider itself stays level
        let joint = if swap {
            // seen from the slider the ground moves the other way
            if !motor {
                joint.set_limits(JointAxis::LinX, [-2.0, 0.0]);
            }
            let id = bench.join(slider, ground, swapped(&joint));
            (id, -1.0)
        } else {
            (bench.join(ground, slider, joint), 1.0)
        };
        let (id, sign) = joint;
        let record = bench.run(0.5);
        let part = match (motor, swap) {
            (true, _) => Part::Drive(Axis::X),
            (false, false) => Part::Lower(Axis::X),
            (false, true) => Part::Upper(Axis::X),
        };
        let along = record.joint_force(id, part).x;
        let expected = if motor { sign * 12.0 } else { 12.0 };
        assert_relative_eq!(along, expected, max_relative = 1e-6);
        let across = record.joint_force(id, Part::Lock(Axis::Y)).x;
        assert_relative_eq!(across, sign * 16.0, max_relative = 1e-6);
        let moment = record.joint_force(id, Part::Lock(Axis::Angle)).x;
        assert!(moment.abs() < 1e-5, "{moment}");
        let [x, y, angle] = bench.place(slider);
        assert!(x.hypot(y) < 1e-7 && angle.abs() < 1e-7, "{x} {y} {angle}");
    }
}

/// A cantilever of two bodies: the root carries both weights and their moment, the joint between
/// them one. On the ground, and on a body that stands still but could move by itself.
#[test]
fn a_fixed_joint_carries_force_and_moment() {
    for driven in [false, true] {
        for swap in [false, true] {
            let mut bench = Bench::down(DT);
            let root = if driven {
                let body = RigidBodyBuilder::kinematic_velocity_based();
                bench.world.bodies.insert(body)
            } else {
                bench.ground()
            };
            let (near, far) = (bench.body(0.5, 0.0), bench.body(1.5, 0.0));
            let mut ids = [0; 2];
            for (k, (a, b)) in [(root, near), (near, far)].into_iter().enumerate() {
                let first = if k == 0 { [0.0, 0.0] } else { [0.5, 0.0] };
                let mut joint = FixedJointBuilder::new().build().into();
                let joint = at(&mut joint, first, [-0.5, 0.0]);
                ids[k] = if swap {
                    bench.join(b, a, swapped(&joint))
                } else {
                    bench.join(a, b, joint)
                };
            }
            let record = bench.run(0.5);
            let sign = if swap { -1.0 } else { 1.0 };
            for (id, force, moment) in [(ids[0], 40.0, 40.0), (ids[1], 20.0, 10.0)] {
                let pin = record.joint_force(id, Part::Pin);
                assert_relative_eq!(pin.y, sign * force, max_relative = 1e-6);
                let carried = record.joint_force(id, Part::Lock(Axis::Angle)).x;
                assert_relative_eq!(carried, sign * moment, max_relative = 1e-6);
            }
            assert!(record.joint_gap < 1e-9, "{}", record.joint_gap);
        }
    }
}

#[test]
fn a_rope_carries_the_weight_when_taut_and_nothing_when_slack() {
    for swap in [false, true] {
        let mut bench = Bench::down(DT);
        let (ground, load) = (bench.ground(), bench.body(0.0, -1.0));
        let mut joint = RopeJointBuilder::new(1.5).build().into();
        // held above the centre of mass, so that the load hangs still
        let joint = at(&mut joint, [0.0, 0.25], [0.0, 0.25]);
        let id = if swap {
            bench.join(load, ground, swapped(&joint))
        } else {
            bench.join(ground, load, joint)
        };
        // 0.5 m to fall take 0.316 s
        let record = bench.run(0.3);
        let part = Part::Upper(Axis::Distance);
        assert_eq!(record.joint_force(id, part).x, 0.0);
        assert_relative_eq!(
            bench.pipeline.velocity(load).unwrap().y,
            -3.0,
            epsilon = 1e-9
        );
        let record = bench.run(0.2);
        assert_relative_eq!(record.joint_force(id, part).x, 20.0, max_relative = 1e-6);
        assert!((bench.place(load)[1] + 1.5).abs() < 1e-9);
    }
}

/// A pin that slides across a level slot of the ground: the slot carries the weight, and a spring
/// on it the load along it.
#[test]
fn a_pin_in_a_slot_carries_across_it_only() {
    for swap in [false, true] {
        let mut bench = Bench::new([3.0, -G], DT, false);
        let (ground, body) = (bench.ground(), bench.body(0.0, -0.5));
        let mut joint: GenericJoint = PinSlotJointBuilder::new(Vector::X)
            .local_anchor2(vector([0.0, 0.5]))
            .build()
            .into();
        joint.set_motor_position(JointAxis::LinX, 0.0, 600.0, 40.0);
        joint.set_motor_model(JointAxis::LinX, MotorModel::ForceBased);
        let id = if swap {
            // the slot is now on the body, which hangs askew: hold it level
            joint.lock_axes(JointAxesMask::ANG_X);
            bench.join(body, ground, swapped(&joint))
        } else {
            bench.join(ground, body, joint)
        };
        let sign = if swap { -1.0 } else { 1.0 };
        let mut mean = [0.0; 2];
        bench.run(60.0);
        let last = 4 * 120;
        for _ in 0..last {
            let record = bench.step();
            mean[0] += record.joint_force(id, Part::Drive(Axis::X)).x / f64::from(last);
            mean[1] += record.joint_force(id, Part::Lock(Axis::Y)).x / f64::from(last);
            assert!(record.joint_gap < 1e-3, "{}", record.joint_gap);
        }
        // the body still swings a little where nothing holds it level
        let slack = if swap { 1e-6 } else { 1e-2 };
        assert_relative_eq!(mean[0], -sign * 6.0, max_relative = slack);
        assert_relative_eq!(mean[1], sign * 20.0, max_relative = slack);
    }
}
