//! `[[joint]]`: the schema of a joint, and the rapier joint that it makes.

use crate::peers::{JointDrive, JointShape};
use serde::{Deserialize, Serialize};

/// Name of the fixed ground in joints.
pub const WORLD: &str = "world";

/// Kind of a joint, by the motion that it leaves free.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum JointKind {
    /// Turns about `at`.
    Revolute,
    /// Slides along `axis`, without turning.
    Prismatic,
    /// Nothing: as if welded at `at`.
    Fixed,
    /// The points of `anchors` are at most `length` apart.
    Rope,
    /// A spring between the points of `anchors`.
    Spring,
    /// Slides along `axis` and turns about `at`.
    PinSlot,
}

impl JointKind {
    /// The word of the file.
    pub fn word(self) -> &'static str {
        match self {
            JointKind::Revolute => "revolute",
            JointKind::Prismatic => "prismatic",
            JointKind::Fixed => "fixed",
            JointKind::Rope => "rope",
            JointKind::Spring => "spring",
            JointKind::PinSlot => "pin-slot",
        }
    }

    /// Whether it acts along the distance of two points, instead of at one point.
    pub fn is_distance(self) -> bool {
        matches!(self, JointKind::Rope | JointKind::Spring)
    }

    /// Whether it has an axis of its own.
    pub fn has_axis(self) -> bool {
        matches!(self, JointKind::Prismatic | JointKind::PinSlot)
    }
}

/// `[[joint]]`. Lengths in m, angles in rad; the free coordinate, of the second body relative to
/// the first, is 0 at the start: the angle of a revolute joint, the way along `axis` of a
/// prismatic or pin-slot one. Of a rope or spring it is the distance of its points.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct JointEntry {
    pub kind: JointKind,
    pub bodies: [String; 2],
    pub at: Option<[f64; 2]>,
    pub anchors: Option<[[f64; 2]; 2]>,
    pub axis: Option<[f64; 2]>,
    pub limits: Option<[f64; 2]>,
    pub length: Option<f64>,
    pub stiffness: Option<f64>,
    pub damping: Option<f64>,
    pub motor: Option<Motor>,
    #[serde(default)]
    pub contacts: bool,
}

/// A motor along the free coordinate: with a `speed` it holds that, with a `stiffness` it pulls to
/// `target` as a spring.
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Motor {
    /// Wanted rate of the coordinate [rad/s or m/s].
    pub speed: Option<f64>,
    /// Wanted value of it [rad or m], default 0; needs `stiffness`.
    pub target: Option<f64>,
    /// [N m/rad or N/m]
    pub stiffness: Option<f64>,
    /// [N m s/rad or N s/m], default 0; needs `stiffness`.
    pub damping: Option<f64>,
    /// Largest torque \[N m\] of a slice one metre deep, of a revolute joint; needed with a `speed`,
    /// else default none.
    pub max_torque: Option<f64>,
    /// The same of a prismatic or pin-slot joint \[N\].
    pub max_force: Option<f64>,
}

impl Motor {
    /// Largest torque or force.
    pub fn bound(&self) -> f64 {
        self.max_torque.or(self.max_force).unwrap_or(f64::INFINITY)
    }

    /// As rapier's joint expects it.
    pub(super) fn drive(&self) -> JointDrive {
        match self.stiffness {
            None => JointDrive::Motor {
                speed: self.speed.unwrap_or(0.0),
                max_force: self.bound(),
            },
            Some(stiffness) => JointDrive::Spring {
                target: self.target.unwrap_or(0.0),
                stiffness,
                damping: self.damping.unwrap_or(0.0),
                max_force: self.bound(),
            },
        }
    }
}

/// A joint and the bodies that it connects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    pub kind: JointKind,
    /// Indices into [`super::Scene::bodies`]; `None` is the world.
    pub bodies: [Option<usize>; 2],
    /// A point of each body, in the world at the start \[m\]; the same point unless a rope or spring.
    pub at: [[f64; 2]; 2],
    /// Angle of the axis in the world at the start \[rad\].
    pub axis: f64,
    pub limits: Option<[f64; 2]>,
    /// Of a rope or spring \[m\].
    pub length: f64,
    /// Of a spring [N/m] and [N s/m].
    pub spring: [f64; 2],
    pub motor: Option<Motor>,
    pub contacts: bool,
}

impl Joint {
    /// As rapier's joint expects it.
    pub(super) fn shape(&self) -> JointShape {
        match self.kind {
            JointKind::Revolute => JointShape::Revolute,
            JointKind::Prismatic => JointShape::Prismatic,
            JointKind::Fixed => JointShape::Fixed,
            JointKind::PinSlot => JointShape::PinSlot,
            JointKind::Rope => JointShape::Rope {
                length: self.length,
            },
            JointKind::Spring => JointShape::Spring {
                length: self.length,
                stiffness: self.spring[0],
                damping: self.spring[1],
            },
        }
    }
}
