//! `calibrate`: the wear coefficient from weighed bars, depths and a traced profile, as a user types it.

use crate::common::program::Place;
use serde_json::Value;

/// The depth of the pin after 500 hours with the scene's coefficient, 1e-12 m²/N: K F s / A.
const DEPTH: f64 = 1e-12 * (1000.0 * 0.01 * 0.04 * 9.81) * (0.5 * 500.0 * 3600.0) / 0.01;

fn calibrate(place: &Place, args: &[&str]) -> (String, Value) {
    let args = [&["calibrate"][..], args, &["--out", "out"]].concat();
    let (code, out, err) = place.run(&args);
    assert_eq!((code, err.as_str()), (0, ""), "{args:?}: {out}");
    (out, place.json("out/summary.json"))
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

#[test]
fn a_depth_gives_the_coefficient_of_the_closed_form() {
    let place = Place::new();
    let depth = format!("{:e}", 1.5 * DEPTH);
    let deviation = format!("{:e}", 0.02 * DEPTH);
    let args = [
        "pin-on-disc",
        "--depth",
        &depth,
        "--hours",
        "500",
        "--uncertainty",
        &deviation,
    ];
    let (out, found) = calibrate(&place, &args);
    // single precision of the corners over the depth of a jump
    let close = |key: &str, value: f64| {
        let own = number(&found[key]);
        assert!((own / value - 1.0).abs() < 1e-5, "{key}: {own} {value}");
    };
    close("coefficient_m2_n", 1.5e-12);
    // 1.959964 standard deviations
    close("low_m2_n", 1e-12 * (1.5 - 0.02 * 1.959_964));
    close("high_m2_n", 1e-12 * (1.5 + 0.02 * 1.959_964));
    for words in [
        "wear.pin.coefficient = 1.500e-12 m2/N, 1.461e-12 to 1.539e-12 m2/N with 95.0 %",
        "independent normal errors",
        "K cannot be told from the hours",
        "--set wear.pin.coefficient=1.5",
    ] {
        assert!(out.contains(words), "lacks `{words}`: {out}");
    }
    let listing = place.listing("out");
    assert_eq!(
        listing,
        ["calibration.csv", "calibration.svg", "summary.json"]
    );
    // three parts give the interval of Student's, wider at a higher level
    let depths = [1.45, 1.5, 1.55]
        .map(|part| format!("{:e}", part * DEPTH))
        .join(",");
    let args = [
        "pin-on-disc",
        "--depth",
        &depths,
        "--hours",
        "500",
        "--level",
        "0.99",
    ];
    let (out, found) = calibrate(&place, &args);
    let half = 9.924_84 * 0.05 / 3f64.sqrt();
    let close = |key: &str, value: f64| {
        let own = number(&found[key]);
        assert!((own / value - 1.0).abs() < 1e-5, "{key}: {own} {value}");
    };
    close("low_m2_n", 1e-12 * (1.5 - half));
    close("high_m2_n", 1e-12 * (1.5 + half));
    assert!(
        out.contains("from the scatter, 2 degrees of freedom"),
        "{out}"
    );
}

#[test]
fn a_mass_needs_density_and_width_and_says_what_it_assumed() {
    let place = Place::new();
    let mass = |density: f64, width: f64| format!("{:e}", 1e3 * DEPTH * 0.01 * density * width);
    let args = [
        "pin-on-disc",
        "--hours",
        "500",
        "--uncertainty",
        "0.5",
        "--mass-loss",
    ];
    // the pin presses by its weight: what is weighed has that density too, not that of steel
    let own = mass(1000.0, 1.0);
    let (out, found) = calibrate(&place, &[&args[..], &[&own]].concat());
    assert!((number(&found["coefficient_m2_n"]) / 1e-12 - 1.0).abs() < 1e-5);
    assert!(out.contains("density 1000 kg/m3, the scene's"), "{out}");
    assert!(out.contains("width 1 m, assumed"), "{out}");
    let own = mass(2700.0, 0.02);
    let more = ["--density", "2700", "--width", "0.02"];
    let (out, found) = calibrate(&place, &[&args[..], &[&own], &more].concat());
    assert!((number(&found["coefficient_m2_n"]) / 1e-12 - 1.0).abs() < 1e-5);
    assert!(out.contains("density 2700 kg/m3, given"), "{out}");
    // an error as large as the wear
    assert!(out.contains("the data do not tell K from 0"), "{out}");
}

/// The profile of a run with another coefficient, as `run` writes it, gives that coefficient; points of one
/// number cannot tell it from the friction, nor can a shape that friction hardly changes.
#[test]
fn a_traced_profile_gives_the_coefficient_and_says_what_it_cannot_tell() {
    let place = Place::new();
    let held = "study.contact_time=6.98e-4";
    let k = 1.2 * 5e-17 / 3e-8 * 2e-3;
    let planted = format!("wear.coefficient={k:e}");
    let args = [
        "run",
        "thresher-study",
        "--set",
        held,
        "--set",
        "step.dt=1e-5",
        "--set",
        &planted,
    ];
    let (code, ..) = place.run(&[&args[..], &["--out", "truth"]].concat());
    assert_eq!(code, 0);
    let text = std::fs::read_to_string(place.path("truth/profile.csv")).unwrap();
    let (header, rows) = text.split_once('\n').unwrap();
    // cycles, hours, bar, node, x_m, y_m
    let hours = |row: &str| row.split(',').nth(1).unwrap().to_owned();
    let wanted = rows
        .lines()
        .map(hours)
        .find(|h| h.parse::<f64>().unwrap() > 60.0);
    let wanted = wanted.unwrap();
    let own: Vec<&str> = rows.lines().filter(|row| hours(row) == wanted).collect();
    place.write("traced.csv", format!("{header}\n{}\n", own.join("\n")));
    let scene = [
        "thresher-study",
        "--set",
        held,
        "--set",
        "step.dt=1e-5",
        "--uncertainty",
        "5e-5",
    ];
    let data = [
        "--profile",
        "traced.csv",
        "--hours",
        &wanted,
        "--against",
        "study.friction",
    ];
    let (out, found) = calibrate(&place, &[&scene[..], &data].concat());
    let fit = number(&found["coefficient_m2_n"]);
    // two runs with other jumps, of 0.2 mm each
    assert!((fit / k - 1.0).abs() < 5e-3, "{fit} {k}");
    assert!(number(&found["low_m2_n"]) < k && number(&found["high_m2_n"]) > k);
    assert_eq!(found["measurements"], own.len());
    assert!(out.contains("friction"), "{out}");
    // one number: told from nothing
    let data = [
        "--depth",
        "0.006",
        "--hours",
        "60",
        "--against",
        "study.friction",
    ];
    let (out, found) = calibrate(&place, &[&scene[..], &data].concat());
    assert_eq!(found["against"][0]["told_apart"], false);
    assert!(out.contains("cannot tell K from study.friction"), "{out}");
    // more friction wears less here: it asks for more K
    assert!(
        number(&found["against"][0]["coefficient_per_key"]) > 0.3,
        "{out}"
    );
    // the profiles of all hours are not one profile
    let all = ["--profile", "truth/profile.csv", "--hours", "60"];
    place.refused(
        &[&["calibrate"], &scene[..], &all].concat(),
        &[
            "truth/profile.csv:28: hours = ",
            "keep the profile of one time",
        ],
    );
}

#[test]
fn what_is_wrong_with_measurements_is_refused_and_nothing_is_written() {
    let place = Place::new();
    let x = |name: &str, text: &str| place.write(name, text);
    x("missing.csv", "x_m,z_m\n0,0\n1,1\n");
    x("nan.csv", "x_m,y_m\n0,0.01\n0.001,NaN\n");
    x("empty.csv", "x_m,y_m\n");
    x("ragged.csv", "x_m,y_m\n0,0.01\n0.001\n");
    x("mm.csv", "x_m,y_m\n0,18.8\n10,17\n");
    x("new.csv", "x_m,y_m\n0,0.0188\n0.02,0.0145564\n");
    let study = [
        "calibrate",
        "thresher-study",
        "--set",
        "step.dt=1e-5",
        "--out",
        "out",
    ];
    let depth = ["--depth", "0.005"];
    let known = ["--uncertainty", "1e-4"];
    let cases: [(&[&str], &[&str]); 23] = [
        (
            &["--mass-loss", "0", "--hours", "60"],
            &["--mass-loss 0: allowed is a number above 0"],
        ),
        (
            &["--mass-loss=-3", "--hours", "60"],
            &["--mass-loss -3: allowed"],
        ),
        (
            &["--mass-loss", "nan", "--hours", "60"],
            &["--mass-loss NaN: allowed"],
        ),
        (
            &["--depth", "0.005", "--hours=-60"],
            &["--hours -60: allowed is a number above 0"],
        ),
        (
            &["--depth", "0.005", "--hours", "0"],
            &["--hours 0: allowed"],
        ),
        (
            &["--depth", "0.005,0.006", "--hours", "1e30"],
            &["wear.coefficient =", "allowed is 1e-30 to 1"],
        ),
        (&depth, &["--hours"]),
        (&["--hours", "60"], &["--mass-loss", "--depth", "--profile"]),
        (
            &["--depth", "0.005", "--mass-loss", "3", "--hours", "60"],
            &["cannot be used with"],
        ),
        (
            &["--depth", "0.005", "--hours", "60"],
            &["give --uncertainty"],
        ),
        (
            &["--depth", "0.005,0.005", "--hours", "60"],
            &["no scatter", "--uncertainty"],
        ),
        (
            &["--depth", "0.005,0.006,0.005", "--hours", "60,70"],
            &["2 values for 3 measurements"],
        ),
        (
            &["--depth", "0.005", "--hours", "60", "--uncertainty", "0"],
            &["--uncertainty 0: allowed"],
        ),
        (
            &["--depth", "0.005,0.006", "--hours", "60", "--level", "95"],
            &["--level 95: allowed"],
        ),
        (
            &["--depth", "0.005,0.006", "--hours", "60", "--density", "1"],
            &["no effect without --mass-loss"],
        ),
        (
            &["--profile", "missing.csv", "--hours", "60"],
            &["missing.csv:1: column y_m is missing; there are x_m, z_m"],
        ),
        (
            &["--profile", "nan.csv", "--hours", "60"],
            &["nan.csv:3: y_m = \"NaN\"", "finite number"],
        ),
        (
            &["--profile", "empty.csv", "--hours", "60"],
            &["empty.csv: 0 points"],
        ),
        (
            &["--profile", "ragged.csv", "--hours", "60"],
            &["ragged.csv", "line: 3"],
        ),
        (&["--profile", "none.csv", "--hours", "60"], &["none.csv"]),
        (
            &["--profile", "mm.csv", "--hours", "60"],
            &["mm.csv:3", "off the surface of tooth", "in metres"],
        ),
        (
            &[
                "--profile",
                "new.csv",
                "--hours",
                "60",
                "--uncertainty",
                "1e-5",
            ],
            &["new.csv: the new surface", "no wear is seen"],
        ),
        (
            &["--depth", "0.5,0.6", "--hours", "60"],
            &["beyond the end of the run", "wear.limits"],
        ),
    ];
    for (args, words) in cases {
        let (code, out, err) = place.run(&[&study[..], args].concat());
        // clap ends with 2 on wrong flags, as in every command
        assert!(code == 1 || code == 2, "{args:?}: {code} {out}");
        for word in words {
            assert!(err.contains(word), "{args:?} lacks `{word}`: {err}");
        }
        assert!(!place.path("out").exists(), "{args:?} left something");
    }
    let refused = |args: &[&str], words: &[&str]| {
        let all = [&["calibrate"], args, &depth, &known, &["--hours", "60"]].concat();
        place.refused(&all, words);
    };
    refused(&["tower"], &["nothing wears"]);
    // before the measurement is looked at
    place.refused(
        &["calibrate", "tower", "--depth", "0.1", "--hours", "60"],
        &["nothing wears"],
    );
    refused(
        &["pin-on-disc", "--body", "disc"],
        &["body disc: does not wear; allowed is pin"],
    );
    refused(
        &["pin-on-disc", "--set", "life.duration=3600"],
        &["longer life.duration than 3600.0 s"],
    );
    refused(&["thresher-study", "--body", "tooth"], &["is a machine"]);
    refused(
        &["thresher-study", "--against", "study.frction"],
        &["did you mean `study.friction`?"],
    );
    refused(
        &["thresher-study", "--against", "study.shares"],
        &["is no number"],
    );
    refused(
        &["thresher-study", "--against", "wear.coefficient"],
        &["is what is fitted"],
    );
    refused(
        &["thresher-study", "--set", "reading=literal"],
        &["literal"],
    );
}
