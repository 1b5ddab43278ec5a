//! The entries of the failure atlas: files of `scenes/atlas/`, each a scene and a ladder of
//! changes to it.
//!
//! A rung is a scene like any other: every command takes it as `atlas/tower:50`, or by the path of
//! its file as `scenes/atlas/tower.toml:50`. `moreau2d scenes --atlas` lists them.
//!
//! # How to add a rung
//! Add a line to `rungs` of the entry's file: its name, and in `set` the keys of the scene that it
//! changes, as `--set` takes them. `with` gives the numbers that the checks of this rung need,
//! `slow = true` keeps it out of `atlas --quick`.
//!
//! # How to add an entry
//! Write a file like this one. `moreau2d atlas FILE.toml` runs it with every engine. To embed it in the
//! program, put it into `scenes/atlas/` and add its name to the list in `src/scene/atlas.rs`.
//!
//! ```toml
//! # The scene: the blocks of any scene file; or none of them, and `base = "tower"` below.
//! body = [
//!   { name = "floor", kind = "fixed", box = [40, 2], position = [0, -1] },
//!   { name = "box", box = [1, 1], position = [0, 0.5] },
//! ]
//! repeat = [{ of = "box", count = [1, 10], step = [[0, 0], [0, 1]] }]
//!
//! [atlas]
//! shows = "a tall stack"
//! passes = "10 s: lean below 1e-3 of the height, penetration below 1e-4 of a box"
//! # A judge is a list of checks, all of which must hold, and a word for it.
//! judges = [
//!   { name = "stands", checks = [
//!     { measure = "lean", limit = 1e-3 },
//!     { measure = "penetration", unit = "of a box", limit = 1e-4 },
//!   ] },
//! ]
//! rungs = [
//!   { name = "10", with.height = 10 },
//!   { name = "50", set.repeat.0.count = [1, 50], with.height = 50 },
//! ]
//! # Known failures of our engine with their cause: printed beneath the table.
//! [[atlas.fails]]
//! rungs = ["50"]
//! why = "a sentence with figures"
//! ```
//!
//! [`AtlasBlock`] and its fields document every key. The measures are one table of names and functions
//! in `src/experiment/atlas/measures.rs`: a new measure is a line there. Geometry that is too long to
//! write down is a value `{ generate = "NAME", ... }`, computed in `src/scene/generate.rs`.

use super::catalogue;
use super::document::{Document, Node, Segment, Value};
use super::error::{Hint, Origin, SceneError};
use super::issues::{self, ISSUES, Issue};
use super::{At, Scene, overrides, reader};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Name and text of the files of a folder of `scenes/`, for each name given.
macro_rules! embedded {
    ($folder:literal: $($name:literal)*) => {
        &[$(($name, include_str!(concat!("../../scenes/", $folder, "/", $name, ".toml")))),*]
    };
}
pub(super) use embedded;

/// Every entry that comes with the program, in the order of the picture.
const EMBEDDED: &[(&str, &str)] = embedded! { "atlas":
    "heavy-on-light" "tower" "pyramid" "inverted-pyramid" "arch" "card-house" "overhang" "wedge"
    "redundant-contacts" "rotor" "painleve" "kane" "zeno-ball" "stick-slip-incline"
    "sliding-lift-off" "ghost-edges" "bullet" "initial-overlap" "far-origin" "tiny-and-huge"
    "heavy-end" "spinner" "gears" "ratchet" "dominoes" "granular-drum" "hopper" "friction-ramp"
    "rush" "confined" "bridge" "ball-and-chain" "joint-grid"
};

/// Prefix of the names of rungs.
const PREFIX: &str = "atlas/";

/// A scene of the atlas and its ladder.
#[derive(Debug, Clone)]
pub struct AtlasEntry {
    /// The file's name without `.toml`.
    pub name: String,
    /// `[atlas]`
    pub block: AtlasBlock,
    /// The file without `[atlas]`.
    own: Document,
    /// A table with `set` for each rung that has it.
    changes: Vec<Node>,
}

/// `[atlas]`: the block that makes a scene file an entry. `shows`, `passes` and `judges` are required.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AtlasBlock {
    /// What the entry shows, in a line.
    pub shows: String,
    /// When a rung passes, in words.
    pub passes: String,
    /// The catalogue scene that the rungs change; default the blocks of the file itself.
    base: Option<String>,
    /// The first judge is the default of rungs.
    pub judges: Vec<AtlasJudge>,
    /// From easy to hard; default: one rung without a name and without changes.
    #[serde(default = "AtlasRung::alone")]
    pub rungs: Vec<AtlasRung>,
    /// Known failures of our engine.
    #[serde(default)]
    pub fails: Vec<AtlasFailure>,
    /// The complaint of users that the entry stands for.
    pub issue: Option<Issue>,
}

/// An element of `judges`: the checks of a rung, all of which must hold.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AtlasJudge {
    /// Name by which rungs refer to it.
    pub name: String,
    /// What a passed rung does, in a word: `mode` of the results. Default: the name.
    mode: Option<String>,
    pub checks: Vec<AtlasCheck>,
}

/// An element of `checks`. Other keys are numbers that the measure takes, such as `size`.
#[derive(Debug, Clone, Deserialize)]
pub struct AtlasCheck {
    /// A name of the table of measures.
    pub measure: String,
    /// Name in the results; default the measure's.
    pub name: Option<String>,
    /// Upper limit; default none: the value is only reported.
    pub limit: Option<f64>,
    /// Default: the measure's.
    pub unit: Option<String>,
    /// How a rung fails by it, in a word; default: the measure's.
    pub fails: Option<String>,
    /// Mode of the failure if the measured event never happened; default: as `fails`.
    pub never: Option<String>,
    /// The body to measure, for a measure of one body.
    pub body: Option<String>,
    #[serde(flatten)]
    pub numbers: BTreeMap<String, f64>,
}

/// An element of `rungs`. It also has `set`: keys of the scene as `--set` takes them, and their
/// values. A value `{ generate = "NAME", ... }` is computed, see `src/scene/generate.rs`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AtlasRung {
    pub name: String,
    /// In place of the entry's.
    base: Option<String>,
    judge: Option<String>,
    /// Left out by `--quick`; default no.
    #[serde(default)]
    pub slow: bool,
    /// Whether it needs double precision; default false.
    #[serde(default)]
    pub double: bool,
    /// Why other engines than ours cannot run it; default: they can.
    pub only_ours: Option<String>,
    /// Numbers of the checks that differ from rung to rung.
    #[serde(default)]
    pub with: BTreeMap<String, f64>,
}

/// An element of `fails`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AtlasFailure {
    /// Names of rungs.
    rungs: Vec<String>,
    /// The cause, in a sentence.
    why: String,
}

impl AtlasRung {
    /// The only rung of an entry that lists none.
    fn alone() -> Vec<AtlasRung> {
        vec![AtlasRung::default()]
    }
}

impl AtlasJudge {
    /// What a passed rung does, in a word.
    pub fn mode(&self) -> &str {
        self.mode.as_deref().unwrap_or(&self.name)
    }
}

impl AtlasEntry {
    /// The entry called `name`, the complaint called `issues/NAME`, or the file at the path `name`.
    ///
    /// # Errors
    /// [`SceneError::UnknownScene`] with the nearest name, and those of a file that cannot be read.
    pub fn load(name: &str) -> Result<AtlasEntry, SceneError> {
        if let Some((name, text)) = EMBEDDED.iter().find(|(known, _)| *known == name) {
            return AtlasEntry::read(&format!("scenes/atlas/{name}.toml"), text);
        }
        if name.ends_with(".toml") {
            return AtlasEntry::read(name, &catalogue::read(Path::new(name))?);
        }
        if let Some(issue) = name.strip_prefix(issues::PREFIX) {
            return match ISSUES.iter().find(|(known, _)| *known == issue) {
                Some((_, text)) => AtlasEntry::read(&format!("scenes/{name}.toml"), text),
                None => Err(SceneError::UnknownScene {
                    name: name.to_owned(),
                    hint: Hint::new(issue, ISSUES.iter().map(|(name, _)| name)),
                }),
            };
        }
        Err(SceneError::UnknownScene {
            name: format!("{PREFIX}{name}"),
            hint: Hint::new(name, EMBEDDED.iter().map(|(name, _)| name)),
        })
    }

    fn read(file: &str, text: &str) -> Result<AtlasEntry, SceneError> {
        #[derive(Deserialize)]
        struct Whole {
            atlas: AtlasBlock,
        }
        let mut own = Document::parse(file, text)?;
        let mut atlas = Document {
            file: file.to_owned(),
            root: own.root.split_off("atlas"),
        };
        let mut changes = Vec::new();
        if let Some(Value::Array(rungs)) = atlas.root.at_mut(&["atlas", "rungs"]) {
            changes.extend(rungs.iter_mut().map(|rung| rung.split_off("set")));
        }
        let Whole { atlas: block } = reader::read(&atlas)?;
        let name = Path::new(file).file_stem().unwrap_or_default();
        let entry = AtlasEntry {
            name: name.to_string_lossy().into_owned(),
            block,
            own,
            changes,
        };
        entry.check(&atlas)?;
        entry.titled()
    }

    /// Gives the file's own scene its `[scene]`.
    fn titled(mut self) -> Result<AtlasEntry, SceneError> {
        if let (Some(base), Value::Table(blocks)) = (&self.block.base, &self.own.root.value)
            && let Some(block) = blocks.first()
        {
            return Err(SceneError::Conflict {
                at: self.own.place(&[Segment::Key(block.key.clone())]),
                problem: format!("has no effect beside base = \"{base}\""),
            });
        }
        let origin = self.own.root.origin.clone();
        for (key, text) in [("name", &self.name), ("title", &self.block.shows)] {
            let path = ["scene".to_owned(), key.to_owned()];
            let text = Node {
                origin: origin.clone(),
                value: Value::String(text.clone()),
            };
            overrides::set(&mut self.own, &path, &origin, text)?;
        }
        Ok(self)
    }

    /// Whether names are unique, and what is named is there.
    fn check(&self, document: &Document) -> Result<(), SceneError> {
        let block = &self.block;
        let place = |words: [&str; 2], k: usize| {
            let mut path = words.map(|word| Segment::Key(word.to_owned())).to_vec();
            path.push(Segment::Index(k));
            document.place(&path)
        };
        if block.judges.is_empty() || block.rungs.is_empty() {
            return Err(SceneError::Missing {
                at: document.place(&[Segment::Key("atlas".to_owned())]),
                key: "judges, rungs".to_owned(),
            });
        }
        let judges: Vec<&str> = block.judges.iter().map(|j| j.name.as_str()).collect();
        let rungs: Vec<&str> = block.rungs.iter().map(|r| r.name.as_str()).collect();
        for (k, rung) in block.rungs.iter().enumerate() {
            let at = || place(["atlas", "rungs"], k);
            if rungs[..k].contains(&rungs[k]) {
                return Err(SceneError::Duplicate {
                    at: at(),
                    what: "rung",
                    name: rung.name.clone(),
                });
            }
            if let Some(judge) = &rung.judge {
                known(judge, "judge", &judges, at)?;
            }
        }
        for (k, failure) in block.fails.iter().enumerate() {
            for name in &failure.rungs {
                known(name, "rung", &rungs, || place(["atlas", "fails"], k))?;
            }
        }
        Ok(())
    }

    /// The rung called `name`.
    ///
    /// # Errors
    /// [`SceneError::UnknownName`] with the nearest; [`SceneError::Conflict`] where it is empty.
    pub fn rung(&self, name: &str) -> Result<&AtlasRung, SceneError> {
        let names: Vec<&str> = self.block.rungs.iter().map(|r| r.name.as_str()).collect();
        if name.is_empty() && !names.contains(&name) {
            let known = Hint::new(name, &names);
            return Err(SceneError::Conflict {
                at: self.own.place(&[]),
                problem: format!(
                    "say which rung of the entry, as in NAME:{}{known}",
                    names[0]
                ),
            });
        }
        let k = known(name, "rung", &names, || self.own.place(&[]))?;
        Ok(&self.block.rungs[k])
    }

    /// What judges `rung`.
    pub fn judge(&self, rung: &AtlasRung) -> &AtlasJudge {
        let judges = &self.block.judges;
        let found = judges.iter().find(|j| Some(&j.name) == rung.judge.as_ref());
        found.unwrap_or(&judges[0])
    }

    /// Why ours fails the rung called `rung`, where it is known to.
    pub fn explanation(&self, rung: &str) -> Option<&str> {
        let mut fails = self.block.fails.iter();
        let found = fails.find(|failure| failure.rungs.iter().any(|name| name == rung));
        found.map(|failure| failure.why.as_str())
    }

    /// The scene of `rung`, in its parts.
    pub(super) fn document(&self, rung: &AtlasRung) -> Result<Document, SceneError> {
        let mut document = match rung.base.as_ref().or(self.block.base.as_ref()) {
            Some(base) => catalogue::document(base)?,
            None => self.own.clone(),
        };
        let mut rungs = self.block.rungs.iter().zip(&self.changes);
        let set = rungs.find_map(|(r, table)| (r.name == rung.name).then(|| table.entry("set")));
        if let Some(Some(set)) = set {
            let origin = Origin::Typed(format!("rung `{}`", rung.name));
            overrides::graft(&mut document, &mut Vec::new(), &set.node, &origin)?;
        }
        Ok(document)
    }

    /// The scene of `rung`, which may hold a machine: see [`Scene::parse_machine`].
    ///
    /// # Arguments
    /// - `flags`: as of [`Scene::parse`], applied after the rung's own changes.
    ///
    /// # Errors
    /// Those of [`Scene::parse_machine`].
    pub fn scene<M: DeserializeOwned + Serialize>(
        &self,
        rung: &AtlasRung,
        flags: &[String],
        check: impl Fn(&M, &At<'_>) -> Result<(), SceneError>,
    ) -> Result<(Scene, M), SceneError> {
        Scene::with_machine(self.document(rung)?, flags, check)
    }
}

/// The place of `name` among `all`.
fn known(
    name: &str,
    what: &str,
    all: &[&str],
    at: impl Fn() -> Box<super::error::Place>,
) -> Result<usize, SceneError> {
    let found = all.iter().position(|known| *known == name);
    found.ok_or_else(|| SceneError::UnknownName {
        at: at(),
        what: what.to_owned(),
        name: name.to_owned(),
        hint: Hint::new(name, all),
    })
}

/// All entries that come with the program, in the order of the picture.
///
/// # Errors
/// Those of [`AtlasEntry::load`], if an embedded file is broken; a test loads them all.
pub fn atlas_entries() -> Result<Vec<AtlasEntry>, SceneError> {
    let each = EMBEDDED.iter();
    each.map(|(name, _)| AtlasEntry::load(name)).collect()
}

/// Entry and rung of `atlas/ENTRY:RUNG`, `issues/NAME` or `FILE.toml:RUNG`; `None` for other scenes.
pub(super) fn split(name: &str) -> Option<(&str, &str)> {
    if let Some((stem, rung)) = name.split_once(".toml:") {
        return Some((&name[..stem.len() + ".toml".len()], rung));
    }
    if name.ends_with(".toml") {
        return None;
    }
    let issue = name.starts_with(issues::PREFIX).then_some(name);
    let name = issue.or_else(|| name.strip_prefix(PREFIX))?;
    Some(name.split_once(':').unwrap_or((name, "")))
}
