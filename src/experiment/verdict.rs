//! Judges whether a scene held, from its poses and its energy balance, not from its solver.

use super::joint_gap::Pins;
use super::simulate::{Engine, Totals, larger};
use crate::checkpoint::{CheckpointError, Reader, Writer};
use crate::dynamics::record::StepRecord;
use crate::scene::{BodyKind, Built, LASTING, Limits, Scene, SlidingLeast};
use serde::{Deserialize, Serialize};

/// Number of passages that are listed one by one.
const NAMED: usize = 10;

/// Whether a scene held in a run, and by what measures.
///
/// The solver's certificates only say that the impulses solve the contact problems that were set up.
/// They cannot detect that a contact is missing in these problems. So a run also measures the motion
/// of the bodies, from their poses alone ([`crate::scene::Built::measure`]), and the energy that
/// contacts and joints add:
/// - `overlap`: the worst overlap that lasts [`LASTING`] seconds, over the size of the smaller body;
/// - `deepest`: the deepest overlap at the end of any step, over the width of the thinner body. Where many bodies
///   with restitution are driven into each other within a step, their impact comes a step late;
/// - `joint_gap`: as `overlap`, for the gaps of pins and welds;
/// - `passed_through`: pairs of bodies of which one passed through the other;
/// - `energy`: total energy that rigid contacts, pins, locked axes and limits added to the bodies
///   ([`StepRecord::constraint_work`]), over the energy of the scene. The latter is the sum of the
///   largest kinetic energy, the range of the potential energy, and the weight of all moving bodies
///   times their sizes. Left out if a body oscillates, because the work of an accelerated support
///   cannot be separated from it;
/// - `imbalance`: the largest error of the energy balance of a step, over the same energy;
/// - `failed`: islands that are not certified and leave more than a tenth of the velocities at stake, see
///   [`StepRecord::failed`];
/// - `bounded`: overlap that all other islands that are not certified may have added in a second, on
///   average, over the size of the smallest moving body; left out if all are certified.
///
/// The limits are those of `[verdict]` in the scene file. `passed_through` and `failed` must be 0.
/// A measure that the engine or the model does not report is left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// Whether all measures are within their limits.
    pub held: bool,
    /// The same in words.
    pub sentence: String,
    pub checks: Vec<Check>,
    /// The first passages, in order of time.
    pub passed_through: Vec<Passage>,
}

/// One measure and its limit, both dimensionless, see [`Verdict`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    pub name: &'static str,
    pub value: f64,
    pub limit: f64,
    pub held: bool,
    /// End of the step with that value \[s\], of `deepest`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Explanation for the sentence of the verdict if the value exceeds its limit.
    #[serde(skip)]
    why: String,
}

/// One body passed through another.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Passage {
    /// End of the step \[s\].
    pub time_s: f64,
    pub bodies: [String; 2],
}

/// Collects the measures of a verdict, step by step.
pub struct Judge {
    limits: Limits,
    names: Vec<String>,
    pins: Option<Pins>,
    /// Gaps over size in the last [`LASTING`] seconds, the worst least of all such windows, and their steps.
    gaps: SlidingLeast,
    worst_gap: Option<f64>,
    window: usize,
    /// Step length \[s\].
    dt: f64,
    /// Steps in which some pair passed through another, by pairs.
    passages: usize,
    named: Vec<Passage>,
    /// Whether some body oscillates, so that its contacts do work from an external source.
    driven: bool,
    /// Weight times size of all moving bodies \[J\].
    weight: f64,
    /// Size of the smallest moving body \[m\]; 0 if there is none.
    least: f64,
}

impl Judge {
    /// # Arguments
    /// - `built`: the world at the start.
    pub fn new(scene: &Scene, built: &Built) -> Judge {
        let gravity = scene.gravity[0].hypot(scene.gravity[1]);
        let (mut weight, mut least) = (0.0, f64::INFINITY);
        if let Some((simulation, bodies)) = built.simulation() {
            for (k, body) in bodies.iter().enumerate() {
                if scene.bodies[k].kind == BodyKind::Dynamic {
                    let mass = simulation.mass(*body).unwrap_or(0.0);
                    let size = built.size(k).unwrap_or(0.0);
                    weight += mass * gravity * size;
                    least = if size > 0.0 { least.min(size) } else { least };
                }
            }
        }
        Judge {
            limits: scene.limits,
            names: scene.bodies.iter().map(|body| body.name.clone()).collect(),
            pins: Pins::of(scene),
            gaps: SlidingLeast::default(),
            worst_gap: None,
            window: ((LASTING / scene.step.dt).ceil() as usize).max(1),
            dt: scene.step.dt,
            passages: 0,
            named: Vec::new(),
            driven: scene.bodies.iter().any(|body| body.oscillation.is_some()),
            weight,
            least: if least.is_finite() { least } else { 0.0 },
        }
    }

    /// Saves what was found so far.
    ///
    /// # Errors
    /// [`CheckpointError::Write`].
    pub fn save(&self, to: &mut Writer) -> Result<(), CheckpointError> {
        to.put(&(&self.gaps, self.worst_gap))?;
        to.put(&(self.passages, &self.named))
    }

    /// Goes on from what [`Judge::save`] saved in a run of the same scene.
    ///
    /// # Errors
    /// [`CheckpointError::Read`].
    pub fn load(&mut self, from: &mut Reader) -> Result<(), CheckpointError> {
        (self.gaps, self.worst_gap) = from.take()?;
        (self.passages, self.named) = from.take()?;
        Ok(())
    }

    /// Adds a step.
    pub fn add(&mut self, record: &StepRecord, built: &Built, engine: Engine) {
        for [a, b] in &record.passed {
            self.passages += 1;
            if self.named.len() < NAMED {
                let name = |number: u32| {
                    let mut all = self.names.iter().enumerate();
                    let found = all.find(|(k, _)| built.number(*k) == Some(number));
                    found.map_or_else(|| number.to_string(), |(_, name)| name.clone())
                };
                self.named.push(Passage {
                    time_s: record.time,
                    bodies: [name(*a), name(*b)],
                });
            }
        }
        if let Some(pins) = &self.pins {
            let gap = pins.relative_gap(built, engine);
            self.gaps.push(gap, self.window);
            let least = match gap.is_nan() {
                true => Some(gap),
                false => self.gaps.of_last(self.window),
            };
            if let Some(least) = least {
                self.worst_gap = Some(larger(self.worst_gap.unwrap_or(0.0), least));
            }
        }
    }

    /// The verdict at the end of the run.
    pub fn verdict(self, totals: &Totals, built: &Built) -> Verdict {
        let mut checks = Checks(Vec::new());
        self.check_overlaps(&mut checks, totals, built);
        self.check_joints(&mut checks);
        if built.simulation().is_some() {
            self.check_passages(&mut checks);
        }
        if totals.accounted {
            self.check_energy(&mut checks, totals);
            self.check_solver(&mut checks, totals);
        }
        let Checks(checks) = checks;
        let failed = checks.iter().filter(|check| !check.held);
        let failed: Vec<&str> = failed.map(|check| check.why.as_str()).collect();
        let held = failed.is_empty();
        let sentence = match held {
            true => "the scene held".to_owned(),
            false => format!("the scene did not hold: {}", failed.join("; ")),
        };
        Verdict {
            held,
            sentence,
            checks,
            passed_through: self.named,
        }
    }

    fn check_overlaps(&self, checks: &mut Checks, totals: &Totals, built: &Built) {
        let Some((ratio, pair)) = built.lasting_overlap() else {
            return;
        };
        let names = |pair: [u32; 2]| {
            let [a, b] = pair.map(|k| self.names[k as usize].as_str());
            format!("{a} and {b}")
        };
        let of = pair.map_or(String::new(), |pair| {
            let share = 100.0 * ratio;
            let long = match totals.steps < self.window {
                true => "all through the run".to_owned(),
                false => format!("for {LASTING} s or longer"),
            };
            let both = names(pair);
            format!("{both} overlap by {share:.2} % of the smaller one {long}")
        });
        checks.add("overlap", ratio, self.limits.overlap, of);
        let deepest = built.deepest_overlap();
        let at = deepest.map(|deepest| deepest.step as f64 * self.dt);
        let of = deepest.zip(at).map_or(String::new(), |(deepest, time)| {
            let (share, both) = (100.0 * deepest.ratio, names(deepest.bodies));
            format!("{both} overlap by {share:.0} % of the thinner one's width at {time:.4} s")
        });
        let ratio = deepest.map_or(0.0, |deepest| deepest.ratio);
        checks.add("deepest", ratio, self.limits.deepest, of);
        if let Some(check) = checks.0.last_mut() {
            check.time_s = at;
        }
    }

    fn check_joints(&self, checks: &mut Checks) {
        // a run shorter than a window counts as a whole
        // at the end half a window is enough
        let last = self.gaps.at_end(self.window);
        let gap = match (self.worst_gap, last) {
            (Some(worst), Some(last)) => Some(larger(worst, last)),
            (worst, last) => worst.or(last),
        };
        if let Some(ratio) = gap {
            let share = 100.0 * ratio;
            let why = format!("a joint stays open by {share:.2} % of its smaller body");
            checks.add("joint_gap", ratio, self.limits.joint_gap, why);
        }
    }

    fn check_passages(&self, checks: &mut Checks) {
        let who = self.named.first().map_or(String::new(), |first| {
            let ([a, b], count) = (&first.bodies, self.passages);
            let time = first.time_s;
            format!("{a} passed through {b} at {time:.4} s ({count} such passages in all)")
        });
        checks.add("passed_through", self.passages as f64, 0.0, who);
    }

    fn check_energy(&self, checks: &mut Checks, totals: &Totals) {
        let scale = totals.kinetic_most
            + (totals.potential[1] - totals.potential[0])
            + self.weight
            + f64::MIN_POSITIVE;
        if !self.driven {
            let given = totals.constraint_gain;
            let why = format!("contacts and joints gave {given:.3e} J");
            checks.add("energy", given / scale, self.limits.energy, why);
        }
        let off = totals.imbalance;
        let why = format!("the energy balance of a step is off by {off:.3e} J");
        checks.add("imbalance", off / scale, self.limits.imbalance, why);
    }

    fn check_solver(&self, checks: &mut Checks, totals: &Totals) {
        let failed = totals.failed_islands;
        let why = format!("islands that failed: {failed}");
        checks.add("failed", failed as f64, 0.0, why);
        if totals.unsolved_islands > failed && self.least > 0.0 {
            let mean = totals.bounded_way / totals.time;
            let why = format!(
                "islands that are not certified may add an overlap of {mean:.2e} m a second"
            );
            checks.add("bounded", mean / self.least, self.limits.bounded, why);
        }
    }
}

/// The checks of a run so far.
struct Checks(Vec<Check>);

impl Checks {
    /// Adds a check; a value that is no number is not within its limit.
    fn add(&mut self, name: &'static str, value: f64, limit: f64, why: String) {
        self.0.push(Check {
            name,
            value,
            limit,
            held: value <= limit,
            time_s: None,
            why,
        });
    }
}
