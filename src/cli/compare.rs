use super::compare_table::table;
use super::compared_lead::of_points;
use super::{CompareArgs, Flags, Outcome, effect, run_page, summary};
use crate::experiment::{Comparison, Engine, RunError, Setting, run_settings, step_count};
use crate::report::{
    Chart, OutputFolder, Progress, ResultRow, convergence, energy, panels, scatter, work_precision,
};
use crate::scene::{Scene, Scheme};
use serde::Serialize;

/// The part of `summary.json` that only `compare` writes.
#[derive(Serialize)]
struct Found<'a> {
    rows: usize,
    points: usize,
    repeats: usize,
    pictures: &'a [&'static str],
    warnings: &'a [String],
}

pub(super) fn compare(args: &CompareArgs) -> Result<Outcome, RunError> {
    let (mut scene, machine) = args.common.load()?;
    if machine.is_some() {
        return Err(RunError::Unfit(format!(
            "scene {}: a wear scene is not compared with rapier, which computes no slip; use `run`",
            scene.name
        )));
    }
    // every step length covers the same time
    if let Some(steps) = args.common.flags.steps {
        scene.step.time = f64::from(steps) * scene.step.dt;
    }
    let comparison = Comparison {
        schemes: schemes(&args.common.flags, &scene),
        ladder: args.ladder,
        sweep: !args.no_sweep,
        ..Comparison::default()
    };
    let mut settings = comparison.settings(&scene.step);
    let skipped = leave_out(&scene, &mut settings);
    refuse_idle(args, &scene, &settings)?;
    let folder = OutputFolder::create(args.common.folder(&scene))?;
    let steps: usize = settings.iter().map(|s| step_count(&s.step)).sum();
    let repeats = args.repeats as usize;
    let progress = Progress::new(
        &scene.name,
        (steps * repeats) as u64,
        args.common.flags.quiet,
    );
    let results = run_settings(&scene, &settings, repeats, None, &progress)?;
    drop(progress);
    let rows = summary::written(&folder, &results.rows)?;
    let notes: Vec<String> = skipped
        .into_iter()
        .chain(results.notes)
        .chain(scatter(&rows))
        .collect();
    let pictures = draw(&folder, &rows, args.ladder)?;
    let more = Found {
        rows: rows.len(),
        points: settings.len(),
        repeats,
        pictures: &pictures,
        warnings: &notes,
    };
    let (head, say) = (summary::header("compare", &scene), args.common.flags.say());
    let text = summary::write(&folder, head, more)?;
    let base = |s: &&Setting| s.step.dt == scene.step.dt && s.baseline == s.engine.baseline();
    let columns: Vec<Setting> = settings.iter().filter(base).cloned().collect();
    let table = table(&rows, &columns, Engine::RapierStiff.name());
    let title = format!("{}: {}", scene.name, scene.title);
    if args.report {
        let lead = of_points(&rows, repeats, notes.len());
        let title = format!("Comparison of {title}");
        run_page::write_compared(&folder, &text, &title, lead, &table)?;
    }
    summary::finish(folder, &text, say, |target| {
        let mut out = format!("{title}\n{table}");
        out.push_str(&summary::noted(&notes));
        out.push_str(&format!(
            "results.csv{} in {}\n",
            pictures
                .iter()
                .map(|p| format!(", {p}"))
                .collect::<String>(),
            target.display()
        ));
        out
    })?;
    Ok(Outcome::Done)
}

/// Refuses keys and flags that have no effect on any of the points.
fn refuse_idle(args: &CompareArgs, scene: &Scene, settings: &[Setting]) -> Result<(), RunError> {
    let flags = &args.common.flags;
    let mut typed = flags.of_runs();
    if args.no_sweep {
        typed.push(("--no-sweep", String::new()));
    }
    flags.refuse_twice(scene)?;
    let engines: Vec<Engine> = settings.iter().map(|s| s.engine).collect();
    let run = effect::Run {
        engines: &engines,
        one_scheme: flags.scheme.is_some() || flags.events,
        ..effect::Run::new("compare", scene, None, flags)
    };
    run.refuse(flags, &typed)
}

/// Removes the settings of engines that cannot step the scene; returns a sentence for each engine.
pub(super) fn leave_out(scene: &Scene, settings: &mut Vec<Setting>) -> Vec<String> {
    let used = |e: &&(&str, Engine)| settings.iter().any(|s| s.engine == e.1);
    let engines = Engine::ALL.iter().filter(used).map(|(_, engine)| *engine);
    let unfit = engines.filter_map(|e| Some((e, e.fits(scene).err()?)));
    let unfit: Vec<(Engine, RunError)> = unfit.collect();
    settings.retain(|s| unfit.iter().all(|(engine, _)| *engine != s.engine));
    let words = |error: RunError| error.to_string().replacen("--engine ", "skipped ", 1);
    unfit.into_iter().map(|(_, error)| words(error)).collect()
}

/// The scheme that the flags set; without such flags the scene's scheme and then the others.
pub(super) fn schemes(flags: &Flags, scene: &Scene) -> Vec<(Scheme, bool)> {
    let own = (scene.step.scheme, scene.step.events);
    if flags.scheme.is_some() || flags.events {
        return vec![own];
    }
    let all = [
        (Scheme::Staggered, false),
        (Scheme::Staggered, true),
        (Scheme::Moreau, false),
    ];
    let others = all.into_iter().filter(|other| *other != own);
    std::iter::once(own).chain(others).collect()
}

/// Draws the pictures with values to show; returns their file names.
fn draw(
    folder: &OutputFolder,
    rows: &[ResultRow],
    ladder: bool,
) -> Result<Vec<&'static str>, RunError> {
    type Draw = fn(&[ResultRow]) -> Vec<Chart>;
    let all: [(&str, Draw); 3] = [
        ("work-precision.svg", work_precision),
        ("convergence.svg", convergence),
        ("energy.svg", energy),
    ];
    let mut written = Vec::new();
    for (name, draw) in &all[..if ladder { 3 } else { 1 }] {
        let charts = draw(rows);
        if !charts.is_empty() {
            folder.write(name, panels(&charts)?)?;
            written.push(*name);
        }
    }
    Ok(written)
}
