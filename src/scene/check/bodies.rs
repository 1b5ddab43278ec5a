//! Checks the bodies of a file.

use super::*;
use crate::scene::file::{BodyEntry, BodyKind};
use crate::scene::joint::WORLD;
use crate::scene::outline::{check_chain, check_polygon};

pub(super) fn check(top: &At<'_>, file: &SceneFile) -> Result<(), SceneError> {
    let at = top.key("body");
    distinct(&at, "body", file.body.iter().map(|body| body.name.as_str()))?;
    let closed_form = planar::is_planar(&file.body);
    for (index, body) in file.body.iter().enumerate() {
        let at = at.index(index);
        check_body(&at, body, &file.material)?;
        check_drag(&at, body, file.step.dt)?;
        if body.ccd == Some(true) && file.step.scheme == Scheme::Moreau {
            let problem = "the times of impacts need the scheme staggered; moreau ignores gaps";
            return Err(at.key("ccd").conflict(problem));
        }
        planar::check_body(&at, body, closed_form)?;
    }
    for (index, joint) in file.joint.iter().enumerate() {
        joints::check(&top.key("joint").index(index), joint, closed_form)?;
    }
    Ok(())
}

fn check_body(at: &At<'_>, body: &BodyEntry, materials: &[Material]) -> Result<(), SceneError> {
    if body.name == WORLD {
        return Err(at
            .key("name")
            .conflict("`world` is what joints call the fixed ground"));
    }
    check_shape(at, body)?;
    check_mass(at, body)?;
    if let Some([x, y]) = body.one_way
        && (x.hypot(y) - 1.0).abs() > 1e-6
    {
        let value = format!("{:?}", [x, y]);
        return Err(at
            .key("one_way")
            .out_of_range(value, "a direction of length 1"));
    }
    let fixed = body.kind == BodyKind::Fixed;
    for (key, moving) in [
        ("velocity", body.velocity != [0.0; 2]),
        ("spin", body.spin != 0.0),
    ] {
        let why = "a fixed body does not move; use kind = \"kinematic\"";
        at.refuse(&[key], fixed && moving, why)?;
    }
    if let Some(name) = &body.material
        && !materials.iter().any(|material| material.name == *name)
    {
        let known = materials.iter().map(|material| &material.name);
        return Err(at.key("material").unknown("material", name, known));
    }
    Ok(())
}

/// Drag is computed from the velocity at the start of the step: above 1/dt it would reverse the
/// velocity.
fn check_drag(at: &At<'_>, body: &BodyEntry, dt: f64) -> Result<(), SceneError> {
    for (key, value) in [
        ("linear_damping", body.linear_damping),
        ("angular_damping", body.angular_damping),
    ] {
        if let Some(value) = value
            && value > 1.0 / dt
        {
            let allowed = format!("0 to 1/dt = {} per second", 1.0 / dt);
            return Err(at.key(key).out_of_range(format!("{value:?}"), allowed));
        }
    }
    Ok(())
}

/// Checks that each part has exactly one shape.
fn check_parts(at: &At<'_>, body: &BodyEntry) -> Result<(), SceneError> {
    let at = at.key("parts");
    let parts = body.parts.as_deref().unwrap_or(&[]);
    if parts.is_empty() {
        return Err(at.conflict("a body has at least one part"));
    }
    for (index, part) in parts.iter().enumerate() {
        let at = at.index(index);
        check_one_shape(&at)?;
        if let Some(points) = &part.polygon {
            check_outline(&at, "polygon", check_polygon(points))?;
        }
    }
    Ok(())
}

const SHAPES: [&str; 10] = [
    "disc", "box", "capsule", "polygon", "sector", "polyline", "rod", "line", "bowl", "parts",
];

fn check_one_shape(at: &At<'_>) -> Result<(), SceneError> {
    let given: Vec<&str> = SHAPES
        .into_iter()
        .filter(|shape| at.written(shape))
        .collect();
    match given[..] {
        [_] => Ok(()),
        [] => {
            let (last, others) = (SHAPES[9], SHAPES[..9].join(", "));
            Err(at.missing(format!("{others} or {last}")))
        }
        [first, second, ..] => {
            let problem = format!("a body has one shape; `{first}` is given already");
            Err(at.key(second).conflict(problem))
        }
    }
}

fn check_outline(
    at: &At<'_>,
    key: &'static str,
    faults: Result<(), String>,
) -> Result<(), SceneError> {
    faults.map_err(|problem| SceneError::Outline {
        at: at.key(key).place(),
        problem,
    })
}

fn check_shape(at: &At<'_>, body: &BodyEntry) -> Result<(), SceneError> {
    check_one_shape(at)?;
    if body.parts.is_some() {
        check_parts(at, body)?;
    }
    if let Some([radius, thickness, angle]) = body.sector {
        for (index, value, most, allowed) in [
            (1, thickness, 1.98 * radius, "1e-6 to 1.98 of the radius"),
            (2, angle, 3.0, "1e-6 to 3 rad"),
        ] {
            if value > most {
                let at = at.key("sector").index(index);
                return Err(at.out_of_range(format!("{value:?}"), allowed));
            }
        }
    }
    let chain = body.polyline.is_some();
    at.refuse(
        &["closed", "hollow", "two_sided"],
        !chain,
        "{key} is a property of a polyline",
    )?;
    let closed = body.closed == Some(true);
    at.refuse(
        &["hollow"],
        !closed || body.two_sided == Some(true),
        "{key} is a property of a closed polyline that is not two-sided",
    )?;
    if let Some(points) = &body.polygon {
        check_outline(at, "polygon", check_polygon(points))?;
    }
    if let Some(points) = &body.polyline {
        check_outline(at, "polyline", check_chain(points, closed))?;
    }
    Ok(())
}

fn check_mass(at: &At<'_>, body: &BodyEntry) -> Result<(), SceneError> {
    let moved_by_forces = [
        "density",
        "mass",
        "inertia",
        "ccd",
        "gravity_scale",
        "linear_damping",
        "angular_damping",
    ];
    let why = format!("{{key}} has no effect on a {} body", body.kind.word());
    at.refuse(&moved_by_forces, body.kind != BodyKind::Dynamic, &why)?;
    let why = "a rod has no area; give its mass";
    at.refuse(&["density"], body.rod.is_some(), why)?;
    let why = "give density or mass, not both";
    at.refuse(&["mass"], body.density.is_some(), why)?;
    let why = "inertia needs a mass";
    at.refuse(&["inertia"], body.mass.is_none(), why)?;
    // A polyline has an area only if it encloses the solid.
    let encloses = body.closed == Some(true) && body.hollow != Some(true);
    if body.kind == BodyKind::Dynamic
        && body.polyline.is_some()
        && !encloses
        && body.inertia.is_none()
    {
        let key = "mass and inertia (the polyline encloses no solid to take them from)";
        return Err(at.missing(key));
    }
    Ok(())
}
