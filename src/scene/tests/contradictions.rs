//! Files that can be read but make no sense.

use super::*;

#[test]
fn a_body_has_one_whole_shape() {
    for (new, expected) in [
        (
            "polygon = [[0, 0], [0, 1], [1, 0]]",
            "14:1: body.ball.polygon: the polygon is wound clockwise (a tooth wound the wrong way)",
        ),
        (
            "polygon = [[0, 0], [1, 1], [1, 0], [0, 1]]",
            "edges 0 and 2",
        ),
        ("polygon = [[0, 0], [1, 0]]", "2 points: allowed is 3"),
        (
            "disc = 0.5\nbox = [1, 1]",
            "15:1: body.ball.box: a body has one shape; `disc` is given already",
        ),
        (
            "disc = 0.5\nclosed = true",
            "closed is a property of a polyline",
        ),
        (
            "polyline = [[0, 0], [1, 0], [0, 1]]\nhollow = true",
            "hollow is a property of a closed polyline that is not two-sided",
        ),
        (
            "disc = 0.5\ntwo_sided = true",
            "two_sided is a property of a polyline",
        ),
        (
            "parts = []",
            "14:1: body.ball.parts: a body has at least one part",
        ),
        (
            "parts = [{ disc = 1 }, { position = [1, 0] }]",
            "14:24: body.ball.parts.1: missing key `disc, box",
        ),
        (
            "parts = [{ disc = 1, box = [1, 1] }]",
            "body.ball.parts.0.box: a body has one shape; `disc` is given already",
        ),
        (
            "disc = 0.5\nparts = [{ disc = 1 }]",
            "body.ball.parts: a body has one shape; `disc` is given already",
        ),
    ] {
        assert_error("disc = 0.5", new, &[expected]);
    }
}

#[test]
fn mass_and_motion_contradict_nothing() {
    for (key, expected) in [
        ("mass = 1\ndensity = 1", "give density or mass"),
        ("inertia = 1", "inertia needs a mass"),
        (
            "linear_damping = 101",
            "15:1: body.ball.linear_damping = 101.0: allowed is 0 to 1/dt = 100 per second",
        ),
    ] {
        assert_error("disc = 0.5", &format!("disc = 0.5\n{key}"), &[expected]);
    }
    for (key, expected) in [
        (
            "mass = 1",
            "12:1: body.floor.mass: mass has no effect on a fixed body",
        ),
        ("spin = 1", "a fixed body does not move"),
        (
            "one_way = [0, 2]",
            "12:1: body.floor.one_way = [0.0, 2.0]: allowed is a direction of length 1",
        ),
        (
            "gravity_scale = 0",
            "gravity_scale has no effect on a fixed body",
        ),
        ("ccd = true", "ccd has no effect on a fixed body"),
    ] {
        assert_error(
            "box = [10, 1]",
            &format!("box = [10, 1]\n{key}"),
            &[expected],
        );
    }
    for (old, new, expected) in [
        (
            "disc = 0.5",
            "polyline = [[0, 0], [1, 0]]",
            "missing key `mass and inertia",
        ),
        (
            "dt = 0.01",
            "dt = 0.01\nscheme = \"moreau\"\n[[body]]\nname = \"bullet\"\ndisc = 0.5\nccd = true",
            "body.bullet.ccd: the times of impacts need the scheme staggered",
        ),
    ] {
        assert_error(old, new, &[expected]);
    }
}

#[test]
fn names_materials_and_blocks_contradict_nothing() {
    for (old, new, expected) in [
        (
            "name = \"ball\"\ndisc",
            "name = \"floor\"\ndisc",
            "13:1: body.floor.name: there is already a body named `floor`",
        ),
        (
            "name = \"ball\"\ndisc",
            "name = \"world\"\ndisc",
            "`world` is what joints call",
        ),
        (
            "name = \"steel\"",
            "name = \"steel\"\n[[material]]\nname = \"steel\"",
            "9:1: material.steel.name: there is already a material",
        ),
        (
            "name = \"steel\"",
            "name = \"steel\"\ndamping = 1",
            "damping needs a stiffness",
        ),
        (
            "name = \"steel\"",
            "name = \"steel\"\nstiffness = 1\nrestitution = 0.5",
            "use damping_restitution",
        ),
        (
            "[step]",
            "[gravity]\nx = 1\nslope = 1\n[step]",
            "6:1: gravity.slope: give either x, y or magnitude",
        ),
        (
            "[step]",
            "[wear]\n[step]",
            "4:2: wear: [wear] needs a [study] or a [thresher]",
        ),
        (
            "[step]",
            "[study]\n[step]",
            "body: [study] makes its own bodies",
        ),
        ("[step]", "[study]\n[thresher]\n[step]", "not both"),
    ] {
        assert_error(old, new, &[expected]);
    }
    let empty = "[scene]\nname = \"a\"\ntitle = \"b\"\n";
    assert!(error_of(empty, &[]).contains("t.toml: the scene has no bodies"));
}

#[test]
fn a_joint_ties_two_bodies_one_of_which_moves() {
    let joint = |bodies: &str| {
        let text =
            format!("{BALL}[[joint]]\nkind = \"revolute\"\nat = [0, 0]\nbodies = {bodies}\n");
        error_of(&text, &[])
    };
    assert!(joint("[\"ball\", \"ball\"]").contains("ties `ball` to itself"));
    assert!(joint("[\"floor\", \"world\"]").contains("neither body is dynamic"));
}

#[test]
fn repeats_are_checked() {
    let repeat = |keys: &str| format!("{BALL}[[repeat]]\nof = \"ball\"\n{keys}\n");
    let cases = [
        ("count = [3]", "missing key `step (or ring)`"),
        ("count = [3, 3]\nstep = [[1, 0]]", "step: expected 2 pairs"),
        (
            "count = [0]\nstep = [[1, 0]]",
            "count.0 = 0: allowed is 1 to",
        ),
        (
            "count = [-1]\nstep = [[1, 0]]",
            "count.0: expected a whole number from 0 to 4294967295, found -1",
        ),
        (
            "count = [4000000000, 4000000000]\nstep = [[1, 0], [0, 1]]",
            "repeat.ball.count = 16000000000000000000 copies: allowed is 100000 in",
        ),
        (
            "count = [3, 4]\nstep = [[1, 0], [0, 1]]\nshrink = 1",
            "shrink = 1: allowed is 0 to 0",
        ),
        (
            "count = [3]\nstep = [[1, 0]]\njitter = 0.1",
            "missing key `seed`",
        ),
        (
            "count = [3]\nstep = [[1, 0]]\nseed = 1",
            "a seed has no effect",
        ),
        (
            "count = [3]\nring = { centre = [0, 0], radius = 1, count = 3 }",
            "a grid or a ring, not both",
        ),
        (
            "ring = { centre = [0, 0], radius = -1, count = 3 }",
            "ring.radius = -1.0: allowed is 0 to 1e6 m",
        ),
        (
            "ring = { centre = [0, 0], radius = 1, count = 3, arc = [1, 0] }",
            "ring.arc = [1.0, 0.0]: allowed is [from, to] with from < to",
        ),
        (
            "count = [3, 3]\nstep = [[1, 0], [0, 1]]\npin = [0, 0]",
            "repeat.ball.pin: a pin ties the copies of a row or ring; for a grid give `pins`",
        ),
        (
            "count = [1, 1, 1, 1, 1]\nstep = [[1, 0]]",
            "count: expected an array of 1 to 4 numbers, found 5 of them",
        ),
        (
            "count = [3, 3]\nstep = [[1, 0], [0, 1]]\npins = [[0, 0]]",
            "repeat.ball.pins: expected 2 points [x, y], one for each count",
        ),
        (
            "count = [3, 3]\nstep = [[1, 0], [0, 1]]\nshrink = 1\npins = [[0, 0], [0, 0]]",
            "repeat.ball.pins: in a grid that shrinks no copy has one right above it",
        ),
        (
            "ring = { centre = [0, 0], radius = 1, count = 3 }\npins = [[0, 0]]",
            "repeat.ball.pins: a repeat is a grid or a ring, not both",
        ),
        (
            "count = [3, 3]\nstep = [[1, 0], [0, 1]]\nshrink = 1\nfixed = [[0, 2], [1, 2]]",
            "repeat.ball.fixed.1 = [1, 2]: allowed is the numbers, from 0, of a copy in a grid of",
        ),
        (
            "count = [3]\nstep = [[1, 0]]\nfixed = [[0, 0]]",
            "repeat.ball.fixed.0 = [0, 0]: allowed is the numbers",
        ),
        (
            "count = [1]\nstep = [[1, 0]]\npin = [0, 0]",
            "a single copy has no neighbour to tie",
        ),
        (
            "count = [1]\nstep = [[1, 0]]\n[[repeat]]\nof = \"ball\"\ncount = [1]\nstep = [[0, 1]]",
            "already a repeat named `ball`",
        ),
    ];
    for (keys, expected) in cases {
        let error = error_of(&repeat(keys), &[]);
        assert!(
            error.contains(expected),
            "{keys}\n  {error}\n  lacks {expected}"
        );
    }
}
