//! Reads rapier's impulse joints, and reads them again when they change.

use super::bodies::Bodies;
use super::engine::prelude::*;
use super::joint_checks::{check, check_bodies, check_dominance};
use super::joint_rows::Form;
use crate::contact::NO_BODY;
use crate::dynamics::{JointRow, ModelError};

/// All impulse joints of a world as they were last read, in rapier's order.
///
/// Once a step, [`Joints::refresh`] compares all properties that a user can change with the stored
/// ones. Rows come from the stored joints, as often as a step needs them.
#[derive(Default)]
pub(super) struct Joints {
    seen: Vec<Seen>,
    /// One per joint; `None` if it is disabled.
    forms: Vec<Option<Form>>,
    /// Numbers of the two bodies of each joint; `None` if one is disabled.
    pairs: Vec<Option<[u32; 2]>>,
    /// Numbering of the bodies in `pairs`; `None` until they are looked up.
    numbering: Option<u64>,
    /// Counts the joints that were read or removed.
    pub revision: u64,
}

/// The properties of a joint when it was last read.
#[derive(PartialEq)]
struct Seen {
    handle: ImpulseJointHandle,
    ends: [RigidBodyHandle; 2],
    traits: Traits,
}

impl Joints {
    /// Reads what the user changed since the last call, and the numbers of the bodies.
    ///
    /// # Errors
    /// [`ModelError::Unsupported`] for multibody joints, couplings that are no distance, and bodies
    /// of which one dominates the other. [`ModelError::Invalid`] for missing bodies and invalid
    /// numbers. All name the joint. Invalid joints are not stored.
    pub fn refresh(&mut self, world: &PhysicsWorld, bodies: &Bodies) -> Result<(), ModelError> {
        if world.multibody_joints.multibodies().next().is_some() {
            return Err(ModelError::Unsupported(
                "multibody joints are not supported: use impulse joints".to_owned(),
            ));
        }
        let mut count = 0;
        for (handle, joint) in world.impulse_joints.iter() {
            let seen = Seen {
                handle,
                ends: [joint.body1(), joint.body2()],
                traits: Traits::of(&joint.data),
            };
            if self.seen.get(count) != Some(&seen) {
                self.read(count, seen, joint)?;
            }
            count += 1;
        }
        self.revision += (self.seen.len() - count) as u64;
        self.seen.truncate(count);
        self.forms.truncate(count);
        if self.numbering != Some(bodies.numbering) {
            self.number(world, bodies)?;
        }
        self.check_dominance(bodies)
    }

    /// Reads the joint that comes after `count` others.
    fn read(&mut self, count: usize, seen: Seen, joint: &ImpulseJoint) -> Result<(), ModelError> {
        self.revision += 1;
        let id = seen.handle.into_raw_parts().0;
        let mut form = None;
        if joint.data.is_enabled() {
            check(id, joint)?;
            form = Some(Form::read(id, &joint.data));
        }
        match self.seen.get_mut(count) {
            Some(old) => {
                if (old.handle, old.ends) != (seen.handle, seen.ends) {
                    self.numbering = None;
                }
                (*old, self.forms[count]) = (seen, form);
            }
            None => {
                self.numbering = None;
                self.seen.push(seen);
                self.forms.push(form);
            }
        }
        Ok(())
    }

    /// Looks up the numbers of the bodies.
    fn number(&mut self, world: &PhysicsWorld, bodies: &Bodies) -> Result<(), ModelError> {
        self.numbering = None;
        self.pairs.clear();
        for joint in &self.seen {
            check_bodies(joint.handle.into_raw_parts().0, joint.ends, world)?;
            self.pairs
                .push(match joint.ends.map(|handle| bodies.index_of(handle)) {
                    [Some(a), Some(b)] => Some([a, b]),
                    _ => None,
                });
        }
        self.numbering = Some(bodies.numbering);
        Ok(())
    }

    /// Checked in every step, as bodies change without their joints.
    fn check_dominance(&self, bodies: &Bodies) -> Result<(), ModelError> {
        let levels = &bodies.roles.dominance;
        if levels.is_empty() {
            return Ok(());
        }
        for (k, joint) in self.seen.iter().enumerate() {
            if let (Some(_), Some(pair)) = (&self.forms[k], self.pairs[k]) {
                let id = joint.handle.into_raw_parts().0;
                check_dominance(id, pair.map(|body| levels[body as usize]))?;
            }
        }
        Ok(())
    }

    /// Adds the rows of all enabled joints at the bodies' present poses, for a step of `dt` \[s\].
    pub fn rows(&self, bodies: &Bodies, dt: f64, out: &mut Vec<JointRow>) {
        for (form, pair) in self.forms.iter().zip(&self.pairs) {
            if let (Some(form), Some(pair)) = (form, *pair) {
                form.push(bodies, pair, dt, out);
            }
        }
    }
}

/// All properties of a joint that a user can change and that matter, bit for bit; not the impulses
/// that rapier writes.
#[derive(PartialEq)]
struct Traits {
    frames: [[Bits; 4]; 2],
    limits: [[Bits; 2]; 3],
    motors: [[Bits; 5]; 3],
    softness: [Bits; 2],
    models: [MotorModel; 3],
    axes: [JointAxesMask; 4],
    on: bool,
}

/// Bits of rapier's numbers.
#[cfg(not(feature = "f64"))]
type Bits = u32;
#[cfg(feature = "f64")]
type Bits = u64;

impl Traits {
    fn of(joint: &GenericJoint) -> Traits {
        let (motors, soft) = (&joint.motors, &joint.softness);
        Traits {
            frames: [&joint.local_frame1, &joint.local_frame2].map(|frame| {
                let (at, turn) = (frame.translation, frame.rotation);
                [at.x, at.y, turn.re, turn.im].map(Real::to_bits)
            }),
            limits: joint.limits.map(|l| [l.min, l.max].map(Real::to_bits)),
            motors: [0, 1, 2].map(|k| {
                let JointMotor {
                    target_vel,
                    target_pos,
                    stiffness,
                    damping,
                    max_force,
                    ..
                } = motors[k];
                [target_vel, target_pos, stiffness, damping, max_force].map(Real::to_bits)
            }),
            softness: [soft.natural_frequency, soft.damping_ratio].map(Real::to_bits),
            models: [0, 1, 2].map(|k| motors[k].model),
            axes: [
                joint.locked_axes,
                joint.limit_axes,
                joint.motor_axes,
                joint.coupled_axes,
            ],
            on: joint.is_enabled(),
        }
    }
}

/// Hash of the properties of a joint that a user can change.
pub(super) fn fingerprint(joint: &GenericJoint) -> u64 {
    let own = Traits::of(joint);
    let numbers = own.frames.as_flattened().iter();
    let numbers = numbers.chain(own.limits.as_flattened());
    let numbers = numbers.chain(own.motors.as_flattened());
    let numbers = numbers.chain(&own.softness).map(|bits| u64::from(*bits));
    let models = own.models.iter().map(|model| *model as u64);
    let axes = own.axes.iter().map(|axes| u64::from(axes.bits()));
    let switches = [own.on, joint.contacts_enabled].map(u64::from);
    let all = numbers.chain(models).chain(axes).chain(switches);
    all.fold(0xcbf2_9ce4_8422_2325, |hash, word| {
        (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// Body number of a contact side outside of the model.
pub(super) const OUTSIDE: u32 = NO_BODY;
