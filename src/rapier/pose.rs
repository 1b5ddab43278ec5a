//! Poses between rapier's `f32` and ours.

use super::engine::math::{Pose, Real, Rotation, Vector};
use super::widen::{widen, widen_state};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

impl Pose64 {
    /// From rapier's rounded pose, its rotation made a unit again.
    pub(super) fn from_rapier(pose: &Pose) -> Self {
        Pose64::read(pose, widen)
    }

    /// The same for where a body is, which is read whenever somebody moves it.
    pub(super) fn from_rapier_body(pose: &Pose) -> Self {
        Pose64::read(pose, widen_state)
    }

    fn read(pose: &Pose, widen: fn(Real) -> f64) -> Self {
        let (cos, sin) = (f64::from(pose.rotation.re), f64::from(pose.rotation.im));
        let length = cos.hypot(sin);
        Pose64 {
            translation: Vec2::new(widen(pose.translation.x), widen(pose.translation.y)),
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
