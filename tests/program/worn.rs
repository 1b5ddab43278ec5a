//! Scenes that wear: the guide's pin on a disc from its file and from its program, what a run writes,
//! and how it ends.

use crate::common::program::Place;
use moreau2d::experiment::{CellRow, NodeRow};
use moreau2d::report::Row;
use serde::de::DeserializeOwned;

#[allow(clippy::all)]
mod program {
    include!("../../src/guide/pin_on_disc/program.rs");

    pub fn run(duration: f64) -> WornColliders {
        pin_on_disc(duration).unwrap()
    }
}

const SCENE: &str = include_str!("../../scenes/pin-on-disc.toml");
const PROGRAM: &str = include_str!("../../src/guide/pin_on_disc/program.rs");
const DURATION: f64 = 3.6e6;

fn rows<R: Row + DeserializeOwned>(place: &Place, folder: &str) -> Vec<R> {
    let file = place.path(folder).join(R::FILE);
    let mut reader = csv::Reader::from_path(file).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}

/// Lines of a text with more than a remark.
fn lines(text: &str) -> usize {
    let said = |line: &&str| !line.trim().is_empty() && !line.trim().starts_with('#');
    text.lines().filter(said).count()
}

#[test]
fn a_pin_on_a_disc_wears_alike_from_a_file_and_from_a_program() {
    assert!(lines(SCENE) <= 25, "{}", lines(SCENE));
    assert!(lines(PROGRAM) <= 30, "{}", lines(PROGRAM));
    let place = Place::new();
    let (code, out, err) = place.run(&["run", "pin-on-disc"]);
    assert_eq!(code, 0, "{out}{err}");
    let cells: Vec<CellRow> = rows(&place, "out/pin-on-disc");
    let last: Vec<&CellRow> = cells.iter().filter(|row| row.seconds == DURATION).collect();
    let nodes: Vec<NodeRow> = rows(&place, "out/pin-on-disc");
    let surface = nodes.iter().filter(|row| row.seconds == DURATION);

    let worn = program::run(DURATION);
    assert_eq!(worn.seconds(), DURATION);
    let depth = worn.state(0).depth();
    assert_eq!(depth.len(), last.len());
    // K F s / A
    let expected = 1e-12 * (1000.0 * 0.01 * 0.04 * 9.81) * (0.5 * DURATION) / 0.01;
    for (row, own) in last.iter().zip(depth.iter().rev()) {
        println!("{:e} {own:e} {expected:e}", row.depth_m);
        assert!(
            (row.depth_m / own - 1.0).abs() < 1e-12,
            "{} {own}",
            row.depth_m
        );
        // single precision of the corners over the depth of a jump
        assert!((own / expected - 1.0).abs() < 1e-5, "{own} {expected}");
    }
    for (row, node) in surface.zip(worn.state(0).profile().nodes().iter().rev()) {
        let place = worn.in_collider(0, *node);
        assert!((row.x_m - place.x).abs() < 1e-15 && (row.y_m - place.y).abs() < 1e-15);
    }

    let summary = place.json("out/pin-on-disc/summary.json");
    assert_eq!(summary["wear"][0]["body"], "pin");
    assert_eq!(summary["wear_hours"], 1000.0);
    assert_eq!(summary["wear_compliance"], true);
    assert!(summary["ended"].is_null());
    assert!(out.contains("contacts are rigid"), "{out}");
    let files = place.listing("out/pin-on-disc");
    for file in [
        "jumps.csv",
        "steps.csv",
        "wear-per-cell-pin.svg",
        "worn-surface-pin.svg",
    ] {
        assert!(files.iter().any(|known| known == file), "{files:?}");
    }
}

/// The same bytes for any number of threads; a stiffness of the material in place of wear compliance.
#[test]
fn threads_change_no_byte_and_a_stiffness_gives_the_same_depth() {
    let place = Place::new();
    let stiff = "[[material]]\nname = \"steel\"\nstiffness = 1e6\n\n[[body]]\nname = \"disc\"";
    let text = SCENE.replacen("[[body]]\nname = \"disc\"", stiff, 1);
    place.write("stiff.toml", text);
    // so soft that it lies 0.39 mm deep
    let args = [
        "duration=2e5",
        "wear.pin.cell=1e-3",
        "life.jump=1e-5",
        "overlap=0.1",
    ];
    let args = args.map(|change| ["--set", change]).concat();
    let mut found = Vec::new();
    for threads in ["1", "2"] {
        let head = ["run", "stiff.toml", "--threads", threads, "--out", threads];
        let (code, out, err) = place.run(&[&head[..], &args[..]].concat());
        assert_eq!(code, 0, "{out}{err}");
        assert!(!out.contains("wear compliance"), "{out}");
        found.push(std::fs::read(place.path(threads).join("wear.csv")).unwrap());
    }
    assert_eq!(found[0], found[1]);
    let cells: Vec<CellRow> = rows(&place, "1");
    let expected = 1e-12 * 3.924 * (0.5 * 2e5) / 0.01;
    let last: Vec<&CellRow> = cells.iter().filter(|row| row.seconds == 2e5).collect();
    assert_eq!(last.len(), 11);
    for row in last {
        assert!(
            (row.depth_m / expected - 1.0).abs() < 1e-4,
            "{row:?} {expected}"
        );
    }
}

/// A body that wears through itself ends the run, with all that was found.
#[test]
fn a_body_worn_through_loses_nothing_of_what_was_found() {
    let place = Place::new();
    let thin = SCENE.replacen("box = [0.01, 0.04]", "box = [0.01, 0.001]\nmass = 0.4", 1);
    place.write("thin.toml", thin.replacen("[0, 0.07]", "[0, 0.0505]", 1));
    let (code, out, err) = place.run(&["run", "thin.toml", "--set", "duration=3.6e7"]);
    assert_eq!(code, 2, "{out}{err}");
    assert!(
        out.contains("body pin: surface 0 is worn through itself after"),
        "{out}"
    );
    let summary = place.json("out/pin-on-disc/summary.json");
    let deepest = summary["wear"][0]["deepest_m"].as_f64().unwrap();
    assert!((7e-4..1e-3).contains(&deepest), "{deepest}");
    let cells: Vec<CellRow> = rows(&place, "out/pin-on-disc");
    assert!(cells.iter().any(|row| row.depth_m == deepest));
}

/// Bug: the pictures of any body said "along the tooth", a closed surface was drawn open, and its depths over
/// x, where every x has two cells.
#[test]
fn pictures_of_a_disc_go_once_round_it() {
    let place = Place::new();
    let disc = SCENE.replacen("box = [0.01, 0.04]", "disc = 0.02", 1);
    place.write("disc.toml", disc.replacen("edges = [0, 0]", "", 1));
    let (code, out, err) = place.run(&["run", "disc.toml", "--set", "duration=1e5"]);
    assert_eq!(code, 0, "{out}{err}");
    let picture = |name: &str| {
        let file = place.path("out/pin-on-disc").join(name);
        std::fs::read_to_string(file).unwrap()
    };
    let depth = picture("wear-per-cell-pin.svg");
    assert!(depth.contains("along the new surface") && !depth.contains("tooth"));
    // the first line that is not of the grid: x rises all along a line, and an outline ends where it starts
    let line = |svg: &str, points: usize| -> Vec<f64> {
        let mut lines = svg.split("points=\"").skip(1);
        let found = lines.find_map(|rest| {
            let words: Vec<&str> = rest.split('"').next()?.split_whitespace().collect();
            (words.len() == points).then_some(words)
        });
        let xs = found.unwrap().into_iter();
        xs.map(|word| word.split(',').next().unwrap().parse().unwrap())
            .collect()
    };
    let along = line(&depth, 64);
    assert!(along.windows(2).all(|pair| pair[1] > pair[0]), "{along:?}");
    let round = line(&picture("worn-surface-pin.svg"), 65);
    assert_eq!(round[0], round[64]);
}

/// An upper side that nothing touches: not a depth of 0 without a word.
#[test]
fn a_body_that_nothing_wears_is_told() {
    let place = Place::new();
    let (code, out, err) = place.run(&["run", "pin-on-disc", "--set", "wear.pin.edges=[2, 2]"]);
    assert_eq!(code, 0, "{out}{err}");
    let told = "nothing slid under load on the edges of body pin that wear";
    assert!(out.contains(told), "{out}");
    let summary = place.json("out/pin-on-disc/summary.json");
    assert_eq!(summary["wear"][0]["deepest_m"], 0.0);
    assert!(summary["warnings"].to_string().contains(told));
    // where all is well, it is not
    let (_, out, _) = place.run(&["run", "pin-on-disc"]);
    assert!(!out.contains("nothing slid"), "{out}");
}

#[test]
fn wear_without_effect_or_without_sense_is_refused() {
    let place = Place::new();
    for (args, expected) in [
        (
            &["run", "pin-on-disc", "--engine", "rapier"][..],
            "scene pin-on-disc wears",
        ),
        (
            &["compare", "pin-on-disc", "--set", "coefficient=1e-13"],
            "only `run` wears",
        ),
        (
            &["run", "pin-on-disc", "--dump-problems", "p"],
            "runs in cycles",
        ),
        (
            &["run", "pin-on-disc", "--set", "wear.pin.cell=0.5"],
            "wear.pin.cell = 0.5: allowed is 1.0000e-6 to 2.0000e-2 m",
        ),
        (
            &["run", "pin-on-disc", "--set", "wear.pin.body=pinn"],
            "did you mean `pin`?",
        ),
        (
            &["run", "pin-on-disc", "--set", "wear.pin.coefficient=-1"],
            "1e-30 to 1 m²/N",
        ),
    ] {
        place.refused(args, &[expected]);
    }
}

/// `mass = true`: the load falls with the pin, `h = L (1 − exp(−K ρ g s))` for a pin of length L, and the
/// jumps are off by what they say.
#[test]
fn a_pin_loses_its_weight_on_request() {
    let place = Place::new();
    let changes = ["wear.pin.mass=true", "life.jump=2e-5"].map(|change| ["--set", change]);
    let head = ["run", "pin-on-disc", "--quiet"];
    let (code, out, err) = place.run(&[&head[..], &changes.concat()].concat());
    assert_eq!(code, 0, "{out}{err}");
    let summary = place.json("out/pin-on-disc/summary.json");
    let number = |key: &str| summary["wear"][0][key].as_f64().unwrap();
    let exact = 0.04 * (1.0 - (-1e-12 * 1000.0 * 9.81 * 0.5 * DURATION).exp());
    // without it K F s / A is 0.9 % more
    let off = number("deepest_m") - exact;
    assert!((off / exact).abs() < 5e-4, "{off} {exact}");
    let told = number("jump_error_m");
    assert!((off / told - 1.0).abs() < 0.05, "{off} {told}");
}

/// Bug: 400 cells under a pin, each of which a step resolves, rang for ever between two states, and the
/// largest load on a cell was right on average alone.
#[test]
fn a_pin_on_many_cells_comes_to_rest() {
    let place = Place::new();
    let finer = ["--set", "wear.pin.cell=5e-5", "--set", "duration=1e5"];
    let args: Vec<&str> = ["run", "pin-on-disc"].into_iter().chain(finer).collect();
    let (code, out, err) = place.run(&args);
    assert_eq!(code, 0, "{out}{err}");
    let summary = place.json("out/pin-on-disc/summary.json");
    let open = summary["wear_open_load"].as_f64().unwrap();
    assert!(open < 1e-3, "{open}");
}

/// Bug: the last cycles of a pin thinner than it sinks in, by wear compliance or by a stiffness, met the
/// disc through its upper side: overlaps of 0.08 m, and jumps by loads that were none.
#[test]
fn a_pin_ends_before_the_disc_reaches_through_it() {
    let place = Place::new();
    let stiff = "[[material]]\nname = \"steel\"\nstiffness = 1e6\n\n[[body]]\nname = \"disc\"";
    let text = SCENE.replacen("[[body]]\nname = \"disc\"", stiff, 1);
    place.write("rigid.toml", SCENE);
    place.write("stiff.toml", text);
    for (file, sinks) in [("rigid.toml", 2e-4), ("stiff.toml", 7.848e-4)] {
        let changes = ["duration=1e10", "overlap=0.1", "life.jump=2e-4"];
        let changes = changes.map(|change| ["--set", change]).concat();
        let (code, out, err) = place.run(&[&["run", file, "--out", "r"][..], &changes].concat());
        assert_eq!(code, 2, "{file}: {out}{err}");
        assert!(out.contains("worn through itself after"), "{file}: {out}");
        let summary = place.json("r/summary.json");
        let number = |value: &serde_json::Value| value.as_f64().unwrap();
        let deepest = number(&summary["totals"]["worst_penetration_m"]);
        // a landing on a new surface
        assert!(deepest < 1.5 * sinks, "{file}: {deepest}");
        let pin = &summary["wear"][0];
        let (gone, error) = (number(&pin["deepest_m"]), number(&pin["jump_error_m"]));
        assert!((0.0385..0.04).contains(&gone), "{file}: {gone}");
        // the same load from the first jump to the last
        assert!(error < 1e-6, "{file}: {error}");
        let rate = gone / number(&summary["wear_s"]);
        assert!((rate / 1.962e-10 - 1.0).abs() < 1e-4, "{file}: {rate}");
    }
}

/// Bug: jumps of a nanometre, seven million of them, ran for ever.
#[test]
fn jumps_without_end_are_bounded() {
    let place = Place::new();
    let changes = ["life.jump=1e-9", "step.time=0.02", "life.settle=0"];
    let changes = changes.map(|change| ["--set", change]).concat();
    let (code, out, err) = place.run(&[&["run", "pin-on-disc"][..], &changes].concat());
    assert_eq!(code, 2, "{out}{err}");
    for words in [
        "life.jump = 1e-9: 20000 jumps",
        "of the 3600000.0 s of life.duration",
        "allowed is about",
    ] {
        assert!(out.contains(words), "{words}: {out}");
    }
    let allowed = "allowed is 1.34e-6 to 1 m";
    for scene in ["thresher", "thresher-study"] {
        place.refused(
            &["run", scene, "--set", "wear.jump=1e-9"],
            &["wear.jump", allowed],
        );
    }
}

/// Bug: depths of hundreds of metres on a tooth of 18.8 mm on a base of 8 mm, and all was well.
#[test]
fn a_study_ends_where_the_tooth_ends() {
    let place = Place::new();
    let args = ["run", "thresher-study", "--out", "r", "--set"];
    let (code, out, err) = place.run(&[&args[..], &["study.cycles=1e12"]].concat());
    assert_eq!(code, 2, "{out}{err}");
    for words in [
        "base worn through after",
        "at 18 of 18 points the base is worn through before the study.cycles = 1000000000000.0",
        "base worn through: after",
    ] {
        assert!(out.contains(words), "{words}: {out}");
    }
    let number = |cell: &String| cell.parse::<f64>().unwrap();
    let rows = place.rows("r/comparison.csv");
    let cycles: Vec<f64> = rows.iter().map(|row| number(&row[6])).collect();
    for row in &rows {
        let depth = 1e-6 * number(&row[3]);
        assert!((0.02..0.0268).contains(&depth), "{row:?}");
    }
    // wear of a cycle is as the torque and the speed
    for (k, speed) in [70.0, 80.0, 90.0, 100.0, 110.0, 120.0].iter().enumerate() {
        for (row, torque) in [(k, 146.39), (k + 6, 20.87)] {
            let scaled = cycles[row] * speed * torque / (cycles[0] * 70.0 * 146.39);
            assert!((scaled - 1.0).abs() < 1e-6, "{torque} {speed}: {scaled}");
        }
    }
    // as many cycles as the first tooth lasts, and a little more and less
    let frictions = place.rows("r/friction.csv");
    let all = cycles.iter().copied();
    let all = all.chain(frictions.iter().map(|row| number(&row[6])));
    let first = all.fold(f64::INFINITY, f64::min);
    for (share, expected) in [(0.97, 0), (1.03, 2)] {
        let most = format!("study.cycles={}", share * first);
        let flags = ["--set", "study.batches=24"];
        let (code, out, err) = place.run(&[&args[..], &[&most], &flags].concat());
        assert_eq!(code, expected, "{share}: {out}{err}");
    }
}
