//! Clusters of bodies that collide within a step. Each is stepped separately from event to event.

mod all;
mod instant;
mod runner;
mod search;

pub(super) use all::locate_impacts;
pub(super) use runner::{Cluster, Context};
