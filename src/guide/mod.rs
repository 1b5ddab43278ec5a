//! Guides: how to step your own world, build a scene and write a solver, and which features of rapier2d
//! are supported. Documentation only; every example is compiled and run.
//!
//! | guide | for |
//! |---|---|
//! | [`first_step`] | users who have a rapier2d world and call `world.step()` |
//! | [`own_scene`] | users who build a machine: outlines, motors, belts, soft surfaces, wear |
//! | [`pin_on_disc`] | users whose bodies wear: from a scene file, from a program |
//! | [`sweeps`] | users who need a scene over many values of its keys, on one machine or on a cluster |
//! | [`stopped_runs`] | users whose runs take hours: what is kept of one that was stopped |
//! | [`own_solver`] | users who compare impulse solvers or write one |
//! | [`data_flow`] | those who change the code: how a contact becomes an impulse, and an impulse wear |
//! | [`features`] | which features of rapier2d are supported, with the test of each |
//!
//! Scene files are described in [`crate::scene`], the comparison with rapier in
//! [`crate::experiment`].

pub mod data_flow;
pub mod features;
pub mod first_step;
pub mod own_scene;
pub mod own_solver;
pub mod pin_on_disc;
pub mod stopped_runs;
pub mod sweeps;
