//! Gaps of balls, boxes and convex polygons in `f64`: exact to round-off, where parry's are to 1e-7 of the size.

use super::convex::{polygon_ball, polygon_polygon};
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use std::sync::Arc;

/// A shape with a closed-form gap.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Exact {
    /// Radius \[m\].
    Ball(f64),
    /// Half extents \[m\].
    Box(Vec2),
    /// Corners, counter-clockwise, at least three.
    Polygon(Arc<[Vec2]>),
}

/// One contact between two exact shapes, signs as in [`crate::contact`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Touch {
    pub normal: Vec2,
    /// Halfway between the two surfaces.
    pub point: Vec2,
    pub gap: f64,
    pub feature: u32,
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

/// Contacts of shape 1 with shape 2 that are nearer than `reach` \[m\], at most two.
pub(super) fn touches(
    pose1: &Pose64,
    shape1: &Exact,
    pose2: &Pose64,
    shape2: &Exact,
    reach: f64,
    out: &mut Vec<Touch>,
) {
    out.clear();
    match (shape1, shape2) {
        (&Exact::Ball(r1), &Exact::Ball(r2)) => {
            let d = pose2.translation - pose1.translation;
            let distance = d.norm();
            // concentric balls have no normal of their own: push upwards, by rule
            let normal = if distance > 0.0 {
                d / distance
            } else {
                Vec2::y()
            };
            let gap = distance - r1 - r2;
            out.push(Touch {
                normal,
                point: pose1.translation + normal * (r1 + 0.5 * gap),
                gap,
                feature: 0,
            });
        }
        (&Exact::Box(half), &Exact::Ball(r)) => {
            out.push(box_ball(pose1, half, pose2.translation, r));
        }
        (&Exact::Ball(r), &Exact::Box(half)) => {
            out.push(box_ball(pose2, half, pose1.translation, r).reversed());
        }
        (&Exact::Box(h1), &Exact::Box(h2)) => box_box(pose1, h1, pose2, h2, out),
        (Exact::Polygon(points), &Exact::Ball(r)) => {
            out.push(polygon_ball(pose1, points, pose2.translation, r));
        }
        (&Exact::Ball(r), Exact::Polygon(points)) => {
            out.push(polygon_ball(pose2, points, pose1.translation, r).reversed());
        }
        (Exact::Polygon(a), Exact::Polygon(b)) => polygon_polygon(pose1, a, pose2, b, out),
        (Exact::Polygon(a), &Exact::Box(h)) => polygon_polygon(pose1, a, pose2, &corners(h), out),
        (&Exact::Box(h), Exact::Polygon(b)) => polygon_polygon(pose1, &corners(h), pose2, b, out),
    }
    out.retain(|t| t.gap <= reach);
}

fn box_ball(pose: &Pose64, half: Vec2, center: Vec2, radius: f64) -> Touch {
    let c = pose.apply_inverse(center);
    let nearest = Vec2::new(c.x.clamp(-half.x, half.x), c.y.clamp(-half.y, half.y));
    let d = c - nearest;
    let distance = d.norm();
    let (normal, separation) = if distance > 0.0 {
        (d / distance, distance)
    } else {
        // the centre lies inside: out by the nearest face
        let depth = half - c.abs();
        let axis = if depth.x < depth.y {
            Vec2::x()
        } else {
            Vec2::y()
        };
        let side = if c.dot(&axis) < 0.0 { -1.0 } else { 1.0 };
        (axis * side, -depth.x.min(depth.y))
    };
    let gap = separation - radius;
    let surface = c - normal * (radius + 0.5 * gap);
    Touch {
        normal: pose.rotate(normal),
        point: pose.apply(surface),
        gap,
        feature: 0,
    }
}

/// The four outward face normals of a box and the half extent along each.
fn face(half: Vec2, k: usize) -> (Vec2, f64) {
    match k {
        0 => (Vec2::x(), half.x),
        1 => (Vec2::y(), half.y),
        2 => (-Vec2::x(), half.x),
        _ => (-Vec2::y(), half.y),
    }
}

fn corners(half: Vec2) -> [Vec2; 4] {
    std::array::from_fn(|k| corner(half, k))
}

fn corner(half: Vec2, k: usize) -> Vec2 {
    match k {
        0 => Vec2::new(half.x, half.y),
        1 => Vec2::new(-half.x, half.y),
        2 => Vec2::new(-half.x, -half.y),
        _ => Vec2::new(half.x, -half.y),
    }
}

/// Largest face separation of `other` from `base`, and its face.
fn separation(base: Vec2, other: Vec2, relative: &Pose64) -> (f64, usize) {
    let mut best = (f64::NEG_INFINITY, 0);
    for k in 0..4 {
        let (n, extent) = face(base, k);
        let nearest = (0..4)
            .map(|i| n.dot(&relative.apply(corner(other, i))))
            .fold(f64::INFINITY, f64::min);
        if nearest - extent > best.0 {
            best = (nearest - extent, k);
        }
    }
    best
}

fn relative(base: &Pose64, other: &Pose64) -> Pose64 {
    Pose64 {
        translation: base.apply_inverse(other.translation),
        cos: base.cos * other.cos + base.sin * other.sin,
        sin: base.cos * other.sin - base.sin * other.cos,
    }
}

/// Separating-axis reference face, incident face clipped to it.
///
/// Sources: Ericson, *Real-Time Collision Detection* (2005), §5.5; Catto, GDC 2007.
fn box_box(pose1: &Pose64, h1: Vec2, pose2: &Pose64, h2: Vec2, out: &mut Vec<Touch>) {
    let r12 = relative(pose1, pose2);
    let r21 = relative(pose2, pose1);
    let (s1, f1) = separation(h1, h2, &r12);
    let (s2, f2) = separation(h2, h1, &r21);
    // a tie belongs to shape 1, so that stacked boxes keep their reference face
    let slack = 1e-6 * h1.x.min(h1.y).min(h2.x).min(h2.y);
    let (base, other, pose, rel, k, flipped) = if s2 > s1 + slack {
        (h2, h1, pose2, r21, f2, true)
    } else {
        (h1, h2, pose1, r12, f1, false)
    };
    let (normal, extent) = face(base, k);
    let tangent = Vec2::new(-normal.y, normal.x);
    let width = if k % 2 == 0 { base.y } else { base.x };
    // incident face: the one that looks most against the normal
    let incident = (0..4)
        .min_by(|&a, &b| {
            let look = |i| rel.rotate(face(other, i).0).dot(&normal);
            look(a).total_cmp(&look(b))
        })
        .unwrap_or(0);
    let ends = match incident {
        0 => [3, 0],
        1 => [0, 1],
        2 => [1, 2],
        _ => [2, 3],
    }
    .map(|i| {
        let p = rel.apply(corner(other, i));
        (tangent.dot(&p), normal.dot(&p) - extent)
    });
    let [mut a, mut b] = ends;
    for side in [1.0, -1.0] {
        let (da, db) = (side * a.0 - width, side * b.0 - width);
        let cut = |inner: (f64, f64), outer: (f64, f64), di: f64, d_o: f64| {
            let s = di / (di - d_o);
            (
                inner.0 + s * (outer.0 - inner.0),
                inner.1 + s * (outer.1 - inner.1),
            )
        };
        if da > 0.0 && db > 0.0 {
            return;
        } else if da > 0.0 {
            a = cut(b, a, db, da);
        } else if db > 0.0 {
            b = cut(a, b, da, db);
        }
    }
    // features are numbered along the reference face, so they persist while it does
    let mut points = [a, b];
    points.sort_by(|p, q| p.0.total_cmp(&q.0));
    if flipped {
        points.reverse();
    }
    for (i, (t, gap)) in points.into_iter().enumerate() {
        let local = tangent * t + normal * (extent + 0.5 * gap);
        let world = pose.rotate(normal);
        out.push(Touch {
            normal: if flipped { -world } else { world },
            point: pose.apply(local),
            gap,
            feature: i as u32 | (k as u32) << 1 | u32::from(flipped) << 3,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gaps(p1: Pose64, s1: &Exact, p2: Pose64, s2: &Exact) -> Vec<Touch> {
        let mut out = Vec::new();
        touches(&p1, s1, &p2, s2, 1.0, &mut out);
        out
    }

    #[test]
    fn stacked_boxes_touch_at_both_ends_whatever_the_offset() {
        let unit = Exact::Box(Vec2::new(0.5, 0.5));
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
        let (ball, bx) = (Exact::Ball(0.5), Exact::Box(Vec2::new(0.5, 0.5)));
        let low = Pose64::new(Vec2::zeros(), 0.3);
        let high = Pose64::new(Vec2::new(0.1, 1.2), -0.7);
        for (s1, s2) in [(&ball, &ball), (&ball, &bx), (&bx, &ball), (&bx, &bx)] {
            let up = gaps(low, s1, high, s2);
            let down = gaps(high, s2, low, s1);
            assert_eq!(up.len(), down.len());
            assert!(!up.is_empty());
            // the two orders may number the two ends the other way round
            let sorted = |mut found: Vec<Touch>| {
                found.sort_by(|a, b| a.gap.total_cmp(&b.gap));
                found
            };
            for (u, d) in sorted(up).iter().zip(&sorted(down)) {
                assert!(u.normal.y > 0.5);
                assert!((u.normal + d.normal).norm() < 1e-14, "{s1:?} {s2:?}");
                assert!((u.gap - d.gap).abs() < 1e-14);
            }
        }
    }

    /// Against the distance of densely sampled outlines.
    #[test]
    fn tilted_corner_gap_is_the_corner_height() {
        let half = Vec2::new(0.3, 0.2);
        let floor = Pose64::new(Vec2::new(0.0, -1.0), 0.0);
        for angle in [0.05, 0.4, 1.2, -0.6] {
            let pose = Pose64::new(Vec2::new(0.2, 0.5), angle);
            let lowest = (0..4)
                .map(|i| pose.apply(corner(half, i)).y)
                .fold(f64::INFINITY, f64::min);
            let found = gaps(
                floor,
                &Exact::Box(Vec2::new(5.0, 1.0)),
                pose,
                &Exact::Box(half),
            );
            let least = found.iter().map(|t| t.gap).fold(f64::INFINITY, f64::min);
            assert!((least - lowest).abs() < 1e-15);
        }
    }
}
