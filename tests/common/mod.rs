//! What several integration tests share.
#![allow(dead_code)] // each test binary uses a part

pub mod movers;
pub mod problems;
pub mod program;
pub mod series;

use moreau2d::contact::Vec3;
use moreau2d::dynamics::Pose64;
use moreau2d::dynamics::record::StepRecord;
use moreau2d::experiment::{Engine, Measure, Samples, Totals, measures, simulate};
use moreau2d::rapier::engine::prelude::{Real, Vector};
use moreau2d::scene::{self, Built, Scene};

/// A place or a velocity of rapier.
pub fn at(x: f64, y: f64) -> Vector {
    Vector::new(x as Real, y as Real)
}

/// A scene of the catalogue with flags applied.
#[track_caller]
pub fn load(name: &str, flags: &[&str]) -> Scene {
    let flags: Vec<String> = flags.iter().map(|f| (*f).to_owned()).collect();
    scene::load(name, &flags).unwrap_or_else(|e| panic!("{e}"))
}

/// Flags that make a big scene of the catalogue small enough for a test that only asks whether it
/// works.
pub fn small(name: &str) -> &'static [&'static str] {
    match name {
        "large-pyramid" => &["repeat.0.count=[20, 20]"],
        "many-pyramids" => &["repeat.0.count=[2]", "repeat.1.count=[10, 10, 3, 2]"],
        "tumbler" => &["repeat.0.count=[12, 12]"],
        "box-drum" => &["repeat.0.count=[15, 15]"],
        "drum-of-boxes" => &["repeat.0.count=[12, 12]"],
        "grains" => &["repeat.0.count=[10, 5]", "repeat.1.count=[10, 5]"],
        "joint-grid" => &[
            "repeat.0.count=[20, 20]",
            "repeat.0.fixed=[[8, 0], [9, 0], [10, 0], [11, 0]]",
        ],
        _ => &[],
    }
}

/// A scene from its text.
#[track_caller]
pub fn parse(text: &str) -> Scene {
    Scene::parse("test.toml", text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

/// What a run of our engine gave.
pub struct Run {
    pub totals: Totals,
    pub measures: Vec<Measure>,
    pub records: Vec<StepRecord>,
    pub built: Built,
}

impl Run {
    /// Where body `k` of the scene is at the end, and how fast.
    #[track_caller]
    pub fn state(&self, k: usize) -> (Pose64, Vec3) {
        self.built.state(k).unwrap()
    }

    /// The measure called `name`.
    #[track_caller]
    pub fn measure(&self, name: &str) -> &Measure {
        let found = self.measures.iter().find(|m| m.name == name);
        found.unwrap_or_else(|| panic!("no measure {name} in {:?}", self.measures))
    }

    /// The error of the measure called `name`.
    #[track_caller]
    pub fn error(&self, name: &str) -> f64 {
        self.measure(name).error
    }
}

/// Runs a scene for the time it states.
#[track_caller]
pub fn run(scene: &Scene) -> Run {
    let ratio = scene.step.time / scene.step.dt;
    run_steps(scene, (ratio * (1.0 - 1e-12)).ceil() as usize)
}

/// Runs a scene for so many steps.
#[track_caller]
pub fn run_steps(scene: &Scene, steps: usize) -> Run {
    let mut built = scene.build().unwrap_or_else(|e| panic!("{e}"));
    let mut samples = Samples::start(&built, Engine::Moreau);
    let mut records = Vec::with_capacity(steps);
    let totals = simulate(&mut built, Engine::Moreau, steps, |record, built| {
        samples.add(record, built, Engine::Moreau);
        records.push(record.clone());
        Ok(())
    })
    .unwrap_or_else(|e| panic!("{e}"));
    Run {
        totals,
        measures: measures(scene, &samples),
        records,
        built,
    }
}

/// Step lengths over which orders of convergence are asserted.
pub const LADDER: [f64; 6] = [
    1.0 / 30.0,
    1.0 / 60.0,
    1.0 / 125.0,
    1.0 / 250.0,
    1.0 / 500.0,
    1.0 / 1000.0,
];

/// Least-squares slope of ln(error) against ln(dt).
pub fn order(errors: &[f64]) -> f64 {
    let points: Vec<(f64, f64)> = LADDER
        .iter()
        .zip(errors)
        .map(|(dt, e)| (dt.ln(), e.ln()))
        .collect();
    let n = points.len() as f64;
    let (mx, my) = points
        .iter()
        .fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
    let (xy, xx) = points.iter().fold((0.0, 0.0), |s, p| {
        (s.0 + (p.0 - mx) * (p.1 - my), s.1 + (p.0 - mx).powi(2))
    });
    xy / xx
}

/// Root mean square.
pub fn rms(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, n) = values
        .into_iter()
        .fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    (sum / n).sqrt()
}

/// Steele, Lea & Flood's SplitMix64: random cases that are the same in every run.
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Evenly in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// Evenly among 0, 1, ... n − 1.
    pub fn below(&mut self, n: usize) -> usize {
        (self.between(0.0, n as f64)) as usize
    }
}
