//! What was measured of a worn part: numbers as typed, or a traced profile.

use super::calibrate::CalibrateArgs;
use crate::experiment::{Course, Measured, RunError};
use crate::report::{number, quantity};
use crate::thresher::{WornCourse, WornPoint, distance};
use std::path::{Path, PathBuf};

/// Density of steel [kg/m³] and a slice of a scene \[m\], where nothing else is said.
const STEEL: f64 = 7850.0;
const SLICE: f64 = 1.0;
/// A traced point may lie this far outside the new surface, or beyond its ends, over the size of the surface.
const OUTSIDE: f64 = 0.02;

/// Which measurement.
pub(super) enum Kind {
    /// \[kg\] of a part.
    Mass(Vec<f64>),
    /// \[m\] of the deepest place.
    Depth(Vec<f64>),
    /// Points of the worn surface in the frame of the part \[m\], with their lines in the file.
    Profile(PathBuf, Vec<([f64; 2], u64)>),
}

/// Measurements, in SI units.
pub(super) struct Data {
    pub kind: Kind,
    pub hours: Vec<f64>,
    /// Standard deviation.
    pub deviation: Option<f64>,
    pub level: f64,
}

fn unfit<T>(text: String) -> Result<T, RunError> {
    Err(RunError::Unfit(text))
}

/// A list of numbers above 0.
fn positive(flag: &str, values: &[f64]) -> Result<(), RunError> {
    match values.iter().find(|v| !(v.is_finite() && **v > 0.0)) {
        Some(value) => unfit(format!("{flag} {value}: allowed is a number above 0")),
        None => Ok(()),
    }
}

impl Data {
    /// Reads what was typed.
    ///
    /// # Errors
    /// [`RunError::Unfit`], which names the flag, or file and line, the value and what is allowed.
    pub fn read(args: &CalibrateArgs) -> Result<Data, RunError> {
        positive("--hours", &args.hours)?;
        positive("--mass-loss", &args.mass_loss)?;
        positive("--depth", &args.depth)?;
        for (flag, value) in [
            ("--uncertainty", args.uncertainty),
            ("--density", args.density),
            ("--width", args.width),
        ] {
            positive(flag, value.as_slice())?;
        }
        if !(args.level > 0.0 && args.level < 1.0) {
            return unfit(format!(
                "--level {}: allowed is above 0, below 1",
                args.level
            ));
        }
        // grams
        let grams = args.profile.is_none() && args.depth.is_empty();
        let unit = if grams { 1e-3 } else { 1.0 };
        let kind = match &args.profile {
            Some(path) => Kind::Profile(path.clone(), points(path)?),
            None if grams => Kind::Mass(args.mass_loss.iter().map(|g| unit * g).collect()),
            None => Kind::Depth(args.depth.clone()),
        };
        for (flag, value) in [("--density", args.density), ("--width", args.width)] {
            if let Some(value) = value.filter(|_| !grams) {
                let why = "has no effect without --mass-loss";
                return unfit(format!("{flag} {value}: {why}"));
            }
        }
        let count = kind.len();
        let hours = match (args.hours.len(), &kind) {
            (1, _) => vec![args.hours[0]; count],
            (n, Kind::Mass(_) | Kind::Depth(_)) if n == count => args.hours.clone(),
            (n, Kind::Profile(..)) => {
                return unfit(format!("--hours: {n} values; a traced profile has one"));
            }
            (n, _) => {
                return unfit(format!(
                    "--hours: {n} values for {count} measurements; allowed is one, or one for each"
                ));
            }
        };
        let deviation = args.uncertainty.map(|u| unit * u);
        if count == 1 && deviation.is_none() {
            return unfit(
                "one measurement alone has no scatter to tell its error: give --uncertainty, its standard \
                 deviation, or several measurements"
                    .to_owned(),
            );
        }
        Ok(Data {
            kind,
            hours,
            deviation,
            level: args.level,
        })
    }

    /// What a run gives for each datum: the course of [`Measured`].
    pub fn course(&self, worn: &WornCourse, args: &CalibrateArgs) -> Course {
        let mass = self.density(worn, args).0 * self.width(worn, args).0;
        let n = self.hours.len();
        let row = |point: &WornPoint| match &self.kind {
            Kind::Mass(_) => vec![mass * point.volume; n],
            Kind::Depth(_) => vec![point.deepest; n],
            Kind::Profile(_, traced) => {
                let of = |(p, _): &([f64; 2], u64)| distance(&point.outline, worn.solid, *p).0;
                traced.iter().map(of).collect()
            }
        };
        Course {
            hours: worn.points.iter().map(|point| point.hours).collect(),
            found: worn.points.iter().map(row).collect(),
        }
    }

    pub fn measured(&self) -> Measured {
        Measured {
            values: match &self.kind {
                Kind::Mass(values) | Kind::Depth(values) => values.clone(),
                // on the worn surface
                Kind::Profile(_, points) => vec![0.0; points.len()],
            },
            hours: self.hours.clone(),
            deviation: self.deviation,
            level: self.level,
        }
    }

    /// Density [kg/m³] and where it is from.
    pub fn density(&self, worn: &WornCourse, args: &CalibrateArgs) -> (f64, &'static str) {
        match (args.density, worn.density) {
            (Some(given), _) => (given, "given"),
            // a part that presses by its weight and is weighed has one density
            (None, Some(of_scene)) => (of_scene, "the scene's, that of the body that wears"),
            (None, None) => (STEEL, "assumed: steel; --density gives another"),
        }
    }

    /// Width of the part \[m\] and where it is from.
    pub fn width(&self, worn: &WornCourse, args: &CalibrateArgs) -> (f64, &'static str) {
        match (args.width, worn.width) {
            (Some(given), _) => (given, "given"),
            (None, Some(of_scene)) => (of_scene, "the machine's, thresher.machine_width"),
            (None, None) => (SLICE, "assumed: a slice; --width gives that of the part"),
        }
    }

    /// Refuses a traced profile that is none of this surface.
    ///
    /// # Errors
    /// [`RunError::Unfit`] with file and line of the point that lies furthest off.
    pub fn check_on(&self, worn: &WornCourse) -> Result<(), RunError> {
        let Kind::Profile(path, traced) = &self.kind else {
            return Ok(());
        };
        let new = &worn.points[0].outline;
        let of = |side: usize| {
            let all = new.iter().map(|p| p[side]);
            let low = all.clone().fold(f64::INFINITY, f64::min);
            (low, all.fold(f64::NEG_INFINITY, f64::max))
        };
        let (x, y) = (of(0), of(1));
        let size = (x.1 - x.0).hypot(y.1 - y.0);
        let slack = (OUTSIDE * size).max(4.0 * self.deviation.unwrap_or(0.0));
        let deepest = worn.points.iter().map(|p| p.deepest).fold(0.0, f64::max);
        let mut worst: Option<(f64, [f64; 2], u64)> = None;
        for (point, line) in traced {
            let (away, beyond) = distance(new, worn.solid, *point);
            // nothing grows, and nothing wears deeper than the run
            let off = (away - slack)
                .max(-away - deepest - slack)
                .max(beyond - slack);
            if off > 0.0 && worst.is_none_or(|(most, ..)| off > most) {
                worst = Some((off + slack, *point, *line));
            }
        }
        match worst {
            None => Ok(()),
            Some((off, [px, py], line)) => unfit(format!(
                "{}:{line}: the point ({px}, {py}) m lies {} off the surface of {}, which is at x of {} to {} and y of \
                 {} to {} m when new and wears by {} at most in this run; allowed is {} off it: \
                 coordinates are those of the part, in metres",
                path.display(),
                quantity(off, "m", 3),
                worn.part,
                number(x.0, 4),
                number(x.1, 4),
                number(y.0, 4),
                number(y.1, 4),
                quantity(deepest, "m", 3),
                quantity(slack, "m", 2)
            )),
        }
    }
}

impl Kind {
    pub fn len(&self) -> usize {
        match self {
            Kind::Mass(values) | Kind::Depth(values) => values.len(),
            Kind::Profile(_, points) => points.len(),
        }
    }

    /// A number of it, with its unit.
    pub fn show(&self, value: f64) -> String {
        match self {
            Kind::Mass(_) => quantity(1e3 * value, "g", 4),
            Kind::Depth(_) | Kind::Profile(..) => quantity(value, "m", 4),
        }
    }

    /// What is compared.
    pub fn word(&self) -> &'static str {
        match self {
            Kind::Mass(_) => "mass loss",
            Kind::Depth(_) => "deepest wear",
            Kind::Profile(..) => "distance of the traced points from the surface",
        }
    }
}

/// The points of a traced profile: a CSV file with columns `x_m` and `y_m`; others are left aside.
fn points(path: &Path) -> Result<Vec<([f64; 2], u64)>, RunError> {
    let place = path.display();
    let wrong = |error: csv::Error| RunError::Unfit(format!("{place}: {error}"));
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_path(path)
        .map_err(wrong)?;
    let header = reader.headers().map_err(wrong)?.clone();
    let column = |name: &str| {
        let found: Vec<usize> = (0..header.len()).filter(|&k| header[k] == *name).collect();
        match found[..] {
            [one] => Ok(one),
            [] => {
                let all = header.iter().collect::<Vec<_>>().join(", ");
                let all = if all.is_empty() { "none" } else { &all };
                unfit(format!(
                    "{place}:1: column {name} is missing; there are {all}"
                ))
            }
            _ => unfit(format!("{place}:1: column {name} is there twice")),
        }
    };
    let columns = [("x_m", column("x_m")?), ("y_m", column("y_m")?)];
    // as `run` writes it, with the profiles of all hours
    let hours = header.iter().position(|name| name == "hours");
    let mut first: Option<String> = None;
    let mut points = Vec::new();
    for record in reader.records() {
        let record = record.map_err(wrong)?;
        let line = record.position().map_or(0, csv::Position::line);
        if let Some(own) = hours.and_then(|k| record.get(k)) {
            let first = first.get_or_insert_with(|| own.to_owned());
            if first != own {
                return unfit(format!(
                    "{place}:{line}: hours = {own}, but {first} above: keep the profile of one time"
                ));
            }
        }
        let mut point = [0.0; 2];
        for (value, (name, column)) in point.iter_mut().zip(columns) {
            let text = record.get(column).unwrap_or_default();
            let number = text.parse().ok().filter(|x: &f64| x.is_finite());
            *value = match number {
                Some(number) => number,
                None => {
                    return unfit(format!(
                        "{place}:{line}: {name} = {text:?}: allowed is a finite number in metres"
                    ));
                }
            };
        }
        points.push((point, line));
    }
    match points.len() {
        0 | 1 => unfit(format!(
            "{place}: {} points; a traced profile has two at least",
            points.len()
        )),
        _ => Ok(points),
    }
}
