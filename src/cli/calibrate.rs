//! `calibrate`: the wear coefficient of a scene from weighed parts, depths or a traced profile.

use super::calibrate_data::{Data, Kind};
use super::{Common, Outcome, effect, summary};
use crate::experiment::{CalibrationError, Course, Fit, Measured, RunError, Second};
use crate::report::{OutputFolder, row, write_rows};
use crate::scene::Scene;
use crate::scene::keys::COEFFICIENTS;
use crate::thresher::{self, Machine, WornCourse, worn_course, worn_part};
use clap::{ArgGroup, Args};
use std::path::PathBuf;

/// Relative change of a second parameter, either way, from which the derivative is taken.
const CHANGE: f64 = 0.05;

#[derive(Args)]
#[command(override_usage = "moreau2d calibrate [OPTIONS] --hours <H>\n       \
                            <--mass-loss <G>|--depth <M>|--profile <FILE.csv>> <SCENE>")]
#[command(group(ArgGroup::new("data").required(true).args(["mass_loss", "depth", "profile"])))]
pub(super) struct CalibrateArgs {
    #[command(flatten)]
    common: Common,
    /// Mass that a part has lost [g], of one or, separated by commas, of several alike.
    #[arg(
        long,
        value_name = "G",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    pub mass_loss: Vec<f64>,
    /// Depth of the deepest wear of a part [m], of one or several alike.
    #[arg(
        long,
        value_name = "M",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    pub depth: Vec<f64>,
    /// Points of a worn surface: a CSV file with the columns x_m and y_m, in the frame of the part.
    #[arg(long, value_name = "FILE.csv")]
    pub profile: Option<PathBuf>,
    /// Hours of work after which that was measured: one number, or one for each measurement.
    #[arg(
        long,
        value_name = "H",
        value_delimiter = ',',
        required = true,
        allow_hyphen_values = true
    )]
    pub hours: Vec<f64>,
    /// Standard deviation of a measurement, in its unit (g or m) [default: from the scatter].
    #[arg(long, value_name = "U", allow_hyphen_values = true)]
    pub uncertainty: Option<f64>,
    /// Probability with which the interval holds the coefficient.
    #[arg(
        long,
        value_name = "P",
        default_value_t = 0.95,
        allow_hyphen_values = true
    )]
    pub level: f64,
    /// Density of the part [kg/m³], for --mass-loss [default: that of the body in the scene, or 7850, steel].
    #[arg(long, value_name = "RHO", allow_hyphen_values = true)]
    pub density: Option<f64>,
    /// Width of the part across the scene [m], for --mass-loss [default: the machine's, or 1].
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub width: Option<f64>,
    /// The body that was measured, in a scene where several wear.
    #[arg(long, value_name = "NAME")]
    pub body: Option<String>,
    /// A key with a number of which to tell whether the data can tell it from the coefficient; two more runs
    /// each; may be repeated [default: the keys of [uncertain] that are numbers].
    #[arg(long, value_name = "KEY")]
    against: Vec<String>,
}

row! {
    /// A measurement beside what the run gives with the coefficient that was found, in kg or m.
    MeasurementRow in "calibration.csv" {
        hours: f64,
        measured: f64,
        fitted: f64,
        residual: f64,
    }
}

/// A parameter besides the coefficient.
pub(super) struct Against {
    pub key: String,
    pub value: f64,
    pub second: Result<Second, String>,
}

/// What was found.
pub(super) struct Found {
    pub worn: WornCourse,
    pub data: Data,
    pub course: Course,
    pub measured: Measured,
    pub fit: Fit,
    pub against: Vec<Against>,
}

/// Runs the scene, fits the coefficient and writes what it found.
pub(super) fn calibrate(args: &CalibrateArgs) -> Result<Outcome, RunError> {
    let flags = &args.common.flags;
    let (scene, machine) = args.common.load()?;
    worn_part(&scene, machine.as_ref(), args.body.as_deref())?;
    let data = Data::read(args)?;
    flags.refuse_twice(&scene)?;
    let run = effect::Run::new("calibrate", &scene, machine.as_ref(), flags);
    run.refuse(flags, &flags.of_runs())?;
    let seconds = seconds(args, &scene)?;
    let target = flags.out.clone();
    let target =
        target.unwrap_or_else(|| PathBuf::from("out").join(format!("calibrate-{}", scene.name)));
    let folder = OutputFolder::create(target)?;
    let worn = run_worn(args, &scene, machine.as_ref())?;
    data.check_on(&worn)?;
    let measured = data.measured();
    let course = data.course(&worn, args);
    let fit = course.fit(&measured);
    let fit = fit.map_err(|error| no_fit(error, &scene, &worn, &data, &course, args))?;
    let (coefficient, [least, most]) = (fit.ratio * worn.coefficient, COEFFICIENTS);
    if !(least..=most).contains(&coefficient) {
        return Err(RunError::Unfit(format!(
            "--hours: these and the {} give {} = {coefficient:e} m2/N; allowed is {least:e} to {most}: look at the \
             units",
            data.kind.word(),
            worn.key
        )));
    }
    let mut against = Vec::new();
    for (key, value) in seconds {
        let second = slope(args, &worn, &data, &measured, &fit, (&key, value))?;
        let second = second.map(|slope| Second::new(&fit, &slope));
        against.push(Against { key, value, second });
    }
    let found = Found {
        worn,
        data,
        course,
        measured,
        fit,
        against,
    };
    found.write(&folder, &scene)?;
    let head = summary::header("calibrate", &scene);
    let more = found.json(args);
    summary::close(folder, head, more, flags.say(), |target| {
        format!(
            "{}: {}\n{}results in {}\n",
            scene.name,
            scene.title,
            found.describe(args),
            target.display()
        )
    })?;
    Ok(Outcome::Done)
}

fn run_worn(
    args: &CalibrateArgs,
    scene: &Scene,
    machine: Option<&Machine>,
) -> Result<WornCourse, RunError> {
    let steps = args.common.step_count(scene);
    let quiet = args.common.flags.quiet;
    worn_course(scene, machine, args.body.as_deref(), steps, quiet)
}

/// The parameters to tell from the coefficient, with their values in the scene.
fn seconds(args: &CalibrateArgs, scene: &Scene) -> Result<Vec<(String, f64)>, RunError> {
    let is_coefficient = |key: &str| key.starts_with("wear.") && key.ends_with("coefficient");
    if args.against.is_empty() {
        let numbers = scene.uncertain.iter().filter_map(|input| {
            let value = input.number.filter(|value| *value != 0.0)?;
            Some((input.key.clone(), value))
        });
        return Ok(numbers.filter(|(key, _)| !is_coefficient(key)).collect());
    }
    let mut found = Vec::new();
    for key in &args.against {
        // read as an uncertain input is: a key of the scene, with a number
        let flags = [format!("uncertain={{ \"{key}\" = {{ percent = 1 }} }}")];
        let (scene, _) = load(args, &flags)
            .map_err(|error| RunError::Unfit(format!("--against {key}: {error}")))?;
        let input = scene.uncertain.first();
        let number = input.and_then(|input| Some((input.key.clone(), input.number?)));
        let (key, value) = number.ok_or_else(|| {
            RunError::Unfit(format!("--against {key}: allowed is the key of a number"))
        })?;
        if is_coefficient(&key) {
            let why = "is what is fitted, or acts as it";
            return Err(RunError::Unfit(format!("--against {key}: {why}")));
        }
        found.push((key, value));
    }
    Ok(found)
}

/// The scene with further changes.
fn load(args: &CalibrateArgs, more: &[String]) -> Result<(Scene, Option<Machine>), RunError> {
    let flags = &args.common.flags;
    let typed = flags.of_keys().into_iter().map(|(change, _)| change);
    let all = flags
        .set
        .iter()
        .cloned()
        .chain(typed)
        .chain(more.iter().cloned());
    let name = args.common.scene.as_deref().unwrap_or_default();
    Ok(thresher::load(name, &all.collect::<Vec<_>>())?)
}

/// Derivative of what is measured by the logarithm of a key, at the coefficient that was found; or why the
/// scene with another value tells none.
fn slope(
    args: &CalibrateArgs,
    worn: &WornCourse,
    data: &Data,
    measured: &Measured,
    fit: &Fit,
    (key, value): (&str, f64),
) -> Result<Result<Vec<f64>, String>, RunError> {
    let mut ends = Vec::new();
    for sign in [-1.0, 1.0] {
        let end = value * (1.0 + sign * CHANGE);
        let held = worn.fitted.iter().filter(|(fitted, _)| fitted != key);
        let mut changes: Vec<String> = held
            .map(|(key, value)| format!("{key}={value:?}"))
            .collect();
        changes.push(format!("{key}={end:?}"));
        let changed = load(args, &changes);
        let (scene, machine) = match changed {
            Ok(found) => found,
            Err(error) => return Ok(Err(error.to_string())),
        };
        match run_worn(args, &scene, machine.as_ref()) {
            Ok(worn) => ends.push(data.course(&worn, args).all(measured, fit.ratio)),
            Err(error) => return Ok(Err(error.to_string())),
        }
    }
    let pairs = ends[0].iter().zip(&ends[1]);
    Ok(Ok(pairs.map(|(a, b)| (b - a) / (2.0 * CHANGE)).collect()))
}

/// Why there is no coefficient, and what to do.
fn no_fit(
    error: CalibrationError,
    scene: &Scene,
    worn: &WornCourse,
    data: &Data,
    course: &Course,
    args: &CalibrateArgs,
) -> RunError {
    let what = data.kind.word();
    RunError::Unfit(match error {
        CalibrationError::Beyond => {
            let most = course.found.iter().flatten().copied().fold(0.0, f64::max);
            let reached = match &data.kind {
                Kind::Profile(..) => String::new(),
                kind => format!(", {}", kind.show(most)),
            };
            let longer = match scene.life {
                Some(life) => format!("give a longer life.duration than {:?} s", life.duration),
                None => "let it run to a deeper limit, wear.limits, or longer, wear.max_hours"
                    .to_owned(),
            };
            format!(
                "scene {}: the {what} is at or beyond the end of the run{reached}: {longer}",
                scene.name
            )
        }
        CalibrationError::NoWear => match &args.profile {
            Some(path) => format!(
                "{}: the new surface of {} fits these points best: no wear is seen in them",
                path.display(),
                worn.part
            ),
            None => format!("scene {}: nothing wears in it", scene.name),
        },
        CalibrationError::Equal | CalibrationError::NoScatter => {
            "the measurements have no scatter that could tell their error: give --uncertainty, the standard \
             deviation of one"
                .to_owned()
        }
        CalibrationError::Shape => format!(
            "scene {}: {} does not wear in the run: there is no {what} to compare with",
            scene.name, worn.part
        ),
        other => format!("scene {}: {other}", scene.name),
    })
}

impl Found {
    pub(super) fn coefficient(&self) -> f64 {
        self.fit.ratio * self.worn.coefficient
    }

    /// Ends of the interval; the upper one may be open.
    pub(super) fn interval(&self) -> [Option<f64>; 2] {
        let k = self.worn.coefficient;
        [Some(k * self.fit.low), self.fit.high.map(|high| k * high)]
    }

    fn write(&self, folder: &OutputFolder, scene: &Scene) -> Result<(), RunError> {
        let pairs = self.measured.values.iter().zip(&self.fit.fitted);
        let rows: Vec<MeasurementRow> = (self.measured.hours.iter().zip(pairs))
            .map(|(hours, (measured, fitted))| MeasurementRow {
                hours: *hours,
                measured: *measured,
                fitted: *fitted,
                residual: measured - fitted,
            })
            .collect();
        write_rows(folder, &rows)?;
        folder.write("calibration.svg", self.picture(scene).to_svg()?)?;
        Ok(())
    }
}
