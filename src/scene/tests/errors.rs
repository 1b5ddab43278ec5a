//! Every error names the line or flag, the key, what is allowed, the nearest known name.

use super::*;

#[test]
fn ranges_name_line_key_value_and_what_is_allowed() {
    let dt = "dt = 0.01";
    let steel = "name = \"steel\"";
    let disc = "disc = 0.5";
    let cases = [
        (
            dt,
            "dt = -1",
            "t.toml:5:1: step.dt = -1.0: allowed is 1e-9 to 1 s",
        ),
        (
            dt,
            "dt = 0",
            "t.toml:5:1: step.dt = 0.0: allowed is 1e-9 to 1 s",
        ),
        (
            dt,
            "dt = nan",
            "t.toml:5:1: step.dt = NaN: allowed is a finite number",
        ),
        (
            dt,
            "dt = inf",
            "t.toml:5:1: step.dt = inf: allowed is a finite number",
        ),
        (
            dt,
            "dt = 99999999999999999999",
            "t.toml:5:1: step.dt = 1e20: allowed is 1e-9 to 1 s",
        ),
        (
            dt,
            "tolerance = 1",
            "step.tolerance = 1.0: allowed is 1e-15 to 1e-2",
        ),
        (
            steel,
            "name = \"steel\"\nfriction = -0.1",
            "8:1: material.steel.friction = -0.1: allowed is 0 to 1000",
        ),
        (
            steel,
            "name = \"steel\"\nrestitution = 1.5",
            "8:1: material.steel.restitution = 1.5: allowed is 0 to 1",
        ),
        (
            steel,
            "name = \"steel\"\nrestitution = -0.1",
            "8:1: material.steel.restitution = -0.1: allowed is 0 to 1",
        ),
        (
            disc,
            "sector = [1, 2, 0.1]",
            "14:14: body.ball.sector.1 = 2.0: allowed is 1e-6 to 1.98 of the radius",
        ),
        (
            disc,
            "disc = 0.5\nmass = -2",
            "15:1: body.ball.mass = -2.0: allowed is 1e-12 to 1e12 kg",
        ),
        (
            disc,
            "disc = 0",
            "14:1: body.ball.disc = 0.0: allowed is 1e-6 to 1e6 m",
        ),
        (
            disc,
            "box = [1, 0]",
            "14:11: body.ball.box.1 = 0.0: allowed is 1e-6 to 1e6 m",
        ),
        (
            disc,
            "capsule = [1, -1]",
            "body.ball.capsule.1 = -1.0: allowed is 1e-6 to 1e6 m",
        ),
        (
            disc,
            "disc = 0.5\nvelocity = [0, nan]",
            "15:16: body.ball.velocity.1 = NaN",
        ),
        (
            "name = \"ball\"\ntitle",
            "name = \"a/b\"\ntitle",
            "2:1: scene.name = \"a/b\": allowed is 1 to 64 letters",
        ),
        (
            "A ball on a floor",
            "",
            "3:1: scene.title = \"\": allowed is one line",
        ),
    ];
    for (old, new, expected) in cases {
        assert_error(old, new, &[expected]);
    }
}

#[test]
fn unknown_names_come_with_the_nearest_known_one() {
    let disc = "disc = 0.5";
    let cases = [
        (
            "dt = 0.01",
            "dtt = 0.01",
            "t.toml:5:1: step.dtt: unknown key `dtt`; did you mean `dt`?",
        ),
        (
            "[step]",
            "[stp]",
            "4:2: stp: unknown key `stp`; did you mean `step`?",
        ),
        (
            "dt = 0.01",
            "scheme = \"morau\"",
            "5:1: step.scheme: unknown scheme `morau`; did you mean `moreau`?",
        ),
        (
            "dt = 0.01",
            "solver = \"ngs\"",
            "5:1: step.solver: unknown solver `ngs`; did you mean `nsgs`?",
        ),
        (
            "dt = 0.01",
            "solver = \"xyz\"",
            "unknown solver `xyz`; known: auto, enumeration",
        ),
        (
            disc,
            "disk = 0.5",
            "14:1: body.ball.disk: unknown key `disk`; did you mean `disc`?",
        ),
        (
            disc,
            "disc = 0.5\nfriction = 0.3",
            "15:1: body.ball.friction: unknown key `friction`; did you mean `material.friction`?",
        ),
        (
            "[step]",
            "[[step]]",
            "step: expected [step], found [[step]]",
        ),
        (
            disc,
            "disc = 0.5\nmaterial = \"stele\"",
            "15:1: body.ball.material: unknown material `stele`; did you mean `steel`?",
        ),
        (
            "\"fixed\"",
            "\"fixd\"",
            "10:1: body.floor.kind: unknown kind `fixd`; did you mean `fixed`?",
        ),
        (
            disc,
            "disc = 1\n[[repeat]]\nof = \"bal\"\ncount = [1]\nstep = [[1, 0]]",
            "16:1: repeat.bal.of: unknown body `bal`; did you mean `ball`?",
        ),
        (
            disc,
            "disc = 1\n[[joint]]\nkind = \"revolut\"\nbodies = [\"ball\", \"world\"]\nat = [0, 0]",
            "16:1: joint.ball-world.kind: unknown kind `revolut`; did you mean `revolute`?",
        ),
        (
            disc,
            "disc = 1\n[[joint]]\nkind = \"revolute\"\nat = [0, 0]\nbodies = [\"ball\", \"flor\"]",
            "18:19: joint.ball-flor.bodies.1: unknown body `flor`; did you mean `floor`?",
        ),
        (
            disc,
            "disc = 1\n[reference]\nclosed_form = \"beem\"",
            "reference.closed_form: unknown closed_form `beem`; did you mean `beam`?",
        ),
    ];
    for (old, new, expected) in cases {
        // Blocks are put last, so that the keys that follow in `BALL` stay with the body.
        let new = new.to_owned();
        let (old, new) = match new.split_once("\n[") {
            Some((head, block)) => (
                "disc = 0.5\nposition = [0, 1]\n",
                format!("{head}\n[{block}\n"),
            ),
            None => (old, new),
        };
        assert_error(old, &new, &[expected]);
    }
}

#[test]
fn malformed_text_and_wrong_types_are_told_with_their_place() {
    let cases = [
        ("dt = 0.01", "dt = ", "t.toml:5:", "malformed TOML"),
        ("dt = 0.01", "dt = = 1", "t.toml:5:", "dt: malformed TOML"),
        (
            "dt = 0.01",
            "dt = 1\ndt = 2",
            ":6:1: dt: malformed TOML",
            "duplicate",
        ),
        (
            "dt = 0.01",
            "dt = \"a\"",
            "t.toml:5:1: step.dt: expected a number, found the string \"a\"",
            "",
        ),
        (
            "dt = 0.01",
            "dt = 2024-01-01",
            "step.dt: expected a number, found a date",
            "",
        ),
        (
            "disc = 0.5",
            "box = 1",
            "14:1: body.ball.box: expected an array of 2 numbers, found 1",
            "",
        ),
        (
            "disc = 0.5",
            "box = [1]",
            "expected an array of 2 numbers, found an array of length 1",
            "",
        ),
        (
            "disc = 0.5",
            "box = [1, 2, 3]",
            "expected an array of 2 numbers, found an array of length 3",
            "",
        ),
        (
            "disc = 0.5",
            "disc = true",
            "expected a number, found true",
            "",
        ),
        (
            "\"fixed\"",
            "3",
            "body.floor.kind: expected a word in quotes, found 3",
            "",
        ),
        (
            "[[material]]",
            "[material]",
            "6:2: material: expected [[material]] for each one, found [material]",
            "",
        ),
        (
            "title = \"A ball on a floor\"\n",
            "",
            "scene: missing key `title`",
            "",
        ),
        (
            "disc = 0.5",
            "",
            "12:1: body.ball: missing key `disc, box, capsule",
            "",
        ),
    ];
    for (old, new, expected, also) in cases {
        assert_error(old, new, &[expected, also]);
    }
}

#[test]
fn errors_of_flags_name_the_flag() {
    let cases = [
        (
            "step.dt=-1",
            "t.toml with --set step.dt=-1: step.dt = -1.0: allowed is 1e-9 to 1 s",
        ),
        (
            "step.dtt=1",
            "with --set step.dtt=1: step.dtt: unknown key `dtt`; did you mean `dt`?",
        ),
        ("stp.dt=1", "unknown key `stp`; did you mean `step`?"),
        (
            "shceme=moreau",
            "with --set shceme=moreau: unknown key `shceme`; did you mean `scheme`?",
        ),
        (
            "scheme=morau",
            "unknown scheme `morau`; did you mean `moreau`?",
        ),
        (
            "body.bal.disc=1",
            "with --set body.bal.disc=1: body: unknown element `bal`; did you mean `ball`?",
        ),
        ("body.7.disc=1", "unknown element `7`; known: floor, ball"),
        (
            "position=[0, 0]",
            "`position` could be any of body.floor.position, body.ball.position",
        ),
        ("step.dt.x=1", "step.dt: expected a table with the key `x`"),
        (
            "step.dt=fast",
            "with --set step.dt=fast: step.dt: expected a number, found the string \"fast\"",
        ),
        ("step.dt", "--set step.dt: expected key=value"),
        ("=1", "--set =1: expected key=value"),
        ("step.dt=1\nx = 2", "expected a number, found the string"),
    ];
    for (flag, expected) in cases {
        let error = error_of(BALL, &[flag]);
        assert!(
            error.contains(expected),
            "{flag}\n  {error}\n  lacks {expected}"
        );
    }
}

#[test]
fn unknown_scenes_and_files_are_told() {
    let error = load("towr", &[]).unwrap_err().to_string();
    assert_eq!(error, "unknown scene `towr`; did you mean `tower`?");
    let error = load("nowhere/towr.toml", &[]).unwrap_err().to_string();
    assert!(
        error.starts_with("nowhere/towr.toml: cannot read the scene"),
        "{error}"
    );
}
