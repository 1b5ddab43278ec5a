//! The keys that a file and its flags set, with their places: the program checks their effect.

use super::document::{Document, Node, Segment, Value};
use super::error::Place;

/// A key that was set.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// Path of block and name, as in [`super::keys::KEYS`].
    pub path: String,
    pub place: Place,
    /// The value as in the file; long values are abbreviated.
    pub value: String,
}

/// Blocks whose keys may have an effect in one run and none in another.
const BLOCKS: [&str; 11] = [
    "step",
    "gravity",
    "material",
    "reference",
    "verdict",
    "tooth",
    "wear",
    "life",
    "study",
    "thresher",
    "uncertain",
];

/// The keys of these blocks that were set.
pub(super) fn keys(document: &Document) -> Vec<Written> {
    let mut found = Vec::new();
    for block in BLOCKS {
        let path = vec![Segment::Key(block.to_owned())];
        if let Some(node) = document.node(&path) {
            collect(document, node, block, &path, &mut found);
        }
    }
    found
}

fn collect(
    document: &Document,
    node: &Node,
    name: &str,
    path: &[Segment],
    found: &mut Vec<Written>,
) {
    let then = |segment| [path, &[segment]].concat();
    match &node.value {
        Value::Table(entries) => entries.iter().for_each(|entry| {
            let name = format!("{name}.{}", entry.key);
            let path = then(Segment::Key(entry.key.clone()));
            collect(document, &entry.node, &name, &path, found);
        }),
        Value::Array(items)
            if matches!(
                items[..],
                [
                    Node {
                        value: Value::Table(_),
                        ..
                    },
                    ..
                ]
            ) =>
        {
            items.iter().enumerate().for_each(|(index, item)| {
                collect(document, item, name, &then(Segment::Index(index)), found);
            });
        }
        value => found.push(Written {
            path: name.to_owned(),
            place: *document.place(path),
            value: text(value),
        }),
    }
}

fn text(value: &Value) -> String {
    match value {
        Value::String(text) => format!("{text:?}"),
        Value::Integer(number) => number.to_string(),
        Value::Float(number) => format!("{number:?}"),
        Value::Boolean(flag) => flag.to_string(),
        Value::Array(_) => "[...]".to_owned(),
        Value::Table(_) => "{...}".to_owned(),
        Value::Datetime => "a date".to_owned(),
    }
}
