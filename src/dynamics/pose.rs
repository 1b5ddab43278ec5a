use super::model::Configuration;
use crate::contact::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// A planar rigid motion in `f64`: rotation by (cos, sin), then translation \[m\].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
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

    /// Angle in (−π, π] \[rad\].
    pub fn angle(&self) -> f64 {
        self.sin.atan2(self.cos)
    }

    /// Rotates a vector.
    pub fn rotate(&self, v: Vec2) -> Vec2 {
        Vec2::new(
            self.cos * v.x - self.sin * v.y,
            self.sin * v.x + self.cos * v.y,
        )
    }

    /// The vector that [`Pose64::rotate`] turns into `v`.
    pub fn unrotate(&self, v: Vec2) -> Vec2 {
        Vec2::new(
            self.cos * v.x + self.sin * v.y,
            self.cos * v.y - self.sin * v.x,
        )
    }

    /// Transforms a point.
    pub fn apply(&self, p: Vec2) -> Vec2 {
        self.translation + self.rotate(p)
    }

    /// The point that [`Pose64::apply`] maps to `p`.
    pub fn apply_inverse(&self, p: Vec2) -> Vec2 {
        self.unrotate(p - self.translation)
    }

    /// The composition that applies `local` first.
    pub fn compose(&self, local: &Pose64) -> Pose64 {
        Pose64 {
            translation: self.apply(local.translation),
            cos: self.cos * local.cos - self.sin * local.sin,
            sin: self.sin * local.cos + self.cos * local.sin,
        }
    }

    /// Moves for `dt` with velocity `u` of the point `center` (in the body frame) and spin `u_z`.
    pub(crate) fn advance(&mut self, u: &Vec3, center: Vec2, dt: f64) {
        let world = self.apply(center) + u.xy() * dt;
        // most bodies of many scenes do not turn
        let turn = u.z * dt;
        let (sin, cos) = match turn == 0.0 {
            true => (turn, 1.0),
            false => turn.sin_cos(),
        };
        let (c, s) = (
            self.cos * cos - self.sin * sin,
            self.sin * cos + self.cos * sin,
        );
        // one Newton step keeps the rotation at unit length over millions of steps
        let scale = 1.5 - 0.5 * (c * c + s * s);
        (self.cos, self.sin) = (c * scale, s * scale);
        self.translation = world - self.rotate(center);
    }

    /// The numbers of [`super::MultibodyModel::configuration`]; the last is unused.
    pub(crate) fn numbers(&self) -> Configuration {
        let at = self.translation;
        [at.x, at.y, self.cos, self.sin, 0.0]
    }

    /// The pose of [`Pose64::numbers`].
    pub(crate) fn from_numbers([x, y, cos, sin, _]: &Configuration) -> Self {
        Pose64 {
            translation: Vec2::new(*x, *y),
            cos: *cos,
            sin: *sin,
        }
    }
}
