//! Convex polygons, and the view of a part by its corners and faces.

use super::Touch;
use super::edges::{Edge, TILT, half_turn};
use super::exposed::Exposed;
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// A convex polygon in the frame of its part \[m\].
#[derive(Debug, Clone, PartialEq)]
pub(in crate::rapier) struct Polygon {
    /// Corners, counter-clockwise.
    pub points: Box<[Vec2]>,
    /// Outward normals of the face from each point to the next.
    pub normals: Box<[Vec2]>,
    pub center: Vec2,
    /// Least width across a face.
    pub thickness: f64,
    /// `None` if all of it is exposed.
    pub exposed: Option<Exposed>,
}

impl Polygon {
    /// From its corners in either orientation; `None` if they span no area.
    pub fn new(mut points: Vec<Vec2>) -> Option<Polygon> {
        points.dedup();
        if points.len() > 1 && points.first() == points.last() {
            points.pop();
        }
        let n = points.len();
        let twice: f64 = (0..n).map(|i| points[i].perp(&points[(i + 1) % n])).sum();
        if n < 3 || !(twice != 0.0 && twice.is_finite()) {
            return None;
        }
        if twice < 0.0 {
            points.reverse();
        }
        let normals = (0..n).map(|i| {
            let along = (points[(i + 1) % n] - points[i]).normalize();
            Vec2::new(along.y, -along.x)
        });
        let normals: Box<[Vec2]> = normals.collect();
        let depth = |p: &Vec2, i: usize| normals[i].dot(&(points[i] - p));
        let width = |i: usize| points.iter().map(|p| depth(p, i)).fold(0.0, f64::max);
        Some(Polygon {
            thickness: (0..n).map(width).fold(f64::INFINITY, f64::min),
            normals,
            center: points.iter().sum::<Vec2>() / n as f64,
            points: points.into(),
            exposed: None,
        })
    }

    fn view(&self) -> View<'_> {
        View {
            points: &self.points,
            normals: &self.normals,
            center: self.center,
            exposed: self.exposed.as_ref(),
            edge: None,
            alone: [false; 2],
        }
    }
}

/// The view of a polygon, box or segment for the algorithm; a segment has a face on both sides.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub points: &'a [Vec2],
    pub normals: &'a [Vec2],
    pub center: Vec2,
    /// `None` if all of it is exposed.
    pub exposed: Option<&'a Exposed>,
    pub edge: Option<&'a Edge>,
    /// Per end of a segment, whether it has the corner there alone: see [`super::facing::alone`].
    pub alone: [bool; 2],
}

impl<'a> From<&'a Polygon> for View<'a> {
    fn from(polygon: &'a Polygon) -> Self {
        polygon.view()
    }
}

impl<'a> From<&'a Edge> for View<'a> {
    fn from(edge: &'a Edge) -> Self {
        let [a, b] = edge.ends;
        // a one-sided segment has solid behind it, as deep as it is long
        let depth = f64::from(u8::from(edge.one_sided)) * 0.5 * (b - a).norm();
        View {
            points: &edge.ends,
            normals: &edge.normals,
            center: 0.5 * (a + b) - depth * edge.normals[0],
            exposed: None,
            edge: Some(edge),
            alone: [false; 2],
        }
    }
}

impl View<'_> {
    fn next(&self, k: usize) -> Vec2 {
        self.points[(k + 1) % self.points.len()]
    }

    /// Start and end of face `k`; a segment's left face runs the other way.
    pub(super) fn face(&self, k: usize) -> [Vec2; 2] {
        [self.points[k], self.next(k)]
    }

    /// Slope at the start and the end of face `k`: the width of the face that a unit of depth under
    /// it takes. A penetrating point belongs to the face that it is nearer to; the bisector
    /// separates two faces.
    ///
    /// Zero where the algorithm compares the faces of both shapes and takes the best of all.
    pub(super) fn ridges(&self, k: usize, other: &View) -> [f64; 2] {
        match (self.edge, other.edge) {
            (Some(edge), _) => [k % 2, (k + 1) % 2].map(|end| match self.alone[end] {
                true => 0.0,
                false => edge.ridge(end, k),
            }),
            (None, Some(edge))
                if (0..2).any(|end| edge.neighbours[end].is_some() && !other.alone[end]) =>
            {
                let n = self.normals.len();
                [(k + n - 1) % n, (k + 1) % n].map(|next| {
                    let cos = self.normals[k].dot(&self.normals[next]);
                    half_turn(self.normals[k].perp(&self.normals[next]).abs(), cos)
                })
            }
            _ => [0.0, 0.0],
        }
    }

    /// Whether a contact at corner `end` of a segment may have this direction, known within an angle, `slack`
    /// over its length.
    pub(super) fn admits(&self, edge: &Edge, end: usize, direction: Vec2, slack: f64) -> bool {
        match self.alone[end] {
            true => edge.has_in_wedge(end, direction, slack),
            false => edge.admits_within(end, direction, slack),
        }
    }

    /// Whether `other`, at its pose `seen` in the frame of this one, can touch a face. Other parts may cover it.
    pub(super) fn has_face(&self, face: usize, other: &View, seen: &Pose64) -> bool {
        self.has_face_near(face, || other.points.iter().map(|q| seen.apply(*q)))
    }

    fn has_face_near<P: Iterator<Item = Vec2>>(&self, face: usize, points: impl Fn() -> P) -> bool {
        self.exposed.is_none_or(|exposed| {
            let [start, end] = self.face(face);
            let along = (end - start).normalize();
            let places = points().map(|p| along.dot(&(p - start)));
            let range = places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], t| {
                [low.min(t), high.max(t)]
            });
            exposed.has_face(face, range)
        })
    }

    /// Whether other parts leave this direction, in the frame of this one, to a contact of a corner with a face of
    /// `other`, in whose frame this one has the pose `seen`.
    ///
    /// That face may lie along one of the corner's own, which must be exposed then. In the middle of a flat
    /// surface, the contact is at the end of the surface or at that of the face, whichever comes first: if at the
    /// latter, it has the normal of the surface.
    pub(super) fn has_corner(
        &self,
        corner: usize,
        direction: Vec2,
        other: &View,
        seen: &Pose64,
    ) -> bool {
        let Some(exposed) = self.exposed else {
            return true;
        };
        let near = || other.points.iter().map(|p| seen.apply_inverse(*p));
        if !exposed.admits(corner, direction) {
            let beyond = exposed.beyond(corner, direction);
            return beyond.is_some_and(|(beyond, run)| {
                let heights = near().map(|p| beyond.normal.dot(&p)).enumerate();
                let deepest = heights.min_by(|a, b| a.1.total_cmp(&b.1));
                let k = deepest.map_or(0, |(k, _)| k);
                let end = seen.apply_inverse(other.points[k]) - self.points[corner];
                // parts beside the other one may prolong its face
                let more = other
                    .exposed
                    .map_or(0.0, |own| own.run(k, seen.rotate(beyond.way)));
                beyond.way.dot(&end) + more > run
            });
        }
        let n = self.points.len();
        let along = [corner, (corner + n - 1) % n]
            .into_iter()
            .find(|face| self.normals[*face].dot(&direction) > 1.0 - 0.5 * TILT * TILT);
        along.is_none_or(|face| self.has_face_near(face, near))
    }

    /// Whether other parts leave this direction to a contact at a corner alone.
    pub(super) fn leaves(&self, corner: usize, direction: Vec2) -> bool {
        (self.exposed).is_none_or(|exposed| exposed.admits(corner, direction))
    }

    /// A point inside; of a one-sided segment one in the solid behind it.
    pub(super) fn inner(&self) -> Vec2 {
        self.edge.map_or(self.center, |edge| {
            0.5 * (edge.ends[0] + edge.ends[1]) - 0.5 * edge.depth * edge.normals[0]
        })
    }

    pub(super) fn is_segment(&self) -> bool {
        self.points.len() == 2
    }
}

/// A ball at a polygon, and a bound of their gap \[m\]: at the point nearest to the ball's centre; if that is
/// inside, at the nearest face that is exposed. `None` where other parts cover this point.
pub(super) fn polygon_ball(
    pose: &Pose64,
    polygon: &Polygon,
    rounding: f64,
    center: Vec2,
    radius: f64,
) -> (Option<Touch>, f64) {
    let c = pose.apply_inverse(center);
    let view = polygon.view();
    let heights = polygon.normals.iter().zip(polygon.points.iter());
    let heights = heights.map(|(n, p)| n.dot(&(c - p))).enumerate();
    let most = |best: (usize, f64), next: (usize, f64)| if next.1 > best.1 { next } else { best };
    let (k, separation) = heights.clone().fold((0, f64::NEG_INFINITY), most);
    let along = |k: usize| {
        let [a, b] = view.face(k);
        let t = (c - a).dot(&(b - a)) / (b - a).norm();
        (t, (b - a).norm())
    };
    let has_face = |k: usize| {
        let (t, _) = along(k);
        (polygon.exposed.as_ref()).is_none_or(|exposed| exposed.has_face(k, [t, t]))
    };
    let (mut normal, mut distance, mut open) = (polygon.normals[k], separation, has_face(k));
    if separation > 0.0 {
        let n = polygon.points.len();
        let nearest = (0..n)
            .map(|k| (k, nearest_on_edge(view.face(k), c)))
            .min_by(|(_, p), (_, q)| (c - p).norm_squared().total_cmp(&(c - q).norm_squared()));
        let (k, point) = nearest.unwrap_or((0, c));
        let away = c - point;
        // for a centre on the face, the normal of the face
        if away.norm() > 0.0 {
            (normal, distance) = (away.normalize(), away.norm());
            let (t, length) = along(k);
            open = match t {
                _ if t <= 0.0 => view.leaves(k, normal),
                _ if t >= length => view.leaves((k + 1) % n, normal),
                _ => has_face(k),
            };
        }
    } else if !open {
        let faces = heights.filter(|(k, _)| has_face(*k));
        let (k, height) = faces.fold((0, f64::NEG_INFINITY), most);
        (normal, distance, open) = (polygon.normals[k], height, height > f64::NEG_INFINITY);
    }
    let gap = distance - radius - rounding;
    let touch = open.then(|| Touch {
        normal: pose.rotate(normal),
        point: pose.apply(c - normal * (radius + 0.5 * gap)),
        gap,
        feature: 0,
    });
    (touch, gap)
}

fn nearest_on_edge([a, b]: [Vec2; 2], p: Vec2) -> Vec2 {
    let along = b - a;
    a + along * ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0)
}

/// Smaller extent of the bounding box \[m\]; the length of a segment.
pub(super) fn size(view: &View) -> f64 {
    let first = view.points[0];
    let (low, high) = view
        .points
        .iter()
        .fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
    if view.is_segment() {
        (high - low).norm()
    } else {
        (high - low).min()
    }
}
