//! Nothing but the time depends on the number of threads.

use crate::common::program::Place;
use crate::common::{load, small};
use moreau2d::contact::{ContactProblem, Vec2};
use moreau2d::dynamics::{Scheme, StepError, StepperSettings};
use moreau2d::experiment::{Engine, simulate};
use moreau2d::oracles::{SOLVERS, solver_by_name};
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, StateError};
use moreau2d::report::{ResultRow, read_rows};
use moreau2d::solver::{Auto, FactorCache, ImpulseSolver, Shares, SolveReport};
use std::collections::BTreeSet;
use std::fs;
use std::sync::{Arc, Mutex};
use std::thread::{self, ThreadId};

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

/// Chains of links with limits, hung up at one end, that swing down onto a post.
fn chains(world: &mut PhysicsWorld) {
    for x in places() {
        let (hook, _) = world.insert(
            RigidBodyBuilder::fixed().translation(Vector::new(x, 8.0)),
            ColliderBuilder::ball(0.1),
        );
        world.insert(
            RigidBodyBuilder::fixed().translation(Vector::new(x + 1.0, 5.0 + 0.01 * x)),
            ColliderBuilder::ball(0.4),
        );
        let mut before = hook;
        for k in 0..24 {
            let place = at(x + 0.4 * k as Real + 0.2, 8.0);
            let link = ColliderBuilder::cuboid(0.15, 0.05).density(1.0 + k as Real);
            let (link, _) = world.insert(place, link);
            let joint = RevoluteJointBuilder::new()
                // every fourth joint is built with a gap, which the energy bound does not let close at once
                .local_anchor1(Vector::new(
                    if k == 0 {
                        0.0
                    } else if k % 4 == 0 {
                        0.6
                    } else {
                        0.2
                    },
                    0.0,
                ))
                .local_anchor2(Vector::new(-0.2, 0.0))
                .limits([-0.9, 0.9])
                .contacts_enabled(false);
            world.insert_impulse_joint(before, link, joint);
            before = link;
        }
    }
}

/// Towers that a piston presses down further than they give way.
fn pressed(world: &mut PhysicsWorld) {
    for x in places() {
        for k in 0..12 {
            let square = ColliderBuilder::cuboid(0.25, 0.25);
            world.insert(at(x, 0.25 + 0.5 * k as Real), square);
        }
        let piston = RigidBodyBuilder::kinematic_velocity_based()
            .translation(Vector::new(x, 6.6))
            .linvel(Vector::new(0.0, -1.0 - 1e-3 * x));
        world.insert(piston, ColliderBuilder::cuboid(0.5, 0.5));
    }
}

/// What a case is stepped with, for how many steps, and what its records must show.
struct Case {
    name: &'static str,
    settings: StepperSettings,
    world: fn(&mut PhysicsWorld),
    steps: usize,
    shows: fn(&Counts) -> bool,
}

#[derive(Debug, Default)]
struct Counts {
    unsolved: usize,
    relaxed: usize,
    events: usize,
    joints_capped: usize,
    redundant: usize,
    most_islands: usize,
}

fn cases() -> Vec<Case> {
    let settings = StepperSettings::default;
    vec![
        Case {
            name: "heaps",
            settings: settings(),
            world: |w| places().for_each(|x| heap(w, x, 0.0, 0)),
            steps: 50,
            shows: |c| c.most_islands >= 10,
        },
        Case {
            name: "heaps that bounce, with events",
            settings: StepperSettings {
                events: true,
                ..settings()
            },
            world: |w| places().for_each(|x| heap(w, x, 0.7, 0)),
            steps: 16,
            shows: |c| c.events > 0,
        },
        Case {
            name: "heaps with dominance",
            settings: settings(),
            world: |w| places().for_each(|x| heap(w, x, 0.0, 1)),
            steps: 8,
            shows: |c| c.most_islands >= 10,
        },
        Case {
            name: "heaps that sweeps do not solve",
            settings: StepperSettings {
                solver: "nsgs".to_owned(),
                tolerance: 1e-14,
                ..settings()
            },
            world: |w| places().for_each(|x| heap(w, x, 0.0, 0)),
            steps: 20,
            shows: |c| c.unsolved > 0,
        },
        Case {
            name: "heaps with least shares",
            settings: StepperSettings {
                shares: Shares::MinimumNorm,
                ..settings()
            },
            world: |w| places().for_each(|x| heap(w, x, 0.0, 0)),
            steps: 40,
            shows: |c| c.redundant > 0,
        },
        Case {
            name: "heaps of the published scheme",
            settings: StepperSettings {
                scheme: Scheme::Moreau,
                ..settings()
            },
            world: |w| places().for_each(|x| heap(w, x, 0.0, 0)),
            steps: 30,
            shows: |c| c.most_islands >= 10,
        },
        Case {
            name: "chains",
            settings: settings(),
            world: chains,
            steps: 60,
            shows: |c| c.joints_capped > 0,
        },
        Case {
            name: "towers pressed flat",
            settings: settings(),
            world: pressed,
            steps: 10,
            shows: |c| c.unsolved > 0 && c.relaxed > 0,
        },
    ]
}

/// The record, and pose and velocity of every body, of each step as text: it tells every bit of a
/// float.
fn trace(case: &Case, threads: usize) -> (Vec<String>, Counts) {
    let mut world = grounded();
    (case.world)(&mut world);
    let mut pipeline = MoreauPipeline::new(MoreauSettings {
        stepper: StepperSettings {
            threads,
            ..case.settings.clone()
        },
        ..MoreauSettings::default()
    })
    .unwrap();
    let mut counts = Counts::default();
    let mut steps = Vec::new();
    for _ in 0..case.steps {
        let record = pipeline.step(&mut world).unwrap();
        // bodies move as the impulses that are told have them, capped or not
        let energy = &record.energy;
        let scale = energy.kinetic_start + energy.kinetic_end + energy.forces.abs();
        let left = energy.imbalance().abs();
        assert!(left <= 1e-9 * scale, "{}: {left} J of {scale}", case.name);
        counts.unsolved += record.unsolved;
        counts.relaxed += record.relaxed;
        counts.events += record.events;
        counts.joints_capped += record.joints_capped;
        counts.redundant += record.redundant;
        counts.most_islands = counts.most_islands.max(record.islands);
        let bodies = world.bodies.iter().map(|(handle, _)| handle);
        let states: Vec<_> = bodies
            .map(|b| (pipeline.pose(b), pipeline.velocity(b)))
            .collect();
        steps.push(format!("{record:?} {states:?}"));
    }
    (steps, counts)
}

#[test]
fn every_number_of_threads_gives_the_same_bytes() {
    for case in cases() {
        let (one, counts) = trace(&case, 1);
        assert!((case.shows)(&counts), "{}: {counts:?}", case.name);
        for threads in THREADS {
            let (others, _) = trace(&case, threads);
            let same = one.iter().zip(&others).position(|(a, b)| a != b);
            assert_eq!(same, None, "{}, {threads} threads: first step", case.name);
            assert_eq!(one.len(), others.len());
        }
    }
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

/// The problems of some steps of a scene, with the impulses of each.
fn problems(name: &str, steps: usize) -> Vec<(ContactProblem, Vec<Vec2>)> {
    let mut built = load(name, small(name)).build().unwrap();
    built.keep_problems(true);
    let mut found = Vec::new();
    for step in 0..steps {
        Engine::Moreau.step(&mut built).unwrap();
        if step % 5 == 0 {
            let all = built.problems().iter();
            found.extend(all.map(|s| (s.problem.clone(), s.impulses.clone())));
        }
    }
    found
}

/// From nothing, and from impulses that do not quite fit.
fn starts(found: &[Vec2]) -> [Vec<Vec2>; 2] {
    let near = found.iter().map(|p| p * 1.1).collect();
    [vec![Vec2::zeros(); found.len()], near]
}

fn answer(
    solver: &mut dyn ImpulseSolver,
    (problem, found): &(ContactProblem, Vec<Vec2>),
) -> Vec<String> {
    let mut of = |mut impulses: Vec<Vec2>| -> String {
        let report: SolveReport = solver.solve(problem, &mut impulses, 1e-9);
        format!("{report:?} {impulses:?}")
    };
    let mut answers: Vec<String> = starts(found).map(&mut of).into();
    let mut carried = FactorCache::default();
    for factor in [1.1, 1.0 + 1e-7] {
        let mut impulses: Vec<Vec2> = found.iter().map(|p| p * factor).collect();
        let report = solver.solve_next(problem, &mut impulses, 1e-9, &mut carried);
        answers.push(format!("{report:?} {impulses:?} {}", carried.is_empty()));
    }
    answers
}

/// Whoever is met before, the same problem gets the same answer: from a new object, and from one
/// that has gone through all of them in either order.
#[test]
fn a_solver_takes_nothing_from_one_problem_to_the_next() {
    let mut all = Vec::new();
    for (name, steps) in [
        ("many-pyramids", 6),
        ("arch", 6),
        ("drum", 160),
        ("chain", 30),
    ] {
        all.extend(problems(name, steps));
    }
    let dense = all.iter().take(2).map(|(problem, found)| {
        let operator = moreau2d::contact::Delassus::dense(problem.operator.explicit());
        let dense = ContactProblem {
            operator,
            ..problem.clone()
        };
        (dense, found.clone())
    });
    let dense: Vec<_> = dense.collect();
    all.extend(dense);
    for name in SOLVERS {
        // a tableau of hundreds of blocks takes minutes, and so do sweeps that crawl
        let most = if name == "lemke" || name == "prox" {
            30
        } else {
            400
        };
        let own: Vec<_> = all.iter().filter(|(p, _)| p.len() <= most).collect();
        assert!(own.len() > 10, "{name}: {}", own.len());
        let new = || solver_by_name(name).unwrap();
        let alone: Vec<_> = own.iter().map(|p| answer(new().as_mut(), p)).collect();
        let mut object = new();
        let forward = own.iter().map(|p| answer(object.as_mut(), p));
        let forward: Vec<_> = forward.collect();
        let backward = own.iter().rev().map(|p| answer(object.as_mut(), p));
        let mut backward: Vec<_> = backward.collect();
        backward.reverse();
        for (k, answer) in alone.iter().enumerate() {
            let size = own[k].0.len();
            assert!(*answer == forward[k], "{name}: problem {k} of {size}");
            assert!(*answer == backward[k], "{name}: problem {k} of {size}");
        }
    }
}

/// Remembers which threads it worked on.
struct Own(Auto, Arc<Mutex<Vec<ThreadId>>>);

impl ImpulseSolver for Own {
    fn name(&self) -> &'static str {
        "own"
    }

    fn solve(&mut self, p: &ContactProblem, impulses: &mut [Vec2], tolerance: f64) -> SolveReport {
        self.1.lock().unwrap().push(thread::current().id());
        self.0.solve(p, impulses, tolerance)
    }
}

/// One object works on one thread, set before the threads or after, and gives the same bytes.
#[test]
fn a_solver_of_ones_own_stays_on_the_callers_thread() {
    let run = |own: bool, threads: usize| {
        let mut world = grounded();
        places().for_each(|x| heap(&mut world, x, 0.0, 0));
        let mut pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
        let met = Arc::new(Mutex::new(Vec::new()));
        pipeline.set_threads(threads).unwrap();
        if own {
            pipeline.set_solver(Box::new(Own(Auto::default(), met.clone())));
            pipeline.set_threads(threads).unwrap();
        }
        let steps = (0..40).map(|_| format!("{:?}", pipeline.step(&mut world).unwrap()));
        let steps: Vec<String> = steps.collect();
        let met = met.lock().unwrap().clone();
        assert_eq!(met.is_empty(), !own);
        assert!(met.iter().all(|id| *id == thread::current().id()));
        steps
    };
    let named = run(false, 1);
    assert!(named == run(true, 1));
    assert!(named == run(true, 3));
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
