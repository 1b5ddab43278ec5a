//! `chart --models`: every reduction of the model against the full model.

use super::chart::ChartArgs;
use super::{Outcome, summary};
use crate::experiment::{REDUCTIONS, RunError, against_full, step_count};
use crate::report::{
    Align, ModelRow, OutputFolder, Progress, Table, model_matrix, number, write_rows, written_rows,
};
use crate::scene::Scene;
use serde::Serialize;

/// Scenes at rest and in motion, of few and many islands, with friction and without, with joints.
const SCENES: [&str; 10] = [
    "tower",
    "wall",
    "many-pyramids",
    "card-house",
    "hit-heap",
    "drum",
    "touching-balls",
    "bowl",
    "elastic-gas",
    "chain",
];

/// Most steps of a scene without `--time` and `--steps`.
const STEPS: usize = 120;

#[derive(Serialize)]
struct Found<'a> {
    rows: &'a [ModelRow],
}

pub(super) fn chart(args: &ChartArgs, folder: OutputFolder) -> Result<Outcome, RunError> {
    let mut names: Vec<String> = args.scenes.clone();
    if names.is_empty() {
        names = SCENES.map(str::to_owned).to_vec();
    }
    let scenes: Vec<Scene> = names
        .iter()
        .map(|name| of_bodies(args, name))
        .collect::<Result<_, _>>()?;
    let repeats = args.repeats.unwrap_or(3) as usize;
    let steps: usize = scenes.iter().map(|scene| step_count(&scene.step)).sum();
    let count = steps * repeats * REDUCTIONS.len();
    let progress = Progress::new("models", count as u64, args.flags.quiet);
    let mut rows = Vec::new();
    for scene in &scenes {
        for reduction in &REDUCTIONS {
            rows.push(against_full(scene, reduction, repeats, &progress)?);
        }
    }
    drop(progress);
    write_rows(&folder, &rows)?;
    let rows: Vec<ModelRow> = written_rows(&folder)?;
    folder.write("models.svg", model_matrix(&rows)?)?;
    let head = summary::program("chart");
    let found = Found { rows: &rows };
    summary::close(folder, head, found, args.flags.say(), |target| {
        format!("{}results in {}\n", table(&rows), target.display())
    })?;
    Ok(Outcome::Done)
}

fn of_bodies(args: &ChartArgs, name: &str) -> Result<Scene, RunError> {
    let flags = &args.flags;
    let (mut scene, machine) = flags.load(name)?;
    flags.refuse_twice(&scene)?;
    if machine.is_some() {
        return Err(RunError::Unfit(format!(
            "chart --models: scene {} is a machine; its jumps state their error in every run",
            scene.name
        )));
    }
    if let Some(reduction) = REDUCTIONS.iter().find(|r| !(r.is_on)(&scene.step)) {
        return Err(RunError::Unfit(format!(
            "chart --models: scene {} has {} = false; every reduction is compared by itself",
            scene.name, reduction.key
        )));
    }
    let dt = scene.step.dt;
    match flags.steps {
        Some(steps) => scene.step.time = f64::from(steps) * dt,
        None if flags.time.is_none() => scene.step.time = scene.step.time.min(STEPS as f64 * dt),
        None => {}
    }
    Ok(scene)
}

fn table(rows: &[ModelRow]) -> Table {
    let mut table = Table::new([
        ("reduction", Align::Left),
        ("scene", Align::Left),
        ("steps", Align::Right),
        ("unknowns full", Align::Right),
        ("reduced", Align::Right),
        ("time full [s]", Align::Right),
        ("reduced", Align::Right),
        ("ratio", Align::Right),
        ("difference", Align::Right),
        ("steps apart", Align::Right),
        ("verdict", Align::Left),
    ]);
    for row in rows {
        table.push([
            row.reduction.clone(),
            row.scene.clone(),
            row.steps.to_string(),
            row.unknowns_full.to_string(),
            row.unknowns.to_string(),
            number(row.time_full_s, 3),
            number(row.time_s, 3),
            number(row.time_ratio, 3),
            number(row.difference, 2),
            row.steps_apart.to_string(),
            row.verdict.clone(),
        ]);
    }
    table
}
