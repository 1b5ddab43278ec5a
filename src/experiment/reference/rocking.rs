//! A block that rocks on its corners.

use super::{Measure, Samples, down, find};
use crate::scene::{Scene, Shape};

/// A block that rocks about its corners without sliding or bouncing. With half diagonal R at α from
/// the vertical and `p² = 3 g/(4 R)`,
///
/// ```text
/// ω² = 2 p² (cos(α − θ₀) − cos(α − θ))      from rest at θ₀                        (1)
/// ω⁺/ω⁻ = 1 − (3/2) sin² α                  at each landing                        (2)
/// ```
///
/// The block first lands after the time `∫ dθ/ω`. It then rises to the angle θ₁ with
/// `cos(α − θ₁) = cos α + (ω⁺/ω⁻)² (cos(α − θ₀) − cos α)`.
///
/// # Source
/// Housner, *The behavior of inverted pendulum structures during earthquakes* (1963), without his
/// approximation for slender blocks.
pub(super) fn rocking_block(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let Some(block) = find(scene, "block") else {
        return Vec::new();
    };
    let Shape::Box { width, height } = scene.bodies[block].shape else {
        return Vec::new();
    };
    let alpha = (width / height).atan();
    let p2 = 0.75 * down(scene) / (0.5 * width.hypot(height));
    let start = scene.bodies[block].angle.abs();
    // ω² at θ of a block that starts from rest at the first angle
    let fall = |from: f64, to: f64| 2.0 * p2 * ((alpha - from).cos() - (alpha - to).cos());
    let keeps = 1.0 - 1.5 * alpha.sin().powi(2);
    let peak =
        |rate2: f64, at: f64| alpha - ((alpha - at).cos() + rate2 / (2.0 * p2)).min(1.0).acos();

    let sign = scene.bodies[block].angle.signum();
    let angle = |k: usize| sign * s.states[k][block].0.angle();
    let rate = |k: usize| sign * s.states[k][block].1.z;
    let Some(k) = (1..=s.steps()).find(|&k| angle(k) <= 0.0) else {
        return Vec::new();
    };
    // a landing takes two steps, and may begin in the step before them
    let (before, after) = (k.saturating_sub(2), k + 2);
    let mut out = Vec::new();
    let share = angle(k - 1) / (angle(k - 1) - angle(k));
    let time = s.time[k - 1] + share * s.step_length(k - 1);
    // the substitution θ = θ₀ − x² removes the singularity of 1/ω at θ₀
    let landing = integral(0.0, start.sqrt(), |x| {
        2.0 * x / fall(start, start - x * x).sqrt()
    });
    out.push(Measure::relative("landing-time", time, landing));
    if after > s.steps() {
        return out;
    }
    let at_zero = |k: usize| (rate(k).powi(2) + fall(angle(k).abs(), 0.0)).sqrt();
    out.push(Measure::relative(
        "rate-kept",
        at_zero(after) / at_zero(before),
        keeps,
    ));
    if let Some(top) = (after..=s.steps()).find(|&k| rate(k) >= 0.0) {
        let found = peak(rate(top).powi(2), angle(top).abs());
        let exact = peak(keeps * keeps * fall(start, 0.0), 0.0);
        out.push(Measure::relative("first-peak", found, exact));
    }
    out
}

/// `∫ f` by Gauss's rule of three points on 200 panels: exact to round-off for a smooth `f`.
fn integral(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    const PANELS: usize = 200;
    let half = 0.5 * (to - from) / PANELS as f64;
    let node = 0.6f64.sqrt() * half;
    (0..PANELS)
        .map(|k| {
            let middle = from + (2 * k + 1) as f64 * half;
            half / 9.0 * (5.0 * f(middle - node) + 8.0 * f(middle) + 5.0 * f(middle + node))
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quadrature_is_exact_to_round_off() {
        let quarter = integral(0.0, 1.0, |x| 1.0 / (1.0 + x * x));
        assert!((quarter - std::f64::consts::FRAC_PI_4).abs() < 1e-14);
    }
}
