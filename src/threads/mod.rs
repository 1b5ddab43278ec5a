//! Threads that share out the parts of one piece of work.
//!
//! What is computed never depends on their number: the parts are independent of each other, and the
//! results come in the order of the parts. Who hands out work therefore keeps sums of floats in one
//! order of its own.
//!
//! To wake a thread takes 10 to 50 µs. Work below some 100 µs stays on the caller's thread: each
//! caller states the size from which on it makes several parts.

#[cfg(feature = "parallel")]
mod pool;
#[cfg(not(feature = "parallel"))]
#[path = "pool_absent.rs"]
mod pool;

pub(crate) use pool::Threads;

/// Parts for each thread. More than one, as parts are of unequal cost and threads wake late.
const PARTS: usize = 3;

impl Threads {
    /// Number of parts into which to split work on `count` things, of which each part has at least
    /// `least`: 1 for one thread.
    pub fn parts(&self, count: usize, least: usize) -> usize {
        match self.count() {
            1 => 1,
            threads => (count / least.max(1)).clamp(1, PARTS * threads),
        }
    }

    /// Calls `one` on every part. Returns the results in the order of the parts.
    ///
    /// A thread takes the next part when it is done with one, the caller's thread too.
    pub fn map<T: Send, R: Send>(&self, parts: Vec<T>, one: impl Fn(T) -> R + Sync) -> Vec<R> {
        match parts.len() {
            0 | 1 => parts.into_iter().map(one).collect(),
            _ => self.share_out(parts, one),
        }
    }
}
