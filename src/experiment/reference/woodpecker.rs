//! Glocker's woodpecker toy, tabulated.

use super::{Measure, Samples};
use crate::scene::Scene;

/// Instants \[s\] at which the woodpecker's angle crosses zero upwards, and heights \[m\] of the
/// sleeve at 0.1 and 0.2 s, of the toy with the parameters and start of the catalogue's scene.
///
/// # Source
/// Model and parameters: Glocker, *Set-Valued Force Laws* (2001), section 12.4, and Glocker &
/// Studer (2005), section 5. The numbers are a converged run of Moreau's rule on that model,
/// printed to 5 and 4 digits.
const CROSSINGS: [f64; 2] = [0.07349, 0.21956];
const HEIGHTS: [(f64, f64); 2] = [(0.1, -0.007080), (0.2, -0.023884)];

/// Crossings, heights and the period between the crossings; those that the run is long enough for.
pub(super) fn woodpecker(scene: &Scene, s: &Samples) -> Vec<Measure> {
    let Some(block) = &scene.linear else {
        return Vec::new();
    };
    let coordinate = |name: &str| block.coordinates.iter().position(|c| c == name);
    let (Some(sleeve), Some(woodpecker)) = (coordinate("y"), coordinate("phi_s")) else {
        return Vec::new();
    };
    let value = |step: usize, k: usize| s.states[step][k].0.translation.x;
    // between two samples the value is taken as linear
    let between = |step: usize, share: f64, k: usize| {
        value(step, k) + share * (value(step + 1, k) - value(step, k))
    };
    let mut out = Vec::new();
    let crossings: Vec<f64> = (0..s.states.len() - 1)
        .filter(|&i| value(i, woodpecker) < 0.0 && value(i + 1, woodpecker) >= 0.0)
        .map(|i| {
            let (before, after) = (value(i, woodpecker), value(i + 1, woodpecker));
            s.time[i] + s.step_length(i) * before / (before - after)
        })
        .collect();
    let names = ["crossing-1", "crossing-2"];
    for ((name, exact), computed) in names.into_iter().zip(CROSSINGS).zip(&crossings) {
        out.push(Measure::relative(name, *computed, exact));
    }
    if let [first, second, ..] = crossings[..] {
        let exact = CROSSINGS[1] - CROSSINGS[0];
        out.push(Measure::relative("period", second - first, exact));
    }
    for (name, (time, exact)) in ["height-0.1s", "height-0.2s"].into_iter().zip(HEIGHTS) {
        let after = s.time.iter().position(|t| *t >= time);
        if let Some(i) = after.filter(|i| *i > 0) {
            let share = (time - s.time[i - 1]) / s.step_length(i - 1);
            out.push(Measure::relative(
                name,
                between(i - 1, share, sleeve),
                exact,
            ));
        }
    }
    out
}
