//! Checks copies of bodies: grids, rings and chains.

use super::*;
use crate::scene::expand::copies;
use crate::scene::file::{BodyEntry, BodyKind, RepeatEntry};
use crate::scene::keys::MOST_BODIES;

/// Checks every repeat, and the total number of bodies that they place.
pub(super) fn check(top: &At<'_>, file: &SceneFile) -> Result<(), SceneError> {
    let at = top.key("repeat");
    let mut placed = 0_u64;
    for (index, repeat) in file.repeat.iter().enumerate() {
        let at = at.index(index);
        let template = check_repeat(&at, repeat, &file.body)?;
        placed = placed.saturating_add(copies(repeat).saturating_mul(points(template)));
        if placed > u64::from(MOST_BODIES) {
            let key = if repeat.ring.is_some() {
                "ring"
            } else {
                "count"
            };
            let value = format!("{} copies", copies(repeat));
            let allowed =
                format!("{MOST_BODIES} in the whole scene, polygons counted by their corners");
            return Err(at.key(key).out_of_range(value, allowed));
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
    let count = |outline: Option<&Vec<_>>| outline.map_or(1, |points| points.len().max(1) as u64);
    let parts = body.parts.iter().flatten();
    let parts = parts.map(|part| count(part.polygon.as_ref())).sum();
    count(body.polygon.as_ref().or(body.polyline.as_ref())).max(parts)
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
    if let Some(ring) = &repeat.ring {
        at.refuse(
            &["count", "step", "shrink", "pins", "fixed"],
            true,
            "a repeat is a grid or a ring, not both",
        )?;
        if let Some(arc) = ring.arc {
            let span = arc[1] - arc[0];
            if !(span > 0.0 && span <= std::f64::consts::TAU) {
                let allowed = "[from, to] with from < to, at most a whole turn";
                let at = at.key("ring").key("arc");
                return Err(at.out_of_range(format!("{arc:?}"), allowed));
            }
        }
    } else {
        check_grid(at, repeat, template)?;
    }
    if repeat.pin.is_some() {
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
    let why = "only discs have a radius to spread";
    let spread = repeat.radius_spread > 0.0;
    at.refuse(&["radius_spread"], spread && template.disc.is_none(), why)?;
    let random = repeat.jitter > 0.0 || spread;
    if random && repeat.seed.is_none() {
        return Err(at.missing("seed"));
    }
    let why = "a seed has no effect without jitter or radius_spread";
    at.refuse(&["seed"], !random, why)?;
    Ok(template)
}

fn check_grid(at: &At<'_>, repeat: &RepeatEntry, template: &BodyEntry) -> Result<(), SceneError> {
    let Some(count) = &repeat.count else {
        return Err(at.missing("count (or ring)"));
    };
    let Some(step) = &repeat.step else {
        return Err(at.missing("step (or ring)"));
    };
    if !(1..=4).contains(&count.len()) {
        let expected = "an array of 1 to 4 numbers".to_owned();
        return Err(at.key("count").wrong_length(expected, count.len()));
    }
    if step.len() != count.len() {
        let expected = format!("{} pairs [dx, dy], one for each count", count.len());
        return Err(at.key("step").wrong_length(expected, step.len()));
    }
    if let Some(shrink) = repeat.shrink {
        let rows = u64::from(count.get(1).copied().unwrap_or(1));
        let most = u64::from(count[0] - 1) / (rows - 1).max(1);
        if u64::from(shrink) > most {
            let allowed = format!("0 to {most}, so that the last of {rows} rows has a copy");
            return Err(at.key("shrink").out_of_range(shrink.to_string(), allowed));
        }
    }
    check_fixed(at, repeat, count, template)?;
    check_pins(at, repeat, count, template)
}

/// Checks that the copies listed in `fixed` exist.
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
            let allowed = format!("the numbers, from 0, of a copy in a grid of {count:?}");
            return Err(at.index(index).out_of_range(format!("{place:?}"), allowed));
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
        let expected = format!("{} points [x, y], one for each count", count.len());
        return Err(at.wrong_length(expected, pins.len()));
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
