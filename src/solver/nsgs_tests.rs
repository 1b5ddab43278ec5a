use super::*;
use crate::contact::examples::{Lcg, heap, pyramid, tower};
use crate::contact::levels;
use crate::solver::solve_cold;

/// The motion that the impulses cause is unique if all contacts stick.
#[test]
fn relaxed_sweeps_find_the_same_velocities() {
    for bodies in [tower(4, 0.5, |_| 1.0), pyramid(4, 0.5)] {
        let problem = bodies.problem();
        let (exact, report) = solve_cold::<Nsgs>(&problem, 1e-6);
        assert!(report.solved(), "{report:?}");
        let end = problem.local_velocity(&exact);
        for relaxation in [0.7, 1.4] {
            let mut impulses = vec![Vec2::zeros(); problem.len()];
            let mut relaxed = Nsgs {
                relaxation,
                ..Nsgs::default()
            };
            let report = relaxed.solve(&problem, &mut impulses, 1e-6);
            assert!(report.solved(), "{relaxation}: {report:?}");
            // the tolerance times the size of the operator's rows
            let apart = |a: &Vec2, b: &Vec2| (a - b).amax();
            let found = problem.local_velocity(&impulses);
            let worst = end
                .iter()
                .zip(&found)
                .map(|(a, b)| apart(a, b))
                .fold(0.0, f64::max);
            assert!(worst < 1e-5, "{relaxation}: {worst}");
        }
    }
}

fn bits(impulses: &[Vec2]) -> Vec<[u64; 2]> {
    impulses
        .iter()
        .map(|p| [p.x.to_bits(), p.y.to_bits()])
        .collect()
}

/// Sweeps over four contacts at a time against one block at a time, forwards and backwards, from
/// all kinds of impulses. Impulses, change and scale are equal to the last bit.
#[test]
fn four_at_a_time_is_block_after_block() {
    let mut soft = heap(9, 7, 0.4, 1.0, 5).problem();
    for (k, law) in soft.laws.iter_mut().enumerate() {
        // frictionless and frictional, steep, rigid and compliant
        *law = Law::Contact {
            friction: [0.0, 0.3, 1.0, 30.0][k % 4],
            compliance: [0.0, 0.0, 0.5][k % 3],
        };
    }
    // bodies with a locked axis, and rows that do not belong to a contact between points
    let mut odd = heap(9, 7, 0.4, 1.0, 6).problem();
    if let Delassus::Bodies(op) = &mut odd.operator {
        op.inverse_mass[7].x = 0.0;
        op.inverse_mass[20].y = 0.0;
        op.rows[30].jacobian[1][1] *= 0.5;
        op.rows[50].jacobian[0][0].x += 0.1;
        op.rows[60].bodies[0] = op.rows[60].bodies[1];
    }
    for (name, problem, alone) in [
        ("odd", odd, 0),
        ("pyramid", pyramid(9, 0.5).problem(), 0),
        ("heap", heap(12, 8, 0.5, 2.0, 1).problem(), 0),
        ("soft", soft, 0),
    ] {
        check_sweeps_by_four(name, &problem, alone);
    }
}

/// Checks that sweeps of `problem` over four blocks equal sweeps over one block to the last bit;
/// `alone` of its blocks are not contacts.
pub(crate) fn check_sweeps_by_four(name: &str, problem: &ContactProblem, alone: usize) {
    let Delassus::Bodies(op) = &problem.operator else {
        panic!("bodies");
    };
    let others = |law: &&Law| !matches!(law, Law::Contact { .. });
    assert_eq!(problem.laws.iter().filter(others).count(), alone, "{name}");
    let judge = Judge::new(problem);
    let diagonal = judge.diagonal();
    let mut random = Lcg(11);
    let mut one = Nsgs::default();
    let mut impulses = vec![Vec2::zeros(); problem.len()];
    for (p, law) in impulses.iter_mut().zip(&problem.laws) {
        if law.rows() == 2 && random.next() < 0.5 {
            *p = Vec2::new(random.next(), random.next() - 0.5);
        }
    }
    problem.operator.restart(&impulses, &mut one.state);
    let (start, bodies) = (impulses.clone(), one.state.bodies().to_vec());
    let wanted: Vec<_> = (0..60)
        .map(|sweep| {
            let figures = one.one_by_one(problem, diagonal, &mut impulses, sweep % 2 == 1);
            (figures.map(f64::to_bits), bits(&impulses))
        })
        .collect();
    let mut four = FourSweep::default();
    for level in levels() {
        four.arrange(problem, op);
        four.gather(problem, op, diagonal, &start, &bodies);
        let mut by_four = vec![Vec2::zeros(); problem.len()];
        for (sweep, wanted) in wanted.iter().enumerate() {
            let figures = four.sweep(level, problem, op, diagonal, sweep % 2 == 1);
            four.write(&mut by_four);
            let found = (figures.map(f64::to_bits), bits(&by_four));
            assert!(found == *wanted, "{name}, sweep {sweep}, {level:?}");
        }
    }
}

/// Checks that a turn after every tenth sweep needs fewer sweeps than a turn after each.
pub(crate) fn check_turns_after_ten(name: &str, problem: &ContactProblem) {
    let mut impulses = vec![Vec2::zeros(); problem.len()];
    let mut judge = Judge::new(problem);
    let each = Nsgs::default().run(problem, &mut judge, &mut impulses, 1e-7, 20_000, &START);
    let (_, tenth) = solve_cold::<Nsgs>(problem, 1e-7);
    assert!(tenth.solved());
    assert!(
        10 * tenth.sweeps < 9 * each,
        "{name}: {} {each}",
        tenth.sweeps
    );
}

/// In a solve by sweeps alone, a hint that the judge refused does not lead to a check after each
/// later sweep.
#[test]
fn the_judge_is_asked_ever_more_seldom() {
    let count = |plan: &Plan, from: usize| {
        let mut since_check = 0;
        let refused = (from..from + 1000).filter(|&sweep| {
            since_check += 1;
            let checks = plan.checks(true, since_check, sweep);
            since_check *= usize::from(!checks);
            checks
        });
        refused.count()
    };
    assert!((0..16).all(|sweep| ALONE.checks(true, 1, sweep)));
    assert!(count(&ALONE, 0) < 80, "{}", count(&ALONE, 0));
    // every fiftieth, whatever the hint
    assert_eq!(count(&ALONE, 10_000), 20);
    assert_eq!(count(&START, 10_000), 1000);
    for plan in [START, ALONE] {
        assert!(!plan.checks(false, 49, 0) && plan.checks(false, 50, 0));
    }
}

/// A solve by fours ends at the same impulses as the same number of sweeps over one block, whatever
/// problem the solver solved before.
#[test]
fn a_solve_by_fours_is_the_solve() {
    let mut used = Nsgs::with_budget(120);
    for problem in [
        heap(12, 8, 0.5, 0.1, 1).problem(),
        tower(30, 0.5, |_| 1.0).problem(),
        pyramid(9, 0.5).problem(),
    ] {
        check_solve_by_four(&mut used, &problem);
    }
}

/// Checks that a solve of `problem` returns the impulses of the same number of sweeps over one
/// block.
pub(crate) fn check_solve_by_four(used: &mut Nsgs, problem: &ContactProblem) {
    let mut impulses = vec![Vec2::zeros(); problem.len()];
    let report = used.solve(problem, &mut impulses, 1e-5);
    let mut judge = Judge::new(problem);
    let mut plain = Nsgs::default();
    let mut wanted = vec![Vec2::zeros(); problem.len()];
    problem.operator.restart(&wanted, &mut plain.state);
    let mut best = vec![Vec2::zeros(); problem.len()];
    for sweep in 0..report.sweeps {
        let diagonal = judge.diagonal().to_vec();
        plain.one_by_one(problem, &diagonal, &mut wanted, sweep / 10 % 2 == 1);
    }
    let end = judge.natural_map(problem, &wanted).merit();
    if end < judge.natural_map(problem, &best).merit() {
        best.copy_from_slice(&wanted);
    }
    assert!(report.sweeps > 1);
    assert_eq!(bits(&impulses), bits(&best));
}
