use super::world::{box2d_error, lacks, narrow};
use crate::dynamics::ModelError;
use crate::rapier::engine::prelude::*;
use boxdd::{
    BodyId, DistanceJointDef, JointBase, PrismaticJointDef, RevoluteJointDef, Transform,
    WeldJointDef, WheelJointDef, World,
};
use std::f64::consts::{PI, TAU};

/// Gain per mass [1/s] above which a rapier motor keeps its speed in any step, as Box2D's motors
/// do.
const HOLDS: f64 = 1e6;

/// Adds a rapier joint to Box2D.
///
/// # Errors
/// [`ModelError::Unsupported`] for joints that Box2D does not have.
pub(super) fn add(
    world: &mut World,
    ids: [BodyId; 2],
    bodies: [&RigidBody; 2],
    joint: &GenericJoint,
    name: &str,
) -> Result<(), ModelError> {
    let refuse = |what: &str| Err(lacks(&format!("{what} ({name})")));
    if !joint.is_enabled() {
        return refuse("disabled joints");
    }
    if joint.softness != SpringCoefficients::joint_defaults() {
        return refuse("joints with a softness of their own");
    }
    let frame = |pose: &Pose| {
        let place = [narrow(pose.translation.x), narrow(pose.translation.y)];
        Transform::from_pos_angle(place, narrow(pose.rotation.angle()))
    };
    let base = || -> boxdd::Result<JointBase> {
        let frames = [frame(&joint.local_frame1)?, frame(&joint.local_frame2)?];
        let base = world.joint_base(ids[0], ids[1])?;
        let base = base.with_local_frames(frames[0], frames[1]);
        Ok(base.with_collide_connected(joint.contacts_enabled))
    };
    let base = base().map_err(box2d_error(name))?;
    let along = |axis: JointAxis| -> Result<Along, ModelError> {
        let motor = match joint.motor(axis) {
            Some(motor) if motor.stiffness != 0.0 || f64::from(motor.damping) < HOLDS => {
                return Err(lacks(&format!("driving springs ({name})")));
            }
            motor => motor.map(|m| (narrow(m.max_force), narrow(m.target_vel))),
        };
        let limits = joint.limits(axis).map(|l| [l.min, l.max].map(narrow));
        Ok((limits, motor))
    };
    let (free, linear) = (JointAxesMask::empty(), JointAxesMask::LIN_AXES);
    let made = match (joint.locked_axes, joint.coupled_axes) {
        (JointAxesMask::LOCKED_REVOLUTE_AXES, c) if c == free => {
            let (limits, motor) = along(JointAxis::AngX)?;
            if limits.is_some_and(|l| l.iter().any(|angle| f64::from(angle.abs()) > 0.99 * PI)) {
                return refuse("limits beyond 178 degrees");
            }
            world.create_revolute_joint(&revolute(base, limits, motor))
        }
        (JointAxesMask::LOCKED_PRISMATIC_AXES, c) if c == free => {
            let (limits, motor) = along(JointAxis::LinX)?;
            world.create_prismatic_joint(&prismatic(base, limits, motor))
        }
        (JointAxesMask::LOCKED_FIXED_AXES, c) if c == free => {
            world.create_weld_joint(&WeldJointDef::new(base))
        }
        (JointAxesMask::LOCKED_PIN_SLOT_AXES, c) if c == free => {
            let (limits, motor) = along(JointAxis::LinX)?;
            if motor.is_some() {
                return refuse("motors along a slot");
            }
            let mut def = WheelJointDef::new(base).enable_spring(false);
            if let Some([low, high]) = limits {
                def = def.enable_limit(true);
                def = def.lower_translation(low).upper_translation(high);
            }
            world.create_wheel_joint(&def)
        }
        (locked, c) if locked == free && c == linear => {
            // a spring of zero stiffness leaves the length free between its limits
            let mut def = DistanceJointDef::new(base).enable_spring(true).hertz(0.0);
            if let Some(limits) = joint.limits(JointAxis::LinX) {
                let [low, high] = [limits.min, limits.max].map(narrow);
                def = def.enable_limit(true).length(high);
                def = def.min_length(low).max_length(high);
            }
            if let Some(motor) = joint.motor(JointAxis::LinX) {
                let Some((hertz, ratio)) = spring(joint, bodies, motor) else {
                    return refuse("springs off the centres of mass, or with a largest force");
                };
                def = def.length(narrow(motor.target_pos));
                def = def.hertz(hertz).damping_ratio(ratio);
            }
            world.create_distance_joint(&def)
        }
        _ => return refuse("joints of such axes"),
    };
    made.map(drop).map_err(box2d_error(name))
}

/// Limits, and largest force and speed of a motor, along the free axis of a joint.
type Along = (Option<Limits>, Option<Motor>);
type Limits = [f32; 2];
type Motor = (f32, f32);

fn revolute(base: JointBase, limits: Option<Limits>, motor: Option<Motor>) -> RevoluteJointDef {
    let mut def = RevoluteJointDef::new(base);
    if let Some([low, high]) = limits {
        def = def.enable_limit(true).lower_angle(low).upper_angle(high);
    }
    if let Some((force, speed)) = motor {
        def = def.enable_motor(true);
        def = def.max_motor_torque(force).motor_speed(speed);
    }
    def
}

fn prismatic(base: JointBase, limits: Option<Limits>, motor: Option<Motor>) -> PrismaticJointDef {
    let mut def = PrismaticJointDef::new(base);
    if let Some([low, high]) = limits {
        def = def.enable_limit(true);
        def = def.lower_translation(low).upper_translation(high);
    }
    if let Some((force, speed)) = motor {
        def = def.enable_motor(true);
        def = def.max_motor_force(force).motor_speed(speed);
    }
    def
}

/// Frequency \[Hz\] and damping ratio of a spring between two centres of mass. Alone, its stiffness
/// k gives `2πf = √(k/m)` with the reduced mass m; the damping c is `2ζ√(k m)`.
fn spring(joint: &GenericJoint, bodies: [&RigidBody; 2], motor: &JointMotor) -> Option<(f32, f32)> {
    let frames = [&joint.local_frame1, &joint.local_frame2];
    let centred = |(body, frame): (&RigidBody, &&Pose)| {
        let centre = body.mass_properties().local_mprops.local_com;
        !body.is_dynamic() || (frame.translation - centre).length() == 0.0
    };
    let each = bodies.into_iter().zip(&frames);
    let inverse = |body: &RigidBody| match body.is_dynamic() {
        true => 1.0 / f64::from(body.mass()),
        false => 0.0,
    };
    let mass = 1.0 / (inverse(bodies[0]) + inverse(bodies[1]));
    let (k, c) = (f64::from(motor.stiffness), f64::from(motor.damping));
    let fits = each.into_iter().all(centred)
        && motor.model == MotorModel::ForceBased
        && motor.max_force == Real::MAX
        && k > 0.0
        && mass.is_finite();
    let omega = (k / mass).sqrt();
    fits.then(|| ((omega / TAU) as f32, (c / (2.0 * omega * mass)) as f32))
}
