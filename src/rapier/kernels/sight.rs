//! What earlier poses of two parts tell about the sides on which they are.

use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// What the past of two parts tells about segments, see [`Edge`](super::Edge).
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::rapier) struct Sight {
    /// Per part that is a segment, the face on whose side the other part was.
    pub faces: [Option<usize>; 2],
    /// Motion \[m\] of the other part, seen from each, since the time at which its place decides: half a step
    /// for one-sided segments.
    pub moved: [Vec2; 2],
    /// How far beyond a segment \[m\] the other part may have come through it: the motion of the two in a
    /// step, or any distance if they touched in the last one.
    pub motion: f64,
    /// If the two did not touch in the last step: per part that is a segment, the face on whose side the
    /// other part touched a neighbour of the segment.
    pub beside: [Option<usize>; 2],
    /// Poses of the two at the start of the step, for a two-sided segment with another segment, where
    /// they tell the sides.
    pub start: Option<[Pose64; 2]>,
    /// If a part is rounded, poses of the two at the start of the step, or now within one.
    pub began: Option<[Pose64; 2]>,
    /// Per part that is a two-sided segment, the one face on which it touched others in the last step.
    pub elsewhere: [Option<usize>; 2],
    /// Centres of mass of the two bodies at the start of the step.
    pub centers: [Vec2; 2],
    /// Whether the last step found a contact of two sharp ones. Their poses at the start of the step
    /// may then be across each other, by rounding or by what is left of an overlap.
    pub touched: bool,
    /// The faces that two segments of chains show each other, where these are nearest to each other.
    pub told: Option<[Option<usize>; 2]>,
}

/// The part of a [`Sight`] that belongs to one segment, in its frame.
#[derive(Clone, Copy)]
pub(in crate::rapier) struct Past {
    pub face: Option<usize>,
    pub moved: Vec2,
    pub motion: f64,
}

impl Sight {
    /// What belongs to part `own`, at its pose.
    pub(super) fn of(&self, own: usize, pose: &Pose64) -> Past {
        Past {
            face: self.faces[own],
            moved: pose.unrotate(self.moved[own]),
            motion: self.motion,
        }
    }
}
