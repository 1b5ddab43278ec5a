//! `merge`: one table of the cases of a sweep, and its pictures.

use super::merge_table::SweepTable;
use super::summary::{self, Say};
use super::sweep::{PLAN, Planned, PlannedCase};
use super::sweep_case::{self, Found, Record};
use super::{Outcome, summary as out};
use crate::experiment::RunError;
use crate::report::{Align, OutputFolder, SweepPoint, SweepResult, Table, counted, number};
use crate::scene::Hint;
use clap::Args;
use serde::Serialize;
use serde_json::Value;
use std::collections::HashSet;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Rows that the terminal shows at most, and results that are drawn without `--draw`.
const SHOWN: usize = 40;
const DRAWN: usize = 6;

#[derive(Args)]
pub(super) struct MergeArgs {
    /// Folders of a sweep, or of its parts.
    #[arg(value_name = "DIR", required = true)]
    folders: Vec<PathBuf>,
    /// Folder for the table and its pictures.
    #[arg(long, value_name = "DIR", default_value = "out/merge")]
    out: PathBuf,
    /// Draw this column of sweep.csv; may be repeated [default: lives, depths of wear and measures that
    /// vary, else energies and overlap].
    #[arg(long, value_name = "COLUMN")]
    draw: Vec<String>,
    /// Print no table.
    #[arg(long)]
    quiet: bool,
    /// Print summary.json in place of the table.
    #[arg(long)]
    json: bool,
}

/// The part of `summary.json` that only `merge` writes.
#[derive(Serialize)]
struct Summary<'a> {
    scene: &'a str,
    title: &'a str,
    /// Of the program that ran the cases.
    version_of_cases: &'a str,
    keys: &'a [String],
    cases: usize,
    held: usize,
    /// Names of cases, each with what it varies and why it did not hold.
    not_held: Vec<[String; 3]>,
    missing: &'a [[String; 2]],
    damaged: &'a [[String; 2]],
    columns: &'a [String],
    pictures: &'a [String],
    warnings: &'a [String],
}

/// Merges the folders of a sweep.
pub(super) fn merge(args: &MergeArgs) -> Result<Outcome, RunError> {
    let planned = plans(&args.folders)?;
    let first = &planned[0];
    let mut table = SweepTable::new(first.keys.clone());
    let (mut missing, mut damaged) = (Vec::new(), Vec::new());
    let mut seen = HashSet::new();
    for case in planned.iter().flat_map(|planned| &planned.cases) {
        if !seen.insert(case) {
            continue;
        }
        match find(args, first, case)? {
            Case::Whole(record, summary) => table.add(case.clone(), *record, &summary),
            Case::Missing => missing.push([case.case.clone(), case.words(&first.keys)]),
            Case::Damaged(why) => damaged.push([case.case.clone(), why]),
        }
    }
    table.close();
    if table.rows.is_empty() {
        let folders: Vec<String> = args
            .folders
            .iter()
            .map(|f| f.display().to_string())
            .collect();
        return Err(RunError::Unfit(format!(
            "{}: none of the {} is there; `moreau2d sweep` runs them",
            folders.join(", "),
            counted(missing.len() + damaged.len(), "case")
        )));
    }
    let drawn = columns(args, &table)?;
    let folder = OutputFolder::create(&args.out)?;
    folder.write("sweep.csv", table.csv()?)?;
    let (pictures, notes) = draw(&folder, first, &table, &drawn)?;
    let bad = table.rows.iter().filter(|row| !row.record.held);
    let more = Summary {
        scene: &first.scene,
        title: &first.title,
        version_of_cases: &first.version,
        keys: &table.keys,
        cases: table.rows.len(),
        held: table.rows.len() - bad.clone().count(),
        not_held: bad
            .map(|row| {
                let why = row.record.why.clone().unwrap_or_default();
                [row.case.case.clone(), row.case.words(&table.keys), why]
            })
            .collect(),
        missing: &missing,
        damaged: &damaged,
        columns: &table.columns,
        pictures: &pictures,
        warnings: &notes,
    };
    let say = Say::of(args.json, args.quiet);
    let old = pictures_before(&args.out);
    out::close(folder, summary::program("merge"), &more, say, |target| {
        let files = pictures.iter().map(|name| format!(", {name}"));
        format!(
            "{}: {}\n{}{}{}sweep.csv{} in {}\n",
            first.scene,
            first.title,
            shown(&table, &drawn),
            listed(&more),
            summary::noted(&notes),
            files.collect::<String>(),
            target.display()
        )
    })?;
    for name in old.iter().filter(|name| !pictures.contains(name)) {
        let path = args.out.join(name);
        fs::remove_file(&path).map_err(|error| sweep_case::io_error(&path, error))?;
    }
    Ok(match missing.is_empty() && damaged.is_empty() {
        true => Outcome::Done,
        false => Outcome::Failed,
    })
}

/// The pictures that an earlier merge has drawn in a folder.
fn pictures_before(folder: &Path) -> Vec<String> {
    let text = fs::read(folder.join(sweep_case::SUMMARY)).unwrap_or_default();
    let summary: Value = serde_json::from_slice(&text).unwrap_or_default();
    // other commands list pictures too
    let own = summary["command"] == "merge";
    let names = summary["pictures"]
        .as_array()
        .filter(|_| own)
        .into_iter()
        .flatten();
    let own = names.filter_map(|name| name.as_str());
    own.filter(|name| name.ends_with(".svg") && !name.contains(['/', '\\']))
        .filter(|name| folder.join(name).is_file())
        .map(str::to_owned)
        .collect()
}

/// The plans of all folders: of one version, one scene and the same keys.
fn plans(folders: &[PathBuf]) -> Result<Vec<Planned>, RunError> {
    let mut all: Vec<Planned> = Vec::new();
    for folder in folders {
        let path = folder.join(PLAN);
        let text = fs::read(&path).map_err(|error| match error.kind() {
            ErrorKind::NotFound => RunError::Unfit(format!(
                "{}: no folder of a sweep, it has no {PLAN}; `moreau2d sweep` writes one",
                folder.display()
            )),
            _ => sweep_case::io_error(&path, error),
        })?;
        let planned: Planned = serde_json::from_slice(&text).map_err(|error| {
            RunError::Unfit(format!(
                "{}: is no plan of a sweep: {error}; `moreau2d sweep` writes it again",
                path.display()
            ))
        })?;
        let keys = planned.keys.len();
        if let Some(case) = planned.cases.iter().find(|case| case.values.len() != keys) {
            return Err(RunError::Unfit(format!(
                "{}: case {} has {} for {}; `moreau2d sweep` writes the file again",
                path.display(),
                case.case,
                counted(case.values.len(), "value"),
                counted(keys, "key")
            )));
        }
        if let Some(first) = all.first() {
            let of = |planned: &Planned| {
                let keys = planned.keys.join(", ");
                [planned.version.clone(), planned.scene.clone(), keys]
            };
            let pairs = of(&planned).into_iter().zip(of(first));
            let mut named = ["version", "scene", "keys"].into_iter().zip(pairs);
            if let Some((what, (own, other))) = named.find(|(_, (own, other))| own != other) {
                return Err(RunError::Unfit(format!(
                    "{}: {what} is {own}, in {} {other}: one table needs the same; run the sweep again \
                     with one version, or merge apart",
                    folder.display(),
                    folders[0].display()
                )));
            }
        }
        all.push(planned);
    }
    Ok(all)
}

/// A case in one of the folders.
enum Case {
    Whole(Box<Record>, Value),
    Missing,
    Damaged(String),
}

/// The first folder's that has the case whole.
fn find(args: &MergeArgs, planned: &Planned, case: &PlannedCase) -> Result<Case, RunError> {
    let mut found = Case::Missing;
    for folder in &args.folders {
        match sweep_case::look(folder, &case.case)? {
            Found::Nothing => {}
            Found::Damaged(why) => {
                let place = folder.join(&case.case);
                found = Case::Damaged(format!("{}: {why}", place.display()));
            }
            Found::Whole(record) if record.version != planned.version => {
                return Err(RunError::Unfit(format!(
                    "{}: version is {}, of the sweep {}: results of several versions make no table; run the \
                     sweep again with one version",
                    folder.join(&case.case).display(),
                    record.version,
                    planned.version
                )));
            }
            Found::Whole(record) => {
                let summary = match record.ended {
                    true => Value::Null,
                    false => sweep_case::summary(&folder.join(&case.case))?,
                };
                return Ok(Case::Whole(record, summary));
            }
        }
    }
    Ok(found)
}

/// The columns to draw.
fn columns(args: &MergeArgs, table: &SweepTable) -> Result<Vec<String>, RunError> {
    for name in &args.draw {
        if !table.columns.contains(name) {
            let hint = Hint::new(name, &table.columns);
            return Err(RunError::Unfit(format!(
                "--draw {name}: no such column{hint}"
            )));
        }
        if table
            .rows
            .iter()
            .all(|row| table.number(row, name).is_none())
        {
            return Err(RunError::Unfit(format!(
                "--draw {name}: is a number in no case"
            )));
        }
    }
    if !args.draw.is_empty() {
        let mut seen = HashSet::new();
        let asked = args.draw.iter().filter(|name| seen.insert(*name));
        return Ok(asked.cloned().collect());
    }
    let of_wear = |name: &str| {
        name.starts_with("life.") && name.ends_with(".hours")
            || name.ends_with(".deepest_m")
            || name == "comparison.computed_um"
            || name.starts_with("measures.") && name.ends_with(".computed")
    };
    // of a machine that was run for too short a time
    let of_start = |name: &str| {
        name == "steel_lost_kg"
            || name.starts_with("life.") && name.ends_with(".extrapolated_hours")
    };
    let of_bodies = |name: &str| {
        [
            "totals.energy_end_j",
            "totals.friction_work_j",
            "totals.worst_penetration_m",
        ]
        .contains(&name)
    };
    let varying = |wanted: &dyn Fn(&str) -> bool| -> Vec<String> {
        let all = table.columns.iter();
        let found = all.filter(|name| wanted(name) && table.varies(name));
        found.take(DRAWN).cloned().collect()
    };
    let wanted: [&dyn Fn(&str) -> bool; 3] = [&of_wear, &of_start, &of_bodies];
    let mut found = wanted.into_iter().map(varying);
    Ok(found.find(|names| !names.is_empty()).unwrap_or_default())
}

/// Draws each column; returns the names of the files, and notes on what could not be drawn.
fn draw(
    folder: &OutputFolder,
    planned: &Planned,
    table: &SweepTable,
    columns: &[String],
) -> Result<(Vec<String>, Vec<String>), RunError> {
    let (mut pictures, mut notes) = (Vec::new(), Vec::new());
    let subject = format!("{}: {}", planned.scene, planned.title);
    for column in columns {
        let points = table.rows.iter().map(|row| SweepPoint {
            values: (row.case.values.iter())
                .map(|value| value.as_deref().unwrap_or_default())
                .collect(),
            result: table.number(row, column),
            held: row.record.held,
        });
        let result = SweepResult {
            result: column,
            subject: &subject,
            keys: &table.keys,
            points: points.collect(),
        };
        match result.picture()? {
            Some(picture) => {
                let plain = |c: char| match c.is_ascii_alphanumeric() || "._-".contains(c) {
                    true => c,
                    false => '-',
                };
                let stem: String = column.chars().map(plain).collect();
                let name = own_name(&stem, &pictures);
                folder.write(&name, picture)?;
                pictures.push(name);
            }
            None => notes.push(format!(
                "{column} is not drawn: nothing varies, or more than a picture holds"
            )),
        }
    }
    Ok((pictures, notes))
}

/// `STEM.svg`, or the first of `STEM-2.svg`, `STEM-3.svg`, ... that no other picture has. Some file systems
/// take `a` and `A` for the same.
fn own_name(stem: &str, others: &[String]) -> String {
    let numbered = (2..).map(|k| format!("{stem}-{k}.svg"));
    let mut names = [format!("{stem}.svg")].into_iter().chain(numbered);
    let is_free = |name: &String| others.iter().all(|other| !other.eq_ignore_ascii_case(name));
    names.find(is_free).unwrap_or_default()
}

/// The table for the terminal: keys and drawn columns.
fn shown(table: &SweepTable, columns: &[String]) -> String {
    let keys = table.keys.iter().map(|key| (key.as_str(), Align::Right));
    let results = columns.iter().map(|name| (name.as_str(), Align::Right));
    let mut text = Table::new(keys.chain(results).chain([("", Align::Left)]));
    for row in table.rows.iter().take(SHOWN) {
        let values = row
            .case
            .values
            .iter()
            .map(|v| v.clone().unwrap_or_default());
        let results = columns.iter().map(|name| {
            let value = table.number(row, name);
            value.map_or("-".to_owned(), |value| number(value, 5))
        });
        let remark = match (row.record.held, row.record.ended) {
            (true, _) => "",
            (false, true) => "ended with an error",
            (false, false) => "did not hold",
        };
        text.push(values.chain(results).chain([remark.to_owned()]));
    }
    match table.rows.len() > SHOWN {
        true => format!("{text}and {} more rows\n", table.rows.len() - SHOWN),
        false => format!("{text}"),
    }
}

/// Counts, and what is missing.
fn listed(found: &Summary<'_>) -> String {
    let mut text = format!("{}, {} held\n", counted(found.cases, "case"), found.held);
    for (what, all) in [("missing", found.missing), ("damaged", found.damaged)] {
        for [case, words] in all.iter().take(SHOWN) {
            text.push_str(&format!("{what}: {case}, {words}\n"));
        }
        if all.len() > SHOWN {
            text.push_str(&format!("and {} more {what}\n", all.len() - SHOWN));
        }
    }
    text
}
