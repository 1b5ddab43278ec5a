//! Segments of polylines: which directions a contact with one may take.
//!
//! Two segments that meet are one surface. A point near their common corner belongs to the one
//! that is nearer, and to the corner itself only within the wedge between the two normals: where
//! the surface is flat or hollow that wedge is empty, and nothing stumbles over the joint (the
//! "ghost collisions" of rapier's issues 669 and 643). Every direction outside is refused, as the
//! neighbour has a nearer point.
//!
//! Inside the solid it is the bisector of two segments that parts them, see [`Edge::ridge`].
//!
//! Source: Ericson, *Real-Time Collision Detection* (2005), §5.1 (Voronoi regions of features).

use super::Touch;
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// A segment with what its neighbours leave to it, in the frame of its collider \[m\].
#[derive(Debug, Clone, PartialEq)]
pub(in crate::rapier) struct Edge {
    pub ends: [Vec2; 2],
    /// On the right of its direction, and its opposite.
    pub normals: [Vec2; 2],
    /// Where the neighbour leads from each end, as a unit vector.
    pub neighbours: [Option<Vec2>; 2],
    /// Whether contacts at a corner are reported by this segment rather than by the neighbour.
    pub owns: [bool; 2],
    /// Solid behind, on the left: met from the right only.
    pub one_sided: bool,
}

impl Edge {
    /// A segment by itself, from `a` to `b`; `None` if it has no length.
    pub fn new(a: Vec2, b: Vec2, one_sided: bool) -> Option<Edge> {
        let along = (b - a).try_normalize(0.0).filter(|t| t.x.is_finite())?;
        let normal = Vec2::new(along.y, -along.x);
        Some(Edge {
            ends: [a, b],
            normals: [normal, -normal],
            neighbours: [None, None],
            owns: [true, true],
            one_sided,
        })
    }

    /// The face (0 right, 1 left) on whose side a shape centred at `center` lies, with its
    /// distance from the line \[m\]; `None` behind a one-sided segment.
    pub fn side(&self, center: Vec2) -> (Option<usize>, f64) {
        let height = self.normals[0].dot(&(center - self.ends[0]));
        match (height >= 0.0, self.one_sided) {
            (true, _) => (Some(0), height),
            (false, false) => (Some(1), -height),
            (false, true) => (None, -height),
        }
    }

    /// How much of the segment at corner `end` a depth under `face` takes, length by depth: up to
    /// the bisector with the neighbour. Zero at a flat or hollow corner.
    pub fn ridge(&self, end: usize, face: usize) -> f64 {
        let Some(leads) = self.neighbours[end] else {
            return 0.0;
        };
        let outward = (self.ends[end] - self.ends[1 - end]).normalize();
        half_turn(-leads.dot(&self.normals[face]), leads.dot(&outward))
    }

    /// Whether corner `end` may be met along `direction`.
    pub fn admits(&self, end: usize, direction: Vec2) -> bool {
        if self.one_sided && direction.dot(&self.normals[0]) < 0.0 {
            return false;
        }
        let outward = self.ends[end] - self.ends[1 - end];
        direction.dot(&outward) >= 0.0
            && self.neighbours[end].is_none_or(|leads| direction.dot(&leads) <= 0.0)
    }
}

/// `tan(δ/2)` of a turn by δ; zero for one to the other side.
pub(super) fn half_turn(sin: f64, cos: f64) -> f64 {
    // folded back on itself it is as good as closed
    sin.max(0.0) / (1.0 + cos.max(-1.0 + 1e-12))
}

/// The point of a segment nearest to a ball's centre; none where a neighbour is nearer, or from
/// behind. Returns a lower bound of the gap, or of the way to where there may be one \[m\].
pub(super) fn edge_ball(
    pose: &Pose64,
    edge: &Edge,
    rounding: f64,
    center: Vec2,
    radius: f64,
    reach: f64,
    out: &mut Vec<Touch>,
) -> f64 {
    let c = pose.apply_inverse(center);
    let (face, height) = edge.side(c);
    let Some(face) = face else {
        return reach + height;
    };
    let [a, b] = edge.ends;
    // both segments of a corner ask the same question of it, so that one of them answers
    let beyond = [(c - a).dot(&(b - a)) <= 0.0, (c - b).dot(&(a - b)) <= 0.0];
    let both = radius + rounding;
    let (normal, distance, feature) = if let Some(end) = beyond.iter().position(|&far| far) {
        let away = c - edge.ends[end];
        let distance = away.norm();
        let leads = edge.neighbours[end];
        let nearer = leads.is_some_and(|leads| away.dot(&leads) > 0.0);
        if nearer || !edge.owns[end] || distance == 0.0 {
            return distance - both;
        }
        if edge.one_sided && away.dot(&edge.normals[0]) < 0.0 {
            return distance - both;
        }
        (away / distance, distance, 1 + end as u32)
    } else {
        (edge.normals[face], height, 0)
    };
    let gap = distance - both;
    if gap <= reach {
        let surface = c - normal * (radius + 0.5 * gap);
        out.push(Touch {
            normal: pose.rotate(normal),
            point: pose.apply(surface),
            gap,
            feature,
        });
    }
    gap
}
