//! The folder of a case of a sweep: it appears whole, and says itself whether it is still whole.

use super::{Common, Flags, Outcome, RunArgs, run};
use crate::experiment::{Engine, RunError};
use crate::report::ReportError;
use crate::scene::{Scene, fnv1a};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Name of the file that says what a folder holds.
pub(super) const RECORD: &str = "case.json";
/// What the folders begin with in which `plan.json` is written.
pub(super) const STAGING: &str = ".plan-";
pub(super) const SUMMARY: &str = "summary.json";
pub(super) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// `case.json`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    program: String,
    pub version: String,
    /// Name of the folder.
    pub case: String,
    pub scene: String,
    /// As `run --set` takes them.
    pub changes: Vec<String>,
    /// Whether the scene held; `false` also where the run ended with an error.
    pub held: bool,
    /// Why it did not.
    pub why: Option<String>,
    /// Whether the run ended with an error, so that there is no summary.
    pub ended: bool,
    /// Whether all files of a run are kept.
    pub all_files: bool,
    files: BTreeMap<String, Mark>,
}

/// Size and FNV-1a of a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Mark {
    bytes: usize,
    fnv1a: String,
}

impl Mark {
    fn of(content: &[u8]) -> Mark {
        Mark {
            bytes: content.len(),
            fnv1a: format!("{:016x}", fnv1a(content)),
        }
    }
}

/// What is found where the folder of a case should be.
pub(super) enum Found {
    Nothing,
    Whole(Box<Record>),
    /// Why it is not whole.
    Damaged(String),
}

/// The name of the folder of a case: a hash of the resolved scene, of its uncertain inputs and of the
/// program's version.
pub(super) fn name(scene: &Scene) -> String {
    let mut content = format!("{VERSION} {:016x}", scene.hash);
    let variants = scene.uncertain.iter().flat_map(|input| &input.others);
    variants.for_each(|variant| content.push_str(&format!(" {}", variant.flag)));
    format!("{:016x}", fnv1a(content.as_bytes()))
}

/// Looks at the folder of the case `name`.
///
/// # Errors
/// [`RunError::Report`] where a file is there and cannot be read.
pub(super) fn look(out: &Path, name: &str) -> Result<Found, RunError> {
    let folder = out.join(name);
    if !folder.exists() {
        return Ok(Found::Nothing);
    }
    let damaged = |why: String| Ok(Found::Damaged(why));
    let Some(text) = read(&folder.join(RECORD))? else {
        return damaged(format!("{RECORD} is missing"));
    };
    let record: Record = match serde_json::from_slice(&text) {
        Ok(record) => record,
        Err(error) => return damaged(format!("{RECORD} cannot be read: {error}")),
    };
    if record.case != name {
        return damaged(format!("{RECORD} is that of case {}", record.case));
    }
    if record.ended == record.files.contains_key(SUMMARY) {
        return damaged(format!("{RECORD} contradicts itself"));
    }
    for (file, mark) in &record.files {
        let Some(content) = read(&folder.join(file))? else {
            return damaged(format!("{file} is missing"));
        };
        let is = Mark::of(&content);
        if is != *mark {
            return damaged(match is.bytes == mark.bytes {
                true => format!("{file} was changed"),
                false => format!("{file} has {} bytes of {}", is.bytes, mark.bytes),
            });
        }
    }
    Ok(Found::Whole(Box::new(record)))
}

/// The content of a file; `None` where there is none.
fn read(path: &Path) -> Result<Option<Vec<u8>>, RunError> {
    match fs::read(path) {
        Ok(content) => Ok(Some(content)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(io_error(path, source)),
    }
}

pub(super) fn io_error(path: &Path, source: io::Error) -> RunError {
    let path = path.to_path_buf();
    RunError::Report(ReportError::Io { path, source })
}

/// The arguments of the run of a case.
pub(super) fn arguments(scene: &str, changes: Vec<String>, all_files: bool) -> RunArgs {
    RunArgs {
        common: Common {
            scene: Some(scene.to_owned()),
            flags: Flags {
                set: changes,
                quiet: true,
                ..Flags::default()
            },
        },
        engine: Engine::Moreau,
        accuracy: None,
        every: None,
        report: false,
        animate: false,
        dump_problems: None,
        dump_every: None,
        resume: None,
        checkpoint_every: None,
        summary_only: !all_files,
        words: Vec::new(),
    }
}

/// Runs a case and puts its folder in place, in one rename.
///
/// # Arguments
/// - `out`: folder of the sweep, which exists.
/// - `scene`: its name in the record.
///
/// # Errors
/// Those of files. What a run ends with otherwise is a result of the case.
pub(super) fn run_case(
    out: &Path,
    name: &str,
    scene: &str,
    args: RunArgs,
) -> Result<Record, RunError> {
    match attempt(out, name, scene, args) {
        Ok(record) => Ok(record),
        // another process ran the same case, was faster, and swept up
        Err(error) => match look(out, name)? {
            Found::Whole(record) => Ok(*record),
            _ => Err(error),
        },
    }
}

fn attempt(out: &Path, name: &str, scene: &str, mut args: RunArgs) -> Result<Record, RunError> {
    let work = tempfile::Builder::new()
        .prefix(&format!(".{name}-"))
        .tempdir_in(out)
        .map_err(|error| io_error(out, error))?;
    let folder = work.path().join("case");
    args.common.flags.out = Some(folder.clone());
    let (held, why, ended) = match run::run(&args, None) {
        Ok(Outcome::Done) => (true, None, false),
        Ok(Outcome::Failed) => (false, Some(reason(&folder)?), false),
        Err(error) if of_files(&error) => return Err(error),
        Err(error) => {
            fs::create_dir_all(&folder).map_err(|error| io_error(&folder, error))?;
            (false, Some(error.to_string()), true)
        }
    };
    let record = Record {
        program: "moreau2d".to_owned(),
        version: VERSION.to_owned(),
        case: name.to_owned(),
        scene: scene.to_owned(),
        changes: args.common.flags.set,
        held,
        why,
        ended,
        all_files: !args.summary_only,
        files: marks(&folder)?,
    };
    let mut text = format!("{:#}", serde_json::json!(record));
    text.push('\n');
    let path = folder.join(RECORD);
    fs::write(&path, text).map_err(|error| io_error(&path, error))?;
    let place = out.join(name);
    if record.all_files
        && let Found::Whole(old) = look(out, name)?
        && !old.all_files
    {
        fs::remove_dir_all(&place).map_err(|error| io_error(&place, error))?;
    }
    fs::rename(&folder, &place).map_err(|error| io_error(&place, error))?;
    Ok(record)
}

/// Whether an error is one of files, and not of the scene.
fn of_files(error: &RunError) -> bool {
    match error {
        RunError::Report(error) => !matches!(
            error,
            ReportError::EmptyChart { .. } | ReportError::Chart { .. }
        ),
        RunError::Problem { .. } => true,
        _ => false,
    }
}

/// What the summary of a run says of why its scene did not hold.
fn reason(folder: &Path) -> Result<String, RunError> {
    let summary = summary(folder)?;
    let verdict = &summary["verdict"];
    let of_verdict = verdict["sentence"]
        .as_str()
        .filter(|_| verdict["held"] == false);
    let last = summary["warnings"].as_array().and_then(|all| all.last());
    let why = of_verdict.or(summary["ended"].as_str());
    let why = why.or(last.and_then(Value::as_str));
    Ok(why.unwrap_or("did not hold").to_owned())
}

/// `summary.json` of a folder.
///
/// # Errors
/// [`RunError::Report`] where it cannot be read; [`RunError::Unfit`] where it is no JSON.
pub(super) fn summary(folder: &Path) -> Result<Value, RunError> {
    let path = folder.join(SUMMARY);
    let text = fs::read(&path).map_err(|error| io_error(&path, error))?;
    serde_json::from_slice(&text)
        .map_err(|error| RunError::Unfit(format!("{}: {error}", path.display())))
}

fn marks(folder: &Path) -> Result<BTreeMap<String, Mark>, RunError> {
    let mut marks = BTreeMap::new();
    for entry in fs::read_dir(folder).map_err(|error| io_error(folder, error))? {
        let path: PathBuf = entry.map_err(|error| io_error(folder, error))?.path();
        let content = fs::read(&path).map_err(|error| io_error(&path, error))?;
        let name = path.file_name().unwrap_or_default();
        marks.insert(name.to_string_lossy().into_owned(), Mark::of(&content));
    }
    Ok(marks)
}

/// Removes what killed runs of the case `name`, which is whole, have left behind.
pub(super) fn sweep_up(left: &[(String, PathBuf)], name: &str) {
    for (_, path) in left.iter().filter(|(of, _)| of == name) {
        // where another process runs the same case, it sweeps up itself
        let _ = fs::remove_dir_all(path);
    }
}

/// What killed runs have left in `out`: name of the case, and path. What they left of `plan.json`, which is
/// there, is removed.
pub(super) fn leftovers(out: &Path) -> Result<Vec<(String, PathBuf)>, RunError> {
    let mut found = Vec::new();
    for entry in fs::read_dir(out).map_err(|error| io_error(out, error))? {
        let path = entry.map_err(|error| io_error(out, error))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if name.starts_with(STAGING) {
            // another part, if it is its, is about to write the same
            let _ = fs::remove_dir_all(&path);
        }
        let case = name.strip_prefix('.').and_then(|rest| rest.split_once('-'));
        if let Some((case, _)) = case.filter(|(case, _)| case.len() == 16) {
            found.push((case.to_owned(), path.clone()));
        }
    }
    Ok(found)
}
