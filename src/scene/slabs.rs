//! The solid behind the edges of a polyline, as convex pieces that stay inside it.

use super::outline::signed_area;
use crate::contact::Vec2;

/// The solid behind each edge, at most `thickness` \[m\] of it: a quadrilateral or a triangle, whose
/// first two corners are those of the edge.
///
/// At a convex corner the bisector separates the pieces of the two edges. A piece is at most half as
/// thick as the solid, measured to the edges that face it.
pub(super) fn slabs(points: &[[f64; 2]], closed: bool, thickness: f64) -> Vec<Vec<[f64; 2]>> {
    let n = points.len();
    let count = if closed { n } else { n.saturating_sub(1) };
    let edges: Vec<[Vec2; 2]> = (0..count)
        .map(|k| [points[k], points[(k + 1) % n]].map(Vec2::from))
        .collect();
    let directions: Vec<Vec2> = edges.iter().map(|[a, b]| (b - a).normalize()).collect();
    // twice the area over the outline is the radius of the largest circle inside, or more
    let length: f64 = edges.iter().map(|[a, b]| (b - a).norm()).sum();
    let area = if closed { signed_area(points) } else { 0.0 };
    let thickness = match area > 0.0 {
        true => thickness.min(area / length),
        false => thickness,
    };
    let piece = |k: usize| {
        let [a, b] = edges[k];
        let own = inwards(directions[k]);
        let before = if k > 0 {
            Some(k - 1)
        } else {
            closed.then(|| count - 1)
        };
        let after = if k + 1 < count {
            Some(k + 1)
        } else {
            closed.then_some(0)
        };
        let faces = |j: &usize| {
            let behind = (0.5 * (edges[*j][0] + edges[*j][1]) - a).dot(&own) > 0.0;
            behind
                && own.dot(&inwards(directions[*j])) < 0.0
                && ![before, after].contains(&Some(*j))
        };
        let free = (0..count)
            .filter(faces)
            .map(|j| distance(edges[k], edges[j]));
        let thick = thickness.min(0.5 * free.fold(f64::INFINITY, f64::min));
        let [left, right] = [
            before.map_or(own, |j| offset(own, [directions[j], directions[k]])),
            after.map_or(own, |j| offset(own, [directions[k], directions[j]])),
        ];
        // the length that the piece loses per unit of depth
        let shrinks = directions[k].dot(&(left - right));
        let length = (b - a).norm();
        let corners = match shrinks * thick < length {
            true => vec![a, b, b + right * thick, a + left * thick],
            false => vec![a, b, a + left * (length / shrinks)],
        };
        corners.into_iter().map(|p| [p.x, p.y]).collect()
    };
    (0..count).map(piece).collect()
}

fn inwards(direction: Vec2) -> Vec2 {
    Vec2::new(-direction.y, direction.x)
}

/// Where a corner moves if the edges before and after it move inwards by one unit: along their
/// bisector at a convex corner, else along the normal of the piece's `own` edge.
fn offset(own: Vec2, [before, after]: [Vec2; 2]) -> Vec2 {
    if before.perp(&after) <= 0.0 {
        return own;
    }
    let (m, n) = (inwards(before), inwards(after));
    // two edges that nearly fold back on each other enclose no solid
    (m + n) / (1.0 + m.dot(&n)).max(1e-12)
}

/// Distance of two segments that do not cross \[m\].
fn distance(one: [Vec2; 2], two: [Vec2; 2]) -> f64 {
    let to = |p: Vec2, [a, b]: [Vec2; 2]| {
        let along = b - a;
        let t = ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (p - a - t * along).norm()
    };
    let ends = one
        .map(|p| to(p, two))
        .into_iter()
        .chain(two.map(|p| to(p, one)));
    ends.fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether a point lies in a closed outline: an odd number of edges to its right.
    fn inside(points: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
        let n = points.len();
        let crossed = |k: &usize| {
            let ([x0, y0], [x1, y1]) = (points[*k], points[(k + 1) % n]);
            (y0 > y) != (y1 > y) && x < x0 + (y - y0) * (x1 - x0) / (y1 - y0)
        };
        (0..n).filter(crossed).count() % 2 == 1
    }

    fn star(tips: usize, valley: f64) -> Vec<[f64; 2]> {
        (0..2 * tips)
            .map(|k| {
                let angle = std::f64::consts::PI * k as f64 / tips as f64;
                let r = if k % 2 == 0 { 1.0 } else { valley };
                [r * angle.cos(), r * angle.sin()]
            })
            .collect()
    }

    /// Points well within a piece lie in the outline, at sharp tips and thin necks too.
    #[test]
    fn no_piece_leaves_the_solid() {
        let neck = [
            [-2.0, -1.0],
            [-1.0, -1.0],
            [0.0, -0.01],
            [1.0, -1.0],
            [2.0, -1.0],
            [2.0, 1.0],
            [1.0, 1.0],
            [0.0, 0.01],
            [-1.0, 1.0],
            [-2.0, 1.0],
        ];
        let mut outlines = vec![neck.to_vec()];
        for tips in 3..9 {
            outlines.extend([0.1, 0.4, 0.9].map(|valley| star(tips, valley)));
        }
        for outline in outlines {
            for piece in slabs(&outline, true, 10.0) {
                let count = piece.len() as f64;
                let centre = [0, 1].map(|i| piece.iter().map(|p| p[i]).sum::<f64>() / count);
                for corner in &piece {
                    let p = [0, 1].map(|i| centre[i] + 0.999 * (corner[i] - centre[i]));
                    assert!(inside(&outline, p), "{outline:?} {piece:?}");
                }
            }
        }
    }
}
