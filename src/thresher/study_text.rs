use super::{Outcome, RunArgs, summary};
use crate::experiment::{RunError, StudyOutcome, WearHistory, run_study};
use crate::report::{
    Align, OutputFolder, Progress, ReportError, Table, depth_per_cell, heights, number, plus_minus,
    quantity, tooth_height, worn_profile, write_rows,
};
use crate::scene::{Reading, Scene, Study};
use serde_json::{Value, json};

pub(super) fn run(args: &RunArgs, scene: &Scene) -> Result<Outcome, RunError> {
    let Some(study) = &scene.study else {
        return Err(RunError::Unfit(format!(
            "scene {} has no study",
            scene.name
        )));
    };
    args.refuse("--steps", args.common.flags.steps.is_some(), scene)?;
    args.refuse("--every", args.every.is_some(), scene)?;
    let calibrated = study.reading == Reading::TorqueBalanced;
    args.refuse(
        "--time",
        calibrated && args.common.flags.time.is_some(),
        scene,
    )?;
    let folder = OutputFolder::create(args.common.folder(scene))?;
    let points = (study.torques.len() * study.speeds.len()) as u64;
    let progress = Progress::new(&scene.name, points, args.common.flags.quiet);
    let outcome = run_study(scene, &progress)?;
    drop(progress);
    write_rows(&folder, &outcome.comparison)?;
    if let Some(history) = &outcome.history {
        let subtitle = format!(
            "{} N m, {} rad/s, reading {}",
            outcome.torque,
            outcome.speed,
            reading(study)
        );
        let base = scene.tooth.map_or(0.0, |t| t.base);
        write_wear(&folder, history, &subtitle, base)?;
    }
    summary::close(
        folder,
        summary::header("run", scene),
        json!({
            "reading": reading(study),
            "contact_time_s": summary::float(outcome.contact_time),
            "life_contact_time_s": outcome.life_contact_time.map(summary::float),
            "contact_time_calibrated": outcome.calibrated,
            "stepper_against_algebra": outcome.oracle_difference.map(summary::float),
            "life": outcome.history.as_ref().map(life_json),
            "totals": summary::totals(&outcome.totals),
            "warnings": summary::warnings(&outcome.totals),
        }),
        args.common.flags.say(),
        |target| {
            let found = describe(study, &outcome);
            let place = target.display();
            format!(
                "{}: {}\n\n{found}\nresults in {place}\n",
                scene.name, scene.title
            )
        },
    )?;
    Ok(if outcome.totals.unsolved_islands > 0 {
        Outcome::Unsolved
    } else {
        Outcome::Done
    })
}

fn reading(study: &Study) -> &'static str {
    match study.reading {
        Reading::Literal => "literal",
        Reading::TorqueBalanced => "torque-balanced",
    }
}

/// Wear, worn volume, profile and life as CSV, and the three pictures drawn from them.
pub(super) fn write_wear(
    folder: &OutputFolder,
    history: &WearHistory,
    subtitle: &str,
    base: f64,
) -> Result<(), ReportError> {
    write_rows(folder, &history.wear)?;
    write_rows(folder, &history.volume)?;
    write_rows(folder, &history.profile)?;
    write_rows(folder, &history.life)?;
    let chart = worn_profile(&history.profile, 1, base, subtitle)?;
    folder.write("worn-profile.svg", chart.to_svg()?)?;
    let chart = depth_per_cell(&history.wear, 1, subtitle)?;
    folder.write("depth-per-cell.svg", chart.to_svg()?)?;
    let points = heights(&history.profile);
    let chart = tooth_height(&points, &history.limits, &history.life, subtitle);
    folder.write("tooth-height.svg", chart.to_svg()?)
}

/// Crossings of the limits for `summary.json`.
pub(super) fn life_json(history: &WearHistory) -> Vec<Value> {
    history
        .crossings
        .iter()
        .map(|c| {
            json!({
                "limit": c.limit,
                "cell": c.cell + 1,
                "hours": c.hours.map(summary::float),
                "cycles": c.cycles.map(summary::float),
                "error_hours": c.error_hours.map(summary::float),
                "extrapolated_hours": c.extrapolated_hours.map(summary::float),
            })
        })
        .collect()
}

/// Hours to each limit, in words.
pub(super) fn describe_life(history: &WearHistory) -> String {
    let mut out = String::new();
    for (limit, c) in history.limits.iter().zip(&history.crossings) {
        let what = format!("{} (height {})", c.limit, quantity(limit.height, "m", 3));
        let when = match (c.hours, c.error_hours, c.extrapolated_hours) {
            // an error that is not known is left out
            (Some(h), e, _) => {
                let hours = plus_minus(h, e.unwrap_or(f64::NAN));
                format!("after {hours} hours")
            }
            (None, _, Some(h)) => format!(
                "not reached in {} hours; about {} at the last rate",
                number(history.hours, 4),
                number(h, 3)
            ),
            (None, _, None) => "never: nothing wears".to_owned(),
        };
        out.push_str(&format!("  {what}: {when}, cell {} decides\n", c.cell + 1));
    }
    if let Some((cell, depth)) = history.deepest() {
        out.push_str(&format!(
            "  deepest wear {} in cell {cell} after {} hours\n",
            quantity(depth, "m", 4),
            number(history.hours, 4)
        ));
    }
    out
}

fn describe(study: &Study, outcome: &StudyOutcome) -> String {
    let mut out = format!("reading: {}\n", reading(study));
    if let Some(stall) = &outcome.stall {
        out.push_str(&format!(
            "The rotor stalls: with e = 0 one closed contact stops it in one step (speed after it \
             {} rad/s); {} step of a cycle wears, sliding under load is impossible.\n\
             Wear per cycle goes as torque^{:.4} speed^{:.4}.\n\
             {} of {} loadings by a single cell pass the judge: the Delassus operator has rank \
             one, and the shares of the cells are not unique. Depths per cell mean nothing here, and no \
             life is followed.\n",
            number(stall.speed_after, 2),
            stall.wearing_steps,
            stall.torque_exponent,
            stall.speed_exponent,
            stall.single_cell.0,
            stall.single_cell.1,
        ));
    } else {
        out.push_str(&format!(
            "calibrated: contact time of one cycle {}, of the life below {} (one published depth: {} \
             at {} N m, {} rad/s)\n\
             assumed: axis distance {} m, friction {}; the study does not give them\n\
             stepper against the algebra: {} (largest relative difference of a depth)\n",
            quantity(outcome.contact_time, "s", 5),
            quantity(outcome.life_contact_time.unwrap_or(f64::NAN), "s", 5),
            quantity(study.calibrate.depth, "m", 4),
            study.calibrate.torque,
            study.calibrate.speed,
            study.axis_distance,
            study.friction,
            number(outcome.oracle_difference.unwrap_or(f64::NAN), 2),
        ));
    }
    out.push('\n');
    let mut table = Table::new([
        ("torque [N m]", Align::Right),
        ("speed [rad/s]", Align::Right),
        ("published [um]", Align::Right),
        ("computed [um]", Align::Right),
        ("error", Align::Right),
        ("", Align::Left),
    ]);
    let (mut sum, mut worst, mut count) = (0.0, 0.0f64, 0);
    for row in &outcome.comparison {
        let error = row.relative_error;
        if !row.calibrated && error.is_finite() {
            sum += error.abs();
            worst = worst.max(error.abs());
            count += 1;
        }
        let published = if row.published_um.is_nan() {
            "-".to_owned()
        } else {
            format!("{:.0}", row.published_um)
        };
        let percent = if error.is_nan() {
            "-".to_owned()
        } else {
            format!("{:+.1} %", 100.0 * error)
        };
        table.push([
            number(row.torque_nm, 5),
            number(row.omega_rad_s, 4),
            published,
            format!("{:.0}", row.computed_um),
            percent,
            if row.calibrated { "calibrated" } else { "" }.to_owned(),
        ]);
    }
    out.push_str(&format!("{table}"));
    if count > 0 {
        out.push_str(&format!(
            "mean error of the other {count} points {:.1} %, worst {:.1} %\n",
            100.0 * sum / f64::from(count),
            100.0 * worst
        ));
    }
    if let Some(history) = &outcome.history {
        out.push_str(&format!(
            "\nlife at {} N m, {} rad/s, worn along the normals of the profile:\n{}",
            outcome.torque,
            outcome.speed,
            describe_life(history)
        ));
    }
    out.push_str(&format!(
        "{} steps, {} per step; worst residual {}\n",
        outcome.totals.steps,
        quantity(
            outcome.totals.wall / outcome.totals.steps.max(1) as f64,
            "s",
            3
        ),
        number(outcome.totals.residual, 2)
    ));
    out
}
