//! Poses between rapier's `f32` and ours.

use super::engine::math::{Pose, Real, Rotation, Vector};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

impl Pose64 {
    /// From rapier's rounded pose, its rotation made a unit again.
    pub(super) fn from_rapier(pose: &Pose) -> Self {
        let (cos, sin) = (f64::from(pose.rotation.re), f64::from(pose.rotation.im));
        let length = cos.hypot(sin);
        Pose64 {
            translation: Vec2::new(
                super::widen(pose.translation.x),
                super::widen(pose.translation.y),
            ),
            cos: cos / length,
            sin: sin / length,
        }
    }

    /// Rounded for rapier.
    pub(super) fn to_rapier(self) -> Pose {
        Pose::from_parts(
            Vector::new(self.translation.x as Real, self.translation.y as Real),
            Rotation::from_cos_sin_unchecked(self.cos as Real, self.sin as Real),
        )
    }
}
