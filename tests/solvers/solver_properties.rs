//! What holds for every solver of the table, whatever its method.

use crate::common::Random;
use crate::common::problems::{Change, Known, apart, assert_laws, bodies_and_rows, largest};
use moreau2d::contact::examples::tower;
use moreau2d::contact::{ContactProblem, Delassus, Law, NO_BODY, Vec2, Vec3, natural_map};
use moreau2d::oracles::{SOLVERS, solver_by_name};
use moreau2d::solver::SolveReport;
use nalgebra::DMatrix;
use proptest::prelude::*;

/// Solves from `start`; whatever comes of it, the report is the judge's and nothing is NaN.
#[track_caller]
fn solve(
    name: &str,
    problem: &ContactProblem,
    start: &[Vec2],
    tolerance: f64,
) -> (Vec<Vec2>, SolveReport) {
    let mut impulses = start.to_vec();
    let mut solver = solver_by_name(name).unwrap();
    let report = solver.solve(problem, &mut impulses, tolerance);
    let finite = impulses.iter().all(|p| p.x.is_finite() && p.y.is_finite());
    assert!(finite, "{name}: {impulses:?}");
    let residual = natural_map(problem, &impulses);
    assert_eq!(residual, report.residual, "{name}");
    assert_eq!(residual.certified(tolerance), report.solved(), "{name}");
    (impulses, report)
}

fn zeros(problem: &ContactProblem) -> Vec<Vec2> {
    vec![Vec2::zeros(); problem.len()]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Where there is one solution only, every solver finds it: impulses and velocities.
    #[test]
    fn the_only_solution_is_found(seed: u64) {
        let random = &mut Random(seed);
        for known in [Known::unique(random), Known::unique_explicit(random)] {
            let expected = known.problem.local_velocity(&known.impulses);
            for name in SOLVERS {
                let (found, report) = solve(name, &known.problem, &zeros(&known.problem), 1e-11);
                prop_assert!(report.solved(), "{name}: {report:?}");
                // the residual times the condition number, up to some hundreds, and 1 / (1 - μ κ)
                let off = apart(&found, &known.impulses);
                prop_assert!(off < 1e-7, "{name}: impulses off by {off}");
                let off = apart(&known.problem.local_velocity(&found), &expected);
                prop_assert!(off < 1e-7, "{name}: velocities off by {off}");
            }
        }
    }

    /// Labels, axes, hand and units change the answer only as they must.
    #[test]
    fn the_answer_follows_the_writing_of_the_problem(seed: u64) {
        let random = &mut Random(seed);
        let known = Known::unique(random);
        for change in Change::all(random, &known.problem) {
            let problem = change.problem(&known.problem);
            for name in SOLVERS {
                let (old, _) = solve(name, &known.problem, &zeros(&known.problem), 1e-13);
                let (new, report) = solve(name, &problem, &zeros(&problem), 1e-13);
                let off = apart(&new, &change.impulses(&old));
                prop_assert!(off <= 1e-9 * largest(&new), "{name} {change:?}: {off}, {report:?}");
            }
        }
    }

    /// Redundant contacts, friction up to 2, compliance: whoever claims a solution obeys the laws,
    /// and a solution is kept by whoever starts from it.
    #[test]
    fn who_claims_a_solution_has_one(seed: u64) {
        let random = &mut Random(seed);
        let known = Known::redundant(random);
        for name in SOLVERS {
            let (found, report) = solve(name, &known.problem, &zeros(&known.problem), 1e-8);
            if report.solved() {
                assert_laws(&known.problem, &found);
            }
            let (_, report) = solve(name, &known.problem, &known.impulses, 1e-8);
            // the others ignore a start
            let warm = ["auto", "direct", "nsgs", "prox"].contains(&name);
            prop_assert!(report.solved() || !warm, "{name}: {report:?}");
        }
    }

    /// Bodies of 1e-12 to 1e12 kg, some locked in part, friction up to 100, velocities of 1e-6 to
    /// 1e6 m/s or none at all, starts of any size.
    #[test]
    fn nothing_infinite_comes_of_extreme_numbers(seed: u64) {
        let random = &mut Random(seed);
        let problem = extreme(random);
        prop_assume!(problem.validate().is_ok());
        let start = extreme_start(random, problem.len());
        for name in SOLVERS {
            for start in [&zeros(&problem), &start] {
                let figures = solve(name, &problem, start, 1e-8).1.residual;
                prop_assert!(
                    figures.absolute.is_finite() && figures.velocity.is_finite(), "{name}"
                );
            }
        }
    }

    /// Without any velocity there is nothing to do, and nothing is done.
    #[test]
    fn no_velocity_needs_no_impulse(seed: u64) {
        let mut problem = Known::redundant(&mut Random(seed)).problem;
        problem.free.fill(Vec2::zeros());
        for name in SOLVERS {
            let (found, report) = solve(name, &problem, &zeros(&problem), 1e-12);
            // enumeration takes no large problem, but nothing is what it would return
            prop_assert!(report.solved(), "{name}: {report:?}");
            prop_assert_eq!(largest(&found), 0.0, "{}", name);
        }
    }
}

fn extreme(random: &mut Random) -> ContactProblem {
    let bodies = 2 + random.below(4);
    let contacts = 1 + random.below(8);
    let sides = |random: &mut Random, _: usize| {
        let first = random.below(bodies) as u32;
        let other = random.below(bodies + 1) as u32;
        let ground = other == first || other == bodies as u32;
        [if ground { NO_BODY } else { other }, first]
    };
    let mut operator = bodies_and_rows(random, bodies, sides, contacts);
    if let Delassus::Bodies(op) = &mut operator {
        for w in &mut op.inverse_mass {
            *w *= 10f64.powf(random.between(-12.0, 12.0));
            match random.below(6) {
                0 => *w = Vec3::new(0.0, 0.0, w.z),
                1 => *w = Vec3::new(w.x, w.y, 0.0),
                _ => {}
            }
        }
    }
    let speed = match random.below(4) {
        0 => 0.0,
        _ => 10f64.powf(random.between(-6.0, 6.0)),
    };
    ContactProblem {
        free: (0..contacts)
            .map(|_| speed * Vec2::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0)))
            .collect(),
        laws: (0..contacts)
            .map(|_| Law::Contact {
                friction: [0.0, 0.5, 10.0, 100.0][random.below(4)],
                compliance: 0.0,
            })
            .collect(),
        operator,
    }
}

fn extreme_start(random: &mut Random, blocks: usize) -> Vec<Vec2> {
    let size = 10f64.powf(random.between(-12.0, 12.0));
    (0..blocks)
        .map(|_| size * Vec2::new(random.between(-1.0, 1.0), random.between(-1.0, 1.0)))
        .collect()
}

/// Sweeps left this solution for good, a residual of 0.1: they did not ask whether they start from
/// one.
#[test]
fn sweeps_keep_a_solution_that_repels_them() {
    let known = Known::redundant(&mut Random(7827357020481305735));
    let (found, report) = solve("nsgs", &known.problem, &known.impulses, 1e-8);
    assert!(report.solved(), "{report:?}");
    assert_eq!((found, report.sweeps), (known.impulses, 0));
}

/// Sweeps grew here until the judge's squares overflowed, and were returned: finite, but judged
/// infinite.
#[test]
fn sweeps_that_diverge_give_back_their_start() {
    let random = &mut Random(3940363232134534123);
    let problem = extreme(random);
    let start = extreme_start(random, problem.len());
    for start in [zeros(&problem), start] {
        let before = natural_map(&problem, &start).merit();
        let (_, report) = solve("prox", &problem, &start, 1e-8);
        assert!(report.residual.merit() <= before, "{report:?}");
    }
}

/// A body between two plates that are driven together at 1 m/s each: self-stress of any size leaves
/// the velocities as wrong as none, and is not returned for its small relative residual.
#[test]
fn no_solver_ends_a_press_with_impulses_without_bound() {
    let mut operator = DMatrix::identity(4, 4);
    (operator[(0, 2)], operator[(2, 0)]) = (-1.0, -1.0);
    let law = Law::Contact {
        friction: 0.0,
        compliance: 0.0,
    };
    let problem = ContactProblem {
        operator: Delassus::dense(operator),
        free: vec![Vec2::new(-1.0, 0.0); 2],
        laws: vec![law; 2],
    };
    for name in SOLVERS {
        let (impulses, report) = solve(name, &problem, &zeros(&problem), 1e-8);
        assert!(!report.solved(), "{name}");
        // 1 N s would stop either plate alone
        assert!(largest(&impulses) <= 2.0, "{name}: {impulses:?}");
    }
}

/// Of problems that have a solution, redundant and with friction up to 2, how many each method finds
/// one of. Floors, not goals: what was measured less one in fifty.
#[test]
fn shares_of_redundant_problems_solved() {
    let random = &mut Random(1);
    let few: Vec<_> = (0..300).map(|_| Known::redundant(random)).collect();
    let many: Vec<_> = (0..100)
        .map(|_| Known::redundant_of(random, 15, 60))
        .collect();
    for (name, of_few, of_many) in [
        ("auto", 294, 98),
        ("enumeration", 130, 0),
        ("nsgs", 282, 29),
        ("direct", 294, 97),
        ("lemke", 294, 97),
        ("prox", 294, 67),
    ] {
        for (problems, least) in [(&few, of_few), (&many, of_many)] {
            let solved = problems
                .iter()
                .map(|k| &k.problem)
                .filter(|p| solve(name, p, &zeros(p), 1e-8).1.solved())
                .count();
            assert!(solved >= least, "{name}: {solved} of {}", problems.len());
        }
    }
}

/// Whatever the size: too large for some, which then leave it alone.
#[test]
fn a_start_that_is_not_finite_never_comes_back() {
    for boxes in [1, 2, 40] {
        let problem = tower(boxes, 0.5, |_| 1.0).problem();
        for name in SOLVERS {
            let mut impulses = vec![Vec2::new(f64::NAN, f64::INFINITY); problem.len()];
            let report = solver_by_name(name)
                .unwrap()
                .solve(&problem, &mut impulses, 1e-8);
            let finite = impulses.iter().all(|p| p.x.is_finite() && p.y.is_finite());
            assert!(finite, "{name}, {boxes}: {report:?}");
        }
    }
}
