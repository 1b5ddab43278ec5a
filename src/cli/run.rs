use super::dump::Dump;
use super::resume::{self, Stopped};
use super::run_accurate::{self, Accurate};
use super::run_files::{BodyState, RunFiles};
use super::run_lead::lead;
use super::summary::{Head, OfRun, Ours};
use super::{Outcome, RunArgs, effect, run_inputs, run_machine, run_page, run_wear, summary};
use crate::checkpoint::{Reader, Writer};
use crate::dynamics::record::ContactRecord;
use crate::experiment::{
    Choice, Engine, Held, Judge, Measure, RunError, Samples, Setting, Totals, Verdict, go_on,
    measures,
};
use crate::report::{
    Align, Moving, OutputFolder, Progress, ReportError, Stage, Still, Table, number,
};
use crate::scene::{BodyKind, Built, Scene};
use crate::thresher::Machine;
use serde::Serialize;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Most rows of `bodies.csv` that a run writes without `--every`.
pub(super) const BODY_ROWS: usize = 100_000;

/// What pictures of bodies that wear say.
pub(super) const NEW: &str =
    "Bodies are drawn as they were new: where they overlap here, they have worn.";

/// The part of `summary.json` that only `run` writes.
#[derive(Serialize)]
struct Found<'a> {
    totals: Value,
    verdict: &'a Verdict,
    /// Where the bodies that move are at the end, of a scene that has few.
    end: Vec<End<'a>>,
    measures: &'a [Measure],
    #[serde(skip_serializing_if = "Option::is_none")]
    accuracy: Option<&'a Accurate<'a>>,
    warnings: &'a [String],
}

/// Most bodies that the summary tells the end of: with more it is no summary.
const ENDS: usize = 24;

/// Where a body is at the end of a run, and how fast.
#[derive(Serialize)]
struct End<'a> {
    body: &'a str,
    x_m: f64,
    y_m: f64,
    angle_rad: f64,
    vx_m_s: f64,
    vy_m_s: f64,
    omega_rad_s: f64,
}

/// The ends of the bodies that move; none if there are more than [`ENDS`].
fn ends<'a>(scene: &'a Scene, states: &[BodyState]) -> Vec<End<'a>> {
    let moving = states.iter().filter_map(|(k, pose, u)| {
        let body = scene.bodies.get(*k as usize)?;
        (body.kind == BodyKind::Dynamic).then(|| End {
            body: &body.name,
            x_m: pose.translation.x,
            y_m: pose.translation.y,
            angle_rad: pose.angle(),
            vx_m_s: u.x,
            vy_m_s: u.y,
            omega_rad_s: u.z,
        })
    });
    let all: Vec<End<'a>> = moving.collect();
    match all.len() <= ENDS {
        true => all,
        false => Vec::new(),
    }
}

/// The head of the summary; for a peer, with the peer's settings in place of ours.
pub(super) fn head(scene: &Scene, engine: Engine, every: usize) -> Head<'_> {
    let mut head = summary::header("run", scene);
    if let Some(of_scene) = &mut head.scene {
        let peer = engine.peer().is_some();
        if peer {
            of_scene.settings.ours = Ours::default();
        }
        of_scene.settings.run = Some(OfRun {
            model: scene.model().word(),
            engine: engine.name(),
            every,
            setting: peer.then(|| Setting::new(engine, &scene.step).label()),
        });
    }
    head
}

/// The scene of a run and its machine, if the run can be made.
///
/// # Errors
/// Those of a scene that cannot be loaded; [`RunError::Unfit`] for an engine that cannot step it, and
/// for a key or flag without effect.
pub(super) fn checked(args: &RunArgs) -> Result<(Scene, Option<Machine>), RunError> {
    let (scene, machine) = args.common.load()?;
    match &machine {
        Some(_) => only_moreau(args, &scene)?,
        None if !scene.wear.is_empty() => only_moreau(args, &scene)?,
        None => args.engine.has_model(&scene)?,
    }
    refuse_idle(args, &scene, machine.as_ref())?;
    refuse_moving(args, &scene, machine.is_some())?;
    run_inputs::check(args, &scene, machine.as_ref())?;
    Ok((scene, machine))
}

/// Runs a scene, or goes on with one that was `stopped`.
pub(super) fn run(args: &RunArgs, stopped: Option<Stopped>) -> Result<Outcome, RunError> {
    let (scene, machine) = checked(args)?;
    if let Some(machine) = machine {
        return run_machine::run(args, &scene, &machine, stopped);
    }
    if !scene.wear.is_empty() {
        return run_wear::run(args, &scene, stopped);
    }
    match args.accuracy {
        None => once(args, &scene, stopped, None),
        Some(asked) => run_accurate::run(args, &scene, asked),
    }
}

/// Runs a scene once; held to the accuracy of a choice, if there is one.
pub(super) fn once(
    args: &RunArgs,
    scene: &Scene,
    stopped: Option<Stopped>,
    choice: Option<&Choice>,
) -> Result<Outcome, RunError> {
    let folder = resume::folder(args, scene, None, stopped)?;
    let mut dump = Dump::create(args)?;
    let steps = args.common.step_count(scene);
    let mut built = scene.build()?;
    built.keep_problems(dump.is_some());
    let every = row_interval(args, steps * built.bodies());
    let mut judge = Judge::new(scene, &built);
    let mut held = choice.map(|choice| Held::start(choice, scene, &built));
    let (mut checkpoint, saved) = resume::checkpoint(args, &folder)?;
    let (mut samples, mut files, totals) =
        begin(args, &folder, every, &mut built, &mut judge, saved)?;
    let progress = Progress::new(&scene.name, steps as u64, args.common.flags.quiet);
    progress.set(totals.steps as u64);
    let totals = go_on(
        &mut built,
        args.engine,
        totals,
        steps,
        |record, built, totals| {
            if scene.reference.is_some() {
                samples.add(record, built, args.engine);
            }
            judge.add(record, built, args.engine);
            if let Some(held) = &mut held {
                held.add(record, built)?;
            }
            files.add(record, || states(built, args.engine))?;
            if let Some(dump) = &mut dump {
                dump.add(built)?;
            }
            progress.advance();
            if let Some(checkpoint) = &mut checkpoint
                && checkpoint.is_due(totals.steps)
            {
                checkpoint.save(&saved_state(built, &judge, &samples, totals, &mut files)?)?;
            }
            Ok(())
        },
    )?;
    drop(progress);
    let found = measures(scene, &samples);
    let ended = held
        .map(|held| held.end(scene, &found, &totals))
        .transpose()?;
    let accuracy = choice
        .zip(ended)
        .map(|(choice, ended)| Accurate::new(choice, &ended));
    files.add_last(|| states(&built, args.engine))?;
    let last = files.finish()?;
    if !args.summary_only {
        write_still(&folder, scene, &states(&built, args.engine), &last)?;
        write_moving(args, &folder, scene)?;
    }
    let verdict = judge.verdict(&totals, &built);
    let notes = notes(scene, &totals, &found);
    let head = head(scene, args.engine, every);
    let states = states(&built, args.engine);
    let found_in_run = Found {
        totals: summary::totals(&totals),
        verdict: &verdict,
        end: ends(scene, &states),
        measures: &found,
        accuracy: accuracy.as_ref(),
        warnings: &notes,
    };
    let text = summary::write(&folder, head, found_in_run)?;
    let lead = lead(
        scene,
        args.engine,
        &totals,
        &verdict,
        &found,
        &states,
        notes.len(),
    );
    let stage = Stage::of(scene);
    run_page::write(args, &folder, &text, lead, Some(&stage), None)?;
    let dumped = dump.map(Dump::finish).transpose()?;
    let say = args.common.flags.say();
    summary::finish(folder, &text, say, |target| {
        let mut out = told(args, scene, &totals, &verdict, accuracy.as_ref());
        out.push_str(&summary::noted(&notes));
        if !found.is_empty() {
            out.push_str(&measure_table(&found));
        }
        out.push_str(&written(every, dumped, target));
        out
    })?;
    // what a peer did is told, and is no failure of the command
    Ok(match verdict.held || args.engine != Engine::Moreau {
        true => Outcome::Done,
        false => Outcome::Failed,
    })
}

/// Samples, files and totals at the start of a run, or as they were `saved`.
fn begin(
    args: &RunArgs,
    folder: &OutputFolder,
    every: usize,
    built: &mut Built,
    judge: &mut Judge,
    saved: Option<Reader>,
) -> Result<(Samples, RunFiles, Totals), RunError> {
    match saved {
        Some(mut saved) => {
            built.load(&mut saved)?;
            judge.load(&mut saved)?;
            let samples = saved.take()?;
            let totals = Totals::load(&mut saved)?;
            let files = RunFiles::load(folder, every, &mut saved)?;
            Ok((samples, files, totals))
        }
        None => {
            let files = start_files(args, folder, every, built)?;
            let samples = Samples::start(built, args.engine);
            args.engine.prepare(built)?;
            Ok((samples, files, Totals::start(built, args.engine)))
        }
    }
}

/// All that [`begin`] needs to go on.
fn saved_state(
    built: &Built,
    judge: &Judge,
    samples: &Samples,
    totals: &Totals,
    files: &mut RunFiles,
) -> Result<Writer, RunError> {
    let mut to = Writer::default();
    built.save(&mut to)?;
    judge.save(&mut to)?;
    to.put(samples)?;
    totals.save(&mut to)?;
    files.save(&mut to)?;
    Ok(to)
}

/// What came out of a run, in words.
fn told(
    args: &RunArgs,
    scene: &Scene,
    totals: &Totals,
    verdict: &Verdict,
    accuracy: Option<&Accurate>,
) -> String {
    let mut out = format!("{}: {}\n", scene.name, scene.title);
    out.push_str(&summary::describe(totals, args.engine, scene.step.events));
    out.push_str(&format!("{}\n", verdict.sentence));
    if let Some(accuracy) = accuracy {
        out.push_str(&accuracy.text());
    }
    out
}

/// What was written, in words.
fn written(every: usize, dumped: Option<(usize, PathBuf)>, target: &Path) -> String {
    let mut out = String::new();
    if every > 1 {
        out.push_str(&format!(
            "the CSV files hold one step in {every}, and the last\n"
        ));
    }
    if let Some((count, folder)) = dumped {
        let folder = folder.display();
        out.push_str(&format!("{count} contact problems in {folder}\n"));
    }
    out + &format!("results in {}\n", target.display())
}

/// Steps between two rows of the CSV files, for a run that makes so many `rows` of bodies.
pub(super) fn row_interval(args: &RunArgs, rows: usize) -> usize {
    let typed = args.every.map(|n| n as usize);
    typed.unwrap_or_else(|| rows.div_ceil(BODY_ROWS).max(1))
}

/// The CSV files, with the bodies at the start.
pub(super) fn start_files(
    args: &RunArgs,
    folder: &OutputFolder,
    every: usize,
    built: &Built,
) -> Result<RunFiles, RunError> {
    let mut files = RunFiles::create(folder, every, args.summary_only)?;
    files.add_bodies(0.0, states(built, args.engine))?;
    Ok(files)
}

/// What the user of a run should know besides its verdict.
fn notes(scene: &Scene, totals: &Totals, found: &[Measure]) -> Vec<String> {
    let mut notes = summary::warnings(totals);
    // it ends before the first event that its closed form knows
    if scene.reference.is_some() && found.is_empty() {
        let why = "the run is too short for its closed form: nothing is compared";
        notes.push(why.to_owned());
    }
    notes.extend(scene.side_warnings());
    notes.extend(scene.start_warnings());
    notes
}

/// Refuses keys and flags that have no effect in this run.
fn refuse_idle(args: &RunArgs, scene: &Scene, machine: Option<&Machine>) -> Result<(), RunError> {
    let flags = &args.common.flags;
    let mut typed = flags.of_runs();
    if let Some(asked) = args.accuracy {
        typed.push(("--accuracy", asked.to_string()));
    }
    if let Some(every) = args.every {
        typed.push(("--every", every.to_string()));
    }
    if let Some(every) = args.checkpoint_every {
        typed.push(("--checkpoint-every", every.to_string()));
    }
    if let Some(folder) = &args.dump_problems {
        typed.push(("--dump-problems", folder.display().to_string()));
    }
    flags.refuse_twice(scene)?;
    let engines = [args.engine];
    let run = effect::Run {
        engines: &engines,
        chosen: args.accuracy.is_some(),
        ..effect::Run::new("run", scene, machine, flags)
    };
    run.refuse(flags, &typed)
}

/// Refuses any engine but ours for a wear scene.
fn only_moreau(args: &RunArgs, scene: &Scene) -> Result<(), RunError> {
    match args.engine {
        Engine::Moreau => Ok(()),
        other => Err(RunError::Unfit(format!(
            "--engine {}: scene {} wears, and only moreau computes the impulses and the slip that wear needs",
            other.name(),
            scene.name
        ))),
    }
}

/// The states of all bodies, in the scene's order.
pub(super) fn states(built: &Built, engine: Engine) -> Vec<BodyState> {
    let state = |k| {
        let (pose, u) = engine.state(built, k)?;
        Some((k as u32, pose, u))
    };
    (0..built.bodies()).filter_map(state).collect()
}

/// Writes `scene.svg`: the bodies at the end of the run, with the contacts of its last step.
pub(super) fn write_still(
    folder: &OutputFolder,
    scene: &Scene,
    states: &[BodyState],
    (contacts, time): &(Vec<ContactRecord>, f64),
) -> Result<(), ReportError> {
    let poses = states
        .iter()
        .map(|(_, pose, _)| [pose.translation.x, pose.translation.y, pose.angle()]);
    let still = Still {
        stage: &Stage::of(scene),
        poses: &poses.collect::<Vec<_>>(),
        velocities: &states
            .iter()
            .map(|(_, _, u)| [u.x, u.y, u.z])
            .collect::<Vec<_>>(),
        dt: scene.step.dt,
        contacts,
        title: &format!("{}: {}", scene.name, scene.title),
        time: *time,
        note: (!scene.wear.is_empty()).then_some(NEW),
    };
    folder.write("scene.svg", still.to_svg())
}

/// Writes `scene-moving.svg` if it was asked for: the motion that the CSV files hold.
pub(super) fn write_moving(
    args: &RunArgs,
    folder: &OutputFolder,
    scene: &Scene,
) -> Result<(), ReportError> {
    if !args.animate {
        return Ok(());
    }
    let moving = Moving {
        stage: &Stage::of(scene),
        title: &format!("{}: {}", scene.name, scene.title),
        note: (!scene.wear.is_empty()).then_some(NEW),
    };
    folder.write("scene-moving.svg", moving.to_svg(folder)?)
}

/// Refuses a moving picture of a machine, or of a scene too large for one.
fn refuse_moving(args: &RunArgs, scene: &Scene, machine: bool) -> Result<(), RunError> {
    let why = match (args.animate, machine) {
        (false, _) => None,
        (true, true) => Some("a machine has pictures of its own, and none that moves".to_owned()),
        (true, false) => Moving::refused(&Stage::of(scene)),
    };
    match why {
        Some(why) => Err(RunError::Unfit(format!("--animate: {}: {why}", scene.name))),
        None => Ok(()),
    }
}

fn measure_table(found: &[Measure]) -> String {
    let mut table = Table::new([
        ("compared with the closed form", Align::Left),
        ("computed", Align::Right),
        ("exact", Align::Right),
        ("error (relative if without unit)", Align::Right),
    ]);
    for m in found {
        let unit = if m.unit == "1" { "" } else { m.unit };
        table.push([
            m.name.to_owned(),
            number(m.computed, 8),
            number(m.exact, 8),
            format!("{} {unit}", number(m.error, 2))
                .trim_end()
                .to_owned(),
        ]);
    }
    format!("{table}")
}
