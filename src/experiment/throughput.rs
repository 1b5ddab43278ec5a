use super::results::{self, interleave};
use super::setting::Setting;
use super::simulate::{Engine, RunError};
use crate::dynamics::{Phases, StepError};
use crate::report::{Progress, ResultRow};
use crate::scene::{Built, Scene, Step};

/// A scene at one size.
#[derive(Debug, Clone)]
pub struct Workload {
    pub scene: Scene,
    /// The changes that make this size; empty for the unchanged scene.
    pub rung: String,
    /// Steps before the timed ones.
    pub settle: usize,
}

/// Engines, threads and steps of a throughput measurement.
#[derive(Debug, Clone)]
pub struct Throughput {
    pub engines: Vec<Engine>,
    /// Numbers of threads of our engine, each measured; a peer, as it is built here, has one thread.
    pub threads: Vec<usize>,
    /// Tolerances of our solver, each measured; that of the scene if empty.
    pub tolerances: Vec<f64>,
    /// Timed steps, 1 at least.
    pub steps: usize,
}

/// Timed steps that an engine takes in a turn, so that its world is in the CPU caches as in a run
/// alone. A step that is not timed follows; it is the one that is looked at.
const TURN: usize = 10;

/// One engine with its own copy of the world.
struct Point {
    setting: Setting,
    built: Built,
    /// Time of each step \[s\], and for our engine the times of its phases.
    times: Vec<f64>,
    phases: Vec<Phases>,
    /// Steps that were looked at, and the sum of their contacts.
    watched: usize,
    contacts: usize,
    islands: usize,
    sweeps: usize,
    penetration: f64,
    residual: f64,
    unsolved: usize,
    failed: Option<String>,
}

impl Throughput {
    /// Number of steps of all engines in one workload, for a progress bar.
    pub fn count(&self, work: &Workload) -> usize {
        self.points(&work.scene).len() * (work.settle + self.steps + self.steps.div_ceil(TURN))
    }

    /// The engines, each with its settings: ours with each number of threads and each tolerance,
    /// once with islands at rest kept, once with all islands solved in every step.
    fn points(&self, scene: &Scene) -> Vec<(Engine, Step)> {
        let own = [scene.step.tolerance];
        let tolerances = match self.tolerances.as_slice() {
            [] => &own,
            given => given,
        };
        let mut points = Vec::new();
        for &engine in &self.engines {
            if engine != Engine::Moreau {
                let threads = 1;
                let step = scene.step.clone();
                points.push((engine, Step { threads, ..step }));
                continue;
            }
            let all = tolerances.iter();
            for (&tolerance, &threads) in all.flat_map(|r| self.threads.iter().map(move |n| (r, n)))
            {
                for keep_rest in [true, false] {
                    let step = Step {
                        tolerance,
                        threads,
                        keep_rest,
                        ..scene.step.clone()
                    };
                    if scene.step.keep_rest || !keep_rest {
                        points.push((engine, step));
                    }
                }
            }
        }
        points
    }

    /// Times the steps of a workload, each engine with its own copy of the world.
    ///
    /// Engines take turns of ten steps, so that a slowdown of the computer affects all of them.
    /// Between the timed steps of a turn nothing else is done. After them comes a step that is not
    /// timed, whose contacts and overlaps are measured. All but the times is deterministic.
    ///
    /// # Returns
    /// For each engine, and for each setting of ours:
    /// - `step-time` \[s\], the mean of the middle half of the timed steps, with half their range over
    ///   it in `spread`. (Steps are of different kinds, some without a solve; a median would show one
    ///   kind alone.)
    /// - `contacts`, the mean number of a step;
    /// - `penetration` \[m\], the worst of the measured steps;
    /// - for our engine the time of each phase of a step ([`Phases`]), in the same way, and `residual`
    ///   and `unsolved-islands` of all timed steps;
    /// - `contact-sweeps` per second, for a method that sweeps over the contacts: over the whole step
    ///   for a peer, over the solve for our engine if all contacts form one island.
    ///
    /// An engine that fails in a step has only the row `step-time`, NaN and `fail`; the notes say
    /// why.
    ///
    /// # Errors
    /// [`RunError::Step`] if the scene cannot be built; [`RunError::Unfit`] if an engine cannot step
    /// the scene.
    pub fn run(
        &self,
        work: &Workload,
        progress: &Progress,
    ) -> Result<(Vec<ResultRow>, Vec<String>), RunError> {
        let mut points = Vec::new();
        for (engine, step) in self.points(&work.scene) {
            engine.has_model(&work.scene)?;
            let scene = Scene {
                step,
                ..work.scene.clone()
            };
            let mut built = scene.build()?;
            let setting = Setting::new(engine, &scene.step);
            if let Some(settings) = &setting.baseline {
                engine.prepare_with(settings, &mut built)?;
            }
            // the first call records overlaps of the start, which are not errors of a step
            built.measure(|built, k| engine.state(built, k));
            points.push(Point::new(setting, built));
        }
        for turn in (0..work.settle).step_by(TURN) {
            let steps = TURN.min(work.settle - turn);
            interleave(&mut points, 1, |_, point| {
                point.settle(steps, progress);
                Ok::<_, RunError>(())
            })?;
        }
        for turn in (0..self.steps).step_by(TURN) {
            let steps = TURN.min(self.steps - turn);
            interleave(&mut points, 1, |_, point| {
                point.turn(steps, progress);
                Ok::<_, RunError>(())
            })?;
        }
        let failed = points.iter().filter_map(|p| {
            let reason = p.failed.as_ref()?;
            let (name, threads) = (p.setting.name(), p.setting.threads());
            Some(format!("{name} {}, threads {threads}: {reason}", work.rung))
        });
        let notes = failed.collect();
        let rows = points.iter_mut().flat_map(|p| p.rows(work)).collect();
        Ok((rows, notes))
    }
}

impl Point {
    fn new(setting: Setting, built: Built) -> Point {
        Point {
            setting,
            built,
            times: Vec::new(),
            phases: Vec::new(),
            watched: 0,
            contacts: 0,
            islands: 0,
            sweeps: 0,
            penetration: 0.0,
            residual: 0.0,
            unsolved: 0,
            failed: None,
        }
    }

    /// Steps that nobody looks at.
    fn settle(&mut self, steps: usize, progress: &Progress) {
        self.records(false);
        for _ in 0..steps {
            self.take(|point| point.setting.engine.step(&mut point.built).map(drop));
            progress.advance();
        }
    }

    /// A turn of timed steps, and one that is looked at.
    fn turn(&mut self, steps: usize, progress: &Progress) {
        self.records(false);
        for _ in 0..steps {
            self.take(Point::timed_step);
            progress.advance();
        }
        self.records(true);
        self.take(Point::watched_step);
        progress.advance();
    }

    /// Whether steps of a peer make a record.
    fn records(&mut self, on: bool) {
        if let Some(simulation) = self.built.simulation_mut() {
            simulation.peer_records = on;
        }
    }

    fn take(&mut self, step: impl Fn(&mut Point) -> Result<(), StepError>) {
        if self.failed.is_none()
            && let Err(error) = step(self)
        {
            self.failed = Some(error.to_string());
        }
    }

    fn timed_step(&mut self) -> Result<(), StepError> {
        self.built.time_phases(true);
        let (record, elapsed) = self.setting.engine.timed_step(&mut self.built)?;
        self.times.push(elapsed);
        self.phases.push(self.built.phases());
        self.sweeps += record.sweeps;
        self.residual = self.residual.max(record.residual);
        self.unsolved += record.unsolved;
        Ok(())
    }

    fn watched_step(&mut self) -> Result<(), StepError> {
        let engine = self.setting.engine;
        self.built.time_phases(false);
        let record = engine.step(&mut self.built)?;
        let found = self.built.measure(|built, k| engine.state(built, k));
        self.watched += 1;
        self.contacts += record.contacts_at_end();
        self.islands = self.islands.max(record.islands);
        let worst = found.map_or(record.penetration, |m| m.worst);
        self.penetration = self.penetration.max(worst);
        Ok(())
    }

    fn rows(&mut self, work: &Workload) -> Vec<ResultRow> {
        let setting = &self.setting;
        let blank = ResultRow {
            rung: work.rung.clone(),
            verdict: match (&self.failed, self.unsolved) {
                (Some(_), _) => "fail",
                (None, 0) => "",
                _ => "unsolved",
            }
            .to_owned(),
            ..results::row(&work.scene, setting)
        };
        let row = |measure: &str, value: f64, unit: &str| ResultRow {
            measure: measure.to_owned(),
            value,
            unit: unit.to_owned(),
            ..blank.clone()
        };
        if self.failed.is_some() {
            let mode = "stops".to_owned();
            let failed = row("step-time", f64::NAN, "s");
            return vec![ResultRow { mode, ..failed }];
        }
        let contacts = self.contacts as f64 / self.watched as f64;
        let mean = self.times.iter().sum::<f64>() / self.times.len() as f64;
        let (step, spread) = middle(&mut self.times);
        let mut rows = vec![
            ResultRow {
                seconds_per_simulated_second: Some(step / setting.step.dt),
                spread: Some(spread),
                ..row("step-time", step, "s")
            },
            row("contacts", contacts, "1"),
            row("penetration", self.penetration, "m"),
        ];
        match &setting.baseline {
            Some(_) if contacts == 0.0 => {}
            Some(peer) => {
                let sweeps = peer.sweeps() as f64;
                rows.push(row("contact-sweeps", contacts * sweeps / mean, "1/s"));
            }
            None => {
                for (k, (name, _)) in Phases::default().named().into_iter().enumerate() {
                    let own = self.phases.iter().map(|p| p.named()[k].1);
                    let (phase, spread) = middle(&mut own.collect::<Vec<_>>());
                    rows.push(ResultRow {
                        spread: Some(spread),
                        ..row(&format!("{name}-time"), phase, "s")
                    });
                }
                if self.sweeps > 0 && self.islands == 1 {
                    let solving: f64 = self.phases.iter().map(|p| p.solve).sum();
                    let rate = contacts * self.sweeps as f64 / solving;
                    rows.push(row("contact-sweeps", rate, "1/s"));
                }
                rows.push(row("residual", self.residual, "1"));
                rows.push(row("unsolved-islands", self.unsolved as f64, "1"));
            }
        }
        rows
    }
}

/// Mean of the middle half of `times`, and half the range of that half over its mean.
fn middle(times: &mut [f64]) -> (f64, f64) {
    times.sort_by(f64::total_cmp);
    let half = &times[times.len() / 4..times.len() - times.len() / 4];
    let mean = half.iter().sum::<f64>() / half.len() as f64;
    let range = half[half.len() - 1] - half[0];
    (mean, if range > 0.0 { 0.5 * range / mean } else { 0.0 })
}

/// Exponent p of `time ∝ contacts^p` over the sizes of a scene, by least squares over logarithms.
/// One row for each scene, engine and setting with at least two sizes; its `rung` names
/// the smallest and the largest number of contacts.
pub fn growth(rows: &[ResultRow]) -> Vec<ResultRow> {
    fn engine(r: &ResultRow) -> (&str, &str, &str, usize) {
        (&r.scene, &r.engine, &r.setting, r.threads)
    }
    let value = |of: &ResultRow, measure: &str| {
        let same =
            |r: &&ResultRow| (&r.rung, engine(r)) == (&of.rung, engine(of)) && r.measure == measure;
        rows.iter().find(same).map(|r| r.value)
    };
    let mut found: Vec<ResultRow> = Vec::new();
    let times = rows.iter().filter(|r| r.measure == "step-time");
    for first in times.clone() {
        if found.iter().any(|r| engine(r) == engine(first)) {
            continue;
        }
        let own = times.clone().filter(|r| engine(r) == engine(first));
        let points: Vec<(f64, f64)> = own
            .filter_map(|r| Some((value(r, "contacts")?, r.value)))
            .filter(|(n, t)| *n > 0.0 && *t > 0.0)
            .collect();
        let Some(power) = slope(&points) else {
            continue;
        };
        let least = points.iter().map(|p| p.0).fold(f64::INFINITY, f64::min);
        let most = points.iter().map(|p| p.0).fold(0.0, f64::max);
        found.push(ResultRow {
            rung: format!("{least:.0} to {most:.0} contacts"),
            measure: "growth".to_owned(),
            value: power,
            unit: "1".to_owned(),
            seconds_per_simulated_second: None,
            spread: None,
            ..first.clone()
        });
    }
    found
}

/// Slope of log y over log x; `None` for fewer than two different x.
fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let n = points.len() as f64;
    let logs = || points.iter().map(|(x, y)| (x.ln(), y.ln()));
    let mean_x = logs().map(|p| p.0).sum::<f64>() / n;
    let mean_y = logs().map(|p| p.1).sum::<f64>() / n;
    let xx: f64 = logs().map(|(x, _)| (x - mean_x).powi(2)).sum();
    let xy: f64 = logs().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    (xx > 1e-12).then(|| xy / xx)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_half_tells_the_spread() {
        let mut times = [9.0, 1.0, 2.0, 3.0, 2.5, 2.0, 3.0, 100.0];
        // sorted 1 2 2 2.5 3 3 9 100: middle half 2 to 3
        assert_eq!(middle(&mut times), (2.625, 0.5 * (3.0 - 2.0) / 2.625));
        assert_eq!(middle(&mut [2.0]), (2.0, 0.0));
    }

    #[test]
    fn growth_is_the_power_through_the_rungs() {
        let text = "[scene]\nname = \"s\"\ntitle = \"t\"\n[[body]]\nname = \"b\"\ndisc = 1\n";
        let scene = Scene::parse("s.toml", text, &[]).unwrap();
        let setting = Setting::new(Engine::Moreau, &scene.step);
        let mut rows = Vec::new();
        for n in [1e3, 1e4, 1e5] {
            for (measure, value) in [("step-time", 3e-7 * f64::powf(n, 1.25)), ("contacts", n)] {
                rows.push(ResultRow {
                    rung: n.to_string(),
                    measure: measure.to_owned(),
                    value,
                    ..results::row(&scene, &setting)
                });
            }
        }
        let found = growth(&rows);
        assert_eq!(found.len(), 1);
        assert!((found[0].value - 1.25).abs() < 1e-12);
        assert_eq!(found[0].rung, "1000 to 100000 contacts");
        assert!(growth(&rows[..2]).is_empty());
    }
}
