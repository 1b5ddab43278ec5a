use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// A progress bar on standard error, and only where someone looks at it.
///
/// Nothing is drawn when `quiet` or when standard error is not a terminal, so that logs and pipes
/// stay clean. The bar vanishes when the value is dropped.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// A bar named `label` that ends at `total` (steps, cycles, runs).
    pub fn new(label: &str, total: u64, quiet: bool) -> Self {
        let target = if quiet || !std::io::stderr().is_terminal() {
            ProgressDrawTarget::hidden()
        } else {
            ProgressDrawTarget::stderr()
        };
        let bar = ProgressBar::with_draw_target(Some(total), target).with_prefix(label.to_owned());
        // The template is ours and constant; were it wrong, the plain bar would do.
        if let Ok(style) =
            ProgressStyle::with_template("{prefix} {bar:32} {percent:>3} %  {eta} left  {msg}")
        {
            bar.set_style(style);
        }
        Progress { bar }
    }

    /// Moves to `position` of `total`. Cheap enough for every step.
    pub fn set(&self, position: u64) {
        self.bar.set_position(position);
    }

    /// Advances by one.
    pub fn advance(&self) {
        self.bar.inc(1);
    }

    /// Shows `text` behind the bar.
    pub fn message(&self, text: impl Into<String>) {
        self.bar.set_message(text.into());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quiet_draws_nothing_and_still_counts() {
        let progress = Progress::new("run", 10, true);
        assert!(progress.bar.is_hidden());
        progress.set(4);
        progress.advance();
        assert_eq!(progress.bar.position(), 5);
    }
}
