//! `moreau2d compare`: the table behind it, and the pictures drawn from it.

use crate::common::program::Place;
use moreau2d::report::{
    ResultRow, convergence, energy, observed_order, panels, read_rows, work_precision,
};
use std::collections::BTreeSet;
use std::fs;
use std::path::PathBuf;

/// A folder in which the program ran, and what it printed.
struct Compared {
    place: Place,
    code: i32,
    out: String,
    err: String,
}

/// Compares a scene of the catalogue, or one whose text this is.
fn compare(scene: &str, flags: &[&str]) -> Compared {
    let place = Place::new();
    let mut args = ["compare", scene, "--out", "r"];
    if scene.starts_with("[scene]") {
        place.write("s.toml", scene);
        args[1] = "s.toml";
    }
    let (code, out, err) = place.run(&[&args[..], flags].concat());
    Compared {
        place,
        code,
        out,
        err,
    }
}

impl Compared {
    fn path(&self, name: &str) -> PathBuf {
        self.place.path("r").join(name)
    }

    fn rows(&self) -> Vec<ResultRow> {
        assert_eq!(self.code, 0, "{}", self.err);
        read_rows(&self.path("results.csv")).unwrap()
    }
}

type Point<'a> = (&'a str, &'a str, &'a str, u64);

fn point(row: &ResultRow) -> Point<'_> {
    (&row.engine, &row.scheme, &row.setting, row.dt_s.to_bits())
}

#[test]
fn every_point_is_in_the_table_once_with_time_and_spread() {
    let compared = compare("two-balls", &["--ladder", "--steps", "6", "--repeats", "2"]);
    let text = fs::read_to_string(compared.path("results.csv")).unwrap();
    assert_eq!(
        text.lines().next().unwrap(),
        "scene,rung,engine,scheme,solver,setting,dt_s,threads,precision,measure,value,unit,\
         reference,seconds_per_simulated_second,spread,verdict,mode"
    );
    let mut rows = compared.rows();
    // counted in its own test, where it is built in
    rows.retain(|r| r.engine != "box2d");
    let ladder: BTreeSet<u64> = [30.0, 60.0, 125.0, 250.0, 500.0, 1000.0]
        .map(|n: f64| n.recip().to_bits())
        .into();
    for (engine, scheme, events) in [
        ("moreau", "staggered", false),
        ("moreau", "staggered", true),
        ("moreau", "moreau", false),
        ("rapier", "", false),
        ("rapier-stiff", "", false),
    ] {
        let of = rows.iter().filter(|r| {
            let located = r.setting.ends_with(", events");
            r.engine == engine && r.scheme == scheme && located == events
        });
        assert_eq!(
            of.map(|r| r.dt_s.to_bits()).collect::<BTreeSet<_>>(),
            ladder,
            "{engine}"
        );
    }
    // five engines and schemes on the ladder, and the sweep: 4 frequencies, 2 numbers of substeps
    // and 2 of iterations at two steps, where the preset stands already
    let points: BTreeSet<Point> = rows.iter().map(point).collect();
    assert_eq!(points.len(), 5 * 6 + 2 * (4 * 2 * 2 - 1));
    for measure in [
        "striker-speed",
        "target-speed",
        "penetration",
        "energy-rise",
    ] {
        let of: Vec<Point> = rows
            .iter()
            .filter(|r| r.measure == measure)
            .map(point)
            .collect();
        assert_eq!(of.len(), points.len(), "{measure}: once for every point");
        assert_eq!(of.into_iter().collect::<BTreeSet<_>>(), points, "{measure}");
    }
    for row in &rows {
        assert!(row.seconds_per_simulated_second.unwrap() > 0.0, "{row:?}");
        assert!(row.spread.unwrap() >= 0.0, "{row:?}");
        assert_eq!((row.threads, row.verdict.as_str()), (1, ""), "{row:?}");
    }
    // two runs of a few microseconds never take the same time at every point
    assert!(rows.iter().any(|r| r.spread.unwrap() > 0.0));
}

#[test]
fn settings_of_a_peer_are_spelled_in_full() {
    let rows = compare("two-balls", &["--steps", "2", "--repeats", "1"]).rows();
    let settings = |engine: &str| -> BTreeSet<String> {
        let of = rows.iter().filter(|r| r.engine == engine);
        of.map(|r| r.setting.clone()).collect()
    };
    let default = "30 Hz, x2 at fixed bodies, 4 substeps, 1 PGS";
    assert_eq!(settings("rapier"), BTreeSet::from([default.to_owned()]));
    let stiff = settings("rapier-stiff");
    assert_eq!(stiff.len(), 16);
    assert!(stiff.contains("500 Hz, x2 at fixed bodies, 40 substeps, 1 PGS"));
    assert_eq!(
        settings("moreau"),
        BTreeSet::from(["tolerance 1e-8", "tolerance 1e-8, events"].map(str::to_owned))
    );
    // a single run has no spread
    assert!(rows.iter().all(|r| r.spread.is_none()));
}

#[test]
fn a_scheme_that_is_asked_for_is_the_only_one_and_the_sweep_can_be_left_out() {
    let flags = [
        "--steps",
        "2",
        "--repeats",
        "1",
        "--scheme",
        "moreau",
        "--no-sweep",
    ];
    let rows = compare("two-balls", &flags).rows();
    let points: BTreeSet<Point> = rows.iter().map(point).collect();
    // ours, rapier and its stiff preset, and Box2D where it is built in, at three steps
    assert_eq!(points.len(), if cfg!(feature = "box2d") { 12 } else { 9 });
    let ours = rows.iter().filter(|r| r.engine == "moreau");
    assert!(ours.clone().count() > 0);
    assert!(ours.clone().all(|r| r.scheme == "moreau"));
}

/// Every value comes back bit for bit; only the clock differs.
#[test]
fn a_second_comparison_differs_in_its_times_alone() {
    let values = || -> Vec<(String, u64)> {
        let rows = compare("spinning-disc", &["--steps", "60", "--repeats", "1"]).rows();
        let value = |r: &ResultRow| (format!("{:?} {}", point(r), r.measure), r.value.to_bits());
        rows.iter().map(value).collect()
    };
    let first = values();
    assert!(first.len() > 100);
    assert_eq!(first, values());
}

#[test]
fn pictures_are_drawn_from_the_file_alone() {
    let compared = compare(
        "bouncing-ball",
        &["--ladder", "--time", "2", "--repeats", "1"],
    );
    let rows = compared.rows();
    for (name, charts) in [
        ("work-precision.svg", work_precision(&rows)),
        ("convergence.svg", convergence(&rows)),
        ("energy.svg", energy(&rows)),
    ] {
        let written = fs::read_to_string(compared.path(name)).unwrap();
        assert!(!charts.is_empty(), "{name}");
        assert!(
            panels(&charts).unwrap() == written,
            "{name}: not the bytes of the rows"
        );
        assert!(compared.out.contains(name));
        assert!(!written.contains("NaN"), "{name}");
    }
    // another value in the file is another picture
    let mut changed = rows.clone();
    let apex = changed.iter_mut().find(|r| r.measure == "apex-3").unwrap();
    apex.value *= 10.0;
    let pictures = |rows: &[ResultRow]| panels(&work_precision(rows)).unwrap();
    assert!(pictures(&changed) != pictures(&rows));
}

/// Without a ladder there is nothing to converge; a picture without any value is not written.
#[test]
fn pictures_that_show_nothing_are_not_written() {
    let compared = compare("sliding-block", &["--steps", "12", "--repeats", "1"]);
    assert!(compared.path("work-precision.svg").exists());
    assert!(!compared.path("convergence.svg").exists());
    // friction only takes energy: no engine's ever rises
    let compared = compare(
        "sliding-block",
        &["--ladder", "--steps", "12", "--repeats", "1"],
    );
    let rows = compared.rows();
    let rises = rows.iter().filter(|r| r.measure == "energy-rise");
    let rising: Vec<_> = rises.filter(|r| r.value != 0.0).collect();
    assert!(rising.is_empty(), "{rising:?}");
    assert!(!compared.path("energy.svg").exists());
}

/// In f32 the energy of this disc is infinite. The engine that fails is in the table, without a
/// time, and the comparison goes on.
/// The numbers are too large for single precision only.
#[test]
#[cfg(not(feature = "f64"))]
fn an_engine_that_fails_is_a_row_of_nan() {
    let scene = "[scene]\nname = \"overflow\"\ntitle = \"t\"\n[step]\ndt = 1e-7\ntime = 4e-7\n\
                 [[body]]\nname = \"disc\"\ndisc = 1e6\ndensity = 1e9\nspin = 1e6\n";
    let compared = compare(scene, &["--repeats", "2"]);
    let rows = compared.rows();
    let (ours, peers): (Vec<_>, Vec<_>) = rows.iter().partition(|r| r.engine == "moreau");
    assert!(!ours.is_empty() && !peers.is_empty());
    for row in ours {
        assert!(
            row.value.is_finite() && row.seconds_per_simulated_second.is_some(),
            "{row:?}"
        );
    }
    for row in peers {
        assert!(
            row.value.is_nan() && row.seconds_per_simulated_second.is_none(),
            "{row:?}"
        );
        assert_eq!(
            (row.verdict.as_str(), row.mode.as_str()),
            ("fail", "explodes")
        );
    }
    assert!(
        compared.out.contains("rapier failed at 3 points"),
        "{}",
        compared.out
    );
    assert!(compared.out.contains("the energy is not finite"));
}

/// Stopping inside a step leaves a share of the way: relative to `v²/(2 μ g)` it is
/// `4 φ (1 − φ) (μ g Δt/2v)²`, φ the share of the step that is slid. One run has one φ a step
/// length: on this ladder `4 φ (1 − φ)` is .97, .54, .98, .53, .86 and .93, which alone fits an
/// order of -0.02. A ladder of other phases within these bounds would be off by 0.22 at most, so
/// that 0.2 is no tighter than chance and still tells 2 from 1 and 3.
#[test]
fn the_distance_of_the_sliding_block_converges_with_order_two() {
    let rows = compare(
        "sliding-block",
        &["--ladder", "--repeats", "1", "--no-sweep"],
    )
    .rows();
    for (scheme, events) in [("staggered", false), ("staggered", true), ("moreau", false)] {
        let points: Vec<(f64, f64)> = rows
            .iter()
            .filter(|r| r.scheme == scheme && r.measure == "distance")
            .filter(|r| r.setting.ends_with(", events") == events)
            .map(|r| (r.dt_s, r.value))
            .collect();
        assert_eq!(points.len(), 6);
        if events {
            // the end of the slide is located: what is left is round-off, without an order
            let worst = points.iter().map(|p| p.1).fold(0.0, f64::max);
            assert!(worst < 1e-9, "{worst}");
            continue;
        }
        let (order, error) = observed_order(&points).unwrap();
        assert!((order - 2.0).abs() < 0.2, "{scheme}: {order} ± {error}");
        for (dt, error) in points {
            let phase = (5.0 / (0.5 * 9.81) / dt).fract();
            let exact = 4.0 * phase * (1.0 - phase) * (0.5 * 9.81 * dt / 10.0).powi(2);
            // the law itself, to the round-off of a thousand steps
            assert!((error - exact).abs() < 1e-12, "{dt}: {error} {exact}");
        }
    }
}

#[test]
fn flags_that_make_no_sense_are_refused() {
    for (flags, words) in [
        (&["--repeats", "0"][..], "1..=100"),
        (&["--repeats", "101"], "1..=100"),
        (&["--repeats", "many"], "invalid digit"),
        (&["--ladder", "6"], "unexpected argument"),
        (&["--laddr"], "--ladder"),
        (&["--sweep"], "--no-sweep"),
        (&["--engine", "rapier"], "--engine"),
        (&["--scheme", "euler"], "`euler`"),
    ] {
        let args = [&["compare", "two-balls"], flags].concat();
        Place::new().refused(&args, &[words]);
    }
}
