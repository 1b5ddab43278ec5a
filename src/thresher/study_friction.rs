//! Depth and life of the study's tooth by friction, at a contact time that is held.
//!
//! A contact time fitted anew at every friction would give the published depth every time, and so
//! hide what friction does.

use super::blocks::{Study, Wear};
use super::machine::Setup;
use super::rows::{FrictionDepthRow, FrictionRow};
use super::study::{depth_by_algebra, operating_point};
use super::study_life::life_by_algebra;
use crate::experiment::{RunError, Totals};
use crate::scene::Scene;

/// The published lives \[h\] by friction: Ibrahim, Shash & Abboud (2025), doi
/// 10.30493/das.2024.485466. For a friction of 0.18 only cycles are printed; for 0.35 the study also
/// says 31 h.
pub(super) const PUBLISHED_LIVES: [(f64, f64); 5] = [
    (0.14, 64.0),
    (0.25, 27.0),
    (0.30, 31.0),
    (0.35, 14.0),
    (0.40, 20.0),
];

/// What the study also says of a friction of 0.35 \[h\].
pub(super) const ALSO: (f64, f64) = (0.35, 31.0);

/// Published ranges of the depth \[µm\] after 4e6 cycles at two frictions, for torques from 20.87 to 54.37 N m:
/// as [`PUBLISHED_LIVES`].
const PUBLISHED_DEPTHS: [(f64, [f64; 2]); 2] = [(0.14, [492.0, 718.0]), (0.40, [2569.0, 2850.0])];
/// The torques \[N m\] of those ranges.
const THEIR_TORQUES: [f64; 2] = [20.87, 54.37];

/// One row for each of the study's frictions and the two torques of the published ranges, by the algebra, at
/// the calibration's speed and a contact time \[s\]; none where these torques are above that of the calibration,
/// at which the tooth is known to last.
///
/// # Errors
/// [`RunError`].
pub(super) fn friction_depths(
    setup: &Setup<Study>,
    contact_time: f64,
) -> Result<Vec<FrictionDepthRow>, RunError> {
    let mut rows = Vec::new();
    if setup.parameters.calibrate.torque < THEIR_TORQUES[1] {
        return Ok(rows);
    }
    for torque in THEIR_TORQUES {
        for &friction in &setup.parameters.frictions {
            let mut at = setup.clone();
            at.parameters.friction = friction;
            let speed = at.parameters.calibrate.speed;
            let depth = depth_by_algebra(&at, [torque, speed], contact_time)?;
            let compared = at.parameters.cycles == 4e6;
            let of = |row: &&(f64, [f64; 2])| row.0 == friction && compared;
            let published = PUBLISHED_DEPTHS.iter().find(of);
            let [least, most] = published.map_or([f64::NAN; 2], |(_, range)| *range);
            rows.push(FrictionDepthRow {
                friction,
                torque_nm: torque,
                omega_rad_s: speed,
                computed_um: 1e6 * depth,
                published_least_um: least,
                published_most_um: most,
            });
        }
    }
    Ok(rows)
}

/// One row for each of the study's frictions, at the calibration's torque and speed: depth by the
/// stepper, life by the algebra.
///
/// # Arguments
/// - `times`: contact time of a cycle \[s\] for the depth and for the life.
///
/// # Errors
/// [`RunError`].
pub(super) fn friction_rows(
    scene: &Scene,
    setup: &Setup<Study>,
    times: [f64; 2],
    totals: &mut Totals,
) -> Result<Vec<FrictionRow>, RunError> {
    let mut rows = Vec::new();
    for &friction in &setup.parameters.frictions {
        let mut at = setup.clone();
        at.parameters.friction = friction;
        let Study { calibrate, .. } = at.parameters;
        let (torque, speed) = (calibrate.torque, calibrate.speed);
        let point = operating_point(scene, &at, [torque, speed], times[0], totals)?;
        let published = PUBLISHED_LIVES.iter().find(|(of, _)| *of == friction);
        rows.push(FrictionRow {
            friction,
            torque_nm: torque,
            omega_rad_s: speed,
            computed_um: 1e6 * point.depth,
            life_hours: life(&at, times[1])?,
            published_hours: published.map_or(f64::NAN, |(_, hours)| *hours),
            worn_through_cycles: point.worn_through.unwrap_or(f64::NAN),
        });
    }
    Ok(rows)
}

/// Hours to the highest limit; NaN without limits, or if it is not reached.
fn life(setup: &Setup<Study>, contact_time: f64) -> Result<f64, RunError> {
    let heights = setup.wear.limits.iter().map(|l| l.height);
    let highest = heights.fold(f64::NEG_INFINITY, f64::max);
    if highest == f64::NEG_INFINITY {
        return Ok(f64::NAN);
    }
    // the life ends at the first limit
    let wear = Wear {
        limits: setup
            .wear
            .limits
            .iter()
            .filter(|l| l.height == highest)
            .cloned()
            .collect(),
        ..setup.wear.clone()
    };
    let found = life_by_algebra(&setup.parameters, &setup.tooth, &wear, contact_time)?;
    Ok(found
        .crossings
        .first()
        .and_then(|c| c.hours)
        .unwrap_or(f64::NAN))
}
