//! Where a contact lies on a surface.

use serde::{Deserialize, Serialize};

/// A place on one surface of a contact, as detection found it.
///
/// It belongs to the surface itself, not to the middle of the gap, and to the configuration in which
/// the contact was found.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct SurfacePoint {
    /// The edge, or cell, that the contact lies on: the segment number of a polyline, from 0; the
    /// part's number on a surface of other parts; 0 on a surface of one piece.
    pub edge: u32,
    /// Fraction of the way along a segment, or the axis of a capsule, from 0 at its first point to 1
    /// at its second: a load there has the weights `1 − at` and `at` at the two. The end of one
    /// segment is the start of the next. 0 on any other part.
    pub at: f64,
}

impl SurfacePoint {
    /// A place on a part that is no segment.
    pub fn on(edge: u32) -> SurfacePoint {
        SurfacePoint { edge, at: 0.0 }
    }
}
