//! The one constant of the torque-balanced reading: the contact time of a load cycle, fitted to one
//! published depth.

use super::blocks::Calibration;
use crate::experiment::RunError;
use crate::report::number;
use crate::scene::Scene;
use std::f64::consts::TAU;

/// Largest relative difference from the published depth.
const TOLERANCE: f64 = 1e-9;
/// The search stops at this relative width of the bracket: round-off of a life.
const ROUND_OFF: f64 = 1e-14;
const TRIALS: usize = 60;
/// First trial \[s\].
const PROBE: f64 = 1e-6;

/// The contact time \[s\] with which `depth` is that of `target`, to 1e-9 relative.
///
/// A depth is nearly proportional to the time, so each trial is the last one times target over
/// depth. If that leaves the bracket found so far, the bracket is halved.
///
/// # Arguments
/// - `depth`: largest depth \[m\] after the target's cycles, for a contact time \[s\].
///
/// # Errors
/// [`RunError::Unfit`] if no time reaches the depth, nothing wears, or the time is longer than a
/// cycle, which is one revolution; those of `depth`.
pub(super) fn contact_time(
    scene: &Scene,
    target: &Calibration,
    depth: impl Fn(f64) -> Result<f64, RunError>,
) -> Result<f64, RunError> {
    let unfit = |found: String| {
        RunError::Unfit(format!(
            "scene {}: study.calibrate.depth is {} m: no contact time of a cycle wears a tooth to \
             it in {} cycles at {} N m and {} rad/s; {found}",
            scene.name, target.depth, target.cycles, target.torque, target.speed
        ))
    };
    let first = depth(PROBE)?;
    if first <= 0.0 || !first.is_finite() {
        return Err(unfit("nothing wears there".to_owned()));
    }
    let revolution = TAU / target.speed;
    let (mut low, mut high) = (0.0, revolution);
    let mut time = (PROBE * target.depth / first).min(revolution);
    let (mut best, mut nearest, mut error) = (time, 0.0, f64::INFINITY);
    for _ in 0..TRIALS {
        let reached = depth(time)?;
        let off = (reached / target.depth - 1.0).abs();
        if off < error {
            (best, nearest, error) = (time, reached, off);
        }
        if off < ROUND_OFF || (time >= revolution && reached < target.depth) {
            break;
        }
        if reached < target.depth {
            low = time;
        } else {
            high = time;
        }
        time *= target.depth / reached;
        if !(time > low && time < high) {
            time = 0.5 * (low + high);
        }
        if time <= low || time >= high {
            // no number lies between the two ends
            time = high;
        }
    }
    if error <= TOLERANCE {
        return Ok(best);
    }
    Err(unfit(format!(
        "the nearest is {} m, with {} s of the {} s of a revolution",
        number(nearest, 6),
        number(best, 4),
        number(revolution, 4)
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thresher::load;

    fn search(depth: impl Fn(f64) -> f64) -> Result<f64, String> {
        let (scene, _) = load("thresher-study", &[]).unwrap();
        let target = Calibration {
            depth: 4e-3,
            ..Calibration::default()
        };
        contact_time(&scene, &target, |time| Ok(depth(time))).map_err(|e| e.to_string())
    }

    #[test]
    fn a_crooked_depth_is_found_as_well() {
        // linear, saturating, and one that grows so fast that the plain ratio runs away
        assert!((search(|t| 2.0 * t).unwrap() / 2e-3 - 1.0).abs() < 1e-13);
        let saturating = search(|t| 5e-3 * (1.0 - (-t / 1e-3).exp())).unwrap();
        assert!((saturating / (1e-3 * 5f64.ln()) - 1.0).abs() < 1e-9);
        let cubic = search(|t| 4e6 * t.powi(3)).unwrap();
        assert!((cubic / 1e-3 - 1.0).abs() < 1e-9, "{cubic}");
    }

    #[test]
    fn a_depth_that_no_time_reaches_is_an_error_that_says_how_near_it_came() {
        let reason = |depth: fn(f64) -> f64| search(depth).unwrap_err();
        let low = reason(|t| (2.0 * t).min(3e-3));
        for words in ["study.calibrate.depth", "0.004 m", "0.00300000 m"] {
            assert!(low.contains(words), "{low}");
        }
        // a jump over the target: the old search gave its last guess
        let jump = reason(|t| if t < 2e-3 { 3e-3 } else { 5e-3 });
        assert!(jump.contains("the nearest is"), "{jump}");
        assert!(reason(|_| 0.0).contains("nothing wears"));
        // a second of contact in a revolution of 0.09 s
        let long = reason(|t| 4e-3 * t);
        assert!(long.contains("of the 0.08976 s"), "{long}");
    }
}
