//! Plans: equal cases, scenes beside, the study, and what is refused.

use super::{cases, done};
use crate::common::program::Place;
use std::fs;

/// Equal cases, and values that are the same number, are one case that the summary counts.
#[test]
fn equal_cases_run_once_and_are_told() {
    let place = Place::new();
    let case = |dt: &str| format!("[[case]]\n\"step.dt\" = {dt}\n");
    let plan = |cases: &[&str]| {
        let cases: String = cases.iter().map(|dt| case(dt)).collect();
        place.write("plan.toml", format!("scene = \"sliding-block\"\n{cases}"));
    };
    plan(&["0.01", "0.02", "0.01", "1e-2"]);
    let out = done(&place, &["sweep", "plan.toml", "--out", "s"]);
    let told = "\n4 cases over step.dt, 2 the same as one before and not run again\n2 held";
    assert!(out.contains(told), "{out}");
    assert_eq!(cases(&place, "s").len(), 2);
    plan(&["0.01"]);
    let out = done(&place, &["sweep", "plan.toml", "--out", "one"]);
    assert!(out.contains("\n1 case over step.dt\n1 held"), "{out}");
}

/// As `run` does, with files beside the plan.
#[test]
fn a_scene_without_an_ending_is_found_beside_the_plan() {
    let place = Place::new();
    fs::create_dir(place.path("plans")).unwrap();
    let ball = "[scene]\nname = \"ball\"\ntitle = \"t\"\n[[body]]\nname = \"ball\"\ndisc = 0.5\n";
    place.write("plans/ball", ball);
    let plan = |scene: &str| {
        let text = format!("scene = \"{scene}\"\n[grid]\n\"step.time\" = [0.1]\n");
        place.write("plans/p.toml", text);
    };
    plan("ball");
    let out = done(&place, &["sweep", "plans/p.toml", "--out", "s"]);
    assert!(out.starts_with("ball: t\n"), "{out}");
    plan("bal");
    place.refused(
        &["sweep", "plans/p.toml", "--out", "u"],
        &[
            "plans/p.toml:1:1: scene: unknown scene `bal`",
            "and there is no file plans/bal\n",
        ],
    );
    // a name of the catalogue comes first
    place.write("plans/tower", ball);
    plan("tower");
    let out = done(&place, &["sweep", "plans/p.toml", "--out", "t"]);
    assert!(out.starts_with("tower: "), "{out}");
}

/// Scenes, the rest of plans of them, and what is said of it.
const BAD: [(&str, &str, &str); 13] = [
    (
        "tower",
        "[grid]\n\"step.dt\" = [0.01, -1]\n",
        "plan.toml:3:20: step.dt = -1.0: allowed is 1e-9 to 1 s",
    ),
    (
        "tower",
        "[grid]\n\"step.dt\" = [0.01, \"a\"]\n",
        "plan.toml:3:20: step.dt: expected a number, found the string \"a\"",
    ),
    (
        "tower",
        "[grid]\n\"step.dtt\" = [0.01]\n",
        "plan.toml:3:15: step.dtt: unknown key `dtt`; did you mean `dt`?",
    ),
    (
        "tower",
        "[set]\ntoleranc = 0.2\n[grid]\n\"step.dt\" = [0.01]\n",
        "plan.toml:3:1: unknown key `toleranc`; did you mean `tolerance`?",
    ),
    (
        "tower",
        "[grid]\ntime = [1]\nname = [\"a\"]\n",
        "plan.toml:4:9: name: could be any of",
    ),
    (
        "tower",
        "[grid]\n\"body.bx.disc\" = [1]\n",
        "plan.toml:3:19: body",
    ),
    (
        "tower",
        "[grid]\n\"step.dt\" = []\n",
        "plan.toml:3:1: grid.step.dt = []: allowed is at least one value",
    ),
    ("tower", "[grid]\n", "plan.toml:2:2: grid: has no key"),
    (
        "towr",
        "[grid]\n\"step.dt\" = [0.01]\n",
        "plan.toml:1:1: scene: unknown scene `towr`; did you mean `tower`?",
    ),
    (
        "bal.toml",
        "[grid]\n\"step.dt\" = [0.01]\n",
        "plan.toml:1:1: scene: bal.toml: no such file",
    ),
    (
        "pin-on-disc",
        "[grid]\n\"verdict.overlap\" = [1]\n\"gravity.y\" = [-1]\n\"life.duration\" = [0]\n",
        "plan.toml:5:20: life.duration = 0.0: allowed is",
    ),
    (
        "thresher-study",
        "[grid]\n\"wear.error\" = [\"measured\"]\n",
        "plan.toml:3:17: wear.error = \"measured\": has no effect on a [study]",
    ),
    (
        "tower",
        "[grid]\n\"step.dt\" = [0.01]\ndt = [0.02]\n",
        "has no effect before",
    ),
];

/// Every case is checked before the first runs; errors name file, line, key, value, what is allowed and
/// the nearest name.
#[test]
fn bad_plans_run_no_case() {
    let place = Place::new();
    place.write(
        "ball.toml",
        "[scene]\nname = \"ball\"\ntitle = \"t\"\n[[body]]\nname = \"ball\"\ndisc = 0.5\n",
    );
    for (scene, rest, words) in BAD {
        place.write("plan.toml", format!("scene = \"{scene}\"\n{rest}"));
        place.refused(&["sweep", "plan.toml"], &[words]);
    }
    place.write(
        "plan.toml",
        "scene = \"ball.toml\"\n[grid]\n\"step.time\" = [0.1]\n",
    );
    done(&place, &["sweep", "plan.toml"]);
    assert_eq!(cases(&place, "out/sweep-plan").len(), 1);
    place.refused(&["sweep", "none.toml"], &["none.toml: No such file"]);
    for out in ["ball.toml", "ball.toml/deep"] {
        place.refused(
            &["sweep", "plan.toml", "--out", out],
            &["ball.toml: exists and is not a folder"],
        );
    }
    place.refused(
        &["sweep", "plan.toml", "--shard", "3/2"],
        &["--shard", "K/N"],
    );
    place.refused(
        &["sweep", "plan.toml", "--shard", "/2"],
        &["neither SLURM_ARRAY_TASK_ID nor"],
    );
    place.refused(&["sweep", "plan.toml", "--jobs", "0"], &["1..=1024"]);
    place.refused(
        &["merge", "out/sweep-plan", "--draw", "totals.energy_nd_j"],
        &["no such column; did you mean `totals.energy_end_j`?"],
    );
    place.refused(&["merge", "out/sweep-plan", "--draw", "ended"], &["ended"]);
}

/// The plan of the study: its twelve published points are those of `run`.
#[test]
fn the_plan_of_the_study_has_144_cases() {
    let text = include_str!("../../../scenes/sweeps/thresher-study.toml");
    let plan = moreau2d::scene::plan::Plan::parse("study.toml", text).unwrap();
    assert_eq!((plan.len(), plan.keys.len()), (144, 3));
    // two of them, at the friction of the study
    let place = Place::new();
    let fewer = text
        .replace("[20.87, 54.37, 110.91, 146.39]", "[146.39]")
        .replace("[70, 80, 90, 100, 110, 120]", "[70, 120]")
        .replace("[0.14, 0.18, 0.25, 0.3, 0.35, 0.4]", "[0.3, 0.4]");
    place.write("plan.toml", fewer);
    done(&place, &["sweep", "plan.toml", "--out", "s"]);
    done(&place, &["merge", "s", "--out", "t"]);
    let head = place.header("t/sweep.csv");
    let at = |name: &str| head.split(',').position(|other| other == name).unwrap();
    let (depth, life) = (at("comparison.computed_um"), at("life.unfit.hours"));
    let rows = place.rows("t/sweep.csv");
    let number = |row: usize, column: usize| rows[row][column].parse::<f64>().unwrap();
    // as `run thresher-study` prints them, with the contact time that it fits
    assert!((number(0, depth) - 7620.0).abs() < 0.01, "{:?}", rows[0]);
    assert!((number(2, depth) - 11967.0).abs() < 0.5, "{:?}", rows[2]);
    // depth falls with friction and rises with speed, the life the other way
    assert!(number(1, depth) < number(0, depth) && number(1, life) > number(0, life));
    assert!(number(2, depth) > number(0, depth) && number(2, life) < number(0, life));
}
