//! One trial of a setting over the whole run, and how far two trials are apart.

use super::super::joint_gap::Pins;
use super::super::reference::{Measure, Samples, Size, measures};
use super::super::results::{driven, energy_rise};
use super::super::simulate::{Engine, RunError, Totals, simulate};
use crate::dynamics::Pose64;
use crate::dynamics::record::StepRecord;
use crate::report::Progress;
use crate::scene::{BodyKind, Built, Scene, Step};

/// Instants of a run at which two runs are compared: the number of steps is a multiple of it.
pub(super) const INSTANTS: usize = 10;
/// Differences below this share are round-off of single precision, in which contacts are found.
pub(super) const ROUND_OFF: f64 = 1e-7;

/// A figure of a run that is relative and should be 0, by the name of its measure.
pub(super) type Part = (&'static str, f64);

/// What is kept of a run to compare it with another: poses at some instants, and what no run may do.
pub(super) struct Observer {
    /// Steps between two instants, and steps so far.
    every: usize,
    steps: usize,
    /// Poses of the bodies that move, at the start and at each instant.
    poses: Vec<Vec<Pose64>>,
    moving: Vec<usize>,
    /// Diameter of each body that moves \[m\]; 0 where the model has none.
    sizes: Vec<f64>,
    pins: Option<Pins>,
    joint_gap: f64,
    /// Steps, events, sweeps, factorisations and pivots so far.
    pub work: usize,
}

impl Observer {
    pub fn start(scene: &Scene, built: &Built, steps: usize) -> Observer {
        let moves = |k: &usize| {
            let body = scene.bodies.get(*k);
            body.is_none_or(|body| body.kind == BodyKind::Dynamic)
        };
        let moving: Vec<usize> = (0..built.bodies()).filter(moves).collect();
        let mut observer = Observer {
            every: (steps / INSTANTS).max(1),
            steps: 0,
            poses: Vec::new(),
            sizes: moving
                .iter()
                .map(|k| built.size(*k).unwrap_or(0.0))
                .collect(),
            moving,
            pins: Pins::of(scene),
            joint_gap: 0.0,
            work: 0,
        };
        observer.poses.push(observer.now(built));
        observer
    }

    fn now(&self, built: &Built) -> Vec<Pose64> {
        let nowhere = Pose64::new([f64::NAN; 2].into(), f64::NAN);
        let pose = |k: &usize| built.state(*k).map_or(nowhere, |(pose, _)| pose);
        self.moving.iter().map(pose).collect()
    }

    /// Adds a step; whether it ends at an instant.
    pub fn add(&mut self, record: &StepRecord, built: &Built) -> bool {
        self.steps += 1;
        self.work += 1 + record.events + record.sweeps + record.factorisations + record.pivots;
        if let Some(pins) = &self.pins {
            self.joint_gap = self.joint_gap.max(pins.gap(built, Engine::Moreau));
        }
        let instant = self.steps.is_multiple_of(self.every);
        if instant {
            self.poses.push(self.now(built));
        }
        instant
    }

    /// The largest way of a body from its start, with its size \[m\]; 1 if nothing moves or has a size.
    fn length(&self) -> f64 {
        let way = |k: usize| {
            let start = self.poses[0][k].translation;
            let ways = self.poses.iter().map(|p| (p[k].translation - start).norm());
            ways.fold(0.0, f64::max) + self.sizes[k]
        };
        let most = (0..self.moving.len()).map(way).fold(0.0, f64::max);
        if most > 0.0 { most } else { 1.0 }
    }

    /// The largest distance of a body at the instants that both have, over `length`: of its origin, or
    /// half its size times the angle between. Infinite if a pose is not finite.
    pub fn apart(&self, other: &Observer, length: f64) -> f64 {
        let pairs = self.poses.iter().zip(&other.poses);
        let far = |k: usize, a: &Pose64, b: &Pose64| {
            let way = (a.translation - b.translation).norm();
            let turn = 0.5 * self.sizes[k] * (a.angle() - b.angle()).abs();
            let most = way.max(turn);
            if most.is_finite() {
                most
            } else {
                f64::INFINITY
            }
        };
        let worst = pairs.flat_map(|(a, b)| {
            let bodies = a.iter().zip(b).enumerate();
            bodies.map(move |(k, (a, b))| far(k, a, b))
        });
        worst.fold(0.0, f64::max) / length
    }
}

/// A run of a setting and what it found.
pub(super) struct Trial {
    pub step: Step,
    pub steps: usize,
    pub seen: Observer,
    pub found: Vec<Measure>,
    /// Errors that are known without another run, because their exact value is 0.
    pub known: Vec<Part>,
    pub length: f64,
    pub energy: f64,
}

impl Trial {
    /// Runs `scene` with `steps` steps of its own scheme; `None` if a step fails.
    ///
    /// # Errors
    /// [`RunError`] if the scene cannot be built.
    pub fn run(
        scene: &Scene,
        steps: usize,
        progress: &Progress,
    ) -> Result<Option<Trial>, RunError> {
        let mut built = scene.build()?;
        let mut seen = Observer::start(scene, &built, steps);
        let mut samples = Samples::start(&built, Engine::Moreau);
        let outcome = simulate(&mut built, Engine::Moreau, steps, |record, built| {
            if scene.reference.is_some() {
                samples.add(record, built, Engine::Moreau);
            }
            seen.add(record, built);
            progress.advance();
            Ok(())
        });
        match outcome {
            Ok(totals) => Ok(Some(Trial::of(
                scene,
                seen,
                measures(scene, &samples),
                &totals,
            ))),
            Err(RunError::Step(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// A run that was seen to its end.
    pub fn of(scene: &Scene, seen: Observer, found: Vec<Measure>, totals: &Totals) -> Trial {
        let length = seen.length();
        let energy = energy(scene, totals, length);
        let mut known = vec![
            ("overlap", totals.penetration / length),
            ("unsolved", totals.bounded_way / length),
            ("failed islands", never(totals.failed_islands)),
            ("passages", never(totals.passages)),
        ];
        if seen.pins.is_some() {
            known.push(("joint-gap", seen.joint_gap / length));
        }
        if !driven(scene) {
            let rise = energy_rise(totals) - totals.work_recovery.max(0.0);
            known.push(("energy-rise", share(rise.max(0.0), energy)));
        }
        if !totals.energy_end.is_finite() {
            known.push(("energy", f64::INFINITY));
        }
        Trial {
            step: scene.step.clone(),
            steps: seen.steps,
            seen,
            found,
            known,
            length,
            energy,
        }
    }

    /// Whether a measure of the scene is a distance from the exact motion.
    pub fn has_motion(&self) -> bool {
        self.found.iter().any(|m| m.size == Size::Motion)
    }

    /// How far this trial is from a `finer` one in each of the measures `names`, and in its trajectory
    /// if `motion`; infinite in what one of them lacks.
    pub fn differences(&self, finer: &Trial, names: &[&'static str], motion: bool) -> Vec<Part> {
        let of = |trial: &Trial, name: &str| -> Option<Measure> {
            trial.found.iter().find(|m| m.name == name).cloned()
        };
        let mut parts: Vec<Part> = names
            .iter()
            .map(|name| {
                let apart = match (of(self, name), of(finer, name)) {
                    (Some(a), Some(b)) => finer.apart(&a, &b),
                    _ => f64::INFINITY,
                };
                (*name, apart)
            })
            .collect();
        if motion {
            let apart = self.seen.apart(&finer.seen, finer.length);
            parts.push(("trajectory", apart));
        }
        for (_, apart) in &mut parts {
            if apart.is_nan() {
                *apart = f64::INFINITY;
            }
            if *apart < ROUND_OFF {
                *apart = 0.0;
            }
        }
        parts
    }

    /// The difference of a measure, over its size.
    fn apart(&self, a: &Measure, b: &Measure) -> f64 {
        let difference = (a.computed - b.computed).abs();
        let size = match b.size {
            Size::Value => a.computed.abs().max(b.computed.abs()),
            Size::Given(size) => size.abs(),
            Size::Unit | Size::Motion => self.unit(b.unit),
        };
        share(difference, size)
    }

    fn unit(&self, unit: &str) -> f64 {
        match unit {
            "m" => self.length,
            "N m" | "J" => self.energy,
            _ => 1.0,
        }
    }

    /// The error of this run against the closed form in the sizes in which runs are compared: what the
    /// choice never sees.
    pub fn error(&self) -> Part {
        let errors = self.found.iter().map(|m| {
            let size = match m.size {
                Size::Value | Size::Given(_) => 1.0,
                Size::Unit | Size::Motion => self.unit(m.unit),
            };
            (m.name, m.error / size)
        });
        let known = self.known.iter().copied();
        worst(errors.chain(known))
    }
}

/// The largest; NaN counts as infinite.
pub(super) fn worst(parts: impl Iterator<Item = Part>) -> Part {
    let size = |e: f64| if e.is_nan() { f64::INFINITY } else { e };
    parts.fold(("", 0.0), |most, part| match size(part.1) > most.1 {
        true => (part.0, size(part.1)),
        false => most,
    })
}

/// What may not happen at all.
fn never(count: usize) -> f64 {
    if count > 0 { f64::INFINITY } else { 0.0 }
}

/// `part / whole`; 0 for no part of nothing.
fn share(part: f64, whole: f64) -> f64 {
    if part == 0.0 { 0.0 } else { part / whole }
}

/// Energy that moves in a run \[J\]: the largest kinetic energy, the range of the potential energy, and
/// the weight of all bodies that move times `length`.
fn energy(scene: &Scene, totals: &Totals, length: f64) -> f64 {
    let moving = (scene.bodies.iter()).filter(|body| body.kind == BodyKind::Dynamic);
    let masses = moving.filter_map(|body| Some(body.mass_and_inertia()?.0));
    let gravity = scene.gravity[0].hypot(scene.gravity[1]);
    let weight: f64 = masses.map(|mass| mass * gravity).sum();
    totals.kinetic_most + (totals.potential[1] - totals.potential[0]) + weight * length
}
