use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use tempfile::TempDir;

use super::kept::Kept;
use super::{Checkpoint, ReportError, RunRecord};

/// An output folder that is written completely or not at all.
///
/// Files go to a hidden staging folder on the same file system: inside the target where that
/// exists, else inside its deepest existing ancestor. [`OutputFolder::commit`] moves them into
/// place; dropping the value without it removes every trace and leaves an older output untouched.
///
/// The files of a run that can be resumed go to a folder in the target that everyone can find,
/// [`OutputFolder::keep`]. It stays there from the first [`Checkpoint`] to the commit.
#[derive(Debug)]
pub struct OutputFolder {
    target: PathBuf,
    staging: Staging,
}

/// Where files are until the commit.
#[derive(Debug)]
enum Staging {
    Hidden(TempDir),
    Kept(Kept),
}

/// What a run left in its folder.
pub enum Reopened {
    /// Its results are there.
    Finished,
    /// It was stopped.
    Stopped(Box<OutputFolder>, RunRecord),
}

impl OutputFolder {
    /// Prepares to write to `target`, which need not exist, and neither need its parents.
    ///
    /// Called before a long run, it finds early that the folder cannot be written.
    ///
    /// # Errors
    /// `ReportError::NotAFolder` where a file stands in the way; `ReportError::Io` where the
    /// folder, or the ancestor it would be made in, cannot be written.
    pub fn create(target: impl AsRef<Path>) -> Result<Self, ReportError> {
        let target = target.as_ref().to_path_buf();
        let (host, _) = deepest_existing(&target)?;
        let staging = tempfile::Builder::new()
            .prefix(".moreau2d-")
            .tempdir_in(&host)
            .map_err(|error| ReportError::io(&target)(without_path(error)))?;
        let staging = Staging::Hidden(staging);
        let folder = OutputFolder { target, staging };
        // A folder of our own: the temporary one is closed to other users, the output is not.
        let files = folder.files();
        fs::create_dir(&files).map_err(ReportError::io(&folder.target))?;
        Ok(folder)
    }

    /// As [`OutputFolder::create`], for a `run` that can be stopped and resumed. While another run
    /// writes to the same target this one cannot be resumed.
    ///
    /// # Errors
    /// Those of [`OutputFolder::create`].
    pub fn keep(target: impl AsRef<Path>, run: RunRecord) -> Result<Self, ReportError> {
        let target = target.as_ref().to_path_buf();
        let (host, missing) = deepest_existing(&target)?;
        let mut made = Vec::new();
        for name in missing {
            made.insert(0, made.first().unwrap_or(&host).join(name));
        }
        fs::create_dir_all(&target).map_err(ReportError::io(&target))?;
        match Kept::create(&target, made, run)? {
            Some(kept) => Ok(OutputFolder {
                target,
                staging: Staging::Kept(kept),
            }),
            None => OutputFolder::create(target),
        }
    }

    /// The folder of a run that was stopped. Results that were complete are moved into place.
    ///
    /// # Errors
    /// `ReportError::NothingKept`, `ReportError::Running`, `ReportError::Damaged`,
    /// `ReportError::Io`.
    pub fn reopen(target: impl AsRef<Path>) -> Result<Reopened, ReportError> {
        let target = target.as_ref().to_path_buf();
        fs::metadata(&target).map_err(ReportError::io(&target))?;
        if !target.join(super::kept::KEPT).is_dir() {
            return match target.join("summary.json").exists() {
                true => Ok(Reopened::Finished),
                false => Err(ReportError::NothingKept { path: target }),
            };
        }
        let (kept, run) = Kept::reopen(&target)?;
        // of a move that was cut short: files that the new ones replaced
        let old = kept.path.join("old");
        if old.exists() {
            fs::remove_dir_all(&old).map_err(ReportError::io(&old))?;
        }
        let staging = Staging::Kept(kept);
        let folder = OutputFolder { target, staging };
        match run {
            Some(run) => Ok(Reopened::Stopped(Box::new(folder), run)),
            None => folder.commit().map(|_| Reopened::Finished),
        }
    }

    /// Whether the run in it has a checkpoint.
    pub fn is_saved(&self) -> bool {
        matches!(&self.staging, Staging::Kept(kept) if kept.is_saved())
    }

    /// The checkpoint `name` of a run; `None` if it cannot be resumed.
    ///
    /// # Arguments
    /// - `every`: number of steps between two checkpoints; by the time that they take without.
    pub fn checkpoint(&self, name: &str, every: Option<usize>) -> Option<Checkpoint> {
        match &self.staging {
            Staging::Kept(kept) => Some(Checkpoint::new(&kept.path, name, every)),
            Staging::Hidden(_) => None,
        }
    }

    /// Path of the output after the commit.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Path of the file `name` (a file name without folders) before the commit.
    pub fn path(&self, name: &str) -> PathBuf {
        self.files().join(name)
    }

    /// Path of the file `name` after the commit; errors name this path.
    pub fn place(&self, name: &str) -> PathBuf {
        self.target.join(name)
    }

    /// A folder beside the files for what lasts until the commit alone; that of a run which can be resumed
    /// is there when it goes on.
    ///
    /// # Errors
    /// `ReportError::Io`.
    pub fn scratch(&self, name: &str) -> Result<PathBuf, ReportError> {
        let path = self.staging().join(name);
        fs::create_dir_all(&path).map_err(ReportError::io(&self.target))?;
        Ok(path)
    }

    /// Whether a folder is, or could be made, at `target`.
    ///
    /// # Errors
    /// `ReportError::NotAFolder` where a file stands in the way; `ReportError::Io`.
    pub fn check(target: &Path) -> Result<(), ReportError> {
        deepest_existing(target).map(drop)
    }

    /// Writes a small file in one go.
    ///
    /// # Errors
    /// `ReportError::Io`.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> Result<(), ReportError> {
        fs::write(self.path(name), content).map_err(ReportError::io(&self.place(name)))
    }

    /// Moves every file into place and returns the target.
    ///
    /// A target that does not exist appears in one rename. In one that exists, files of the same
    /// names are replaced and others left alone; if a move fails, those before it are undone.
    ///
    /// # Errors
    /// `ReportError::Io`, `ReportError::NotAFolder`; `ReportError::IsAFolder` where a folder has
    /// the name of a file. The target is then as it was.
    pub fn commit(self) -> Result<PathBuf, ReportError> {
        if let Staging::Kept(kept) = &self.staging {
            kept.set_done(true)?;
            if let Err(error) = self.place_files() {
                kept.set_done(false)?;
                return Err(error);
            }
            if let Staging::Kept(kept) = self.staging {
                kept.remove();
            }
            return Ok(self.target);
        }
        // Looked up again: another run may have made the folder in the meantime.
        let (host, missing) = deepest_existing(&self.target)?;
        match missing.split_first() {
            Some((first, rest)) => self.place_folder(&host.join(first), rest)?,
            None => self.place_files()?,
        }
        Ok(self.target)
    }

    fn staging(&self) -> &Path {
        match &self.staging {
            Staging::Hidden(folder) => folder.path(),
            Staging::Kept(kept) => &kept.path,
        }
    }

    fn files(&self) -> PathBuf {
        self.staging().join("files")
    }

    /// Wraps the files in the folders `rest` and renames the outermost to `place`.
    fn place_folder(&self, place: &Path, rest: &[OsString]) -> Result<(), ReportError> {
        let mut outermost = self.files();
        if let Some((last, between)) = rest.split_last() {
            outermost = self.staging().join("tree");
            let parent = between.iter().fold(outermost.clone(), |p, c| p.join(c));
            fs::create_dir_all(&parent)
                .and_then(|()| fs::rename(self.files(), parent.join(last)))
                .map_err(ReportError::io(&self.target))?;
        }
        fs::rename(outermost, place).map_err(ReportError::io(place))
    }

    fn place_files(&self) -> Result<(), ReportError> {
        let new = self.files();
        let old = self.staging().join("old");
        let io = || ReportError::io(&self.target);
        fs::create_dir(&old).map_err(io())?;
        let mut names = Vec::new();
        for entry in fs::read_dir(&new).map_err(io())? {
            names.push(entry.map_err(io())?.file_name());
        }
        names.sort();
        for name in &names {
            let path = self.target.join(name);
            if path.is_dir() {
                return Err(ReportError::IsAFolder { path });
            }
        }
        for (moved, name) in names.iter().enumerate() {
            let place = self.target.join(name);
            let step = absent_is_fine(fs::rename(&place, old.join(name)))
                .and_then(|()| fs::rename(new.join(name), &place));
            if let Err(source) = step {
                for name in &names[..=moved] {
                    let place = self.target.join(name);
                    // Best effort: the error reported is the one that started this.
                    let back = if new.join(name).exists() {
                        Ok(())
                    } else {
                        fs::rename(&place, new.join(name))
                    };
                    let _ = back.and_then(|()| fs::rename(old.join(name), &place));
                }
                return Err(ReportError::Io {
                    path: place,
                    source,
                });
            }
        }
        Ok(())
    }
}

/// Errors of `tempfile` name its temporary folder, which the user does not know.
fn without_path(error: io::Error) -> io::Error {
    let text = error.to_string();
    match text.split_once(" at path ") {
        Some((what, _)) => io::Error::new(error.kind(), what),
        None => error,
    }
}

fn absent_is_fine(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        other => other,
    }
}

/// The deepest folder on the way to `target` that exists, and the names missing below it.
fn deepest_existing(target: &Path) -> Result<(PathBuf, Vec<OsString>), ReportError> {
    let mut missing = Vec::new();
    let mut path = target;
    loop {
        // The parent of a relative path of one part is the empty path.
        let here = if path.as_os_str().is_empty() {
            Path::new(".")
        } else {
            path
        };
        match fs::metadata(here) {
            Ok(found) if found.is_dir() => {
                missing.reverse();
                return Ok((here.to_path_buf(), missing));
            }
            Ok(_) => {
                return Err(ReportError::NotAFolder {
                    path: here.to_path_buf(),
                });
            }
            // A broken link exists here, but no folder can be made in its place. What else is
            // found now was made by another process in this very moment.
            Err(source)
                if !matches!(
                    source.kind(),
                    io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
                ) || fs::symlink_metadata(here).is_ok_and(|found| found.is_symlink()) =>
            {
                return Err(ReportError::Io {
                    path: here.to_path_buf(),
                    source,
                });
            }
            Err(source) => match (path.components().next_back(), path.parent()) {
                (Some(Component::Normal(name)), Some(parent)) => {
                    missing.push(name.to_os_string());
                    path = parent;
                }
                _ => {
                    return Err(ReportError::Io {
                        path: here.to_path_buf(),
                        source,
                    });
                }
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listing(path: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(path)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn commit_makes_missing_parents_and_leaves_no_staging() {
        let root = tempfile::tempdir().unwrap();
        for depth in ["a", "b/c", "d/e/f"] {
            let target = root.path().join(depth);
            let folder = OutputFolder::create(&target).unwrap();
            folder.write("steps.csv", "time_s\n").unwrap();
            assert!(!target.exists(), "nothing shows before the commit");
            assert_eq!(folder.commit().unwrap(), target);
            assert_eq!(listing(&target), ["steps.csv"]);
        }
        assert_eq!(listing(root.path()), ["a", "b", "d"]);
    }

    #[test]
    fn commit_replaces_same_names_and_keeps_others() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("steps.csv"), "old").unwrap();
        fs::write(root.path().join("notes.txt"), "mine").unwrap();
        let folder = OutputFolder::create(root.path()).unwrap();
        folder.write("steps.csv", "new").unwrap();
        folder.write("bodies.csv", "new").unwrap();
        folder.commit().unwrap();
        assert_eq!(
            listing(root.path()),
            ["bodies.csv", "notes.txt", "steps.csv"]
        );
        let read = |name| fs::read_to_string(root.path().join(name)).unwrap();
        assert_eq!(read("steps.csv"), "new");
        assert_eq!(read("notes.txt"), "mine");
    }

    #[test]
    fn drop_without_commit_leaves_nothing_and_touches_nothing() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("steps.csv"), "old").unwrap();
        for target in [root.path().to_path_buf(), root.path().join("new/deep")] {
            let folder = OutputFolder::create(target).unwrap();
            folder.write("steps.csv", "half").unwrap();
            drop(folder);
            assert_eq!(listing(root.path()), ["steps.csv"]);
        }
        assert_eq!(
            fs::read_to_string(root.path().join("steps.csv")).unwrap(),
            "old"
        );
    }

    #[test]
    fn a_failed_commit_restores_what_was_there() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("a.csv"), "old").unwrap();
        fs::create_dir(root.path().join("b.csv")).unwrap();
        let folder = OutputFolder::create(root.path()).unwrap();
        folder.write("a.csv", "new").unwrap();
        folder.write("b.csv", "new").unwrap();
        let error = folder.commit().unwrap_err();
        assert!(matches!(error, ReportError::IsAFolder { .. }), "{error}");
        assert_eq!(
            fs::read_to_string(root.path().join("a.csv")).unwrap(),
            "old"
        );
        assert_eq!(listing(root.path()), ["a.csv", "b.csv"]);
    }

    #[test]
    fn a_file_in_the_way_is_named_before_the_run() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("file.txt");
        fs::write(&file, "").unwrap();
        for target in [file.clone(), file.join("out"), file.join("out/deep")] {
            match OutputFolder::create(&target) {
                Err(ReportError::NotAFolder { path }) => assert_eq!(path, file),
                other => panic!("{target:?}: {other:?}"),
            }
        }
    }

    /// Permission bits do not stop a superuser; the kernel's own file system does.
    #[cfg(target_os = "linux")]
    #[test]
    fn an_unwritable_parent_is_named_before_the_run() {
        let error = OutputFolder::create("/proc/moreau2d/out").unwrap_err();
        assert!(matches!(error, ReportError::Io { .. }));
        assert!(
            error.to_string().starts_with("/proc/moreau2d/out: "),
            "{error}"
        );
        // and nothing of the folder that was to be written first
        assert!(!error.to_string().contains(".moreau2d-"), "{error}");
    }

    /// Files are written elsewhere first; errors name where they were to stand.
    #[test]
    fn errors_name_the_folder_of_the_user() {
        let root = tempfile::tempdir().unwrap();
        let folder = OutputFolder::create(root.path().join("mine")).unwrap();
        fs::remove_dir_all(folder.files()).unwrap();
        let rows: &[crate::report::PointRow] = &[];
        for error in [
            folder.write("steps.csv", "time_s\n").unwrap_err(),
            crate::report::write_rows(&folder, rows).unwrap_err(),
            crate::report::written_rows::<crate::report::PointRow>(&folder).unwrap_err(),
        ] {
            let text = error.to_string();
            assert!(
                text.contains("mine/") && !text.contains(".moreau2d-"),
                "{text}"
            );
        }
    }
}
