//! Crowds: large islands in motion, of whose contact problem the solver left much.
//!
//! A crowd is answered by a fixed number of sweeps ([`Crowd`](crate::solver::Crowd)), from step to step.
//! Its impulses obey the rigid law up to a closing velocity that the record states. Four things differ
//! from other islands:
//!
//! - Gaps within a dead band, [`BAND`], count as 0, and no contact is pushed out. Then a solution exists:
//!   pushes contradict each other in a heap that is wedged together, and gaps of micrometres that must
//!   close within the step decide nothing and make the problem degenerate. In heaps of 400 boxes and
//!   330 hexagons this raised the problems that [`Direct`](crate::solver::Direct) solves from 14 and
//!   16 to 66 and 92 of a hundred.
//! - Overlaps are moved apart by sweeps as well: see [`part_crowd`].
//! - Contacts that give energy are scaled down: see [`super::scaled::bound_swept`].
//! - [`Effort`](super::rules::Effort) decides whether an exact solve is tried.
//!
//! A heap that slows down comes to rest under the sweeps alone. Then it is certified like any other.

use super::asked::Asked;
use super::interval::{Interval, Source, movable};
use super::island_problem::IslandProblem;
use super::midpoint_gaps::{least_size, least_size_squared, opening};
use super::model::{ContactPoint, NormalLaw};
use super::pair_set::PairSet;
use super::solution::Solution;
use crate::contact::{
    BodyOperator, ContactProblem, Delassus, LocalBodies, NO_BODY, Rows, Vec2, Vec3,
};
use crate::solver::Crowd;

/// Gap up to which a contact of a crowd touches, as a share of the size of the smaller body. It trades
/// the place of a body for a problem that sweeps solve: half of it, and heaps still creep.
const BAND: f64 = 1e-3;

/// Overlap of a crowd down to which it is moved apart, as a share of the size: half the band, so that
/// what is moved apart stays in contact. A share at a time never gets there, so that it begins at
/// [`TRIGGER`] times that.
const SLOP: f64 = 0.5 * BAND;
const TRIGGER: f64 = 1.1;

/// Share of an overlap that a step corrects, and the most, as a share of the size. A smaller share leaves
/// deeper overlaps in motion; all of it would overshoot where the sweeps of one pair undo those of
/// another.
const SHARE: f64 = 0.8;
const STRIDE: f64 = 0.1;

/// Sweeps for the displacements of a step. What they leave waits for the next step.
const SWEEPS: usize = 30;

/// Drops pushes, and closing velocities of gaps within the dead band, from the problem of a crowd.
pub(super) fn simplify(
    island: &mut IslandProblem,
    members: &[u32],
    interval: &Interval,
    inverse_mass: &[Vec3],
) {
    island.count_added();
    island.drop_pushes();
    for (k, &i) in members.iter().enumerate() {
        let (Source::Contact(index), true) =
            (interval.blocks[i as usize].source, island.terms[k].rigid)
        else {
            continue;
        };
        let contact = &interval.detection.contacts[index];
        if island.terms[k].impact {
            continue;
        }
        // a point has no size, and no band
        let within =
            |square: f64| square.is_finite() && contact.gap * contact.gap <= BAND * BAND * square;
        if contact.gap <= 0.0 || within(least_size_squared(&contact.rows, inverse_mass)) {
            let closing = island.added[k].x;
            island.problem.free[k].x -= closing;
            island.added[k].x = 0.0;
        }
    }
}

/// The bodies of crowds; empty if there are none.
pub(super) fn crowd_bodies(bodies: usize, interval: &Interval, solution: &Solution) -> Vec<bool> {
    let mut crowd = Vec::new();
    for (k, outcome) in solution.outcomes.iter().enumerate() {
        if outcome.crowd {
            crowd.resize(bodies, false);
            let sides = |i: &u32| interval.sides[*i as usize];
            for body in solution.islands.blocks(k).iter().flat_map(sides) {
                if let Some(own) = crowd.get_mut(body as usize) {
                    *own = true;
                }
            }
        }
    }
    crowd
}

/// Whether a contact of a crowd is to be moved apart; `gap` may be that of another time.
pub(super) fn overlaps(contact: &ContactPoint, gap: f64, inverse_mass: &[Vec3]) -> bool {
    // most contacts are open, and need no size
    gap < 0.0 && is_deep(gap, least_size(&contact.rows, inverse_mass))
}

fn is_deep(gap: f64, size: f64) -> bool {
    -gap > TRIGGER * SLOP * size
}

/// Displacements that move the bodies of a crowd apart after the step of `interval`.
///
/// With `g` the gap at the next midpoint and `s` the size of the smaller body, they satisfy
///
/// ```text
/// J d ≥ min(SHARE (−g − SLOP s), STRIDE s)    of contacts with −g > 1.1 SLOP s
/// J d ≥ −max(g, 0)    of all others           J d = 0    of joints               (1)
/// ```
///
/// Rows of pairs that overlap since the `start` get `R P_N` on the left, with `R` their own inverse
/// mass: a body built into others waits until these have made room, and is not pushed through them.
///
/// as far as [`SWEEPS`] sweeps of Gauss-Seidel from zero find them. Bodies outside the crowd do not move.
/// Velocities and kinetic energy do not change.
pub(super) fn part_crowd(
    crowd: &[bool],
    start: &PairSet,
    interval: &Interval,
    solution: &Solution,
    path: Option<&[Vec3]>,
    inverse_mass: &[Vec3],
    solver: &mut Crowd,
) -> Vec<(u32, Vec3)> {
    let own = |bodies: [u32; 2]| {
        let inside = |body: u32| crowd.get(body as usize).is_some_and(|c| *c);
        movable(bodies, inverse_mass).map(|body| if inside(body) { body } else { NO_BODY })
    };
    let mut displaced = Asked::default();
    let mut any = false;
    for contact in &interval.detection.contacts {
        let bodies = interval
            .roles
            .receiving(contact.rows.bodies, own(contact.rows.bodies));
        if !matches!(contact.law, NormalLaw::Rigid { .. }) || bodies == [NO_BODY; 2] {
            continue;
        }
        let gap = contact.gap + opening(contact, interval, solution, path);
        let square = least_size_squared(&contact.rows, inverse_mass);
        if gap > 0.0 && gap * gap > STRIDE * STRIDE * square {
            continue;
        }
        let size = square.sqrt();
        let overlaps = is_deep(gap, size);
        any |= overlaps;
        let asked = match overlaps {
            true => -(SHARE * (-gap - SLOP * size)).min(STRIDE * size),
            false => gap.max(0.0),
        };
        let rows = Rows {
            bodies,
            ..contact.rows
        };
        let compliance = match overlaps && start.contains(contact.key.pair) {
            true => rows.diagonal(inverse_mass)[(0, 0)],
            false => 0.0,
        };
        displaced.contact(rows, asked, compliance);
    }
    if !any {
        return Vec::new();
    }
    for joint in &interval.detection.joints {
        let bodies = own(joint.rows.bodies);
        displaced.joint(joint, bodies, Vec2::zeros(), inverse_mass);
    }
    let Asked { rows, free, laws } = displaced;
    let members: Vec<u32> = (0..rows.len() as u32).collect();
    let (mut local, mut op) = (LocalBodies::default(), BodyOperator::default());
    local.operator(&members, |i| rows[i], inverse_mass, &mut op);
    let problem = ContactProblem {
        operator: Delassus::Bodies(op),
        free,
        laws,
    };
    let impulses = solver.displace(&problem, SWEEPS);
    let Delassus::Bodies(op) = &problem.operator else {
        return Vec::new();
    };
    let mut moved = vec![Vec3::zeros(); op.inverse_mass.len()];
    let pushed = op
        .rows
        .iter()
        .zip(&impulses)
        .filter(|(_, p)| p.x != 0.0 || p.y != 0.0);
    for (rows, p) in pushed {
        rows.push(*p, &op.inverse_mass, &mut moved);
    }
    let all = local.bodies.iter().copied().zip(moved);
    all.filter(|(_, d)| *d != Vec3::zeros()).collect()
}

#[cfg(test)]
#[path = "crowd_tests.rs"]
pub(super) mod tests;
