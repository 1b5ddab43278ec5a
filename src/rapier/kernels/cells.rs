//! Segments that are cells of a foundation: springs along the segment's normal.
//!
//! The overlap of a foundation carries its load, so it may be deeper than a cell is long, and the
//! least overlap says nothing about the way in. A cell is therefore pressed along its own normal,
//! over the whole width that the other part covers. It is left out where another direction separates
//! the two more and belongs to a neighbour: the wall beside a face that is pressed is not pressed.

use super::edges::Edge;
use super::facing::behind;
use super::polygon::View;
use super::{Core, Part, Touch, relative, with_view};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// Cosine of 45 degrees: a face within that of a cell presses it.
const NEARLY: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Part of a cell that is covered: its two ends as (distance along the cell, gap) \[m\].
type Covered = [(f64, f64); 2];

/// Adds the two ends of the width of a `cell`, part 1 (0) or part 2 (1), that the other part covers,
/// if either is nearer than `reach` \[m\]. Their normal is that of the cell.
///
/// Returns a lower bound of the gap, or of the motion before there may be a contact \[m\]. `None` for
/// two-sided segments, rounded parts and other parts without faces.
pub(in crate::rapier) fn cell_touches(
    poses: [&Pose64; 2],
    parts: [&Part; 2],
    cell: usize,
    reach: f64,
    out: &mut Vec<Touch>,
) -> Option<f64> {
    let Core::Edge(edge) = &parts[cell].core else {
        return None;
    };
    if !edge.one_sided || parts.iter().any(|part| part.rounding != 0.0) {
        return None;
    }
    let seen = relative(poses[cell], poses[1 - cell]);
    let back = relative(poses[1 - cell], poses[cell]);
    let mut covered = None;
    let bound = match &parts[1 - cell].core {
        Core::Ball(_) | Core::Other(_) => return None,
        &Core::HalfPlane(normal) => {
            let gaps = over_plane(edge, seen.rotate(normal), seen.translation);
            covered = gaps.1;
            gaps.0
        }
        core => with_view(core, |other| {
            let gaps = over_view(edge, &other, &seen, &back);
            covered = gaps.1;
            gaps.0
        }),
    };
    let Some(mut ends) = covered else {
        return Some(bound);
    };
    if ends[0].1.min(ends[1].1) > reach {
        return Some(bound);
    }
    if ends[0].0 > ends[1].0 {
        ends.reverse();
    }
    let (normal, along) = (edge.normals[0], edge.along());
    for (feature, (t, gap)) in (0..).zip(ends) {
        let touch = Touch {
            normal: poses[cell].rotate(normal),
            point: poses[cell].apply(edge.ends[0] + along * t + normal * (0.5 * gap)),
            gap,
            feature,
        };
        out.push(if cell == 0 { touch } else { touch.reversed() });
    }
    Some(bound)
}

/// A bound of the gap, and what a part with corners covers of a cell. Poses of the part in the frame
/// of the cell and back.
fn over_view(edge: &Edge, other: &View, seen: &Pose64, back: &Pose64) -> (f64, Option<Covered>) {
    let beyond = behind(edge, other, seen);
    if beyond > 0.0 {
        return (0.5 * beyond, None);
    }
    let normal = edge.normals[0];
    let height = |p: Vec2| normal.dot(&(p - edge.ends[0]));
    let faces = match other.edge {
        Some(line) if line.one_sided => 1,
        _ => other.normals.len(),
    };
    // the face that presses
    let toward = back.rotate(-normal);
    let against = |k: &usize| other.normals[*k].dot(&toward);
    let incident = (0..faces).max_by(|a, b| against(a).total_cmp(&against(b)));
    let slack = 1e-6 * edge.length();
    let mut bound = f64::NEG_INFINITY;
    let mut least = f64::NEG_INFINITY;
    for k in 0..faces {
        let m = seen.rotate(other.normals[k]);
        let start = seen.apply(other.points[k]);
        let [a, b] = edge.ends.map(|p| m.dot(&(p - start)));
        bound = bound.max(a.min(b));
        let end = usize::from(b < a);
        let presses = incident == Some(k) && -m.dot(&normal) > NEARLY;
        if !presses && edge.has_neighbour_facing(end, -m) {
            // of two cells that lie equally deep, the one whose start is the corner is pressed
            let tie = if end == 0 { -slack } else { slack };
            least = least.max(a.min(b) + tie);
        }
    }
    let lowest = other.points.iter().map(|q| height(seen.apply(*q)));
    let (nearest, lowest) =
        lowest
            .enumerate()
            .fold((0, f64::INFINITY), |best, (j, h)| match h < best.1 {
                true => (j, h),
                false => best,
            });
    bound = bound.max(lowest);
    // the depth of a segment whose neighbour leads on is not that of its line
    let owned = |k: &usize| {
        other.edge.is_none_or(|line| {
            let ends = !line.leads_on(nearest, toward);
            line.is_owner(nearest, toward, 0) && (ends || against(k) > NEARLY)
        })
    };
    let Some(k) = incident.filter(|k| against(k) > 0.0 && owned(k)) else {
        return (bound, None);
    };
    let along = edge.along();
    let ends = other.face(k).map(|q| {
        let p = seen.apply(q);
        (along.dot(&(p - edge.ends[0])), height(p))
    });
    let covered = within(ends, edge.length());
    // so deep that the broad phase need not see them
    let deepest = other.edge.map_or(f64::INFINITY, |line| {
        edge.depth_share() + line.depth_share()
    });
    let passed = |[a, b]: &Covered| a.1.max(b.1) < -deepest;
    // deeper than along another face, that a neighbour meets; or pressed from behind, by a far face of
    // what does not reach the cell at all
    let beside = |[a, b]: &Covered| {
        let lowest = a.1.min(b.1);
        lowest < least || (bound > 0.0 && lowest < -slack)
    };
    (
        bound,
        covered.filter(|covered| !beside(covered) && !passed(covered)),
    )
}

/// [`over_view`] for a half-plane with a normal and a point of its border, in the frame of the cell.
fn over_plane(edge: &Edge, m: Vec2, origin: Vec2) -> (f64, Option<Covered>) {
    let heights = edge.ends.map(|p| m.dot(&(p - origin)));
    let end = usize::from(heights[1] < heights[0]);
    let facing = -m.dot(&edge.normals[0]);
    if facing <= 0.0 || !edge.is_owner(end, -m, 0) {
        return (heights[end], None);
    }
    let [a, b] = heights.map(|h| h / facing);
    (heights[end], Some([(0.0, a), (edge.length(), b)]))
}

/// A line of (distance along the cell, height), cut to a cell's length; `None` if it lies beside it.
fn within([mut a, mut b]: Covered, length: f64) -> Option<Covered> {
    for (side, limit) in [(-1.0, 0.0), (1.0, length)] {
        let (over_a, over_b) = (side * (a.0 - limit), side * (b.0 - limit));
        let cut = |share: f64| (limit, a.1 + share * (b.1 - a.1));
        match (over_a > 0.0, over_b > 0.0) {
            (true, true) => return None,
            (true, false) => a = cut(over_a / (over_a - over_b)),
            (false, true) => b = cut(over_a / (over_a - over_b)),
            (false, false) => {}
        }
    }
    Some([a, b])
}
