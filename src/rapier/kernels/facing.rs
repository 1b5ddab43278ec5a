//! The sides of segments on which other parts lie.

use super::edges::Edge;
use super::polygon::{View, size};
use super::sheets::sides_of_sheets;
use super::{Part, Sight, relative, with_view};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// Rounding of distances, as a share of the sizes of two shapes: far below what a contact resolves.
pub(super) const ROUNDING: f64 = 1e-12;

/// Distance, as a share of the shorter of two segments, up to which one that touches the other, or a
/// neighbour of it, may be on the wrong side by what is left of an overlap.
pub(super) const LEFT: f64 = 1e-3;

/// The nearest features of two cores that do not overlap.
pub(super) enum Nearest {
    /// Corners, by their numbers in the two shapes.
    Corners([usize; 2], f64),
    /// A face of the first (0) or second shape (1), and the corner of the other over it.
    Face(usize, [usize; 2], f64),
}

impl Nearest {
    /// The direction from the first core's nearest point to the second's, not of unit length, the distance
    /// \[m\], and the corners that are nearest points.
    pub fn way(&self, views: &[View; 2], poses: &[Pose64; 2]) -> (Vec2, f64, [Option<usize>; 2]) {
        let [first, second] = views;
        match *self {
            Nearest::Corners([i, j], distance) => {
                let way = poses[1].apply(second.points[j]) - poses[0].apply(first.points[i]);
                (way, distance, [Some(i), Some(j)])
            }
            Nearest::Face(0, [k, j], distance) => {
                (poses[0].rotate(first.normals[k]), distance, [None, Some(j)])
            }
            Nearest::Face(_, [k, i], distance) => (
                -poses[1].rotate(second.normals[k]),
                distance,
                [Some(i), None],
            ),
        }
    }
}

pub(super) fn nearest(first: &View, second: &View, seen: &Pose64, back: &Pose64) -> Nearest {
    let slack = ROUNDING * (size(first) + size(second));
    let mut best = Nearest::Corners([0, 0], f64::INFINITY);
    let mut least = f64::INFINITY;
    for (turn, base, other, pose) in [(0, first, second, seen), (1, second, first, back)] {
        let faces = if base.is_segment() {
            1
        } else {
            base.points.len()
        };
        for (j, q) in other.points.iter().enumerate() {
            let p = pose.apply(*q);
            for k in 0..faces {
                let [a, b] = base.face(k);
                let along = b - a;
                let t = (p - a).dot(&along) / along.norm_squared();
                let foot = a + along * t.clamp(0.0, 1.0);
                let distance = (p - foot).norm();
                // a corner over the end of a face lies on the face, and not on a face beside it that
                // ends there too and is as near
                let over = (-1e-9..=1.0 + 1e-9).contains(&t);
                let allowed = match (over, matches!(best, Nearest::Face(..))) {
                    (true, false) => slack,
                    (false, true) => -slack,
                    _ => 0.0,
                };
                if distance < least + allowed {
                    least = distance;
                    let corner = |k: usize| if turn == 0 { [k, j] } else { [j, k] };
                    best = if over {
                        let behind = base.is_segment() && base.normals[0].dot(&(p - a)) < 0.0;
                        Nearest::Face(turn, [if behind { 1 } else { k }, j], distance)
                    } else {
                        let end = if t < 0.0 {
                            k
                        } else {
                            (k + 1) % base.points.len()
                        };
                        Nearest::Corners(corner(end), distance)
                    };
                }
            }
        }
    }
    best
}

/// How far a shape lies behind the line of a one-sided segment \[m\]; negative if part of it lies in
/// front. `pose` is that of the shape in the frame of the segment.
pub(super) fn behind(edge: &Edge, other: &View, pose: &Pose64) -> f64 {
    behind_line((edge.ends[0], edge.normals[0]), other, pose)
}

/// [`behind`] for a line through a point, with its normal.
fn behind_line((foot, normal): (Vec2, Vec2), other: &View, pose: &Pose64) -> f64 {
    let height = |q: &Vec2| normal.dot(&(pose.apply(*q) - foot));
    // the solid behind another segment counts
    let all = other.points.iter().map(height);
    -all.fold(height(&other.center), f64::max)
}

/// Per end of a one-sided segment, whether it has the sharp corner there alone: all of the other shape lies
/// behind the neighbour, which does not meet it then. `pose` is that of the shape in the frame of the segment.
pub(super) fn alone(edge: &Edge, other: &View, pose: &Pose64) -> [bool; 2] {
    let left = LEFT * edge.length().min(size(other));
    [0, 1].map(|end| {
        let normal = edge.next_normal(end, 0);
        let outward = edge.ends[end] - edge.ends[1 - end];
        let bends_away = |normal: &Vec2| normal.dot(&outward) > 0.0;
        edge.one_sided
            && !edge.goes_on_at(end)
            && !is_two_sided(other)
            && (normal.filter(bends_away))
                .is_some_and(|normal| behind_line((edge.ends[end], normal), other, pose) >= -left)
    })
}

/// Whether a two-sided segment that lies `far` behind a one-sided one \[m\] was in front of it in the last
/// step, or at the start of this one, or lay on it by rounding. Of `sight`, the one-sided one
/// is part `own`.
fn came_through(edge: &Edge, other: &View, far: f64, own: usize, sight: &Sight) -> bool {
    let Some(start) = sight.start.filter(|_| far <= sight.motion) else {
        return false;
    };
    let touched = sight.faces[1 - own].is_some();
    let pose = relative(&start[own], &start[1 - own]);
    other.edge.is_some_and(|line| !line.one_sided)
        && (touched || behind(edge, other, &pose) <= 1e-6 * edge.length())
}

/// Whether all of a shape lies behind the line of a face of a segment.
pub(super) fn beyond(edge: &Edge, face: usize, other: &View, pose: &Pose64) -> bool {
    let height = |q: &Vec2| edge.normals[face].dot(&(pose.apply(*q) - edge.ends[0]));
    other.points.iter().all(|q| height(q) <= 0.0)
}

/// Whether two segments cross.
pub(super) fn cross(first: &View, second: &View, seen: &Pose64, back: &Pose64) -> bool {
    let splits = |base: &View, other: &View, pose: &Pose64| {
        let height = |q: Vec2| base.normals[0].dot(&(pose.apply(q) - base.points[0]));
        height(other.points[0]) * height(other.points[1]) < 0.0
    };
    splits(first, second, seen) && splits(second, first, back)
}

pub(super) fn is_two_sided(view: &View) -> bool {
    view.edge.is_some_and(|edge| !edge.one_sided)
}

/// The face of the free segment `i` of two shapes that looks at the solid behind the other one, a one-sided
/// segment. `None` if they are steep to each other, if the free one lies behind where it is nearest, or where a
/// corner that it touches does not tell.
fn facing_solid(
    i: usize,
    poses: [&Pose64; 2],
    views: &[View; 2],
    seen: [&Pose64; 2],
) -> Option<usize> {
    let solid = views[1 - i].edge.filter(|solid| solid.one_sided)?;
    let edge = views[i].edge?;
    edge.neighbours.iter().position(Option::is_none)?;
    let outward = poses[1 - i].rotate(solid.normals[0]);
    let cosine = outward.dot(&poses[i].rotate(edge.normals[0]));
    let [first, second] = views;
    if cosine.abs() <= 0.5 || cross(first, second, seen[0], seen[1]) {
        return None;
    }
    let near = nearest(first, second, seen[0], seen[1]);
    let (way, distance, corners) = near.way(views, &[*poses[0], *poses[1]]);
    let touches = distance <= LEFT * solid.length().min(edge.length());
    let toward = if i == 1 { way } else { -way };
    match (corners[1 - i], corners[i]) {
        // the solid at an overhanging corner is not behind this segment alone
        (Some(end), None) if touches => {
            let away = |face: usize| -poses[i].rotate(edge.normals[face]);
            let admits = |face: &usize| solid.admits(end, poses[1 - i].unrotate(away(*face)));
            let mut faces = (0..2).filter(admits);
            faces.next().filter(|_| faces.next().is_none())
        }
        (Some(_), Some(_)) if touches => None,
        _ => (touches || outward.dot(&toward) > 0.0).then_some(usize::from(cosine > 0.0)),
    }
}

/// The sides of segments on which the other of two shapes lies. The error is how far one of them lies
/// behind a one-sided segment \[m\]. `seen` are the poses of the second in the frame of the first, and
/// of the first in that of the second.
pub(super) fn sides(
    poses: [&Pose64; 2],
    views: &[View; 2],
    seen: [&Pose64; 2],
    sight: &Sight,
) -> Result<[Option<usize>; 2], f64> {
    if let Some(told) = sight.told {
        return Ok(told);
    }
    if let Some(start) = sight.start
        && views.iter().all(is_two_sided)
        && let Some(sides) = sides_of_sheets(views, &start, sight)
    {
        return Ok(sides);
    }
    let mut sides = [None, None];
    for i in 0..2 {
        let (other, pose) = (&views[1 - i], seen[i]);
        sides[i] = match views[i].edge {
            Some(edge) if edge.one_sided => {
                let behind = behind(edge, other, pose);
                // an outline that has sunk into one wall of a corner still meets the other wall
                let left = match other.edge {
                    Some(other) if other.one_sided => LEFT * edge.length().min(other.length()),
                    _ => 0.0,
                };
                if behind > left && !came_through(edge, other, behind, i, sight) {
                    return Err(behind);
                }
                Some(0)
            }
            Some(_) if let Some(face) = facing_solid(i, poses, views, seen) => Some(face),
            Some(edge) => {
                let points = other.points.iter().map(|q| pose.apply(*q));
                let past = sight.of(i, poses[i]);
                let face = edge.side(points, pose.apply(other.inner()), &past);
                // other parts may go round a capsule, but not through its core in no time
                let free = edge.neighbours == [None; 2];
                let gone_round = |start: [Pose64; 2]| {
                    let before = relative(&start[i], &start[1 - i]);
                    free && beyond(edge, face, other, pose) && beyond(edge, face, other, &before)
                };
                Some(match sight.began.is_some_and(gone_round) {
                    true => 1 - face,
                    false => face,
                })
            }
            None => None,
        };
    }
    Ok(sides)
}

/// The [`sides`] of two parts with corners; `None` if one is behind the other.
pub(in crate::rapier) fn sides_of(
    poses: [&Pose64; 2],
    parts: [&Part; 2],
    sight: &Sight,
) -> Option<[Option<usize>; 2]> {
    let mut found = None;
    with_view(&parts[0].core, |first| {
        with_view(&parts[1].core, |second| {
            let seen = relative(poses[0], poses[1]);
            let back = relative(poses[1], poses[0]);
            found = sides(poses, &[first, second], [&seen, &back], sight).ok();
            0.0
        })
    });
    found
}
