//! The rows that a joint of a rapier world adds to the contact problem.

use super::bodies::Bodies;
use super::engine::dynamics::SpringCoefficients;
use super::engine::prelude::*;
use super::widen;
use crate::contact::{Vec2, Vec3};
use crate::dynamics::{
    ContactKey, Coordinate, JointCoordinate, JointFrames, JointKind, JointPart, JointRow, Pose64,
    RowName, Spring,
};
use std::f64::consts::{PI, TAU};

/// Keys of joints are separate from those of collider pairs.
const JOINT_PAIR: u64 = u64::MAX;

/// The axes of a joint with rapier's index of its limits and motor.
pub(super) const AXES: [(JointAxis, JointCoordinate); 3] = [
    (JointAxis::LinX, JointCoordinate::X),
    (JointAxis::LinY, JointCoordinate::Y),
    (JointAxis::AngX, JointCoordinate::Angle),
];

/// A joint read into `f64`.
///
/// Supports every combination of locked, limited and motorised axes of a [`GenericJoint`]. The axes
/// are those of the frame on the first body. Two coupled linear axes are one: the distance of the
/// anchors. Locked axes and limits are rigid, unless the joint has a softness of its own, which
/// turns its locked axes into springs. A motor is the spring and damper that rapier documents, `−k
/// (x − x₀) − c (γ − v)` within its largest force, with `k` and `c` per mass of the row for
/// [`MotorModel::AccelerationBased`]. If both gains are zero the motor keeps its speed.
#[derive(Debug, Clone)]
pub(super) struct Form {
    id: u32,
    /// The joint frames on both bodies.
    frames: [Pose64; 2],
    /// Both linear axes locked and rigid: one block of two rows.
    pinned: bool,
    /// Other axes that have rows; empty for a plain pin.
    axes: Vec<Axis>,
}

/// What a joint does along one axis besides being a pin.
#[derive(Debug, Clone, Copy)]
enum Axis {
    Locked(JointCoordinate),
    /// Locked by a spring with stiffness and damping per mass.
    Soft(JointCoordinate, [f64; 2]),
    Free {
        which: JointCoordinate,
        /// Least and largest value [m or rad].
        range: Option<[f64; 2]>,
        motor: Option<Motor>,
    },
}

/// A motor in the units of its coordinate.
#[derive(Debug, Clone, Copy)]
struct Motor {
    target: f64,
    speed: f64,
    stiffness: f64,
    damping: f64,
    max_force: f64,
    per_mass: bool,
}

impl Form {
    /// Reads a joint that [`super::joint_checks::check`] has accepted.
    pub fn read(id: u32, data: &GenericJoint) -> Form {
        let soft = softness(&data.softness);
        let locked = |axis: JointAxis| data.locked_axes.contains(axis.into());
        let pinned = locked(JointAxis::LinX) && locked(JointAxis::LinY) && soft.is_none();
        let of = |(axis, which): (JointAxis, JointCoordinate)| {
            if locked(axis) {
                match soft {
                    Some(gains) => Some(Axis::Soft(which, gains)),
                    None if pinned && which != JointCoordinate::Angle => None,
                    None => Some(Axis::Locked(which)),
                }
            } else if !data.coupled_axes.contains(axis.into()) {
                free(data, axis, which)
            } else if axis == JointAxis::LinX {
                free(data, axis, JointCoordinate::Distance)
            } else {
                None
            }
        };
        Form {
            id,
            frames: [&data.local_frame1, &data.local_frame2].map(Pose64::from_rapier),
            pinned,
            axes: AXES.into_iter().filter_map(of).collect(),
        }
    }

    /// Adds the joint's rows between two bodies at their present poses, for a step of `dt` \[s\].
    pub fn push(&self, bodies: &Bodies, pair: [u32; 2], dt: f64, out: &mut Vec<JointRow>) {
        let side = |k: usize| {
            let shadow = &bodies.list[pair[k] as usize];
            let frame = shadow.pose.compose(&self.frames[k]);
            let arm = frame.translation - shadow.pose.apply(shadow.center);
            (frame, arm)
        };
        let ((first, r1), (second, r2)) = (side(0), side(1));
        let placed = Placed {
            id: self.id,
            axis: Vec2::new(first.cos, first.sin),
            other: Vec2::new(second.cos, second.sin),
            frames: JointFrames {
                bodies: pair,
                arms: [r1, r2],
                offset: second.translation - first.translation,
            },
        };
        if self.pinned {
            let moves = |k: u32| bodies.list[k as usize].inverse_mass != Vec3::zeros();
            let point = match pair.into_iter().all(moves) {
                true => placed.frames.shared_point(),
                false => placed.frames.point(),
            };
            out.push(point.lock(placed.name(JointPart::Pin), 0.0));
        }
        for axis in &self.axes {
            match *axis {
                Axis::Locked(which) => {
                    let name = placed.name(JointPart::Lock(which));
                    out.push(placed.coordinate(which).lock(name, 0.0));
                }
                Axis::Soft(which, gains) => {
                    let row = placed.coordinate(which);
                    let kind = JointKind::Spring(locking(row.value.x, gains));
                    out.push(row.driven(placed.name(JointPart::Lock(which)), kind));
                }
                Axis::Free {
                    which,
                    range,
                    motor,
                } => placed.push_free(which, range, motor, dt, out),
            }
        }
    }
}

/// Limits and motor of an axis that is not locked, if it has any.
fn free(data: &GenericJoint, axis: JointAxis, which: JointCoordinate) -> Option<Axis> {
    let range = data.limits(axis).map(|l| [bound(l.min), bound(l.max)]);
    // a range of a whole turn is no limit, in rapier either
    let range = range.filter(|[low, high]| axis != JointAxis::AngX || high - low < TAU);
    let motor = data.motor(axis).map(|motor| Motor {
        target: widen(motor.target_pos),
        speed: widen(motor.target_vel),
        stiffness: widen(motor.stiffness),
        damping: widen(motor.damping),
        max_force: bound(motor.max_force),
        per_mass: motor.model == MotorModel::AccelerationBased,
    });
    let some = range.is_some() || motor.is_some();
    some.then_some(Axis::Free {
        which,
        range,
        motor,
    })
}

/// A joint at the present poses.
struct Placed {
    id: u32,
    frames: JointFrames,
    /// The x axes of the frames on the first and the second body.
    axis: Vec2,
    other: Vec2,
}

impl Placed {
    fn coordinate(&self, which: JointCoordinate) -> Coordinate {
        match which {
            JointCoordinate::X => self.frames.along(self.axis),
            JointCoordinate::Y => self.frames.along(Vec2::new(-self.axis.y, self.axis.x)),
            JointCoordinate::Angle => self.frames.angle(self.angle()),
            JointCoordinate::Distance => self.frames.distance(),
        }
    }

    /// Angle of the second frame from the first, in (−π, π] \[rad\].
    fn angle(&self) -> f64 {
        let (sin, cos) = (
            self.axis.x * self.other.y - self.axis.y * self.other.x,
            self.axis.x * self.other.x + self.axis.y * self.other.y,
        );
        sin.atan2(cos)
    }

    fn name(&self, part: JointPart) -> RowName {
        let (kind, axis) = match part {
            JointPart::Pin => (0, None),
            JointPart::Lock(axis) => (0, Some(axis)),
            JointPart::Lower(axis) => (1, Some(axis)),
            JointPart::Upper(axis) => (2, Some(axis)),
            JointPart::Drive(axis) => (3, Some(axis)),
        };
        let axis = axis.map_or(0, |axis| axis as u64 + 1);
        RowName {
            key: ContactKey {
                pair: JOINT_PAIR,
                feature: u64::from(self.id) << 5 | axis << 2 | kind,
            },
            joint: self.id,
            part,
        }
    }

    /// Limits and motor of an axis that is not locked.
    fn push_free(
        &self,
        which: JointCoordinate,
        range: Option<[f64; 2]>,
        motor: Option<Motor>,
        dt: f64,
        out: &mut Vec<JointRow>,
    ) {
        let coordinate = self.coordinate(which);
        let angular = which == JointCoordinate::Angle;
        // the range that is left bounds the speed of a motor in this step, so that even a strong
        // motor does not drive against a limit
        let mut speeds = [f64::NEG_INFINITY, f64::INFINITY];
        if let Some([low, high]) = range {
            let mut row = coordinate;
            if angular {
                // the turn nearest to the middle of the range
                let middle = 0.5 * (low + high);
                row.value.x = middle + wrapped(row.value.x - middle);
            }
            speeds = [
                ((low - row.value.x) / dt).min(0.0),
                ((high - row.value.x) / dt).max(0.0),
            ];
            if low == high {
                out.push(row.lock(self.name(JointPart::Lock(which)), low));
            } else {
                // a distance is never below 0
                if low.is_finite() && (which != JointCoordinate::Distance || low > 0.0) {
                    out.push(row.above(self.name(JointPart::Lower(which)), low));
                }
                if high.is_finite() {
                    out.push(row.below(self.name(JointPart::Upper(which)), high));
                }
            }
        }
        if let Some(motor) = motor {
            let stretch = coordinate.value.x - motor.target;
            let stretch = if angular { wrapped(stretch) } else { stretch };
            let kind = motor.drive(stretch, speeds);
            out.push(coordinate.driven(self.name(JointPart::Drive(which)), kind));
        }
    }
}

impl Motor {
    /// The motor at this stretch, its speed clamped to `speeds`.
    fn drive(&self, stretch: f64, speeds: [f64; 2]) -> JointKind {
        let speed = self.speed.clamp(speeds[0], speeds[1]);
        let max_force = self.max_force;
        let (stiffness, damping) = (self.stiffness, self.damping);
        if stiffness == 0.0 && damping == 0.0 {
            return JointKind::Motor { speed, max_force };
        }
        JointKind::Spring(Spring {
            stretch,
            speed,
            stiffness,
            damping,
            per_mass: self.per_mass,
            max_force,
        })
    }
}

/// The spring of a locked axis with softness.
fn locking(stretch: f64, [stiffness, damping]: [f64; 2]) -> Spring {
    Spring {
        stretch,
        speed: 0.0,
        stiffness,
        damping,
        per_mass: true,
        max_force: f64::INFINITY,
    }
}

/// rapier uses its largest number for "no bound".
fn bound(value: Real) -> f64 {
    if value.abs() >= Real::MAX {
        f64::INFINITY.copysign(f64::from(value))
    } else {
        widen(value)
    }
}

/// `ω²` and `2 ζ ω` of a softness; `None` for rapier's default, which counts as rigid.
pub(super) fn softness(softness: &SpringCoefficients<Real>) -> Option<[f64; 2]> {
    let rigid = SpringCoefficients::<Real>::joint_defaults();
    if softness.natural_frequency >= rigid.natural_frequency {
        return None;
    }
    let omega = TAU * widen(softness.natural_frequency);
    let zeta = widen(softness.damping_ratio);
    Some([omega * omega, 2.0 * zeta * omega])
}

/// The angle in (−π, π] \[rad\].
fn wrapped(angle: f64) -> f64 {
    let turns = ((angle - PI) / TAU).ceil();
    angle - turns * TAU
}
