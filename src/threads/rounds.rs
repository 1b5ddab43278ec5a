//! Rounds: the same parts again and again, with the caller's work between them.

use super::Threads;
use super::pool::let_others_run;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

/// Looks for the next round before a thread lets others run: some microseconds.
const SPINS: usize = 4000;

/// No more rounds.
const END: u64 = u64::MAX;

/// What the threads of some rounds share.
///
/// Rounds are shorter than it takes to wake a thread, so that threads wait for the next one awake.
struct Board {
    /// Number of the round, and the next part of it, in 32 bits each.
    state: AtomicU64,
    done: AtomicUsize,
    parts: usize,
}

impl Board {
    /// Does parts of the present round while there are any. Returns whether it did one.
    fn take(&self, work: &impl Fn(usize)) -> bool {
        let seen = self.state.load(Ordering::Acquire);
        let part = seen as u32 as usize;
        if seen == END || part >= self.parts {
            return false;
        }
        let next = seen + 1;
        let taken = self
            .state
            .compare_exchange(seen, next, Ordering::AcqRel, Ordering::Acquire);
        if taken.is_ok() {
            // counts even if `work` panics, or the others would wait for ever
            let _done = Done(&self.done);
            work(part);
        }
        true
    }

    /// Does parts of all rounds until the end.
    fn help(&self, work: impl Fn(usize)) {
        let mut idle = 0;
        while self.state.load(Ordering::Acquire) != END {
            idle = if self.take(&work) { 0 } else { idle + 1 };
            wait(idle);
        }
    }

    /// One round.
    fn round(&self, work: &impl Fn(usize)) {
        self.done.store(0, Ordering::Relaxed);
        let round = self.state.load(Ordering::Relaxed) >> 32;
        self.state.store((round + 1) << 32, Ordering::Release);
        while self.take(work) {}
        let mut idle = 0;
        while self.done.load(Ordering::Acquire) < self.parts {
            idle += 1;
            wait(idle);
        }
    }
}

fn wait(idle: usize) {
    match idle {
        0 => {}
        idle if idle < SPINS => std::hint::spin_loop(),
        // there may be fewer processors than threads
        _ => let_others_run(),
    }
}

struct Done<'a>(&'a AtomicUsize);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        self.0.fetch_add(1, Ordering::Release);
    }
}

/// Ends the rounds, also if the caller panics.
struct Ends<'a>(&'a Board);

impl Drop for Ends<'_> {
    fn drop(&mut self) {
        self.0.state.store(END, Ordering::Release);
    }
}

impl Threads {
    /// Calls `lead` with a function that does a round: `work` for each of `parts`, on all threads. It
    /// returns once all are done. The order of the parts of a round is not determined.
    pub fn rounds<R>(
        &self,
        parts: usize,
        work: impl Fn(usize) + Sync,
        lead: impl FnOnce(&dyn Fn()) -> R,
    ) -> R {
        if self.count() == 1 || parts < 2 {
            return lead(&|| (0..parts).for_each(&work));
        }
        let board = Board {
            // a round without parts
            state: AtomicU64::new(parts as u64),
            done: AtomicUsize::new(0),
            parts,
        };
        let own = || {
            let _ends = Ends(&board);
            lead(&|| board.round(&work))
        };
        self.beside(parts - 1, || board.help(&work), own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    /// Every part is done once a round, and the caller sees it done, whatever the number of threads.
    #[test]
    fn each_round_does_every_part_once() {
        for (count, parts) in [(1, 3), (2, 0), (2, 1), (2, 2), (2, 7), (3, 4), (8, 5)] {
            let threads = Threads::new(count).unwrap();
            let sums: Vec<Mutex<usize>> = (0..parts).map(|_| Mutex::new(0)).collect();
            let work = |part: usize| *sums[part].lock().unwrap() += part + 1;
            let rounds = threads.rounds(parts, work, |next| {
                for round in 1..=500 {
                    next();
                    for (part, sum) in sums.iter().enumerate() {
                        assert_eq!(*sum.lock().unwrap(), round * (part + 1));
                    }
                }
                500
            });
            assert_eq!(rounds, 500);
        }
    }

    #[test]
    fn a_panic_ends_the_rounds() {
        let threads = Threads::new(2).unwrap();
        let fails = |work: &(dyn Fn(usize) + Sync), lead: &dyn Fn(&dyn Fn())| {
            let run = || threads.rounds(3, work, lead);
            std::panic::catch_unwind(std::panic::AssertUnwindSafe(run)).is_err()
        };
        assert!(fails(&|part| assert!(part != 1), &|next| next()));
        assert!(fails(&|_| {}, &|_| panic!("lead")));
        assert!(!fails(&|_| {}, &|next| next()));
    }
}
