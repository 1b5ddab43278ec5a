//! Flags of the commands that take scenes, and the scenes that they make.

use super::{print_err, summary};
use crate::dynamics::MOST_THREADS;
use crate::experiment::{RunError, step_count};
use crate::scene::{Origin, Scene, SceneError};
use crate::thresher::{self, Machine};
use clap::Args;
use std::path::PathBuf;

/// Arguments of every command that takes one scene.
#[derive(Args, Clone)]
pub(super) struct Common {
    /// Name of a scene of the catalogue (see `moreau2d scenes`), path of a TOML file, - for a scene from
    /// standard input, or a rung of the atlas as atlas/ENTRY:RUNG, issues/NAME or FILE.toml:RUNG.
    #[arg(required = true)]
    pub scene: Option<String>,
    #[command(flatten)]
    pub flags: Flags,
}

/// Flags of every command that takes scenes.
#[derive(Args, Clone, Default)]
pub(super) struct Flags {
    /// Folder for the results [default: out/NAME].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Step length [s].
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    pub dt: Option<String>,
    /// Simulated time [s]; with [[wear]] of one measured cycle, for the study the contact time of one
    /// load cycle.
    #[arg(
        long,
        value_name = "S",
        allow_hyphen_values = true,
        conflicts_with = "steps"
    )]
    pub time: Option<String>,
    /// Number of steps, in place of --time.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub steps: Option<u32>,
    /// Change a key of the scene; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", allow_hyphen_values = true)]
    pub set: Vec<String>,
    /// Time-stepping scheme: staggered or moreau.
    #[arg(long, value_name = "NAME")]
    pub scheme: Option<String>,
    /// Locate the time of each impact within its step.
    #[arg(long)]
    pub events: bool,
    /// Impulse solver: auto, enumeration, nsgs, direct, lemke or prox.
    #[arg(long, value_name = "NAME")]
    pub solver: Option<String>,
    /// Relative natural-map residual at which an island counts as solved.
    #[arg(long, value_name = "R", allow_hyphen_values = true)]
    pub tolerance: Option<String>,
    /// How hard the impulses of large islands in motion are looked for: fast or exact.
    #[arg(long, value_name = "NAME")]
    pub effort: Option<String>,
    #[arg(long, value_name = "N", value_delimiter = ',',
          value_parser = clap::value_parser!(u32).range(1..=MOST_THREADS as i64),
          help = format!("Threads that share the steps of moreau, 1 to {MOST_THREADS}; results do \
                          not depend on the number. bench takes several numbers, separated by \
                          commas [default: 1]"))]
    pub threads: Vec<u32>,
    /// Print no progress bar and no tables.
    #[arg(long)]
    pub quiet: bool,
    /// Print summary.json in place of tables.
    #[arg(long)]
    pub json: bool,
    /// Changes of the scene that the program applies before those of the user.
    #[arg(skip)]
    pub before: Vec<String>,
}

impl Flags {
    /// What the command prints to the terminal.
    pub fn say(&self) -> summary::Say {
        summary::Say::of(self.json, self.quiet)
    }

    /// Loads the scene `name` with all flags applied, and its machine if it has one. Prints warnings
    /// about the scene to standard error.
    pub fn load(&self, name: &str) -> Result<(Scene, Option<Machine>), RunError> {
        let (mut scene, machine) = self.load_on_one_thread(name)?;
        scene.step.threads = match self.threads[..] {
            [] => 1,
            [one] => one as usize,
            _ => {
                return Err(RunError::Unfit(
                    "--threads: only `bench` takes several numbers".to_owned(),
                ));
            }
        };
        Ok((scene, machine))
    }

    /// As [`Flags::load`], without `--threads`.
    pub fn load_on_one_thread(&self, name: &str) -> Result<(Scene, Option<Machine>), SceneError> {
        let typed = self.of_keys();
        let changes = typed.iter().map(|(change, _)| change);
        let set = self.before.iter().chain(&self.set).chain(changes);
        let set: Vec<String> = set.cloned().collect();
        let in_words = |error: SceneError| {
            let each = typed.iter();
            each.fold(error, |error, (change, words)| error.typed(change, words))
        };
        let (scene, machine) = thresher::load(name, &set).map_err(in_words)?;
        if !self.quiet {
            let of_machine = machine.iter().flat_map(|m| m.step_warnings(scene.step.dt));
            let text: String = (scene.step_warnings().into_iter())
                .chain(of_machine)
                .map(|warning| format!("warning: {warning}\n"))
                .collect();
            print_err(&text);
        }
        Ok((scene, machine))
    }

    /// For each flag that sets a key of the scene: the change `KEY=VALUE`, and the flag as typed.
    pub fn of_keys(&self) -> Vec<(String, String)> {
        let mut typed = Vec::new();
        for (flag, value) in [
            ("--dt", &self.dt),
            ("--time", &self.time),
            ("--tolerance", &self.tolerance),
        ] {
            if let Some(value) = value {
                let change = format!("step.{}={value}", &flag[2..]);
                typed.push((change, format!("{flag} {value}")));
            }
        }
        if self.events {
            typed.push(("step.events=true".to_owned(), "--events".to_owned()));
        }
        for (flag, value) in [
            ("--scheme", &self.scheme),
            ("--solver", &self.solver),
            ("--effort", &self.effort),
        ] {
            if let Some(value) = value {
                let change = format!("step.{}=\"{}\"", &flag[2..], value.escape_default());
                typed.push((change, format!("{flag} {value}")));
            }
        }
        typed
    }

    /// Flags that set no key of the scene but may have no effect in a run, with their values.
    pub fn of_runs(&self) -> Vec<(&'static str, String)> {
        let mut typed = Vec::new();
        if let Some(steps) = self.steps {
            typed.push(("--steps", steps.to_string()));
        }
        if !self.threads.is_empty() {
            let counts: Vec<String> = self.threads.iter().map(u32::to_string).collect();
            typed.push(("--threads", counts.join(",")));
        }
        typed
    }

    /// The flag, as typed, that made a change of the scene; `None` for a key of the file.
    pub fn typed(&self, origin: &Origin) -> Option<String> {
        let Origin::Flag(flag) = origin else {
            return None;
        };
        let mut flags = self.of_keys().into_iter();
        let found = flags.find(|(change, _)| change == flag);
        Some(found.map_or(format!("--set {flag}"), |(_, words)| words))
    }

    /// Refuses a change that a later one overwrites.
    pub fn refuse_twice(&self, scene: &Scene) -> Result<(), RunError> {
        let words = |flag: &str| self.typed(&Origin::Flag(flag.to_owned()));
        let mine = scene.changes.get(self.before.len()..).unwrap_or(&[]);
        for (k, (flag, path)) in mine.iter().enumerate() {
            let undone = mine[k + 1..].iter().find(|(_, later)| {
                let rest = path.strip_prefix(later.as_str());
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            });
            if let Some((later, _)) = undone {
                let [flag, later] = [flag, later].map(|flag| words(flag).unwrap_or_default());
                return Err(RunError::Unfit(format!(
                    "{flag}: has no effect before {later}, which sets {path} again"
                )));
            }
        }
        Ok(())
    }

    /// Number of steps of the run.
    pub fn step_count(&self, scene: &Scene) -> usize {
        self.steps
            .map(|n| n as usize)
            .unwrap_or_else(|| step_count(&scene.step))
    }

    pub fn folder(&self, scene: &Scene) -> PathBuf {
        self.out
            .clone()
            .unwrap_or_else(|| PathBuf::from("out").join(&scene.name))
    }
}

impl Common {
    /// See [`Flags::load`].
    pub fn load(&self) -> Result<(Scene, Option<Machine>), RunError> {
        self.flags.load(self.scene.as_deref().unwrap_or_default())
    }

    /// See [`Flags::step_count`].
    pub fn step_count(&self, scene: &Scene) -> usize {
        self.flags.step_count(scene)
    }

    /// See [`Flags::folder`].
    pub fn folder(&self, scene: &Scene) -> PathBuf {
        self.flags.folder(scene)
    }
}
