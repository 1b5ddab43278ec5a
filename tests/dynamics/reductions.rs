//! What the model leaves out changes no motion and adds no unknown.

use crate::common::{load, run_steps};
use moreau2d::experiment::{Engine, REDUCTIONS, against_full, simulate};
use moreau2d::report::Progress;
use std::collections::HashSet;

/// Scene, steps, and which reductions leave unknowns out of it: islands at rest, islands, distant
/// contacts, friction rows. Solving islands by themselves leaves out no unknown, but the coupling of up to 100
/// of them. `hit-heap` ends with its first impacts: those after them have several solutions and part chaotic
/// ways.
const SCENES: [(&str, usize, [bool; 4]); 8] = [
    ("tower", 60, [true, false, false, false]),
    ("wall", 30, [true, false, false, false]),
    ("bowl", 120, [false, false, false, true]),
    ("chain", 60, [false; 4]),
    ("double-pendulum", 120, [false; 4]),
    ("drum", 30, [false, false, true, false]),
    ("hit-heap", 15, [false, false, true, false]),
    ("many-pyramids", 3, [true, false, false, false]),
];

#[test]
fn reductions_change_nothing() {
    for (name, steps, fewer) in SCENES {
        // solved as well as round-off allows, so that differences are not those of the tolerance
        let mut scene = load(name, &["step.tolerance=1e-12"]);
        scene.step.time = steps as f64 * scene.step.dt;
        for (reduction, fewer) in REDUCTIONS.iter().zip(fewer) {
            let hidden = Progress::new("", 0, true);
            let row = against_full(&scene, reduction, 1, &hidden).unwrap();
            println!(
                "{name} {}: {} of {} unknowns, work {} of {}, {:e}",
                row.reduction,
                row.unknowns,
                row.unknowns_full,
                row.work,
                row.work_full,
                row.difference
            );
            // bodies of some metres: 1e-9 relative
            assert!(
                row.difference <= 1e-9,
                "{name} {}: {:e}",
                row.reduction,
                row.difference
            );
            assert!(
                row.unknowns <= row.unknowns_full,
                "{name} {}",
                row.reduction
            );
            assert_eq!(
                row.unknowns < row.unknowns_full,
                fewer,
                "{name} {}",
                row.reduction
            );
        }
    }
}

/// Problems of islands are never larger than the one of all, and the entries of their dense operators never more.
#[test]
fn islands_pose_smaller_problems() {
    for (name, steps) in [("many-pyramids", 1), ("card-house", 20), ("drum", 150)] {
        let [all, split] = ["false", "true"].map(|on| {
            let mut built = load(name, &[&format!("step.split_islands={on}")])
                .build()
                .unwrap();
            built.keep_problems(true);
            let (mut most, mut entries) = (0, 0);
            simulate(&mut built, Engine::Moreau, steps, |_, built| {
                for stored in built.problems() {
                    most = most.max(stored.problem.len());
                    entries += stored.problem.len().pow(2);
                }
                Ok(())
            })
            .unwrap();
            (most, entries)
        });
        println!("{name}: {split:?} of {all:?}");
        assert!(
            split.0 <= all.0 && split.1 <= all.1,
            "{name}: {split:?} of {all:?}"
        );
        assert!(split.1 < all.1, "{name}");
    }
}

/// A body without unknowns is one of endless mass: with 1e12 times the mass of what lies on it, and without
/// weight, it has moved by less than 1e-11 m after a second, and so have those on it. `body.kind` is the switch.
#[test]
fn a_body_without_unknowns_is_one_of_endless_mass() {
    // a closed form would refuse the full model
    let none = "reference.closed_form=none";
    for (name, body, light, more) in [
        ("incline", "floor", "block", Some(none)),
        ("tower", "floor", "box", None),
        ("sliding-block", "floor", "block", Some(none)),
    ] {
        let light = format!("body.{light}.mass=1");
        let common: Vec<&str> = [light.as_str(), "step.tolerance=1e-12"]
            .into_iter()
            .chain(more)
            .collect();
        let full = [
            "kind=dynamic",
            "mass=1e12",
            "inertia=1e15",
            "gravity_scale=0",
        ];
        let full = full.map(|change| format!("body.{body}.{change}"));
        let full: Vec<&str> = full
            .iter()
            .map(String::as_str)
            .chain(common.iter().copied())
            .collect();
        let [reduced, full] = [&common[..], &full].map(|flags| {
            let run = run_steps(&load(name, flags), 60);
            let places = (0..run.built.bodies()).filter_map(|k| run.built.state(k));
            let places: Vec<_> = places
                .map(|(pose, _)| (pose.translation, pose.angle()))
                .collect();
            (places, run.totals)
        });
        let apart = reduced.0.iter().zip(&full.0);
        let apart = apart.map(|(a, b)| (a.0 - b.0).norm().max((a.1 - b.1).abs()));
        let apart = apart.fold(0.0, f64::max);
        let work = [&reduced.1, &full.1].map(|t| t.sweeps + t.factorisations + t.pivots);
        println!("{name}: {apart:e}, work {work:?}");
        assert!(apart <= 1e-9, "{name}: {apart:e}");
        assert!(work[0] <= work[1], "{name}: {work:?}");
        assert!(reduced.1.unknowns <= full.1.unknowns, "{name}");
    }
}

/// Where a reduced step ends elsewhere than the full one, both are solutions of the same problem. What is not certified
/// solves no problem exactly: some steps of the house that collapses, with one step length or the other.
#[test]
fn steps_apart_are_two_solutions_of_one_problem() {
    let hidden = Progress::new("", 0, true);
    for (name, reduction, steps, draws) in [
        ("hit-heap", "distant contacts", 60, 1),
        ("card-house", "islands", 120, 4),
        ("card-house", "distant contacts", 120, 4),
    ] {
        let reduction = REDUCTIONS.iter().find(|r| r.name == reduction).unwrap();
        let (mut exact, mut certified) = (0, 0);
        for draw in 0..draws {
            let mut scene = load(name, &[]);
            scene.step.dt *= 1.0 + 0.01 * f64::from(draw);
            scene.step.time = f64::from(steps) * scene.step.dt;
            let row = against_full(&scene, reduction, 1, &hidden).unwrap();
            println!("{row:?}");
            assert!(row.steps_apart_certified > 0, "{row:?}");
            assert_eq!(
                row.steps_another_solution, row.steps_apart_certified,
                "{row:?}"
            );
            assert_eq!(row.verdict.split(',').next(), Some("another solution"));
            exact += u32::from(row.steps_apart_certified == row.steps_apart);
            certified += row.steps_apart_certified;
        }
        println!("{name}: {certified} steps, {exact} of {draws} draws certified");
        assert!(2 * exact >= draws, "{name}");
    }
}

/// No reduction costs more than 2 % over the full model; what a clock tells of a step, 1e-6 s, is granted.
#[test]
#[ignore = "times: minutes, on a quiet machine"]
fn no_reduction_is_slower_than_the_full_model() {
    let hidden = Progress::new("", 0, true);
    for (name, ..) in SCENES.iter().chain(&[("card-house", 0, [false; 4])]) {
        let mut scene = load(name, &[]);
        scene.step.time = scene.step.time.min(120.0 * scene.step.dt);
        for reduction in &REDUCTIONS {
            let row = against_full(&scene, reduction, 3, &hidden).unwrap();
            println!(
                "{name} {}: {:.4}, {}",
                row.reduction, row.time_ratio, row.verdict
            );
            assert!(!row.verdict.ends_with("slower"), "{row:?}");
        }
    }
}

/// A stored problem names each of its blocks once: in contacts and joints, with located impacts, in a crowd.
#[test]
fn stored_problems_name_each_block_once() {
    for (name, flags, steps) in [
        ("chain", &[][..], 40),
        ("hit-heap", &[][..], 40),
        ("elastic-gas", &["step.events=true"][..], 40),
        ("tower", &[][..], 5),
        ("drum-of-boxes", &[][..], 60),
    ] {
        let mut built = load(name, flags).build().unwrap();
        built.keep_problems(true);
        let mut blocks = 0;
        simulate(&mut built, Engine::Moreau, steps, |_, built| {
            for stored in built.problems() {
                assert_eq!(stored.keys.len(), stored.problem.len(), "{name}");
                assert_eq!(stored.keys.len(), stored.impulses.len(), "{name}");
                let different: HashSet<_> = stored.keys.iter().collect();
                assert_eq!(different.len(), stored.keys.len(), "{name}");
                blocks += stored.keys.len();
            }
            Ok(())
        })
        .unwrap();
        assert!(blocks > 0, "{name}");
    }
}
