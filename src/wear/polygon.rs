use super::WearError;
use crate::contact::Vec2;

/// Signed area of a closed polygon, `½ Σ (x_i y_{i+1} − x_{i+1} y_i)` \[m²\]: positive if
/// counter-clockwise. Computed about the first vertex, which loses no digits far from the origin.
pub fn signed_area(polygon: &[Vec2]) -> f64 {
    let Some(&origin) = polygon.first() else {
        return 0.0;
    };
    let twice: f64 = polygon
        .windows(2)
        .map(|e| (e[0] - origin).perp(&(e[1] - origin)))
        .sum();
    0.5 * twice
}

/// Checks that a closed polygon is fit to be a collider: simple and counter-clockwise.
///
/// # Errors
/// [`WearError::TooFewNodes`] below 3 vertices; [`WearError::NonFinite`]; [`WearError::ZeroEdge`];
/// [`WearError::Crossing`] where two edges cross, touch or fold back; [`WearError::Winding`] unless
/// the signed area is above 0.
pub fn check_polygon(polygon: &[Vec2]) -> Result<(), WearError> {
    if polygon.len() < 3 {
        return Err(WearError::TooFewNodes {
            found: polygon.len(),
            needed: 3,
        });
    }
    let mut closed = polygon.to_vec();
    closed.push(polygon[0]);
    check_nodes(&closed)?;
    if let Some((first, second)) = crossing_of_ring(polygon) {
        return Err(WearError::Crossing { first, second });
    }
    let measure = signed_area(polygon);
    if measure > 0.0 {
        Ok(())
    } else {
        Err(WearError::Winding { measure })
    }
}

/// Checks that an open polyline is fit to be a collider: without crossings.
///
/// # Errors
/// [`WearError::NonFinite`]; [`WearError::ZeroEdge`]; [`WearError::Crossing`] where two edges cross,
/// touch or fold back.
pub fn check_chain(points: &[Vec2]) -> Result<(), WearError> {
    check_nodes(points)?;
    match crossing(points, |_, _| false) {
        Some((first, second)) => Err(WearError::Crossing { first, second }),
        None => Ok(()),
    }
}

/// Refuses nodes that are not finite and edges without length.
pub(super) fn check_nodes(nodes: &[Vec2]) -> Result<(), WearError> {
    if let Some(index) = nodes
        .iter()
        .position(|p| !(p.x.is_finite() && p.y.is_finite()))
    {
        return Err(WearError::NonFinite {
            what: "node",
            index,
        });
    }
    match nodes.windows(2).position(|e| e[0] == e[1]) {
        Some(node) => Err(WearError::ZeroEdge { node }),
        None => Ok(()),
    }
}

/// The first pair of edges (i < j, in order of i, with the largest j) of an open polyline that
/// cross, touch or fold back, without the pairs that `skip` excludes.
pub(super) fn crossing(
    nodes: &[Vec2],
    skip: impl Fn(usize, usize) -> bool,
) -> Option<(usize, usize)> {
    let edges = nodes.len().saturating_sub(1);
    for i in 0..edges {
        for j in (i + 2..edges).rev() {
            if !skip(i, j) && touch(nodes[i], nodes[i + 1], nodes[j], nodes[j + 1]) {
                return Some((i, j));
            }
        }
        if i + 1 < edges && folds_back(nodes[i], nodes[i + 1], nodes[i + 2]) {
            return Some((i, i + 1));
        }
    }
    None
}

/// [`crossing`] of a closed polyline, without its first node again.
pub(super) fn crossing_of_ring(nodes: &[Vec2]) -> Option<(usize, usize)> {
    let last = nodes.len().checked_sub(1)?;
    let mut closed = nodes.to_vec();
    closed.push(nodes[0]);
    let found = crossing(&closed, |i, j| (i, j) == (0, last));
    // the only adjacent pair that the check of an open polyline leaves out
    found.or_else(|| {
        let folded = last > 0 && folds_back(nodes[last], nodes[0], nodes[1]);
        folded.then_some((0, last))
    })
}

/// Whether the path a → b → c turns straight back on itself.
fn folds_back(a: Vec2, b: Vec2, c: Vec2) -> bool {
    (b - a).perp(&(c - b)) == 0.0 && (b - a).dot(&(c - b)) < 0.0
}

/// Whether two closed segments share a point.
fn touch(a: Vec2, b: Vec2, c: Vec2, d: Vec2) -> bool {
    let apart = |p: f64, q: f64, r: f64, s: f64| p.max(q) < r.min(s) || r.max(s) < p.min(q);
    if apart(a.x, b.x, c.x, d.x) || apart(a.y, b.y, c.y, d.y) {
        return false;
    }
    let side = |p: Vec2, q: Vec2, r: Vec2| {
        let area = (q - p).perp(&(r - p));
        // signum of 0 is 1 in Rust; a point on the line must read 0
        if area == 0.0 { 0.0 } else { area.signum() }
    };
    side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(xy: &[(f64, f64)]) -> Vec<Vec2> {
        xy.iter().map(|&(x, y)| Vec2::new(x, y)).collect()
    }

    #[test]
    fn a_square_passes_and_its_mirror_does_not() {
        let square = points(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]);
        assert_eq!(check_polygon(&square), Ok(()));
        assert_eq!(signed_area(&square), 1.0);
        let back: Vec<_> = square.iter().rev().copied().collect();
        assert_eq!(
            check_polygon(&back),
            Err(WearError::Winding { measure: -1.0 })
        );
    }

    #[test]
    fn crossings_touches_and_folds_are_named() {
        let bow = points(&[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]);
        assert_eq!(
            check_polygon(&bow),
            Err(WearError::Crossing {
                first: 0,
                second: 2
            })
        );
        let touching = points(&[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 0.0), (0.0, 1.0)]);
        assert!(matches!(
            check_polygon(&touching),
            Err(WearError::Crossing { first: 0, .. })
        ));
        let fold = points(&[(0.0, 0.0), (2.0, 0.0), (1.0, 0.0), (1.0, 1.0)]);
        assert!(matches!(
            check_polygon(&fold),
            Err(WearError::Crossing { .. })
        ));
    }

    #[test]
    fn degenerate_polygons_are_refused() {
        let twice = points(&[(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (0.0, 1.0)]);
        assert_eq!(check_polygon(&twice), Err(WearError::ZeroEdge { node: 1 }));
        let nan = points(&[(0.0, 0.0), (1.0, f64::NAN), (0.0, 1.0)]);
        assert!(matches!(
            check_polygon(&nan),
            Err(WearError::NonFinite { index: 1, .. })
        ));
        assert!(matches!(
            check_polygon(&nan[..2]),
            Err(WearError::TooFewNodes { .. })
        ));
    }
}
