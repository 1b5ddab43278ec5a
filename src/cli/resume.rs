//! `run --resume`: the folder of a run that was stopped, and what was typed then.

use super::{Cli, Command, Outcome, RunArgs, print_err, run};
use crate::checkpoint::Reader;
use crate::experiment::{Engine, RunError};
use crate::report::{Checkpoint, KEPT, OutputFolder, Reopened, ReportError, RunRecord};
use crate::scene::Scene;
use crate::thresher::Machine;
use clap::Parser;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use serde_json::Value;
use std::path::Path;

/// A run that was stopped: its folder and what it was.
pub(super) type Stopped = (OutputFolder, RunRecord);

/// `run`, from its start or from where it was stopped.
pub(super) fn command(args: &mut RunArgs) -> Result<Outcome, RunError> {
    if let Some(target) = &args.resume {
        return resume(target);
    }
    args.words = typed();
    run::run(args, None)
}

/// What was typed, without the program.
pub(super) fn typed() -> Vec<String> {
    let words = std::env::args_os().skip(1);
    words.map(|w| w.to_string_lossy().into_owned()).collect()
}

/// What was typed beside `--resume`, which goes on with what was typed when the run was started.
pub(super) fn conflict(error: &clap::Error) -> Option<String> {
    let of_resume = match error.get(ContextKind::InvalidArg) {
        Some(ContextValue::String(arg)) => arg.starts_with("--resume"),
        _ => false,
    };
    if error.kind() != ErrorKind::ArgumentConflict || !of_resume {
        return None;
    }
    let mut words = typed().into_iter().skip(1).peekable();
    let mut others = Vec::new();
    while let Some(word) = words.next() {
        match word.as_str() {
            "--resume" => drop(words.next()),
            word if word.starts_with("--resume=") => {}
            word => others.push(word.to_owned()),
        }
    }
    Some(format!(
        "--resume cannot be used with `{}`: it goes on with all that was typed when the run was started, and \
         with a report if one was asked for then",
        command_line(&others).trim_start_matches("moreau2d ")
    ))
}

fn resume(target: &Path) -> Result<Outcome, RunError> {
    let (folder, record) = match OutputFolder::reopen(target)? {
        Reopened::Finished => {
            let place = target.display();
            print_err(&format!(
                "{place}: the run is finished, nothing is left to do\n"
            ));
            return Ok(outcome(target));
        }
        Reopened::Stopped(folder, record) => (*folder, record),
    };
    let of_this = env!("CARGO_PKG_VERSION");
    if record.version != of_this {
        return Err(RunError::Unfit(format!(
            "--resume {}: the run was started by version {}, this is {of_this}: run it again",
            target.display(),
            record.version
        )));
    }
    let typed = std::iter::once("moreau2d").chain(record.arguments.iter().map(String::as_str));
    let parsed = Cli::try_parse_from(typed).map(|cli| cli.command);
    let Ok(Command::Run(mut args)) = parsed else {
        return Err(ReportError::Damaged {
            path: target.to_path_buf(),
            reason: format!("`{}` is no run", command_line(&record.arguments)),
        }
        .into());
    };
    args.words = record.arguments.clone();
    args.common.flags.out = Some(target.to_path_buf());
    if !args.common.flags.quiet {
        print_err(&format!("resumes `{}`\n", command_line(&args.words)));
    }
    run::run(&args, Some((folder, record)))
}

/// The folder for the results of a run: one that can be resumed where that is possible.
///
/// # Errors
/// [`RunError::Unfit`] if the scene is not that of the run that was stopped; [`RunError::Report`].
pub(super) fn folder(
    args: &RunArgs,
    scene: &Scene,
    machine: Option<&Machine>,
    stopped: Option<Stopped>,
) -> Result<OutputFolder, RunError> {
    let scene_hash = format!("{:016x}", scene.hash);
    if let Some((folder, record)) = stopped {
        if record.scene_hash != scene_hash {
            return Err(RunError::Unfit(format!(
                "--resume {}: scene {} is not the one that was stopped: its hash is {scene_hash}, it was {}",
                folder.target().display(),
                scene.name,
                record.scene_hash
            )));
        }
        return Ok(folder);
    }
    let target = args.common.folder(scene);
    let study = matches!(machine, Some(Machine::Study(_)));
    // a run that is held to an accuracy may start anew
    let resumes = args.engine == Engine::Moreau
        && args.dump_problems.is_none()
        && args.accuracy.is_none()
        && !study;
    if args.words.is_empty() || !resumes {
        return Ok(OutputFolder::create(target)?);
    }
    let record = RunRecord {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scene_hash,
        arguments: args.words.clone(),
    };
    spare(&target)?;
    Ok(OutputFolder::keep(target, record)?)
}

/// How a finished run ended, by its summary.
fn outcome(target: &Path) -> Outcome {
    let text = std::fs::read(target.join("summary.json")).unwrap_or_default();
    let summary: Value = serde_json::from_slice(&text).unwrap_or_default();
    let held = match &summary["verdict"]["held"] {
        Value::Bool(held) => *held && summary["ended"].is_null(),
        // of a machine
        _ => summary["totals"]["unsolved_islands"] == 0 && summary["wrong"].is_null(),
    };
    let peer = summary["settings"]["engine"]
        .as_str()
        .is_some_and(|engine| engine != "moreau");
    match held || peer {
        true => Outcome::Done,
        false => Outcome::Failed,
    }
}

/// Refuses a folder in which a run waits to be resumed; complete results that wait there are moved first.
///
/// # Errors
/// [`RunError::Unfit`]; [`RunError::Report`] for a damaged checkpoint.
fn spare(target: &Path) -> Result<(), RunError> {
    if !target.join(KEPT).is_dir() {
        return Ok(());
    }
    match OutputFolder::reopen(target) {
        Ok(Reopened::Stopped(folder, record)) if folder.is_saved() => {
            let (place, command) = (target.display(), command_line(&record.arguments));
            Err(RunError::Unfit(format!(
                "--out {place}: `{command}` was stopped here, and `run --resume {place}` goes on with it; to give \
                 it up, remove {place}/{KEPT}"
            )))
        }
        // at work: this run cannot be resumed; or stopped before its first checkpoint
        Ok(_) | Err(ReportError::Running { .. } | ReportError::NothingKept { .. }) => Ok(()),
        Err(error) => Err(error.into()),
    }
}

/// The checkpoint of a run that can be resumed, and what it holds if it was stopped.
pub(super) fn checkpoint(
    args: &RunArgs,
    folder: &OutputFolder,
) -> Result<(Option<Checkpoint>, Option<Reader>), RunError> {
    let every = args.checkpoint_every.map(|n| n as usize);
    let checkpoint = folder.checkpoint("run", every);
    let saved = checkpoint.as_ref().map(Checkpoint::load).transpose()?;
    Ok((checkpoint, saved.flatten()))
}

/// The command as it was typed, without the place of the program.
pub(super) fn command_line(words: &[String]) -> String {
    let quoted = |word: &String| {
        let plain = |c: char| c.is_alphanumeric() || "-_=./:,+@%".contains(c);
        match !word.is_empty() && word.chars().all(plain) {
            true => word.clone(),
            false => format!("'{}'", word.replace('\'', "'\\''")),
        }
    };
    let words = words.iter().map(quoted);
    let all = std::iter::once("moreau2d".to_owned()).chain(words);
    all.collect::<Vec<_>>().join(" ")
}
