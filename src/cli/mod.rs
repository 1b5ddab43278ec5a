//! The command-line program: it parses the arguments, calls the library and prints the results.

mod atlas;
mod atlas_table;
mod bench;
mod bench_problems;
mod bench_scenes;
mod bench_table;
mod calibrate;
mod calibrate_chart;
mod calibrate_data;
mod calibrate_text;
mod chart;
mod chart_accuracy;
mod chart_models;
mod chart_table;
mod compare;
mod compare_table;
mod compared_lead;
mod dump;
mod effect;
mod explain;
mod flags;
mod input_bands;
mod input_cases;
mod input_output;
mod issues;
mod merge;
mod merge_table;
mod resume;
mod run;
mod run_accurate;
mod run_files;
mod run_inputs;
mod run_lead;
mod run_machine;
mod run_page;
mod run_wear;
mod shard;
mod solve;
mod summary;
mod sweep;
mod sweep_case;

use crate::experiment::{ACCURACIES, Engine, RunError};
use crate::report::ReportError;
use crate::scene;
use clap::{Args, CommandFactory, Parser, Subcommand};
use flags::{Common, Flags};
use std::path::PathBuf;
use std::process::ExitCode;

// paragraphs are one line each: the help wraps them
const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  wrong input, or a file or standard output cannot be read or written; no
     half-written file is left
  2  run, sweep, solve and atlas: the results are written, but a scene did not
     hold with moreau, a stored problem is unsolved, or a rung of the atlas
     failed; compare, chart and bench list such points and exit with 0; merge:
     cases are missing";
const EXIT_RUN: &str = "Exit codes: 0 the scene held; 1 wrong input, or a file cannot be read or written; \
2 the results are written, but with moreau the scene did not hold: bodies overlap, joints stay open, a body \
passed through another, contacts gave energy, the energy balance is off, or islands failed or leave closing \
velocities of more than verdict.bounded; or a body of [[wear]] is worn through before life.duration. The last \
lines, `verdict` and `ended` in summary.json say which; the limits are the keys verdict.* of the scene. For a \
peer the verdict is told, and the exit code is 0.";
const EXIT_SOLVE: &str = "Exit codes: 0 solved; 1 wrong input, or a file cannot be read or written; 2 not \
solved to the tolerance.";
const EXIT_ATLAS: &str = "Exit codes: 0 moreau passes every rung; 1 wrong input, or a file cannot be read or \
written; 2 the results are written, but moreau fails a rung or leaves one unsolved. Some rungs are known to \
fail, with and without --quick: the lines below the table name the cause of each.";
const EXIT_MERGE: &str = "Exit codes: 0 done; cases that did not hold are listed; 1 wrong input, results of \
several versions, or a file cannot be read or written; 2 the table is written, but cases are missing or \
damaged: they are listed.";
const EXIT_CALIBRATE: &str = "Exit codes: 0 done; 1 wrong input, measurements that are none of this scene, \
or a file cannot be read or written.";
const EXIT_TABLES: &str = "Exit codes: 0 done; points that failed or are unsolved are listed; 1 wrong input, \
or a file cannot be read or written.";

/// Exact nonsmooth contact, and the wear that follows from it, for rapier2d worlds.
#[derive(Parser)]
#[command(name = "moreau2d", version, after_help = EXIT_CODES, max_term_width = 80)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// List the scenes that come with the program.
    Scenes {
        /// List the scenes of the failure atlas in place of the catalogue, which run as
        /// atlas/ENTRY:RUNG, and those of the atlas of complaints, which run as issues/NAME.
        #[arg(long)]
        atlas: bool,
        /// List the keys of scene files in place of the scenes, with their meaning and range.
        #[arg(long, conflicts_with = "atlas")]
        keys: bool,
    },
    /// Simulate a scene, and its wear if it has any.
    ///
    /// Writes bodies.csv, contacts.csv, impacts.csv, steps.csv, summary.json and scene.svg, the bodies at
    /// the end with the impulses of the last step; with --report also report.html. Wear and machines have
    /// further files.
    ///
    /// Until the end they grow in the folder moreau2d-checkpoint there. A run that was stopped, by whatever,
    /// goes on with --resume DIR.
    #[command(after_help = EXIT_RUN)]
    Run(RunArgs),
    /// Say what a scene models, what is left out, and which accuracy to expect, from a short trial.
    Explain(explain::ExplainArgs),
    /// Simulate one scene with moreau and with its peers, and compare accuracy and speed.
    #[command(after_help = EXIT_TABLES)]
    Compare(CompareArgs),
    /// Chart accuracy against speed over many scenes, and list which points are dominated.
    #[command(after_help = EXIT_TABLES)]
    Chart(chart::ChartArgs),
    /// Run the failure atlas: scenes of growing difficulty that show where each engine fails.
    #[command(after_help = EXIT_ATLAS)]
    Atlas(atlas::AtlasArgs),
    /// Measure time and quality of the steps of scenes, or of all impulse solvers on stored problems.
    #[command(after_help = EXIT_TABLES)]
    Bench(bench::BenchArgs),
    /// Run a scene over a grid, a list or a sample of its keys.
    ///
    /// PLAN.toml has `scene = "NAME or FILE"`, and lists of values in [grid], tables of values in
    /// [[case]], or distributions in [sample]; [set] changes keys in every case. Each case is a folder
    /// called by the hash of its scene and of the program's version. It appears whole; a case that is
    /// there is not run again, so that a sweep that was killed goes on where it was.
    #[command(after_help = sweep::help())]
    Sweep(sweep::SweepArgs),
    /// Make one table of the cases of a sweep, and draw it.
    ///
    /// Writes sweep.csv, a row for each case with its keys and its results, summary.json, and pictures:
    /// lines over one key, maps over two, a map for each value of the others over more, points over a
    /// sample.
    #[command(after_help = EXIT_MERGE)]
    Merge(merge::MergeArgs),
    /// Find the wear coefficient of a scene from weighed parts, depths or a traced profile, with an interval.
    ///
    /// Runs the scene once and fits K to what was measured: time enters Archard's law only as K t. Errors of
    /// measurements are taken as independent and normal. Says which parameters the data cannot tell from K.
    /// Writes calibration.csv, calibration.svg and summary.json.
    #[command(after_help = EXIT_CALIBRATE)]
    Calibrate(calibrate::CalibrateArgs),
    /// Solve a stored contact problem or linear complementarity problem (LCP).
    #[command(after_help = EXIT_SOLVE)]
    Solve(solve::SolveArgs),
    /// Print what completes commands and flags in a shell, to be put where it looks for such files.
    ///
    /// For bash: moreau2d completions bash > ~/.local/share/bash-completion/completions/moreau2d
    Completions { shell: clap_complete::Shell },
}

#[derive(Args)]
struct RunArgs {
    #[command(flatten)]
    common: Common,
    /// Engine that steps the scene: moreau, rapier, rapier-stiff, or box2d if it is built in.
    #[arg(long, value_name = "NAME", default_value = "moreau", value_parser = Engine::named)]
    engine: Engine,
    /// Choose step length, scheme, events and tolerance such that no measure of the scene is off by more
    /// than R of its size, 1e-6 to 0.1: the cheapest setting that trials over the whole run find. Measures
    /// are those that compare has: values of the closed form, relative to themselves, or else the
    /// trajectories, relative to the way of the bodies and their size. The trials cost 4 to 155
    /// times the run; the summary has the setting, with which a run without trials gives the same.
    #[arg(long, value_name = "R", allow_hyphen_values = true, value_parser = accuracy)]
    accuracy: Option<f64>,
    /// Write every N-th step to bodies.csv, contacts.csv and steps.csv, and the last step of a scene of
    /// bodies [default: 1, or more if bodies.csv would exceed 100 000 rows]. impacts.csv always has
    /// every impact, and the counts, work and residuals in steps.csv are those of all steps since the
    /// row before.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    every: Option<u32>,
    /// Write report.html as well: what came out and whether it can be trusted, a replay with contacts
    /// and impulses, charts and settings, in one file that a browser opens without network.
    #[arg(long)]
    report: bool,
    /// Write scene-moving.svg as well: the motion with its impulses, in a picture that plays in a browser
    /// and on a page, without a script. It has at most 480 kB, and as many frames as fit.
    #[arg(long)]
    animate: bool,
    /// Write each contact problem of the run to this folder, as a JSON file.
    #[arg(long, value_name = "DIR")]
    dump_problems: Option<PathBuf>,
    /// Write the contact problems of every N-th step only.
    #[arg(long, value_name = "N", requires = "dump_problems",
          value_parser = clap::value_parser!(u32).range(1..))]
    dump_every: Option<u32>,
    /// Go on with a run that was stopped, whose results were to be in DIR: with all that was typed
    /// then, from its last checkpoint. The results are those of a run that was not stopped.
    #[arg(long, value_name = "DIR", exclusive = true)]
    resume: Option<PathBuf>,
    /// Write a checkpoint every N-th step [default: once a second, or as rarely as it takes for less
    /// than 2 % of the time]. A machine writes one before each jump. Peers, the study and runs with
    /// --dump-problems or --accuracy write none.
    #[arg(long, value_name = "N", conflicts_with = "dump_problems",
          value_parser = clap::value_parser!(u32).range(1..))]
    checkpoint_every: Option<u32>,
    /// Write summary.json alone.
    #[arg(skip)]
    summary_only: bool,
    /// What was typed, without the program; empty for a case of a sweep, which is not resumed.
    #[arg(skip)]
    words: Vec<String>,
}

#[derive(Args)]
struct CompareArgs {
    #[command(flatten)]
    common: Common,
    /// Number of runs of each point; the runs are interleaved and times are their medians.
    #[arg(long, value_name = "N", default_value_t = 3,
          value_parser = clap::value_parser!(u32).range(1..=100))]
    repeats: u32,
    /// Run six step lengths in place of three, and draw error and energy against step length. The
    /// lengths are 1/30 to 1/1000 s, or 2 to 1/16 times the scene's step if that is not 1/60 s.
    #[arg(long)]
    ladder: bool,
    /// Run the peers with their presets only (rapier: default and stiff, Box2D: default), without
    /// the sweep of their settings: for scenes that take long.
    #[arg(long)]
    no_sweep: bool,
    /// Write report.html as well: what came out and whether it can be trusted, pictures and tables, in
    /// one file that a browser opens without network.
    #[arg(long)]
    report: bool,
}

/// Runs the program.
///
/// # Returns
/// 0 done; 1 wrong input or an I/O error, no half-written file is left; 2 done, but something is
/// unsolved.
pub fn main() -> ExitCode {
    let mut cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // clap reports help and version as errors for standard output
            let code = u8::from(error.use_stderr());
            if let Some(why) = resume::conflict(&error) {
                return failed(&RunError::Unfit(why));
            }
            return match unless_closed(error.print()) {
                Ok(()) => ExitCode::from(code),
                Err(error) => failed(&error),
            };
        }
    };
    let result = match &mut cli.command {
        Command::Scenes { keys: true, .. } => print_out(&scene::keys::listing())
            .map(|()| Outcome::Done)
            .map_err(RunError::from),
        Command::Scenes { atlas: true, .. } => atlas::list(),
        Command::Scenes { .. } => list_scenes(),
        Command::Run(args) => resume::command(args),
        Command::Explain(args) => explain::explain(args),
        Command::Compare(args) => compare::compare(args),
        Command::Chart(args) => chart::chart(args),
        Command::Atlas(args) => atlas::atlas(args),
        Command::Bench(args) => bench::bench(args),
        Command::Sweep(args) => sweep::sweep(args),
        Command::Merge(args) => merge::merge(args),
        Command::Calibrate(args) => calibrate::calibrate(args),
        Command::Solve(args) => solve::solve(args),
        Command::Completions { shell } => completions(*shell),
    };
    match result {
        Ok(outcome) => ExitCode::from(match outcome {
            Outcome::Done => 0,
            Outcome::Failed => 2,
        }),
        Err(error) => failed(&error),
    }
}

fn failed(error: &dyn std::error::Error) -> ExitCode {
    print_err(&format!("error: {error}\n"));
    ExitCode::from(1)
}

/// Writes the completions of a shell to standard output.
fn completions(shell: clap_complete::Shell) -> Result<Outcome, RunError> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "moreau2d", &mut script);
    print_out(&String::from_utf8_lossy(&script))?;
    Ok(Outcome::Done)
}

/// How a command ended.
enum Outcome {
    Done,
    /// The scene did not hold, or something is unsolved.
    Failed,
}

/// `--tolerance` of the commands without a scene.
fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(value) if (1e-15..=1e-2).contains(&value) => Ok(value),
        _ => Err("must be 1e-15 to 1e-2".to_owned()),
    }
}

/// `--accuracy`.
fn accuracy(text: &str) -> Result<f64, String> {
    let [least, most] = ACCURACIES;
    match text.parse() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        _ => Err(format!("must be {least:e} to {most}")),
    }
}

fn list_scenes() -> Result<Outcome, RunError> {
    let scenes = scene::scenes()?;
    let width = scenes.iter().map(|s| s.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for s in &scenes {
        text.push_str(&format!("{:width$}  {}\n", s.name, s.title));
    }
    print_out(&text)?;
    Ok(Outcome::Done)
}

/// Prints to standard error; ignores a closed pipe.
fn print_err(text: &str) {
    use std::io::Write;
    let _ = std::io::stderr().write_all(text.as_bytes());
}

/// Prints to standard output; ignores a closed pipe (`| head`).
///
/// # Errors
/// `ReportError::Io` if what was printed has no place, as on a full disk.
fn print_out(text: &str) -> Result<(), ReportError> {
    use std::io::Write;
    let mut out = std::io::stdout();
    // a buffer that is emptied at the end of the program would tell nobody
    let printed = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    unless_closed(printed)
}

/// An error of printing, unless the reader has closed the pipe.
fn unless_closed(printed: std::io::Result<()>) -> Result<(), ReportError> {
    match printed {
        Err(source) if source.kind() != std::io::ErrorKind::BrokenPipe => Err(ReportError::Io {
            path: PathBuf::from("<stdout>"),
            source,
        }),
        _ => Ok(()),
    }
}
