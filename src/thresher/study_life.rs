//! The life of the study's tooth, worn cell by cell along its normals.
//!
//! Separate from the comparison with the study's table, which refits a quadratic after every
//! update: that spreads a scar over the tooth and adds steel at its tip. Here wear is as in the
//! thresher: the worn profile stays within the new one. The literal reading has no life, as the
//! impulse distribution over its cells is not unique.

use super::blocks::{Study, Tooth, Update, Wear};
use super::contact_time::contact_time;
use super::operation;
use super::study_rotor::{deepest, load_cycle, new_tooth, oracle_load_slip, rotor};
use super::wear_history::WearHistory;
use crate::experiment::{RunError, Totals};
use crate::scene::Scene;
use crate::wear::{JumpRule, Profile, WearState};
use std::f64::consts::TAU;

/// Longest jump \[cycles\]; the depth bound of a jump is reached long before.
const LONGEST_JUMP: f64 = 1e12;
/// Remaining cycles that count as round-off, relative to the requested ones.
const ROUND_OFF: f64 = 1e-9;

/// The life of one tooth at the calibration's torque and speed.
pub(super) struct StudyLife {
    pub history: WearHistory,
    /// Contact time of one cycle \[s\]: that of the file, or the one with which the depth is the
    /// published one in this computation.
    pub contact_time: f64,
    /// Largest difference of a node's wear in a cycle between the stepper and the algebra, relative
    /// to the largest wear of a node.
    pub oracle_difference: f64,
}

/// Wears the tooth of the torque-balanced reading until the last limit or the longest time is
/// reached, or its base is worn through.
///
/// # Errors
/// [`RunError`].
pub(super) fn study_life(
    scene: &Scene,
    study: &Study,
    tooth: &Tooth,
    wear: &Wear,
    totals: &mut Totals,
) -> Result<StudyLife, RunError> {
    let (torque, speed) = (study.calibrate.torque, study.calibrate.speed);
    let algebra = |profile: &Profile, time: f64| {
        oracle_load_slip(study, profile, Update::Normal, torque, speed, time)
    };
    let contact_time = match study.contact_time {
        Some(time) => time,
        None => contact_time(scene, &study.calibrate, |time| {
            let mut state = new_tooth(tooth, wear, speed, Update::Normal)?;
            let cycle = |profile: &Profile| Ok(algebra(profile, time)?);
            let most = study.calibrate.cycles;
            wear_on(&mut state, tooth, wear, [most; 2], |_| false, cycle, |_| ())?;
            Ok(deepest(&state))
        })?,
    };
    let mut oracle_difference: f64 = 0.0;
    let cycle = |profile: &Profile| {
        let rotor = rotor(study, profile, Update::Normal, torque, speed)?;
        let cycle = load_cycle(scene, rotor, contact_time, totals)?;
        let exact = algebra(profile, contact_time)?;
        let scale = exact.iter().copied().fold(0.0, f64::max);
        for (ours, exact) in cycle.load_slip.iter().zip(&exact) {
            oracle_difference = oracle_difference.max((ours - exact).abs() / scale);
        }
        Ok(cycle.load_slip)
    };
    let history = history(study, tooth, wear, cycle)?;
    Ok(StudyLife {
        history,
        contact_time,
        oracle_difference,
    })
}

/// The life by the algebra alone, without the stepper, at a contact time \[s\].
///
/// # Errors
/// [`RunError`].
pub(super) fn life_by_algebra(
    study: &Study,
    tooth: &Tooth,
    wear: &Wear,
    contact_time: f64,
) -> Result<WearHistory, RunError> {
    let (torque, speed) = (study.calibrate.torque, study.calibrate.speed);
    history(study, tooth, wear, |profile: &Profile| {
        let update = Update::Normal;
        Ok(oracle_load_slip(
            study,
            profile,
            update,
            torque,
            speed,
            contact_time,
        )?)
    })
}

/// The history of a tooth that `cycle` wears, as [`wear_on`] has it, at the calibration's speed.
fn history(
    study: &Study,
    tooth: &Tooth,
    wear: &Wear,
    cycle: impl FnMut(&Profile) -> Result<Vec<f64>, RunError>,
) -> Result<WearHistory, RunError> {
    let speed = study.calibrate.speed;
    let mut state = new_tooth(tooth, wear, speed, Update::Normal)?;
    let mut history = WearHistory::default();
    history.add_profile(1, &state);
    // without limits: above every height, so that the study's cycles are enough
    let heights = wear.limits.iter().map(|l| l.height);
    let lowest = heights.fold(f64::INFINITY, f64::min);
    let done = |state: &WearState| {
        let now = state.life().last();
        now.cycles >= study.cycles * (1.0 - ROUND_OFF) && now.height <= lowest
    };
    // the history gets a point at the published depth
    let longest = wear.max_hours * 3600.0 * speed / TAU;
    let stops = [study.calibrate.cycles, longest];
    let last = wear_on(&mut state, tooth, wear, stops, done, cycle, |state| {
        history.add_profile(1, state);
    })?;
    state.close(&last)?;
    history.close(1, &state, &wear.limits)?;
    let through = operation::worn_through(&history, state.life(), tooth.base);
    // of no interest to a tooth that is replaced at its last limit
    history.add_limits(1, (through.hours.is_some()).then_some(through));
    Ok(history)
}

/// Wears a tooth jump by jump, until `done`, the last of `stops`, no wear, or a base that is worn
/// through.
///
/// # Arguments
/// - `stops`: cycles at which a jump ends, whatever its depth; the computation ends at the second.
/// - `cycle`: `load_slip` of one cycle [N m] on the nodes of a profile; `after` receives each jump.
///
/// # Returns
/// `load_slip` of the final profile.
fn wear_on(
    state: &mut WearState,
    tooth: &Tooth,
    wear: &Wear,
    stops: [f64; 2],
    done: impl Fn(&WearState) -> bool,
    mut cycle: impl FnMut(&Profile) -> Result<Vec<f64>, RunError>,
    mut after: impl FnMut(&WearState),
) -> Result<Vec<f64>, RunError> {
    let rule = JumpRule {
        cycles: LONGEST_JUMP,
        depth: wear.jump,
        stability: 1.0,
    };
    loop {
        let load_slip = cycle(state.profile())?;
        let now = state.life().last().cycles;
        let left = stops.map(|stop| stop - now);
        let ended = left[1] <= ROUND_OFF * stops[1];
        let worn_through = state.profile().nodes().iter().any(|p| p.y <= -tooth.base);
        let idle = load_slip.iter().all(|s| *s == 0.0);
        if ended || worn_through || idle || done(state) {
            return Ok(load_slip);
        }
        // the loads are given, and fall with the overlap of 8 mm alone
        let jump = state.next_jump(&rule, &load_slip, 0.0)?;
        let mut cycles = jump.cycles.min(left[1]);
        if left[0] > ROUND_OFF * stops[0] {
            cycles = cycles.min(left[0]);
        }
        state.advance(&load_slip, cycles, 0.0)?;
        after(state);
    }
}
