//! Wear of the colliders of a rapier world, whatever they are: a pin, a rail, a tooth, a roller.
//!
//! [`WornColliders`] stands above [`crate::rapier`] and [`crate::wear`], which do not know each other.
//! It reads load and slip of every cell from the records of the steps, wears the surfaces by as much
//! time as their feedback allows, and gives the colliders their new shapes in the user's own world.
//!
//! ```
//! use moreau2d::rapier::engine::prelude::*;
//! use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
//! use moreau2d::wear::JumpRule;
//! use moreau2d::worn::{WearingSurface, WornColliders};
//!
//! let mut world = PhysicsWorld::new();
//! let disc = RigidBodyBuilder::kinematic_velocity_based().linvel(Vector::new(0.5, 0.0));
//! let face = ColliderBuilder::cuboid(4.0, 0.1).translation(Vector::new(0.0, -0.1));
//! world.insert(disc, face.friction(0.0));
//! let pin = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.02));
//! let steel = ColliderBuilder::cuboid(0.005, 0.02).density(1000.0).friction(0.0);
//! let (_, pin) = world.insert(pin, steel);
//! let mut pipeline = MoreauPipeline::new(MoreauSettings::default())?;
//!
//! // a jump wears at most 0.1 mm
//! let mut worn = WornColliders::new(JumpRule { depth: 1e-4, ..JumpRule::default() });
//! let lower_face = WearingSurface { edges: Some([0, 0]), ..WearingSurface::new(1e-13) };
//! let pin = worn.add(&mut world, &mut pipeline, pin, lower_face)?;
//! while worn.seconds() < 3.6e6 {
//!     for step in 0..60 {
//!         let record = pipeline.step(&mut world)?;
//!         // it comes down on its new surface before it is measured
//!         if step >= 30 {
//!             worn.measure(&record)?;
//!         }
//!     }
//!     worn.jump(&mut world, &mut pipeline, 3.6e6)?;
//! }
//! // K F s / A
//! let depth = 1e-13 * (1000.0 * 0.01 * 0.04 * 9.81) * (0.5 * 3.6e6) / 0.01;
//! for found in worn.state(pin).depth() {
//!     assert!((found / depth - 1.0).abs() < 1e-3, "{found} {depth}");
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What wears
//! One-sided polylines, open and closed, boxes, triangles, convex polygons and balls. Each becomes a
//! one-sided polyline whose worn edges are cut into cells. A ball becomes a regular polygon, and not a
//! ball of smaller radius: a ball that slides gets a flat, and one that rolls wears evenly of itself.
//! Both sides of a contact may wear, each with its own coefficient, and any number of colliders.
//!
//! Wear moves an open part of an outline between the edges beside it: its ends move along them. A
//! whole outline moves inwards everywhere, a sharp corner along its bisector: where only one face of a
//! box is touched, let only this one wear. Where an outline crosses itself the body is worn through, which
//! is an error, and everything stays as before the jump.
//!
//! # Time
//! One load cycle of [`crate::wear`] is one second here: a measurement of any length gives wear rates
//! per second, and a jump is a number of seconds.
//!
//! # Long jumps and rigid contacts
//! A jump is bounded in metres. If a node would wear by more than its elastic penetration,
//! `K k S > 1`, explicit wear is not monotone and soon not stable; on rigid contacts it never is, as
//! their shares of a load are not unique. The surfaces then wear with wear compliance,
//! [`Archard::worn_modulus`](crate::wear::Archard::worn_modulus): that jump only plans, and from then on
//! they yield by what they will wear in the planned jump, over the sliding distance of a loaded node.
//!
//! A cell yields along its own normal. A body that slides by at speed `v` meets a cell that slopes by α
//! with the normal speed `v sin α`, though its surface stays where it is: keep `v sin α Δt` well below
//! the depth of a jump. [`Jumped::open_load`] says how well. A flat pin does not slope, and a
//! counterface at rest with a surface speed (a belt) has no such part at all.
//!
//! # Sleep
//! A body that sleeps is in no record and would wear by nothing under any load. From the first wearing
//! collider on, all bodies of the pipeline stay awake.

mod colliders;
mod face;
mod jumps;

pub use colliders::{WearingSurface, WornColliders};
pub use jumps::Jumped;

use crate::dynamics::ModelError;
use crate::rapier::MOST_CELLS;
use crate::wear::WearError;
use thiserror::Error;

/// Why colliders cannot wear, or no further. Surfaces count from 0 in the order in which they were
/// added.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum WornError {
    /// The collider cannot be read or changed.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// An edge that the collider does not have.
    #[error("edges {found:?}: the surface has the edges 0 to {last}{order}")]
    Edges {
        found: [usize; 2],
        last: usize,
        order: &'static str,
    },
    /// A cell too long for the shortest edge that wears.
    #[error("cell {cell} m: edge {edge} is {length} m long, a cell may have twice that at most")]
    Cell { cell: f64, edge: usize, length: f64 },
    /// More cells than [`MOST_CELLS`].
    #[error(
        "cell {cell} m: the surface would have {cells} cells, at most {MOST_CELLS} are allowed"
    )]
    Cells { cell: f64, cells: f64 },
    /// A moving surface carries its own material along, from cell to cell.
    #[error(
        "the surface moves at {speed} m/s along itself: its material does not stay in its cells. \
         Move the body instead"
    )]
    SurfaceSpeed { speed: f64 },
    /// The collider wears already.
    #[error("the collider wears already, as surface {surface}")]
    Twice { surface: usize },
    /// The settings or the geometry of a surface.
    #[error("surface {surface}: {source}")]
    Wear { surface: usize, source: WearError },
    /// The outline crosses itself: nothing of the last jump is kept.
    #[error("surface {surface} is worn through itself after {seconds:.5e} s of wear: {source}")]
    WornThrough {
        surface: usize,
        seconds: f64,
        source: WearError,
    },
    /// A jump without a measured step.
    #[error("nothing was measured since the last jump")]
    Unmeasured,
    /// A jump to a time that is past, or not finite.
    #[error("a jump until {until} s: {worn} s are worn already, it must be later and finite")]
    Past { until: f64, worn: f64 },
    /// The pipeline may put bodies to sleep.
    #[error(
        "bodies may sleep: a body that sleeps under load would wear by nothing; keep them awake"
    )]
    Sleeps,
}

impl WornError {
    /// The surface that the error is about, if it was added already.
    pub fn surface(&self) -> Option<usize> {
        match self {
            WornError::Wear { surface, .. } | WornError::WornThrough { surface, .. } => {
                Some(*surface)
            }
            _ => None,
        }
    }
}
