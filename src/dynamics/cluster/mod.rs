//! Clusters of bodies that collide, or stop sliding, within a step. Each is stepped separately from event to event.

mod all;
mod instant;
mod runner;
mod search;
mod slides;
mod stops;

pub(super) use all::locate_impacts;
pub(super) use runner::{Cluster, Context};
