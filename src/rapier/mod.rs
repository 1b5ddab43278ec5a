//! The only place that names rapier2d, parry2d and `f32`.
//!
//! A [`rapier2d::prelude::PhysicsWorld`] keeps its bodies, colliders and joints; this module finds
//! the contacts with it and steps it with [`crate::dynamics`] in place of rapier's own solver.
//! Positions, velocities and masses live here in `f64`; rapier gets them rounded.
//!
//! # Single or double precision
//! [`engine`] is rapier2d, or rapier2d-f64 with the feature `f64`; write `use
//! moreau2d::rapier::engine::prelude::*` and a program builds with both. In single precision
//! gaps of shapes without a kernel of ours are good to 1e-7 of the shapes' size, in double to
//! 1e-15.

mod bodies;
mod body_checks;
mod changes;
#[cfg(feature = "debug-render")]
mod debug_render;
mod detection;
mod joint_checks;
mod joint_rows;
mod joints;
mod kernels;
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

/// Precision in which rapier holds poses and shapes, as tables spell it.
pub const PRECISION: &str = if cfg!(feature = "f64") { "f64" } else { "f32" };

pub use crate::dynamics::Pose64;
pub use bodies::ExactBody;
#[cfg(feature = "debug-render")]
pub use debug_render::ContactStyle;
pub use detection::{DetectionDrive, SurfaceLaw};
pub use pipeline::{MoreauPipeline, MoreauSettings};
pub use results::{HandledContact, StepResults, Totals};
pub use state::{PipelineState, StateError};
pub use widen::widen;
