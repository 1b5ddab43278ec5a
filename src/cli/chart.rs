use super::chart_table::table;
use super::compare::{leave_out, schemes};
use super::compared_lead::of_points;
use super::summary::OneOf;
use super::{Flags, Outcome, chart_accuracy, chart_models, effect, run_page, summary};
use crate::experiment::{
    Baseline, ChartPlan, Comparison, Engine, RunError, Setting, charted_scenes,
};
use crate::peers::{BaselineSettings, Box2dSettings};
use crate::report::{
    CsvFile, Domination, OutputFolder, PointRow, Progress, ResultRow, panels, read_rows, scatter,
    shared, work_precision, write_rows, written_rows,
};
use crate::scene::Scene;
use crate::thresher::{Machine, WearChart};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The machines, which a full chart shows last.
const MACHINES: [&str; 2] = ["thresher-study", "thresher"];

/// Tolerances and solvers that our engine runs besides the defaults.
const TOLERANCES: [f64; 3] = [1e-4, 1e-6, 1e-10];
const SOLVERS: [&str; 2] = ["nsgs", "direct"];

#[derive(Args)]
pub(super) struct ChartArgs {
    /// Scenes of the catalogue, paths of TOML files, or - for standard input [default: all scenes with a closed form, and
    /// some that test stability].
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<String>,
    #[command(flatten)]
    pub flags: Flags,
    /// Run four scenes, three step lengths, one run of each point, and the peers' presets only.
    #[arg(long)]
    quick: bool,
    /// Number of runs of each point; the runs are interleaved and times are their medians
    /// [default: 3, with --quick 1].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=100))]
    pub repeats: Option<u32>,
    /// Run a single point of each scene: moreau, rapier, rapier-stiff, or box2d if it is built in,
    /// with the step length, scheme, solver and tolerance of the other flags.
    #[arg(long, value_name = "NAME", value_parser = Engine::named)]
    engine: Option<Engine>,
    /// Settings of the peer at the point, in place of its preset; box2d takes HZ,SUBSTEPS only.
    #[arg(long, value_name = "HZ,SUBSTEPS,PGS", requires = "engine")]
    soft: Option<String>,
    /// Write report.html as well: what came out and whether it can be trusted, pictures and tables, in
    /// one file that a browser opens without network.
    #[arg(long)]
    report: bool,
    /// Draw the results.csv of an earlier chart again, and run nothing.
    #[arg(long, value_name = "FILE",
          conflicts_with_all = ["scenes", "quick", "repeats", "engine", "dt", "time", "steps", "set",
                                "scheme", "events", "solver", "tolerance", "threads"])]
    from: Option<PathBuf>,
    /// Run each scene with the setting that `run --accuracy R` chooses, for each R, and search for the
    /// cheapest fixed setting with the help of the closed form; write accuracy.csv and accuracy.svg
    /// [R: 1e-2,1e-3,1e-4; scenes: twelve with a closed form].
    #[arg(long, value_name = "R,...", value_delimiter = ',', require_equals = true, num_args = 0..,
          default_missing_values = ["1e-2", "1e-3", "1e-4"], value_parser = super::accuracy,
          conflicts_with_all = ["from", "quick", "repeats", "engine", "dt", "time", "steps", "scheme", "events",
                                "tolerance", "threads", "report"])]
    pub accuracy: Option<Vec<f64>>,
    /// Step each scene with every reduction of the model and without it, and set unknowns, time and
    /// difference side by side; write models.csv and models.svg [scenes: ten of all kinds; steps: 240 at
    /// most].
    #[arg(long, conflicts_with_all = ["from", "quick", "engine", "accuracy", "report"])]
    models: bool,
}

impl ChartArgs {
    fn repeats(&self) -> usize {
        self.repeats.unwrap_or(if self.quick { 1 } else { 3 }) as usize
    }
}

/// The peer's settings from `--soft`: frequency \[Hz\], substeps, and for rapier sweeps. Returns the
/// engine's preset without `--soft`.
fn soft(args: &ChartArgs, engine: Engine) -> Result<Option<Baseline>, RunError> {
    let (Some(text), Some(preset)) = (&args.soft, engine.baseline()) else {
        return Ok(engine.baseline());
    };
    let parts: Vec<&str> = text.split(',').collect();
    let (found, form) = match preset {
        Baseline::Rapier(_) => (
            rapier_settings(&parts).map(Baseline::Rapier),
            "HZ,SUBSTEPS,PGS such as 500,40,1",
        ),
        Baseline::Box2d(_) => (
            box2d_settings(&parts).map(Baseline::Box2d),
            "HZ,SUBSTEPS such as 120,40",
        ),
    };
    let wrong = || {
        let engine = engine.name();
        RunError::Unfit(format!(
            "--soft {text}: must be {form} for --engine {engine}, each above 0"
        ))
    };
    found.map(Some).ok_or_else(wrong)
}

fn rapier_settings(parts: &[&str]) -> Option<BaselineSettings> {
    let [hertz, substeps, iterations] = parts else {
        return None;
    };
    Some(BaselineSettings {
        contact_frequency: frequency(hertz)?,
        substeps: count(substeps)?,
        iterations: count(iterations)?,
    })
}

fn box2d_settings(parts: &[&str]) -> Option<Box2dSettings> {
    let [hertz, substeps] = parts else {
        return None;
    };
    Some(Box2dSettings {
        contact_frequency: frequency(hertz)?,
        substeps: count(substeps)?,
    })
}

fn frequency(text: &str) -> Option<f64> {
    let number: Option<f64> = text.parse().ok();
    number.filter(|f| *f > 0.0 && f.is_finite())
}

fn count(text: &str) -> Option<usize> {
    text.parse().ok().filter(|n| *n > 0)
}

pub(super) fn chart(args: &ChartArgs) -> Result<Outcome, RunError> {
    let target = args.flags.out.clone();
    let target = target.unwrap_or_else(|| PathBuf::from("out").join("chart"));
    if let Some(asked) = &args.accuracy {
        return chart_accuracy::chart(args, asked, OutputFolder::create(target)?);
    }
    if args.models {
        return chart_models::chart(args, OutputFolder::create(target)?);
    }
    if let Some(file) = &args.from {
        let folder = OutputFolder::create(target)?;
        return show(args, folder, &read_rows(file)?, &[], Vec::new());
    }
    let mut names = args.scenes.clone();
    if names.is_empty() {
        names = charted_scenes(args.quick)?;
        if !args.quick {
            names.extend(MACHINES.map(str::to_owned));
        }
    }
    // all input is read before anything runs
    let works: Vec<Work> = names
        .iter()
        .map(|name| Work::new(args, name))
        .collect::<Result<_, _>>()?;
    for (k, work) in works.iter().enumerate() {
        if works[..k].iter().any(|w| w.scene.name == work.scene.name) {
            return Err(RunError::Unfit(format!(
                "scene {}: named twice; a chart holds each scene once",
                work.scene.name
            )));
        }
    }
    refuse_idle(args, &works)?;
    let folder = OutputFolder::create(target)?;
    let mut file = CsvFile::<ResultRow>::create(&folder)?;
    let mut points = CsvFile::<PointRow>::create(&folder)?;
    let mut notes = Vec::new();
    for work in &works {
        let found = work.run(args)?;
        notes.extend(found.1);
        for row in &found.0 {
            file.write(row)?;
        }
        for setting in &work.settings {
            points.write(&work.point(args, setting))?;
        }
    }
    file.finish()?;
    points.finish()?;
    let rows: Vec<ResultRow> = written_rows(&folder)?;
    show(args, folder, &rows, &works, notes)
}

/// Refuses keys and flags that have no effect on any of the scenes.
fn refuse_idle(args: &ChartArgs, works: &[Work]) -> Result<(), RunError> {
    let flags = &args.flags;
    let mut typed = flags.of_runs();
    if let Some(soft) = &args.soft {
        typed.push(("--soft", soft.clone()));
    }
    let of_keys = flags.of_keys();
    if let Some(peer) = args.engine.filter(|engine| engine.peer().is_some())
        && let Some((_, words)) = of_keys.iter().find(|(key, _)| effect::ours_alone(key))
    {
        let why = format!("on --engine {}, only on moreau", peer.name());
        return Err(effect::unfit(words, &why));
    }
    let mut refused: Option<Vec<(String, String)>> = None;
    for work in works {
        // a single point takes its step from flags, and its reference takes it from `--set`
        if args.engine.is_none() {
            flags.refuse_twice(&work.scene)?;
        }
        let engines: Vec<Engine> = work.settings.iter().map(|s| s.engine).collect();
        let idle = work.as_run(args, &engines).without_effect(flags, &typed);
        // an effect on one scene is enough
        refused = Some(match refused {
            None => idle,
            Some(mut all) => {
                all.retain(|(what, _)| idle.iter().any(|(other, _)| other == what));
                all
            }
        });
    }
    match refused.into_iter().flatten().next() {
        None => Ok(()),
        Some((what, why)) => Err(effect::unfit(&what, &why)),
    }
}

/// A scene and the points of its chart.
struct Work {
    /// The name or path as the user typed it.
    name: String,
    scene: Scene,
    machine: Option<Machine>,
    comparison: Comparison,
    settings: Vec<Setting>,
    notes: Vec<String>,
}

impl Work {
    fn new(args: &ChartArgs, name: &str) -> Result<Work, RunError> {
        let flags = &args.flags;
        // the step flags set the step of a single point, not the ladder that its reference follows
        let base = match args.engine {
            None => flags.clone(),
            Some(_) => Flags {
                dt: None,
                scheme: None,
                events: false,
                solver: None,
                tolerance: None,
                ..flags.clone()
            },
        };
        let (mut scene, machine) = base.load(name)?;
        if machine.is_some() {
            refuse(args, &scene)?;
        }
        if let Some(steps) = flags.steps {
            scene.step.time = f64::from(steps) * scene.step.dt;
        }
        let fixed = |flag: &Option<String>| flag.is_some() || args.quick;
        let comparison = Comparison {
            schemes: schemes(flags, &scene),
            ladder: !args.quick,
            sweep: !args.quick,
            tolerances: match fixed(&flags.tolerance) {
                true => Vec::new(),
                false => TOLERANCES.to_vec(),
            },
            solvers: match fixed(&flags.solver) {
                true => Vec::new(),
                false => SOLVERS.map(str::to_owned).to_vec(),
            },
        };
        let mut settings = match args.engine {
            None if machine.is_some() => WearChart::settings(&scene.step, args.quick),
            None => once(comparison.settings(&scene.step)),
            Some(engine) => {
                let mut step = flags.load(name)?.0.step;
                step.time = scene.step.time;
                let mut setting = Setting::new(engine, &step);
                setting.baseline = soft(args, engine)?;
                setting.engine.fits(&scene)?;
                vec![setting]
            }
        };
        let notes = leave_out(&scene, &mut settings);
        Ok(Work {
            name: name.to_owned(),
            scene,
            machine,
            comparison,
            settings,
            notes,
        })
    }

    /// Runs all points. Returns the rows, and notes that name the scene.
    fn run(&self, args: &ChartArgs) -> Result<(Vec<ResultRow>, Vec<String>), RunError> {
        let (scene, settings) = (&self.scene, self.settings.clone());
        let repeats = args.repeats();
        let bar = |steps| Progress::new(&scene.name, steps as u64, args.flags.quiet);
        let results = match &self.machine {
            Some(machine) => {
                let chart = WearChart {
                    scene,
                    machine,
                    settings,
                    repeats,
                };
                chart.run(&bar(chart.steps()))?
            }
            None => {
                let plan = ChartPlan::new(scene, &self.comparison, settings, repeats);
                plan.run(&bar(plan.steps()))?
            }
        };
        let notes = self.notes.iter().chain(&results.notes);
        let named = notes.map(|note| format!("{}: {note}", self.scene.name));
        Ok((results.rows, named.collect()))
    }

    /// The run of `engines` whose keys and flags are checked for their effect.
    fn as_run<'a>(&'a self, args: &ChartArgs, engines: &'a [Engine]) -> effect::Run<'a> {
        let flags = &args.flags;
        effect::Run {
            engines,
            reference: self.scene.reference.is_none() && self.machine.is_none(),
            one_scheme: flags.scheme.is_some() || flags.events || args.engine.is_some(),
            ..effect::Run::new("chart", &self.scene, self.machine.as_ref(), flags)
        }
    }

    /// The command that runs `setting` alone.
    fn point(&self, args: &ChartArgs, setting: &Setting) -> PointRow {
        let (flags, step) = (&args.flags, &setting.step);
        let mut words = vec!["moreau2d chart".to_owned(), quoted(&self.name)];
        words.push(format!(
            "--engine {} --dt {}",
            setting.engine.name(),
            step.dt
        ));
        match &setting.baseline {
            None => {
                words.push(format!(
                    "--scheme {} --solver {} --tolerance {:e}",
                    step.scheme.name(),
                    step.solver,
                    step.tolerance
                ));
                match (self.scene.step.events, step.events) {
                    (_, true) => words.push("--events".to_owned()),
                    (true, false) => words.push("--set step.events=false".to_owned()),
                    (false, false) => {}
                }
                if step.threads > 1 {
                    words.push(format!("--threads {}", step.threads));
                }
            }
            preset if *preset == setting.engine.baseline() => {}
            Some(Baseline::Rapier(b)) => {
                let numbers = (b.contact_frequency, b.substeps, b.iterations);
                words.push(format!("--soft {},{},{}", numbers.0, numbers.1, numbers.2));
            }
            Some(Baseline::Box2d(b)) => {
                words.push(format!("--soft {},{}", b.contact_frequency, b.substeps));
            }
        }
        if args.quick {
            words.push("--quick".to_owned());
        }
        // a self-converged reference depends on the scene's step
        if let (None, Some(dt)) = (args.engine, &flags.dt) {
            words.push(format!("--set step.dt={dt}"));
        }
        if flags.steps.is_some() || flags.time.is_some() {
            words.push(format!("--time {}", self.scene.step.time));
        }
        // the command must not contain a change that has no effect on this point
        let engines = [setting.engine];
        let run = self.as_run(args, &engines);
        let idle = run.without_effect(flags, &[]);
        let idle = |set: &String| idle.iter().any(|(what, _)| *what == format!("--set {set}"));
        let sets = flags.set.iter().filter(|set| !idle(set));
        words.extend(sets.map(|set| format!("--set {}", quoted(set))));
        PointRow {
            scene: self.scene.name.clone(),
            rung: String::new(),
            engine: setting.engine.name().to_owned(),
            scheme: setting.scheme().to_owned(),
            solver: setting.solver().to_owned(),
            setting: setting.label(),
            dt_s: step.dt,
            command: words.join(" "),
        }
    }
}

/// Refuses flags that do not apply to a wear scene: its load cycle sets the time, and no peer has
/// its contact law or computes slip.
fn refuse(args: &ChartArgs, scene: &Scene) -> Result<(), RunError> {
    let peer = args.engine.filter(|e| *e != Engine::Moreau);
    let flag = match peer {
        Some(peer) => format!("--engine {}", peer.name()),
        None if args.flags.steps.is_some() => "--steps".to_owned(),
        None if args.flags.time.is_some() => "--time".to_owned(),
        None => return Ok(()),
    };
    Err(RunError::Unfit(format!(
        "{flag}: does not apply to wear scene {}: only moreau steps its contacts, for one load cycle",
        scene.name
    )))
}

/// Removes points of a peer that repeat another point under a different name.
fn once(settings: Vec<Setting>) -> Vec<Setting> {
    let mut kept: Vec<Setting> = Vec::new();
    for setting in settings {
        let same = |k: &Setting| k.step.dt == setting.step.dt && k.baseline == setting.baseline;
        if setting.baseline.is_none() || !kept.iter().any(same) {
            kept.push(setting);
        }
    }
    kept
}

/// Quotes `text` for a shell, in single quotes if it is not a plain word.
fn quoted(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,".contains(c);
    match !text.is_empty() && text.chars().all(plain) {
        true => text.to_owned(),
        false => format!("'{}'", text.replace('\'', r"'\''")),
    }
}

/// The part of `summary.json` that only `chart` writes.
#[derive(Serialize)]
struct Found<'a> {
    rows: usize,
    pictures: &'a [String],
    peer_points: usize,
    dominated: usize,
    dominated_strictly: usize,
    /// Empty with `--from`, whose rows say nothing of it.
    scenes: Vec<OneOf>,
    warnings: &'a [String],
}

/// Draws `rows`, counts the dominated points and writes the summary.
fn show(
    args: &ChartArgs,
    folder: OutputFolder,
    rows: &[ResultRow],
    works: &[Work],
    mut notes: Vec<String>,
) -> Result<Outcome, RunError> {
    notes.extend(scatter(rows));
    let pictures = draw(&folder, rows)?;
    let domination = Domination::new(rows);
    write_rows(&folder, &domination.pairs)?;
    write_rows(&folder, &domination.undominated)?;
    let (peers, dominated, strictly) = domination.counts();
    let more = Found {
        rows: rows.len(),
        pictures: &pictures,
        peer_points: peers,
        dominated,
        dominated_strictly: strictly,
        scenes: (works.iter())
            .map(|work| {
                let (scene, points) = (&work.scene, work.settings.len());
                OneOf::new(&scene.name, Some(scene.step.time), points, scene.hash)
            })
            .collect(),
        warnings: &notes,
    };
    let text = summary::write(&folder, summary::program("chart"), more)?;
    let table = table(&domination);
    if args.report {
        let lead = of_points(rows, args.repeats(), notes.len());
        let title = "Accuracy against speed";
        run_page::write_compared(&folder, &text, title, lead, &table)?;
    }
    summary::finish(folder, &text, args.flags.say(), |target| {
        let notes = summary::noted(&notes);
        format!("{table}{notes}{}", files(target, pictures.len()))
    })?;
    Ok(Outcome::Done)
}

fn files(target: &Path, pictures: usize) -> String {
    format!(
        "results.csv, points.csv, domination.csv, undominated.csv and {pictures} pictures in {}\n",
        target.display()
    )
}

/// Draws a picture for each scene with values to show; returns the file names.
fn draw(folder: &OutputFolder, rows: &[ResultRow]) -> Result<Vec<String>, RunError> {
    let mut written = Vec::new();
    for of_scene in rows.chunk_by(|a, b| a.scene == b.scene) {
        let charts = work_precision(&shared(of_scene));
        if !charts.is_empty() {
            let name = format!("{}.svg", of_scene[0].scene);
            folder.write(&name, panels(&charts)?)?;
            written.push(name);
        }
    }
    Ok(written)
}
