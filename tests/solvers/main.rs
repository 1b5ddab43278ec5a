//! Impulse solvers and their judge on stored and random problems.

#[path = "../common/mod.rs"]
mod common;

mod collection;
mod judge_properties;
mod lcp;
mod rest;
mod solver_properties;
