//! `--report`: one page of the results, from their files and their summary.

use super::RunArgs;
use crate::report::{
    Lead, OutputFolder, Page, Replay, ReportError, Section, Stage, StepRow, Watch, run_charts,
    written_rows,
};
use crate::scene::LASTING;
use serde_json::Value;
use std::fs;

/// The file of the page.
const FILE: &str = "report.html";
/// The pictures of the motion, which the replay shows.
const SCENE: [&str; 2] = ["scene.svg", "scene-moving.svg"];
/// Most characters of the replay of a machine, whose page holds the pictures of its life as well: 2 MB in all.
const OF_MACHINE: usize = 1_000_000;
/// What is to be known of the replay of a machine.
const MACHINE: [&str; 4] = [
    "It shows the first measured revolution, with new teeth at the operating torque: written steps, not the \
     whole life. The pictures below show what the hours do to the teeth.",
    "The cylinder turns counter-clockwise, as the arrow at its axle says. wear.csv numbers the cells of a tooth \
     from 1 at its tall end, which trails, to the toe, which leads; all bars are equal.",
    "Crop is soft. Where a segment lies within steel it is pressed in by that depth: the contact law of the crop \
     turns the depth into a pressure, and this is no failure of the solver.",
    "A segment that has left the machine is removed, and its number passes to one that enters.",
];
/// The same for one with grains.
const GRAINS: [&str; 3] = [
    "It shows the first measured revolution with grains and new teeth: written steps.",
    "The cylinder turns counter-clockwise, as the arrow at its axle says. The cells of a tooth are numbered from 1 \
     at its tall end, which trails, to the toe, which leads.",
    "A grain that has left the machine is removed, and its number passes to one that enters. grains.csv has the \
     radius of each.",
];
/// Keys of the summary that the page shows elsewhere.
const SHOWN: [&str; 10] = [
    "program",
    "version",
    "command",
    "scene",
    "title",
    "scene_hash",
    "settings",
    "warnings",
    "verdict",
    "measures",
];

/// Writes `report.html` if it was asked for.
///
/// # Arguments
/// - `summary`: the text of `summary.json`.
/// - `stage`: bodies for the replay; `None` where nothing moves that the files show.
/// - `text`: what the terminal shows of the results, without times of the computer.
pub(super) fn write(
    args: &RunArgs,
    folder: &OutputFolder,
    summary: &str,
    lead: Lead,
    stage: Option<&Stage>,
    text: Option<&str>,
) -> Result<(), ReportError> {
    if !args.report {
        return Ok(());
    }
    let summary: Value = serde_json::from_str(summary).unwrap_or_default();
    let mut sections = Vec::new();
    let mut replay = None;
    if let Some(stage) = stage {
        let watch = watch(&summary, stage);
        replay = Some((
            stage,
            match stage.bodies.iter().any(|b| b.kind == "driven") {
                true => Replay::within(folder, stage, watch, OF_MACHINE)?,
                false => Replay::read(folder, stage, watch)?,
            },
        ));
        let rows: Vec<StepRow> = written_rows(folder)?;
        if stage.bodies.iter().any(|b| b.kind == "driven") {
            let grains = summary.get("grains").is_some();
            let words = if grains { &GRAINS[..] } else { &MACHINE[..] };
            let items = words.iter().map(|word| (*word).to_owned()).collect();
            let title = "How to read the replay".to_owned();
            sections.push(Section::List { title, items });
        }
        sections.push(Section::Charts {
            title: "Over time".to_owned(),
            charts: run_charts(&rows, summary["settings"]["tolerance"].as_f64()),
        });
    }
    sections.extend(notes(&summary));
    sections.extend(checks(&summary));
    sections.extend(measures(&summary));
    sections.extend(text.map(|text| Section::Text {
        title: "Results".to_owned(),
        text: text.to_owned(),
    }));
    sections.extend(pictures(folder)?);
    sections.push(settings(&summary, &args.words));
    sections.extend(totals(&summary));
    sections.push(Section::List {
        title: "Files beside this page".to_owned(),
        items: names(folder)?,
    });
    let word = |key: &str| summary[key].as_str().unwrap_or_default().to_owned();
    let page = Page {
        title: &format!("{}: {}", word("scene"), word("title")),
        lead,
        replay,
        sections,
    };
    folder.write(FILE, page.to_html()?)
}

/// Writes `report.html` of a command that compares: its pictures, its tables, and what was typed.
///
/// # Arguments
/// - `summary`: the text of `summary.json`.
/// - `text`: the tables that the terminal shows.
pub(super) fn write_compared(
    folder: &OutputFolder,
    summary: &str,
    title: &str,
    lead: Lead,
    text: &str,
) -> Result<(), ReportError> {
    let summary: Value = serde_json::from_str(summary).unwrap_or_default();
    let mut sections: Vec<Section> = pictures(folder)?.into_iter().collect();
    sections.push(Section::Text {
        title: "Results".to_owned(),
        text: text.trim_end().to_owned(),
    });
    sections.extend(notes(&summary));
    sections.push(settings(&summary, &super::resume::typed()));
    sections.extend(scenes(&summary));
    sections.extend(totals(&summary));
    sections.push(Section::List {
        title: "Files beside this page".to_owned(),
        items: names(folder)?,
    });
    let page = Page {
        title,
        lead,
        replay: None,
        sections,
    };
    folder.write(FILE, page.to_html()?)
}

/// Limits for the time bar, from those of the verdict.
fn watch(summary: &Value, stage: &Stage) -> Watch {
    let found = |name: &str| {
        let checks = summary["verdict"]["checks"].as_array();
        checks?.iter().find(|check| check["name"] == name)
    };
    let check = |name: &str, key: &str| found(name)?[key].as_f64();
    let held = |name: &str| found(name).is_none_or(|check| check["held"] == true);
    // steps do not tell pairs: where none overlaps for long, a series of them may
    let overlap = (check("overlap", "limit").filter(|_| !held("overlap")))
        .map(|share| share * stage.smallest());
    // the check's value is the worst error over the energy of the scene
    let worst = summary["totals"]["worst_imbalance_j"].as_f64();
    let share = check("imbalance", "value").filter(|share| *share > 0.0);
    let energy = worst.zip(share).map(|(worst, share)| worst / share);
    let imbalance = check("imbalance", "limit").zip(energy);
    let deepest = check("deepest", "time_s").filter(|_| !held("deepest"));
    let passages = summary["verdict"]["passed_through"].as_array();
    let passages = passages.into_iter().flatten();
    let passages = passages.filter_map(|passage| passage["time_s"].as_f64());
    Watch {
        moments: deepest.into_iter().chain(passages).collect(),
        bounded: held("bounded"),
        overlap: overlap.unwrap_or(f64::INFINITY),
        lasting: LASTING,
        imbalance: imbalance.map_or(f64::INFINITY, |(limit, energy)| limit * energy),
    }
}

fn notes(summary: &Value) -> Option<Section> {
    let notes = summary["warnings"].as_array().filter(|n| !n.is_empty())?;
    Some(Section::List {
        title: "Notes".to_owned(),
        items: notes.iter().map(plain).collect(),
    })
}

fn checks(summary: &Value) -> Option<Section> {
    let checks = summary["verdict"]["checks"].as_array()?;
    let row = |check: &Value| {
        let held = if check["held"] == true { "yes" } else { "no" };
        let meaning = match check["name"].as_str().unwrap_or_default() {
            "overlap" => "worst lasting overlap over the size of the smaller body",
            "deepest" => "deepest overlap at the end of a step over the width of the thinner body",
            "joint_gap" => "widest lasting joint gap over the size of the smaller body",
            "passed_through" => "bodies that passed through another",
            "energy" => "energy that contacts and joints gave, over that of the scene",
            "imbalance" => "worst error of the energy balance of a step, over the scene's energy",
            "failed" => "contact problems that leave a tenth of the velocities at stake",
            "bounded" => {
                "overlap a second that the other uncertified problems may add, over the smallest size"
            }
            _ => "",
        };
        vec![
            plain(&check["name"]),
            meaning.to_owned(),
            figure(&check["value"]),
            figure(&check["limit"]),
            held.to_owned(),
        ]
    };
    Some(Section::Table {
        title: "Checks".to_owned(),
        header: words(&["check", "what it measures", "value", "limit", "held"]),
        rows: checks.iter().map(row).collect(),
    })
}

fn measures(summary: &Value) -> Option<Section> {
    let measures = summary["measures"].as_array().filter(|m| !m.is_empty())?;
    let row = |m: &Value| {
        let mut row = vec![plain(&m["name"])];
        row.extend(["computed", "exact", "error"].map(|key| figure(&m[key])));
        row.push(plain(&m["unit"]));
        row
    };
    Some(Section::Table {
        title: "Compared with the closed form".to_owned(),
        header: words(&["measure", "computed", "exact", "error", "unit of the error"]),
        rows: measures.iter().map(row).collect(),
    })
}

fn settings(summary: &Value, typed: &[String]) -> Section {
    let mut rows = vec![
        vec!["command".to_owned(), super::resume::command_line(typed)],
        vec![
            "program".to_owned(),
            format!(
                "{} {}",
                plain(&summary["program"]),
                plain(&summary["version"])
            ),
        ],
    ];
    // of a command that has one
    for (name, key) in [("scene", "scene"), ("hash of the scene", "scene_hash")] {
        if summary[key].is_string() {
            rows.push(vec![name.to_owned(), plain(&summary[key])]);
        }
    }
    let chosen = &summary["accuracy"];
    if chosen["reason"].is_string() {
        rows.push(vec![
            "why these settings".to_owned(),
            plain(&chosen["reason"]),
        ]);
        let error = chosen["error"].as_f64().map(|error| format!("{error:.1e}"));
        rows.push(vec![
            "error of the run, estimated".to_owned(),
            format!(
                "{} ({})",
                error.unwrap_or("—".to_owned()),
                plain(&chosen["measure"])
            ),
        ]);
    }
    let keys = summary["settings"].as_object().into_iter().flatten();
    rows.extend(keys.map(|(key, value)| vec![key.clone(), figure(value)]));
    Section::Table {
        title: "Settings".to_owned(),
        header: words(&["setting", "value"]),
        rows,
    }
}

/// The scenes of a command on several, with their hashes.
fn scenes(summary: &Value) -> Option<Section> {
    let scenes = summary["scenes"].as_array().filter(|s| !s.is_empty())?;
    let row = |scene: &Value| {
        let text = ["scene", "scene_hash"].map(|key| plain(&scene[key]));
        let figures = ["time_s", "points"].map(|key| figure(&scene[key]));
        [&text[..], &figures[..]].concat()
    };
    Some(Section::Table {
        title: "Scenes".to_owned(),
        header: words(&["scene", "hash", "time [s]", "points or rungs"]),
        rows: scenes.iter().map(row).collect(),
    })
}

/// Totals, and all other plain figures of the summary.
fn totals(summary: &Value) -> Option<Section> {
    let top = summary.as_object()?.iter();
    let of_top = top.filter(|(key, value)| {
        !SHOWN.contains(&key.as_str())
            && !value.is_object()
            && !value.is_array()
            && !value.is_null()
    });
    let totals = summary["totals"].as_object().into_iter().flatten();
    let rows: Vec<Vec<String>> = (of_top.chain(totals))
        .map(|(key, value)| vec![key.clone(), figure(value)])
        .collect();
    (!rows.is_empty()).then(|| Section::Table {
        title: "Totals".to_owned(),
        header: words(&["figure", "value"]),
        rows,
    })
}

/// The pictures in the folder but those of the motion.
fn pictures(folder: &OutputFolder) -> Result<Option<Section>, ReportError> {
    let mut pictures = Vec::new();
    for name in names(folder)? {
        if name.ends_with(".svg") && !SCENE.contains(&name.as_str()) {
            let svg = fs::read_to_string(folder.path(&name));
            let svg = svg.map_err(|source| ReportError::Io {
                path: folder.place(&name),
                source,
            })?;
            pictures.push((name, svg));
        }
    }
    Ok((!pictures.is_empty()).then(|| Section::Pictures {
        title: "Pictures".to_owned(),
        pictures,
    }))
}

/// Names of the files that the run wrote, sorted.
fn names(folder: &OutputFolder) -> Result<Vec<String>, ReportError> {
    let error = |source| ReportError::Io {
        path: folder.target().to_owned(),
        source,
    };
    // of a run that was stopped between this page and its end, the page is there already
    let mut names = Vec::new();
    for entry in fs::read_dir(folder.path("")).map_err(error)? {
        names.push(
            entry
                .map_err(error)?
                .file_name()
                .to_string_lossy()
                .into_owned(),
        );
    }
    names.retain(|name| name != FILE);
    names.sort();
    Ok(names)
}

fn words(header: &[&str]) -> Vec<String> {
    header.iter().map(|word| (*word).to_owned()).collect()
}

/// A text without quotes, anything else as JSON.
fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "—".to_owned(),
        other => other.to_string(),
    }
}

/// A number to six digits.
fn figure(value: &Value) -> String {
    match value.as_f64().filter(|_| value.is_f64()) {
        Some(x) => match format!("{x:.5e}").parse::<f64>() {
            Ok(six) => plain(&six.into()),
            Err(_) => plain(value),
        },
        None => plain(value),
    }
}
