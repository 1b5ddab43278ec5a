//! What a step and a solve cost. Read as ratios on one machine; nothing here asserts a time.
//!
//! `cargo bench --bench step` measures, `cargo bench --bench step -- --test` runs each once.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use moreau2d::contact::examples::{pyramid, tower};
use moreau2d::contact::{ContactProblem, Vec2};
use moreau2d::dynamics::{MoreauStepper, NormalLaw, Scheme, StepperSettings};
use moreau2d::models::{Rotor, RotorContact, RotorMotor};
use moreau2d::oracles::{SOLVERS, solver_by_name};
use moreau2d::scene::{self, Built};
use std::hint::black_box;

fn build(name: &str) -> Built {
    scene::load(name, &[])
        .expect("a scene of the catalogue")
        .build()
        .expect("a scene that was checked")
}

/// One step of a scene after `settle` steps; it goes on from sample to sample.
fn scene_step(c: &mut Criterion, name: &str, settle: usize) {
    let mut built = build(name);
    for _ in 0..settle {
        built.step().expect("a step");
    }
    c.bench_function(&format!("step/{name}"), |b| {
        b.iter(|| black_box(built.step().expect("a step")));
    });
}

fn steps(c: &mut Criterion) {
    // warm: its impulses are those of the last step
    scene_step(c, "pyramid", 20);
    // 0.32 s: the grains lie on the drum and have begun to turn with it
    scene_step(c, "drum", 160);
}

const INERTIA: f64 = 5.186444e-4;
const TORQUE: f64 = 146.39;
const SPEED: f64 = 70.0;
const FRICTION: f64 = 0.3;

/// The study's rotor: levers of its 26 cells with the ramp leading, axis at 0.25 m.
fn levers() -> Vec<Vec2> {
    let (alpha, beta, gamma, l) = (-5.539, -0.1014, 0.0188, 0.25);
    (0..26)
        .map(|i| {
            let x = 0.002 * f64::from(i);
            let (y, slope) = ((alpha * x + beta) * x + gamma, 2.0 * alpha * x + beta);
            let q = f64::hypot(slope, 1.0);
            let closing: f64 = (-(l + y) * slope - x) / q;
            Vec2::new(-closing.max(0.0), ((l + y) - x * slope) / q)
        })
        .collect()
}

fn rotor(law: impl Fn(Vec2) -> NormalLaw) -> Rotor {
    let mut rotor = Rotor::new(INERTIA, 1.8326, SPEED).expect("a rotor");
    rotor.contacts = levers()
        .into_iter()
        .map(|lever| RotorContact {
            lever,
            gap: 0.0,
            friction: FRICTION,
            law: law(lever),
            position: Vec2::zeros(),
        })
        .collect();
    rotor
}

fn rotor_steps(c: &mut Criterion) {
    let stepper = |scheme| {
        MoreauStepper::new(StepperSettings {
            scheme,
            ..StepperSettings::default()
        })
        .expect("settings")
    };
    // every cell resists with the same share of the torque
    let mut held = rotor(|lever| NormalLaw::Load {
        force: TORQUE / 26.0 / (lever.x.abs() + FRICTION * lever.y),
    });
    held.motor = Some(RotorMotor {
        speed: SPEED,
        max_torque: 2.0 * TORQUE,
    });
    let mut torque_balanced = stepper(Scheme::Staggered);
    c.bench_function("step/rotor-26-torque-balanced", |b| {
        b.iter(|| black_box(torque_balanced.step(&mut held, 1e-6).expect("a step")));
    });
    // stalled after the first step: what is measured is the rank-one problem at rest
    let mut free = rotor(|_| NormalLaw::Rigid { restitution: 0.0 });
    free.torque = TORQUE;
    let mut literal = stepper(Scheme::Moreau);
    c.bench_function("step/rotor-26-literal", |b| {
        b.iter(|| black_box(literal.step(&mut free, 1e-6).expect("a step")));
    });
}

/// A tower of boxes of 1000 kg under a step of weight and a shove at the top.
fn shoved_tower(boxes: usize) -> ContactProblem {
    let mut bodies = tower(boxes, 0.5, |_| 1e3);
    bodies.velocities[boxes - 1].x += 0.05;
    bodies.problem()
}

fn solves(c: &mut Criterion) {
    for (name, problem) in [
        ("solve/4-contacts", shoved_tower(2)),
        ("solve/tower-10", shoved_tower(10)),
    ] {
        problem.validate().expect("a valid problem");
        let mut group = c.benchmark_group(name);
        for method in SOLVERS {
            let mut solver = solver_by_name(method).expect("a name of the table");
            let mut cold = vec![Vec2::zeros(); problem.len()];
            // enumeration gives up on twenty contacts: that time would say nothing
            if !solver.solve(&problem, &mut cold, 1e-8).solved() {
                continue;
            }
            group.bench_function(BenchmarkId::from_parameter(method), |b| {
                b.iter(|| {
                    let mut impulses = vec![Vec2::zeros(); problem.len()];
                    black_box(solver.solve(&problem, &mut impulses, 1e-8))
                });
            });
        }
        group.finish();
    }
}

/// What Gauss-Seidel does not solve: to 1e-9 from nothing, at rest from the impulses found, and beside
/// them the 2000 sweeps that do not get there.
fn hard_solves(c: &mut Criterion) {
    let heavy_top = |k| if k == 9 { 1e5 } else { 1.0 };
    for (name, problem) in [
        ("hard/tower-100", tower(100, 0.5, |_| 1.0).problem()),
        ("hard/ratio-1e5", tower(10, 0.5, heavy_top).problem()),
        ("hard/pyramid-990", pyramid(44, 0.5).problem()),
        ("hard/pyramid-5050", pyramid(100, 0.5).problem()),
    ] {
        let mut group = c.benchmark_group(name);
        group.sample_size(10);
        for method in ["auto", "nsgs"] {
            let mut solver = solver_by_name(method).expect("a name of the table");
            group.bench_function(BenchmarkId::from_parameter(method), |b| {
                b.iter(|| {
                    let mut impulses = vec![Vec2::zeros(); problem.len()];
                    black_box(solver.solve(&problem, &mut impulses, 1e-9))
                });
            });
        }
        let mut solver = solver_by_name("auto").expect("a name of the table");
        let mut impulses = vec![Vec2::zeros(); problem.len()];
        let report = solver.solve(&problem, &mut impulses, 1e-9);
        assert!(report.solved(), "{name}: {report:?}");
        group.bench_function(BenchmarkId::from_parameter("auto-at-rest"), |b| {
            b.iter(|| black_box(solver.solve(&problem, &mut impulses, 1e-9)));
        });
        group.finish();
    }
}

criterion_group!(benches, steps, rotor_steps, solves, hard_solves);
criterion_main!(benches);
