//! Springs and dampers of a step: contacts of the Kelvin-Voigt law.

use super::model::{ContactPoint, NormalLaw};
use crate::contact::Vec3;

/// `κ = k G Δt²` at which half of the stretch is taken at the end of the step: half of the bound of
/// an explicit step. A smaller number damps contacts that a step resolves, a larger one lets those
/// ring that it does not.
const UNRESOLVED: f64 = 2.0;

/// The springs and dampers of all contacts that overlap, by body.
pub(super) struct Springs {
    /// `Σk` \[N/m\] and `Σc` \[N s/m\] on each body; empty without visco-elastic contacts.
    sums: Vec<[f64; 2]>,
}

impl Springs {
    /// Those of `contacts` on so many bodies.
    pub fn of(contacts: &[ContactPoint], bodies: usize) -> Springs {
        let mut sums = Vec::new();
        for contact in contacts {
            let NormalLaw::ViscoElastic { stiffness, damping } = contact.law else {
                continue;
            };
            if sums.is_empty() {
                sums.resize(bodies, [0.0; 2]);
            }
            let pressed = contact.gap <= 0.0;
            for body in contact.rows.bodies.iter().filter(|_| pressed) {
                // the world has no entry
                if let Some([k, c]) = sums.get_mut(*body as usize) {
                    (*k, *c) = (*k + stiffness, *c + damping);
                }
            }
        }
        Springs { sums }
    }

    /// `Σk G_NN` [1/s²] and `Σc G_NN` [1/s] for a contact: what each of its bodies adds to `G_NN`, times the
    /// springs and dampers on that body, at least its own.
    #[inline]
    pub fn rates(&self, contact: &ContactPoint, inverse_mass: &[Vec3]) -> [f64; 2] {
        let NormalLaw::ViscoElastic { stiffness, damping } = contact.law else {
            return [0.0; 2];
        };
        let mut rates = [0.0; 2];
        for (body, rows) in contact.rows.bodies.iter().zip(&contact.rows.jacobian) {
            let (Some(w), Some([k, c])) = (
                inverse_mass.get(*body as usize),
                self.sums.get(*body as usize),
            ) else {
                continue;
            };
            let own = rows[0].component_mul(w).dot(&rows[0]);
            rates[0] += k.max(stiffness) * own;
            rates[1] += c.max(damping) * own;
        }
        rates
    }
}

/// Kelvin-Voigt contact with the gap `g` at the midpoint,
///
/// ```text
/// P = −Δt [k (x + a Δt γ_E) + φ c (θ γ_E + (1 − θ) γ_A)],  0 ≤ P                            (1)
/// x = g + (1 − a) Δt (γ_E − γ_A)/4  for g ≤ 0,   a g  for g > 0
/// a = κ²/(κ² + 4),  κ = Σk G Δt²,  and 1 for c = 0
/// ```
///
/// as `0 ≤ γ_NE + b + R P ⟂ P ≥ 0`. For small `κ` the stretch is that of a spring between bodies, the
/// mean of three midpoints: order 2. A contact that the step does not resolve, of large `κ`, has its
/// gap closed at the next midpoint, as a rigid one. So is one without a damper, to first order: what
/// presses on it comes to rest by the damping of the step alone, and would ring for ever. `θ` is that of a damper between bodies, too.
///
/// `κ` and `z` of the damper count all springs and dampers on each of the two bodies, whatever they press
/// on: what the step resolves is the motion of a body on all of them. With its own alone each of 400
/// cells under a pad is resolved, and the pad rings for ever. Of springs along one line the sum is the
/// largest eigenvalue; across each other it is above, and the contact comes to rest earlier.
///
/// `φ` is the part of the step in which the surfaces overlap,
/// `φ = ½ − g/(Δt |γ_A|)` in [0, 1]. A damper acts from the landing on with its full force; all or
/// nothing, its impulse would be off by up to half a step's.
///
/// Active iff `g ≤ 0`, `φ > 0`, or `g + Δt γ_F ≤ 0`. The gap is used without a dead band, which would
/// lose force.
///
/// # Arguments
/// - `[stiffness, damping]`: `k`, `c`; `g`: the gap at the midpoint.
/// - `[rate, free]`: `γ_A` and `γ_F`.
/// - `rates`: `Σk G` [1/s²] and `Σc G` [1/s].
///
/// # Returns
/// `b` and `R`; `None` for a contact that takes no part.
///
/// # Source
/// Newmark (1959) for the stretch, Liniger & Willoughby (1970) for θ; a, φ are ours.
pub(super) fn visco_elastic(
    [stiffness, damping]: [f64; 2],
    g: f64,
    [rate, free]: [f64; 2],
    rates: [f64; 2],
    dt: f64,
) -> Option<(f64, f64)> {
    let part = overlapping(g, dt * rate.abs());
    if g > 0.0 && part == 0.0 && g + dt * free > 0.0 {
        return None;
    }
    let number = rates[0] * dt * dt;
    let late = match damping > 0.0 {
        // without a square, which may overflow
        true => 1.0 / (1.0 + (UNRESOLVED / number).powi(2)),
        false => 1.0,
    };
    let damping = part * damping;
    let theta = damper_weight(part * rates[1] * dt);
    let mean = if g <= 0.0 {
        0.25 * (1.0 - late) * dt
    } else {
        0.0
    };
    let stretch = if g <= 0.0 { g } else { late * g };
    let gain = stiffness * (late * dt + mean) + theta * damping;
    if gain <= 0.0 {
        return None;
    }
    // −P/Δt at γ_E = 0
    let force = stiffness * (stretch - mean * rate) + (1.0 - theta) * damping * rate;
    Some((force / gain, 1.0 / (dt * gain)))
}

/// The part of a step in which the gap is below 0, that is `g` in its middle and changes by `way`.
fn overlapping(g: f64, way: f64) -> f64 {
    if way > 0.0 {
        (0.5 - g / way).clamp(0.0, 1.0)
    } else {
        f64::from(u8::from(g <= 0.0))
    }
}

/// Weight `θ = 1/(1 − e^{−z}) − 1/z` of the velocity at the end of a step in a damper, `z = c G Δt`: from
/// ½ to 1. It makes the decay of a single damper exact.
pub(super) fn damper_weight(z: f64) -> f64 {
    if z < 1e-3 {
        // the next term is z³/720
        0.5 + z / 12.0
    } else {
        -1.0 / (-z).exp_m1() - 1.0 / z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MASS: f64 = 0.02;

    /// Position and velocity of a point mass that starts at `gap` with -1 m/s, after `time`.
    fn drop(stiffness: f64, damping: f64, gap: f64, dt: f64, time: f64) -> (f64, f64) {
        let (mut x, mut u) = (gap, -1.0);
        for _ in 0..(time / dt).round() as usize {
            let gap = x + 0.5 * dt * u;
            let law = [stiffness, damping];
            let rule = visco_elastic(law, gap, [u, u], law.map(|v| v / MASS), dt);
            let next = rule.map_or(u, |(b, compliance)| {
                let impulse = -(u + b) / (compliance + 1.0 / MASS);
                u + impulse.max(0.0) / MASS
            });
            x += 0.5 * dt * (u + next);
            u = next;
        }
        (x, u)
    }

    /// A landing and a rebound with damping, the crop of the thresher on its steel, from 20 heights:
    /// order 2, and 3e-4 of the approach at the thresher's step. With the stretch at the end of the
    /// step the error was 5e-2 there, and fell with its first power.
    #[test]
    fn a_damped_rebound_is_of_second_order() {
        let (k, c): (f64, f64) = (1.9e5, 20.0);
        let zeta = c / (2.0 * (k * MASS).sqrt());
        let root = (1.0 - zeta * zeta).sqrt();
        let exact = (-zeta / root * (2.0 * zeta * root).atan2(2.0 * zeta * zeta - 1.0)).exp();
        let worst = |dt: f64| {
            let gap = |i: i32| 2e-4 + 5e-6 * f64::from(i);
            let off = |i| (drop(k, c, gap(i), dt, 4e-3).1 - exact).abs();
            (0..20).map(off).fold(0.0, f64::max)
        };
        let errors = [8e-5, 2e-5, 5e-6].map(worst);
        assert!(errors[1] < 5e-4, "{errors:?}");
        // 16 a quarter of the step; the phase of the landing scatters it
        for pair in errors.windows(2) {
            assert!(pair[1] < pair[0] / 10.0, "{errors:?}");
        }
    }

    /// A contact that no step resolves is closed at the next midpoint, and stays: it does not ring.
    #[test]
    fn a_stiff_contact_is_a_rigid_one() {
        for (stiffness, damping) in [(1e14, 0.0), (1e14, 1e-6), (f64::MAX, 1e-6)] {
            let (dt, gap) = (1e-3, 7.7e-3);
            let (x, u) = drop(stiffness, damping, gap, dt, 0.02);
            // the overlap of the first midpoint is closed within a step
            assert!(
                x.abs() < 1e-11 && u.abs() < 1e-8,
                "{stiffness}: {x} m, {u} m/s"
            );
        }
    }

    /// With hardly any damping a landing returns at most its speed, but for the 1 % by which the phase of the
    /// landing scatters it at the longest steps that resolve it.
    #[test]
    fn an_elastic_rebound_gives_no_energy() {
        for dt in [2e-5, 1e-4, 3e-4, 1e-3, 3e-3] {
            for i in 0..20 {
                let (_, u) = drop(1.9e5, 1e-6, 2e-4 + 1e-5 * f64::from(i), dt, 0.03);
                assert!(u < 1.01, "{dt}: {u}");
            }
        }
    }

    #[test]
    fn the_weight_of_a_damper_makes_its_decay_exact() {
        for z in [1e-9, 9.99e-4, 1.001e-3, 0.1, 2.0, 30.0, 1e12] {
            let theta = damper_weight(z);
            assert!((0.5..=1.0).contains(&theta), "{z}: {theta}");
            let factor = (1.0 - (1.0 - theta) * z) / (1.0 + theta * z);
            // θ is a difference of numbers near 1/z
            let slack = 1e-15 * (1.0 + 1.0 / z.min(1.0)) + 1e-12 * z.min(1e-3);
            assert!(
                (factor - (-z).exp()).abs() <= slack.max(1e-13),
                "{z}: {factor}"
            );
        }
    }
}
