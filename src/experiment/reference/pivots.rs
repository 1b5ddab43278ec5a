//! Bodies on pivots.

use super::motion::{integrate, pendulum as swing, turned_towards};
use super::{Measure, Samples, down, find};
use crate::contact::Vec2;
use crate::scene::Scene;

/// Angle of an arm from straight down \[rad\], positive counter-clockwise.
fn from_down(arm: Vec2) -> f64 {
    arm.x.atan2(-arm.y)
}

/// A compound pendulum, `(J + m d²) φ̈ = −m g d sin φ` with `d` from pivot to centre; its energy,
/// and how far its centre strays from the circle.
pub(super) fn pendulum(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(k), [joint]) = (find(scene, "pendulum"), &scene.joints[..]) else {
        return Vec::new();
    };
    let body = &scene.bodies[k];
    let Some((m, inertia)) = body.mass_and_inertia() else {
        return Vec::new();
    };
    let (g, pivot) = (down(scene), Vec2::from(joint.at));
    let arm = Vec2::from(body.position) - pivot;
    let d = arm.norm();
    let end = s.time[s.time.len() - 1];
    let rate = m * g * d / (inertia + m * d * d);
    let [exact, _] = swing(rate, [from_down(arm), body.spin], end);
    let last = s.last()[k].0.translation - pivot;
    // above the lowest place of the centre
    let energy = |step: usize| {
        let (pose, u) = s.states[step][k];
        let height = pose.translation.y - pivot.y + d;
        0.5 * m * u.xy().norm_squared() + 0.5 * inertia * u.z * u.z + m * g * height
    };
    vec![
        Measure::absolute(
            "angle",
            "rad",
            turned_towards(from_down(last), exact),
            exact,
        ),
        Measure::relative("energy", energy(s.states.len() - 1), energy(0)),
        Measure::absolute("pin-drift", "m", last.norm(), d),
    ]
}

/// Two bodies in a chain, `a` and `b` the angles of their arms from straight down:
///
/// ```text
/// A ä + C cos(a−b) b̈ + C sin(a−b) ḃ² + G_1 sin a = 0
/// B b̈ + C cos(a−b) ä − C sin(a−b) ȧ² + G_2 sin b = 0                         (1)
/// A = J_1 + m_1 d_1² + m_2 e²,  B = J_2 + m_2 d_2²,  C = m_2 e d_2
/// G_1 = (m_1 d_1 + m_2 e) g,  G_2 = m_2 d_2 g
/// ```
///
/// with `d` from a body's upper pivot to its centre and `e` from the first pivot to the second, on
/// the line through the first body's centre. The larger error of the two angles, and the energy.
pub(super) fn double_pendulum(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(upper), Some(lower)) = (find(scene, "upper"), find(scene, "lower")) else {
        return Vec::new();
    };
    let [first, second] = &scene.joints[..] else {
        return Vec::new();
    };
    let (one, two) = (&scene.bodies[upper], &scene.bodies[lower]);
    let (Some((m1, j1)), Some((m2, j2))) = (one.mass_and_inertia(), two.mass_and_inertia()) else {
        return Vec::new();
    };
    let (g, pivots) = (down(scene), [first, second].map(|j| Vec2::from(j.at)));
    let arms = [
        Vec2::from(one.position) - pivots[0],
        Vec2::from(two.position) - pivots[1],
    ];
    let [d1, d2] = arms.map(|arm| arm.norm());
    let e = (pivots[1] - pivots[0]).norm();
    let (a, b, c) = (
        j1 + m1 * d1 * d1 + m2 * e * e,
        j2 + m2 * d2 * d2,
        m2 * e * d2,
    );
    let (g1, g2) = ((m1 * d1 + m2 * e) * g, m2 * d2 * g);
    let chain = |&[phi, psi, u, v]: &[f64; 4]| {
        let (sin, cos) = (phi - psi).sin_cos();
        let f = -c * sin * v * v - g1 * phi.sin();
        let h = c * sin * u * u - g2 * psi.sin();
        let det = a * b - c * c * cos * cos;
        [
            u,
            v,
            (b * f - c * cos * h) / det,
            (a * h - c * cos * f) / det,
        ]
    };
    let end = s.time[s.time.len() - 1];
    let start = [from_down(arms[0]), from_down(arms[1]), one.spin, two.spin];
    let exact = integrate(chain, start, end);
    // each body turns as its arm does
    let error = [(upper, 0), (lower, 1)].map(|(k, i)| {
        let turned = s.last()[k].0.angle() - scene.bodies[k].angle;
        let computed = turned_towards(start[i] + turned, exact[i]);
        Measure::absolute(["upper-angle", "lower-angle"][i], "rad", computed, exact[i])
    });
    // above the lowest state of the chain
    let energy = |step: usize| {
        let of = |k: usize, m: f64, j: f64, below: f64| {
            let (pose, u) = s.states[step][k];
            let height = pose.translation.y - pivots[0].y + below;
            0.5 * m * u.xy().norm_squared() + 0.5 * j * u.z * u.z + m * g * height
        };
        of(upper, m1, j1, d1) + of(lower, m2, j2, e + d2)
    };
    let mut out = error.to_vec();
    out.push(Measure::relative(
        "energy",
        energy(s.states.len() - 1),
        energy(0),
    ));
    out
}
