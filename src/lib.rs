//! Exact nonsmooth contact, and the wear that follows from it, for rapier2d worlds.
#![forbid(unsafe_code)]

pub mod contact;
pub mod dynamics;
mod linalg;
pub mod rapier;
pub mod solver;
pub mod wear;

#[cfg(feature = "lab")]
pub mod cli;
#[cfg(feature = "lab")]
pub mod experiment;
#[cfg(feature = "lab")]
pub mod guide;
#[cfg(feature = "lab")]
pub mod models;
#[cfg(feature = "lab")]
pub mod oracles;
#[cfg(feature = "lab")]
pub mod peers;
#[cfg(feature = "lab")]
pub mod problems;
#[cfg(feature = "lab")]
pub mod report;
#[cfg(feature = "lab")]
pub mod scene;
#[cfg(feature = "lab")]
pub mod thresher;

/// The README, whose code must run.
#[cfg(all(doctest, feature = "lab"))]
#[doc = include_str!("../README.md")]
pub struct Readme;
