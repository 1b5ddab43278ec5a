//! The limits that rungs are set by: those of masonry against the equilibrium oracle, and statistics
//! of converged runs (`cargo test --release --lib converged -- --ignored --nocapture`).

use super::*;
use crate::experiment::{can_stand, limit};
use crate::scene::Shape;

fn entry(name: &str) -> AtlasEntry {
    AtlasEntry::load(name).unwrap()
}

/// The scene of a rung, with changes.
fn scene(entry: &AtlasEntry, rung: &str, flags: &[String]) -> Scene {
    crate::scene::load(&format!("atlas/{}:{rung}", entry.name), flags).unwrap()
}

/// What must stand can, what must fall cannot.
#[test]
fn the_oracle_dates_masonry() {
    let mut dated = 0;
    for name in ["arch", "card-house", "overhang", "wedge"] {
        let entry = entry(name);
        for rung in &entry.block.rungs {
            let judge = entry.judge(rung).name.as_str();
            if judge != "flagged" {
                let stands = can_stand(&scene(&entry, &rung.name, &[])).unwrap();
                assert_eq!(judge == "stands", stands, "{name} {}", rung.name);
                dated += 1;
            }
        }
    }
    assert_eq!(dated, 10 + 6 + 8 + 6);
}

/// Complaints that a thing does not stand are of things that can, by a linear programme; and the
/// triangles stand by friction alone.
#[test]
fn complaints_about_statics_are_of_what_can_stand() {
    let issue = |name: &str, flags: &[String]| {
        let scene = crate::scene::load(&format!("issues/{name}"), flags).unwrap();
        can_stand(&scene).unwrap()
    };
    for name in [
        "heavy-on-cube",
        "creep-on-slope",
        "triangles",
        "stack-ten-minutes",
    ] {
        assert!(issue(name, &[]), "{name}");
    }
    let slippery = "material.stone.friction=0.29".to_owned();
    assert!(!issue("triangles", &[slippery]));
}

/// The first rung of each size is 2 % above the least that stands.
#[test]
fn margins_of_arches_and_cards_are_from_their_limits() {
    let mut offs = Vec::new();
    let arch = entry("arch");
    for n in [7, 27, 61] {
        let angle = std::f64::consts::PI / f64::from(n);
        let with = |thickness: f64| {
            let sector = format!("body.voussoir.sector=[1,{thickness:?},{angle:?}]");
            scene(&arch, &format!("{n}, +2 %"), &[sector])
        };
        let least = limit(0.03, 0.2, |t: f64| can_stand(&with(t))).unwrap();
        let points = |s: &Scene| match &s.bodies[s.bodies.len() - 1].shape {
            Shape::Polygon { points } => points.clone(),
            other => panic!("{other:?}"),
        };
        let rung = scene(&arch, &format!("{n}, +2 %"), &[]);
        let sought = with(least * 1.02);
        let pairs = points(&rung)
            .into_iter()
            .zip(points(&sought))
            .flat_map(|(a, b)| a.into_iter().zip(b));
        let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        offs.push(off);
    }
    let cards = entry("card-house");
    for storeys in [1, 3, 5] {
        let name = format!("{storeys}, mu +2 %");
        let with = |mu: f64| scene(&cards, &name, &[format!("material.card.friction={mu:?}")]);
        let least = limit(0.01, 1.0, |mu: f64| can_stand(&with(mu))).unwrap();
        let friction = scene(&cards, &name, &[]).materials[0].friction;
        offs.push((friction / (least * 1.02) - 1.0).abs());
    }
    assert!(offs.iter().all(|off| *off < 1e-9), "{offs:?}");
}

/// The value of the check `measure` of a rung over step lengths, with ours and rapier's stiff preset;
/// prints it. An error relative to `exact` is what the check gives.
fn levels(name: &str, rung: &str, measure: &str, levels: [f64; 3]) -> [f64; 6] {
    let entry = entry(name);
    let each = [Engine::Moreau, Engine::RapierStiff].map(|engine| {
        levels.map(|dt| {
            let scene = scene(&entry, rung, &[format!("step.dt={dt:?}")]);
            let trace = Trace::of(&scene, engine).unwrap();
            let rung = entry.rung(rung).unwrap();
            let checks = entry.judge(rung).checks.iter();
            let check = checks.clone().find(|c| c.measure == measure).unwrap();
            let value = Ask::new(check, rung, &scene).unwrap().statistic(&trace);
            let unsolved = trace.totals.unsolved_islands;
            let engine = engine.name();
            println!(
                "{name} {rung:?}, {engine}, dt {dt}: {value}, {unsolved} unsolved",
                rung = rung.name
            );
            value
        })
    });
    [
        each[0][0], each[0][1], each[0][2], each[1][0], each[1][1], each[1][2],
    ]
}

fn exact(name: &str, rung: &str) -> f64 {
    entry(name).rung(rung).unwrap().with["exact"]
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
#[ignore = "minutes"]
fn converged_dominoes() {
    let mut off = Vec::new();
    for rung in ["0.4 m apart", "0.6 m apart", "0.8 m apart"] {
        let dts = [240.0, 480.0, 960.0].map(f64::recip);
        let found = levels("dominoes", rung, "wave-speed", dts);
        off.push((0.5 * (found[2] + found[5]) / exact("dominoes", rung) - 1.0).abs());
    }
    assert!(off.iter().all(|off| *off < 1e-3), "{off:?}");
}

#[test]
#[ignore = "minutes"]
fn converged_drum() {
    let found = levels("granular-drum", "1/500 s", "mean-angle", [2e-3, 1e-3, 5e-4]);
    for finest in [found[2], found[5]] {
        assert!((finest - 0.451).abs() < 1e-3, "{found:?}");
    }
}

#[test]
#[ignore = "minutes"]
fn converged_hopper() {
    let mut off = Vec::new();
    for rung in ["1 m", "1.4 m"] {
        let dts = [240.0, 480.0, 960.0].map(f64::recip);
        let found = levels("hopper", rung, "discharge", dts);
        off.push((mean(&found) / exact("hopper", rung) - 1.0).abs());
    }
    assert!(off.iter().all(|off| *off < 0.01), "{off:?}");
}

#[test]
#[ignore = "minutes"]
fn converged_spinner() {
    let mut off = Vec::new();
    for rung in ["0.5 rad/s", "1 rad/s"] {
        let dts = [120.0, 240.0, 480.0].map(f64::recip);
        let found = levels("spinner", rung, "mean-square-speed", dts);
        off.push((mean(&found) / exact("spinner", rung) - 1.0).abs());
    }
    assert!(off.iter().all(|off| *off < 0.03), "{off:?}");
}
