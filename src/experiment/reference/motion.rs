//! Integrates reduced equations of motion to an error far below any error that is measured.

/// The state at `time` \[s\] of `ẏ = f(y)` from `start`, by the classical Runge-Kutta method of
/// order 4 in 40 000 steps: its error on the references here is below 1e-11.
///
/// # Source
/// Hairer, Nørsett & Wanner, *Solving Ordinary Differential Equations I*, section II.1.
pub(super) fn integrate<const N: usize>(
    f: impl Fn(&[f64; N]) -> [f64; N],
    start: [f64; N],
    time: f64,
) -> [f64; N] {
    const STEPS: usize = 40_000;
    let h = time / STEPS as f64;
    let along = |y: &[f64; N], k: &[f64; N], t: f64| std::array::from_fn(|i| y[i] + t * k[i]);
    let mut y = start;
    for _ in 0..STEPS {
        let a = f(&y);
        let b = f(&along(&y, &a, 0.5 * h));
        let c = f(&along(&y, &b, 0.5 * h));
        let d = f(&along(&y, &c, h));
        y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
    }
    y
}

/// Angle and its rate at `time` \[s\] of the pendulum `φ̈ = −k sin φ`.
pub(super) fn pendulum(k: f64, start: [f64; 2], time: f64) -> [f64; 2] {
    integrate(|&[angle, rate]| [rate, -k * angle.sin()], start, time)
}

/// `angle` \[rad\] plus the number of full turns that brings it nearest to `near`.
pub(super) fn turned_towards(angle: f64, near: f64) -> f64 {
    use std::f64::consts::TAU;
    angle + TAU * ((near - angle) / TAU).round()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Period by Gauss's arithmetic-geometric mean, `T = 2π/(√k agm(1, cos(φ₀/2)))`.
    #[test]
    fn a_pendulum_comes_back_after_its_period() {
        let (k, amplitude) = (9.81_f64 / 4.5, 1.5_f64);
        let (mut a, mut b) = (1.0, (0.5 * amplitude).cos());
        for _ in 0..10 {
            (a, b) = (0.5 * (a + b), (a * b).sqrt());
        }
        let period = 2.0 * PI / (k.sqrt() * a);
        let [angle, rate] = pendulum(k, [amplitude, 0.0], period);
        // the bound that `integrate` promises
        assert!((angle - amplitude).abs() < 1e-11 && rate.abs() < 1e-11);
    }

    #[test]
    fn angles_turn_to_their_neighbour() {
        assert!((turned_towards(-3.0, 3.3) - (2.0 * PI - 3.0)).abs() < 1e-15);
        assert_eq!(turned_towards(0.5, 0.4), 0.5);
    }
}
