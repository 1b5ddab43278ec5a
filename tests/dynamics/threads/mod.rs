//! Nothing but the time depends on the number of threads.

mod cases;
mod solvers;

use crate::common::program::Place;
use crate::common::{load, small};
use moreau2d::dynamics::StepError;
use moreau2d::experiment::{Engine, simulate};
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, StateError};
use moreau2d::report::{ResultRow, read_rows};
use std::collections::BTreeSet;
use std::fs;

/// One more than a machine may have, an odd number, and a whole lot.
const THREADS: [usize; 3] = [2, 3, 8];

fn at(x: Real, y: Real) -> RigidBodyBuilder {
    RigidBodyBuilder::dynamic().translation(Vector::new(x, y))
}

fn grounded() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.insert(
        RigidBodyBuilder::fixed().translation(Vector::new(0.0, -0.5)),
        ColliderBuilder::cuboid(1000.0, 0.5),
    );
    world
}

/// A heap of all kinds of shapes dropped at `x`, each somewhat else.
fn heap(world: &mut PhysicsWorld, x: Real, restitution: Real, dominance: i8) {
    for k in 0..20 {
        let body = at(
            x + 0.37 * (k % 5) as Real,
            0.6 + (0.7 + 1e-3 * x) * (k / 5) as Real,
        );
        let shape = match k % 4 {
            0 => ColliderBuilder::ball(0.3),
            1 => ColliderBuilder::cuboid(0.3, 0.2),
            2 => ColliderBuilder::capsule_x(0.2, 0.15),
            _ => ColliderBuilder::round_cuboid(0.2, 0.2, 0.05),
        };
        let body = body.rotation(0.2 * k as Real + 0.01 * x);
        let body = body.dominance_group(dominance * (k % 3) as i8);
        world.insert(body, shape.restitution(restitution));
    }
}

/// Ten places far enough apart that nothing at one meets what is at another.
fn places() -> impl Iterator<Item = Real> {
    (0..10).map(|k| 12.0 * k as Real - 54.0)
}

/// Hand-written models and rapier worlds alike, from scene files.
#[test]
fn scenes_give_the_same_bytes() {
    for (name, steps) in [("many-pyramids", 12), ("drum", 60), ("elastic-gas", 30)] {
        let mut scene = load(name, small(name));
        assert_eq!(scene.step.threads, 1);
        let mut run = |threads: usize| {
            scene.step.threads = threads;
            let mut built = scene.build().unwrap();
            let mut steps_seen = Vec::new();
            simulate(&mut built, Engine::Moreau, steps, |record, built| {
                let states: Vec<_> = (0..built.bodies()).map(|k| built.state(k)).collect();
                steps_seen.push(format!("{record:?} {states:?}"));
                Ok(())
            })
            .unwrap();
            steps_seen
        };
        let one = run(1);
        for threads in THREADS {
            assert!(one == run(threads), "{name}, {threads} threads");
        }
    }
}

/// The files of a run, byte by byte; in the second scene bodies collide.
#[test]
fn the_program_writes_the_same_files() {
    let files = ["bodies.csv", "contacts.csv", "steps.csv", "impacts.csv"];
    for (scene, steps, files) in [
        ("many-pyramids", "12", &files[..3]),
        ("elastic-gas", "30", &files),
    ] {
        let place = Place::new();
        let run = |threads: &str, out: &str| {
            let mut args = vec!["run", scene, "--steps", steps, "--quiet"];
            let sizes = small(scene).iter().flat_map(|s| ["--set", s]);
            args.extend(sizes);
            args.extend(["--threads", threads, "--out", out]);
            let (code, _, err) = place.run(&args);
            assert_eq!(code, 0, "{scene}: {err}");
            assert_eq!(
                place.json(&format!("{out}/summary.json"))["settings"]["threads"].to_string(),
                threads
            );
        };
        run("1", "r1");
        for threads in THREADS.map(|n| n.to_string()) {
            run(&threads, "r");
            for file in files {
                let [a, b] =
                    ["r1", "r"].map(|f| fs::read(place.path(&format!("{f}/{file}"))).unwrap());
                assert!(a.len() > 1000, "{scene}: {file}");
                assert!(a == b, "{scene}, {threads} threads: {file}");
            }
            fs::remove_dir_all(place.path("r")).unwrap();
        }
    }
}

/// A state holds the number, and nothing else in it tells how many there were.
#[test]
fn a_state_is_the_same_and_is_resumed_by_any_number() {
    let begin = |threads: usize| {
        let mut world = grounded();
        places().for_each(|x| heap(&mut world, x, 0.2, 0));
        let mut pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
        pipeline.set_threads(threads).unwrap();
        for _ in 0..30 {
            pipeline.step(&mut world).unwrap();
        }
        (world, serde_json::to_value(pipeline.state()).unwrap())
    };
    let key = "/settings/stepper/threads";
    let (mut world, mut saved) = begin(3);
    let (_, one) = begin(1);
    assert_eq!(saved.pointer(key).unwrap(), 3);
    assert_eq!(one.pointer(key).unwrap(), 1);
    *saved.pointer_mut(key).unwrap() = 1.into();
    assert!(saved == one);

    let go_on = |threads: usize| {
        let state = serde_json::from_value(saved.clone()).unwrap();
        let (mut world, _) = begin(2);
        let mut pipeline = MoreauPipeline::resume(&state, &mut world).unwrap();
        pipeline.set_threads(threads).unwrap();
        let steps = (0..20).map(|_| format!("{:?}", pipeline.step(&mut world).unwrap()));
        steps.collect::<Vec<String>>()
    };
    assert!(go_on(1) == go_on(4));

    // saved before there were threads, and by someone with a lot of them
    let stepper = saved.pointer_mut("/settings/stepper").unwrap();
    stepper.as_object_mut().unwrap().remove("threads");
    let state = serde_json::from_value(saved.clone()).unwrap();
    MoreauPipeline::resume(&state, &mut world).unwrap();
    saved["settings"]["stepper"]["threads"] = 5000.into();
    let state = serde_json::from_value(saved).unwrap();
    let error = MoreauPipeline::resume(&state, &mut world).err().unwrap();
    assert_eq!(error, StateError::Settings(StepError::Threads(5000)));
}

#[test]
fn numbers_that_are_none_are_refused_by_name() {
    for threads in [0, 1025, usize::MAX] {
        let mut settings = MoreauSettings::default();
        let mut pipeline = MoreauPipeline::new(settings.clone()).unwrap();
        settings.stepper.threads = threads;
        let error = MoreauPipeline::new(settings).err().unwrap();
        assert_eq!(error, StepError::Threads(threads));
        let text = error.to_string();
        assert!(text.contains(&threads.to_string()) && text.contains("1 to 1024"));
        assert_eq!(pipeline.set_threads(threads), Err(error));
    }
    let place = Place::new();
    let cases: [(&[&str], &[&str]); 10] = [
        (
            &["run", "tower", "--threads", "0"],
            &["--threads", "1..=1024"],
        ),
        (
            &["run", "tower", "--threads", "1025"],
            &["--threads", "1025"],
        ),
        (&["run", "tower", "--threads", "-1"], &["-1"]),
        (&["run", "tower", "--threads", "two"], &["--threads", "two"]),
        (
            &["run", "tower", "--threads", "1,2"],
            &["--threads", "bench"],
        ),
        (
            &["compare", "tower", "--threads", "2,4"],
            &["--threads", "bench"],
        ),
        (
            &["run", "tower", "--engine", "rapier", "--threads", "2"],
            &["--threads", "rapier", "no effect"],
        ),
        (
            &[
                "chart",
                "tower",
                "--engine",
                "rapier-stiff",
                "--threads",
                "2",
            ],
            &["--threads", "rapier-stiff", "no effect"],
        ),
        (
            &["bench", "--solvers", "--threads", "2"],
            &["--threads", "no effect"],
        ),
        (
            &["run", "tower", "--set", "step.threads=2"],
            &["step.threads"],
        ),
    ];
    for (args, words) in cases {
        let (code, out, err) = place.run(args);
        assert_eq!((code, out.as_str()), (1, ""), "{args:?}: {err}");
        for word in words {
            assert!(err.contains(word), "{args:?}: {err} lacks {word}");
        }
        assert!(!place.path("out").exists(), "{args:?} left something");
    }
}

/// Ours once with each number, rapier on one thread; what the threads do not change is the same.
#[test]
fn bench_runs_ours_with_each_number_of_threads() {
    let place = Place::new();
    let mut args = vec!["bench", "many-pyramids", "--steps", "3", "--settle", "2"];
    args.extend(small("many-pyramids").iter().flat_map(|s| ["--set", s]));
    args.extend(["--set", "step.keep_rest=false"]);
    args.extend(["--threads", "1,3,1", "--out", "r"]);
    let (code, out, err) = place.run(&args);
    assert_eq!(code, 0, "{err}");
    assert!(out.contains("threads"), "{out}");
    let rows: Vec<ResultRow> = read_rows(&place.path("r/results.csv")).unwrap();
    let of = |engine: &str| -> BTreeSet<u64> {
        let own = rows.iter().filter(|r| r.engine == engine);
        own.map(|r| r.threads as u64).collect()
    };
    assert_eq!(of("moreau"), BTreeSet::from([1, 3]));
    assert_eq!(of("rapier"), BTreeSet::from([1]));
    let summary = place.json("r/summary.json");
    assert_eq!(summary["settings"]["threads"].to_string(), "[1,3]");
    let value = |measure: &str, threads: usize| {
        let mut own = rows
            .iter()
            .filter(|r| (r.engine.as_str(), r.measure.as_str()) == ("moreau", measure));
        own.find(|r| r.threads == threads).unwrap().value
    };
    for measure in ["contacts", "penetration", "residual", "unsolved-islands"] {
        let [one, three] = [1, 3].map(|n| value(measure, n).to_bits());
        assert_eq!(one, three, "{measure}");
    }
    for threads in [1, 3] {
        let phases = ["detection", "assembly", "solve", "record", "write"];
        let of = |p: &str| value(&format!("{p}-time"), threads);
        assert!(phases.iter().all(|p| of(p) > 0.0));
        // medians of three steps each
        let sum: f64 = phases.iter().map(|p| of(p)).sum();
        assert!(sum < 3.0 * value("step-time", threads), "{threads}: {sum}");
    }
}
