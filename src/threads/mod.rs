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
mod rounds;

pub(crate) use pool::Threads;

/// Into how many pieces to split the share of a thread: pieces are of unequal cost, and threads wake
/// late.
const PIECES: usize = 3;

impl Threads {
    /// The ends of the parts into which to split a list of `count` things; `most` parts are worth
    /// their cost. Empty if it is better not to split it.
    ///
    /// The first part is the share of one thread, which the caller begins with at once and need not
    /// copy. The others are pieces of the shares of the other threads.
    pub fn split(&self, count: usize, most: usize) -> Vec<usize> {
        let threads = self.count();
        let pieces = most.min(PIECES * threads);
        if threads == 1 || pieces < 2 {
            return Vec::new();
        }
        let first = pieces.div_ceil(threads);
        (first..=pieces).map(|k| k * count / pieces).collect()
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
