//! Plans of a sweep: a scene, and which of its keys take which values.
//!
//! ```toml
//! scene = "thresher-study"         # a scene of the catalogue, or a file beside the plan
//!
//! [set]                            # the same in every case, as `run --set` takes it
//! "study.contact_time" = 6.95e-4
//! "study.speeds" = "[{study.calibrate.speed}]" # follows a key that varies
//!
//! [grid]                           # every value with every other
//! "study.calibrate.speed" = [70, 80, 90]
//! "study.friction" = [0.25, 0.3]
//!
//! [sample]                         # with each of them, ten draws
//! count = 10
//! seed = 1
//! [sample.keys]
//! "wear.coefficient" = { distribution = "lognormal", median = 3.3e-12, factor = 1.5 }
//! ```
//!
//! `[[case]]` lists cases one by one: each is a table of keys and values. Where a plan has several of
//! `[[case]]`, `[grid]` and `[sample]`, every case of one is taken with every case of the others.

mod read;
mod sample;
#[cfg(test)]
mod tests;

pub(super) use read::{leaves, toml};
pub use sample::distributions;

use super::catalogue;
use super::error::{Hint, Origin, Place, SceneError};
use std::path::{Path, PathBuf};

/// Most cases of a plan: an extra zero in `count` must not fill a disk.
pub const MOST_CASES: usize = 100_000;

/// A plan that was read and whose own values were checked. Those of the scene are checked when a case
/// is loaded.
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// The file as errors name it.
    pub file: String,
    /// The scene as the plan names it.
    pub scene: String,
    /// Where the plan names it.
    pub scene_place: Place,
    /// The keys that vary, in the order of the file.
    pub keys: Vec<String>,
    set: Vec<Setting>,
    /// Their product is the plan, the last one running fastest.
    axes: Vec<Axis>,
    count: usize,
}

/// The points of an axis; each sets one key or several.
type Axis = Vec<Vec<Setting>>;

/// A value of a key.
#[derive(Debug, Clone, PartialEq)]
struct Setting {
    key: String,
    /// As TOML.
    value: String,
    /// The value is a string and is given as such in tables.
    bare: Option<String>,
    place: Place,
}

/// One case of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// What each of [`Plan::keys`] is set to, as text; `None` where the case leaves it to the scene.
    pub values: Vec<Option<String>>,
    /// What the case changes in the scene, in order.
    pub changes: Vec<Change>,
}

/// A change of the scene and where the plan makes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// `key=value`, as [`super::Scene::parse`] takes it.
    pub flag: String,
    /// Its path is the key.
    pub place: Place,
}

impl Plan {
    /// Reads a plan from its text; `file` is its name in errors.
    ///
    /// # Errors
    /// [`SceneError::Syntax`]; [`SceneError::UnknownKey`], [`SceneError::UnknownName`] of a
    /// distribution and [`SceneError::Missing`]; [`SceneError::WrongType`] for what is no list of
    /// values; [`SceneError::OutOfRange`] for an empty list, a number that is not finite, a parameter
    /// of a distribution and more than [`MOST_CASES`] cases; [`SceneError::Conflict`] for a key that is
    /// set twice, a value that is listed twice and a plan without cases.
    pub fn parse(file: &str, text: &str) -> Result<Plan, SceneError> {
        read::plan(file, text)
    }

    /// Number of cases.
    #[allow(clippy::len_without_is_empty)] // a plan has at least one case
    pub fn len(&self) -> usize {
        self.count
    }

    /// The scene to load: as [`super::load`] takes it, with files looked for beside the plan.
    pub fn scene_beside(&self, plan: &Path) -> String {
        let beside = self.beside(plan);
        let of_catalogue = || catalogue::document(&self.scene).is_ok();
        match self.scene.contains(".toml") || beside.is_file() && !of_catalogue() {
            true => beside.to_string_lossy().into_owned(),
            false => self.scene.clone(),
        }
    }

    /// Where the scene is if it is a file.
    pub fn beside(&self, plan: &Path) -> PathBuf {
        plan.parent().unwrap_or(Path::new("")).join(&self.scene)
    }

    /// The case `number`, from 0.
    ///
    /// # Errors
    /// [`SceneError::OutOfRange`] from [`Plan::len`] on; [`SceneError::UnknownName`] where `[set]` follows
    /// a key that does not vary in this case.
    pub fn case(&self, number: usize) -> Result<Case, SceneError> {
        if number >= self.count {
            let origin = Origin::Line { line: 1, column: 1 };
            let (file, path) = (self.file.clone(), "case".to_owned());
            return Err(SceneError::OutOfRange {
                at: Box::new(Place { file, origin, path }),
                value: number.to_string(),
                allowed: format!("0 to {}", self.count - 1),
            });
        }
        let mut rest = number;
        let mut points: Vec<&Vec<Setting>> = Vec::new();
        for axis in self.axes.iter().rev() {
            points.push(&axis[rest % axis.len()]);
            rest /= axis.len();
        }
        let varied: Vec<&Setting> = points.into_iter().rev().flatten().collect();
        let value = |key: &String| {
            let found = varied.iter().find(|setting| setting.key == *key);
            found.map(|setting| setting.text().to_owned())
        };
        let mut changes = Vec::new();
        for fixed in &self.set {
            changes.push(fixed.change(&fixed.following(&varied)?));
        }
        changes.extend(varied.iter().map(|setting| setting.change(&setting.value)));
        Ok(Case {
            values: self.keys.iter().map(value).collect(),
            changes,
        })
    }
}

impl Setting {
    /// The value in tables.
    fn text(&self) -> &str {
        self.bare.as_deref().unwrap_or(&self.value)
    }

    fn change(&self, value: &str) -> Change {
        Change {
            flag: format!("{}={value}", self.key),
            place: self.place.clone(),
        }
    }

    /// The value with each `{key}` in a string replaced by what the case sets that key to. What comes
    /// out is read as TOML.
    fn following(&self, varied: &[&Setting]) -> Result<String, SceneError> {
        let Some(text) = self.bare.as_deref().filter(|text| text.contains('{')) else {
            return Ok(self.value.clone());
        };
        let mut out = String::new();
        let mut rest = text;
        let mut follows = false;
        while let Some((before, after)) = rest.split_once('{') {
            out.push_str(before);
            rest = after;
            let key = after.split_once('}').map(|(key, _)| key).filter(is_key);
            let Some(key) = key else {
                // an inline table
                out.push('{');
                continue;
            };
            let found = varied.iter().find(|setting| setting.key == key);
            let found = found.ok_or_else(|| SceneError::UnknownName {
                at: Box::new(self.place.clone()),
                what: "key that varies".to_owned(),
                name: key.to_owned(),
                hint: Hint::new(key, varied.iter().map(|setting| &setting.key)),
            })?;
            out.push_str(found.text());
            rest = &after[key.len() + 1..];
            follows = true;
        }
        out.push_str(rest);
        Ok(match follows {
            true => out,
            false => self.value.clone(),
        })
    }
}

/// Whether a text may be a key of a scene.
fn is_key(text: &&str) -> bool {
    let part = |c: char| c.is_ascii_alphanumeric() || "-_.[],".contains(c);
    !text.is_empty() && text.chars().all(part)
}
