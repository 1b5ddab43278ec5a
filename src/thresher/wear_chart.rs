//! The chart of a machine: error of the wear depth per cell against computing time.
//!
//! One load cycle wears a new tooth. Its depth per cell is compared with the algebra of the study,
//! or for other scenes with the machine's own run converged over three step lengths.

use super::cycle::{first_cycle, first_cycle_steps};
use super::machine::Machine;
use super::study::study_cycle;
use crate::experiment::{
    Engine, Results, RunError, Setting, Totals, interleave, median_and_spread, row,
};
use crate::report::{Progress, ResultRow, step_length};
use crate::scene::{Scene, Scheme, Step};

/// Ratios of step lengths to the scene's own: of the points, and of the finer reference.
const LADDER: [f64; 5] = [8.0, 4.0, 2.0, 1.0, 0.5];
const REFERENCE: [f64; 3] = [0.5, 0.25, 0.125];
/// A halved step must reduce the difference to at most this ratio.
const SHRINKS: f64 = 0.75;

/// Tolerances besides the scene's own. Gauss-Seidel alone takes 400 times as long on the thresher,
/// and leaves islands unsolved.
const TOLERANCES: [f64; 4] = [1e-4, 1e-6, 1e-8, 1e-10];
const SOLVERS: [&str; 2] = ["auto", "direct"];

/// Wear of one load cycle of a new tooth.
pub(super) struct WornCycle {
    /// Depth of each cell \[m\].
    pub depth: Vec<f64>,
    /// The exact depth, if there is algebra for it.
    pub exact: Option<Vec<f64>>,
    pub totals: Totals,
}

/// A name and a measure of the difference of two wear results.
type Distance = (&'static str, fn(&[f64], &[f64]) -> f64);

/// For depths h and reference depths h': relative errors of all cells together `Σ|h − h'|/Σ h'`, of
/// the deepest cell, and of the sum.
const DISTANCES: [Distance; 3] = [
    ("wear-per-cell", |depth, exact| {
        let off: f64 = depth.iter().zip(exact).map(|(a, b)| (a - b).abs()).sum();
        off / exact.iter().sum::<f64>()
    }),
    ("wear-deepest", |depth, exact| {
        let most = |h: &[f64]| h.iter().copied().fold(0.0, f64::max);
        (most(depth) / most(exact) - 1.0).abs()
    }),
    ("wear-total", |depth, exact| {
        (depth.iter().sum::<f64>() / exact.iter().sum::<f64>() - 1.0).abs()
    }),
];

/// The reference of the chart.
struct Against {
    depth: Vec<f64>,
    /// Accuracy of the reference in each distance; `None` if it did not converge.
    known: [Option<f64>; DISTANCES.len()],
    words: &'static str,
}

impl Against {
    fn describe(&self, known: f64) -> String {
        match known > 0.0 {
            true => format!("{} ±{known:.1e}", self.words),
            false => self.words.to_owned(),
        }
    }
}

/// The chart of a machine: settings of the stepper, and the error of the wear of a load cycle.
#[derive(Debug, Clone)]
pub struct WearChart<'a> {
    pub scene: &'a Scene,
    pub machine: &'a Machine,
    pub settings: Vec<Setting>,
    pub repeats: usize,
}

impl WearChart<'_> {
    /// Settings of a machine's chart: our stepper in both schemes over the ladder of steps, and at
    /// the scene's step and scheme other tolerances and solvers. A quick chart has three steps and
    /// the scheme alone.
    pub fn settings(step: &Step, quick: bool) -> Vec<Setting> {
        let other = match step.scheme {
            Scheme::Staggered => Scheme::Moreau,
            Scheme::Moreau => Scheme::Staggered,
        };
        let base = Setting::new(Engine::Moreau, step);
        let (schemes, lengths) = match quick {
            true => (vec![step.scheme], &LADDER[..3]),
            false => (vec![step.scheme, other], &LADDER[..]),
        };
        let mut settings: Vec<Setting> = Vec::new();
        for scheme in schemes {
            let mut setting = base.clone();
            setting.step.scheme = scheme;
            settings.extend(lengths.iter().map(|by| setting.with_dt(by * step.dt)));
        }
        if !quick {
            let mut variants = vec![base.clone(); TOLERANCES.len() + SOLVERS.len()];
            for (setting, tolerance) in variants.iter_mut().zip(TOLERANCES) {
                setting.step.tolerance = tolerance;
            }
            for (setting, solver) in variants[TOLERANCES.len()..].iter_mut().zip(SOLVERS) {
                setting.step.solver = solver.to_owned();
            }
            for setting in variants {
                if !settings.contains(&setting) {
                    settings.push(setting);
                }
            }
        }
        settings
    }

    /// Steps of all runs, for a progress bar.
    pub fn steps(&self) -> usize {
        let Machine::Thresher(setup) = self.machine else {
            return self.settings.len() * self.repeats;
        };
        let of = |dt: f64| first_cycle_steps(&setup.parameters, dt);
        let points: usize = self.settings.iter().map(|s| of(s.step.dt)).sum();
        let finer = REFERENCE.iter().map(|by| of(by * self.scene.step.dt));
        points * self.repeats + finer.sum::<usize>()
    }

    /// Runs every setting and compares the wear of one load cycle.
    ///
    /// # Returns
    /// `wear-per-cell`, `wear-deepest` and `wear-total` of every point, relative, and at least the
    /// accuracy of the reference; `residual` and `unsolved-islands`.
    ///
    /// # Errors
    /// [`RunError`] if the scene or its reference cannot be run; a point that fails is a row.
    pub fn run(&self, progress: &Progress) -> Result<Results, RunError> {
        self.machine.needs_strip("chart")?;
        let settings = &self.settings;
        progress.message("reference");
        let (against, notes) = self.against(progress)?;
        progress.message("");
        type Run = Result<(WornCycle, Vec<f64>), String>;
        let mut points: Vec<Option<Run>> = settings.iter().map(|_| None).collect();
        interleave(&mut points, self.repeats, |k, point| {
            if matches!(point, Some(Err(_))) {
                return Ok(());
            }
            match self.cycle(&settings[k].step, progress) {
                Ok(found) => {
                    let now = found.totals.wall / found.totals.time;
                    let mut times = match point.take() {
                        Some(Ok((_, times))) => times,
                        _ => Vec::new(),
                    };
                    times.push(now);
                    *point = Some(Ok((found, times)));
                }
                Err(RunError::Step(error)) => *point = Some(Err(error.to_string())),
                Err(RunError::Wear(error)) => *point = Some(Err(error.to_string())),
                Err(error) => return Err(error),
            }
            Ok(())
        })?;
        let mut results = Results {
            rows: Vec::new(),
            notes,
        };
        for (setting, point) in settings.iter().zip(points.into_iter().flatten()) {
            let blank = row(self.scene, setting);
            match point {
                Ok((found, mut times)) => {
                    let (time, spread) = median_and_spread(&mut times);
                    let unsolved = found.totals.unsolved_islands;
                    let blank = ResultRow {
                        seconds_per_simulated_second: time,
                        spread,
                        verdict: if unsolved > 0 { "unsolved" } else { "" }.to_owned(),
                        ..blank
                    };
                    results.rows.extend(figures(&against, &blank, Some(&found)));
                }
                Err(reason) => {
                    let blank = ResultRow {
                        verdict: "fail".to_owned(),
                        mode: "stops".to_owned(),
                        ..blank
                    };
                    let dt = step_length(setting.step.dt);
                    let label = setting.label();
                    results.notes.push(format!(
                        "{} failed, {label}, dt {dt}: {reason}",
                        setting.name()
                    ));
                    results.rows.extend(figures(&against, &blank, None));
                }
            }
        }
        Ok(results)
    }

    /// The reference, and sentences that describe it.
    fn against(&self, progress: &Progress) -> Result<(Against, Vec<String>), RunError> {
        let run = |by: f64| {
            let mut step = self.scene.step.clone();
            step.dt *= by;
            self.cycle(&step, progress)
        };
        if let Machine::Study(_) = self.machine {
            let cycle = run(LADDER[0])?;
            let depth = cycle.exact.ok_or_else(|| {
                RunError::Unfit(format!(
                    "scene {}: this reading has no algebra to compare with",
                    self.scene.name
                ))
            })?;
            let against = Against {
                depth,
                known: [Some(0.0); DISTANCES.len()],
                words: "algebra",
            };
            return Ok((against, Vec::new()));
        }
        let levels = [run(REFERENCE[0])?, run(REFERENCE[1])?, run(REFERENCE[2])?];
        let steps = REFERENCE
            .map(|by| step_length(by * self.scene.step.dt))
            .join(", ");
        let mut notes = Vec::new();
        let known = DISTANCES.map(|(name, distance)| {
            let coarse = distance(&levels[0].depth, &levels[1].depth);
            let fine = distance(&levels[1].depth, &levels[2].depth);
            let converges = fine <= SHRINKS * coarse;
            notes.push(match converges {
                true => format!(
                    "{name}: against our own run at steps of {steps}, the last two {fine:.1e} \
                     apart, the first two {coarse:.1e}; smaller errors are not resolved"
                ),
                false => format!(
                    "{name}: our own runs at steps of {steps} do not converge, the last two are \
                     {fine:.1e} apart, the first two {coarse:.1e}: not compared"
                ),
            });
            converges.then_some(fine)
        });
        let [_, _, finest] = levels;
        let against = Against {
            depth: finest.depth,
            known,
            words: "self-converged",
        };
        Ok((against, notes))
    }

    /// One load cycle by `step`.
    fn cycle(&self, step: &Step, progress: &Progress) -> Result<WornCycle, RunError> {
        let scene = Scene {
            step: step.clone(),
            ..self.scene.clone()
        };
        match self.machine {
            Machine::Thresher(setup) => first_cycle(&scene, setup, progress, &mut |_, _| Ok(())),
            Machine::Study(setup) => {
                progress.advance();
                study_cycle(&scene, setup)
            }
        }
    }
}

fn figures(against: &Against, blank: &ResultRow, found: Option<&WornCycle>) -> Vec<ResultRow> {
    let mut rows = Vec::new();
    let mut push = |measure: &str, value: f64, reference: String| {
        rows.push(ResultRow {
            measure: measure.to_owned(),
            value,
            unit: "1".to_owned(),
            reference,
            ..blank.clone()
        });
    };
    for ((name, distance), known) in DISTANCES.iter().zip(against.known) {
        if let Some(known) = known {
            let value = found.map_or(f64::NAN, |f| distance(&f.depth, &against.depth).max(known));
            push(name, value, against.describe(known));
        }
    }
    let of = |value: fn(&Totals) -> f64| found.map_or(f64::NAN, |f| value(&f.totals));
    push("residual", of(|t| t.residual), "0".to_owned());
    let unsolved = of(|t| t.unsolved_islands as f64);
    push("unsolved-islands", unsolved, "0".to_owned());
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thresher::load;

    #[test]
    fn distances_are_relative_and_tell_a_shift_from_a_loss() {
        let exact = [1.0, 2.0, 1.0];
        let of = |depth: &[f64]| DISTANCES.map(|(_, distance)| distance(depth, &exact));
        assert_eq!(of(&exact), [0.0; 3]);
        // moved from one cell to the next, nothing lost
        assert_eq!(of(&[2.0, 1.0, 1.0]), [0.5, 0.0, 0.0]);
        assert_eq!(of(&[1.0, 1.0, 1.0]), [0.25, 0.5, 0.25]);
    }

    #[test]
    fn no_point_of_a_wear_chart_runs_twice() {
        let settings = WearChart::settings(&Step::default(), false);
        for (k, setting) in settings.iter().enumerate() {
            assert!(!settings[..k].contains(setting), "{setting:?}");
        }
        // two schemes at five steps, three tolerances and a solver more
        assert_eq!(settings.len(), 10 + 3 + 1);
        assert_eq!(WearChart::settings(&Step::default(), true).len(), 3);
    }

    /// The study's rotor slides at constant speed under given loads: exact at every step.
    #[test]
    fn the_study_is_exact_at_every_step_length() {
        let (scene, machine) = load("thresher-study", &[]).unwrap();
        let chart = WearChart {
            scene: &scene,
            machine: &machine.unwrap(),
            settings: WearChart::settings(&scene.step, true),
            repeats: 1,
        };
        let results = chart.run(&Progress::new("", 1, true)).unwrap();
        let wear: Vec<&ResultRow> = results
            .rows
            .iter()
            .filter(|r| r.measure.starts_with("wear"))
            .collect();
        assert_eq!(wear.len(), 9);
        for row in wear {
            assert!(row.value < 1e-6, "{row:?}");
            assert_eq!(row.reference, "algebra");
        }
    }
}
