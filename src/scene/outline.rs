//! Whether a list of points is the outline of something.

/// A corner \[m\].
type Point = [f64; 2];

/// Shortest edge \[m\] told from a repeated point: the smallest shape allowed.
const SHORTEST_EDGE: f64 = 1e-6;

/// Most points of one outline; the search for crossings looks at every pair of edges.
const MOST_POINTS: usize = 4096;

/// Twice the signed area of the triangle (a, b, c): positive when it turns left.
fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Signed area [m²] of a closed outline by the shoelace formula, positive counter-clockwise.
pub(super) fn signed_area(points: &[Point]) -> f64 {
    let Some(first) = points.first() else {
        return 0.0;
    };
    points
        .windows(2)
        .map(|edge| turn(*first, edge[0], edge[1]))
        .sum::<f64>()
        / 2.0
}

/// A convex polygon, counter-clockwise.
///
/// # Errors
/// What is wrong, for the user.
pub(super) fn check_polygon(points: &[Point]) -> Result<(), String> {
    check_chain(points, true)?;
    if signed_area(points) < 0.0 {
        return Err(
            "the polygon is wound clockwise (a tooth wound the wrong way); \
                    list its corners counter-clockwise"
                .to_owned(),
        );
    }
    let n = points.len();
    for i in 0..n {
        let corner = (i + 1) % n;
        if turn(points[i], points[corner], points[(i + 2) % n]) < 0.0 {
            return Err(format!(
                "the polygon is not convex at corner {corner} (counted from 0); \
                 use a closed polyline, or several bodies"
            ));
        }
    }
    Ok(())
}

/// A chain without repeated points and crossings; a closed one encloses an area.
///
/// # Errors
/// What is wrong, for the user.
pub(super) fn check_chain(points: &[Point], closed: bool) -> Result<(), String> {
    let n = points.len();
    let least = if closed { 3 } else { 2 };
    if !(least..=MOST_POINTS).contains(&n) {
        return Err(format!("{n} points: allowed is {least} to {MOST_POINTS}"));
    }
    let edges = if closed { n } else { n - 1 };
    let edge = |i: usize| (points[i], points[(i + 1) % n]);
    for i in 0..edges {
        let (a, b) = edge(i);
        if (b[0] - a[0]).hypot(b[1] - a[1]) < SHORTEST_EDGE {
            let next = (i + 1) % n;
            return Err(format!(
                "points {i} and {next} (counted from 0) are the same; an edge is at least 1e-6 m"
            ));
        }
    }
    for i in 0..edges {
        for j in i + 1..edges {
            let (p, q) = (edge(i), edge(j));
            let crossing = if j == i + 1 {
                folds_back(p.0, p.1, q.1)
            } else if closed && i == 0 && j == edges - 1 {
                folds_back(q.0, q.1, p.1)
            } else {
                meet(p, q)
            };
            if crossing {
                return Err(format!("edges {i} and {j} (counted from 0) cross or touch"));
            }
        }
    }
    // Round-off of the shoelace sum is about 1e-16 of the square of the extent.
    let extent = points.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    if closed && signed_area(points).abs() <= 1e-14 * extent * extent {
        return Err("the outline encloses no area".to_owned());
    }
    Ok(())
}

/// Whether the edge b-c runs back over a-b.
fn folds_back(a: Point, b: Point, c: Point) -> bool {
    let along = (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1]);
    turn(a, b, c) == 0.0 && along < 0.0
}

/// Whether two segments share a point.
fn meet(p: (Point, Point), q: (Point, Point)) -> bool {
    let sides = [
        turn(p.0, p.1, q.0),
        turn(p.0, p.1, q.1),
        turn(q.0, q.1, p.0),
        turn(q.0, q.1, p.1),
    ];
    let within = |(a, b): (Point, Point), c: Point| {
        (0..2).all(|k| a[k].min(b[k]) <= c[k] && c[k] <= a[k].max(b[k]))
    };
    let touches = [(p, q.0), (p, q.1), (q, p.0), (q, p.1)]
        .into_iter()
        .zip(sides)
        .any(|((segment, point), side)| side == 0.0 && within(segment, point));
    let apart = |a: f64, b: f64| (a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0);
    touches || (apart(sides[0], sides[1]) && apart(sides[2], sides[3]))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [Point; 4] = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];

    #[test]
    fn area_is_signed_by_the_winding() {
        let mut clockwise = SQUARE;
        clockwise.reverse();
        assert_eq!(signed_area(&SQUARE), 4.0);
        assert_eq!(signed_area(&clockwise), -4.0);
    }

    #[test]
    fn a_square_is_a_polygon_and_its_reverse_is_only_a_chain() {
        let mut clockwise = SQUARE;
        clockwise.reverse();
        assert_eq!(check_polygon(&SQUARE), Ok(()));
        assert!(check_polygon(&clockwise).is_err_and(|e| e.contains("clockwise")));
        assert_eq!(check_chain(&clockwise, true), Ok(()));
    }

    #[test]
    fn bad_outlines_are_named() {
        let cases: [(&[Point], bool, &str); 7] = [
            (
                &[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]],
                true,
                "edges 0 and 2",
            ),
            (
                &[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
                true,
                "points 1 and 2",
            ),
            (
                &[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]],
                true,
                "points 3 and 0",
            ),
            (&[[0.0, 0.0], [1.0, 0.0]], true, "2 points: allowed is 3"),
            (&[[0.0, 0.0]], false, "1 points: allowed is 2"),
            (
                &[[0.0, 0.0], [2.0, 0.0], [1.0, 0.0]],
                false,
                "edges 0 and 1",
            ),
            (
                &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]],
                true,
                "cross or touch",
            ),
        ];
        for (points, closed, expected) in cases {
            let error = check_chain(points, closed).unwrap_err();
            assert!(error.contains(expected), "{points:?}: {error}");
        }
        let dented = [[0.0, 0.0], [2.0, 0.0], [1.0, 0.5], [1.0, 2.0]];
        assert!(check_polygon(&dented).is_err_and(|e| e.contains("not convex at corner 2")));
    }
}
