use super::super::simulation::{BodyId, Simulation};
use super::{BOX2D_MISSING, Box2dSettings};
use crate::dynamics::record::StepRecord;
use crate::dynamics::{ModelError, StepError};

/// Placeholder without values: the feature `box2d` is off.
#[derive(Debug)]
pub enum Box2d {}

impl Box2d {
    /// # Errors
    /// [`ModelError::Unsupported`] with [`BOX2D_MISSING`], always.
    pub fn copy(
        _: &Simulation,
        _: &Box2dSettings,
        _: &[(BodyId, String)],
    ) -> Result<Box2d, ModelError> {
        Err(ModelError::Unsupported(BOX2D_MISSING.to_owned()))
    }

    /// Never called, as [`Box2d`] has no values.
    ///
    /// # Errors
    /// None.
    pub fn step(&mut self, _: &mut Simulation) -> Result<StepRecord, StepError> {
        match *self {}
    }
}
