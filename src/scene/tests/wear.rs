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

#[test]
fn what_cannot_wear_is_refused_with_its_place() {
    let open = "polyline = [[0.01, 0], [0, 0], [-0.01, 0]]\nmass = 1\ninertia = 1";
    let polygon = "polygon = [[-0.01, 0], [0.01, 0], [0.01, 0.04], [-0.01, 0.04]]";
    let edges = |edges: &str| format!("coefficient = 1e-13\nedges = {edges}");
    let cases = [
        (
            "coefficient = 1e-13",
            "coefficient = -1e-13".to_owned(),
            "15:1: wear.pin.coefficient = -1e-13: allowed is 1e-30 to 1 m²/N",
        ),
        (
            "coefficient = 1e-13",
            edges("[0, 4]"),
            "16:1: wear.pin.edges = [0, 4]: allowed is 0 to 3, the edges of body `pin`",
        ),
        (
            "coefficient = 1e-13",
            edges("[0]"),
            "wear.pin.edges: expected an array of 2 numbers",
        ),
        (
            "coefficient = 1e-13",
            "coeficient = 1e-13".to_owned(),
            "did you mean `coefficient`?",
        ),
        (
            "body = \"pin\"",
            "body = \"pinn\"".to_owned(),
            "14:1: wear.pinn.body: unknown body `pinn`; did you mean `pin`?",
        ),
        (
            "body = \"pin\"",
            "body = \"belt\"".to_owned(),
            "the surface of body `belt` moves along itself",
        ),
        (
            "[life]",
            "[[wear]]\nbody = \"pin\"\ncoefficient = 1\n[life]".to_owned(),
            "body `pin` has a [[wear]] already",
        ),
        (
            polygon,
            "capsule = [0.1, 0.1]".to_owned(),
            "body `pin` cannot wear: a capsule has no edges",
        ),
        (
            polygon,
            format!("two_sided = true\n{open}"),
            "a two-sided polyline has no solid behind it",
        ),
        (
            "[life]\nduration = 1e6",
            String::new(),
            "13:3: wear: missing key `life.duration",
        ),
        (
            "duration = 1e6",
            "duration = 0".to_owned(),
            "life.duration = 0.0: allowed is 1e-6 to 1e12 s",
        ),
        (
            "[[wear]]\nbody = \"pin\"\ncoefficient = 1e-13",
            String::new(),
            "[life] says how long the bodies of [[wear]] wear; there are none",
        ),
        (
            "[[wear]]\n",
            "[wear]\n".to_owned(),
            "[[wear]] lets a body wear",
        ),
        (
            "surface_velocity = -0.5",
            "surface_velocity = -0.5\n[reference]\nclosed_form = \"conveyor\"".to_owned(),
            "a closed form knows no wear",
        ),
    ];
    for (old, new, expected) in cases {
        assert!(PIN.contains(old), "{old}");
        let error = error_of(&PIN.replacen(old, &new, 1), &[]);
        assert!(
            error.contains(expected),
            "{new}\n  {error}\n  lacks {expected}"
        );
    }
    let open = PIN.replacen(polygon, open, 1);
    let error = error_of(&open, &["wear.pin.edges=[1, 0]"]);
    assert!(
        error.contains("0 to 1, the edges of body `pin`, the first not above the last"),
        "{error}"
    );
    let error = error_of(&open, &["wear.pin.mass=true"]);
    assert!(error.contains("needs the density of the body"), "{error}");
    let disc = PIN.replacen(polygon, "disc = 0.01", 1);
    let error = error_of(&disc, &["wear.pin.edges=[0, 1]"]);
    assert!(error.contains("a disc has no edges of its own"), "{error}");
    let still = PIN.replacen("surface_velocity = -0.5\n", "", 1);
    let still = still.replacen(
        "name = \"pin\"\npolygon",
        "name = \"pin\"\nkind = \"fixed\"\npolygon",
        1,
    );
    assert!(error_of(&still, &[]).contains("nothing moves in this scene"));
}
