//! Writes `summary.json` and prints its main figures to the terminal.

use super::print_out;
use crate::experiment::{Engine, Totals};
use crate::report::{
    OutputFolder, ReportError, ResultRow, number, quantity, write_rows, written_rows,
};
use crate::scene::{Material, Scene};
use serde::Serialize;
use serde_json::Value;
use std::path::Path;

/// What a command prints to the terminal.
#[derive(Clone, Copy)]
pub(super) enum Say {
    Tables,
    Summary,
    Nothing,
}

impl Say {
    /// `--json` overrides `--quiet`.
    pub fn of(json: bool, quiet: bool) -> Say {
        match (json, quiet) {
            (true, _) => Say::Summary,
            (false, true) => Say::Nothing,
            (false, false) => Say::Tables,
        }
    }
}

/// Writes `summary.json`, moves the folder to its final path, and prints the results. `tables` makes
/// the text from that path.
pub(super) fn close(
    folder: OutputFolder,
    head: impl Serialize,
    more: impl Serialize,
    say: Say,
    tables: impl FnOnce(&Path) -> String,
) -> Result<(), ReportError> {
    let text = write(&folder, head, more)?;
    finish(folder, &text, say, tables)
}

/// The end of [`close`], after `summary.json` with this text is written.
pub(super) fn finish(
    folder: OutputFolder,
    summary: &str,
    say: Say,
    tables: impl FnOnce(&Path) -> String,
) -> Result<(), ReportError> {
    let target = folder.commit()?;
    match say {
        Say::Summary => print_out(summary),
        Say::Tables => print_out(&tables(&target)),
        Say::Nothing => Ok(()),
    }
}

/// One line for each note.
pub(super) fn noted<N: AsRef<str>>(notes: &[N]) -> String {
    let lines = notes
        .iter()
        .map(|note| format!("note: {}\n", note.as_ref()));
    lines.collect()
}

/// Writes `results.csv` and reads it back: tables and charts show the content of the file.
pub(super) fn written(
    folder: &OutputFolder,
    rows: &[ResultRow],
) -> Result<Vec<ResultRow>, ReportError> {
    write_rows(folder, rows)?;
    written_rows(folder)
}

/// The head of every summary: program, version, command, and the scene if there is one.
#[derive(Serialize)]
pub(super) struct Head<'a> {
    program: &'static str,
    version: &'static str,
    command: &'a str,
    #[serde(flatten)]
    pub scene: Option<OfScene<'a>>,
}

#[derive(Serialize)]
pub(super) struct OfScene<'a> {
    scene: &'a str,
    title: &'a str,
    scene_hash: String,
    pub settings: Settings<'a>,
    pub warnings: Vec<String>,
}

/// One of the scenes of a command on several.
#[derive(Serialize)]
pub(super) struct OneOf {
    pub scene: String,
    /// Of a scene whose points do not differ in them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Rungs or points.
    pub points: usize,
    pub scene_hash: String,
}

impl OneOf {
    pub fn new(scene: &str, time_s: Option<f64>, points: usize, hash: u64) -> OneOf {
        OneOf {
            scene: scene.to_owned(),
            time_s,
            points,
            scene_hash: format!("{hash:016x}"),
        }
    }
}

/// Settings of the run; a setting that a peer does not have is null.
#[derive(Serialize)]
pub(super) struct Settings<'a> {
    dt_s: f64,
    time_s: f64,
    /// Of a scene with bodies of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    gravity_m_s2: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    materials: Option<String>,
    #[serde(flatten)]
    pub ours: Ours<'a>,
    #[serde(flatten)]
    pub run: Option<OfRun>,
}

/// Settings that only our engine has.
#[derive(Serialize, Default)]
pub(super) struct Ours<'a> {
    scheme: Option<&'a str>,
    events: Option<bool>,
    impact_law: Option<&'a str>,
    recovery: Option<bool>,
    keep_rest: Option<bool>,
    split_islands: Option<bool>,
    skip_distant: Option<bool>,
    skip_tangents: Option<bool>,
    shares: Option<&'a str>,
    effort: Option<&'a str>,
    solver: Option<&'a str>,
    tolerance: Option<f64>,
    threads: Option<usize>,
}

/// Settings that only `run` writes.
#[derive(Serialize)]
pub(super) struct OfRun {
    pub model: &'static str,
    pub engine: &'static str,
    pub every: usize,
    /// Solver settings of a peer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setting: Option<String>,
}

/// The head for a command without a scene or with several.
pub(super) fn program(command: &str) -> Head<'_> {
    Head {
        program: "moreau2d",
        version: env!("CARGO_PKG_VERSION"),
        command,
        scene: None,
    }
}

/// The head for a command on one scene.
pub(super) fn header<'a>(command: &'a str, scene: &'a Scene) -> Head<'a> {
    let (step, with_bodies) = (&scene.step, !scene.bodies.is_empty());
    let settings = Settings {
        dt_s: step.dt,
        time_s: step.time,
        gravity_m_s2: with_bodies.then_some(scene.gravity),
        materials: with_bodies.then(|| materials(scene)),
        ours: Ours {
            scheme: Some(step.scheme.name()),
            events: Some(step.events),
            impact_law: Some(step.impact_law.name()),
            recovery: Some(step.recovery),
            keep_rest: Some(step.keep_rest),
            split_islands: Some(step.split_islands),
            skip_distant: Some(step.skip_distant),
            skip_tangents: Some(step.skip_tangents),
            shares: Some(step.shares.name()),
            effort: Some(step.effort.name()),
            solver: Some(&step.solver),
            tolerance: Some(step.tolerance),
            threads: Some(step.threads),
        },
        run: None,
    };
    Head {
        scene: Some(OfScene {
            scene: &scene.name,
            title: &scene.title,
            scene_hash: format!("{:016x}", scene.hash),
            settings,
            warnings: scene.step_warnings(),
        }),
        ..program(command)
    }
}

/// Friction and restitution of each material.
fn materials(scene: &Scene) -> String {
    let of = |m: &Material| {
        let name = if m.name.is_empty() {
            "default"
        } else {
            &m.name
        };
        let bounce = match m.stiffness {
            Some(stiffness) => format!("stiffness {stiffness} N/m"),
            None => format!("restitution {}", m.restitution),
        };
        format!("{name}: friction {}, {bounce}", m.friction)
    };
    scene
        .materials
        .iter()
        .map(of)
        .collect::<Vec<_>>()
        .join("; ")
}

/// Converts `value` to JSON; NaN and infinities become null.
pub(super) fn json(value: impl Serialize) -> Value {
    serde_json::to_value(value).unwrap_or_default()
}

/// Merges both objects; `more` overwrites keys that both have.
fn merged(mut summary: Value, more: Value) -> Value {
    if let (Value::Object(summary), Value::Object(more)) = (&mut summary, more) {
        summary.extend(more);
    }
    summary
}

/// The totals as JSON; figures that a peer does not report are null.
pub(super) fn totals(t: &Totals) -> Value {
    const OF_OURS: [&str; 18] = [
        "resting_islands",
        "sweeps",
        "factorisations",
        "pivots",
        "unsolved_islands",
        "unsolved_steps",
        "failed_islands",
        "bounded_way_m",
        "redundant_steps",
        "capped_islands",
        "crowd_islands",
        "relaxed_islands",
        "joint_capped_islands",
        "cut_islands",
        "events",
        "still_recovering_pairs",
        "constraint_work_j",
        "constraint_gain_j",
    ];
    let mut totals = json(t);
    for key in OF_OURS.iter().filter(|_| !t.accounted) {
        totals[key] = Value::Null;
    }
    totals
}

/// Steps, solver work and quality as text for the terminal.
///
/// # Arguments
/// - `located`: whether `step.events` is on; else only impacts of swept bodies (CCD) are located, and rebounds
///   that would leave an overlap.
pub(super) fn describe(t: &Totals, engine: Engine, located: bool) -> String {
    let mut text = format!(
        "{} steps, {} simulated, {} contacts at most; {} per step\n",
        t.steps,
        quantity(t.time, "s", 4),
        t.most_contacts,
        quantity(t.wall / t.steps.max(1) as f64, "s", 3),
    );
    if engine != Engine::Moreau {
        text.push_str(&format!(
            "penetration {} m; {} reports no residuals, solver work or energy balance\n",
            number(t.penetration, 2),
            engine.peer().unwrap_or_default()
        ));
        return text;
    }
    text.push_str(&format!(
        "solver: {} sweeps, {} factorisations, {} pivots; worst residual {} (relative), {} m/s\n",
        t.sweeps,
        t.factorisations,
        t.pivots,
        number(t.residual, 2),
        number(t.residual_velocity, 2),
    ));
    text.push_str(&format!(
        "penetration {} m, {} m when impacts were detected; largest error of the energy balance {} J\n",
        number(t.penetration, 2),
        number(t.penetration_impact, 2),
        number(t.imbalance, 2),
    ));
    if t.events > 0 {
        let why = match located {
            true => "",
            false => {
                " without --events: those of fast bodies and of bodies with continuous collision detection (CCD), \
                 and those that would have left bodies overlapped"
            }
        };
        text.push_str(&format!("{} impacts located in time{why}\n", t.events));
    }
    text
}

/// Warnings about the results.
pub(super) fn warnings(t: &Totals) -> Vec<String> {
    let mut out = Vec::new();
    if t.unread > 0 {
        out.push(format!(
            "contacts of {} bodies, summed over all steps, could not be read: some contacts are missing",
            t.unread
        ));
    }
    if t.unsolved_islands > 0 {
        out.push(format!(
            "{} islands in {} steps were not solved to the tolerance, which holds for the residual and for its \
             velocity: {} bounded, {} failed; worst residual {}, {} m/s",
            t.unsolved_islands,
            t.unsolved_steps,
            t.unsolved_islands - t.failed_islands,
            t.failed_islands,
            number(t.residual, 2),
            number(t.residual_velocity, 2)
        ));
    }
    if t.redundant_steps > 0 {
        out.push(format!(
            "in {} steps more contacts carry load than there are coordinates: the impulses of \
             single contacts are not unique",
            t.redundant_steps
        ));
    }
    if t.capped > 0 {
        out.push(format!(
            "impulses were reduced {} times so that contacts add no energy",
            t.capped
        ));
    }
    if t.crowds > 0 {
        out.push(format!(
            "{} times an island of more than 500 contacts in motion was answered by sweeps (`--effort exact` \
             also tries the solver)",
            t.crowds
        ));
    }
    if t.relaxed > 0 {
        out.push(format!(
            "{} times the contacts of an island contradicted each other or no rigid impulses were found: \
             penetrations were not corrected",
            t.relaxed
        ));
    }
    if t.joints_capped > 0 {
        out.push(format!(
            "{} times joints closed only part of their gaps, because closing them would have added \
             energy: the step is long for how fast bodies turn; widest gap {} m",
            t.joints_capped,
            number(t.joint_gap, 2)
        ));
    }
    if t.cut > 0 {
        out.push(format!(
            "{} times an island was stepped in parts: links under tension turn too far in a step, or many bodies \
             hit each other that would have been left overlapped; a shorter step resolves the rest as well",
            t.cut
        ));
    }
    if t.recovering > 0 {
        out.push(format!(
            "{} pairs of bodies that overlapped at the start still overlap",
            t.recovering
        ));
    }
    // smaller gains are round-off of the energy bound
    if t.impact_gain > 1e-9 * t.kinetic_most {
        out.push(format!(
            "impacts added {} J of energy: impact_law = \"capped\" would not",
            number(t.impact_gain, 3)
        ));
    }
    out
}

/// Writes `summary.json` and returns its text: `head` and `more` merged, with the warnings of both.
pub(super) fn write(
    folder: &OutputFolder,
    head: impl Serialize,
    more: impl Serialize,
) -> Result<String, ReportError> {
    let (mut summary, mut more) = (json(head), json(more));
    if let (Some(Value::Array(known)), Some(Value::Array(new))) =
        (summary.get_mut("warnings"), more.get_mut("warnings"))
    {
        known.append(new);
        *new = std::mem::take(known);
    }
    let summary = merged(summary, more);
    let mut text = format!("{summary:#}");
    text.push('\n');
    folder.write("summary.json", &text)?;
    Ok(text)
}
