//! Reads the text of a plan.

use super::sample;
use super::{Axis, MOST_CASES, Plan, Setting};
use crate::scene::check::At;
use crate::scene::document::{Document, Entry, Node, Value};
use crate::scene::error::{Hint, Origin, SceneError};
use crate::scene::reader::in_words;

const BLOCKS: [&str; 5] = ["scene", "set", "grid", "case", "sample"];

/// A value below a block, with its key and its place.
pub(in crate::scene) struct Leaf<'a> {
    pub key: String,
    pub at: At<'a>,
    pub node: &'a Node,
}

/// See [`Plan::parse`].
pub(super) fn plan(file: &str, text: &str) -> Result<Plan, SceneError> {
    let document = Document::parse(file, text)?;
    let top = At::top(&document);
    let blocks = in_order(&document.root);
    if let Some(other) = blocks.iter().find(|e| !BLOCKS.contains(&e.key.as_str())) {
        return Err(SceneError::UnknownKey {
            at: top.key(&other.key).place(),
            key: other.key.clone(),
            hint: Hint::new(&other.key, BLOCKS),
        });
    }
    let block = |name: &str| document.root.entry(name).map(|entry| &entry.node);
    let scene = block("scene").ok_or_else(|| top.missing("scene"))?;
    let scene = scene.text().ok_or_else(|| {
        let expected = "name or file of a scene, in quotes";
        top.key("scene").wrong_type(expected, in_words(scene))
    })?;
    let mut set = Vec::new();
    if let Some(node) = block("set") {
        for leaf in values(&top.key("set"), node)? {
            set.push(leaf.setting(leaf.node, &leaf.at)?);
        }
    }
    let mut axes: Vec<Axis> = Vec::new();
    if let Some(node) = block("case") {
        axes.push(cases(&top.key("case"), node)?);
    }
    if let Some(node) = block("grid") {
        axes.extend(grid(&top.key("grid"), node)?);
    }
    if let Some(node) = block("sample") {
        axes.push(sample::axis(&top.key("sample"), node)?);
    }
    if axes.is_empty() {
        return Err(top.missing("[grid], [[case]] or [sample]"));
    }
    let count = axes.iter().try_fold(1_usize, |n, axis| {
        n.checked_mul(axis.len()).filter(|n| *n <= MOST_CASES)
    });
    let count = count.ok_or_else(|| {
        let sizes: Vec<String> = axes.iter().map(|axis| axis.len().to_string()).collect();
        let largest = ["sample", "grid", "case"]
            .into_iter()
            .find(|name| block(name).is_some());
        let at = top.key(largest.unwrap_or("grid"));
        let allowed = format!("1 to {MOST_CASES} cases in all");
        at.out_of_range(format!("{} cases", sizes.join(" x ")), allowed)
    })?;
    Ok(Plan {
        file: file.to_owned(),
        scene: scene.to_owned(),
        scene_place: *top.key("scene").place(),
        keys: keys(&set, &axes)?,
        set,
        axes,
        count,
    })
}

/// The keys that vary; none may be set in two blocks.
fn keys(set: &[Setting], axes: &[Axis]) -> Result<Vec<String>, SceneError> {
    let mut all: Vec<(&String, Option<usize>)> = set.iter().map(|s| (&s.key, None)).collect();
    let mut varied = Vec::new();
    for (number, axis) in axes.iter().enumerate() {
        for setting in axis.iter().flatten() {
            match all.iter().find(|(key, _)| **key == setting.key) {
                None => {
                    all.push((&setting.key, Some(number)));
                    varied.push(setting.key.clone());
                }
                Some((_, of)) if *of == Some(number) => {}
                Some(_) => {
                    let problem = "is set in two blocks of the plan".to_owned();
                    let at = Box::new(setting.place.clone());
                    return Err(SceneError::Conflict { at, problem });
                }
            }
        }
    }
    Ok(varied)
}

/// An axis for each key, with a point for each value.
fn grid(at: &At<'_>, node: &Node) -> Result<Vec<Axis>, SceneError> {
    let leaves = values(at, node)?;
    if leaves.is_empty() {
        let problem = "has no key: give at least one, as \"step.dt\" = [0.01, 0.005]";
        return Err(at.conflict(problem));
    }
    let axis = |leaf: &Leaf<'_>| {
        let Value::Array(values) = &leaf.node.value else {
            let found = in_words(leaf.node);
            return Err(leaf.at.wrong_type("a list of values in [ ]", found));
        };
        if values.is_empty() {
            return Err(leaf.at.out_of_range("[]", "at least one value"));
        }
        let mut axis: Axis = Vec::new();
        for (number, value) in values.iter().enumerate() {
            let at = leaf.at.index(number);
            let setting = leaf.setting(value, &at)?;
            if axis.iter().any(|other| other[0].value == setting.value) {
                return Err(at.conflict(format!("{} is listed twice", setting.value)));
            }
            axis.push(vec![setting]);
        }
        Ok(axis)
    };
    leaves.iter().map(axis).collect()
}

/// An axis with a point for each table of `[[case]]`.
fn cases(at: &At<'_>, node: &Node) -> Result<Axis, SceneError> {
    let tables = match &node.value {
        Value::Array(tables) if !tables.is_empty() => tables,
        _ => return Err(at.wrong_type("tables [[case]]", in_words(node))),
    };
    let mut axis = Vec::new();
    for (number, table) in tables.iter().enumerate() {
        let at = at.index(number);
        let leaves = values(&at, table)?;
        if leaves.is_empty() {
            return Err(at.conflict("has no key"));
        }
        let point = leaves.iter().map(|leaf| leaf.setting(leaf.node, &leaf.at));
        axis.push(point.collect::<Result<_, _>>()?);
    }
    Ok(axis)
}

impl Leaf<'_> {
    /// The key set to `value`, which stands at `at`.
    pub(super) fn setting(&self, value: &Node, at: &At<'_>) -> Result<Setting, SceneError> {
        let mut place = *at.place();
        place.path.clone_from(&self.key);
        Ok(Setting {
            key: self.key.clone(),
            value: toml(value, at)?,
            bare: value.text().map(str::to_owned),
            place,
        })
    }
}

/// Whether a value ends a path of keys: all but a table.
fn is_value(node: &Node) -> bool {
    !matches!(node.value, Value::Table(_))
}

/// All values of a block.
fn values<'a>(at: &At<'a>, node: &'a Node) -> Result<Vec<Leaf<'a>>, SceneError> {
    leaves(at, node, is_value, "a table")
}

/// All values of a block that `ends` accepts, in the order of the file. Keys may be quoted paths,
/// `"step.dt"`, or paths of TOML, `step.dt`.
///
/// # Arguments
/// - `expected`: what to say to a value that is neither accepted nor a table.
pub(in crate::scene) fn leaves<'a>(
    at: &At<'a>,
    node: &'a Node,
    ends: fn(&Node) -> bool,
    expected: &str,
) -> Result<Vec<Leaf<'a>>, SceneError> {
    if is_value(node) {
        return Err(at.wrong_type("a table of keys of the scene", in_words(node)));
    }
    let mut found: Vec<Leaf<'a>> = Vec::new();
    let mut open = vec![(String::new(), at.clone(), node)];
    while let Some((path, at, table)) = open.pop() {
        for entry in in_order(table).into_iter().rev() {
            let at = at.key(&entry.key);
            let key = match path.is_empty() {
                true => entry.key.clone(),
                false => format!("{path}.{}", entry.key),
            };
            if entry.key.trim().is_empty() || entry.key.contains('=') {
                return Err(at.conflict(format!("`{}` is no key of a scene", entry.key)));
            }
            match (ends(&entry.node), is_value(&entry.node)) {
                (true, _) => found.push(Leaf {
                    key,
                    at,
                    node: &entry.node,
                }),
                (false, true) => return Err(at.wrong_type(expected, in_words(&entry.node))),
                (false, false) => open.push((key, at, &entry.node)),
            }
        }
    }
    found.sort_by_key(|leaf| line(&leaf.node.origin));
    for (number, leaf) in found.iter().enumerate() {
        if found[..number].iter().any(|other| other.key == leaf.key) {
            return Err(leaf.at.conflict("is set twice"));
        }
    }
    Ok(found)
}

/// The entries of a table in the order of the file.
pub(super) fn in_order(table: &Node) -> Vec<&Entry> {
    let Value::Table(entries) = &table.value else {
        return Vec::new();
    };
    let mut entries: Vec<&Entry> = entries.iter().collect();
    entries.sort_by_key(|entry| line(&entry.origin));
    entries
}

fn line(origin: &Origin) -> (usize, usize) {
    match origin {
        Origin::Line { line, column } => (*line, *column),
        Origin::Flag(_) | Origin::Typed(_) => (0, 0),
    }
}

/// A value as TOML on one line.
pub(in crate::scene) fn toml(node: &Node, at: &At<'_>) -> Result<String, SceneError> {
    Ok(match &node.value {
        Value::String(text) => quoted(text),
        Value::Integer(number) => number.to_string(),
        Value::Float(number) if number.is_finite() => format!("{number:?}"),
        Value::Float(number) => {
            return Err(at.out_of_range(number.to_string(), "a finite number"));
        }
        Value::Boolean(flag) => flag.to_string(),
        Value::Array(items) => {
            let items = items.iter().enumerate();
            let items = items.map(|(k, item)| toml(item, &at.index(k)));
            format!("[{}]", items.collect::<Result<Vec<_>, _>>()?.join(", "))
        }
        Value::Table(_) => {
            let items = in_order(node).into_iter().map(|entry| {
                let value = toml(&entry.node, &at.key(&entry.key))?;
                Ok(format!("{} = {value}", quoted(&entry.key)))
            });
            format!(
                "{{ {} }}",
                items.collect::<Result<Vec<_>, SceneError>>()?.join(", ")
            )
        }
        Value::Datetime => return Err(at.wrong_type("a value of a scene", in_words(node))),
    })
}

/// A basic string of TOML.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out.push_str(&format!("\\u{:04X}", u32::from(c))),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
