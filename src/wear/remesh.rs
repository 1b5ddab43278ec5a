use super::contain::lowered;
use super::polygon::crossing;
use super::{Profile, WearError, in_range, signed_area};
use crate::contact::Vec2;

/// Shortest and longest edge allowed, in cell sizes.
const EDGE_RANGE: [f64; 2] = [0.5, 1.5];

/// Brings every edge into [0.5, 1.5] of the cell size and keeps the area.
///
/// - **Merge.** The shortest edge (a, b) between p and q becomes one node
///   `m = m₀ + τ n`, `τ = 2 (A(p, m₀, q) − A(p, a, b, q)) / |q − p|`                   (1)
///   with `m₀` its midpoint, `n` the normal of the chord p q and `A` the signed area: the area
///   under p a b q and under p m q is the same. An end node must not move, so there the next edge
///   is merged into its far node instead. On a convex part `m` lies outside of the polyline. If it
///   lies outside of the new part too, it moves straight down until it does not, and the area
///   decreases.
///   On a ring, which is not measured against the new part, such a node stays at `m₀` instead, and the
///   area decreases as well: no node ever moves out.
/// - **Split.** An edge longer than 1.5 cells is cut into equal parts of 0.75 to 1.25 cells, on
///   itself.
///
/// # Arguments
/// - `profile`: without crossings.
/// - `cell_size` \[m\].
/// - `new`: the profile within which all nodes must stay, or `None` for no such bound.
///
/// # Returns
/// The profile with its new nodes, and the area \[m²\] removed to keep it within `new`, exactly 0
/// if no node lay outside; `None` if every edge is in range already.
///
/// # Errors
/// [`WearError::Range`] unless `cell_size` is finite and above 0; [`WearError::TooFewNodes`] if the
/// profile is too short for its cells; [`WearError::Crossing`] if a merge makes it cross itself;
/// [`WearError::Unbalanced`] if a merged node stays outside of `new` at any height.
pub fn remesh(
    profile: &Profile,
    cell_size: f64,
    new: Option<&Profile>,
) -> Result<Option<(Profile, f64)>, WearError> {
    let inside = cell_size > 0.0 && cell_size.is_finite();
    in_range("cell size [m]", cell_size, inside, "finite and above 0")?;
    let [low, high] = EDGE_RANGE.map(|r| r * cell_size);
    let fits = |length: &f64| (low..=high).contains(length);
    if profile.edges().iter().all(fits) {
        return Ok(None);
    }
    let mut nodes = profile.nodes().to_vec();
    let mut taken = 0.0;
    let ring = profile.is_ring();
    while let Some(edge) = shortest_below(&nodes, low, ring) {
        if ring {
            taken += merge_on_ring(&mut nodes, edge)?;
            continue;
        }
        let node = merge(&mut nodes, edge)?;
        if let Some(new) = new {
            let (before, merged, after) = (nodes[node - 1], nodes[node], nodes[node + 1]);
            nodes[node] = lowered(before, merged, after, new, cell_size, node)?;
            // the triangle that the two edges sweep
            taken += 0.5 * (merged.y - nodes[node].y) * (after.x - before.x);
        }
    }
    let mut split = vec![nodes[0]];
    for [a, b] in profile.moved(nodes.clone())?.edge_ends() {
        let edge = nodes[b] - nodes[a];
        let length = edge.norm();
        if length > high {
            let parts = (length / cell_size).round();
            let inner = 1..parts as usize;
            split.extend(inner.map(|k| nodes[a] + (k as f64 / parts) * edge));
        }
        if b != 0 {
            split.push(nodes[b]);
        }
    }
    Ok(Some((profile.moved(split)?.simple()?, taken)))
}

/// The shortest edge, if it is below `low`.
fn shortest_below(nodes: &[Vec2], low: f64, ring: bool) -> Option<usize> {
    let mut best = None;
    let mut least = low;
    let count = nodes.len() - usize::from(!ring);
    for i in 0..count {
        let length = (nodes[(i + 1) % nodes.len()] - nodes[i]).norm();
        if length < least {
            (best, least) = (Some(i), length);
        }
    }
    best
}

/// Merges an edge by equation (1) of [`remesh`] and returns the new node; the ends do not move.
fn merge(nodes: &mut Vec<Vec2>, edge: usize) -> Result<usize, WearError> {
    let edges = nodes.len() - 1;
    if edges < 3 {
        return Err(WearError::TooFewNodes {
            found: nodes.len(),
            needed: 4,
        });
    }
    let (a, start) = match edge {
        0 => (1, nodes[2]),
        e if e == edges - 1 => (e - 1, nodes[e - 1]),
        e => (e, 0.5 * (nodes[e] + nodes[e + 1])),
    };
    let quad = [nodes[a - 1], nodes[a], nodes[a + 1], nodes[a + 2]];
    let chord = quad[3] - quad[0];
    let Some(unit) = chord.try_normalize(0.0) else {
        return Err(WearError::Crossing {
            first: a - 1,
            second: a + 1,
        });
    };
    let excess = signed_area(&[quad[0], start, quad[3]]) - signed_area(&quad);
    let shift = 2.0 * excess / chord.norm();
    nodes[a] = start + shift * Vec2::new(-unit.y, unit.x);
    nodes.remove(a + 1);
    Ok(a)
}

/// Merges an edge of a ring, see [`remesh`]; returns the area \[m²\] that is lost.
fn merge_on_ring(nodes: &mut Vec<Vec2>, edge: usize) -> Result<f64, WearError> {
    let n = nodes.len();
    if n < 5 {
        return Err(WearError::TooFewNodes {
            found: n,
            needed: 5,
        });
    }
    let quad = [n - 1, 0, 1, 2].map(|k| nodes[(edge + k) % n]);
    let middle = 0.5 * (quad[1] + quad[2]);
    let chord = quad[3] - quad[0];
    let excess = signed_area(&[quad[0], middle, quad[3]]) - signed_area(&quad);
    // beyond the chord's line lies the outside
    let (node, lost) = match chord.try_normalize(0.0) {
        Some(unit) if excess < 0.0 => {
            let inward = 2.0 * excess / chord.norm();
            (middle + inward * Vec2::new(-unit.y, unit.x), 0.0)
        }
        _ => (middle, excess),
    };
    // the first node stays the first
    if edge + 1 == n {
        nodes[0] = node;
        nodes.pop();
    } else {
        nodes[edge] = node;
        nodes.remove(edge + 1);
    }
    Ok(lost)
}

/// Cuts the loops off a profile that crosses itself.
///
/// Where edges `i < j` cross, the crossing point replaces the nodes between them: wear from both
/// sides has counted the steel of the loop twice. The ends do not move. A ring that crosses itself is
/// refused: which part of it is the body is not known.
///
/// # Returns
/// The simple profile, and the area \[m²\] by which it lies higher than before (signed); the
/// profile itself and exactly 0 if nothing crosses.
///
/// # Errors
/// [`WearError::TooFewNodes`] if fewer than 3 nodes remain; [`WearError::ZeroEdge`];
/// [`WearError::Crossing`] for a ring.
pub fn clip_loops(profile: &Profile) -> Result<(Profile, f64), WearError> {
    if profile.is_ring() {
        return Ok((profile.clone().simple()?, 0.0));
    }
    let mut nodes = profile.nodes().to_vec();
    let mut clipped = false;
    while let Some((i, j)) = crossing(&nodes, |_, _| false) {
        clipped = true;
        if j == i + 1 {
            // a fold straight back: a spike of no area
            nodes.remove(j);
        } else {
            let (a, b) = (nodes[i], nodes[i + 1]);
            let (c, d) = (nodes[j], nodes[j + 1]);
            let denominator = (d - c).perp(&(b - a));
            // collinear edges overlap at c
            let t = if denominator == 0.0 {
                1.0
            } else {
                (a - c).perp(&(b - a)) / denominator
            };
            let point = if denominator == 0.0 {
                c
            } else {
                c + t.clamp(0.0, 1.0) * (d - c)
            };
            nodes.splice(i + 1..=j, [point]);
        }
        nodes.dedup();
    }
    if !clipped {
        return Ok((profile.clone(), 0.0));
    }
    let simple = profile.moved(nodes)?.simple()?;
    let change = simple.area_above(0.0) - profile.area_above(0.0);
    Ok((simple, change))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn profile(xy: &[(f64, f64)]) -> Profile {
        Profile::unchecked(xy.iter().map(|&(x, y)| Vec2::new(x, y)).collect()).unwrap()
    }

    proptest! {
        #[test]
        fn edges_come_into_range_and_the_area_stays(
            steps in prop::collection::vec((0.02f64..3.0, -0.4f64..0.4), 8..30),
        ) {
            let mut p = Vec2::new(0.0, 5.0);
            let mut nodes = vec![p];
            for (dx, slope) in steps {
                p += Vec2::new(dx, slope * dx);
                nodes.push(p);
            }
            let old = Profile::new(nodes).unwrap();
            let (new, taken) = remesh(&old, 1.0, None).unwrap().unwrap_or((old.clone(), 0.0));
            prop_assert_eq!(taken, 0.0);
            prop_assert!(new.edges().iter().all(|l| (0.5..=1.5).contains(l)));
            // round-off of an area of a few hundred
            prop_assert!((new.area_above(0.0) - old.area_above(0.0)).abs() < 1e-11);
            prop_assert_eq!(new.nodes()[0], old.nodes()[0]);
            prop_assert_eq!(new.nodes().last(), old.nodes().last());
        }
    }

    #[test]
    fn a_mesh_in_range_is_left_alone_and_one_too_short_is_refused() {
        let p = profile(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.5), (3.2, 0.0)]);
        assert_eq!(remesh(&p, 1.0, None), Ok(None));
        assert!(matches!(
            remesh(&p, 20.0, None),
            Err(WearError::TooFewNodes { .. })
        ));
        assert!(matches!(
            remesh(&p, f64::NAN, None),
            Err(WearError::Range { .. })
        ));
    }

    #[test]
    fn a_merge_that_would_grow_steel_takes_some_instead() {
        let cap = profile(&[(0.0, 0.0), (1.0, 0.5), (1.2, 0.5), (2.2, 0.0), (3.2, -0.5)]);
        let (free, _) = remesh(&cap, 1.0, None).unwrap().unwrap();
        // the two corners make one 0.05 above them: the same area, but steel that was never there
        assert!((free.rise_over(&cap) - 0.5 / 11.0).abs() < 1e-15);
        let (kept, taken) = remesh(&cap, 1.0, Some(&cap)).unwrap().unwrap();
        // within 1e-9 of a cell
        assert!(kept.rise_over(&cap) <= 1e-9);
        assert!((taken - 0.05).abs() < 1e-8, "{taken}");
        let lost = cap.area_above(0.0) - kept.area_above(0.0);
        // round-off of an area of 1
        assert!((lost - taken).abs() < 1e-15);
        // one that is deep inside is left as it is
        let low = profile(&[
            (0.0, -1.0),
            (1.0, -0.5),
            (1.2, -0.5),
            (2.2, -1.0),
            (3.2, -1.5),
        ]);
        assert_eq!(remesh(&low, 1.0, Some(&cap)), remesh(&low, 1.0, None));
    }

    #[test]
    fn a_loop_is_found_and_cut_off() {
        // a swallow-tail: the edges after nodes 1 and 3 cross at (2, 1)
        let tail = profile(&[
            (0.0, 0.0),
            (1.0, 0.0),
            (3.0, 2.0),
            (1.0, 2.0),
            (3.0, 0.0),
            (4.0, 0.0),
        ]);
        let (simple, change) = clip_loops(&tail).unwrap();
        let expected = profile(&[(0.0, 0.0), (1.0, 0.0), (2.0, 1.0), (3.0, 0.0), (4.0, 0.0)]);
        assert_eq!(simple, expected);
        // the loop (2,1) (3,2) (1,2) runs against the sense of steel above: area −1 under it
        assert_eq!(change, 1.0);
        assert_eq!(clip_loops(&simple), Ok((expected, 0.0)));
    }
}
