//! Gaps of convex polygons in `f64`.
//!
//! parry's own (GJK, then EPA, in `f32`) now and then takes a wrong face for two polygons that just
//! touch, and reports a gap of minus their thickness: an arch of voussoirs bursts.

use super::kernels::Touch;
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// Outward unit normal of edge `k` and its distance from the origin.
fn face(points: &[Vec2], k: usize) -> (Vec2, f64) {
    let along = points[(k + 1) % points.len()] - points[k];
    let normal = Vec2::new(along.y, -along.x).normalize();
    (normal, normal.dot(&points[k]))
}

/// Largest separation of `other` from a face of `base` \[m\], and the face; both in `base`'s frame.
fn separation(base: &[Vec2], other: &[Vec2]) -> (f64, usize) {
    let along = |k: usize| {
        let (normal, extent) = face(base, k);
        let nearest = other.iter().map(|p| normal.dot(p));
        nearest.fold(f64::INFINITY, f64::min) - extent
    };
    (0..base.len())
        .map(|k| (along(k), k))
        .fold((f64::NEG_INFINITY, 0), |best, next| {
            if next.0 > best.0 { next } else { best }
        })
}

/// Separating-axis reference face, incident face clipped to it: at most two points.
///
/// # Arguments
/// - `first`, `second`: corners in each shape's frame \[m\], counter-clockwise, at least three.
///
/// Sources: Ericson, *Real-Time Collision Detection* (2005), §5.5; Catto, GDC 2007.
pub(super) fn polygon_polygon(
    pose1: &Pose64,
    first: &[Vec2],
    pose2: &Pose64,
    second: &[Vec2],
    out: &mut Vec<Touch>,
) {
    let into = |pose: &Pose64, from: &Pose64, points: &[Vec2]| -> Vec<Vec2> {
        let seen = |p: &Vec2| pose.apply_inverse(from.apply(*p));
        points.iter().map(seen).collect()
    };
    let second_in_1 = into(pose1, pose2, second);
    let first_in_2 = into(pose2, pose1, first);
    let (s1, f1) = separation(first, &second_in_1);
    let (s2, f2) = separation(second, &first_in_2);
    // a tie belongs to shape 1, so that resting polygons keep their reference face
    let slack = 1e-6 * size(first).min(size(second));
    let (base, other, pose, k, flipped) = if s2 > s1 + slack {
        (second, &first_in_2, pose2, f2, true)
    } else {
        (first, &second_in_1, pose1, f1, false)
    };
    let (normal, extent) = face(base, k);
    let tangent = Vec2::new(-normal.y, normal.x);
    // incident face: the one that looks most against the normal
    let look = |i: usize| face(other, i).0.dot(&normal);
    let incident = (0..other.len())
        .min_by(|&a, &b| look(a).total_cmp(&look(b)))
        .unwrap_or(0);
    let end = |p: Vec2| (tangent.dot(&p), normal.dot(&p) - extent);
    let mut a = end(other[incident]);
    let mut b = end(other[(incident + 1) % other.len()]);
    let bounds = [base[k], base[(k + 1) % base.len()]].map(|p| tangent.dot(&p));
    for (side, bound) in [(-1.0, bounds[0]), (1.0, bounds[1])] {
        let (da, db) = (side * (a.0 - bound), side * (b.0 - bound));
        let cut = |inner: (f64, f64), outer: (f64, f64), share: f64| {
            let s = inner.1 + share * (outer.1 - inner.1);
            (inner.0 + share * (outer.0 - inner.0), s)
        };
        if da > 0.0 && db > 0.0 {
            return;
        } else if da > 0.0 {
            a = cut(b, a, db / (db - da));
        } else if db > 0.0 {
            b = cut(a, b, da / (da - db));
        }
    }
    // features are numbered along the reference face, so they persist while it does
    let mut points = [a, b];
    points.sort_by(|p, q| p.0.total_cmp(&q.0));
    if flipped {
        points.reverse();
    }
    let world = pose.rotate(normal);
    for (i, (t, gap)) in points.into_iter().enumerate() {
        out.push(Touch {
            normal: if flipped { -world } else { world },
            point: pose.apply(tangent * t + normal * (extent + 0.5 * gap)),
            gap,
            feature: i as u32 | u32::from(flipped) << 1 | (k as u32) << 2,
        });
    }
}

/// The point of a polygon nearest to a ball's centre; from inside, out by the nearest face.
pub(super) fn polygon_ball(pose: &Pose64, points: &[Vec2], center: Vec2, radius: f64) -> Touch {
    let c = pose.apply_inverse(center);
    let (separation, k) = self::separation(points, &[c]);
    let (mut normal, mut distance) = (face(points, k).0, separation);
    if separation > 0.0 {
        let nearest = (0..points.len())
            .map(|k| nearest_on_edge(points[k], points[(k + 1) % points.len()], c))
            .min_by(|p, q| (c - p).norm_squared().total_cmp(&(c - q).norm_squared()));
        let away = c - nearest.unwrap_or(c);
        // on the face itself its normal stands
        if away.norm() > 0.0 {
            (normal, distance) = (away.normalize(), away.norm());
        }
    }
    let gap = distance - radius;
    Touch {
        normal: pose.rotate(normal),
        point: pose.apply(c - normal * (radius + 0.5 * gap)),
        gap,
        feature: 0,
    }
}

fn nearest_on_edge(a: Vec2, b: Vec2, p: Vec2) -> Vec2 {
    let along = b - a;
    a + along * ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0)
}

/// Smaller extent of the bounding box \[m\].
fn size(points: &[Vec2]) -> f64 {
    let (low, high) = points
        .iter()
        .fold((points[0], points[0]), |(low, high), p| {
            (low.inf(p), high.sup(p))
        });
    (high - low).min()
}

#[cfg(test)]
mod tests {
    use super::super::kernels::{Exact, touches};
    use super::*;

    fn rectangle(half: Vec2) -> Exact {
        let corner = |x: f64, y: f64| Vec2::new(x * half.x, y * half.y);
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        Exact::Polygon(corners.map(|(x, y)| corner(x, y)).into())
    }

    /// A rectangle is a box, against every other shape and in either order.
    #[test]
    fn a_polygon_of_four_corners_is_a_box() {
        let half = Vec2::new(0.3, 0.2);
        let (polygon, same) = (rectangle(half), Exact::Box(half));
        let others = [
            Exact::Ball(0.25),
            Exact::Box(Vec2::new(0.5, 0.1)),
            rectangle(Vec2::new(0.5, 0.1)),
        ];
        let sorted = |mut found: Vec<Touch>| {
            found.sort_by(|a, b| a.point.x.total_cmp(&b.point.x));
            found
        };
        let mut met = 0;
        // 0 is left out: square on, faces tie, and the two count them from different ones
        for k in 1..200 {
            // around each other, apart and overlapping, at all angles
            let (turn, way) = (0.37 * f64::from(k), 0.61 * f64::from(k));
            let distance = 0.2 + 0.4 * (0.77 * f64::from(k)).sin().abs();
            let a = Pose64::new(Vec2::new(0.4, -0.2), turn);
            let offset = Vec2::new(way.cos(), way.sin()) * distance;
            let b = Pose64::new(a.translation + offset, 1.3 * turn);
            for other in &others {
                for swap in [false, true] {
                    let find = |shape: &Exact| {
                        let mut out = Vec::new();
                        match swap {
                            false => touches(&a, shape, &b, other, 1.0, &mut out),
                            true => touches(&b, other, &a, shape, 1.0, &mut out),
                        }
                        sorted(out)
                    };
                    let (as_polygon, as_box) = (find(&polygon), find(&same));
                    assert_eq!(as_polygon.len(), as_box.len(), "{k} {other:?} {swap}");
                    for (p, q) in as_polygon.iter().zip(&as_box) {
                        met += 1;
                        // a few roundings of numbers of size one
                        assert!((p.gap - q.gap).abs() < 1e-14, "{k} {other:?} {p:?} {q:?}");
                        assert!((p.normal - q.normal).norm() < 1e-13, "{k} {other:?}");
                        assert!((p.point - q.point).norm() < 1e-13, "{k} {other:?}");
                    }
                }
            }
        }
        assert!(met > 1000, "{met}");
    }

    /// Two voussoirs that share a joint touch at its two ends, wherever they stand.
    #[test]
    fn voussoirs_touch_at_both_ends_of_their_joint() {
        let beta = 0.1f64;
        let corner = |r: f64, angle: f64| Vec2::new(angle.cos(), angle.sin()) * r;
        let points = [
            corner(0.95, -beta),
            corner(1.05, -beta),
            corner(1.05, beta),
            corner(0.95, beta),
        ];
        let stone = Exact::Polygon(points.into());
        for k in 0..30 {
            let at = |k: f64| Pose64::new(Vec2::zeros(), 2.0 * beta * k);
            let (a, b) = (at(f64::from(k)), at(f64::from(k) + 1.0));
            let mut found = Vec::new();
            touches(&a, &stone, &b, &stone, 1.0, &mut found);
            assert_eq!(found.len(), 2);
            let joint = 2.0 * beta * (f64::from(k) + 0.5);
            for (touch, radius) in found.iter().zip([1.05, 0.95]) {
                assert!(touch.gap.abs() < 1e-15);
                assert!(
                    (touch.point - corner(radius, joint)).norm() < 1e-14 || {
                        let other = 2.0 - radius;
                        (touch.point - corner(other, joint)).norm() < 1e-14
                    }
                );
            }
            assert!((found[0].point - found[1].point).norm() > 0.099);
        }
    }
}
