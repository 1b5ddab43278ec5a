//! rapier's impulse joints, read once and read again when they change.

use super::bodies::Bodies;
use super::engine::prelude::*;
use super::joint_checks::{check, check_bodies};
use super::joint_rows::Form;
use crate::contact::NO_BODY;
use crate::dynamics::{JointRow, ModelError};

/// All impulse joints of a world as they were read last, in rapier's order.
///
/// What a user changes is found by comparing all that can be changed about each joint, once a step;
/// rows are made from what is kept, as often as a step asks for them.
#[derive(Default)]
pub(super) struct Joints {
    known: Vec<Known>,
    /// Of the bodies' numbers that are kept; `None` until they are looked up.
    numbering: Option<u64>,
}

/// A joint as it was read.
struct Known {
    handle: ImpulseJointHandle,
    ends: [RigidBodyHandle; 2],
    traits: Traits,
    /// `None` where it is switched off.
    form: Option<Form>,
    /// Numbers of its bodies, if both are enabled.
    pair: Option<[u32; 2]>,
}

impl Joints {
    /// Takes over what the user changed since the last call.
    ///
    /// # Errors
    /// [`ModelError::Unsupported`] for multibody joints and couplings that are no distance,
    /// [`ModelError::Invalid`] for bodies that are not there and for numbers that make no joint; all
    /// name the joint. What is bad is not taken over.
    pub fn refresh(&mut self, world: &PhysicsWorld) -> Result<(), ModelError> {
        if world.multibody_joints.multibodies().next().is_some() {
            return Err(ModelError::Unsupported(
                "multibody joints are not supported: use impulse joints".to_owned(),
            ));
        }
        let mut count = 0;
        for (handle, joint) in world.impulse_joints.iter() {
            let id = handle.into_raw_parts().0;
            check_bodies(id, joint, &world.bodies)?;
            let ends = [joint.body1(), joint.body2()];
            let traits = Traits::of(&joint.data);
            let old = self.known.get_mut(count);
            count += 1;
            if let Some(old) = &old
                && (old.handle, old.ends) == (handle, ends)
                && old.traits == traits
            {
                continue;
            }
            let on = joint.data.is_enabled();
            if on {
                check(id, joint)?;
            }
            let new = Known {
                handle,
                ends,
                traits,
                form: on.then(|| Form::read(id, &joint.data)),
                pair: None,
            };
            self.numbering = None;
            match old {
                Some(old) => *old = new,
                None => self.known.push(new),
            }
        }
        self.known.truncate(count);
        Ok(())
    }

    /// Looks up the numbers of the bodies, where they or the joints are new.
    pub fn number(&mut self, bodies: &Bodies) {
        if self.numbering == Some(bodies.numbering) {
            return;
        }
        self.numbering = Some(bodies.numbering);
        for joint in &mut self.known {
            joint.pair = match joint.ends.map(|handle| bodies.index_of(handle)) {
                [Some(a), Some(b)] => Some([a, b]),
                _ => None,
            };
        }
    }

    /// Adds the rows of all enabled joints at the bodies' present poses, for a step of `dt` \[s\].
    pub fn rows(&self, bodies: &Bodies, dt: f64, out: &mut Vec<JointRow>) {
        for joint in &self.known {
            if let (Some(form), Some(pair)) = (&joint.form, joint.pair) {
                form.push(bodies, pair, dt, out);
            }
        }
    }
}

/// All that a user can change about a joint and that matters, bit for bit; not what rapier writes
/// into it.
#[derive(Clone, PartialEq)]
struct Traits {
    frames: [u64; 8],
    limits: [[u64; 2]; 3],
    motors: [[u64; 5]; 3],
    models: [MotorModel; 3],
    softness: [u64; 2],
    axes: [JointAxesMask; 4],
    switches: [bool; 2],
}

impl Traits {
    fn of(joint: &GenericJoint) -> Traits {
        let bits = |x: Real| f64::from(x).to_bits();
        let [a, b] = [&joint.local_frame1, &joint.local_frame2];
        Traits {
            frames: [
                a.translation.x,
                a.translation.y,
                a.rotation.re,
                a.rotation.im,
                b.translation.x,
                b.translation.y,
                b.rotation.re,
                b.rotation.im,
            ]
            .map(bits),
            limits: joint.limits.map(|l| [l.min, l.max].map(bits)),
            motors: joint.motors.map(|m| {
                let numbers = [
                    m.target_vel,
                    m.target_pos,
                    m.stiffness,
                    m.damping,
                    m.max_force,
                ];
                numbers.map(bits)
            }),
            models: joint.motors.map(|m| m.model),
            softness: [
                joint.softness.natural_frequency,
                joint.softness.damping_ratio,
            ]
            .map(bits),
            axes: [
                joint.locked_axes,
                joint.limit_axes,
                joint.motor_axes,
                joint.coupled_axes,
            ],
            switches: [joint.contacts_enabled, joint.is_enabled()],
        }
    }

    /// A number that tells it from others.
    fn fingerprint(&self) -> u64 {
        let numbers = self.frames.iter().chain(self.limits.as_flattened());
        let numbers = numbers.chain(self.motors.as_flattened());
        let numbers = numbers.chain(&self.softness).copied();
        let models = self.models.iter().map(|m| *m as u64);
        let axes = self.axes.iter().map(|a| u64::from(a.bits()));
        let switches = self.switches.iter().map(|s| u64::from(*s));
        numbers
            .chain(models)
            .chain(axes)
            .chain(switches)
            .fold(0xcbf2_9ce4_8422_2325, |hash, word| {
                (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3)
            })
    }
}

/// Tells apart what a user can change about a joint.
pub(super) fn fingerprint(joint: &GenericJoint) -> u64 {
    Traits::of(joint).fingerprint()
}

/// A side of a contact that belongs to no body of the model.
pub(super) const OUTSIDE: u32 = NO_BODY;
