//! Tests of problems with an explicit operator: equal to those from bodies, large, and full.

use super::{DatStorage, StoredProblem, read, to_dat};
use crate::contact::examples::{Bodies, Lcg, heap, pyramid, tower};
use crate::contact::{ContactProblem, Delassus, Vec2};
use crate::solver::{Auto, Direct, solve_cold};
use nalgebra::DVector;

fn explicit(problem: &ContactProblem) -> ContactProblem {
    ContactProblem {
        operator: Delassus::Blocks(problem.operator.to_blocks().into_owned()),
        ..problem.clone()
    }
}

/// The same impulses give the same velocities, and sweeps keep them equal.
#[test]
fn blocks_do_what_bodies_do() {
    let problem = heap(6, 5, 0.4, 0.5, 9).problem();
    let blocks = explicit(&problem);
    let dense = Delassus::dense(problem.operator.explicit());
    assert_eq!(blocks.operator, dense);
    let mut random = Lcg(3);
    let mut impulses: Vec<Vec2> = (0..problem.len())
        .map(|_| Vec2::from_fn(|_, _| random.next() - 0.5))
        .collect();
    let operator = &blocks.operator;
    let mut state = operator.start(&impulses);
    for i in [3, 40, 3] {
        let change = Vec2::new(0.3, -0.2);
        operator.push(i, change, &mut state);
        impulses[i] += change;
    }
    let wanted = problem.operator.apply(&impulses);
    for (i, xi) in wanted.iter().enumerate() {
        // some ten terms of order one
        assert!((operator.read(i, &state) - xi).norm() < 1e-13);
        for j in 0..problem.len() {
            assert_eq!(operator.block(i, j), problem.operator.block(i, j));
        }
    }
}

/// A file of 7000 contacts, without bodies: written, read, checked and solved within seconds. The
/// bounds on the work are the measured ones, rounded up by half.
#[test]
fn a_pyramid_of_seven_thousand_contacts_from_a_file() {
    let problem = explicit(&pyramid(59, 0.5).problem());
    assert_eq!(problem.len(), 6962);
    let stored = StoredProblem::Contact {
        problem: problem.clone(),
        solution: None,
    };
    let text = to_dat(&stored, DatStorage::Blocks).unwrap();
    let loaded = read(text.as_bytes()).unwrap();
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
    assert_eq!(loaded.problem, stored);
    let (_, report) = solve_cold::<Auto>(&problem, 1e-8);
    assert!(report.solved(), "{report:?}");
    assert!(
        report.sweeps <= 100 && report.factorisations <= 27,
        "{report:?}"
    );
}

/// `G + Σ v vᵀ`: every contact is coupled with every other one.
fn full(bodies: &Bodies, seed: u64) -> ContactProblem {
    let problem = bodies.problem();
    let mut random = Lcg(seed);
    let mut operator = problem.operator.explicit();
    let rows = operator.nrows();
    for _ in 0..8 {
        let v = DVector::from_fn(rows, |_, _| 0.5 * (random.next() - 0.5));
        operator += &v * v.transpose();
    }
    ContactProblem {
        operator: Delassus::dense(operator),
        ..problem
    }
}

/// The factorisation does not pivot, and loses nothing by it: a dense LU with pivoting certified
/// the same problems, at 1e-9 and at 1e-12.
#[test]
fn full_and_sparse_operators_are_certified_to_the_last_digits() {
    let mut problems = vec![
        explicit(&tower(20, 0.8, |k| if k % 2 == 1 { 1e6 } else { 1.0 }).problem()),
        explicit(&tower(10, 0.2, |k| if k == 9 { 1e5 } else { 1.0 }).problem()),
        explicit(&pyramid(8, 0.3).problem()),
    ];
    for seed in 0..6 {
        problems.push(explicit(&heap(5, 4, 0.5, 1.0, seed).problem()));
        problems.push(full(&heap(4, 4, 0.5, 1.0, seed), seed + 5));
    }
    for (k, problem) in problems.iter().enumerate() {
        for tolerance in [1e-9, 1e-12] {
            let (_, report) = solve_cold::<Direct>(problem, tolerance);
            assert!(report.solved(), "{k}: {report:?}");
        }
    }
}
