//! The step: contacts are found, an interval is posed and solved, what came of it is recorded and
//! written to the model.

use super::cluster::{Cluster, Context, locate_impacts};
use super::contact_cache::{CachedContact, CachedContacts, ContactCache, Overlaps};
use super::crew::Crew;
use super::events::{find_crowds, lands, release_lone, see_from_the_start};
use super::interval::{Interval, movable};
use super::island_cache::IslandCacheState;
use super::joint_recovery::close_joints;
use super::kinetic::kinetic;
use super::model::{Configuration, ContactKey, Detection, MultibodyModel};
use super::outcome::SolvedProblem;
use super::phases::{PhaseClock, Phases};
use super::record::StepRecord;
use super::recording::{forces_work, record_interval};
use super::recovery::{find_overlaps, part_overlaps};
use super::roles::BodyRoles;
use super::rules::{Rules, Scheme, Span};
use super::settings::{StepError, StepperSettings, check_finite};
use super::solution::Solution;
use super::solve::IslandSolver;
use crate::contact::{NO_BODY, Rows, Vec3};
use crate::solver::{ImpulseSolver, Judged, solver_by_name};
use serde::{Deserialize, Serialize};

/// Moreau's midpoint step with certified impulses: equations (1) to (6) of [`crate::dynamics`].
pub struct MoreauStepper {
    settings: StepperSettings,
    solver: IslandSolver,
    time: f64,
    cache: ContactCache,
    /// What the step at hand writes of contacts and joints, until it is taken.
    contacts_next: CachedContacts,
    interval: Interval,
    solution: Solution,
    /// Of the last step, where they are kept.
    problems: Vec<SolvedProblem>,
    origin: Vec<Configuration>,
    inverse_mass: Vec<Vec3>,
    /// Whether the solver is the one that the settings name.
    named: bool,
}

/// A step that has begun: the bodies stand at its midpoint, contacts are found, nothing is solved.
pub(crate) struct BegunStep {
    rules: Rules,
    record: StepRecord,
}

/// What a stepper takes from one step to the next: two caches and the time.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct StepperState {
    time: f64,
    contacts: ContactCache,
    islands: IslandCacheState,
}

impl MoreauStepper {
    /// A stepper at t = 0 with no memory.
    ///
    /// # Errors
    /// [`StepError::Solver`], [`StepError::Tolerance`], [`StepError::Events`],
    /// [`StepError::Threads`], [`StepError::Spawn`].
    pub fn new(settings: StepperSettings) -> Result<Self, StepError> {
        let solver = solver_by_name(&settings.solver)
            .ok_or_else(|| StepError::Solver(settings.solver.clone()))?;
        if !(settings.tolerance > 0.0 && settings.tolerance.is_finite()) {
            return Err(StepError::Tolerance(settings.tolerance));
        }
        if settings.events && settings.scheme == Scheme::Moreau {
            return Err(StepError::Events);
        }
        let mut solver = IslandSolver::new(solver, settings.tolerance);
        solver.crew = Crew::new(settings.threads, &settings.solver)?;
        Ok(MoreauStepper {
            solver,
            settings,
            time: 0.0,
            cache: ContactCache::default(),
            contacts_next: CachedContacts::default(),
            interval: Interval {
                whole: true,
                ..Interval::default()
            },
            solution: Solution::default(),
            problems: Vec::new(),
            origin: Vec::new(),
            inverse_mass: Vec::new(),
            named: true,
        })
    }

    /// Time at the end of the last step \[s\].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The settings in force.
    pub fn settings(&self) -> &StepperSettings {
        &self.settings
    }

    /// Takes a solver of the user's own in place of the one that the settings name, from the next
    /// step on. What it returns is judged here: its own word does not count. There is one of it, so
    /// that all islands are solved on the caller's thread.
    pub fn set_solver(&mut self, solver: Box<dyn ImpulseSolver>) {
        self.solver.own.solver = Box::new(Judged::new(solver));
        self.solver.crew = None;
        self.solver.cache.clear();
        self.named = false;
    }

    /// Other threads in place of those of the settings, see [`StepperSettings::threads`]: after a
    /// state is resumed on another machine, say.
    ///
    /// # Errors
    /// [`StepError::Threads`], [`StepError::Spawn`]; nothing is changed then.
    pub fn set_threads(&mut self, threads: usize) -> Result<(), StepError> {
        let crew = Crew::new(threads, &self.settings.solver)?;
        self.solver.crew = crew.filter(|_| self.named);
        self.settings.threads = threads;
        Ok(())
    }

    /// Forgets all contacts, as if none had touched before: after a re-meshed collider, say.
    pub fn forget_contacts(&mut self) {
        self.cache.contacts.clear();
        self.solver.cache.clear();
    }

    /// What the next step depends on.
    pub(crate) fn state(&self) -> StepperState {
        StepperState {
            time: self.time,
            contacts: self.cache.clone(),
            islands: self.solver.cache.state(),
        }
    }

    /// Goes on from where [`MoreauStepper::state`] was taken.
    pub(crate) fn restore(&mut self, state: &StepperState) {
        self.time = state.time;
        self.cache = state.contacts.clone();
        self.solver.cache.restore(&state.islands);
    }

    /// What is remembered of the contacts and joints of bodies to which `group` gives a number, all
    /// that move on both sides: it is lost after a step without them.
    pub(crate) fn set_aside(
        &self,
        group: impl Fn(u32) -> u32,
    ) -> Vec<(u32, ContactKey, CachedContact)> {
        let found = &self.interval.detection;
        let contacts = found.contacts.iter().map(|c| (&c.key, &c.rows));
        let all = contacts.chain(found.joints.iter().map(|j| (&j.key, &j.rows)));
        let of = |(key, rows): (&ContactKey, &Rows)| {
            let [a, b] = movable(rows.bodies, &self.inverse_mass);
            let own = match (a, b) {
                (NO_BODY, NO_BODY) => 0,
                (NO_BODY, b) => group(b),
                (a, NO_BODY) => group(a),
                (a, b) => group(a).min(group(b)),
            };
            let memory = self.cache.contacts.get(key).filter(|_| own != 0)?;
            Some((own, *key, *memory))
        };
        all.filter_map(of).collect()
    }

    /// Remembers again what was set aside.
    pub(crate) fn take_back(&mut self, memory: &[(ContactKey, CachedContact)]) {
        self.cache.contacts.extend(memory.iter().copied());
        let seen = &mut self.cache.overlaps.seen;
        seen.extend(memory.iter().map(|(key, _)| key.pair));
    }

    /// Whether the problems of every step are kept for [`MoreauStepper::problems`]; not at first.
    pub fn keep_problems(&mut self, keep: bool) {
        self.solver.keep = keep;
        self.problems.clear();
    }

    /// Whether the time of steps is booked from now on for [`MoreauStepper::phases`]; not at first.
    pub fn time_phases(&mut self, on: bool) {
        self.solver.clock.switch(on);
    }

    /// Where the time of all steps went since [`MoreauStepper::time_phases`].
    pub fn phases(&self) -> Phases {
        self.solver.clock.phases
    }

    /// The clock, for what a host does before and after a step.
    pub(crate) fn clock(&mut self) -> &mut PhaseClock {
        &mut self.solver.clock
    }

    /// The contact problems of the last step, island after island, those of located impacts last;
    /// none unless they are kept.
    pub fn problems(&self) -> &[SolvedProblem] {
        &self.problems
    }

    /// Advances `model` by `dt` \[s\].
    ///
    /// # Errors
    /// [`StepError::Dt`], [`StepError::NonFinite`], [`StepError::Model`]; the model then stands as
    /// it did before, velocities included.
    pub fn step<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        dt: f64,
    ) -> Result<StepRecord, StepError> {
        let begun = self.begin(model, dt)?;
        self.finish(model, begun)
    }

    /// The first part of a step: advances the bodies to its midpoint and finds the contacts there.
    /// It is followed by [`MoreauStepper::finish`] or [`MoreauStepper::cancel`].
    ///
    /// # Errors
    /// As [`MoreauStepper::step`].
    pub(crate) fn begin<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        dt: f64,
    ) -> Result<BegunStep, StepError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(StepError::Dt(dt));
        }
        self.solver.clock.start();
        model.begin_step(dt)?;
        self.solver.cache.begin();
        self.problems.clear();
        let interval = &mut self.interval;
        interval.start.clear();
        interval.start.extend_from_slice(model.velocities());
        check_finite(&interval.start, self.time)?;
        match model.roles() {
            Some(roles) => interval.roles.clone_from(roles),
            None => interval.roles = BodyRoles::default(),
        }
        self.inverse_mass.clear();
        self.inverse_mass.extend_from_slice(model.inverse_mass());
        self.origin.clear();
        let bodies = 0..interval.start.len();
        self.origin
            .extend(bodies.map(|body| model.configuration(body)));
        let mut rules = self.settings.rules();
        // event location follows all that is fast: sweeps add to it only what was asked for
        let sweeps = &interval.roles.sweeps;
        let asked = sweeps.iter().any(|s| s.all);
        rules.sweeps = rules.corrects_gaps() && (asked || !rules.events && !sweeps.is_empty());
        let mut record = StepRecord {
            time: self.time + dt,
            dt,
            accounted: true,
            ..StepRecord::default()
        };
        record.energy.potential_start = model.potential_energy();
        record.energy.kinetic_start = kinetic(&interval.start, &self.inverse_mass);
        model.advance(0.5 * dt);
        // a crowd that lands must be seen a step before it closes: see `find_crowds`
        let ahead = if rules.events && self.cache.lands {
            2.0 * dt
        } else {
            dt
        };
        if let Err(error) = interval.detect(model, ahead) {
            self.cancel(model);
            return Err(error.into());
        }
        Ok(BegunStep { rules, record })
    }

    /// What was found when the step began.
    pub(crate) fn detection(&self) -> &Detection {
        &self.interval.detection
    }

    /// Puts the model back to the start of a step.
    pub(crate) fn cancel<M: MultibodyModel + ?Sized>(&self, model: &mut M) {
        model.set_velocities(&self.interval.start);
        for (body, place) in self.origin.iter().enumerate() {
            model.set_configuration(body, place);
        }
    }

    /// The rest of a step.
    ///
    /// # Errors
    /// As [`MoreauStepper::step`].
    pub(crate) fn finish<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        BegunStep { rules, mut record }: BegunStep,
    ) -> Result<StepRecord, StepError> {
        let result = self.take_step(model, &rules, &mut record);
        if result.is_err() {
            self.solver.cache.drop_step();
            self.cancel(model);
        }
        result.map(|()| record)
    }

    /// Poses, solves, records and writes a step; the caches change only when nothing can fail any
    /// more.
    fn take_step<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        rules: &Rules,
        record: &mut StepRecord,
    ) -> Result<(), StepError> {
        let dt = record.dt;
        let overlaps = self.pose(model, rules, dt)?;
        self.solve(rules, dt)?;
        let mut clusters = self.locate(model, rules, dt)?;
        let mut apart = vec![false; self.inverse_mass.len()];
        for &body in clusters.iter().flat_map(|c| &c.bodies) {
            apart[body as usize] = true;
        }
        self.count_islands(record, &mut clusters, &apart);
        self.record(model, record, &clusters, &apart);
        self.write(model, &clusters, &apart, dt);
        let potential = self.close_gaps(model, record, overlaps)?;
        std::mem::swap(&mut self.cache.contacts, &mut self.contacts_next);
        self.solver.cache.commit();
        model.end_step();
        self.solver.clock.lap(|t| &mut t.write);
        record.energy.potential_end = model.potential_energy();
        if let Some(before) = potential {
            record.energy.recovery = record.energy.potential_end - before;
        }
        self.solver.clock.lap(|t| &mut t.record);
        self.time += dt;
        Ok(())
    }

    /// Poses the interval of the step. Returns the pairs that are to be moved apart after it.
    fn pose<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        rules: &Rules,
        dt: f64,
    ) -> Result<Option<Overlaps>, StepError> {
        let (interval, w) = (&mut self.interval, self.inverse_mass.as_slice());
        self.cache.lands |= rules.events && interval.detection.contacts.iter().any(lands);
        if rules.locates() {
            let place = |body: u32| Some(self.origin[body as usize]);
            see_from_the_start(model, interval, &self.cache.contacts, rules, place, dt, dt)?;
        }
        self.solver.clock.lap(|t| &mut t.detection);
        interval.free_velocities(model, self.time + 0.5 * dt, dt);
        if rules.events {
            find_crowds(interval, w);
        }
        interval.collect(rules, &self.cache.contacts, None, w, Span::whole(dt));
        let recovers = self.settings.recovers();
        let overlaps = recovers.then(|| find_overlaps(&self.cache.overlaps, interval, w));
        match &overlaps {
            Some(overlaps) => interval.excused.clone_from(&overlaps.open),
            None => interval.excused.clear(),
        }
        Ok(overlaps)
    }

    /// Solves the interval of the step.
    fn solve(&mut self, rules: &Rules, dt: f64) -> Result<(), StepError> {
        let (interval, solution) = (&self.interval, &mut self.solution);
        let w = self.inverse_mass.as_slice();
        self.solver.solve(interval, solution, w, rules);
        if rules.locates() {
            release_lone(interval, solution, rules, w, dt);
        }
        solution.end_velocities(interval, w);
        check_finite(&solution.end, self.time)
    }

    /// Steps clusters of bodies that collide within the step.
    fn locate<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        rules: &Rules,
        dt: f64,
    ) -> Result<Vec<Cluster>, StepError> {
        let clusters = if rules.locates() {
            let context = Context {
                main: &self.interval,
                trial: &self.solution,
                cache: &self.cache.contacts,
                rules: *rules,
                inverse_mass: &self.inverse_mass,
                origin: &self.origin,
                time: self.time,
                dt,
            };
            locate_impacts(model, &mut self.solver, &context)?
        } else {
            Vec::new()
        };
        self.solver.clock.lap(|t| &mut t.solve);
        Ok(clusters)
    }

    /// Counts the work of all islands, and results and problems of those that are not all `apart`.
    fn count_islands(&mut self, record: &mut StepRecord, clusters: &mut [Cluster], apart: &[bool]) {
        let (interval, solution) = (&self.interval, &mut self.solution);
        let mut counts = vec![false; solution.outcomes.len()];
        for (k, outcome) in solution.outcomes.iter().enumerate() {
            outcome.count_work(record);
            let mut blocks = solution.islands.blocks(k).iter();
            counts[k] = blocks.any(|&i| is_used(interval, apart, i as usize));
            if counts[k] {
                outcome.count(record);
            }
        }
        if self.solver.keep {
            let problems = solution.problems.drain(..).zip(&counts);
            let used = problems.filter_map(|(problem, used)| used.then_some(problem));
            self.problems.extend(used);
            let located = clusters.iter_mut().map(|c| &mut c.problems);
            located.for_each(|own| self.problems.append(own));
        }
    }

    /// Records contacts and energies, of the interval and of the clusters that are `apart` from it.
    fn record<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &M,
        record: &mut StepRecord,
        clusters: &[Cluster],
        apart: &[bool],
    ) {
        let (interval, solution) = (&self.interval, &mut self.solution);
        let (w, next) = (self.inverse_mass.as_slice(), &mut self.contacts_next);
        next.clear();
        let used = |i: usize| is_used(interval, apart, i);
        record_interval(interval, solution, used, w, record.time, record, next);
        record.energy.forces += forces_work(interval, solution, w, |body| !apart[body]);
        for cluster in clusters {
            record.add(&cluster.record);
            next.extend(cluster.contacts.entries().iter().copied());
            for (&body, u) in cluster.bodies.iter().zip(&cluster.end) {
                solution.end[body as usize] = *u;
            }
        }
        record.energy.kinetic_end = kinetic(&solution.end, w);
        let own = [&interval.start, &solution.end].map(|u| model.kinetic_energy(u));
        if let [Some(start), Some(end)] = own {
            let energy = &mut record.energy;
            let change = energy.kinetic_end - energy.kinetic_start;
            energy.forces += end - start - change;
            (energy.kinetic_start, energy.kinetic_end) = (start, end);
        }
        self.solver.clock.lap(|t| &mut t.record);
    }

    /// Gives the model its velocities and poses at the end of the step.
    fn write<M: MultibodyModel + ?Sized>(
        &self,
        model: &mut M,
        clusters: &[Cluster],
        apart: &[bool],
        dt: f64,
    ) {
        let end = &self.solution.end;
        model.set_velocities(end);
        for body in (0..apart.len()).filter(|&body| !apart[body]) {
            model.shift(body, &end[body], 0.5 * dt);
        }
        for cluster in clusters {
            for (&body, place) in cluster.bodies.iter().zip(&cluster.configuration) {
                model.set_configuration(body as usize, place);
            }
        }
    }

    /// Closes gaps of joints and moves overlapped pairs apart, by position alone. Returns the
    /// potential energy \[J\] before, where anything may have moved.
    fn close_gaps<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        record: &mut StepRecord,
        overlaps: Option<Overlaps>,
    ) -> Result<Option<f64>, StepError> {
        let (interval, solution, w) = (&self.interval, &self.solution, &self.inverse_mass);
        let unclosed = !solution.unclosed.is_empty();
        let moves = unclosed || overlaps.as_ref().is_some_and(|o| !o.open.is_empty());
        let potential = moves.then(|| model.potential_energy());
        if unclosed {
            close_joints(model, interval, solution, w, &mut self.solver)?;
        }
        if let Some(mut overlaps) = overlaps {
            let (open, solver) = (&mut overlaps.open, &mut self.solver);
            let moves = part_overlaps(open, interval, solution, w, record.dt, solver);
            record.recovering = overlaps.open.len();
            self.cache.overlaps = overlaps;
            for (body, d) in moves {
                model.shift(body as usize, &d, 1.0);
            }
        }
        Ok(potential)
    }
}

/// Whether a block is recorded with the interval: all its bodies are solved there.
fn is_used(interval: &Interval, apart: &[bool], block: usize) -> bool {
    let mut sides = interval.sides[block].iter().filter(|b| **b != NO_BODY);
    sides.all(|b| !apart[*b as usize])
}
