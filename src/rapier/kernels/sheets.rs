//! The sides on which two segments lie, of which each has two.
//!
//! Their centres do not tell them: a segment beside another may lie on both sides of its line. Their
//! nearest points do, unless these lie in the line of a segment or touch by rounding. There the past tells
//! the sides, or what the segments touch elsewhere.

use super::edges::Edge;
use super::facing::{LEFT, cross, nearest};
use super::polygon::{View, size};
use super::{Sight, relative};
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use std::f64::consts::FRAC_1_SQRT_2;

/// Height over a segment, as a share of the shorter one, up to which one that was on a side of it stays
/// there.
const NEARLY_IN_LINE: f64 = 1e-4;

/// Height of one segment over another, as a share of the shorter one, up to which the two are in one line.
const IN_LINE: f64 = 1e-6;

/// The faces of two segments that face each other. `None` where they may touch: two of which the last
/// step found a contact then keep the sides that they had.
pub(super) fn sides_of_sheets(
    views: &[View; 2],
    poses: &[Pose64; 2],
    sight: &Sight,
) -> Option<[Option<usize>; 2]> {
    in_one_line(views, poses, sight).or_else(|| Some(Facing::of(views, poses, sight)?.faces()))
}

/// The nearest points of two segments that do not cross.
struct Facing<'a> {
    views: &'a [View<'a>; 2],
    poses: &'a [Pose64; 2],
    sight: &'a Sight,
    /// Length of the shorter segment \[m\].
    size: f64,
    /// Between the nearest points \[m\].
    distance: f64,
    /// From the nearest point of each to that of the other, as unit vectors.
    ways: [Vec2; 2],
    /// The corners that are nearest points.
    corners: [Option<usize>; 2],
}

impl<'a> Facing<'a> {
    /// `None` if the segments cross or touch; if they touched in the last step, also where they are not
    /// clearly apart, or beyond a corner of a chain.
    fn of(views: &'a [View<'a>; 2], poses: &'a [Pose64; 2], sight: &'a Sight) -> Option<Self> {
        let [first, second] = views;
        let seen = relative(&poses[0], &poses[1]);
        let back = relative(&poses[1], &poses[0]);
        if cross(first, second, &seen, &back) {
            return None;
        }
        let near = nearest(first, second, &seen, &back);
        let (direction, distance, corners) = near.way(views, poses);
        let size = size(first).min(size(second));
        // by rounding, or by what is left of an overlap
        let least = if sight.touched { LEFT } else { 1e-9 };
        if distance <= least * size {
            return None;
        }
        let way = direction.normalize();
        let facing = Facing {
            views,
            poses,
            sight,
            size,
            distance,
            ways: [way, -way],
            corners,
        };
        let chained = (0..2).any(|i| facing.chained(i).is_some());
        (!sight.touched || !chained).then_some(facing)
    }

    /// Beyond a corner of a chain, the normal of the neighbour, which tells the side.
    fn chained(&self, i: usize) -> Option<Vec2> {
        let (edge, corner) = (self.views[i].edge?, self.corners[i]?);
        let leads = edge.leads_on(corner, self.poses[i].unrotate(self.ways[i]));
        edge.next_normal(corner, 0).filter(|_| leads)
    }

    /// Sine of the angle at which the other's nearest point lies over segment `i`, positive on the side of its
    /// face 0.
    fn height(&self, i: usize) -> f64 {
        if let Some(height) = self.over_neighbour(i) {
            return height;
        }
        let (views, poses) = (self.views, self.poses);
        let normal = poses[i].rotate(self.chained(i).unwrap_or(views[i].normals[0]));
        let height = normal.dot(&self.ways[i]);
        let told = |face: usize| if face == 0 { IN_LINE } else { -IN_LINE };
        let off = height.abs() * self.distance;
        if off <= (NEARLY_IN_LINE * self.size).min(0.5 * self.distance)
            && let Some(face) = self.sight.faces[i]
        {
            return told(face);
        }
        if height.abs() > IN_LINE {
            return height;
        }
        if let Some(face) = self.sight.elsewhere[i] {
            return told(face);
        }
        let own = poses[i].apply(views[i].points[self.corners[i].unwrap_or(0)]);
        let other = poses[1 - i].apply(views[1 - i].center);
        normal.dot(&(other - own)) / self.size
    }

    /// [`Facing::height`] over the neighbour of segment `i`, if the other's corner is nearer to it than to the
    /// segment. It may be in front of the one and behind the other.
    fn over_neighbour(&self, i: usize) -> Option<f64> {
        let (edge, j) = (self.views[i].edge?, self.corners[1 - i]?);
        if self.corners[i].is_some() {
            return None;
        }
        let other = self.poses[1 - i].apply(self.views[1 - i].points[j]);
        let point = self.poses[i].apply_inverse(other);
        (0..2).find_map(|end| {
            let (leads, normal) = (edge.neighbours[end]?, edge.next_normal(end, 0)?);
            let away = point - edge.ends[end];
            let height = normal.dot(&away);
            let nearer = away.dot(&leads) > 0.0 && height.abs() < self.distance;
            nearer.then(|| height / away.norm())
        })
    }

    /// The faces that the nearest points face. See [`Sight::beside`].
    fn faces(&self) -> [Option<usize>; 2] {
        let Facing { views, poses, .. } = self;
        let beside = self.sight.beside;
        let heights = [0, 1].map(|i| self.height(i));
        let straight = |i: usize| heights[i].abs() > FRAC_1_SQRT_2;
        let mut faces = heights.map(|height| usize::from(height < 0.0));
        let came_through = |i: usize| straight(i) && beside[i].is_some_and(|face| face != faces[i]);
        if self.distance <= LEFT * self.size && (0..2).any(came_through) {
            faces = faces.map(|face| 1 - face);
        }
        // what may get to the corner in this step
        if self.distance <= self.sight.motion {
            for i in 0..2 {
                let known = beside[i].filter(|_| self.chained(i).is_some());
                faces[i] = known.unwrap_or(faces[i]);
            }
        }
        // a free end that slides towards a corner of a chain is about to be above it
        for (i, j) in [(0, 1), (1, 0)] {
            let free =
                |edge: &Edge| self.corners[i].is_some_and(|end| edge.neighbours[end].is_none());
            if views[i].edge.is_some_and(free) && !straight(i) && self.chained(j).is_some() {
                let normal = poses[j].rotate(views[j].normals[faces[j]]);
                faces[i] = usize::from(poses[i].rotate(views[i].normals[0]).dot(&normal) > 0.0);
            }
        }
        faces.map(Some)
    }
}

/// The sides of two segments in one line, whose places do not tell them: those that they had, those on which
/// the neighbours or the two themselves touched others, else those to which their neighbours lead or, last,
/// where the centres of mass are. `None` for other segments.
fn in_one_line(
    views: &[View; 2],
    poses: &[Pose64; 2],
    sight: &Sight,
) -> Option<[Option<usize>; 2]> {
    let [first, second] = [views[0].edge?, views[1].edge?];
    let normal = poses[0].rotate(first.normals[0]);
    let foot = poses[0].apply(first.ends[0]);
    let slack = IN_LINE * first.length().min(second.length());
    let height = |p: Vec2| normal.dot(&(p - foot));
    let off = |p: &Vec2| height(poses[1].apply(*p)).abs() > slack;
    if second.ends.iter().any(off) {
        return None;
    }
    let alike = poses[1].rotate(second.normals[0]).dot(&normal) > 0.0;
    // whether the second is above the first
    let told = |faces: [Option<usize>; 2]| {
        let one = faces[0].map(|face| face == 0);
        let two = faces[1].map(|face| (face == 1) == alike);
        let contradict = one.is_some() && two.is_some() && one != two;
        one.or(two).filter(|_| !contradict)
    };
    let leads = |i: usize, edge: &Edge| -> f64 {
        let ways = edge.neighbours.iter().flatten();
        ways.map(|way| normal.dot(&poses[i].rotate(*way))).sum()
    };
    let way = leads(1, second) - leads(0, first);
    let led = || (way.abs() > IN_LINE).then_some(way > 0.0);
    let center = normal.dot(&(sight.centers[1] - sight.centers[0]));
    let above = (told(sight.faces).or_else(|| told(sight.beside)))
        .or_else(|| told(sight.elsewhere))
        .or_else(led)
        .or_else(|| (center.abs() > slack).then_some(center > 0.0))?;
    let face = usize::from(!above);
    Some([Some(face), Some(if alike { 1 - face } else { face })])
}
