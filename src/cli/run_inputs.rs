//! `[uncertain]`: how far the inputs of a scene move its wear, beside the error of the computation.
//!
//! One input at a time takes its other values, each in a run of its own that is checked before the first
//! one begins. Of a machine the hours go with 1/K exactly, as time enters the wear only as `K t` and jumps
//! are bounded by depth: values of `wear.coefficient` need no run. Effects are ratios to the nominal
//! result. With `u_i` and `d_i` the largest logarithms of input i up and down, all inputs together give
//!
//! ```text
//! [ v exp(-√Σ d_i²), v exp(√Σ u_i²) ]                                              (1)
//! ```
//!
//! which holds for independent inputs whose effects multiply. Two more runs, with all inputs at once at the
//! ends that shorten and lengthen the life, tell how far that is from true.

use super::input_bands::{Bands, Cause, Effect};
use super::input_cases::{ANY_TIME, Choice, Output, Runs, case, corners, fixed, outputs, words};
use super::input_output::InputRow;
use super::sweep::in_parallel;
use super::{RunArgs, run};
use crate::experiment::RunError;
use crate::report::{OutputFolder, Progress, write_rows};
use crate::scene::{Scene, Uncertain, Variant};
use crate::thresher::{Machine, Reading};
use serde_json::Value;

/// The bands of all outputs of a scene.
pub(super) struct Inputs<'a> {
    scene: &'a Scene,
    bands: Vec<Bands<'a>>,
    /// What the runs hold fixed, in words.
    held: String,
    runs: usize,
}

/// Checks the runs that a scene with `[uncertain]` needs.
///
/// # Errors
/// Those of the first case that cannot be run, at the place in `[uncertain]` that causes it.
pub(super) fn check(
    args: &RunArgs,
    scene: &Scene,
    machine: Option<&Machine>,
) -> Result<(), RunError> {
    if let (Some(first), Some(Machine::Study(setup))) = (scene.uncertain.first(), machine)
        && setup.parameters.reading == Reading::Literal
    {
        return Err(RunError::Unfit(format!(
            "{}: the reading \"literal\" of a study has no life that inputs could move; \"torque-balanced\" \
             has one",
            first.place
        )));
    }
    if let (Some(first), Some(machine)) = (scene.uncertain.first(), machine) {
        machine.needs_strip(&first.place.to_string())?;
    }
    let fixed = fixed(scene, machine, ANY_TIME);
    for input in &scene.uncertain {
        for variant in &input.others {
            let mut flags = fixed.clone();
            flags.push(variant.flag.clone());
            run::checked(&case(args, flags)).map_err(|error| placed(error, input, variant))?;
        }
    }
    Ok(())
}

/// An error of a case, at the place that causes it.
fn placed(error: RunError, input: &Uncertain, variant: &Variant) -> RunError {
    let place = &input.place;
    match error {
        RunError::Scene(error) => {
            let error = error.placed(&variant.flag, place);
            match error.to_string().starts_with(&place.file) {
                true => RunError::Scene(error),
                false => RunError::Unfit(format!("{place} with {}: {error}", variant.flag)),
            }
        }
        other => RunError::Unfit(format!("{place} with {}: {other}", variant.flag)),
    }
}

/// Runs the cases of `[uncertain]`; `None` for a scene without.
///
/// # Arguments
/// - `found`: `summary.json` of the run at the nominal values, as far as it goes.
///
/// # Errors
/// Those of files, and of a case that cannot be started.
pub(super) fn run<'a>(
    args: &RunArgs,
    scene: &'a Scene,
    machine: Option<&Machine>,
    folder: &OutputFolder,
    found: &Value,
) -> Result<Option<Inputs<'a>>, RunError> {
    if scene.uncertain.is_empty() {
        return Ok(None);
    }
    let time = found["life_contact_time_s"].as_f64();
    let time = time.map_or(ANY_TIME.to_owned(), |time| format!("{time:?}"));
    let scratch = folder.scratch("inputs")?;
    let runs = Runs {
        args,
        scene,
        fixed: fixed(scene, machine, &time),
        folder: &scratch,
        base: outputs(found),
        closed: machine.is_some(),
    };
    let choices = one_at_a_time(scene);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    // a thresher runs two lives on two threads
    let jobs = match machine {
        Some(Machine::Thresher(_)) => (cores / 2).max(1),
        _ => cores,
    };
    let progress = Progress::new("inputs", choices.len() as u64 + 2, args.common.flags.quiet);
    let all = |choices: &[Choice]| {
        in_parallel(jobs, choices.len(), |k| {
            let found = runs.outputs(&choices[k]);
            progress.advance();
            found
        })
    };
    let alone = all(&choices)?;
    let corners = corners(&runs, &choices, &alone);
    let (sides, corners): (Vec<usize>, Vec<Choice>) = corners.into_iter().unzip();
    let at_corners = all(&corners)?;
    let made = choices.iter().chain(&corners);
    let made = made
        .filter(|choice| !runs.changes(choice).is_empty())
        .count();
    let alone: Vec<_> = choices.iter().zip(&alone).collect();
    let corners: Vec<_> = corners.iter().zip(&at_corners).collect();
    let bands = runs.base.iter().enumerate();
    let bands =
        bands.map(|(k, output)| bands_of(scene, &runs, (k, output), &alone, (&sides, &corners)));
    let bands = bands.collect::<Result<Vec<_>, _>>()?;
    Ok(Some(Inputs {
        scene,
        bands,
        held: held(machine),
        runs: made,
    }))
}

/// The choices in which one input takes one of its other values.
fn one_at_a_time(scene: &Scene) -> Vec<Choice> {
    let mut choices = Vec::new();
    for (k, input) in scene.uncertain.iter().enumerate() {
        for variant in 0..input.others.len() {
            let mut choice: Choice = vec![None; scene.uncertain.len()];
            choice[k] = Some(variant);
            choices.push(choice);
        }
    }
    choices
}

/// The bands of output `k` from the cases with one input changed and from those with all changed.
///
/// # Errors
/// [`RunError::Unfit`] if the output has no nominal value.
fn bands_of<'a>(
    scene: &'a Scene,
    runs: &Runs<'_>,
    (k, output): (usize, &Output),
    alone: &[(&Choice, &Vec<Output>)],
    (sides, corners): (&[usize], &[(&Choice, &Vec<Output>)]),
) -> Result<Bands<'a>, RunError> {
    let effect = |(choice, found): &(&Choice, &Vec<Output>)| Effect {
        text: words(scene, choice),
        found: found
            .get(k)
            .map_or(Err("no result".to_owned()), |o| o.value.clone()),
        limit: found.get(k).and_then(|o| o.limit.clone()),
        closed: runs.changes(choice).is_empty(),
    };
    let value = output.value.clone();
    let nominal = value.map_err(|why| {
        let place = &scene.uncertain[0].place;
        RunError::Unfit(format!("{place}: no {} to move: {why}", output.name))
    })?;
    let causes = scene.uncertain.iter().enumerate().map(|(number, input)| {
        let own = alone.iter().filter(|(choice, _)| choice[number].is_some());
        Cause::new(input, own.map(effect).collect(), nominal)
    });
    let together = sides.iter().copied().zip(corners.iter().map(effect));
    Ok(Bands {
        output: output.clone(),
        nominal,
        causes: causes.collect(),
        together: together.collect(),
    })
}

/// What stays as it is while inputs vary.
fn held(machine: Option<&Machine>) -> String {
    match machine {
        Some(Machine::Study(_)) => {
            "the contact time of a cycle is held: fitted anew, it would take up what inputs do"
        }
        Some(Machine::Thresher(_)) => {
            "the wear coefficient is held, and the crop's stiffness is calibrated to the operating torque in \
             each run"
        }
        None => "everything else is held",
    }
    .to_owned()
}

impl Inputs<'_> {
    /// The part of `summary.json`.
    pub fn json(&self) -> Value {
        self.bands.iter().map(Bands::json).collect()
    }

    pub fn describe(&self) -> String {
        let mut out = String::from("\n");
        for bands in &self.bands {
            out.push_str(&bands.describe());
        }
        out.push_str(&format!(
            "inputs: {} runs; one at a time between the bounds of [uncertain], ratios combined as the root of the \
             sum of\nsquared logarithms, lower and upper ends apart. That sees no inputs that move together, none \
             that act on each\nother, and nothing between the ends; {}.\n",
            self.runs, self.held
        ));
        out
    }

    /// Writes `uncertain.csv` and a picture for each output.
    ///
    /// # Errors
    /// [`RunError::Report`].
    pub fn write(&self, folder: &OutputFolder) -> Result<(), RunError> {
        let rows: Vec<InputRow> = self.bands.iter().flat_map(Bands::rows).collect();
        write_rows(folder, &rows)?;
        for (k, bands) in self.bands.iter().enumerate() {
            let name = match k {
                0 => "tornado.svg".to_owned(),
                k => format!("tornado-{}.svg", k + 1),
            };
            folder.write(&name, bands.picture(self.scene).to_svg()?)?;
        }
        Ok(())
    }
}
