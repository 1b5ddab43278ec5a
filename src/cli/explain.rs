//! `explain`: what a scene models, and how well its step resolves it.

use super::{Common, Outcome, print_out, summary};
use crate::experiment::{Explanation, RunError, explain as of_scene};
use crate::report::{Align, Table, counted, number, quantity};
use crate::scene::Scene;
use crate::solver::SMALL;
use crate::thresher::{Machine, explain_threshing};
use clap::Args;
use serde_json::json;

#[derive(Args)]
pub(super) struct ExplainArgs {
    #[command(flatten)]
    common: Common,
}

/// Prints what a scene models; writes no file.
pub(super) fn explain(args: &ExplainArgs) -> Result<Outcome, RunError> {
    let flags = &args.common.flags;
    let (scene, machine) = args.common.load()?;
    flags.refuse_twice(&scene)?;
    let refused = |what: &str| Err(RunError::Unfit(format!("explain: {what}")));
    if flags.out.is_some() {
        return refused("--out: no file is written");
    }
    match &machine {
        Some(Machine::Thresher(setup)) => {
            let flag = match (&flags.steps, &flags.time) {
                (Some(_), _) => Some("--steps"),
                (_, Some(_)) => Some("--time"),
                _ => None,
            };
            if let Some(flag) = flag {
                return refused(&format!(
                    "{flag}: the trial of a machine is its first load cycle"
                ));
            }
            return show(args, &scene, &explain_threshing(&scene, setup)?);
        }
        Some(Machine::Study(_)) => {
            let model =
                "a rotor with one coordinate, its angle; the crop is a prescribed load cycle";
            if flags.json {
                print_out(&format!(
                    "{:#}\n",
                    json!({"scene": scene.name, "model": "rotor", "degrees_of_freedom": 1})
                ))?;
            } else {
                print_out(&format!(
                    "{}: {}\nmodel: {model}\n",
                    scene.name, scene.title
                ))?;
            }
            return Ok(Outcome::Done);
        }
        None => {}
    }
    let mut scene = scene;
    if let Some(steps) = flags.steps {
        scene.step.time = f64::from(steps) * scene.step.dt;
    }
    show(args, &scene, &of_scene(&scene)?)
}

fn show(args: &ExplainArgs, scene: &Scene, found: &Explanation) -> Result<Outcome, RunError> {
    print_out(&match args.common.flags.json {
        true => format!("{:#}\n", summary::json(found)),
        false => format!("{}: {}\n{}", scene.name, scene.title, text(found)),
    })?;
    Ok(Outcome::Done)
}

fn text(e: &Explanation) -> String {
    let t = &e.trial;
    let parts: Vec<String> = [
        (e.dynamic_bodies, "that move"),
        (e.fixed_bodies, "fixed"),
        (e.kinematic_bodies, "on a given path"),
    ]
    .iter()
    .filter(|part| part.0 > 0)
    .map(|(count, what)| format!("{count} {what}"))
    .collect();
    let of = match (parts.is_empty(), e.joints) {
        (true, _) => "a mechanism of coordinates".to_owned(),
        (false, 0) => format!("bodies: {}", parts.join(", ")),
        (false, n) => format!(
            "bodies: {}; {}, {} taken{}",
            parts.join(", "),
            counted(n, "joint"),
            counted(e.coordinates_taken, "coordinate"),
            match e.joint_rows - e.coordinates_taken {
                0 => String::new(),
                more => format!(" ({more} of their rows repeat others)"),
            }
        ),
    };
    let mut out = format!(
        "degrees of freedom: {} (model {}); {of}\n\
         trial: {}, {}, scheme {}, solver {}\n\
         at most in a step: {}, {}, {}\n\
         in all: {} times a contact sticks, {} slides{}; {}, {}, {}\n",
        e.degrees_of_freedom,
        e.model,
        match t.run_steps {
            0 => counted(t.steps, "step"),
            all => format!("{} of {all} steps", t.steps),
        },
        quantity(t.time_s, "s", 3),
        e.scheme,
        e.solver,
        counted(t.most_contacts, "contact"),
        counted(t.most_islands, "island"),
        counted(t.most_unknowns, "unknown impulse"),
        t.sticking,
        t.sliding,
        match t.frictionless {
            0 => String::new(),
            n => format!(", {n} is closed without friction"),
        },
        counted(t.impacts, "impact"),
        counted(t.sweeps, "sweep"),
        counted(t.factorisations, "factorisation"),
    );
    out.push_str(&islands(e));
    out.push_str("left out:\n");
    for left in &e.left_out {
        let key = left.key.map_or(String::new(), |key| format!(" ({key})"));
        out.push_str(&format!("  {}: {}{key}\n", left.what, left.why));
    }
    for scale in &e.time_scales {
        out.push_str(&format!(
            "time scale: {}: {}, {} steps\n",
            scale.what,
            quantity(scale.period_s, "s", 3),
            number(scale.steps, 3)
        ));
    }
    out.push_str(&accuracy(e));
    for step in &e.steps_for {
        out.push_str(&format!(
            "for an accuracy of {:e} over the trial alone: step.dt = {}\n",
            step.accuracy,
            number(step.dt_s, 2)
        ));
    }
    out.push_str(&format!("to choose: {}\n", e.to_choose));
    for warning in &e.warnings {
        out.push_str(&format!("warning: {warning}\n"));
    }
    out
}

/// The errors to expect, or why they are not known.
fn accuracy(e: &Explanation) -> String {
    if let Some(why) = e.accuracy_unknown {
        return format!("accuracy: not known: {why}\n");
    }
    let mut table = Table::new([
        ("expected after the trial", Align::Left),
        ("error", Align::Right),
        ("with half the step", Align::Right),
        ("order", Align::Right),
    ]);
    for a in &e.accuracy {
        table.push([
            a.measure.to_owned(),
            quantity(a.error, a.unit, 2),
            quantity(a.error_of_half, a.unit, 2),
            match a.order.is_nan() {
                true => "exact".to_owned(),
                false => number(a.order, 2),
            },
        ]);
    }
    let mut out = table.to_string();
    let cost = e.accuracy.first().map(|a| a.cost_of_half);
    if let Some(cost) = cost.filter(|cost| cost.is_finite()) {
        let cost = number(cost, 2);
        out.push_str(&format!(
            "half the step costs {cost} times the solver's work\n"
        ));
    }
    out
}

/// Kinds of islands that the trial solved, each with how it is solved.
fn islands(e: &Explanation) -> String {
    let t = &e.trial;
    let auto = e.solver == "auto";
    let kinds = [
        (
            t.resting_islands,
            "at rest, which keep their impulses".to_owned(),
        ),
        (
            t.small_islands,
            match auto {
                true => format!(
                    "of up to {SMALL} contacts and joints, by enumeration of what each contact does"
                ),
                false => format!("of up to {SMALL} contacts and joints, by {}", e.solver),
            },
        ),
        (
            t.other_islands,
            match auto {
                true => format!(
                    "larger, of up to {}, by Newton's method and interior point",
                    t.largest_island
                ),
                false => format!("larger, of up to {}, by {}", t.largest_island, e.solver),
            },
        ),
        (
            t.swept_islands,
            format!(
                "of more than 500 contacts in motion, of up to {}, by sweeps to a stated closing velocity",
                t.largest_island
            ),
        ),
    ];
    let own: Vec<String> = (kinds.iter().filter(|(count, _)| *count > 0))
        .map(|(count, kind)| format!("  {count} {kind}\n"))
        .collect();
    match own.is_empty() {
        true => String::new(),
        false => format!(
            "islands, summed over the steps, all with the scheme {}:\n{}",
            e.scheme,
            own.concat()
        ),
    }
}
