use super::bench_problems::{OF_CATALOGUE, OF_SOURCES, collection, of_catalogue};
use super::bench_scenes::bench_scenes;
use super::bench_table::{CLASSES, class_name, tables};
use super::{Flags, Outcome, effect, summary, tolerance};
use crate::experiment::{Engine, RunError, bench_solvers};
use crate::oracles::SOLVERS;
use crate::report::{OutputFolder, Performance, Progress, Score, write_rows};
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub(super) struct BenchArgs {
    /// Scenes of the catalogue, or paths of TOML files, to measure [default: tower, drum,
    /// large-pyramid, and many-pyramids and wall in several sizes].
    #[arg(value_name = "SCENE")]
    pub scenes: Vec<String>,
    #[command(flatten)]
    pub flags: Flags,
    /// Peers that step every scene as well: rapier, rapier-stiff, or box2d if it is built in,
    /// separated by commas.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', default_value = "rapier",
          value_parser = Engine::named, conflicts_with = "solvers")]
    pub against: Vec<Engine>,
    /// Number of steps before the timed steps [default: 60, for the drum 1000; with --quick 5, for
    /// the drum 300].
    #[arg(long, value_name = "N", conflicts_with = "solvers")]
    pub settle: Option<u32>,
    /// Tolerances of moreau's solver, separated by commas, each measured [default: that of the scene].
    #[arg(long, value_name = "R", value_delimiter = ',', value_parser = tolerance,
          conflicts_with_all = ["solvers", "tolerance"])]
    pub tolerances: Vec<f64>,
    /// Run only the smallest size of each scene, with 10 timed steps.
    #[arg(long, conflicts_with_all = ["solvers", "scenes"])]
    pub quick: bool,
    /// Run every impulse solver on every problem of a folder, and draw the performance profile.
    #[arg(long)]
    solvers: bool,
    /// Folder of contact problems (.json or .dat), as `run --dump-problems` writes them [default:
    /// tests/data/problems in the current folder, which the sources have; without it, problems of the
    /// catalogue's scenes].
    #[arg(long, value_name = "DIR", requires = "solvers")]
    problems: Option<PathBuf>,
    /// Number of timings of each solver on each problem; they are interleaved and times are their
    /// medians.
    #[arg(long, value_name = "N", default_value_t = 3, requires = "solvers",
          value_parser = clap::value_parser!(u32).range(1..=100))]
    repeats: u32,
}

const PICTURE: &str = "performance-profile.svg";

/// Measures the scenes, or with `--solvers` all solvers; writes and draws the results.
pub(super) fn bench(args: &BenchArgs) -> Result<Outcome, RunError> {
    if !args.solvers {
        return bench_scenes(args);
    }
    let flags = &args.flags;
    refuse_idle(flags)?;
    let typed = flags.tolerance.as_deref().unwrap_or("1e-8");
    let tolerance =
        tolerance(typed).map_err(|why| RunError::Unfit(format!("--tolerance {typed}: {why}")))?;
    if let Some(scene) = args.scenes.first() {
        return Err(RunError::Unfit(format!(
            "bench --solvers: takes no scene ({scene}) but a folder of problem files: --problems \
             DIR; `run {scene} --dump-problems DIR` writes such a folder"
        )));
    }
    let target = flags.out.clone();
    let target = target.unwrap_or_else(|| PathBuf::from("out").join("bench-solvers"));
    let (source, (problems, notes)) = match &args.problems {
        Some(folder) => (folder.display().to_string(), collection(folder)?),
        None if Path::new(OF_SOURCES).is_dir() => {
            (OF_SOURCES.to_owned(), collection(Path::new(OF_SOURCES))?)
        }
        None => (OF_CATALOGUE.to_owned(), of_catalogue()?),
    };
    let folder = OutputFolder::create(target)?;
    let repeats = args.repeats as usize;
    let timings = problems.len() * SOLVERS.len() * repeats;
    let progress = Progress::new("bench", timings as u64, flags.quiet);
    let measured = bench_solvers(&problems, tolerance, repeats, &progress);
    drop(progress);
    let rows = summary::written(&folder, &measured)?;
    let performance = Performance::new(&rows);
    write_rows(&folder, &performance.profile())?;
    folder.write(PICTURE, performance.chart().to_svg()?)?;
    let by_blocks = CLASSES.iter().map(|class| Scores {
        blocks: Some(class_name(class)),
        ..Scores::of(&performance.sized(class.0, class.1))
    });
    let more = Found {
        settings: Settings {
            problems: source,
            tolerance,
            repeats,
        },
        rows: rows.len(),
        pictures: [PICTURE],
        warnings: &notes,
        all: Scores::of(&performance),
        by_blocks: by_blocks.collect(),
    };
    summary::close(
        folder,
        summary::program("bench"),
        more,
        flags.say(),
        |target| {
            format!(
                "{}{}results.csv, performance-profile.csv, {PICTURE} in {}\n",
                tables(&performance),
                summary::noted(&notes),
                target.display()
            )
        },
    )?;
    Ok(Outcome::Done)
}

/// Refuses flags that have no effect on stored problems.
fn refuse_idle(flags: &Flags) -> Result<(), RunError> {
    let run = effect::Run::of_problems("bench --solvers", effect::Subject::Problems);
    let keys = flags.of_keys().into_iter();
    let set = flags
        .set
        .iter()
        .map(|set| (set.clone(), format!("--set {set}")));
    let of_steps = |(change, words): (String, String)| {
        let tolerance = change.starts_with("step.tolerance=") && words.starts_with("--tolerance");
        (!tolerance).then_some((words, String::new()))
    };
    let typed: Vec<(String, String)> = keys.chain(set).filter_map(of_steps).collect();
    let typed = typed
        .iter()
        .map(|(words, value)| (words.as_str(), value.clone()));
    run.refuse(flags, &typed.chain(flags.of_runs()).collect::<Vec<_>>())
}

/// The part of `summary.json` that only `bench --solvers` writes.
#[derive(Serialize)]
struct Found<'a> {
    settings: Settings,
    rows: usize,
    pictures: [&'static str; 1],
    warnings: &'a [String],
    all: Scores,
    by_blocks: Vec<Scores>,
}

#[derive(Serialize)]
struct Settings {
    problems: String,
    tolerance: f64,
    repeats: usize,
}

/// Scores of every solver on some of the problems.
#[derive(Serialize)]
struct Scores {
    #[serde(skip_serializing_if = "Option::is_none")]
    blocks: Option<String>,
    problems: usize,
    unsolved: usize,
    solvers: Vec<Score>,
}

impl Scores {
    fn of(performance: &Performance) -> Scores {
        Scores {
            blocks: None,
            problems: performance.problems(),
            unsolved: performance.unsolved(),
            solvers: performance.scores(),
        }
    }
}
