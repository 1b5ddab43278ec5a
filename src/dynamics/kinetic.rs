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
    mobile_sum(w, |i| 0.5 * u[i] * u[i] / w[i])
}

/// The sum over the coordinates of a body that are not locked; −0 if there are none.
pub(super) fn mobile_sum(inverse_mass: &Vec3, of: impl Fn(usize) -> f64) -> f64 {
    // −0 changes no sum. Without a loop, which the compiler would not unroll
    let term = |i: usize| if inverse_mass[i] > 0.0 { of(i) } else { -0.0 };
    term(0) + term(1) + term(2)
}
