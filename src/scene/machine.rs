//! A machine in a scene file: blocks that belong to a folder above this one.
//!
//! A machine makes its own bodies. This folder knows only the names of its blocks, to suggest the
//! right name for a misspelt one. The owner of the blocks gives [`Scene::parse_machine`] a type to
//! read them into and a function to check them. Errors are the same as in the scene's own blocks, and
//! `--set` changes keys of both.
//!
//! [`Scene::parse_machine`]: super::Scene::parse_machine

use super::SceneError;
use super::check::At;
use super::document::{Document, Segment};
use super::file::{Reference, SceneFile};
use super::reader;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Names of the blocks that may belong to a machine. `wear` is a machine's as a table; as an array of
/// tables it is the scene's own.
const KEYS: [&str; 4] = ["tooth", "wear", "study", "thresher"];

/// A block that exists but is not read here.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub struct Kept {}

/// The scene's own blocks, and the machine's.
///
/// # Errors
/// Those of [`reader::read`].
pub(super) fn read<M: DeserializeOwned>(document: &Document) -> Result<(SceneFile, M), SceneError> {
    let own = document.is_array("wear");
    let table = document.root.entry("wear").filter(|_| !own);
    if table.is_some_and(|wear| wear.node.entry("body").is_some()) {
        let problem = "[wear] is the block of a machine; [[wear]] lets a body wear".to_owned();
        let at = document.place(&[Segment::Key("wear".to_owned())]);
        return Err(SceneError::Conflict { at, problem });
    }
    let of_scene = document.only(|key| own || key != "wear");
    let of_machine = document.only(|key| KEYS.contains(&key) && !(own && key == "wear"));
    Ok((reader::read(&of_scene)?, reader::read(&of_machine)?))
}

/// The whole file as JSON with defaults filled in, including the machine's blocks.
#[derive(Serialize)]
pub(super) struct Whole<'a, M> {
    #[serde(flatten)]
    file: &'a SceneFile,
    #[serde(flatten)]
    machine: &'a M,
    reference: Option<Reference>,
}

impl<'a, M: Serialize> Whole<'a, M> {
    pub fn new(file: &'a SceneFile, machine: &'a M) -> Self {
        Whole {
            file,
            machine,
            reference: file.reference,
        }
    }

    /// As a tree: the scene's own `wear`, where it has one, in place of the machine's.
    pub fn tree(&self) -> serde_json::Value {
        // a number that is finite and a key that is a string always have a JSON form
        let mut all = serde_json::to_value(self).unwrap_or_default();
        if !self.file.wear.is_empty() {
            all["wear"] = serde_json::to_value(&self.file.wear).unwrap_or_default();
        }
        all
    }
}

/// The machine type of a scene that must have no machine.
#[derive(Deserialize, Serialize)]
pub(super) struct NoMachine {
    tooth: Option<Kept>,
    wear: Option<Kept>,
    study: Option<Kept>,
    thresher: Option<Kept>,
}

/// Refuses a machine.
pub(super) fn refuse(machine: &NoMachine, top: &At<'_>) -> Result<(), SceneError> {
    let blocks = [
        &machine.tooth,
        &machine.wear,
        &machine.study,
        &machine.thresher,
    ];
    match KEYS.iter().zip(blocks).find(|(_, block)| block.is_some()) {
        Some((key, _)) => Err(top.key(key).conflict(format!(
            "[{key}] belongs to a machine, which is more than a scene of bodies: read the file by \
             `thresher::load`"
        ))),
        None => Ok(()),
    }
}
