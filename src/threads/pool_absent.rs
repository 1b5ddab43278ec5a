//! Replaces the pool if the feature `parallel` is off.

/// The caller's thread.
#[derive(Debug, Clone, Default)]
pub(crate) struct Threads(());

impl Threads {
    /// The caller's thread, whatever the number.
    ///
    /// # Errors
    /// None.
    pub fn new(_: usize) -> Result<Threads, String> {
        Ok(Threads(()))
    }

    /// Number of threads.
    pub fn count(&self) -> usize {
        1
    }

    pub(super) fn share_out<T: Send, R: Send>(
        &self,
        parts: Vec<T>,
        one: impl Fn(T) -> R + Sync,
    ) -> Vec<R> {
        parts.into_iter().map(one).collect()
    }

    pub(super) fn beside<R>(&self, _: usize, _: impl Fn() + Sync, own: impl FnOnce() -> R) -> R {
        own()
    }
}

/// There are no others.
pub(super) fn let_others_run() {}
