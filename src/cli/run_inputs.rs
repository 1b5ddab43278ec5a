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

use super::sweep::in_parallel;
use super::sweep_case::{self, Found, Record};
use super::{RunArgs, run};
use crate::experiment::RunError;
use crate::report::{
    Align, OutputFolder, Progress, Table, Tornado, TornadoRow, number, quantity, row, write_rows,
};
use crate::scene::{Scene, Uncertain, Variant};
use crate::thresher::{Machine, Reading};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

/// The key to which hours of a machine are in inverse proportion.
const COEFFICIENT: &str = "wear.coefficient";
/// A contact time with which a scene can be checked before that of the run is known \[s\].
const ANY_TIME: &str = "1e-6";

row! {
    /// A result of a scene with inputs at other values.
    InputRow in "uncertain.csv" {
        result: String,
        unit: String,
        /// The key that is changed; `together` for all at once.
        input: String,
        value: String,
        /// NaN where there is none.
        found: f64,
        /// Over the nominal result.
        ratio: f64,
        /// `run`, `closed form`, or why there is no result.
        how: String,
    }
}

/// A result of a run that inputs move.
#[derive(Debug, Clone, PartialEq)]
struct Output {
    name: String,
    unit: &'static str,
    /// Half width of its numerical error; NaN if unknown.
    error: f64,
    value: Result<f64, String>,
    /// The limit that ends a life.
    limit: Option<String>,
}

/// What an input does to an output at one of its values.
#[derive(Debug, Clone, PartialEq)]
struct Effect {
    text: String,
    found: Result<f64, String>,
    limit: Option<String>,
    closed: bool,
}

/// What an input does to an output.
struct Cause<'a> {
    input: &'a Uncertain,
    effects: Vec<Effect>,
    /// Logarithms of the largest ratios, down and up, both at least 0.
    reach: [f64; 2],
}

/// An output with its two bands.
struct Bands<'a> {
    output: Output,
    nominal: f64,
    causes: Vec<Cause<'a>>,
    /// All inputs at once at the ends that make the first output least, 0, and most, 1; none where that is
    /// one input alone.
    together: Vec<(usize, Effect)>,
}

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

/// What all cases change besides an input: what a case does not need, and what would be fitted anew and so
/// hide what an input does.
fn fixed(scene: &Scene, machine: Option<&Machine>, contact_time: &str) -> Vec<String> {
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
fn case(args: &RunArgs, changes: Vec<String>) -> RunArgs {
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
fn outputs(found: &Value) -> Vec<Output> {
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
type Choice = Vec<Option<usize>>;

/// The runs of a scene with inputs at other values.
struct Runs<'a> {
    args: &'a RunArgs,
    scene: &'a Scene,
    fixed: Vec<String>,
    folder: &'a Path,
    /// Results at the nominal values.
    base: Vec<Output>,
    closed: bool,
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
    fn changes(&self, choice: &Choice) -> Vec<String> {
        let all = self.scene.uncertain.iter().zip(choice);
        let changed = all.filter(|(input, _)| !self.is_closed(input));
        let flag = |(input, variant): (&'a Uncertain, &Option<usize>)| {
            variant.map(|k| input.others[k].flag.clone())
        };
        changed.filter_map(flag).collect()
    }

    /// The outputs with these values of the inputs.
    fn outputs(&self, choice: &Choice) -> Result<Vec<Output>, RunError> {
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
    let nominal: Choice = vec![None; scene.uncertain.len()];
    let mut choices: Vec<Choice> = Vec::new();
    for (k, input) in scene.uncertain.iter().enumerate() {
        for variant in 0..input.others.len() {
            let mut choice = nominal.clone();
            choice[k] = Some(variant);
            choices.push(choice);
        }
    }
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
    let mut bands = Vec::new();
    for (k, output) in runs.base.iter().enumerate() {
        let effect = |choice: &Choice, found: &[Output]| Effect {
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
            let own = choices
                .iter()
                .zip(&alone)
                .filter(|(c, _)| c[number].is_some());
            let effects = own.map(|(choice, found)| effect(choice, found)).collect();
            Cause::new(input, effects, nominal)
        });
        bands.push(Bands {
            output: output.clone(),
            nominal,
            causes: causes.collect(),
            together: (sides.iter().zip(corners.iter().zip(&at_corners)))
                .map(|(side, (choice, found))| (*side, effect(choice, found)))
                .collect(),
        });
    }
    Ok(Some(Inputs {
        scene,
        bands,
        held: held(machine),
        runs: made,
    }))
}

/// All inputs at once at the values that make the first output least, and most.
fn corners(runs: &Runs<'_>, choices: &[Choice], found: &[Vec<Output>]) -> Vec<(usize, Choice)> {
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
fn words(scene: &Scene, choice: &Choice) -> String {
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
fn shortened(text: &str, value: Option<f64>) -> String {
    let long = value.filter(|_| text.len() > 8);
    long.map_or(text.to_owned(), |value| number(value, 4))
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

impl<'a> Cause<'a> {
    fn new(input: &'a Uncertain, effects: Vec<Effect>, nominal: f64) -> Cause<'a> {
        let mut reach = [0.0f64; 2];
        for value in effects
            .iter()
            .filter_map(|effect| effect.found.as_ref().ok())
        {
            let log = (value / nominal).ln();
            reach = [reach[0].max(-log), reach[1].max(log)];
        }
        Cause {
            input,
            effects,
            reach,
        }
    }

    fn span(&self) -> f64 {
        self.reach[0] + self.reach[1]
    }

    /// Least and largest value of the output.
    fn ends(&self, nominal: f64) -> [f64; 2] {
        let [down, up] = self.reach;
        [nominal * (-down).exp(), nominal * up.exp()]
    }
}

impl Bands<'_> {
    /// Equation (1) of this module.
    fn inputs(&self) -> [f64; 2] {
        let sum = |side: usize| {
            let squares = self.causes.iter().map(|cause| cause.reach[side].powi(2));
            squares.sum::<f64>().sqrt()
        };
        [self.nominal * (-sum(0)).exp(), self.nominal * sum(1).exp()]
    }

    /// All effects multiplied, without and with equation (1)'s square root: what the corners would be.
    fn product(&self) -> [f64; 2] {
        let sum = |side: usize| self.causes.iter().map(|c| c.reach[side]).sum::<f64>();
        [self.nominal * (-sum(0)).exp(), self.nominal * sum(1).exp()]
    }

    fn numerics(&self) -> Option<[f64; 2]> {
        let error = self.output.error;
        error
            .is_finite()
            .then_some([self.nominal - error, self.nominal + error])
    }

    /// Causes, the largest first; equal ones in the order of the file.
    fn ranked(&self) -> Vec<&Cause<'_>> {
        let mut all: Vec<&Cause> = self.causes.iter().collect();
        all.sort_by(|a, b| b.span().total_cmp(&a.span()));
        all
    }

    fn show(&self, value: f64) -> String {
        match self.output.unit {
            "h" => format!("{} h", number(value, 4)),
            unit => quantity(value, unit, 4),
        }
    }

    fn range(&self, [from, to]: [f64; 2]) -> String {
        format!("{} to {}", self.show(from), self.show(to))
    }

    /// What the output is.
    fn title(&self) -> String {
        match &self.output.limit {
            Some(limit) => format!("{}, until {limit}", self.output.name),
            None => self.output.name.clone(),
        }
    }

    /// The largest cause in words.
    fn largest(&self) -> String {
        let ranked = self.ranked();
        let Some(first) = ranked.first().filter(|cause| cause.span() > 0.0) else {
            return "no input moves it".to_owned();
        };
        let squares = |cause: &Cause| cause.span().powi(2);
        let all: f64 = ranked.iter().map(|cause| squares(cause)).sum();
        let wide = |[a, b]: [f64; 2]| (b / a).ln();
        let numerics = self.numerics().filter(|[from, _]| *from > 0.0).map(wide);
        let beside = match numerics {
            Some(log) if log > first.span() => ", less than the numerics",
            _ => "",
        };
        format!(
            "the largest cause is {}: alone it gives {}, a factor of {}, and {} % of the squares of (1){beside}",
            first.input.key,
            self.range(first.ends(self.nominal)),
            number(first.span().exp(), 3),
            number(100.0 * squares(first) / all, 2)
        )
    }

    fn describe(&self) -> String {
        let numerics = self
            .numerics()
            .map_or("not known".to_owned(), |n| self.range(n));
        let mut out = format!(
            "{}: {}, with two bands\n  numerics  {numerics}\n  inputs    {}\n",
            self.title(),
            self.show(self.nominal),
            self.range(self.inputs())
        );
        let mut table = Table::new([
            ("input", Align::Left),
            ("value", Align::Right),
            (self.output.name.as_str(), Align::Right),
            ("ratio", Align::Right),
            ("how", Align::Left),
        ]);
        for cause in self.ranked() {
            let own = [
                cause.input.key.clone(),
                shortened(&cause.input.nominal, cause.input.number),
                self.show(self.nominal),
                String::new(),
                "the scene".to_owned(),
            ];
            table.push(own);
            for effect in &cause.effects {
                self.push(&mut table, String::new(), effect);
            }
        }
        out.push_str(&format!("{table}"));
        out.push_str(&format!("{}\n", self.largest()));
        for (side, effect) in &self.together {
            let found = match &effect.found {
                Ok(value) => self.show(*value),
                Err(why) => format!("no result ({why})"),
            };
            out.push_str(&format!(
                "all at once, {}: {found}; the single effects multiplied are {}\n",
                effect.text,
                self.show(self.product()[*side])
            ));
        }
        out
    }

    fn push(&self, table: &mut Table, name: String, effect: &Effect) {
        let (value, ratio) = match &effect.found {
            Ok(value) => (self.show(*value), number(value / self.nominal, 4)),
            Err(_) => ("-".to_owned(), "-".to_owned()),
        };
        table.push([name, effect.text.clone(), value, ratio, self.how(effect)]);
    }

    fn how(&self, effect: &Effect) -> String {
        match &effect.found {
            Err(why) => why.clone(),
            Ok(_) if effect.closed => "closed form, 1/K".to_owned(),
            Ok(_) => match &effect.limit {
                limit if *limit == self.output.limit => "run".to_owned(),
                Some(limit) => format!("run; {limit} first"),
                None => "run".to_owned(),
            },
        }
    }

    fn rows(&self) -> impl Iterator<Item = InputRow> + '_ {
        let row = |input: &str, effect: &Effect| {
            let found = effect.found.clone().unwrap_or(f64::NAN);
            InputRow {
                result: self.output.name.clone(),
                unit: self.output.unit.to_owned(),
                input: input.to_owned(),
                value: effect.text.clone(),
                found,
                ratio: found / self.nominal,
                how: self.how(effect),
            }
        };
        let alone = self.causes.iter().flat_map(move |cause| {
            let key = cause.input.key.as_str();
            cause.effects.iter().map(move |effect| row(key, effect))
        });
        let together = self.together.iter();
        alone.chain(together.map(move |(_, effect)| row("together", effect)))
    }

    fn json(&self) -> Value {
        let one = |effect: &Effect| {
            json!({
                "value": effect.text,
                "found": effect.found.as_ref().ok(),
                "how": self.how(effect),
            })
        };
        let cause = |cause: &&Cause| {
            json!({
                "input": cause.input.key,
                "nominal": cause.input.nominal,
                "band": cause.ends(self.nominal),
                "values": cause.effects.iter().map(one).collect::<Vec<_>>(),
            })
        };
        json!({
            "result": self.output.name,
            "unit": self.output.unit,
            "limit": self.output.limit,
            "nominal": self.nominal,
            "numerics": self.numerics(),
            "inputs": self.inputs(),
            "causes": self.ranked().iter().map(cause).collect::<Vec<_>>(),
            "together": self.together.iter().map(|(_, e)| one(e)).collect::<Vec<_>>(),
            "largest": self.largest(),
        })
    }

    fn picture(&self, scene: &Scene) -> Tornado {
        let band = |name: &str, ends: [f64; 2]| TornadoRow {
            name: name.to_owned(),
            ends: ends.map(|end| (end, self.show(end))).into(),
            band: true,
        };
        let mut rows: Vec<TornadoRow> = Vec::new();
        for cause in self.ranked() {
            let ends = cause.effects.iter().filter_map(|effect| {
                let value = *effect.found.as_ref().ok()?;
                Some((value, effect.text.clone()))
            });
            rows.push(TornadoRow {
                name: format!(
                    "{} ({})",
                    cause.input.key,
                    shortened(&cause.input.nominal, cause.input.number)
                ),
                ends: ends.collect(),
                band: false,
            });
        }
        rows.push(band("all inputs", self.inputs()));
        rows.extend(self.numerics().map(|ends| band("numerics", ends)));
        Tornado {
            title: "What each uncertain input does".to_owned(),
            subtitle: format!("{}, {}", scene.name, self.title()),
            axis: format!("{} [{}]", self.output.name, self.output.unit),
            nominal: self.nominal,
            rows,
            notes: vec![
                "Above each bar what the input is at its end; in brackets what it is in the scene, the upright \
                 line."
                    .to_owned(),
                "All inputs: one at a time, logarithms added in quadrature; inputs that act on each other are \
                 not seen by it."
                    .to_owned(),
            ],
        }
    }
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
