//! Glocker's woodpecker toy.

use super::event_driven::event_driven;
use super::{Measure, Samples};
use crate::scene::Scene;

/// Instants \[s\] at which the woodpecker's angle `phi_s` rises through zero, the time between the
/// first two, and the sleeve's height `y` \[m\] at 0.1 and 0.2 s, all compared with [`event_driven`].
/// Measures of instants after the end of the run are left out.
///
/// # Source
/// Glocker, *Set-Valued Force Laws* (2001).
pub(super) fn woodpecker(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let Some(block) = &scene.linear else {
        return Vec::new();
    };
    let coordinate = |name: &str| block.coordinates.iter().position(|c| c == name);
    let (Some(sleeve), Some(woodpecker)) = (coordinate("y"), coordinate("phi_s")) else {
        return Vec::new();
    };
    let Some(exact) = event_driven(block, s.time[s.time.len() - 1]) else {
        return Vec::new();
    };
    let of_run = |k: usize| -> Vec<(f64, f64)> {
        let value = |(t, state): (&f64, &Vec<_>)| (*t, value_of(&state[k]));
        s.time.iter().zip(&s.states).map(value).collect()
    };
    let of_exact =
        |k: usize| -> Vec<(f64, f64)> { exact.iter().map(|(t, q)| (*t, q[k])).collect() };
    let [computed, expected] = [of_run(woodpecker), of_exact(woodpecker)].map(upward_crossings);
    let mut out = Vec::new();
    let names = ["crossing-1", "crossing-2"];
    for ((name, a), b) in names.into_iter().zip(&computed).zip(&expected) {
        out.push(Measure::relative(name, *a, *b));
    }
    if let ([a, b, ..], [c, d, ..]) = (&computed[..], &expected[..]) {
        out.push(Measure::relative("period", b - a, d - c));
    }
    let paths = [of_run(sleeve), of_exact(sleeve)];
    for (name, time) in [("height-0.1s", 0.1), ("height-0.2s", 0.2)] {
        if let [Some(a), Some(b)] = [at(&paths[0], time), at(&paths[1], time)] {
            out.push(Measure::relative(name, a, b));
        }
    }
    out
}

fn value_of((pose, _): &(crate::dynamics::Pose64, crate::contact::Vec3)) -> f64 {
    pose.translation.x
}

/// Instants at which a path of points (t, x) rises through zero; linear between points.
fn upward_crossings(path: Vec<(f64, f64)>) -> Vec<f64> {
    path.windows(2)
        .filter(|w| w[0].1 < 0.0 && w[1].1 >= 0.0)
        .map(|w| w[0].0 + (w[1].0 - w[0].0) * w[0].1 / (w[0].1 - w[1].1))
        .collect()
}

/// The path's value at `time`, linear between points; `None` beyond its end.
fn at(path: &[(f64, f64)], time: f64) -> Option<f64> {
    let after = path.iter().position(|(t, _)| *t >= time)?;
    let (t, x) = path[after];
    let (s, y) = path[after.checked_sub(1)?];
    Some(y + (x - y) * (time - s) / (t - s))
}
