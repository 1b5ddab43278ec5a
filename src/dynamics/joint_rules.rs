//! How each row of a joint enters the contact problem: free term and law.

use super::model::{JointKind, JointRow, Spring};
use super::rules::{Rules, Span};
use super::visco_elastic::damper_weight;
use crate::contact::{Law, Vec2};

/// Data that the rule of a joint row depends on.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointSituation {
    pub span: Span,
    /// Rate at the start, and without impulses.
    pub gamma_a: Vec2,
    pub gamma_f: Vec2,
    /// Expected change of the gap beyond its rate over the horizon.
    pub bend: Vec2,
    /// `G_nn` of the first row [1/kg], above 0.
    pub diagonal: f64,
}

/// Returns the velocity added to `γ_F`, and the law; `None` for a row that takes no part.
///
/// With the gap `g` and its bend `n` at the midpoint and the time `h` to the next one,
///
/// ```text
/// pin, lock     γ_E + (g + n/2)/h = 0                                          (1)
/// limit         0 ≤ γ_E + b ⟂ P ≥ 0,  b = (g + n/2)/h, below 0 at most |γ_A|   (2)
/// motor         γ_E = speed, |P| ≤ F Δt                                        (3)
/// spring        P = −Δt [k (x + Δt (γ_E − γ_A)/4) + c (θ γ_E + (1 − θ) γ_A − v)]   (4)
/// ```
///
/// With `n(u_E)` in place of `n/2`, (1) would be SHAKE: no gap at the next midpoint. Without `n` it
/// closes the gap of the last turn, a step late. In a steady turn all three give the same impulses.
/// If the turn grows by `Δn` per step, the gap is 0, `n` and `n/2`, respectively. The work of a pin
/// in a step, `P·(γ_A + γ_E)/2`, then has an error of `+P·Δn/2h` with `n(u_A)` in full, of
/// `−P·Δn/2h` without it, and a smaller one with half of it, without a second solve.
///
/// The stretch in (4) is the mean `(x₋ + 2x + x₊)/4` over three midpoints, the average acceleration
/// method: order 2, conserves energy at any stiffness. `θ = 1/(1 − e^{−z}) − 1/z`, `z = c G Δt`,
/// makes the decay of a single damper exact: θ = ½ + z/12 for a weak one, order 2, and 1 for a
/// strong one, which holds its speed.
///
/// # Source
/// Ryckaert, Ciccotti & Berendsen (1977) for (1); Newmark (1959) for the stretch, Liniger &
/// Willoughby (1970) for θ.
pub(super) fn joint_rule(
    rules: &Rules,
    joint: &JointRow,
    now: &JointSituation,
) -> Option<(Vec2, Law)> {
    let horizon = now.span.horizon;
    let closing = |gap: Vec2| {
        // the published rule does not correct gaps
        if rules.corrects_gaps() {
            (gap + 0.5 * now.bend) / horizon
        } else {
            Vec2::zeros()
        }
    };
    Some(match joint.kind {
        JointKind::Pin { gap } => (closing(gap), Law::Pin),
        JointKind::Lock { gap } => (closing(Vec2::new(gap, 0.0)), BILATERAL),
        JointKind::Limit { gap } => {
            if !rules.corrects_gaps() && gap > 0.0 {
                return None;
            }
            let free = closing(Vec2::new(gap, 0.0)).x;
            (
                Vec2::new(free.max(-(-now.gamma_a.x).max(0.0)), 0.0),
                UNILATERAL,
            )
        }
        JointKind::Motor { speed, max_force } => {
            (Vec2::new(-speed, 0.0), bounded(max_force, now.span.length))
        }
        JointKind::Spring(spring) => spring_rule(&spring, now)?,
    })
}

/// The law of a row in an instant of impact. `None` for rows with only finite forces, and for a
/// limit that neither touches nor had an impulse before.
pub(super) fn joint_impact_rule(joint: &JointRow, pressed: bool) -> Option<(Vec2, Law)> {
    match joint.kind {
        JointKind::Pin { .. } => Some((Vec2::zeros(), Law::Pin)),
        JointKind::Lock { .. } => Some((Vec2::zeros(), BILATERAL)),
        JointKind::Limit { gap } if gap <= 0.0 || pressed => Some((Vec2::zeros(), UNILATERAL)),
        JointKind::Motor { speed, max_force } if max_force == f64::INFINITY => {
            Some((Vec2::new(-speed, 0.0), BILATERAL))
        }
        _ => None,
    }
}

pub(super) const BILATERAL: Law = Law::Bounded {
    lower: f64::NEG_INFINITY,
    upper: f64::INFINITY,
    compliance: 0.0,
};

pub(super) const UNILATERAL: Law = Law::Contact {
    friction: 0.0,
    compliance: 0.0,
};

fn bounded(max_force: f64, length: f64) -> Law {
    let bound = max_force * length;
    Law::Bounded {
        lower: -bound,
        upper: bound,
        compliance: 0.0,
    }
}

/// (4) of [`joint_rule`] as `γ_E + b + R P = 0`, `R = 1/(Δt² k/4 + θ c Δt)`.
fn spring_rule(spring: &Spring, now: &JointSituation) -> Option<(Vec2, Law)> {
    let dt = now.span.length;
    // `k` and `c` are per unit mass
    let mass = if spring.per_mass {
        1.0 / now.diagonal
    } else {
        1.0
    };
    let (k, c) = (mass * spring.stiffness, mass * spring.damping);
    let theta = damper_weight(c * now.diagonal * dt);
    let gain = 0.25 * dt * dt * k + theta * c * dt;
    if gain <= 0.0 {
        return None;
    }
    let rate = now.gamma_a.x;
    // P at γ_E = 0
    let at_rest =
        -dt * (k * (spring.stretch - 0.25 * dt * rate) + c * ((1.0 - theta) * rate - spring.speed));
    let bound = spring.max_force * dt;
    let law = Law::Bounded {
        lower: -bound,
        upper: bound,
        compliance: 1.0 / gain,
    };
    Some((Vec2::new(-at_rest / gain, 0.0), law))
}
