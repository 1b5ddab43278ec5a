//! The plug-in on rapier worlds: what users see of it.

#[path = "../common/mod.rs"]
mod common;

mod bent_seams;
mod bodies;
mod borrowed;
mod cells;
mod covers;
#[cfg(feature = "debug-render")]
mod debug_render;
mod detection;
mod dominance;
mod drops;
mod edits;
mod fast_bodies;
mod features;
mod gaps;
mod hand_written;
mod hooks;
mod impacts;
mod joint_changes;
mod joints;
mod left_out;
mod linear_models;
mod long_run;
mod outlines;
mod places;
mod planar_models;
mod queries;
mod rapier_scenes;
mod rapier_seam;
mod reach;
mod reserves;
mod resting;
mod results;
mod resume;
mod seam_matrix;
mod seams;
mod sleeping;
mod springs;
mod tips;
mod user_worlds;
