//! `[uncertain]`: a life with two bands, and what each input does to it.

use crate::common::program::Place;
use serde_json::Value;

/// The study with a fitted contact time, and a short list of points.
const STUDY: &str = include_str!("../../scenes/thresher-study.toml");
const UNCERTAIN: &str = r#"
[uncertain]
wear.coefficient = { percent = 50 }
"study.friction" = { from = 0.2, to = 0.4 }
study.shares = { among = ["equal", "winkler"] }
"#;

/// Coarse steps: the load cycle of the study is exact with any (see the sweep of the study).
const COARSE: [&str; 2] = ["--set", "step.dt=1e-5"];

fn place(block: &str) -> Place {
    let place = Place::new();
    place.write("study.toml", format!("{STUDY}\n{block}"));
    place
}

fn run(place: &Place, more: &[&str]) -> (String, Value) {
    let args = [&["run", "study.toml", "--out", "out"][..], &COARSE, more].concat();
    let (code, out, err) = place.run(&args);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    (out, place.json("out/summary.json"))
}

/// Hours to the limit of a run of its own.
fn hours(place: &Place, changes: &[&str]) -> f64 {
    let mut args = vec![
        "run",
        "study.toml",
        "--out",
        "other",
        "--set",
        "uncertain={}",
    ];
    args.extend(COARSE);
    for change in changes {
        args.extend(["--set", change]);
    }
    let (code, out, err) = place.run(&args);
    assert_eq!(code, 0, "{out}{err}");
    // the first limit: with equal shares the base is worn through before the tooth is unfit
    let summary = place.json("other/summary.json");
    let lives = summary["life"].as_array().unwrap();
    let hours = lives.iter().filter_map(|life| life["hours"].as_f64());
    hours.reduce(f64::min).unwrap()
}

fn found<'a>(causes: &'a Value, input: &str, value: &str) -> &'a Value {
    let causes = causes.as_array().unwrap();
    let cause = causes.iter().find(|cause| cause["input"] == input).unwrap();
    let values = cause["values"].as_array().unwrap();
    let found = values.iter().find(|v| v["value"] == value);
    &found.unwrap_or_else(|| panic!("{input} = {value}: {values:?}"))["found"]
}

/// The hours of every value are those of a run with it, at the contact time of the scene's own run; the
/// bands are what the module says.
#[test]
fn the_bands_of_a_life_are_those_of_runs_by_hand() {
    let place = place(UNCERTAIN);
    let (out, summary) = run(&place, &[]);
    let bands = &summary["uncertain"][0];
    let number = |value: &Value| value.as_f64().unwrap();
    let nominal = number(&bands["nominal"]);
    assert_eq!(bands["nominal"], summary["life"][0]["hours"]);
    let held = format!(
        "study.contact_time={:?}",
        number(&summary["life_contact_time_s"])
    );
    let causes = &bands["causes"];
    let mut logs = [0.0, 0.0];
    for (input, value, change) in [
        ("study.friction", "0.2", "study.friction=0.2"),
        ("study.friction", "0.4", "study.friction=0.4"),
        ("study.shares", "equal", "study.shares=equal"),
    ] {
        let by_hand = hours(&place, &[&held, change]);
        let own = number(found(causes, input, value));
        assert_eq!(own, by_hand, "{input} = {value}");
        let log: f64 = (own / nominal).ln();
        logs[usize::from(log > 0.0)] += log * log;
    }
    // exact where the jumps are alike; a stop at the published depth makes one of them shorter here
    for (value, factor) in [("1.667e-12", 2.0), ("5.000e-12", 2.0 / 3.0)] {
        let own = number(found(causes, "wear.coefficient", value));
        assert!((own / (nominal * factor) - 1.0).abs() < 1e-12);
        let k = 5e-17 / 3e-8 * 2e-3 / factor;
        let by_hand = hours(&place, &[&held, &format!("wear.coefficient={k:e}")]);
        let error = number(&summary["life"][0]["error_hours"]) / nominal;
        let off = by_hand / own - 1.0;
        assert!(off.abs() < 0.2 * error, "{value}: {off} of {error}");
        logs[usize::from(factor > 1.0)] += f64::ln(factor).powi(2);
    }
    let [low, high] = [0, 1].map(|side| number(&bands["inputs"][side]));
    assert!((low / (nominal * (-logs[0].sqrt()).exp()) - 1.0).abs() < 1e-12);
    assert!((high / (nominal * logs[1].sqrt().exp()) - 1.0).abs() < 1e-12);
    let error = number(&summary["life"][0]["error_hours"]);
    assert!((number(&bands["numerics"][0]) - (nominal - error)).abs() < 1e-9);
    // all at once, by a run as well
    let together = &bands["together"][1];
    let k = format!("wear.coefficient={:e}", 0.5 * 5e-17 / 3e-8 * 2e-3);
    let by_hand = hours(
        &place,
        &[&held, "study.friction=0.4", "study.shares=equal", &k],
    );
    assert!(
        (number(&together["found"]) / by_hand - 1.0).abs() < 2e-3,
        "{together}"
    );
    for words in [
        "numerics  ",
        "inputs    ",
        "the largest cause is wear.coefficient: alone it gives",
        "a factor of 3.00",
        "closed form, 1/K",
        "inputs that move together",
        "the contact time of a cycle is held",
        "the single effects multiplied",
    ] {
        assert!(out.contains(words), "lacks `{words}`: {out}");
    }
    let files = place.listing("out");
    for file in ["tornado.svg", "uncertain.csv"] {
        assert!(files.iter().any(|known| known == file), "{files:?}");
    }
    // nothing but files: the runs are gone
    assert!(files.iter().all(|name| name.contains('.')), "{files:?}");
}

/// A trap: with a contact time that is fitted anew at every value, K would do nothing at all.
#[test]
fn a_fitted_constant_does_not_take_up_what_an_input_does() {
    let place = place(UNCERTAIN);
    let fitted = hours(&place, &[]);
    let again = hours(&place, &["wear.coefficient=5e-12"]);
    // the search ends within 1e-9 of the depth
    assert!((again / fitted - 1.0).abs() < 1e-3, "{fitted} {again}");
}

/// The block is no part of the scene: its hash, its own results and its bytes stay.
#[test]
fn the_block_changes_nothing_else_and_the_bytes_are_the_same_again() {
    let with = place(UNCERTAIN);
    let (_, first) = run(&with, &[]);
    let csv = std::fs::read(with.path("out/uncertain.csv")).unwrap();
    let svg = std::fs::read(with.path("out/tornado.svg")).unwrap();
    run(&with, &[]);
    assert_eq!(std::fs::read(with.path("out/uncertain.csv")).unwrap(), csv);
    assert_eq!(std::fs::read(with.path("out/tornado.svg")).unwrap(), svg);
    let without = place("");
    let (out, mut second) = run(&without, &[]);
    assert!(!out.contains("two bands"));
    let mut first = first;
    first["uncertain"] = Value::Null;
    for summary in [&mut first, &mut second] {
        summary["totals"] = Value::Null;
        summary["uncertain"] = Value::Null;
    }
    assert_eq!(first, second);
}

/// Bodies that wear: the depth after the duration, in proportion to K, by runs.
#[test]
fn the_depth_of_a_body_has_bands_too() {
    let place = Place::new();
    let args = [
        "run",
        "pin-on-disc",
        "--set",
        "uncertain.wear.pin.coefficient.percent=50",
        "--set",
        "uncertain.body.disc.surface_velocity={ from = -0.6, to = -0.5 }",
    ];
    let (code, out, err) = place.run(&args);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    let bands = &place.json("out/pin-on-disc/summary.json")["uncertain"][0];
    assert_eq!(bands["result"], "depth of pin");
    let number = |value: &Value| value.as_f64().unwrap();
    let ratio = |input: &str, value: &str| {
        number(found(&bands["causes"], input, value)) / number(&bands["nominal"])
    };
    // K F s / A; single precision of the corners over the depth of a jump
    let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
    close(ratio("wear.pin.coefficient", "5e-13"), 0.5);
    close(ratio("wear.pin.coefficient", "1.5e-12"), 1.5);
    close(ratio("body.disc.surface_velocity", "-0.6"), 1.2);
    // independent factors: the product is what all at once give
    close(
        number(&bands["together"][0]["found"]) / number(&bands["nominal"]),
        1.5 * 1.2,
    );
    assert!(out.contains("depth of pin: "), "{out}");
}

/// A sweep has the bands of each case in its table.
#[test]
fn a_sweep_takes_the_bands_along() {
    let place = Place::new();
    let plan = "scene = \"pin-on-disc\"\n[set]\n\"uncertain.wear.pin.coefficient.percent\" = 50\n\
                [grid]\n\"life.duration\" = [1e6, 2e6]\n";
    place.write("plan.toml", plan);
    let (code, out, err) = place.run(&["sweep", "plan.toml", "--out", "cases", "--files"]);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    let (code, out, err) = place.run(&["sweep", "plan.toml", "--out", "cases", "--files"]);
    assert_eq!((code, err.as_str()), (0, ""), "{out}");
    assert!(out.contains("2 were done before"), "{out}");
    let cases = place.listing("cases");
    let case = cases.iter().find(|name| *name != "plan.json").unwrap();
    let summary = place.json(&format!("cases/{case}/summary.json"));
    assert_eq!(
        summary["uncertain"][0]["causes"][0]["input"],
        "wear.pin.coefficient"
    );
}

#[test]
fn what_is_wrong_with_the_block_is_refused_before_anything_runs() {
    let long = STUDY.lines().count() + 3;
    let cases: [(&str, &[&str]); 19] = [
        (
            "\"study.frction\" = { percent = 5 }",
            &[
                "unknown key `study.frction`",
                "did you mean `study.friction`?",
            ],
        ),
        (
            "study.friction = { from = 0.4, to = 0.1 }",
            &["uncertain.study.friction.to = 0.1: allowed is above from, 0.4"],
        ),
        (
            "study.friction = { from = 0.3, to = 0.3 }",
            &["allowed is above from"],
        ),
        (
            "study.friction = { from = 0.4, to = 0.5 }",
            &["leaves out the scene's value of `study.friction`, 0.3"],
        ),
        (
            "study.friction = { from = 0.1 }",
            &["uncertain.study.friction", "`to`"],
        ),
        (
            "study.shares = { percent = 5 }",
            &["`study.shares` is no number", "winkler"],
        ),
        (
            "wear.coefficient = { percent = 100 }",
            &["wear.coefficient = 0.0: allowed is 1e-30 to 1 m²/N"],
        ),
        (
            "wear.coefficient = { percent = 150 }",
            &["wear.coefficient = -1.66", "allowed is 1e-30 to 1 m²/N"],
        ),
        (
            "wear.coefficient = { percent = 0 }",
            &["percent = 0.0: allowed is above 0"],
        ),
        (
            "wear.coefficient = { percent = nan }",
            &["percent = NaN: allowed is a finite number"],
        ),
        (
            "wear.coefficient = { percent = \"5\" }",
            &["percent: expected a number"],
        ),
        (
            "study.shares = { among = [\"equal\", \"lever\"] }",
            &["`winkler`"],
        ),
        (
            "study.shares = { among = [\"winkler\", \"leer\"] }",
            &["leer", "did you mean `lever`?"],
        ),
        (
            "study.shares = { among = [\"winkler\", \"winkler\"] }",
            &["is listed twice"],
        ),
        (
            "study.shares = { among = [\"winkler\"] }",
            &["2 to 100 values"],
        ),
        (
            "study.friction = { procent = 5, percent = 3 }",
            &["unknown key `procent`", "did you mean `percent`?"],
        ),
        (
            "study.friction = { percent = 5, from = 0.1, to = 0.4 }",
            &["give either percent, from and to, or among"],
        ),
        ("study.friction = 5", &["expected", "percent = P"]),
        (
            "study.calibrate.depth = { percent = 5 }",
            &[
                "study.calibrate.depth",
                "has no effect with a study.contact_time",
            ],
        ),
    ];
    for (line, words) in cases {
        let place = place(&format!("[uncertain]\n{line}\n"));
        let args = ["run", "study.toml", "--out", "out"];
        let at = format!("study.toml:{long}:");
        place.refused(&args, &[&[at.as_str()], words].concat());
    }
    let place = place("");
    let literal = [
        "run",
        "study.toml",
        "--set",
        "study.reading=literal",
        "--set",
    ];
    let block = "uncertain={ \"study.friction\" = { percent = 5 } }";
    place.refused(
        &[&literal[..], &[block]].concat(),
        &["\"literal\"", "no life"],
    );
    let block = "uncertain={ \"step.dt\" = { percent = 5 } }";
    place.refused(
        &["run", "tower", "--set", block],
        &["nothing wears in this scene"],
    );
    // a whole number by percentages
    let block = "uncertain={ \"tooth.cells\" = { percent = 5 } }";
    place.refused(
        &["run", "study.toml", "--set", block],
        &["tooth.cells", "unknown key"],
    );
    let cells = |block| {
        [
            "run",
            "study.toml",
            "--set",
            "tooth.cells=26",
            "--set",
            block,
        ]
    };
    place.refused(
        &cells(block),
        &["`tooth.cells` is a whole number: use from and to"],
    );
    let block = "uncertain={ \"tooth.cells\" = { from = 13.5, to = 30 } }";
    place.refused(&cells(block), &["from = 13.5: allowed is a whole number"]);
}
