//! `run --accuracy`: the setting is chosen, and the run is held to it.

use super::resume::command_line;
use super::{Outcome, RunArgs, print_err, run};
use crate::experiment::{Choice, Ended, RunError, TrialRow, choose, step_count};
use crate::report::{Progress, number};
use crate::scene::Scene;
use serde::Serialize;

/// The part of `summary.json` about `--accuracy`.
#[derive(Serialize)]
pub(super) struct Accurate<'a> {
    asked: f64,
    /// Expected error of the setting in its worst measure, from the trials.
    expected: f64,
    expected_measure: &'a str,
    /// Estimated error of the run: how far it is from the finest trial, and the expected error of that.
    error: f64,
    measure: &'a str,
    reason: String,
    /// Steps, events, sweeps, factorisations and pivots of the run, and of all that came before it.
    work: usize,
    choice_work: usize,
    tightened: &'a [String],
    trials: &'a [TrialRow],
}

impl<'a> Accurate<'a> {
    pub fn new(choice: &'a Choice, ended: &Ended) -> Accurate<'a> {
        Accurate {
            asked: choice.asked,
            expected: choice.expected,
            expected_measure: choice.measure,
            error: ended.error,
            measure: ended.measure,
            reason: choice.sentence(),
            work: ended.work,
            choice_work: choice.work,
            tightened: &choice.tightened,
            trials: &choice.trials,
        }
    }

    /// For the terminal.
    pub fn text(&self) -> String {
        let mut out = format!("{}\n", self.reason);
        for why in self.tightened {
            out.push_str(&format!("the run was started anew: {why}\n"));
        }
        let times = self.choice_work as f64 / self.work.max(1) as f64;
        out.push_str(&format!(
            "held: estimated error {}{}; work {} (steps, events, sweeps, factorisations, pivots), the trials took {} \
             times as much\n",
            number(self.error, 2),
            match self.measure {
                "" => String::new(),
                name => format!(" ({name})"),
            },
            self.work,
            number(times, 2),
        ));
        out
    }
}

/// Chooses a setting for `scene` and runs it; starts anew with a finer one while it is not held.
///
/// # Errors
/// Those of [`choose`] and of [`run::once`].
pub(super) fn run(args: &RunArgs, scene: &Scene, asked: f64) -> Result<Outcome, RunError> {
    let quiet = args.common.flags.quiet;
    // most choices end after three levels, of a quarter, half and all of the scene's steps
    let usual = 5 * step_count(&scene.step) as u64;
    let progress = Progress::new("trials", usual, quiet);
    let mut choice = choose(scene, asked, &progress)?;
    drop(progress);
    if !quiet && !args.words.is_empty() {
        print_err(&format!(
            "chosen by {} trials; {} makes the same run without them, and can be resumed\n",
            choice.trials.len(),
            without_trials(args, scene, &choice)
        ));
    }
    let mut runs = 0;
    choice.hold(scene, |scene, choice| {
        if runs > 0 && !quiet {
            let why = choice.tightened.last().map_or("", String::as_str);
            print_err(&format!("the run starts anew: {why}\n"));
        }
        runs += 1;
        run::once(args, scene, None, Some(choice))
    })
}

/// The command that makes the chosen run without its trials, as long as it is not made finer.
fn without_trials(args: &RunArgs, scene: &Scene, choice: &Choice) -> String {
    let mut words = Vec::new();
    let mut typed = args.words.iter();
    while let Some(word) = typed.next() {
        match word.as_str() {
            "--accuracy" => _ = typed.next(),
            word if word.starts_with("--accuracy=") => {}
            word => words.push(word.to_owned()),
        }
    }
    let step = &choice.step;
    let [dt, tolerance] = [step.dt, step.tolerance].map(|value| format!("{value:e}"));
    let chosen = [
        "--scheme",
        step.scheme.name(),
        "--dt",
        &dt,
        "--tolerance",
        &tolerance,
    ];
    words.extend(chosen.map(str::to_owned));
    match (step.events, scene.step.events) {
        (true, _) => words.push("--events".to_owned()),
        (false, true) => words.extend(["--set", "step.events=false"].map(str::to_owned)),
        (false, false) => {}
    }
    format!("`{}`", command_line(&words))
}
