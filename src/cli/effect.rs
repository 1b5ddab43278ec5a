//! One table of which keys and flags have an effect in which run. A key or flag without effect is
//! refused; the error says what it would need.
//!
//! A key of the scene file applies to every engine, scheme and reading that the file may be run
//! with. It is refused only if the file itself leaves it without effect. A flag or a `--set` applies
//! to this run alone, and is refused if it has no effect in this run.

use super::Flags;
use crate::experiment::{Engine, RunError};
use crate::scene::{Scene, Scheme};
use crate::thresher::{Machine, Reading, Shares};
use Need::{
    Balanced, Bodies, Contacts, Fitted, Gravity, Islands, Judged, Landings, LongLife, Ours, Peer,
    Redrawn, Restitution, Staggered, StartedOnce, Tables, Time, Unchosen, Unworn, Wears, Winkler,
};

/// What a key or flag needs to have an effect.
#[derive(Clone, Copy, PartialEq)]
enum Need {
    /// Our engine is among those that step.
    Ours,
    /// A peer is among the engines that step.
    Peer,
    /// A scene that is stepped for a given time, not load cycles of a machine.
    Bodies,
    /// The command judges whether the scene held.
    Judged,
    /// No other flag sets the duration of the run.
    Time,
    /// The scene may have several islands, which threads can solve in parallel.
    Islands,
    /// Contacts that open and close.
    Landings,
    /// A contact with a restitution above 0.
    Restitution,
    /// Our engine runs in the scheme `staggered`.
    Staggered,
    /// The scene takes its gravity from `gravity`.
    Gravity,
    /// The run writes rows of steps.
    Redrawn,
    /// The torque-balanced reading of the study.
    Balanced,
    /// The torque-balanced reading with a contact time that is fitted.
    Fitted,
    /// The torque-balanced reading with a load distribution by overlap (Winkler).
    Winkler,
    /// Load cycles of the whole machine.
    LongLife,
    /// The command wears the bodies of `[[wear]]`.
    Wears,
    /// A scene without `[[wear]]`.
    Unworn,
    /// A contact problem, not a linear complementarity problem.
    Contacts,
    /// The command prints tables to the terminal.
    Tables,
    /// `--accuracy` does not choose it.
    Unchosen,
    /// A run that is not started anew with a finer step, as one with `--accuracy` may be.
    StartedOnce,
}

/// What each key of scene files and each flag needs to have an effect. A flag that sets a key is
/// listed under the key. Keys and flags that always have an effect are not listed.
const TABLE: &[(&str, &[Need])] = &[
    ("step.time", &[Time]),
    ("step.dt", &[Unchosen]),
    ("step.scheme", &[Ours, Unchosen]),
    ("step.events", &[Ours, Landings, Unchosen]),
    ("step.impact_law", &[Ours, Landings, Restitution]),
    ("step.recovery", &[Ours, Landings, Staggered]),
    ("step.keep_rest", &[Ours]),
    ("step.split_islands", &[Ours, Islands]),
    ("step.skip_distant", &[Ours]),
    ("step.skip_tangents", &[Ours]),
    ("step.shares", &[Ours]),
    ("step.effort", &[Ours]),
    ("step.solver", &[Ours]),
    ("step.tolerance", &[Ours, Unchosen]),
    ("gravity", &[Gravity]),
    ("material.stiffness", &[Ours]),
    ("material.damping", &[Ours]),
    ("material.damping_restitution", &[Ours]),
    ("reference", &[Bodies]),
    ("verdict.overlap", &[Judged, Bodies]),
    ("verdict.deepest", &[Judged, Bodies]),
    ("verdict.joint_gap", &[Judged, Bodies]),
    ("verdict.energy", &[Judged, Bodies, Ours]),
    ("verdict.imbalance", &[Judged, Bodies, Ours]),
    ("study.shares", &[Balanced]),
    ("study.tape_thickness", &[Balanced, Winkler]),
    ("study.contact_time", &[Balanced]),
    ("study.frictions", &[Balanced]),
    ("study.calibrate.depth", &[Balanced, Fitted]),
    ("study.calibrate.cycles", &[Balanced]),
    ("wear.body", &[Wears]),
    ("wear.coefficient", &[Wears]),
    ("wear.edges", &[Wears]),
    ("wear.cell", &[Wears]),
    ("wear.mass", &[Wears]),
    ("life", &[Wears]),
    ("uncertain", &[Wears, Balanced]),
    ("wear.limits", &[Balanced]),
    ("wear.jump", &[Balanced]),
    ("wear.max_hours", &[Balanced]),
    ("wear.revolutions", &[LongLife]),
    ("wear.error", &[LongLife]),
    ("--accuracy", &[Ours, Bodies, Unworn]),
    ("--steps", &[Bodies, Unchosen]),
    ("--threads", &[Ours, Islands]),
    ("--every", &[Redrawn]),
    ("--dump-problems", &[Ours, Bodies, Unworn, StartedOnce]),
    ("--checkpoint-every", &[Ours, Bodies, StartedOnce]),
    ("--soft", &[Peer]),
    ("--no-sweep", &[Peer]),
    ("--shares", &[Contacts]),
    ("--quiet", &[Tables]),
];

/// Keys and flags that have an effect on stored problems, where nothing is stepped.
const OF_PROBLEMS: [&str; 3] = ["step.tolerance", "--shares", "--quiet"];

/// The input of a run.
#[derive(Clone, Copy)]
pub(super) enum Subject<'a> {
    /// A scene and its machine, if it has one.
    Scene(&'a Scene, Option<&'a Machine>),
    /// Stored contact problems.
    Problems,
    /// A stored linear complementarity problem.
    Lcp,
}

/// A run whose keys and flags are checked for their effect.
#[derive(Clone, Copy)]
pub(super) struct Run<'a> {
    pub command: &'static str,
    pub subject: Subject<'a>,
    /// The engines that step.
    pub engines: &'a [Engine],
    /// Whether our engine also runs a reference solution, with the keys of the scene.
    pub reference: bool,
    /// Whether `--steps` sets the duration.
    pub steps: bool,
    /// Whether our engine runs in the scene's scheme only.
    pub one_scheme: bool,
    /// Whether the command prints tables or a progress bar without `--quiet`.
    pub tables: bool,
    /// Whether `--accuracy` chooses the step.
    pub chosen: bool,
}

impl<'a> Run<'a> {
    /// `command` on `scene`, by default with our engine.
    pub fn new(
        command: &'static str,
        scene: &'a Scene,
        machine: Option<&'a Machine>,
        flags: &Flags,
    ) -> Run<'a> {
        Run {
            command,
            subject: Subject::Scene(scene, machine),
            engines: &[Engine::Moreau],
            reference: false,
            steps: flags.steps.is_some(),
            one_scheme: true,
            tables: true,
            chosen: false,
        }
    }

    /// `command` on stored problems.
    pub fn of_problems(command: &'static str, subject: Subject<'a>) -> Run<'a> {
        Run {
            command,
            subject,
            engines: &[],
            reference: false,
            steps: false,
            one_scheme: true,
            tables: true,
            chosen: false,
        }
    }

    /// Refuses the first key or flag without effect.
    ///
    /// # Arguments
    /// - `typed`: flags that set no key, with their values as typed.
    ///
    /// # Errors
    /// [`RunError::Unfit`].
    pub fn refuse(&self, flags: &Flags, typed: &[(&str, String)]) -> Result<(), RunError> {
        match self.without_effect(flags, typed).into_iter().next() {
            None => Ok(()),
            Some((what, why)) => Err(unfit(&what, &why)),
        }
    }

    /// All flags and keys without effect, flags first, each with the reason.
    pub fn without_effect(&self, flags: &Flags, typed: &[(&str, String)]) -> Vec<(String, String)> {
        let of_flags = typed.iter().filter_map(|(flag, value)| {
            let words = format!("{flag} {value}").trim_end().to_owned();
            Some((words, self.idle(flag)?))
        });
        let written = self.scene().map_or(&[][..], |scene| &scene.written);
        let of_keys = written.iter().filter_map(|key| {
            Some(match flags.typed(&key.place.origin) {
                Some(words) => (words, self.idle(&key.path)?),
                None => {
                    let place = format!("{} = {}", key.place, key.value);
                    (place, self.idle_in_file(&key.path)?)
                }
            })
        });
        of_flags.chain(of_keys).collect()
    }

    /// Why a key or flag has no effect; `None` if it has one.
    pub fn idle(&self, name: &str) -> Option<String> {
        self.lacks(name, |_| true)
    }

    /// Why a key of the file has no effect in any run of the file; `None` if it may have one.
    fn idle_in_file(&self, key: &str) -> Option<String> {
        self.lacks(key, |need| {
            matches!(need, Landings | Restitution | Gravity | Bodies | LongLife)
                || need == Time && matches!(self.machine(), Some(Machine::Thresher(_)))
        })
    }

    /// The reason of the first unmet need of `name`, among the needs for which `counts` holds.
    fn lacks(&self, name: &str, counts: impl Fn(Need) -> bool) -> Option<String> {
        if !matches!(self.subject, Subject::Scene(..)) && !OF_PROBLEMS.contains(&name) {
            let what = format!("in `{}`: nothing is stepped", self.command);
            return Some(what);
        }
        let of = |row: &&(&str, &[Need])| {
            let rest = name.strip_prefix(row.0);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        };
        let (_, needs) = TABLE.iter().find(of)?;
        let referred = |need: Need| need == Ours && self.reference && !name.starts_with("--");
        let mut needs = needs
            .iter()
            .filter(|need| counts(**need) && !referred(**need));
        needs.find_map(|need| self.lacking(*need))
    }

    fn scene(&self) -> Option<&'a Scene> {
        match self.subject {
            Subject::Scene(scene, _) => Some(scene),
            Subject::Problems | Subject::Lcp => None,
        }
    }

    fn machine(&self) -> Option<&'a Machine> {
        match self.subject {
            Subject::Scene(_, machine) => machine,
            Subject::Problems | Subject::Lcp => None,
        }
    }

    /// Why the run does not meet a need, to follow "has no effect"; `None` if it meets the need.
    fn lacking(&self, need: Need) -> Option<String> {
        let (lacks, why) = match need {
            Ours => {
                let engines: Vec<&str> = self.engines.iter().map(|e| e.name()).collect();
                let why = format!("on --engine {}, only on moreau", engines.join(","));
                (!self.engines.contains(&Engine::Moreau), why)
            }
            Peer => {
                let peer = self.engines.iter().any(|engine| engine.peer().is_some());
                let name = self.scene().map_or("", |scene| &scene.name);
                let why = format!("on scene {name} without a peer that steps it");
                (!peer, why)
            }
            Time if self.steps => (true, "with --steps, which sets the duration".to_owned()),
            Time if self.command == "bench" => {
                let how = "--steps N sets the timed steps, --settle N those before";
                (true, format!("in bench; {how}"))
            }
            Judged => {
                let why = "in `{command}`: only `run` judges whether a scene held";
                (
                    self.command != "run",
                    why.replace("{command}", self.command),
                )
            }
            Wears => {
                let worn = self.scene().is_some_and(|scene| !scene.wear.is_empty());
                let why = format!(
                    "in `{}`: only `run` wears the bodies of a scene, and `calibrate`",
                    self.command
                );
                (worn && !["run", "calibrate"].contains(&self.command), why)
            }
            Unworn => {
                let worn = self.scene().is_some_and(|scene| !scene.wear.is_empty());
                (
                    worn,
                    "on a scene with [[wear]], which runs in cycles".to_owned(),
                )
            }
            Staggered => {
                let moreau = |scene: &Scene| scene.step.scheme == Scheme::Moreau;
                let alone = self.one_scheme && self.scene().is_some_and(moreau);
                let why = "in the scheme moreau, which ignores gaps; it needs staggered";
                (alone, why.to_owned())
            }
            Contacts => {
                let why = "on an LCP, only on a contact problem";
                (matches!(self.subject, Subject::Lcp), why.to_owned())
            }
            Unchosen => (self.chosen, "with --accuracy, which chooses it".to_owned()),
            StartedOnce => (
                self.chosen,
                "with --accuracy, whose run may start anew with a finer step".to_owned(),
            ),
            Tables => (
                !self.tables,
                "with --json, which prints only JSON".to_owned(),
            ),
            _ => {
                return self
                    .scene()
                    .and_then(|scene| lacking_of(scene, self.machine(), need));
            }
        };
        lacks.then_some(why)
    }
}

/// Why a scene does not meet a need, to follow "has no effect"; `None` if it meets the need.
fn lacking_of(scene: &Scene, machine: Option<&Machine>, need: Need) -> Option<String> {
    let parameters = match machine {
        Some(Machine::Study(setup)) => Some(&setup.parameters),
        _ => None,
    };
    let study = parameters.is_some();
    let reading = parameters.map(|study| study.reading);
    let shares = parameters.map(|study| study.shares);
    let machine = matches!(machine, Some(Machine::Thresher(_)));
    let own = "on scene {scene}, whose run is set by its own blocks";
    let (lacks, why) = match need {
        Bodies => (study || machine, own),
        Redrawn => (study, own),
        Time if machine => (true, own),
        Time => (
            reading == Some(Reading::TorqueBalanced),
            "on scene {scene}, whose contact time is calibrated; study.reading = \"literal\" \
             needs it",
        ),
        Islands => (
            study || scene.linear.is_some(),
            "on scene {scene}: all of it is one island",
        ),
        Landings => (study, "on a [study]: its one rotor is always in contact"),
        Restitution => (
            !rebounds(scene),
            "on scene {scene}: no contact of it has a restitution above 0",
        ),
        Gravity => (study, "on a [study], whose gravity is the standard one"),
        Balanced => (
            reading == Some(Reading::Literal),
            "with study.reading = \"literal\", which computes no life; it needs \"torque-balanced\"",
        ),
        Fitted => (
            parameters.is_some_and(|study| study.contact_time.is_some()),
            "with a study.contact_time, which is then not fitted",
        ),
        Winkler => (
            shares.is_some_and(|shares| shares != Shares::Winkler),
            "unless study.shares = \"winkler\"",
        ),
        LongLife => (
            study,
            "on a [study], whose cycles are all equal; it needs a [thresher]",
        ),
        _ => (false, ""),
    };
    lacks.then(|| why.replace("{scene}", &scene.name))
}

/// Whether any contact has a restitution above 0.
fn rebounds(scene: &Scene) -> bool {
    let linear = scene.linear.iter().flat_map(|block| &block.contact);
    linear.into_iter().any(|contact| contact.restitution > 0.0)
        || scene.materials.iter().any(|m| m.restitution > 0.0)
}

/// Whether only our engine uses the key of a change such as `step.solver="nsgs"`.
pub(super) fn ours_alone(change: &str) -> bool {
    let key = change.split('=').next().unwrap_or_default();
    TABLE
        .iter()
        .any(|(name, needs)| *name == key && needs.contains(&Ours))
}

/// The error that refuses `what`.
pub(super) fn unfit(what: &str, why: &str) -> RunError {
    RunError::Unfit(format!("{what}: has no effect {why}"))
}
