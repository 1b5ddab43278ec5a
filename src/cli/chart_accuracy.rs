//! `chart --accuracy`: what chosen settings reach and cost, against the best fixed settings.

use super::chart::ChartArgs;
use super::{Outcome, summary};
use crate::experiment::{RunError, against_search};
use crate::report::{
    AccuracyRow, Align, OutputFolder, Progress, Table, accuracy_charts, number, panels,
    step_length, write_rows, written_rows,
};
use crate::scene::{ClosedForm, Scene};
use serde::Serialize;

/// Scenes with a closed form whose errors depend on the step, of all kinds of mechanics.
const SCENES: [&str; 12] = [
    "sliding-block",
    "conveyor",
    "bouncing-ball",
    "two-balls",
    "elastic-gas",
    "rocking-block",
    "pendulum",
    "double-pendulum",
    "falling-rod",
    "bowl",
    "loop",
    "riding-disc",
];

#[derive(Serialize)]
struct Found<'a> {
    rows: &'a [AccuracyRow],
}

pub(super) fn chart(
    args: &ChartArgs,
    asked: &[f64],
    folder: OutputFolder,
) -> Result<Outcome, RunError> {
    let mut names: Vec<String> = args.scenes.clone();
    if names.is_empty() {
        names = SCENES.map(str::to_owned).to_vec();
    }
    let scenes: Vec<Scene> = names
        .iter()
        .map(|name| with_closed_form(args, name))
        .collect::<Result<_, _>>()?;
    let progress = Progress::new(
        "accuracy",
        (scenes.len() * asked.len()) as u64,
        args.flags.quiet,
    );
    let mut rows = Vec::new();
    for scene in &scenes {
        for &asked in asked {
            let hidden = Progress::new("", 0, true);
            rows.push(against_search(scene, asked, &hidden)?);
            progress.advance();
        }
    }
    drop(progress);
    write_rows(&folder, &rows)?;
    let rows: Vec<AccuracyRow> = written_rows(&folder)?;
    folder.write("accuracy.svg", panels(&accuracy_charts(&rows))?)?;
    let head = summary::program("chart");
    summary::close(
        folder,
        head,
        Found { rows: &rows },
        args.flags.say(),
        |target| format!("{}results in {}\n", table(&rows), target.display()),
    )?;
    Ok(Outcome::Done)
}

fn with_closed_form(args: &ChartArgs, name: &str) -> Result<Scene, RunError> {
    let (scene, machine) = args.flags.load(name)?;
    args.flags.refuse_twice(&scene)?;
    let form = scene.reference.filter(|form| *form != ClosedForm::None);
    if machine.is_some() || form.is_none() {
        return Err(RunError::Unfit(format!(
            "chart --accuracy: scene {} has no closed form by which its errors could be judged",
            scene.name
        )));
    }
    Ok(scene)
}

fn table(rows: &[AccuracyRow]) -> Table {
    let mut table = Table::new([
        ("scene", Align::Left),
        ("asked", Align::Right),
        ("error", Align::Right),
        ("measure", Align::Left),
        ("setting", Align::Left),
        ("dt", Align::Right),
        ("work", Align::Right),
        ("of best", Align::Right),
        ("choice", Align::Right),
    ]);
    for row in rows {
        let events = if row.events { " events" } else { "" };
        table.push([
            row.scene.clone(),
            format!("{:e}", row.accuracy),
            number(row.error, 2),
            row.measure.clone(),
            format!("{}{events}", row.scheme),
            step_length(row.dt_s),
            row.work.to_string(),
            number(row.ratio, 3),
            row.choice_work.to_string(),
        ]);
    }
    table
}
