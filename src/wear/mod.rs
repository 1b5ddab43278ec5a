//! Archard wear of a surface: from the contact records of a simulated cycle to the life of a part.
//!
//! ```text
//! contact records → load_slip per node → Archard depth → cycle jump → profile → re-mesh → life
//! ```
//!
//! # Conventions
//!
//! A [`Profile`] is an open polyline in the frame of the part, from its tall end to its toe, with
//! the solid on its right: `x` grows along it, and the outward normal is the tangent turned by +90
//! degrees. A ring is closed, and has no ends. Detection names the **edge** of a contact and the place on it
//! ([`ContactRecord::places`]), and only they decide where the contact wears. A **node** belongs to
//! the current mesh. A **cell** is a station `x` of the first mesh and never changes, so that reports
//! keep their columns when the mesh changes ([`CellMap`]). Both count from 0 here; the first cell of a table is
//! cell 1.
//!
//! A planar scene is one metre deep: loads are per metre of width, and a worn area \[m²\] is a worn
//! volume per metre. Depth is positive for removed material.
//!
//! # Sources
//!
//! Archard, J. Appl. Phys. 24 (1953); Põdra & Andersson, Tribol. Int. 32 (1999), wear by explicit
//! steps on a Winkler foundation; Ibrahim, Shash & Abboud, DYSONA Appl. Sci. 6(1) (2025), the
//! tooth of the thresher.

#[cfg(doc)]
use crate::dynamics::record::ContactRecord;

mod archard;
mod cells;
#[cfg(test)]
mod closed_forms;
mod contain;
mod jump;
mod life;
mod polygon;
mod profile;
mod remesh;
mod state;
mod update;

pub use archard::{Archard, LoadSlip};
pub use cells::CellMap;
pub use jump::{Jump, JumpBound, JumpRule, MOST_JUMPS, trapezoid_error};
pub use life::{Life, LifePoint, Limit, LimitLife, Measure};
pub use polygon::{check_chain, check_polygon, signed_area};
pub use profile::Profile;
pub use remesh::{clip_loops, remesh};
pub use state::{PlannedStep, WearSettings, WearState, WearStep};
pub use update::{Update, refit_quadratic, smooth_depths, wear_normal};

use thiserror::Error;

/// Errors of a wear computation.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum WearError {
    /// A number is NaN or infinite.
    #[error("wear: {what} {index} is not finite")]
    NonFinite { what: &'static str, index: usize },
    /// Two arrays disagree in length.
    #[error("wear: {what} has {found} values, must have {expected}")]
    Length {
        what: &'static str,
        found: usize,
        expected: usize,
    },
    /// A number is outside its range.
    #[error("wear: {what} is {value}, must be {allowed}")]
    Range {
        what: &'static str,
        value: f64,
        allowed: &'static str,
    },
    /// Too few nodes for a profile or polygon, or for a merge that keeps the area.
    #[error("wear: {found} nodes, needs at least {needed}")]
    TooFewNodes { found: usize, needed: usize },
    /// Two nodes in a row coincide.
    #[error("wear: the edge after node {node} has no length")]
    ZeroEdge { node: usize },
    /// Two edges cross or touch; an edge is named by the node it starts from.
    #[error("wear: the edges after nodes {first} and {second} cross")]
    Crossing { first: usize, second: usize },
    /// A polygon runs clockwise, or a profile from its toe to its tall end.
    #[error("wear: wrong winding, signed measure {measure}")]
    Winding { measure: f64 },
    /// A jump wears more than the mesh can follow.
    #[error("wear: the jump wears {depth} m at node {node}, at most {limit} m is allowed")]
    JumpTooLong { node: usize, depth: f64, limit: f64 },
    /// A surface too curved for its depth or its cells: the requested area cannot be removed along
    /// the normals, or no merged node stays within the new part.
    #[error(
        "wear: the surface is too curved at node {node} for the requested depth, or for its cells"
    )]
    Unbalanced { node: usize },
    /// A part that is thinner than its surface sinks in under load: what touches it reaches through.
    #[error(
        "wear: {left:.3e} m are left under node {node}, which sinks in by {sinks:.3e} m under its load"
    )]
    Thin { node: usize, left: f64, sinks: f64 },
    /// The wear has reached the underside of the base.
    #[error("wear: node {node} at y = {y} m is worn through the base, {base} m thick")]
    WornThrough { node: usize, y: f64, base: f64 },
}

/// Refuses NaN and infinity, naming the first such number.
fn all_finite(what: &'static str, values: &[f64]) -> Result<(), WearError> {
    match values.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(WearError::NonFinite { what, index }),
        None => Ok(()),
    }
}

/// Refuses an array of the wrong length.
fn same_length(what: &'static str, found: usize, expected: usize) -> Result<(), WearError> {
    if found == expected {
        Ok(())
    } else {
        Err(WearError::Length {
            what,
            found,
            expected,
        })
    }
}

/// Refuses a number outside its range; NaN is outside every range.
fn in_range(
    what: &'static str,
    value: f64,
    inside: bool,
    allowed: &'static str,
) -> Result<(), WearError> {
    if inside {
        Ok(())
    } else {
        Err(WearError::Range {
            what,
            value,
            allowed,
        })
    }
}
