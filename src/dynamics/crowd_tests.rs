//! Large islands that are not solved, over several steps.

use super::super::constraint_work::work;
use super::super::interval::{Block, Collected, Interval, Source};
use super::super::island_problem::{IslandProblem, LARGE, Terms, is_rigid};
use super::super::model::{ContactKey, ContactPoint, NormalLaw};
use super::super::rules::{Effort, ImpactLaw, Rules, Scheme};
use super::super::scaled::bound_swept;
use super::super::solution::Solution;
use super::super::solve::IslandSolver;
use super::simplify;
use crate::contact::{BodyOperator, ContactProblem, Delassus, Law, NO_BODY, Rows, Vec2, Vec3};
use crate::solver::{Direct, ImpulseSolver, Shares, SolveReport};
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
        // crowds are for the methods of the program
        "direct"
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
    let mut own = Collected::default();
    for k in 0..=count {
        let left = if k > 0 { k - 1 } else { NO_BODY };
        let right = if k < count { k } else { NO_BODY };
        let rows = Rows {
            bodies: [left, right],
            jacobian: [-1.0, 1.0].map(|s| [Vec3::new(s, 0.0, 0.0), Vec3::new(0.0, s, 0.0)]),
        };
        let number = first + u64::from(k);
        own.pairs.push(number);
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
            rolls_on: [0.0; 2],
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
            sinks: false,
            held: [0.0; 2],
            turning: None,
        };
        let law = Law::Contact {
            friction: 0.5,
            compliance: 0.0,
        };
        own.push(block, rows.bodies, Vec2::new(-1.0, 0.0), law, Vec2::zeros());
    }
    interval.swap_blocks(&mut own);
    interval
}

const RULES: Rules = Rules {
    distant: false,
    one_problem: false,
    tangents: false,
    scheme: Scheme::Staggered,
    law: ImpactLaw::Capped,
    shares: Shares::Found,
    events: false,
    sweeps: false,
    effort: Effort::Fast,
};
/// An island is a crowd once its problem was not solved: from then on it is not tried again, known by any
/// of its blocks, until the end of the step if that failed in a part of a step.
#[test]
fn a_crowd_is_known_by_any_block_and_within_its_step() {
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
            assert!(solution.outcomes[0].crowd);
        }
        solver.cache.commit();
        tried.load(Ordering::Relaxed)
    };
    assert_eq!(step(0, &[true, false, false]), 1);
    // of 601 contacts the first 400 are new
    assert_eq!(step(400, &[true, false]), 1);
    assert_eq!(step(400, &[true]), 1);
    // a failure in a part of a step counts only until the end of the step
    assert_eq!(step(9000, &[false, false]), 2);
    assert_eq!(step(9000, &[false, false]), 3);
}

/// With the effort `exact` the solver is tried in every step that the sweeps do not solve.
#[test]
fn effort_decides_whether_a_crowd_is_tried() {
    for (effort, tries) in [(Effort::Fast, 1), (Effort::Exact, 6)] {
        let fails = FailsLarge::default();
        let tried = fails.tried.clone();
        let mut solver = IslandSolver::new(Box::new(fails), 1e-8);
        let masses = vec![Vec3::new(1.0, 1.0, 0.0); 600];
        let rules = Rules { effort, ..RULES };
        for _ in 0..5 {
            solver.cache.begin();
            let mut solution = Solution::default();
            solver.solve(&row(0, 600, 0.0), &mut solution, &masses, &rules);
            solver.cache.commit();
        }
        // once with pushes, then without in every step
        assert_eq!(tried.load(Ordering::Relaxed), tries, "{effort:?}");
    }
}

/// Solves, and then leaves this share of the impulses out.
struct Misses {
    share: f64,
    direct: Direct,
}

impl ImpulseSolver for Misses {
    fn name(&self) -> &'static str {
        "direct"
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
    ) -> SolveReport {
        self.direct.solve(problem, impulses, tolerance);
        impulses.iter_mut().for_each(|p| *p *= 1.0 - self.share);
        SolveReport::judged(problem, impulses, tolerance)
    }
}

/// A step of an island by a solver that [`Misses`] by `share`.
fn missed(interval: &Interval, share: f64) -> Solution {
    let direct = Direct::default();
    let mut solver = IslandSolver::new(Box::new(Misses { share, direct }), 1e-8);
    let masses = vec![Vec3::new(1.0, 1.0, 0.0); 600];
    let mut solution = Solution::default();
    solver.cache.begin();
    solver.solve(interval, &mut solution, &masses, &RULES);
    solution
}

/// What nearly solves an island is not thrown away: the island stays as it is if the solver missed by
/// little. Otherwise it is a crowd, with the solver's impulses where the sweeps leave more.
#[test]
fn a_near_miss_is_kept() {
    let mut interval = row(0, 600, 0.0);
    // nothing is pushed, and the last wall makes room for all
    interval.bias.fill(Vec2::new(-0.5, 0.0));
    interval.detection.contacts[600].gap = 7.0;
    interval.bias[600].x = 700.0;
    for (share, crowd) in [(1e-6, false), (1e-2, true)] {
        let outcome = &missed(&interval, share).outcomes[0];
        assert_eq!(outcome.crowd, crowd, "{share}");
        let left = &outcome.report.residual;
        assert!(!outcome.report.solved(), "{share}");
        // sweeps alone leave more than that of a row of 600 balls
        assert!(
            left.velocity <= 2.0 * share * left.velocity_scale,
            "{left:?}"
        );
    }
}

/// Joints alone are no crowd, whatever the solver leaves.
#[test]
fn an_island_of_joints_is_no_crowd() {
    let mut interval = row(0, 600, 0.0);
    for law in &mut interval.laws {
        *law = Law::Pin;
    }
    assert!(!missed(&interval, 1e-2).outcomes[0].crowd);
}

/// The problem of a crowd has neither pushes nor gaps within the dead band; wider gaps stay.
#[test]
fn the_problem_of_a_crowd_has_no_pushes_and_no_small_gaps() {
    let masses = vec![Vec3::new(1.0, 1.0, 1.0); 600];
    for (gap, bias, posed) in [(-1e-3, -1.0, -0.5), (1e-4, 2.0, -0.5), (1e-2, 2.0, 2.0)] {
        let mut interval = row(0, 600, 0.0);
        for contact in &mut interval.detection.contacts {
            // a size of 1 m
            for side in &mut contact.rows.jacobian {
                side[1].z = 0.5;
            }
        }
        interval.detection.contacts[7].gap = gap;
        interval.bias[7].x = bias;
        let mut solution = Solution::default();
        solution.begin(&interval);
        let members: Vec<u32> = (0..601).collect();
        let mut island = IslandProblem::default();
        island.set_up(&interval, &solution, &members, &masses);
        simplify(&mut island, &members, &interval, &masses);
        let free = island.problem.free[7].x;
        assert!((free - posed).abs() < 1e-12, "{gap}: {free}");
        assert!((island.added[7].x - (posed + 0.5)).abs() < 1e-12);
    }
}

/// A ball of 1 kg at 1 m/s: 1 N s stops it and 2 N s throw it back as fast. More would add energy.
#[test]
fn impulses_that_add_energy_are_scaled_down() {
    let rows = Rows {
        bodies: [NO_BODY, 0],
        jacobian: [[Vec3::zeros(); 2], [Vec3::x(), Vec3::y()]],
    };
    let gamma = Vec2::new(-1.0, 0.0);
    let terms = Terms {
        gamma_a: gamma,
        gamma_f: gamma,
        bias: gamma,
        rigid: true,
        bilateral: false,
        impact: false,
        pressed_before: false,
    };
    let mut island = IslandProblem {
        problem: ContactProblem {
            operator: Delassus::Bodies(BodyOperator {
                inverse_mass: vec![Vec3::new(1.0, 1.0, 0.0)],
                rows: vec![rows],
            }),
            free: vec![gamma],
            laws: vec![Law::Contact {
                friction: 0.5,
                compliance: 0.0,
            }],
        },
        terms: vec![terms],
        ..IslandProblem::default()
    };
    island.count_added();
    for (impulse, bounded) in [(1.0, 1.0), (2.0, 2.0), (3.0, 2.0), (9.0, 2.0)] {
        let mut impulses = vec![Vec2::new(impulse, 0.0)];
        let mut velocities = Vec::new();
        island.problem.velocities(&impulses, &mut velocities);
        let changed = bound_swept(&island, &mut impulses, &velocities);
        assert_eq!(changed, impulse > 2.0, "{impulse}");
        assert!((impulses[0].x - bounded).abs() < 1e-12, "{impulses:?}");
        island.problem.velocities(&impulses, &mut velocities);
        assert!(work(&island, &impulses, &velocities) < 1e-12);
    }
}
