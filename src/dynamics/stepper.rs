use super::cluster::Context;
use super::contact_cache::{CachedContact, CachedContacts, ContactCache};
use super::crew::{Crew, MOST_THREADS};
use super::events::{self, find_crowds, lands, release_lone, see_from_the_start};
use super::interval::{Interval, movable};
use super::island_cache::IslandCacheState;
use super::joint_recovery::close_joints;
use super::kinetic::kinetic;
use super::model::{Configuration, ContactKey, ModelError, MultibodyModel};
use super::outcome::SolvedProblem;
use super::phases::{PhaseClock, Phases};
use super::record::StepRecord;
use super::recording::{forces_work, record_interval};
use super::recovery::{find_overlaps, part_overlaps};
use super::rules::{ImpactLaw, Rules, Scheme, Span};
use super::solution::Solution;
use super::solve::IslandSolver;
use super::standing::Standing;
use crate::contact::{NO_BODY, Rows, Vec3};
use crate::solver::{ImpulseSolver, Judged, Shares, solver_by_name};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// How a [`MoreauStepper`] steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepperSettings {
    pub scheme: Scheme,
    /// Impacts are located in time inside the step; needs [`Scheme::Staggered`].
    pub events: bool,
    /// What impacts return; the published scheme knows no cap.
    pub impact_law: ImpactLaw,
    /// Whether pairs that start overlapped are moved apart; [`Scheme::Moreau`] never does.
    pub recovery: bool,
    /// How a load is shared out among redundant contacts.
    pub shares: Shares,
    /// A name of [`crate::solver::SOLVERS`].
    pub solver: String,
    /// Relative natural-map residual at which an island counts as solved.
    pub tolerance: f64,
    /// Threads that islands are shared out among, 1 to [`MOST_THREADS`]; nothing that is computed depends on it.
    ///
    /// It pays from some hundred contacts in several islands on: one island is solved on one thread,
    /// and so are islands with dominance and all that a solver of the user's own solves.
    #[serde(default = "one")]
    pub threads: usize,
}

fn one() -> usize {
    1
}

impl Default for StepperSettings {
    fn default() -> Self {
        StepperSettings {
            scheme: Scheme::Staggered,
            events: false,
            impact_law: ImpactLaw::Capped,
            recovery: true,
            shares: Shares::Found,
            solver: "auto".to_owned(),
            tolerance: 1e-8,
            threads: one(),
        }
    }
}

impl StepperSettings {
    fn rules(&self) -> Rules {
        Rules {
            scheme: self.scheme,
            law: self.impact_law,
            shares: self.shares,
            events: self.events,
            sweeps: false,
        }
    }

    fn recovers(&self) -> bool {
        self.recovery && self.scheme == Scheme::Staggered
    }
}

/// Why a step could not be taken.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum StepError {
    /// The step length is not a positive finite number.
    #[error("step length is {0} s, must be finite and above 0")]
    Dt(f64),
    /// Settings name a solver that does not exist.
    #[error("unknown solver '{0}'")]
    Solver(String),
    /// The tolerance is not a positive finite number.
    #[error("solver tolerance is {0}, must be finite and above 0")]
    Tolerance(f64),
    /// No number of threads.
    #[error("threads are {0}, must be 1 to {MOST_THREADS}")]
    Threads(usize),
    /// The system does not give so many threads.
    #[error("{threads} threads cannot be started: {why}")]
    Spawn { threads: usize, why: String },
    /// Event location with a scheme that ignores gaps.
    #[error("event location needs the scheme 'staggered'; 'moreau' ignores gaps")]
    Events,
    /// A velocity or position is NaN or infinite; the model stands as it did before.
    #[error("body {body} has a velocity that is not finite at t = {time} s")]
    NonFinite { body: usize, time: f64 },
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// Moreau's midpoint step with certified impulses: equations (1) to (6) of [`crate::dynamics`].
pub struct MoreauStepper {
    settings: StepperSettings,
    solver: IslandSolver,
    time: f64,
    cache: ContactCache,
    /// The next step's contacts.
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

/// What a stepper takes from one step to the next.
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
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(StepError::Dt(dt));
        }
        self.solver.clock.start();
        model.begin_step(dt)?;
        self.solver.cache.begin();
        self.problems.clear();
        let start = &mut self.interval.start;
        start.clear();
        start.extend_from_slice(model.velocities());
        check_finite(start, self.time)?;
        self.inverse_mass.clear();
        self.inverse_mass.extend_from_slice(model.inverse_mass());
        self.origin.clear();
        let bodies = self.interval.start.len();
        self.origin
            .extend((0..bodies).map(|body| model.configuration(body)));
        let result = self.step_from_start(model, dt);
        if result.is_err() {
            self.solver.cache.drop_step();
            model.set_velocities(&self.interval.start);
            for (body, place) in self.origin.iter().enumerate() {
                model.set_configuration(body, place);
            }
        }
        result
    }

    fn step_from_start<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        dt: f64,
    ) -> Result<StepRecord, StepError> {
        let mut rules = self.settings.rules();
        match model.standing() {
            Some(standing) => self.interval.standing.clone_from(standing),
            None => self.interval.standing = Standing::default(),
        }
        // event location follows all that is fast: sweeps add to it only what was asked for
        let sweeps = &self.interval.standing.sweeps;
        let asked = sweeps.iter().any(|s| s.all);
        rules.sweeps = rules.corrects_gaps() && (asked || !rules.events && !sweeps.is_empty());
        let (interval, solution) = (&mut self.interval, &mut self.solution);
        let w = self.inverse_mass.as_slice();
        let mut record = StepRecord {
            time: self.time + dt,
            dt,
            accounted: true,
            ..StepRecord::default()
        };
        record.energy.potential_start = model.potential_energy();
        record.energy.kinetic_start = kinetic(&interval.start, w);

        model.advance(0.5 * dt);
        // a crowd that lands must be seen a step before it closes: see `find_crowds`
        let ahead = if rules.events && self.cache.lands {
            2.0 * dt
        } else {
            dt
        };
        interval.detect(model, ahead)?;
        self.cache.lands |= rules.events && interval.detection.contacts.iter().any(lands);
        if rules.locates() {
            let place = |body: u32| Some(self.origin[body as usize]);
            see_from_the_start(model, interval, &self.cache.contacts, &rules, place, dt, dt)?;
        }
        self.solver.clock.lap(|t| &mut t.detection);
        interval.free_velocities(model, self.time + 0.5 * dt, dt);
        if rules.events {
            find_crowds(interval, w);
        }
        interval.collect(&rules, &self.cache.contacts, None, w, Span::whole(dt));
        // kept apart until nothing can fail any more
        let recovers = self.settings.recovers();
        let overlaps = recovers.then(|| find_overlaps(&self.cache.overlaps, interval, w));
        match &overlaps {
            Some(overlaps) => interval.excused.clone_from(&overlaps.open),
            None => interval.excused.clear(),
        }
        self.solver.solve(interval, solution, w, &rules);
        if rules.locates() {
            release_lone(interval, solution, &rules, w, dt);
        }
        solution.end_velocities(interval, w);
        check_finite(&solution.end, self.time)?;

        let mut clusters = if rules.locates() {
            let context = Context {
                main: interval,
                trial: solution,
                memory: &self.cache.contacts,
                rules,
                inverse_mass: w,
                origin: &self.origin,
                time: self.time,
                dt,
            };
            events::run(model, &mut self.solver, &context)?
        } else {
            Vec::new()
        };
        self.solver.clock.lap(|t| &mut t.solve);
        let mut apart = vec![false; w.len()];
        for &body in clusters.iter().flat_map(|c| &c.bodies) {
            apart[body as usize] = true;
        }
        let used = |i: usize| {
            let mut sides = interval.sides[i].iter().filter(|b| **b != NO_BODY);
            sides.all(|b| !apart[*b as usize])
        };
        let mut counts = vec![false; solution.outcomes.len()];
        for (k, outcome) in solution.outcomes.iter().enumerate() {
            outcome.count_work(&mut record);
            counts[k] = solution.islands.blocks(k).iter().any(|&i| used(i as usize));
            if counts[k] {
                outcome.count(&mut record);
            }
        }
        if self.solver.keep {
            let problems = solution.problems.drain(..).zip(&counts);
            let used = problems.filter_map(|(problem, used)| used.then_some(problem));
            self.problems.extend(used);
            let located = clusters.iter_mut().map(|c| &mut c.problems);
            located.for_each(|own| self.problems.append(own));
        }

        self.contacts_next.clear();
        let end = self.time + dt;
        record_interval(
            interval,
            solution,
            used,
            w,
            end,
            &mut record,
            &mut self.contacts_next,
        );
        record.energy.forces += forces_work(interval, solution, w, |body| !apart[body]);
        for cluster in &clusters {
            record.add(&cluster.record);
            let memory = cluster.memory.entries();
            self.contacts_next.extend(memory.iter().copied());
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
        model.set_velocities(&solution.end);
        for body in (0..apart.len()).filter(|&body| !apart[body]) {
            model.shift(body, &solution.end[body], 0.5 * dt);
        }
        for cluster in &clusters {
            for (&body, place) in cluster.bodies.iter().zip(&cluster.configuration) {
                model.set_configuration(body as usize, place);
            }
        }
        let moves =
            !solution.unclosed.is_empty() || overlaps.as_ref().is_some_and(|o| !o.open.is_empty());
        let potential = moves.then(|| model.potential_energy());
        if !solution.unclosed.is_empty() {
            close_joints(model, interval, solution, w, &mut self.solver)?;
        }
        if let Some(mut overlaps) = overlaps {
            let moves = part_overlaps(
                &mut overlaps.open,
                interval,
                solution,
                w,
                dt,
                &mut self.solver,
            );
            record.recovering = overlaps.open.len();
            self.cache.overlaps = overlaps;
            for (body, d) in moves {
                model.shift(body as usize, &d, 1.0);
            }
        }
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
        Ok(record)
    }
}

pub(super) fn check_finite(velocities: &[Vec3], time: f64) -> Result<(), StepError> {
    match velocities
        .iter()
        .position(|u| u.iter().any(|x| !x.is_finite()))
    {
        Some(body) => Err(StepError::NonFinite { body, time }),
        None => Ok(()),
    }
}
