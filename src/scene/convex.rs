//! Distances of convex pieces: polygons, segments and points, from their corners alone.
//!
//! This module uses no contact code: measurements of an engine must not share code with the engine.

use crate::contact::Vec2;

/// Distance of two cores \[m\]. If they overlap, minus the least overlap; two points never overlap.
///
/// Where the cores are farther apart than `enough`, any distance between `enough` and theirs may be
/// returned: that from one edge costs a fraction of that of all corners.
pub(super) fn gap(a: &[Vec2], b: &[Vec2], enough: f64) -> f64 {
    let apart = faces(a, b).max(faces(b, a));
    if apart < 0.0 && apart.is_finite() || apart > enough {
        return apart;
    }
    corners(a, b).min(corners(b, a))
}

/// Largest distance of `other` from an edge, seen along its normal; −∞ for a point.
fn faces(core: &[Vec2], other: &[Vec2]) -> f64 {
    let n = core.len();
    let edges = if n > 1 { n } else { 0 };
    let face = |k: usize| {
        let along = core[(k + 1) % n] - core[k];
        let normal = Vec2::new(along.y, -along.x).normalize();
        let nearest = other.iter().map(|p| normal.dot(&(p - core[k])));
        nearest.fold(f64::INFINITY, f64::min)
    };
    (0..edges).map(face).fold(f64::NEG_INFINITY, f64::max)
}

/// Least distance of a corner from an edge of `other`.
fn corners(points: &[Vec2], other: &[Vec2]) -> f64 {
    let n = other.len();
    let nearest = |p: &Vec2| {
        let edges = (0..n).map(|k| to_segment(p, &other[k], &other[(k + 1) % n]));
        edges.fold(f64::INFINITY, f64::min)
    };
    points.iter().map(nearest).fold(f64::INFINITY, f64::min)
}

/// Distance \[m\] of a point from a segment.
pub(super) fn to_segment(p: &Vec2, a: &Vec2, b: &Vec2) -> f64 {
    let along = b - a;
    let length = along.norm_squared();
    let t = if length > 0.0 {
        ((p - a).dot(&along) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p - a - along * t).norm()
}

/// Least extent \[m\] of a core over all directions: that across one of its edges. 0 for points and
/// segments.
pub(super) fn width(core: &[Vec2]) -> f64 {
    let n = core.len();
    if n < 3 {
        return 0.0;
    }
    let across = |k: usize| {
        let along = (core[(k + 1) % n] - core[k]).normalize();
        let away = core.iter().map(|p| along.perp(&(p - core[k])).abs());
        away.fold(0.0, f64::max)
    };
    (0..n).map(across).fold(f64::INFINITY, f64::min)
}

/// Corners of the convex hull of points, counter-clockwise; fewer than three if they lie on a line.
///
/// Source: Andrew, *Another efficient algorithm for convex hulls in two dimensions*, Inf. Proc. Letters 9 (1979).
pub(super) fn hull(mut points: Vec<Vec2>) -> Vec<Vec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    let chain = |points: &mut dyn Iterator<Item = &Vec2>| {
        let mut chain: Vec<Vec2> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp(&(p - b)) <= 0.0
            {
                chain.pop();
            }
            chain.push(*p);
        }
        chain.pop();
        chain
    };
    let mut all = chain(&mut points.iter());
    all.append(&mut chain(&mut points.iter().rev()));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_width_of_points_is_that_of_their_hull() {
        let points = |all: &[[f64; 2]]| all.iter().map(|p| Vec2::from(*p)).collect::<Vec<_>>();
        let corners = hull(points(&[
            [0.0, 0.0],
            [2.0, 1.0],
            [2.0, 0.0],
            [1.0, 0.0],
            [0.0, 1.0],
            [1.0, 0.5],
            [2.0, 1.0],
        ]));
        assert_eq!(
            corners,
            points(&[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])
        );
        assert_eq!(width(&corners), 1.0);
        for line in [
            &[[1.0, 2.0]][..],
            &[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]],
            &[],
        ] {
            assert_eq!(width(&hull(points(line))), 0.0, "{line:?}");
        }
    }

    fn depth(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
        let [a, b] = [a, b].map(|c| c.iter().map(|p| Vec2::from(*p)).collect::<Vec<_>>());
        let found = -gap(&a, &b, f64::INFINITY);
        // either order, a few roundings apart
        assert!((found + gap(&b, &a, f64::INFINITY)).abs() < 1e-15);
        // a lower bound suffices above `enough`, and is above it as well
        for enough in [0.0, 0.3, 3.0] {
            let bound = gap(&a, &b, enough);
            let exact = -found;
            assert!(bound == exact || enough < bound && bound <= exact + 1e-15);
        }
        found
    }

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    #[test]
    fn depths_of_cores_in_each_other_and_apart() {
        let moved = |x: f64, y: f64| SQUARE.map(|p| [p[0] + x, p[1] + y]);
        assert_eq!(depth(&SQUARE, &moved(0.75, 0.5)), 0.25);
        // apart along x, and apart by a diagonal of 3-4-5
        assert_eq!(depth(&SQUARE, &moved(1.5, 0.5)), -0.5);
        assert_eq!(depth(&SQUARE, &moved(4.0, 5.0)), -5.0);
        // points: two, one above a square, one in it
        assert_eq!(depth(&[[0.0, 0.0]], &[[3.0, 4.0]]), -5.0);
        assert_eq!(depth(&SQUARE, &[[0.5, 1.25]]), -0.25);
        assert_eq!(depth(&SQUARE, &[[0.5, 0.875]]), 0.125);
        // segments: crossed, one after the other, and one that cuts a corner off by 0.1 sqrt 2
        let along = [[-1.0, 0.0], [1.0, 0.0]];
        assert_eq!(depth(&along, &[[0.0, -0.5], [0.0, 2.0]]), 0.5);
        assert_eq!(depth(&along, &[[2.0, 0.0], [3.0, 0.0]]), -1.0);
        let cut = depth(&SQUARE, &[[1.2, 0.6], [0.6, 1.2]]);
        assert!((cut - 0.1 * 2f64.sqrt()).abs() < 1e-15, "{cut}");
    }

    #[test]
    fn the_width_is_the_least_extent() {
        let width = |core: &[[f64; 2]]| {
            let core: Vec<Vec2> = core.iter().map(|p| Vec2::from(*p)).collect();
            super::width(&core)
        };
        assert_eq!(
            width(&[[0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]]),
            2.0
        );
        // a 3-4-5 triangle: the height over its longest side
        let height = width(&[[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]]);
        assert!((height - 2.4).abs() < 1e-15, "{height}");
        assert_eq!(width(&[[0.0, 0.0], [1.0, 0.0]]), 0.0);
    }
}
