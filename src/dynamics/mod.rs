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
//! What enters (4) for each contact is the [`Scheme`]: the published activation rule, or the
//! staggered one, which is second order in persistent contact. With the staggered one
//!
//! - impacts can be located in time ([`StepperSettings::events`]): bodies that collide inside a
//!   step are stepped by themselves to the instant, through an impact of no duration, and on;
//! - the [`ImpactLaw`] says what they return, by default Newton's law that never adds energy;
//! - pairs that start overlapped are moved apart by position alone
//!   ([`StepperSettings::recovery`]).
//!
//! # From contacts to a step
//! ```text
//! Detection            what the model found at the midpoint: contacts, rows of joints
//! Interval             posed: the blocks that take part, each with b, law and impulse to start from
//! WorkingSet           which of them are near enough to matter
//! Islands              groups of blocks that share bodies
//! IslandProblem        one island, posed: its contact problem and what its blocks are made of
//! Worker               solves it: Newton's method or another solver, bounds on energy, fallback
//! IslandResult         what became of it
//! Solution             of all islands: impulses, velocities at the end; the interval is as it was
//! StepRecord           what everyone else reads
//! ContactCache         handed on to the next step, by contact and joint
//! IslandCache          the same by island: factors, fallback state
//! ```
//! `MoreauStepper` owns all of it. Nothing but the two caches and the time survives a step; all else
//! is kept for its capacity only.

mod cluster;
mod collect;
mod contact_cache;
mod energy_bound;
mod events;
mod fallback;
#[cfg(test)]
mod fallback_tests;
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
mod local_bodies;
mod model;
mod outcome;
mod phases;
mod pose;
pub mod record;
mod recording;
mod recovery;
mod redundancy;
mod roles;
mod rules;
pub(crate) mod saved;
mod settings;
mod solution;
mod solve;
mod step;
mod stepper;
#[cfg(feature = "parallel")]
mod thread_pool;
#[cfg(not(feature = "parallel"))]
#[path = "thread_pool_absent.rs"]
mod thread_pool;
mod working_set;

pub(crate) use contact_cache::CachedContact;
pub(crate) use islands::Islands;
pub use joint::RowName;
pub use joint_frames::{Bend, Coordinate, JointFrames};
pub use model::{
    Configuration, ContactKey, ContactPoint, Detection, JointCoordinate, JointKind, JointPart,
    JointRow, ModelError, MultibodyModel, NormalLaw, Spring,
};
pub use outcome::SolvedProblem;
pub use phases::{Clock, Phases};
pub use pose::Pose64;
pub use roles::{BodyRoles, Sweep};
pub use rules::{ImpactLaw, Scheme};

pub use settings::{MOST_THREADS, StepError, StepperSettings};
pub use stepper::MoreauStepper;
pub(crate) use stepper::StepperState;
