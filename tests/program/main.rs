//! The program as a user types it, and what it writes.

#[path = "../common/mod.rs"]
mod common;

mod accuracy;
mod atlas;
mod bench;
#[cfg(feature = "box2d")]
mod box2d;
#[cfg(not(feature = "box2d"))]
mod box2d_missing;
mod calibrate;
mod catalogue;
mod chart;
mod cli;
mod compare;
mod effect;
mod explain;
mod issues;
mod moving;
mod pages;
mod refused;
mod reports;
mod resume;
mod run_files;
mod run_page;
mod shell;
mod solve;
mod sweep;
mod uncertain;
mod verdict;
mod worn;
