//! Contacts on a path too curved for one interval.
//!
//! A midpoint step moves a contact that persists along its tangent. If the gap has the acceleration `c`
//! at constant velocities, it is off by about `c h²/8`. What an impact sets spinning may turn by half a
//! radian in a step. An interval at whose end such a contact overlaps by more than [`LARGE_OVERLAP`] of
//! the smaller body is therefore stepped in equal parts: the overlap falls with the square of their
//! number.

use super::context::{Context, Rest};
use super::runner::Runner;
use crate::contact::Vec3;
use crate::dynamics::interval::{Interval, Source, belongs};
use crate::dynamics::midpoint_gaps::least_size;
use crate::dynamics::model::{MultibodyModel, NormalLaw};
use crate::dynamics::recording::end_gap;
use crate::dynamics::recovery::LARGE_OVERLAP;
use crate::dynamics::rules::{Rules, Span};
use crate::dynamics::settings::StepError;
use crate::dynamics::solution::Solution;
use crate::dynamics::solve::IslandSolver;

/// Most parts of an interval.
const PARTS: f64 = 8.0;

/// A contact that needs an interval to be cut.
#[derive(Debug, Clone, Copy)]
pub(in crate::dynamics) struct Turn {
    pub bodies: [u32; 2],
    /// Number of parts.
    pub parts: f64,
}

/// The contacts among the blocks that `used` selects that need the interval to be cut. Crowds are left
/// out for their cost, overlaps of the start because they are none of this path, and intervals without a
/// solution, where bodies are pressed into each other.
pub(in crate::dynamics) fn wide_turns(
    interval: &Interval,
    solution: &Solution,
    inverse_mass: &[Vec3],
    used: impl Fn(usize) -> bool,
) -> Vec<Turn> {
    if !solution.outcomes.iter().all(|o| o.report.solved()) {
        return Vec::new();
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
            || interval.known_overlaps.contains(&contact.key.pair)
            || contact.rows.bodies.iter().any(crowded)
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

impl Runner {
    /// Length of the first of the equal parts in which the interval solved last, or the trial if that is
    /// `known`, is to be stepped; infinite if it can stay whole.
    pub(super) fn first_part(&self, context: &Context, known: bool, rest: Rest) -> f64 {
        let (interval, solution) = match known {
            true => (context.main, context.trial),
            false => (&self.interval, &self.solution),
        };
        let (w, members) = (context.inverse_mass, Some(self.members.as_slice()));
        let turns = wide_turns(interval, solution, w, |i| {
            belongs(interval.sides[i], members, w)
        });
        let parts = turns.iter().map(|t| t.parts).fold(1.0, f64::max);
        if parts > 1.0 {
            rest.length / parts
        } else {
            f64::INFINITY
        }
    }

    /// Steps the bodies from `here` by a part of the rest; leaves them at its midpoint.
    pub(super) fn part<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        solver: &mut IslandSolver,
        context: &Context,
        rules: &Rules,
        time: f64,
        rest: Rest,
    ) -> Result<(), StepError> {
        self.restore(model);
        let span = Span {
            step: context.dt,
            length: time,
            horizon: time,
            strikes: false,
        };
        self.advance(model, solver, context, rules, span, rest.at)
    }
}
