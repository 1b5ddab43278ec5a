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

use crate::dynamics::events::touch_tolerance;
use crate::dynamics::interval::{Interval, Source};
use crate::dynamics::model::NormalLaw;
use crate::dynamics::solution::Solution;

/// Least time from the start of an interval to the end of a slide, and from there to its end, as a
/// share of the interval.
const ENDS: f64 = 1e-7;
/// Resolution of distances, as a share of the gap below which surfaces touch.
const RESOLVED: f64 = 1e-3;

/// A pair of surfaces whose slide ends within an interval.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slide {
    pub bodies: [u32; 2],
    pub surfaces: [u32; 2],
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
    pub fn early(&self, length: f64) -> Option<f64> {
        (self.most > 0.0).then(|| length * (1.0 - self.against / self.most))
    }

    /// A guess of the end. If forces drive the contact back, `φ` can be the length or more, and a
    /// contact that slides back has stopped long before its mean velocity vanishes.
    pub fn time(&self, length: f64) -> f64 {
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
