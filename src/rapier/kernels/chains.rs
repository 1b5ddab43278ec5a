//! The sides of chains of two-sided segments, where these are nearest to another part.

use super::facing::{LEFT, cross, nearest};
use super::polygon::{View, size};
use super::{Part, relative, with_view};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// Distance, as a share of the smaller of two parts, below which they touch by rounding.
const ROUNDING: f64 = 1e-9;

/// What the nearest points of two parts tell.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(in crate::rapier) struct Approach {
    /// Their distance \[m\].
    pub distance: f64,
    /// Whether they touch: by rounding, or by what is left of an overlap. The rest may then be wrong.
    pub touches: bool,
    /// The part (0 or 1) of which the neighbour at an end is nearer to the other part, and this end.
    pub leads: Option<(usize, usize)>,
    /// Per part that is a segment, the face on whose side the other one lies; `None` beside a free end, or
    /// where the two overlap.
    pub faces: [Option<usize>; 2],
}

/// What the nearest points of two parts with corners tell.
pub(in crate::rapier) fn approach(poses: &[Pose64; 2], parts: [&Part; 2]) -> Approach {
    let mut told = Approach::default();
    with_view(&parts[0].core, |first| {
        with_view(&parts[1].core, |second| {
            told = by_nearest(poses, &[first, second]);
            0.0
        })
    });
    told
}

fn by_nearest(poses: &[Pose64; 2], views: &[View; 2]) -> Approach {
    let [first, second] = views;
    let [one, two] = poses;
    let (seen, back) = (relative(one, two), relative(two, one));
    let apart = match first.is_segment() && second.is_segment() {
        true => !cross(first, second, &seen, &back),
        false => separates(first, second, &seen) || separates(second, first, &back),
    };
    let (way, distance, corners) = nearest(first, second, &seen, &back).way(views, poses);
    let size = size(first).min(size(second));
    if !apart || distance <= ROUNDING * size {
        return Approach {
            distance,
            touches: true,
            ..Approach::default()
        };
    }
    let way = way.normalize();
    let ways = [one.unrotate(way), two.unrotate(-way)];
    let leads = |i: usize| {
        let end = corners[i]?;
        let edge = views[i].edge.filter(|edge| edge.leads_on(end, ways[i]));
        edge.map(|_| (i, end))
    };
    Approach {
        distance,
        touches: distance <= LEFT * size,
        leads: leads(0).or_else(|| leads(1)),
        faces: [0, 1].map(|i| face(&views[i], corners[i], ways[i])),
    }
}

/// Whether a face of `base` separates it from `other`, at a pose in its frame.
fn separates(base: &View, other: &View, pose: &Pose64) -> bool {
    let beyond = |(n, p): (&Vec2, &Vec2)| {
        other
            .points
            .iter()
            .all(|q| n.dot(&(pose.apply(*q) - p)) > 0.0)
    };
    base.normals.iter().zip(base.points).any(beyond)
}

/// The face of a segment towards which a direction leads from a point on it. At a corner the bisector of the
/// two segments' normals tells it.
fn face(view: &View, corner: Option<usize>, way: Vec2) -> Option<usize> {
    let edge = view.edge?;
    let normal = match corner {
        None => edge.normals[0],
        Some(end) => edge.normals[0] + edge.next_normal(end, 0)?,
    };
    let height = normal.dot(&way);
    (height.abs() > 1e-9).then_some(usize::from(height < 0.0))
}
