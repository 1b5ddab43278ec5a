//! Clusters of bodies that collide, stop sliding or turn far within a step, or whose links need shorter
//! steps. Each is stepped separately from event to event.

mod account;
mod all;
mod bounce;
mod context;
mod counts;
mod held;
mod instant;
mod meetings;
mod records;
mod runner;
mod search;
mod setup;
mod slides;
mod stops;
mod turns;
mod watch;
mod watched;

pub(super) use all::locate_impacts;
pub(super) use context::{Cluster, Context};
pub(super) use counts::LATE;
