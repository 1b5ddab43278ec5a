//! `[sample]`: values that are drawn from distributions.
//!
//! The value of a key in a draw depends on the seed, the key and the number of the draw alone: more
//! draws, or another key, leave those before as they were.

use super::read::{Leaf, in_order, leaves};
use super::{Axis, MOST_CASES, Setting};
use crate::scene::check::At;
use crate::scene::document::{Node, Value};
use crate::scene::error::{Hint, SceneError};
use crate::scene::hash::fnv1a;
use crate::scene::random::SplitMix64;
use crate::scene::reader::in_words;
use std::f64::consts::TAU;

/// Decimal digits of a drawn value: what the last bits of a logarithm are on one machine or another
/// does not matter.
const DIGITS: usize = 12;
/// Draws of a bounded normal distribution until one must lie within its bounds.
const TRIES: usize = 10_000;

/// A distribution: its name, the numbers that it needs, those that it may have, and its meaning.
struct Kind {
    name: &'static str,
    needs: &'static [&'static str],
    may: &'static [&'static str],
    meaning: &'static str,
}

const KINDS: [Kind; 6] = [
    Kind {
        name: "uniform",
        needs: &["from", "to"],
        may: &[],
        meaning: "evenly over [from, to)",
    },
    Kind {
        name: "loguniform",
        needs: &["from", "to"],
        may: &[],
        meaning: "its logarithm evenly over [log from, log to); from above 0",
    },
    Kind {
        name: "normal",
        needs: &["mean", "deviation"],
        may: &["from", "to"],
        meaning: "Gauss's, of a standard deviation; cut off below `from` and above `to`",
    },
    Kind {
        name: "lognormal",
        needs: &["median", "factor"],
        may: &[],
        meaning: "two thirds (68.3 %) lie between median / factor and median x factor; factor above 1",
    },
    Kind {
        name: "triangular",
        needs: &["from", "mode", "to"],
        may: &[],
        meaning: "rises evenly from `from` to the most frequent value `mode`, falls to `to`",
    },
    Kind {
        name: "whole",
        needs: &["from", "to"],
        may: &[],
        meaning: "whole numbers, each from `from` to `to` as often",
    },
];

/// Name, numbers and meaning of each distribution of `[sample.keys]`, one a line.
pub fn distributions() -> String {
    let line = |kind: &Kind| {
        let optional = kind.may.iter().map(|name| format!("[{name}]"));
        let numbers = kind.needs.iter().map(|name| (*name).to_owned());
        let numbers: Vec<String> = numbers.chain(optional).collect();
        format!("{}: {}: {}\n", kind.name, numbers.join(", "), kind.meaning)
    };
    KINDS.iter().map(line).collect()
}

/// A distribution with its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Distribution {
    Uniform([f64; 2]),
    LogUniform([f64; 2]),
    Normal {
        mean: f64,
        deviation: f64,
        within: [f64; 2],
    },
    LogNormal {
        median: f64,
        factor: f64,
    },
    Triangular([f64; 3]),
    Whole([f64; 2]),
}

/// The axis of `[sample]`: a point for each draw.
///
/// # Errors
/// Those of [`super::Plan::parse`].
pub(super) fn axis(at: &At<'_>, block: &Node) -> Result<Axis, SceneError> {
    const KEYS: [&str; 3] = ["count", "seed", "keys"];
    if !matches!(block.value, Value::Table(_)) {
        return Err(at.wrong_type("a table", in_words(block)));
    }
    if let Some(other) = in_order(block)
        .iter()
        .find(|e| !KEYS.contains(&e.key.as_str()))
    {
        return Err(SceneError::UnknownKey {
            at: at.key(&other.key).place(),
            key: other.key.clone(),
            hint: Hint::new(&other.key, KEYS),
        });
    }
    let whole = |key: &str, least: i64, most: i64| {
        let node = &block.entry(key).ok_or_else(|| at.missing(key))?.node;
        match node.value {
            Value::Integer(n) if (least..=most).contains(&n) => Ok(n as u64),
            Value::Integer(n) => Err(at
                .key(key)
                .out_of_range(n.to_string(), format!("{least} to {most}"))),
            _ => Err(at.key(key).wrong_type("a whole number", in_words(node))),
        }
    };
    let count = whole("count", 1, MOST_CASES as i64)?;
    let seed = whole("seed", 0, i64::MAX)?;
    let keys = block.entry("keys").ok_or_else(|| at.missing("keys"))?;
    let at = at.key("keys");
    let is_leaf = |node: &Node| node.entry("distribution").is_some();
    let expected = "{ distribution = \"NAME\", ... }";
    let leaves = leaves(&at, &keys.node, is_leaf, expected)?;
    if leaves.is_empty() {
        let problem = "has no key: give at least one, as \"step.dt\" = { distribution = \"uniform\", \
                       from = 0.001, to = 0.01 }";
        return Err(at.conflict(problem));
    }
    let mut drawn: Vec<(&Leaf<'_>, Distribution)> = Vec::new();
    for leaf in &leaves {
        drawn.push((leaf, read(leaf)?));
    }
    let draw = |number| -> Result<Vec<Setting>, SceneError> {
        let each = drawn.iter();
        let each = each.map(|(leaf, of)| setting(leaf, *of, seed, number));
        each.collect()
    };
    (0..count).map(draw).collect()
}

/// The value of a key in a draw.
fn setting(
    leaf: &Leaf<'_>,
    distribution: Distribution,
    seed: u64,
    number: u64,
) -> Result<Setting, SceneError> {
    let key = &leaf.key;
    let mut random = SplitMix64(fnv1a(format!("{seed} {key} {number}").as_bytes()));
    let value = distribution.draw(&mut random).ok_or_else(|| {
        let problem = "almost no value of the distribution lies between `from` and `to`";
        leaf.at.conflict(problem)
    })?;
    if !value.is_finite() {
        let problem = format!("draw {number} is {value}: the distribution is too wide for numbers");
        return Err(leaf.at.conflict(problem));
    }
    let value = match distribution {
        Distribution::Whole(_) => format!("{value:.0}"),
        _ => format!("{:?}", rounded(value)),
    };
    let mut place = *leaf.at.place();
    place.path.clone_from(key);
    Ok(Setting {
        key: key.clone(),
        value,
        bare: None,
        place,
    })
}

/// To [`DIGITS`] digits.
fn rounded(value: f64) -> f64 {
    let text = format!("{value:.*e}", DIGITS - 1);
    text.parse().unwrap_or(value)
}

/// Reads `{ distribution = "NAME", ... }`.
fn read(leaf: &Leaf<'_>) -> Result<Distribution, SceneError> {
    let (at, table) = (&leaf.at, leaf.node);
    let name = table.string("distribution").ok_or_else(|| {
        let at = at.key("distribution");
        at.wrong_type("the name of a distribution, in quotes", "something else")
    })?;
    let known = KINDS.iter().map(|kind| kind.name);
    let kind = KINDS.iter().find(|kind| kind.name == name);
    let kind = kind.ok_or_else(|| at.key("distribution").unknown("distribution", name, known))?;
    let takes: Vec<&str> = kind.needs.iter().chain(kind.may).copied().collect();
    for entry in in_order(table) {
        if entry.key != "distribution" && !takes.contains(&entry.key.as_str()) {
            return Err(SceneError::UnknownKey {
                at: at.key(&entry.key).place(),
                key: entry.key.clone(),
                hint: Hint::new(&entry.key, &takes),
            });
        }
    }
    let number = |key: &str| match table.entry(key).map(|entry| &entry.node) {
        None => Ok(None),
        Some(node) => match node.value {
            Value::Integer(n) => Ok(Some(n as f64)),
            Value::Float(x) if x.is_finite() => Ok(Some(x)),
            Value::Float(x) => Err(at.key(key).out_of_range(x.to_string(), "a finite number")),
            _ => Err(at.key(key).wrong_type("a number", in_words(node))),
        },
    };
    let needed = |key: &str| number(key)?.ok_or_else(|| at.missing(key));
    let found = match kind.name {
        "uniform" => Distribution::Uniform([needed("from")?, needed("to")?]),
        "loguniform" => Distribution::LogUniform([needed("from")?, needed("to")?]),
        "normal" => Distribution::Normal {
            mean: needed("mean")?,
            deviation: needed("deviation")?,
            within: [
                number("from")?.unwrap_or(f64::NEG_INFINITY),
                number("to")?.unwrap_or(f64::INFINITY),
            ],
        },
        "lognormal" => Distribution::LogNormal {
            median: needed("median")?,
            factor: needed("factor")?,
        },
        "triangular" => Distribution::Triangular([needed("from")?, needed("mode")?, needed("to")?]),
        _ => Distribution::Whole([needed("from")?, needed("to")?]),
    };
    match found.wrong() {
        None => Ok(found),
        Some((key, value, allowed)) => Err(at.key(key).out_of_range(format!("{value:?}"), allowed)),
    }
}

impl Distribution {
    /// The first number that does not fit: its key, its value, and what is allowed.
    fn wrong(self) -> Option<(&'static str, f64, String)> {
        let above = |key, value: f64, least: f64| {
            (value <= least).then(|| (key, value, format!("above {least:?}")))
        };
        let at_least = |key, value: f64, least: f64| {
            (value < least).then(|| (key, value, format!("at least {least:?}")))
        };
        match self {
            Distribution::Uniform([from, to]) => above("to", to, from),
            Distribution::LogUniform([from, to]) => {
                above("from", from, 0.0).or(above("to", to, from))
            }
            Distribution::Normal {
                deviation, within, ..
            } => above("deviation", deviation, 0.0).or(above("to", within[1], within[0])),
            Distribution::LogNormal { median, factor } => {
                above("median", median, 0.0).or(above("factor", factor, 1.0))
            }
            Distribution::Triangular([from, mode, to]) => at_least("mode", mode, from)
                .or(above("to", to, from))
                .or(at_least("to", to, mode)),
            Distribution::Whole([from, to]) => {
                let whole = |key, value: f64| {
                    let wrong = value.fract() != 0.0 || value.abs() > 2e9;
                    wrong.then(|| (key, value, "a whole number of at most 2e9".to_owned()))
                };
                whole("from", from)
                    .or(whole("to", to))
                    .or(at_least("to", to, from))
            }
        }
    }

    /// A value; `None` if the bounds of a normal distribution leave almost none.
    fn draw(self, random: &mut SplitMix64) -> Option<f64> {
        Some(match self {
            Distribution::Uniform([from, to]) => from + (to - from) * random.unit(),
            Distribution::LogUniform([from, to]) => {
                // to / from may be above all numbers
                let u = random.unit();
                (from.powf(1.0 - u) * to.powf(u)).min(to)
            }
            Distribution::Normal {
                mean,
                deviation,
                within: [from, to],
            } => {
                let mut tries = (0..TRIES).map(|_| mean + deviation * normal(random));
                return tries.find(|x| (from..=to).contains(x));
            }
            Distribution::LogNormal { median, factor } => median * factor.powf(normal(random)),
            Distribution::Triangular([from, mode, to]) => {
                let (u, rise) = (random.unit(), (mode - from) / (to - from));
                match u < rise {
                    true => from + (u * (to - from) * (mode - from)).sqrt(),
                    false => to - ((1.0 - u) * (to - from) * (to - mode)).sqrt(),
                }
            }
            Distribution::Whole([from, to]) => {
                (from + ((to - from + 1.0) * random.unit()).floor()).min(to)
            }
        })
    }
}

/// Of mean 0 and standard deviation 1: Box & Muller (1958).
fn normal(random: &mut SplitMix64) -> f64 {
    let (radius, turn) = (random.unit(), random.unit());
    (-2.0 * radius.ln()).sqrt() * (TAU * turn).cos()
}
