//! The stepper: its settings and its state between steps.

use super::contact_cache::Landing;
use super::contact_cache::{CachedContact, CachedContacts, ContactCache};
use super::interval::{Interval, movable};
use super::island_cache::IslandCacheState;
use super::model::{Configuration, ContactKey};
use super::outcome::SolvedProblem;
use super::phases::{Clock, PhaseClock, Phases};
use super::pulled_links::StiffLink;
use super::record::ContactRecord;
use super::resting::RestingIslands;
use super::rules::Scheme;
use super::settings::{MOST_THREADS, StepError, StepperSettings};
use super::shown::Shows;
use super::solution::Solution;
use super::solve::IslandSolver;
use super::thread_pool::SolverPool;
use crate::contact::{NO_BODY, Rows, Vec3};
use crate::solver::{ImpulseSolver, Judged, SolverTable, find_solver, solver_by_name};
use crate::threads::Threads;
use serde::{Deserialize, Serialize};

/// Moreau's midpoint step with certified impulses: equations (1) to (6) of [`crate::dynamics`].
pub struct MoreauStepper {
    pub(super) settings: StepperSettings,
    table: SolverTable,
    pub(super) solver: IslandSolver,
    pub(super) threads: Threads,
    pub(super) time: f64,
    pub(super) cache: ContactCache,
    pub(super) resting: RestingIslands,
    /// Cache entries that the current step writes; they replace the cache when the step succeeds.
    pub(super) contacts_next: CachedContacts,
    pub(super) landings_next: Vec<Landing>,
    pub(super) reserves_next: Vec<f64>,
    pub(super) interval: Interval,
    pub(super) solution: Solution,
    /// Problems of the last step, if they are stored.
    pub(super) problems: Vec<SolvedProblem>,
    pub(super) origin: Vec<Configuration>,
    /// The masses of the step, with the added inertia of `stiff` links.
    pub(super) inverse_mass: Vec<Vec3>,
    pub(super) stiff: Vec<StiffLink>,
    /// Displacements that moved overlapping bodies apart after the last step.
    pub(super) parted: Vec<(u32, Vec3)>,
    pub(super) shows: Shows,
    /// Whether the solver is that of the settings.
    named: bool,
}

/// State of a stepper between two steps: the two caches, the islands at rest and the time. `PipelineState` of the rapier
/// adapter includes it in a saved state.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct StepperState {
    time: f64,
    contacts: ContactCache,
    islands: IslandCacheState,
    resting: RestingIslands,
}

impl MoreauStepper {
    /// A stepper at t = 0 without cached contacts.
    ///
    /// # Errors
    /// [`StepError::Solver`], [`StepError::Tolerance`], [`StepError::Events`],
    /// [`StepError::Threads`], [`StepError::Spawn`].
    pub fn new(settings: StepperSettings) -> Result<Self, StepError> {
        MoreauStepper::with_solvers(settings, solver_by_name)
    }

    /// Like [`MoreauStepper::new`], with solvers of your own beside those of the core: `table` is
    /// asked for a name in the settings that the core does not know. The stepper judges what such a
    /// solver returns. Each thread has one of its own.
    ///
    /// # Errors
    /// Those of [`MoreauStepper::new`].
    pub fn with_solvers(settings: StepperSettings, table: SolverTable) -> Result<Self, StepError> {
        let solver = find_solver(&settings.solver, table)
            .ok_or_else(|| StepError::Solver(settings.solver.clone()))?;
        if !(settings.tolerance > 0.0 && settings.tolerance.is_finite()) {
            return Err(StepError::Tolerance(settings.tolerance));
        }
        if settings.events && settings.scheme == Scheme::Moreau {
            return Err(StepError::Events);
        }
        let mut solver = IslandSolver::new(solver, settings.tolerance);
        let threads = start(settings.threads)?;
        solver.pool = SolverPool::new(&threads, &settings.solver, table)?;
        solver.worker.crowd.threads = threads.clone();
        Ok(MoreauStepper {
            solver,
            threads,
            settings,
            table,
            time: 0.0,
            cache: ContactCache::default(),
            resting: RestingIslands::default(),
            contacts_next: CachedContacts::default(),
            landings_next: Vec::new(),
            reserves_next: Vec::new(),
            interval: Interval {
                whole: true,
                ..Interval::default()
            },
            solution: Solution::default(),
            problems: Vec::new(),
            origin: Vec::new(),
            inverse_mass: Vec::new(),
            stiff: Vec::new(),
            parted: Vec::new(),
            shows: Shows::default(),
            named: true,
        })
    }

    /// Time at the end of the last step \[s\].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The current settings.
    pub fn settings(&self) -> &StepperSettings {
        &self.settings
    }

    /// Uses the user's own solver instead of that of the settings, from the next step on. The
    /// stepper judges its results; its own reports do not count. There is only one such solver, so
    /// all islands are solved on the caller's thread.
    pub fn set_solver(&mut self, solver: Box<dyn ImpulseSolver>) {
        self.solver.worker.solver = Box::new(Judged::new(solver));
        self.solver.pool = None;
        self.solver.cache.clear();
        self.end_rest();
        self.named = false;
    }

    /// Changes the number of threads of the settings, see [`StepperSettings::threads`]: for example
    /// after a state is resumed on another machine.
    ///
    /// # Errors
    /// [`StepError::Threads`], [`StepError::Spawn`]. Nothing changes then.
    pub fn set_threads(&mut self, threads: usize) -> Result<(), StepError> {
        let started = start(threads)?;
        let pool = SolverPool::new(&started, &self.settings.solver, self.table)?;
        self.solver.pool = pool.filter(|_| self.named);
        self.solver.worker.crowd.threads = started.clone();
        self.threads = started;
        self.settings.threads = threads;
        Ok(())
    }

    /// The threads, for the work of a host within a step.
    pub(crate) fn threads(&self) -> &Threads {
        &self.threads
    }

    /// The state that the next step depends on.
    pub(crate) fn state(&self) -> StepperState {
        StepperState {
            time: self.time,
            contacts: self.cache.clone(),
            islands: self.solver.cache.state(),
            resting: self.resting.saved(),
        }
    }

    /// Restores the state that [`MoreauStepper::state`] returned.
    pub(crate) fn restore(&mut self, state: &StepperState) {
        self.time = state.time;
        self.cache = state.contacts.clone();
        self.solver.cache.restore(&state.islands);
        self.resting = state.resting.clone();
    }

    /// Returns the cache entries of contacts and joints between bodies that all have a number of
    /// `group`, as (number, key, entry). A step without those bodies removes them from the cache.
    pub(crate) fn set_aside(
        &mut self,
        group: impl Fn(u32) -> u32,
    ) -> Vec<(u32, ContactKey, CachedContact)> {
        let resting = self.resting.set_aside(&group);
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
            let cached = self.cache.contacts.get(key).filter(|_| own != 0)?;
            Some((own, *key, *cached))
        };
        resting.into_iter().chain(all.filter_map(of)).collect()
    }

    /// Ends the rest of all islands, after a change that nothing else shows.
    pub(crate) fn end_rest(&mut self) {
        self.resting.end_all(&mut self.cache, 0);
    }

    /// Contacts of the islands that rest in this step; detection leaves them out.
    pub(crate) fn resting_contacts(&self) -> impl Iterator<Item = &ContactRecord> {
        self.resting.contacts()
    }

    /// Displacements [m, m, rad] that moved overlapping bodies apart after the last step.
    pub(crate) fn parted(&self) -> &[(u32, Vec3)] {
        &self.parted
    }

    /// Restores the entries that [`MoreauStepper::set_aside`] returned.
    pub(crate) fn take_back(&mut self, contacts: &[(ContactKey, CachedContact)]) {
        self.cache.take_back(contacts);
    }

    /// Follows bodies whose numbers change between two steps: `before` has the old number of each, or
    /// [`NO_BODY`] for a new one.
    pub(crate) fn renumber(&mut self, before: &[u32]) {
        self.cache.renumber(before);
    }

    /// Whether to store the problems of every step for [`MoreauStepper::problems`]; off by default.
    pub fn keep_problems(&mut self, keep: bool) {
        self.solver.store_problems = keep;
        self.problems.clear();
    }

    /// Measures the time of each phase of a step with `clock` from now on, see
    /// [`MoreauStepper::phases`]. `None` stops it. Off by default.
    pub fn time_phases(&mut self, clock: Option<Clock>) {
        self.solver.clock.switch(clock);
    }

    /// Timings of all steps since [`MoreauStepper::time_phases`].
    pub fn phases(&self) -> Phases {
        self.solver.clock.phases
    }

    /// The clock, for the work of a host before and after a step.
    pub(crate) fn clock(&mut self) -> &mut PhaseClock {
        &mut self.solver.clock
    }

    /// The contact problems of the last step, one per island: those of located impacts and then those
    /// of islands at rest, as they were solved last, come at the end. Empty
    /// unless they are stored.
    pub fn problems(&self) -> &[SolvedProblem] {
        &self.problems
    }
}

/// # Errors
/// [`StepError::Threads`] unless there are 1 to [`MOST_THREADS`]; [`StepError::Spawn`] if the system
/// cannot start them.
fn start(threads: usize) -> Result<Threads, StepError> {
    if !(1..=MOST_THREADS).contains(&threads) {
        return Err(StepError::Threads(threads));
    }
    Threads::new(threads).map_err(|why| StepError::Spawn { threads, why })
}
