//! Which islands of a solved step are at rest.
//!
//! Motion that a solve resolves is never taken for rest, however slow: with `F` of
//! [`Residual`](crate::contact::Residual) and `r` its velocity, an island rests if
//!
//! ```text
//! r ≤ ε v/10,   |u_A|_k + |u_E|_k ≤ min(1000 r + δ, ε v),   |u| = |v| + a |ω|   (1)
//! ```
//!
//! for all its bodies `k`; `v` is the velocity scale of the island, `δ` the round-off of its
//! impulses, `a` the longest arm of the body's contacts. At the top of a tower of 50 boxes the speed
//! is a thousand times the residual of its contacts. `ε` = [`REST`]. The solver's tolerance does not
//! matter, only what the solve reached.
//!
//! A pile that has come to rest still rocks by some 1e-9 m/s, within the dead band of its gaps. So an
//! island is stopped once all its bodies are slower than [`SLOW`] of what the forces on them give in a
//! step, 1.6e-9 m/s under gravity at 1/60 s. The next solve starts from `u_A = 0` exactly, and tells
//! rest from a motion that begins: there `u_E` is what the forces leave. If (1) fails, the island is
//! stopped again only after twice as many steps, and so on, until it is faster or at rest. What is
//! stopped is not given back: a steady motion slower than [`SLOW`] is lost.
//!
//! The repeated problem has the same rows and gaps, and differs in `u_A` alone, which is zero now.
//! With friction `μ` the residual velocity of `P` in it is at most
//!
//! ```text
//! r + 4 (1 + μ) max_k (|u_A| + |u_E|)_k                                       (2)
//! ```
//!
//! which the record states. The state is the same in all later steps, bit for bit, so no error adds
//! up.

use super::contact_cache::Overlaps;
use super::crowd::overlaps;
use super::interval::{Interval, Source};
use super::model::NormalLaw;
use super::outcome::SolvedProblem;
use super::solution::Solution;
use crate::contact::{NO_BODY, Vec3};

/// Largest speed of a body at rest, as a share of the velocity scale of its island: see (1).
const REST: f64 = 1e-9;
/// Speed at which an island is stopped, as a share of what the forces on each body give in a step.
const SLOW: f64 = 1e-8;
/// Largest speed of a body that a residual of the contacts of its island explains, see (1).
const SPREAD: f64 = 1e3;

/// A solved step before it is recorded.
#[derive(Clone, Copy)]
pub(super) struct Solved<'a> {
    pub interval: &'a Interval,
    pub inverse_mass: &'a [Vec3],
    pub in_cluster: &'a [bool],
    /// Pairs that are moved apart.
    pub overlaps: Option<&'a Overlaps>,
    /// Of the islands that are used, in their order; empty if they are not stored.
    pub problems: &'a [SolvedProblem],
}

/// The least number of an island's movable bodies.
pub(super) fn first(interval: &Interval, solution: &Solution, island: usize) -> u32 {
    let least = members(interval, solution, island).min();
    least.map_or(NO_BODY, |body| body as u32)
}

/// The movable bodies of an island, once for each of their contacts.
pub(super) fn members<'a>(
    interval: &'a Interval,
    solution: &'a Solution,
    island: usize,
) -> impl Iterator<Item = usize> + 'a {
    let blocks = solution.islands.blocks(island).iter();
    let sides = blocks.flat_map(|&i| interval.sides[i as usize]);
    sides
        .filter(|body| *body != NO_BODY)
        .map(|body| body as usize)
}

/// How an island moves by itself.
#[derive(Clone, Copy)]
pub(super) enum State {
    Moves,
    /// All its bodies are slow enough to be stopped.
    Slow,
    /// With the relative residual and the bound (2) \[m/s\].
    Rests([f64; 2]),
}

pub(super) fn state_of(island: usize, step: &Solved, solution: &Solution) -> State {
    let (interval, outcome) = (step.interval, &solution.outcomes[island]);
    let residual = &outcome.report.residual;
    let most = REST * residual.velocity_scale;
    let room = (SPREAD * residual.velocity + residual.round_off).min(most);
    let plain = outcome.report.solved()
        && !(outcome.relaxed || outcome.contacts_bounded || outcome.joints_bounded);
    if !plain {
        return State::Moves;
    }
    let mut roughest: f64 = 0.0;
    let mut fastest: f64 = 0.0;
    for &i in solution.islands.blocks(island) {
        let (i, block) = (i as usize, &interval.blocks[i as usize]);
        let Source::Contact(index) = block.source else {
            return State::Moves;
        };
        let contact = &interval.detection.contacts[index];
        let rigid = matches!(contact.law, NormalLaw::Rigid { .. });
        if !rigid || contact.surface_velocity != 0.0 || block.impact {
            return State::Moves;
        }
        roughest = roughest.max(contact.friction);
        for (side, &body) in contact.rows.bodies.iter().enumerate() {
            if body == NO_BODY {
                continue;
            }
            let k = body as usize;
            let [n, t] = contact.rows.jacobian[side];
            let arm = n.z.hypot(t.z);
            let of = |u: &Vec3| u.xy().norm() + arm * u.z.abs();
            if interval.sides[i][side] != NO_BODY {
                let speed = of(&interval.start[k]) + of(&solution.end[k]);
                fastest = fastest.max(speed);
                if speed > SLOW * interval.length * of(&interval.accelerations[k]) {
                    return State::Moves;
                }
            } else if interval.start[k] != Vec3::zeros() {
                return State::Moves;
            }
            if step.in_cluster[k] {
                return State::Moves;
            }
        }
        let pair = contact.key.pair;
        let apart = |o: &Overlaps| o.open.contains(pair) || o.late.contains(pair);
        let pushed = outcome.crowd && overlaps(contact, contact.gap, step.inverse_mass);
        let moved = pushed || step.overlaps.is_some_and(apart);
        if moved || solution.deferred.contains(&index) {
            return State::Moves;
        }
    }
    let bound = residual.velocity + 4.0 * (1.0 + roughest) * fastest;
    match residual.velocity <= 0.1 * most && fastest <= room {
        true => State::Rests([residual.relative, bound]),
        false => State::Slow,
    }
}

/// Which of the islands, by `island_of` each body from 1, a contact that is no block of theirs or a
/// joint connects with something that moves or may be pushed.
pub(super) fn linked(step: &Solved, island_of: &[usize], islands: usize) -> Vec<bool> {
    let mut linked = vec![false; islands + 1];
    let (found, start) = (&step.interval.detection, &step.interval.start);
    let island = |body: u32| island_of.get(body as usize).copied().unwrap_or(0);
    let moves = |body: u32| {
        let k = body as usize;
        body != NO_BODY && (step.inverse_mass[k] != Vec3::zeros() || start[k] != Vec3::zeros())
    };
    for contact in &found.contacts {
        let [a, b] = contact.rows.bodies;
        for (own, other) in [(a, b), (b, a)] {
            linked[island(own)] |= moves(other) && island(own) != island(other);
        }
    }
    let joined = found.joints.iter().flat_map(|joint| joint.rows.bodies);
    joined.for_each(|body| linked[island(body)] = true);
    linked.split_off(1)
}
