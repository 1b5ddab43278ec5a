//! Bodies.

use super::*;
use crate::scene::file::{BodyEntry, BodyKind};
use crate::scene::joint::WORLD;
use crate::scene::outline::{check_chain, check_polygon, signed_area};

pub(super) fn check(top: &At<'_>, file: &SceneFile) -> Result<(), SceneError> {
    let at = top.key("body");
    distinct(&at, "body", file.body.iter().map(|body| body.name.as_str()))?;
    let closed_form = planar::is_planar(&file.body);
    for (index, body) in file.body.iter().enumerate() {
        let at = at.index(index);
        check_body(&at, body, &file.material)?;
        check_drag(&at, body, file.step.dt)?;
        planar::check_body(&at, body, closed_form)?;
    }
    for (index, joint) in file.joint.iter().enumerate() {
        joints::check(&top.key("joint").index(index), joint, closed_form)?;
    }
    Ok(())
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
    if let Some([x, y]) = body.one_way {
        at.pair("one_way", [x, y], PLACE)?;
        if (x.hypot(y) - 1.0).abs() > 1e-6 {
            return Err(SceneError::OutOfRange {
                at: at.key("one_way").place(),
                value: format!("{:?}", [x, y]),
                allowed: "a direction of length 1".to_owned(),
            });
        }
    }
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

/// Drag is taken at the velocity of the step's start: beyond 1/dt it would turn the velocity round.
fn check_drag(at: &At<'_>, body: &BodyEntry, dt: f64) -> Result<(), SceneError> {
    at.within_if("gravity_scale", body.gravity_scale, SCALE)?;
    for (key, value) in [
        ("linear_damping", body.linear_damping),
        ("angular_damping", body.angular_damping),
    ] {
        if let Some(value) = value
            && !(0.0..=1.0 / dt).contains(&value)
        {
            return Err(SceneError::OutOfRange {
                at: at.key(key).place(),
                value: format!("{value:?}"),
                allowed: format!("0 to 1/dt = {} per second", 1.0 / dt),
            });
        }
    }
    for (key, given) in [
        ("gravity_scale", body.gravity_scale),
        ("linear_damping", body.linear_damping),
        ("angular_damping", body.angular_damping),
    ] {
        if given.is_some() && body.kind != BodyKind::Dynamic {
            let problem = format!("{key} has no effect on a {} body", body.kind.word());
            return Err(at.key(key).conflict(problem));
        }
    }
    Ok(())
}

/// Every part is one shape by itself.
fn check_parts(at: &At<'_>, body: &BodyEntry) -> Result<(), SceneError> {
    let at = at.key("parts");
    let parts = body.parts.as_deref().unwrap_or(&[]);
    if parts.is_empty() {
        return Err(at.conflict("a body has at least one part"));
    }
    for (index, part) in parts.iter().enumerate() {
        let at = at.index(index);
        check_shape(&at, &part.alone(body))?;
        at.pair("position", part.position, PLACE)?;
        at.within("angle", part.angle, ANGLE)?;
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
        ("rod", body.rod.is_some()),
        ("line", body.line.is_some()),
        ("bowl", body.bowl.is_some()),
        ("parts", body.parts.is_some()),
    ]
    .into_iter()
    .filter_map(|(key, given)| given.then_some(key))
    .collect();
    match given[..] {
        [_] => {}
        [] => {
            return Err(SceneError::Missing {
                at: at.place(),
                key: "disc, box, capsule, polygon, sector, polyline, rod, line, bowl or parts"
                    .to_owned(),
            });
        }
        [first, second, ..] => {
            let problem = format!("a body has one shape; `{first}` is given already");
            return Err(at.key(second).conflict(problem));
        }
    }
    if body.parts.is_some() {
        check_parts(at, body)?;
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
    if body.two_sided.is_some() && body.polyline.is_none() {
        return Err(at
            .key("two_sided")
            .conflict("two_sided is a property of a polyline"));
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
    if body.density.is_some() && body.rod.is_some() {
        return Err(at
            .key("density")
            .conflict("a rod has no area; give its mass"));
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
