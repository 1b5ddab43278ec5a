//! Damping of a Kelvin-Voigt contact from a coefficient of restitution.

/// Damping `c` \[N s/m\] with which an impact without tension has the restitution `e`.
///
/// `c = 2 ζ √(k m)` with ζ solved from the impact `m ẍ + c ẋ + k x = 0`, which ends when the force
/// is zero, `k x + c ẋ = 0`, not at `x = 0`:
///
/// ```text
/// e(ζ) = exp(−ζ/√(1−ζ²) · atan2(2 ζ √(1−ζ²), 2 ζ² − 1))                      (1)
/// ```
///
/// The textbook `ζ = −ln e / √(π² + ln² e)` assumes adhesion and gives a restitution above `e`.
///
/// # Arguments
/// - `restitution`: e in (0, 1]; values below 1e-3 count as 1e-3.
/// - `stiffness`: k \[N/m\].
/// - `mass`: effective mass `1/G_NN` \[kg\].
///
/// # Source
/// Schwager & Pöschel, *Granular Matter* 9 (2007).
pub fn damping_for_restitution(restitution: f64, stiffness: f64, mass: f64) -> f64 {
    let target = restitution.clamp(1e-3, 1.0);
    // e falls monotonically from 1 at ζ = 0; beyond critical damping it is below 0.14
    let (mut low, mut high) = (0.0, 1.0 - 1e-9);
    for _ in 0..80 {
        let zeta = 0.5 * (low + high);
        if returned(zeta) > target {
            low = zeta;
        } else {
            high = zeta;
        }
    }
    2.0 * 0.5 * (low + high) * (stiffness * mass).sqrt()
}

fn returned(zeta: f64) -> f64 {
    let root = (1.0 - zeta * zeta).sqrt();
    (-zeta / root * (2.0 * zeta * root).atan2(2.0 * zeta * zeta - 1.0)).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integrates the impact with small steps and measures the restitution.
    #[test]
    fn impact_returns_the_restitution_asked_for() {
        for e in [0.2, 0.482, 0.9] {
            let (k, m) = (1e5, 0.02);
            let c = damping_for_restitution(e, k, m);
            let (mut x, mut v, dt) = (0.0, -1.0, 1e-8);
            while k * x + c * v < 0.0 || v < 0.0 {
                // symplectic Euler: first order in a step of 1e-5 of the contact time
                v -= dt / m * (k * x + c * v);
                x += dt * v;
            }
            assert!((v - e).abs() < 1e-4, "{e}: {v}");
        }
    }
}
