//! Checks that a scene file makes sense. [`super::keys`] has the values that each key allows by
//! itself. This module checks references, contradictions, and ranges that depend on other keys.

mod blocks;
mod bodies;
mod closed_form;
mod joints;
mod linear;
mod planar;
mod repeats;
mod wear;

pub(super) use closed_form::closed_form;
pub(super) use joints::joints;
pub(super) use planar::{planar, starts, touches};

use super::document::{Document, Segment};
use super::error::{Hint, Place, SceneError};
use super::file::{Material, SceneFile, Step};
use super::keys;
use crate::dynamics::Scheme;

/// Checks everything that can be checked without placing the bodies: first every value by itself,
/// then the rules between several keys.
///
/// # Errors
/// The first fault found, see [`SceneError`].
pub(super) fn check(file: &SceneFile, document: &Document) -> Result<(), SceneError> {
    keys::check(document)?;
    let top = At::top(document);
    gravity(&top.key("gravity"))?;
    step(&top.key("step"), &file.step)?;
    distinct(
        &top.key("material"),
        "material",
        file.material.iter().map(|m| m.name.as_str()),
    )?;
    let closed_form = planar::is_planar(&file.body);
    for (index, material) in file.material.iter().enumerate() {
        check_material(&top.key("material").index(index), material, closed_form)?;
    }
    bodies::check(&top, file)?;
    repeats::check(&top, file)?;
    blocks::check(&top, file)
}

/// A place in the file, as a path of keys and indices, whose values are checked.
#[derive(Clone)]
pub struct At<'a> {
    document: &'a Document,
    path: Vec<Segment>,
}

/// A closed range of numbers, and its text in errors.
#[derive(Clone, Copy)]
pub struct Range {
    least: f64,
    most: f64,
    text: &'static str,
}

/// See [`Range`].
pub const fn range(least: f64, most: f64, text: &'static str) -> Range {
    Range { least, most, text }
}

impl<'a> At<'a> {
    pub(super) fn top(document: &'a Document) -> Self {
        At {
            document,
            path: Vec::new(),
        }
    }

    /// The block or key `key` at this place.
    pub fn key(&self, key: &str) -> Self {
        self.then(Segment::Key(key.to_owned()))
    }

    /// The element `index` at this place, from 0.
    pub fn index(&self, index: usize) -> Self {
        self.then(Segment::Index(index))
    }

    fn then(&self, segment: Segment) -> Self {
        let mut at = self.clone();
        at.path.push(segment);
        at
    }

    /// The place as errors name it.
    pub fn place(&self) -> Box<Place> {
        self.document.place(&self.path)
    }

    /// Checks that the value of a key is in its range.
    ///
    /// # Errors
    /// [`SceneError::OutOfRange`].
    pub fn within(&self, key: &str, value: f64, range: Range) -> Result<(), SceneError> {
        if (range.least..=range.most).contains(&value) {
            return Ok(());
        }
        Err(SceneError::OutOfRange {
            at: self.key(key).place(),
            value: format!("{value:?}"),
            allowed: range.text.to_owned(),
        })
    }

    /// Checks that all values of a list are in one range.
    ///
    /// # Errors
    /// [`SceneError::OutOfRange`].
    pub fn each(&self, key: &str, values: &[f64], range: Range) -> Result<(), SceneError> {
        for (index, value) in values.iter().enumerate() {
            if !(range.least..=range.most).contains(value) {
                return Err(SceneError::OutOfRange {
                    at: self.key(key).index(index).place(),
                    value: format!("{value:?}"),
                    allowed: range.text.to_owned(),
                });
            }
        }
        Ok(())
    }

    /// Checks that a whole number is between `least` and `most`.
    ///
    /// # Errors
    /// [`SceneError::OutOfRange`].
    pub fn count(&self, key: &str, value: u32, least: u32, most: u32) -> Result<(), SceneError> {
        if (least..=most).contains(&value) {
            return Ok(());
        }
        Err(SceneError::OutOfRange {
            at: self.key(key).place(),
            value: value.to_string(),
            allowed: format!("{least} to {most}"),
        })
    }

    /// Checks a name, which must be usable in a path of keys, a file name and a CSV column.
    ///
    /// # Errors
    /// [`SceneError::OutOfRange`].
    pub fn name(&self, key: &str, name: &str) -> Result<(), SceneError> {
        let good = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
        if (1..=64).contains(&name.len()) && name.chars().all(good) {
            return Ok(());
        }
        Err(SceneError::OutOfRange {
            at: self.key(key).place(),
            value: format!("{name:?}"),
            allowed: "1 to 64 letters, digits, `-` and `_`".to_owned(),
        })
    }

    fn written(&self, key: &str) -> bool {
        let mut path = self.path.clone();
        path.push(Segment::Key(key.to_owned()));
        self.document.node(&path).is_some()
    }

    /// If `when` is true, refuses the first of `keys` that the file has here. `{key}` in `why` stands
    /// for that key.
    fn refuse(&self, keys: &[&str], when: bool, why: &str) -> Result<(), SceneError> {
        match keys.iter().find(|key| when && self.written(key)) {
            Some(key) => Err(self.key(key).conflict(why.replace("{key}", key))),
            None => Ok(()),
        }
    }

    pub(super) fn missing(&self, key: impl Into<String>) -> SceneError {
        SceneError::Missing {
            at: self.place(),
            key: key.into(),
        }
    }

    pub(super) fn out_of_range(
        &self,
        value: impl Into<String>,
        allowed: impl Into<String>,
    ) -> SceneError {
        SceneError::OutOfRange {
            at: self.place(),
            value: value.into(),
            allowed: allowed.into(),
        }
    }

    pub(super) fn wrong_type(
        &self,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> SceneError {
        SceneError::WrongType {
            at: self.place(),
            expected: expected.into(),
            found: found.into(),
        }
    }

    fn wrong_length(&self, expected: String, found: usize) -> SceneError {
        self.wrong_type(expected, format!("{found} of them"))
    }

    pub(super) fn conflict(&self, problem: impl Into<String>) -> SceneError {
        SceneError::Conflict {
            at: self.place(),
            problem: problem.into(),
        }
    }

    pub(super) fn unknown<S: AsRef<str>>(
        &self,
        what: &str,
        name: &str,
        known: impl IntoIterator<Item = S>,
    ) -> SceneError {
        SceneError::UnknownName {
            at: self.place(),
            what: what.to_owned(),
            name: name.to_owned(),
            hint: Hint::new(name, known),
        }
    }
}

/// Refuses two elements of one array with the same name.
///
/// # Errors
/// [`SceneError::Duplicate`].
pub fn distinct<'n>(
    array: &At<'_>,
    what: &'static str,
    names: impl Iterator<Item = &'n str>,
) -> Result<(), SceneError> {
    let mut seen = std::collections::HashSet::new();
    for (index, name) in names.enumerate() {
        if !seen.insert(name) {
            return Err(SceneError::Duplicate {
                at: array.index(index).key("name").place(),
                what,
                name: name.to_owned(),
            });
        }
    }
    Ok(())
}

fn gravity(at: &At<'_>) -> Result<(), SceneError> {
    at.refuse(
        &["magnitude", "angle", "slope"],
        at.written("x") || at.written("y"),
        "give either x, y or magnitude with angle or slope, not both",
    )?;
    let why = "give angle or slope, not both";
    at.refuse(&["slope"], at.written("angle"), why)
}

fn step(at: &At<'_>, step: &Step) -> Result<(), SceneError> {
    if step.events && step.scheme == Scheme::Moreau {
        let problem = "event location needs the scheme staggered; moreau ignores gaps";
        return Err(at.key("events").conflict(problem));
    }
    Ok(())
}

fn check_material(at: &At<'_>, material: &Material, closed_form: bool) -> Result<(), SceneError> {
    at.refuse(
        &["damping_restitution"],
        at.written("damping"),
        "give damping or damping_restitution, not both",
    )?;
    let rigid = material.stiffness.is_none();
    let damping = ["damping", "damping_restitution"];
    at.refuse(&damping, rigid, "damping needs a stiffness")?;
    at.refuse(
        &["restitution"],
        !rigid && material.restitution != 0.0,
        "restitution has no effect on a compliant contact; use damping_restitution",
    )?;
    at.refuse(
        &["stiffness"],
        closed_form,
        "contacts in a scene with a rod, a line or a bowl are rigid",
    )
}
