//! How far apart parts may be and still meet in a step.

use super::super::bodies::Bodies;
use super::super::joints::OUTSIDE;
use super::Present;

/// Bodies are slow if they are this factor slower than the fastest one.
const SLOWER: f64 = 16.0;
/// At most one body in so many is fast; if more are, they rarely stay apart from the others.
const FEW: usize = 8;

/// How far bodies can move in a step.
///
/// A body moves as far as its own speed takes it, and as far as a collision drives it: within one
/// step that can be the speed of the fastest body of all, through a chain of others. A few fast
/// bodies that meet no slow one in this step ([`Span::fast`]) drive only each other: one fast
/// projectile does not make the whole pile look ahead as far as it flies.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Span {
    pub dt: f64,
    /// Distance by acceleration alone \[m\].
    drop: f64,
    /// Prediction distance of the two fastest bodies \[m\].
    pub prediction: f64,
    /// Prediction distance of the two fastest slow bodies \[m\].
    slow_prediction: f64,
    /// Speed \[m/s\] above which a body is fast.
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
            slow_prediction: prediction(fastest),
            fast: f64::INFINITY,
        };
        let fast = fastest / SLOWER;
        let few = bodies.len() / FEW;
        // a body that falls freely for a step gets as far
        let pays = fast * dt > drop && speeds().filter(|speed| *speed > fast).count() <= few;
        let slowest = || speeds().filter(|speed| *speed <= fast).fold(0.0, f64::max);
        match pays {
            true => Span {
                slow_prediction: prediction(slowest()),
                fast,
                ..whole
            },
            false => whole,
        }
    }

    /// Whether there are both fast and slow bodies.
    pub fn is_split(&self) -> bool {
        self.fast < f64::INFINITY
    }

    /// The span of another part of the step.
    pub fn over(self, dt: f64) -> Span {
        Span { dt, ..self }
    }

    /// The span with all bodies counted as fast.
    pub fn whole(self) -> Span {
        Span {
            slow_prediction: self.prediction,
            fast: f64::INFINITY,
            ..self
        }
    }

    pub fn is_fast(&self, speed: f64) -> bool {
        speed > self.fast
    }

    /// How far a body's own velocity, or an impact that is known, takes it in a step \[m\].
    pub fn own(&self, body: &Present) -> f64 {
        (1.1 * body.speed * self.dt + self.drop).max(body.way)
    }

    /// Bound of the motion of two bodies towards each other in a step \[m\].
    pub fn motion(&self, [one, two]: [&Present; 2]) -> f64 {
        match one.way.max(two.way) > 0.0 {
            true => self.own(one) + self.own(two),
            false => 1.1 * (one.speed + two.speed) * self.dt + 2.0 * self.drop,
        }
    }

    /// How near two surfaces must be to matter \[m\]: bounds the motion of the two in a step, and
    /// the motion that a neighbour can drive. `sizes` \[m\] are the sizes of the parts.
    pub fn reach(&self, bodies: [&Present; 2], sizes: [f64; 2]) -> f64 {
        let [one, two] = bodies;
        let own = self.motion(bodies);
        let driven = match one.fast || two.fast {
            true => self.prediction,
            false => self.slow_prediction,
        };
        own.max(driven.min(sizes[0].min(sizes[1])))
    }

    /// The share of one side: two shares are no less than the reach.
    pub fn growth(&self, body: &Present, size: f64) -> f64 {
        let own = self.own(body);
        // the share of a fast body is the whole reach, whatever it meets
        own.max(match body.fast {
            true => self.prediction.min(size),
            false => 0.5 * self.slow_prediction.min(size),
        })
    }

    /// Motion of a body in the next steps \[m\].
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

    /// One body in eight may be fast. More bodies do not split the span, nor does one that only
    /// falls.
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

    /// The grid finds every pair only if two parts grown by their shares overlap within the reach.
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
