//! The contact problems of `bench --solvers`: of a folder, or of scenes of the catalogue.

use crate::experiment::{Engine, NamedProblem, RunError};
use crate::problems::{StoredProblem, read};
use crate::report::ReportError;
use crate::scene;
use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};

/// The problems that are stored with the sources.
pub(super) const OF_SOURCES: &str = "tests/data/problems";
/// What is said of the problems where there is no folder.
pub(super) const OF_CATALOGUE: &str = "of the catalogue";
/// Scenes of all kinds, and steps whose problems are taken.
const SCENES: [(&str, &[usize]); 10] = [
    ("beam", &[1, 15]),
    ("wedge", &[1, 40]),
    ("arch", &[1]),
    ("capstan", &[1, 3]),
    ("cradle", &[30]),
    ("tower", &[1]),
    ("card-house", &[2, 6]),
    ("hit-heap", &[60]),
    ("chain", &[1, 200]),
    ("drum", &[300]),
];
/// Most problems of a step: the largest.
const OF_A_STEP: usize = 4;

/// Problems of the first steps of scenes of the catalogue, the same each time, and a note about them.
pub(super) fn of_catalogue() -> Result<(Vec<NamedProblem>, Vec<String>), RunError> {
    let mut problems = Vec::new();
    for (name, steps) in SCENES {
        let mut built = scene::load(name, &[])?.build()?;
        built.keep_problems(true);
        let last = steps.iter().copied().max().unwrap_or(0);
        for step in 1..=last {
            Engine::Moreau.timed_step(&mut built)?;
            if !steps.contains(&step) {
                continue;
            }
            let mut of_step: Vec<_> = built.problems().iter().map(|p| &p.problem).collect();
            of_step.sort_by_key(|problem| std::cmp::Reverse(problem.len()));
            for (k, problem) in of_step.into_iter().take(OF_A_STEP).enumerate() {
                problems.push(NamedProblem {
                    name: format!("{name}-step{step}-{}", k + 1),
                    problem: problem.clone(),
                });
            }
        }
    }
    let note = format!(
        "{OF_SOURCES} is not here: the {} problems are of steps of the catalogue's scenes; --problems DIR takes those \
         of a folder, which `run SCENE --dump-problems DIR` writes",
        problems.len()
    );
    Ok((problems, vec![note]))
}

/// The contact problems of a folder, sorted by name, and notes about them.
///
/// A problem is named after its file, without the extension if that name is unique in the folder.
pub(super) fn collection(folder: &Path) -> Result<(Vec<NamedProblem>, Vec<String>), RunError> {
    let unfit = |what: &str| {
        RunError::Unfit(format!(
            "--problems {}: {what}; give a folder of contact problems (.json or .dat), as `run \
             SCENE --dump-problems DIR` writes them",
            folder.display()
        ))
    };
    let files = problem_files(folder).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => unfit("no such folder"),
        io::ErrorKind::NotADirectory => unfit("not a folder"),
        _ => unreadable(folder)(error).into(),
    })?;
    let stem = |path: &PathBuf| path.file_stem().map(|s| s.to_string_lossy().into_owned());
    let mut stems: HashMap<Option<String>, usize> = HashMap::new();
    for path in &files {
        *stems.entry(stem(path)).or_default() += 1;
    }
    let mut problems = Vec::new();
    let mut notes = Vec::new();
    let mut lcps = 0;
    for path in &files {
        let bytes = std::fs::read(path).map_err(unreadable(path))?;
        let loaded = read(&bytes).map_err(|source| RunError::Problem {
            path: path.clone(),
            source,
        })?;
        let StoredProblem::Contact { problem, .. } = loaded.problem else {
            lcps += 1;
            continue;
        };
        let alone = stem(path).filter(|s| stems.get(&Some(s.clone())) == Some(&1));
        let full = path.file_name().map(|name| name.to_string_lossy());
        let name = alone.unwrap_or_else(|| full.unwrap_or_default().into_owned());
        let warned = loaded.warnings.iter();
        notes.extend(warned.map(|warning| format!("{name}: {warning}")));
        problems.push(NamedProblem { name, problem });
    }
    if problems.is_empty() {
        return Err(unfit(match lcps {
            0 => "no problem files",
            _ => "holds plain LCPs only, which only lemke solves",
        }));
    }
    if lcps > 0 {
        notes.push(format!(
            "{lcps} plain LCPs left out: only lemke solves them"
        ));
    }
    Ok((problems, notes))
}

/// Files with the extension of a problem file, sorted; without those of subfolders.
fn problem_files(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let extension = path.extension().map(|e| e.to_ascii_lowercase());
        if extension.is_some_and(|e| e == "json" || e == "dat") && path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

fn unreadable(path: &Path) -> impl FnOnce(io::Error) -> ReportError + '_ {
    move |source| ReportError::Io {
        path: path.to_path_buf(),
        source,
    }
}
