//! The only place that names rapier2d, parry2d and `f32`.
//!
//! A [`rapier2d::prelude::PhysicsWorld`] keeps its bodies, colliders and joints; this module finds
//! the contacts with it and steps it with [`crate::dynamics`] in place of rapier's own solver.
//! Positions, velocities and masses live here in `f64`; rapier gets them rounded.

mod baseline;
mod bodies;
mod convex;
mod detection;
mod dispatcher;
mod joints;
mod kernels;
mod mass;
mod pipeline;
mod points;
mod pose;
mod simulation;
mod widen;

pub use crate::dynamics::Pose64;
pub use baseline::BaselineSettings;
pub use bodies::ExactBody;
pub use detection::{NO_CELL, SurfaceLaw};
pub use pipeline::{MoreauPipeline, MoreauSettings};
pub use simulation::{
    BodyId, ColliderId, FrictionRule, JointDrive, MassSpec, Motion, ShapeSpec, Simulation, Surface,
};
pub use widen::widen;
