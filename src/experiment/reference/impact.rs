//! Bounces and impacts, alone and many at once.
//!
//! # Source
//! Newton's law of restitution, for many contacts at once as in Glocker, *Set-Valued Force Laws*
//! (2001), ch. 8: every contact reverses its own relative velocity, `γ_E = −e γ_A`.

use super::{Measure, Samples, down, find, mass, restitution};
use crate::contact::Vec3;
use crate::dynamics::Pose64;
use crate::scene::{Scene, Shape};

/// Apex 3 at `e⁶ h`, rest at `√(2h/g) (1+e)/(1−e)`.
pub(super) fn bouncing_ball(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(floor), Some(ball)) = (find(scene, "floor"), find(scene, "ball")) else {
        return Vec::new();
    };
    let (Shape::Disc { radius }, Shape::Box { height, .. }) =
        (&scene.bodies[ball].shape, &scene.bodies[floor].shape)
    else {
        return Vec::new();
    };
    let e = restitution(scene, floor, ball);
    let g = down(scene);
    let top = scene.bodies[floor].position[1] + 0.5 * height + radius;
    let h = scene.bodies[ball].position[1] - top;
    let mut out = Vec::new();
    let energy_height =
        |(pose, u): &(Pose64, Vec3)| pose.translation.y - top + u.y * u.y / (2.0 * g);
    let mut bounces = 0;
    for k in 1..s.states.len() {
        let (before, after) = (s.states[k - 1][ball].1.y, s.states[k][ball].1.y);
        bounces += usize::from(before < 0.0 && after > 0.0);
        if bounces == 3 {
            let apex = energy_height(&s.states[k][ball]);
            out.push(Measure::relative("apex-3", apex, e.powi(6) * h));
            break;
        }
    }
    // With event location, the ball is at rest after the last located impact. Without, it is at rest
    // from the step after which its energy stays below a millionth of the initial one.
    let moving = s
        .states
        .iter()
        .rposition(|state| energy_height(&state[ball]).abs() > 1e-6 * h);
    if let Some(k) = moving
        && k + 1 < s.time.len()
        && e < 1.0
    {
        let exact = (2.0 * h / g).sqrt() * (1.0 + e) / (1.0 - e);
        out.push(Measure::relative(
            "rest-time",
            s.settled
                .filter(|_| scene.step.events)
                .unwrap_or(s.time[k + 1]),
            exact,
        ));
    }
    out
}

/// `v₁' = (m₁ − e m₂) v/(m₁ + m₂)`, `v₂' = (1 + e) m₁ v/(m₁ + m₂)`.
pub(super) fn two_balls(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(a), Some(b)) = (find(scene, "striker"), find(scene, "target")) else {
        return Vec::new();
    };
    let (Some(m1), Some(m2)) = (mass(scene, a), mass(scene, b)) else {
        return Vec::new();
    };
    let (v, e) = (scene.bodies[a].velocity[0], restitution(scene, a, b));
    // against the striker's speed: one of the two may come to rest
    let speed = |k: usize, exact: f64, name| Measure::over(name, s.last()[k].1.x, exact, v.abs());
    vec![
        speed(a, (m1 - e * m2) * v / (m1 + m2), "striker-speed"),
        speed(b, (1.0 + e) * m1 * v / (m1 + m2), "target-speed"),
    ]
}

/// The last ball leaves with the striker's speed, and all others are at rest.
pub(super) fn cradle(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let Some(striker) = find(scene, "striker") else {
        return Vec::new();
    };
    let v = scene.bodies[striker].velocity[0];
    let order = {
        let mut order: Vec<usize> = (0..scene.bodies.len()).collect();
        let x = |k: &usize| scene.bodies[*k].position[0];
        order.sort_by(|a, b| x(a).total_cmp(&x(b)));
        order
    };
    let last = order[order.len() - 1];
    let others = order[..order.len() - 1]
        .iter()
        .map(|&k| s.last()[k].1.x.abs())
        .fold(0.0, f64::max);
    vec![
        Measure::relative("last-speed", s.last()[last].1.x, v),
        Measure::over("others-at-rest", others, 0.0, v.abs()),
    ]
}

/// One ball hits a row of balls that touch, at speed v; all n balls are equal. The others then leave
/// together with `w = (1 + e) v/n`, and the first has `w − e v`.
///
/// This follows from the momentum and from `γ_E = −e γ_A`: the relative velocity is `e v` at the
/// contact that was hit, and 0 at all contacts that were at rest.
pub(super) fn touching_balls(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let Some(striker) = find(scene, "striker") else {
        return Vec::new();
    };
    let others: Vec<usize> = (0..scene.bodies.len()).filter(|&k| k != striker).collect();
    let Some(&first) = others.first() else {
        return Vec::new();
    };
    let v = scene.bodies[striker].velocity[0];
    let e = restitution(scene, striker, first);
    let together = (1.0 + e) * v / scene.bodies.len() as f64;
    let speed = |k: usize| s.last()[k].1.x;
    let off = |k: &usize| (speed(*k) - together).abs();
    let worst = others.iter().max_by(|a, b| off(a).total_cmp(&off(b)));
    let measure = |name, computed: f64, exact: f64| Measure::over(name, computed, exact, v.abs());
    vec![
        measure("striker-speed", speed(striker), together - e * v),
        measure(
            "others-speed",
            worst.map_or(f64::NAN, |&k| speed(k)),
            together,
        )
        .of_motion(),
    ]
}

/// Elastic balls without friction or forces: `E = E₀`.
pub(super) fn elastic_gas(_: &Scene, s: &Samples) -> Vec<Measure> {
    let Some(&start) = s.energy.first() else {
        return Vec::new();
    };
    vec![Measure::absolute(
        "energy-drift",
        "1",
        s.energy_drift(start),
        0.0,
    )]
}
