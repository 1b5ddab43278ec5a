//! `moreau2d chart`: points, pictures, who is dominated, and the reference of our own.

use crate::common::program::Place;
use moreau2d::report::{
    Domination, DominationRow, PointRow, ResultRow, UndominatedRow, observed_order, panels,
    read_rows, shared, work_precision,
};
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

const BOX2D: bool = cfg!(feature = "box2d");

/// A folder in which the program runs, and what it printed.
struct Charted {
    place: Place,
    code: i32,
    out: String,
    err: String,
}

impl Charted {
    fn new() -> Charted {
        Charted {
            place: Place::new(),
            code: -1,
            out: String::new(),
            err: String::new(),
        }
    }

    fn chart(&mut self, args: &[&str]) {
        let args = [&["chart"], args].concat();
        (self.code, self.out, self.err) = self.place.run(&args);
    }

    fn path(&self, name: &str) -> PathBuf {
        self.place.path(name)
    }

    fn rows(&self, folder: &str) -> Vec<ResultRow> {
        assert_eq!(self.code, 0, "{}", self.err);
        read_rows(&self.path(folder).join("results.csv")).unwrap()
    }
}

fn charted(args: &[&str]) -> Charted {
    let mut charted = Charted::new();
    charted.chart(args);
    charted
}

fn key(row: &ResultRow) -> (String, String, String, String, String, u64) {
    (
        row.scene.clone(),
        row.engine.clone(),
        row.scheme.clone(),
        row.solver.clone(),
        row.setting.clone(),
        row.dt_s.to_bits(),
    )
}

/// One run serves all that is asked of a quick chart: it takes a second in all.
#[test]
fn a_quick_chart_is_whole_and_every_point_runs_again_by_its_command() {
    let mut c = charted(&["sliding-block", "tower", "--quick", "--out", "r"]);
    let rows = c.rows("r");
    // three schemes of ours and two presets at three steps, of each scene; and Box2D's preset
    let each = if BOX2D { 6 * 3 } else { 5 * 3 };
    let points: BTreeSet<_> = rows.iter().map(key).collect();
    assert_eq!(points.len(), 2 * each);
    for (scene, measures) in [
        (
            "sliding-block",
            vec!["distance", "stop-time", "penetration", "energy-rise"],
        ),
        ("tower", vec!["trajectory", "penetration", "energy-rise"]),
    ] {
        for measure in measures {
            let of = rows
                .iter()
                .filter(|r| r.scene == scene && r.measure == measure);
            assert_eq!(of.count(), each, "{scene} {measure}");
        }
    }
    assert!(rows.iter().all(|r| match r.measure.as_str() {
        "trajectory" => r.reference.starts_with("self-converged ±"),
        "distance" => r.reference == "closed form",
        _ => true,
    }));
    assert!(
        c.out.contains(
            "note: tower: no closed form: trajectories are compared with moreau's own run"
        )
    );

    // pictures from the file alone, with labels and fronts and without a NaN
    for scene in ["sliding-block", "tower"] {
        let of: Vec<ResultRow> = rows.iter().filter(|r| r.scene == scene).cloned().collect();
        let svg = fs::read_to_string(c.path("r").join(format!("{scene}.svg"))).unwrap();
        assert!(
            svg == panels(&work_precision(&shared(&of))).unwrap(),
            "{scene}"
        );
        for text in [
            "front of ours",
            "front of the peers",
            "1/60 s",
            "rapier-stiff",
            "PGS",
        ] {
            assert!(svg.contains(text), "{scene}: {text}");
        }
        assert!(!svg.contains("NaN"), "{scene}");
    }
    let pairs: Vec<DominationRow> = read_rows(&c.path("r/domination.csv")).unwrap();
    let left: Vec<UndominatedRow> = read_rows(&c.path("r/undominated.csv")).unwrap();
    assert_eq!(
        Domination::new(&rows),
        Domination {
            pairs,
            undominated: left
        }
    );

    // drawn again from the file: the same bytes
    c.chart(&["--from", "r/results.csv", "--out", "again"]);
    assert_eq!(c.code, 0, "{}", c.err);
    for name in ["tower.svg", "domination.csv", "undominated.csv"] {
        let read = |folder: &str| fs::read(c.path(folder).join(name)).unwrap();
        assert!(read("r") == read("again"), "{name}");
    }

    // the same values bit for bit from the command beside each of some points
    let commands: Vec<PointRow> = read_rows(&c.path("r/points.csv")).unwrap();
    assert_eq!(commands.len(), points.len());
    for k in [1, 5, 10, 13, 16, 21, 25, 29] {
        let point = &commands[k];
        let words: Vec<&str> = point.command.split(' ').skip(2).collect();
        c.chart(&[&words[..], &["--out", "one"]].concat());
        let one = c.rows("one");
        let value = |r: &ResultRow| (r.measure.clone(), r.value.to_bits(), r.reference.clone());
        let of = |row: &ResultRow| {
            (
                &row.scene,
                &row.engine,
                &row.scheme,
                &row.solver,
                &row.setting,
                row.dt_s,
            ) == (
                &point.scene,
                &point.engine,
                &point.scheme,
                &point.solver,
                &point.setting,
                point.dt_s,
            )
        };
        assert!(one.iter().all(of), "{}: another point", point.command);
        let there: Vec<_> = rows.iter().filter(|r| of(r)).map(value).collect();
        let here: Vec<_> = one.iter().map(value).collect();
        assert_eq!(here, there, "{}", point.command);
    }
}

/// The full ladders: every tolerance, solver and setting of rapier once, and each spelled out.
#[test]
fn the_full_chart_of_a_scene_has_all_ladders() {
    let c = charted(&["two-balls", "--repeats", "2", "--time", "0.2", "--out", "r"]);
    let rows = c.rows("r");
    let points: BTreeSet<_> = rows.iter().map(key).collect();
    // 5 engines and schemes at 6 steps, 3 tolerances, 2 solvers; 16 settings of rapier at two
    // steps, of which both presets stand already; Box2D at 6 steps, and what of its settings at
    // two of them it can have: 1 and 3, 3 and 4 frequencies at 4 and 40 substeps
    let box2d = if BOX2D { 6 + 4 + 7 - 2 } else { 0 };
    assert_eq!(points.len(), 5 * 6 + 3 + 2 + 2 * (16 - 2) + box2d);
    let of = |find: &dyn Fn(&ResultRow) -> bool| {
        let keys: BTreeSet<_> = rows.iter().filter(|r| find(r)).map(key).collect();
        keys.len()
    };
    for tolerance in ["1e-4", "1e-6", "1e-10"] {
        assert_eq!(of(&|r| r.setting == format!("tolerance {tolerance}")), 1);
    }
    for solver in ["nsgs", "direct"] {
        assert_eq!(of(&|r| r.solver == solver), 1, "{solver}");
    }
    assert_eq!(
        of(&|r| r
            .setting
            .starts_with("2000 Hz, x2 at fixed bodies, 40 substeps, 4 PGS")),
        2
    );
    assert!(rows.iter().all(|r| r.spread.is_some()));
    let commands: Vec<PointRow> = read_rows(&c.path("r/points.csv")).unwrap();
    let swept = commands
        .iter()
        .find(|p| p.setting.starts_with("120 Hz, x2 at fixed bodies, 40"));
    let command = &swept.unwrap().command;
    assert!(
        command.contains("--soft 120,40,1") && command.contains("--time 0.2"),
        "{command}"
    );
}

const PENDULUM: &str = "[scene]\nname = \"swing\"\ntitle = \"t\"\n[step]\ntime = 1\n\
    [[body]]\nname = \"bob\"\ndisc = 0.1\nposition = [0.6, -0.8]\n\
    [[joint]]\nkind = \"revolute\"\nbodies = [\"world\", \"bob\"]\nat = [0, 0]\n";

/// A pendulum's scheme is of order 2: so is what its own converged run shows, and the bar of the
/// reference is the difference of steps of 1/2000 and 1/4000 s, 3/4 · 1/4 of the error at 1/125 s
/// over (2000/125)². The coarsest step does not count: the gap of the pin, two thirds of its error of second
/// order, is closed in what is shown, and the higher orders of the rest are seen.
#[test]
fn an_error_against_our_own_run_has_the_order_of_the_scheme() {
    let mut c = Charted::new();
    fs::write(c.path("swing.toml"), PENDULUM).unwrap();
    let flags = [
        "--scheme",
        "staggered",
        "--solver",
        "auto",
        "--tolerance",
        "1e-12",
    ];
    c.chart(&[&["swing.toml", "--repeats", "1", "--out", "r"], &flags[..]].concat());
    let rows = c.rows("r");
    let ours = rows
        .iter()
        .filter(|r| r.engine == "moreau" && r.measure == "trajectory");
    let points: Vec<(f64, f64)> = ours.map(|r| (r.dt_s, r.value)).collect();
    assert_eq!(points.len(), 6);
    let (order, error) = observed_order(&points[1..]).unwrap();
    assert!((order - 2.0).abs() < 0.1, "{order} ± {error}");
    let row = rows.iter().find(|r| r.measure == "trajectory").unwrap();
    let bar: f64 = row.reference["self-converged ±".len()..]
        .split(' ')
        .next()
        .unwrap()
        .parse()
        .unwrap();
    let expected = points[2].1 * (125.0_f64 / 2000.0).powi(2) * 0.75;
    assert!((bar / expected - 1.0).abs() < 0.2, "{bar} {expected}");
    assert!(
        rows.iter()
            .any(|r| r.measure == "joint-gap" && r.engine == "rapier")
    );
    let svg = fs::read_to_string(c.path("r/swing.svg")).unwrap();
    assert!(svg.contains("reference ±"), "the bar is in the picture");
}

#[test]
fn bad_input_is_refused_before_anything_runs() {
    for (args, words) in [
        (&["slidng-block"][..], "did you mean `sliding-block`"),
        (&["tower", "nowhere.toml"], "nowhere.toml"),
        (&["tower", "tower"], "named twice"),
        (&["tower", "--engine", "rapir"], "did you mean rapier?"),
        (
            &["tower", "--engine", "moreau", "--soft", "30,4,1"],
            "--soft",
        ),
        (&["tower", "--soft", "30,4,1"], "--engine"),
        (
            &["tower", "--engine", "rapier", "--soft", "30,4"],
            "HZ,SUBSTEPS,PGS",
        ),
        (
            &["tower", "--engine", "rapier", "--soft", "30,0,1"],
            "HZ,SUBSTEPS,PGS",
        ),
        (&["bowl", "--engine", "rapier"], "only moreau steps it"),
        (
            &["thresher", "--engine", "rapier"],
            "only moreau steps its contacts",
        ),
        (&["thresher-study", "--time", "1"], "--time"),
        (
            &["thresher-study", "--set", "study.reading=\"literal\""],
            "no algebra",
        ),
        (&["tower", "--repeats", "0"], "1..=100"),
        (&["--quik"], "--quick"),
        (&["--from", "none.csv"], "none.csv"),
        (&["tower", "--from", "none.csv"], "--from"),
        (&["--from", "none.csv", "--dt", "0.5"], "--dt"),
        (&["--from", "none.csv", "--set", "foo=1"], "--set"),
        // they write no page
        (&["--models", "--report"], "--report"),
        (&["--accuracy", "--report"], "--report"),
    ] {
        Place::new().refused(&[&["chart"], args].concat(), &[words]);
    }
}
