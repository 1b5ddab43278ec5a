//! Throughput of scenes: time of a step and its parts, and quality of the step.

use super::bench::BenchArgs;
use super::{Outcome, effect, summary};
use crate::experiment::{Engine, REST_SOLVED, RunError, Throughput, Workload, growth};
use crate::report::{
    Align, OutputFolder, Progress, ResultRow, Table, number, quantity, throughput as chart_of,
};
use serde::Serialize;
use std::path::PathBuf;

/// Changes of the scene that make a size, as `--set` takes them.
type Size = &'static [&'static str];

/// Scenes measured by default: name, steps before the timed ones (in full and with `--quick`), and
/// sizes. `--quick` takes the first size of each. The drum needs more steps because its grains must
/// land first. Each pyramid is an island; the wall is one island of ten courses at every length.
const LADDERS: [(&str, [u32; 2], &[Size]); 5] = [
    ("tower", SETTLE, &[&["repeat.box.count=[1,100]"]]),
    ("drum", [1000, 300], &[&[]]),
    (
        "many-pyramids",
        SETTLE,
        &[
            &["repeat.floor.count=[2]", "repeat.box.count=[10,10,2,2]"],
            &["repeat.floor.count=[4]", "repeat.box.count=[10,10,4,4]"],
            &["repeat.floor.count=[8]", "repeat.box.count=[10,10,8,8]"],
            &["repeat.floor.count=[18]", "repeat.box.count=[10,10,19,18]"],
        ],
    ),
    (
        "wall",
        SETTLE,
        &[
            &[],
            &[
                "body.floor.box=[150,2]",
                "repeat.even.count=[64,5]",
                "repeat.odd.count=[63,5]",
            ],
            &[
                "body.floor.box=[700,2]",
                "repeat.even.count=[320,5]",
                "repeat.odd.count=[319,5]",
            ],
            &[
                "body.floor.box=[4000,2]",
                "repeat.even.count=[1700,5]",
                "repeat.odd.count=[1699,5]",
            ],
        ],
    ),
    ("large-pyramid", SETTLE, &[&[]]),
];

/// Steps before the timed ones, and timed steps; in full and with `--quick`.
const SETTLE: [u32; 2] = [60, 5];
const STEPS: [u32; 2] = [60, 10];

/// The file of the picture.
const PICTURE: &str = "throughput.svg";

pub(super) fn bench_scenes(args: &BenchArgs) -> Result<Outcome, RunError> {
    let flags = &args.flags;
    let works = workloads(args)?;
    let steps = STEPS[usize::from(args.quick)];
    let mut engines = vec![Engine::Moreau];
    if args.against.contains(&Engine::Moreau) {
        return Err(RunError::Unfit(
            "--against moreau: has no effect: moreau is always measured".to_owned(),
        ));
    }
    for &engine in &args.against {
        if !engines.contains(&engine) {
            engines.push(engine);
        }
    }
    let mut threads: Vec<usize> = Vec::new();
    for &count in &flags.threads {
        if !threads.contains(&(count as usize)) {
            threads.push(count as usize);
        }
    }
    if threads.is_empty() {
        threads.push(1);
    }
    let throughput = Throughput {
        engines,
        threads,
        tolerances: args.tolerances.clone(),
        steps: flags.steps.unwrap_or(steps) as usize,
    };
    let target = flags.out.clone();
    let folder =
        OutputFolder::create(target.unwrap_or_else(|| PathBuf::from("out").join("bench")))?;
    let count: usize = works.iter().map(|work| throughput.count(work)).sum();
    let progress = Progress::new("bench", count as u64, flags.quiet);
    let (mut measured, mut notes) = (Vec::new(), Vec::new());
    for work in &works {
        let (rows, more) = throughput.run(work, &progress)?;
        measured.extend(rows);
        notes.extend(more);
    }
    drop(progress);
    measured.extend(growth(&measured));
    let rows = summary::written(&folder, &measured)?;
    let mut pictures = Vec::new();
    if let Some(chart) = chart_of(&rows) {
        folder.write(PICTURE, chart.to_svg()?)?;
        pictures.push(PICTURE);
    }
    let more = Found {
        settings: Settings {
            steps: throughput.steps,
            threads: &throughput.threads,
            tolerances: &throughput.tolerances,
            settle: works.iter().map(|work| work.settle).collect(),
        },
        rows: rows.len(),
        pictures: &pictures,
        warnings: &notes,
    };
    summary::close(
        folder,
        summary::program("bench"),
        more,
        flags.say(),
        |target| {
            let (table, notes) = (table(&rows), summary::noted(&notes));
            let files: String = pictures.iter().map(|p| format!(", {p}")).collect();
            format!("{table}{notes}results.csv{files} in {}\n", target.display())
        },
    )?;
    Ok(Outcome::Done)
}

/// The part of `summary.json` that only a bench of scenes writes.
#[derive(Serialize)]
struct Found<'a> {
    settings: Settings<'a>,
    rows: usize,
    pictures: &'a [&'static str],
    warnings: &'a [String],
}

#[derive(Serialize)]
struct Settings<'a> {
    steps: usize,
    threads: &'a [usize],
    tolerances: &'a [f64],
    settle: Vec<usize>,
}

/// The scenes to measure; reads all input before anything runs.
fn workloads(args: &BenchArgs) -> Result<Vec<Workload>, RunError> {
    let one = |name: &str, settle: u32, size: &[&str]| -> Result<Workload, RunError> {
        let mut flags = args.flags.clone();
        // the size comes first, so that changes of the user override it
        flags.before = size.iter().map(|s| (*s).to_owned()).collect();
        let (scene, machine) = flags.load_on_one_thread(name)?;
        if machine.is_some() {
            return Err(RunError::Unfit(format!(
                "scene {}: a wear scene is stepped in load cycles; `run` reports their time",
                scene.name
            )));
        }
        flags.refuse_twice(&scene)?;
        effect::Run::new("bench", &scene, None, &flags).refuse(&flags, &flags.of_runs())?;
        let rung = [flags.before, flags.set].concat().join(" ");
        let settle = args.settle.unwrap_or(settle) as usize;
        Ok(Workload {
            scene,
            rung,
            settle,
        })
    };
    if !args.scenes.is_empty() {
        let named = args.scenes.iter();
        return named.map(|name| one(name, SETTLE[0], &[])).collect();
    }
    let mut works = Vec::new();
    for (name, settle, sizes) in LADDERS {
        let settle = settle[usize::from(args.quick)];
        let sizes = if args.quick { &sizes[..1] } else { sizes };
        for size in sizes {
            // the large pyramid has no small size
            if !(args.quick && name == "large-pyramid") {
                works.push(one(name, settle, size)?);
            }
        }
    }
    Ok(works)
}

/// One line for each scene, size and engine.
fn table(rows: &[ResultRow]) -> String {
    let mut table = Table::new([
        ("scene", Align::Left),
        ("engine", Align::Left),
        ("tolerance", Align::Right),
        ("rest", Align::Left),
        ("threads", Align::Right),
        ("contacts", Align::Right),
        ("step", Align::Right),
        ("ratio", Align::Right),
        ("detection", Align::Right),
        ("assembly", Align::Right),
        ("solve", Align::Right),
        ("record", Align::Right),
        ("write", Align::Right),
        ("sweeps/s", Align::Right),
        ("penetration", Align::Right),
        ("unsolved", Align::Right),
    ]);
    let steps = rows.iter().filter(|r| r.measure == "step-time");
    for step in steps {
        let of = |row: &ResultRow, measure: &str| {
            (&row.scene, &row.rung) == (&step.scene, &step.rung) && row.measure == measure
        };
        let own = |measure: &str| {
            let same = |r: &&ResultRow| {
                of(r, measure)
                    && (&r.engine, &r.setting, r.threads)
                        == (&step.engine, &step.setting, step.threads)
            };
            rows.iter().find(same).map(|r| r.value)
        };
        let cell = |measure: &str, unit: &str| {
            own(measure).map_or("-".to_owned(), |v| quantity(v, unit, 3))
        };
        let rapier = |r: &&ResultRow| of(r, "step-time") && r.engine == Engine::Rapier.name();
        let ratio = rows.iter().find(rapier).map(|r| step.value / r.value);
        let ours = step.engine == Engine::Moreau.name();
        let tolerance = step.setting.strip_prefix("tolerance ").filter(|_| ours);
        let tolerance = tolerance.and_then(|rest| rest.split(',').next());
        let rest = match (ours, step.setting.contains(REST_SOLVED)) {
            (false, _) => "-",
            (true, false) => "kept",
            (true, true) => "solved",
        };
        table.push([
            step.scene.clone(),
            step.engine.clone(),
            tolerance.unwrap_or("-").to_owned(),
            rest.to_owned(),
            step.threads.to_string(),
            own("contacts").map_or("-".to_owned(), |n| format!("{n:.0}")),
            quantity(step.value, "s", 3),
            ratio.map_or("-".to_owned(), |r| number(r, 3)),
            cell("detection-time", "s"),
            cell("assembly-time", "s"),
            cell("solve-time", "s"),
            cell("record-time", "s"),
            cell("write-time", "s"),
            own("contact-sweeps").map_or("-".to_owned(), |v| format!("{:.0} M", v / 1e6)),
            cell("penetration", "m"),
            own("unsolved-islands").map_or("-".to_owned(), |n| format!("{n:.0}")),
        ]);
    }
    let mut out = table.to_string();
    let growths = rows.iter().filter(|r| r.measure == "growth");
    for row in growths {
        out.push_str(&format!(
            "{} {}{}{}: time grows as contacts^{} from {}\n",
            row.scene,
            row.engine,
            match row.setting.split_once("tolerance") {
                Some((_, setting)) => format!(", tolerance{setting}"),
                None => String::new(),
            },
            match row.threads {
                1 => String::new(),
                n => format!(" on {n} threads"),
            },
            number(row.value, 3),
            row.rung
        ));
    }
    out
}
