use super::atlas_table::{Broken, Share, explanations, shares, table};
use super::compared_lead::of_rungs;
use super::summary::{self, OneOf, Say};
use super::{Outcome, issues, print_out, run_page};
use crate::experiment::{Atlas, Engine, Preset, RunError};
use crate::report::{OutputFolder, Progress, matrix};
use crate::scene::{atlas_entries, issue_entries};
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

#[derive(Args)]
pub(super) struct AtlasArgs {
    /// Entries to run, by name or as paths of TOML files [default: all].
    #[arg(value_name = "ENTRY")]
    entries: Vec<String>,
    /// Run only the cheap rungs of each entry.
    #[arg(long)]
    quick: bool,
    /// Run the atlas of complaints: scenes after threads of public issue trackers, with each engine
    /// at its default and at its remedy.
    #[arg(long, conflicts_with = "quick")]
    issues: bool,
    /// Write report.html as well: what came out and whether it can be trusted, pictures and tables, in
    /// one file that a browser opens without network.
    #[arg(long)]
    report: bool,
    /// Folder for the results.
    #[arg(long, value_name = "DIR", default_value = "out/atlas")]
    out: PathBuf,
    /// Print no progress bar and no tables.
    #[arg(long)]
    quiet: bool,
    /// Print summary.json in place of tables.
    #[arg(long)]
    json: bool,
}

/// Lists every entry with its rungs.
pub(super) fn list() -> Result<Outcome, RunError> {
    let mut text = String::new();
    for entry in atlas_entries()? {
        text += &format!("atlas/{}: {}\n", entry.name, entry.block.shows);
        for rung in &entry.block.rungs {
            text += &format!("    :{}\n", rung.name);
        }
    }
    for entry in issue_entries()? {
        text += &format!("issues/{}: {}\n", entry.name, entry.block.shows);
    }
    print_out(&text)?;
    Ok(Outcome::Done)
}

/// The part of `summary.json` that only `atlas` writes.
#[derive(Serialize)]
struct Found<'a> {
    quick: bool,
    rows: usize,
    pictures: [&'static str; 1],
    engines: Vec<Counts>,
    not_passed: &'a [Broken<'a>],
    scenes: Vec<OneOf>,
    warnings: &'a [String],
}

/// Number of rungs of an engine by verdict.
#[derive(Serialize)]
struct Counts {
    engine: String,
    pass: usize,
    fail: usize,
    unsolved: usize,
    none: usize,
}

impl Counts {
    fn of(share: Share) -> Counts {
        let [pass, fail, unsolved, none] = share.counts;
        Counts {
            engine: share.engine,
            pass,
            fail,
            unsolved,
            none,
        }
    }
}

const PICTURE: &str = "atlas.svg";

/// Runs the atlas with every engine, writes the results and draws them.
pub(super) fn atlas(args: &AtlasArgs) -> Result<Outcome, RunError> {
    let read = crate::thresher::read_rung;
    let atlas = match args.issues {
        true => Atlas::issues(&args.entries, read)?,
        false => Atlas::new(&args.entries, args.quick, read)?,
    };
    let folder = OutputFolder::create(&args.out)?;
    let presets = match args.issues {
        true => Preset::with_remedies(),
        false => Engine::ALL.map(|(_, engine)| Preset::of(engine)).to_vec(),
    };
    let progress = Progress::new("atlas", (atlas.rungs() * presets.len()) as u64, args.quiet);
    let mut results = atlas.run_presets(&presets, &progress)?;
    drop(progress);
    if args.issues {
        results.rows = issues::beside_others(&atlas, results.rows)?;
    }
    let rows = summary::written(&folder, &results.rows)?;
    let (picture, drawing) = match args.issues {
        true => (issues::PICTURE, issues::picture(&atlas, &rows)?),
        false => (PICTURE, matrix(&rows)?),
    };
    folder.write(picture, drawing)?;
    let broken = explanations(&atlas, &rows);
    let more = Found {
        quick: args.quick,
        rows: rows.len(),
        pictures: [picture],
        engines: shares(&rows).into_iter().map(Counts::of).collect(),
        not_passed: &broken,
        scenes: (atlas.hashes().into_iter())
            .map(|(entry, rungs, hash)| OneOf::new(entry, None, rungs, hash))
            .collect(),
        warnings: &results.notes,
    };
    let say = Say::of(args.json, args.quiet);
    let text = summary::write(&folder, summary::program("atlas"), more)?;
    let table = match args.issues {
        true => issues::text(&atlas, &rows),
        false => table(&atlas, &rows),
    };
    if args.report {
        let title = match args.issues {
            true => "The atlas of complaints",
            false => "The failure atlas",
        };
        let lead = of_rungs(&shares(&rows), &broken, results.notes.len());
        run_page::write_compared(&folder, &text, title, lead, &table)?;
    }
    summary::finish(folder, &text, say, |target| {
        let notes = summary::noted(&results.notes);
        format!(
            "{table}{notes}results.csv, {picture} in {}\n",
            target.display()
        )
    })?;
    let ours = broken.is_empty();
    Ok(if ours { Outcome::Done } else { Outcome::Failed })
}
