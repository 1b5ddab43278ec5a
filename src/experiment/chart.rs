use super::compare::Comparison;
use super::results::{Results, run_settings};
use super::self_reference::SelfReference;
use super::setting::{Setting, step_count};
use super::simulate::RunError;
use crate::report::{Progress, step_length};
use crate::scene::{self, Scene, SceneError};

/// Scenes without a closed form that a chart runs by default: they stand, hang or roll, and are
/// cheap enough for step lengths down to 1/4000 s.
const STABILITY: [&str; 8] = [
    "tower",
    "heavy-top",
    "pyramid",
    "loaded-arch",
    "card-house",
    "high-mass-ratio-2",
    "high-mass-ratio-3",
    "chain",
];

/// Scenes of a quick chart: a stop, an impact, static forces, and a stack without a closed form.
const QUICK: [&str; 4] = ["sliding-block", "bouncing-ball", "beam", "tower"];

/// Names of the scenes that a chart runs by default: all with a closed form, in the order of the
/// catalogue, then some that test stability; a quick chart runs four scenes.
///
/// # Errors
/// Those of [`scene::scenes`].
pub fn charted_scenes(quick: bool) -> Result<Vec<String>, SceneError> {
    if quick {
        return Ok(QUICK.map(str::to_owned).to_vec());
    }
    let mut names = Vec::new();
    for listing in scene::scenes()? {
        if listing.has_reference {
            names.push(listing.name.to_owned());
        }
    }
    names.extend(STABILITY.map(str::to_owned));
    Ok(names)
}

/// The points of one scene's chart.
#[derive(Debug, Clone)]
pub struct ChartPlan<'a> {
    pub scene: &'a Scene,
    pub settings: Vec<Setting>,
    pub repeats: usize,
    /// Step and period of a self-converged reference, see [`Comparison::finest_and_period`]; `None`
    /// if the scene has a closed form.
    reference: Option<(f64, f64)>,
}

impl<'a> ChartPlan<'a> {
    /// Compares `settings` of `scene` with its closed form, or with a self-converged reference that
    /// is finer than the finest step of `comparison`.
    pub fn new(
        scene: &'a Scene,
        comparison: &Comparison,
        settings: Vec<Setting>,
        repeats: usize,
    ) -> Self {
        let own = scene.reference.is_none();
        ChartPlan {
            scene,
            settings,
            repeats,
            reference: own.then(|| comparison.finest_and_period(scene.step.dt)),
        }
    }

    /// Number of steps of all runs, for a progress bar.
    pub fn steps(&self) -> usize {
        let each: usize = self.settings.iter().map(|s| step_count(&s.step)).sum();
        let reference = self
            .reference
            .map_or(0, |(finest, _)| SelfReference::steps(self.scene, finest));
        each * self.repeats + reference
    }

    /// Runs all points.
    ///
    /// # Returns
    /// The rows of [`run_settings`]. For a scene without a closed form, the notes say what it is
    /// compared with instead, or that no comparison is possible.
    ///
    /// # Errors
    /// Those of [`run_settings`].
    pub fn run(&self, progress: &Progress) -> Result<Results, RunError> {
        let mut notes = Vec::new();
        let mut reference = None;
        if let Some((finest, period)) = self.reference {
            progress.message("reference");
            let steps = [finest, finest / 2.0, finest / 4.0].map(step_length);
            let steps = format!("{}, {} and {}", steps[0], steps[1], steps[2]);
            match SelfReference::converge(self.scene, finest, period, progress) {
                Ok(Some(found)) => {
                    notes.push(format!(
                        "no closed form: trajectories are compared with moreau's own run, {}, by \
                         steps of {steps}; smaller errors cannot be measured",
                        found.describe()
                    ));
                    reference = Some(found);
                }
                Ok(None) => notes.push(format!(
                    "no closed form, and moreau's runs at steps of {steps} do not converge: no \
                     trajectory is compared"
                )),
                Err(RunError::Step(error)) => notes.push(format!(
                    "no closed form, and moreau's reference run fails ({error}): no trajectory is \
                     compared"
                )),
                Err(error) => return Err(error),
            }
            progress.message("");
        }
        let mut results = run_settings(
            self.scene,
            &self.settings,
            self.repeats,
            reference.as_ref(),
            progress,
        )?;
        notes.append(&mut results.notes);
        results.notes = notes;
        Ok(results)
    }
}
