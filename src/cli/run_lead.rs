//! What came out of a run, whether it can be trusted, and what to do: the first words of its page.

use super::run_files::BodyState;
use crate::experiment::{Engine, Measure, Totals, Verdict};
use crate::report::{Lead, Stage, counted, number, plus_minus, quantity};
use crate::scene::Scene;
use serde_json::Value;

/// Below this speed [m/s], and this spin [rad/s] times a metre, a body counts as at rest here.
const REST: f64 = 1e-3;
/// Where no input was varied: what of a threshing machine nobody measured.
const ASSUMED: &str = ". Assumed, not measured, are the strength of the crop (thresher.crop_strength) and its friction \
                       on the concave (thresher.friction_concave): bounds of both in [uncertain] of the scene file \
                       make the run say what they do to the hours";

/// The words for a run of bodies.
///
/// # Arguments
/// - `states`: the bodies at the end of the run.
/// - `notes`: what the summary warns of.
pub(super) fn lead(
    scene: &Scene,
    engine: Engine,
    totals: &Totals,
    verdict: &Verdict,
    found: &[Measure],
    states: &[BodyState],
    notes: usize,
) -> Lead {
    Lead {
        good: verdict.held,
        what_came_out: outcome(scene, totals, found, states),
        can_it_be_trusted: trust(scene, engine, totals, verdict, notes),
        what_to_do: advice(scene, engine, verdict),
    }
}

fn outcome(scene: &Scene, totals: &Totals, found: &[Measure], states: &[BodyState]) -> String {
    let stage = Stage::of(scene);
    let moving = stage.bodies.iter().filter(|b| b.kind == "dynamic").count();
    let who = match (moving, &scene.linear) {
        (_, Some(linear)) => format!("{} coordinates", linear.coordinates.len()),
        (1, None) => "one body that moves".to_owned(),
        (n, None) => format!("{n} bodies that move"),
    };
    let mut text = format!(
        "{} with {who} ran {} in {} steps, with up to {} at once. ",
        scene.name,
        quantity(totals.time, "s", 4),
        totals.steps,
        counted(totals.most_contacts, "contact")
    );
    let speed = |state: &&BodyState| state.2.x.hypot(state.2.y);
    let dynamic = |state: &&BodyState| {
        let body = stage.bodies.get(state.0 as usize);
        body.is_some_and(|body| body.kind != "fixed" && body.kind != "kinematic")
    };
    let fastest = states
        .iter()
        .filter(dynamic)
        .max_by(|a, b| speed(a).total_cmp(&speed(b)));
    if let Some(state) = fastest {
        let most_spin = states.iter().filter(dynamic).map(|s| s.2.z.abs());
        let at_rest = speed(&state) < REST && most_spin.fold(0.0, f64::max) < REST;
        text.push_str(&match at_rest {
            true => "At the end all bodies are at rest. ".to_owned(),
            false => format!(
                "At the end the fastest, {}, moves at {}. ",
                stage.bodies[state.0 as usize].name,
                quantity(speed(&state), "m/s", 3)
            ),
        });
    }
    if let Some(first) = found.first() {
        let unit = match first.unit {
            "1" => String::new(),
            unit => format!(" {unit}"),
        };
        text.push_str(&format!(
            "{}: {} computed, {} exact (error {}{unit}).",
            first.name,
            number(first.computed, 6),
            number(first.exact, 6),
            number(first.error, 2)
        ));
    }
    text.trim_end().to_owned()
}

fn trust(
    scene: &Scene,
    engine: Engine,
    totals: &Totals,
    verdict: &Verdict,
    notes: usize,
) -> String {
    let mut text = match verdict.held {
        true => "Yes, within the model: ".to_owned(),
        false => {
            let why = verdict
                .sentence
                .trim_start_matches("the scene did not hold: ");
            format!("Not everywhere: {why}. Apart from that, ")
        }
    };
    let solved = match totals.unsolved_islands {
        0 => "every contact problem is solved".to_owned(),
        all => format!(
            "{all} contact problems are not certified, {} of them within a closing velocity of {} at worst, \
             and all others are solved",
            all - totals.failed_islands,
            quantity(totals.residual_velocity, "m/s", 2)
        ),
    };
    text.push_str(&match engine.peer() {
        Some(peer) => format!(
            "only the poses were checked: {peer} reports no residual and no energy balance. Bodies \
             overlap by at most {}.",
            quantity(totals.penetration, "m", 2)
        ),
        None => format!(
            "{solved} to the relative residual {}, bodies overlap by at most {}, and the energy \
             balance of no step is off by more than {}.",
            number(scene.step.tolerance, 1),
            quantity(totals.penetration.max(0.0), "m", 2),
            quantity(totals.imbalance, "J", 2)
        ),
    });
    match notes {
        0 => {}
        1 => text.push_str(" One note below limits what can be read from it."),
        n => text.push_str(&format!(" {n} notes below limit what can be read from it.")),
    }
    text
}

fn advice(scene: &Scene, engine: Engine, verdict: &Verdict) -> String {
    let half = number(0.5 * scene.step.dt, 4);
    // without the zeros at its end
    let half: f64 = half.parse().unwrap_or(0.5 * scene.step.dt);
    let shorter = format!("a step of half the length (--dt {half})");
    let failed = |name: &str| verdict.checks.iter().any(|c| c.name == name && !c.held);
    let mut advice = Vec::new();
    if verdict.held {
        return format!(
            "Nothing must be done. To see how much the motion depends on the step, run it again with \
             --dt {half} and compare."
        );
    }
    if engine != Engine::Moreau {
        return format!("Try {shorter}, or --engine moreau.");
    }
    if failed("passed_through") {
        advice.push(format!(
            "for bodies that pass through others, {shorter}, or ccd = true for them"
        ));
    }
    if failed("overlap") {
        advice.push(format!(
            "for the overlap, {shorter}, and a look at how the bodies lie at the start"
        ));
    }
    if failed("deepest") {
        let finer = match scene.step.events {
            true => shorter.clone(),
            false => format!("{shorter}, or --events, which finds each impact in time"),
        };
        advice.push(format!("for the deep overlap, {finer}"));
    }
    if failed("joint_gap") {
        advice.push(format!("for the joints, {shorter}"));
    }
    if failed("energy") || failed("imbalance") {
        advice.push(format!("for the energy, {shorter}"));
    }
    if failed("failed") || failed("bounded") {
        let other = match scene.step.solver.as_str() {
            "auto" => "",
            _ => "--solver auto, ",
        };
        advice.push(format!(
            "for the problems that are not certified, {other}--effort exact, a looser --tolerance, or a shorter step; \
             --dump-problems writes them to files for `moreau2d solve`"
        ));
    }
    // what has a place on the time bar
    let marked = ["overlap", "imbalance", "failed", "bounded"];
    let lead = match marked.iter().any(|name| failed(name)) {
        true => "Go to the red places of the time bar. Then try",
        false => "Try",
    };
    format!("{lead}: {}.", advice.join("; "))
}

/// The words for a machine with grains beside the strip.
fn grains_lead(found: &Value, totals: &Totals, notes: usize, wrong: Option<&str>) -> Lead {
    let of = |crop: &str, figure: &str| found[crop][figure].as_f64().unwrap_or(f64::NAN);
    let worn = |crop: &str| of(crop, "worn_m3_per_m_bar_revolution");
    let bounded = totals.unsolved_steps;
    let interval = of("grains", "interval_95");
    let known = match interval < 1.0 {
        true => format!(
            "known to ± {} % (95 %, this seed)",
            number(100.0 * interval, 2)
        ),
        false => "not known: wear.revolutions are too few".to_owned(),
    };
    Lead {
        good: wrong.is_none(),
        what_came_out: format!(
            "With grains the drive takes {} N m, with the strip of crop that `thresher` has {} N m. Grains wear a \
             bar by {} times what the strip does; the depth of the deepest cell is {known}.",
            number(of("grains", "torque_nm"), 3),
            number(of("strip", "torque_nm"), 4),
            number(worn("grains") / worn("strip"), 2),
        ),
        can_it_be_trusted: match wrong {
            Some(why) => format!("No: {why}."),
            None => format!(
                "The computation is sound: of its {} steps {} are certified and {bounded} bounded, within a \
                 closing velocity of {}. No grain passed through the steel. Torque and wear of the strip are \
                 calibrated; those of the grains are no better than the size and density assumed.",
                totals.steps,
                totals.steps - bounded,
                quantity(totals.residual_velocity, "m/s", 2)
            ),
        },
        what_to_do: match (wrong, notes) {
            (Some(_), _) => "Do what the line above says and run it again; the figures below are not those of the scene.",
            (None, 0) => "Run other seeds (--set seed=2) to see the scatter of the torque.",
            (None, _) => "Read the notes below before the figures.",
        }
        .to_owned(),
    }
}

/// The words for a machine, from what its run adds to the summary.
///
/// # Arguments
/// - `wrong`: what makes the results those of another machine.
pub(super) fn machine_lead(
    found: &Value,
    totals: &Totals,
    notes: usize,
    wrong: Option<&str>,
) -> Lead {
    if found.get("grains").is_some() {
        return grains_lead(found, totals, notes, wrong);
    }
    let solved = totals.unsolved_islands == 0;
    let lives = found["life"].as_array().into_iter().flatten();
    let hours = |life: &Value| {
        let hours = life["hours"].as_f64()?;
        let error = life["error_hours"].as_f64().unwrap_or(f64::NAN);
        let limit = life["limit"].as_str()?.to_owned();
        Some(format!("{limit} after {} h", plus_minus(hours, error)))
    };
    let reached: Vec<String> = lives.filter_map(hours).collect();
    let what = match reached.is_empty() {
        true => "No limit of wear is reached in the hours that were run.".to_owned(),
        false => format!("Limits of wear are reached: {}.", reached.join("; ")),
    };
    let trust = match (solved, wrong) {
        (_, Some(why)) => format!("No: {why}."),
        (false, None) => format!(
            "Not everywhere: {} contact problems in {} steps are unsolved.",
            totals.unsolved_islands, totals.unsolved_steps
        ),
        (true, None) => format!(
            "The computation is sound: every contact problem of its {} steps is solved, to the residual \
             {}.{} The hours are no better than what was calibrated and assumed, and the error stated is that of \
             the computation alone{}.",
            totals.steps,
            number(totals.residual, 2),
            beside_published(found),
            match (most_moving(found), found.get("calibrated")) {
                (Some(input), _) => input,
                (None, Some(_)) => ASSUMED.to_owned(),
                (None, None) => ": see the results below".to_owned(),
            }
        ),
    };
    let to_do = match (solved && wrong.is_none(), notes) {
        (true, 0) => "Measure what is assumed on your machine before you plan by the hours.",
        _ => "Read the notes and the assumptions below before the hours.",
    };
    Lead {
        good: solved && wrong.is_none(),
        what_came_out: what,
        can_it_be_trusted: trust,
        what_to_do: to_do.to_owned(),
    }
}

/// The input of `[uncertain]` that moves the first result most, and the range within which it moves it.
fn most_moving(found: &Value) -> Option<String> {
    let bands = found["uncertain"].get(0)?;
    let cause = bands["causes"].get(0)?;
    let [from, to] = [0, 1].map(|end| cause["band"][end].as_f64());
    Some(format!(
        ". Of the inputs that were varied {} moves the result most: {} {} to {} {} between its bounds",
        cause["input"].as_str()?,
        bands["result"].as_str()?,
        number(from?, 3),
        number(to?, 3),
        bands["unit"].as_str()?
    ))
}

/// How a study compares with its published numbers, in a sentence; empty for other machines.
fn beside_published(found: &Value) -> String {
    let rows = |key: &str| found[key].as_array().into_iter().flatten();
    let points = rows("comparison").filter(|row| row["calibrated"] == false);
    let off = points.filter_map(|row| row["relative_error"].as_f64());
    let off: Vec<f64> = off.map(|error| 100.0 * error.abs()).collect();
    if off.is_empty() {
        return String::new();
    }
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    let worst = off.iter().copied().fold(0.0, f64::max);
    let longer = rows("frictions")
        .filter_map(|row| Some(row["life_hours"].as_f64()? / row["published_hours"].as_f64()?));
    let (least, most) = longer.fold((f64::INFINITY, 0.0), |(least, most), ratio| {
        (ratio.min(least), ratio.max(most))
    });
    let lives = match most > 0.0 {
        true => format!(
            " and the lives over friction {} to {} times the published ones",
            number(least, 2),
            number(most, 2)
        ),
        false => String::new(),
    };
    format!(
        " It is not the published study: with one point fitted, the other {} depths are {mean:.1} % off in the \
         mean and {worst:.1} % at worst{lives}.",
        off.len()
    )
}
