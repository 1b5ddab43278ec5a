//! Gaps in `f64`, exact to round-off; parry's are accurate to 1e-7 of the size.
//!
//! A collider is a set of [`Part`]s: a ball, a box, a convex polygon, a segment of a polyline or a
//! half-plane, each with a rounding (that of capsules and round shapes, and the contact skin).

mod axes;
mod beside;
mod boxes;
mod cells;
mod chains;
mod convex;
mod edges;
mod exposed;
mod facing;
mod polygon;
mod sheets;
mod sight;

pub(super) use axes::{Axes, Axis, with_axes};
pub(super) use cells::cell_touches;
pub(super) use chains::approach;
pub(super) use edges::Edge;
pub(super) use exposed::{Beyond, Exposed};
pub(super) use facing::sides_of;
pub(super) use polygon::Polygon;
pub(super) use sight::Sight;

use super::engine::prelude::SharedShape;
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use convex::convex_convex;
use polygon::{View, polygon_ball};
use sight::Past;
use std::sync::Arc;

/// A core with a closed-form gap, in the frame of its part.
#[derive(Clone)]
pub(super) enum Core {
    /// Radius \[m\].
    Ball(f64),
    /// Half extents \[m\].
    Box(Vec2),
    Polygon(Arc<Polygon>),
    Edge(Arc<Edge>),
    /// Outward normal of a half-plane whose border runs through the origin.
    HalfPlane(Vec2),
    /// A shape without a kernel here, left to parry.
    Other(SharedShape),
}

/// A core and the radius added all round it \[m\].
#[derive(Clone)]
pub(super) struct Part {
    pub core: Core,
    pub rounding: f64,
}

impl Part {
    /// Whether this is a segment with two sides.
    pub fn is_two_sided(&self) -> bool {
        matches!(&self.core, Core::Edge(edge) if !edge.one_sided)
    }

    /// Whether this is a segment with solid behind it.
    pub fn is_one_sided(&self) -> bool {
        matches!(&self.core, Core::Edge(edge) if edge.one_sided)
    }

    /// Whether this is a sharp segment with two sides.
    pub fn is_sheet(&self) -> bool {
        self.rounding == 0.0 && self.is_two_sided()
    }

    /// Whether this is the first or the last segment of a chain with two sides.
    pub fn ends_a_chain(&self) -> bool {
        matches!(&self.core, Core::Edge(edge) if !edge.one_sided && edge.ends_a_chain())
    }

    /// Whether this is a segment with a neighbour at more than 45 degrees.
    pub fn has_sharp_corner(&self) -> bool {
        matches!(&self.core, Core::Edge(edge)
            if (0..2).any(|end| edge.neighbours[end].is_some() && !edge.goes_on_at(end)))
    }

    /// Whether this is a segment of a chain that goes on at both ends, without a sharp corner.
    pub fn goes_on(&self) -> bool {
        matches!(&self.core, Core::Edge(edge) if edge.goes_on())
    }
}

/// One contact between two parts, signs as in [`crate::contact`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Touch {
    pub normal: Vec2,
    /// Midpoint between the two surfaces.
    pub point: Vec2,
    pub gap: f64,
    pub feature: u32,
}

impl Part {
    /// Whether a direction, in its frame, is along the normal of one of its faces.
    pub fn is_face(&self, direction: Vec2) -> bool {
        const ROUNDING: f64 = 1e-9;
        let along = |n: &Vec2| n.perp(&direction).abs() < ROUNDING;
        match &self.core {
            Core::Box(_) => direction.amin() < ROUNDING,
            Core::Polygon(polygon) => polygon.normals.iter().any(along),
            Core::Edge(edge) => along(&edge.normals[0]),
            Core::HalfPlane(_) => true,
            Core::Ball(_) | Core::Other(_) => false,
        }
    }

    /// Ends of the face whose outward normal is nearest to a direction, within the angle of a cosine, in its
    /// frame and without the rounding. `None` for segments of a chain and for polygons beside others.
    pub fn face_towards(&self, direction: Vec2, cosine: f64) -> Option<[Vec2; 2]> {
        let face = |normals: &[Vec2], points: &[Vec2]| {
            let along = normals.iter().map(|n| n.dot(&direction)).enumerate();
            let (k, most) = along.max_by(|a, b| a.1.total_cmp(&b.1))?;
            (most >= cosine).then(|| [points[k], points[(k + 1) % points.len()]])
        };
        match &self.core {
            &Core::Box(half) => face(&BOX_NORMALS, &corners(half)),
            Core::Polygon(polygon) if polygon.exposed.is_none() => {
                face(&polygon.normals, &polygon.points)
            }
            Core::Edge(edge) if edge.neighbours == [None; 2] => face(&edge.normals, &edge.ends),
            _ => None,
        }
    }

    /// The middle of a polygon, in its frame; the origin of other parts.
    pub fn middle(&self) -> Vec2 {
        match &self.core {
            Core::Polygon(polygon) => polygon.center,
            _ => Vec2::zeros(),
        }
    }

    /// Radius of its round surfaces \[m\].
    #[inline]
    pub fn radius(&self) -> f64 {
        match self.core {
            Core::Ball(radius) => radius + self.rounding,
            _ => self.rounding,
        }
    }
}

impl Touch {
    /// The same contact with the shapes in the other order.
    fn reversed(self) -> Touch {
        Touch {
            normal: -self.normal,
            ..self
        }
    }
}

/// Pose of `other` in the frame of `base`.
pub(super) fn relative(base: &Pose64, other: &Pose64) -> Pose64 {
    Pose64 {
        translation: base.apply_inverse(other.translation),
        cos: base.cos * other.cos + base.sin * other.sin,
        sin: base.cos * other.sin - base.sin * other.cos,
    }
}

/// Adds the contacts of part 1 with part 2 that are nearer than `reach` \[m\], at most two.
///
/// Returns a lower bound \[m\] of the gap: no contact can appear unless the two move by more than
/// the excess of this bound over `reach`. `None` for parts without a kernel.
pub(super) fn touches(
    [pose1, pose2]: [&Pose64; 2],
    [part1, part2]: [&Part; 2],
    sight: &Sight,
    reach: f64,
    out: &mut Vec<Touch>,
) -> Option<f64> {
    let from = out.len();
    let rounding = [part1.rounding, part2.rounding];
    let flat = rounding == [0.0, 0.0];
    Some(match (&part1.core, &part2.core) {
        (Core::Other(_), _) | (_, Core::Other(_)) => return None,
        (&Core::Ball(r1), &Core::Ball(r2)) => {
            let touch = ball_ball(pose1, r1 + rounding[0], pose2, r2 + rounding[1]);
            keep(touch, reach, out)
        }
        (&Core::Box(h1), &Core::Box(h2)) if flat => {
            boxes::box_box(pose1, h1, pose2, h2, reach, out)
        }
        (_, &Core::Ball(r2)) => {
            let (center, radius) = (pose2.translation, r2 + rounding[1]);
            with_ball(pose1, part1, (center, radius), (sight, 0), reach, out)
        }
        (&Core::Ball(r1), _) => {
            let (center, radius) = (pose1.translation, r1 + rounding[0]);
            let bound = with_ball(pose2, part2, (center, radius), (sight, 1), reach, out);
            out[from..].iter_mut().for_each(|t| *t = t.reversed());
            bound
        }
        (&Core::HalfPlane(_), &Core::HalfPlane(_)) => f64::INFINITY,
        (&Core::HalfPlane(n), core) => with_view(core, |view| {
            plane(pose1, n, pose2, view, rounding, reach, out)
        }),
        (core, &Core::HalfPlane(n)) => {
            let swapped = [rounding[1], rounding[0]];
            let bound = with_view(core, |view| {
                plane(pose2, n, pose1, view, swapped, reach, out)
            });
            out[from..].iter_mut().for_each(|t| *t = t.reversed());
            bound
        }
        (core1, core2) => with_view(core1, |first| {
            with_view(core2, |second| {
                convex_convex([pose1, pose2], [first, second], rounding, sight, reach, out)
            })
        }),
    })
}

fn keep(touch: Touch, reach: f64, out: &mut Vec<Touch>) -> f64 {
    if touch.gap <= reach {
        out.push(touch);
    }
    touch.gap
}

/// Calls `run` with the corners and faces of a core, if it has any.
fn with_view(core: &Core, run: impl FnOnce(View) -> f64) -> f64 {
    match core {
        Core::Polygon(polygon) => run(View::from(polygon.as_ref())),
        Core::Edge(edge) => run(View::from(edge.as_ref())),
        &Core::Box(h) => run(View {
            points: &corners(h),
            normals: &BOX_NORMALS,
            center: Vec2::zeros(),
            exposed: None,
            edge: None,
            alone: [false; 2],
        }),
        Core::Ball(_) | Core::HalfPlane(_) | Core::Other(_) => f64::INFINITY,
    }
}

/// The faces of a box, in the order of its [`corners`].
pub(super) const BOX_NORMALS: [Vec2; 4] = [
    Vec2::new(1.0, 0.0),
    Vec2::new(0.0, 1.0),
    Vec2::new(-1.0, 0.0),
    Vec2::new(0.0, -1.0),
];

/// Corners, counter-clockwise; the faces between each and the next are +x, +y, −x, −y.
pub(super) fn corners(h: Vec2) -> [Vec2; 4] {
    [
        Vec2::new(h.x, -h.y),
        Vec2::new(h.x, h.y),
        Vec2::new(-h.x, h.y),
        Vec2::new(-h.x, -h.y),
    ]
}

fn ball_ball(pose1: &Pose64, r1: f64, pose2: &Pose64, r2: f64) -> Touch {
    let d = pose2.translation - pose1.translation;
    let distance = d.norm();
    // concentric balls have no normal: the rule is to push upwards
    let normal = if distance > 0.0 {
        d / distance
    } else {
        Vec2::y()
    };
    let gap = distance - r1 - r2;
    Touch {
        normal,
        point: pose1.translation + normal * (r1 + 0.5 * gap),
        gap,
        feature: 0,
    }
}

/// A part that is no ball, and its number in `sight`, with a ball: its centre and radius.
fn with_ball(
    pose: &Pose64,
    part: &Part,
    (center, radius): (Vec2, f64),
    (sight, own): (&Sight, usize),
    reach: f64,
    out: &mut Vec<Touch>,
) -> f64 {
    let rounding = part.rounding;
    match &part.core {
        &Core::Box(half) => keep(box_ball(pose, half, rounding, center, radius), reach, out),
        Core::Polygon(polygon) => {
            let (touch, bound) = polygon_ball(pose, polygon, rounding, center, radius);
            touch.map_or(bound, |touch| keep(touch, reach, out).min(bound))
        }
        Core::Edge(edge) => {
            let past = sight.of(own, pose);
            edges::edge_ball(pose, edge, rounding, (center, radius), past, reach, out)
        }
        &Core::HalfPlane(n) => {
            let normal = pose.rotate(n);
            let gap = normal.dot(&(center - pose.translation)) - radius - rounding;
            let touch = Touch {
                normal,
                point: center - normal * (radius + 0.5 * gap),
                gap,
                feature: 0,
            };
            keep(touch, reach, out)
        }
        Core::Ball(_) | Core::Other(_) => f64::INFINITY,
    }
}

fn box_ball(pose: &Pose64, half: Vec2, rounding: f64, center: Vec2, radius: f64) -> Touch {
    let c = pose.apply_inverse(center);
    let nearest = Vec2::new(c.x.clamp(-half.x, half.x), c.y.clamp(-half.y, half.y));
    let d = c - nearest;
    let distance = d.norm();
    let (normal, separation) = if distance > 0.0 {
        (d / distance, distance)
    } else {
        // the centre lies inside: take the nearest face
        let depth = half - c.abs();
        let axis = if depth.x < depth.y {
            Vec2::x()
        } else {
            Vec2::y()
        };
        let side = if c.dot(&axis) < 0.0 { -1.0 } else { 1.0 };
        (axis * side, -depth.x.min(depth.y))
    };
    let gap = separation - radius - rounding;
    Touch {
        normal: pose.rotate(normal),
        point: pose.apply(c - normal * (radius + 0.5 * gap)),
        gap,
        feature: 0,
    }
}

/// A half-plane, with the face most opposed to its normal.
fn plane(
    pose: &Pose64,
    n: Vec2,
    other_pose: &Pose64,
    other: View,
    rounding: [f64; 2],
    reach: f64,
    out: &mut Vec<Touch>,
) -> f64 {
    let normal = pose.rotate(n);
    let both = rounding[0] + rounding[1];
    let toward = other_pose.unrotate(-normal);
    let height = |q: Vec2| normal.dot(&(other_pose.apply(q) - pose.translation));
    let bound = other.points.iter().map(|q| height(*q));
    let bound = bound.fold(f64::INFINITY, f64::min) - both;
    if bound > reach {
        return bound;
    }
    let against = |k: &usize| other_pose.rotate(other.normals[*k]).dot(&normal);
    let lowest = (0..other.normals.len()).min_by(|a, b| against(a).total_cmp(&against(b)));
    let k = lowest.unwrap_or(0);
    for j in [k, (k + 1) % other.points.len()] {
        let p = other_pose.apply(other.points[j]);
        let gap = height(other.points[j]) - both;
        let owned = other
            .edge
            .is_none_or(|edge| !edge.one_sided || edge.is_owner(j, toward, 0));
        if gap <= reach && owned {
            out.push(Touch {
                normal,
                point: p - normal * (rounding[1] + 0.5 * gap),
                gap,
                feature: j as u32,
            });
        }
    }
    bound
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A core without rounding.
    pub(in crate::rapier) fn sharp(core: Core) -> Part {
        Part {
            core,
            rounding: 0.0,
        }
    }

    fn gaps(p1: Pose64, s1: &Part, p2: Pose64, s2: &Part) -> Vec<Touch> {
        let mut out = Vec::new();
        touches([&p1, &p2], [s1, s2], &Sight::default(), 1.0, &mut out);
        out
    }

    #[test]
    fn stacked_boxes_touch_at_both_ends_whatever_the_offset() {
        let unit = sharp(Core::Box(Vec2::new(0.5, 0.5)));
        for offset in [0.0, 1000.0] {
            let a = Pose64::new(Vec2::new(offset, 0.0), 0.0);
            let b = Pose64::new(Vec2::new(offset + 0.25, 1.0 + 1e-7), 0.0);
            let found = gaps(a, &unit, b, &unit);
            assert_eq!(found.len(), 2);
            for t in &found {
                // one rounding of the offset's coordinate
                assert!((t.gap - 1e-7).abs() < 1e-15 + 4.0 * f64::EPSILON * offset);
                assert!((t.normal - Vec2::y()).norm() < 1e-15);
            }
            assert!((found[1].point.x - found[0].point.x).abs() > 0.74);
        }
    }

    #[test]
    fn normals_point_from_the_first_to_the_second() {
        let ball = sharp(Core::Ball(0.5));
        let bx = sharp(Core::Box(Vec2::new(0.5, 0.5)));
        let low = Pose64::new(Vec2::zeros(), 0.3);
        let high = Pose64::new(Vec2::new(0.1, 1.2), -0.7);
        for (s1, s2) in [(&ball, &ball), (&ball, &bx), (&bx, &ball), (&bx, &bx)] {
            let up = gaps(low, s1, high, s2);
            let down = gaps(high, s2, low, s1);
            assert_eq!(up.len(), down.len());
            assert!(!up.is_empty());
            // the two orders may number the two ends differently
            let sorted = |mut found: Vec<Touch>| {
                found.sort_by(|a, b| a.gap.total_cmp(&b.gap));
                found
            };
            for (u, d) in sorted(up).iter().zip(&sorted(down)) {
                assert!(u.normal.y > 0.5);
                assert!((u.normal + d.normal).norm() < 1e-14, "{u:?} {d:?}");
                assert!((u.gap - d.gap).abs() < 1e-14);
            }
        }
    }

    /// A disc touches a box on a face or at a corner, a capsule on its side or at an end.
    #[test]
    fn faces_are_told_from_corners() {
        let half = Vec2::new(0.5, 0.2);
        let points = corners(half).to_vec();
        let edge = Edge::new(Vec2::new(-0.5, 0.0), Vec2::new(0.5, 0.0), false).unwrap();
        let capsule = Part {
            core: Core::Edge(Arc::new(edge)),
            rounding: 0.2,
        };
        let polygon = Polygon::new(points).unwrap();
        let flats = [
            sharp(Core::Box(half)),
            sharp(Core::Polygon(Arc::new(polygon))),
            capsule,
        ];
        let pose = Pose64::new(Vec2::new(0.3, 0.4), 0.7);
        let disc = sharp(Core::Ball(2.0));
        for flat in &flats {
            for (at, expected) in [(0.0, true), (0.45, true), (0.6, false), (-1.5, false)] {
                let place = Pose64::new(pose.apply(Vec2::new(at, 2.2)), 0.0);
                let found = gaps(pose, flat, place, &disc);
                assert_eq!(found.len(), 1);
                let face = flat.is_face(pose.unrotate(found[0].normal));
                assert_eq!(face, expected, "{at}");
            }
        }
        assert!(!disc.is_face(Vec2::y()));
    }

    /// Against the distance of densely sampled outlines.
    #[test]
    fn tilted_corner_gap_is_the_corner_height() {
        let half = Vec2::new(0.3, 0.2);
        let floor = Pose64::new(Vec2::new(0.0, -1.0), 0.0);
        for angle in [0.05, 0.4, 1.2, -0.6] {
            let pose = Pose64::new(Vec2::new(0.2, 0.5), angle);
            let lowest = (0..4)
                .map(|i| pose.apply(corners(half)[i]).y)
                .fold(f64::INFINITY, f64::min);
            let found = gaps(
                floor,
                &sharp(Core::Box(Vec2::new(5.0, 1.0))),
                pose,
                &sharp(Core::Box(half)),
            );
            let least = found.iter().map(|t| t.gap).fold(f64::INFINITY, f64::min);
            assert!((least - lowest).abs() < 1e-15);
        }
    }
}
