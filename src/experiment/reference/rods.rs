//! A thin rod that stands on a floor with one tip. The tip sticks, slides without friction, or jams.

use super::motion::{integrate, turned_towards};
use super::{Measure, Samples, down, find, friction};
use crate::contact::Vec2;
use crate::scene::{Scene, Shape};

/// A rod that stands on the lower of its ends.
struct Standing {
    body: usize,
    /// Half length `l` \[m\], mass \[kg\], inertia about the centre [kg m²].
    half: f64,
    mass: f64,
    inertia: f64,
    /// Angle from the horizontal \[rad\], in (0, π), and its rate \[rad/s\].
    angle: f64,
    rate: f64,
}

impl Standing {
    fn of(scene: &Scene) -> Option<Standing> {
        let body = find(scene, "rod")?;
        let rod = &scene.bodies[body];
        let Shape::Rod { length } = rod.shape else {
            return None;
        };
        let (mass, inertia) = rod.mass_and_inertia()?;
        Some(Standing {
            body,
            half: 0.5 * length,
            mass,
            inertia,
            angle: rod.angle,
            rate: rod.spin,
        })
    }

    fn end_angle(&self, s: &Samples, exact: f64) -> f64 {
        turned_towards(s.last()[self.body].0.angle(), exact)
    }

    /// The lower end \[m\].
    fn tip(&self, s: &Samples, k: usize) -> Vec2 {
        s.states[k][self.body].0.apply(Vec2::new(-self.half, 0.0))
    }
}

/// The rod falls about a tip that sticks: `(J + m l²) θ̈ = −m g l cos θ`.
pub(super) fn stuck_rod(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let Some(rod) = Standing::of(scene) else {
        return Vec::new();
    };
    let (m, l, g) = (rod.mass, rod.half, down(scene));
    let k = m * g * l / (rod.inertia + m * l * l);
    let end = s.time[s.time.len() - 1];
    let [exact, _] = integrate(
        |&[angle, rate]| [rate, -k * angle.cos()],
        [rod.angle, rod.rate],
        end,
    );
    let drift = (rod.tip(s, s.states.len() - 1) - rod.tip(s, 0)).norm();
    vec![
        Measure::absolute("angle", "rad", rod.end_angle(s, exact), exact),
        Measure::absolute("tip-drift", "m", drift, 0.0),
    ]
}

/// The rod falls on a frictionless floor. Its centre moves straight down:
/// `(J + m l² cos² θ) θ̈ = m l² sin θ cos θ θ̇² − m g l cos θ`.
pub(super) fn falling_rod(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let Some(rod) = Standing::of(scene) else {
        return Vec::new();
    };
    let (m, l, g) = (rod.mass, rod.half, down(scene));
    let end = s.time[s.time.len() - 1];
    let fall = |&[angle, rate]: &[f64; 2]| {
        let (sin, cos) = angle.sin_cos();
        let moment = m * l * l * sin * cos * rate * rate - m * g * l * cos;
        [rate, moment / (rod.inertia + m * l * l * cos * cos)]
    };
    let [exact, _] = integrate(fall, [rod.angle, rod.rate], end);
    let drift = s.last()[rod.body].0.translation.x - scene.bodies[rod.body].position[0];
    vec![
        Measure::absolute("angle", "rad", rod.end_angle(s, exact), exact),
        Measure::absolute("centre-drift", "m", drift, 0.0),
    ]
}

/// Painlevé's rod. While the tip slides with velocity `v`, the normal force at the tip is
/// proportional to `1/p`,
///
/// ```text
/// p = 1 + (m l²/J) cos θ (cos θ + μ sgn(v) sin θ)                            (1)
/// ```
///
/// If `p < 0` no contact force is consistent with sliding, and the tip jams at once. The measure
/// compares whether the tip sticks within two steps (1 or 0) with whether `p < 0`.
///
/// # Source
/// Painlevé (1895); Génot & Brogliato, *Eur. J. Mech. A/Solids* 18 (1999).
pub(super) fn painleve(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(rod), Some(floor)) = (Standing::of(scene), find(scene, "floor")) else {
        return Vec::new();
    };
    if s.sticks.len() < 2 {
        return Vec::new();
    }
    let (sin, cos) = rod.angle.sin_cos();
    let mu = friction(scene, floor, rod.body);
    let speed = scene.bodies[rod.body].velocity[0] + rod.rate * rod.half * sin;
    let slender = rod.mass * rod.half * rod.half / rod.inertia;
    let p = 1.0 + slender * cos * (cos + mu * speed.signum() * sin);
    let truth = |b: bool| f64::from(u8::from(b));
    let jams = s.sticks[0] || s.sticks[1];
    vec![Measure::absolute(
        "jams",
        "yes or no",
        truth(jams),
        truth(p < 0.0),
    )]
}
