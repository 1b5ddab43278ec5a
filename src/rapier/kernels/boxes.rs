//! Two boxes, the most frequent pair.

use super::{Touch, relative};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// Chooses a reference face by separating axes and clips the incident face to it: at most two
/// points.
///
/// Returns the largest separation along a face normal \[m\], a lower bound of the distance; beyond
/// `reach` nothing is added.
///
/// Sources: Ericson, *Real-Time Collision Detection* (2005), §5.5; Catto, GDC 2007.
pub(super) fn box_box(
    pose1: &Pose64,
    h1: Vec2,
    pose2: &Pose64,
    h2: Vec2,
    reach: f64,
    out: &mut Vec<Touch>,
) -> f64 {
    let seen = relative(pose1, pose2);
    let (c, s) = (seen.cos, seen.sin);
    let (ac, as_) = (c.abs(), s.abs());
    let there = seen.translation;
    let back = Vec2::new(-(c * there.x + s * there.y), s * there.x - c * there.y);
    let spread = |h: Vec2| Vec2::new(ac * h.x + as_ * h.y, as_ * h.x + ac * h.y);
    let apart1 = there.abs() - h1 - spread(h2);
    let apart2 = back.abs() - h2 - spread(h1);
    let (s1, s2) = (apart1.max(), apart2.max());
    let bound = s1.max(s2);
    if bound > reach {
        return bound;
    }
    // a tie goes to shape 1, so that stacked boxes keep their reference face
    let slack = 1e-6 * h1.x.min(h1.y).min(h2.x).min(h2.y);
    let flipped = s2 > s1 + slack;
    let (base, other, pose, at, turn, apart) = if flipped {
        (h2, h1, pose2, back, (c, -s), apart2)
    } else {
        (h1, h2, pose1, there, (c, s), apart1)
    };
    // the face of the base that faces the other's centre, as (sign, axis)
    let along_x = apart.x >= apart.y;
    let side = if along_x { at.x } else { at.y };
    let sign = 1f64.copysign(side);
    let (extent, width) = if along_x {
        (base.x, base.y)
    } else {
        (base.y, base.x)
    };
    let normal = if along_x {
        Vec2::new(sign, 0.0)
    } else {
        Vec2::new(0.0, sign)
    };
    let tangent = Vec2::new(-normal.y, normal.x);
    // the incident face, most opposed to the normal: its two corners, counter-clockwise
    let (oc, os) = turn;
    let m = Vec2::new(oc * normal.x + os * normal.y, oc * normal.y - os * normal.x);
    let corners = if m.x.abs() > m.y.abs() {
        let x = -other.x.copysign(m.x);
        let y = other.y.copysign(x);
        [Vec2::new(x, -y), Vec2::new(x, y)]
    } else {
        let y = -other.y.copysign(m.y);
        let x = other.x.copysign(y);
        [Vec2::new(x, y), Vec2::new(-x, y)]
    };
    let [mut a, mut b] = corners.map(|p| {
        let p = at + Vec2::new(oc * p.x - os * p.y, os * p.x + oc * p.y);
        (tangent.dot(&p), normal.dot(&p) - extent)
    });
    for way in [1.0, -1.0] {
        let (da, db) = (way * a.0 - width, way * b.0 - width);
        let cut = |inner: (f64, f64), outer: (f64, f64), di: f64, d_o: f64| {
            let share = di / (di - d_o);
            (
                inner.0 + share * (outer.0 - inner.0),
                inner.1 + share * (outer.1 - inner.1),
            )
        };
        if da > 0.0 && db > 0.0 {
            return bound;
        } else if da > 0.0 {
            a = cut(b, a, db, da);
        } else if db > 0.0 {
            b = cut(a, b, da, db);
        }
    }
    // features are numbered along the reference face, so they persist while that face does
    let mut points = if a.0 <= b.0 { [a, b] } else { [b, a] };
    if flipped {
        points.reverse();
    }
    let face = u32::from(!along_x) | u32::from(sign < 0.0) << 1;
    let world = pose.rotate(normal);
    for (i, (t, gap)) in points.into_iter().enumerate() {
        if gap <= reach {
            out.push(Touch {
                normal: if flipped { -world } else { world },
                point: pose.apply(tangent * t + normal * (extent + 0.5 * gap)),
                gap,
                feature: i as u32 | face << 1 | u32::from(flipped) << 3,
            });
        }
    }
    bound
}
