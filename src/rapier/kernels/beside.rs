//! Polygons that lie beside each other, face to face.

use super::edges::TILT;
use super::exposed::Exposed;
use super::polygon::Polygon;
use super::{BOX_NORMALS, Core, Part, corners, relative};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

impl Part {
    /// Whether two sharp polygons have faces towards each other that are parallel, within `flush` \[m\] at their
    /// ends, and at most `reach` \[m\] apart. With a `normal`, in the frame of this one, only its face with
    /// this counts.
    pub fn is_beside(
        &self,
        pose: &Pose64,
        other: &Part,
        at: &Pose64,
        [flush, reach]: [f64; 2],
        normal: Option<Vec2>,
    ) -> bool {
        let (mut room, mut more) = ([Vec2::zeros(); 4], [Vec2::zeros(); 4]);
        let (Some(own), Some(facing)) = (self.faces(&mut room), other.faces(&mut more)) else {
            return false;
        };
        let seen = relative(pose, at);
        let count = facing.1.len();
        facing.0.iter().enumerate().any(|(k, m)| {
            let m = seen.rotate(*m);
            let mut sides = own.0.iter().zip(own.1);
            sides.any(|(n, p)| {
                let asked = normal.is_none_or(|asked| is_same(*n, asked));
                asked && n.dot(&m) < 0.0 && n.perp(&m).abs() < TILT && {
                    let ends = [k, (k + 1) % count].map(|k| n.dot(&(seen.apply(facing.1[k]) - p)));
                    (ends[0] - ends[1]).abs() <= flush && ends[0].abs() <= reach
                }
            })
        })
    }

    /// Whether a sharp polygon has a face with this normal, in its frame.
    pub fn has_face(&self, normal: Vec2) -> bool {
        let mut room = [Vec2::zeros(); 4];
        let faces = self.faces(&mut room);
        faces.is_some_and(|(normals, _)| normals.iter().any(|n| is_same(*n, normal)))
    }

    /// Normals and first corners of the faces of a sharp polygon. There is `room` for those of a box.
    fn faces<'a>(&'a self, room: &'a mut [Vec2; 4]) -> Option<(&'a [Vec2], &'a [Vec2])> {
        match &self.core {
            _ if self.rounding > 0.0 => None,
            Core::Box(half) => {
                *room = corners(*half);
                Some((&BOX_NORMALS, room))
            }
            Core::Polygon(polygon) => Some((&polygon.normals, &polygon.points)),
            _ => None,
        }
    }
}

impl Polygon {
    /// This polygon if it lies face to face with another, at most `reach` \[m\] from it: grown over what is
    /// between the two, if that is more than `flush` \[m\]. `None` if it does not, or if the two faces are not
    /// parallel within `flush`.
    pub fn beside(&self, other: &Polygon, [flush, reach]: [f64; 2]) -> Option<Polygon> {
        let (n, count) = (self.points.len(), other.points.len());
        let pairs = (0..n).flat_map(|k| (0..count).map(move |i| (k, i)));
        pairs
            .filter_map(|(k, i)| {
                let (m, normal) = (self.normals[k], other.normals[i]);
                if m.dot(&normal) > 0.0 || m.perp(&normal).abs() > TILT {
                    return None;
                }
                let ends = [self.points[k], self.points[(k + 1) % n]];
                let origin = other.points[i];
                let [one, two] = ends.map(|p| normal.dot(&(p - origin)));
                if (one - two).abs() > flush || one.min(two) < -flush || one.max(two) > reach {
                    return None;
                }
                let along = (other.points[(i + 1) % count] - origin).normalize();
                let length = (other.points[(i + 1) % count] - origin).norm();
                let places = ends.map(|p| along.dot(&(p - origin)));
                let overlaps =
                    places[0].max(places[1]) > reach && places[0].min(places[1]) < length - reach;
                overlaps.then_some((k, one.max(two)))
            })
            .map(|(k, gap)| match gap > flush {
                true => self.grown(k, gap),
                false => Some(self.clone()),
            })
            .next()?
    }

    /// With one face moved outwards, between the lines of the two beside it.
    fn grown(&self, face: usize, by: f64) -> Option<Polygon> {
        let n = self.points.len();
        let (first, last) = (face, (face + 1) % n);
        let normal = self.normals[face];
        let moved = |corner: usize, inner: usize| {
            let way = (self.points[corner] - self.points[inner]).normalize();
            // a sharp corner would grow far
            let slope = normal.dot(&way).max(0.5);
            self.points[corner] + by / slope * way
        };
        let mut points = self.points.to_vec();
        points[first] = moved(first, (first + n - 1) % n);
        points[last] = moved(last, (last + 1) % n);
        Polygon::new(points)
    }
}

impl Exposed {
    /// Whether this leaves an outward direction to a contact of the polygon at a place near its surface.
    pub fn leaves(&self, polygon: &Polygon, place: Vec2, direction: Vec2) -> bool {
        let n = polygon.points.len();
        let along = |k: &usize| is_same(polygon.normals[*k], direction);
        if let Some(face) = (0..n).find(along) {
            let (start, end) = (polygon.points[face], polygon.points[(face + 1) % n]);
            let t = (end - start).normalize().dot(&(place - start));
            return self.has_face(face, [t, t]);
        }
        // the contact is at the corner that is met first
        let reach = |k: &usize| polygon.points[*k].dot(&direction);
        let corner = (0..n).max_by(|a, b| reach(a).total_cmp(&reach(b)));
        corner.is_none_or(|corner| self.admits(corner, direction))
    }
}

/// Whether two unit vectors are the same but for rounding.
fn is_same(one: Vec2, two: Vec2) -> bool {
    one.dot(&two) > 0.0 && one.perp(&two).abs() < 1e-9
}
