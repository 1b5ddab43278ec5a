//! The ranges of a machine's blocks.

use super::Blocks;
use super::blocks::{Calibration, Study, Tooth, Wear};
use super::grain_parameters::{FULLEST, Grains};
use super::parameters::{Hold, Thresher};
use crate::scene::{At, Range, SceneError, distinct, range};
use crate::wear::MOST_JUMPS;
use std::f64::consts::TAU;

const SIZE: Range = range(1e-6, 1e6, "1e-6 to 1e6 m");
const MASS: Range = range(1e-12, 1e12, "1e-12 to 1e12 kg");
const INERTIA: Range = range(1e-18, 1e18, "1e-18 to 1e18 kg m²");
const FRICTION: Range = range(0.0, 1000.0, "0 to 1000");
const RESTITUTION: Range = range(1e-3, 1.0, "0.001 to 1");
const FEED: Range = range(1e-12, 1e12, "1e-12 to 1e12 kg/s");
const CYCLES: Range = range(1.0, 1e12, "1 to 1e12");
const DRIVE_TORQUE: Range = range(1e-9, 1e12, "1e-9 to 1e12 N m");
const DRIVE_SPEED: Range = range(1e-6, 1e6, "1e-6 to 1e6 rad/s");
const FOUNDATION: Range = range(1.0, 1e15, "1 to 1e15 Pa/m");
const BENDING: Range = range(0.0, 1e9, "0 to 1e9 N m/rad");
const DEGREES: Range = range(-360.0, 360.0, "-360 to 360 degrees");

/// Checks all blocks of a machine that are present; `top` is the top of the file.
///
/// # Errors
/// [`SceneError::OutOfRange`] and [`SceneError::Duplicate`].
pub(super) fn check(blocks: &Blocks, top: &At<'_>) -> Result<(), SceneError> {
    if let Some(block) = &blocks.tooth {
        tooth(&top.key("tooth"), block)?;
    }
    if let Some(block) = &blocks.wear {
        let tooth = blocks.tooth.unwrap_or_default();
        wear(&top.key("wear"), block, &tooth)?;
    }
    if let Some(block) = &blocks.study {
        study(&top.key("study"), block)?;
    }
    if let Some(block) = &blocks.thresher {
        thresher(&top.key("thresher"), block)?;
        let tooth = blocks.tooth.unwrap_or_default();
        parts(top, block, &tooth, blocks.wear.as_ref())?;
    }
    Ok(())
}

fn tooth(at: &At<'_>, tooth: &Tooth) -> Result<(), SceneError> {
    at.within("alpha", tooth.alpha, range(-1e6, 1e6, "-1e6 to 1e6 1/m"))?;
    at.within("beta", tooth.beta, range(-1e3, 1e3, "-1000 to 1000"))?;
    at.within("gamma", tooth.gamma, SIZE)?;
    at.within("width", tooth.width, SIZE)?;
    at.within("base", tooth.base, SIZE)?;
    // Three points define a quadratic; a thousand cells are finer than any measured profile.
    at.count("cells", tooth.cells, 3, 1000)
}

fn wear(at: &At<'_>, wear: &Wear, tooth: &Tooth) -> Result<(), SceneError> {
    let coefficient = range(1e-30, 1.0, "1e-30 to 1 m2/N");
    at.within("coefficient", wear.coefficient, coefficient)?;
    // Jumps longer than 0.3 of an edge are shortened to it.
    let least = (tooth.gamma + tooth.base) / MOST_JUMPS as f64;
    if !(least..=1.0).contains(&wear.jump) {
        return Err(SceneError::OutOfRange {
            at: at.key("jump").place(),
            value: format!("{:?}", wear.jump),
            allowed: format!("{least:.2e} to 1 m, from {MOST_JUMPS} jumps for a tooth on its base"),
        });
    }
    if let Some(concave) = wear.concave_coefficient {
        at.within("concave_coefficient", concave, coefficient)?;
    }
    at.count("revolutions", wear.revolutions, 1, 10_000)?;
    at.within(
        "smoothing_length",
        wear.smoothing_length,
        range(0.0, 1.0, "0 to 1 m"),
    )?;
    at.within(
        "max_hours",
        wear.max_hours,
        range(1e-6, 1e9, "1e-6 to 1e9 h"),
    )?;
    let limits = at.key("limits");
    distinct(
        &limits,
        "limit",
        wear.limits.iter().map(|limit| limit.name.as_str()),
    )?;
    for (index, limit) in wear.limits.iter().enumerate() {
        let at = limits.index(index);
        at.name("name", &limit.name)?;
        at.within("height", limit.height, range(-1e6, 1e6, "-1e6 to 1e6 m"))?;
    }
    Ok(())
}

fn study(at: &At<'_>, study: &Study) -> Result<(), SceneError> {
    at.within("axis_distance", study.axis_distance, SIZE)?;
    at.within("friction", study.friction, FRICTION)?;
    at.within("inertia", study.inertia, INERTIA)?;
    at.within("lever", study.lever, range(0.0, 1e6, "0 to 1e6 m"))?;
    at.within("mass", study.mass, MASS)?;
    at.within("start_angle_deg", study.start_angle_deg, DEGREES)?;
    at.within("tape_thickness", study.tape_thickness, SIZE)?;
    at.within("cycles", study.cycles, CYCLES)?;
    at.count("batches", study.batches, 1, 1_000_000)?;
    for (key, values, least, range) in [
        ("speeds", &study.speeds, 1, DRIVE_SPEED),
        ("torques", &study.torques, 1, DRIVE_TORQUE),
        ("frictions", &study.frictions, 0, FRICTION),
    ] {
        if !(least..=1000).contains(&values.len()) {
            return Err(SceneError::OutOfRange {
                at: at.key(key).place(),
                value: format!("{} values", values.len()),
                allowed: format!("{least} to 1000 values"),
            });
        }
        at.each(key, values, range)?;
    }
    if let Some(time) = study.contact_time {
        // a cycle is one revolution
        let fastest = study
            .speeds
            .iter()
            .copied()
            .fold(study.calibrate.speed, f64::max);
        let most = TAU / fastest;
        if !(1e-9..=most).contains(&time) {
            return Err(SceneError::OutOfRange {
                at: at.key("contact_time").place(),
                value: format!("{time:?}"),
                allowed: format!("1e-9 to {most:.4e} s, a revolution at {fastest} rad/s"),
            });
        }
    }
    calibration(&at.key("calibrate"), &study.calibrate)
}

fn calibration(at: &At<'_>, point: &Calibration) -> Result<(), SceneError> {
    at.within("torque", point.torque, DRIVE_TORQUE)?;
    at.within("speed", point.speed, DRIVE_SPEED)?;
    at.within("depth", point.depth, range(1e-12, 1e6, "1e-12 to 1e6 m"))?;
    at.within("cycles", point.cycles, CYCLES)
}

fn thresher(at: &At<'_>, thresher: &Thresher) -> Result<(), SceneError> {
    for (key, value) in [
        ("tip_radius", thresher.tip_radius),
        ("machine_width", thresher.machine_width),
        ("crop_thickness", thresher.crop_thickness),
        ("segment_length", thresher.segment_length),
        ("exit_distance", thresher.exit_distance),
        ("clearance_inlet", thresher.clearance_inlet),
        ("clearance_outlet", thresher.clearance_outlet),
    ] {
        at.within(key, value, SIZE)?;
    }
    at.count("bars", thresher.bars, 1, 1000)?;
    at.within("inertia", thresher.inertia, INERTIA)?;
    at.within("speed", thresher.speed, DRIVE_SPEED)?;
    at.within("operating_torque", thresher.operating_torque, DRIVE_TORQUE)?;
    at.within(
        "drive_torque_factor",
        thresher.drive_torque_factor,
        range(1.0, 1e6, "1 to 1e6"),
    )?;
    at.within("feed_rate", thresher.feed_rate, FEED)?;
    at.within(
        "entry_speed",
        thresher.entry_speed,
        range(1e-6, 1e6, "1e-6 to 1e6 m/s"),
    )?;
    at.within("feed_phase", thresher.feed_phase, range(0.0, 1.0, "0 to 1"))?;
    at.within("crop_stiffness", thresher.crop_stiffness, FOUNDATION)?;
    at.within("crop_restitution", thresher.crop_restitution, RESTITUTION)?;
    at.within(
        "crop_bending_stiffness",
        thresher.crop_bending_stiffness,
        BENDING,
    )?;
    at.within(
        "crop_strength",
        thresher.crop_strength,
        range(0.0, 1e9, "0 to 1e9 N per metre of width"),
    )?;
    at.within("friction_steel", thresher.friction_steel, FRICTION)?;
    at.within("friction_concave", thresher.friction_concave, FRICTION)?;
    at.within("concave_start_deg", thresher.concave_start_deg, DEGREES)?;
    at.within("concave_end_deg", thresher.concave_end_deg, DEGREES)?;
    let arc = thresher.concave_end_deg - thresher.concave_start_deg;
    if !(1.0..=350.0).contains(&arc) {
        return Err(SceneError::OutOfRange {
            at: at.key("concave_end_deg").place(),
            value: format!("{:?}", thresher.concave_end_deg),
            allowed: "1 to 350 degrees past concave_start_deg".to_owned(),
        });
    }
    if let Some(points) = &thresher.governor {
        governor(&at.key("governor"), points)?;
    }
    if let Some(point) = &thresher.calibrate {
        calibration(&at.key("calibrate"), point)?;
    }
    match &thresher.grains {
        Some(block) => grains(at, block, thresher),
        None => Ok(()),
    }
}

/// Coefficients per part belong to a run with grains, and bars of their own to one without a life.
fn parts(top: &At<'_>, p: &Thresher, tooth: &Tooth, wear: Option<&Wear>) -> Result<(), SceneError> {
    let conflict = |at: At<'_>, problem: &str| {
        let (at, problem) = (at.place(), problem.to_owned());
        Err(SceneError::Conflict { at, problem })
    };
    let at = top.key("thresher");
    let lives = wear.is_some_and(|wear| !wear.limits.is_empty());
    if p.grains.is_none() && wear.is_some_and(|wear| wear.concave_coefficient.is_some()) {
        let why = "the concave wears only in a run with [thresher.grains]";
        return conflict(top.key("wear").key("concave_coefficient"), why);
    }
    if p.grains.is_some() && p.hold == Hold::Torque {
        let why =
            "grains have no stiffness by which the torque could be held; `feed` gives their life";
        return conflict(at.key("hold"), why);
    }
    if p.grains.is_some() && p.calibrate.is_some() {
        let why =
            "nothing of grains is calibrated: calibrate K with the strip, and set wear.coefficient";
        return conflict(at.key("calibrate"), why);
    }
    if p.bar.is_empty() {
        return Ok(());
    }
    let at = at.key("bar");
    if p.grains.is_none() || lives {
        let why = "bars of their own need [thresher.grains] and no [wear] limits: a life is that of equal bars";
        return conflict(at, why);
    }
    if p.bar.len() != p.bars as usize {
        return Err(SceneError::OutOfRange {
            at: at.place(),
            value: format!("{} bars", p.bar.len()),
            allowed: format!("{}, as thresher.bars says", p.bars),
        });
    }
    for (k, bar) in p.bar.iter().enumerate() {
        let at = at.index(k);
        if let Some(height) = bar.height.filter(|h| !(1e-6..=tooth.gamma).contains(h)) {
            return Err(SceneError::OutOfRange {
                at: at.key("height").place(),
                value: format!("{height:?}"),
                allowed: format!("1e-6 to {} m, the new tooth", tooth.gamma),
            });
        }
        at.within("friction", bar.friction.unwrap_or(0.0), FRICTION)?;
        if let Some(coefficient) = bar.coefficient {
            at.within(
                "coefficient",
                coefficient,
                range(1e-30, 1.0, "1e-30 to 1 m2/N"),
            )?;
        }
    }
    Ok(())
}

/// The torque of a governor is a function of the speed that does not rise.
fn governor(at: &At<'_>, points: &[[f64; 2]]) -> Result<(), SceneError> {
    let refused = |at: &At<'_>, value: String, allowed: &str| {
        let (at, allowed) = (at.place(), allowed.to_owned());
        Err(SceneError::OutOfRange { at, value, allowed })
    };
    if !(2..=1000).contains(&points.len()) {
        let value = format!("{} points", points.len());
        return refused(at, value, "2 to 1000 points [rad/s, N m]");
    }
    for (k, [speed, torque]) in points.iter().enumerate() {
        let own = at.index(k);
        if !(1e-6..=1e6).contains(speed) || !(0.0..=1e12).contains(torque) {
            let value = format!("[{speed:?}, {torque:?}]");
            return refused(&own, value, "[1e-6 to 1e6 rad/s, 0 to 1e12 N m]");
        }
        let before = k.checked_sub(1).map(|before| points[before]);
        if before.is_some_and(|[at, most]| *speed <= at || *torque > most) {
            let value = format!("[{speed:?}, {torque:?}]");
            return refused(
                &own,
                value,
                "a higher speed than the point before, and no higher torque",
            );
        }
    }
    Ok(())
}

/// Grains must fit through the machine, and the feed of them through the inlet.
fn grains(at: &At<'_>, grains: &Grains, p: &Thresher) -> Result<(), SceneError> {
    let of = at.key("grains");
    let refused = |at: At<'_>, value: f64, allowed: String| {
        let (at, value) = (at.place(), format!("{value:?}"));
        Err(SceneError::OutOfRange { at, value, allowed })
    };
    of.within("spread", grains.spread, range(0.0, 0.9, "0 to 0.9"))?;
    // two of the largest through the narrowest place, one of them through the layer
    let narrow = p
        .clearance_inlet
        .min(p.clearance_outlet)
        .min(p.crop_thickness);
    let most = 0.25 * narrow / (1.0 + grains.spread);
    if !(1e-5..=most).contains(&grains.radius) {
        let allowed = format!(
            "1e-5 to {most:.3e} m: two of the largest grains pass the narrowest clearance side by side"
        );
        return refused(of.key("radius"), grains.radius, allowed);
    }
    of.within(
        "density",
        grains.density,
        range(1e-3, 1e6, "1e-3 to 1e6 kg/m3"),
    )?;
    let least = p.crop_density() / FULLEST;
    if grains.density < least {
        let allowed = format!(
            "at least {least:.4}: lighter grains fill more than {FULLEST} of the inlet at this feed and entry speed"
        );
        return refused(of.key("density"), grains.density, allowed);
    }
    of.within("friction", grains.friction, FRICTION)?;
    of.within("restitution", grains.restitution, range(0.0, 1.0, "0 to 1"))?;
    if p.crop_thickness > p.clearance_inlet {
        let allowed = format!(
            "at most clearance_inlet, {:?}: grains enter between the tips and the table",
            p.clearance_inlet
        );
        return refused(at.key("crop_thickness"), p.crop_thickness, allowed);
    }
    Ok(())
}
