//! Mechanisms of many joints: a parallelogram and a car.

use approx::assert_relative_eq;

fn scene(text: &str) -> moreau2d::scene::Built {
    let text = format!("[scene]\nname = \"odd\"\ntitle = \"odd\"\n{text}");
    moreau2d::scene::Scene::parse("t.toml", &text, &[])
        .unwrap()
        .build()
        .unwrap()
}

/// A parallelogram of three links is driven through its dead points: the coupler never turns,
/// although a linkage that closes on itself has a row more than it needs there.
#[test]
fn a_parallelogram_keeps_its_coupler_level() {
    let mut built = scene(
        r#"
[step]
dt = 0.005
[[body]]
name = "crank"
box = [0.5, 0.05]
angle = 1.5707963267948966
position = [0, 0.25]
[[body]]
name = "coupler"
box = [1, 0.05]
position = [0.5, 0.5]
[[body]]
name = "rocker"
box = [0.5, 0.05]
angle = 1.5707963267948966
position = [1, 0.25]
[[joint]]
kind = "revolute"
bodies = ["world", "crank"]
at = [0, 0]
motor = { speed = 3, max_torque = 1e4 }
[[joint]]
kind = "revolute"
bodies = ["crank", "coupler"]
at = [0, 0.5]
[[joint]]
kind = "revolute"
bodies = ["coupler", "rocker"]
at = [1, 0.5]
[[joint]]
kind = "revolute"
bodies = ["world", "rocker"]
at = [1, 0]
"#,
    );
    for _ in 0..90 {
        let record = built.step().unwrap();
        assert_eq!((record.unsolved, record.joints_capped), (0, 0));
        // (ω Δt)² r/4 of an arm of 0.25 m
        assert!(record.joint_gap < 1e-4, "{}", record.joint_gap);
        let (coupler, _) = built.state(1).unwrap();
        assert!(coupler.angle().abs() < 1e-3, "{}", coupler.angle());
    }
}

/// Two wheels on sprung hubs drive over a bump and go on at the speed of their motors.
#[test]
fn a_car_with_springs_and_motors_drives() {
    let mut text = r#"
[step]
dt = 0.016666666666666666
[[body]]
name = "road"
kind = "fixed"
polyline = [[60, 0], [4, 0], [3, 0.1], [2, 0], [-10, 0]]
[[body]]
name = "chassis"
box = [2, 0.4]
position = [-6, 1]
"#
    .to_owned();
    for (name, x) in [("rear", -6.7), ("front", -5.3)] {
        text += &format!(
            r#"
[[body]]
name = "hub-{name}"
disc = 0.05
mass = 20
position = [{x}, 0.36]
[[body]]
name = "wheel-{name}"
disc = 0.35
mass = 30
position = [{x}, 0.36]
[[joint]]
kind = "prismatic"
bodies = ["chassis", "hub-{name}"]
at = [{x}, 0.36]
axis = [0, 1]
limits = [-0.2, 0.25]
motor = {{ stiffness = 30000, damping = 2500 }}
[[joint]]
kind = "revolute"
bodies = ["hub-{name}", "wheel-{name}"]
at = [{x}, 0.36]
motor = {{ speed = -8, max_torque = 300 }}
"#
        );
    }
    let mut built = scene(&text);
    for _ in 0..600 {
        let record = built.step().unwrap();
        assert_eq!((record.unsolved, record.joints_capped), (0, 0));
        assert!(record.joint_gap < 2e-3, "{}", record.joint_gap);
        assert!(record.energy.imbalance().abs() < 1e-9 * record.energy.kinetic_end.max(1.0));
    }
    let (pose, velocity) = built.state(1).unwrap();
    assert!(pose.translation.x > 15.0, "{pose:?}");
    // rolling: speed 8 rad/s of wheels of 0.35 m, and the chassis may pitch a little still
    assert_relative_eq!(velocity.x, 2.8, max_relative = 1e-3);
    assert_relative_eq!(velocity.y, 0.0, epsilon = 1e-3);
}
