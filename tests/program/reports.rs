//! What tables, files and pictures say, and what they leave open.

use crate::common::program::Place;
use moreau2d::experiment::{Engine, Totals, simulate};
use moreau2d::report::{
    ResultRow, StepRow, convergence, panels, read_rows, scatter, work_precision,
};
use moreau2d::scene;

// --- what a peer does not tell ------------------------------------------------------------------

/// Columns of steps.csv that a peer's step fills: all others are empty, and not 0.
const TOLD: [&str; 6] = [
    "time_s",
    "dt_s",
    "contacts",
    "kinetic_j",
    "potential_j",
    "penetration_m",
];

#[test]
fn what_a_peer_does_not_tell_is_empty_in_every_file() {
    let place = Place::new();
    let mut engines = vec!["rapier", "rapier-stiff"];
    if cfg!(feature = "box2d") {
        engines.push("box2d");
    }
    for engine in engines {
        let args = "run tower --steps 5 --quiet --out r --engine";
        let mut args: Vec<&str> = args.split(' ').collect();
        args.push(engine);
        let (code, _, err) = place.run(&args);
        assert_eq!(code, 0, "{err}");
        let mut file = csv::Reader::from_path(place.path("r/steps.csv")).unwrap();
        let header = file.headers().unwrap().clone();
        let mut rows = 0;
        for row in file.records() {
            rows += 1;
            for (name, cell) in header.iter().zip(&row.unwrap()) {
                assert_eq!(
                    cell.is_empty(),
                    !TOLD.contains(&name),
                    "{engine} {name}: {cell}"
                );
            }
        }
        assert_eq!(rows, 5);
        let totals = &place.json("r/summary.json")["totals"];
        for key in [
            "sweeps",
            "factorisations",
            "pivots",
            "unsolved_islands",
            "events",
            "worst_residual",
            "worst_residual_velocity_m_s",
            "worst_imbalance_j",
            "worst_joint_gap_m",
            "worst_penetration_impact_m",
            "impact_gain_j",
            "work_forces_j",
            "work_contact_n_j",
            "work_returned_j",
            "work_recovery_j",
        ] {
            assert!(totals[key].is_null(), "{engine} {key}: {}", totals[key]);
        }
        // nor does it go by our settings
        let settings = &place.json("r/summary.json")["settings"];
        assert!(settings["solver"].is_null() && settings["tolerance"].is_null());
        assert!(settings["setting"].as_str().unwrap().contains("substeps"));
        assert!(totals["worst_penetration_m"].as_f64().unwrap() > 0.0);
        assert!(totals["contacts"].as_u64().unwrap() > 0);
        let (_, out, _) = place.run(&args[..4]);
        assert!(!out.contains("worst residual 0 "), "{out}");
    }
    // ours fills all of them
    assert_eq!(
        place.run(&["run", "tower", "--steps", "5", "--out", "r"]).0,
        0
    );
    let rows: Vec<StepRow> = read_rows(&place.path("r/steps.csv")).unwrap();
    assert!(
        rows.iter()
            .all(|r| r.pivots.is_some() && r.residual.is_some())
    );
    let totals = &place.json("r/summary.json")["totals"];
    let empty = totals
        .as_object()
        .unwrap()
        .iter()
        .find(|(_, v)| v.is_null());
    assert!(empty.is_none(), "{empty:?}");
}

/// Inside it is NaN, from the record to the totals: a maximum must not swallow it.
#[test]
fn what_a_peer_does_not_tell_is_not_a_number() {
    let scene = scene::load("tower", &[]).unwrap();
    let totals = |engine: Engine| -> Totals {
        let mut built = scene.build().unwrap();
        simulate(&mut built, engine, 3, |record, _| {
            assert_eq!(record.accounted, engine == Engine::Moreau);
            assert_eq!(record.energy.imbalance().is_nan(), engine != Engine::Moreau);
            Ok(())
        })
        .unwrap()
    };
    let rapier = totals(Engine::Rapier);
    let unknown = [
        rapier.residual,
        rapier.residual_velocity,
        rapier.imbalance,
        rapier.joint_gap,
        rapier.penetration_impact,
        rapier.impact_gain,
        rapier.work_forces,
        rapier.work_contact_n,
        rapier.work_joints,
    ];
    assert!(
        !rapier.accounted && unknown.iter().all(|v| v.is_nan()),
        "{rapier:?}"
    );
    let ours = totals(Engine::Moreau);
    assert!(ours.accounted && ours.residual <= 1e-8 && ours.imbalance < 1e-6);
}

// --- what is not solved -------------------------------------------------------------------------

fn row(engine: &str, dt: f64, value: f64, time: f64) -> ResultRow {
    ResultRow {
        scene: "s".to_owned(),
        rung: String::new(),
        engine: engine.to_owned(),
        scheme: if engine == "moreau" { "staggered" } else { "" }.to_owned(),
        solver: "auto".to_owned(),
        setting: "tolerance 1e-8".to_owned(),
        dt_s: dt,
        threads: 1,
        precision: "f64".to_owned(),
        measure: "distance".to_owned(),
        value,
        unit: "m".to_owned(),
        reference: "closed form".to_owned(),
        seconds_per_simulated_second: Some(time),
        spread: None,
        verdict: String::new(),
        mode: String::new(),
    }
}

/// Four steps of ours and of a peer; the step of 1/240 s is the best of all, and not solved.
fn rows(engine: &str) -> Vec<ResultRow> {
    let mut rows = Vec::new();
    for one in ["moreau", "rapier"] {
        for (k, rate) in [60.0, 120.0, 240.0, 480.0].into_iter().enumerate() {
            let time = 0.01 * 2f64.powi(k as i32);
            rows.push(row(one, 1.0 / rate, 1e-3 / rate, time));
        }
        let k = rows.len() - 2;
        if one == engine {
            rows[k].value = 1e-9;
            rows[k].seconds_per_simulated_second = Some(1e-4);
            rows[k].verdict = "unsolved".to_owned();
        }
    }
    rows
}

#[test]
fn a_point_that_is_not_solved_is_listed_and_not_drawn() {
    for (engine, who) in [("moreau", "moreau staggered"), ("rapier", "rapier")] {
        let rows = rows(engine);
        let charts = work_precision(&rows);
        assert_eq!(charts.len(), 1);
        let points = |x: f64| {
            let all = charts[0].series.iter().flat_map(|s| &s.points);
            all.filter(|p| p.0 == x).count()
        };
        // in no line, marker or front, and without a label
        assert_eq!(points(1e-4), 0, "{engine}");
        assert!(points(0.01) > 0);
        assert!(charts[0].labels.iter().all(|l| l.x != 1e-4));
        assert!(
            charts[0]
                .series
                .iter()
                .all(|s| s.points.iter().all(|p| p.1 > 1e-8))
        );
        let note = format!("{who}, not drawn as islands were left unsolved: 1/240 s");
        assert_eq!(charts[0].notes, [note]);
        assert!(panels(&charts).unwrap().contains("1/240 s"));

        let charts = convergence(&rows);
        let points = charts[0].series.iter().flat_map(|s| &s.points);
        assert!(points.clone().count() > 0 && points.clone().all(|p| p.1 > 1e-8));
        assert!(
            charts[0].notes[0].contains("1/240 s"),
            "{:?}",
            charts[0].notes
        );
    }
}

/// A line through the rest still is one, a single point is one of its engine, and of nothing
/// solved there is nothing to draw.
#[test]
fn of_nothing_solved_there_is_no_picture() {
    let mut rows = rows("");
    rows.iter_mut()
        .for_each(|r| r.verdict = "unsolved".to_owned());
    assert!(work_precision(&rows).is_empty());
    assert!(convergence(&rows).is_empty());
    rows[0].verdict = String::new();
    let charts = work_precision(&rows);
    assert_eq!(charts.len(), 1);
    let drawn: usize = charts[0].series.iter().map(|s| s.points.len()).sum();
    assert_eq!(drawn, 1);
    assert_eq!(charts[0].notes.len(), 2, "{:?}", charts[0].notes);
    panels(&charts).unwrap();
    assert!(work_precision(&[]).is_empty());
}

// --- times --------------------------------------------------------------------------------------

#[test]
fn times_that_scatter_are_told() {
    let mut all = rows("");
    assert_eq!(scatter(&all), None, "a single run");
    all.iter_mut().for_each(|r| r.spread = Some(0.05));
    assert_eq!(scatter(&all), None, "within a tenth");
    all[1].spread = Some(0.3);
    all[6].spread = Some(0.6);
    // a point counts once, however many measures it has
    let mut twin = all[6].clone();
    twin.measure = "penetration".to_owned();
    all.insert(7, twin);
    assert_eq!(
        scatter(&all).unwrap(),
        "times of 2 of 8 points scatter by more than ± 10 % between repeats, most by ± 60 % \
         (s rapier, 1/240 s, tolerance 1e-8): differences within that mean nothing"
    );
}

// --- units --------------------------------------------------------------------------------------

/// Bugs: the chart of the work since the start summed the written steps alone, and the time bar of a page
/// was red for unsolved steps only if they were written.
#[test]
fn rows_that_are_left_out_lose_nothing() {
    let place = Place::new();
    let args = ["run", "hit-heap", "--steps", "63", "--every", "7"];
    let (code, _, err) = place.run(&[&args[..], &["--out", "r", "--quiet"]].concat());
    assert_eq!(code, 0, "{err}");
    let text = std::fs::read_to_string(place.path("r/steps.csv")).unwrap();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let rows = place.rows("r/steps.csv");
    assert_eq!(rows.len(), 9);
    let totals = &place.json("r/summary.json")["totals"];
    let column = |name: &str| {
        let at = header.iter().position(|known| *known == name).unwrap();
        let numbers = rows.iter().map(|row| row[at].parse::<f64>().unwrap());
        numbers.collect::<Vec<_>>()
    };
    for name in [
        "work_forces_j",
        "work_contact_t_j",
        "work_contact_n_j",
        "sweeps",
        "factorisations",
    ] {
        let sum: f64 = column(name).iter().sum();
        let total = totals[name].as_f64().unwrap();
        assert!(total != 0.0, "{name}");
        assert!(
            (sum - total).abs() <= 1e-12 * total.abs(),
            "{name}: {sum} {total}"
        );
    }
    let worst = column("residual_velocity_m_s").into_iter().reduce(f64::max);
    assert_eq!(worst, totals["worst_residual_velocity_m_s"].as_f64());
}

/// Every row of a comparison says what it is in, and one without a dimension says that.
#[test]
fn every_row_of_a_comparison_has_a_unit() {
    let place = Place::new();
    let args = "compare two-balls --steps 6 --repeats 1 --no-sweep";
    let (code, out, err) = place.run(&args.split(' ').collect::<Vec<_>>());
    assert_eq!(code, 0, "{err}");
    let table: Vec<&str> = out
        .lines()
        .skip(3)
        .take_while(|l| !l.starts_with("time per"))
        .collect();
    assert!(table.len() > 4, "{out}");
    for line in table {
        let label = line.split("  ").next().unwrap();
        assert!(label.contains(" [") && label.ends_with(']'), "{line}");
    }
    let times = out
        .lines()
        .find(|l| l.starts_with("time per simulated second"));
    assert!(
        times.unwrap().contains(" µs") || times.unwrap().contains(" ms"),
        "{out}"
    );
    assert!(
        out.contains("residual [-]") && out.contains("penetration [m]"),
        "{out}"
    );
}

// --- impacts that are located without being asked for --------------------------------------------

const BULLET: &str = "[scene]\nname = \"shot\"\ntitle = \"t\"\n[gravity]\ny = 0\n[step]\ndt = 0.01\n\
    [[body]]\nname = \"wall\"\nkind = \"fixed\"\nbox = [0.02, 4]\nposition = [2, 0]\n\
    [[body]]\nname = \"ball\"\ndisc = 0.1\nvelocity = [200, 0]\n";

#[test]
fn impacts_located_by_sweeps_are_told_apart() {
    let place = Place::new();
    place.write("shot.toml", BULLET);
    let (code, out, err) = place.run(&["run", "shot.toml", "--steps", "5"]);
    assert_eq!(code, 0, "{err}");
    let told = "1 impacts located in time without --events: those of fast bodies and of bodies with continuous";
    assert!(out.contains(told), "{out}");
    let (_, out, _) = place.run(&["run", "shot.toml", "--steps", "5", "--events"]);
    assert!(out.contains("impacts located in time\n"), "{out}");
}
