use super::super::tests::sharp;
use super::super::{Core, Part, Polygon, touches};
use super::*;
use std::sync::Arc;

fn rectangle(half: Vec2) -> Part {
    let corner = |x: f64, y: f64| Vec2::new(x * half.x, y * half.y);
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let points = corners.map(|(x, y)| corner(x, y)).to_vec();
    sharp(Core::Polygon(Polygon::new(points).unwrap().into()))
}

/// A polygon of four corners has the gaps of a box, against every other shape and in either
/// order.
#[test]
fn a_polygon_of_four_corners_is_a_box() {
    let half = Vec2::new(0.3, 0.2);
    let (polygon, same) = (rectangle(half), sharp(Core::Box(half)));
    let others = [
        sharp(Core::Ball(0.25)),
        sharp(Core::Box(Vec2::new(0.5, 0.1))),
        rectangle(Vec2::new(0.5, 0.1)),
    ];
    let sorted = |mut found: Vec<Touch>| {
        found.sort_by(|a, b| a.point.x.total_cmp(&b.point.x));
        found
    };
    let mut met = 0;
    // 0 is left out: for parallel faces there is a tie, and the two count faces from different
    // ones
    for k in 1..200 {
        // around each other, apart and overlapping, at all angles
        let (turn, way) = (0.37 * f64::from(k), 0.61 * f64::from(k));
        let distance = 0.2 + 0.4 * (0.77 * f64::from(k)).sin().abs();
        let a = Pose64::new(Vec2::new(0.4, -0.2), turn);
        let offset = Vec2::new(way.cos(), way.sin()) * distance;
        let b = Pose64::new(a.translation + offset, 1.3 * turn);
        for other in &others {
            for swap in [false, true] {
                let find = |shape: &Part| {
                    let (none, mut out) = (Sight::default(), Vec::new());
                    match swap {
                        false => touches([&a, &b], [shape, other], &none, 1.0, &mut out),
                        true => touches([&b, &a], [other, shape], &none, 1.0, &mut out),
                    };
                    sorted(out)
                };
                let (as_polygon, as_box) = (find(&polygon), find(&same));
                assert_eq!(as_polygon.len(), as_box.len(), "{k} {swap}");
                for (p, q) in as_polygon.iter().zip(&as_box) {
                    met += 1;
                    // a few roundings of numbers of size one
                    assert!((p.gap - q.gap).abs() < 1e-14, "{k} {p:?} {q:?}");
                    assert!((p.normal - q.normal).norm() < 1e-13, "{k}");
                    assert!((p.point - q.point).norm() < 1e-13, "{k}");
                }
            }
        }
    }
    assert!(met > 1000, "{met}");
}

/// Two voussoirs that share a joint touch at its two ends, at any pose.
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
    let stone = sharp(Core::Polygon(Polygon::new(points.to_vec()).unwrap().into()));
    for k in 0..30 {
        let at = |k: f64| Pose64::new(Vec2::zeros(), 2.0 * beta * k);
        let (a, b) = (at(f64::from(k)), at(f64::from(k) + 1.0));
        let mut found = Vec::new();
        touches([&a, &b], [&stone; 2], &Sight::default(), 1.0, &mut found);
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

/// Bug: a box that landed with a face on the corner of two segments had no contact with either,
/// as the deepest of its own corners under one segment lay beside it.
#[test]
fn a_face_on_the_corner_of_two_segments_is_met_at_any_depth() {
    let [p, q, r] = [[0.55, 0.34], [-0.55, 0.39], [-1.64, -0.31]].map(Vec2::from);
    let mut edges = [[p, q], [q, r]].map(|[a, b]| Edge::new(a, b, true).unwrap());
    edges[0].neighbours = [Some(Vec2::x()), Some((r - q).normalize())];
    edges[1].neighbours = [Some((p - q).normalize()), Some(-Vec2::x())];
    let fallen = sharp(Core::Box(Vec2::new(0.26, 0.175)));
    let place = Pose64::new(Vec2::zeros(), 0.0);
    for depth in [0.001, 0.01, 0.02, 0.05] {
        let pose = Pose64::new(Vec2::new(-0.4776, 0.6928 - depth), -1.22);
        for turned in [false, true] {
            let mut out = Vec::new();
            for edge in &edges {
                let part = sharp(Core::Edge(Arc::new(edge.clone())));
                let (poses, parts) = match turned {
                    true => ([&pose, &place], [&fallen, &part]),
                    false => ([&place, &pose], [&part, &fallen]),
                };
                touches(poses, parts, &Sight::default(), 0.0, &mut out);
            }
            let least = out.iter().map(|t| t.gap).fold(0.0, f64::min);
            let up = out.iter().all(|t| t.normal.y.abs() > 0.8);
            assert!(
                up && (-depth - 1e-3..-0.8 * depth + 1e-3).contains(&least),
                "{depth} {out:?}"
            );
        }
    }
}

/// Bug: where the corner of an outline lay on a two-sided segment to the last digit, rounding told
/// its side, and neither of its two sides had a contact.
#[test]
fn a_corner_on_a_segment_is_met_whatever_rounding_tells() {
    let corner = Vec2::new(0.1, 0.2);
    let ends = [Vec2::new(-0.4, 0.5), Vec2::new(0.6, 0.45)];
    let mut sides = ends.map(|end| Edge::new(end, corner, false).unwrap());
    for (k, side) in sides.iter_mut().enumerate() {
        side.neighbours[1] = Some((ends[1 - k] - corner).normalize());
        side.owns[1] = k == 0;
    }
    let floor = Edge::new(Vec2::new(-1.1, 0.0), Vec2::new(0.9, 0.0), false).unwrap();
    let floor = sharp(Core::Edge(Arc::new(floor)));
    let sides = sides.map(|side| sharp(Core::Edge(Arc::new(side))));
    for turn in (0..40).map(|k| 0.01 * f64::from(k)) {
        let base = Pose64::new(Vec2::new(0.3, 0.7), turn);
        let mut signs = [false; 2];
        for ulps in -4..=4 {
            // the corner lies over 0.13 of the floor
            let spin = 0.3 - 0.02 * f64::from(ulps);
            let mut own = Pose64::new(Vec2::zeros(), turn + spin);
            let height = f64::EPSILON * f64::from(ulps);
            own.translation = base.apply(Vec2::new(0.13, height)) - own.rotate(corner);
            signs[usize::from(base.apply_inverse(own.apply(corner)).y < 0.0)] = true;
            let mut out = Vec::new();
            for side in &sides {
                let normals = match &side.core {
                    Core::Edge(edge) => edge.normals,
                    _ => unreachable!(),
                };
                let down = own.unrotate(base.rotate(-Vec2::y()));
                let face = usize::from(normals[0].dot(&down) < 0.0);
                let sight = Sight {
                    faces: [Some(1), Some(face)],
                    motion: f64::INFINITY,
                    ..Sight::default()
                };
                touches([&base, &own], [&floor, side], &sight, 1e-3, &mut out);
            }
            let up = base.rotate(Vec2::y());
            let met = |t: &Touch| t.gap.abs() < 1e-14 && t.normal.dot(&up) > 1.0 - 1e-9;
            assert!(out.iter().any(met), "{turn} {ulps}: {out:?}");
        }
        assert_eq!(signs, [true; 2], "{turn}");
    }
}
