//! What has no effect in a run is refused and named; what is taken changes something.

use crate::common::program::Place;
use std::collections::BTreeMap;
use std::fs;

/// A spinning ball that falls on a floor and rebounds.
const BALL: &str = r#"[scene]
name = "ball"
title = "A ball falls on a floor"
[[material]]
name = "rubber"
restitution = 0.5
[[body]]
name = "floor"
kind = "fixed"
box = [10, 1]
[[body]]
name = "ball"
disc = 0.5
spin = 5
position = [0, 1.2]
"#;

fn place() -> Place {
    let place = Place::new();
    place.write("ball.toml", BALL);
    let soft = "restitution = 0.0\nstiffness = 1e4\ndamping = 1";
    place.write("soft.toml", BALL.replace("restitution = 0.5", soft));
    place.write("lcp", r#"{"kind": "lcp", "matrix": [[2]], "q": [-1]}"#);
    place
}

/// Each line is typed. The program ends with 1, says that the last words have no effect, what they
/// lack, and leaves nothing behind.
#[test]
fn what_has_no_effect_is_refused_and_named() {
    let place = place();
    let only = "has no effect on --engine rapier, only on moreau";
    let own = "whose run is set by its own blocks";
    let stepped = "nothing is stepped";
    for (command, given, why) in [
        // a peer has a method of its own
        ("run tower --engine rapier", "--set step.events=true", only),
        ("run tower --engine rapier", "--events", only),
        ("run tower --engine rapier", "--scheme moreau", only),
        ("run tower --engine rapier", "--solver nsgs", only),
        ("run tower --engine rapier", "--tolerance 1e-3", only),
        ("run tower --engine rapier", "--threads 2", only),
        ("run tower --engine rapier", "--dump-problems p", only),
        ("run tower --engine rapier", "--set scheme=moreau", only),
        ("run tower --engine rapier", "--set step.solver=nsgs", only),
        ("run tower --engine rapier", "--set tolerance=1e-3", only),
        ("run tower --engine rapier", "--set recovery=false", only),
        (
            "run tower --engine rapier",
            "--set shares=minimum-norm",
            only,
        ),
        (
            "run ball.toml --engine rapier",
            "--set impact_law=newton",
            only,
        ),
        (
            "run soft.toml --engine rapier",
            "--set material.0.stiffness=1e5",
            only,
        ),
        (
            "run soft.toml --engine rapier",
            "--set material.rubber.damping=2",
            only,
        ),
        (
            "run tower --engine rapier-stiff",
            "--events",
            "rapier-stiff",
        ),
        // one setting undoes another
        ("run tower --steps 3", "--set step.time=1", "--steps"),
        (
            "run tower --dt 0.01",
            "--set step.dt=0.02",
            "before --dt 0.01",
        ),
        (
            "run tower --set step.dt=0.01",
            "--set dt=0.02",
            "has no effect",
        ),
        ("compare tower --steps 3", "--set step.time=1", "--steps"),
        ("bench tower --steps 3", "--set step.time=1", "--steps"),
        // what the scene is made of
        (
            "run tower",
            "--set step.impact_law=newton",
            "restitution above 0",
        ),
        (
            "run tower --scheme moreau",
            "--set step.recovery=false",
            "it needs staggered",
        ),
        ("run thresher-study", "--steps 3", own),
        ("run thresher-study", "--every 3", own),
        ("run thresher-study", "--dump-problems p", own),
        ("run thresher-study", "--threads 2", "one island"),
        ("run woodpecker", "--threads 2", "one island"),
        ("run thresher-study", "--time 1", "calibrated"),
        (
            "run thresher-study --set study.contact_time=6e-4",
            "--set study.calibrate.depth=7e-3",
            "not fitted",
        ),
        ("run thresher-study", "--set step.time=1", "calibrated"),
        (
            "run thresher-study --scheme staggered",
            "--events",
            "one rotor",
        ),
        ("run thresher-study", "--set recovery=false", "one rotor"),
        ("run thresher-study", "--set impact_law=newton", "one rotor"),
        ("run thresher-study", "--set gravity.y=-5", "standard one"),
        (
            "run thresher-study",
            "--set reference.closed_form=none",
            own,
        ),
        (
            "run thresher-study",
            "--set wear.revolutions=2",
            "[thresher]",
        ),
        (
            "run thresher-study --set reading=literal",
            "--set study.shares=equal",
            "torque-balanced",
        ),
        (
            "run thresher-study --set reading=literal",
            "--set wear.jump=0.2",
            "torque-balanced",
        ),
        (
            "run thresher-study --set study.shares=equal",
            "--set tape_thickness=0.01",
            "winkler",
        ),
        ("run thresher", "--steps 3", own),
        ("run thresher", "--time 3", own),
        ("run thresher", "--set step.time=3", own),
        ("run thresher", "--dump-problems p", own),
        // no peer steps it
        ("compare bowl", "--no-sweep", "without a peer"),
        // the commands of many points
        ("chart tower --engine rapier", "--scheme moreau", only),
        ("chart tower --engine rapier", "--tolerance 1e-3", only),
        ("chart tower --engine rapier", "--threads 2", only),
        ("chart two-balls --engine rapier", "--set solver=nsgs", only),
        (
            "chart tower --engine moreau",
            "--soft 30,4,1",
            "without a peer",
        ),
        ("bench tower", "--time 3", "--steps N"),
        ("bench tower", "--against moreau", "always measured"),
        ("bench --solvers", "--dt 0.1", stepped),
        ("bench --solvers", "--time 1", stepped),
        ("bench --solvers", "--steps 1", stepped),
        ("bench --solvers", "--scheme moreau", stepped),
        ("bench --solvers", "--events", stepped),
        ("bench --solvers", "--solver nsgs", stepped),
        ("bench --solvers", "--threads 2", stepped),
        ("bench --solvers", "--set step.dt=1", stepped),
        ("solve lcp", "--shares minimum-norm", "LCP"),
        ("solve lcp --json", "--quiet", "with --json"),
    ] {
        let line = format!("{command} {given}");
        let said = match given {
            "--set dt=0.02" => "--set step.dt=0.01",
            _ => given,
        };
        let words = [&format!("{said}: has no effect"), why];
        place.refused(&line.split_whitespace().collect::<Vec<_>>(), &words);
    }
}

/// In a file too, where the file itself leaves a key without effect; not what is meant for another
/// engine.
#[test]
fn keys_of_a_file_are_refused_with_their_line() {
    let place = place();
    for (block, key, why) in [
        (
            "[study]",
            "[gravity]\ny = -5",
            "gravity.y = -5: has no effect",
        ),
        (
            "[study]",
            "[reference]\nclosed_form = \"none\"",
            "reference.closed_form = \"none\": has no effect",
        ),
        (
            "[thresher]",
            "[step]\ntime = 1",
            "step.time = 1: has no effect",
        ),
        (
            "[study]",
            "[step]\nrecovery = false",
            "step.recovery = false: has no effect",
        ),
    ] {
        let text = format!("[scene]\nname = \"a\"\ntitle = \"b\"\n{block}\n{key}\n");
        place.write("a.toml", text);
        place.refused(&["run", "a.toml"], &["a.toml:6:1: ", why]);
    }
    let ours =
        format!("{BALL}[step]\nevents = true\nsolver = \"nsgs\"\nimpact_law = \"uniform\"\n");
    place.write("ours.toml", ours);
    let (code, _, err) = place.run(&["run", "ours.toml", "--engine", "rapier", "--steps", "3"]);
    assert_eq!(code, 0, "{err}");
}

/// Each line with the words after it writes other results than without.
#[test]
fn what_is_taken_changes_something() {
    let place = place();
    let results = |line: &str| -> BTreeMap<String, Vec<u8>> {
        let words = line.split_whitespace().chain(["--out", "r"]);
        let (code, _, err) = place.run(&words.collect::<Vec<_>>());
        assert!(code == 0 || code == 2, "{line}: {err}");
        let names = place.listing("r").into_iter();
        let csv = names.filter(|name| name.ends_with(".csv"));
        let read = |name: String| {
            (
                name.clone(),
                fs::read(place.path(&format!("r/{name}"))).unwrap(),
            )
        };
        let all = csv.map(read).collect();
        fs::remove_dir_all(place.path("r")).unwrap();
        all
    };
    for (line, given) in [
        ("run ball.toml --time 0.5", "--dt 0.01"),
        ("run ball.toml --time 0.5", "--set step.dt=0.01"),
        (
            "run ball.toml --set step.time=0.5",
            "--set step.scheme=moreau",
        ),
        ("run ball.toml --steps 40", "--scheme moreau"),
        ("run ball.toml --steps 40", "--events"),
        ("run ball.toml --steps 40", "--set impact_law=uniform"),
        ("run ball.toml --steps 40", "--every 2"),
        ("run ball.toml --steps 40", "--engine rapier"),
        ("run soft.toml --steps 40", "--set material.0.stiffness=1e5"),
        ("run soft.toml --steps 40", "--set material.0.damping=3"),
        ("run beam --steps 5", "--set shares=minimum-norm"),
        ("run tower --steps 3", "--solver nsgs"),
        ("run tower --steps 3 --solver nsgs", "--tolerance 1e-3"),
        (
            "run tower --steps 3 --set repeat.box.step=[[0,0],[0,0.99]]",
            "--set recovery=false",
        ),
    ] {
        let (with, without) = (results(&format!("{line} {given}")), results(line));
        assert!(!without.is_empty());
        assert_ne!(with, without, "{line} {given} changes nothing");
    }
}
