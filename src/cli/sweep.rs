//! `sweep`: a scene over many values of its keys.

use super::shard::{Shard, Typed};
use super::sweep_case::{self, Found, Record, STAGING, VERSION};
use super::{Outcome, print_err, print_out, run};
use crate::experiment::RunError;
use crate::report::{OutputFolder, Progress, counted};
use crate::scene::SceneError;
use crate::scene::plan::{self, Case, Plan};
use clap::Args;
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Most cases that the terminal lists.
const LISTED: usize = 20;

#[derive(Args)]
pub(super) struct SweepArgs {
    /// The plan: a TOML file.
    #[arg(value_name = "PLAN.toml")]
    plan: PathBuf,
    /// Cases that run at a time; results do not depend on the number [default: as many as there are
    /// cores, in a job array 1].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1024))]
    jobs: Option<u32>,
    /// Run part K of N, from 1. In an array of N jobs /N: the part is SLURM_ARRAY_TASK_ID, from 1, or
    /// HQ_TASK_ID, from 0. Without, SLURM_ARRAY_TASK_ID and SLURM_ARRAY_TASK_COUNT say which part, from any
    /// first number [default: the whole sweep].
    #[arg(long, value_name = "K/N", value_parser = Typed::read)]
    shard: Option<Typed>,
    /// Folder for the cases; several parts may share it [default: out/sweep-PLAN].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Keep all files of the run of each case, not summary.json alone.
    #[arg(long)]
    files: bool,
    /// Print no progress bar and no results.
    #[arg(long)]
    quiet: bool,
}

/// The end of the help: the distributions of a plan, and the exit codes.
pub(super) fn help() -> String {
    let distributions = plan::distributions();
    let lines = distributions.lines().map(|line| format!("  {line}\n"));
    format!(
        "Distributions of [sample.keys], as \"KEY\" = {{ distribution = \"NAME\", ... }}, with their \
         numbers:\n{}\n{EXIT_CODES}",
        lines.collect::<String>()
    )
}

const EXIT_CODES: &str = "\
Exit codes: 0 every case of this shard is done and its scene held; 1 wrong input, or a file cannot be
read or written: cases that are done stay; 2 all are done, but in some the scene did not hold or could
not be computed to the end: they are listed with the reason.";

/// Name of the file that says what a sweep is of.
pub(super) const PLAN: &str = "plan.json";

/// `plan.json`: the same for every part of a sweep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Planned {
    program: String,
    pub version: String,
    pub scene: String,
    pub title: String,
    pub keys: Vec<String>,
    pub cases: Vec<PlannedCase>,
}

#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(super) struct PlannedCase {
    /// Name of its folder.
    pub case: String,
    /// What each of the keys is set to; null where it is left to the scene.
    pub values: Vec<Option<String>>,
}

impl PlannedCase {
    /// The values as text.
    pub fn words(&self, keys: &[String]) -> String {
        let pair = |(key, value): (&String, &Option<String>)| {
            let value = value.as_ref()?;
            Some(format!("{key} = {value}"))
        };
        let pairs: Vec<String> = keys.iter().zip(&self.values).filter_map(pair).collect();
        pairs.join(", ")
    }
}

/// Runs a sweep, or a part of it.
pub(super) fn sweep(args: &SweepArgs) -> Result<Outcome, RunError> {
    let text =
        fs::read_to_string(&args.plan).map_err(|error| sweep_case::io_error(&args.plan, error))?;
    let plan = Plan::parse(&args.plan.display().to_string(), &text)?;
    let (shard, in_array) = Shard::of(args.shard, |name| env::var(name).ok())?;
    let jobs = match (args.jobs, in_array) {
        (Some(jobs), _) => jobs as usize,
        (None, true) => 1,
        (None, false) => std::thread::available_parallelism().map_or(1, usize::from),
    };
    let out = args.out.clone().unwrap_or_else(|| {
        let name = args.plan.file_stem().unwrap_or_default().to_string_lossy();
        PathBuf::from("out").join(format!("sweep-{name}"))
    });
    OutputFolder::check(&out)?;
    let planned = check(args, &plan, jobs)?;
    write_plan(&out, &planned)?;
    let mine = part(&planned, shard);
    let mut records: Vec<Option<Record>> = Vec::new();
    let left = sweep_case::leftovers(&out)?;
    for &number in &mine {
        records.push(done(args, &out, &planned.cases[number], &left)?);
    }
    let before = records.iter().flatten().count();
    let to_do: Vec<usize> = (0..mine.len()).filter(|k| records[*k].is_none()).collect();
    let progress = Progress::new(&planned.scene, mine.len() as u64, args.quiet);
    progress.set(before as u64);
    let scene = plan.scene_beside(&args.plan);
    let found = in_parallel(jobs, to_do.len(), |k| {
        let number = mine[to_do[k]];
        let flags = flags(&plan.case(number)?);
        let case = sweep_case::arguments(&scene, flags, args.files);
        let name = &planned.cases[number].case;
        let record = sweep_case::run_case(&out, name, &planned.scene, case)?;
        sweep_case::sweep_up(&left, name);
        progress.advance();
        Ok(record)
    })?;
    drop(progress);
    for (k, record) in to_do.into_iter().zip(found) {
        records[k] = Some(record);
    }
    let records: Vec<Record> = records.into_iter().flatten().collect();
    if !args.quiet {
        let cases: Vec<&PlannedCase> = mine.iter().map(|k| &planned.cases[*k]).collect();
        print_out(&describe(&planned, &cases, shard, before, &records))?;
        print_out(&format!(
            "cases in {}; `moreau2d merge` makes one table of them\n",
            out.display()
        ))?;
    }
    Ok(match records.iter().all(|record| record.held) {
        true => Outcome::Done,
        false => Outcome::Failed,
    })
}

fn flags(case: &Case) -> Vec<String> {
    case.changes.iter().map(|c| c.flag.clone()).collect()
}

/// Loads the scene of every case, and names the folders.
///
/// # Errors
/// Those of the first case that cannot be run, at the place in the plan that causes them.
fn check(args: &SweepArgs, plan: &Plan, jobs: usize) -> Result<Planned, RunError> {
    let scene = plan.scene_beside(&args.plan);
    let load = |number: usize| {
        let case = plan.case(number)?;
        let run = sweep_case::arguments(&scene, flags(&case), args.files);
        let (scene, machine) = run::checked(&run).map_err(|error| placed(error, plan, &case))?;
        let mut warnings = scene.step_warnings();
        warnings.extend(machine.iter().flat_map(|m| m.step_warnings(scene.step.dt)));
        let name = sweep_case::name(&scene);
        let values = case.values;
        let planned = PlannedCase { case: name, values };
        Ok((scene.name, scene.title, planned, warnings))
    };
    // what is wrong with one case is mostly wrong with all
    let (scene, title, ..) = load(0)?;
    let loaded = in_parallel(jobs, plan.len(), load)?;
    if !args.quiet {
        warn(loaded.iter().map(|(.., warnings)| &warnings[..]));
    }
    Ok(Planned {
        program: "moreau2d".to_owned(),
        version: VERSION.to_owned(),
        scene,
        title,
        keys: plan.keys.clone(),
        cases: loaded.into_iter().map(|(_, _, case, _)| case).collect(),
    })
}

/// Prints one warning of each kind, and how many cases have one. Warnings of a kind differ in numbers only.
fn warn<'a>(cases: impl Iterator<Item = &'a [String]>) {
    let number = |word: &str| word.contains(|c: char| c.is_ascii_digit());
    let kind = |text: &'a str| -> Vec<&str> {
        let words = text.split_whitespace();
        words.filter(|word| !number(word)).collect()
    };
    // kind, its first warning, number of cases, and the last of them
    let mut found: Vec<(Vec<&str>, &str, usize, usize)> = Vec::new();
    for (case, texts) in cases.enumerate() {
        for text in texts {
            let own = kind(text);
            match found.iter_mut().find(|(known, ..)| *known == own) {
                Some((.., count, last)) => {
                    *count += usize::from(*last != case);
                    *last = case;
                }
                None => found.push((own, text, 1, case)),
            }
        }
    }
    for (_, text, count, _) in found {
        print_err(&match count {
            1 => format!("warning: in one case: {text}\n"),
            _ => format!("warning: in {count} cases, as in the first: {text}\n"),
        });
    }
}

/// The error of a case, at the place in the plan that causes it.
fn placed(error: RunError, plan: &Plan, case: &Case) -> RunError {
    let error = match error {
        RunError::Scene(error @ SceneError::UnknownScene { .. }) => {
            let beside = plan.beside(Path::new(&plan.file));
            RunError::Unfit(format!(
                "{}: {error}; and there is no file {}",
                plan.scene_place,
                beside.display()
            ))
        }
        RunError::Scene(error @ (SceneError::NoFile { .. } | SceneError::Read { .. })) => {
            RunError::Unfit(format!("{}: {error}", plan.scene_place))
        }
        RunError::Scene(error) => {
            let changes = case.changes.iter();
            RunError::Scene(changes.fold(error, |error, c| error.placed(&c.flag, &c.place)))
        }
        RunError::Unfit(text) => {
            let found = case.changes.iter().find_map(|change| {
                let rest = text.strip_prefix(&format!("--set {}", change.flag))?;
                let (_, value) = change.flag.split_once('=')?;
                Some(format!("{} = {value}{rest}", change.place))
            });
            RunError::Unfit(found.unwrap_or(text))
        }
        other => other,
    };
    let text = error.to_string();
    match text.starts_with(&plan.file) {
        true => error,
        false => {
            let flags = flags(case).join(", ");
            RunError::Unfit(format!("{text}; in {} with {flags}", plan.file))
        }
    }
}

/// Writes `plan.json` unless it is there.
fn write_plan(out: &Path, planned: &Planned) -> Result<(), RunError> {
    let mut text = format!("{:#}", serde_json::json!(planned));
    text.push('\n');
    let there = || -> Option<Planned> {
        let text = fs::read(out.join(PLAN)).ok()?;
        serde_json::from_slice(&text).ok()
    };
    match there() {
        Some(same) if same == *planned => return Ok(()),
        Some(other) => print_err(&format!(
            "note: {} has cases of another plan (scene {}, version {}); they stay where they are\n",
            out.display(),
            other.scene,
            other.version
        )),
        None => {}
    }
    // replaced in one rename: other parts may read it at any time
    let write = || -> io::Result<()> {
        fs::create_dir_all(out)?;
        let staging = tempfile::Builder::new().prefix(STAGING).tempdir_in(out)?;
        let file = staging.path().join(PLAN);
        fs::write(&file, text)?;
        fs::rename(file, out.join(PLAN))
    };
    match write() {
        // another part wrote it at the same time, and swept up
        Err(_) if there().as_ref() == Some(planned) => Ok(()),
        result => result.map_err(|error| sweep_case::io_error(out, error)),
    }
}

/// The cases of a part: numbers in the plan. Of cases that are the same scene the first counts.
fn part(planned: &Planned, shard: Shard) -> Vec<usize> {
    let mut seen = HashSet::new();
    let all = planned.cases.iter().enumerate();
    let first: Vec<usize> = all
        .filter(|(_, case)| seen.insert(&case.case))
        .map(|(number, _)| number)
        .collect();
    let own = first.into_iter().enumerate();
    own.filter(|(k, _)| shard.has(*k)).map(|(_, n)| n).collect()
}

/// The record of a case that is done. A damaged folder is named and removed.
fn done(
    args: &SweepArgs,
    out: &Path,
    case: &PlannedCase,
    left: &[(String, PathBuf)],
) -> Result<Option<Record>, RunError> {
    let place = out.join(&case.case);
    let remove = || fs::remove_dir_all(&place).map_err(|e| sweep_case::io_error(&place, e));
    match sweep_case::look(out, &case.case)? {
        Found::Nothing => Ok(None),
        Found::Whole(record) if record.version != VERSION => {
            let (place, version) = (place.display(), &record.version);
            print_err(&format!(
                "note: {place} is of version {version}; it is run again\n"
            ));
            remove()?;
            Ok(None)
        }
        Found::Whole(record) if record.all_files || !args.files || record.ended => {
            sweep_case::sweep_up(left, &case.case);
            Ok(Some(*record))
        }
        // stays until the run with all files takes its place
        Found::Whole(_) => Ok(None),
        Found::Damaged(why) => {
            let place = place.display();
            print_err(&format!(
                "note: {place} is damaged: {why}; it is run again\n"
            ));
            remove()?;
            Ok(None)
        }
    }
}

/// The results of `work` for 0 to `count`, in order, by `jobs` threads. After an error no further number
/// is begun; the error with the lowest number is returned.
pub(super) fn in_parallel<T: Send>(
    jobs: usize,
    count: usize,
    work: impl Fn(usize) -> Result<T, RunError> + Sync,
) -> Result<Vec<T>, RunError> {
    let next = AtomicUsize::new(0);
    let found = Mutex::new(Vec::new());
    let one = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= count {
                return;
            }
            let result = work(number);
            if result.is_err() {
                next.store(count, Ordering::Relaxed);
            }
            // no thread panics while it holds the lock
            if let Ok(mut found) = found.lock() {
                found.push((number, result));
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..jobs.min(count) {
            scope.spawn(one);
        }
        one();
    });
    let mut found = found.into_inner().unwrap_or_default();
    found.sort_by_key(|(number, _)| *number);
    found.into_iter().map(|(_, result)| result).collect()
}

/// What was run, and which cases did not hold.
fn describe(
    planned: &Planned,
    cases: &[&PlannedCase],
    shard: Shard,
    before: usize,
    records: &[Record],
) -> String {
    let once: HashSet<&String> = planned.cases.iter().map(|case| &case.case).collect();
    let same = match planned.cases.len() - once.len() {
        0 => String::new(),
        n => format!(", {n} the same as one before and not run again"),
    };
    let mut text = format!(
        "{}: {}\n{} over {}{same}\n",
        planned.scene,
        planned.title,
        counted(planned.cases.len(), "case"),
        planned.keys.join(", ")
    );
    if shard.count > 1 {
        text.push_str(&format!(
            "part {} of {}: {}\n",
            shard.number,
            shard.count,
            counted(cases.len(), "case")
        ));
    }
    if before > 0 {
        text.push_str(&format!("{before} were done before\n"));
    }
    let ended = records.iter().filter(|r| r.ended).count();
    let failed = records.iter().filter(|r| !r.held).count();
    text.push_str(&format!(
        "{} held, {} did not hold, {ended} ended with an error\n",
        records.len() - failed,
        failed - ended
    ));
    let bad = cases.iter().zip(records).filter(|(_, r)| !r.held);
    for (case, record) in bad.clone().take(LISTED) {
        let why = record.why.as_deref().unwrap_or_default();
        let words = case.words(&planned.keys);
        text.push_str(&format!("  {}, {words}: {why}\n", case.case));
    }
    if failed > LISTED {
        text.push_str(&format!("  and {} more\n", failed - LISTED));
    }
    text
}
