//! Joints.

use super::*;
use crate::scene::file::{BodyEntry, BodyKind};
use crate::scene::joint::{Joint, JointEntry, JointKind, Motor, WORLD};
use std::collections::HashMap;
use std::f64::consts::TAU;

const COORDINATE: Range = range(-1e9, 1e9, "-1e9 to 1e9");
const LENGTH: Range = range(0.0, 1e9, "0 to 1e9 m");
const GAIN: Range = range(0.0, 1e15, "0 to 1e15");

pub(super) fn check(at: &At<'_>, joint: &JointEntry, closed_form: bool) -> Result<(), SceneError> {
    let kind = joint.kind;
    if joint.bodies[0] == joint.bodies[1] {
        let problem = format!("the joint ties `{}` to itself", joint.bodies[0]);
        return Err(at.key("bodies").conflict(problem));
    }
    let distance = kind.is_distance();
    for (key, given, known) in [
        ("at", joint.at.is_some(), !distance),
        ("anchors", joint.anchors.is_some(), distance),
        ("axis", joint.axis.is_some(), kind.has_axis()),
        ("length", joint.length.is_some(), distance),
        (
            "stiffness",
            joint.stiffness.is_some(),
            kind == JointKind::Spring,
        ),
        (
            "damping",
            joint.damping.is_some(),
            kind == JointKind::Spring,
        ),
        (
            "limits",
            joint.limits.is_some(),
            !matches!(kind, JointKind::Fixed | JointKind::Rope),
        ),
        (
            "motor",
            joint.motor.is_some(),
            kind == JointKind::Revolute || kind.has_axis(),
        ),
    ] {
        if given && !known {
            let problem = format!("{key} has no effect on a {} joint", kind.word());
            return Err(at.key(key).conflict(problem));
        }
    }
    let missing = |key: &str| SceneError::Missing {
        at: at.place(),
        key: key.to_owned(),
    };
    match (joint.at, joint.anchors) {
        (None, None) if distance => return Err(missing("anchors (a point of each body)")),
        (None, None) => return Err(missing("at")),
        (Some(place), _) => at.pair("at", place, PLACE)?,
        (_, Some(points)) => {
            for (index, point) in points.into_iter().enumerate() {
                at.key("anchors").at_point(index, point)?;
            }
        }
    }
    if let Some(axis) = joint.axis {
        at.pair("axis", axis, PLACE)?;
        if axis[0].hypot(axis[1]) < 1e-9 {
            return Err(at.key("axis").conflict("the axis has no direction"));
        }
    }
    at.within_if("length", joint.length, LENGTH)?;
    if kind == JointKind::Spring && joint.stiffness.is_none() {
        return Err(missing("stiffness"));
    }
    at.within_if("stiffness", joint.stiffness, GAIN)?;
    at.within_if("damping", joint.damping, GAIN)?;
    if let Some(limits) = joint.limits {
        at.pair("limits", limits, COORDINATE)?;
        let [low, high] = limits;
        if low > high {
            let problem = format!("the lower limit {low:?} is above the upper one {high:?}");
            return Err(at.key("limits").conflict(problem));
        }
        if kind == JointKind::Revolute && high - low >= TAU {
            let problem = "limits a whole turn or more apart are none; leave them out";
            return Err(at.key("limits").conflict(problem));
        }
    }
    if let Some(motor) = &joint.motor {
        check_motor(&at.key("motor"), motor, kind)?;
    }
    if closed_form {
        let springs = joint.motor.is_some_and(|m| m.stiffness.is_some());
        let more = joint.limits.is_some() || springs || joint.contacts;
        if kind != JointKind::Revolute || more {
            let what = if kind == JointKind::Revolute {
                "a joint with limits, a spring or contacts".to_owned()
            } else {
                format!("a {} joint", kind.word())
            };
            return Err(SceneError::Unsupported {
                at: at.place(),
                what: format!("{what} in a scene with a rod, a line or a bowl"),
                supported: "revolute, with a motor of given speed",
            });
        }
    }
    Ok(())
}

fn check_motor(at: &At<'_>, motor: &Motor, kind: JointKind) -> Result<(), SceneError> {
    let (own, other) = if kind == JointKind::Revolute {
        ("max_torque", ("max_force", motor.max_force))
    } else {
        ("max_force", ("max_torque", motor.max_torque))
    };
    if other.1.is_some() {
        let problem = format!("the motor of a {} joint has a {own}", kind.word());
        return Err(at.key(other.0).conflict(problem));
    }
    at.within_if("speed", motor.speed, SPIN)?;
    at.within_if("target", motor.target, COORDINATE)?;
    at.within_if("stiffness", motor.stiffness, GAIN)?;
    at.within_if("damping", motor.damping, GAIN)?;
    at.within_if("max_torque", motor.max_torque, TORQUE)?;
    at.within_if("max_force", motor.max_force, TORQUE)?;
    let missing = |key: &str| SceneError::Missing {
        at: at.place(),
        key: key.to_owned(),
    };
    if motor.stiffness.is_some() {
        if motor.speed.is_some() {
            let problem = "a motor has either a speed or a stiffness";
            return Err(at.key("speed").conflict(problem));
        }
        return Ok(());
    }
    for (key, given) in [
        ("target", motor.target.is_some()),
        ("damping", motor.damping.is_some()),
    ] {
        if given {
            return Err(at.key(key).conflict(format!("{key} needs a stiffness")));
        }
    }
    if motor.speed.is_none() {
        return Err(missing("speed or stiffness"));
    }
    if motor.max_torque.or(motor.max_force).is_none() {
        return Err(missing(own));
    }
    Ok(())
}

/// Every joint with the numbers of its bodies among those placed.
///
/// # Errors
/// [`SceneError::UnknownName`]; [`SceneError::Conflict`] for a joint between two bodies neither
/// of which it can move.
pub(in crate::scene) fn joints(
    joints: &[JointEntry],
    placed: &[BodyEntry],
    document: &Document,
) -> Result<Vec<Joint>, SceneError> {
    let top = At::top(document);
    let numbers: HashMap<&str, usize> = placed
        .iter()
        .enumerate()
        .map(|(number, body)| (body.name.as_str(), number))
        .collect();
    joints
        .iter()
        .enumerate()
        .map(|(index, joint)| {
            let at = top.key("joint").index(index).key("bodies");
            let mut bodies = [None; 2];
            for (side, name) in joint.bodies.iter().enumerate() {
                bodies[side] = numbers.get(name.as_str()).copied();
                if bodies[side].is_none() && name != WORLD {
                    let known = placed.iter().map(|body| body.name.as_str()).chain([WORLD]);
                    return Err(at.index(side).unknown("body", name, known));
                }
            }
            let movable = |body: &usize| placed[*body].kind == BodyKind::Dynamic;
            if !bodies.iter().flatten().any(movable) {
                return Err(at.conflict("neither body is dynamic: the joint has no effect"));
            }
            let place = joint.at.unwrap_or([0.0; 2]);
            let points = joint.anchors.unwrap_or([place; 2]);
            let [dx, dy] = [0, 1].map(|i| points[1][i] - points[0][i]);
            let [x, y] = joint.axis.unwrap_or([1.0, 0.0]);
            Ok(Joint {
                kind: joint.kind,
                bodies,
                at: points,
                axis: y.atan2(x),
                limits: joint.limits,
                length: joint.length.unwrap_or(dx.hypot(dy)),
                spring: [joint.stiffness.unwrap_or(0.0), joint.damping.unwrap_or(0.0)],
                motor: joint.motor,
                contacts: joint.contacts,
            })
        })
        .collect()
}
