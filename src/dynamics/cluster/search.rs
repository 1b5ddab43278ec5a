//! Finds when and where the next pair of a cluster closes.

use super::runner::{Context, Rest, Runner, start_of};
use crate::contact::NO_BODY;
use crate::dynamics::events::{crossing, touch_tolerance};
use crate::dynamics::model::{ContactKey, ContactPoint, MultibodyModel};
use crate::dynamics::rules::{Rules, Span};
use crate::dynamics::settings::StepError;
use crate::dynamics::solve::IslandSolver;

/// Most steps of the search for an instant: Newton needs three, bisection of a step 40 to reach
/// round-off.
const SEARCHES: usize = 60;

/// Most lengths of the interval up to an instant that are tried.
const LENGTHS: usize = 8;

/// Share of a step at its end in which no event is located; such a contact closes at the start of
/// the next step instead. An interval of zero length has no rates.
const LAST: f64 = 1e-9;

/// Gap and velocity of a pair at an instant.
struct Nearest {
    /// Smallest gap \[m\] and the velocity at which it closes \[m/s\].
    gap: f64,
    closing: f64,
    /// Gaps that count as zero, and the gap below which surfaces touch \[m\].
    resolution: f64,
    touch: f64,
}

impl Runner {
    /// The first pair of deferred contacts to close on the path of the interval: one of its
    /// contacts, and the time until then.
    pub(super) fn next<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        context: &Context,
    ) -> Result<Option<(ContactPoint, f64)>, StepError> {
        let mut guesses: Vec<(ContactPoint, f64)> = Vec::new();
        for &i in &self.solution.deferred {
            let contact = self.interval.detection.contacts[i];
            let guess = crossing(&self.interval, &self.solution, &contact, context.dt)
                .unwrap_or(self.interval.length);
            match guesses
                .iter_mut()
                .find(|(c, _)| c.surfaces == contact.surfaces)
            {
                Some((_, earlier)) => *earlier = earlier.min(guess),
                None => guesses.push((contact, guess)),
            }
        }
        let mut first: Option<(ContactPoint, f64)> = None;
        for (contact, guess) in guesses {
            if let Some(time) = self.locate(model, context, &contact, guess)?
                && time < self.interval.length - LAST * context.dt
                && first.is_none_or(|(_, earliest)| time < earliest)
            {
                first = Some((contact, time));
            }
        }
        Ok(first)
    }

    /// The time at which the pair of `contact` closes on the path of the interval. Starts from
    /// `first` and uses Newton's method within a bracket, on detected gaps.
    ///
    /// The parabola that gives `first` assumes a straight normal. Only detection sees curved or
    /// rotating surfaces, and normals that flip in an overlap.
    fn locate<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        context: &Context,
        contact: &ContactPoint,
        first: f64,
    ) -> Result<Option<f64>, StepError> {
        let end = self.interval.length;
        let (mut open, mut closed) = (0.0, None);
        let mut time = first;
        for _ in 0..SEARCHES {
            let found = self.nearest(model, context, contact, time)?;
            let mut better = f64::NAN;
            match found {
                // a touching pair closes at the start, though its gap may still be slightly open
                Some(near) if time == 0.0 && near.gap <= near.touch => return Ok(Some(time)),
                Some(near) => {
                    if near.gap.abs() <= near.resolution {
                        return Ok((near.closing > 0.0).then_some(time));
                    }
                    if near.gap > 0.0 {
                        open = time;
                    } else {
                        closed = Some(time);
                    }
                    better = time + near.gap / near.closing;
                }
                None => open = time,
            }
            let limit = match closed {
                None if time == end => return Ok(None),
                None => end,
                Some(closed) => closed,
            };
            time = if better > open && better < limit {
                better
            } else if closed.is_none() {
                end
            } else {
                0.5 * (open + limit)
            };
        }
        Ok(Some(time))
    }

    /// The smallest gap of a pair at `time` on the path of the interval; `None` if none of its
    /// contacts is near.
    fn nearest<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        context: &Context,
        contact: &ContactPoint,
        time: f64,
    ) -> Result<Option<Nearest>, StepError> {
        let (interval, solution, share) =
            (&self.interval, &self.solution, time / self.interval.length);
        let at = |b: u32, share: f64| {
            let (a, e) = (interval.start[b as usize], solution.end[b as usize]);
            a + share * (e - a)
        };
        for b in contact.rows.bodies {
            if let Some(place) = start_of(&self.place, &self.here, b) {
                model.set_configuration(b as usize, &place);
                model.shift(b as usize, &at(b, 0.5 * share), time);
            }
        }
        let found = &mut self.instant.detection;
        found.clear();
        model.detect_pairs(&[contact.surfaces], context.dt, found)?;
        // a resting corner is as near as possible, and closes by round-off
        let open = |c: &&ContactPoint| !self.closed.contains(&c.key);
        let all = self.instant.detection.contacts.iter().filter(open);
        let nearest = all.min_by(|a, b| a.gap.total_cmp(&b.gap));
        Ok(nearest.map(|c| {
            let mut closing = 0.0;
            for (side, &b) in c.rows.bodies.iter().enumerate() {
                if b != NO_BODY {
                    closing -= c.rows.jacobian[side][0].dot(&at(b, share));
                }
            }
            let touch = touch_tolerance(c, interval, context.dt);
            Nearest {
                gap: c.gap,
                closing,
                resolution: (2.0 * c.gap_noise).max(1e-5 * touch),
                touch,
            }
        }))
    }

    /// Moves to the instant at which `contact` closes and detects the contacts there. Returns the
    /// contact that closes, and the time from the start of the rest.
    ///
    /// `time` is that on the path of the whole rest. The shorter interval up to it has another
    /// path, unless the bodies fly: Newton's method corrects the time until the surfaces touch.
    #[allow(clippy::too_many_arguments)] // the state of one search
    pub(super) fn seek<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        solver: &mut IslandSolver,
        context: &Context,
        rules: &Rules,
        contact: &ContactPoint,
        time: f64,
        rest: Rest,
    ) -> Result<Option<(ContactKey, f64)>, StepError> {
        if time == 0.0 || self.idle() {
            self.restore(model);
            if time > 0.0 {
                self.fly(model, time);
                self.instant.start.clone_from(&self.solution.end);
            } else {
                self.instant.start.clone_from(&self.interval.start);
            }
            let found = self.closing(model, context, contact)?;
            return Ok(found.map(|near| (near.key, time)));
        }
        let (mut time, mut before, mut tried) = (time, None, 0);
        loop {
            tried += 1;
            self.restore(model);
            let span = Span {
                step: context.dt,
                length: time,
                horizon: 0.5 * rest.length,
                strikes: true,
            };
            self.advance(model, solver, context, rules, span, rest.at)?;
            self.finish_interval(model);
            self.instant.start.clone_from(&self.solution.end);
            let Some(near) = self.closing(model, context, contact)? else {
                // the time before was as near as possible
                match before.filter(|_| tried <= LENGTHS) {
                    Some(before) => (time, tried) = (before, LENGTHS),
                    None => return Ok(None),
                }
                continue;
            };
            let better = time + near.gap / near.closing;
            let inside = better > 0.0 && better < rest.length - LAST * context.dt;
            if near.gap.abs() <= near.touch || !inside || tried >= LENGTHS {
                // an open contact that does not get there in this step is no impact
                let reached = inside || near.gap <= near.touch;
                return Ok(reached.then_some((near.key, time)));
            }
            (before, time) = (Some(time), better);
        }
    }

    /// Detects the contacts of the instant at the present configuration. Returns the nearest one of
    /// the pair of `contact` that closes.
    fn closing<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        context: &Context,
        contact: &ContactPoint,
    ) -> Result<Option<Closing>, StepError> {
        let instant = &mut self.instant;
        instant
            .accelerations
            .clone_from(&self.interval.accelerations);
        model.set_velocities(&instant.start);
        instant.detect_pairs(model, &self.pairs, context.dt)?;
        let of = |c: &ContactPoint| Closing {
            key: c.key,
            gap: c.gap,
            closing: -c.rows.velocity(&instant.start).x,
            touch: touch_tolerance(c, instant, context.dt),
        };
        let all = instant.detection.contacts.iter();
        let all = all.filter(|c| c.surfaces == contact.surfaces && !self.closed.contains(&c.key));
        let all = all.map(of).filter(|near| near.closing > 0.0);
        Ok(all.min_by(|a, b| a.gap.total_cmp(&b.gap)))
    }
}

/// A contact that closes at an instant.
struct Closing {
    key: ContactKey,
    /// Its gap \[m\], the velocity at which it closes \[m/s\], and the gap below which it touches.
    gap: f64,
    closing: f64,
    touch: f64,
}
