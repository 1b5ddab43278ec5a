//! What `[[wear]]` and `[life]` refuse, and what they resolve to.

use super::*;

const PIN: &str = r#"[scene]
name = "pin"
title = "A pin on a belt"
[[body]]
name = "belt"
kind = "fixed"
box = [1, 0.1]
surface_velocity = -0.5
[[body]]
name = "pin"
polygon = [[-0.01, 0], [0.01, 0], [0.01, 0.04], [-0.01, 0.04]]
position = [0, 0.05]
[[wear]]
body = "pin"
coefficient = 1e-13
[life]
duration = 1e6
"#;

#[test]
fn a_wearing_body_is_resolved() {
    let scene = parse(
        PIN,
        &["wear.pin.edges=[3, 0]", "jump=1e-5", "wear.pin.mass=true"],
    )
    .unwrap();
    let wear = &scene.wear[0];
    assert_eq!((wear.body, wear.edges), (1, Some([3, 0])));
    assert_eq!(wear.density, Some(1000.0));
    let life = scene.life.unwrap();
    assert_eq!((life.jump, life.settle), (1e-5, None));
    assert!(parse(BALL, &[]).unwrap().wear.is_empty());
}

const POLYGON: &str = "polygon = [[-0.01, 0], [0.01, 0], [0.01, 0.04], [-0.01, 0.04]]";
const OPEN: &str = "polyline = [[0.01, 0], [0, 0], [-0.01, 0]]\nmass = 1\ninertia = 1";

#[test]
fn wear_out_of_range_or_without_a_partner_is_refused_with_its_place() {
    for (old, new, expected) in [
        (
            "coefficient = 1e-13",
            "coefficient = -1e-13",
            "15:1: wear.pin.coefficient = -1e-13: allowed is 1e-30 to 1 m²/N",
        ),
        (
            "coefficient = 1e-13",
            "coefficient = 1e-13\nedges = [0, 4]",
            "16:1: wear.pin.edges = [0, 4]: allowed is 0 to 3, the edges of body `pin`",
        ),
        (
            "coefficient = 1e-13",
            "coefficient = 1e-13\nedges = [0]",
            "wear.pin.edges: expected an array of 2 numbers",
        ),
        (
            "coefficient = 1e-13",
            "coeficient = 1e-13",
            "did you mean `coefficient`?",
        ),
        (
            "coefficient = 1e-13",
            "coefficient = 1e-13\ncell = 1e-9",
            "16:1: wear.pin.cell = 1e-9: allowed is 1.2000e-5 to 4.0000e-2 m, from 10000 cells",
        ),
        (
            "coefficient = 1e-13",
            "coefficient = 1e-13\nedges = [3, 0]\ncell = 0.05",
            "17:1: wear.pin.cell = 0.05: allowed is 6.0000e-6 to 4.0000e-2 m",
        ),
        (
            "body = \"pin\"",
            "body = \"pinn\"",
            "14:1: wear.pinn.body: unknown body `pinn`; did you mean `pin`?",
        ),
        (
            "body = \"pin\"",
            "body = \"belt\"",
            "the surface of body `belt` moves along itself",
        ),
        (
            "[life]",
            "[[wear]]\nbody = \"pin\"\ncoefficient = 1\n[life]",
            "body `pin` has a [[wear]] already",
        ),
        (
            "[life]\nduration = 1e6",
            "",
            "13:3: wear: missing key `life.duration",
        ),
        (
            "duration = 1e6",
            "duration = 0",
            "life.duration = 0.0: allowed is 1e-6 to 1e12 s",
        ),
        (
            "[[wear]]\nbody = \"pin\"\ncoefficient = 1e-13",
            "",
            "[life] says how long the bodies of [[wear]] wear; there are none",
        ),
        ("[[wear]]\n", "[wear]\n", "[[wear]] lets a body wear"),
        (
            "surface_velocity = -0.5",
            "surface_velocity = -0.5\n[reference]\nclosed_form = \"conveyor\"",
            "a closed form knows no wear",
        ),
    ] {
        refused(PIN, old, new, expected);
    }
    let still = PIN.replacen("surface_velocity = -0.5\n", "", 1);
    let fixed = "name = \"pin\"\nkind = \"fixed\"\npolygon";
    let expected = "nothing moves in this scene";
    refused(&still, "name = \"pin\"\npolygon", fixed, expected);
}

#[test]
fn shapes_that_cannot_wear_are_refused() {
    let capsule = "body `pin` cannot wear: a capsule has no edges";
    refused(PIN, POLYGON, "capsule = [0.1, 0.1]", capsule);
    let two_sided = format!("two_sided = true\n{OPEN}");
    let no_solid = "a two-sided polyline has no solid behind it";
    refused(PIN, POLYGON, &two_sided, no_solid);
    for (shape, change, expected) in [
        (
            OPEN,
            "wear.pin.edges=[1, 0]",
            "0 to 1, the edges of body `pin`, the first not above the last",
        ),
        (OPEN, "wear.pin.mass=true", "needs the density of the body"),
        (
            "disc = 0.01",
            "wear.pin.edges=[0, 1]",
            "a disc has no edges of its own",
        ),
        (
            "disc = 0.01",
            "wear.pin.cell=6e-6",
            "wear.pin.cell = 6e-6: allowed is 6.2832e-6 to 2.8284e-2 m",
        ),
    ] {
        let error = error_of(&PIN.replacen(POLYGON, shape, 1), &[change]);
        assert!(error.contains(expected), "{error}\n{expected}");
    }
}
