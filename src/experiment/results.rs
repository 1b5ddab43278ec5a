use super::joint_gap::Pins;
use super::reference::{Measure, Samples, measures};
use super::self_reference::SelfReference;
use super::setting::{Setting, step_count};
use super::simulate::{Engine, RunError, Totals, advance};
use crate::report::{Progress, ResultRow, step_length};
use crate::scene::BodyKind;
use crate::scene::{Built, Scene};

/// Relative round-off of the energy of a scene, summed over its bodies and the steps of a run.
const ROUND_OFF: f64 = 1e-12;

/// Results of an experiment.
#[derive(Debug, Clone, Default)]
pub struct Results {
    /// One row for each point and measure, in the order of the points.
    pub rows: Vec<ResultRow>,
    /// One note for each engine with points that failed or were skipped, with the first reason.
    pub notes: Vec<String>,
}

/// Result of a point.
enum Point {
    /// Totals and errors of the last repeat; wall time per simulated second of each repeat.
    Measured(Box<Totals>, Vec<Measure>, Vec<f64>),
    /// Mode of the failure, and its reason as a sentence.
    Failed(&'static str, String),
    /// The engine cannot step the scene; the reason.
    Unavailable(String),
}

/// Runs every setting on `scene` and measures it; every comparison uses this function.
///
/// Repeats are interleaved: every point runs once before any runs again, so that a slowdown of the
/// computer affects all points. Only the steps are timed. All but the times is deterministic.
///
/// # Arguments
/// - `settings`: the points; `scene.step` is not used.
/// - `repeats`: runs of each point, 1 at least.
/// - `reference`: the self-converged reference of a scene without a closed form, if there is one.
/// - `progress`: advanced once a step.
///
/// # Returns
/// Rows for each point:
/// - the errors against the scene's closed form, or `trajectory` \[m\], the largest distance of a
///   body from its position in `reference`;
/// - `penetration` \[m\], and for our engine `penetration-impact` \[m\], the depth at which impacts
///   were detected;
/// - `joint-gap` \[m\] of joints that hold two points together;
/// - `energy-rise` \[J\] if nothing drives the scene: the largest excess of the energy over its start
///   (0 below 1e-12 of it). For our engine also `energy-recovery`, the part of it from separating
///   bodies that overlap at the start and from closing gaps of joints by position;
/// - for our engine `residual` and `unsolved-islands`.
///
/// `seconds_per_simulated_second` is the median of the repeats, `spread` half their range over it,
/// empty for a single run. A point that fails in a step, or whose energy is no longer finite, has
/// NaN in every measure and the verdict `fail`; one with islands that no solve certified has
/// `unsolved`. A measure that other points have and this one does not, such as the time of an event
/// that never happens, is NaN, `fail` and `never`.
///
/// # Errors
/// [`RunError::Step`] if the scene cannot be built. A point that fails is a row, not an error; a
/// point with [`RunError::Unfit`] is left out. The notes list both.
pub fn run_settings(
    scene: &Scene,
    settings: &[Setting],
    repeats: usize,
    reference: Option<&SelfReference>,
    progress: &Progress,
) -> Result<Results, RunError> {
    let mut points: Vec<Option<Point>> = settings.iter().map(|_| None).collect();
    interleave(&mut points, repeats, |k, point| {
        if matches!(point, None | Some(Point::Measured(..))) {
            let ended = run(scene, &settings[k], reference, progress)?;
            *point = Some(match (point.take(), ended) {
                (Some(Point::Measured(_, _, mut times)), Point::Measured(totals, found, now)) => {
                    times.extend(now);
                    Point::Measured(totals, found, times)
                }
                (_, ended) => ended,
            });
        }
        Ok::<_, RunError>(())
    })?;
    let against = reference.map_or("closed form".to_owned(), SelfReference::describe);
    Ok(gather(scene, settings, points, &against))
}

/// Visits all `points` once for each repeat.
pub(crate) fn interleave<P, E>(
    points: &mut [P],
    repeats: usize,
    mut visit: impl FnMut(usize, &mut P) -> Result<(), E>,
) -> Result<(), E> {
    for _ in 0..repeats.max(1) {
        for (k, point) in points.iter_mut().enumerate() {
            visit(k, point)?;
        }
    }
    Ok(())
}

fn run(
    scene: &Scene,
    setting: &Setting,
    reference: Option<&SelfReference>,
    progress: &Progress,
) -> Result<Point, RunError> {
    let scene = Scene {
        step: setting.step.clone(),
        ..scene.clone()
    };
    let engine = setting.engine;
    let prepared = || -> Result<Built, RunError> {
        engine.has_model(&scene)?;
        let mut built = scene.build()?;
        if let Some(settings) = &setting.baseline {
            engine.prepare_with(settings, &mut built)?;
        }
        Ok(built)
    };
    let mut built = match prepared() {
        Err(RunError::Unfit(reason)) => return Ok(Point::Unavailable(reason)),
        built => built?,
    };
    let mut samples = Samples::start(&built, engine);
    let mut places = reference.map(|r| (r, r.sampler(&built, engine)));
    let pins = Pins::of(&scene);
    let mut joint_gap: f64 = 0.0;
    let steps = step_count(&scene.step);
    let outcome = advance(&mut built, engine, steps, |record, built| {
        if scene.reference.is_some() {
            samples.add(record, built, engine);
        }
        if let Some((_, places)) = &mut places {
            places.add(record.time, built, engine);
        }
        if let Some(pins) = &pins {
            joint_gap = joint_gap.max(pins.gap(built, engine));
        }
        progress.advance();
        Ok(())
    });
    match outcome {
        // comparisons with NaN are false, so that maxima over the run would not show it
        Ok(totals) if !totals.energy_end.is_finite() => Ok(Point::Failed(
            "explodes",
            "the energy is not finite".to_owned(),
        )),
        Ok(mut totals) => {
            // measured from the poses, as for every engine, in place of our own record
            totals.joint_gap = joint_gap;
            let mut found = measures(&scene, &samples);
            if let Some((reference, places)) = &places {
                let distance = reference.distance(places);
                found.push(Measure::absolute("trajectory", "m", distance, 0.0));
            }
            let time = totals.wall / totals.time;
            Ok(Point::Measured(Box::new(totals), found, vec![time]))
        }
        Err(RunError::Step(error)) => Ok(Point::Failed("stops", error.to_string())),
        Err(RunError::Unfit(reason)) => Ok(Point::Unavailable(reason)),
        Err(error) => Err(error),
    }
}

fn gather(
    scene: &Scene,
    settings: &[Setting],
    mut points: Vec<Option<Point>>,
    against: &str,
) -> Results {
    let shown = Shown::of(scene, against);
    let mut known: Vec<Measure> = Vec::new();
    for point in points.iter().flatten() {
        if let Point::Measured(_, found, _) = point {
            for m in found {
                if !known.iter().any(|k| k.name == m.name) {
                    known.push(m.clone());
                }
            }
        }
    }
    for m in &mut known {
        m.error = f64::NAN;
    }
    let mut results = Results {
        rows: Vec::new(),
        notes: notes(settings, &points),
    };
    for (setting, point) in settings.iter().zip(&mut points) {
        let blank = row(scene, setting);
        match point {
            None | Some(Point::Unavailable(_)) => {}
            Some(Point::Failed(mode, _)) => {
                for figure in shown.figures(setting.engine, None, &known) {
                    results.rows.push(ResultRow {
                        verdict: "fail".to_owned(),
                        mode: (*mode).to_owned(),
                        ..figure.filled(&blank)
                    });
                }
            }
            Some(Point::Measured(totals, found, times)) => {
                let (time, spread) = median_and_spread(times);
                let unsolved = totals.unsolved_islands > 0;
                let blank = ResultRow {
                    seconds_per_simulated_second: time,
                    spread,
                    verdict: if unsolved { "unsolved" } else { "" }.to_owned(),
                    ..blank
                };
                let all: Vec<Measure> = known
                    .iter()
                    .map(|k| found.iter().find(|m| m.name == k.name).unwrap_or(k).clone())
                    .collect();
                for figure in shown.figures(setting.engine, Some(totals), &all) {
                    let mut row = figure.filled(&blank);
                    if row.value.is_nan() {
                        row.verdict = "fail".to_owned();
                        row.mode = "never".to_owned();
                    }
                    results.rows.push(row);
                }
            }
        }
    }
    results
}

/// One sentence for each engine and scheme with points that failed or were skipped.
fn notes(settings: &[Setting], points: &[Option<Point>]) -> Vec<String> {
    let mut notes: Vec<(String, &str, usize, String)> = Vec::new();
    for (setting, point) in settings.iter().zip(points) {
        let (what, reason) = match point {
            Some(Point::Failed(_, reason)) => ("failed", reason),
            Some(Point::Unavailable(reason)) => ("skipped", reason),
            _ => continue,
        };
        match notes
            .iter_mut()
            .find(|n| n.0 == setting.name() && n.1 == what)
        {
            Some((_, _, count, _)) => *count += 1,
            None => {
                let dt = step_length(setting.step.dt);
                let first = format!("{}, dt {dt}: {reason}", setting.label());
                notes.push((setting.name(), what, 1, first));
            }
        }
    }
    let sentence = |(name, what, count, first)| match count {
        1 => format!("{name} {what}, {first}"),
        _ => format!("{name} {what} at {count} points, first at {first}"),
    };
    notes.into_iter().map(sentence).collect()
}

/// Name, value, unit and reference of a measure.
struct Figure<'a>(&'static str, f64, &'static str, &'a str);

impl Figure<'_> {
    fn filled(&self, blank: &ResultRow) -> ResultRow {
        ResultRow {
            measure: self.0.to_owned(),
            value: self.1,
            unit: self.2.to_owned(),
            reference: self.3.to_owned(),
            ..blank.clone()
        }
    }
}

/// The measures of a scene.
struct Shown<'a> {
    /// Reference of the errors.
    against: &'a str,
    pins: bool,
    driven: bool,
}

impl<'a> Shown<'a> {
    fn of(scene: &Scene, against: &'a str) -> Shown<'a> {
        Shown {
            against,
            pins: Pins::of(scene).is_some(),
            driven: driven(scene),
        }
    }

    /// All figures of a point; NaN for a failed point, which has no totals.
    fn figures(
        &self,
        engine: Engine,
        totals: Option<&Totals>,
        errors: &[Measure],
    ) -> Vec<Figure<'a>> {
        let of = |value: fn(&Totals) -> f64| totals.map_or(f64::NAN, value);
        let mut figures: Vec<Figure> = errors
            .iter()
            .map(|m| Figure(m.name, m.error, m.unit, self.against))
            .collect();
        figures.push(Figure("penetration", of(|t| t.penetration), "m", "0"));
        // a peer's penetration includes contacts in an impact
        if engine == Engine::Moreau {
            let depth = of(|t| t.penetration_impact);
            figures.push(Figure("penetration-impact", depth, "m", "0"));
        }
        if self.pins {
            figures.push(Figure("joint-gap", of(|t| t.joint_gap), "m", "0"));
        }
        if !self.driven {
            figures.push(Figure("energy-rise", of(energy_rise), "J", "0"));
            // peers separate overlapping bodies too, but do not report the energy
            if engine == Engine::Moreau {
                let lifted = of(|t| t.work_recovery);
                figures.push(Figure("energy-recovery", lifted, "J", "0"));
            }
        }
        // peers certify nothing
        if engine == Engine::Moreau {
            figures.push(Figure("residual", of(|t| t.residual), "1", "0"));
            let unsolved = of(|t| t.unsolved_islands as f64);
            figures.push(Figure("unsolved-islands", unsolved, "1", "0"));
        }
        figures
    }
}

/// Rise of the energy \[J\]; 0 if it is round-off of the energies of which it is the difference.
pub(super) fn energy_rise(totals: &Totals) -> f64 {
    let size = totals.energy_start.abs().max(totals.energy_end.abs());
    match totals.energy_rise <= ROUND_OFF * size.max(totals.kinetic_most) {
        true => 0.0,
        false => totals.energy_rise,
    }
}

/// Whether something supplies energy, so that a rise is no error: a motor, a belt, or a body of
/// prescribed motion.
pub(super) fn driven(scene: &Scene) -> bool {
    let moves = |b: &crate::scene::Body| {
        let prescribed = b.kind == BodyKind::Kinematic
            && (b.oscillation.is_some() || b.velocity != [0.0; 2] || b.spin != 0.0);
        prescribed || b.surface_velocity != 0.0
    };
    scene.bodies.iter().any(moves) || scene.joints.iter().any(|j| j.motor.is_some())
}

/// A row of `setting` without a measure.
pub(crate) fn row(scene: &Scene, setting: &Setting) -> ResultRow {
    ResultRow {
        scene: scene.name.clone(),
        rung: String::new(),
        engine: setting.engine.name().to_owned(),
        scheme: setting.scheme().to_owned(),
        solver: setting.solver().to_owned(),
        setting: setting.label(),
        dt_s: setting.step.dt,
        threads: setting.threads(),
        precision: setting.precision().to_owned(),
        measure: String::new(),
        value: f64::NAN,
        unit: String::new(),
        reference: String::new(),
        seconds_per_simulated_second: None,
        spread: None,
        verdict: String::new(),
        mode: String::new(),
    }
}

/// Median, and half the range over the median if there are several values.
pub(crate) fn median_and_spread(times: &mut [f64]) -> (Option<f64>, Option<f64>) {
    times.sort_by(f64::total_cmp);
    let (Some(least), Some(most)) = (times.first(), times.last()) else {
        return (None, None);
    };
    let median = 0.5 * (times[(times.len() - 1) / 2] + times[times.len() / 2]);
    let spread = (times.len() > 1).then(|| 0.5 * (most - least) / median);
    (Some(median), spread)
}

#[cfg(test)]
mod tests {
    use super::super::reference::Size;
    use super::*;

    #[test]
    fn repeats_are_interleaved() {
        let mut order = Vec::new();
        let mut points = ["a", "b", "c"];
        let ended: Result<(), ()> = interleave(&mut points, 2, |_, p| {
            order.push(*p);
            Ok(())
        });
        assert_eq!(ended, Ok(()));
        assert_eq!(order, ["a", "b", "c", "a", "b", "c"]);
    }

    fn measured(errors: &[(&'static str, f64)], unsolved_islands: usize) -> Option<Point> {
        let totals = Totals {
            unsolved_islands,
            ..Totals::default()
        };
        let found = errors.iter().map(|&(name, error)| Measure {
            name,
            unit: "1",
            computed: 0.0,
            exact: 0.0,
            error,
            size: Size::Value,
        });
        Some(Point::Measured(
            Box::new(totals),
            found.collect(),
            vec![1.0, 3.0],
        ))
    }

    /// Failed points have a row for every measure, skipped ones have none; the notes list both.
    #[test]
    fn failures_are_rows_and_skipped_points_are_notes() {
        let text = "[scene]\nname = \"s\"\ntitle = \"t\"\n[[body]]\nname = \"b\"\ndisc = 1\n";
        let scene = Scene::parse("s.toml", text, &[]).unwrap();
        let settings = [
            Engine::Moreau,
            Engine::Rapier,
            Engine::Moreau,
            Engine::RapierStiff,
        ]
        .map(|engine| Setting::new(engine, &scene.step));
        let points = vec![
            measured(&[("time", 0.1), ("place", 0.2)], 1),
            measured(&[("place", 0.3)], 0),
            Some(Point::Failed("stops", "why".to_owned())),
            Some(Point::Unavailable("no such world".to_owned())),
        ];
        let results = gather(&scene, &settings, points, "closed form");
        let rows = |engine: &str, verdict: &str| -> Vec<(String, bool, String)> {
            let of = results
                .rows
                .iter()
                .filter(|r| r.engine == engine && r.verdict == verdict);
            of.map(|r| (r.measure.clone(), r.value.is_nan(), r.mode.clone()))
                .collect()
        };
        let expect = |names: &[&str], nan: bool, mode: &str| -> Vec<(String, bool, String)> {
            names
                .iter()
                .map(|&n| (n.to_owned(), nan, mode.to_owned()))
                .collect()
        };
        let ours = [
            "time",
            "place",
            "penetration",
            "penetration-impact",
            "energy-rise",
            "energy-recovery",
            "residual",
            "unsolved-islands",
        ];
        assert_eq!(rows("moreau", "unsolved"), expect(&ours, false, ""));
        assert_eq!(rows("moreau", "fail"), expect(&ours, true, "stops"));
        assert_eq!(rows("rapier", "fail"), expect(&["time"], true, "never"));
        assert_eq!(
            rows("rapier", ""),
            expect(&["place", "penetration", "energy-rise"], false, "")
        );
        assert!(results.rows.iter().all(|r| r.engine != "rapier-stiff"));
        assert_eq!(results.notes.len(), 2, "{:?}", results.notes);
        assert!(
            results.notes[0].starts_with("moreau staggered failed, tolerance 1e-8, dt 1/60 s: why")
        );
        assert!(
            results.notes[1].contains("skipped") && results.notes[1].ends_with("no such world")
        );
        // two repeats: median and half the range over it, but no time for what failed
        assert_eq!(results.rows[0].seconds_per_simulated_second, Some(2.0));
        assert_eq!(results.rows[0].spread, Some(0.5));
        let failed = results.rows.iter().find(|r| r.mode == "stops");
        assert_eq!(failed.and_then(|r| r.seconds_per_simulated_second), None);
    }

    #[test]
    fn round_off_of_the_energy_is_no_rise() {
        let totals = |energy_rise| Totals {
            energy_start: -1e8,
            energy_rise,
            ..Totals::default()
        };
        assert_eq!(energy_rise(&totals(0.9e-4)), 0.0);
        assert_eq!(energy_rise(&totals(1.1e-4)), 1.1e-4);
        assert!(energy_rise(&totals(f64::NAN)).is_nan());
        // without any energy every rise counts
        let from_nothing = Totals {
            energy_rise: 1e-30,
            ..Totals::default()
        };
        assert_eq!(energy_rise(&from_nothing), 1e-30);
    }

    #[test]
    fn spread_needs_a_second_run() {
        assert_eq!(median_and_spread(&mut [2.0]), (Some(2.0), None));
        let (median, spread) = median_and_spread(&mut [5.0, 1.0, 3.0, 2.0]);
        assert_eq!((median, spread), (Some(2.5), Some(0.8)));
        assert_eq!(median_and_spread(&mut []), (None, None));
    }
}
