//! Expands the checked file to a flat list of placed bodies.

use super::file::{BodyEntry, BodyKind, RepeatEntry};
use super::joint::{JointEntry, JointKind};
use super::random::SplitMix64;

/// All bodies of the scene, in the order of the file; the copies replace their template, repeat by
/// repeat.
///
/// The result depends on the file alone: random displacements come from SplitMix64 started at
/// the repeat's seed, three draws a copy in the order of the copies, whichever are used.
///
/// # Arguments
/// - `bodies`, `repeats`: checked, so that the number of [`copies`] is bounded.
pub(super) fn expand(bodies: &[BodyEntry], repeats: &[RepeatEntry]) -> Vec<BodyEntry> {
    let mut placed = Vec::new();
    for body in bodies {
        let mut of = repeats
            .iter()
            .filter(|repeat| repeat.of == body.name)
            .peekable();
        if of.peek().is_none() {
            placed.push(body.clone());
        }
        for repeat in of {
            placed.extend(place(body, repeat));
        }
    }
    placed
}

/// The joints of every repeat with a `pin` or `pins`, between neighbouring copies.
pub(super) fn pins(bodies: &[BodyEntry], repeats: &[RepeatEntry]) -> Vec<JointEntry> {
    let mut joints = Vec::new();
    for repeat in repeats {
        let Some(template) = bodies.iter().find(|body| body.name == repeat.of) else {
            continue;
        };
        if let Some(pin) = repeat.pin {
            let copies = place(template, repeat);
            let whole = repeat.ring.is_some_and(|ring| ring.arc.is_none());
            let last = copies.len() - usize::from(!whole);
            let next = |k: usize| &copies[(k + 1) % copies.len()];
            joints.extend((0..last).map(|k| joint(&copies[k], next(k), pin)));
        }
        if let Some(pins) = &repeat.pins {
            let copies = place(template, repeat);
            let mut stride = 1;
            for (&pin, &n) in pins.iter().zip(repeat.count.iter().flatten()) {
                let n = n as usize;
                let tied = (0..copies.len()).filter(|k| k / stride % n + 1 < n);
                let pairs = tied.map(|k| (&copies[k], &copies[k + stride]));
                joints.extend(
                    pairs
                        .filter(|(a, b)| [a, b].iter().any(|c| c.kind == BodyKind::Dynamic))
                        .map(|(a, b)| joint(a, b, pin)),
                );
                stride *= n;
            }
        }
    }
    joints
}

/// Joins `next` to `copy` at a point in the frame of `copy`.
fn joint(copy: &BodyEntry, next: &BodyEntry, [x, y]: [f64; 2]) -> JointEntry {
    let (sin, cos) = copy.angle.sin_cos();
    JointEntry {
        kind: JointKind::Revolute,
        bodies: [copy.name.clone(), next.name.clone()],
        at: Some([
            copy.position[0] + cos * x - sin * y,
            copy.position[1] + sin * x + cos * y,
        ]),
        anchors: None,
        axis: None,
        limits: None,
        length: None,
        stiffness: None,
        damping: None,
        motor: None,
        contacts: false,
    }
}

/// Number of copies that a repeat makes; 0 if it has neither `count` nor `ring`.
pub(super) fn copies(repeat: &RepeatEntry) -> u64 {
    if let Some(ring) = &repeat.ring {
        return u64::from(ring.count);
    }
    let count = |k: usize| match repeat.count.as_deref() {
        None | Some([]) => 0,
        Some(count) => u64::from(count.get(k).copied().unwrap_or(1)),
    };
    let blocks = count(2).saturating_mul(count(3));
    let shrink = u64::from(repeat.shrink.unwrap_or(0));
    let (columns, rows) = (count(0), count(1));
    if shrink == 0 || columns == 0 {
        return columns.saturating_mul(rows).saturating_mul(blocks);
    }
    // An arithmetic series that ends with the last row that has a copy.
    let rows = rows.min((columns - 1) / shrink + 1);
    (rows * columns - shrink * (rows * rows.saturating_sub(1) / 2)).saturating_mul(blocks)
}

fn place(template: &BodyEntry, repeat: &RepeatEntry) -> Vec<BodyEntry> {
    let mut random = SplitMix64(u64::from(repeat.seed.unwrap_or(0)));
    let base = repeat.name.as_deref().unwrap_or(&template.name);
    let mut copy = |label: String, position: [f64; 2], turn: f64| {
        let draws = [random.symmetric(), random.symmetric(), random.symmetric()];
        BodyEntry {
            name: format!("{base}[{label}]"),
            position: [
                position[0] + repeat.jitter * draws[0],
                position[1] + repeat.jitter * draws[1],
            ],
            angle: template.angle + turn,
            disc: template
                .disc
                .map(|r| r * (1.0 + repeat.radius_spread * draws[2])),
            ..template.clone()
        }
    };
    if let Some(ring) = &repeat.ring {
        return (0..ring.count)
            .map(|k| {
                let angle = ring.angle(k);
                let at = [
                    ring.centre[0] + ring.radius * angle.cos(),
                    ring.centre[1] + ring.radius * angle.sin(),
                ];
                copy(k.to_string(), at, angle)
            })
            .collect();
    }
    let count = repeat.count.as_deref().unwrap_or(&[]);
    let steps = repeat.step.as_deref().unwrap_or(&[]);
    let shrink = repeat.shrink.unwrap_or(0);
    let mut placed = Vec::new();
    let mut place = vec![0_u32; count.len()];
    let mut more = !count.contains(&0) && !count.is_empty();
    while more {
        let less = shrink.saturating_mul(place.get(1).copied().unwrap_or(0));
        if place[0] < count[0].saturating_sub(less) {
            let mut at = template.position;
            for (axis, (&k, step)) in place.iter().zip(steps).enumerate() {
                let start = if axis == 0 {
                    0.5 * f64::from(less)
                } else {
                    0.0
                };
                at[0] += (f64::from(k) + start) * step[0];
                at[1] += (f64::from(k) + start) * step[1];
            }
            let words: Vec<String> = place.iter().map(u32::to_string).collect();
            let mut copy = copy(words.join(","), at, 0.0);
            if repeat.fixed.iter().flatten().any(|fixed| *fixed == place) {
                copy.kind = BodyKind::Fixed;
                (copy.velocity, copy.spin) = ([0.0; 2], 0.0);
            }
            placed.push(copy);
        }
        // the next place, the first number running fastest
        more = false;
        for (k, &n) in place.iter_mut().zip(count) {
            *k += 1;
            if *k < n {
                more = true;
                break;
            }
            *k = 0;
        }
    }
    placed
}
