//! Moves overlapping pairs apart, without adding velocity.

use super::asked::Asked;
use super::contact_cache::Overlaps;
use super::crowd::overlaps as crowd_overlaps;
use super::displacements::displacements;
use super::ends::{Ends, is_exempt};
use super::interval::{Interval, movable};
use super::midpoint_gaps::{STRIDE, opening};
use super::model::{JointKind, NormalLaw};
use super::overlapping::{landed, limits, share, slop, turned};
use super::pair_set::PairSet;
use super::solution::Solution;
use super::solve::IslandSolver;
use crate::contact::{NO_BODY, Rows, Vec2, Vec3};

/// Relative residual at which the displacements of a step count as solved: a micrometre per metre
/// of displacement. A share of the overlap is left for the next step anyway.
const ENOUGH: f64 = 1e-6;

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
/// If (1) has no solution, or none within [`FARTHEST`](super::displacements::FARTHEST), for example for a body
/// wedged between walls, it is regularised: its rows get `R P_N` on the left, with a large `R` for rows that ask
/// for a displacement and a very small one for all others. The body then moves to where it overlaps the walls least.
///
/// Zero displacements may solve (1) to its tolerance, [`ENOUGH`] of the widest gap that takes part. A pair
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
    let share = share(interval.length);
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
    ask_joints(&mut asked, interval, solution, inverse_mass);
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

/// Adds the rows of the joints. A limit may move by its remaining gap; all others must not move.
fn ask_joints(asked: &mut Asked, interval: &Interval, solution: &Solution, inverse_mass: &[Vec3]) {
    for joint in &interval.detection.joints {
        let opening = interval.length * joint.rows.velocity(&solution.end).x;
        let gap = match joint.kind {
            JointKind::Limit { gap } => (gap + opening).max(0.0),
            _ => 0.0,
        };
        let bodies = movable(joint.rows.bodies, inverse_mass);
        asked.joint(joint, bodies, Vec2::new(gap, 0.0), inverse_mass);
    }
}

#[cfg(test)]
#[path = "recovery_tests.rs"]
mod tests;
