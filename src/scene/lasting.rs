//! What lasts: the least of a value in any window of [`LASTING`](super::LASTING) seconds.

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// The least of the last `window` values, for each window: a queue of the values that no later one is below.
///
/// Source: Lemire, *Streaming maximum-minimum filter*, Nordic J. Computing 13 (2006).
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct SlidingLeast {
    /// Values so far.
    count: usize,
    /// Increasing values, and their numbers.
    queue: VecDeque<(usize, f64)>,
}

impl SlidingLeast {
    /// Adds a value, and forgets those before the last `window`. One that is no number counts as infinite.
    pub fn push(&mut self, value: f64, window: usize) {
        let value = if value.is_nan() { f64::INFINITY } else { value };
        while self.queue.back().is_some_and(|last| last.1 >= value) {
            self.queue.pop_back();
        }
        self.queue.push_back((self.count, value));
        self.count += 1;
        while self
            .queue
            .front()
            .is_some_and(|first| first.0 + window < self.count)
        {
            self.queue.pop_front();
        }
    }

    /// The least of the last values, `last` of them; `None` if there have been fewer.
    pub fn of_last(&self, last: usize) -> Option<f64> {
        let known = self.count >= last;
        let mut queue = self.queue.iter().filter(|_| known);
        queue
            .find(|entry| entry.0 + last >= self.count)
            .map(|entry| entry.1)
    }

    /// The least of the last half of a window, or of all values if they are fewer than a window.
    pub fn at_end(&self, window: usize) -> Option<f64> {
        self.of_last(match self.count < window {
            true => self.count,
            false => window.div_ceil(2),
        })
    }
}

/// The deepest overlap of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Deepest {
    /// Over the width of the thinner body.
    pub ratio: f64,
    /// In the scene's numbers, the smaller first.
    pub bodies: [u32; 2],
    /// The number of the step at whose end it was found, from 1.
    pub step: usize,
}

/// Overlaps that last, and the deepest one: of each pair of bodies the ratios of depth to size.
#[derive(Serialize, Deserialize)]
pub(super) struct Lasting {
    /// Steps of a window, and steps so far.
    window: usize,
    steps: usize,
    /// The pairs that overlapped in the last step, since when and by how much.
    present: FxHashMap<(u32, u32), SlidingLeast>,
    /// Depth over size of each pair in this step.
    now: FxHashMap<(u32, u32), f64>,
    /// The worst of all windows, and its pair.
    worst: (f64, Option<[u32; 2]>),
    deepest: Option<Deepest>,
}

impl Lasting {
    /// # Arguments
    /// - `window`: steps that count as lasting, at least 1.
    pub fn new(window: usize) -> Lasting {
        Lasting {
            window,
            steps: 0,
            present: FxHashMap::default(),
            now: FxHashMap::default(),
            worst: (0.0, None),
            deepest: None,
        }
    }

    /// Adds an overlap of a pair in this step.
    pub fn add(&mut self, pair: (u32, u32), ratio: f64) {
        let worst = self.now.entry(pair).or_insert(0.0);
        *worst = worst.max(ratio);
    }

    /// Adds the ratio of depth to width of a pair in this step.
    pub fn deepen(&mut self, pair: (u32, u32), ratio: f64) {
        if self.deepest.is_none_or(|deepest| ratio > deepest.ratio) {
            self.deepest = Some(Deepest {
                ratio,
                bodies: [pair.0, pair.1],
                step: self.steps + 1,
            });
        }
    }

    /// The deepest overlap so far, also one of a single step.
    pub fn deepest(&self) -> Option<Deepest> {
        self.deepest
    }

    /// Ends a step.
    pub fn step(&mut self) {
        self.steps += 1;
        // no window with a smaller ratio is worse
        let worst = self.worst.0;
        self.now.retain(|_, ratio| *ratio > worst);
        let now = &self.now;
        self.present.retain(|pair, _| now.contains_key(pair));
        for (pair, ratio) in self.now.drain() {
            let present = self.present.entry(pair).or_default();
            present.push(ratio, self.window);
        }
        self.worst = self.so_far(self.window);
    }

    /// The worst ratio of depth to size of an overlap that lasted a window, at the end half of one, or all of a shorter
    /// run, and its pair.
    pub fn worst(&self) -> (f64, Option<[u32; 2]>) {
        match self.steps < self.window {
            true => self.so_far(self.steps.max(1)),
            false => self.so_far(self.window.div_ceil(2)),
        }
    }

    /// The worst so far, also of those that go on and have lasted `least` steps.
    fn so_far(&self, least: usize) -> (f64, Option<[u32; 2]>) {
        let mut found = self.worst;
        for (&(a, b), present) in &self.present {
            let Some(ratio) = present.of_last(least) else {
                continue;
            };
            // of equal ratios the first pair, so that the order of the map does not matter
            if ratio > found.0 || ratio == found.0 && Some([a, b]) < found.1 {
                found = (ratio, Some([a, b]));
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against the least of each window, counted anew.
    #[test]
    fn the_least_of_every_window_is_known() {
        let values: Vec<f64> = (0..200).map(|k| f64::from(k * 7919 % 101)).collect();
        for window in [1, 2, 7, 60] {
            let mut least = SlidingLeast::default();
            for (k, value) in values.iter().enumerate() {
                least.push(*value, window);
                let all = &values[(k + 1).saturating_sub(window)..=k];
                let expected = all.iter().copied().fold(f64::INFINITY, f64::min);
                assert_eq!(least.of_last(window.min(k + 1)), Some(expected));
                for last in 1..=window.min(k + 1) {
                    let all = values[k + 1 - last..=k].iter().copied();
                    assert_eq!(least.of_last(last), Some(all.fold(f64::INFINITY, f64::min)));
                }
            }
        }
    }

    /// Bug: windows that followed each other missed what lasted for less than two of them.
    #[test]
    fn what_lasts_a_window_is_found_wherever_it_begins() {
        for begin in 0..20 {
            for (long, expected) in [(9, 0.0), (10, 0.1), (15, 0.3)] {
                let mut lasting = Lasting::new(10);
                for k in 0..50 {
                    if (begin..begin + long).contains(&k) {
                        let ratio = if k < begin + 5 { 0.1 } else { 0.3 };
                        lasting.add((1, 2), ratio);
                    }
                    lasting.step();
                }
                let pair = (expected > 0.0).then_some([1, 2]);
                assert_eq!(lasting.worst(), (expected, pair), "{begin} {long}");
            }
        }
    }

    /// At the end half a window is enough, as nothing tells how it goes on.
    #[test]
    fn what_lasts_at_the_end_counts() {
        for (long, expected) in [(4, 0.0), (5, 0.2), (9, 0.2)] {
            let mut lasting = Lasting::new(10);
            for k in 0..50 {
                if k >= 50 - long {
                    lasting.add((1, 2), 0.2);
                }
                lasting.step();
            }
            assert_eq!(lasting.worst().0, expected, "{long}");
        }
    }

    /// A run shorter than a window counts as a whole.
    #[test]
    fn a_short_run_counts_as_a_whole() {
        let mut lasting = Lasting::new(10);
        for _ in 0..4 {
            lasting.add((1, 2), 0.2);
            lasting.step();
        }
        assert_eq!(lasting.worst(), (0.2, Some([1, 2])));
        lasting.step();
        assert_eq!(lasting.worst(), (0.0, None));
    }

    #[test]
    fn the_deepest_is_known_however_short_it_is() {
        let mut lasting = Lasting::new(10);
        for (k, ratio) in [0.1, 0.4, 0.3].into_iter().enumerate() {
            lasting.deepen((k as u32, 9), ratio);
            lasting.deepen((7, 8), 0.2);
            lasting.step();
        }
        let expected = Deepest {
            ratio: 0.4,
            bodies: [1, 9],
            step: 2,
        };
        assert_eq!(lasting.deepest(), Some(expected));
    }
}
