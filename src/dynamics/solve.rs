//! The contact problems of a stage, one an island.

use super::crew::Crew;
use super::island::{IslandOutcome, Solved, SolvedProblem, Task, Worker};
use super::island_cache::IslandCache;
use super::islands::Islands;
use super::jam::{Jam, LARGE};
use super::part::{Begin, Part};
use super::phases::PhaseClock;
use super::rules::Rules;
use super::stage::Stage;
use crate::contact::{NO_BODY, Vec2, Vec3};
use crate::solver::{Carried, ImpulseSolver, SolveReport};

/// An island to be solved.
struct Job {
    island: usize,
    /// Work spent on parts of it.
    spent: Vec<SolveReport>,
    carried: Option<Carried>,
    jam: Jam,
}

/// Splits stages into islands and solves them.
pub(super) struct IslandSolver {
    pub own: Worker,
    /// Other threads, where there are any.
    pub crew: Option<Crew>,
    pub tolerance: f64,
    pub islands: Islands,
    /// Of the last stage, one an island.
    pub outcomes: Vec<IslandOutcome>,
    /// Copies of all problems of a step, where they are asked for.
    pub kept: Option<Vec<SolvedProblem>>,
    pub cache: IslandCache,
    pub clock: PhaseClock,
}

/// Blocks from which on an island carries factors from step to step: fewer are factorised at once.
const CARRIES: usize = 16;

impl IslandSolver {
    pub fn new(solver: Box<dyn ImpulseSolver>, tolerance: f64) -> Self {
        IslandSolver {
            own: Worker::new(solver),
            crew: None,
            tolerance,
            islands: Islands::default(),
            outcomes: Vec::new(),
            kept: None,
            cache: IslandCache::default(),
            clock: PhaseClock::default(),
        }
    }

    /// Begins a step.
    pub fn begin(&mut self) {
        if let Some(kept) = &mut self.kept {
            kept.clear();
        }
        self.cache.begin();
    }

    /// Number of problems kept so far.
    pub fn kept_count(&self) -> usize {
        self.kept.as_ref().map_or(0, Vec::len)
    }

    /// Takes out the problems kept since there were `count`.
    pub fn take_kept(&mut self, count: usize) -> Vec<SolvedProblem> {
        let kept = self.kept.as_mut();
        kept.map_or(Vec::new(), |all| all.split_off(count.min(all.len())))
    }

    /// Finds the impulses of all blocks of `stage`.
    pub fn solve(&mut self, stage: &mut Stage, inverse_mass: &[Vec3], rules: &Rules) {
        (self.islands).build(inverse_mass.len(), stage.sides.iter().copied());
        self.outcomes.clear();
        if self.cache.any_fallback() {
            stage.before.clone_from(&stage.impulses);
        }
        if stage.standing.dominance.is_empty() {
            let mut part = Part::near(stage, &self.islands);
            while !self.solve_part(&mut part, stage, inverse_mass, rules) {}
            for (outcome, kept) in part.into_solved() {
                self.outcomes.push(outcome);
                if let Some(all) = &mut self.kept {
                    all.extend(kept);
                }
            }
            stage.loose.sort_unstable();
            return;
        }
        // bodies that press on each other both ways are of one dominance
        let level = |k: usize| {
            let sides = stage.sides[self.islands.blocks(k)[0] as usize];
            let own = sides.iter().find(|b| **b != NO_BODY);
            own.map_or(0, |b| stage.standing.dominance[*b as usize])
        };
        let mut order: Vec<(i16, usize)> = (0..self.islands.len()).map(|k| (level(k), k)).collect();
        order.sort_by_key(|&(level, k)| (std::cmp::Reverse(level), k));
        let task = self.task(inverse_mass, rules);
        let mut outcomes = vec![None; order.len()];
        let mut above = None;
        for (level, k) in order {
            if above != Some(level) {
                stage.end_velocities(inverse_mass);
                above = Some(level);
            }
            stage.look_up(self.islands.blocks(k));
            let job = self.job(k, Vec::new(), stage);
            let (outcome, kept) = self.solve_here(job, stage, task);
            outcomes[k] = Some(outcome);
            if let Some(all) = &mut self.kept {
                all.extend(kept);
            }
        }
        self.outcomes.extend(outcomes.into_iter().flatten());
        stage.loose.sort_unstable();
    }

    fn task<'a>(&self, inverse_mass: &'a [Vec3], rules: &'a Rules) -> Task<'a> {
        Task {
            inverse_mass,
            rules,
            tolerance: self.tolerance,
            keep: self.kept.is_some(),
        }
    }

    /// Takes out what an island of a step carried from the last one.
    fn job(&mut self, island: usize, spent: Vec<SolveReport>, stage: &Stage) -> Job {
        let members = self.islands.blocks(island);
        let carries = members.len() >= CARRIES && stage.whole;
        let key = stage.key(members[0] as usize);
        let jam = if members.len() > LARGE {
            let keys = members.iter().map(|&i| stage.key(i as usize));
            self.cache.fallback(keys, stage.whole)
        } else {
            Jam::default()
        };
        let carried = carries.then(|| self.cache.take_factors(&key));
        Job {
            island,
            spent,
            carried,
            jam,
        }
    }

    /// Notes what became of an island.
    fn settle(
        &mut self,
        job: Job,
        solved: Solved,
        impulses: &[Vec2],
        stage: &mut Stage,
    ) -> (IslandOutcome, Option<SolvedProblem>) {
        let members = self.islands.blocks(job.island);
        let key = stage.key(members[0] as usize);
        let keys = members.iter().map(|&i| stage.key(i as usize));
        self.cache.keep_fallback(keys, stage.whole, job.jam);
        if let Some(carried) = job.carried {
            self.cache.keep_factors(key, carried);
        }
        let (mut outcome, kept) = solved.settle(members, impulses, stage);
        for earlier in job.spent {
            outcome.report = outcome.report.after(&earlier);
        }
        (outcome, kept)
    }

    /// Solves an island on the caller's thread.
    fn solve_here(
        &mut self,
        mut job: Job,
        stage: &mut Stage,
        task: Task,
    ) -> (IslandOutcome, Option<SolvedProblem>) {
        let members = self.islands.blocks(job.island);
        let kept = (job.carried.as_mut(), &mut job.jam);
        let solved = (self.own).solve_island(members, kept, stage, task, &mut self.clock);
        let impulses = std::mem::take(self.own.impulses());
        let settled = self.settle(job, solved, &impulses, stage);
        *self.own.impulses() = impulses;
        self.clock.lap(|t| &mut t.solve);
        settled
    }

    /// Solves those islands of a part that are not solved yet. `false` if contacts that were left
    /// out would be closed: the part holds them now, and their islands wait.
    fn solve_part(
        &mut self,
        part: &mut Part,
        stage: &mut Stage,
        inverse_mass: &[Vec3],
        rules: &Rules,
    ) -> bool {
        let taken: Vec<u32> = (0..stage.blocks.len() as u32)
            .filter(|&i| part.taken[i as usize])
            .collect();
        if taken.len() < stage.blocks.len() || part.round > 0 {
            (self.islands).build_of(inverse_mass.len(), &taken, &stage.sides);
        }
        // all are taken up before any is solved: none depends on the others then
        let mut jobs = Vec::with_capacity(self.islands.len());
        for k in 0..self.islands.len() {
            if let Begin::Anew(spent) = part.begin(self.islands.blocks(k), stage) {
                jobs.push(self.job(k, spent, stage));
            }
        }
        let task = self.task(inverse_mass, rules);
        let sizes = jobs.iter().map(|job| self.islands.blocks(job.island).len());
        if let Some(crew) = &mut self.crew
            && crew.shares(sizes)
        {
            let (still, islands): (&Stage, _) = (stage, &self.islands);
            let one = |worker: &mut Worker, clock: &mut PhaseClock, mut job: Job| {
                let members = islands.blocks(job.island);
                let kept = (job.carried.as_mut(), &mut job.jam);
                let solved = worker.solve_island(members, kept, still, task, clock);
                (job, solved, worker.impulses().clone())
            };
            self.clock.lap(|t| &mut t.assembly);
            for (job, solved, impulses) in crew.solve(&mut self.own, &mut self.clock, jobs, one) {
                let first = self.islands.blocks(job.island)[0];
                let (outcome, kept) = self.settle(job, solved, &impulses, stage);
                part.keep(first, outcome, kept);
            }
            self.clock.lap(|t| &mut t.solve);
        } else {
            for job in jobs {
                let first = self.islands.blocks(job.island)[0];
                let (outcome, kept) = self.solve_here(job, stage, task);
                part.keep(first, outcome, kept);
            }
        }
        if taken.len() == stage.blocks.len() {
            return true;
        }
        stage.end_velocities(inverse_mass);
        part.take_closed(stage)
    }
}
