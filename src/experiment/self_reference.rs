//! A self-converged reference for scenes without a closed form: our runs at three step lengths, each
//! half of the one before, as far as they converge.

use super::setting::step_count;
use super::simulate::{Engine, RunError, advance};
use crate::contact::Vec2;
use crate::report::{Progress, number};
use crate::scene::{Built, Scene};

/// Most instants of a run that are compared.
const INSTANTS: usize = 40;
/// Halving the step must reduce the difference to this share at most: 1/2 is order 1.
const SHRINKS: f64 = 0.75;
/// Differences below this share of the farthest coordinate are round-off of single precision.
const ROUND_OFF: f64 = 1e-6;
/// A larger share of the farthest coordinate is too large a difference, convergent or not.
const SMALL: f64 = 1e-3;

/// Positions of the bodies of a scene, converged over three step lengths.
///
/// With `x₁, x₂, x₃` the positions at steps Δt, Δt/2 and Δt/4, `d₁ = max |x₁ − x₂|` and
/// `d₂ = max |x₂ − x₃|` over all bodies and all instants up to t,
/// ```text
/// d₂ ≤ 3/4 d₁  and  d₂ ≤ 1e-3 L,   or   d₂ ≤ 1e-6 L                          (1)
/// ```
/// holds up to the `horizon`; L is the farthest coordinate of a body, 1 m at least. x₃ is the
/// reference and `d₂` at the horizon its error bar: smaller errors cannot be measured.
#[derive(Debug, Clone, PartialEq)]
pub struct SelfReference {
    /// Instants up to the horizon \[s\], and the positions of all bodies at each \[m\].
    places: Places,
    /// d₂ at the horizon \[m\].
    pub error: f64,
    /// Time up to which the runs agree \[s\].
    pub horizon: f64,
}

/// Positions of all bodies at some instants.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Places {
    instants: Vec<f64>,
    found: Vec<Vec<Vec2>>,
    /// Time and positions at the end of the last step.
    last: (f64, Vec<Vec2>),
}

impl Places {
    /// Starts with a world that has not been stepped.
    fn start(instants: &[f64], built: &Built, engine: Engine) -> Places {
        Places {
            instants: instants.to_vec(),
            found: Vec::new(),
            last: (0.0, places(built, engine)),
        }
    }

    /// Adds the end of a step at `time` \[s\]; positions within a step are interpolated linearly.
    pub(super) fn add(&mut self, time: f64, built: &Built, engine: Engine) {
        let now = places(built, engine);
        // the sum of many steps meets an instant up to round-off only
        let reached = |t: f64| t <= time * (1.0 + 1e-9);
        while let Some(&t) = self.instants.get(self.found.len()).filter(|&&t| reached(t)) {
            let (before, then) = (self.last.0, &self.last.1);
            let share = ((t - before) / (time - before)).min(1.0);
            let between = then.iter().zip(&now).map(|(a, b)| a + (b - a) * share);
            self.found.push(between.collect());
        }
        self.last = (time, now);
    }

    /// Largest distance of a body at each instant that both have \[m\]; infinite if a position is not
    /// finite.
    fn distances(&self, other: &Places) -> Vec<f64> {
        let far = |(a, b): (&Vec2, &Vec2)| {
            let distance = (a - b).norm();
            if distance.is_finite() {
                distance
            } else {
                f64::INFINITY
            }
        };
        let pairs = self.found.iter().zip(&other.found);
        pairs
            .map(|(a, b)| a.iter().zip(b).map(far).fold(0.0, f64::max))
            .collect()
    }

    /// The farthest coordinate at each instant, 1 m at least.
    fn sizes(&self) -> Vec<f64> {
        let far = |all: &Vec<Vec2>| all.iter().map(|p| p.amax()).fold(1.0, f64::max);
        self.found.iter().map(far).collect()
    }
}

fn places(built: &Built, engine: Engine) -> Vec<Vec2> {
    let nowhere = Vec2::repeat(f64::NAN);
    (0..built.bodies())
        .map(|k| engine.state(built, k).map_or(nowhere, |s| s.0.translation))
        .collect()
}

impl SelfReference {
    /// Runs `scene` with our engine, in the scene's scheme, at the steps `finest`, `finest/2` and
    /// `finest/4` \[s\], and compares the three runs.
    ///
    /// # Arguments
    /// - `period`: a time that is a multiple of every step length to be compared \[s\].
    /// - `progress`: advanced once for each step.
    ///
    /// # Returns
    /// `None` if not even the first instant converges: the motion is chaotic or the steps too long.
    ///
    /// # Errors
    /// [`RunError::Step`] if the scene cannot be built or a step fails.
    pub fn converge(
        scene: &Scene,
        finest: f64,
        period: f64,
        progress: &Progress,
    ) -> Result<Option<SelfReference>, RunError> {
        let instants = instants(scene.step.time, period);
        let run = |dt: f64| -> Result<Places, RunError> {
            let mut scene = scene.clone();
            scene.step.dt = dt;
            let mut built = scene.build()?;
            let mut places = Places::start(&instants, &built, Engine::Moreau);
            let steps = step_count(&scene.step);
            advance(&mut built, Engine::Moreau, steps, |record, built| {
                places.add(record.time, built, Engine::Moreau);
                progress.advance();
                Ok(())
            })?;
            Ok(places)
        };
        let levels = [run(finest)?, run(finest / 2.0)?, run(finest / 4.0)?];
        Ok(SelfReference::of(levels))
    }

    /// Steps of all three runs together.
    pub fn steps(scene: &Scene, finest: f64) -> usize {
        let of = |dt: f64| {
            let mut step = scene.step.clone();
            step.dt = dt;
            step_count(&step)
        };
        of(finest) + of(finest / 2.0) + of(finest / 4.0)
    }

    fn of([first, second, third]: [Places; 3]) -> Option<SelfReference> {
        let (coarse, fine) = (first.distances(&second), second.distances(&third));
        let (mut before, mut error, mut known) = (0.0_f64, 0.0_f64, 0);
        for ((d1, d2), size) in coarse.iter().zip(&fine).zip(third.sizes()) {
            let (d1, d2) = (before.max(*d1), error.max(*d2));
            let converges = d2 <= SHRINKS * d1 && d2 <= SMALL * size;
            if !(converges || d2 <= ROUND_OFF * size) {
                break;
            }
            (before, error, known) = (d1, d2, known + 1);
        }
        let mut places = third;
        places.instants.truncate(known);
        places.found.truncate(known);
        let horizon = *places.instants.last()?;
        Some(SelfReference {
            places,
            error,
            horizon,
        })
    }

    /// Collects the positions of another run of the same scene, at the same instants.
    pub(super) fn sampler(&self, built: &Built, engine: Engine) -> Places {
        Places::start(&self.places.instants, built, engine)
    }

    /// Largest distance of a body from the reference \[m\], at least the error bar of the reference;
    /// NaN if the run is too short.
    pub(super) fn distance(&self, run: &Places) -> f64 {
        if run.found.len() < self.places.found.len() {
            return f64::NAN;
        }
        let most = run.distances(&self.places).into_iter().fold(0.0, f64::max);
        if most.is_finite() {
            most.max(self.error)
        } else {
            f64::NAN
        }
    }

    /// The text of the column `reference`, with the error bar after `±`.
    pub fn describe(&self) -> String {
        format!(
            "self-converged ±{:.1e} m until {} s",
            self.error,
            number(self.horizon, 3)
        )
    }
}

/// Multiples of `period` up to `time`, [`INSTANTS`] at most.
fn instants(time: f64, period: f64) -> Vec<f64> {
    let all = (time / period * (1.0 + 1e-12)).floor() as usize;
    let stride = all.div_ceil(INSTANTS).max(1);
    let mut instants: Vec<f64> = (1..=all / stride)
        .map(|k| (k * stride) as f64 * period)
        .collect();
    if instants.is_empty() {
        instants.push(time);
    }
    instants
}

#[cfg(test)]
mod tests {
    use super::*;

    fn places_of(instants: &[f64], at: impl Fn(f64) -> f64) -> Places {
        Places {
            instants: instants.to_vec(),
            found: instants
                .iter()
                .map(|&t| vec![Vec2::new(at(t), 0.0)])
                .collect(),
            last: (0.0, Vec::new()),
        }
    }

    #[test]
    fn instants_are_whole_periods() {
        assert_eq!(instants(1.0, 0.25), [0.25, 0.5, 0.75, 1.0]);
        let long = instants(10.0, 0.2);
        assert_eq!((long.len(), long[0]), (25, 0.4));
        assert_eq!(instants(0.1, 0.2), [0.1]);
    }

    /// Errors of order 1 up to 2 s; after that the finest run differs.
    #[test]
    fn the_horizon_ends_where_the_levels_part() {
        let instants = [1.0, 2.0, 3.0];
        let level = |dt: f64| move |t: f64| t * 1e-3 * dt;
        let last = |t: f64| if t > 2.0 { 0.5 } else { level(0.25)(t) };
        let runs = [
            places_of(&instants, level(1.0)),
            places_of(&instants, level(0.5)),
            places_of(&instants, last),
        ];
        let known = SelfReference::of(runs).unwrap();
        assert_eq!(known.horizon, 2.0);
        assert!((known.error - 0.5e-3).abs() < 1e-15);
        // at least the error bar; NaN for a run that ends early and for a position that is NaN
        let same = places_of(&instants, level(0.25));
        assert_eq!(known.distance(&same), known.error);
        let off = places_of(&instants, |t| level(0.25)(t) + 0.1);
        assert!((known.distance(&off) - 0.1).abs() < 1e-15);
        assert!(known.distance(&places_of(&[1.0], level(0.25))).is_nan());
        let lost = places_of(&instants, |_| f64::NAN);
        assert!(known.distance(&lost).is_nan());
        assert_eq!(known.describe(), "self-converged ±5.0e-4 m until 2.00 s");
    }

    #[test]
    fn what_never_converges_is_no_reference() {
        let instants = [1.0];
        let runs = [0.0, 0.1, 0.3].map(|x| places_of(&instants, move |_| x));
        assert_eq!(SelfReference::of(runs), None);
        // round-off need not shrink
        let runs = [0.0, 1e-7, 3e-7].map(|x| places_of(&instants, move |_| x));
        assert!(SelfReference::of(runs).is_some());
    }
}
