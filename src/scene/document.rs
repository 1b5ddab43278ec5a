//! A TOML document that stores for every value where it was written.
//!
//! The document outlives parsing, so that a later range check can name the line, or the flag of a
//! value that was set on the command line.

use super::error::{Origin, Place, SceneError};
use std::borrow::Cow;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// One step of a path of keys.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Segment {
    Key(String),
    Index(usize),
}

#[derive(Debug, Clone)]
pub(super) struct Node {
    pub origin: Origin,
    pub value: Value,
}

#[derive(Debug, Clone)]
pub(super) enum Value {
    Table(Vec<Entry>),
    Array(Vec<Node>),
    String(String),
    Integer(i64),
    Float(f64),
    Boolean(bool),
    Datetime,
}

/// A key of a table with its value; `origin` is the key's.
#[derive(Debug, Clone)]
pub(super) struct Entry {
    pub key: String,
    pub origin: Origin,
    pub node: Node,
}

impl Node {
    pub fn entry(&self, key: &str) -> Option<&Entry> {
        match &self.value {
            Value::Table(entries) => entries.iter().find(|e| e.key == key),
            _ => None,
        }
    }

    /// Removes `key` and returns it: a table with it alone, or an empty one.
    pub fn split_off(&mut self, key: &str) -> Node {
        let mut taken = Vec::new();
        if let Value::Table(entries) = &mut self.value {
            let at = entries.iter().position(|e| e.key == key);
            taken.extend(at.map(|at| entries.remove(at)));
        }
        Node {
            origin: self.origin.clone(),
            value: Value::Table(taken),
        }
    }

    /// The value under a path of keys.
    pub fn at_mut(&mut self, path: &[&str]) -> Option<&mut Value> {
        let mut value = &mut self.value;
        for key in path {
            let Value::Table(entries) = value else {
                return None;
            };
            value = &mut entries.iter_mut().find(|e| e.key == *key)?.node.value;
        }
        Some(value)
    }

    /// The value as a string, if it is one.
    pub fn text(&self) -> Option<&str> {
        match &self.value {
            Value::String(text) => Some(text),
            _ => None,
        }
    }

    /// The string under `key`.
    pub fn string(&self, key: &str) -> Option<&str> {
        self.entry(key)?.node.text()
    }
}

/// What identifies an element of an array of tables: its `name`; for a repeat the body in `of`, for
/// wear that in `body`; for a joint its two bodies.
pub(super) struct Traits {
    pub name: Option<String>,
    pub of: Option<String>,
    pub ties: Option<String>,
}

/// Labels of the elements of an array of tables in paths of keys: the name; without one the trait that
/// only this element has, for a joint `crank-rod`; otherwise the number from 0.
pub(super) fn labels(all: &[Traits]) -> Vec<String> {
    type Trait = fn(&Traits) -> Option<&String>;
    let each: [Trait; 2] = [|t| t.of.as_ref(), |t| t.ties.as_ref()];
    let alone =
        |found: &String, of: Trait| all.iter().filter(|t| of(t) == Some(found)).count() == 1;
    let label = |(index, traits): (usize, &Traits)| {
        let own = each.iter().filter_map(|&of| Some((of(traits)?, of)));
        let unique = own.into_iter().find(|(found, of)| alone(found, *of));
        let label = traits.name.as_ref().or(unique.map(|(found, _)| found));
        label.map_or(index.to_string(), String::clone)
    };
    all.iter().enumerate().map(label).collect()
}

/// See [`labels`].
pub(super) fn node_labels(items: &[Node]) -> Vec<String> {
    let traits = items.iter().map(|item| Traits {
        name: item.string("name").map(str::to_owned),
        of: item.string("of").or(item.string("body")).map(str::to_owned),
        ties: item
            .entry("bodies")
            .and_then(|entry| match &entry.node.value {
                Value::Array(bodies) => match &bodies[..] {
                    [a, b] => Some(format!("{}-{}", a.text()?, b.text()?)),
                    _ => None,
                },
                _ => None,
            }),
    });
    labels(&traits.collect::<Vec<_>>())
}

#[derive(Debug, Clone)]
pub(super) struct Document {
    pub file: String,
    pub root: Node,
}

impl Document {
    /// Parses `text`; `file` is its name in errors.
    ///
    /// # Errors
    /// [`SceneError::Syntax`] with the line and the key before the fault.
    pub fn parse(file: &str, text: &str) -> Result<Self, SceneError> {
        let lines = Lines::new(text);
        let table = DeTable::parse(text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            SceneError::Syntax {
                at: Box::new(Place {
                    file: file.to_owned(),
                    origin: lines.origin(offset),
                    path: lines.key_at(offset),
                }),
                problem: error.message().to_owned(),
            }
        })?;
        let root = Node {
            origin: lines.origin(0),
            value: Value::Table(entries(table.get_ref(), &lines)),
        };
        Ok(Document {
            file: file.to_owned(),
            root,
        })
    }

    /// The document with the blocks that are `wanted` only.
    pub fn only(&self, wanted: impl Fn(&str) -> bool) -> Cow<'_, Document> {
        let Value::Table(entries) = &self.root.value else {
            return Cow::Borrowed(self);
        };
        // a file may have 100 000 bodies
        if entries.iter().all(|entry| wanted(&entry.key)) {
            return Cow::Borrowed(self);
        }
        let part = entries.iter().filter(|entry| wanted(&entry.key));
        let root = Node {
            origin: self.root.origin.clone(),
            value: Value::Table(part.cloned().collect()),
        };
        let file = self.file.clone();
        Cow::Owned(Document { file, root })
    }

    /// Whether a block is an array, as `[[wear]]` makes it.
    pub fn is_array(&self, block: &str) -> bool {
        let node = self.root.entry(block).map(|entry| &entry.node.value);
        matches!(node, Some(Value::Array(_)))
    }

    /// The value at `path`.
    pub fn node(&self, path: &[Segment]) -> Option<&Node> {
        path.iter()
            .try_fold(&self.root, |node, segment| match segment {
                Segment::Key(key) => node.entry(key).map(|entry| &entry.node),
                Segment::Index(index) => match &node.value {
                    Value::Array(items) => items.get(*index),
                    _ => None,
                },
            })
    }

    /// The place of the value at `path`, or of its nearest ancestor if it was not written.
    ///
    /// The path names elements of arrays of tables by their [`labels`].
    pub fn place(&self, path: &[Segment]) -> Box<Place> {
        let mut node = Some(&self.root);
        let mut origin = &self.root.origin;
        let mut words = Vec::new();
        for segment in path {
            let mut word = None;
            node = match (segment, node) {
                (Segment::Key(key), Some(table)) => table.entry(key).map(|entry| {
                    origin = &entry.origin;
                    &entry.node
                }),
                (
                    Segment::Index(index),
                    Some(Node {
                        value: Value::Array(items),
                        ..
                    }),
                ) => items.get(*index).inspect(|item| {
                    origin = &item.origin;
                    word = node_labels(items).into_iter().nth(*index);
                }),
                _ => None,
            };
            words.push(match (word, segment) {
                (Some(name), _) => name,
                (None, Segment::Key(key)) => key.clone(),
                (None, Segment::Index(index)) => index.to_string(),
            });
        }
        Box::new(Place {
            file: self.file.clone(),
            origin: origin.clone(),
            path: words.join("."),
        })
    }
}

/// Parses one TOML value typed on the command line; anything else is taken as a plain string.
pub(super) fn flag_value(text: &str, origin: &Origin) -> Node {
    let document = format!("v = {text}");
    let parsed = DeTable::parse(&document).ok().and_then(|table| {
        // a line break in the text could add further keys: such a text is a string
        let table = table.into_inner();
        (table.len() == 1).then(|| table.into_iter().next().map(|(_, value)| value))?
    });
    match parsed {
        Some(value) => node(&value, &|_| origin.clone()),
        None => Node {
            origin: origin.clone(),
            value: Value::String(text.to_owned()),
        },
    }
}

fn entries(table: &DeTable<'_>, lines: &Lines<'_>) -> Vec<Entry> {
    table_entries(table, &|offset| lines.origin(offset))
}

fn table_entries(table: &DeTable<'_>, origin: &dyn Fn(usize) -> Origin) -> Vec<Entry> {
    table
        .iter()
        .map(|(key, value)| Entry {
            key: key.get_ref().to_string(),
            origin: origin(key.span().start),
            node: node(value, origin),
        })
        .collect()
}

/// Depth is bounded by the parser's own recursion limit.
fn node(value: &Spanned<DeValue<'_>>, origin: &dyn Fn(usize) -> Origin) -> Node {
    let kind = match value.get_ref() {
        DeValue::String(text) => Value::String(text.to_string()),
        DeValue::Integer(number) => {
            match i64::from_str_radix(number.as_str(), number.radix()) {
                Ok(integer) => Value::Integer(integer),
                // Too long for 64 bits: a large real number, which the range checks then judge.
                Err(_) => Value::Float(number.as_str().parse().unwrap_or(f64::INFINITY)),
            }
        }
        DeValue::Float(number) => Value::Float(number.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(flag) => Value::Boolean(*flag),
        DeValue::Datetime(_) => Value::Datetime,
        DeValue::Array(items) => Value::Array(items.iter().map(|v| node(v, origin)).collect()),
        DeValue::Table(table) => Value::Table(table_entries(table, origin)),
    };
    Node {
        origin: origin(value.span().start),
        value: kind,
    }
}

/// Byte offsets to lines and columns.
struct Lines<'a> {
    text: &'a str,
    /// Offset of the first byte of every line.
    starts: Vec<usize>,
    /// Offsets of the bytes that start no character.
    inner: Vec<usize>,
}

impl<'a> Lines<'a> {
    fn new(text: &'a str) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n');
        let starts = std::iter::once(0)
            .chain(breaks.map(|(at, _)| at + 1))
            .collect();
        let inner = (0..text.len())
            .filter(|at| !text.is_char_boundary(*at))
            .collect();
        Lines {
            text,
            starts,
            inner,
        }
    }

    /// The line's number from 0.
    fn line(&self, offset: usize) -> usize {
        self.starts.partition_point(|start| *start <= offset) - 1
    }

    fn origin(&self, offset: usize) -> Origin {
        let offset = offset.min(self.text.len());
        let line = self.line(offset);
        let inner = |end| self.inner.partition_point(|at| *at < end);
        let start = self.starts[line];
        Origin::Line {
            line: line + 1,
            column: offset - start - (inner(offset) - inner(start)) + 1,
        }
    }

    /// The key on the line of `offset`, as far as malformed TOML has one.
    fn key_at(&self, offset: usize) -> String {
        let text = self.text[self.starts[self.line(offset)]..]
            .lines()
            .next()
            .unwrap_or("");
        let key = text.split(['=', '#']).next().unwrap_or("").trim();
        key.chars().take(60).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters() {
        let lines = Lines::new("é = 1\nname = \"größe\" # µ\nx");
        let at = |line, column| Origin::Line { line, column };
        for (offset, expected) in [(0, at(1, 1)), (2, at(1, 2)), (7, at(2, 1)), (22, at(2, 14))] {
            assert_eq!(lines.origin(offset), expected, "{offset}");
        }
        assert_eq!(lines.origin(1000), at(3, 2));
    }
}
