//! Threads of a pool.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Mutex, PoisonError};

/// The caller's thread, and those of a pool besides it. Copies share the pool.
#[derive(Debug, Clone, Default)]
pub(crate) struct Threads {
    others: Option<Arc<ThreadPool>>,
}

impl Threads {
    /// `count` threads, 1 or more, with the caller's.
    ///
    /// # Errors
    /// The system's reason why it cannot start them.
    pub fn new(count: usize) -> Result<Threads, String> {
        if count <= 1 {
            return Ok(Threads::default());
        }
        let pool = ThreadPoolBuilder::new()
            .num_threads(count - 1)
            .thread_name(|k| format!("moreau2d {}", k + 1))
            .build()
            .map_err(|error| error.to_string())?;
        Ok(Threads {
            others: Some(Arc::new(pool)),
        })
    }

    /// Number of threads, with the caller's.
    pub fn count(&self) -> usize {
        1 + (self.others.as_ref()).map_or(0, |pool| pool.current_num_threads())
    }

    /// [`Threads::map`] for several parts.
    pub(super) fn share_out<T: Send, R: Send>(
        &self,
        parts: Vec<T>,
        one: impl Fn(T) -> R + Sync,
    ) -> Vec<R> {
        let Some(pool) = &self.others else {
            return parts.into_iter().map(one).collect();
        };
        let count = parts.len();
        let helpers = pool.current_num_threads().min(count - 1);
        let queue = Mutex::new(parts.into_iter().enumerate());
        // no thread panics while it holds the queue
        let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
        let work = |done: &mut Vec<(usize, R)>| {
            while let Some((k, part)) = next() {
                done.push((k, one(part)));
            }
        };
        let mut own = Vec::new();
        let mut done: Vec<Vec<(usize, R)>> = (0..helpers).map(|_| Vec::new()).collect();
        pool.in_place_scope(|scope| {
            for done in &mut done {
                let work = &work;
                scope.spawn(move |_| work(done));
            }
            work(&mut own);
        });
        let mut results: Vec<Option<R>> = (0..count).map(|_| None).collect();
        for (k, result) in done.into_iter().flatten().chain(own) {
            results[k] = Some(result);
        }
        // each part was taken once
        results.into_iter().flatten().collect()
    }

    /// Calls `own` on the caller's thread, and `others` on up to `most` threads at the same time.
    pub(super) fn beside<R>(
        &self,
        most: usize,
        others: impl Fn() + Sync,
        own: impl FnOnce() -> R,
    ) -> R {
        let Some(pool) = &self.others else {
            return own();
        };
        pool.in_place_scope(|scope| {
            for _ in 0..most.min(pool.current_num_threads()) {
                scope.spawn(|_| others());
            }
            own()
        })
    }
}

/// Gives the processor to another thread, if one waits for it.
pub(super) fn let_others_run() {
    std::thread::yield_now();
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Barrier;

    /// Every part is done once, and the results are in order, for any number of threads.
    #[test]
    fn results_come_in_the_order_of_the_parts() {
        for count in [1, 2, 3, 8] {
            let threads = Threads::new(count).unwrap();
            assert_eq!(threads.count(), count);
            for parts in [0, 1, 2, 7, 500] {
                let found = threads.map((0..parts).collect(), |k: usize| 2 * k);
                assert_eq!(found, (0..parts).map(|k| 2 * k).collect::<Vec<_>>());
            }
        }
    }

    /// Each part waits until another thread has the other one.
    #[test]
    fn threads_work_at_the_same_time() {
        let threads = Threads::new(2).unwrap();
        let both = Barrier::new(2);
        let found = threads.map(vec![(); 2], |()| {
            both.wait();
            std::thread::current().id()
        });
        assert_ne!(found[0], found[1]);
    }

    #[test]
    fn what_is_small_is_not_split() {
        let split = |threads, most| Threads::new(threads).unwrap().split(600, most);
        assert!(split(1, 1_000_000).is_empty());
        assert!(split(2, 0).is_empty());
        assert!(split(2, 1).is_empty());
        assert_eq!(split(2, 2), [300, 600]);
        assert_eq!(split(2, 1_000_000), [300, 400, 500, 600]);
        assert_eq!(split(3, 3), [200, 400, 600]);
    }
}
