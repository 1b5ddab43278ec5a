//! Kinetic energy.

use crate::contact::Vec3;

/// `T` \[J\] of all movable bodies.
pub(super) fn kinetic(velocities: &[Vec3], inverse_mass: &[Vec3]) -> f64 {
    velocities
        .iter()
        .zip(inverse_mass)
        .map(|(u, w)| kinetic_of(u, w))
        .sum()
}

/// `T` \[J\] of one body.
pub(super) fn kinetic_of(u: &Vec3, w: &Vec3) -> f64 {
    (0..3)
        .filter(|&i| w[i] > 0.0)
        .map(|i| 0.5 * u[i] * u[i] / w[i])
        .sum()
}
