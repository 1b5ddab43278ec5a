//! Guides: how to step a world of one's own, build a scene, bring a solver, and what of rapier2d is
//! there. Documentation alone; every example is compiled and run.
//!
//! | guide | for |
//! |---|---|
//! | [`first_step`] | those who have a rapier2d world and call `world.step()` |
//! | [`own_scene`] | those who build a machine: outlines, motors, belts, soft surfaces, wear |
//! | [`own_solver`] | those who compare impulse solvers or write one |
//! | [`data_flow`] | those who change the code: how a contact becomes an impulse, and an impulse wear |
//! | [`features`] | what of rapier2d is there, what is not, and the test that says so |
//!
//! Scene files are described in [`crate::scene`], the comparison with rapier in
//! [`crate::experiment`].

pub mod data_flow;
pub mod features;
pub mod first_step;
pub mod own_scene;
pub mod own_solver;
