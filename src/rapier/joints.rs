//! rapier's impulse joints as rows of the contact problem.

use super::bodies::Bodies;
use super::widen;
use crate::contact::{NO_BODY, Rows, Vec2, Vec3};
use crate::dynamics::{ContactKey, Detection, JointKind, JointRow, ModelError};
use rapier2d::prelude::*;

/// Keys of joints live beside those of collider pairs.
const JOINT_PAIR: u64 = u64::MAX;

/// Rows of all enabled joints at the present poses, in rapier's order.
///
/// A revolute joint gives two rows that close the distance of its anchors, and a third if it has
/// a velocity motor: an exact speed within the torque limit, where rapier's own is soft.
///
/// # Errors
/// [`ModelError::Unsupported`] names any other joint kind, limits, or a position motor.
pub(super) fn joint_rows(
    world: &PhysicsWorld,
    bodies: &Bodies,
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
        let refuse = |what: String| Err(ModelError::Unsupported(format!("joint {id}: {what}")));
        let data = &joint.data;
        if data.locked_axes != JointAxesMask::LOCKED_REVOLUTE_AXES || !data.coupled_axes.is_empty()
        {
            return refuse(format!(
                "{} joints are not supported yet, only revolute ones",
                kind_name(data)
            ));
        }
        if !data.limit_axes.is_empty() {
            return refuse("joint limits are not supported yet".to_owned());
        }
        let (Some(a), Some(b)) = (
            bodies.index_of(joint.body1()),
            bodies.index_of(joint.body2()),
        ) else {
            continue;
        };
        let side = |body: u32, frame: &Pose| {
            let shadow = &bodies.list[body as usize];
            let local = Vec2::new(widen(frame.translation.x), widen(frame.translation.y));
            let anchor = shadow.pose.apply(local);
            (anchor, anchor - shadow.pose.apply(shadow.center))
        };
        let (p1, r1) = side(a, &data.local_frame1);
        let (p2, r2) = side(b, &data.local_frame2);
        let pin = |r: Vec2, sign: f64| {
            [
                Vec3::new(sign, 0.0, -sign * r.y),
                Vec3::new(0.0, sign, sign * r.x),
            ]
        };
        out.joints.push(JointRow {
            key: ContactKey {
                pair: JOINT_PAIR,
                feature: u64::from(id) << 1,
            },
            rows: Rows {
                bodies: [a, b],
                jacobian: [pin(r1, -1.0), pin(r2, 1.0)],
            },
            kind: JointKind::Pin { gap: p2 - p1 },
        });
        if !data.motor_axes.is_empty() {
            let motor = &data.motors[JointAxis::AngX as usize];
            if data.motor_axes != JointAxesMask::ANG_X || motor.stiffness != 0.0 {
                return refuse("position motors are not supported yet".to_owned());
            }
            // a motor without gain does nothing in rapier either
            if motor.damping > 0.0 {
                out.joints.push(motor_row(id, a, b, motor));
            }
        }
    }
    Ok(())
}

fn motor_row(id: u32, a: u32, b: u32, motor: &JointMotor) -> JointRow {
    let spin = |sign: f64| [Vec3::new(0.0, 0.0, sign), Vec3::zeros()];
    JointRow {
        key: ContactKey {
            pair: JOINT_PAIR,
            feature: (u64::from(id) << 1) | 1,
        },
        rows: Rows {
            bodies: [a, b],
            jacobian: [spin(-1.0), spin(1.0)],
        },
        kind: JointKind::Motor {
            speed: widen(motor.target_vel),
            max_force: if motor.max_force == Real::MAX {
                f64::INFINITY
            } else {
                widen(motor.max_force)
            },
        },
    }
}

fn kind_name(joint: &GenericJoint) -> &'static str {
    if !joint.coupled_axes.is_empty() {
        "rope or spring"
    } else if joint.locked_axes == JointAxesMask::LOCKED_PRISMATIC_AXES {
        "prismatic"
    } else if joint.locked_axes == JointAxesMask::LOCKED_FIXED_AXES {
        "fixed"
    } else if joint.locked_axes == JointAxesMask::LOCKED_PIN_SLOT_AXES {
        "pin-slot"
    } else {
        "generic"
    }
}

/// A side of a contact that belongs to no body of the model.
pub(super) const OUTSIDE: u32 = NO_BODY;
