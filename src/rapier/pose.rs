//! Poses between rapier's `f32` and ours.

use super::engine::math::{Pose, Real, Rotation, Vector};
use super::widen::{widen, widen_state};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

impl Pose64 {
    /// A pose from rapier's rounded one, its rotation normalised.
    pub fn from_rapier(pose: &Pose) -> Self {
        Pose64::read(pose, widen)
    }

    /// Like [`Self::from_rapier`], for the pose of a body: read whenever the user moves the body,
    /// so fast.
    #[inline]
    pub(super) fn from_rapier_body(pose: &Pose) -> Self {
        Pose64::read(pose, widen_state)
    }

    #[inline(always)]
    fn read(pose: &Pose, widen: impl Fn(Real) -> f64) -> Self {
        let (cos, sin) = (f64::from(pose.rotation.re), f64::from(pose.rotation.im));
        let length = length(cos, sin);
        Pose64 {
            translation: Vec2::new(widen(pose.translation.x), widen(pose.translation.y)),
            cos: cos / length,
            sin: sin / length,
        }
    }

    /// Rounds the pose for rapier.
    pub fn to_rapier(self) -> Pose {
        Pose::from_parts(
            Vector::new(self.translation.x as Real, self.translation.y as Real),
            Rotation::from_cos_sin_unchecked(self.cos as Real, self.sin as Real),
        )
    }
}

/// `√(x² + y²)` of single-precision numbers: correctly rounded but for one case in millions, and
/// the same on every machine.
///
/// # Source
/// Borges, "Algorithm 1014: an improved algorithm for hypot(x, y)", *ACM TOMS* 47 (2021), the
/// variant without fused multiply-add.
#[cfg(not(feature = "f64"))]
fn length(x: f64, y: f64) -> f64 {
    let (x, y) = (x.abs().max(y.abs()), x.abs().min(y.abs()));
    let h = (x * x + y * y).sqrt();
    // computes both candidates and selects one: a branch would be mispredicted
    let (dy, dx) = (h - y, h - x);
    let steep = x * (2.0 * dy - x) + (dy - 2.0 * (x - y)) * dy;
    let flat = 2.0 * dx * (x - 2.0 * y) + ((4.0 * dx - y) * y + dx * dx);
    h - if h <= 2.0 * y { steep } else { flat } / (2.0 * h)
}

#[cfg(feature = "f64")]
fn length(x: f64, y: f64) -> f64 {
    x.hypot(y)
}

#[cfg(all(test, not(feature = "f64")))]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn length_is_that_of_hypot(x in any::<f32>(), y in any::<f32>(), angle in -4.0f32..4.0) {
            prop_assume!(x.is_finite() && y.is_finite() && (x, y) != (0.0, 0.0));
            for (x, y) in [(x, y), (angle.cos(), angle.sin())] {
                let (x, y) = (f64::from(x), f64::from(y));
                let error = length(x, y) - x.hypot(y);
                prop_assert!(error.abs() <= f64::EPSILON * x.hypot(y));
            }
        }
    }
}
