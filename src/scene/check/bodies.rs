//! Bodies, repeats and joints.

use super::*;
use crate::scene::Joint;
use crate::scene::expand::copies;
use crate::scene::file::{BodyEntry, BodyKind, JointEntry, JointKind, RepeatEntry, WORLD};
use crate::scene::outline::{check_chain, check_polygon, signed_area};
use std::collections::HashMap;

/// Most bodies a scene may place, a polygon or polyline counted by its points: beyond it a slip
/// of a zero in `count` would fill the memory.
const MOST_BODIES: u64 = 100_000;

pub(super) fn check(top: &At<'_>, file: &SceneFile) -> Result<(), SceneError> {
    let at = top.key("body");
    distinct(&at, "body", file.body.iter().map(|body| body.name.as_str()))?;
    for (index, body) in file.body.iter().enumerate() {
        check_body(&at.index(index), body, &file.material)?;
    }
    let at = top.key("repeat");
    let mut placed = 0_u64;
    for (index, repeat) in file.repeat.iter().enumerate() {
        let at = at.index(index);
        let template = check_repeat(&at, repeat, &file.body)?;
        placed = placed.saturating_add(copies(repeat).saturating_mul(points(template)));
        if placed > MOST_BODIES {
            let key = if repeat.ring.is_some() {
                "ring"
            } else {
                "count"
            };
            return Err(SceneError::OutOfRange {
                at: at.key(key).place(),
                value: format!("{} copies", copies(repeat)),
                allowed: format!(
                    "{MOST_BODIES} in the whole scene, polygons counted by their corners"
                ),
            });
        }
    }
    let base = |repeat: &RepeatEntry| repeat.name.clone().unwrap_or_else(|| repeat.of.clone());
    for (index, repeat) in file.repeat.iter().enumerate() {
        if file.repeat[..index]
            .iter()
            .any(|other| base(other) == base(repeat))
        {
            return Err(SceneError::Duplicate {
                at: at.index(index).place(),
                what: "repeat",
                name: base(repeat),
            });
        }
    }
    for (index, joint) in file.joint.iter().enumerate() {
        check_joint(&top.key("joint").index(index), joint)?;
    }
    Ok(())
}

fn points(body: &BodyEntry) -> u64 {
    let outline = body.polygon.as_ref().or(body.polyline.as_ref());
    outline.map_or(1, |points| points.len().max(1) as u64)
}

fn check_body(at: &At<'_>, body: &BodyEntry, materials: &[Material]) -> Result<(), SceneError> {
    at.name("name", &body.name)?;
    if body.name == WORLD {
        return Err(at
            .key("name")
            .conflict("`world` is what joints call the fixed ground"));
    }
    check_shape(at, body)?;
    check_mass(at, body)?;
    at.pair("position", body.position, PLACE)?;
    at.within("angle", body.angle, ANGLE)?;
    at.pair("velocity", body.velocity, SPEED)?;
    at.within("spin", body.spin, SPIN)?;
    at.within("surface_velocity", body.surface_velocity, SPEED)?;
    if body.kind == BodyKind::Fixed {
        for (key, moving) in [
            ("velocity", body.velocity != [0.0; 2]),
            ("spin", body.spin != 0.0),
        ] {
            if moving {
                return Err(at
                    .key(key)
                    .conflict("a fixed body does not move; use kind = \"kinematic\""));
            }
        }
    }
    if let Some(name) = &body.material
        && !materials.iter().any(|material| material.name == *name)
    {
        let known = materials.iter().map(|material| &material.name);
        return Err(at.key("material").unknown("material", name, known));
    }
    Ok(())
}

fn check_shape(at: &At<'_>, body: &BodyEntry) -> Result<(), SceneError> {
    let given: Vec<&str> = [
        ("disc", body.disc.is_some()),
        ("box", body.rectangle.is_some()),
        ("capsule", body.capsule.is_some()),
        ("polygon", body.polygon.is_some()),
        ("sector", body.sector.is_some()),
        ("polyline", body.polyline.is_some()),
    ]
    .into_iter()
    .filter_map(|(key, given)| given.then_some(key))
    .collect();
    match given[..] {
        [_] => {}
        [] => {
            return Err(SceneError::Missing {
                at: at.place(),
                key: "disc, box, capsule, polygon, sector or polyline".to_owned(),
            });
        }
        [first, second, ..] => {
            let problem = format!("a body has one shape; `{first}` is given already");
            return Err(at.key(second).conflict(problem));
        }
    }
    at.within_if("disc", body.disc, SIZE)?;
    for (key, size) in [("box", body.rectangle), ("capsule", body.capsule)] {
        if let Some(size) = size {
            at.pair(key, size, SIZE)?;
        }
    }
    if let Some([radius, thickness, angle]) = body.sector {
        let at = at.key("sector");
        for (key, value, most, text) in [
            (0, radius, SIZE.most, SIZE.text),
            (1, thickness, 1.98 * radius, "1e-6 to 1.98 of the radius"),
            (2, angle, 3.0, "1e-6 to 3 rad"),
        ] {
            if !(1e-6..=most).contains(&value) {
                return Err(SceneError::OutOfRange {
                    at: at.index(key).place(),
                    value: format!("{value:?}"),
                    allowed: text.to_owned(),
                });
            }
        }
    }
    if body.closed.is_some() && body.polyline.is_none() {
        return Err(at
            .key("closed")
            .conflict("closed is a property of a polyline"));
    }
    let outline = |key, points: &[[f64; 2]], faults: Result<(), String>| {
        for (index, point) in points.iter().enumerate() {
            at.key(key).at_point(index, *point)?;
        }
        faults.map_err(|problem| SceneError::Outline {
            at: at.key(key).place(),
            problem,
        })
    };
    if let Some(points) = &body.polygon {
        outline("polygon", points, check_polygon(points))?;
    }
    if let Some(points) = &body.polyline {
        outline(
            "polyline",
            points,
            check_chain(points, body.closed == Some(true)),
        )?;
    }
    Ok(())
}

impl At<'_> {
    fn at_point(&self, index: usize, point: [f64; 2]) -> Result<(), SceneError> {
        const CORNER: Range = range(-1e6, 1e6, "-1e6 to 1e6 m");
        for (axis, value) in point.into_iter().enumerate() {
            if !(CORNER.least..=CORNER.most).contains(&value) {
                return Err(SceneError::OutOfRange {
                    at: self.index(index).index(axis).place(),
                    value: format!("{value:?}"),
                    allowed: CORNER.text.to_owned(),
                });
            }
        }
        Ok(())
    }
}

fn check_mass(at: &At<'_>, body: &BodyEntry) -> Result<(), SceneError> {
    let keys = [
        ("density", body.density, DENSITY),
        ("mass", body.mass, MASS),
        ("inertia", body.inertia, INERTIA),
    ];
    for (key, value, range) in keys {
        at.within_if(key, value, range)?;
        if value.is_some() && body.kind != BodyKind::Dynamic {
            let problem = format!("{key} has no effect on a {} body", body.kind.word());
            return Err(at.key(key).conflict(problem));
        }
    }
    if body.density.is_some() && body.mass.is_some() {
        return Err(at.key("mass").conflict("give density or mass, not both"));
    }
    if body.inertia.is_some() && body.mass.is_none() {
        return Err(at.key("inertia").conflict("inertia needs a mass"));
    }
    // A chain has no area of its own, except where it encloses the solid.
    let encloses = |points: &Vec<_>| body.closed == Some(true) && signed_area(points) > 0.0;
    if body.kind == BodyKind::Dynamic
        && body
            .polyline
            .as_ref()
            .is_some_and(|points| !encloses(points))
        && body.inertia.is_none()
    {
        return Err(SceneError::Missing {
            at: at.place(),
            key: "mass and inertia (the polyline encloses no solid to take them from)".to_owned(),
        });
    }
    Ok(())
}

fn check_repeat<'b>(
    at: &At<'_>,
    repeat: &RepeatEntry,
    bodies: &'b [BodyEntry],
) -> Result<&'b BodyEntry, SceneError> {
    let Some(template) = bodies.iter().find(|body| body.name == repeat.of) else {
        let known = bodies.iter().map(|body| &body.name);
        return Err(at.key("of").unknown("body", &repeat.of, known));
    };
    if let Some(name) = &repeat.name {
        at.name("name", name)?;
    }
    if let Some(ring) = &repeat.ring {
        for (key, given) in [
            ("count", repeat.count.is_some()),
            ("step", repeat.step.is_some()),
            ("shrink", repeat.shrink.is_some()),
        ] {
            if given {
                return Err(at
                    .key(key)
                    .conflict("a repeat is a grid or a ring, not both"));
            }
        }
        let at = at.key("ring");
        at.pair("centre", ring.centre, PLACE)?;
        at.within("radius", ring.radius, range(0.0, 1e6, "0 to 1e6 m"))?;
        at.count("count", ring.count, 1, MOST_BODIES as u32)?;
        if let Some(arc) = ring.arc {
            at.pair("arc", arc, ANGLE)?;
            let span = arc[1] - arc[0];
            if !(span > 0.0 && span <= std::f64::consts::TAU) {
                return Err(SceneError::OutOfRange {
                    at: at.key("arc").place(),
                    value: format!("{arc:?}"),
                    allowed: "[from, to] with from < to, at most a whole turn".to_owned(),
                });
            }
        }
    } else {
        check_grid(at, repeat)?;
    }
    if let Some(pin) = repeat.pin {
        at.pair("pin", pin, PLACE)?;
        let grid = repeat.count.as_ref().is_some_and(|count| count.len() > 1);
        let problem = match template.kind {
            _ if grid => "a pin ties the copies of a row or ring, not of a grid",
            BodyKind::Dynamic if copies(repeat) > 1 => "",
            BodyKind::Dynamic => "a single copy has no neighbour to tie",
            _ => "the copies are not dynamic: the pin has no effect",
        };
        if !problem.is_empty() {
            return Err(at.key("pin").conflict(problem));
        }
    }
    at.within("jitter", repeat.jitter, range(0.0, 1e6, "0 to 1e6 m"))?;
    at.within(
        "radius_spread",
        repeat.radius_spread,
        range(0.0, 0.9, "0 to 0.9"),
    )?;
    if repeat.radius_spread > 0.0 && template.disc.is_none() {
        return Err(at
            .key("radius_spread")
            .conflict("only discs have a radius to spread"));
    }
    let random = repeat.jitter > 0.0 || repeat.radius_spread > 0.0;
    match repeat.seed {
        None if random => Err(SceneError::Missing {
            at: at.place(),
            key: "seed".to_owned(),
        }),
        Some(_) if !random => Err(at
            .key("seed")
            .conflict("a seed has no effect without jitter or radius_spread")),
        _ => Ok(template),
    }
}

fn check_grid(at: &At<'_>, repeat: &RepeatEntry) -> Result<(), SceneError> {
    let (Some(count), Some(step)) = (&repeat.count, &repeat.step) else {
        let missing = if repeat.count.is_none() {
            "count"
        } else {
            "step"
        };
        return Err(SceneError::Missing {
            at: at.place(),
            key: format!("{missing} (or ring)"),
        });
    };
    if !(1..=2).contains(&count.len()) {
        return Err(SceneError::WrongType {
            at: at.key("count").place(),
            expected: "an array of 1 or 2 numbers".to_owned(),
            found: format!("{} of them", count.len()),
        });
    }
    if step.len() != count.len() {
        return Err(SceneError::WrongType {
            at: at.key("step").place(),
            expected: format!("{} pairs [dx, dy], one for each count", count.len()),
            found: format!("{} of them", step.len()),
        });
    }
    for index in 0..count.len() {
        if count[index] == 0 {
            return Err(SceneError::OutOfRange {
                at: at.key("count").index(index).place(),
                value: "0".to_owned(),
                allowed: format!("1 to {MOST_BODIES}"),
            });
        }
        at.key("step").at_point(index, step[index])?;
    }
    if let Some(shrink) = repeat.shrink {
        let rows = u64::from(count.get(1).copied().unwrap_or(1));
        let most = u64::from(count[0] - 1) / (rows - 1).max(1);
        if u64::from(shrink) > most {
            return Err(SceneError::OutOfRange {
                at: at.key("shrink").place(),
                value: shrink.to_string(),
                allowed: format!("0 to {most}, so that the last of {rows} rows has a copy"),
            });
        }
    }
    Ok(())
}

fn check_joint(at: &At<'_>, joint: &JointEntry) -> Result<(), SceneError> {
    if joint.kind != JointKind::Revolute {
        return Err(SceneError::Unsupported {
            at: at.key("kind").place(),
            what: format!("a {} joint", joint.kind.word()),
            supported: "revolute",
        });
    }
    if joint.bodies[0] == joint.bodies[1] {
        let problem = format!("the joint ties `{}` to itself", joint.bodies[0]);
        return Err(at.key("bodies").conflict(problem));
    }
    at.pair("at", joint.at, PLACE)?;
    if let Some(motor) = joint.motor {
        at.key("motor").within("speed", motor.speed, SPIN)?;
        at.key("motor")
            .within("max_torque", motor.max_torque, TORQUE)?;
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
            Ok(Joint {
                kind: joint.kind,
                bodies,
                at: joint.at,
                motor: joint.motor,
            })
        })
        .collect()
}
