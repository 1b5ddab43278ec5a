//! Contacts that are left out of a step's problem because they would open, and are needed after all.

use crate::common::parse;
use moreau2d::experiment::Engine;

/// A heavy ball hits a light lever near its pivot at 1 m/s: the tip would go at 10 m/s, through the
/// stop that is farther than anything comes by itself.
#[test]
fn a_tip_that_is_thrown_at_a_stop_is_stopped() {
    let scene = parse(
        r#"
[scene]
name = "lever"
title = "A lever between a ball and a stop"
[gravity]
y = 0
[step]
time = 1
[[body]]
name = "lever"
density = 1
box = [2, 0.02]
position = [1, 0]
[[body]]
name = "ball"
density = 1e5
disc = 0.05
position = [0.2, -0.069]
velocity = [0, 1]
[[body]]
name = "stop"
kind = "fixed"
disc = 0.05
position = [1.9, 0.086]
[[joint]]
kind = "revolute"
bodies = ["world", "lever"]
at = [0, 0]
"#,
    );
    let mut built = scene.build().unwrap();
    let mut carried = false;
    for _ in 0..4 {
        let record = Engine::Moreau.step(&mut built).unwrap();
        assert_eq!(record.unsolved, 0, "at {} s", record.time);
        assert!(
            record.penetration < 2e-3,
            "at {} s: {} m",
            record.time,
            record.penetration
        );
        carried |= record.contacts.len() > 1;
    }
    // ball and stop press on it
    assert!(carried);
    let (lever, u) = built.state(0).unwrap();
    assert!(lever.angle() < 0.02, "{}", lever.angle());
    assert!(u.z.abs() < 0.1, "{u}");
}
