//! Reductions of the model: what a step leaves out, and what the full model costs and changes.
//!
//! Each leaves out unknowns whose values follow from the others, and has a key that brings them back.
//!
//! | reduction | why the result is the same | what may differ |
//! |---|---|---|
//! | islands at rest | they pose the problem of the last step again, see [`StepperSettings::keep_rest`](crate::dynamics::StepperSettings::keep_rest) | motion slower than 1e-8 of what forces give in a step is stopped |
//! | islands | no contact or joint couples them: `G` is block diagonal | the tolerance is relative to the velocities of the island, or of all; Newton's law is bounded by island |
//! | distant contacts | `P = 0` obeys the law of a contact that the others leave open | nothing but which of several solutions is found |
//! | friction rows | without friction the cone is a half-line: `P_T = 0` | the full model has a friction of 1e-12 |
//!
//! Bodies that are fixed or move as prescribed have no columns in `G`: with or without them, the operator is
//! the same, so that there is nothing to compare. The same holds for the joint rows that move no body.
//! `body.touches`, `joint.contacts` and `step.events` are choices of another model, not reductions.
//! The jumps of a wear life have an error of their own, which the run states.

use super::setting::step_count;
use super::simulate::{Engine, RunError, Totals};
use crate::report::{ModelRow, Progress};
use crate::scene::{Built, Scene, Step};

/// A reduction of the model.
pub struct Reduction {
    pub name: &'static str,
    /// Its switch in a scene file.
    pub key: &'static str,
    pub is_on: fn(&Step) -> bool,
    set: fn(&mut Step, bool),
}

/// All reductions of a step.
pub const REDUCTIONS: [Reduction; 4] = [
    Reduction {
        name: "islands at rest",
        key: "step.keep_rest",
        is_on: |step| step.keep_rest,
        set: |step, on| step.keep_rest = on,
    },
    Reduction {
        name: "islands",
        key: "step.split_islands",
        is_on: |step| step.split_islands,
        set: |step, on| step.split_islands = on,
    },
    Reduction {
        name: "distant contacts",
        key: "step.skip_distant",
        is_on: |step| step.skip_distant,
        set: |step, on| step.skip_distant = on,
    },
    Reduction {
        name: "friction rows",
        key: "step.skip_tangents",
        is_on: |step| step.skip_tangents,
        set: |step, on| step.skip_tangents = on,
    },
];

/// One of the two models of a scene.
struct Side {
    built: Built,
    totals: Totals,
    /// Least time of each step \[s\].
    times: Vec<f64>,
}

impl Side {
    fn new(scene: &Scene, reduction: &Reduction, on: bool) -> Result<Side, RunError> {
        let mut scene = scene.clone();
        (reduction.set)(&mut scene.step, on);
        Ok(Side {
            built: scene.build()?,
            totals: Totals::default(),
            times: Vec::new(),
        })
    }

    fn step(&mut self) -> Result<(), RunError> {
        let (record, seconds) = Engine::Moreau.timed_step(&mut self.built)?;
        self.totals.add(&record);
        self.times.push(seconds);
        Ok(())
    }
}

/// Steps `scene` with `reduction` and without it, in turns, `repeats` times.
///
/// # Returns
/// Unknowns, work and largest difference, which are deterministic, and times.
///
/// # Errors
/// [`RunError`] if the scene cannot be built or a step fails.
pub fn against_full(
    scene: &Scene,
    reduction: &Reduction,
    repeats: usize,
    progress: &Progress,
) -> Result<ModelRow, RunError> {
    let steps = step_count(&scene.step);
    let mut difference: f64 = 0.0;
    let mut least: [Vec<f64>; 2] = [vec![f64::INFINITY; steps], vec![f64::INFINITY; steps]];
    let mut last = None;
    for repeat in 0..repeats.max(1) {
        let mut full = Side::new(scene, reduction, false)?;
        let mut reduced = Side::new(scene, reduction, true)?;
        for step in 0..steps {
            // neither is always the first
            if (step + repeat) % 2 == 0 {
                full.step()?;
                reduced.step()?;
            } else {
                reduced.step()?;
                full.step()?;
            }
            difference = difference.max(apart(&full.built, &reduced.built));
            progress.advance();
        }
        for (least, side) in least.iter_mut().zip([&full, &reduced]) {
            for (least, time) in least.iter_mut().zip(&side.times) {
                *least = least.min(*time);
            }
        }
        last = Some([full.totals, reduced.totals]);
    }
    let [full, reduced] = last.unwrap_or_default();
    let work = |t: &Totals| t.sweeps + t.factorisations + t.pivots;
    let [time_full_s, time_s] = least.map(|times| times.iter().sum::<f64>());
    Ok(ModelRow {
        reduction: reduction.name.to_owned(),
        key: reduction.key.to_owned(),
        scene: scene.name.clone(),
        steps,
        unknowns_full: full.unknowns,
        unknowns: reduced.unknowns,
        work_full: work(&full),
        work: work(&reduced),
        time_full_s,
        time_s,
        time_ratio: time_s / time_full_s,
        difference,
    })
}

/// Largest distance of the same body in two worlds \[m\], and of its direction \[rad\].
fn apart(a: &Built, b: &Built) -> f64 {
    let of = |k: usize| {
        let ((a, _), (b, _)) = (a.state(k)?, b.state(k)?);
        let turned = (a.cos - b.cos).hypot(a.sin - b.sin);
        Some((a.translation - b.translation).norm().max(turned))
    };
    (0..a.bodies()).filter_map(of).fold(0.0, f64::max)
}
