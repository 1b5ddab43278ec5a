//! Joints: what the keys mean, and what is refused.

use super::*;

fn with(joint: &str) -> String {
    format!("{BALL}[[joint]]\nbodies = [\"floor\", \"ball\"]\n{joint}\n")
}

fn joint(text: &str) -> Joint {
    parse(&with(text), &[]).unwrap().joints[0]
}

#[test]
fn defaults_are_those_that_are_stated() {
    let spring = joint("kind = \"spring\"\nanchors = [[0, 1], [3, 5]]\nstiffness = 20");
    assert_eq!(spring.length, 5.0);
    assert_eq!(spring.spring, [20.0, 0.0]);
    assert!(!spring.contacts && spring.limits.is_none());
    let rope = joint("kind = \"rope\"\nanchors = [[0, 1], [0, 2]]\nlength = 4\ncontacts = true");
    assert_eq!((rope.length, rope.contacts), (4.0, true));
    let slider = joint("kind = \"prismatic\"\nat = [0, 1]");
    assert_eq!(slider.axis, 0.0);
    let slider = joint("kind = \"pin-slot\"\nat = [0, 1]\naxis = [0, -3]");
    assert_eq!(slider.axis, -std::f64::consts::FRAC_PI_2);
    let servo = joint("kind = \"revolute\"\nat = [0, 1]\nmotor = { stiffness = 2 }");
    let motor = servo.motor.unwrap();
    assert_eq!((motor.target, motor.bound()), (None, f64::INFINITY));
}

/// Every kind becomes a joint that can be stepped, by both engines.
#[test]
fn every_kind_is_stepped_by_both_engines() {
    for text in [
        "kind = \"revolute\"\nat = [0, 1]\nlimits = [-1, 1]",
        "kind = \"revolute\"\nat = [0, 1]\nmotor = { speed = 1, max_torque = 5 }",
        "kind = \"prismatic\"\nat = [0, 1]\naxis = [0, 1]\nlimits = [0, 1]",
        "kind = \"prismatic\"\nat = [0, 1]\nmotor = { target = 0.5, stiffness = 9, max_force = 5 }",
        "kind = \"fixed\"\nat = [0, 1]",
        "kind = \"rope\"\nanchors = [[0, 3], [0, 1.5]]",
        "kind = \"spring\"\nanchors = [[0, 3], [0, 1]]\nstiffness = 1e4\ndamping = 10\nlimits = [1, 3]",
        "kind = \"pin-slot\"\nat = [0, 1]\naxis = [1, 1]\nmotor = { speed = 1, max_force = 5 }",
    ] {
        let scene = parse(&with(text), &[]).unwrap();
        let mut built = scene.build().unwrap();
        for _ in 0..20 {
            let record = built.step().unwrap();
            assert_eq!(record.unsolved, 0, "{text}");
            assert!(!record.joints.is_empty(), "{text}");
        }
        let mut peer = scene.build().unwrap();
        let simulation = peer.simulation_mut().unwrap();
        for _ in 0..20 {
            simulation.step_with_rapier();
        }
        let (_, bodies) = peer.simulation().unwrap();
        let (ours, _) = built.state(1).unwrap();
        let theirs = peer.simulation().unwrap().0.rapier_pose(bodies[1]).unwrap();
        let apart = (ours.translation - theirs.translation).norm();
        // both follow the same joint for 0.2 s; rapier in four substeps a step, softly
        assert!(apart < 0.02, "{text}: {apart}");
    }
}

#[test]
fn what_makes_no_joint_is_refused() {
    for (text, expected) in [
        ("kind = \"revolute\"", &["missing key `at`"][..]),
        (
            "kind = \"rope\"\nat = [0, 0]",
            &["joint.floor-ball.at", "at has no effect on a rope joint"],
        ),
        ("kind = \"rope\"", &["missing key `anchors"]),
        (
            "kind = \"spring\"\nanchors = [[0, 0], [0, 1]]",
            &["missing key `stiffness`"],
        ),
        (
            "kind = \"spring\"\nanchors = [[0, 0], [0, 1]]\nstiffness = -1",
            &["joint.floor-ball.stiffness = -1.0", "0 to 1e15"],
        ),
        (
            "kind = \"spring\"\nanchors = [[0, 0], [0, 1]]\nstiffness = 1\ndamping = nan",
            &["joint.floor-ball.damping = NaN", "finite"],
        ),
        (
            "kind = \"revolute\"\nat = [0, inf]",
            &["joint.floor-ball.at.1", "finite"],
        ),
        (
            "kind = \"revolute\"\nat = [0, 0]\naxis = [1, 0]",
            &["axis has no effect on a revolute joint"],
        ),
        (
            "kind = \"prismatic\"\nat = [0, 0]\naxis = [0, 0]",
            &["the axis has no direction"],
        ),
        (
            "kind = \"prismatic\"\nat = [0, 0]\nlimits = [1, -1]",
            &["the lower limit 1.0 is above the upper one -1.0"],
        ),
        (
            "kind = \"revolute\"\nat = [0, 0]\nlimits = [-4, 4]",
            &["a whole turn or more"],
        ),
        (
            "kind = \"fixed\"\nat = [0, 0]\nlimits = [0, 1]",
            &["limits has no effect on a fixed joint"],
        ),
        (
            "kind = \"fixed\"\nat = [0, 0]\nmotor = { speed = 1, max_torque = 1 }",
            &["motor has no effect on a fixed joint"],
        ),
        (
            "kind = \"revolute\"\nat = [0, 0]\nmotor = { speed = 1 }",
            &["missing key `max_torque`"],
        ),
        (
            "kind = \"prismatic\"\nat = [0, 0]\nmotor = { speed = 1, max_torque = 1 }",
            &["the motor of a prismatic joint has a max_force"],
        ),
        (
            "kind = \"revolute\"\nat = [0, 0]\nmotor = { max_torque = 1 }",
            &["missing key `speed or stiffness`"],
        ),
        (
            "kind = \"revolute\"\nat = [0, 0]\nmotor = { speed = 1, stiffness = 1 }",
            &["either a speed or a stiffness"],
        ),
        (
            "kind = \"revolute\"\nat = [0, 0]\nmotor = { speed = 1, max_torque = 1, damping = 1 }",
            &["damping needs a stiffness"],
        ),
        (
            "kind = \"revolute\"\nat = [0, 0]\nmotor = { speed = 1, max_torqe = 1 }",
            &["unknown key `max_torqe`", "did you mean `max_torque`?"],
        ),
        (
            "kind = \"prismatic\"\nat = [0, 0]\nlimit = [0, 1]",
            &["unknown key `limit`", "did you mean `limits`?"],
        ),
    ] {
        let error = error_of(&with(text), &[]);
        for part in expected {
            assert!(error.contains(part), "{text}\n  {error}\n  lacks {part}");
        }
    }
}

/// Closed-form geometry has pins only.
#[test]
fn scenes_with_a_rod_have_pins_only() {
    let scene = |joint: &str| {
        with(joint)
            .replace("disc = 0.5", "rod = 1\nmass = 1")
            .replace("box = [10, 1]", "line = true")
    };
    let pin = "kind = \"revolute\"\nat = [0, 1]";
    assert!(parse(&scene(pin), &[]).is_ok());
    for (joint, what) in [
        (format!("{pin}\nlimits = [-1, 1]"), "limits"),
        (format!("{pin}\nmotor = {{ stiffness = 1 }}"), "a spring"),
        ("kind = \"fixed\"\nat = [0, 1]".to_owned(), "a fixed joint"),
    ] {
        let error = error_of(&scene(&joint), &[]);
        assert!(
            error.contains(what) && error.contains("not supported"),
            "{error}"
        );
    }
}
