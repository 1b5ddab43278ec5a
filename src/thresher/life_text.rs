use super::run_files::RunFiles;
use super::run_study::{describe_life, life_json, write_wear};
use super::{Outcome, RunArgs, summary};
use crate::contact::Vec2;
use crate::experiment::{PowerBudget, RunError, ThreshingOutcome, run_threshing};
use crate::report::{
    Align, Axis, Chart, Colour, OutputFolder, Progress, Series, Style, Table, number, quantity,
};
use crate::scene::threshing::Outlines;
use crate::scene::{ConcaveSetting, Scene, Thresher, Tooth};
use serde_json::{Value, json};

pub(super) fn run(args: &RunArgs, scene: &Scene) -> Result<Outcome, RunError> {
    let (Some(p), Some(tooth)) = (&scene.thresher, &scene.tooth) else {
        return Err(RunError::Unfit(format!(
            "scene {} has no thresher",
            scene.name
        )));
    };
    args.refuse("--steps", args.common.flags.steps.is_some(), scene)?;
    args.refuse("--time", args.common.flags.time.is_some(), scene)?;
    let folder = OutputFolder::create(args.common.folder(scene))?;
    let quiet = args.common.flags.quiet;
    let every = args.every.map_or(EVERY, |n| n as usize);
    let mut files = RunFiles::create(&folder, every)?;
    let outcome = run_threshing(
        scene,
        |label, total| Progress::new(label, total, quiet),
        &mut |record, world| Ok(files.add(record, || world.bodies())?),
    )?;
    files.finish()?;
    for (name, title, outlines) in [
        (
            "machine-new.svg",
            "The machine with new teeth",
            &outcome.picture_new,
        ),
        (
            "machine-worn.svg",
            "The machine with worn teeth",
            &outcome.picture_worn,
        ),
    ] {
        folder.write(name, picture(title, outlines).to_svg()?)?;
    }
    let subtitle = format!(
        "{} N m, {} rad/s, all bars equal",
        p.operating_torque, p.speed
    );
    write_wear(&folder, &outcome.history, &subtitle, tooth.base)?;
    summary::close(
        folder,
        summary::header("run", scene),
        details(p, &outcome),
        args.common.flags.say(),
        |target| {
            let found = describe(p, tooth, &outcome);
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

fn details(p: &Thresher, outcome: &ThreshingOutcome) -> Value {
    json!({
        "machine_width_m": summary::float(p.machine_width),
        "calibrated": {
            "crop_stiffness_pa_m": summary::float(outcome.stiffness),
            "operating_torque_nm": summary::float(p.operating_torque),
            "depth_at_calibration_m": outcome.calibration.map(|(_, d)| summary::float(d)),
        },
        "concave_moved_m": summary::float(outcome.concave_moved),
        "torque_new_nm": summary::float(outcome.torque_new),
        "torque_worn_nm": summary::float(outcome.torque_worn),
        "speed_new_rad_s": summary::float(outcome.speed_new),
        "power_new_w": power_json(&outcome.power_new),
        "power_worn_w": power_json(&outcome.power_worn),
        "revolutions": summary::float(outcome.revolutions),
        "jumps": outcome.jumps,
        "steel_lost_kg": summary::float(outcome.steel_lost),
        "sampling_error": summary::float(outcome.sampling),
        "life": life_json(&outcome.history),
        "totals": summary::totals(&outcome.totals),
        "warnings": summary::warnings(&outcome.totals),
    })
}

/// Steps between the rows kept of the first measured revolution: 1.6 degrees of turning.
const EVERY: usize = 20;

/// Teeth, crop and concave, to scale.
fn picture(title: &str, outlines: &Outlines) -> Chart {
    let mut chart = Chart::new(title, Axis::linear("x [mm]"), Axis::linear("y [mm]"));
    chart.equal_aspect = true;
    let points = |outline: &[Vec2], closed: bool| {
        let end = closed.then(|| outline.first()).flatten();
        let all = outline.iter().chain(end);
        all.map(|p| (1e3 * p.x, 1e3 * p.y)).collect::<Vec<_>>()
    };
    for (k, tooth) in outlines.teeth.iter().enumerate() {
        let name = if k == 0 { "teeth" } else { "" };
        let body = Series::new(name, Style::Body, points(tooth, true));
        chart.series.push(body);
    }
    for (k, segment) in outlines.crop.iter().enumerate() {
        let name = if k == 0 { "crop" } else { "" };
        let mut line = Series::new(name, Style::Line, points(segment, true));
        line.colour = Colour::Palette(1);
        chart.series.push(line);
    }
    let mut line = Series::new("concave", Style::Line, points(&outlines.concave, false));
    line.colour = Colour::Palette(0);
    chart.series.push(line);
    chart
}

/// Every term of the budget with its name, in the order of the table.
fn terms(p: &PowerBudget) -> [(&'static str, f64); 10] {
    [
        ("drive", p.drive),
        ("feeder", p.feeder),
        ("gravity", p.gravity),
        ("friction on the teeth", -p.friction_teeth),
        ("friction on the concave", -p.friction_concave),
        ("normal losses on the teeth", -p.normal_teeth),
        ("normal losses on the concave", -p.normal_concave),
        ("carried away by the crop", -p.crop),
        ("bending of the crop", -p.bending),
        ("stored in the machine", -p.stored),
    ]
}

fn power_json(p: &PowerBudget) -> Value {
    let mut map = serde_json::Map::new();
    for (name, value) in terms(p) {
        map.insert(name.replace(' ', "_"), summary::float(value));
    }
    map.insert("sum".to_owned(), summary::float(p.imbalance()));
    Value::Object(map)
}

fn describe(p: &Thresher, tooth: &Tooth, outcome: &ThreshingOutcome) -> String {
    let mut out = format!(
        "hours to each limit at {} N m, {} rad/s:\n{}",
        p.operating_torque,
        p.speed,
        describe_life(&outcome.history)
    );
    let last = outcome.history.profile.iter().rev();
    let height = last
        .take_while(|row| row.cycles == outcome.history.cycles)
        .map(|row| row.y_m)
        .fold(f64::NEG_INFINITY, f64::max);
    let worn = tooth.gamma - height;
    out.push_str(&format!(
        "  steel lost {} kg on all {} bars\n",
        number(outcome.steel_lost, 3),
        p.bars
    ));
    out.push_str(&match p.concave {
        ConcaveSetting::Follows => format!(
            "  the concave followed the teeth by {}, so that the clearance stayed\n",
            quantity(outcome.concave_moved, "m", 3)
        ),
        ConcaveSetting::Fixed => format!(
            "  the concave stayed: clearance grown by {0}; move it in by {0} to restore it\n",
            quantity(worn, "m", 3)
        ),
    });
    out.push_str(&format!(
        "  torque {} N m with new teeth, {} N m at the end\n\n",
        number(outcome.torque_new, 4),
        number(outcome.torque_worn, 4)
    ));
    out.push_str(&format!(
        "calibrated: crop stiffness {} Pa/m, so that new teeth take the operating torque; the wear \
         coefficient",
        number(outcome.stiffness, 3)
    ));
    match &outcome.calibration {
        Some((target, depth)) => out.push_str(&format!(
            ",\n  to one published depth: {} after {:.0} revolutions; this run gives {}\n",
            quantity(target.depth, "m", 3),
            target.cycles,
            quantity(*depth, "m", 3)
        )),
        None => out.push_str(", at the study's operating point (not this one)\n"),
    }
    out.push_str(
        "assumed: tip radius, number of bars, inertia, width, drive, entry speed, concave friction,\n  \
         bending stiffness of the crop, the grain over which it wears, one profile for all bars\n\n",
    );
    out.push_str(&budget(&outcome.power_new, &outcome.power_worn));
    out.push_str(&format!(
        "\n{} revolutions in {} steps, {} jumps; {} per step; worst residual {}; sampling error \
         of a cycle up to {} %\n",
        number(outcome.revolutions, 4),
        outcome.totals.steps,
        outcome.jumps,
        quantity(
            outcome.totals.wall / outcome.totals.steps.max(1) as f64,
            "s",
            3
        ),
        number(outcome.totals.residual, 2),
        number(100.0 * outcome.sampling, 2),
    ));
    out.push_str(&format!(
        "in every step kinetic energy changes by the work of all impulses to {} J of {} J\n",
        number(outcome.totals.imbalance, 2),
        number(outcome.totals.kinetic_most, 3)
    ));
    for warning in summary::warnings(&outcome.totals) {
        out.push_str(&format!("note: {warning}\n"));
    }
    out
}

fn budget(new: &PowerBudget, worn: &PowerBudget) -> String {
    let mut table = Table::new([
        ("power, whole machine", Align::Left),
        ("new teeth [W]", Align::Right),
        ("worn teeth [W]", Align::Right),
    ]);
    for ((name, a), (_, b)) in terms(new).into_iter().zip(terms(worn)) {
        table.push([name.to_owned(), format!("{a:.0}"), format!("{b:.0}")]);
    }
    table.push([
        "sum".to_owned(),
        number(new.imbalance(), 2),
        number(worn.imbalance(), 2),
    ]);
    format!("{table}")
}
