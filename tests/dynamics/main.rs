//! The time step: closed forms, order, events, caches, threads, determinism.

#[path = "../common/mod.rs"]
mod common;

mod belt;
mod bridge;
mod closed_forms;
mod closed_loops;
mod crowds;
mod determinism;
mod driven;
mod energy;
mod events;
mod events_worse;
mod exact_discs;
mod factor_cache;
mod given_energy;
mod heaps;
mod large_discs;
mod late_overlap;
mod late_rebounds;
mod meetings;
mod momentum;
mod own_solver;
mod reductions;
mod shown_joints;
mod slides;
mod sticking;
mod terrain;
mod threads;
mod thrown_together;
mod work_counts;
