//! rapier's impulse joints as rows of the contact problem.

use super::bodies::Bodies;
use super::engine::prelude::*;
use super::widen;
use crate::contact::{NO_BODY, Rows, Vec2, Vec3};
use crate::dynamics::Pose64;
use crate::dynamics::{ContactKey, Detection, JointKind, JointRow, ModelError};

/// Keys of joints live beside those of collider pairs.
const JOINT_PAIR: u64 = u64::MAX;

/// Rows of all enabled joints at the present poses, in rapier's order.
///
/// A revolute joint gives two rows that close the distance of its anchors, and a third if it has
/// a velocity motor: an exact speed within the torque limit, where rapier's own is soft. A
/// force-based position motor is a spring, see [`spring_torques`].
///
/// # Errors
/// [`ModelError::Unsupported`] names any other joint kind, limits, other motors, or a spring that
/// is too stiff to be explicit in a step of `dt` \[s\].
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
            if data.motor_axes != JointAxesMask::ANG_X {
                return refuse("motors along an axis are not supported yet".to_owned());
            }
            if motor.stiffness != 0.0 {
                if motor.model != MotorModel::ForceBased || motor.max_force != Real::MAX {
                    return refuse(
                        "position motors that scale with mass or have a limit are not supported \
                         yet"
                        .to_owned(),
                    );
                }
                let limit = stable_rate(bodies, [a, b]) / (dt * dt);
                if f64::from(motor.stiffness) > limit || f64::from(motor.damping) > limit * dt {
                    return refuse(format!(
                        "a spring of {} N m/rad and {} N m s/rad is too stiff for steps of {dt} s: \
                         at most {limit:.3e} and {:.3e}",
                        motor.stiffness,
                        motor.damping,
                        limit * dt
                    ));
                }
            } else if motor.damping > 0.0 {
                // a motor without gain does nothing in rapier either
                out.joints.push(motor_row(id, a, b, motor));
            }
        }
    }
    Ok(())
}

/// Half of the smaller free inertia [kg m²]: below `k Δt² =` this an explicit spring is stable.
fn stable_rate(bodies: &Bodies, pair: [u32; 2]) -> f64 {
    let fastest = pair
        .iter()
        .map(|&k| bodies.inverse_mass[k as usize].z)
        .fold(0.0, f64::max);
    0.5 / fastest
}

/// Adds the torques of all rotational springs, `−k (θ − θ₀) − c (ω − ω₀)` on the second body.
///
/// Explicit: taken at the midpoint configuration and the velocity of the start, as any force.
pub(super) fn spring_torques(world: &PhysicsWorld, bodies: &Bodies, out: &mut [Vec3]) {
    for (_, joint) in world.impulse_joints.iter() {
        let data = &joint.data;
        let motor = &data.motors[JointAxis::AngX as usize];
        let spring = data.motor_axes == JointAxesMask::ANG_X && motor.stiffness != 0.0;
        if !spring || !data.is_enabled() {
            continue;
        }
        let (Some(a), Some(b)) = (
            bodies.index_of(joint.body1()),
            bodies.index_of(joint.body2()),
        ) else {
            continue;
        };
        let frame = |body: u32, local: &Pose| {
            let local = Pose64::from_rapier(local);
            bodies.list[body as usize].pose.compose(&local)
        };
        let (f1, f2) = (frame(a, &data.local_frame1), frame(b, &data.local_frame2));
        let angle = (f1.cos * f2.sin - f1.sin * f2.cos).atan2(f1.cos * f2.cos + f1.sin * f2.sin);
        let spin = bodies.velocities[b as usize].z - bodies.velocities[a as usize].z;
        let torque = -widen(motor.stiffness) * (angle - widen(motor.target_pos))
            - widen(motor.damping) * (spin - widen(motor.target_vel));
        out[b as usize].z += torque;
        out[a as usize].z -= torque;
    }
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
