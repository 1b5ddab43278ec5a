//! `[uncertain]`: keys of a scene whose values are known within bounds only.
//!
//! ```toml
//! [uncertain]
//! wear.coefficient = { percent = 50 }               # the scene's value -50 % and +50 %
//! "study.friction" = { from = 0.25, to = 0.35 }     # the scene's value lies between
//! study.shares = { among = ["winkler", "equal"] }   # the scene's value is one of them
//! ```
//!
//! The block says nothing about the scene itself, and is no part of its hash. The program runs the scene
//! with each of the other values.

use super::check::At;
use super::document::{Document, Node, Value};
use super::error::{Hint, Place, SceneError};
use super::overrides;
use super::plan::{leaves, toml};
use super::reader::in_words;
use serde_json::Value as Json;

/// Name of the block.
pub(super) const BLOCK: &str = "uncertain";
/// Keys of an entry.
const WORDS: [&str; 4] = ["percent", "from", "to", "among"];
const ENTRY: &str =
    "{ percent = P }, { from = A, to = B } or { among = [...] }, the spread of the key's value";
/// Most values of a list, and most keys: each is a run.
const MOST: usize = 100;

/// A key whose value is known within bounds only.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertain {
    /// The whole path of the key.
    pub key: String,
    /// The scene's own value, as text.
    pub nominal: String,
    /// The number that it is, for a spread between two ends.
    pub number: Option<f64>,
    /// The other values, the lower end first.
    pub others: Vec<Variant>,
    /// Where the file says so.
    pub place: Place,
}

/// A value that a key may have besides that of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// As text in tables.
    pub text: String,
    pub number: Option<f64>,
    /// `key=value`, as [`super::Scene::parse`] takes it.
    pub flag: String,
}

/// Reads the block.
///
/// # Arguments
/// - `tree`: gives the whole file with its defaults filled in.
///
/// # Errors
/// [`SceneError::UnknownKey`] for a key that the scene does not have; [`SceneError::WrongType`] for what is
/// no spread, and for bounds of what is no number; [`SceneError::Missing`] for one bound of two;
/// [`SceneError::OutOfRange`] for a percentage, bounds in the wrong order or on one side of the scene's value;
/// [`SceneError::Conflict`] for two kinds of spread, a value that is listed twice, a key that has no value,
/// and a scene in which nothing wears.
pub(super) fn read(
    document: &Document,
    tree: impl FnOnce() -> Json,
) -> Result<Vec<Uncertain>, SceneError> {
    let at = At::top(document).key(BLOCK);
    let Some(entry) = document.root.entry(BLOCK) else {
        return Ok(Vec::new());
    };
    let tree = tree();
    let has = |block: &&str| tree.get(block).is_some_and(|block| !block.is_null());
    let wears = ["wear", "study", "thresher"].iter().any(has);
    let mut found: Vec<Uncertain> = Vec::new();
    for leaf in leaves(&at, &entry.node, is_spread, ENTRY)? {
        if !wears {
            let problem = "says how far inputs move the wear; nothing wears in this scene";
            return Err(at.conflict(problem));
        }
        let (key, value) = value_of(&tree, &leaf.key, &leaf.at)?;
        if found.iter().any(|other| other.key == key) {
            return Err(leaf.at.conflict(format!("`{key}` is set twice")));
        }
        let spread = Spread {
            key: &key,
            value,
            at: &leaf.at,
            node: leaf.node,
        };
        found.push(spread.resolve()?);
    }
    if found.len() > MOST {
        let count = format!("{} keys", found.len());
        return Err(at.out_of_range(count, format!("at most {MOST}")));
    }
    Ok(found)
}

/// Whether a table is a spread, and no block of keys. An empty one is a spread that says nothing.
fn is_spread(node: &Node) -> bool {
    let Value::Table(entries) = &node.value else {
        return false;
    };
    entries
        .iter()
        .any(|entry| WORDS.contains(&entry.key.as_str()))
}

/// The whole path of a key and its value in the scene.
fn value_of<'t>(tree: &'t Json, key: &str, at: &At<'_>) -> Result<(String, &'t Json), SceneError> {
    let mut paths = overrides::paths(tree);
    let named: Vec<&String> = match key.contains('.') {
        true => paths.iter().filter(|path| *path == key).collect(),
        false => {
            let last = |path: &&String| path.rsplit('.').next() == Some(key);
            paths.iter().filter(last).collect()
        }
    };
    match named[..] {
        [one] => {
            let one = one.clone();
            if let Some(value) = overrides::value_at(tree, &one) {
                return Ok((one, value));
            }
        }
        [] => {
            // an element of a list, or of an array of tables by its number
            if let Some(value) = overrides::value_at(tree, key).filter(|v| !v.is_object()) {
                return Ok((key.to_owned(), value));
            }
        }
        _ => {
            let all: Vec<&str> = named.iter().map(|path| path.as_str()).collect();
            let problem = format!("could be any of {}; write the whole path", all.join(", "));
            return Err(at.conflict(problem));
        }
    }
    paths.sort();
    Err(SceneError::UnknownKey {
        at: at.place(),
        key: key.to_owned(),
        hint: Hint::new(key, paths),
    })
}

/// The spread of a key, as the file has it.
struct Spread<'a> {
    key: &'a str,
    /// In the scene.
    value: &'a Json,
    at: &'a At<'a>,
    node: &'a Node,
}

impl Spread<'_> {
    fn resolve(&self) -> Result<Uncertain, SceneError> {
        let Value::Table(entries) = &self.node.value else {
            return Err(self.at.wrong_type(ENTRY, in_words(self.node)));
        };
        if let Some(other) = entries.iter().find(|e| !WORDS.contains(&e.key.as_str())) {
            return Err(SceneError::UnknownKey {
                at: self.at.key(&other.key).place(),
                key: other.key.clone(),
                hint: Hint::new(&other.key, WORDS),
            });
        }
        if self.value.is_null() {
            let problem = format!("`{}` has no value in this scene: set it", self.key);
            return Err(self.at.conflict(problem));
        }
        let has = |word| self.node.entry(word).is_some();
        let kinds = [has("percent"), has("from") || has("to"), has("among")];
        if kinds.iter().filter(|kind| **kind).count() != 1 {
            let problem = "give either percent, from and to, or among";
            return Err(self.at.conflict(problem));
        }
        let others = match kinds {
            [true, ..] => self.percent()?,
            [_, true, _] => self.between()?,
            _ => self.among()?,
        };
        let number = self.value.as_f64().filter(|_| !kinds[2]);
        let mut place = *self.at.place();
        place.path = self.key.to_owned();
        Ok(Uncertain {
            key: self.key.to_owned(),
            nominal: text_of(self.value),
            number,
            others,
            place,
        })
    }

    /// The number that the scene has.
    fn number(&self) -> Result<f64, SceneError> {
        self.value.as_f64().ok_or_else(|| {
            let found = format!("{} in this scene", text_of(self.value));
            let expected = format!("{{ among = [...] }}, as `{}` is no number", self.key);
            self.at.wrong_type(expected, found)
        })
    }

    /// A finite number of the entry.
    fn bound(&self, word: &str) -> Result<f64, SceneError> {
        let at = self.at.key(word);
        let entry = self.node.entry(word);
        let node = &entry.ok_or_else(|| self.at.missing(word))?.node;
        match node.value {
            Value::Integer(number) => Ok(number as f64),
            Value::Float(number) if number.is_finite() => Ok(number),
            Value::Float(number) => Err(at.out_of_range(number.to_string(), "a finite number")),
            _ => Err(at.wrong_type("a number", in_words(node))),
        }
    }

    fn percent(&self) -> Result<Vec<Variant>, SceneError> {
        let (number, percent) = (self.number()?, self.bound("percent")?);
        let at = self.at.key("percent");
        if !(percent > 0.0 && percent <= 1e6) {
            return Err(at.out_of_range(format!("{percent:?}"), "above 0, to 1e6"));
        }
        if !self.value.is_f64() {
            let problem = format!("`{}` is a whole number: use from and to", self.key);
            return Err(at.conflict(problem));
        }
        if number == 0.0 {
            let problem = format!(
                "`{}` is 0, as any percentage of it: use from and to",
                self.key
            );
            return Err(at.conflict(problem));
        }
        let ends = [-percent, percent].map(|p| number * (1.0 + p / 100.0));
        let [a, b] = ends;
        Ok([a.min(b), a.max(b)].map(|end| self.end(end)).into())
    }

    fn between(&self) -> Result<Vec<Variant>, SceneError> {
        let number = self.number()?;
        let (from, to) = (self.bound("from")?, self.bound("to")?);
        if from >= to {
            let allowed = format!("above from, {from:?}");
            return Err(self.at.key("to").out_of_range(format!("{to:?}"), allowed));
        }
        if !(from..=to).contains(&number) {
            let problem = format!(
                "{from:?} to {to:?} leaves out the scene's value of `{}`, {number:?}",
                self.key
            );
            return Err(self.at.conflict(problem));
        }
        if let (false, Some(part)) = (
            self.value.is_f64(),
            [from, to].into_iter().find(|end| end.fract() != 0.0),
        ) {
            let at = self.at.key(if part == from { "from" } else { "to" });
            return Err(at.out_of_range(format!("{part:?}"), "a whole number"));
        }
        let ends = [from, to].into_iter().filter(|end| *end != number);
        Ok(ends.map(|end| self.end(end)).collect())
    }

    /// An end of a range of numbers.
    fn end(&self, value: f64) -> Variant {
        let text = match self.value.is_f64() {
            true => format!("{value:?}"),
            false => format!("{value:.0}"),
        };
        Variant {
            flag: format!("{}={text}", self.key),
            number: Some(value),
            text,
        }
    }

    fn among(&self) -> Result<Vec<Variant>, SceneError> {
        let at = self.at.key("among");
        let items = match self.node.entry("among").map(|entry| &entry.node) {
            Some(Node {
                value: Value::Array(items),
                ..
            }) => items,
            Some(node) => return Err(at.wrong_type("a list of values in [ ]", in_words(node))),
            None => return Err(self.at.missing("among")),
        };
        if !(2..=MOST).contains(&items.len()) {
            let allowed = format!("2 to {MOST} values");
            return Err(at.out_of_range(format!("{} values", items.len()), allowed));
        }
        let mut all: Vec<Variant> = Vec::new();
        for (k, item) in items.iter().enumerate() {
            let at = at.index(k);
            let toml = toml(item, &at)?;
            let text = item.text().map_or(toml.clone(), str::to_owned);
            if all.iter().any(|other| other.text == text) {
                return Err(at.conflict(format!("{toml} is listed twice")));
            }
            all.push(Variant {
                flag: format!("{}={toml}", self.key),
                text,
                number: None,
            });
        }
        let nominal = text_of(self.value);
        let same = |variant: &Variant| {
            let number = variant.text.parse::<f64>().ok();
            variant.text == nominal || number.is_some() && number == self.value.as_f64()
        };
        let (own, others): (Vec<Variant>, Vec<Variant>) = all.into_iter().partition(same);
        if own.is_empty() {
            let known = others.iter().map(|variant| &variant.text);
            return Err(at.unknown("value of the scene in this list", &nominal, known));
        }
        Ok(others)
    }
}

/// A value of the scene as text.
fn text_of(value: &Json) -> String {
    match value {
        Json::String(text) => text.clone(),
        Json::Number(number) => match number.as_f64().filter(|_| number.is_f64()) {
            Some(float) => format!("{float:?}"),
            None => number.to_string(),
        },
        other => other.to_string(),
    }
}
