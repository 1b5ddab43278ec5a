//! What other parts leave exposed of a convex polygon.
//!
//! Parts of one body, or of bodies that never move, often lie flush or overlap. The faces between them are
//! inside the solid that they make up: nothing can touch those, and a corner in the middle of a flat
//! floor has one normal only, that of the floor. A contact at the point `p` may have a normal `n` if it is one
//! of every part that holds the point,
//!
//! ```text
//! n ∈ ∩ N_i(p),     N_i(p) = { n : n · (x − p) ≤ 0 for all points x of part i }.   (1)
//! ```
//!
//! Of a face, `N` is its normal, or empty where another part lies in front of it. At a corner it is a cone. In a
//! hollow it is empty, but what comes down there will soon touch the faces beside it: corners in hollows keep their
//! own normals. (Without this, boxes that slide through a valley met its far side too late in 3 of 96 scenes more.)

use super::edges::TILT;
use super::polygon::Polygon;
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// Least tolerance of directions at corners [rad].
const ANGLE: f64 = 1e-6;

/// What other parts leave exposed of a polygon, numbered as its corners and faces.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::rapier) struct Exposed {
    /// Per face, from the first to the last exposed point, along the face from its start \[m\]; unbounded where
    /// the face is exposed to its end. What is covered between the two counts as exposed. `None` if all of it is
    /// covered.
    faces: Box<[Option<[f64; 2]>]>,
    corners: Box<[Normals]>,
}

/// The normals of contacts at a corner.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Normals {
    /// All between those of its two faces.
    All,
    Between(Cone),
    /// The corner is inside another part.
    None,
}

/// Directions from one to another.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cone {
    /// The first and the last, counter-clockwise.
    ends: [Vec2; 2],
    /// Tolerance [rad]: corners of other parts may stand out a little.
    angle: f64,
    /// How far beyond the corner \[m\] the faces with these two normals go on.
    runs: [f64; 2],
}

/// The surface that goes on beyond a corner: the last normal that contacts at the corner may have, and the way
/// along the face with this normal.
pub(in crate::rapier) struct Beyond {
    pub normal: Vec2,
    pub way: Vec2,
}

impl Exposed {
    /// What `others`, in the same frame, leave exposed of `own`; `None` if that is all. Faces lie flush with those
    /// of another part within a distance \[m\] that belongs to that part.
    pub fn new(own: &Polygon, others: &[(&Polygon, f64)]) -> Option<Exposed> {
        let numbers = 0..own.points.len();
        let faces = numbers.clone().map(|k| exposed(own, k, others));
        let corners = numbers.map(|k| normals(own, k, others));
        let exposed = Exposed {
            faces: faces.collect(),
            corners: corners.collect(),
        };
        let whole = |face: &Option<[f64; 2]>| *face == Some([f64::NEG_INFINITY, f64::INFINITY]);
        let all = exposed.faces.iter().all(whole)
            && exposed
                .corners
                .iter()
                .all(|normals| *normals == Normals::All);
        (!all).then_some(exposed)
    }

    /// In a frame to which the present one has this pose.
    pub fn seen_from(mut self, pose: &Pose64) -> Exposed {
        for normals in &mut self.corners {
            if let Normals::Between(cone) = normals {
                cone.ends = cone.ends.map(|normal| pose.unrotate(normal));
            }
        }
        self
    }

    /// Covers what `other` parts cover, of the same polygon.
    pub fn cover_also(&mut self, other: &Exposed) {
        for (face, theirs) in self.faces.iter_mut().zip(&other.faces) {
            let common = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a.max(c), b.min(d)];
            let left = face.zip(*theirs).map(|(own, their)| common(own, their));
            *face = left.filter(|[from, to]| from < to);
        }
        for (corner, theirs) in self.corners.iter_mut().zip(&other.corners) {
            *corner = corner.and(theirs);
        }
    }

    /// Whether a part that lies between two places along a face \[m\], from its start, can touch the face.
    pub fn has_face(&self, face: usize, [low, high]: [f64; 2]) -> bool {
        self.faces[face].is_some_and(|[from, to]| low < to && high > from)
    }

    /// Whether a contact at a corner may have this direction, which lies between the normals of its two faces.
    pub fn admits(&self, corner: usize, direction: Vec2) -> bool {
        match &self.corners[corner] {
            Normals::All => true,
            Normals::Between(cone) => is_between(cone.ends, direction, cone.angle),
            Normals::None => false,
        }
    }

    /// If a corner does not admit a direction: where the surface goes on, and how far \[m\]. `None` at a corner
    /// inside another part.
    pub fn beyond(&self, corner: usize, direction: Vec2) -> Option<(Beyond, f64)> {
        let Normals::Between(cone) = &self.corners[corner] else {
            return None;
        };
        let end = usize::from(cone.ends[1].perp(&direction) > 0.0);
        Some((cone.beyond(end), cone.runs[end]))
    }

    /// How far \[m\] the surface goes on beyond a corner in a direction.
    pub fn run(&self, corner: usize, way: Vec2) -> f64 {
        let Normals::Between(cone) = &self.corners[corner] else {
            return 0.0;
        };
        let along = (0..2).filter(|end| cone.beyond(*end).way.dot(&way) > 0.0);
        along.map(|end| cone.runs[end]).fold(0.0, f64::max)
    }

    /// Measures by `run` \[m\] how far the surface goes on beyond each corner.
    pub fn measure(&mut self, run: impl Fn(usize, Beyond) -> f64) {
        for (corner, normals) in self.corners.iter_mut().enumerate() {
            if let Normals::Between(cone) = normals {
                cone.runs = [0, 1].map(|end| run(corner, cone.beyond(end)));
            }
        }
    }
}

impl Normals {
    /// Those that are in both.
    fn and(&self, other: &Normals) -> Normals {
        match (self, other) {
            (Normals::None, _) | (_, Normals::None) => Normals::None,
            (Normals::All, one) | (one, Normals::All) => *one,
            (Normals::Between(a), Normals::Between(b)) => match common(a.ends, b.ends) {
                Some(ends) => Normals::Between(Cone {
                    ends,
                    angle: a.angle.max(b.angle),
                    runs: [0, 1].map(|end| a.runs[end].max(b.runs[end])),
                }),
                // in a hollow
                None => Normals::All,
            },
        }
    }
}

impl Cone {
    fn beyond(&self, end: usize) -> Beyond {
        let normal = self.ends[end];
        let left = Vec2::new(-normal.y, normal.x);
        Beyond {
            normal,
            way: if end == 1 { left } else { -left },
        }
    }
}

impl Beyond {
    /// How far \[m\] a face of a polygon with this normal reaches from a point on it.
    pub fn reach(&self, polygon: &Polygon, from: Vec2, flush: f64) -> Option<f64> {
        let n = polygon.points.len();
        let on = |k: &usize| {
            let height = polygon.normals[*k].dot(&(from - polygon.points[*k]));
            self.normal.dot(&polygon.normals[*k]) > 0.0
                && self.normal.perp(&polygon.normals[*k]).abs() < TILT
                && height.abs() <= flush
        };
        let along = |k: usize| self.way.dot(&(polygon.points[k % n] - from));
        let ends = (0..n).filter(on).map(|k| [along(k), along(k + 1)]);
        let ends = ends.filter(|[a, b]| a.min(*b) <= flush);
        let far = ends.map(|[a, b]| a.max(b)).fold(0.0, f64::max);
        (far > flush).then_some(far)
    }
}

/// The part of a face that nothing lies in front of, see [`Exposed::faces`].
fn exposed(own: &Polygon, face: usize, others: &[(&Polygon, f64)]) -> Option<[f64; 2]> {
    let n = own.points.len();
    let (start, end) = (own.points[face], own.points[(face + 1) % n]);
    let (along, length) = ((end - start).normalize(), (end - start).norm());
    // just in front of the face, beyond what may lie flush with it
    let mut covered: Vec<[f64; 2]> = (others.iter())
        .filter_map(|(other, flush)| {
            let front = start + 2.0 * flush * own.normals[face];
            let [from, to] = within(other, front, along, length)?;
            Some([from - flush, to + flush])
        })
        .collect();
    covered.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let (mut first, mut last, mut reached) = (None, 0.0, 0.0);
    for [from, to] in covered.into_iter().chain([[length, length]]) {
        if from > reached {
            first = first.or(Some(reached));
            last = from;
        }
        reached = to.max(reached);
    }
    let from = first?;
    Some([
        if from == 0.0 { f64::NEG_INFINITY } else { from },
        if last == length { f64::INFINITY } else { last },
    ])
}

/// The stretch of a line, up to `length` from its start, that lies inside a polygon.
fn within(polygon: &Polygon, start: Vec2, along: Vec2, length: f64) -> Option<[f64; 2]> {
    let (mut from, mut to) = (0.0, length);
    for (normal, point) in polygon.normals.iter().zip(&polygon.points) {
        let (height, slope) = (normal.dot(&(start - point)), normal.dot(&along));
        match slope {
            _ if slope.abs() < 1e-12 && height > 0.0 => return None,
            _ if slope.abs() < 1e-12 => (),
            _ if slope > 0.0 => to = f64::min(to, -height / slope),
            _ => from = f64::max(from, -height / slope),
        }
    }
    (from < to).then_some([from, to])
}

/// The normals (1) at a corner.
fn normals(own: &Polygon, corner: usize, others: &[(&Polygon, f64)]) -> Normals {
    let n = own.points.len();
    let whole = [own.normals[(corner + n - 1) % n], own.normals[corner]];
    let (point, mut cone, mut out) = (own.points[corner], Some(whole), 0.0);
    for (other, flush) in others {
        let heights = other.normals.iter().zip(&other.points);
        let heights: Vec<f64> = heights.map(|(m, q)| m.dot(&(point - q))).collect();
        if heights.iter().all(|height| height <= flush) {
            let on = |k: &usize| heights[*k] >= -*flush;
            let count = heights.len();
            let standing = (0..count).filter(on).map(|k| heights[k].abs());
            out = standing.fold(out, f64::max);
            // faces that meet here have numbers in a row
            let Some(first) = (0..count).find(|&k| on(&k) && !on(&((k + count - 1) % count)))
            else {
                if on(&0) {
                    continue; // a part smaller than what is flush
                }
                return Normals::None;
            };
            let row = (0..count).map(|i| (first + i) % count).take_while(on);
            let last = row.last().unwrap_or(first);
            cone = cone.and_then(|cone| common(cone, [other.normals[first], other.normals[last]]));
        }
    }
    match cone {
        Some(cone) if cone == whole => Normals::All,
        Some(ends) => {
            let beside = [(corner + n - 1) % n, (corner + 1) % n];
            let lengths = beside.map(|k| (own.points[k] - point).norm());
            Normals::Between(Cone {
                ends,
                angle: ANGLE.max(2.0 * out / lengths[0].min(lengths[1])),
                runs: [0.0; 2],
            })
        }
        // in a hollow
        None => Normals::All,
    }
}

/// What two cones of less than half a turn, each from its first to its second direction, have in common.
fn common(a: [Vec2; 2], b: [Vec2; 2]) -> Option<[Vec2; 2]> {
    let later = |i: usize| match is_between(b, a[i], ANGLE) {
        true => Some(a[i]),
        false => Some(b[i]).filter(|end| is_between(a, *end, ANGLE)),
    };
    Some([later(0)?, later(1)?])
}

/// Whether a direction lies in a cone of less than half a turn, within a small angle.
fn is_between([first, last]: [Vec2; 2], direction: Vec2, angle: f64) -> bool {
    first.perp(&direction) >= -angle
        && direction.perp(&last) >= -angle
        && direction.dot(&(first + last)) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    const UP: Vec2 = Vec2::new(0.0, 1.0);

    fn rectangle(low: [f64; 2], high: [f64; 2]) -> Polygon {
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
        Polygon::new(corners.map(Vec2::from).to_vec()).unwrap()
    }

    fn hidden(own: &Polygon, others: &[Polygon]) -> Option<Exposed> {
        let others: Vec<(&Polygon, f64)> = others.iter().map(|other| (other, 1e-7)).collect();
        Exposed::new(own, &others)
    }

    /// Numbers of the faces of a [`rectangle`], and of their first corners.
    const BOTTOM: usize = 0;
    const RIGHT: usize = 1;
    const TOP: usize = 2;
    const LEFT: usize = 3;

    #[test]
    fn a_tile_between_two_others_has_a_top_and_a_bottom() {
        let tile = rectangle([0.0, 0.0], [1.0, 0.5]);
        let beside = [
            rectangle([-1.0, 0.0], [1e-8, 0.5]),
            rectangle([1.0, -1e-8], [2.0, 0.5 + 1e-8]),
        ];
        let exposed = hidden(&tile, &beside).unwrap();
        for (face, open) in [(BOTTOM, true), (RIGHT, false), (TOP, true), (LEFT, false)] {
            assert_eq!(exposed.has_face(face, [0.2, 0.3]), open, "{face}");
        }
        for corner in [TOP, LEFT] {
            assert!(exposed.admits(corner, UP));
            assert!(!exposed.admits(corner, Vec2::new(1e-3, 1.0).normalize()));
            assert!(!exposed.admits(corner, Vec2::new(-1e-3, 1.0).normalize()));
        }
    }

    #[test]
    fn a_step_between_tiles_is_exposed() {
        let tile = rectangle([0.0, 0.0], [1.0, 0.5]);
        let lower = rectangle([-1.0, 0.0], [0.0, 0.5 - 1e-4]);
        let exposed = hidden(&tile, &[lower]).unwrap();
        // the left face runs downwards
        assert!(exposed.has_face(LEFT, [-1.0, 0.01]));
        assert!(!exposed.has_face(LEFT, [2e-4, 0.3]));
        let up_left = Vec2::new(-1.0, 1.0).normalize();
        assert!(exposed.admits(LEFT, up_left));
        assert!(!exposed.admits(BOTTOM, -up_left));
    }

    #[test]
    fn a_ridge_has_the_normals_between_its_slopes() {
        let part = |top: f64, side: f64| {
            let corners = [[0.0, -1.0], [side, -1.0], [side, top], [0.0, 0.0]];
            Polygon::new(corners.map(Vec2::from).to_vec()).unwrap()
        };
        let end_at = |p: &Polygon| (p.points.iter()).position(|q| q.norm() == 0.0).unwrap();
        // in a valley what comes down may touch the corner first
        for (top, ridge) in [(-0.1, true), (0.1, false)] {
            let (right, left) = (part(top, 1.0), part(top, -1.0));
            let exposed = hidden(&right, &[left]).unwrap();
            let at = end_at(&right);
            assert!(exposed.admits(at, UP));
            assert_eq!(exposed.admits(at, Vec2::new(-0.2, 1.0).normalize()), !ridge);
        }
    }

    #[test]
    fn parts_apart_and_parts_that_are_the_same_hide_nothing() {
        let tile = rectangle([0.0, 0.0], [1.0, 0.5]);
        let apart = rectangle([1.001, 0.0], [2.0, 0.5]);
        assert_eq!(hidden(&tile, &[apart, tile.clone()]), None);
    }

    #[test]
    fn a_part_inside_another_has_no_contacts() {
        let tile = rectangle([0.0, 0.0], [1.0, 0.5]);
        let around = rectangle([-0.1, -0.1], [1.1, 0.6]);
        let exposed = hidden(&tile, &[around]).unwrap();
        for k in 0..4 {
            assert!(!exposed.has_face(k, [-1.0, 2.0]));
            assert!(!exposed.admits(k, tile.normals[k]));
        }
    }
}
