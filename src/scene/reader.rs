//! Reads a [`Document`](super::document::Document) into the schema's structs through serde, and
//! turns what serde finds wrong into errors with a place and the nearest known key.

use super::document::{Document, Node, Segment, Value};
use super::error::{Hint, SceneError};
use super::keys::KEYS;
use serde::de::{self, DeserializeSeed, Deserializer, IntoDeserializer, Unexpected, Visitor};
use std::fmt;

/// The document as a `T`.
///
/// # Errors
/// [`SceneError::UnknownKey`], [`SceneError::WrongType`], [`SceneError::Missing`],
/// [`SceneError::UnknownName`] for a word that is none of an enumeration,
/// [`SceneError::OutOfRange`] for NaN and infinity wherever they stand.
pub(super) fn read<'de, T: de::Deserialize<'de>>(document: &'de Document) -> Result<T, SceneError> {
    T::deserialize(Reader(&document.root)).map_err(|fault| fault.located(document))
}

/// What a value is, as errors say it.
pub(super) fn in_words(node: &Node) -> String {
    found_in_words(Reader(node).unexpected())
}

/// The path of a key that another block has.
fn key_elsewhere(name: &str) -> Option<&'static str> {
    let mut paths = KEYS.iter().map(|key| key.path);
    paths.find(|path| path.rsplit('.').next() == Some(name))
}

/// An error of serde and its path, innermost segment first.
#[derive(Debug)]
struct Fault {
    path: Vec<Segment>,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    UnknownKey(String, &'static [&'static str]),
    UnknownWord(String, &'static [&'static str]),
    WrongType { found: String, expected: String },
    Missing(&'static str),
    NotFinite(f64),
}

impl Fault {
    fn new(kind: Kind) -> Self {
        Fault {
            path: Vec::new(),
            kind,
        }
    }

    fn within(mut self, segment: Segment) -> Self {
        self.path.push(segment);
        self
    }

    fn located(mut self, document: &Document) -> SceneError {
        self.path.reverse();
        let at = document.place(&self.path);
        match self.kind {
            Kind::UnknownKey(key, known) => SceneError::UnknownKey {
                hint: match key_elsewhere(&key) {
                    Some(path) => Hint::of(path),
                    None => Hint::new(&key, known),
                },
                at,
                key,
            },
            Kind::UnknownWord(name, known) => SceneError::UnknownName {
                hint: Hint::new(&name, known),
                at,
                what: match self.path.last() {
                    Some(Segment::Key(key)) => key.clone(),
                    _ => "word".to_owned(),
                },
                name,
            },
            Kind::WrongType { found, expected } => {
                let [expected, found] = match (&self.path[..], &expected[..], &found[..]) {
                    ([Segment::Key(block)], "an array", "a table") => {
                        [format!("[[{block}]] for each one"), format!("[{block}]")]
                    }
                    ([Segment::Key(block)], "a table", "an array") => {
                        [format!("[{block}]"), format!("[[{block}]]")]
                    }
                    _ => [expected, found],
                };
                SceneError::WrongType {
                    at,
                    expected,
                    found,
                }
            }
            Kind::Missing(key) => SceneError::Missing {
                at,
                key: key.to_owned(),
            },
            Kind::NotFinite(value) => SceneError::OutOfRange {
                at,
                value: value.to_string(),
                allowed: "a finite number".to_owned(),
            },
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.kind)
    }
}

impl std::error::Error for Fault {}

impl de::Error for Fault {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Fault::new(Kind::WrongType {
            found: message.to_string(),
            expected: "another value".to_owned(),
        })
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        Fault::new(Kind::WrongType {
            found: found_in_words(found),
            expected: expected_in_words(&expected.to_string()),
        })
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        Self::invalid_type(found, expected)
    }

    fn invalid_length(length: usize, expected: &dyn de::Expected) -> Self {
        Fault::new(Kind::WrongType {
            found: format!("an array of length {length}"),
            expected: expected_in_words(&expected.to_string()),
        })
    }

    fn unknown_variant(variant: &str, known: &'static [&'static str]) -> Self {
        Fault::new(Kind::UnknownWord(variant.to_owned(), known))
    }

    fn unknown_field(field: &str, known: &'static [&'static str]) -> Self {
        Fault::new(Kind::UnknownKey(field.to_owned(), known))
    }

    fn missing_field(field: &'static str) -> Self {
        Fault::new(Kind::Missing(field))
    }
}

/// Translates what serde expected into the terms of a scene file.
fn expected_in_words(expected: &str) -> String {
    match expected {
        "f64" => "a number".to_owned(),
        "u32" | "usize" => "a whole number from 0 to 4294967295".to_owned(),
        "u64" => "a whole number of at least 0".to_owned(),
        "a sequence" => "an array".to_owned(),
        "an array of length 2" => "an array of 2 numbers".to_owned(),
        word if word.starts_with("struct ") => "a table".to_owned(),
        word if word.starts_with("enum ") => "a word in quotes".to_owned(),
        word => word.to_owned(),
    }
}

fn found_in_words(found: Unexpected<'_>) -> String {
    match found {
        Unexpected::Str(text) => format!("the string {text:?}"),
        Unexpected::Signed(number) => format!("{number}"),
        Unexpected::Float(number) => format!("{number:?}"),
        Unexpected::Bool(flag) => format!("{flag}"),
        Unexpected::Map => "a table".to_owned(),
        Unexpected::Seq => "an array".to_owned(),
        other => other.to_string(),
    }
}

struct Reader<'de>(&'de Node);

impl Reader<'_> {
    fn unexpected(&self) -> Unexpected<'_> {
        match &self.0.value {
            Value::Table(_) => Unexpected::Map,
            Value::Array(_) => Unexpected::Seq,
            Value::String(text) => Unexpected::Str(text),
            Value::Integer(number) => Unexpected::Signed(*number),
            Value::Float(number) => Unexpected::Float(*number),
            Value::Boolean(flag) => Unexpected::Bool(*flag),
            Value::Datetime => Unexpected::Other("a date"),
        }
    }
}

impl<'de> Deserializer<'de> for Reader<'de> {
    type Error = Fault;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        match &self.0.value {
            Value::Table(entries) => visitor.visit_map(Entries {
                rest: entries.iter(),
                value: None,
            }),
            Value::Array(items) => {
                let mut seq = Items { items, next: 0 };
                let value = visitor.visit_seq(&mut seq)?;
                // serde's fixed arrays stop reading when full and ignore the rest.
                if seq.next == items.len() {
                    Ok(value)
                } else {
                    let expected = format!("an array of length {}", seq.next);
                    Err(de::Error::invalid_length(items.len(), &expected.as_str()))
                }
            }
            Value::String(text) => visitor.visit_borrowed_str(text),
            Value::Integer(number) => visitor.visit_i64(*number),
            Value::Float(number) if !number.is_finite() => {
                Err(Fault::new(Kind::NotFinite(*number)))
            }
            Value::Float(number) => visitor.visit_f64(*number),
            Value::Boolean(flag) => visitor.visit_bool(*flag),
            Value::Datetime => Err(de::Error::invalid_type(self.unexpected(), &visitor)),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Fault> {
        visitor.visit_some(self)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        // serde would also take an array of the fields in order; a scene file may not.
        match &self.0.value {
            Value::Table(_) => self.deserialize_any(visitor),
            _ => Err(de::Error::invalid_type(self.unexpected(), &visitor)),
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Fault> {
        match &self.0.value {
            Value::String(text) => visitor.visit_enum(text.as_str().into_deserializer()),
            _ => Err(de::Error::invalid_type(self.unexpected(), &visitor)),
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf
        unit unit_struct newtype_struct seq tuple tuple_struct map identifier ignored_any
    }
}

struct Entries<'de> {
    rest: std::slice::Iter<'de, super::document::Entry>,
    value: Option<&'de super::document::Entry>,
}

impl<'de> de::MapAccess<'de> for Entries<'de> {
    type Error = Fault;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Fault> {
        let Some(entry) = self.rest.next() else {
            return Ok(None);
        };
        self.value = Some(entry);
        let key: de::value::BorrowedStrDeserializer<'de, Fault> =
            de::value::BorrowedStrDeserializer::new(&entry.key);
        seed.deserialize(key)
            .map(Some)
            .map_err(|fault| fault.within(Segment::Key(entry.key.clone())))
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, Fault> {
        let entry = self
            .value
            .take()
            .ok_or_else(|| <Fault as de::Error>::custom("a value without a key"))?;
        seed.deserialize(Reader(&entry.node))
            .map_err(|fault| fault.within(Segment::Key(entry.key.clone())))
    }
}

struct Items<'de> {
    items: &'de [Node],
    next: usize,
}

impl<'de> de::SeqAccess<'de> for &mut Items<'de> {
    type Error = Fault;

    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, Fault> {
        let Some(item) = self.items.get(self.next) else {
            return Ok(None);
        };
        let index = self.next;
        self.next += 1;
        seed.deserialize(Reader(item))
            .map(Some)
            .map_err(|fault| fault.within(Segment::Index(index)))
    }
}
