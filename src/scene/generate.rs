//! Computed geometry: values of the atlas's files that are too long to write down.

use super::document::{Node, Value, flag_value};
use super::error::{Hint, Origin, Place, SceneError};
use std::f64::consts::TAU;

/// The generators: name, the numbers that each takes, and the function that returns TOML.
type Generator = (&'static str, &'static [&'static str], fn(&[f64]) -> String);

const GENERATORS: [Generator; 8] = [
    ("points", &["from", "to", "edges"], points),
    ("discs", &["from", "to", "count", "radius"], discs),
    ("circle", &["radius", "count"], circle),
    ("gear", &["teeth", "phase"], gear),
    ("slabs", &["count"], slabs),
    ("cards", &["storeys"], cards),
    ("overhang", &["count", "share"], overhang),
    ("springs", &["side"], springs),
];

/// The value of `{ generate = "NAME", ... }`. Numbers of copies are limited to a million.
///
/// # Errors
/// [`SceneError::UnknownName`] for an unknown generator, [`SceneError::UnknownKey`] for a number
/// that it does not take, [`SceneError::Missing`] for one that it needs.
pub(super) fn generate(file: &str, table: &Node, origin: &Origin) -> Result<Node, SceneError> {
    let place = || {
        Box::new(Place {
            file: file.to_owned(),
            origin: origin.clone(),
            path: "generate".to_owned(),
        })
    };
    let name = table.string("generate").unwrap_or("");
    let found = GENERATORS.iter().find(|(known, ..)| *known == name);
    let (_, takes, make) = found.ok_or_else(|| SceneError::UnknownName {
        at: place(),
        what: "generator".to_owned(),
        name: name.to_owned(),
        hint: Hint::new(name, GENERATORS.map(|(known, ..)| known)),
    })?;
    if let Value::Table(entries) = &table.value
        && let Some(other) = entries
            .iter()
            .find(|e| e.key != "generate" && !takes.contains(&e.key.as_str()))
    {
        return Err(SceneError::UnknownKey {
            at: place(),
            key: other.key.clone(),
            hint: Hint::new(&other.key, *takes),
        });
    }
    let number = |key: &&str| match table.entry(key).map(|entry| &entry.node.value) {
        Some(Value::Float(number)) => Ok(*number),
        Some(Value::Integer(number)) => Ok(*number as f64),
        _ => Err(SceneError::Missing {
            at: place(),
            key: format!("{key} (a number)"),
        }),
    };
    let numbers = takes.iter().map(number).collect::<Result<Vec<f64>, _>>()?;
    Ok(flag_value(&make(&numbers), origin))
}

/// A TOML array of the texts that `each` returns for 0, 1, 2, ...
fn array(count: f64, each: impl FnMut(u32) -> String) -> String {
    let items: Vec<String> = (0..count.clamp(0.0, 1e6) as u32).map(each).collect();
    format!("[{}]", items.join(", "))
}

/// Points on the x axis \[m\] from `from` to `to`.
fn points(p: &[f64]) -> String {
    let [from, to, edges] = [p[0], p[1], p[2]];
    array(edges + 1.0, |k| {
        format!("[{:?}, 0]", from + (to - from) * f64::from(k) / edges)
    })
}

/// Parts: discs under the x axis, their centres from `from` to `to` \[m\].
fn discs(p: &[f64]) -> String {
    let [from, to, count, radius] = [p[0], p[1], p[2], p[3]];
    array(count, |k| {
        let x = from + (to - from) * f64::from(k) / (count - 1.0);
        format!("{{ disc = {radius:?}, position = [{x:?}, {:?}] }}", -radius)
    })
}

/// Points of a circle, clockwise.
fn circle(p: &[f64]) -> String {
    let [radius, count] = [p[0], p[1]];
    array(count, |k| {
        let angle = -TAU * f64::from(k) / count;
        format!("[{:?}, {:?}]", radius * angle.cos(), radius * angle.sin())
    })
}

/// Parts of a wheel with trapezoidal teeth 0.5 m apart, the first at `phase` teeth.
fn gear(p: &[f64]) -> String {
    let [teeth, phase] = [p[0], p[1]];
    let pitch = 0.5 * teeth / TAU;
    array(teeth + 1.0, |k| {
        if k == 0 {
            return format!("{{ disc = {:?} }}", pitch - 0.14);
        }
        let angle = TAU * (f64::from(k - 1) + phase) / teeth;
        let (x, y) = (pitch * angle.cos(), pitch * angle.sin());
        format!(
            "{{ polygon = [[-0.2, -0.15], [0.12, -0.06], [0.12, 0.06], [-0.2, 0.15]], \
             position = [{x:?}, {y:?}], angle = {angle:?} }}"
        )
    })
}

/// Bodies: a stack of slabs 1 m high, 1, 2, 3, ... metres wide.
fn slabs(p: &[f64]) -> String {
    array(p[0], |k| {
        let (width, y) = (k + 1, f64::from(k) + 0.5);
        format!("{{ name = \"slab{k}\", box = [{width}, 1], position = [0, {y:?}] }}")
    })
}

/// Bodies: storeys of pairs of cards that lean on each other, under a board each; the top one is
/// a single pair.
fn cards(p: &[f64]) -> String {
    // slope of a card, height of a storey, thickness of a card on the level and of a board
    let (slope, height, thick, board) = (0.45, 1.0, 0.05, 0.05);
    let apart = 2.0 * slope * height + 0.1;
    let out = -slope * height;
    let top = height - thick / slope;
    let left = [[out, 0.0], [out + thick, 0.0], [0.0, top], [0.0, height]];
    let mut right = left.map(|[x, y]| [-x, y]);
    right.reverse();
    let storeys = p[0].clamp(0.0, 100.0);
    let storey = |storey: u32| {
        let pairs = storeys - f64::from(storey);
        let y = f64::from(storey) * (height + board);
        let middle = 0.5 * (pairs - 1.0);
        let mut bodies: Vec<String> = (0..pairs as u32)
            .flat_map(|pair| {
                let x = apart * (f64::from(pair) - middle);
                [("left", left), ("right", right)].map(|(side, polygon)| {
                    format!(
                        "{{ name = \"{side}{storey}-{pair}\", polygon = {polygon:?}, \
                         position = [{x:?}, {y:?}] }}"
                    )
                })
            })
            .collect();
        if pairs > 1.0 {
            let width = apart * (pairs - 1.0) + 0.4;
            bodies.push(format!(
                "{{ name = \"board{storey}\", box = [{width:?}, {board:?}], \
                 position = [0.0, {:?}] }}",
                y + height + 0.5 * board
            ));
        }
        bodies.join(", ")
    };
    array(storeys, storey)
}

/// Bodies: blocks of 1 m over an edge at x = 0, the k-th from the top farther out than the one
/// below it by `share`/(2 k); the harmonic sum, with which they just stand, is share 1.
fn overhang(p: &[f64]) -> String {
    let [count, share] = [p[0], p[1]];
    let mut x = -0.5;
    array(count, |row| {
        let k = count - f64::from(row);
        x += share * 0.5 / k;
        let y = 0.1 + 0.2 * f64::from(row);
        format!("{{ name = \"block{k}\", box = [1, 0.2], position = [{x:?}, {y:?}] }}")
    })
}

/// Joints: a spring from each of `side` x `side` bodies `disc[column,row]` to the origin.
fn springs(p: &[f64]) -> String {
    let side = p[0].clamp(0.0, 1e3);
    array(side * side, |k| {
        let place = [k % side as u32, k / side as u32];
        let at = place.map(|k| (f64::from(k) - 0.5 * (side - 1.0)) * 1.5);
        format!(
            "{{ kind = \"spring\", bodies = [\"world\", \"disc[{},{}]\"], \
             anchors = [[0, 0], {:?}], length = 0.001, stiffness = 4 }}",
            place[0],
            place[1],
            [at[1], at[0]]
        )
    })
}
