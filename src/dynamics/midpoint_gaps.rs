//! Gaps of contacts from one midpoint to the next, and the sizes that they are compared with.

use super::interval::{Interval, movable};
use super::model::ContactPoint;
use super::solution::Solution;
use crate::contact::{NO_BODY, Rows, Vec3};

/// Largest displacement of a body in a step, as a share of its size: the problem of the displacements is linear.
pub(super) const STRIDE: f64 = 0.1;

/// Opening \[m\] of a contact from the midpoint of the step to the next one, `Δt γ_E`.
///
/// `path` has the mean velocities of all bodies between the two, if the impacts of some are located in
/// time: only for these they are not those at the end. What meets after the end of the step is then an
/// impact to come.
pub(super) fn opening(
    contact: &ContactPoint,
    interval: &Interval,
    solution: &Solution,
    path: Option<&[Vec3]>,
) -> f64 {
    let (dt, closing) = (interval.length, contact.rows.velocity(&solution.end).x);
    let mean = path.map_or(closing, |path| contact.rows.velocity(path).x);
    match mean == closing {
        true => dt * closing,
        false => (dt * mean).max(dt * mean - 0.5 * dt * closing),
    }
}

/// Twice the lever of a contact or joint on the smaller of its movable bodies \[m\]: at most the diameter of a
/// circle about the centre of mass that contains the body.
pub(super) fn least_size(rows: &Rows, inverse_mass: &[Vec3]) -> f64 {
    least_size_squared(rows, inverse_mass).sqrt()
}

/// The square of [`least_size`] \[m²\].
#[inline]
pub(super) fn least_size_squared(rows: &Rows, inverse_mass: &[Vec3]) -> f64 {
    let bodies = movable(rows.bodies, inverse_mass);
    let levers = (0..2).filter(|&side| bodies[side] != NO_BODY).map(|side| {
        let [n, t] = rows.jacobian[side];
        n.z * n.z + t.z * t.z
    });
    // a point has no size
    let levers = levers.filter(|lever| *lever > 0.0);
    4.0 * levers.fold(f64::INFINITY, f64::min)
}
