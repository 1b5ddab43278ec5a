//! Checks of the joints of a rapier world.

use super::bodies::IMMOVABLE;
use super::body_checks::body_id;
use super::engine::prelude::*;
use super::joint_rows::{AXES, softness};
use crate::dynamics::ModelError;

/// Refuses a joint with a body that is not in the world; a disabled body passes.
pub(super) fn check_bodies(
    id: u32,
    ends: [RigidBodyHandle; 2],
    world: &PhysicsWorld,
) -> Result<(), ModelError> {
    match ends.into_iter().find(|end| !world.bodies.contains(*end)) {
        Some(gone) => Err(ModelError::Invalid(format!(
            "joint {id}: body (handle {:?}) is not in the world",
            body_id(gone)
        ))),
        None => Ok(()),
    }
}

/// Refuses a joint between bodies of which one dominates the other.
pub(super) fn check_dominance(id: u32, [a, b]: [i16; 2]) -> Result<(), ModelError> {
    // a body that nothing moves is above all others, and may be joined to any
    if a == b || a == IMMOVABLE || b == IMMOVABLE {
        return Ok(());
    }
    Err(ModelError::Unsupported(format!(
        "joint {id}: it ties bodies of dominance {a} and {b}, which is not supported"
    )))
}

/// Refuses a joint that cannot be stepped.
pub(super) fn check(id: u32, joint: &ImpulseJoint) -> Result<(), ModelError> {
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
