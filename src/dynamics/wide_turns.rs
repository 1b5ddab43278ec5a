//! Contacts on a path too curved for one interval.
//!
//! A midpoint step moves a contact that persists along its tangent. If the gap has the acceleration `c`
//! at constant velocities, it is off by about `c h²/8`. What an impact sets spinning may turn by half a
//! radian in a step. An interval at whose end such a contact overlaps by more than [`LARGE_OVERLAP`] of
//! the smaller body is therefore stepped in equal parts: the overlap falls with the square of their
//! number.

use super::interval::{Interval, Source};
use super::midpoint_gaps::least_size;
use super::model::NormalLaw;
use super::overlapping::LARGE_OVERLAP;
use super::recording::end_gap;
use super::solution::Solution;
use crate::contact::Vec3;

/// Most parts of an interval.
const PARTS: f64 = 8.0;

/// A contact that needs an interval to be cut.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    pub bodies: [u32; 2],
    /// Number of parts.
    pub parts: f64,
}

/// The contacts among the blocks that `used` selects that need the interval to be cut. Crowds are left
/// out for their cost, overlaps of the start because they are none of this path, and islands without a
/// solution, where bodies are pressed into each other.
pub(super) fn wide_turns(
    interval: &Interval,
    solution: &Solution,
    inverse_mass: &[Vec3],
    used: impl Fn(usize) -> bool,
) -> Vec<Turn> {
    let mut unsolved = vec![false; interval.blocks.len()];
    for (k, outcome) in solution.outcomes.iter().enumerate() {
        let blocks = solution.islands.blocks(k).iter();
        blocks.for_each(|&i| unsolved[i as usize] = !outcome.report.solved());
    }
    let crowded = |b: &u32| interval.crowded.get(*b as usize).is_some_and(|c| *c > 0);
    let mut found = Vec::new();
    for (i, block) in interval.blocks.iter().enumerate() {
        let Source::Contact(index) = block.source else {
            continue;
        };
        let contact = &interval.detection.contacts[index];
        if !block.continues
            || block.impact
            || !matches!(contact.law, NormalLaw::Rigid { .. })
            || interval.known_overlaps.contains(contact.key.pair)
            || contact.rows.bodies.iter().any(crowded)
            || unsolved[i]
            || !used(i)
        {
            continue;
        }
        // what overlapped before the path began stays out of it
        let before = contact.gap - 0.5 * interval.length * block.gamma_a.x;
        let grown = before.min(0.0) - end_gap(interval, solution, i, contact);
        let allowed = LARGE_OVERLAP * least_size(&contact.rows, inverse_mass);
        if grown > allowed {
            found.push(Turn {
                bodies: contact.rows.bodies,
                parts: (grown / allowed).sqrt().ceil().min(PARTS),
            });
        }
    }
    found
}
