//! The atlas of complaints: scenes after threads of public issue trackers, in `scenes/issues/`.
//!
//! Each file is an entry of the atlas with one rung and a block `[atlas.issue]`, which names the
//! threads and says what part of them the scene tests. The verdict is a closed form or a limit of
//! statics, never the result of an engine. Every command takes a scene as `issues/NAME`;
//! `moreau2d atlas --issues` runs them all with all engines.

use super::atlas::{AtlasEntry, embedded};
use super::error::SceneError;
use serde::Deserialize;

/// Prefix of the names of the scenes.
pub(super) const PREFIX: &str = "issues/";

/// Every complaint, in the order of the table.
pub(super) const ISSUES: &[(&str, &str)] = embedded! { "issues":
    "flush-tiles" "flush-tiles-disc" "flush-chunks" "heavy-on-cube" "launched-box" "smaller-base"
    "welded-beam" "welded-tower" "bounce-for-ever" "elastic-disc" "creep-on-slope" "gripped-part"
    "impulse-of-drop" "head-on" "flipper" "chain-limits" "friction-impulse" "rope-on-drum"
    "cradle" "tilted-foot" "triangles" "gears" "ball-and-chain" "stack-ten-minutes"
    "pressed-into-wall" "snapshot" "contact-force" "dense-cube" "rolling-disc" "shuttle"
};

/// `[atlas.issue]`
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Issue {
    /// Repository and number of each thread, as in `dimforge/rapier#142`.
    pub threads: Vec<String>,
    /// Threads that could not be looked up, so that only their number and subject are known.
    #[serde(default)]
    pub unchecked: Vec<String>,
    /// What users complained of.
    pub complaint: String,
    /// What part of the threads the scene tests, and what it leaves out.
    pub tests: String,
}

/// All complaints, in the order of the table.
///
/// # Errors
/// Those of [`AtlasEntry::load`], if an embedded file is broken; a test loads them all.
pub fn issue_entries() -> Result<Vec<AtlasEntry>, SceneError> {
    let each = ISSUES.iter();
    each.map(|(name, _)| AtlasEntry::load(&format!("{PREFIX}{name}")))
        .collect()
}
