//! Solves an interval: its islands one by one, or on several threads.

use super::interval::Interval;
use super::island::{Task, Worker};
use super::island_cache::IslandCache;
use super::island_problem::LARGE;
use super::outcome::IslandResult;
use super::phases::PhaseClock;
use super::rules::Rules;
use super::solution::Solution;
use super::thread_pool::SolverPool;
use super::working_set::WorkingSet;
use crate::contact::{NO_BODY, Vec2, Vec3};
use crate::solver::{FactorCache, ImpulseSolver, SEVERAL, SolveReport};

/// An island to be solved.
struct Job {
    island: usize,
    /// Work on earlier parts of it.
    earlier_work: Vec<SolveReport>,
    factors: Option<FactorCache>,
    crowd: bool,
}

/// Splits intervals into islands and solves them.
pub(super) struct IslandSolver {
    pub worker: Worker,
    /// Further threads, if any.
    pub pool: Option<SolverPool>,
    pub tolerance: f64,
    /// Whether solutions store copies of their problems.
    pub store_problems: bool,
    pub cache: IslandCache,
    pub clock: PhaseClock,
    /// Empty between two solves, kept to reuse their memory.
    set: WorkingSet,
    jobs: Vec<Job>,
}

/// Least number of blocks of an island that stores factors for the next step; smaller ones are
/// cheap to factorise.
const LEAST_BLOCKS_FOR_FACTORS: usize = 16;

impl IslandSolver {
    pub fn new(solver: Box<dyn ImpulseSolver>, tolerance: f64) -> Self {
        IslandSolver {
            worker: Worker::new(solver),
            pool: None,
            tolerance,
            store_problems: false,
            cache: IslandCache::default(),
            clock: PhaseClock::default(),
            set: WorkingSet::default(),
            jobs: Vec::new(),
        }
    }

    /// Computes the impulses of all blocks of `interval`.
    pub fn solve(
        &mut self,
        interval: &Interval,
        solution: &mut Solution,
        inverse_mass: &[Vec3],
        rules: &Rules,
    ) {
        solution.begin(interval);
        let sides = interval.sides.iter().copied();
        let plain = interval.roles.dominance.is_empty() && !rules.locates();
        solution.islands.merge_all(rules.one_problem && plain);
        (solution.islands).build(inverse_mass.len(), sides);
        if interval.blocks.is_empty() {
            return;
        }
        if interval.roles.dominance.is_empty() {
            let mut set = std::mem::take(&mut self.set);
            match rules.distant {
                _ if interval.driven_from.is_some() => set.add(interval.blocks.len()),
                true => set.begin_with_all(interval.blocks.len()),
                false => set.begin_with_near(interval, &solution.islands),
            }
            while !self.solve_set(&mut set, interval, solution, inverse_mass, rules) {}
            solution.finish(set.results());
            self.set = set;
        } else {
            let results = self.solve_levels(interval, solution, inverse_mass, rules);
            solution.finish(results.iter().flatten());
        }
    }

    /// Solves the islands of higher dominance before those they act on.
    fn solve_levels(
        &mut self,
        interval: &Interval,
        solution: &mut Solution,
        inverse_mass: &[Vec3],
        rules: &Rules,
    ) -> Vec<Option<IslandResult>> {
        let islands = std::mem::take(&mut solution.islands);
        // bodies that act on each other in both directions have the same dominance
        let level = |k: usize| {
            let sides = interval.sides[islands.blocks(k)[0] as usize];
            let own = sides.iter().find(|b| **b != NO_BODY);
            own.map_or(0, |b| interval.roles.dominance[*b as usize])
        };
        let mut order: Vec<(i16, usize)> = (0..islands.len()).map(|k| (level(k), k)).collect();
        order.sort_by_key(|&(level, k)| (std::cmp::Reverse(level), k));
        let mut results: Vec<Option<IslandResult>> = order.iter().map(|_| None).collect();
        let mut last = None;
        for (level, k) in order {
            if last != Some(level) {
                solution.end_velocities(interval, inverse_mass);
                last = Some(level);
            }
            let members = islands.blocks(k);
            solution.add_higher(interval, members);
            let job = self.job(k, members, Vec::new(), interval);
            let task = self.task(interval, solution, inverse_mass, rules);
            let result = self.solve_here(job, members, task);
            solution.store(interval, members, self.worker.impulses(), &result);
            results[k] = Some(result);
        }
        solution.islands = islands;
        results
    }

    fn task<'a>(
        &self,
        interval: &'a Interval,
        solution: &'a Solution,
        inverse_mass: &'a [Vec3],
        rules: &'a Rules,
    ) -> Task<'a> {
        Task {
            interval,
            solution,
            inverse_mass,
            rules,
            tolerance: self.tolerance,
            store_problems: self.store_problems,
        }
    }

    /// An island with its data from the cache.
    fn job(
        &mut self,
        island: usize,
        members: &[u32],
        earlier_work: Vec<SolveReport>,
        interval: &Interval,
    ) -> Job {
        let mut keys = members.iter().map(|&i| interval.key(i as usize));
        let crowd = members.len() > LARGE
            && self.cache.is_crowd(
                keys.clone(),
                interval.whole && interval.driven_from.is_none(),
            );
        let stores = members.len() >= LEAST_BLOCKS_FOR_FACTORS && interval.whole;
        let first = keys.next().filter(|_| stores);
        Job {
            island,
            earlier_work,
            factors: first.map(|first| self.cache.take_factors(&first)),
            crowd,
        }
    }

    /// Stores an island's data for the next step.
    fn store(
        &mut self,
        members: &[u32],
        factors: Option<FactorCache>,
        crowd: bool,
        interval: &Interval,
    ) {
        let mut keys = members.iter().map(|&i| interval.key(i as usize));
        (self.cache).store_crowd(keys.clone(), interval.whole, crowd);
        if let (Some(factors), Some(first)) = (factors, keys.next()) {
            self.cache.store_factors(first, factors);
        }
    }

    /// Solves an island on the caller's thread.
    fn solve_here(&mut self, mut job: Job, members: &[u32], task: Task) -> IslandResult {
        let memory = (job.factors.as_mut(), job.crowd);
        let mut result = (self.worker).solve_island(members, memory, task, &mut self.clock);
        self.store(members, job.factors, result.outcome.crowd, task.interval);
        add_work(&mut result, &job.earlier_work);
        self.clock.lap(|t| &mut t.solve);
        result
    }

    /// Solves the islands of the working set that are not solved yet. Returns `false` if contacts
    /// outside the set would be closed: they are then added to the set, and their islands are left
    /// for the next round.
    fn solve_set(
        &mut self,
        set: &mut WorkingSet,
        interval: &Interval,
        solution: &mut Solution,
        inverse_mass: &[Vec3],
        rules: &Rules,
    ) -> bool {
        let mut islands = std::mem::take(&mut solution.islands);
        let all = set.group(interval, &mut islands, inverse_mass.len());
        // prepare all islands before the first solve, so that none depends on another
        let mut jobs = std::mem::take(&mut self.jobs);
        for k in 0..islands.len() {
            let members = islands.blocks(k);
            if let Some(earlier_work) = set.begin(members) {
                jobs.push(self.job(k, members, earlier_work, interval));
            }
        }
        // all threads sweep the parts of one large crowd
        let in_parts = |job: &Job| job.crowd && islands.blocks(job.island).len() >= SEVERAL;
        jobs.sort_by_key(|job| !in_parts(job));
        let crowds = jobs.partition_point(in_parts);
        let sizes = (jobs[crowds..].iter()).map(|job| islands.blocks(job.island).len());
        let shared = match self.pool.as_mut().is_some_and(|pool| pool.shares(sizes)) {
            true => jobs.split_off(crowds),
            false => Vec::new(),
        };
        for job in jobs.drain(..) {
            let members = islands.blocks(job.island);
            let task = self.task(interval, solution, inverse_mass, rules);
            let result = self.solve_here(job, members, task);
            solution.store(interval, members, self.worker.impulses(), &result);
            set.store(members[0], result);
        }
        if !shared.is_empty() {
            let task = self.task(interval, solution, inverse_mass, rules);
            let solved = self.solve_on_threads(shared, |island| islands.blocks(island), task);
            for (island, result, impulses) in solved {
                let members = islands.blocks(island);
                solution.store(interval, members, &impulses, &result);
                set.store(members[0], result);
            }
            self.clock.lap(|t| &mut t.solve);
        }
        (solution.islands, self.jobs) = (islands, jobs);
        if all {
            return true;
        }
        solution.end_velocities(interval, inverse_mass);
        set.include_closed(interval, solution)
    }

    /// Solves islands on all threads. Returns their numbers, results and impulses in the order of
    /// the jobs.
    fn solve_on_threads<'a>(
        &mut self,
        jobs: Vec<Job>,
        members: impl Fn(usize) -> &'a [u32] + Sync,
        task: Task,
    ) -> Vec<(usize, IslandResult, Vec<Vec2>)> {
        let one = |worker: &mut Worker, clock: &mut PhaseClock, mut job: Job| {
            let memory = (job.factors.as_mut(), job.crowd);
            let result = worker.solve_island(members(job.island), memory, task, clock);
            (job, result, worker.impulses().to_vec())
        };
        self.clock.lap(|t| &mut t.assembly);
        let Some(pool) = &mut self.pool else {
            return Vec::new();
        };
        // each thread has islands of its own now
        let threads = std::mem::take(&mut self.worker.crowd.threads);
        let solved = pool.solve(&mut self.worker, &mut self.clock, jobs, one);
        self.worker.crowd.threads = threads;
        let store = |(job, mut result, impulses): (Job, IslandResult, _)| {
            let own = members(job.island);
            self.store(own, job.factors, result.outcome.crowd, task.interval);
            add_work(&mut result, &job.earlier_work);
            (job.island, result, impulses)
        };
        solved.into_iter().map(store).collect()
    }
}

/// Adds the work on earlier parts of an island.
fn add_work(result: &mut IslandResult, earlier_work: &[SolveReport]) {
    for earlier in earlier_work {
        result.outcome.report = result.outcome.report.after(earlier);
    }
}
