//! A run of a scene with wear, as measurements see it: depth, volume and outline over the hours.

use super::blocks::Study;
use super::life::run_threshing;
use super::machine::{Machine, Setup};
use super::rows::ProfileRow;
use super::study::run_study;
use super::wear_history::WearHistory;
use crate::experiment::{RunError, WearOutcome};
use crate::report::Progress;
use crate::scene::{Mass, Scene};

/// What a wearing part is after so much wear.
#[derive(Debug, Clone)]
pub struct WornPoint {
    pub hours: f64,
    /// Of the deepest cell \[m\].
    pub deepest: f64,
    /// Per metre of width \[m³/m\].
    pub volume: f64,
    /// Outline of the surface, in the frame of the part \[m\]; the first once more behind the last where it is
    /// closed.
    pub outline: Vec<[f64; 2]>,
}

/// A wearing part over the hours, from new on.
#[derive(Debug, Clone)]
pub struct WornCourse {
    pub part: String,
    /// Key of its wear coefficient, and its value [m²/N].
    pub key: String,
    pub coefficient: f64,
    /// Width of the machine \[m\], where the scene has one.
    pub width: Option<f64>,
    /// Density with which the scene loads the part \[kg/m³\], where it has one.
    pub density: Option<f64>,
    /// +1 where the solid is on the left of the outline, -1 where it is on the right.
    pub solid: f64,
    pub points: Vec<WornPoint>,
    /// What the coefficient counts with, in words; empty for nothing.
    pub with: String,
    /// A key that was fitted, and its value, which further runs must hold: fitted again it would take up what
    /// they change.
    pub fitted: Option<(String, f64)>,
}

/// The number of a wearing part among those of a scene; that of a machine is its tooth.
///
/// # Errors
/// [`RunError::Unfit`] for a scene in which nothing wears, a body that does not wear, and no body where
/// several wear.
pub fn worn_part(
    scene: &Scene,
    machine: Option<&Machine>,
    body: Option<&str>,
) -> Result<usize, RunError> {
    if machine.is_some() {
        let Some(body) = body else {
            return Ok(0);
        };
        let why = "is a machine, whose teeth wear alike";
        return Err(RunError::Unfit(format!(
            "body {body}: scene {} {why}",
            scene.name
        )));
    }
    let names: Vec<&str> = (scene.wear.iter())
        .map(|wear| scene.bodies[wear.body].name.as_str())
        .collect();
    match (body, &names[..]) {
        (_, []) => {
            let why = format!("scene {}: nothing wears in it", scene.name);
            Err(RunError::Unfit(why))
        }
        (None, [_]) => Ok(0),
        (None, _) => {
            let all = names.join(", ");
            let why = format!(
                "scene {}: {all} wear; say which was measured, --body",
                scene.name
            );
            Err(RunError::Unfit(why))
        }
        (Some(name), _) => names.iter().position(|n| *n == name).ok_or_else(|| {
            let all = names.join(", ");
            RunError::Unfit(format!("body {name}: does not wear; allowed is {all}"))
        }),
    }
}

/// Runs a scene and tells the wear of one of its parts.
///
/// # Arguments
/// - `body`: the part of a scene with several.
/// - `steps`: of a measured cycle of a scene with `[[wear]]`.
///
/// # Errors
/// [`RunError`]; [`RunError::Unfit`] for a scene in which nothing wears, and for a body that does not.
pub fn worn_course(
    scene: &Scene,
    machine: Option<&Machine>,
    body: Option<&str>,
    steps: usize,
    quiet: bool,
) -> Result<WornCourse, RunError> {
    let part = worn_part(scene, machine, body)?;
    match machine {
        Some(machine) => of_machine(scene, machine, quiet),
        None => of_bodies(scene, part, steps, quiet),
    }
}

fn of_machine(scene: &Scene, machine: &Machine, quiet: bool) -> Result<WornCourse, RunError> {
    let key = "wear.coefficient".to_owned();
    match machine {
        Machine::Study(setup) => {
            // its life alone
            let mut parameters: Study = setup.parameters.clone();
            parameters.torques.truncate(1);
            parameters.speeds.truncate(1);
            parameters.frictions.clear();
            let alone = Setup {
                parameters,
                ..setup.clone()
            };
            let progress = Progress::new(&scene.name, 1, quiet);
            let found = run_study(scene, &alone, &progress)?;
            let (Some(history), Some(time)) = (found.history, found.life_contact_time) else {
                return Err(RunError::Unfit(format!(
                    "scene {}: the reading \"literal\" has no life to compare with",
                    scene.name
                )));
            };
            Ok(WornCourse {
                part: "tooth".to_owned(),
                key,
                coefficient: setup.wear.coefficient,
                width: None,
                density: None,
                solid: -1.0,
                points: points(&history),
                with: format!(
                    "K counts with the contact time of a cycle, {time:e} s: only their product acts; hold it by \
                     study.contact_time"
                ),
                fitted: Some(("study.contact_time".to_owned(), time)),
            })
        }
        Machine::Thresher(setup) => {
            machine.needs_strip("calibrate")?;
            let progress = |label: &str, total| Progress::new(label, total, quiet);
            let found = run_threshing(scene, setup, progress, &mut |_, _| Ok(()), &|_| None)?;
            Ok(WornCourse {
                part: "tooth".to_owned(),
                key,
                coefficient: setup.wear.coefficient,
                width: Some(setup.parameters.machine_width),
                density: None,
                solid: -1.0,
                points: points(&found.history),
                with: format!(
                    "K counts with the load, here that of thresher.hold = \"{}\" at {} N m with new teeth",
                    setup.parameters.hold.word(),
                    setup.parameters.operating_torque
                ),
                fitted: None,
            })
        }
    }
}

/// The points of a machine's history.
fn points(history: &WearHistory) -> Vec<WornPoint> {
    let outlines = history.profile.chunk_by(|a, b| a.cycles == b.cycles);
    let of = |rows: &[ProfileRow]| {
        let (cycles, hours) = (rows[0].cycles, rows[0].hours);
        let depths = history.wear.iter().filter(|row| row.cycles == cycles);
        let volumes = history.volume.iter().filter(|row| row.cycles == cycles);
        WornPoint {
            hours,
            deepest: depths.map(|row| row.depth_m).fold(0.0, f64::max),
            volume: volumes.map(|row| row.volume_m3_per_m).sum(),
            outline: rows.iter().map(|row| [row.x_m, row.y_m]).collect(),
        }
    };
    outlines.map(of).collect()
}

fn of_bodies(
    scene: &Scene,
    part: usize,
    steps: usize,
    quiet: bool,
) -> Result<WornCourse, RunError> {
    let mut built = scene.build()?;
    let progress = Progress::new(&scene.name, 1000, quiet);
    let outcome = WearOutcome::start(scene, &mut built)?;
    let found = outcome.go_on(scene, &mut built, steps, &progress, |_, _, _| Ok(()))?;
    let (name, state) = (&found.names[part], found.state(part));
    let nodes: Vec<_> = found.nodes.iter().filter(|row| row.body == *name).collect();
    let closed = state.profile().is_ring();
    let outlines = nodes.chunk_by(|a, b| a.seconds == b.seconds);
    // a point of the life and an outline for each jump, the new body first
    let pairs = state.life().points().iter().zip(outlines);
    let points = pairs.map(|(point, rows)| WornPoint {
        hours: point.hours,
        deepest: point.depth.iter().copied().fold(0.0, f64::max),
        volume: point.volume.iter().sum(),
        outline: (rows.iter().chain(rows.first().filter(|_| closed)))
            .map(|row| [row.x_m, row.y_m])
            .collect(),
    });
    let density = match scene.bodies[scene.wear[part].body].mass {
        Some(Mass::Density(density)) => Some(density),
        _ => None,
    };
    Ok(WornCourse {
        part: name.clone(),
        key: format!("wear.{name}.coefficient"),
        coefficient: scene.wear[part].coefficient,
        width: None,
        density,
        solid: 1.0,
        points: points.collect(),
        with: match scene.wear.len() {
            1 => String::new(),
            _ => "the coefficients of the other bodies are those of the scene".to_owned(),
        },
        fitted: None,
    })
}

/// Distance of a point from an outline \[m\], positive outside the solid, and how far it lies beyond the ends
/// of an open one.
pub fn distance(outline: &[[f64; 2]], solid: f64, [x, y]: [f64; 2]) -> (f64, f64) {
    let mut best = (f64::INFINITY, 0.0, 0.0);
    let last = outline.len().saturating_sub(2);
    let closed = outline.first() == outline.last();
    for (k, pair) in outline.windows(2).enumerate() {
        let ([ax, ay], [bx, by]) = (pair[0], pair[1]);
        let (dx, dy) = (bx - ax, by - ay);
        let length = dx.hypot(dy);
        if length == 0.0 {
            continue;
        }
        let along = ((x - ax) * dx + (y - ay) * dy) / length;
        let inside = along.clamp(0.0, length);
        let (px, py) = (ax + inside * dx / length, ay + inside * dy / length);
        let away = (x - px).hypot(y - py);
        // left of the outline is positive
        let left = (dx * (y - ay) - dy * (x - ax)) / length;
        let beyond = match k {
            0 if along < 0.0 && !closed => -along,
            k if k == last && along > length && !closed => along - length,
            _ => 0.0,
        };
        // at a corner two edges are as near: the one that sees the point more from the front decides
        let nearer = away < best.0 * (1.0 - 1e-12);
        if nearer || (away <= best.0 * (1.0 + 1e-12) && left.abs() > f64::abs(best.1)) {
            best = (away, left, beyond);
        }
    }
    let (away, left, beyond) = best;
    // beyond an end the distance from the line of the edge counts
    let size = if beyond > 0.0 { left.abs() } else { away };
    (-solid * left.signum() * size, beyond)
}

#[cfg(test)]
mod tests {
    use super::distance;

    #[test]
    fn distances_are_positive_outside_the_solid() {
        // from left to right, the solid below it, on its right
        let roof = [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]];
        let d = |p| distance(&roof, -1.0, p);
        let half = 0.5f64.sqrt();
        assert!((d([0.0, 1.0]).0 - half).abs() < 1e-15);
        assert!((d([1.0, 0.0]).0 + half).abs() < 1e-15);
        // above the ridge
        assert!((d([1.0, 1.5]).0 - 0.5).abs() < 1e-15, "{:?}", d([1.0, 1.5]));
        // beyond the end, on the line of the last edge
        let (away, beyond) = d([3.0, -1.0]);
        assert!(away.abs() < 1e-15 && (beyond - 2f64.sqrt()).abs() < 1e-15);
        // the same outline from right to left
        let back: Vec<[f64; 2]> = roof.iter().rev().copied().collect();
        // an edge from its other end rounds otherwise
        let other = distance(&back, 1.0, [0.0, 1.0]).0;
        assert!((other - d([0.0, 1.0]).0).abs() < 1e-15);
        // a closed square, counter-clockwise
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        assert_eq!(distance(&square, 1.0, [-0.5, 0.5]), (0.5, 0.0));
        assert_eq!(distance(&square, 1.0, [0.25, 0.5]), (-0.25, 0.0));
    }
}
