use crate::dynamics::ModelError;
use crate::peers::{BaselineSettings, Box2dSettings};
use crate::scene::Built;
use std::fmt;

/// Solver settings of a peer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Baseline {
    Rapier(BaselineSettings),
    Box2d(Box2dSettings),
}

impl Baseline {
    /// Applies the settings to a world that has not been stepped.
    ///
    /// # Errors
    /// [`ModelError::Unsupported`] for a world that is not rapier's; those of
    /// [`crate::peers::Box2d::copy`].
    pub fn prepare(&self, built: &mut Built) -> Result<(), ModelError> {
        match self {
            Baseline::Rapier(settings) => built.peer()?.set_baseline(settings),
            Baseline::Box2d(settings) => built.set_box2d(settings)?,
        }
        Ok(())
    }

    /// Sweeps over all contacts in a step; for Box2D without its relaxation sweeps, which use no bias.
    pub fn sweeps(&self) -> usize {
        match self {
            Baseline::Rapier(settings) => settings.substeps * settings.iterations,
            Baseline::Box2d(settings) => settings.substeps,
        }
    }
}

/// Prints all settings, as tables and charts show them.
impl fmt::Display for Baseline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Baseline::Rapier(settings) => settings.fmt(f),
            Baseline::Box2d(settings) => settings.fmt(f),
        }
    }
}
