//! Exact nonsmooth contact, and the wear that follows from it, for rapier2d worlds.
#![forbid(unsafe_code)]

pub mod contact;
pub mod scene;
pub mod solver;
pub mod dynamics;
