//! The runs of `[uncertain]`: what each changes in the scene, and what it gives.

use super::sweep_case::{self, Found, Record};
use super::{RunArgs, run};
use crate::experiment::RunError;
use crate::report::number;
use crate::scene::{Scene, Uncertain, Variant};
use crate::thresher::Machine;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// The key to which hours of a machine are in inverse proportion.
const COEFFICIENT: &str = "wear.coefficient";
/// A contact time with which a scene can be checked before that of the run is known \[s\].
pub(super) const ANY_TIME: &str = "1e-6";

/// A result of a run that inputs move.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Output {
    pub name: String,
    pub unit: &'static str,
    /// Half width of its numerical error; NaN if unknown.
    pub error: f64,
    pub value: Result<f64, String>,
    /// The limit that ends a life.
    pub limit: Option<String>,
}

/// What all cases change besides an input: what a case does not need, and what would be fitted anew and so
/// hide what an input does.
pub(super) fn fixed(scene: &Scene, machine: Option<&Machine>, contact_time: &str) -> Vec<String> {
    let mut all = vec!["uncertain={}".to_owned()];
    let mut add = |key: &str, value: &str| {
        if scene.uncertain.iter().all(|input| input.key != key) {
            all.push(format!("{key}={value}"));
        }
    };
    match machine {
        Some(Machine::Study(setup)) => {
            let study = &setup.parameters;
            add("study.contact_time", contact_time);
            add("study.frictions", "[]");
            let first = |values: &[f64]| format!("[{:?}]", values.first().unwrap_or(&1.0));
            add("study.torques", &first(&study.torques));
            add("study.speeds", &first(&study.speeds));
        }
        Some(Machine::Thresher(_)) => add("wear.error", "\"run\""),
        None => {}
    }
    all
}

/// The run of a case: that of `args` with further changes.
pub(super) fn case(args: &RunArgs, changes: Vec<String>) -> RunArgs {
    let scene = args.common.scene.as_deref().unwrap_or_default();
    let mut run = sweep_case::arguments(scene, changes, false);
    let own = &args.common.flags;
    let typed = own.of_keys().into_iter().map(|(change, _)| change);
    let before = own.before.iter().chain(&own.set).cloned().chain(typed);
    let flags = &mut run.common.flags;
    flags.before = before.collect();
    flags.steps = own.steps;
    flags.threads.clone_from(&own.threads);
    run
}

/// What a summary tells of the wear: the hours to the first limit of a machine, or the depth of each body.
pub(super) fn outputs(found: &Value) -> Vec<Output> {
    if let Some(bodies) = found["wear"].as_array() {
        let of = |body: &Value| {
            let name = body["body"].as_str().unwrap_or_default();
            let depth = body["deepest_m"].as_f64().filter(|depth| *depth > 0.0);
            Output {
                name: format!("depth of {name}"),
                unit: "m",
                error: body["jump_error_m"].as_f64().unwrap_or(f64::NAN),
                value: depth.ok_or_else(|| "nothing wears".to_owned()),
                limit: None,
            }
        };
        return bodies.iter().map(of).collect();
    }
    let lives = found["life"].as_array().into_iter().flatten();
    let reached = lives.filter_map(|life| Some((life["hours"].as_f64()?, life)));
    let first = reached.min_by(|a, b| a.0.total_cmp(&b.0));
    let (value, error, limit) = match first {
        Some((hours, life)) => (
            Ok(hours),
            life["error_hours"].as_f64().unwrap_or(f64::NAN),
            life["limit"].as_str().map(str::to_owned),
        ),
        None => (
            Err("no limit is reached; see wear.max_hours".to_owned()),
            f64::NAN,
            None,
        ),
    };
    vec![Output {
        name: "life".to_owned(),
        unit: "h",
        error,
        value,
        limit,
    }]
}

/// A value of an input: its number, its variant; without a variant the scene's own.
pub(super) type Choice = Vec<Option<usize>>;

/// The runs of a scene with inputs at other values.
pub(super) struct Runs<'a> {
    pub args: &'a RunArgs,
    pub scene: &'a Scene,
    pub fixed: Vec<String>,
    pub folder: &'a Path,
    /// Results at the nominal values.
    pub base: Vec<Output>,
    pub closed: bool,
}

impl<'a> Runs<'a> {
    /// Whether the results of this input's values follow without a run.
    fn is_closed(&self, input: &Uncertain) -> bool {
        self.closed && input.key == COEFFICIENT && input.number.is_some()
    }

    /// The factor that values of inputs have on the results without a run.
    fn factor(&self, choice: &Choice) -> f64 {
        let all = self.scene.uncertain.iter().zip(choice);
        let factor = |(input, variant): (&Uncertain, &Option<usize>)| {
            let value = input.others[(*variant)?].number?;
            Some(input.number? / value).filter(|_| self.is_closed(input))
        };
        all.filter_map(factor).product()
    }

    /// What a run with these values changes in the scene.
    pub(super) fn changes(&self, choice: &Choice) -> Vec<String> {
        let all = self.scene.uncertain.iter().zip(choice);
        let changed = all.filter(|(input, _)| !self.is_closed(input));
        let flag = |(input, variant): (&'a Uncertain, &Option<usize>)| {
            variant.map(|k| input.others[k].flag.clone())
        };
        changed.filter_map(flag).collect()
    }

    /// The outputs with these values of the inputs.
    pub(super) fn outputs(&self, choice: &Choice) -> Result<Vec<Output>, RunError> {
        let changes = self.changes(choice);
        let mut found = match changes.is_empty() {
            true => self.base.clone(),
            false => self.run(changes)?,
        };
        let factor = self.factor(choice);
        for output in &mut found {
            output.value = output.value.clone().map(|value| value * factor);
        }
        Ok(found)
    }

    /// Runs a case that is not done yet.
    fn run(&self, changes: Vec<String>) -> Result<Vec<Output>, RunError> {
        let args = case(self.args, [self.fixed.clone(), changes].concat());
        let (scene, _) = run::checked(&args)?;
        let name = sweep_case::name(&scene);
        let record: Record = match sweep_case::look(self.folder, &name)? {
            Found::Whole(record) => *record,
            found => {
                let place = self.folder.join(&name);
                if let Found::Damaged(_) = found {
                    fs::remove_dir_all(&place).map_err(|e| sweep_case::io_error(&place, e))?;
                }
                sweep_case::run_case(self.folder, &name, &scene.name, args)?
            }
        };
        if record.ended {
            let why = record.why.unwrap_or_else(|| "it failed".to_owned());
            let none = |output: &Output| Output {
                value: Err(why.clone()),
                ..output.clone()
            };
            return Ok(self.base.iter().map(none).collect());
        }
        let found = sweep_case::summary(&self.folder.join(&name))?;
        Ok(outputs(&found))
    }
}

/// All inputs at once at the values that make the first output least, and most.
pub(super) fn corners(
    runs: &Runs<'_>,
    choices: &[Choice],
    found: &[Vec<Output>],
) -> Vec<(usize, Choice)> {
    let Some(Ok(nominal)) = runs.base.first().map(|output| output.value.clone()) else {
        return Vec::new();
    };
    let mut all = Vec::new();
    for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
        let mut corner: Choice = vec![None; runs.scene.uncertain.len()];
        for (k, chosen) in corner.iter_mut().enumerate() {
            let mut best = sign * nominal;
            for (choice, outputs) in choices.iter().zip(found) {
                let value = outputs.first().and_then(|o| o.value.clone().ok());
                if let (Some(variant), Some(value)) = (choice[k], value)
                    && sign * value < best
                {
                    (best, *chosen) = (sign * value, Some(variant));
                }
            }
        }
        // one alone was run
        if corner.iter().flatten().count() > 1 {
            all.push((side, corner));
        }
    }
    all
}

/// The values of the inputs of a case that are not the scene's.
pub(super) fn words(scene: &Scene, choice: &Choice) -> String {
    let all = scene.uncertain.iter().zip(choice);
    let several = choice.iter().flatten().count() > 1;
    let word = |(input, variant): (&Uncertain, &Option<usize>)| {
        let value = short(&input.others[(*variant)?]);
        Some(match several {
            true => format!("{} = {value}", input.key),
            false => value,
        })
    };
    all.filter_map(word).collect::<Vec<_>>().join(", ")
}

fn short(variant: &Variant) -> String {
    shortened(&variant.text, variant.number)
}

/// A number of many digits with four of them.
pub(super) fn shortened(text: &str, value: Option<f64>) -> String {
    let long = value.filter(|_| text.len() > 8);
    long.map_or(text.to_owned(), |value| number(value, 4))
}
