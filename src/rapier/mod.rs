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

mod baseline;
mod bodies;
mod body_checks;
mod box2d;
mod changes;
mod detection;
mod joint_checks;
mod joint_rows;
mod joint_spec;
mod joints;
mod kernels;
mod mass;
mod peer;
mod pipeline;
mod pose;
mod queries;
mod reporter;
mod results;
mod shadow;
mod simulation;
mod sleeping;
mod state;
mod surfaces;
mod widen;

#[cfg(not(feature = "f64"))]
pub use rapier2d as engine;
#[cfg(feature = "f64")]
pub use rapier2d_f64 as engine;

/// Precision in which rapier holds poses and shapes, as tables spell it.
pub const PRECISION: &str = if cfg!(feature = "f64") { "f64" } else { "f32" };

pub use crate::dynamics::Pose64;
pub use baseline::BaselineSettings;
pub use bodies::ExactBody;
pub use box2d::{BOX2D_MISSING, Box2d, Box2dSettings};
pub use detection::{DetectionDrive, SurfaceLaw};
pub use joint_spec::{JointDrive, JointShape, JointSpec};
pub use pipeline::{MoreauPipeline, MoreauSettings};
pub use results::{HandledContact, StepResults, Totals};
pub use simulation::{
    BodyId, ColliderId, FrictionRule, MassSpec, Motion, ShapeSpec, Simulation, Surface,
};
pub use state::{PipelineState, StateError};
pub use widen::widen;
