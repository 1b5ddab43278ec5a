//! Steps one cluster of bodies from event to event.

use super::bounce::{Bounce, forget_restitution};
use super::context::{Cluster, Context, Rest};
use super::counts::{Counts, LATE, SOLVES};
use super::slides::Slide;
use super::watched::{Kept, Pair, Sought, kept};
use crate::contact::{Law, Vec2};
use crate::dynamics::contact_cache::CachedContacts;
use crate::dynamics::cut_links::{CutLink, is_telling, part_length};
use crate::dynamics::events::{release_lone, see_from_the_start};
use crate::dynamics::interval::{Interval, movable};
use crate::dynamics::model::{Configuration, ContactKey, ContactPoint, MultibodyModel, NearWanted};
use crate::dynamics::outcome::SolvedProblem;
use crate::dynamics::pulled_links::find_links;
use crate::dynamics::record::{StepRecord, Waypoint};
use crate::dynamics::rules::{Rules, Span};
use crate::dynamics::settings::{StepError, check_finite};
use crate::dynamics::solution::Solution;
use crate::dynamics::solve::IslandSolver;
use crate::threads::Threads;

/// What ends an interval.
pub(super) enum Next {
    /// A pair closes.
    Closes(Pair),
    /// A pair stops sliding.
    Stops(Slide),
    /// A part of an interval with a path too curved for it.
    Turns,
    /// A part of an interval too long for its links.
    Cut,
}

/// Steps clusters; reuses its buffers.
#[derive(Default)]
pub(super) struct Runner {
    /// The interval stepped last, and the instant at its end.
    pub interval: Interval,
    pub solution: Solution,
    pub instant: Interval,
    pub hit: Solution,
    pub members: Vec<bool>,
    pub pairs: Vec<[u32; 2]>,
    /// Bodies of the cluster, and adjacent bodies with prescribed motion.
    pub moved: Vec<u32>,
    /// For each body its index in `moved`, or [`NO_BODY`](crate::contact::NO_BODY).
    pub place: Vec<u32>,
    /// Configurations of the `moved` bodies at the start of the interval.
    pub here: Vec<Configuration>,
    /// Contacts that take part in the interval.
    pub kept: Vec<Kept>,
    /// Contacts that have landed in the step, and those of them that landed at the instant before the
    /// interval, as they were then.
    pub landed: Vec<ContactKey>,
    pub held: Vec<ContactPoint>,
    /// The impact before, if it was between two bodies that touch nothing else.
    pub bounced: Option<Bounce>,
    /// Problems of all intervals and instants that are part of the result.
    pub problems: Vec<SolvedProblem>,
    /// The cluster's own contact cache, after its first interval.
    pub own_contacts: Option<CachedContacts>,
    pub record: StepRecord,
    /// Whether nothing has happened in the step so far: the interval of all of it starts as the trial does.
    fresh: bool,
    /// Whether no contact rebounds any more in the step: there were too many rebounds.
    pub plastic: bool,
    /// Whether an interval has left contacts deep, see [`deep_impacts`](crate::dynamics::deep_impacts).
    pub deep: bool,
    /// Its links because of which it is stepped in parts.
    cuts: Vec<CutLink>,
    /// Whether the cluster has more than [`LATE`] bodies and no events: at most [`SOLVES`] intervals of all such
    /// clusters are solved in a step, then the plain rule steps the rest.
    large: bool,
    /// How many were solved, also before a cluster met other bodies.
    spent: usize,
}

/// Configurations of some bodies.
pub(super) fn places(model: &dyn MultibodyModel, bodies: &[u32]) -> Vec<Configuration> {
    let of = |b: &u32| model.configuration(*b as usize);
    bodies.iter().map(of).collect()
}

impl Runner {
    /// Steps `bodies` through the step of `context`. On return they are at its end; all other
    /// bodies are where they were.
    ///
    /// # Errors
    /// [`StepError`] of the detection, or velocities that are not finite.
    pub fn run(
        &mut self,
        model: &mut dyn MultibodyModel,
        solver: &mut IslandSolver,
        context: &Context,
        bodies: Vec<u32>,
    ) -> Result<Cluster, StepError> {
        self.gather(context, &bodies);
        let escorts = self.moved[bodies.len()..].to_vec();
        let saved = places(model, &escorts);
        self.start(context);
        self.restore(model);
        let mut cluster = Cluster::of(bodies);
        let mut counts = Counts::new();
        let (mut elapsed, mut rules) = (0.0, context.rules);
        let located = context.rules.events;
        cluster.located = located;
        cluster.in_parts = context.parts > 1.0;
        self.large = !located && cluster.bodies.len() > LATE && !cluster.in_parts;
        loop {
            if self.solves_left() == 0 {
                rules = self.plainer(rules);
            }
            let rest = Rest::of(context, elapsed);
            // the trial of the whole step already gives the path from the start
            let known = self.fresh && rules == context.rules && !context.anew;
            let wanted = [
                known,
                located && counts.may_stop(),
                located && counts.may_turn(),
            ];
            let next = self.try_rest(model, solver, context, &rules, rest, wanted)?;
            let Some((next, time)) = next else {
                self.record_last(context, context.time + context.dt, &mut cluster);
                break;
            };
            let (pair, time) = match next {
                Next::Closes(pair) => (pair, time),
                next => {
                    match next {
                        Next::Stops(slide) => {
                            counts.stops += 1;
                            self.stop(model, solver, context, &rules, (slide, time), rest)?;
                        }
                        next => {
                            counts.turns += usize::from(matches!(next, Next::Turns));
                            self.part(model, solver, context, &rules, time, rest)?;
                        }
                    }
                    // the midpoint of a shorter interval may defer what that of the rest kept open
                    match self.closes(model, context, &rules)? {
                        Some(closes) => closes,
                        None => {
                            self.finish_interval(model);
                            elapsed += self.interval.length;
                            self.go_on(model, context, elapsed, &mut cluster);
                            continue;
                        }
                    }
                }
            };
            match self.seek(model, solver, context, &rules, &pair, time, rest)? {
                Sought::Impact(key, time) => {
                    elapsed += time;
                    if time > 0.0 {
                        self.settle(model, context, false);
                        self.record_last(context, context.time + elapsed, &mut cluster);
                        self.own_contacts = Some(std::mem::take(&mut cluster.contacts));
                    }
                    let rest = Rest::of(context, elapsed);
                    let hit = (key, &pair);
                    if self.strike(model, solver, context, hit, rest, &cluster, &mut counts) {
                        match counts.chatter(context.dt)
                            && self.may_be_plastic(&rules, counts.are_few(cluster.bodies.len()))
                        {
                            true => self.plastic = true,
                            false => rules = self.plainer(rules),
                        }
                        counts.forget_impacts();
                    }
                }
                Sought::Open(time) if counts.may_turn() => {
                    counts.turns += 1;
                    elapsed += time;
                    self.go_on(model, context, elapsed, &mut cluster);
                }
                // no contact closes in fact
                _ => {
                    rules = self.plainer(rules);
                    self.restore(model);
                }
            }
        }
        self.end(model, context, &mut cluster);
        for (&b, place) in escorts.iter().zip(&saved) {
            model.set_configuration(b as usize, place);
        }
        Ok(cluster)
    }

    /// The rules for the rest of a step in which impacts are too many to be located, or none is found: first
    /// those of a step without events, in which fast bodies are still swept, then those without sweeps.
    fn plainer(&self, rules: Rules) -> Rules {
        Rules {
            events: false,
            sweeps: rules.events && !self.interval.roles.sweeps.is_empty(),
            ..rules
        }
    }

    /// How many intervals of the cluster may still be solved.
    pub fn solves_left(&self) -> usize {
        match self.large {
            true => SOLVES.saturating_sub(self.spent),
            false => usize::MAX,
        }
    }

    /// Completes a cluster at the end of the step.
    fn end(&mut self, model: &dyn MultibodyModel, context: &Context, cluster: &mut Cluster) {
        cluster.record = std::mem::take(&mut self.record);
        cluster.unclosed.clone_from(&self.solution.unclosed);
        let links = self.cuts_now(context);
        cluster.links = links.into_iter().map(|c| c.next).collect();
        cluster.problems = std::mem::take(&mut self.problems);
        let velocity = |b: &u32| self.solution.end[*b as usize];
        cluster.end = cluster.bodies.iter().map(velocity).collect();
        cluster.configuration = places(model, &cluster.bodies);
        let reserve = |b: &u32| self.interval.reserves.get(*b as usize).copied();
        cluster.reserves = cluster.bodies.iter().filter_map(reserve).collect();
    }

    /// Solves the impact of a contact, named by its key and pair, where the bodies are, and makes its
    /// result the start of the next interval. Returns whether the plain rule is to step the rest.
    #[allow(clippy::too_many_arguments)] // the state of one step
    fn strike(
        &mut self,
        model: &dyn MultibodyModel,
        solver: &mut IslandSolver,
        context: &Context,
        (key, pair): (ContactKey, &Pair),
        rest: Rest,
        cluster: &Cluster,
        counts: &mut Counts,
    ) -> bool {
        self.forget_sticking(context);
        let bodies = cluster.bodies.len();
        let speed = self.approach(key);
        let [lone, solved] = self.impact(solver, context, key, rest, bodies);
        let rebounds = self.instant.blocks.iter().any(|b| b.impact);
        // what no impulses solve closes all the same, and would do so for ever
        let many = counts.impact(
            (pair.surfaces, movable(pair.bodies, context.inverse_mass)),
            bodies,
            [lone, rebounds],
            [rest.at, speed, context.dt],
        );
        self.fresh = false;
        self.settle_hit(model, context);
        self.hold_landed();
        self.here = places(model, &self.moved);
        let (before, after) = (&self.instant.start, &self.hit.end);
        let here = cluster.bodies.iter().zip(&self.here);
        let here = here.filter(|(b, _)| before[**b as usize] != after[**b as usize]);
        self.record
            .waypoints
            .extend(here.map(|(&body, &place)| Waypoint {
                body,
                time: rest.at,
                place,
            }));
        std::mem::swap(&mut self.interval.start, &mut self.hit.end);
        many || !solved
    }

    /// Begins a step of the bodies that are gathered.
    pub fn start(&mut self, context: &Context) {
        let origin = |b: &u32| context.origin[*b as usize];
        self.here = self.moved.iter().map(origin).collect();
        self.interval.start.clone_from(&context.main.start);
        (self.interval.reserves).clone_from(&context.main.reserves);
        for interval in [&mut self.interval, &mut self.instant] {
            interval.roles.clone_from(&context.main.roles);
            let known = &context.main.known_overlaps;
            interval.known_overlaps.clone_from(known);
            interval.detection.wants_near = match context.rules.events {
                true => NearWanted::All,
                false => NearWanted::None,
            };
        }
        self.interval.crowded.clone_from(&context.main.crowded);
        self.interval.plain.clone_from(&context.main.plain);
        self.landed.clear();
        self.held.clear();
        self.bounced = None;
        self.plastic = false;
        self.deep = false;
        self.fresh = true;
        self.own_contacts = None;
        let cuts = context.cuts.iter().filter(|c| self.members[c.link.body]);
        self.cuts = cuts.copied().collect();
        self.record = StepRecord::default();
        self.problems.clear();
    }

    /// Solves the rest of the step without impacts, unless it is too long for the links, or the trial of
    /// the whole step has `known` it. Returns the first contact to close, or with `slides` the first slide to end, and the time
    /// until then. `None` if there is neither: the bodies are then at the end of the step.
    fn try_rest(
        &mut self,
        model: &mut dyn MultibodyModel,
        solver: &mut IslandSolver,
        context: &Context,
        rules: &Rules,
        rest: Rest,
        [known, slides, cuts]: [bool; 3],
    ) -> Result<Option<(Next, f64)>, StepError> {
        let equal = (rest.length * context.parts / context.dt).round().max(1.0);
        let part = part_length(&self.cuts, rest.length, context.dt).min(rest.length / equal);
        if part < rest.length {
            self.record.cut = 1;
            return Ok(Some((Next::Cut, part)));
        }
        let span = Span {
            step: context.dt,
            length: rest.length,
            horizon: 0.5 * (rest.length + context.dt),
            strikes: false,
        };
        if known {
            self.take_trial(context);
        } else {
            self.advance(model, solver, context, rules, span, rest.at)?;
        }
        let closes = self.closes(model, context, rules)?;
        let stops = match slides {
            true => self.first_stop(context, known),
            false => None,
        };
        let part = match cuts {
            true => self.first_part(context, known, rest),
            false => f64::INFINITY,
        };
        let closing = closes.as_ref().map_or(f64::INFINITY, |(_, time)| *time);
        let stopping = stops.as_ref().map_or(f64::INFINITY, |(_, time)| *time);
        if part < closing.min(stopping) {
            return Ok(Some((Next::Turns, part)));
        }
        if let Some((slide, time)) = stops.filter(|(_, time)| *time < closing) {
            return Ok(Some((Next::Stops(slide), time)));
        }
        if let Some((pair, time)) = closes {
            return Ok(Some((Next::Closes(pair), time)));
        }
        if known {
            self.restore(model);
            self.advance(model, solver, context, rules, span, rest.at)?;
        }
        self.settle(model, context, true);
        self.finish_interval(model);
        Ok(None)
    }

    /// The first pair to close in the interval solved last, and the time until then. The bodies stay where
    /// they are.
    fn closes(
        &mut self,
        model: &mut dyn MultibodyModel,
        context: &Context,
        rules: &Rules,
    ) -> Result<Option<(Pair, f64)>, StepError> {
        if !rules.locates() {
            return Ok(None);
        }
        // the search leaves the bodies at the last configuration it tried
        let middle = places(model, &self.moved);
        let closes = self.next(model, context);
        self.place_all(model, &middle);
        closes
    }

    pub fn restore(&self, model: &mut dyn MultibodyModel) {
        self.place_all(model, &self.here);
    }

    pub fn place_all(&self, model: &mut dyn MultibodyModel, places: &[Configuration]) {
        for (&b, place) in self.moved.iter().zip(places) {
            model.set_configuration(b as usize, place);
        }
    }

    /// Whether the bodies fly: no contact or joint acts on them.
    pub fn idle(&self) -> bool {
        let mut blocks = self.interval.laws.iter().zip(&self.solution.impulses);
        blocks.all(|(law, p)| matches!(law, Law::Contact { .. }) && *p == Vec2::zeros())
    }

    /// Shortens the interval of flying bodies to `time` and moves them to its end.
    pub fn fly(&mut self, model: &mut dyn MultibodyModel, time: f64) {
        let (interval, solution) = (&mut self.interval, &mut self.solution);
        interval.length = time;
        interval.clear_blocks();
        solution.clear();
        for (end, (start, a)) in solution
            .end
            .iter_mut()
            .zip(interval.start.iter().zip(&interval.accelerations))
        {
            *end = start + time * a;
        }
        for &b in &self.moved {
            let mean = 0.5 * (self.interval.start[b as usize] + self.solution.end[b as usize]);
            model.shift(b as usize, &mean, time);
        }
    }

    /// Solves an interval from `here`; leaves the bodies at its midpoint.
    pub fn advance(
        &mut self,
        model: &mut dyn MultibodyModel,
        solver: &mut IslandSolver,
        context: &Context,
        rules: &Rules,
        span: Span,
        at: f64,
    ) -> Result<(), StepError> {
        let interval = &mut self.interval;
        model.set_velocities(&interval.start);
        for &b in &self.moved {
            let u = interval.start[b as usize];
            model.shift(b as usize, &u, 0.5 * span.length);
        }
        interval.detect_pairs(model, &self.pairs, context.dt)?;
        if context.anew && self.fresh && span.length == context.dt {
            // those of the whole step follow fast parts to where they first touch
            let contacts = &mut interval.detection.contacts;
            let of = |c: &&ContactPoint| self.pairs.binary_search(&c.surfaces).is_ok();
            contacts.clear();
            contacts.extend(context.main.detection.contacts.iter().filter(of));
        }
        let cache = self.own_contacts.as_ref().unwrap_or(context.cache);
        let w = context.inverse_mass;
        interval.apply_forces(model, w, at + 0.5 * span.length);
        if rules.locates() {
            let (places, here) = (&self.place, &self.here);
            let place = |b: u32| start_of(places, here, b);
            see_from_the_start(model, interval, cache, rules, place, span.length, span.step)?;
        }
        if self.plastic {
            forget_restitution(&mut interval.detection.contacts);
        }
        interval.free_velocities(w, span.length);
        self.add_held();
        let (interval, cache) = (&mut self.interval, self.own_contacts.as_ref());
        let cache = cache.unwrap_or(context.cache);
        // a few bodies: nothing to share out
        let threads = Threads::default();
        interval.collect(rules, cache, Some(&self.members), w, span, &threads);
        let solution = &mut self.solution;
        solver.solve(interval, solution, w, rules);
        self.spent += usize::from(self.large);
        let outcomes = solution.outcomes.iter();
        outcomes.for_each(|outcome| outcome.count_work(&mut self.record));
        if rules.locates() {
            release_lone(interval, solution, rules, w, span.step);
        }
        self.kept.clear();
        let blocks = 0..interval.blocks.len();
        self.kept
            .extend(blocks.filter_map(|i| kept(interval, solution, i, span.step)));
        solution.end_velocities(interval, w);
        // no search on a path that is not finite
        check_finite(&solution.end, context.time)
    }

    /// Moves the bodies from the midpoint of the interval to its end.
    pub fn finish_interval(&self, model: &mut dyn MultibodyModel) {
        for &b in &self.moved {
            let u = self.solution.end[b as usize];
            model.shift(b as usize, &u, 0.5 * self.interval.length);
        }
    }

    /// Ends the interval solved last without an impact. The bodies are at its end.
    fn go_on(
        &mut self,
        model: &dyn MultibodyModel,
        context: &Context,
        elapsed: f64,
        cluster: &mut Cluster,
    ) {
        self.fresh = false;
        self.settle(model, context, false);
        self.record_last(context, context.time + elapsed, cluster);
        // tension that is gone for a moment may come back within the step
        let cuts = self.cuts_now(context);
        if !cuts.is_empty() {
            self.cuts = cuts;
        }
        self.own_contacts = Some(std::mem::take(&mut cluster.contacts));
        self.here = places(model, &self.moved);
        self.interval.start.clone_from(&self.solution.end);
        self.held.clear();
    }

    /// The links of the cluster with the forces of the interval solved last, if it is stepped in parts
    /// because of some.
    fn cuts_now(&self, context: &Context) -> Vec<CutLink> {
        if self.cuts.is_empty() || !is_telling(self.interval.length, context.dt) {
            return self.cuts.clone();
        }
        let before: Vec<_> = self.cuts.iter().map(|c| c.link).collect();
        let (interval, solution, w) = (&self.interval, &self.solution, context.inverse_mass);
        let found = find_links(&before, interval, solution, w, context.dt);
        let first = self.own_contacts.is_none();
        let all = found.into_iter().map(|(body, mut next)| {
            let last = self.cuts.iter().find(|c| c.link.body == body);
            if let Some(last) = last.filter(|_| !first) {
                next.lasting = next.lasting.min(last.next.lasting);
            }
            CutLink::of(body, next, w)
        });
        all.collect()
    }
}

/// Configuration of a body at the start of the interval; `None` if it does not move in it.
pub(super) fn start_of(places: &[u32], here: &[Configuration], body: u32) -> Option<Configuration> {
    let place = *places.get(body as usize)?;
    here.get(place as usize).copied()
}
