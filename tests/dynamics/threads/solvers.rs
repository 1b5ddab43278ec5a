//! Solvers: no memory of other problems, and those of the user.

use super::{grounded, heap, places};
use crate::common::{load, small};
use moreau2d::contact::{ContactProblem, Vec2};
use moreau2d::experiment::Engine;
use moreau2d::oracles::{SOLVERS, solver_by_name};
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
use moreau2d::solver::{Auto, FactorCache, ImpulseSolver, SolveReport};
use std::sync::{Arc, Mutex};
use std::thread::{self, ThreadId};

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
