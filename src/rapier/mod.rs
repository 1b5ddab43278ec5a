//! The only place that names rapier2d, parry2d and `f32`.
//!
//! A [`rapier2d::prelude::PhysicsWorld`] owns its bodies, colliders and joints. This module finds
//! the contacts of such a world and steps it with [`crate::dynamics`] in place of rapier's own
//! solver. It stores positions, velocities and masses in `f64` and writes them to rapier rounded.
//!
//! # Single or double precision
//! [`engine`] is rapier2d, or rapier2d-f64 with the feature `f64`. A program that writes `use
//! moreau2d::rapier::engine::prelude::*` builds with both. Shapes without a kernel of this crate
//! have gaps that are accurate to 1e-7 of the shapes' size in single precision, and to 1e-15 in
//! double precision.

mod bodies;
mod body_checks;
mod body_reading;
mod borrowed;
mod changes;
#[cfg(feature = "debug-render")]
mod debug_render;
mod detection;
mod joint_checks;
mod joint_rows;
mod joints;
mod kernels;
mod model;
mod outline;
mod pipeline;
mod pose;
mod queries;
mod reporter;
mod results;
mod shadow;
mod sleeping;
mod state;
mod widen;

#[cfg(not(feature = "f64"))]
pub(crate) use parry2d as parry;
#[cfg(feature = "f64")]
pub(crate) use parry2d_f64 as parry;
#[cfg(not(feature = "f64"))]
pub use rapier2d as engine;
#[cfg(feature = "f64")]
pub use rapier2d_f64 as engine;

/// Precision in which rapier stores poses and shapes, as tables print it.
pub const PRECISION: &str = if cfg!(feature = "f64") { "f64" } else { "f32" };

pub use crate::dynamics::Pose64;
pub use bodies::ExactBody;
#[cfg(feature = "debug-render")]
pub use debug_render::ContactStyle;
pub use detection::{DetectionDrive, SurfaceLaw};
pub use outline::{MOST_CELLS, Outline, Piece};
pub use pipeline::{MoreauPipeline, MoreauSettings};
pub use results::{HandledContact, StepResults, Totals};
pub(crate) use state::raw_handle;
pub use state::{PipelineState, StateError};
pub use widen::widen;
