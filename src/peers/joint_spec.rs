//! Joints of a [`Simulation`], described in `f64`.

use super::simulation::{BodyId, Simulation};
use crate::contact::Vec2;
use crate::dynamics::{ModelError, Pose64};
use crate::rapier::engine::prelude::*;

/// The free motions of a joint; axes are those of [`JointSpec::angles`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointShape {
    /// Rotates about a point.
    Revolute,
    /// Translates along the axis, without rotation.
    Prismatic,
    /// Free in nothing.
    Fixed,
    /// Translates along the axis and rotates.
    PinSlot,
    /// Two points are at most `length` \[m\] apart.
    Rope { length: f64 },
    /// A spring of rest length \[m\], stiffness [N/m] and damping [N s/m] between two points.
    Spring {
        length: f64,
        stiffness: f64,
        damping: f64,
    },
}

/// A motor or spring along the free coordinate of a joint: the angle \[rad\] of a revolute joint,
/// the displacement \[m\] along the axis of a prismatic or pin-slot one, of the second body
/// relative to the first. Forces are in N m and N.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum JointDrive {
    /// Keeps `speed` with at most `max_force`.
    Motor { speed: f64, max_force: f64 },
    /// Drives with `damping` times what the speed lacks of `speed`, and at most `max_force`.
    Droop {
        speed: f64,
        damping: f64,
        max_force: f64,
    },
    /// Pulls to `target` with `stiffness` and `damping`, and at most `max_force`.
    Spring {
        target: f64,
        stiffness: f64,
        damping: f64,
        max_force: f64,
    },
}

/// A joint between two bodies; `None` is the fixed world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointSpec {
    pub shape: JointShape,
    pub bodies: [Option<BodyId>; 2],
    /// Anchor in each body's frame \[m\].
    pub anchors: [Vec2; 2],
    /// Angle of the joint's axis in each body's frame \[rad\].
    pub angles: [f64; 2],
    /// Least and largest value of the free coordinate; for a spring, of its length.
    pub limits: Option<[f64; 2]>,
    pub drive: Option<JointDrive>,
    /// A drive of the angle of a pin-slot joint, besides the one along its slot.
    pub turn: Option<JointDrive>,
    /// Whether the two bodies touch.
    pub contacts: bool,
}

impl JointSpec {
    /// A pin without limits or drive; its bodies do not touch.
    pub fn revolute(bodies: [Option<BodyId>; 2], anchors: [Vec2; 2]) -> Self {
        JointSpec {
            shape: JointShape::Revolute,
            bodies,
            anchors,
            angles: [0.0; 2],
            limits: None,
            drive: None,
            turn: None,
            contacts: false,
        }
    }
}

/// Gain per mass [1/s] of a motor that keeps its speed, to 1e-10 of the change by a load.
const EXACT: f64 = 1e12;

impl Simulation {
    /// Joins two bodies. The joint is an ordinary joint of the world, for rapier's solver as well.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] if a body is unknown, or a joint other than a pin-slot one has a
    /// [`JointSpec::turn`].
    pub fn add_joint(&mut self, spec: &JointSpec) -> Result<ImpulseJointHandle, ModelError> {
        if spec.turn.is_some() && spec.shape != JointShape::PinSlot {
            return Err(ModelError::Invalid(
                "only a pin-slot joint has a drive of its angle besides its own".into(),
            ));
        }
        let mut handles = [RigidBodyHandle::invalid(); 2];
        for (handle, body) in handles.iter_mut().zip(spec.bodies) {
            *handle = match body {
                Some(body) if self.world.bodies.contains(body.0) => body.0,
                Some(_) => {
                    return Err(ModelError::Invalid("the body is not in the world".into()));
                }
                None => self.ground(),
            };
        }
        Ok(self
            .world
            .impulse_joints
            .insert(handles[0], handles[1], generic(spec), true))
    }

    /// Replaces the drive of the angle of all revolute joints of a body.
    pub fn set_drive(&mut self, body: BodyId, drive: JointDrive) {
        let of_body: Vec<ImpulseJointHandle> = (self.world.impulse_joints)
            .attached_joints(body.0)
            .map(|(_, _, handle, _)| handle)
            .collect();
        for handle in of_body {
            let joint = self.world.impulse_joints.get_mut(handle, false);
            if let Some(joint) = joint.filter(|j| j.data.as_revolute().is_some()) {
                driven(&mut joint.data, JointAxis::AngX, drive);
            }
        }
    }
}

fn generic(spec: &JointSpec) -> GenericJoint {
    let locked = match spec.shape {
        JointShape::Revolute => JointAxesMask::LOCKED_REVOLUTE_AXES,
        JointShape::Prismatic => JointAxesMask::LOCKED_PRISMATIC_AXES,
        JointShape::Fixed => JointAxesMask::LOCKED_FIXED_AXES,
        JointShape::PinSlot => JointAxesMask::LOCKED_PIN_SLOT_AXES,
        JointShape::Rope { .. } | JointShape::Spring { .. } => JointAxesMask::empty(),
    };
    let mut joint = GenericJoint::new(locked);
    // rounded only now: the angle of an axis along y, rounded, would tilt it by 4e-8
    let frame = |side: usize| Pose64::new(spec.anchors[side], spec.angles[side]).to_rapier();
    joint.set_local_frame1(frame(0));
    joint.set_local_frame2(frame(1));
    joint.set_contacts_enabled(spec.contacts);
    let axis = match spec.shape {
        JointShape::Revolute => JointAxis::AngX,
        _ => JointAxis::LinX,
    };
    if let JointShape::Rope { .. } | JointShape::Spring { .. } = spec.shape {
        joint.coupled_axes = JointAxesMask::LIN_AXES;
    }
    if let Some(limits) = spec.limits {
        joint.set_limits(axis, limits.map(|x| x as Real));
    }
    for (axis, drive) in [(axis, spec.drive), (JointAxis::AngX, spec.turn)] {
        if let Some(drive) = drive {
            driven(&mut joint, axis, drive);
        }
    }
    match spec.shape {
        JointShape::Rope { length } => {
            joint.set_limits(axis, [0.0, length as Real]);
        }
        JointShape::Spring {
            length,
            stiffness,
            damping,
        } => spring(&mut joint, axis, [length, stiffness, damping]),
        _ => {}
    }
    joint
}

fn driven(joint: &mut GenericJoint, axis: JointAxis, drive: JointDrive) {
    let bound = match drive {
        JointDrive::Motor { speed, max_force } => {
            joint.set_motor_velocity(axis, speed as Real, EXACT as Real);
            max_force
        }
        JointDrive::Droop {
            speed,
            damping,
            max_force,
        } => {
            joint.set_motor_model(axis, MotorModel::ForceBased);
            joint.set_motor_velocity(axis, speed as Real, damping as Real);
            max_force
        }
        JointDrive::Spring {
            target,
            stiffness,
            damping,
            max_force,
        } => {
            spring(joint, axis, [target, stiffness, damping]);
            max_force
        }
    };
    joint.set_motor_max_force(axis, bound.min(f64::from(Real::MAX)) as Real);
}

fn spring(joint: &mut GenericJoint, axis: JointAxis, numbers: [f64; 3]) {
    let [target, stiffness, damping] = numbers.map(|x| x as Real);
    joint.set_motor_model(axis, MotorModel::ForceBased);
    joint.set_motor_position(axis, target, stiffness, damping);
}
