//! Steps a cluster to the end of a slide.

use super::context::{Context, Rest};
use super::runner::Runner;
use super::slides::{Slide, ended_slides};
use crate::dynamics::interval::belongs;
use crate::dynamics::model::MultibodyModel;
use crate::dynamics::rules::{Rules, Span};
use crate::dynamics::settings::StepError;
use crate::dynamics::solve::IslandSolver;

/// Most lengths that are tried for one slide: two are enough under constant forces.
const LENGTHS: usize = 8;

impl Runner {
    /// The slide of the interval solved last, or of the trial if that is `known`, that ends first,
    /// and its time.
    pub(super) fn first_stop(&self, context: &Context, known: bool) -> Option<(Slide, f64)> {
        let (interval, solution) = match known {
            true => (context.main, context.trial),
            false => (&self.interval, &self.solution),
        };
        let members = Some(self.members.as_slice());
        let used = |i: usize| belongs(interval.sides[i], members, context.inverse_mass);
        let slides = ended_slides(interval, solution, context.dt, used);
        let time = |s: Slide| (s, s.time(interval.length));
        let all = slides.into_iter().map(time);
        all.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Steps the bodies from `here` to the end of a slide, first to the time of its `guess`; leaves them at
    /// the midpoint of that interval.
    #[allow(clippy::too_many_arguments)] // the state of one search
    pub(super) fn stop(
        &mut self,
        model: &mut dyn MultibodyModel,
        solver: &mut IslandSolver,
        context: &Context,
        rules: &Rules,
        (slide, guess): (Slide, f64),
        rest: Rest,
    ) -> Result<(), StepError> {
        let mut time = guess;
        let mut last = slide.early(rest.length).map(|early| (rest.length, early));
        for _ in 0..LENGTHS {
            self.restore(model);
            let span = Span {
                step: context.dt,
                length: time,
                horizon: 0.5 * rest.length,
                strikes: false,
            };
            self.advance(model, solver, context, rules, span, rest.at)?;
            let found = ended_slides(&self.interval, &self.solution, context.dt, |_| true);
            let same = |s: &&Slide| s.surfaces == slide.surfaces;
            let Some(found) = found.iter().find(same) else {
                break;
            };
            let now = found.early(time).map(|early| (time, early));
            let secant = now.zip(last).map(|(now, last)| {
                let slope = (last.1 - now.1) / (last.0 - now.0);
                now.0 - now.1 / slope
            });
            last = now;
            let between = secant.filter(|t| *t > 0.0 && *t < time);
            time = between.unwrap_or_else(|| found.time(time));
        }
        Ok(())
    }
}
