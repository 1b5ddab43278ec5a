//! Shares out the islands of an interval among threads.

use super::island::Worker;
use super::phases::PhaseClock;
use super::settings::StepError;
use crate::solver::{SolverTable, find_solver};
use crate::threads::Threads;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Blocks of a batch, the unit of work of a thread: some 10 to 100 µs, so that the overhead of a
/// batch is negligible.
const BATCH: usize = 64;

/// A solver for each thread besides the caller's.
///
/// The assignment of islands to threads varies from run to run, but no result depends on it: a
/// solve only reads the interval and its current solution, and a solver stores nothing between
/// problems.
pub(super) struct SolverPool {
    threads: Threads,
    others: Vec<PoolThread>,
    /// Islands of the interval, the largest first, and batches of them.
    order: Vec<usize>,
    batches: Vec<Range<usize>>,
}

/// What one thread works with.
struct PoolThread {
    worker: Worker,
    clock: PhaseClock,
}

impl SolverPool {
    /// A solver of that name for each of `threads`; `None` for one thread.
    ///
    /// # Errors
    /// [`StepError::Solver`].
    pub fn new(
        threads: &Threads,
        solver: &str,
        table: SolverTable,
    ) -> Result<Option<SolverPool>, StepError> {
        if threads.count() == 1 {
            return Ok(None);
        }
        let others = (1..threads.count()).map(|_| {
            let solver = find_solver(solver, table);
            Some(PoolThread {
                worker: Worker::new(solver?),
                clock: PhaseClock::default(),
            })
        });
        let others: Option<Vec<PoolThread>> = others.collect();
        Ok(Some(SolverPool {
            threads: threads.clone(),
            others: others.ok_or_else(|| StepError::Solver(solver.to_owned()))?,
            order: Vec::new(),
            batches: Vec::new(),
        }))
    }

    /// Splits islands with these numbers of blocks into batches. Returns whether there are several:
    /// a single batch is solved faster by the caller.
    pub fn shares(&mut self, sizes: impl Iterator<Item = usize>) -> bool {
        let sizes: Vec<usize> = sizes.collect();
        self.order.clear();
        self.order.extend(0..sizes.len());
        // the longest work must not start last
        self.order
            .sort_unstable_by_key(|&k| (std::cmp::Reverse(sizes[k]), k));
        self.batches.clear();
        let (mut first, mut blocks) = (0, 0);
        for (place, &k) in self.order.iter().enumerate() {
            blocks += sizes[k];
            if blocks >= BATCH || place + 1 == sizes.len() {
                self.batches.push(first..place + 1);
                (first, blocks) = (place + 1, 0);
            }
        }
        self.batches.len() > 1
    }

    /// Calls `one` on every job, one for each island given to [`SolverPool::shares`]. Returns the
    /// results in the order of the jobs.
    ///
    /// Distributes the wall time over the phases in proportion to the time that all threads spent
    /// in each.
    pub fn solve<J: Send, R: Send>(
        &mut self,
        worker: &mut Worker,
        clock: &mut PhaseClock,
        jobs: Vec<J>,
        one: impl Fn(&mut Worker, &mut PhaseClock, J) -> R + Sync,
    ) -> Vec<R> {
        let count = jobs.len();
        let mut jobs: Vec<Option<J>> = jobs.into_iter().map(Some).collect();
        let mut take = |&k: &usize| Some((k, jobs[k].take()?));
        let batches = self.batches.drain(..);
        let batches = batches.map(|b| self.order[b].iter().filter_map(&mut take).collect());
        let batches: Vec<Vec<(usize, J)>> = batches.collect();
        let helpers = self.others.len().min(batches.len().saturating_sub(1));
        let queue = Mutex::new(batches.into_iter());
        // no thread panics while it holds the queue
        let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
        let work = |(worker, clock): (&mut Worker, &mut PhaseClock)| {
            let mut done: Vec<(usize, R)> = Vec::new();
            clock.start();
            while let Some(batch) = next() {
                for (k, job) in batch {
                    done.push((k, one(worker, clock, job)));
                    clock.lap(|t| &mut t.solve);
                }
            }
            done
        };
        let others = &mut self.others[..helpers];
        let mut own_clock = clock.another();
        let mut workers = vec![(worker, &mut own_clock)];
        for thread in others.iter_mut() {
            thread.clock = clock.another();
            workers.push((&mut thread.worker, &mut thread.clock));
        }
        let done = self.threads.map(workers, work);
        let clocks = others.iter().map(|thread| &thread.clock);
        clock.lap_in_proportion(clocks.chain(std::iter::once(&own_clock)));
        let mut results: Vec<Option<R>> = (0..count).map(|_| None).collect();
        for (k, result) in done.into_iter().flatten() {
            results[k] = Some(result);
        }
        // each job was in one batch
        results.into_iter().flatten().collect()
    }
}

#[cfg(feature = "parallel")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::solver_by_name;
    use std::sync::Barrier;

    fn pool(threads: usize) -> (SolverPool, Worker) {
        let solver = solver_by_name("auto").unwrap();
        let threads = Threads::new(threads).unwrap();
        let pool = SolverPool::new(&threads, "auto", solver_by_name)
            .unwrap()
            .unwrap();
        (pool, Worker::new(solver))
    }

    /// Every island is solved once, and the results are in order, for any number of threads.
    #[test]
    fn results_come_in_the_order_of_the_islands() {
        let sizes = || (0..500).map(|k| 1 + (k * 37) % 90);
        for threads in [2, 3, 8] {
            let (mut pool, mut worker) = pool(threads);
            for _ in 0..20 {
                assert!(pool.shares(sizes()));
                let clock = &mut PhaseClock::default();
                let found = pool.solve(&mut worker, clock, (0..500).collect(), |_, _, k| k);
                assert_eq!(found, (0..500).collect::<Vec<usize>>());
            }
        }
    }

    /// Each island waits until another thread solves the other one.
    #[test]
    fn threads_work_at_the_same_time() {
        let (mut pool, mut worker) = pool(2);
        let both = Barrier::new(2);
        assert!(pool.shares([BATCH, BATCH].into_iter()));
        let clock = &mut PhaseClock::default();
        let found = pool.solve(&mut worker, clock, vec![(); 2], |_, _, ()| {
            both.wait();
            std::thread::current().id()
        });
        assert_ne!(found[0], found[1]);
    }

    #[test]
    fn what_is_one_batch_is_not_shared_out() {
        let (mut pool, _) = pool(2);
        let shared = [
            (vec![], false),
            (vec![10_000], false),
            (vec![1; BATCH], false),
            (vec![1; BATCH + 1], true),
            (vec![1, 10_000], true),
        ];
        for (sizes, expected) in shared {
            assert_eq!(pool.shares(sizes.iter().copied()), expected, "{sizes:?}");
        }
    }

    fn seconds() -> f64 {
        let now = std::time::SystemTime::now();
        now.duration_since(std::time::UNIX_EPOCH)
            .unwrap()
            .as_secs_f64()
    }

    /// The phases add up to the wall time, for any number of threads.
    #[test]
    fn phases_add_up_to_the_wall_time() {
        let (mut pool, mut worker) = pool(4);
        let mut clock = PhaseClock::default();
        clock.switch(Some(seconds));
        let start = std::time::Instant::now();
        clock.start();
        assert!(pool.shares([BATCH; 12].into_iter()));
        let pause = || std::thread::sleep(std::time::Duration::from_millis(2));
        pool.solve(&mut worker, &mut clock, vec![(); 12], |_, clock, ()| {
            pause();
            clock.lap(|t| &mut t.assembly);
            pause();
        });
        let wall = start.elapsed().as_secs_f64();
        let timings = clock.phases;
        assert!(timings.assembly > 0.0 && timings.solve > 0.0, "{timings:?}");
        // twelve islands of 4 ms on four threads take at least 12 ms
        let sum = timings.assembly + timings.solve;
        assert!((0.012..=wall).contains(&sum), "{timings:?} of {wall} s");
    }
}
