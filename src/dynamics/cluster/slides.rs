//! Slides that end within a step.
//!
//! A contact that slides at the start of a step and sticks at its end has stopped at a time `t` in
//! between. The step as a whole gives the right velocity, since friction acts with its mean, but the
//! distance of a uniform deceleration: too long by `|γ_A| (h − t)/2`. Its cluster is therefore
//! stepped to `t` and then on, as with an impact, but without one.
//!
//! Under constant forces the friction that stops the contact within `t` has the share
//! `r(t) = |P_T| / (μ P_N)` of the greatest possible one, and `φ(t) = t (1 − r)` is linear in `t`.
//! The slide ends at its zero, which the secant through two lengths finds exactly.

use super::runner::{Context, Rest, Runner};
use crate::dynamics::events::touch_tolerance;
use crate::dynamics::interval::{Interval, Source, belongs};
use crate::dynamics::model::{MultibodyModel, NormalLaw};
use crate::dynamics::rules::{Rules, Span};
use crate::dynamics::settings::StepError;
use crate::dynamics::solution::Solution;
use crate::dynamics::solve::IslandSolver;

/// Most lengths that are tried for one slide: two are enough under constant forces.
const LENGTHS: usize = 8;
/// Least time from the start of an interval to the end of a slide, and from there to its end, as a
/// share of the interval.
const ENDS: f64 = 1e-7;
/// Resolution of distances, as a share of the gap below which surfaces touch.
const RESOLVED: f64 = 1e-3;

/// A pair of surfaces whose slide ends within an interval.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slide {
    pub bodies: [u32; 2],
    surfaces: [u32; 2],
    /// Velocity at the start \[m/s\], of the contact that slides fastest.
    velocity: f64,
    /// Sums over the contacts that stick at the end: friction against the slide, and the greatest
    /// possible one [N s].
    against: f64,
    most: f64,
    /// The time \[s\] at which the velocity vanishes, if a contact slides back at the end.
    turns: f64,
    /// Distance \[m\] that is not resolved.
    noise: f64,
}

impl Slide {
    /// `φ` of an interval of this length, at the end of which the contact sticks.
    fn early(&self, length: f64) -> Option<f64> {
        (self.most > 0.0).then(|| length * (1.0 - self.against / self.most))
    }

    /// A guess of the end. If forces drive the contact back, `φ` can be the length or more, and a
    /// contact that slides back has stopped long before its mean velocity vanishes.
    fn time(&self, length: f64) -> f64 {
        match self.early(length) {
            Some(early) if early < 0.99 * length => length - early,
            Some(_) => 0.5 * length,
            None => 0.5 * self.turns,
        }
    }
}

/// The slides of an interval that end in it, among the blocks that `used` selects. Crowds are left
/// out: too many of their contacts come to rest in a step.
pub(super) fn ended_slides(
    interval: &Interval,
    solution: &Solution,
    step: f64,
    used: impl Fn(usize) -> bool,
) -> Vec<Slide> {
    let crowded = |b: &u32| interval.crowded.get(*b as usize).is_some_and(|c| *c > 0);
    let mut found: Vec<Slide> = Vec::new();
    for (i, block) in interval.blocks.iter().enumerate() {
        let Source::Contact(index) = block.source else {
            continue;
        };
        let (contact, p) = (&interval.detection.contacts[index], solution.impulses[i]);
        let slides = block.continues && !block.stuck_before && !block.impact;
        if !slides
            || !matches!(contact.law, NormalLaw::Rigid { .. })
            || contact.friction * p.x <= 0.0
            || contact.rows.bodies.iter().any(crowded)
            || !used(i)
        {
            continue;
        }
        let (start, length) = (block.gamma_a.y, interval.length);
        let end = contact.rows.velocity(&solution.end).y + contact.surface_velocity;
        let sticks = end.abs() <= solution.resolution[i];
        if !sticks && start * end >= 0.0 {
            continue;
        }
        let touch = touch_tolerance(contact, interval, step);
        let own = Slide {
            bodies: contact.rows.bodies,
            surfaces: contact.surfaces,
            velocity: start,
            against: if sticks { -start.signum() * p.y } else { 0.0 },
            most: if sticks { contact.friction * p.x } else { 0.0 },
            turns: length * start / (start - end),
            noise: (2.0 * contact.gap_noise).max(RESOLVED * touch),
        };
        // contacts of a pair follow each other
        match found.last_mut().filter(|s| s.surfaces == own.surfaces) {
            Some(pair) => {
                pair.against += own.against;
                pair.most += own.most;
                pair.turns = pair.turns.min(own.turns);
                if own.velocity.abs() > pair.velocity.abs() {
                    pair.velocity = own.velocity;
                }
            }
            None => found.push(own),
        }
    }
    let length = interval.length;
    let matters = |s: &Slide| {
        let (time, left) = (s.time(length), length - s.time(length));
        time.min(left) > ENDS * length && 0.5 * s.velocity.abs() * left > s.noise
    };
    found.retain(matters);
    found
}

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

    /// Steps the bodies from `here` to the end of a slide, first to the `time` of its guess. Returns
    /// the length of that interval.
    #[allow(clippy::too_many_arguments)] // the state of one search
    pub(super) fn stop<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        solver: &mut IslandSolver,
        context: &Context,
        rules: &Rules,
        (slide, guess): (Slide, f64),
        rest: Rest,
    ) -> Result<f64, StepError> {
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
        self.finish_interval(model);
        Ok(self.interval.length)
    }
}
