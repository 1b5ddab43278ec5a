//! The scenes that come with the program, embedded in it.

use super::atlas::{self, AtlasEntry};
use super::document::Document;
use super::error::{Hint, SceneError};
use super::{At, Scene};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::{IsTerminal, Read};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

/// Name and text of every embedded scene, in the order the catalogue shows them.
const EMBEDDED: &[(&str, &str)] = &[
    (
        "sliding-block",
        include_str!("../../scenes/sliding-block.toml"),
    ),
    ("incline", include_str!("../../scenes/incline.toml")),
    ("conveyor", include_str!("../../scenes/conveyor.toml")),
    (
        "spinning-disc",
        include_str!("../../scenes/spinning-disc.toml"),
    ),
    (
        "bouncing-ball",
        include_str!("../../scenes/bouncing-ball.toml"),
    ),
    ("two-balls", include_str!("../../scenes/two-balls.toml")),
    (
        "touching-balls",
        include_str!("../../scenes/touching-balls.toml"),
    ),
    ("cradle", include_str!("../../scenes/cradle.toml")),
    ("elastic-gas", include_str!("../../scenes/elastic-gas.toml")),
    ("beam", include_str!("../../scenes/beam.toml")),
    ("three-discs", include_str!("../../scenes/three-discs.toml")),
    ("ladder", include_str!("../../scenes/ladder.toml")),
    (
        "block-on-slope",
        include_str!("../../scenes/block-on-slope.toml"),
    ),
    ("wedge", include_str!("../../scenes/wedge.toml")),
    ("arch", include_str!("../../scenes/arch.toml")),
    ("capstan", include_str!("../../scenes/capstan.toml")),
    (
        "rocking-block",
        include_str!("../../scenes/rocking-block.toml"),
    ),
    ("pyramid", include_str!("../../scenes/pyramid.toml")),
    ("tower", include_str!("../../scenes/tower.toml")),
    ("wall", include_str!("../../scenes/wall.toml")),
    ("heavy-top", include_str!("../../scenes/heavy-top.toml")),
    ("drum", include_str!("../../scenes/drum.toml")),
    ("hit-heap", include_str!("../../scenes/hit-heap.toml")),
    (
        "large-pyramid",
        include_str!("../../scenes/large-pyramid.toml"),
    ),
    (
        "many-pyramids",
        include_str!("../../scenes/many-pyramids.toml"),
    ),
    ("tumbler", include_str!("../../scenes/tumbler.toml")),
    ("box-drum", include_str!("../../scenes/box-drum.toml")),
    (
        "drum-of-boxes",
        include_str!("../../scenes/drum-of-boxes.toml"),
    ),
    ("grains", include_str!("../../scenes/grains.toml")),
    ("loaded-arch", include_str!("../../scenes/loaded-arch.toml")),
    ("card-house", include_str!("../../scenes/card-house.toml")),
    (
        "high-mass-ratio-1",
        include_str!("../../scenes/high-mass-ratio-1.toml"),
    ),
    (
        "high-mass-ratio-2",
        include_str!("../../scenes/high-mass-ratio-2.toml"),
    ),
    (
        "high-mass-ratio-3",
        include_str!("../../scenes/high-mass-ratio-3.toml"),
    ),
    ("joint-grid", include_str!("../../scenes/joint-grid.toml")),
    (
        "ball-and-chain",
        include_str!("../../scenes/ball-and-chain.toml"),
    ),
    (
        "one-way-platforms",
        include_str!("../../scenes/one-way-platforms.toml"),
    ),
    ("bowl", include_str!("../../scenes/bowl.toml")),
    (
        "rolling-bowl",
        include_str!("../../scenes/rolling-bowl.toml"),
    ),
    ("loop", include_str!("../../scenes/loop.toml")),
    ("stuck-rod", include_str!("../../scenes/stuck-rod.toml")),
    ("falling-rod", include_str!("../../scenes/falling-rod.toml")),
    ("riding-disc", include_str!("../../scenes/riding-disc.toml")),
    ("painleve", include_str!("../../scenes/painleve.toml")),
    ("pendulum", include_str!("../../scenes/pendulum.toml")),
    (
        "double-pendulum",
        include_str!("../../scenes/double-pendulum.toml"),
    ),
    ("chain", include_str!("../../scenes/chain.toml")),
    (
        "slider-crank",
        include_str!("../../scenes/slider-crank.toml"),
    ),
    ("woodpecker", include_str!("../../scenes/woodpecker.toml")),
    ("pin-on-disc", include_str!("../../scenes/pin-on-disc.toml")),
    (
        "thresher-study",
        include_str!("../../scenes/thresher-study.toml"),
    ),
    ("thresher", include_str!("../../scenes/thresher.toml")),
    (
        "thresher-grains",
        include_str!("../../scenes/thresher-grains.toml"),
    ),
];

/// One line of the catalogue.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listing {
    pub name: &'static str,
    /// What the scene shows.
    pub title: String,
    /// Whether it has a closed form to be compared with.
    pub has_reference: bool,
}

/// The catalogue, in the order it is shown.
///
/// # Errors
/// [`SceneError::Syntax`], if an embedded scene is broken; a test loads them all.
pub fn scenes() -> Result<Vec<Listing>, SceneError> {
    EMBEDDED
        .iter()
        .map(|&(name, text)| {
            let document = Document::parse(&file_of(name), text)?;
            let header = document.root.entry("scene");
            let title = header.and_then(|header| header.node.string("title"));
            Ok(Listing {
                name,
                title: title.unwrap_or_default().to_owned(),
                has_reference: document.root.entry("reference").is_some(),
            })
        })
        .collect()
}

/// Loads a scene by its name in the catalogue, from a file, or a rung of the atlas as
/// `atlas/ENTRY:RUNG` or `FILE.toml:RUNG`.
///
/// A name of the catalogue comes first; anything else that ends in `.toml` or is a file is read.
///
/// # Arguments
/// - `flags`: `key=value`, applied in order before anything is checked, see
///   [`Scene::parse`].
///
/// # Errors
/// [`SceneError::UnknownScene`] and [`SceneError::NoFile`] with the nearest name,
/// [`SceneError::UnknownName`] with the nearest rung, [`SceneError::Read`], and those of
/// [`Scene::parse`].
pub fn load(name_or_path: &str, flags: &[String]) -> Result<Scene, SceneError> {
    Scene::of(find(name_or_path)?, flags)
}

/// As [`load`], for a scene that may hold a machine, see [`Scene::parse_machine`].
///
/// # Errors
/// Those of [`load`], and those of `check`.
pub fn load_machine<M: DeserializeOwned + Serialize>(
    name_or_path: &str,
    flags: &[String],
    check: impl Fn(&M, &At<'_>) -> Result<(), SceneError>,
) -> Result<(Scene, M), SceneError> {
    Scene::with_machine(find(name_or_path)?, flags, check)
}

/// The parsed document of a catalogue scene, of a file, or of a rung of the atlas.
fn find(name_or_path: &str) -> Result<Document, SceneError> {
    if let Some((entry, rung)) = atlas::split(name_or_path) {
        let entry = AtlasEntry::load(entry)?;
        return entry.document(entry.rung(rung)?);
    }
    if name_or_path == STANDARD_INPUT {
        return Document::parse(STDIN, &standard_input()?);
    }
    let embedded = document(name_or_path);
    let path = Path::new(name_or_path);
    if embedded.is_err() && path.is_dir() {
        let problem = "it is a folder, and a scene is a file, such as NAME.toml";
        return Err(unread(path, std::io::Error::other(problem)));
    }
    let file = || path.extension().is_some_and(|e| e == "toml") || path.is_file();
    if embedded.is_err() && file() {
        let document = Document::parse(name_or_path, &read(path)?)?;
        if document.root.entry("atlas").is_some() {
            // an entry of the atlas needs a rung: the error lists its rungs
            let entry = AtlasEntry::load(name_or_path)?;
            return entry.document(entry.rung("")?);
        }
        return Ok(document);
    }
    embedded
}

/// The parsed document of the catalogue scene `name`.
///
/// # Errors
/// [`SceneError::UnknownScene`] with the nearest name.
pub(super) fn document(name: &str) -> Result<Document, SceneError> {
    let found = EMBEDDED.iter().find(|(known, _)| *known == name);
    let (name, text) = found.ok_or_else(|| SceneError::UnknownScene {
        name: name.to_owned(),
        hint: Hint::new(name, EMBEDDED.iter().map(|(name, _)| name)),
    })?;
    Document::parse(&file_of(name), text)
}

/// The name of a scene that is read from standard input, and what errors call it.
const STANDARD_INPUT: &str = "-";
const STDIN: &str = "<stdin>";
/// What to do where standard input has no scene: also with `run --resume`, which reads it again.
const PIPE: &str = "pipe a scene into the program, as in `moreau2d run - < FILE` and, if that was stopped, \
                    `moreau2d run --resume DIR < FILE`";

/// Most bytes of a scene file: 100 000 bodies of 80 bytes each. A scene that is read and built takes some
/// hundred times the size of its file.
const MOST_BYTES: u64 = 8 << 20;

/// The text of a scene file.
///
/// # Errors
/// [`SceneError::Read`]; [`SceneError::TooLarge`]; [`SceneError::NoFile`] if the path is the name of a
/// catalogue scene.
pub(super) fn read(path: &Path) -> Result<String, SceneError> {
    let file = std::fs::File::open(path).map_err(|source| unread(path, source))?;
    bounded(file, &path.to_string_lossy())
}

/// The text of standard input. A command may read its scene twice, but standard input only once.
fn standard_input() -> Result<String, SceneError> {
    static TEXT: Mutex<Option<String>> = Mutex::new(None);
    let mut text = TEXT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(text) = &*text {
        return Ok(text.clone());
    }
    let stdin = std::io::stdin();
    if stdin.is_terminal() {
        return Err(SceneError::Read {
            path: STDIN.to_owned(),
            source: std::io::Error::other(format!("it is a terminal: {PIPE}")),
        });
    }
    let read = bounded(stdin.lock(), STDIN)?;
    if read.trim().is_empty() {
        return Err(SceneError::Read {
            path: STDIN.to_owned(),
            source: std::io::Error::other(format!("it is empty: {PIPE}")),
        });
    }
    *text = Some(read.clone());
    Ok(read)
}

/// All of `source`, if it is text and no longer than a scene may be.
fn bounded(source: impl Read, name: &str) -> Result<String, SceneError> {
    let mut text = String::new();
    let read = source.take(MOST_BYTES + 1).read_to_string(&mut text);
    // a text that is cut within a letter is too large as well
    let too_large = text.len() as u64 > MOST_BYTES;
    match read {
        _ if too_large => Err(SceneError::TooLarge {
            path: name.to_owned(),
            most: MOST_BYTES >> 20,
        }),
        Ok(_) => Ok(text),
        Err(source) => Err(SceneError::Read {
            path: name.to_owned(),
            source,
        }),
    }
}

/// Why a file cannot be read. For a missing file such as `tower.toml` or `scenes/tower.toml` the error
/// points to the catalogue scene of that name.
fn unread(path: &Path, source: std::io::Error) -> SceneError {
    let name = path.to_string_lossy().into_owned();
    let stem = path.file_stem().map(|stem| stem.to_string_lossy());
    let hint = Hint::new(
        &stem.unwrap_or_default(),
        EMBEDDED.iter().map(|(name, _)| name),
    );
    let folder = path.parent().unwrap_or(Path::new(""));
    let meant = folder == Path::new("") || folder == Path::new("scenes");
    if source.kind() == std::io::ErrorKind::NotFound && meant && hint.nearest.is_some() {
        return SceneError::NoFile { name, hint };
    }
    SceneError::Read { path: name, source }
}

/// The file name of an embedded scene in errors.
fn file_of(name: &str) -> String {
    format!("scenes/{name}.toml")
}
