//! The resolution of gaps, by what a certified solution leaves of them.

use super::interval::Interval;
use super::model::NormalLaw;

/// Gap that counts as zero, in multiples of the way that the residual of a certified solution lets a
/// contact move in a step. Smaller gaps are noise of the solver. As input of the next step they would
/// make a pile at rest a new problem in every step: with a factor of 1 it settles in half of the
/// steps, from about 5 on in nearly all.
const NOISE: f64 = 10.0;

/// Sets the velocity \[m/s\] that counts as zero for each body, and widens the resolution of each rigid
/// contact's gap,
///
/// ```text
/// v = τ a Δt        g = 10 v Δt                                             (1)
/// ```
///
/// with the tolerance `τ` of the solver and the acceleration `a = |F/m|` of the body \[m/s²\], the
/// larger one of both for a contact. `v` is the residual velocity that a certificate allows where `a`
/// alone loads the contacts.
pub(super) fn widen_gap_noise(interval: &mut Interval, tolerance: f64, dt: f64) {
    interval.noise.clear();
    let noise = (interval.accelerations.iter()).map(|a| tolerance * a.xy().norm() * dt);
    interval.noise.extend(noise);
    for contact in &mut interval.detection.contacts {
        if let NormalLaw::Rigid { .. } = contact.law {
            let noise = noise_of(contact.rows.bodies, &interval.noise);
            contact.gap_noise = contact.gap_noise.max(NOISE * noise * dt);
        }
    }
}

/// The larger `noise` of both bodies, 0 where it is not known.
pub(super) fn noise_of(bodies: [u32; 2], noise: &[f64]) -> f64 {
    let [a, b] = bodies.map(|body| noise.get(body as usize).copied().unwrap_or(0.0));
    a.max(b)
}
