//! How far apart parts may be and still meet in a step.

use super::super::bodies::Bodies;
use super::super::joints::OUTSIDE;
use super::Present;

/// Of bodies so many times slower than the fastest one is asked whether they meet any faster one.
const SLOWER: f64 = 16.0;
/// At most one body in so many is fast, or they are hardly ever alone.
const FEW: usize = 8;

/// How far things can come in a step.
///
/// A body goes as far as its own speed carries it, and as far as what hits it drives it: in one step
/// that can be the fastest body of all, through a row of others. A few fast bodies that meet no slow
/// one in this step ([`Span::fast`]) drive only each other: a ball that is shot past a pile does not
/// make all of the pile look as far ahead as it flies.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Span {
    dt: f64,
    /// By acceleration alone \[m\].
    drop: f64,
    /// Of the fastest two together \[m\].
    pub prediction: f64,
    /// Of the fastest two of the slow \[m\].
    calm: f64,
    /// Speed \[m/s\] above which a body is none of the slow.
    fast: f64,
}

impl Span {
    pub fn new(bodies: &[Present], acceleration: f64, dt: f64) -> Span {
        let speeds = || bodies.iter().map(|body| body.speed);
        let fastest = speeds().fold(0.0, f64::max);
        let drop = acceleration * dt * dt;
        let prediction = |speed: f64| 2.0 * (speed * dt + drop) + 1e-6;
        let whole = Span {
            dt,
            drop,
            prediction: prediction(fastest),
            calm: prediction(fastest),
            fast: f64::INFINITY,
        };
        let fast = fastest / SLOWER;
        let few = bodies.len() / FEW;
        // what falls for a step alone gets as far
        let pays = fast * dt > drop && speeds().filter(|speed| *speed > fast).count() <= few;
        let slowest = || speeds().filter(|speed| *speed <= fast).fold(0.0, f64::max);
        match pays {
            true => Span {
                calm: prediction(slowest()),
                fast,
                ..whole
            },
            false => whole,
        }
    }

    /// Whether some bodies are fast and the others are not.
    pub fn is_split(&self) -> bool {
        self.fast < f64::INFINITY
    }

    /// Of another part of the step.
    pub fn over(self, dt: f64) -> Span {
        Span { dt, ..self }
    }

    /// As if all were fast.
    pub fn whole(self) -> Span {
        Span {
            calm: self.prediction,
            fast: f64::INFINITY,
            ..self
        }
    }

    pub fn is_fast(&self, speed: f64) -> bool {
        speed > self.fast
    }

    /// How near two surfaces must be to matter \[m\]: what these two can do in a step, or what a
    /// neighbour can do to them. `sizes` \[m\] are theirs.
    pub fn reach(&self, bodies: [&Present; 2], sizes: [f64; 2]) -> f64 {
        let [one, two] = bodies;
        let own = 1.1 * (one.speed + two.speed) * self.dt + 2.0 * self.drop;
        let driven = match one.fast || two.fast {
            true => self.prediction,
            false => self.calm,
        };
        own.max(driven.min(sizes[0].min(sizes[1])))
    }

    /// One side's share of it: two of them are no less than the reach.
    pub fn growth(&self, body: &Present, size: f64) -> f64 {
        let own = 1.1 * body.speed * self.dt + self.drop;
        // a fast one's share is all of it, whatever meets it
        own.max(match body.fast {
            true => self.prediction.min(size),
            false => 0.5 * self.calm.min(size),
        })
    }

    /// Where a body goes in the next steps \[m\].
    pub fn ahead(&self, bodies: &Bodies, body: u32) -> [f64; 2] {
        if body == OUTSIDE {
            return [0.0; 2];
        }
        let u = &bodies.velocities[body as usize];
        [u.x, u.y].map(|v| (4.0 * self.dt * v).clamp(-1.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::super::OUTER;
    use super::*;

    fn bodies(speeds: impl IntoIterator<Item = f64>) -> Vec<Present> {
        let body = |speed| Present { speed, ..OUTER };
        speeds.into_iter().map(body).collect()
    }

    /// One in eight may be fast; more are not told from the rest, nor one that only falls.
    #[test]
    fn few_fast_bodies_are_told_from_the_slow() {
        let slow = || std::iter::repeat_n(1.0, 14);
        let split = |speeds: Vec<f64>, acceleration| {
            Span::new(&bodies(speeds), acceleration, 0.01).is_split()
        };
        assert!(split(slow().chain([17.0, 40.0]).collect(), 0.0));
        assert!(!split(slow().chain([15.0, 15.0]).collect(), 0.0));
        assert!(!split(slow().chain([40.0, 40.0, 40.0]).collect(), 0.0));
        assert!(split(slow().chain([17.0]).collect(), 100.0));
        assert!(!split(slow().chain([17.0]).collect(), 110.0));
        assert!(!split(vec![], 10.0));
    }

    /// Grids find every pair only if two parts grown by their shares overlap within the reach.
    #[test]
    fn two_shares_are_no_less_than_the_reach() {
        let speeds = [0.0, 0.1, 1.0, 2.9, 3.2, 20.0, 48.0];
        let list = bodies(std::iter::repeat_n(0.5, 80).chain(speeds));
        let split = Span::new(&list, 9.81, 1.0 / 60.0);
        assert!(split.is_split());
        let mut least = f64::INFINITY;
        for span in [split, split.whole()] {
            let fast = |body: &Present| Present {
                fast: span.is_fast(body.speed),
                ..*body
            };
            let list: Vec<_> = bodies(speeds).iter().map(fast).collect();
            for (a, b) in list.iter().flat_map(|a| list.iter().map(move |b| (a, b))) {
                for sizes in [[0.01, 3.0], [0.5, 0.5], [9.0, 9.0], [0.2, 0.01]] {
                    let shares = span.growth(a, sizes[0]) + span.growth(b, sizes[1]);
                    least = least.min(shares - span.reach([a, b], sizes));
                    assert!(span.reach([a, b], sizes) <= 1.1 * span.prediction);
                }
            }
        }
        assert!(least > -1e-15, "{least}");
    }
}
