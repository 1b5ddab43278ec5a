//! A cluster of bodies, stepped by itself from event to event.

use super::StepError;
use super::events::{crossing, release_lone, see_from_the_start, touch_tolerance};
use super::model::{Configuration, ContactKey, ContactPoint, MultibodyModel, NormalLaw};
use super::outcome::{forces_work, record_stage};
use super::record::StepRecord;
use super::rules::{Rules, applied_acceleration, rest_velocity};
use super::solve::IslandSolver;
use super::stage::{Memories, Span, Stage, belongs, movable};
use super::stepper::check_finite;
use crate::contact::{Law, NO_BODY, Vec2, Vec3};

/// Impacts of a cluster in one step, before the rest of it is stepped by the plain rule.
const EVENTS: usize = 4;
/// The same for two bodies that touch nothing else: their events cost one small solve each.
const LONE_EVENTS: usize = 64;
/// Steps of the search for an instant: Newton takes three, bisection of a step 40 to round-off.
const SEARCHES: usize = 60;

/// What all clusters of a step share.
pub(super) struct Context<'a> {
    pub main: &'a Stage,
    pub memory: &'a Memories,
    pub rules: Rules,
    pub inverse_mass: &'a [Vec3],
    /// Configurations of all bodies at the start of the step.
    pub origin: &'a [Configuration],
    /// Start and length of the step \[s\].
    pub time: f64,
    pub dt: f64,
}

/// What became of a cluster in a step.
pub(super) struct Cluster {
    /// Movable ones, ascending.
    pub bodies: Vec<u32>,
    /// One a body: velocity and configuration at the end, and `∫ u dt`.
    pub end: Vec<Vec3>,
    pub configuration: Vec<Configuration>,
    pub displacement: Vec<Vec3>,
    pub record: StepRecord,
    pub memory: Memories,
}

/// Steps clusters; keeps its arrays.
#[derive(Default)]
pub(super) struct Runner {
    /// The interval stepped last, and the instant at the end of it.
    flow: Stage,
    instant: Stage,
    members: Vec<bool>,
    pairs: Vec<[u32; 2]>,
    /// Bodies of the cluster, and those that move on their own beside it.
    moved: Vec<u32>,
    /// Where they are at the start of the interval.
    here: Vec<Configuration>,
    /// What the cluster remembers of its own since the step began.
    remembered: Option<Memories>,
    record: StepRecord,
}

/// The rest of a step.
#[derive(Clone, Copy)]
struct Rest {
    /// Its start and length \[s\].
    at: f64,
    length: f64,
}

impl Runner {
    /// Steps `bodies` through the step of `context`. On return they stand at its end, all others
    /// as on entry.
    ///
    /// # Errors
    /// [`StepError`] of the detection, or velocities that are not finite.
    pub fn run<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        solver: &mut IslandSolver,
        context: &Context,
        bodies: Vec<u32>,
    ) -> Result<Cluster, StepError> {
        self.gather(context, &bodies);
        let escorts = self.moved[bodies.len()..].to_vec();
        let place = |model: &M, all: &[u32]| -> Vec<Configuration> {
            let of = |b: &u32| model.configuration(*b as usize);
            all.iter().map(of).collect()
        };
        let aside = place(model, &escorts);
        let origin = |b: &u32| context.origin[*b as usize];
        self.here = self.moved.iter().map(origin).collect();
        self.restore(model);
        self.flow.start.clone_from(&context.main.start);
        self.flow.excused.clone_from(&context.main.excused);
        self.remembered = None;
        self.record = StepRecord::default();
        let mut cluster = Cluster {
            end: Vec::new(),
            configuration: Vec::new(),
            displacement: vec![Vec3::zeros(); bodies.len()],
            bodies,
            record: StepRecord::default(),
            memory: Memories::default(),
        };
        let (end, mut elapsed, mut limit) = (context.time + context.dt, 0.0, LONE_EVENTS);
        loop {
            let rest = Rest {
                at: context.time + elapsed,
                length: context.dt - elapsed,
            };
            let plain = self.record.events >= limit;
            let rules = Rules {
                events: !plain,
                ..context.rules
            };
            let span = Span {
                step: context.dt,
                length: rest.length,
                horizon: 0.5 * (rest.length + context.dt),
            };
            // the main trial has shown this far already
            let shown = elapsed == 0.0 && !plain;
            if shown {
                self.take_over(context);
            } else {
                self.advance(model, solver, context, &rules, span, rest.at)?;
            }
            // the search leaves bodies where it looked last
            let middle = place(model, &self.moved);
            let next = if plain {
                None
            } else {
                self.next(model, context)?
            };
            let Some((contact, time)) = next else {
                if shown {
                    self.restore(model);
                    self.advance(model, solver, context, &rules, span, rest.at)?;
                } else {
                    for (&b, at) in self.moved.iter().zip(&middle) {
                        model.set_configuration(b as usize, at);
                    }
                }
                self.finish_interval(model);
                self.keep(solver, context, end, &mut cluster);
                break;
            };
            let found = self.seek(model, solver, context, &rules, &contact, time, rest)?;
            let Some((key, time)) = found else {
                // nothing closes after all: what is left is stepped plainly
                limit = 0;
                self.restore(model);
                continue;
            };
            elapsed += time;
            if time > 0.0 {
                self.keep(solver, context, context.time + elapsed, &mut cluster);
                self.remembered = Some(std::mem::take(&mut cluster.memory));
            }
            self.forget_sticking(context);
            let rest = Rest {
                at: context.time + elapsed,
                length: context.dt - elapsed,
            };
            if !self.impact(solver, context, key, rest, cluster.bodies.len()) {
                limit = EVENTS;
            }
            self.here = place(model, &self.moved);
            std::mem::swap(&mut self.flow.start, &mut self.instant.end);
        }
        check_finite(&self.flow.end, context.time)?;
        cluster.record = std::mem::take(&mut self.record);
        let velocity = |b: &u32| self.flow.end[*b as usize];
        cluster.end = cluster.bodies.iter().map(velocity).collect();
        cluster.configuration = place(model, &cluster.bodies);
        for (&b, place) in escorts.iter().zip(&aside) {
            model.set_configuration(b as usize, place);
        }
        Ok(cluster)
    }

    /// Who belongs, who moves along, and which pairs of surfaces may touch.
    fn gather(&mut self, context: &Context, bodies: &[u32]) {
        self.members.clear();
        self.members.resize(context.inverse_mass.len(), false);
        for &b in bodies {
            self.members[b as usize] = true;
        }
        self.pairs.clear();
        self.moved.clear();
        self.moved.extend_from_slice(bodies);
        for contact in &context.main.detection.contacts {
            let sides = movable(&contact.rows, context.inverse_mass).bodies;
            let mut real = sides.iter().filter(|b| **b != NO_BODY).peekable();
            if real.peek().is_none() || !real.all(|b| self.members[*b as usize]) {
                continue;
            }
            self.pairs.push(contact.surfaces);
            for b in contact.rows.bodies {
                if b != NO_BODY && !self.moved.contains(&b) {
                    self.moved.push(b);
                }
            }
        }
        self.pairs.sort_unstable();
        self.pairs.dedup();
    }

    fn restore<M: MultibodyModel + ?Sized>(&self, model: &mut M) {
        for (&b, place) in self.moved.iter().zip(&self.here) {
            model.set_configuration(b as usize, place);
        }
    }

    /// The path, and what waits on it, from the trial of the whole step.
    fn take_over(&mut self, context: &Context) {
        let (main, flow) = (context.main, &mut self.flow);
        flow.length = main.length;
        flow.end.clone_from(&main.end);
        flow.forces.clone_from(&main.forces);
        flow.accelerations.clone_from(&main.accelerations);
        flow.detection.clear();
        flow.waiting.clear();
        for &i in &main.waiting {
            let contact = main.detection.contacts[i];
            if self.pairs.binary_search(&contact.surfaces).is_ok() {
                flow.waiting.push(flow.detection.contacts.len());
                flow.detection.contacts.push(contact);
            }
        }
        flow.blocks.clear();
        flow.impulses.clear();
        let members = Some(self.members.as_slice());
        for (i, block) in main.blocks.iter().enumerate() {
            if belongs(&main.rows[i], members, context.inverse_mass) {
                flow.blocks.push(*block);
                flow.impulses.push(main.impulses[i]);
            }
        }
    }

    /// Whether nothing holds the bodies or presses on them: they fly.
    fn idle(&self) -> bool {
        let mut blocks = self.flow.blocks.iter().zip(&self.flow.impulses);
        blocks.all(|(b, p)| matches!(b.law, Law::Contact { .. }) && *p == Vec2::zeros())
    }

    /// Cuts the interval of bodies that fly to `time`; moves them to its end.
    fn fly<M: MultibodyModel + ?Sized>(&mut self, model: &mut M, time: f64) {
        let flow = &mut self.flow;
        flow.length = time;
        flow.clear_blocks();
        for (end, (start, a)) in flow
            .end
            .iter_mut()
            .zip(flow.start.iter().zip(&flow.accelerations))
        {
            *end = start + time * a;
        }
        for &b in &self.moved {
            let mean = 0.5 * (self.flow.start[b as usize] + self.flow.end[b as usize]);
            model.shift(b as usize, &mean, time);
        }
    }

    /// Solves an interval from `here`; leaves the bodies at its midpoint.
    fn advance<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        solver: &mut IslandSolver,
        context: &Context,
        rules: &Rules,
        span: Span,
        at: f64,
    ) -> Result<(), StepError> {
        let flow = &mut self.flow;
        model.set_velocities(&flow.start);
        for &b in &self.moved {
            let u = flow.start[b as usize];
            model.shift(b as usize, &u, 0.5 * span.length);
        }
        flow.detect_pairs(model, &self.pairs, context.dt)?;
        let memory = self.remembered.as_ref().unwrap_or(context.memory);
        if rules.events {
            let (moved, here) = (&self.moved, &self.here);
            let place = |b: u32| moved.iter().position(|m| *m == b).map(|k| here[k]);
            see_from_the_start(model, flow, memory, place, span.length, span.step)?;
        }
        flow.free_velocities(model, at + 0.5 * span.length, span.length);
        let w = context.inverse_mass;
        flow.collect(rules, memory, Some(&self.members), w, span);
        solver.solve(flow, w, rules);
        let spent = solver.outcomes.iter();
        spent.for_each(|outcome| outcome.count_work(&mut self.record));
        if rules.events {
            release_lone(flow, solver, span.step);
        }
        flow.end_velocities(w);
        Ok(())
    }

    /// Moves the bodies from the midpoint of the interval to its end.
    fn finish_interval<M: MultibodyModel + ?Sized>(&self, model: &mut M) {
        for &b in &self.moved {
            let u = self.flow.end[b as usize];
            model.shift(b as usize, &u, 0.5 * self.flow.length);
        }
    }

    /// The first pair of waiting contacts to close on the path of the interval, one of them, and
    /// after what time.
    fn next<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        context: &Context,
    ) -> Result<Option<(ContactPoint, f64)>, StepError> {
        let mut guesses: Vec<(ContactPoint, f64)> = Vec::new();
        for &i in &self.flow.waiting {
            let contact = self.flow.detection.contacts[i];
            let guess = crossing(&self.flow, &contact, context.dt).unwrap_or(self.flow.length);
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
                && first.is_none_or(|(_, earliest)| time < earliest)
            {
                first = Some((contact, time));
            }
        }
        Ok(first)
    }

    /// The instant at which the pair of `contact` closes on the path of the interval, sought by
    /// Newton's iteration within a bracket on the gap detected there, from `first` on.
    ///
    /// The parabola that `first` comes from is that of a straight normal; surfaces that curve or
    /// turn, and normals that flip in an overlap, are seen only by detection.
    fn locate<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        context: &Context,
        contact: &ContactPoint,
        first: f64,
    ) -> Result<Option<f64>, StepError> {
        let end = self.flow.length;
        let (mut open, mut closed) = (0.0, None);
        let mut time = first;
        for _ in 0..SEARCHES {
            if time == 0.0 {
                return Ok(Some(time));
            }
            let found = self.nearest(model, context, contact, time)?;
            let mut better = f64::NAN;
            match found {
                Some((gap, closing, resolution)) => {
                    if gap.abs() <= resolution {
                        return Ok((closing > 0.0).then_some(time));
                    }
                    if gap > 0.0 {
                        open = time;
                    } else {
                        closed = Some(time);
                    }
                    better = time + gap / closing;
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

    /// Smallest gap of a pair at `time` on the path of the interval, the velocity at which it
    /// closes, and what is as good as zero; `None` where nothing of it is near.
    fn nearest<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        context: &Context,
        contact: &ContactPoint,
        time: f64,
    ) -> Result<Option<(f64, f64, f64)>, StepError> {
        let (flow, share) = (&self.flow, time / self.flow.length);
        let at = |b: u32, share: f64| {
            let (a, e) = (flow.start[b as usize], flow.end[b as usize]);
            a + share * (e - a)
        };
        for (&b, place) in self.moved.iter().zip(&self.here) {
            if contact.rows.bodies.contains(&b) {
                model.set_configuration(b as usize, place);
                model.shift(b as usize, &at(b, 0.5 * share), time);
            }
        }
        self.instant
            .detect_pairs(model, &[contact.surfaces], context.dt)?;
        let all = self.instant.detection.contacts.iter();
        let nearest = all.min_by(|a, b| a.gap.total_cmp(&b.gap));
        Ok(nearest.map(|c| {
            let mut closing = 0.0;
            for (side, &b) in c.rows.bodies.iter().enumerate() {
                if b != NO_BODY {
                    closing -= c.rows.jacobian[side][0].dot(&at(b, share));
                }
            }
            let touch = touch_tolerance(c, flow, context.dt);
            (c.gap, closing, (2.0 * c.gap_noise).max(1e-5 * touch))
        }))
    }

    /// Steps to the instant at which `contact` closes and finds the contacts there: which one
    /// closes, and how long after the start of the rest.
    #[allow(clippy::too_many_arguments)] // the state of one search
    fn seek<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        solver: &mut IslandSolver,
        context: &Context,
        rules: &Rules,
        contact: &ContactPoint,
        time: f64,
        rest: Rest,
    ) -> Result<Option<(ContactKey, f64)>, StepError> {
        self.restore(model);
        if time > 0.0 && self.idle() {
            solver.outcomes.clear();
            self.fly(model, time);
            self.instant.start.clone_from(&self.flow.end);
        } else if time > 0.0 {
            let span = Span {
                step: context.dt,
                length: time,
                horizon: 0.5 * rest.length,
            };
            self.advance(model, solver, context, rules, span, rest.at)?;
            self.finish_interval(model);
            self.instant.start.clone_from(&self.flow.end);
        } else {
            self.instant.start.clone_from(&self.flow.start);
        }
        let instant = &mut self.instant;
        instant.accelerations.clone_from(&self.flow.accelerations);
        model.set_velocities(&instant.start);
        instant.detect_pairs(model, &self.pairs, context.dt)?;
        let closes = |c: &&ContactPoint| {
            c.surfaces == contact.surfaces && c.rows.velocity(&instant.start).x < 0.0
        };
        let all = instant.detection.contacts.iter().filter(closes);
        let found = all.min_by(|a, b| a.gap.total_cmp(&b.gap));
        Ok(found.map(|c| (c.key, time)))
    }

    /// Records the interval solved last.
    fn keep(&mut self, solver: &IslandSolver, context: &Context, time: f64, cluster: &mut Cluster) {
        let (flow, w) = (&self.flow, context.inverse_mass);
        let (record, memory) = (&mut self.record, &mut cluster.memory);
        solver.outcomes.iter().for_each(|o| o.count(record));
        memory.clear();
        record_stage(flow, |_| true, w, time, record, memory);
        record.energy.forces += forces_work(flow, w, |k| self.members[k]);
        for (&b, d) in cluster.bodies.iter().zip(&mut cluster.displacement) {
            *d += 0.5 * flow.length * (flow.start[b as usize] + flow.end[b as usize]);
        }
    }

    /// An impact disturbs what stuck: the correction of its drift would see a jump.
    fn forget_sticking(&mut self, context: &Context) {
        let mut memory = self.remembered.take().unwrap_or_else(|| {
            let found = &self.instant.detection;
            let keys = found.contacts.iter().map(|c| c.key);
            keys.chain(found.joints.iter().map(|j| j.key))
                .filter_map(|key| Some((key, *context.memory.get(&key)?)))
                .collect()
        });
        memory.values_mut().for_each(|m| m.stuck = None);
        self.remembered = Some(memory);
    }

    /// Impact without duration at the present configuration; whether it was a lone one.
    ///
    /// Two bodies that touch nothing else are followed from bounce to bounce until all that are
    /// left fit into the rest of the step: with closing velocity `v` and relative acceleration
    /// `a` they take `2 e v / (a (1 − e))`, and together give the impulse of a landing without
    /// rebound and of the rest that follows it.
    fn impact(
        &mut self,
        solver: &mut IslandSolver,
        context: &Context,
        key: ContactKey,
        rest: Rest,
        bodies: usize,
    ) -> bool {
        let w = context.inverse_mass;
        let idle = self.idle();
        let members = Some(self.members.as_slice());
        let carried = |k: &ContactKey| {
            let known = self.remembered.as_ref().and_then(|m| m.get(k));
            known.is_some_and(|m| m.impulse.x > 0.0)
        };
        let instant = &mut self.instant;
        let contacts = &instant.detection.contacts;
        let touching: Vec<bool> = contacts
            .iter()
            .map(|c| {
                let near = c.gap <= touch_tolerance(c, instant, context.dt);
                c.key == key || near || carried(&c.key)
            })
            .collect();
        let mut joints = instant.detection.joints.iter();
        let lone = idle
            && bodies <= 2
            && touching.iter().filter(|t| **t).count() == 1
            && !joints.any(|j| belongs(&j.rows, members, w));
        let acceleration = |c: &ContactPoint| -c.rows.velocity(&instant.accelerations).x;
        let slow = |c: &ContactPoint, e: f64, v: f64| {
            if lone {
                2.0 * e * v <= acceleration(c) * (1.0 - e) * rest.length
            } else {
                let a = applied_acceleration(c, &instant.accelerations);
                e * v <= rest_velocity(a, context.dt)
            }
        };
        let mut over = rest.at;
        let in_force: Vec<f64> = contacts
            .iter()
            .map(|c| {
                let NormalLaw::Rigid { restitution: e } = c.law else {
                    return 0.0;
                };
                let v = -c.rows.velocity(&instant.start).x;
                if !slow(c, e, v) {
                    return e;
                }
                if lone && c.key == key && e > 0.0 {
                    over += 2.0 * e * v / (acceleration(c) * (1.0 - e));
                }
                0.0
            })
            .collect();
        instant.collect_impact(&context.rules, &self.members, w, |i| {
            touching[i].then_some(in_force[i])
        });
        solver.solve(instant, w, &context.rules);
        instant.end_velocities(w);
        let record = &mut self.record;
        for outcome in &solver.outcomes {
            outcome.count_work(record);
            outcome.count(record);
        }
        // the instant leaves no memory: what it pressed does not press on
        let mut none = Memories::default();
        record_stage(instant, |_| true, w, over, record, &mut none);
        record.events += 1;
        lone
    }
}
