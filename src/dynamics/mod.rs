//! Moreau's midpoint step over any multibody model.
//!
//! ```text
//! q_M = q_A + u_A Δt/2                                                        (1)
//! contacts at q_M: gaps g, frames, rows W                                     (2)
//! u_F = u_A + M⁻¹ h Δt                                                        (3)
//! impulses P from the contact problem of `crate::contact`                     (4)
//! u_E = u_F + M⁻¹ W P                                                         (5)
//! q_E = q_M + u_E Δt/2                                                        (6)
//! ```
//!
//! The [`Scheme`] decides how each contact enters (4): by the published activation rule, or by the
//! staggered one, which is second order in persistent contact. With the staggered scheme
//!
//! - the stepper can locate impacts in time ([`StepperSettings::events`]): bodies that collide
//!   inside a step are stepped separately, to the instant of the impact, through an impact of zero
//!   duration, and on;
//! - the [`ImpactLaw`] gives their rebound, by default Newton's law with an energy bound;
//! - joints are closed at midpoints. Of the poses (6) those are shown that have them closed at the end of the
//!   step too ([`MultibodyModel::show`]); the next step goes on from (6);
//! - pairs that overlap at the start are moved apart by position alone
//!   ([`StepperSettings::recovery`]);
//! - contacts and joints give back no more energy than they took ([`record::StepEnergy::returned`]).
//!
//! # From contacts to a step
//! ```text
//! Detection            contacts and joint rows that the model found at the midpoint
//! Interval             the blocks that take part, each with b, law and start impulse
//! WorkingSet           the blocks near enough to matter
//! Islands              groups of blocks that share bodies
//! IslandProblem        the contact problem of one island, and data of its blocks
//! Worker               solves one island: solver, energy bounds, crowds
//! IslandResult         the outcome of one island
//! Solution             impulses and end velocities of all islands; leaves the interval unchanged
//! StepRecord           the public record of the step
//! ContactCache         data for the next step, by contact and joint
//! IslandCache          data for the next step, by island: factors, crowds
//! ```
//! `MoreauStepper` owns all of them. Only the two caches and the time carry over to the next step;
//! everything else is stored only to reuse its memory. `PipelineState` of the rapier adapter saves
//! these three, together with the adapter's own data, such as the exact poses of the bodies.

mod angular_momentum;
mod asked;
mod at_rest;
mod closings;
mod cluster;
mod collect;
mod constraint_work;
mod contact_cache;
mod crowd;
mod cut_links;
mod debts;
mod deep_impacts;
mod displacements;
mod driven;
mod ends;
mod energy_bound;
mod events;
mod farther;
mod first_step;
mod gap_resolution;
mod impacts;
mod interval;
mod island;
mod island_cache;
mod island_problem;
mod islands;
mod joint;
mod joint_frames;
mod joint_recovery;
mod joint_rules;
mod kinetic;
mod late_rebounds;
mod midpoint_gaps;
mod model;
mod outcome;
mod overlapping;
mod pair_set;
mod phases;
mod pose;
mod pulled_links;
pub mod record;
mod recording;
mod recovery;
mod redundancy;
mod reserve;
mod resting;
mod roles;
mod rules;
pub(crate) mod saved;
mod scaled;
mod settings;
mod shown;
mod solution;
mod solve;
mod step;
mod step_results;
mod stepper;
mod surface_point;
mod thread_pool;
mod turned_impacts;
mod visco_elastic;
mod wide_turns;
mod working_set;

pub(crate) use contact_cache::CachedContact;
pub(crate) use islands::Islands;
pub use joint::RowName;
pub use joint_frames::{Bend, Coordinate, JointFrames};
pub use model::{
    Configuration, ContactKey, ContactPoint, Detection, JointCoordinate, JointKind, JointPart,
    JointRow, ModelError, MultibodyModel, NearPair, NearWanted, NormalLaw, Shown, Spring,
};
pub use outcome::SolvedProblem;
pub use overlapping::{LARGE_OVERLAP, LASTING};
pub use phases::{Clock, Phases};
pub use pose::Pose64;
pub use roles::{BodyRoles, Sweep};
pub use rules::{Effort, ImpactLaw, Scheme};

pub use settings::{MOST_THREADS, StepError, StepperSettings};
pub use stepper::MoreauStepper;
pub(crate) use stepper::StepperState;
pub use surface_point::SurfacePoint;
