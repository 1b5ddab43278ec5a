use super::blocks::{Study, Tooth, Wear};
use super::check::check;
use super::parameters::Thresher;
use super::shapes::segment_mass;
use crate::experiment::RunError;
use crate::scene::{self, Motion, Scene, SceneError};
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// The blocks of a machine in a scene file, with defaults filled in.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Blocks {
    pub tooth: Option<Tooth>,
    pub wear: Option<Wear>,
    pub study: Option<Study>,
    pub thresher: Option<Thresher>,
}

/// A machine with its tooth and its wear settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup<P> {
    pub parameters: P,
    pub tooth: Tooth,
    pub wear: Wear,
}

/// The machine of a scene.
#[derive(Debug, Clone, PartialEq)]
pub enum Machine {
    Study(Setup<Study>),
    Thresher(Setup<Thresher>),
}

/// Loads a scene by its name in the catalogue or from a file, with its machine if it has one.
///
/// # Arguments
/// Those of [`scene::load`].
///
/// # Errors
/// Those of [`scene::load`], and [`SceneError::OutOfRange`] and [`SceneError::Duplicate`] of the
/// machine's own blocks.
pub fn load(name_or_path: &str, flags: &[String]) -> Result<(Scene, Option<Machine>), SceneError> {
    let (scene, blocks) = scene::load_machine(name_or_path, flags, check)?;
    Ok((scene, blocks.machine()))
}

/// Reads a scene from its text, with its machine if it has one: see [`Scene::parse`] and [`load`].
///
/// # Errors
/// Those of both.
pub fn parse(
    file: &str,
    text: &str,
    flags: &[String],
) -> Result<(Scene, Option<Machine>), SceneError> {
    let (scene, blocks) = Scene::parse_machine(file, text, flags, check)?;
    Ok((scene, blocks.machine()))
}

impl Blocks {
    pub(super) fn machine(self) -> Option<Machine> {
        let (tooth, wear) = (
            self.tooth.unwrap_or_default(),
            self.wear.unwrap_or_default(),
        );
        match (self.study, self.thresher) {
            (Some(parameters), _) => Some(Machine::Study(Setup {
                parameters,
                tooth,
                wear,
            })),
            (None, Some(parameters)) => Some(Machine::Thresher(Setup {
                parameters,
                tooth,
                wear,
            })),
            (None, None) => None,
        }
    }
}

impl Machine {
    /// Warnings about motions that are too fast for steps of `dt` \[s\]: see
    /// [`Scene::step_warnings`].
    pub fn step_warnings(&self, dt: f64) -> Vec<String> {
        let motions = self.motions();
        motions.iter().filter_map(|m| m.warning(dt)).collect()
    }

    /// Refuses a crop of grains for `what` is computed with the strip alone.
    ///
    /// # Errors
    /// [`RunError::Unfit`].
    pub fn needs_strip(&self, what: &str) -> Result<(), RunError> {
        match self {
            Machine::Thresher(setup) if setup.parameters.grains.is_some() => {
                Err(RunError::Unfit(format!(
                    "{what}: the crop is of grains, whose wear scatters too much from one revolution to the next; \
                     it is computed with the strip alone, without [thresher.grains]"
                )))
            }
            _ => Ok(()),
        }
    }

    /// Motions that its step must resolve; none of the study, which has no step.
    pub(super) fn motions(&self) -> Vec<Motion> {
        let Machine::Thresher(Setup { parameters: p, .. }) = self else {
            return Vec::new();
        };
        let (mass, inertia) = segment_mass(p);
        // beside grains, a run has the strip too
        let crop = if p.grains.is_some() { "strip" } else { "crop" };
        let contact = Motion {
            what: format!("the {crop}'s contacts"),
            period: PI * (mass / (p.crop_stiffness * p.segment_length)).sqrt(),
        };
        let bending = (p.crop_bending_stiffness > 0.0).then(|| Motion {
            what: format!("the bending of the {crop}"),
            // two equal segments against each other
            period: TAU * (0.5 * inertia / p.crop_bending_stiffness).sqrt(),
        });
        let passage = Motion {
            what: "the passage of a bar".to_owned(),
            period: TAU / (p.speed * f64::from(p.bars)),
        };
        let motions = [Some(contact), bending, Some(passage)];
        motions.into_iter().flatten().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::thresher::Reading;
    use proptest::prelude::*;

    fn thresher(flags: &[&str]) -> Result<(Scene, Option<Machine>), SceneError> {
        let flags: Vec<String> = flags.iter().map(|f| (*f).to_owned()).collect();
        load("thresher", &flags)
    }

    #[test]
    fn machines_of_the_catalogue_are_read_with_their_defaults() {
        let (_, Some(Machine::Thresher(setup))) = thresher(&[]).unwrap() else {
            panic!("no thresher");
        };
        // the bulk density that fills the inlet, exact but for round-off
        assert!((setup.parameters.crop_density() - 62.5).abs() < 1e-12);
        assert_eq!(setup.tooth, Tooth::default());
        // a key that the file does not set is found by its bare name
        let literal = load("thresher-study", &["reading=literal".to_owned()]).unwrap();
        let (_, Some(Machine::Study(setup))) = literal else {
            panic!("no study");
        };
        assert_eq!(setup.parameters.reading, Reading::Literal);
        assert_eq!(load("tower", &[]).unwrap().1, None);
    }

    /// The same errors as in the scene's own blocks: file, line or flag, key, range, nearest name.
    #[test]
    fn wrong_values_of_a_machine_are_refused_with_their_place() {
        let cases = [
            (
                "[thresher]\nbars = 0",
                "t.toml:5:1: thresher.bars = 0: allowed is 1 to 1000",
            ),
            (
                "[thresher]\nfeed_rate = 0",
                "thresher.feed_rate = 0.0: allowed is 1e-12 to 1e12 kg/s",
            ),
            (
                "[thresher]\nbrs = 8",
                "t.toml:5:1: thresher.brs: unknown key `brs`; did you mean `bars`?",
            ),
            (
                "[thresher]\nbars = \"8\"",
                "t.toml:5:1: thresher.bars: expected a whole number",
            ),
            ("[thresher]\nspeed = nan", "thresher.speed"),
            ("[thresher]\nconcave = \"fixd\"", "did you mean `fixed`?"),
            (
                "[study]\nspeeds = [70, 0]",
                "study.speeds.1 = 0.0: allowed is 1e-6 to 1e6 rad/s",
            ),
            (
                "[study]\n[wear]\nlimits = [{ name = \"a\", height = 0 }, { name = \"a\", height = 1 }]",
                "there is already a limit named `a`",
            ),
            (
                "[study]\n[tooth]\ncells = 2",
                "tooth.cells = 2: allowed is 3 to 1000",
            ),
            ("[thrsher]", "did you mean `thresher`?"),
            ("thresher = 3", "expected a table"),
        ];
        for (block, expected) in cases {
            let header = "[scene]\nname = \"t\"\ntitle = \"t\"\n";
            // a bare key stands before all tables
            let text = match block.starts_with('[') {
                true => format!("{header}{block}\n"),
                false => format!("{block}\n{header}"),
            };
            let error = parse("t.toml", &text, &[]).unwrap_err().to_string();
            assert!(
                error.contains(expected),
                "{block}\n  {error}\n  lacks {expected}"
            );
        }
        let error = thresher(&["bars=1001"]).unwrap_err().to_string();
        assert!(
            error.contains("with --set bars=1001: thresher.bars = 1001"),
            "{error}"
        );
    }

    #[test]
    fn the_hash_sees_the_values_of_a_machine_and_not_their_spelling() {
        let hash = |flag: &str| thresher(&[flag]).unwrap().0.hash;
        assert_eq!(hash("thresher.bars=8"), hash("step.dt=4e-5"));
        assert_ne!(hash("thresher.bars=8"), hash("thresher.bars=6"));
    }

    #[test]
    fn a_scene_of_bodies_refuses_a_machine() {
        let error = scene::load("thresher", &[]).unwrap_err().to_string();
        assert!(error.contains("belongs to a machine"), "{error}");
    }

    #[test]
    fn the_crop_of_the_thresher_needs_its_short_steps() {
        let warnings = |dt: f64| thresher(&[]).unwrap().1.unwrap().step_warnings(dt);
        let found = warnings(1e-4);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].contains("the crop's contacts"), "{found:?}");
        assert!(found[1].contains("the bending of the crop"), "{found:?}");
        // a cylinder that turns by more than a revolution in a step
        let (scene, machine) = thresher(&["thresher.speed=1e6"]).unwrap();
        let found = machine.unwrap().step_warnings(scene.step.dt);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].contains("the passage of a bar"), "{found:?}");
        for name in ["thresher", "thresher-study"] {
            let (scene, machine) = load(name, &[]).unwrap();
            assert!(machine.unwrap().step_warnings(scene.step.dt).is_empty());
        }
    }

    proptest! {
        /// Broken files are refused or accepted, never a panic.
        #[test]
        fn mangled_machines_never_panic(
            cut in 0.0_f64..1.0,
            flips in prop::collection::vec((0.0_f64..1.0, any::<u8>()), 0..8),
            flag in prop::option::of("[a-z.0-9]{0,12}=[ -~]{0,12}"),
        ) {
            let mut bytes = include_bytes!("../../scenes/thresher.toml").to_vec();
            for (at, byte) in flips {
                let index = (at * bytes.len() as f64) as usize;
                bytes[index] = byte;
            }
            // half of the files are cut short
            bytes.truncate((bytes.len() as f64 * (2.0 * cut).min(1.0)) as usize);
            let text = String::from_utf8_lossy(&bytes).into_owned();
            if let Err(error) = parse("t.toml", &text, flag.as_slice()) {
                prop_assert!(!error.to_string().is_empty());
            }
        }
    }
}
