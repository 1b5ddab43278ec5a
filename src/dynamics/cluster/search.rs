//! Finds when and where the next pair of a cluster closes.

use super::bounce::forget_restitution;
use super::context::{Context, Rest};
use super::runner::{Runner, start_of};
use super::watched::{Pair, Sought};
use crate::contact::NO_BODY;
use crate::dynamics::events::{crossing, touch_tolerance};
use crate::dynamics::model::{ContactKey, ContactPoint, MultibodyModel};
use crate::dynamics::rules::{Rules, Span};
use crate::dynamics::settings::StepError;
use crate::dynamics::solve::IslandSolver;

/// Least part of an interval by which the search for the first instant advances, where the bound of the
/// distance allows less. Two surfaces that overlap for a shorter time are not seen to.
const STRIDE: f64 = 1.0 / 64.0;

/// Most steps of the search: those of [`STRIDE`], and as many to converge. Newton needs three, bisection 40
/// to reach round-off.
const SEARCHES: usize = 128;

/// Most lengths of the interval up to an instant that are tried.
const LENGTHS: usize = 16;

/// Share of a step at its end in which no event is located; such a contact closes at the start of
/// the next step instead. An interval of zero length has no rates.
pub(super) const LAST: f64 = 1e-9;

/// A contact at an instant.
struct Closing {
    key: ContactKey,
    /// Its gap \[m\] and the velocity at which it closes \[m/s\].
    gap: f64,
    closing: f64,
    /// Gaps that count as zero, and the gap below which surfaces touch \[m\].
    resolution: f64,
    touch: f64,
}

impl Closing {
    fn of(contact: &ContactPoint, closing: f64, touch: f64) -> Closing {
        Closing {
            key: contact.key,
            gap: contact.gap,
            closing,
            resolution: (2.0 * contact.gap_noise).max(1e-5 * touch),
            touch,
        }
    }

    fn overlaps(&self) -> bool {
        self.gap < -self.resolution
    }
}

/// The search for the length of an interval that ends at a landing: Newton's method between the longest
/// length that is known to be too short and the shortest that is too long, bisection where it leaves them.
///
/// The path jumps where another contact begins to take part in a longer interval: then no length may fit,
/// and the one with the least gap is taken.
struct Lengths {
    /// Bounds of the length \[s\], and whether it is known that the landing lies between them.
    between: [f64; 2],
    known: bool,
    /// The length with the least gap, and that gap \[m\].
    best: Option<(f64, f64)>,
    /// How many further lengths may be tried.
    left: usize,
}

impl Lengths {
    fn up_to(longest: f64, most: usize) -> Lengths {
        Lengths {
            between: [0.0, longest],
            known: false,
            best: None,
            left: most.min(LENGTHS),
        }
    }

    /// The length to try after `time`, where `near` closes; `None` to stay with `time`.
    fn next(&mut self, time: f64, near: Option<&Closing>) -> Option<f64> {
        let may_go_on = self.left > 0;
        self.left = self.left.saturating_sub(1);
        let Some(near) = near.filter(|_| may_go_on) else {
            // stay with the best one, after it is stepped again
            self.left = 0;
            let best = self.best.take();
            return best.map(|best| best.0).filter(|best| *best != time);
        };
        if near.gap.abs() <= near.touch {
            return None;
        }
        let gap = near.gap.abs();
        if self.best.is_none_or(|(_, least)| gap < least) {
            self.best = Some((time, gap));
        }
        self.known |= near.gap < 0.0;
        self.between[usize::from(near.gap < 0.0)] = time;
        let [short, long] = self.between;
        let better = time + near.gap / near.closing;
        if better > short && better < long {
            return Some(better);
        }
        // an open contact that does not get there in this step is no impact
        self.known.then_some(0.5 * (short + long))
    }

    /// What the contact that is `near` at the last `time` makes of it.
    fn end(&self, time: f64, near: Option<Closing>) -> Sought {
        match near {
            Some(near) if near.gap <= near.touch => Sought::Impact(near.key, time),
            Some(_) if self.known => Sought::Open(time),
            _ => Sought::Nothing,
        }
    }
}

fn nearest(all: impl IntoIterator<Item = Closing>) -> Option<Closing> {
    all.into_iter().min_by(|a, b| a.gap.total_cmp(&b.gap))
}

impl Runner {
    /// The first pair to close on the path of the interval, and the time until then.
    pub(super) fn next(
        &mut self,
        model: &mut dyn MultibodyModel,
        context: &Context,
    ) -> Result<Option<(Pair, f64)>, StepError> {
        let mut pairs: Vec<Pair> = Vec::new();
        for &i in &self.solution.deferred {
            let contact = &self.interval.detection.contacts[i];
            let guess = crossing(&self.interval, &self.solution, contact, context.dt)
                .unwrap_or(self.interval.length);
            match pairs.iter_mut().find(|p| p.surfaces == contact.surfaces) {
                Some(pair) => pair.guess = pair.guess.min(guess),
                None => pairs.push(Pair::of(contact, guess)),
            }
        }
        // others are not followed beyond the first to close
        pairs.sort_by(|a, b| a.guess.total_cmp(&b.guess));
        for pair in &mut pairs {
            pair.speed = self.speed_of(pair.surfaces);
        }
        pairs.extend(self.watched(context));
        let mut first: Option<(Pair, f64)> = None;
        for mut pair in pairs {
            let until = first.as_ref().map_or(f64::INFINITY, |(_, time)| *time);
            if let Some(time) = self.locate(model, context, &mut pair, until)?
                && time < until
            {
                first = Some((pair, time));
            }
        }
        Ok(first)
    }

    /// The time at which a pair closes on the path of the interval; `None` if it does not, or not before `until`.
    /// Advances by no more than the bound of its distance allows, and uses Newton's method within that, on
    /// detected gaps.
    ///
    /// The parabola that gives the first guess assumes a straight normal. Only detection sees curved or
    /// rotating surfaces, corners, and normals that flip in an overlap.
    ///
    /// Contacts that overlap from the start close as soon as they stop opening. They become the `standing`
    /// ones of the pair: the first of its other contacts to close is found however deep they are.
    pub(super) fn locate(
        &mut self,
        model: &mut dyn MultibodyModel,
        context: &Context,
        pair: &mut Pair,
        until: f64,
    ) -> Result<Option<f64>, StepError> {
        let end = self.interval.length;
        let last = end - LAST * context.dt;
        let (mut open, mut closed) = (0.0, None);
        let mut guessed = pair.speed.is_none();
        let mut time = match pair.speed {
            Some(_) => 0.0,
            None => pair.guess,
        };
        for round in 0..SEARCHES {
            let (found, bound) = self.contacts_at(model, context, pair, time)?;
            if round == 0 {
                let standing = found.iter().filter(|near| near.overlaps());
                pair.standing = standing.map(|near| near.key).collect();
            }
            // what is slower closes by less than the gap that counts as touching
            let closes = |near: &Closing| near.closing * context.dt > near.touch;
            let (standing, others): (Vec<Closing>, Vec<Closing>) =
                (found.into_iter()).partition(|near| pair.standing.contains(&near.key));
            if standing.iter().any(|near| near.overlaps() && closes(near)) {
                pair.standing.clear();
                return Ok((time < last).then_some(time));
            }
            let mut better = f64::NAN;
            let mut overlaps = false;
            if let Some(near) = nearest(others) {
                // a touching pair closes at the start, though its gap may still be slightly open
                let touches = near.gap.abs() <= near.resolution;
                if closes(&near) && (touches || time == 0.0 && near.gap <= near.touch) {
                    return Ok((time < last).then_some(time));
                }
                overlaps = near.overlaps();
                better = time + near.gap / near.closing;
            }
            match overlaps {
                true => closed = Some(time),
                false => open = time,
            }
            // the time that the bound of the distance leaves free after `open`
            let free = match (closed, pair.speed) {
                (None, Some(speed)) => bound.unwrap_or(0.0).max(0.0) / speed,
                _ => 0.0,
            };
            if open + free >= until {
                return Ok(None);
            }
            let limit = match (closed, pair.speed) {
                (Some(closed), _) => closed,
                (None, _) if time == end => return Ok(None),
                (None, Some(_)) => (open + free + STRIDE * end).min(end),
                (None, None) => end,
            };
            // of a straight path the guess is exact
            time = if !guessed && pair.guess > open && pair.guess < limit {
                guessed = true;
                pair.guess
            } else if better > open && better < limit {
                better
            } else if closed.is_none() {
                limit
            } else {
                0.5 * (open + limit)
            };
        }
        Ok(closed.filter(|time| *time < last))
    }

    /// The contacts of a pair at `time` on the path of the interval that may close; and a lower bound of
    /// its distance \[m\], if there is one.
    fn contacts_at(
        &mut self,
        model: &mut dyn MultibodyModel,
        context: &Context,
        pair: &Pair,
        time: f64,
    ) -> Result<(Vec<Closing>, Option<f64>), StepError> {
        let (interval, solution, share) =
            (&self.interval, &self.solution, time / self.interval.length);
        let at = |b: u32, share: f64| {
            let (a, e) = (interval.start[b as usize], solution.end[b as usize]);
            a + share * (e - a)
        };
        for b in pair.bodies {
            if let Some(place) = start_of(&self.place, &self.here, b) {
                model.set_configuration(b as usize, &place);
                model.shift(b as usize, &at(b, 0.5 * share), time);
            }
        }
        let found = &mut self.instant.detection;
        found.clear();
        model.detect_pairs(&[pair.surfaces], context.dt, found)?;
        let bound = found.near.first().map(|near| near.bound);
        let all = self.instant.detection.contacts.iter();
        let open = all.filter(|c| self.may_close(c, pair, context.dt));
        let open = open.map(|c| {
            let mut closing = 0.0;
            for (side, &b) in c.rows.bodies.iter().enumerate() {
                if b != NO_BODY {
                    closing -= c.rows.jacobian[side][0].dot(&at(b, share));
                }
            }
            let touch = touch_tolerance(c, interval, context.dt);
            Closing::of(c, closing, touch)
        });
        Ok((open.collect(), bound))
    }

    /// Whether a contact may be the one that closes. A resting corner is as near as possible, and closes by
    /// round-off. Contacts deeper than the two can move in a step are none: a face of one shape may show
    /// the far end of the other.
    fn may_close(&self, contact: &ContactPoint, pair: &Pair, step: f64) -> bool {
        !self.is_closed(&contact.key) && pair.allows(contact, step)
    }

    /// Whether a contact touches at the start of the interval and is kept from closing.
    fn is_closed(&self, key: &ContactKey) -> bool {
        self.kept.iter().any(|k| k.touches && k.key == *key)
    }

    /// Moves to the instant at which a pair closes and detects the contacts there.
    ///
    /// `time` is that on the path of the whole rest. The shorter interval up to it has another
    /// path, unless the bodies fly: Newton's method corrects the time until the surfaces touch.
    #[allow(clippy::too_many_arguments)] // the state of one search
    pub(super) fn seek(
        &mut self,
        model: &mut dyn MultibodyModel,
        solver: &mut IslandSolver,
        context: &Context,
        rules: &Rules,
        pair: &Pair,
        time: f64,
        rest: Rest,
    ) -> Result<Sought, StepError> {
        if time == 0.0 || self.idle() {
            self.restore(model);
            if time > 0.0 {
                self.fly(model, time);
                self.instant.start.clone_from(&self.solution.end);
            } else {
                self.instant.start.clone_from(&self.interval.start);
            }
            let found = self.closing(model, context, pair)?;
            return Ok(match found.filter(|near| near.gap <= near.touch) {
                Some(near) => Sought::Impact(near.key, time),
                None if time > 0.0 => Sought::Open(time),
                None => Sought::Nothing,
            });
        }
        let mut search = Lengths::up_to(rest.length - LAST * context.dt, self.solves_left());
        let mut time = time;
        loop {
            self.restore(model);
            let span = Span {
                step: context.dt,
                length: time,
                horizon: 0.5 * rest.length,
                strikes: true,
            };
            self.interval.sought = Some(pair.surfaces);
            let advanced = self.advance(model, solver, context, rules, span, rest.at);
            self.interval.sought = None;
            advanced?;
            self.finish_interval(model);
            self.instant.start.clone_from(&self.solution.end);
            let near = self.closing(model, context, pair)?;
            match search.next(time, near.as_ref()) {
                Some(length) => time = length,
                None => return Ok(search.end(time, near)),
            }
        }
    }

    /// Detects the contacts of the instant at the present configuration. Returns the nearest one of
    /// `pair` that closes.
    fn closing(
        &mut self,
        model: &mut dyn MultibodyModel,
        context: &Context,
        pair: &Pair,
    ) -> Result<Option<Closing>, StepError> {
        let instant = &mut self.instant;
        instant
            .accelerations
            .clone_from(&self.interval.accelerations);
        model.set_velocities(&instant.start);
        instant.detect_pairs(model, &self.pairs, context.dt)?;
        if self.plastic {
            forget_restitution(&mut instant.detection.contacts);
        }
        let instant = &self.instant;
        let of = |c: &ContactPoint| {
            let closing = -c.rows.velocity(&instant.start).x;
            Closing::of(c, closing, touch_tolerance(c, instant, context.dt))
        };
        let all = instant.detection.contacts.iter();
        let all = all.filter(|c| c.surfaces == pair.surfaces && !pair.standing.contains(&c.key));
        let all = all.filter(|c| self.may_close(c, pair, context.dt));
        Ok(nearest(all.map(of).filter(|near| near.closing > 0.0)))
    }
}
