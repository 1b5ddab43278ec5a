//! The account of the energy that rigid contacts, pins and locks take and may give.
//!
//! Constraints that last do no work, apart from friction. With the rows of its midpoint a step lets
//! them do a small work `W` of either sign, an error of the scheme: a pendulum loses energy in one
//! part of its swing and regains it in another. An island may regain what its constraints took
//! before, and no more. This is its reserve,
//!
//! ```text
//! R ← max(min(R − W, max(R − W_L, 0), max(R, X)), −X),   X = 0.01 (T + T_h)      (1)
//! ```
//!
//! with `T` the kinetic energy of its bodies, and `T_h` that of the velocities that forces alone give
//! them in a step. `W_L` is the work of pins, locks and contacts that last, without friction that
//! slips. What impacts, landings and friction take is lost; in a step with an impact, what contacts take
//! is not part of `W` either.
//!
//! A reserve below 0 is a debt, see [`super::debts`].
//!
//! # Source
//! Own construction. Passivity controllers of haptic devices keep such an account, see Hannaford and
//! Ryu, *Time-domain passivity control of haptic interfaces* (2002).

use super::constraint_work::{joint_work, work};
use super::island_problem::IslandProblem;
use crate::contact::{Law, Vec2};
use crate::solver::ImpulseSolver;

/// Largest reserve that an island builds up, as a share of its energy.
const SHARE: f64 = 0.01;

/// Debt that is round-off of the solve: shares of `T`, and of `T_h` in multiples of the tolerance.
const ROUND: [f64; 2] = [1e-11, 10.0];

/// Share of its bound from which friction counts as slipping.
const SLIPS: f64 = 1.0 - 1e-9;

/// `R` of (1) \[J\] of an island after a step, in which `impulses` give the velocities `G P + b`.
pub(super) fn reserve_after(island: &IslandProblem, impulses: &[Vec2], velocities: &[Vec2]) -> f64 {
    let joints = joint_work(island, impulses, velocities);
    let impact = island.impact();
    let (mut contacts, mut lasting) = (0.0, joints);
    for (i, own) in island.terms.iter().enumerate().filter(|(_, own)| own.rigid) {
        let p = impulses[i];
        let mean = 0.5 * (own.gamma_a + velocities[i] - island.added[i]);
        let [normal, mut tangential] = [p.x * mean.x, p.y * mean.y];
        contacts += normal + tangential;
        if impact || !own.pressed_before {
            continue;
        }
        if tangential < 0.0
            && let Law::Contact { friction, .. } = island.problem.laws[i]
            && p.y.abs() >= SLIPS * friction * p.x
        {
            tangential = 0.0;
        }
        lasting += normal + tangential;
    }
    let all = joints + if impact { contacts.max(0.0) } else { contacts };
    let before = island.reserve;
    let limit = SHARE * (island.kinetic + island.forced);
    let after = (before - all).min((before - lasting).max(0.0));
    after.min(before.max(limit)).max(-limit)
}

/// Energy \[J\] that the constraints of an island would give in the step if none of its impacts took
/// place: its work with the impulses of the same problem whose impacts stay open. 0 if no impulses are
/// found.
pub(super) fn given_without_impacts(
    solver: &mut dyn ImpulseSolver,
    island: &IslandProblem,
    tolerance: f64,
) -> f64 {
    let mut problem = island.problem.clone();
    let speeds = (problem.free.iter()).zip(&island.terms);
    let fastest = speeds.fold(0.0, |most: f64, (b, own)| {
        most.max(b.norm()).max(own.gamma_a.norm())
    });
    let impacts = || (0..island.terms.len()).filter(|&i| island.terms[i].impact);
    // opens them faster than anything moves
    for i in impacts() {
        problem.free[i].x += 4.0 * fastest;
    }
    let mut impulses = vec![Vec2::zeros(); problem.free.len()];
    let report = solver.solve(&problem, &mut impulses, tolerance);
    if !report.solved() || impacts().any(|i| impulses[i] != Vec2::zeros()) {
        return 0.0;
    }
    let mut velocities = Vec::new();
    problem.velocities(&impulses, &mut velocities);
    work(island, &impulses, &velocities) + joint_work(island, &impulses, &velocities)
}

/// The part of a reserve below 0 that is no round-off \[J\].
pub(super) fn debt(island: &IslandProblem, reserve: f64, tolerance: f64) -> f64 {
    match -reserve > ROUND[0] * island.kinetic + ROUND[1] * tolerance * island.forced {
        true => -reserve,
        false => 0.0,
    }
}
