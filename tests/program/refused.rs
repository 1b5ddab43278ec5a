//! What the program refuses: names, numbers, files and folders, each by what was typed.

use super::cli::BALL;
use crate::common::program::Place;
use std::fs;

#[test]
fn unknown_names_are_refused_with_the_nearest_known_one() {
    let place = Place::new();
    let cases: [(&[&str], &[&str]); 11] = [
        (
            &["run", "piramid"],
            &["unknown scene `piramid`", "`pyramid`"],
        ),
        (
            &["run", "zzz"],
            &["unknown scene `zzz`", "known:", "pyramid", "beam"],
        ),
        (&["compare", "towr"], &["unknown scene", "`tower`"]),
        (&["run", "beam", "--frobnicate"], &["--frobnicate"]),
        (&["run", "beam", "--stesp", "3"], &["--stesp", "--steps"]),
        (&["rum", "beam"], &["rum", "run"]),
        (
            &["run", "beam", "--engine", "box3d"],
            &["box3d", "known: moreau, rapier"],
        ),
        (
            &["run", "beam", "--engine", "raper"],
            &["raper", "did you mean rapier?"],
        ),
        (
            &["run", "beam", "--solver", "ngs"],
            &["solver", "`ngs`", "`nsgs`"],
        ),
        (
            &["run", "beam", "--scheme", "stagered"],
            &["scheme", "`stagered`", "`staggered`"],
        ),
        (
            &["run", "beam", "--set", "tolerence=1"],
            &["`tolerence`", "`tolerance`"],
        ),
    ];
    for (args, words) in cases {
        place.refused(args, words);
    }
    // a folder, such as that of results
    fs::create_dir(place.path("out.toml")).unwrap();
    for name in ["out.toml", "."] {
        place.refused(&["explain", name], &[name, "it is a folder"]);
    }
    place.refused(&[], &["Usage"]);
    place.refused(&["run"], &["SCENE"]);
}

#[test]
fn numbers_out_of_range_are_refused_with_the_range() {
    let place = Place::new();
    let cases: [(&[&str], &[&str]); 19] = [
        (&["--dt", "-0.01"], &["step.dt", "-0.01", "1e-9 to 1 s"]),
        (&["--dt", "0"], &["step.dt", "1e-9 to 1 s"]),
        (&["--dt", "nan"], &["step.dt", "NaN"]),
        (&["--dt", "inf"], &["step.dt"]),
        (&["--dt", "fast"], &["step.dt", "number", "fast"]),
        (&["--time", "-1"], &["step.time", "-1"]),
        (&["--time", "nan"], &["step.time", "NaN"]),
        (&["--tolerance", "0"], &["step.tolerance", "1e-15 to 1e-2"]),
        (&["--tolerance", "nan"], &["step.tolerance"]),
        (&["--steps", "-3"], &["-3"]),
        (&["--steps", "3.5"], &["3.5", "--steps"]),
        (
            &["--steps", "3", "--time", "1"],
            &["--steps", "--time", "cannot be used"],
        ),
        (&["--every", "0"], &["--every"]),
        (&["--threads", "0"], &["--threads"]),
        (
            &["--set", "body.load.mass=-1"],
            &["body.load.mass", "-1", "1e-12 to 1e12 kg"],
        ),
        (&["--set", "body.load.mass=nan"], &["body.load.mass", "NaN"]),
        (
            &["--set", "body.load.position=[nan, 0]"],
            &["body.load.position.0", "NaN"],
        ),
        (&["--set", "body.loud.mass=1"], &["`loud`", "`load`"]),
        (&["--set", "mass"], &["key=value"]),
    ];
    for (flags, words) in cases {
        let mut args = vec!["run", "beam"];
        args.extend_from_slice(flags);
        place.refused(&args, words);
    }
}

/// Errors say what the user typed, and name things as the scene does.
#[test]
fn errors_name_what_was_typed() {
    let place = Place::new();
    let cases: [(&[&str], &str); 12] = [
        (&["tower", "--dt", "0"], "with --dt 0: step.dt"),
        (&["tower", "--time", "-1"], "with --time -1: step.time"),
        (&["tower", "--tolerance", "7"], "with --tolerance 7: "),
        (&["tower", "--scheme", "eulr"], "with --scheme eulr: "),
        (&["tower", "--solver", "eulr"], "with --solver eulr: "),
        (
            &["tower", "--events", "--set", "step.scheme=moreau"],
            "with --events: ",
        ),
        (
            &["tower", "--set", "repeat.box.count=[0,3]"],
            "with --set repeat.box.count=[0,3]: repeat.box.count.0 = 0",
        ),
        (
            &["tower", "--set", "repeat.0.count=[0,3]"],
            "repeat.box.count.0 = 0",
        ),
        (
            &["pendulum", "--set", "joint.0.at=[nan, 0]"],
            "joint.world-bob.at.0 = NaN",
        ),
        (
            &[
                "double-pendulum",
                "--set",
                "joint.upper-lower.limits=[2, 1]",
            ],
            "joint.upper-lower.limits: the lower limit",
        ),
        (
            &["tower", "--set", "joint.x.at=[0, 0]"],
            "the scene has no [[joint]] that could be changed",
        ),
        (
            &["tower.toml"],
            "tower.toml: no such file; did you mean `tower`?",
        ),
    ];
    for (args, words) in cases {
        let args = [&["run"], args].concat();
        place.refused(&args, &[words]);
        place.refused(&[&["compare"], &args[1..]].concat(), &[words]);
    }
    // a file of that name is read
    place.write("tower.toml", BALL);
    assert_eq!(place.run(&["run", "tower.toml", "--steps", "1"]).0, 0);
}

#[test]
fn broken_files_are_refused_with_line_and_key() {
    let cases = [
        (
            "dt = 0.01",
            "dt = ",
            &["mine.toml:5:", "malformed TOML"][..],
        ),
        (
            "dt = 0.01",
            "dt = 0.01\ndt = 0.02",
            &["mine.toml:6:1", "dt", "duplicate"],
        ),
        (
            "dt = 0.01",
            "dt = -0.01",
            &["mine.toml:5:1", "step.dt = -0.01"],
        ),
        ("dt = 0.01", "dt = nan", &["mine.toml:5:1", "step.dt = NaN"]),
        (
            "dt = 0.01",
            "dtt = 0.01",
            &["mine.toml:5:1", "`dtt`", "`dt`"],
        ),
        (
            "friction = 0.3",
            "friction = -0.3",
            &["mine.toml:8:1", "friction = -0.3", "0 to 1000"],
        ),
        (
            "friction = 0.3",
            "friction = nan",
            &["mine.toml:8:1", "friction = NaN"],
        ),
        (
            "friction = 0.3",
            "restitution = 1.5",
            &["mine.toml:8:1", "restitution = 1.5", "0 to 1"],
        ),
        (
            "mass = 2",
            "mass = -2",
            &["mine.toml:16:1", "body.ball.mass = -2", "1e-12 to 1e12 kg"],
        ),
        ("mass = 2", "mass = nan", &["body.ball.mass = NaN"]),
        (
            "disc = 0.5",
            "disc = 0",
            &["mine.toml:15:1", "body.ball.disc"],
        ),
        (
            "disc = 0.5",
            "polyline = [[0, 0], [1, 1], [1, 0], [0, 1]]\nclosed = true",
            &["mine.toml:15:", "body.ball", "cross"],
        ),
        (
            "disc = 0.5",
            "polygon = [[0, 0], [1, 1], [1, 0], [0, 1]]",
            &["mine.toml:15:", "body.ball.polygon"],
        ),
        (
            "disc = 0.5",
            "polygon = [[0, 0], [0, 1], [1, 1], [1, 0]]",
            &["mine.toml:15:", "body.ball.polygon", "clockwise"],
        ),
        ("disc = 0.5", "", &["body.ball"]),
        (
            "name = \"ball\"\ndisc",
            "name = \"floor\"\ndisc",
            &["mine.toml:14:1", "`floor`"],
        ),
    ];
    for (old, new, words) in cases {
        let place = Place::new();
        assert!(BALL.contains(old), "{old}");
        place.write("mine.toml", BALL.replacen(old, new, 1));
        for command in ["run", "compare"] {
            place.refused(&[command, "mine.toml"], words);
        }
    }
}

#[test]
fn files_that_are_not_there_or_not_text_are_refused() {
    let place = Place::new();
    place.refused(&["run", "none.toml"], &["none.toml"]);
    place.refused(&["run", "none/mine.toml"], &["none/mine.toml"]);
    fs::write(place.path("latin.toml"), b"[scene]\nname = \"\xe9\"\n").unwrap();
    place.refused(&["run", "latin.toml"], &["latin.toml"]);
    fs::create_dir(place.path("folder.toml")).unwrap();
    place.refused(&["run", "folder.toml"], &["folder.toml"]);
    place.write("empty.toml", "");
    place.refused(&["run", "empty.toml"], &["empty.toml", "scene"]);
}

#[test]
fn a_folder_that_cannot_be_written_is_refused_before_the_run() {
    let place = Place::new();
    place.write("file", "");
    place.refused(&["run", "beam", "--out", "file"], &["file", "not a folder"]);
    place.refused(&["run", "beam", "--out", "file/deep"], &["not a folder"]);
    place.refused(
        &["run", "thresher-study", "--out", "file"],
        &["not a folder"],
    );
    place.refused(&["compare", "beam", "--out", "file"], &["not a folder"]);
    // the kernel's own file system refuses a superuser too
    if cfg!(target_os = "linux") {
        place.refused(
            &["run", "beam", "--out", "/proc/moreau2d"],
            &["/proc/moreau2d: "],
        );
        // not the folder that is made first
        let err = place.run(&["run", "beam", "--out", "/proc/moreau2d"]).2;
        assert!(!err.contains("/.moreau2d-"), "{err}");
    }
}

/// A folder stands where a file must go: found at the end, and nothing is half-written.
#[test]
fn a_folder_in_the_place_of_a_file_is_refused_and_nothing_changes() {
    let place = Place::new();
    fs::create_dir_all(place.path("r/steps.csv")).unwrap();
    place.write("r/bodies.csv", "old");
    let args = ["run", "beam", "--steps", "3", "--out", "r"];
    place.refused(&args, &["steps.csv", "folder"]);
    assert_eq!(
        fs::read_to_string(place.path("r/bodies.csv")).unwrap(),
        "old"
    );
}

#[test]
fn engines_without_the_impulses_of_wear_are_refused_for_wear() {
    let place = Place::new();
    let args = ["run", "thresher-study", "--engine", "rapier"];
    place.refused(&args, &["rapier", "thresher-study", "moreau"]);
    place.refused(&["compare", "thresher-study"], &["thresher-study", "run"]);
}

#[test]
fn engines_without_the_geometry_are_refused() {
    let place = Place::new();
    for engine in ["rapier", "rapier-stiff"] {
        let args = ["run", "loop", "--engine", engine];
        let words = [
            engine,
            "loop",
            "lines or bowls",
            "rapier has not",
            "only moreau",
        ];
        place.refused(&args, &words);
        let args = ["run", "woodpecker", "--engine", engine];
        place.refused(&args, &[engine, "[linear]", "only moreau"]);
    }
}

#[test]
fn contradictions_in_the_study_are_refused() {
    let place = Place::new();
    for (flag, words) in [
        ("reading=literl", &["reading", "`literl`", "`literal`"][..]),
        ("study.shares=winkle", &["`winkle`", "`winkler`"]),
        ("study.friction=-0.3", &["study.friction", "-0.3"]),
        ("study.speeds=[]", &["study.speeds"]),
        ("study.speeds=[70, nan]", &["study.speeds", "NaN"]),
        ("study.batches=0", &["study.batches", "0"]),
        ("tooth.cells=1", &["tooth.cells"]),
        ("study.update=cubic", &["study.update", "`cubic`"]),
        ("wear.update=quadratic", &["unknown key", "`update`"]),
    ] {
        place.refused(&["run", "thresher-study", "--set", flag], words);
    }
}

/// Bug: the study takes its steps from the contact time and its rows from the batches; `--steps`
/// and `--every` are accepted and have no effect.
#[test]
fn flags_without_effect_on_the_study_are_refused() {
    let place = Place::new();
    for flag in ["--steps", "--every"] {
        let args = ["run", "thresher-study", flag, "3"];
        place.refused(&args, &[flag, "thresher-study"]);
    }
}

/// Flags of our method do nothing for rapier, and a reference that finds nothing says so.
#[test]
fn what_has_no_effect_is_not_taken_in_silence() {
    let place = Place::new();
    for flag in [
        &["--events"][..],
        &["--solver", "lemke"],
        &["--tolerance", "1e-3"],
        &["--scheme", "moreau"],
    ] {
        let mut args = vec!["run", "tower", "--engine", "rapier"];
        args.extend_from_slice(flag);
        let words = format!("{}: has no effect on --engine rapier", flag.join(" "));
        place.refused(&args, &[&words]);
    }
    let args = "run two-balls --set reference.closed_form=pendulum --steps 3";
    let args: Vec<&str> = args.split(' ').collect();
    place.refused(&args, &["does not fit the scene"]);
}
