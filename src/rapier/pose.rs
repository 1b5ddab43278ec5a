use crate::contact::{Vec2, Vec3};
use rapier2d::math::{Pose, Rotation, Vector};

/// A planar rigid motion in `f64`: rotation by (cos, sin), then translation \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose64 {
    pub translation: Vec2,
    pub cos: f64,
    pub sin: f64,
}

impl Pose64 {
    /// From a position \[m\] and an angle \[rad\].
    pub fn new(translation: Vec2, angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        Pose64 {
            translation,
            cos,
            sin,
        }
    }

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
            Vector::new(self.translation.x as f32, self.translation.y as f32),
            Rotation::from_cos_sin_unchecked(self.cos as f32, self.sin as f32),
        )
    }

    /// Angle in (−π, π] \[rad\].
    pub fn angle(&self) -> f64 {
        self.sin.atan2(self.cos)
    }

    /// Turns a vector.
    pub fn rotate(&self, v: Vec2) -> Vec2 {
        Vec2::new(
            self.cos * v.x - self.sin * v.y,
            self.sin * v.x + self.cos * v.y,
        )
    }

    /// Moves a point.
    pub fn apply(&self, p: Vec2) -> Vec2 {
        self.translation + self.rotate(p)
    }

    /// The point that [`Pose64::apply`] moves to `p`.
    pub fn apply_inverse(&self, p: Vec2) -> Vec2 {
        let d = p - self.translation;
        Vec2::new(
            self.cos * d.x + self.sin * d.y,
            self.cos * d.y - self.sin * d.x,
        )
    }

    /// `self` after `local`.
    pub fn compose(&self, local: &Pose64) -> Pose64 {
        Pose64 {
            translation: self.apply(local.translation),
            cos: self.cos * local.cos - self.sin * local.sin,
            sin: self.sin * local.cos + self.cos * local.sin,
        }
    }

    /// Moves for `dt` with velocity `u` of the point `center` (in the body frame) and spin `u_z`.
    pub(super) fn advance(&mut self, u: &Vec3, center: Vec2, dt: f64) {
        let world = self.apply(center) + u.xy() * dt;
        let (sin, cos) = (u.z * dt).sin_cos();
        let (c, s) = (
            self.cos * cos - self.sin * sin,
            self.sin * cos + self.cos * sin,
        );
        // one Newton step keeps the rotation a unit over millions of steps
        let scale = 1.5 - 0.5 * (c * c + s * s);
        (self.cos, self.sin) = (c * scale, s * scale);
        self.translation = world - self.rotate(center);
    }
}
