//! Exact nonsmooth contact, and the wear that follows from it, for rapier2d worlds.
#![forbid(unsafe_code)]

pub mod cli;
pub mod contact;
pub mod dynamics;
pub mod experiment;
pub mod guide;
pub mod rapier;
pub mod report;
pub mod scene;
pub mod solver;
pub mod thresher;
pub mod wear;

/// The README, whose code must run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
