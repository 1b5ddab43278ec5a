//! A disc in a bowl, and on a plate that shakes.

use super::motion::{pendulum, turned_towards};
use super::{Measure, Samples, down, find, friction};
use crate::contact::Vec2;
use crate::scene::{Scene, Shape};

/// Angle at the end and energy of a disc of radius `r` in a bowl of radius `R`. The disc moves like
/// a pendulum of length `l = R − r`:
///
/// ```text
/// φ̈ = −(g/l) sin φ                         without friction
/// φ̈ = −(g/l) sin φ / (1 + J/(m r²))        if it rolls
/// ```
///
/// A disc with friction is assumed to roll. It must then start with `ω = −l φ̇/r`.
pub(super) fn bowl(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(bowl), Some(disc)) = (find(scene, "bowl"), find(scene, "disc")) else {
        return Vec::new();
    };
    let body = &scene.bodies[disc];
    let (&Shape::Bowl { radius }, &Shape::Disc { radius: r }, Some((m, inertia))) = (
        &scene.bodies[bowl].shape,
        &body.shape,
        body.mass_and_inertia(),
    ) else {
        return Vec::new();
    };
    let (g, length) = (down(scene), radius - r);
    let centre = Vec2::from(scene.bodies[bowl].position);
    let angle = |place: Vec2| (place.x - centre.x).atan2(centre.y - place.y);
    let start = angle(Vec2::from(body.position));
    let rate = Vec2::from(body.velocity).dot(&Vec2::new(start.cos(), start.sin())) / length;
    let slower = if friction(scene, bowl, disc) > 0.0 {
        1.0 + inertia / (m * r * r)
    } else {
        1.0
    };
    let time = s.time[s.time.len() - 1];
    let [exact, _] = pendulum(g / length / slower, [start, rate], time);
    let (pose, _) = s.last()[disc];
    let computed = turned_towards(angle(pose.translation), exact);
    // above the lowest place of the disc
    let energy = |k: usize| {
        let (pose, u) = s.states[k][disc];
        let height = pose.translation.y - centre.y + length;
        0.5 * m * u.xy().norm_squared() + 0.5 * inertia * u.z * u.z + m * g * height
    };
    vec![
        Measure::absolute("angle", "rad", computed, exact),
        Measure::relative("energy", energy(s.states.len() - 1), energy(0)),
    ]
}

/// Largest error of the height of a disc on a plate that oscillates up and down. With an
/// acceleration below g the disc stays on the plate, at `A sin ω t + r` above the plate's mean place.
pub(super) fn riding_disc(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let (Some(plate), Some(disc)) = (find(scene, "plate"), find(scene, "disc")) else {
        return Vec::new();
    };
    let (Some(swing), &Shape::Disc { radius }) =
        (scene.bodies[plate].oscillation, &scene.bodies[disc].shape)
    else {
        return Vec::new();
    };
    let rest = scene.bodies[plate].position[1] + radius;
    let worst = s
        .time
        .iter()
        .zip(&s.states)
        .map(|(t, state)| {
            let exact = rest + swing.amplitude[1] * (swing.angular_frequency * t).sin();
            (state[disc].0.translation.y, exact)
        })
        .max_by(|a, b| (a.0 - a.1).abs().total_cmp(&(b.0 - b.1).abs()));
    worst
        .map(|(computed, exact)| Measure::absolute("height", "m", computed, exact).of_motion())
        .into_iter()
        .collect()
}
