//! What a solver keeps, it does not allocate again.

mod common;

use allocation_counter::measure;
use common::load;
use moreau2d::contact::{ContactProblem, Delassus, Vec2};
use moreau2d::experiment::Engine;
use moreau2d::solver::{Direct, ImpulseSolver, Nsgs};

/// Scenes, and after how many steps to look.
const SCENES: [(&str, usize); 4] = [("pyramid", 1), ("tower", 1), ("arch", 1), ("drum", 200)];

/// The largest problem of the last of `steps` steps.
fn problem(scene: &str, steps: usize) -> ContactProblem {
    let mut built = load(scene, &[]).build().unwrap();
    built.keep_problems(true);
    for _ in 0..steps {
        Engine::Moreau.step(&mut built).unwrap();
    }
    let problems = built.problems();
    let largest = problems.iter().max_by_key(|s| s.problem.len()).unwrap();
    largest.problem.clone()
}

/// The same with loads a quarter larger.
fn heavier(problem: &ContactProblem) -> ContactProblem {
    let mut other = problem.clone();
    other.free.iter_mut().for_each(|b| *b *= 1.25);
    other
}

/// Allocations of a solve from zero.
fn allocations(solver: &mut impl ImpulseSolver, problem: &ContactProblem) -> u64 {
    let mut impulses = vec![Vec2::zeros(); problem.len()];
    let solve = || {
        solver.solve(problem, &mut impulses, 1e-9);
    };
    measure(solve).count_total
}

#[test]
fn what_allocates_is_counted() {
    let mut solver = Nsgs::default();
    assert!(allocations(&mut solver, &problem("pyramid", 1)) > 0);
}

/// Another problem of the same size, from bodies and with an explicit operator.
#[test]
fn sweeps_allocate_nothing_once_they_have_solved_a_problem() {
    for (scene, steps) in SCENES {
        let problem = problem(scene, steps);
        let dense = ContactProblem {
            operator: Delassus::dense(problem.operator.explicit()),
            ..problem.clone()
        };
        for problem in [problem, dense] {
            let mut solver = Nsgs::default();
            allocations(&mut solver, &problem);
            let count = allocations(&mut solver, &heavier(&problem));
            assert_eq!(count, 0, "{scene}, {} contacts", problem.len());
        }
    }
}

/// A step at rest allocates the record that it returns and a few lists, however large the scene.
#[test]
fn a_step_at_rest_allocates_no_more_for_more_bodies() {
    let counts = [4, 16].map(|wide| {
        let even = format!("repeat.even.count=[{wide},5]");
        let odd = format!("repeat.odd.count=[{},5]", wide - 1);
        let mut built = load("wall", &[&even, &odd]).build().unwrap();
        for _ in 0..5 {
            Engine::Moreau.step(&mut built).unwrap();
        }
        let step = || assert_eq!(Engine::Moreau.step(&mut built).unwrap().resting, 1);
        measure(step).count_total
    });
    println!("{counts:?}");
    assert!(counts[1] <= counts[0], "{counts:?}");
    assert!(counts[1] <= 40, "{counts:?}");
}

/// From bodies, whichever stage it takes; the arch takes the interior point.
#[test]
fn newton_and_interior_point_allocate_nothing_once_they_have_solved_the_problem() {
    for (scene, steps) in SCENES {
        let problem = problem(scene, steps);
        let mut solver = Direct::default();
        allocations(&mut solver, &problem);
        assert_eq!(allocations(&mut solver, &problem), 0, "{scene}");
    }
}
