//! The published study, rebuilt: one rotor, 26 cells, a wear law.

use super::blocks::{Reading, Study};
use super::contact_time::contact_time;
use super::machine::Setup;
use super::rows::{ComparisonRow, FrictionDepthRow, FrictionRow};
use super::stall::{Stall, exponent, single_cells};
use super::study_friction::{friction_depths, friction_rows};
use super::study_life::study_life;
use super::study_rotor::{Cycle, deepest, load_cycle, new_tooth, oracle_load_slip, rotor};
use super::wear_chart::WornCycle;
use super::wear_history::WearHistory;
use crate::experiment::{RunError, Totals};
use crate::report::Progress;
use crate::scene::Scene;
use crate::wear::{Profile, WearError, WearState};

/// One published depth after 4e6 cycles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PublishedPoint {
    /// \[N m\], \[rad/s\], \[m\].
    pub torque: f64,
    pub speed: f64,
    pub depth: f64,
}

/// The twelve published depths: Ibrahim, Shash & Abboud (2025), doi 10.30493/das.2024.485466.
pub const PUBLISHED: [PublishedPoint; 12] = {
    const fn p(torque: f64, speed: f64, depth: f64) -> PublishedPoint {
        PublishedPoint {
            torque,
            speed,
            depth,
        }
    }
    [
        p(146.39, 70.0, 7.62e-3),
        p(146.39, 80.0, 8.28e-3),
        p(146.39, 90.0, 9.02e-3),
        p(146.39, 100.0, 9.94e-3),
        p(146.39, 110.0, 13.40e-3),
        p(146.39, 120.0, 17.07e-3),
        p(20.87, 70.0, 1.13e-3),
        p(20.87, 80.0, 1.41e-3),
        p(20.87, 90.0, 1.64e-3),
        p(20.87, 100.0, 2.05e-3),
        p(20.87, 110.0, 2.50e-3),
        p(20.87, 120.0, 2.67e-3),
    ]
};

/// Results of a run of the study.
#[derive(Debug, Clone)]
pub struct StudyOutcome {
    /// Published and computed depths, in the order of torques and speeds.
    pub comparison: Vec<ComparisonRow>,
    /// Contact time of one cycle \[s\] of the comparison, and of the life: in the torque-balanced
    /// reading that of the file, or each calibrated to the same published depth. The literal reading
    /// has no life.
    pub contact_time: f64,
    pub life_contact_time: Option<f64>,
    pub calibrated: bool,
    /// Depth and life by friction; none in the literal reading.
    pub frictions: Vec<FrictionRow>,
    /// Depth by friction at the torques of the published ranges; none in the literal reading.
    pub friction_depths: Vec<FrictionDepthRow>,
    /// Largest relative difference of a depth between the stepper and the algebra, of the
    /// comparison and of the life; `None` if the reading has no algebra.
    pub oracle_difference: Option<f64>,
    /// The operating point of the life, worn along its normals; `None` if the impulse distribution
    /// over the cells is not unique.
    pub torque: f64,
    pub speed: f64,
    pub history: Option<WearHistory>,
    pub totals: Totals,
    pub stall: Option<Stall>,
}

/// Wear of a new tooth in one load cycle at the calibration point, and the same by the algebra.
///
/// # Errors
/// [`RunError`].
pub(super) fn study_cycle(scene: &Scene, setup: &Setup<Study>) -> Result<WornCycle, RunError> {
    let (study, tooth, wear) = (&setup.parameters, &setup.tooth, &setup.wear);
    let update = study.update;
    let (torque, speed) = (study.calibrate.torque, study.calibrate.speed);
    let worn = |load_slip: &[f64]| -> Result<Vec<f64>, RunError> {
        let mut state = new_tooth(tooth, wear, speed, update)?;
        advance(&mut state, load_slip, 1.0)?;
        Ok(state.depth().to_vec())
    };
    let state = new_tooth(tooth, wear, speed, update)?;
    let balanced = study.reading == Reading::TorqueBalanced;
    let window = window(scene, setup)?;
    let mut totals = Totals::default();
    let rotor = rotor(study, state.profile(), update, torque, speed)?;
    let cycle = load_cycle(scene, rotor, window, &mut totals)?;
    let exact = match balanced {
        true => {
            let profile = state.profile();
            let exact = oracle_load_slip(study, profile, update, torque, speed, window)?;
            Some(worn(&exact)?)
        }
        false => None,
    };
    Ok(WornCycle {
        depth: worn(&cycle.load_slip)?,
        exact,
        totals,
    })
}

/// Runs the study's reading over all its torques and speeds.
///
/// In the torque-balanced reading the contact time of a cycle is one constant, given or fitted to one
/// published depth with the algebra, and then used by the stepper everywhere. The life of the tooth
/// at that point, worn along its normals and not refitted, has the contact time that is given, or
/// its own, fitted to the same depth.
///
/// # Errors
/// [`RunError`].
pub fn run_study(
    scene: &Scene,
    setup: &Setup<Study>,
    progress: &Progress,
) -> Result<StudyOutcome, RunError> {
    let (study, tooth, wear) = (&setup.parameters, &setup.tooth, &setup.wear);
    let balanced = study.reading == Reading::TorqueBalanced;
    let calibrated = balanced && study.contact_time.is_none();
    let contact_time = window(scene, setup)?;
    let mut totals = Totals::default();
    let mut comparison = Vec::new();
    let mut oracle_difference: f64 = 0.0;
    let (mut wearing_steps, mut speed_after) = (0, 0.0f64);
    let mut per_cycle = Vec::new();
    for &torque in &study.torques {
        for &speed in &study.speeds {
            let point = operating_point(scene, setup, [torque, speed], contact_time, &mut totals)?;
            per_cycle.push((torque, speed, point.first.load_slip.iter().sum::<f64>()));
            wearing_steps = wearing_steps.max(point.first.wearing_steps);
            speed_after = speed_after.max(point.first.speed_after.abs());
            oracle_difference = oracle_difference.max(point.oracle_difference);
            let row = compare_point(study, torque, speed, &point, calibrated);
            comparison.push(row);
            progress.advance();
        }
    }
    let mut life = None;
    let (mut frictions, mut friction_depths) = (Vec::new(), Vec::new());
    if balanced {
        let found = study_life(scene, study, tooth, wear, &mut totals)?;
        oracle_difference = oracle_difference.max(found.oracle_difference);
        let times = [contact_time, found.contact_time];
        frictions = friction_rows(scene, setup, times, &mut totals)?;
        // a tooth that is worn through sooner has no depth to compare
        if frictions.iter().all(|row| row.worn_through_cycles.is_nan()) {
            friction_depths = self::friction_depths(setup, contact_time)?;
        }
        life = Some(found);
    }
    let (torque, speed) = (study.calibrate.torque, study.calibrate.speed);
    let stall = match study.reading {
        Reading::TorqueBalanced => None,
        Reading::Literal => Some(Stall {
            wearing_steps,
            speed_after,
            torque_exponent: exponent(&per_cycle, |p| p.0, |p| p.1),
            speed_exponent: exponent(&per_cycle, |p| p.1, |p| p.0),
            single_cell: single_cells(study, tooth, torque, speed, scene.step.dt)?,
        }),
    };
    Ok(StudyOutcome {
        comparison,
        contact_time,
        life_contact_time: life.as_ref().map(|l| l.contact_time),
        calibrated,
        frictions,
        friction_depths,
        oracle_difference: balanced.then_some(oracle_difference),
        torque,
        speed,
        history: life.map(|l| l.history),
        totals,
        stall,
    })
}

/// Share of a tooth on its base that one update wears at most where the tooth is worn through: the cycles
/// until then are good to a few per cent.
const FINE_UPDATE: f64 = 1.0 / 16.0;
/// Remaining cycles that count as round-off, relative to the requested ones.
const ROUND_OFF: f64 = 1e-12;

/// Wear of a new tooth over the study's cycles, or until its base is worn through.
pub(super) struct Point {
    /// Depth of the deepest cell \[m\].
    pub depth: f64,
    /// Cycles after which the base is worn through; `None` if it is not.
    pub worn_through: Option<f64>,
    /// Depth of the last update \[m\].
    last_update: f64,
    /// The cycle of the new tooth.
    first: Cycle,
    /// See [`StudyOutcome::oracle_difference`]; 0 if the reading has no algebra.
    oracle_difference: f64,
}

/// Wears a new tooth by the study's cycles at a torque \[N m\] and a speed \[rad/s\].
///
/// There is no law without a tooth: it ends where a cell reaches the underside of the base. A point that
/// ends there in an update that is too long to tell when is computed again with shorter ones.
pub(super) fn operating_point(
    scene: &Scene,
    setup: &Setup<Study>,
    at: [f64; 2],
    contact_time: f64,
    totals: &mut Totals,
) -> Result<Point, RunError> {
    let new = setup.tooth.profile()?.height() + setup.tooth.base;
    let fine = FINE_UPDATE * new;
    let point = worn_point(scene, setup, at, contact_time, f64::INFINITY, totals)?;
    match point.worn_through.is_some() && point.last_update > fine {
        true => worn_point(scene, setup, at, contact_time, fine, totals),
        false => Ok(point),
    }
}

/// [`operating_point`] with updates that wear by `deepest_update` \[m\] at most.
fn worn_point(
    scene: &Scene,
    setup: &Setup<Study>,
    [torque, speed]: [f64; 2],
    contact_time: f64,
    deepest_update: f64,
    totals: &mut Totals,
) -> Result<Point, RunError> {
    let (study, tooth, wear) = (&setup.parameters, &setup.tooth, &setup.wear);
    let (update, balanced) = (study.update, study.reading == Reading::TorqueBalanced);
    let mut state = new_tooth(tooth, wear, speed, update)?;
    let mut algebra = state.clone();
    let mut first = None;
    let (mut through, mut last_update) = (None, 0.0);
    loop {
        let now = state.life().last().cycles;
        let left = study.cycles - now;
        if left <= ROUND_OFF * study.cycles || through.is_some() {
            break;
        }
        let rotor = rotor(study, state.profile(), update, torque, speed)?;
        let cycle = load_cycle(scene, rotor, contact_time, totals)?;
        let rates = state.rates(&cycle.load_slip)?;
        let rate = rates.into_iter().fold(0.0, f64::max);
        let batch = study.cycles / f64::from(study.batches);
        let cycles = batch.min(deepest_update / rate).min(left);
        let (before, lowest) = (deepest(&state), lowest(state.profile()));
        advance(&mut state, &cycle.load_slip, cycles)?;
        last_update = deepest(&state) - before;
        // in the literal reading depths mean nothing
        through = until_through(lowest, state.profile(), tooth.base)
            .filter(|_| balanced)
            .map(|part| (now + part * cycles, before + part * last_update));
        first.get_or_insert(cycle);
        if balanced {
            let profile = algebra.profile();
            let exact = oracle_load_slip(study, profile, update, torque, speed, contact_time)?;
            advance(&mut algebra, &exact, cycles)?;
        }
    }
    let mut oracle_difference: f64 = 0.0;
    if balanced {
        let scale = deepest(&algebra);
        for (ours, exact) in state.depth().iter().zip(algebra.depth()) {
            oracle_difference = oracle_difference.max((ours - exact).abs() / scale);
        }
    }
    Ok(Point {
        depth: through.map_or_else(|| deepest(&state), |(_, depth)| depth),
        worn_through: through.map(|(cycles, _)| cycles),
        last_update,
        // there is at least one batch
        first: first.unwrap_or_default(),
        oracle_difference,
    })
}

/// The part of an update after which the lowest node, at `from` \[m\] before it, reaches the underside of
/// the base, `base` \[m\] below the base line, as it sinks evenly; `None` if it does not.
fn until_through(from: f64, after: &Profile, base: f64) -> Option<f64> {
    let to = lowest(after);
    (to <= -base).then(|| ((from + base) / (from - to)).clamp(0.0, 1.0))
}

/// Height of the lowest node \[m\].
fn lowest(profile: &Profile) -> f64 {
    let heights = profile.nodes().iter().map(|p| p.y);
    heights.fold(f64::INFINITY, f64::min)
}

/// One batch of cycles; the error says what to change if the batch is too long for the profile.
fn advance(state: &mut WearState, load_slip: &[f64], cycles: f64) -> Result<(), RunError> {
    match state.advance(load_slip, cycles, 0.0) {
        Ok(_) => Ok(()),
        Err(error @ WearError::JumpTooLong { .. }) => Err(RunError::Unfit(format!(
            "{error}: take more study.batches, or study.update = \"quadratic\""
        ))),
        Err(error) => Err(error.into()),
    }
}

fn compare_point(
    study: &Study,
    torque: f64,
    speed: f64,
    point: &Point,
    calibrated: bool,
) -> ComparisonRow {
    let compared = study.cycles == 4e6 && point.worn_through.is_none();
    let published = PUBLISHED
        .iter()
        .find(|p| p.torque == torque && p.speed == speed && compared)
        .map_or(f64::NAN, |p| p.depth);
    let depth = point.depth;
    ComparisonRow {
        torque_nm: torque,
        omega_rad_s: speed,
        published_um: published * 1e6,
        computed_um: depth * 1e6,
        relative_error: depth / published - 1.0,
        calibrated: calibrated
            && torque == study.calibrate.torque
            && speed == study.calibrate.speed,
        worn_through_cycles: point.worn_through.unwrap_or(f64::NAN),
    }
}

/// Simulated time of a load cycle of the comparison \[s\]: the contact time of the torque-balanced
/// reading, given or calibrated; in the literal reading the window of the step.
fn window(scene: &Scene, setup: &Setup<Study>) -> Result<f64, RunError> {
    let study = &setup.parameters;
    match (study.reading, study.contact_time) {
        (Reading::Literal, _) => Ok(scene.step.time),
        (Reading::TorqueBalanced, Some(time)) => Ok(time),
        (Reading::TorqueBalanced, None) => calibrate(scene, setup),
    }
}

/// The contact time with which the algebra of the comparison reaches the calibration depth.
fn calibrate(scene: &Scene, setup: &Setup<Study>) -> Result<f64, RunError> {
    let target = &setup.parameters.calibrate;
    contact_time(scene, target, |time| {
        let mut at = setup.clone();
        at.parameters.cycles = target.cycles;
        depth_by_algebra(&at, [target.torque, target.speed], time)
    })
}

/// Depth \[m\] after the study's cycles at a torque \[N m\] and a speed \[rad/s\] by the algebra, in the study's
/// batches alone: the tooth must not be worn through.
///
/// # Errors
/// [`RunError`].
pub(super) fn depth_by_algebra(
    setup: &Setup<Study>,
    [torque, speed]: [f64; 2],
    contact_time: f64,
) -> Result<f64, RunError> {
    let study = &setup.parameters;
    let update = study.update;
    let cycles = study.cycles / f64::from(study.batches);
    let mut state = new_tooth(&setup.tooth, &setup.wear, speed, update)?;
    for _ in 0..study.batches {
        let profile = state.profile();
        let rates = oracle_load_slip(study, profile, update, torque, speed, contact_time)?;
        advance(&mut state, &rates, cycles)?;
    }
    Ok(deepest(&state))
}
