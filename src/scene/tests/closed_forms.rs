//! A scene that its closed form does not describe is refused.

use super::*;

/// Flags that leave a scene of the catalogue without what its closed form takes for granted.
const MISFITS: &[(&str, &str, &str)] = &[
    ("sliding-block", "gravity.slope=0.1", "straight down"),
    ("sliding-block", "body.block.spin=1", "leaves the ground"),
    ("sliding-block", "body.block.linear_damping=1", "has a drag"),
    ("incline", "body.block.velocity=[1,0]", "moves at the start"),
    (
        "spinning-disc",
        "body.disc.velocity=[-9,0]",
        "does not slip",
    ),
    (
        "conveyor",
        "body.belt.surface_velocity=0",
        "surface_velocity",
    ),
    ("bouncing-ball", "body.floor.angle=0.1", "is not level"),
    (
        "bouncing-ball",
        "body.ball.position=[0,-1]",
        "above the floor",
    ),
    ("two-balls", "gravity.y=-1", "there is gravity"),
    ("two-balls", "reference.closed_form=beam", "no body left"),
    ("cradle", "material.steel.restitution=0.5", "restitution"),
    ("touching-balls", "body.striker.disc=0.4", "not equal"),
    ("elastic-gas", "material.steel.friction=0.1", "friction"),
    ("beam", "body.load.position=[3,0.55]", "not between"),
    ("three-discs", "body.top.disc=0.6", "not equal"),
    (
        "ladder",
        "body.wall.material=floor",
        "the wall has friction",
    ),
    ("block-on-slope", "gravity.slope=-0.5", "towards +x"),
    ("wedge", "gravity.slope=0.1", "straight down"),
    ("arch", "gravity.slope=0.1", "straight down"),
    ("capstan", "gravity.slope=0.1", "straight down"),
    ("bowl", "gravity.slope=0.1", "straight down"),
    ("stuck-rod", "gravity.slope=0.1", "straight down"),
    ("rocking-block", "body.block.angle=0", "one corner"),
    ("pendulum", "gravity.slope=0.1", "straight down"),
    ("falling-rod", "material.ice.friction=0.1", "friction"),
    ("painleve", "gravity.slope=0.1", "straight down"),
    (
        "riding-disc",
        "body.plate.oscillation.angular_frequency=20",
        "throws",
    ),
];

#[test]
fn a_closed_form_that_does_not_fit_is_refused() {
    for (scene, flag, expected) in MISFITS {
        let error = load(scene, &[(*flag).to_owned()]).unwrap_err().to_string();
        for part in ["reference.closed_form", "does not fit", expected] {
            assert!(
                error.contains(part),
                "{scene} {flag}\n  {error}\n  lacks {part}"
            );
        }
        // the same scene runs without the comparison
        let flags = [*flag, "reference.closed_form=none"].map(str::to_owned);
        let distinct: &[String] = if flag.starts_with("reference") {
            &flags[1..]
        } else {
            &flags
        };
        assert_eq!(load(scene, distinct).unwrap().reference, None, "{scene}");
    }
}
