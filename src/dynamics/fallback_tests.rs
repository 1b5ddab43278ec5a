//! Large islands without rigid impulses, over several steps.

use super::contact_cache::JointEnergy;
use super::fallback::{Fallback, LARGE};
use super::interval::{Block, Interval, Source};
use super::island_problem::is_rigid;
use super::joint::RowName;
use super::joint_frames::{Bend, Coordinate};
use super::model::{ContactKey, ContactPoint, JointCoordinate, JointPart, NormalLaw};
use super::rules::{ImpactLaw, Rules, Scheme};
use super::solution::Solution;
use super::solve::IslandSolver;
use crate::contact::{ContactProblem, Law, NO_BODY, Residual, Rows, Vec2, Vec3};
use crate::solver::{Direct, ImpulseSolver, Shares, SolveReport, SolveStatus};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A solver that never solves a large problem with a rigid contact, and counts its calls.
#[derive(Default)]
pub struct FailsLarge {
    pub tried: Arc<AtomicUsize>,
    direct: Direct,
}

impl ImpulseSolver for FailsLarge {
    fn name(&self) -> &'static str {
        "fails"
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
    ) -> SolveReport {
        if problem.len() > LARGE && problem.laws.iter().any(is_rigid) {
            self.tried.fetch_add(1, Ordering::Relaxed);
            return SolveReport::judged(problem, impulses, tolerance);
        }
        self.direct.solve(problem, impulses, tolerance)
    }
}

/// A row of `count` balls of 1 kg between two walls. They close at 0.5 m/s and must open at the
/// same speed, with this gap \[m\] at all contacts. The contacts are numbered from `first` on.
pub fn row(first: u64, count: u32, gap: f64) -> Interval {
    let mut interval = Interval {
        length: 0.01,
        whole: true,
        ..Interval::default()
    };
    let bodies = vec![Vec3::zeros(); count as usize];
    for all in [&mut interval.start, &mut interval.free] {
        all.clone_from(&bodies);
    }
    interval.accelerations = bodies;
    for k in 0..=count {
        let left = if k > 0 { k - 1 } else { NO_BODY };
        let right = if k < count { k } else { NO_BODY };
        let rows = Rows {
            bodies: [left, right],
            jacobian: [-1.0, 1.0].map(|s| [Vec3::new(s, 0.0, 0.0), Vec3::new(0.0, s, 0.0)]),
        };
        let number = first + u64::from(k);
        interval.pairs.push(number);
        interval.detection.contacts.push(ContactPoint {
            key: ContactKey {
                pair: number,
                feature: 0,
            },
            rows,
            bodies: rows.bodies,
            surfaces: rows.bodies,
            places: Default::default(),
            position: Vec2::zeros(),
            normal: Vec2::x(),
            gap,
            gap_noise: 0.0,
            radii: [0.0; 2],
            friction: 0.5,
            law: NormalLaw::Rigid { restitution: 0.0 },
            surface_velocity: 0.0,
        });
        let block = Block {
            source: Source::Contact(k as usize),
            bodies: rows.bodies,
            gamma_a: Vec2::zeros(),
            gamma_f: Vec2::new(-0.5, 0.0),
            impact: false,
            bilateral: false,
            loaded: false,
            pressed_before: false,
            stuck_before: false,
            continues: false,
            on_surface: false,
            held: [0.0; 2],
            turning: None,
        };
        let law = Law::Contact {
            friction: 0.5,
            compliance: 0.0,
        };
        interval.push(block, rows.bodies, Vec2::new(-1.0, 0.0), law, Vec2::zeros());
    }
    interval
}

const RULES: Rules = Rules {
    scheme: Scheme::Staggered,
    law: ImpactLaw::Capped,
    shares: Shares::Found,
    events: false,
    sweeps: false,
};

/// Bugs: an island in fallback was solved as rigid again at once when the contact that served as
/// its key opened, and after every impact located in it, several times in a step.
#[test]
fn what_gives_way_is_known_by_any_contact_and_within_its_step() {
    let fails = FailsLarge::default();
    let tried = fails.tried.clone();
    let mut solver = IslandSolver::new(Box::new(fails), 1e-8);
    let masses = vec![Vec3::new(1.0, 1.0, 0.0); 600];
    let mut step = |first: u64, wholes: &[bool]| {
        solver.cache.begin();
        for &whole in wholes {
            let mut interval = row(first, 600, 0.0);
            interval.whole = whole;
            let mut solution = Solution::default();
            solver.solve(&interval, &mut solution, &masses, &RULES);
            // the fallback applies
            assert!(solution.impulses.iter().all(|p| p.x > 0.0));
        }
        solver.cache.commit();
        tried.load(Ordering::Relaxed)
    };
    assert_eq!(step(0, &[true, false, false]), 1);
    // of 601 contacts the first 400 are new
    assert_eq!(step(400, &[true, false]), 1);
    assert_eq!([step(400, &[true]), step(400, &[true])], [1, 1]);
    assert_eq!(step(400, &[true]), 1);
    // the fourth step is over
    assert_eq!(step(400, &[true, false]), 2);
    // a failure in a part of a step counts only until the end of the step
    assert_eq!(step(9000, &[false, false]), 3);
    assert_eq!(step(9000, &[false, false]), 4);
}

/// Regularised contacts get push-outs, which contradict the walls of a row of balls. The rigid
/// problem would never have a solution with them.
#[test]
fn what_gave_way_is_tried_again_without_pushes() {
    let fails = FailsLarge::default();
    let mut solver = IslandSolver::new(Box::new(fails), 1e-8);
    solver.store_problems = true;
    let masses = vec![Vec3::new(1.0, 1.0, 0.0); 600];
    let mut pushes = Vec::new();
    for _ in 0..6 {
        let (interval, mut solution) = (row(0, 600, -1e-3), Solution::default());
        solver.cache.begin();
        solver.solve(&interval, &mut solution, &masses, &RULES);
        solver.cache.commit();
        pushes.extend(solution.problems.iter().map(|s| s.problem.free[7].x));
        // the solution has the original `b`
        assert_eq!(solution.bias[7].x, -1.0);
    }
    // a try with all pushes, four steps without a try, then a try without pushes
    assert_eq!(pushes, [-1.0, -1.0, -1.0, -1.0, -1.0, -0.5]);
}

fn report(status: SolveStatus, velocity: f64) -> SolveReport {
    SolveReport {
        status,
        sweeps: 0,
        factorisations: 0,
        pivots: 0,
        residual: Residual {
            velocity,
            velocity_scale: 1.0,
            ..Residual::default()
        },
    }
}

/// A problem that keeps failing is tried less and less often; a solved one at once again.
#[test]
fn what_fails_is_tried_again_after_ever_more_steps() {
    let failed = report(SolveStatus::Unsolved, 0.1);
    let mut state = Fallback::default();
    let tried: Vec<usize> = (0..200)
        .filter(|_| {
            let tries = !state.skips_rigid();
            state = state.after(&failed);
            assert!(state.active());
            tries
        })
        .collect();
    assert_eq!(tried, [0, 5, 14, 31, 64, 97, 130, 163, 196]);
    let state = state.after(&report(SolveStatus::Solved, 0.0));
    assert_eq!(state, Fallback::default());
}

/// Bug: a heap that was nearly solved from time to time was tried again after a few steps, over and
/// over.
#[test]
fn what_is_nearly_solved_is_used_until_the_island_gives_way() {
    let near = report(SolveStatus::Unsolved, 1e-5);
    assert_eq!(Fallback::default().after(&near), Fallback::default());
    let mut state = Fallback::default().after(&report(SolveStatus::Unsolved, 0.1));
    assert!(state.active());
    let tried = (0..100).filter(|_| {
        let tries = !state.skips_rigid();
        state = state.after(&near);
        assert!(state.active());
        tries
    });
    assert_eq!(tried.collect::<Vec<usize>>(), [4, 13, 30, 63, 96]);
}

/// Bug: joints kept the energy of the rigid impulses, which were not applied, as the energy that
/// they have added.
#[test]
fn joints_of_what_gives_way_count_the_work_of_the_impulses_that_act() {
    let fails = FailsLarge::default();
    let mut solver = IslandSolver::new(Box::new(fails), 1e-8);
    let masses = vec![Vec3::new(1.0, 1.0, 0.0); 600];
    let mut interval = row(0, 600, 0.0);
    // a lock holds the first ball, which moves at the start; forces elsewhere set the scale
    let rows = Rows {
        bodies: [NO_BODY, 0],
        jacobian: [[Vec3::zeros(); 2], [Vec3::x(), Vec3::zeros()]],
    };
    let name = RowName {
        key: ContactKey {
            pair: 5000,
            feature: 0,
        },
        joint: 0,
        part: JointPart::Lock(JointCoordinate::X),
    };
    let place = Coordinate {
        value: Vec2::zeros(),
        rows,
        bend: Bend::Straight,
    };
    let gamma = Vec2::new(0.3, 0.0);
    interval.detection.joints.push(place.lock(name, 0.0));
    interval.energies.push(JointEnergy::default());
    interval.start[0].x = gamma.x;
    interval.free[0].x = gamma.x;
    interval.accelerations[300].x = 1e4;
    let block = Block {
        source: Source::Joint(0),
        bodies: rows.bodies,
        gamma_a: gamma,
        gamma_f: gamma,
        bilateral: true,
        ..interval.blocks[0]
    };
    let law = Law::Bounded {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        compliance: 0.0,
    };
    interval.push(block, rows.bodies, gamma, law, Vec2::zeros());
    let mut solution = Solution::default();
    solver.cache.begin();
    solver.solve(&interval, &mut solution, &masses, &RULES);
    solver.cache.commit();
    solution.end_velocities(&interval, &masses);
    assert!(solution.outcomes[0].relaxed);
    let mean = 0.5 * (interval.start[0].x + solution.end[0].x);
    let work = solution.impulses.last().unwrap().x * mean;
    let added = solution.energies[0].added;
    assert!(
        work < -0.01 && (added - work).abs() < 1e-6,
        "{added} {work}"
    );
}
