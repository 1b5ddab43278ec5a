//! `--set key=value`: changes a scene's document before it is read.

use super::document::{Document, Entry, Node, Traits, Value, flag_value, labels, node_labels};
use super::error::{Hint, Origin, Place, SceneError};
use super::generate::generate;
use super::machine::{self, Whole};
use super::uncertain;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;

/// Blocks of which a scene has any number.
const ARRAYS: [&str; 4] = ["material", "body", "joint", "repeat"];

/// Applies every flag in order.
///
/// A flag is `key=value`. The key is a dotted path (`step.dt`, `body.ball.position.0`; elements
/// of arrays of tables by their name, a repeat by what it is of, a joint by what it ties as in
/// `crank-rod`, any by number from 0), or a bare key that only one block has. The value is TOML; text that is not TOML is taken as a string.
///
/// # Returns
/// Each flag with the whole path of its key.
///
/// # Errors
/// [`SceneError::FlagForm`] without `=`; [`SceneError::UnknownKey`] and
/// [`SceneError::AmbiguousKey`] for a bare key; [`SceneError::UnknownName`] for an element that
/// does not exist, [`SceneError::Conflict`] where the scene has none of its kind;
/// [`SceneError::WrongType`] for a path through a plain value. Keys that the
/// schema does not have are found when the document is read, under the flag's name.
pub(super) fn apply<M: DeserializeOwned + Serialize>(
    document: &mut Document,
    flags: &[String],
) -> Result<Vec<(String, String)>, SceneError> {
    let mut changes = Vec::new();
    for flag in flags {
        let (key, text) = flag
            .split_once('=')
            .map(|(key, text)| (key.trim(), text.trim()))
            .filter(|(key, _)| !key.is_empty())
            .ok_or_else(|| SceneError::FlagForm { flag: flag.clone() })?;
        let origin = Origin::Flag(flag.clone());
        let path = if key.contains('.') {
            key.split('.').map(str::to_owned).collect()
        } else {
            full_path::<M>(document, flag, key)?
        };
        let value = flag_value(text, &origin);
        set(document, &path, &origin, value)?;
        changes.push((flag.clone(), path.join(".")));
    }
    Ok(changes)
}

/// Makes the changes of a table: every value in it is set at its path of keys. A table with the key
/// `generate` stands for what [`generate`] makes of it; bodies and joints made so are added to those
/// of the scene.
///
/// # Arguments
/// - `path`: of the table in the scene, empty at first.
/// - `origin`: what errors call the changes.
///
/// # Errors
/// Those of [`apply`] for paths, and of [`generate`].
pub(super) fn graft(
    document: &mut Document,
    path: &mut Vec<String>,
    changes: &Node,
    origin: &Origin,
) -> Result<(), SceneError> {
    let Value::Table(entries) = &changes.value else {
        return set(document, path, origin, changes.clone());
    };
    if changes.entry("generate").is_none() {
        for entry in entries {
            path.push(entry.key.clone());
            graft(document, path, &entry.node, origin)?;
            path.pop();
        }
        return Ok(());
    }
    let mut made = generate(&document.file, changes, origin)?;
    let keys: Vec<&str> = path.iter().map(String::as_str).collect();
    if let (["body" | "joint"], Value::Array(new)) = (&keys[..], &mut made.value)
        && let Some(Value::Array(all)) = document.root.at_mut(&keys)
    {
        all.append(new);
        return Ok(());
    }
    set(document, path, origin, made)
}

/// The path of a bare key: itself at the top of the file, or the only block that has it.
fn full_path<M: DeserializeOwned + Serialize>(
    document: &Document,
    flag: &str,
    key: &str,
) -> Result<Vec<String>, SceneError> {
    if key == uncertain::BLOCK || document.root.entry(key).is_some() {
        return Ok(vec![key.to_owned()]);
    }
    let (file, machine) = machine::read::<M>(document)?;
    // keys at their default are settable too, so they are looked up in the file as read
    let all = Whole::new(&file, &machine).tree();
    if all.get(key).is_some() {
        return Ok(vec![key.to_owned()]);
    }
    let mut paths = Vec::new();
    collect(&all, &mut Vec::new(), &mut paths);
    let last = |path: &Vec<String>| path.last().cloned().unwrap_or_default();
    let mut found: Vec<_> = paths
        .iter()
        .filter(|path| last(path) == key)
        .cloned()
        .collect();
    match (found.pop(), found.len()) {
        (Some(path), 0) => Ok(path),
        (Some(path), _) => {
            found.push(path);
            Err(SceneError::AmbiguousKey {
                flag: flag.to_owned(),
                key: key.to_owned(),
                paths: found.iter().map(|path| path.join(".")).collect(),
            })
        }
        (None, _) => {
            let mut known: Vec<String> = paths.iter().map(last).collect();
            known.sort();
            known.dedup();
            Err(SceneError::UnknownKey {
                at: Box::new(Place {
                    file: document.file.clone(),
                    origin: Origin::Flag(flag.to_owned()),
                    path: String::new(),
                }),
                key: key.to_owned(),
                hint: Hint::new(key, known),
            })
        }
    }
}

/// Paths of all keys that hold no table.
fn collect(json: &Json, path: &mut Vec<String>, paths: &mut Vec<Vec<String>>) {
    let mut descend = |word: String, value: &Json| {
        path.push(word);
        collect(value, path, paths);
        path.pop();
    };
    match json {
        Json::Object(table) => table
            .iter()
            .for_each(|(key, value)| descend(key.clone(), value)),
        Json::Array(items) if items.iter().any(Json::is_object) => {
            for (label, item) in json_labels(items).into_iter().zip(items) {
                descend(label, item);
            }
        }
        _ => paths.push(path.clone()),
    }
}

/// Labels of the elements of an array of tables, see [`labels`].
fn json_labels(items: &[Json]) -> Vec<String> {
    let text = |item: &Json, key: &str| Some(item.get(key)?.as_str()?.to_owned());
    let traits = items.iter().map(|item| Traits {
        name: text(item, "name"),
        of: text(item, "of").or_else(|| text(item, "body")),
        ties: item.get("bodies").and_then(|bodies| {
            let [a, b] = [0, 1].map(|side| bodies.get(side)?.as_str());
            Some(format!("{}-{}", a?, b?))
        }),
    });
    labels(&traits.collect::<Vec<_>>())
}

/// The whole paths of all keys of a file that hold no table.
pub(super) fn paths(tree: &Json) -> Vec<String> {
    let mut paths = Vec::new();
    collect(tree, &mut Vec::new(), &mut paths);
    paths.iter().map(|path| path.join(".")).collect()
}

/// The value at a path of keys, elements of arrays by their label or number.
pub(super) fn value_at<'t>(tree: &'t Json, path: &str) -> Option<&'t Json> {
    path.split('.').try_fold(tree, |value, word| match value {
        Json::Object(table) => table.get(word),
        Json::Array(items) => {
            let labelled = items.iter().any(Json::is_object);
            let label = json_labels(items).iter().position(|label| label == word);
            let number = || word.parse().ok();
            items.get(label.filter(|_| labelled).or_else(number)?)
        }
        _ => None,
    })
}

/// Sets the value at a path of keys, see [`apply`].
pub(super) fn set(
    document: &mut Document,
    path: &[String],
    origin: &Origin,
    value: Node,
) -> Result<(), SceneError> {
    let file = document.file.clone();
    let place = |depth: usize| {
        Box::new(Place {
            file: file.clone(),
            origin: origin.clone(),
            path: path[..depth].join("."),
        })
    };
    if let [block, _, ..] = path
        && ARRAYS.contains(&block.as_str())
        && document.root.entry(block).is_none()
    {
        return Err(SceneError::Conflict {
            at: place(1),
            problem: format!("the scene has no [[{block}]] that could be changed"),
        });
    }
    let mut node = &mut document.root;
    for (depth, word) in path.iter().enumerate() {
        node = match &mut node.value {
            Value::Table(entries) => child(entries, word, origin, depth + 1 == path.len()),
            Value::Array(items) => {
                let names = node_labels(items);
                let number = word.parse().ok().filter(|index| *index < items.len());
                // what repeats a body goes by the body's name, if nothing else repeats it
                let mut of = (0..items.len()).filter(|&k| items[k].string("of") == Some(word));
                let of = of.next().filter(|_| of.next().is_none());
                let index = names.iter().position(|name| name == word);
                let index = index.or(number).or(of);
                match index {
                    Some(index) => &mut items[index],
                    None => {
                        return Err(SceneError::UnknownName {
                            at: place(depth),
                            what: "element".to_owned(),
                            name: word.clone(),
                            hint: Hint::new(word, names),
                        });
                    }
                }
            }
            _ => {
                return Err(SceneError::WrongType {
                    at: place(depth),
                    expected: format!("a table with the key `{word}`"),
                    found: "a plain value".to_owned(),
                });
            }
        };
    }
    *node = value;
    Ok(())
}

/// The value of `key`, made as an empty table where it is missing. The last key of a path takes
/// the flag as its origin: that is what errors show.
fn child<'a>(entries: &'a mut Vec<Entry>, key: &str, origin: &Origin, last: bool) -> &'a mut Node {
    let index = match entries.iter().position(|entry| entry.key == key) {
        Some(index) => index,
        None => {
            entries.push(Entry {
                key: key.to_owned(),
                origin: origin.clone(),
                node: Node {
                    origin: origin.clone(),
                    value: Value::Table(Vec::new()),
                },
            });
            entries.len() - 1
        }
    };
    if last {
        entries[index].origin = origin.clone();
    }
    &mut entries[index].node
}
