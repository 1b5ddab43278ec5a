//! `calibrate`: the wear coefficient of a scene from weighed parts, depths or a traced profile.

use super::calibrate_data::{Data, Kind};
use super::{Common, Outcome, effect, summary};
use crate::experiment::{CalibrationError, Course, Fit, Measured, RunError, Second};
use crate::report::{
    Axis, Chart, Colour, Dash, OutputFolder, Series, Style, number, row, write_rows,
};
use crate::scene::Scene;
use crate::thresher::{self, Machine, WornCourse, worn_course};
use clap::{ArgGroup, Args};
use serde_json::json;
use std::path::PathBuf;

/// Relative change of a second parameter, either way, from which the derivative is taken.
const CHANGE: f64 = 0.05;

#[derive(Args)]
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
    /// Density of the part [kg/m³], for --mass-loss [default: 7850, steel].
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
struct Against {
    key: String,
    value: f64,
    second: Result<Second, String>,
}

/// What was found.
struct Found {
    worn: WornCourse,
    data: Data,
    course: Course,
    measured: Measured,
    fit: Fit,
    against: Vec<Against>,
}

/// Runs the scene, fits the coefficient and writes what it found.
pub(super) fn calibrate(args: &CalibrateArgs) -> Result<Outcome, RunError> {
    let data = Data::read(args)?;
    let flags = &args.common.flags;
    let (scene, machine) = args.common.load()?;
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
    fn coefficient(&self) -> f64 {
        self.fit.ratio * self.worn.coefficient
    }

    /// Ends of the interval; the upper one may be open.
    fn interval(&self) -> [Option<f64>; 2] {
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

    fn json(&self, args: &CalibrateArgs) -> serde_json::Value {
        let against = self.against.iter().map(|of| {
            let second = of.second.as_ref().ok();
            let finite = |value: fn(&Second) -> f64| second.map(value).filter(|x| x.is_finite());
            json!({
                "key": of.key,
                "value": of.value,
                "told_apart": second.map(Second::told),
                "cosine_squared": finite(|s| s.alike),
                "coefficient_per_key": finite(|s| s.trade),
                "relative_deviation_alone": finite(|s| s.alone),
                "relative_deviation_both": finite(|s| s.both),
                "why": of.second.as_ref().err(),
            })
        });
        let [low, high] = self.interval();
        json!({
            "part": self.worn.part,
            "measured": self.data.kind.word(),
            "measurements": self.data.kind.len(),
            "key": self.worn.key,
            "coefficient_m2_n": self.coefficient(),
            "low_m2_n": low,
            "high_m2_n": high,
            "level": self.data.level,
            "deviation": self.fit.deviation,
            "deviation_given": self.data.deviation.is_some(),
            "scatter": self.fit.scatter,
            "freedom": self.fit.freedom,
            "density_kg_m3": self.data.density(args).0,
            "width_m": self.data.width(&self.worn, args).0,
            "against": against.collect::<Vec<_>>(),
        })
    }

    fn describe(&self, args: &CalibrateArgs) -> String {
        let (data, fit, kind) = (&self.data, &self.fit, &self.data.kind);
        let k = |value: f64| number(value, 4);
        let interval = match self.interval() {
            [Some(low), Some(high)] => format!("{} to {}", k(low), k(high)),
            [low, _] => format!("{} and more: the run ends before", k(low.unwrap_or(0.0))),
        };
        let mut out = format!(
            "{} = {} m2/N, {} m2/N with {} %\n{} of {}, {} measured after {} h\n",
            self.worn.key,
            k(self.coefficient()),
            interval,
            number(100.0 * data.level, 3),
            kind.word(),
            self.worn.part,
            match kind.len() {
                1 => "once".to_owned(),
                n => format!("{n} times"),
            },
            range(&data.hours)
        );
        let source = match data.deviation {
            Some(_) => "given".to_owned(),
            None => format!("from the scatter, {} degrees of freedom", fit.freedom),
        };
        out.push_str(&format!(
            "noise: independent normal errors of standard deviation {}, {source}; the interval has the error of \
             the measurements\nalone, not that of the run nor of its inputs\n",
            kind.show(fit.deviation)
        ));
        if let Kind::Mass(_) = kind {
            let (density, whence) = data.density(args);
            out.push_str(&format!("density {density} kg/m3, {whence}\n"));
            let (width, whence) = data.width(&self.worn, args);
            out.push_str(&format!("width {width} m, {whence}\n"));
        }
        if fit.low == 0.0 {
            out.push_str("the data do not tell K from 0: no wear at all lies in the interval\n");
        }
        out.push_str(&self.misfit());
        out.push_str(
            "K cannot be told from the hours, nor from a factor on all loads: wear tells their product alone, 1 % \
             more hours is\n1 % less K\n",
        );
        if !self.worn.with.is_empty() {
            out.push_str(&format!("{}\n", self.worn.with));
        }
        self.against
            .iter()
            .for_each(|of| out.push_str(&of.describe()));
        out.push_str(&format!(
            "to run with it: --set {}={:.5e}\n",
            self.worn.key,
            self.coefficient()
        ));
        out
    }

    /// Whether the residuals are larger than the uncertainty that was given.
    fn misfit(&self) -> String {
        let (fit, kind) = (&self.fit, &self.data.kind);
        let given = self.data.deviation.is_some() && fit.freedom > 0;
        let shape = match kind {
            Kind::Profile(..) => {
                ": the scene does not wear in this shape, or points share an error; the interval is too narrow"
            }
            _ => ": the uncertainty is too small, or the parts differ; the interval is too narrow",
        };
        // the deviation of n - 1 squares about 1
        let most = 1.0 + 3.0 * (0.5 / fit.freedom.max(1) as f64).sqrt();
        match given && fit.scatter > most * fit.deviation {
            true => format!(
                "note: residuals scatter by {}, more than the {} that were given{shape}\n",
                kind.show(fit.scatter),
                kind.show(fit.deviation)
            ),
            false => match kind {
                Kind::Profile(..) => format!(
                    "residuals of the points scatter by {}; points that share an error of the tracing make the \
                     interval too narrow\n",
                    kind.show(fit.scatter)
                ),
                _ => String::new(),
            },
        }
    }

    fn picture(&self, scene: &Scene) -> Chart {
        let subtitle = format!(
            "{}, {}: {} = {} m²/N",
            scene.name,
            self.worn.part,
            self.worn.key,
            number(self.coefficient(), 4)
        );
        let mut chart = match &self.data.kind {
            Kind::Profile(_, traced) => self.of_profile(traced),
            kind => self.of_numbers(kind),
        };
        chart.subtitle = subtitle;
        chart
    }

    /// The outline new and as fitted, with the traced points.
    fn of_profile(&self, traced: &[([f64; 2], u64)]) -> Chart {
        let mut chart = Chart::new(
            "A traced profile and the wear that fits it",
            Axis::linear("x in the frame of the part [mm]"),
            Axis::linear("y [mm]"),
        );
        let mm = |points: &[[f64; 2]]| points.iter().map(|p| (1e3 * p[0], 1e3 * p[1])).collect();
        let time = self.fit.ratio * self.data.hours[0];
        let points = &self.worn.points;
        let next = points
            .partition_point(|p| p.hours < time)
            .min(points.len() - 1);
        // the nearest of the run: outlines between have no nodes in common
        let near = |p: &usize| (points[*p].hours - time).abs();
        let shown = [next.saturating_sub(1), next].into_iter();
        let shown = shown
            .min_by(|a, b| near(a).total_cmp(&near(b)))
            .unwrap_or(next);
        let mut new = Series::new("new", Style::Line, mm(&points[0].outline));
        (new.dash, new.colour) = (Dash::Dashed, Colour::Palette(6));
        let name = format!(
            "run, {} h at the K found",
            number(points[shown].hours / self.fit.ratio, 4)
        );
        let mut worn = Series::new(name, Style::Line, mm(&points[shown].outline));
        worn.colour = Colour::Palette(0);
        let all: Vec<[f64; 2]> = traced.iter().map(|(p, _)| *p).collect();
        let name = format!("traced, after {} h", number(self.data.hours[0], 4));
        let mut points = Series::new(name, Style::Points, mm(&all));
        points.colour = Colour::Palette(1);
        chart.series = vec![new, worn, points];
        chart
    }

    /// The run with the coefficient found and with both ends of the interval, and the measurements.
    fn of_numbers(&self, kind: &Kind) -> Chart {
        let (label, scale) = match kind {
            Kind::Mass(_) => ("mass lost [g]", 1e3),
            _ => ("deepest wear [mm]", 1e3),
        };
        let mut chart = Chart::new(
            "Measured wear and the run that fits it",
            Axis::linear("hours of work [h]"),
            Axis::linear(label),
        );
        let longest = 1.25 * self.data.hours.iter().copied().fold(0.0, f64::max);
        let course = |ratio: f64| {
            let rows = self.course.hours.iter().zip(&self.course.found);
            let all = rows.map(|(hours, row)| (hours / ratio, scale * row[0]));
            all.take_while(|(hours, _)| *hours <= longest)
                .collect::<Vec<_>>()
        };
        let fit = &self.fit;
        let mut line = Series::new("run at the K found", Style::Line, course(fit.ratio));
        line.colour = Colour::Palette(0);
        chart.series.push(line);
        for (name, ratio) in [("least K", Some(fit.low)), ("largest K", fit.high)] {
            if let Some(ratio) = ratio.filter(|ratio| *ratio > 0.0) {
                let mut line = Series::new(name, Style::Line, course(ratio));
                (line.dash, line.colour) = (Dash::Dashed, Colour::Palette(0));
                chart.series.push(line);
            }
        }
        let data = self.measured.hours.iter().zip(&self.measured.values);
        let data = data.map(|(hours, value)| (*hours, scale * value)).collect();
        let mut points = Series::new("measured", Style::Points, data);
        points.colour = Colour::Palette(1);
        chart.series.push(points);
        chart
    }
}

impl Against {
    fn describe(&self) -> String {
        let key = &self.key;
        let second = match &self.second {
            Ok(second) => second,
            Err(why) => return format!("{key}: its effect could not be computed: {why}\n"),
        };
        if second.trade.abs() < 1e-6 {
            return format!("{key}: moves nothing that was measured\n");
        }
        let trade = format!(
            "1 % more of it asks for {} % {} K",
            number(second.trade.abs(), 2),
            if second.trade > 0.0 { "more" } else { "less" }
        );
        match second.told() {
            true => format!(
                "K and {key}, {}, can be told apart: with both unknown the standard deviation of K is {} %, with \
                 {key} known {} %; {trade}\n",
                self.value,
                number(100.0 * second.both, 2),
                number(100.0 * second.alone, 2)
            ),
            false => format!(
                "these data cannot tell K from {key}, {}: both move them alike (cosine squared {}); {trade}\n",
                self.value,
                number(second.alike, 4)
            ),
        }
    }
}

/// A list of hours in words.
fn range(hours: &[f64]) -> String {
    let low = hours.iter().copied().fold(f64::INFINITY, f64::min);
    let high = hours.iter().copied().fold(0.0, f64::max);
    match low == high {
        true => number(low, 4),
        false => format!("{} to {}", number(low, 4), number(high, 4)),
    }
}
