//! Checks the joints of a file.

use super::*;
use crate::scene::file::{BodyEntry, BodyKind};
use crate::scene::joint::{Joint, JointEntry, JointKind, Motor, WORLD};
use std::collections::HashMap;
use std::f64::consts::TAU;

pub(super) fn check(at: &At<'_>, joint: &JointEntry, closed_form: bool) -> Result<(), SceneError> {
    let kind = joint.kind;
    if joint.bodies[0] == joint.bodies[1] {
        let problem = format!("the joint ties `{}` to itself", joint.bodies[0]);
        return Err(at.key("bodies").conflict(problem));
    }
    let distance = kind.is_distance();
    let why = format!("{{key}} has no effect on a {} joint", kind.word());
    for (keys, known) in [
        (&["at"][..], !distance),
        (&["anchors", "length"], distance),
        (&["axis"], kind.has_axis()),
        (&["stiffness", "damping"], kind == JointKind::Spring),
        (
            &["limits"],
            !matches!(kind, JointKind::Fixed | JointKind::Rope),
        ),
        (&["motor"], kind == JointKind::Revolute || kind.has_axis()),
    ] {
        at.refuse(keys, !known, &why)?;
    }
    if distance && joint.anchors.is_none() {
        return Err(at.missing("anchors (a point of each body)"));
    }
    if !distance && joint.at.is_none() {
        return Err(at.missing("at"));
    }
    if let Some([x, y]) = joint.axis
        && x.hypot(y) < 1e-9
    {
        return Err(at.key("axis").conflict("the axis has no direction"));
    }
    if kind == JointKind::Spring && joint.stiffness.is_none() {
        return Err(at.missing("stiffness"));
    }
    if let Some(limits) = joint.limits {
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
    let (own, other) = match kind {
        JointKind::Revolute => ("max_torque", "max_force"),
        _ => ("max_force", "max_torque"),
    };
    let why = format!("the motor of a {} joint has a {own}", kind.word());
    at.refuse(&[other], true, &why)?;
    let spring = motor.stiffness.is_some();
    let why = "a motor has either a speed or a stiffness";
    at.refuse(&["speed"], spring, why)?;
    at.refuse(&["target", "damping"], !spring, "{key} needs a stiffness")?;
    if !spring && motor.speed.is_none() {
        return Err(at.missing("speed or stiffness"));
    }
    if !spring && !at.written(own) {
        return Err(at.missing(own));
    }
    Ok(())
}

/// All joints, with the numbers of their bodies among the `placed` ones.
///
/// # Errors
/// [`SceneError::UnknownName`]; [`SceneError::Conflict`] for a joint between two bodies that are
/// both not dynamic.
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
