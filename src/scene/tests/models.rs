//! Scenes of closed-form geometry and of constant matrices: what is refused, what they become.

use super::*;

const RODS: &str = r#"[scene]
name = "rods"
title = "A rod, a disc and a floor"
[[material]]
name = "steel"
[[body]]
name = "floor"
kind = "fixed"
line = true
[[body]]
name = "rod"
rod = 2
mass = 3
position = [0, 1]
touches = ["floor"]
[[body]]
name = "disc"
disc = 0.5
"#;

const SWING: &str = r#"[scene]
name = "swing"
title = "Two masses and a wall"
[linear]
coordinates = ["x", "y"]
mass = [[2, 1], [1, 3]]
velocity = [1, 0]
[[linear.contact]]
name = "wall"
gap = 0.1
normal = [-1, 0]
"#;

#[test]
fn shapes_choose_the_model() {
    let rods = parse(RODS, &[]).unwrap();
    assert_eq!(rods.model(), Model::Planar);
    assert_eq!(rods.bodies[1].touches, Some(vec![0]));
    assert_eq!(rods.bodies[1].mass_and_inertia(), Some((3.0, 1.0)));
    assert_eq!(rods.build().unwrap().bodies(), 3);
    assert_eq!(parse(BALL, &[]).unwrap().model(), Model::Rapier);
    let swing = parse(SWING, &[]).unwrap();
    assert_eq!(swing.model(), Model::Linear);
    let built = swing.build().unwrap();
    assert_eq!(built.bodies(), 2);
    assert_eq!(built.state(0).map(|(_, u)| u.x), Some(1.0));
    assert_eq!((built.state(2), built.number(0)), (None, None));
}

#[test]
fn mass_of_rods_discs_and_boxes_is_spread_evenly() {
    let of = |shape: &str| {
        let text = RODS.replacen("disc = 0.5", shape, 1);
        parse(
            &text.replacen("touches = [\"floor\"]", "touches = []", 1),
            &[],
        )
        .unwrap()
        .bodies[2]
            .mass_and_inertia()
            .unwrap()
    };
    let (m, j) = of("disc = 0.5\ndensity = 8");
    // a few roundings of π r² and r²/2
    assert!((m - 2.0 * std::f64::consts::PI).abs() < 1e-14 && (j / m - 0.125).abs() < 1e-15);
    assert_eq!(of("box = [2, 4]\nmass = 3"), (3.0, 5.0));
    assert_eq!(of("box = [2, 4]\nmass = 3\ninertia = 7"), (3.0, 7.0));
}

#[test]
fn shapes_without_a_closed_form_are_told() {
    let disc = "disc = 0.5\n";
    let cases = [
        (
            "mass = 3\n",
            "",
            "10:1: body.rod: missing key `mass (a rod has no area",
        ),
        (
            "mass = 3",
            "density = 3",
            "13:1: body.rod.density: a rod has no area; give its mass",
        ),
        (
            "rod = 2",
            "rod = -2",
            "12:1: body.rod.rod = -2.0: allowed is 1e-6 to 1e6 m",
        ),
        (
            "line = true",
            "line = false",
            "9:1: body.floor.line: `line = false` says nothing",
        ),
        (
            "line = true",
            "bowl = 0",
            "body.floor.bowl = 0.0: allowed is 1e-6 to 1e6 m",
        ),
        (
            "line = true",
            "bowl = 2\nline = true",
            "a body has one shape; `line` is given already",
        ),
        (
            "kind = \"fixed\"\n",
            "",
            "8:1: body.floor.line: a line has no mass; use kind = \"fixed\" or \"kinematic\"",
        ),
        (
            disc,
            "capsule = [1, 1]\n",
            "18:1: body.disc.capsule: a capsule in a scene with a rod, a line or a bowl is not \
             supported yet; supported: disc, box, rod, line and bowl",
        ),
        (
            "touches = [\"floor\"]\n",
            "",
            "body.disc: `rod` and `disc` could meet, and their gap has no closed form here; say \
             with `touches`",
        ),
        (
            "touches = [\"floor\"]",
            "touches = [\"flor\"]",
            "15:12: body.rod.touches.0: unknown body `flor`; did you mean `floor`?",
        ),
        (
            disc,
            "disc = 0.5\noscillation = { amplitude = [0, 1], angular_frequency = 1 }\n",
            "19:1: body.disc.oscillation: only a kinematic body swings by itself",
        ),
        (
            "kind = \"fixed\"",
            "kind = \"kinematic\"\noscillation = { amplitude = [0, 1], angular_frequency = 0 }",
            "oscillation.angular_frequency = 0.0: allowed is 1e-6 to 1e6 rad/s",
        ),
        (
            "name = \"steel\"",
            "name = \"steel\"\nstiffness = 1e6",
            "6:1: material.steel.stiffness: contacts in a scene with a rod, a line or a bowl are",
        ),
    ];
    for (old, new, expected) in cases {
        refused(RODS, old, new, expected);
    }
}

#[test]
fn bodies_that_start_behind_a_surface_are_told() {
    let disc = "disc = 0.5\n";
    let behind = "disc = 0.5\nposition = [0, -2]\n";
    let expected = "body.disc: `disc` starts 2.5 m behind the surface of `floor`";
    refused(RODS, disc, behind, expected);
    let bowl = RODS.replacen("line = true", "bowl = 3", 1);
    let expected = "body.disc: `disc` starts 0.5 m behind the surface of `floor`";
    refused(&bowl, disc, "disc = 3.5\n", expected);
    let crowd = "disc = 0.5\n[[repeat]]\nof = \"disc\"\ncount = [1000]\nstep = [[1, 0]]\n";
    refused(
        RODS,
        disc,
        crowd,
        "body = 1002 bodies: allowed is 1 to 1000",
    );
    // a copy has no line of its own: all bodies are named
    let copies = "disc = 0.5\nposition = [0, -2]\n[[repeat]]\nof = \"disc\"\ncount = [2]\n\
                  step = [[9, 0]]\n";
    refused(RODS, disc, copies, "body: `disc[0]` starts 2.5 m behind");
}

#[test]
fn keys_of_closed_forms_are_known_only_to_them() {
    for (key, value) in [
        ("touches", "[\"floor\"]"),
        (
            "oscillation",
            "{ amplitude = [0, 1], angular_frequency = 1 }",
        ),
    ] {
        let new = format!("disc = 0.5\n{key} = {value}");
        let expected = format!("body.ball.{key}: {key} is known only to scenes with a rod");
        refused(BALL, "disc = 0.5", &new, &expected);
    }
}

#[test]
fn matrices_are_checked() {
    let mass = "mass = [[2, 1], [1, 3]]";
    let cases = [
        (
            "[\"x\", \"y\"]",
            "[]",
            "5:1: linear.coordinates = 0 coordinates: allowed is 1 to 3",
        ),
        (
            "[\"x\", \"y\"]",
            "[\"x\", \"x\"]",
            "there is already a coordinate named `x`",
        ),
        (
            mass,
            "mass = [[2, 1]]",
            "6:1: linear.mass: expected 2 rows, one a coordinate, found 1",
        ),
        (
            mass,
            "mass = [[2, 1], [1]]",
            "linear.mass.1: expected 2 numbers, one a coordinate",
        ),
        (
            mass,
            "mass = [[2, 1], [0, 3]]",
            "the matrix is not symmetric: row 1, column 0",
        ),
        (
            mass,
            "mass = [[2, 3], [3, 2]]",
            "linear.mass: the mass matrix must be positive definite",
        ),
        (
            mass,
            "mass = [[2, 1e13], [1e13, 3]]",
            "linear.mass.0.1 = 10000000000000.0: allowed is",
        ),
        (
            mass,
            "mas = [[2, 1], [1, 3]]",
            "unknown key `mas`; did you mean `mass`?",
        ),
        (
            "velocity = [1, 0]",
            "velocity = [1]",
            "7:1: linear.velocity: expected 2 numbers",
        ),
        (
            "[-1, 0]",
            "[0, 0]",
            "linear.contact.wall.normal: no coordinate moves the gap",
        ),
        (
            "[-1, 0]",
            "[-1, 0]\nfriction = 0.3",
            "missing key `tangent (friction needs it)`",
        ),
        (
            "[-1, 0]",
            "[-1, 0]\nrestitution = 2",
            "restitution = 2.0: allowed is 0 to 1",
        ),
        (
            "[linear]",
            "[gravity]\ny = -1\n[linear]",
            "[gravity] would have no effect",
        ),
        (
            "[linear]",
            "[study]\n[linear]",
            "linear: a scene is a [study] or a [linear], not both",
        ),
        (
            "[linear]",
            "[wear]\n[linear]",
            "[wear] needs a [study] or a [thresher]",
        ),
        (
            "[linear]",
            "[[body]]\nname = \"b\"\ndisc = 1\n[linear]",
            "body: [linear] makes its own bodies; [[body]] would have no effect",
        ),
    ];
    for (old, new, expected) in cases {
        refused(SWING, old, new, expected);
    }
}
