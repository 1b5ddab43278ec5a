//! The failure atlas: scenes in which methods fail, each as a ladder of rungs of growing difficulty.
//! Entries are files of `scenes/atlas/`.
//!
//! [`Atlas::run`] runs every rung of every entry with every engine and returns rows of `results.csv`.
//! Each engine has one preset, which is not tuned to scenes. Table and picture are made from that file
//! alone.
//!
//! # How to read it
//! A rung is judged by measures of the run (a row each: `value`, and in `reference` the most that
//! it may be), the same for every engine. `pass`: all measures are within their limits. `fail`: one is
//! not; `mode` names the failure of the first. `unsolved`: all are, but our solver did not solve some
//! island in some step. A blank verdict is a rung that an engine cannot represent (`cannot`) or that
//! needs a feature that is not built in (`skipped`); a note says which. Peers certify nothing and are
//! judged by their motion alone.
//!
//! Lengths are relative to the bodies, most of 1 m. Limits are of two kinds: those of the definition
//! (penetration 1e-4 of a box, lean 1e-3, ...), and 1e-6 m or more where the definition says zero,
//! because single precision resolves no less.
//!
//! [`crate::scene::atlas`] says how to add an entry or a rung.

mod forces;
mod measures;
mod preset;
mod resumed;
mod trace;
mod verdict;

pub use preset::Preset;

use super::simulate::{Engine, RunError};
use crate::report::{Progress, ResultRow, number};
use crate::scene::atlas::AtlasRung;
use crate::scene::{AtlasEntry, Hint, Scene, SceneError, atlas_entries, issue_entries};
use measures::Ask;
use trace::Trace;
use verdict::{Check, Finding, Verdict};

/// Measures of a machine, by name, and its number of unsolved islands.
pub struct MachineFigures {
    pub values: Vec<(&'static str, f64)>,
    pub unsolved: usize,
}

/// Runs the machine of a rung.
pub type MachineRun = Box<dyn Fn() -> Result<MachineFigures, RunError>>;

/// Reads the scene of a rung, and its machine if it has one. This folder may not use machines, so the
/// caller passes the function that reads them: [`crate::thresher::read_rung`].
pub type ReadRung = fn(&AtlasEntry, &AtlasRung) -> Result<(Scene, Option<MachineRun>), SceneError>;

/// A rung to be run.
struct Task {
    /// Index into the entries.
    entry: usize,
    rung: AtlasRung,
    scene: Scene,
    machine: Option<MachineRun>,
}

impl Task {
    fn run(&self, entry: &AtlasEntry, preset: &Preset) -> Result<Finding, RunError> {
        if self.rung.double && crate::rapier::PRECISION != "f64" {
            let reason = "needs feature `f64`: build with --features f64".to_owned();
            return Ok(Finding::unavailable("skipped", reason));
        }
        if let (Some(why), false) = (&self.rung.only_ours, preset.engine == Engine::Moreau) {
            return Ok(Finding::unavailable("cannot", why.clone()));
        }
        self.judged(entry, preset).or_else(Finding::stopped)
    }

    /// Steps the scene, or runs its machine, and judges the result.
    fn judged(&self, entry: &AtlasEntry, preset: &Preset) -> Result<Finding, RunError> {
        let judge = entry.judge(&self.rung);
        let asks = self.asks(entry)?;
        if let Some(run) = &self.machine {
            let figures = run()?;
            let checks = asks.iter().map(|ask| ask.of_machine(&figures)).collect();
            let unsolved = Some(figures.unsolved);
            return Ok(Finding::judged(checks, judge.mode(), true, unsolved));
        }
        let scene = preset.scene(&self.scene);
        let trace = Trace::with(&scene, preset.engine, preset.baseline.as_ref())?;
        let checks = asks.iter().filter_map(|ask| ask.of_run(&trace)).collect();
        let mut finding = Finding::of(&trace, checks, judge.mode());
        if entry.block.issue.is_some() {
            finding.checks.push(Check::said(trace.said()));
        }
        Ok(finding)
    }

    /// The checks of the rung, their measures found.
    fn asks<'a>(&'a self, entry: &'a AtlasEntry) -> Result<Vec<Ask<'a>>, RunError> {
        let checks = entry.judge(&self.rung).checks.iter();
        let asks = checks.map(|check| Ask::new(check, &self.rung, &self.scene));
        let named = |error: RunError| RunError::Unfit(format!("atlas/{}: {error}", entry.name));
        asks.collect::<Result<_, _>>().map_err(named)
    }

    fn rows(&self, entry: &AtlasEntry, preset: &Preset, finding: &Finding) -> Vec<ResultRow> {
        let row = |measure: &str, value: f64, unit: &str, reference: String| ResultRow {
            scene: entry.name.to_owned(),
            rung: self.rung.name.clone(),
            measure: measure.to_owned(),
            value,
            unit: unit.to_owned(),
            reference,
            seconds_per_simulated_second: finding.cost,
            verdict: finding.verdict.word().to_owned(),
            mode: finding.mode.clone(),
            ..preset.row(&self.scene)
        };
        if finding.checks.is_empty() {
            return vec![row("verdict", f64::NAN, "", String::new())];
        }
        let checks = finding.checks.iter();
        let at_most = |limit: f64| format!("at most {}", number(limit, 3));
        checks
            .map(|c| row(&c.measure, c.value, &c.unit, at_most(c.limit)))
            .collect()
    }
}

/// Rungs to be run.
pub struct Atlas {
    entries: Vec<AtlasEntry>,
    plan: Vec<Task>,
}

/// Results of an atlas.
#[derive(Debug, Clone, Default)]
pub struct AtlasResults {
    /// In the order of entries, rungs, engines, measures.
    pub rows: Vec<ResultRow>,
    /// Why rungs have no verdict or runs ended early.
    pub notes: Vec<String>,
}

impl Atlas {
    /// The rungs of the entries `names`, or of all entries if `names` is empty. A name that ends in
    /// `.toml` is the path of a file.
    ///
    /// # Arguments
    /// - `quick`: the cheap rungs only.
    /// - `read`: reads the scene of a rung.
    ///
    /// # Errors
    /// [`RunError::Unfit`] for an unknown entry, with the nearest, or for a check that measures
    /// nothing; [`RunError::Scene`] if an entry or a scene of it is broken.
    pub fn new(names: &[String], quick: bool, read: ReadRung) -> Result<Atlas, RunError> {
        Atlas::of(atlas_entries()?, names, quick, read)
    }

    /// The complaints `names`, or all of them if `names` is empty.
    ///
    /// # Errors
    /// Those of [`Atlas::new`].
    pub fn issues(names: &[String], read: ReadRung) -> Result<Atlas, RunError> {
        Atlas::of(issue_entries()?, names, false, read)
    }

    fn of(
        mut entries: Vec<AtlasEntry>,
        names: &[String],
        quick: bool,
        read: ReadRung,
    ) -> Result<Atlas, RunError> {
        for name in names.iter().filter(|n| !n.ends_with(".toml")) {
            if !entries.iter().any(|e| e.name == *name) {
                let hint = Hint::new(name, entries.iter().map(|e| &e.name));
                return Err(RunError::Unfit(format!("atlas: no entry `{name}`{hint}")));
            }
        }
        if !names.is_empty() {
            entries.retain(|entry| names.contains(&entry.name));
        }
        let files = names.iter().filter(|n| n.ends_with(".toml"));
        let files: Result<Vec<_>, SceneError> = files.map(|n| AtlasEntry::load(n)).collect();
        entries.extend(files?);
        let mut plan = Vec::new();
        for (k, entry) in entries.iter().enumerate() {
            let rungs = entry.block.rungs.iter();
            for rung in rungs.filter(|rung| !(quick && rung.slow)) {
                let (scene, machine) = read(entry, rung)?;
                let task = Task {
                    entry: k,
                    rung: rung.clone(),
                    scene,
                    machine,
                };
                task.asks(entry)?;
                plan.push(task);
            }
        }
        Ok(Atlas { entries, plan })
    }

    /// The known cause of our engine's failure on a rung.
    pub fn explanation(&self, entry: &str, rung: &str) -> Option<&str> {
        let entry = self.entries.iter().find(|e| e.name == entry)?;
        entry.explanation(rung)
    }

    /// The entries whose rungs are run.
    pub fn entries(&self) -> &[AtlasEntry] {
        &self.entries
    }

    /// Number of rungs to be run.
    pub fn rungs(&self) -> usize {
        self.plan.len()
    }

    /// Of each entry its name, the number of its rungs to be run, and a hash of their scenes in order.
    pub fn hashes(&self) -> Vec<(&str, usize, u64)> {
        let entries = self.entries.iter().enumerate();
        let of = entries.map(|(k, entry)| {
            let scenes = self.plan.iter().filter(|task| task.entry == k);
            let hashes: Vec<u64> = scenes.map(|task| task.scene.hash).collect();
            let bytes = hashes.iter().flat_map(|hash| hash.to_le_bytes());
            let hash = crate::scene::fnv1a(&bytes.collect::<Vec<_>>());
            (entry.name.as_str(), hashes.len(), hash)
        });
        of.collect()
    }

    /// Runs every rung with `engines` at their defaults, see [`Atlas::run_presets`].
    ///
    /// # Errors
    /// Those of [`Atlas::run_presets`].
    pub fn run(&self, engines: &[Engine], progress: &Progress) -> Result<AtlasResults, RunError> {
        let presets: Vec<Preset> = engines.iter().map(|e| Preset::of(*e)).collect();
        self.run_presets(&presets, progress)
    }

    /// Runs every rung with `presets`. All but the times is deterministic.
    ///
    /// # Arguments
    /// - `progress`: advanced once a run.
    ///
    /// # Errors
    /// Errors that are not the result of a rung; a failing rung is a row.
    pub fn run_presets(
        &self,
        presets: &[Preset],
        progress: &Progress,
    ) -> Result<AtlasResults, RunError> {
        let mut results = AtlasResults::default();
        for task in &self.plan {
            let (entry, rung) = (&self.entries[task.entry], &task.rung);
            for preset in presets {
                progress.message(format!("{} {}, {}", entry.name, rung.name, preset.name));
                let finding = task.run(entry, preset)?;
                results.rows.extend(task.rows(entry, preset, &finding));
                if let Some(reason) = &finding.reason {
                    let what = match finding.verdict {
                        Verdict::Unavailable => finding.mode.as_str(),
                        _ => "stopped",
                    };
                    results.note(entry, rung, preset, what, reason);
                }
                progress.advance();
            }
        }
        Ok(results)
    }
}

impl AtlasResults {
    /// Adds a sentence; rungs and engines with the same sentence share it.
    fn note(
        &mut self,
        entry: &AtlasEntry,
        rung: &AtlasRung,
        preset: &Preset,
        what: &str,
        reason: &str,
    ) {
        let note = match what {
            "skipped" => format!("{}: {what}, {reason}", called(entry, rung)),
            "cannot" => {
                // whichever of a peer's presets it is
                let what = reason
                    .strip_prefix("--engine ")
                    .and_then(|r| r.split_once(": "));
                let reason = what.map_or(reason, |(_, what)| what);
                let peer = preset.engine.peer().unwrap_or_default();
                format!("{}: {peer} cannot: {reason}", entry.name)
            }
            _ => format!("{}, {}: {what}, {reason}", called(entry, rung), preset.name),
        };
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}

/// Entry and rung in a note; the only rung of an entry may have no name.
fn called(entry: &AtlasEntry, rung: &AtlasRung) -> String {
    format!("{} {}", entry.name, rung.name)
        .trim_end()
        .to_owned()
}

#[cfg(test)]
mod tests;
