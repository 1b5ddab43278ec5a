//! Whether a scene held: what a run says of it, and its exit code.

use crate::common::program::Place;
use serde_json::Value;

/// Two discs that close by 3.3 m in a step.
const DISCS: &str = r#"[scene]
name = "discs"
title = "Two discs close at 200 m/s"
[gravity]
y = 0
[step]
time = 0.1
[[body]]
name = "left"
disc = 0.1
position = [-1, 0]
velocity = [100, 0]
[[body]]
name = "right"
disc = 0.1
position = [1, 0.02]
velocity = [-100, 0]
"#;

fn place() -> Place {
    let place = Place::new();
    place.write("discs.toml", DISCS);
    place
}

/// Exit code, and the verdict of `summary.json`.
fn run(place: &Place, words: &str) -> (i32, Value) {
    let mut args: Vec<&str> = words.split(' ').collect();
    args.extend(["--out", "o", "--quiet"]);
    let (code, _, err) = place.run(&args);
    assert!(code != 1, "{words}: {err}");
    (code, place.json("o/summary.json")["verdict"].take())
}

fn check<'a>(verdict: &'a Value, name: &str) -> &'a Value {
    let all = verdict["checks"].as_array().unwrap();
    let found = all.iter().find(|check| check["name"] == name);
    found.unwrap_or_else(|| panic!("{name}: {verdict}"))
}

#[test]
fn a_passage_is_named_with_time_and_bodies() {
    let place = place();
    let (code, verdict) = run(&place, "run discs.toml --engine rapier");
    assert_eq!(verdict["held"], false, "{verdict}");
    let first = &verdict["passed_through"][0];
    assert_eq!(first["bodies"], serde_json::json!(["left", "right"]));
    assert!((first["time_s"].as_f64().unwrap() - 1.0 / 60.0).abs() < 1e-7);
    assert_eq!(check(&verdict, "passed_through")["value"], 1.0);
    let sentence = verdict["sentence"].as_str().unwrap();
    assert!(sentence.contains("left passed through right"), "{sentence}");
    // a peer's result is told, and is no failure of the command
    assert_eq!(code, 0);
    for flag in ["", " --events"] {
        let (code, verdict) = run(&place, &format!("run discs.toml{flag}"));
        assert_eq!((code, &verdict["held"]), (0, &true.into()), "{verdict}");
        assert_eq!(verdict["sentence"], "the scene held");
    }
}

#[test]
fn an_overlap_that_lasts_is_measured_by_the_size_of_the_bodies() {
    let place = place();
    let words = "run tower --set repeat.box.count=[1,30] --time 2 --engine rapier";
    let (_, verdict) = run(&place, words);
    assert_eq!(check(&verdict, "overlap")["held"], false, "{verdict}");
    let sentence = verdict["sentence"].as_str().unwrap();
    assert!(sentence.contains("overlap by"), "{sentence}");
    let (_, verdict) = run(&place, &format!("{words} --set verdict.overlap=0.5"));
    assert_eq!(check(&verdict, "overlap")["held"], true, "{verdict}");
    assert_eq!(check(&verdict, "overlap")["limit"], 0.5);
    let (code, verdict) = run(&place, &words.replace("rapier", "moreau"));
    assert_eq!((code, &verdict["held"]), (0, &true.into()), "{verdict}");
}

/// Bug: a disc that another one hits towards a wall has its impact there one step late. Half of it was inside the
/// wall by then, and the scene held: the overlap lasts for one step only.
#[test]
fn a_body_half_inside_another_at_one_instant_is_told() {
    let place = place();
    place.write(
        "late.toml",
        "[scene]\nname = \"late\"\ntitle = \"Late\"\n[gravity]\ny = 0\n[step]\ntime = 0.5\n\
         scheme = \"moreau\"\n\
         [[material]]\nname = \"m\"\nfriction = 0\nrestitution = 0.8\n\
         [[body]]\nname = \"wall\"\nkind = \"fixed\"\nbox = [1, 4]\nposition = [1.5, 0]\n\
         material = \"m\"\n[[body]]\nname = \"light\"\ndisc = 0.25\nmass = 1\n\
         position = [0.749, 0]\nmaterial = \"m\"\n[[body]]\nname = \"heavy\"\ndisc = 0.25\n\
         mass = 4\nposition = [-1, 0]\nvelocity = [18, 0]\nmaterial = \"m\"\n",
    );
    let (code, verdict) = run(&place, "run late.toml");
    assert_eq!((code, &verdict["held"]), (2, &false.into()), "{verdict}");
    assert_eq!(check(&verdict, "deepest")["held"], false, "{verdict}");
    assert_eq!(check(&verdict, "overlap")["value"], 0.0);
    let sentence = verdict["sentence"].as_str().unwrap();
    assert!(sentence.contains("wall and light overlap by"), "{sentence}");
    // the width of a sheet is none: that of the disc counts
    let wall = "box = [1, 4]\nposition = [1.5, 0]";
    let sheet = "polyline = [[0, -0.5], [0, 0.5]]\ntwo_sided = true\nposition = [1, 0]";
    let text = std::fs::read_to_string(place.path("late.toml")).unwrap();
    assert!(text.contains(wall) && text.contains("[18, 0]"));
    place.write(
        "sheet.toml",
        text.replace(wall, sheet).replace("[18, 0]", "[3, 0]"),
    );
    let (code, verdict) = run(&place, "run sheet.toml");
    let deepest = check(&verdict, "deepest")["value"].as_f64().unwrap();
    assert!(code == 0 && (0.05..0.1).contains(&deepest), "{verdict}");
    let (code, verdict) = run(&place, "run late.toml --set verdict.deepest=1");
    assert_eq!(code, 0, "{verdict}");
    let (code, verdict) = run(&place, "run late.toml --scheme staggered");
    assert_eq!((code, &verdict["held"]), (0, &true.into()), "{verdict}");
}

#[test]
fn a_run_of_ours_that_did_not_hold_ends_with_2() {
    let place = place();
    // gravity, a floor and round-off: more than nothing
    let words = "run pyramid --time 0.5 --set verdict.imbalance=0 --set step.keep_rest=false";
    let (code, verdict) = run(&place, words);
    assert_eq!((code, &verdict["held"]), (2, &false.into()), "{verdict}");
    let sentence = verdict["sentence"].as_str().unwrap();
    assert!(sentence.contains("energy balance"), "{sentence}");
    let (_, out, _) = place.run(&["run", "tower", "--steps", "5", "--out", "p"]);
    assert!(out.contains("\nthe scene held\n"), "{out}");
}

#[test]
fn limits_out_of_range_or_without_a_verdict_are_refused() {
    let place = place();
    for (words, why) in [
        ("run tower --set verdict.overlap=-1", "0 to 1"),
        ("run tower --set verdict.overlaps=0", "overlap"),
        (
            "compare tower --set verdict.overlap=0.1",
            "only `run` judges",
        ),
        ("run thresher --set verdict.overlap=0.1", "has no effect"),
        (
            "run tower --engine rapier --set verdict.energy=1",
            "has no effect",
        ),
    ] {
        place.refused(&words.split(' ').collect::<Vec<_>>(), &[why]);
    }
}

/// A piston presses a box into the floor: no impulses stop both. The step says that it failed.
#[test]
fn what_has_no_solution_fails() {
    let place = Place::new();
    place.write(
        "press.toml",
        r#"scene = { name = "press", title = "A piston presses a box into the floor" }
step = { time = 0.5 }
body = [
  { name = "floor", kind = "fixed", box = [4, 1], position = [0, -0.5] },
  { name = "box", box = [1, 1], position = [0, 0.5] },
  { name = "piston", kind = "kinematic", box = [1, 1], position = [0, 1.6], velocity = [0, -1] },
]
"#,
    );
    let (code, verdict) = run(&place, "run press.toml");
    assert_eq!(code, 2, "{verdict}");
    let checks = verdict["checks"].as_array().unwrap();
    let failed = checks.iter().find(|c| c["name"] == "failed").unwrap();
    assert!(failed["held"] == false, "{failed}");
    assert!(failed["value"].as_f64().unwrap() > 10.0, "{failed}");
}
