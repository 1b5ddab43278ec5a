//! rapier's impulse joints as rows of the contact problem.

use super::bodies::Bodies;
use super::engine::dynamics::SpringCoefficients;
use super::engine::prelude::*;
use super::widen;
use crate::contact::{NO_BODY, Vec2};
use crate::dynamics::{
    ContactKey, Coordinate, Detection, JointCoordinate, JointFrames, JointKind, JointPart,
    ModelError, Pose64, RowName, Spring,
};
use std::f64::consts::{PI, TAU};

/// Keys of joints live beside those of collider pairs.
const JOINT_PAIR: u64 = u64::MAX;

/// The axes of a joint with rapier's index of its limits and motor.
const AXES: [(JointAxis, JointCoordinate); 3] = [
    (JointAxis::LinX, JointCoordinate::X),
    (JointAxis::LinY, JointCoordinate::Y),
    (JointAxis::AngX, JointCoordinate::Angle),
];

/// Rows of all enabled joints at the present poses, in rapier's order.
///
/// Every combination of locked, limited and driven axes of a [`GenericJoint`] is a joint here.
/// The axes are those of the frame on the first body; both linear axes coupled are one, the
/// distance of the anchors. Locked axes and limits are rigid unless the joint has a softness of
/// its own, which makes springs of its locked axes. A motor is the spring and damper that rapier
/// documents, `−k (x − x₀) − c (γ − v)` within its largest force, `k` and `c` per mass of the row
/// for [`MotorModel::AccelerationBased`]; without both gains it holds its speed.
///
/// # Errors
/// [`ModelError::Unsupported`] for multibody joints and couplings that are no distance,
/// [`ModelError::Invalid`] for numbers that make no joint; both name the joint.
pub(super) fn joint_rows(
    world: &PhysicsWorld,
    bodies: &Bodies,
    dt: f64,
    out: &mut Detection,
) -> Result<(), ModelError> {
    if world.multibody_joints.multibodies().next().is_some() {
        return Err(ModelError::Unsupported(
            "multibody joints are not supported: use impulse joints".to_owned(),
        ));
    }
    for (handle, joint) in world.impulse_joints.iter() {
        if !joint.data.is_enabled() {
            continue;
        }
        let id = handle.into_raw_parts().0;
        check(id, joint)?;
        let (Some(a), Some(b)) = (
            bodies.index_of(joint.body1()),
            bodies.index_of(joint.body2()),
        ) else {
            continue;
        };
        Rows::of(id, &joint.data, bodies, [a, b]).push(dt, out);
    }
    Ok(())
}

/// A joint at the present poses.
struct Rows<'a> {
    id: u32,
    data: &'a GenericJoint,
    frames: JointFrames,
    /// The frame's x axis on the first body.
    axis: Vec2,
    /// Angle of the second frame from the first, in (−π, π] \[rad\].
    angle: f64,
}

impl<'a> Rows<'a> {
    fn of(id: u32, data: &'a GenericJoint, bodies: &Bodies, pair: [u32; 2]) -> Self {
        let side = |body: u32, frame: &Pose| {
            let shadow = &bodies.list[body as usize];
            let frame = shadow.pose.compose(&Pose64::from_rapier(frame));
            let arm = frame.translation - shadow.pose.apply(shadow.center);
            (frame, arm)
        };
        let (f1, r1) = side(pair[0], &data.local_frame1);
        let (f2, r2) = side(pair[1], &data.local_frame2);
        let (sin, cos) = (
            f1.cos * f2.sin - f1.sin * f2.cos,
            f1.cos * f2.cos + f1.sin * f2.sin,
        );
        Rows {
            id,
            data,
            frames: JointFrames {
                bodies: pair,
                arms: [r1, r2],
                offset: f2.translation - f1.translation,
            },
            axis: Vec2::new(f1.cos, f1.sin),
            angle: sin.atan2(cos),
        }
    }

    fn coordinate(&self, which: JointCoordinate) -> Coordinate {
        match which {
            JointCoordinate::X => self.frames.along(self.axis),
            JointCoordinate::Y => self.frames.along(Vec2::new(-self.axis.y, self.axis.x)),
            JointCoordinate::Angle => self.frames.angle(self.angle),
            JointCoordinate::Distance => self.frames.distance(),
        }
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

    fn push(&self, dt: f64, out: &mut Detection) {
        let data = self.data;
        let soft = softness(&data.softness);
        let locked = |axis: JointAxis| data.locked_axes.contains(axis.into());
        let pinned = locked(JointAxis::LinX) && locked(JointAxis::LinY);
        if pinned && soft.is_none() {
            let name = self.name(JointPart::Pin);
            out.joints.push(self.frames.point().lock(name, 0.0));
        }
        for (axis, which) in AXES {
            if locked(axis) {
                let name = self.name(JointPart::Lock(which));
                match soft {
                    Some((stiffness, damping)) => {
                        let row = self.coordinate(which);
                        let spring = Spring {
                            stretch: row.value.x,
                            speed: 0.0,
                            stiffness,
                            damping,
                            per_mass: true,
                            max_force: f64::INFINITY,
                        };
                        out.joints.push(row.driven(name, JointKind::Spring(spring)));
                    }
                    None if pinned && which != JointCoordinate::Angle => {}
                    None => out.joints.push(self.coordinate(which).lock(name, 0.0)),
                }
            } else if data.coupled_axes.contains(axis.into()) {
                if axis == JointAxis::LinX {
                    self.push_free(axis, JointCoordinate::Distance, dt, out);
                }
            } else {
                self.push_free(axis, which, dt, out);
            }
        }
    }

    /// Limits and motor of an axis that is not locked.
    fn push_free(&self, axis: JointAxis, which: JointCoordinate, dt: f64, out: &mut Detection) {
        let data = self.data;
        let range = data.limits(axis).map(|l| [bound(l.min), bound(l.max)]);
        // a whole turn is no limit, in rapier either
        let range = range.filter(|[low, high]| axis != JointAxis::AngX || high - low < TAU);
        // what is left of the range in a step bounds the speed of a motor: it does not drive
        // against a limit, however strong it is
        let mut speeds = [f64::NEG_INFINITY, f64::INFINITY];
        if let Some([low, high]) = range {
            let mut row = self.coordinate(which);
            if axis == JointAxis::AngX {
                // the turn that is nearest to the middle of the range
                let middle = 0.5 * (low + high);
                row.value.x = middle + wrapped(row.value.x - middle);
            }
            speeds = [
                ((low - row.value.x) / dt).min(0.0),
                ((high - row.value.x) / dt).max(0.0),
            ];
            if low == high {
                out.joints
                    .push(row.lock(self.name(JointPart::Lock(which)), low));
            } else {
                // a distance is never below 0
                if low.is_finite() && (which != JointCoordinate::Distance || low > 0.0) {
                    out.joints
                        .push(row.above(self.name(JointPart::Lower(which)), low));
                }
                if high.is_finite() {
                    out.joints
                        .push(row.below(self.name(JointPart::Upper(which)), high));
                }
            }
        }
        let Some(motor) = data.motor(axis) else {
            return;
        };
        let row = self.coordinate(which);
        let mut stretch = row.value.x - widen(motor.target_pos);
        if axis == JointAxis::AngX {
            stretch = wrapped(stretch);
        }
        let kind = drive(motor, stretch, speeds);
        let name = self.name(JointPart::Drive(which));
        out.joints.push(row.driven(name, kind));
    }
}

/// What a motor does at this stretch, its speed held within `speeds`.
fn drive(motor: &JointMotor, stretch: f64, speeds: [f64; 2]) -> JointKind {
    let speed = widen(motor.target_vel).clamp(speeds[0], speeds[1]);
    let max_force = bound(motor.max_force);
    let (stiffness, damping) = (widen(motor.stiffness), widen(motor.damping));
    if stiffness == 0.0 && damping == 0.0 {
        return JointKind::Motor { speed, max_force };
    }
    JointKind::Spring(Spring {
        stretch,
        speed,
        stiffness,
        damping,
        per_mass: motor.model == MotorModel::AccelerationBased,
        max_force,
    })
}

/// rapier's largest number is no bound.
fn bound(value: Real) -> f64 {
    if value.abs() >= Real::MAX {
        f64::INFINITY.copysign(f64::from(value))
    } else {
        widen(value)
    }
}

/// `ω²` and `2 ζ ω` of a softness that is not rapier's own, which is as good as rigid.
fn softness(softness: &SpringCoefficients<Real>) -> Option<(f64, f64)> {
    let rigid = SpringCoefficients::<Real>::joint_defaults();
    if softness.natural_frequency >= rigid.natural_frequency {
        return None;
    }
    let omega = TAU * widen(softness.natural_frequency);
    let zeta = widen(softness.damping_ratio);
    Some((omega * omega, 2.0 * zeta * omega))
}

/// The angle in (−π, π] \[rad\].
fn wrapped(angle: f64) -> f64 {
    let turns = ((angle - PI) / TAU).ceil();
    angle - turns * TAU
}

/// Whether the joint is one that can be stepped.
fn check(id: u32, joint: &ImpulseJoint) -> Result<(), ModelError> {
    let data = &joint.data;
    let name = || format!("joint {id} ({})", kind_name(data));
    let refuse = |what: &str| Err(ModelError::Unsupported(format!("{}: {what}", name())));
    let invalid = |what: String| Err(ModelError::Invalid(format!("{}: {what}", name())));
    if joint.body1() == joint.body2() {
        return invalid("it ties a body to itself".to_owned());
    }
    for (frame, side) in [(&data.local_frame1, 1), (&data.local_frame2, 2)] {
        let length = frame.rotation.re.hypot(frame.rotation.im);
        if !(frame.translation.is_finite() && length > 0.0 && length.is_finite()) {
            return invalid(format!(
                "the anchor or axis on body {side} is not finite: {}, {}; rotation {}, {}",
                frame.translation.x, frame.translation.y, frame.rotation.re, frame.rotation.im
            ));
        }
    }
    let soft = &data.softness;
    if !(soft.natural_frequency > 0.0 && soft.damping_ratio >= 0.0) {
        return invalid(format!(
            "softness {} Hz, damping ratio {}: must be above 0, and at least 0",
            soft.natural_frequency, soft.damping_ratio
        ));
    }
    let coupled = data.coupled_axes;
    if !coupled.is_empty() {
        if coupled != JointAxesMask::LIN_AXES {
            return refuse("a coupling of axes that is no distance is not supported");
        }
        if data.locked_axes.intersects(coupled) {
            return refuse("an axis that is both locked and coupled is not supported");
        }
        let second = (data.limit_axes | data.motor_axes).contains(JointAxesMask::LIN_Y);
        if second {
            return refuse(
                "of coupled axes the first has limits and motor; the second is not supported",
            );
        }
    }
    for (axis, which) in AXES {
        if data.locked_axes.contains(axis.into()) {
            continue;
        }
        if let Some(limits) = data.limits(axis) {
            if limits.min.is_nan() || limits.max.is_nan() || limits.min > limits.max {
                return invalid(format!(
                    "limits of {which:?} are {} and {}: the lower one must be at most the upper",
                    limits.min, limits.max
                ));
            }
            if softness(soft).is_some() {
                return refuse("limits of a joint with a softness of its own are not supported");
            }
        }
        if let Some(motor) = data.motor(axis) {
            for (what, value) in [
                ("target position", motor.target_pos),
                ("target velocity", motor.target_vel),
            ] {
                if !value.is_finite() {
                    return invalid(format!("motor of {which:?}: {what} is {value}"));
                }
            }
            for (what, value) in [
                ("stiffness", motor.stiffness),
                ("damping", motor.damping),
                ("largest force", motor.max_force),
            ] {
                let force = what == "largest force";
                if !(value >= 0.0 && (force || value.is_finite())) {
                    return invalid(format!(
                        "motor of {which:?}: {what} is {value}, must be at least 0"
                    ));
                }
            }
        }
    }
    Ok(())
}

fn kind_name(joint: &GenericJoint) -> &'static str {
    let linear = JointAxesMask::LIN_AXES;
    let free = JointAxesMask::empty();
    match (joint.locked_axes, joint.coupled_axes) {
        (JointAxesMask::LOCKED_REVOLUTE_AXES, c) if c == free => "revolute",
        (JointAxesMask::LOCKED_PRISMATIC_AXES, c) if c == free => "prismatic",
        (JointAxesMask::LOCKED_FIXED_AXES, c) if c == free => "fixed",
        (JointAxesMask::LOCKED_PIN_SLOT_AXES, c) if c == free => "pin-slot",
        (l, c) if l == free && c == linear && joint.motor_axes == free => "rope",
        (l, c) if l == free && c == linear => "spring",
        _ => "generic",
    }
}

/// A side of a contact that belongs to no body of the model.
pub(super) const OUTSIDE: u32 = NO_BODY;
