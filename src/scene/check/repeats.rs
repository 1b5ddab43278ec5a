//! Copies of bodies: grids, rings and chains.

use super::*;
use crate::scene::expand::copies;
use crate::scene::file::{BodyEntry, BodyKind, RepeatEntry};

/// Most bodies a scene may place, a polygon or polyline counted by its points: beyond it a slip
/// of a zero in `count` would fill the memory.
const MOST_BODIES: u64 = 100_000;

/// Checks every repeat, and that all of them together place a bounded number of bodies.
pub(super) fn check(top: &At<'_>, file: &SceneFile) -> Result<(), SceneError> {
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
    Ok(())
}

fn points(body: &BodyEntry) -> u64 {
    let outline = body.polygon.as_ref().or(body.polyline.as_ref());
    let parts = body.parts.iter().flatten();
    let parts: u64 = parts.map(|part| points(&part.alone(body))).sum();
    outline
        .map_or(1, |points| points.len().max(1) as u64)
        .max(parts)
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
            ("pins", repeat.pins.is_some()),
            ("fixed", repeat.fixed.is_some()),
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
        check_grid(at, repeat, template)?;
    }
    if let Some(pin) = repeat.pin {
        at.pair("pin", pin, PLACE)?;
        let grid = repeat.count.as_ref().is_some_and(|count| count.len() > 1);
        let problem = match template.kind {
            _ if grid => "a pin ties the copies of a row or ring; for a grid give `pins`",
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

fn check_grid(at: &At<'_>, repeat: &RepeatEntry, template: &BodyEntry) -> Result<(), SceneError> {
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
    if !(1..=4).contains(&count.len()) {
        return Err(SceneError::WrongType {
            at: at.key("count").place(),
            expected: "an array of 1 to 4 numbers".to_owned(),
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
    check_fixed(at, repeat, count, template)?;
    check_pins(at, repeat, count, template)
}

/// Copies named as fixed exist.
fn check_fixed(
    at: &At<'_>,
    repeat: &RepeatEntry,
    count: &[u32],
    template: &BodyEntry,
) -> Result<(), SceneError> {
    let at = at.key("fixed");
    if repeat.fixed.is_some() && template.kind != BodyKind::Dynamic {
        let problem = format!("the copies are {} already", template.kind.word());
        return Err(at.conflict(problem));
    }
    for (index, place) in repeat.fixed.iter().flatten().enumerate() {
        let less = place
            .get(1)
            .map_or(0, |row| row.saturating_mul(repeat.shrink.unwrap_or(0)));
        let there = |axis: usize, k: u32| {
            let short = if axis == 0 { less } else { 0 };
            k < count[axis].saturating_sub(short)
        };
        let found =
            place.len() == count.len() && place.iter().enumerate().all(|(axis, &k)| there(axis, k));
        if !found {
            return Err(SceneError::OutOfRange {
                at: at.index(index).place(),
                value: format!("{place:?}"),
                allowed: format!("the numbers, from 0, of a copy in a grid of {count:?}"),
            });
        }
    }
    Ok(())
}

fn check_pins(
    at: &At<'_>,
    repeat: &RepeatEntry,
    count: &[u32],
    template: &BodyEntry,
) -> Result<(), SceneError> {
    let Some(pins) = &repeat.pins else {
        return Ok(());
    };
    let at = at.key("pins");
    if pins.len() != count.len() {
        return Err(SceneError::WrongType {
            at: at.place(),
            expected: format!("{} points [x, y], one for each count", count.len()),
            found: format!("{} of them", pins.len()),
        });
    }
    for (index, pin) in pins.iter().enumerate() {
        at.at_point(index, *pin)?;
    }
    let problem = match template.kind {
        _ if repeat.pin.is_some() => "give either pin or pins",
        _ if repeat.shrink.is_some() => "in a grid that shrinks no copy has one right above it",
        BodyKind::Dynamic if copies(repeat) > 1 => return Ok(()),
        BodyKind::Dynamic => "a single copy has no neighbour to tie",
        _ => "the copies are not dynamic: the pins have no effect",
    };
    Err(at.conflict(problem))
}
