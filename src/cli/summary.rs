//! `summary.json`, and the lines of it that go to the terminal.

use super::print_out;
use crate::experiment::{Engine, Totals};
use crate::report::{
    OutputFolder, ReportError, ResultRow, number, quantity, write_rows, written_rows,
};
use crate::scene::Scene;
use serde_json::{Value, json};
use std::path::Path;

/// A float as JSON has it: NaN and the infinities as null.
pub(super) fn float(x: f64) -> Value {
    serde_json::Number::from_f64(x).map_or(Value::Null, Value::Number)
}

/// What goes to the terminal.
#[derive(Clone, Copy)]
pub(super) enum Say {
    Tables,
    Summary,
    Nothing,
}

impl Say {
    /// `--json` before `--quiet`.
    pub fn of(json: bool, quiet: bool) -> Say {
        match (json, quiet) {
            (true, _) => Say::Summary,
            (false, true) => Say::Nothing,
            (false, false) => Say::Tables,
        }
    }
}

/// Writes `summary.json`, puts the folder in its place, and tells what was found: `tables` is given
/// that place.
pub(super) fn close(
    folder: OutputFolder,
    head: Value,
    more: Value,
    say: Say,
    tables: impl FnOnce(&Path) -> String,
) -> Result<(), ReportError> {
    let text = write(&folder, head, more)?;
    let target = folder.commit()?;
    match say {
        Say::Summary => print_out(&text),
        Say::Tables => print_out(&tables(&target)),
        Say::Nothing => {}
    }
    Ok(())
}

/// Lines that say what else there is to know.
pub(super) fn noted<N: AsRef<str>>(notes: &[N]) -> String {
    let lines = notes
        .iter()
        .map(|note| format!("note: {}\n", note.as_ref()));
    lines.collect()
}

/// Writes `results.csv` and reads it back: what is shown and drawn comes from the file.
pub(super) fn written(
    folder: &OutputFolder,
    rows: &[ResultRow],
) -> Result<Vec<ResultRow>, ReportError> {
    write_rows(folder, rows)?;
    written_rows(folder)
}

/// Who wrote a summary.
pub(super) fn program(command: &str) -> Value {
    json!({
        "program": "moreau2d",
        "version": env!("CARGO_PKG_VERSION"),
        "command": command,
    })
}

/// What every summary of a scene holds: program, scene, settings, and warnings about the scene.
pub(super) fn header(command: &str, scene: &Scene) -> Value {
    let more = json!({
        "scene": scene.name,
        "title": scene.title,
        "scene_hash": format!("{:016x}", scene.hash),
        "settings": {
            "dt_s": float(scene.step.dt),
            "time_s": float(scene.step.time),
            "scheme": scene.step.scheme.name(),
            "events": scene.step.events,
            "impact_law": scene.step.impact_law.name(),
            "recovery": scene.step.recovery,
            "shares": scene.step.shares.name(),
            "solver": scene.step.solver,
            "tolerance": float(scene.step.tolerance),
            "threads": scene.step.threads,
        },
        "warnings": scene.step_warnings(),
    });
    merged(program(command), more)
}

/// Both objects in one; of a key in both the second's value.
fn merged(mut summary: Value, more: Value) -> Value {
    if let (Value::Object(summary), Value::Object(more)) = (&mut summary, more) {
        summary.extend(more);
    }
    summary
}

/// What a peer does not tell is null.
pub(super) fn totals(t: &Totals) -> Value {
    let known = |count: usize| t.accounted.then_some(count);
    json!({
        "steps": t.steps,
        "time_s": float(t.time),
        "contacts": t.contacts,
        "most_contacts": t.most_contacts,
        "bodies_with_unread_contacts": t.unread,
        "sweeps": known(t.sweeps),
        "factorisations": known(t.factorisations),
        "pivots": known(t.pivots),
        "unsolved_islands": known(t.unsolved_islands),
        "unsolved_steps": known(t.unsolved_steps),
        "redundant_steps": known(t.redundant_steps),
        "capped_islands": known(t.capped),
        "relaxed_islands": known(t.relaxed),
        "joint_capped_islands": known(t.joints_capped),
        "events": known(t.events),
        "still_recovering_pairs": known(t.recovering),
        "impact_gain_j": float(t.impact_gain),
        "worst_residual": float(t.residual),
        "worst_residual_velocity_m_s": float(t.residual_velocity),
        "worst_penetration_m": float(t.penetration),
        "worst_penetration_impact_m": float(t.penetration_impact),
        "worst_joint_gap_m": float(t.joint_gap),
        "worst_imbalance_j": float(t.imbalance),
        "energy_start_j": float(t.energy_start),
        "energy_end_j": float(t.energy_end),
        "energy_rise_j": float(t.energy_rise),
        "work_forces_j": float(t.work_forces),
        "work_contact_n_j": float(t.work_contact_n),
        "work_contact_t_j": float(t.work_contact_t),
        "work_joints_j": float(t.work_joints),
        "work_motors_j": float(t.work_motors),
        "work_recovery_j": float(t.work_recovery),
        "friction_work_j": float(t.friction_work),
    })
}

/// Steps, solver work and quality, for a person.
///
/// # Arguments
/// - `located`: whether all impacts were to be located in time, not only those of swept bodies.
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
            "penetration {} m; of residuals, solver work and energy balance {} tells nothing\n",
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
        "penetration {} m, {} m where impacts were noticed; energy balance closes to {} J\n",
        number(t.penetration, 2),
        number(t.penetration_impact, 2),
        number(t.imbalance, 2),
    ));
    if t.events > 0 {
        let why = match located {
            true => "",
            false => {
                " without --events: of bodies that are swept (CCD) so that they pass through nothing"
            }
        };
        text.push_str(&format!("{} impacts located in time{why}\n", t.events));
    }
    text
}

/// What a reader of the results must know.
pub(super) fn warnings(t: &Totals) -> Vec<String> {
    let mut out = Vec::new();
    if t.unread > 0 {
        out.push(format!(
            "contacts of {} bodies, summed over all steps, could not be read: some of them are missing",
            t.unread
        ));
    }
    if t.unsolved_islands > 0 {
        out.push(format!(
            "{} islands in {} steps were not solved to the tolerance (worst residual {}, {} m/s)",
            t.unsolved_islands,
            t.unsolved_steps,
            number(t.residual, 2),
            number(t.residual_velocity, 2)
        ));
    }
    if t.redundant_steps > 0 {
        out.push(format!(
            "in {} steps more contacts carry load than there are coordinates: the shares of \
             single contacts are not unique",
            t.redundant_steps
        ));
    }
    if t.capped > 0 {
        out.push(format!(
            "restitution was capped {} times so that impacts add no energy",
            t.capped
        ));
    }
    if t.relaxed > 0 {
        out.push(format!(
            "{} times the contacts of an island contradicted each other or no rigid impulses were found: \
             it was not pushed out, or gave way",
            t.relaxed
        ));
    }
    if t.joints_capped > 0 {
        out.push(format!(
            "{} times joints closed their gaps by less than asked, or they would have put energy \
             in: the step is long for how fast bodies turn; widest gap {} m",
            t.joints_capped,
            number(t.joint_gap, 2)
        ));
    }
    if t.recovering > 0 {
        out.push(format!(
            "{} pairs that started overlapped are overlapped still",
            t.recovering
        ));
    }
    // round-off of the cap is no news
    if t.impact_gain > 1e-9 * t.kinetic_most {
        out.push(format!(
            "impacts added {} J of energy: impact_law = \"capped\" would not",
            number(t.impact_gain, 3)
        ));
    }
    out
}

/// Writes `summary.json` and gives its text; `more` adds to the header, its warnings to those there.
pub(super) fn write(
    folder: &OutputFolder,
    mut summary: Value,
    mut more: Value,
) -> Result<String, ReportError> {
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
