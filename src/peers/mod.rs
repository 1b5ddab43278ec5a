//! One rapier world, stepped by any engine: ours, rapier's own solver, Box2D.
//!
//! A [`Simulation`] describes bodies, surfaces and joints in `f64` and stores them in an ordinary
//! rapier world. Each engine steps that world and writes the same record.

mod baseline;
mod box2d;
mod clock;
mod joint_spec;
mod mass;
mod peer;
mod simulation;
mod surfaces;

pub use baseline::BaselineSettings;
pub use box2d::{BOX2D_MISSING, Box2d, Box2dSettings};
pub use clock::seconds;
pub use joint_spec::{JointDrive, JointShape, JointSpec};
pub use simulation::{
    BodyId, ColliderId, MassSpec, Motion, PairRule, ShapeSpec, Simulation, Surface,
};
