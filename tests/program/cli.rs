//! The program as a user types it: what it prints, and how it ends.

use crate::common::program::Place;
use serde_json::Value;
use std::fs;
use std::io::Read;
use std::process::Stdio;

/// Scenes of the catalogue that are bodies and do not wear: `run` writes the same files for each.
pub fn scenes_of_bodies() -> Vec<&'static str> {
    let all = moreau2d::scene::scenes().unwrap();
    let names = all.iter().map(|listing| listing.name);
    let of_bodies = |name: &&str| {
        let (scene, machine) = moreau2d::thresher::load(name, &[]).unwrap();
        machine.is_none() && scene.wear.is_empty()
    };
    names.filter(of_bodies).collect()
}

pub const BALL: &str = r#"[scene]
name = "ball"
title = "A ball on a floor"
[step]
dt = 0.01
[[material]]
name = "steel"
friction = 0.3
[[body]]
name = "floor"
kind = "fixed"
box = [10, 1]
[[body]]
name = "ball"
disc = 0.5
mass = 2
position = [0, 1.2]
"#;

#[test]
fn scenes_lists_the_catalogue_one_line_each() {
    let (code, out, err) = Place::new().run(&["scenes"]);
    assert_eq!((code, err.as_str()), (0, ""));
    let names: Vec<&str> = out
        .lines()
        .map(|line| line.split_whitespace().next().unwrap())
        .collect();
    let all = moreau2d::scene::scenes().unwrap();
    let known: Vec<&str> = all.iter().map(|listing| listing.name).collect();
    assert_eq!(names, known, "{out}");
    for name in ["sliding-block", "pin-on-disc", "thresher-study", "thresher"] {
        assert!(names.contains(&name), "{name} is missing:\n{out}");
    }
    // a name and what it shows
    assert!(out.lines().all(|l| l.split_whitespace().count() > 3));
}

/// The literal reading says in words that the rotor stalls and that shares mean nothing.
#[test]
fn the_literal_reading_is_told_in_words() {
    let place = Place::new();
    let (code, out, err) = place.run(&[
        "run",
        "thresher-study",
        "--set",
        "reading=literal",
        "--time",
        "1e-4",
        "--scheme",
        "moreau",
        "--solver",
        "lemke",
        "--out",
        "r",
    ]);
    assert_eq!(code, 0, "{err}");
    for words in ["stalls", "one step", "26 of 26", "rank one", "not unique"] {
        assert!(out.contains(words), "{words}: {out}");
    }
    assert_eq!(place.rows("r/comparison.csv").len(), 12);
}

/// Bug: the last row of a run with wear had the poses of worn bodies at the time of new ones.
#[test]
fn the_last_row_is_that_of_every_step() {
    let place = Place::new();
    for scene in ["pin-on-disc", "tower --steps 50"] {
        let last = |every: &str| {
            let line = format!("run {scene} --quiet --every {every} --out r{every}");
            let (code, _, err) = place.run(&line.split(' ').collect::<Vec<_>>());
            assert_eq!(code, 0, "{err}");
            let rows = place.rows(&format!("r{every}/bodies.csv"));
            let end = rows[rows.len() - 1][0].clone();
            let rows: Vec<_> = rows.into_iter().filter(|row| row[0] == end).collect();
            fs::remove_dir_all(place.path(&format!("r{every}"))).unwrap();
            rows
        };
        assert_eq!(last("7"), last("1"), "{scene}");
    }
}

#[test]
fn flags_change_the_run() {
    let place = Place::new();
    let args = [
        "run",
        "sliding-block",
        "--out",
        "r",
        "--json",
        "--dt",
        "0.005",
        "--time",
        "0.05",
        "--scheme",
        "moreau",
        "--solver",
        "nsgs",
        "--tolerance",
        "1e-6",
        "--set",
        "body.block.velocity=[2, 0]",
        "--every",
        "4",
        "--threads",
        "2",
    ];
    let (code, out, err) = place.run(&args);
    assert_eq!(code, 0, "{err}");
    let summary: Value = serde_json::from_str(&out).unwrap();
    let settings = &summary["settings"];
    assert_eq!(settings["dt_s"], 0.005);
    assert_eq!(settings["scheme"], "moreau");
    assert_eq!(settings["solver"], "nsgs");
    assert_eq!(settings["tolerance"], 1e-6);
    assert_eq!(settings["every"], 4);
    assert_eq!(summary["totals"]["steps"], 10);
    // steps 4 and 8 of 10 and the last one, and the start
    let steps = place.rows("r/steps.csv");
    assert_eq!(steps.len(), 3);
    let end = &steps[2][0];
    assert!((end.parse::<f64>().unwrap() - 0.05).abs() < 1e-12, "{end}");
    let bodies = place.rows("r/bodies.csv");
    assert_eq!(bodies.len(), 2 * 4);
    assert_eq!(&bodies[6][0], end);
    assert_eq!(bodies[1][5], "2.0");
    // the same text stands in the file
    let file: Value =
        serde_json::from_str(&fs::read_to_string(place.path("r/summary.json")).unwrap()).unwrap();
    assert_eq!(file, summary);
    for key in [
        "program",
        "version",
        "scene",
        "scene_hash",
        "totals",
        "warnings",
    ] {
        assert!(!summary[key].is_null(), "{key}");
    }
    for engine in ["rapier", "rapier-stiff"] {
        let (code, out, err) = place.run(&[
            "run", "beam", "--steps", "3", "--engine", engine, "--out", engine, "--json",
        ]);
        assert_eq!(code, 0, "{err}");
        let summary: Value = serde_json::from_str(&out).unwrap();
        assert_eq!(summary["settings"]["engine"], engine);
    }
}

#[test]
fn a_step_too_long_is_a_warning_and_no_error() {
    let place = Place::new();
    place.write("ball.toml", BALL);
    for command in [&["run"][..], &["compare", "--repeats", "1"]] {
        let mut args = command.to_vec();
        args.extend(["ball.toml", "--steps", "3", "--dt", "0.1", "--out", "r"]);
        args.extend(["--set", "material.steel.stiffness=1e6"]);
        let (code, _, err) = place.run(&args);
        assert_eq!(code, 0, "{err}");
        assert!(err.starts_with("warning: step.dt = 0.1 s"), "{err}");
        assert!(err.contains("would do"), "{err}");
        let summary = fs::read_to_string(place.path("r/summary.json")).unwrap();
        let summary: Value = serde_json::from_str(&summary).unwrap();
        let told = summary["warnings"][0].as_str().unwrap();
        assert!(err.contains(told), "{told}");
        args.push("--quiet");
        assert_eq!(place.run(&args).2, "");
    }
}

/// The end of the chain whips round by more than a radian a step at 12 ms.
#[test]
fn joints_that_would_put_energy_in_are_held_back_and_told() {
    let place = Place::new();
    for (dt, told) in [("1.2e-2", true), ("4e-3", false)] {
        let (_, out, _) = place.run(&["run", "chain", "--dt", dt, "--out", "r"]);
        assert_eq!(
            out.contains("would have added energy"),
            told,
            "{dt}: {}",
            out
        );
    }
}

#[test]
fn quiet_prints_nothing_and_json_prints_json_alone() {
    let place = Place::new();
    for args in [
        vec!["run", "pyramid", "--steps", "3"],
        vec!["run", "thresher-study"],
        vec!["compare", "two-balls", "--steps", "3", "--repeats", "1"],
    ] {
        let mut quiet = args.clone();
        quiet.push("--quiet");
        let (code, out, err) = place.run(&quiet);
        assert_eq!((code, out.as_str(), err.as_str()), (0, "", ""), "{args:?}");
        let mut json = args.clone();
        json.push("--json");
        let (_, out, err) = place.run(&json);
        let value: Value = serde_json::from_str(&out).unwrap();
        assert!(value.is_object() && err.is_empty(), "{args:?}");
    }
}

#[test]
fn a_scene_of_ones_own_runs_by_its_path() {
    let place = Place::new();
    place.write("mine.toml", BALL);
    let (code, _, err) = place.run(&["run", "mine.toml", "--steps", "50"]);
    assert_eq!(code, 0, "{err}");
    // the folder is named after the scene, not after the file
    let rows = place.rows("out/ball/bodies.csv");
    let y: f64 = rows.last().unwrap()[3].parse().unwrap();
    assert!((y - 1.0).abs() < 1e-9, "{y}");
    // a file without the ending, in another folder
    fs::create_dir(place.path("sub")).unwrap();
    place.write("sub/scene", BALL);
    assert_eq!(place.run(&["run", "sub/scene", "--steps", "1"]).0, 0);
}

#[test]
fn help_and_version_are_no_errors() {
    let place = Place::new();
    let (code, help, _) = place.run(&["--help"]);
    assert_eq!(code, 0);
    for command in ["scenes", "run", "compare"] {
        assert!(help.contains(command), "{command}");
    }
    // what an exit code means stands where a user looks
    for command in [
        &["--help"][..],
        &["run", "--help"],
        &["compare", "--help"],
        &["chart", "--help"],
        &["atlas", "--help"],
        &["bench", "--help"],
        &["solve", "--help"],
    ] {
        let help = place.run(command).1;
        let codes = help
            .split_once("Exit codes:")
            .unwrap_or_else(|| panic!("{command:?}"))
            .1;
        // lines break where they are full
        let codes = codes.split_whitespace().collect::<Vec<_>>().join(" ");
        let two = !["compare", "chart", "bench"].contains(&command[0]);
        assert!(codes.contains("wrong input"), "{command:?}: {codes}");
        assert_eq!(codes.contains('2'), two, "{command:?}: {codes}");
    }
    let help = place.run(&["atlas", "--help"]).1;
    assert!(
        help.contains("known to fail") && help.contains("--quick"),
        "{help}"
    );
    let help = place.run(&["run", "--help"]).1;
    let most = moreau2d::dynamics::MOST_THREADS;
    assert!(help.contains(&format!("1 to {most}")), "{help}");
    let threads = (most + 1).to_string();
    let args = ["run", "beam", "--threads", &threads];
    place.refused(&args, &[&format!("1..={most}")]);
    let (_, version, _) = place.run(&["--version"]);
    assert_eq!(
        version.trim(),
        concat!("moreau2d ", env!("CARGO_PKG_VERSION"))
    );
    assert!(place.everything().is_empty());
}

/// `moreau2d ... | head`: the reader goes away before anything is written.
#[test]
fn a_closed_pipe_is_no_panic() {
    let place = Place::new();
    for args in [
        vec!["scenes"],
        vec!["--help"],
        vec!["run", "beam", "--steps", "3"],
        vec!["run", "beam", "--steps", "3", "--json"],
        vec!["compare", "beam", "--steps", "3", "--repeats", "1"],
    ] {
        let mut child = place
            .command(&args)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let mut err = String::new();
        child
            .stderr
            .take()
            .unwrap()
            .read_to_string(&mut err)
            .unwrap();
        let status = child.wait().unwrap();
        assert_eq!((status.code(), err.as_str()), (Some(0), ""), "{args:?}");
    }
}

/// Not solved is an outcome, and so is what is left of it: here next to nothing, so that the scene held.
#[test]
fn a_run_that_is_not_certified_says_how_far_it_is_bounded() {
    let place = Place::new();
    // no Gauss-Seidel reaches this in its budget on a tower of forty
    let (code, out, err) = place.run(&[
        "run",
        "tower",
        "--set",
        "repeat.0.count=[1, 40]",
        "--solver",
        "nsgs",
        "--tolerance",
        "1e-15",
        "--steps",
        "2",
        "--out",
        "r",
    ]);
    assert_eq!(code, 0, "{out} {err}");
    assert!(out.contains("2 bounded, 0 failed"), "{out}");
    let text = fs::read_to_string(place.path("r/summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&text).unwrap();
    assert!(summary["totals"]["unsolved_islands"].as_u64().unwrap() > 0);
    assert!(!summary["warnings"].as_array().unwrap().is_empty());
}
