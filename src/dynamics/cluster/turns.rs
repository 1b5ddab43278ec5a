//! Steps a cluster in parts, where its path is too curved for one interval.

use super::context::{Context, Rest};
use super::runner::Runner;
use crate::dynamics::interval::belongs;
use crate::dynamics::model::MultibodyModel;
use crate::dynamics::rules::{Rules, Span};
use crate::dynamics::settings::StepError;
use crate::dynamics::solve::IslandSolver;
use crate::dynamics::wide_turns::wide_turns;

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
    pub(super) fn part(
        &mut self,
        model: &mut dyn MultibodyModel,
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
