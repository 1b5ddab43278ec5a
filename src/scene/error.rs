//! Errors of a scene. They name file, line, key, value, range and nearest name.

use std::fmt;
use thiserror::Error;

/// Where a value was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// Line and column in the file, both from 1; columns count characters.
    Line { line: usize, column: usize },
    /// A change made to the file, `key=value`.
    Flag(String),
    /// A change that was typed as another flag than `--set key=value`: the flag as typed.
    Typed(String),
}

/// The place of a value: file, line or flag, and the dotted path of keys.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    pub file: String,
    pub origin: Origin,
    /// For example `body.ball.position.0`; empty at the top of the file.
    pub path: String,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.origin {
            Origin::Line { line, column } => write!(f, "{}:{line}:{column}", self.file)?,
            Origin::Flag(flag) => write!(f, "{} with --set {flag}", self.file)?,
            Origin::Typed(words) => write!(f, "{} with {words}", self.file)?,
        }
        if !self.path.is_empty() {
            write!(f, ": {}", self.path)?;
        }
        Ok(())
    }
}

/// The known names nearest to an unknown one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Hint {
    /// The nearest known name, if it is near enough.
    pub nearest: Option<String>,
    pub known: Vec<String>,
}

impl Hint {
    /// Ranks `known` by Jaro-Winkler similarity to `name`.
    ///
    /// A name is near enough from a similarity of 0.7 on: a word of three letters with one wrong
    /// letter reaches it (0.78), two unrelated words of the schema rarely do.
    pub fn new<S: AsRef<str>>(name: &str, known: impl IntoIterator<Item = S>) -> Self {
        let known: Vec<String> = known.into_iter().map(|k| k.as_ref().to_owned()).collect();
        let nearest = known
            .iter()
            .map(|k| (strsim::jaro_winkler(name, k), k))
            .filter(|(similarity, _)| *similarity >= 0.7)
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, k)| k.clone());
        Hint { nearest, known }
    }

    /// One known name.
    pub fn of(name: &str) -> Self {
        Hint {
            nearest: Some(name.to_owned()),
            known: vec![name.to_owned()],
        }
    }
}

impl fmt::Display for Hint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const SHOWN: usize = 30;
        if let Some(nearest) = &self.nearest {
            return write!(f, "; did you mean `{nearest}`?");
        }
        if self.known.is_empty() {
            return write!(f, "; there are none");
        }
        let more = if self.known.len() > SHOWN {
            ", ..."
        } else {
            ""
        };
        let shown = &self.known[..self.known.len().min(SHOWN)];
        write!(f, "; known: {}{more}", shown.join(", "))
    }
}

/// Why a scene cannot be used. Every variant with a [`Place`] names file, line (or flag) and path of
/// keys.
#[derive(Debug, Error)]
pub enum SceneError {
    /// Neither a name of the catalogue nor a file.
    #[error("unknown scene `{name}`{hint}")]
    UnknownScene { name: String, hint: Hint },
    /// There is no such file, but a scene of the catalogue is called so.
    #[error("{name}: no such file{hint} Scenes of the catalogue go without .toml")]
    NoFile { name: String, hint: Hint },
    /// The file cannot be read, or is not UTF-8.
    #[error("{path}: cannot read the scene: {source}")]
    Read {
        path: String,
        source: std::io::Error,
    },
    /// The file is larger than a scene may be; nothing of it is parsed.
    #[error(
        "{path}: larger than {most} MiB, the most that a scene may have; write bodies that repeat as [[repeat]]"
    )]
    TooLarge { path: String, most: u64 },
    /// The file is not TOML.
    #[error("{at}: malformed TOML: {problem}")]
    Syntax { at: Box<Place>, problem: String },
    /// A key that the schema does not have.
    #[error("{at}: unknown key `{key}`{hint}")]
    UnknownKey {
        at: Box<Place>,
        key: String,
        hint: Hint,
    },
    /// A value of another type than the key's.
    #[error("{at}: expected {expected}, found {found}")]
    WrongType {
        at: Box<Place>,
        expected: String,
        found: String,
    },
    /// A key without which the scene says nothing.
    #[error("{at}: missing key `{key}`")]
    Missing { at: Box<Place>, key: String },
    /// A number outside its range, NaN and infinity included.
    #[error("{at} = {value}: allowed is {allowed}")]
    OutOfRange {
        at: Box<Place>,
        value: String,
        allowed: String,
    },
    /// A word or a reference (material, body, scheme, solver, ...) that names nothing.
    #[error("{at}: unknown {what} `{name}`{hint}")]
    UnknownName {
        at: Box<Place>,
        what: String,
        name: String,
        hint: Hint,
    },
    /// Two things of one kind share a name.
    #[error("{at}: there is already a {what} named `{name}`")]
    Duplicate {
        at: Box<Place>,
        what: &'static str,
        name: String,
    },
    /// An outline that encloses nothing, crosses itself, is not convex or is wound the wrong way.
    #[error("{at}: {problem}")]
    Outline { at: Box<Place>, problem: String },
    /// Keys that contradict each other, or that would have no effect.
    #[error("{at}: {problem}")]
    Conflict { at: Box<Place>, problem: String },
    /// Known to the field, not to this version.
    #[error("{at}: {what} is not supported yet; supported: {supported}")]
    Unsupported {
        at: Box<Place>,
        what: String,
        supported: &'static str,
    },
    /// A scene in which nothing can happen.
    #[error(
        "{file}: the scene has no bodies: give at least one [[body]], a [linear], a [study] or a [thresher]"
    )]
    NoBodies { file: String },
    /// A `--set` argument that is not `key=value`.
    #[error("--set {flag}: expected key=value, for example step.dt=0.01")]
    FlagForm { flag: String },
    /// A bare key that several blocks have.
    #[error("--set {flag}: `{key}` could be any of {}; write the whole path", .paths.join(", "))]
    AmbiguousKey {
        flag: String,
        key: String,
        paths: Vec<String>,
    },
}

impl SceneError {
    /// The same error of a change `flag` (`key=value`) that a file makes at `place`.
    pub fn placed(mut self, flag: &str, place: &Place) -> SceneError {
        match &mut self {
            SceneError::AmbiguousKey { flag: own, .. } | SceneError::FlagForm { flag: own }
                if own == flag =>
            {
                let problem = match &self {
                    SceneError::AmbiguousKey { paths, .. } => {
                        let paths = paths.join(", ");
                        format!("could be any of {paths}; write the whole path")
                    }
                    _ => "is no key of a scene".to_owned(),
                };
                let at = Box::new(place.clone());
                return SceneError::Conflict { at, problem };
            }
            other => {
                if let Some(at) = other.at_mut()
                    && at.origin == Origin::Flag(flag.to_owned())
                {
                    at.file.clone_from(&place.file);
                    at.origin.clone_from(&place.origin);
                }
            }
        }
        self
    }

    /// The same error of a change `flag` (`key=value`) that the user typed as `words`.
    pub fn typed(mut self, flag: &str, words: &str) -> SceneError {
        if let Some(at) = self.at_mut()
            && at.origin == Origin::Flag(flag.to_owned())
        {
            at.origin = Origin::Typed(words.to_owned());
        }
        self
    }

    /// The place of the fault, of a variant that has one.
    fn at_mut(&mut self) -> Option<&mut Place> {
        match self {
            SceneError::Syntax { at, .. }
            | SceneError::UnknownKey { at, .. }
            | SceneError::WrongType { at, .. }
            | SceneError::Missing { at, .. }
            | SceneError::OutOfRange { at, .. }
            | SceneError::UnknownName { at, .. }
            | SceneError::Duplicate { at, .. }
            | SceneError::Outline { at, .. }
            | SceneError::Conflict { at, .. }
            | SceneError::Unsupported { at, .. } => Some(at),
            _ => None,
        }
    }
}
