//! The folder of a run that can be stopped and resumed.

use super::ReportError;
use crate::checkpoint::{Reader, Writer};
use crate::scene::fnv1a;
use serde::{Deserialize, Serialize};
use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Name of the folder within the folder of the results.
pub const KEPT: &str = "moreau2d-checkpoint";
/// What the run is.
const RECORD: &str = "run.json";
/// Locked as long as the run goes on; the system unlocks it however the program ends.
const LOCK: &str = "lock";
/// Stands there once all results are complete and are being moved into place.
const DONE: &str = "done";
const STATE: &str = "state";
/// Version of the content of these files.
const FORMAT: u32 = 6;
/// Time between two checkpoints: at least this, and [`SHARE`] times what the last one took. What a run
/// computes does not depend on when it saves: the first bounds what is lost, the second what it costs.
const LEAST: Duration = Duration::from_secs(1);
/// A checkpoint takes at most 1/50 of the run.
const SHARE: u32 = 50;

/// The run that a checkpoint belongs to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunRecord {
    pub version: String,
    /// Hash of the resolved scene.
    pub scene_hash: String,
    /// As typed, without the program.
    pub arguments: Vec<String>,
}

#[derive(Serialize, Deserialize)]
struct Record {
    format: u32,
    #[serde(flatten)]
    run: RunRecord,
}

/// The folder in which the files of a run grow and its checkpoints lie.
#[derive(Debug)]
pub(super) struct Kept {
    pub path: PathBuf,
    _lock: File,
    /// Folders that were made for it, the deepest first; `None` if it was there before.
    made: Option<Vec<PathBuf>>,
}

impl Kept {
    /// A new one in `target`; that of an earlier run which is not running any more goes.
    ///
    /// # Arguments
    /// - `made`: folders above it that were made for it, the deepest first.
    ///
    /// # Returns
    /// `None` while another run writes to the folder.
    pub fn create(
        target: &Path,
        made: Vec<PathBuf>,
        run: RunRecord,
    ) -> Result<Option<Kept>, ReportError> {
        let path = target.join(KEPT);
        let io = || ReportError::io(target);
        if path.exists() {
            let Some(lock) = lock(&path).map_err(io())? else {
                return Ok(None);
            };
            fs::remove_dir_all(&path).map_err(ReportError::io(&path))?;
            drop(lock);
        }
        // another run may have made it just now: the lock decides
        match fs::create_dir(&path) {
            Err(error) if error.kind() != io::ErrorKind::AlreadyExists => Err(error),
            _ => Ok(()),
        }
        .map_err(io())?;
        let Some(lock) = lock(&path).map_err(io())? else {
            return Ok(None);
        };
        let kept = Kept {
            path,
            _lock: lock,
            made: Some(made),
        };
        fs::create_dir(kept.path.join("files")).map_err(io())?;
        let record = Record {
            format: FORMAT,
            run,
        };
        let text = serde_json::to_string_pretty(&record).unwrap_or_default() + "\n";
        replace(&kept.path.join(RECORD), &[text.as_bytes()])?;
        Ok(Some(kept))
    }

    /// The one that a stopped run left in `target`, and what it was; without a record if its results
    /// were complete and only had to be moved.
    ///
    /// # Errors
    /// [`ReportError::Running`], [`ReportError::Damaged`], [`ReportError::Io`].
    pub fn reopen(target: &Path) -> Result<(Kept, Option<RunRecord>), ReportError> {
        let path = target.join(KEPT);
        let Some(lock) = lock(&path).map_err(ReportError::io(&path))? else {
            return Err(ReportError::Running {
                path: target.to_path_buf(),
            });
        };
        let kept = Kept {
            path,
            _lock: lock,
            made: None,
        };
        if kept.path.join(DONE).exists() {
            return Ok((kept, None));
        }
        let place = kept.path.join(RECORD);
        let text = fs::read(&place).map_err(|error| match error.kind() {
            // stopped before it began
            io::ErrorKind::NotFound => ReportError::NothingKept {
                path: target.to_path_buf(),
            },
            _ => ReportError::io(&place)(error),
        })?;
        let damaged = |reason: String| ReportError::Damaged {
            path: place.clone(),
            reason,
        };
        let found: serde_json::Value =
            serde_json::from_slice(&text).map_err(|e| damaged(e.to_string()))?;
        if found["format"] != FORMAT {
            return Err(damaged(format!(
                "it has format {}, this program reads {FORMAT}",
                found["format"]
            )));
        }
        let record: RunRecord =
            serde_json::from_value(found).map_err(|e| damaged(e.to_string()))?;
        for file in kept.states()? {
            content(&file)?;
        }
        Ok((kept, Some(record)))
    }

    /// Whether it has a checkpoint.
    pub fn is_saved(&self) -> bool {
        self.states().is_ok_and(|states| !states.is_empty())
    }

    /// Its checkpoints.
    fn states(&self) -> Result<Vec<PathBuf>, ReportError> {
        let io = || ReportError::io(&self.path);
        let mut found = Vec::new();
        for entry in fs::read_dir(&self.path).map_err(io())? {
            let path = entry.map_err(io())?.path();
            if path.extension().is_some_and(|end| end == STATE) {
                found.push(path);
            }
        }
        found.sort();
        Ok(found)
    }

    /// Notes that the results are complete, or takes the note back. What is noted is on the disk.
    pub fn set_done(&self, done: bool) -> Result<(), ReportError> {
        let path = self.path.join(DONE);
        if done {
            let files = self.path.join("files");
            for entry in fs::read_dir(&files).map_err(ReportError::io(&files))? {
                let file = entry.map_err(ReportError::io(&files))?.path();
                let synced = File::open(&file).and_then(|file| file.sync_data());
                synced.map_err(ReportError::io(&file))?;
            }
        }
        match done {
            true => fs::write(&path, ""),
            false => fs::remove_file(&path),
        }
        .map_err(ReportError::io(&path))
    }

    /// Removes it after its files have gone to their place.
    pub fn remove(self) {
        // in one step, so that no half of it is ever found
        let gone = self.path.with_file_name(".moreau2d-gone");
        let _ = fs::remove_dir_all(&gone);
        let _ = fs::rename(&self.path, &gone);
        let _ = fs::remove_dir_all(&gone);
    }
}

impl Drop for Kept {
    /// A run that fails before its first checkpoint leaves nothing behind.
    fn drop(&mut self) {
        let Some(made) = &self.made else {
            return;
        };
        let left = self.path.join(DONE).exists() || self.is_saved();
        if left || !self.path.exists() {
            return;
        }
        // best effort: there is an error to be told already
        let _ = fs::remove_dir_all(&self.path);
        for folder in made {
            let _ = fs::remove_dir(folder);
        }
    }
}

/// The lock of a folder, unless another program has it.
fn lock(folder: &Path) -> io::Result<Option<File>> {
    let file = File::create(folder.join(LOCK))?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Ok(None),
        // a file system without locks
        Ok(()) | Err(TryLockError::Error(_)) => Ok(Some(file)),
    }
}

/// Writes a file whole, in place of an older one.
fn replace(path: &Path, parts: &[&[u8]]) -> Result<(), ReportError> {
    let part = path.with_extension("part");
    let write = || -> io::Result<()> {
        let mut file = File::create(&part)?;
        for bytes in parts {
            file.write_all(bytes)?;
        }
        // its content is there before its name is, also if the machine stops
        file.sync_data()?;
        fs::rename(&part, path)
    };
    write().map_err(ReportError::io(path))
}

/// The values in a checkpoint file, whose first line says how many bytes they have and their FNV-1a.
fn content(path: &Path) -> Result<Vec<u8>, ReportError> {
    let mut bytes = fs::read(path).map_err(ReportError::io(path))?;
    let damaged = |reason: &str| ReportError::Damaged {
        path: path.to_path_buf(),
        reason: reason.to_owned(),
    };
    let end = bytes.iter().position(|b| *b == b'\n');
    let end = end.ok_or_else(|| damaged("its first line is not complete"))?;
    let body = bytes.split_off(end + 1);
    match bytes == header(&body).as_bytes() {
        true => Ok(body),
        false => Err(damaged("its content is not that of its first line")),
    }
}

fn header(body: &[u8]) -> String {
    format!(
        "moreau2d checkpoint {FORMAT}: {} bytes, fnv1a {:016x}\n",
        body.len(),
        fnv1a(body)
    )
}

/// A file with the state of a run, replaced whole again and again.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    every: Option<usize>,
    began: Instant,
    next: Instant,
}

impl Checkpoint {
    /// # Arguments
    /// - `every`: number of steps between two checkpoints; by the time they take without.
    pub(super) fn new(folder: &Path, name: &str, every: Option<usize>) -> Checkpoint {
        let now = Instant::now();
        Checkpoint {
            path: folder.join(name).with_extension(STATE),
            every,
            began: now,
            next: now + LEAST,
        }
    }

    /// What was saved last; `None` before the first time.
    ///
    /// # Errors
    /// [`ReportError::Damaged`], [`ReportError::Io`].
    pub fn load(&self) -> Result<Option<Reader>, ReportError> {
        match self.path.exists() {
            true => Ok(Some(Reader::new(content(&self.path)?))),
            false => Ok(None),
        }
    }

    /// Whether there is anything to load.
    pub fn is_saved(&self) -> bool {
        self.path.exists()
    }

    /// Whether to save after step number `step`.
    pub fn is_due(&mut self, step: usize) -> bool {
        self.began = Instant::now();
        match self.every {
            Some(every) => step.is_multiple_of(every),
            None => self.began >= self.next,
        }
    }

    /// Saves, after [`Checkpoint::is_due`] where there are many occasions.
    ///
    /// # Errors
    /// [`ReportError::Io`]; what was saved last is then still there.
    pub fn save(&mut self, state: &Writer) -> Result<(), ReportError> {
        let body = state.bytes();
        replace(&self.path, &[header(body).as_bytes(), body])?;
        let now = Instant::now();
        self.next = now + LEAST.max((now - self.began) * SHARE);
        Ok(())
    }
}
