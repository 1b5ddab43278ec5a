//! Sharp polygons, those that lie beside each other face to face, and what they cover of each other.

use super::edges::TILT;
use super::exposed::{Beyond, Exposed};
use super::polygon::Polygon;
use super::{BOX_NORMALS, Core, Part, corners, relative};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

impl Part {
    /// Whether this is a box or polygon without rounded corners.
    pub fn is_sharp_polygon(&self) -> bool {
        self.rounding == 0.0 && matches!(self.core, Core::Box(_) | Core::Polygon(_))
    }

    /// Its corners and faces in the frame given by its pose, if it is a box or polygon without rounded corners.
    pub fn sharp_polygon(&self, pose: &Pose64) -> Option<Polygon> {
        let corners: &[Vec2] = match &self.core {
            Core::Box(h) => &corners(*h),
            Core::Polygon(polygon) => &polygon.points,
            _ => return None,
        };
        let placed = corners.iter().map(|p| pose.apply(*p)).collect();
        Polygon::new(placed).filter(|_| self.rounding == 0.0)
    }

    /// The part with what others leave exposed of it; `None` if that is all it had. `placed` is its
    /// [`Part::sharp_polygon`] at `pose`, `others` are as in [`Exposed::new`], and `run` as in
    /// [`Exposed::measure`]. `None` too if that is not `wanted`.
    pub fn covered(
        &self,
        (pose, placed): (&Pose64, &Polygon),
        others: &[(&Polygon, f64)],
        run: impl Fn(Vec2, Beyond) -> f64,
        wanted: impl FnOnce(&Exposed) -> bool,
    ) -> Option<Part> {
        let mut exposed = Exposed::new(placed, others).filter(wanted)?;
        exposed.measure(|corner, beyond| run(placed.points[corner], beyond));
        let polygon = self.sharp_polygon(&Pose64::new(Vec2::zeros(), 0.0))?;
        // rounding may merge corners
        let mut exposed = exposed.seen_from(pose);
        if let Core::Polygon(before) = &self.core
            && let Some(known) = &before.exposed
        {
            exposed.cover_also(known);
        }
        let exposed = Some(exposed);
        let exposed = exposed.filter(|_| polygon.points.len() == placed.points.len());
        Some(Part {
            core: Core::Polygon(Polygon { exposed, ..polygon }.into()),
            rounding: self.rounding,
        })
    }

    /// Whether two sharp polygons lie face to face, at most `reach` \[m\] apart: see [`gap_between`]. With a
    /// `normal`, in the frame of this one, only its face with this counts.
    pub fn is_beside(
        &self,
        pose: &Pose64,
        other: &Part,
        at: &Pose64,
        widths: [f64; 2],
        normal: Option<Vec2>,
    ) -> bool {
        let (mut room, mut more) = ([Vec2::zeros(); 4], [Vec2::zeros(); 4]);
        let (Some(own), Some(facing)) = (self.faces(&mut room), other.faces(&mut more)) else {
            return false;
        };
        let seen = relative(pose, at);
        let (n, count) = (own.0.len(), facing.0.len());
        (0..count).any(|k| {
            let m = seen.rotate(facing.0[k]);
            (0..n).any(|i| {
                let asked = normal.is_none_or(|asked| is_same(own.0[i], asked));
                asked && are_against(own.0[i], m) && {
                    let ends = [facing.1[k], facing.1[(k + 1) % count]].map(|p| seen.apply(p));
                    let face = (own.0[i], [own.1[i], own.1[(i + 1) % n]]);
                    gap_between(face, ends, widths).is_some()
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
        let mut gaps = pairs.filter_map(|(k, i)| {
            let normal = other.normals[i];
            if !are_against(normal, self.normals[k]) {
                return None;
            }
            let ends = [self.points[k], self.points[(k + 1) % n]];
            let face = (normal, [other.points[i], other.points[(i + 1) % count]]);
            Some((k, gap_between(face, ends, [flush, reach])?))
        });
        match gaps.next()? {
            (k, gap) if gap > flush => self.grown(k, gap),
            _ => Some(self.clone()),
        }
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

/// Whether two faces with these normals look at each other.
fn are_against(one: Vec2, two: Vec2) -> bool {
    one.dot(&two) < 0.0 && one.perp(&two).abs() < TILT
}

/// How far \[m\] a face between two `ends` lies in front of one that looks at it, given by its normal and ends;
/// `None` if the two are not parallel within `flush` \[m\] at the ends, overlap by more, are more than `reach` \[m\]
/// apart, or lie beside each other but for less than this.
fn gap_between(
    (normal, [start, end]): (Vec2, [Vec2; 2]),
    ends: [Vec2; 2],
    [flush, reach]: [f64; 2],
) -> Option<f64> {
    let [one, two] = ends.map(|p| normal.dot(&(p - start)));
    let along = (end - start).normalize();
    let places = ends.map(|p| along.dot(&(p - start)));
    let parallel = (one - two).abs() <= flush && one.min(two) >= -flush && one.max(two) <= reach;
    let length = (end - start).norm();
    let over = places[0].max(places[1]) > reach && places[0].min(places[1]) < length - reach;
    (parallel && over).then_some(one.max(two))
}
