//! Checks scenes with rods, lines and bowls. They run on closed-form geometry, which knows fewer
//! shapes and keys.

use super::*;
use crate::models::PlanarShape;
use crate::scene::document::Value;
use crate::scene::file::{BodyEntry, BodyKind};
use crate::scene::planar::{build, may_touch, shape, tied};
use crate::scene::{Body, Joint, Model, Scene, Shape};

const SHAPES: &str = "disc, box, rod, line and bowl";
/// Most bodies of such a scene: half a million pairs.
const MOST_BODIES: usize = 1000;

/// Whether the file has a shape that only the closed-form geometry knows.
pub(super) fn is_planar(bodies: &[BodyEntry]) -> bool {
    let only_planar = |b: &BodyEntry| b.rod.is_some() || b.line.is_some() || b.bowl.is_some();
    bodies.iter().any(only_planar)
}

/// Checks the keys of one body; `planar` if the scene runs on closed-form geometry.
pub(super) fn check_body(at: &At<'_>, body: &BodyEntry, planar: bool) -> Result<(), SceneError> {
    let why = "`line = false` says nothing; leave it out";
    at.refuse(&["line"], body.line == Some(false), why)?;
    let dynamic = body.kind == BodyKind::Dynamic;
    let why = "a {key} has no mass; use kind = \"fixed\" or \"kinematic\"";
    at.refuse(&["line", "bowl"], dynamic, why)?;
    if body.rod.is_some() && dynamic && body.mass.is_none() {
        return Err(at.missing("mass (a rod has no area to take it from)"));
    }
    let why = "{key} is known only to scenes with a rod, a line or a bowl";
    at.refuse(&["oscillation", "touches"], !planar, why)?;
    if !planar {
        return Ok(());
    }
    for key in ["capsule", "polygon", "polyline", "parts"] {
        if at.written(key) {
            return Err(SceneError::Unsupported {
                at: at.key(key).place(),
                what: format!("a {key} in a scene with a rod, a line or a bowl"),
                supported: SHAPES,
            });
        }
    }
    let unknown = [
        "one_way",
        "ccd",
        "gravity_scale",
        "linear_damping",
        "angular_damping",
    ];
    let why = "a scene with a rod, a line or a bowl knows no {key}";
    at.refuse(&unknown, true, why)?;
    let why = "only a kinematic body swings by itself";
    at.refuse(&["oscillation"], body.kind != BodyKind::Kinematic, why)
}

/// For each placed body, the numbers of the bodies that it may touch; `None` if it may touch all.
///
/// # Errors
/// [`SceneError::UnknownName`].
pub(in crate::scene) fn touches(
    placed: &[BodyEntry],
    document: &Document,
) -> Result<Vec<Option<Vec<usize>>>, SceneError> {
    let number = |body: &BodyEntry, index: usize, name: &String| {
        let found = placed.iter().position(|other| other.name == *name);
        found.ok_or_else(|| {
            let at = at_body(&body.name, document);
            let known = placed.iter().map(|b| b.name.as_str());
            at.key("touches").index(index).unknown("body", name, known)
        })
    };
    placed
        .iter()
        .map(|body| {
            let list = body.touches.as_ref().map(|names| {
                let numbers = names.iter().enumerate();
                numbers
                    .map(|(index, name)| number(body, index, name))
                    .collect()
            });
            list.transpose()
        })
        .collect()
}

/// Refuses two bodies that could touch although their gap has no closed form here.
///
/// # Errors
/// [`SceneError::Conflict`].
pub(in crate::scene) fn planar(
    bodies: &[Body],
    joints: &[Joint],
    document: &Document,
) -> Result<(), SceneError> {
    if !bodies.iter().any(|body| body.shape.planar_only()) {
        return Ok(());
    }
    if bodies.len() > MOST_BODIES {
        let value = format!("{} bodies", bodies.len());
        let allowed = format!(
            "1 to {MOST_BODIES} in a scene with a rod, a line or a bowl, where every pair is looked \
             at in every step"
        );
        return Err(At::top(document).key("body").out_of_range(value, allowed));
    }
    for i in 0..bodies.len() {
        for j in i + 1..bodies.len() {
            let still = [i, j].iter().all(|&k| bodies[k].kind != BodyKind::Dynamic);
            if still || tied(joints, i, j) || !may_touch(bodies, i, j) {
                continue;
            }
            let known = match (shape(&bodies[i].shape), shape(&bodies[j].shape)) {
                (Some(a), Some(b)) => a.meets(&b),
                _ => false,
            };
            if !known {
                let problem = format!(
                    "`{}` and `{}` could meet, and their gap has no closed form here; say with \
                     `touches` what each of them may touch",
                    bodies[i].name, bodies[j].name
                );
                return Err(at_body(&bodies[j].name, document).conflict(problem));
            }
        }
    }
    Ok(())
}

/// Refuses a body that starts on the wrong side of a surface that it may touch. The step pushes a
/// small overlap out. An overlap deeper than the body is an error of the file.
///
/// # Errors
/// [`SceneError::Conflict`].
pub(in crate::scene) fn starts(scene: &Scene, document: &Document) -> Result<(), SceneError> {
    if scene.model() != Model::Planar {
        return Ok(());
    }
    let top = At::top(document);
    let model = build(scene).map_err(|error| top.key("body").conflict(error.to_string()))?;
    let Some(([surface, body], gap)) = model.deepest() else {
        return Ok(());
    };
    let (surface, body) = (&scene.bodies[surface], &scene.bodies[body]);
    let too_big = match (&surface.shape, &body.shape) {
        (Shape::Bowl { radius }, Shape::Disc { radius: r }) => r >= radius,
        _ => false,
    };
    if too_big || -gap > shape(&body.shape).map_or(0.0, |s: PlanarShape| s.size()) {
        let problem = format!(
            "`{}` starts {} m behind the surface of `{}`; place it in front, or say with \
             `touches` what it may touch",
            body.name, -gap, surface.name
        );
        return Err(at_body(&body.name, document).conflict(problem));
    }
    Ok(())
}

/// The place of the body of that name in the file. For a copy made by a repeat, which has none, the
/// place of all bodies.
fn at_body<'d>(name: &str, document: &'d Document) -> At<'d> {
    let at = At::top(document).key("body");
    let index = match document.root.entry("body").map(|entry| &entry.node.value) {
        Some(Value::Array(items)) => items
            .iter()
            .position(|item| item.string("name") == Some(name)),
        _ => None,
    };
    index.map_or(at.clone(), |index| at.index(index))
}
