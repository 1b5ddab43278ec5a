//! Moves overlapping pairs apart, without adding velocity.

use super::asked::Asked;
use super::contact_cache::Overlaps;
use super::crowd::overlaps as crowd_overlaps;
use super::ends::{Ends, is_exempt};
use super::interval::{Interval, movable};
use super::island_problem::LARGE;
use super::islands::Islands;
use super::midpoint_gaps::{STRIDE, opening};
use super::model::{JointKind, NormalLaw};
use super::overlapping::{landed, limits, share, slop, turned};
use super::pair_set::PairSet;
use super::solution::Solution;
use super::solve::IslandSolver;
use crate::contact::{
    BodyOperator, ContactProblem, Delassus, Law, LocalBodies, NO_BODY, Rows, Vec2, Vec3,
};

/// Relative residual at which the displacements of a step count as solved: a micrometre per metre
/// of displacement. A share of the overlap is left for the next step anyway.
const ENOUGH: f64 = 1e-6;

/// Largest displacement of a body, as a multiple of the sum of what an island has to correct: in a row of bodies
/// the last one may have to make room for all overlaps. Between walls that are off parallel by less than half a
/// degree (1) has solutions that are farther away: a box that a piston presses into a wall would go up by a
/// tenth of its size in each step, as its sides are off by 1e-4 rad.
const FARTHEST: f64 = 100.0;

/// Compliance of the rows of (1) in [`part_overlaps`] if (1) has no solution, or none is found, as a
/// share of their own inverse mass. The first is for rows that ask for a displacement, which may get
/// only a part of it. The second is for all other rows, which must hardly be violated.
const ASKED_COMPLIANCE: f64 = 1.0;
const OTHER_COMPLIANCE: f64 = 1e-4;

/// Displacements that move overlapped pairs apart after the step of `interval`. Pairs without
/// overlap are then removed from `overlaps`.
///
/// The excess of such a contact is `x = −(g + Δt γ_E)`, the overlap at the end of the step. If it
/// is above a slop, the displacements `d` of minimum kinetic norm satisfy
///
/// ```text
/// J d ≥ s (x − slop)     of these contacts
/// J d ≥ −max(g + Δt γ_E, 0)   of all others        J d = 0   of joints        (1)
/// ```
///
/// This is a contact problem without friction. Velocities and kinetic energy do not change. See
/// [`share`] for `s`; of a late pair it is 1 for a contact that [`landed`] in this step. Contacts of [`Ends`] take the
/// place of those of the step, with `s = 1` for late pairs, and their gap for `g + Δt γ_E`.
///
/// Wedged bodies can move only along their surfaces, and (1) may then need displacements of many
/// times the overlap. All displacements of an island are therefore scaled down by the same factor,
/// so that no body moves farther than a tenth of its size.
///
/// If (1) has no solution, or none within [`FARTHEST`], for example for a body wedged between walls, it is
/// regularised: its rows get `R P_N` on the left, with a large `R` for rows that ask for a displacement and
/// a very small one for all others. The body then moves to where it overlaps the walls least.
///
/// Zero displacements may solve (1) to its tolerance, [`ENOUGH`] of the widest gap of the island. A pair
/// with an excess of at most a slop that they leave where it is needs no further step either: until it
/// overlaps by the trigger of [`limits`] again.
pub(super) fn part_overlaps(
    overlaps: &mut Overlaps,
    interval: &Interval,
    solution: &Solution,
    ends: &Ends,
    inverse_mass: &[Vec3],
    (exempt, crowd): (&[bool], &[bool]),
    solver: &mut IslandSolver,
) -> Vec<(u32, Vec3)> {
    let mut wedged = solver.cache.wedged && !overlaps.is_empty();
    solver.cache.wedged = wedged;
    if overlaps.is_empty() {
        return Vec::new();
    }
    let (dt, share) = (interval.length, share(interval.length));
    let mut asked = Asked::default();
    let (mut open, mut late) = (PairSet::default(), PairSet::default());
    let (mut needed, mut little) = (PairSet::default(), Vec::new());
    let main = interval.detection.contacts.iter().enumerate();
    let main = main.filter(|(_, contact)| !is_exempt(contact, &ends.turned));
    let main = main.map(|(index, contact)| (Some(index), contact, false));
    let own = ends.contacts.iter().map(|(index, c)| (*index, c, true));
    for (index, contact, at_end) in main.chain(own) {
        let movable = movable(contact.rows.bodies, inverse_mass);
        let bodies = (interval.roles).receiving(contact.rows.bodies, movable);
        if !matches!(contact.law, NormalLaw::Rigid { .. }) || bodies == [NO_BODY; 2] {
            continue;
        }
        let pair = contact.key.pair;
        let left = || match at_end {
            true => contact.gap,
            false => contact.gap + opening(contact, interval, solution, ends.path),
        };
        // `part_crowd` moves it, for as long as the crowd lasts
        if is_exempt(contact, crowd) {
            if overlaps.open.contains(pair) && crowd_overlaps(contact, left(), inverse_mass) {
                open.insert(pair);
                needed.insert(pair);
            }
            continue;
        }
        let first = overlaps.open.contains(pair);
        let left = match index.filter(|_| !first && !at_end) {
            Some(index) => left() + turned((index, contact), interval, solution, ends.path),
            None => left(),
        };
        let is_late = !first && overlaps.late.contains(pair);
        let slop = match is_late {
            true => limits((index, contact, at_end), interval, solution, inverse_mass)[1],
            false => slop(contact, interval),
        };
        let x = -left - slop;
        let waits = is_late && is_exempt(contact, exempt);
        if waits {
            late.insert(pair);
            needed.insert(pair);
        }
        // correcting a share per step never reaches zero: stop at a tenth of the slop
        let moves = x > 0.1 * slop && (first || is_late) && !waits;
        if moves {
            if first { &mut open } else { &mut late }.insert(pair);
            if x > slop {
                needed.insert(pair);
            } else {
                little.push((pair, bodies));
            }
        }
        let at_once = |index| landed((index, contact), interval);
        let gap = match moves {
            true if is_late && (at_end || index.is_some_and(at_once)) => -x,
            true => -share * x,
            false => left.max(0.0),
        };
        let rows = Rows {
            bodies,
            ..contact.rows
        };
        asked.contact(rows, gap, 0.0);
    }
    (overlaps.open, overlaps.late) = (open, late);
    if overlaps.is_empty() {
        return Vec::new();
    }
    for joint in &interval.detection.joints {
        // a limit may move by its remaining gap; all other joint rows must not move
        let gap = match joint.kind {
            JointKind::Limit { gap } => (gap + dt * joint.rows.velocity(&solution.end).x).max(0.0),
            _ => 0.0,
        };
        let bodies = movable(joint.rows.bodies, inverse_mass);
        asked.joint(joint, bodies, Vec2::new(gap, 0.0), inverse_mass);
    }
    let tolerance = solver.tolerance.max(ENOUGH);
    let way = (STRIDE, &mut wedged);
    let moves = displacements(&asked, inverse_mass, solver, tolerance, way);
    solver.cache.wedged = wedged;
    let moved = |body: &u32| moves.iter().any(|(other, _)| body == other);
    for (pair, _) in (little.iter()).filter(|(_, bodies)| bodies.iter().any(moved)) {
        needed.insert(*pair);
    }
    overlaps.open.retain(|pair| needed.contains(pair));
    overlaps.late.retain(|pair| needed.contains(pair));
    moves
}

/// Solves (1) of [`part_overlaps`] to `tolerance` on every island with overlaps. See [`within`] for
/// `stride`. If `wedged` is set, the problems of large islands are regularised at once.
pub(super) fn displacements(
    Asked { rows, free, laws }: &Asked,
    inverse_mass: &[Vec3],
    solver: &mut IslandSolver,
    tolerance: f64,
    (stride, wedged): (f64, &mut bool),
) -> Vec<(u32, Vec3)> {
    let mut moved = vec![Vec3::zeros(); inverse_mass.len()];
    let mut islands = Islands::default();
    islands.build(inverse_mass.len(), rows.iter().map(|r| r.bodies));
    let mut local = LocalBodies::default();
    for k in 0..islands.len() {
        let members = islands.blocks(k);
        let moves = |i: &&u32| match laws[**i as usize] {
            Law::Contact { .. } => free[**i as usize].x < 0.0,
            _ => free[**i as usize] != Vec2::zeros(),
        };
        if !members.iter().any(|i| moves(&i)) {
            continue;
        }
        let of = |i: &u32| *i as usize;
        let mut op = BodyOperator::default();
        local.operator(members, |i| rows[i], inverse_mass, &mut op);
        let mut problem = ContactProblem {
            operator: Delassus::Bodies(op),
            free: members.iter().map(|i| free[of(i)]).collect(),
            laws: members.iter().map(|i| laws[of(i)]).collect(),
        };
        let mut push = vec![Vec2::zeros(); members.len()];
        let own = solver.worker.solver.as_mut();
        let large = members.len() > LARGE;
        let mut solved = !(large && *wedged) && own.solve(&problem, &mut push, tolerance).solved();
        let pushed: Vec<bool> = (problem.free.iter().zip(&problem.laws))
            .map(|(b, law)| matches!(law, Law::Contact { .. }) && b.x < 0.0)
            .collect();
        let asked: f64 = members
            .iter()
            .filter(moves)
            .map(|i| free[of(i)].norm())
            .sum();
        let mut d = displaced(&problem, &push);
        let far = farthest(&d) > FARTHEST * asked;
        // contradictory walls have no solution, or none near by
        if (!solved || far) && pushed.contains(&true) {
            *wedged |= large;
            regularise(&mut problem, |i| {
                if pushed[i] {
                    ASKED_COMPLIANCE
                } else {
                    OTHER_COMPLIANCE
                }
            });
            push.fill(Vec2::zeros());
            solved = own.solve(&problem, &mut push, tolerance).solved();
            d = displaced(&problem, &push);
        }
        if solved && let Delassus::Bodies(op) = &problem.operator {
            let share = within(stride, &op.rows, &d);
            for (body, d) in local.bodies.iter().zip(&d) {
                moved[*body as usize] = d * share;
            }
        }
    }
    let some = |(_, d): &(u32, Vec3)| *d != Vec3::zeros();
    (0..).zip(moved).filter(some).collect()
}

/// Displacements of the bodies of a problem by its impulses.
fn displaced(problem: &ContactProblem, push: &[Vec2]) -> Vec<Vec3> {
    let Delassus::Bodies(op) = &problem.operator else {
        return Vec::new();
    };
    let mut d = vec![Vec3::zeros(); op.inverse_mass.len()];
    for (rows, p) in op.rows.iter().zip(push) {
        rows.push(*p, &op.inverse_mass, &mut d);
    }
    d
}

/// The largest distance that a body goes \[m\].
fn farthest(displacements: &[Vec3]) -> f64 {
    let ways = displacements.iter().map(|d| d.xy().norm());
    ways.fold(0.0, f64::max)
}

/// Gives the rigid contacts of a problem `ξ_N + R P_N` in place of `ξ_N`, with
/// `R = compliance_of(i) · G_NN`. Every problem then has a solution, and it is bounded.
fn regularise(problem: &mut ContactProblem, compliance_of: impl Fn(usize) -> f64) {
    for i in 0..problem.len() {
        let block = problem.operator.diagonal(i);
        if let Law::Contact { compliance, .. } = &mut problem.laws[i]
            && *compliance == 0.0
        {
            *compliance = compliance_of(i) * block[(0, 0)];
        }
    }
}

/// Largest factor, up to 1, of an island's displacements `moved` with which no body moves farther
/// than `stride` times its size: the distance of its farthest contact from its centre.
fn within(stride: f64, rows: &[Rows], moved: &[Vec3]) -> f64 {
    let mut size = vec![0.0f64; moved.len()];
    for Rows { bodies, jacobian } in rows {
        for (body, [n, t]) in bodies.iter().zip(jacobian) {
            if let Some(size) = size.get_mut(*body as usize) {
                *size = size.max(n.z.hypot(t.z));
            }
        }
    }
    let share = |(size, d): (&f64, &Vec3)| {
        let way = d.xy().norm() + d.z.abs() * size;
        // a body without a lever, such as a coordinate, has no size
        if size * way > 0.0 {
            stride * size / way
        } else {
            1.0
        }
    };
    size.iter().zip(moved).map(share).fold(1.0, f64::min)
}

#[cfg(test)]
#[path = "recovery_tests.rs"]
mod tests;
