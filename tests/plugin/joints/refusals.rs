//! What is no joint is refused, and what holds nothing is no row.

use super::*;
use approx::assert_relative_eq;
use moreau2d::dynamics::StepError;
use moreau2d::rapier::engine::dynamics::SpringCoefficients;
use std::f64::consts::FRAC_PI_2;

#[test]
fn what_is_no_joint_is_refused_by_number_and_name() {
    let refused = |joint: GenericJoint, what: &[&str]| {
        let mut bench = Bench::down(DT);
        let (ground, body) = (bench.ground(), bench.body(0.5, 0.0));
        bench.join(ground, body, joint);
        let error = bench.pipeline.step(&mut bench.world).unwrap_err();
        assert!(matches!(error, StepError::Model(_)), "{error:?}");
        let text = error.to_string();
        for part in what.iter().chain(&["joint 0"]) {
            assert!(text.contains(part), "{part}: {text}");
        }
    };
    let revolute = RevoluteJointBuilder::new;
    let pin: GenericJoint = revolute().build().into();
    let free = || GenericJointBuilder::new(JointAxesMask::empty());
    refused(
        free().coupled_axes(JointAxesMask::LIN_X).build(),
        &["generic", "coupling", "not supported"],
    );
    refused(
        GenericJointBuilder::new(JointAxesMask::LIN_Y)
            .coupled_axes(JointAxesMask::LIN_AXES)
            .build(),
        &["locked and coupled"],
    );
    let mut rope: GenericJoint = RopeJointBuilder::new(1.0).build().into();
    rope.set_limits(JointAxis::LinY, [0.0, 1.0]);
    refused(rope, &["rope", "second"]);
    let mut askew = pin;
    askew.local_frame2.translation.x = Real::NAN;
    refused(askew, &["revolute", "body 2", "not finite"]);
    let mut askew = pin;
    askew.local_frame1.rotation = Rotation::from_cos_sin_unchecked(0.0, 0.0);
    refused(askew, &["body 1", "not finite"]);
    refused(
        revolute().limits([1.0, -1.0]).build().into(),
        &["limits of Angle", "1 and -1"],
    );
    refused(
        revolute().limits([Real::NAN, 1.0]).build().into(),
        &["limits of Angle", "NaN"],
    );
    refused(
        PrismaticJointBuilder::new(Vector::X)
            .motor_position(0.0, -5.0, 0.0)
            .build()
            .into(),
        &["prismatic", "motor of X", "stiffness is -5"],
    );
    refused(
        SpringJointBuilder::new(1.0, 1.0, -1.0).build().into(),
        &["spring", "damping is -1"],
    );
    refused(
        revolute()
            .motor_velocity(Real::INFINITY, 1.0)
            .build()
            .into(),
        &["target velocity is inf"],
    );
    refused(
        revolute()
            .motor_velocity(1.0, 1.0)
            .motor_max_force(-1.0)
            .build()
            .into(),
        &["largest force is -1"],
    );
    let softness = SpringCoefficients {
        natural_frequency: 5.0,
        damping_ratio: 1.0,
    };
    refused(
        revolute()
            .softness(softness)
            .limits([-1.0, 1.0])
            .build()
            .into(),
        &["softness of its own"],
    );
    let negative = SpringCoefficients {
        damping_ratio: -1.0,
        ..softness
    };
    refused(
        revolute().softness(negative).build().into(),
        &["damping ratio -1"],
    );
}

/// A whole turn is no limit, and a joint that is switched off holds nothing.
#[test]
fn what_holds_nothing_is_no_row() {
    let mut bench = Bench::down(DT);
    let (ground, body) = (bench.ground(), bench.body(0.0, 0.0));
    let joint = RevoluteJointBuilder::new().limits([-4.0, 4.0]).build();
    bench.join(ground, body, joint);
    let handle = bench.world.impulse_joints.iter().next().unwrap().0;
    assert_eq!(bench.step().joints.len(), 1);
    let joint = bench.world.impulse_joints.get_mut(handle, true).unwrap();
    joint.data.set_enabled(false);
    let record = bench.run(0.1);
    assert!(record.joints.is_empty());
    assert!(bench.place(body)[1] < -0.04);
    // rows that nothing can move are none either: a weld of a body that cannot turn
    let body = bench.body(0.0, 3.0);
    bench.world.bodies[body].set_locked_axes(LockedAxes::ROTATION_LOCKED, true);
    let mut weld = FixedJointBuilder::new().build().into();
    bench.join(ground, body, at(&mut weld, [0.0, 3.0], [0.0, 0.0]));
    let record = bench.run(0.1);
    assert_eq!(record.joints.len(), 1);
    assert_relative_eq!(bench.place(body)[1], 3.0, epsilon = 1e-9);
    assert_eq!(bench.place(body)[2].rem_euclid(FRAC_PI_2), 0.0);
}
