//! The failure atlas: scenes in which methods break, each up a ladder until it does.
//!
//! [`Atlas::run`] runs every rung of every entry with every engine at one preset each, never tuned
//! to a scene, and gives rows of `results.csv`; table and picture are drawn from that file and from
//! nothing else.
//!
//! # How to read it
//! A rung is judged by measures of the run (a row each: `value`, and in `reference` the most that
//! it may be), the same for every engine. `pass`: all hold. `fail`: one does not; `mode` says how,
//! by the first that broke. `unsolved`: all hold, but our solver says of some island in some step
//! that it did not solve it. A blank verdict is a rung that an engine has not the parts for
//! (`cannot`) or that needs a feature which is not built in (`skipped`); a note says which. Peers
//! certify nothing, so that they are judged by what they do alone.
//!
//! Lengths are compared with the bodies' own, most of 1 m. Limits are of two kinds: what the
//! atlas asks by its definition (penetration 1e-4 of a box, lean 1e-3, ...), and 1e-6 m or more where
//! the definition says zero, because an engine in single precision knows no better.
//!
//! # How to add an entry
//! A file here or an addition to one, with a function that gives its rungs: a scene each, from the
//! catalogue with changes or from text, a function from the run to its [`Check`]s, and the word for
//! a pass; then a line in [`ENTRIES`]. What we fail gets a sentence there, which is printed with
//! every atlas; a test holds the verdicts of the quick rungs.

mod chains;
mod crowds;
mod friction;
mod impacts;
mod machines;
mod masonry;
mod redundancy;
mod rods;
mod scales;
mod stacks;
mod table;
mod trace;
mod verdict;

use super::setting::Setting;
use super::simulate::{Engine, RunError};
use crate::report::{Progress, ResultRow, number};
use crate::scene::{Built, Hint, Scene, load};
use trace::Trace;
use verdict::Verdict;

pub use table::ENTRIES;
pub(crate) use verdict::{Check, Finding, RELATIVE};

/// A scene of the atlas and its ladder.
pub struct Entry {
    pub name: &'static str,
    /// What it shows, in a line.
    pub shows: &'static str,
    /// When a rung passes, in words.
    pub passes: &'static str,
    pub(crate) rungs: fn() -> Result<Vec<Rung>, RunError>,
    /// Why ours fails a rung, in a sentence: the rung's name, or `*` for all of them.
    pub(crate) ours: &'static [(&'static str, &'static str)],
}

impl Entry {
    /// Why ours fails a rung, where it is known to.
    pub fn explanation(&self, rung: &str) -> Option<&'static str> {
        let found = self
            .ours
            .iter()
            .find(|(name, _)| *name == rung || *name == "*");
        found.map(|(_, sentence)| *sentence)
    }
}

/// A figure or more of a run.
type Judge = Box<dyn Fn(&Trace) -> Vec<Check>>;

/// What an engine other than by stepping a scene does.
type Own = Box<dyn Fn(Engine) -> Result<Finding, RunError>>;

enum Work {
    /// Step the scene, look at the run.
    Steps(Judge),
    Own(Own),
}

/// One difficulty of an entry.
pub(crate) struct Rung {
    name: String,
    scene: Scene,
    /// The mode of a pass.
    passes: &'static str,
    work: Work,
    /// What is changed in the world that no scene file says.
    prepare: fn(&mut Built),
    quick: bool,
    /// Why engines other than ours cannot run it.
    ours_alone: Option<&'static str>,
    double: bool,
}

impl Rung {
    fn new(
        name: impl Into<String>,
        scene: Scene,
        passes: &'static str,
        judge: impl Fn(&Trace) -> Vec<Check> + 'static,
    ) -> Rung {
        Rung {
            name: name.into(),
            scene,
            passes,
            work: Work::Steps(Box::new(judge)),
            prepare: |_| {},
            quick: false,
            ours_alone: None,
            double: false,
        }
    }

    /// A rung of `scene`'s parts that is not a plain run.
    pub fn own(
        name: impl Into<String>,
        scene: Scene,
        work: impl Fn(Engine) -> Result<Finding, RunError> + 'static,
    ) -> Rung {
        Rung {
            work: Work::Own(Box::new(work)),
            ..Rung::new(name, scene, "", |_| Vec::new())
        }
    }

    /// Runs with `--quick` too, if `quick`.
    fn quick_if(mut self, quick: bool) -> Rung {
        self.quick = quick;
        self
    }

    pub fn quick(self) -> Rung {
        self.quick_if(true)
    }

    fn prepared(mut self, prepare: fn(&mut Built)) -> Rung {
        self.prepare = prepare;
        self
    }

    /// Only ours has what it asks for.
    pub fn ours_alone(mut self, why: &'static str) -> Rung {
        self.ours_alone = Some(why);
        self
    }

    /// Means nothing in single precision.
    fn double(mut self) -> Rung {
        self.double = true;
        self
    }

    fn run(&self, engine: Engine) -> Result<Finding, RunError> {
        if self.double && crate::rapier::PRECISION != "f64" {
            let reason = "needs feature `f64`: build with --features f64".to_owned();
            return Ok(Finding::unavailable("skipped", reason));
        }
        if let (Some(why), false) = (self.ours_alone, engine == Engine::Moreau) {
            return Ok(Finding::unavailable("cannot", why.to_owned()));
        }
        let outcome = match &self.work {
            Work::Steps(judge) => Trace::of(&self.scene, engine, self.prepare)
                .map(|trace| Finding::of(&trace, judge(&trace), self.passes)),
            Work::Own(work) => work(engine),
        };
        outcome.or_else(Finding::stopped)
    }

    fn rows(&self, entry: &Entry, engine: Engine, finding: &Finding) -> Vec<ResultRow> {
        let setting = Setting::new(engine, &self.scene.step);
        let row = |measure: &str, value: f64, unit: &str, reference: String| ResultRow {
            scene: entry.name.to_owned(),
            rung: self.name.clone(),
            engine: engine.name().to_owned(),
            scheme: setting.scheme().to_owned(),
            solver: setting.solver().to_owned(),
            setting: preset(engine).to_owned(),
            dt_s: self.scene.step.dt,
            threads: setting.threads(),
            precision: setting.precision().to_owned(),
            measure: measure.to_owned(),
            value,
            unit: unit.to_owned(),
            reference,
            seconds_per_simulated_second: finding.cost,
            spread: None,
            verdict: finding.verdict.word().to_owned(),
            mode: finding.mode.clone(),
        };
        if finding.checks.is_empty() {
            return vec![row("verdict", f64::NAN, "", String::new())];
        }
        let checks = finding.checks.iter();
        let at_most = |limit: f64| format!("at most {}", number(limit, 3));
        checks
            .map(|c| row(c.measure, c.value, c.unit, at_most(c.limit)))
            .collect()
    }
}

/// The engine's setting in a word, the same for every scene.
fn preset(engine: Engine) -> &'static str {
    match engine {
        Engine::Moreau | Engine::Rapier | Engine::Box2d => "default",
        Engine::RapierStiff => "stiff",
    }
}

/// Rungs to be run.
pub struct Atlas {
    plan: Vec<(&'static Entry, Rung)>,
}

/// What an atlas found.
#[derive(Debug, Clone, Default)]
pub struct AtlasResults {
    /// In the order of entries, rungs, engines, measures.
    pub rows: Vec<ResultRow>,
    /// Why rungs have no verdict, and what ended runs early.
    pub notes: Vec<String>,
}

impl Atlas {
    /// The rungs of the entries called `names`, of all where there are none.
    ///
    /// # Arguments
    /// - `entries`: [`ENTRIES`], with more that need what this folder does not know.
    /// - `quick`: the cheap rungs only.
    ///
    /// # Errors
    /// [`RunError::Unfit`] for an unknown entry, with the nearest; [`RunError::Scene`] if a scene of
    /// an entry is broken.
    pub fn new(
        entries: &[&'static Entry],
        names: &[String],
        quick: bool,
    ) -> Result<Atlas, RunError> {
        for name in names {
            if !entries.iter().any(|e| e.name == name) {
                let hint = Hint::new(name, entries.iter().map(|e| e.name));
                return Err(RunError::Unfit(format!("atlas: no entry `{name}`{hint}")));
            }
        }
        let mut plan = Vec::new();
        for &entry in entries {
            if names.is_empty() || names.iter().any(|name| name == entry.name) {
                let rungs = (entry.rungs)()?.into_iter();
                plan.extend(rungs.filter(|r| r.quick || !quick).map(|r| (entry, r)));
            }
        }
        Ok(Atlas { plan })
    }

    /// Number of runs, all engines counted.
    pub fn runs(&self) -> usize {
        self.plan.len() * Engine::ALL.len()
    }

    /// Runs every rung with `engines`. All but the times is deterministic.
    ///
    /// # Arguments
    /// - `progress`: advanced once a run.
    ///
    /// # Errors
    /// None that is the outcome of a rung: those are rows.
    pub fn run(&self, engines: &[Engine], progress: &Progress) -> Result<AtlasResults, RunError> {
        let mut results = AtlasResults::default();
        for (entry, rung) in &self.plan {
            for &engine in engines {
                progress.message(format!("{} {}, {}", entry.name, rung.name, engine.name()));
                let finding = rung.run(engine)?;
                results.rows.extend(rung.rows(entry, engine, &finding));
                if let Some(reason) = &finding.reason {
                    let what = match finding.verdict {
                        Verdict::Unavailable => finding.mode.as_str(),
                        _ => "stopped",
                    };
                    results.note(entry, rung, engine, what, reason);
                }
                progress.advance();
            }
        }
        Ok(results)
    }
}

impl AtlasResults {
    /// One sentence for an entry, whatever the number of its rungs and engines that share it.
    fn note(&mut self, entry: &Entry, rung: &Rung, engine: Engine, what: &str, reason: &str) {
        let note = match what {
            "skipped" => format!("{} {}: {what}, {reason}", entry.name, rung.name),
            "cannot" => {
                // whichever of a peer's presets it is
                let what = reason
                    .strip_prefix("--engine ")
                    .and_then(|r| r.split_once(": "));
                let reason = what.map_or(reason, |(_, what)| what);
                let peer = engine.peer().unwrap_or_default();
                format!("{}: {peer} cannot: {reason}", entry.name)
            }
            _ => format!(
                "{} {}, {}: {what}, {reason}",
                entry.name,
                rung.name,
                engine.name()
            ),
        };
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }
}

/// A scene of the catalogue with changes, as `--set` makes them.
fn catalogue(name: &str, flags: &[String]) -> Result<Scene, RunError> {
    Ok(load(name, flags)?)
}

/// A scene from its text without the header.
fn drafted(name: &str, text: &str) -> Result<Scene, RunError> {
    let header = format!("[scene]\nname = \"{name}\"\ntitle = \"a rung of the atlas\"\n");
    Ok(Scene::parse(name, &(header + text), &[])?)
}

/// A fixed floor whose top is at y = 0.
const FLOOR: &str = "[[body]]\nname = \"floor\"\nkind = \"fixed\"\nbox = [400, 2]\n\
                     position = [0, -1]\n";

/// `[step]`
fn step(dt: f64, time: f64) -> String {
    format!("[step]\ndt = {dt:?}\ntime = {time:?}\n")
}

/// The one `[[material]]` of a scene.
fn material(friction: f64, restitution: f64) -> String {
    format!("[[material]]\nname = \"m\"\nfriction = {friction:?}\nrestitution = {restitution:?}\n")
}
