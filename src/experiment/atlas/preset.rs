//! The settings with which the atlas runs each engine: its defaults, and the remedy that its own
//! documentation recommends if the defaults fail.

use super::super::baseline::Baseline;
use super::super::setting::Setting;
use super::super::simulate::Engine;
use crate::peers::Box2dSettings;
use crate::report::ResultRow;
use crate::scene::Scene;

/// An engine with its settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Preset {
    pub engine: Engine,
    /// Name in the column `engine` of the results.
    pub name: &'static str,
    /// Name in the column `setting`.
    pub setting: &'static str,
    /// Settings of a peer.
    pub baseline: Option<Baseline>,
    /// For our engine: whether impacts are located in time in every scene.
    events: bool,
}

impl Preset {
    /// The engine as the failure atlas runs it.
    pub fn of(engine: Engine) -> Preset {
        Preset {
            engine,
            name: engine.name(),
            setting: match engine {
                Engine::Moreau | Engine::Rapier | Engine::Box2d => "default",
                Engine::RapierStiff => "stiff",
            },
            baseline: engine.baseline(),
            events: false,
        }
    }

    /// Every engine of this build with its defaults and with its remedy. The remedy of our engine is
    /// event location. That of rapier and Box2D is ten times the substeps, and contacts as stiff as
    /// these allow.
    pub fn with_remedies() -> Vec<Preset> {
        let mut all = Vec::new();
        for (_, engine) in Engine::ALL {
            all.push(Preset::of(engine));
            match engine {
                Engine::Moreau => all.push(Preset {
                    name: "moreau-events",
                    setting: "events",
                    events: true,
                    ..Preset::of(engine)
                }),
                Engine::Box2d => all.push(Preset {
                    name: "box2d-stiff",
                    setting: "stiff",
                    baseline: Some(Baseline::Box2d(Box2dSettings {
                        contact_frequency: 300.0,
                        substeps: 40,
                    })),
                    ..Preset::of(engine)
                }),
                // `RapierStiff` is the remedy of `Rapier`
                Engine::Rapier | Engine::RapierStiff => {}
            }
        }
        all
    }

    /// The scene with the settings that concern our engine.
    pub(super) fn scene(&self, scene: &Scene) -> Scene {
        let mut scene = scene.clone();
        scene.step.events |= self.events;
        scene
    }

    /// A row of the results without a measure.
    pub(super) fn row(&self, scene: &Scene) -> ResultRow {
        let setting = Setting::new(self.engine, &scene.step);
        ResultRow {
            engine: self.name.to_owned(),
            setting: self.setting.to_owned(),
            ..super::super::results::row(scene, &setting)
        }
    }
}
