//! Gaps of convex polygons, sharp and rounded, in `f64`.
//!
//! parry's algorithm (GJK, then EPA, in `f32`) now and then chooses a wrong face for two polygons
//! that just touch, and reports a gap of minus their thickness: an arch of voussoirs bursts.

use super::edges::{Edge, half_turn};
use super::{Part, Sight, Touch, relative, with_view};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// A convex polygon in the frame of its part \[m\].
#[derive(Debug, Clone, PartialEq)]
pub(in crate::rapier) struct Polygon {
    /// Corners, counter-clockwise.
    pub points: Box<[Vec2]>,
    /// Outward normals of the face from each point to the next.
    pub normals: Box<[Vec2]>,
    pub center: Vec2,
    /// Least width across a face.
    pub thickness: f64,
}

impl Polygon {
    /// From its corners in either orientation; `None` if they span no area.
    pub fn new(mut points: Vec<Vec2>) -> Option<Polygon> {
        points.dedup();
        if points.len() > 1 && points.first() == points.last() {
            points.pop();
        }
        let n = points.len();
        let twice: f64 = (0..n).map(|i| points[i].perp(&points[(i + 1) % n])).sum();
        if n < 3 || !(twice != 0.0 && twice.is_finite()) {
            return None;
        }
        if twice < 0.0 {
            points.reverse();
        }
        let normals = (0..n).map(|i| {
            let along = (points[(i + 1) % n] - points[i]).normalize();
            Vec2::new(along.y, -along.x)
        });
        let normals: Box<[Vec2]> = normals.collect();
        let depth = |p: &Vec2, i: usize| normals[i].dot(&(points[i] - p));
        let width = |i: usize| points.iter().map(|p| depth(p, i)).fold(0.0, f64::max);
        Some(Polygon {
            thickness: (0..n).map(width).fold(f64::INFINITY, f64::min),
            normals,
            center: points.iter().sum::<Vec2>() / n as f64,
            points: points.into(),
        })
    }

    fn view(&self) -> View<'_> {
        View {
            points: &self.points,
            normals: &self.normals,
            center: self.center,
            edge: None,
        }
    }
}

/// The view of a polygon, box or segment for the algorithm; a segment has a face on both sides.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub points: &'a [Vec2],
    pub normals: &'a [Vec2],
    pub center: Vec2,
    pub edge: Option<&'a Edge>,
}

impl<'a> From<&'a Polygon> for View<'a> {
    fn from(polygon: &'a Polygon) -> Self {
        polygon.view()
    }
}

impl<'a> From<&'a Edge> for View<'a> {
    fn from(edge: &'a Edge) -> Self {
        let [a, b] = edge.ends;
        // a one-sided segment has solid behind it, as deep as it is long
        let depth = f64::from(u8::from(edge.one_sided)) * 0.5 * (b - a).norm();
        View {
            points: &edge.ends,
            normals: &edge.normals,
            center: 0.5 * (a + b) - depth * edge.normals[0],
            edge: Some(edge),
        }
    }
}

impl View<'_> {
    fn next(&self, k: usize) -> Vec2 {
        self.points[(k + 1) % self.points.len()]
    }

    /// Start and end of face `k`; a segment's left face runs the other way.
    pub(super) fn face(&self, k: usize) -> [Vec2; 2] {
        [self.points[k], self.next(k)]
    }

    /// Slope at the start and the end of face `k`: the width of the face that a unit of depth under
    /// it takes. A penetrating point belongs to the face that it is nearer to; the bisector
    /// separates two faces.
    ///
    /// Zero where the algorithm compares the faces of both shapes and takes the best of all.
    fn ridges(&self, k: usize, other: &View) -> [f64; 2] {
        match (self.edge, other.edge) {
            (Some(edge), _) => [k % 2, (k + 1) % 2].map(|end| edge.ridge(end, k)),
            (None, Some(edge)) if edge.neighbours.iter().any(Option::is_some) => {
                let n = self.normals.len();
                [(k + n - 1) % n, (k + 1) % n].map(|next| {
                    let cos = self.normals[k].dot(&self.normals[next]);
                    half_turn(self.normals[k].perp(&self.normals[next]).abs(), cos)
                })
            }
            _ => [0.0, 0.0],
        }
    }

    /// A point inside; of a one-sided segment one in the solid behind it.
    fn inner(&self) -> Vec2 {
        self.edge.map_or(self.center, |edge| {
            0.5 * (edge.ends[0] + edge.ends[1]) - 0.5 * edge.depth * edge.normals[0]
        })
    }

    fn is_segment(&self) -> bool {
        self.points.len() == 2
    }
}

/// Separations of a shape from the faces of another.
struct Separation {
    /// Largest separation \[m\]: a lower bound of the distance.
    any: f64,
    /// Largest separation along a face on the side of the other shape, and this face.
    most: (f64, usize),
    /// Whether the corner met along it belongs to a neighbour of the other segment.
    ceded: bool,
    /// Largest separation along a direction that a contact may take, and its face.
    best: Option<(f64, usize)>,
}

/// `seen` is the pose of `other` in the frame of `base`.
fn separation(base: &View, other: &View, seen: &Pose64, sides: [Option<usize>; 2]) -> Separation {
    let mut found = Separation {
        any: f64::NEG_INFINITY,
        most: (f64::NEG_INFINITY, 0),
        ceded: false,
        best: None,
    };
    // behind a one-sided segment there is solid, not a gap
    let faces = match base.edge {
        Some(edge) if edge.one_sided => 1,
        _ => base.normals.len(),
    };
    for (k, n) in base.normals[..faces].iter().enumerate() {
        let m = Vec2::new(
            seen.cos * n.x + seen.sin * n.y,
            seen.cos * n.y - seen.sin * n.x,
        );
        let (mut low, mut nearest) = (f64::INFINITY, 0);
        for (j, q) in other.points.iter().enumerate() {
            let height = m.dot(q);
            if height < low {
                (low, nearest) = (height, j);
            }
        }
        let apart = n.dot(&(seen.translation - base.points[k])) + low;
        let looks = base.edge.is_none() || sides[0] == Some(k);
        // what has come through a two-sided segment is in it, not beyond it
        if looks {
            found.any = found.any.max(apart);
        }
        let (met, ceded) = match (other.edge, sides[1]) {
            // parallel faces, whichever of the two corners rounding made the nearer
            (Some(edge), Some(face)) if m.dot(&edge.normals[face]) <= -1.0 + 1e-12 => (true, false),
            (Some(edge), Some(face)) => {
                let ceded = edge.cedes(nearest, -m, face);
                (edge.admits(nearest, -m) && !ceded, ceded)
            }
            (Some(_), None) => (false, false),
            (None, _) => (true, false),
        };
        // nor does a line that a chain goes on beyond separate them
        let goes_on = |edge: &Edge| edge.leads_on(nearest, -m);
        let separates = !(is_two_sided(base) && other.edge.is_some_and(goes_on));
        if looks && separates && apart > found.most.0 {
            (found.most, found.ceded) = ((apart, k), ceded);
        }
        if looks && met && found.best.is_none_or(|(most, _)| apart > most) {
            found.best = Some((apart, k));
        }
    }
    found
}

/// Rounding of distances, as a share of the sizes of two shapes: far below what a contact resolves.
const ROUNDING: f64 = 1e-12;

/// The nearest features of two cores that do not overlap.
enum Nearest {
    /// Corners, by their numbers in the two shapes.
    Corners([usize; 2], f64),
    /// A face of the first (0) or second shape (1), and the corner of the other over it.
    Face(usize, [usize; 2], f64),
}

fn nearest(first: &View, second: &View, seen: &Pose64, back: &Pose64) -> Nearest {
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
    let height = |q: &Vec2| edge.normals[0].dot(&(pose.apply(*q) - edge.ends[0]));
    // the solid behind another segment counts
    let all = other.points.iter().map(height);
    -all.fold(height(&other.center), f64::max)
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
fn beyond(edge: &Edge, face: usize, other: &View, pose: &Pose64) -> bool {
    let height = |q: &Vec2| edge.normals[face].dot(&(pose.apply(*q) - edge.ends[0]));
    other.points.iter().all(|q| height(q) <= 0.0)
}

/// Whether two segments cross.
fn cross(first: &View, second: &View, seen: &Pose64, back: &Pose64) -> bool {
    let splits = |base: &View, other: &View, pose: &Pose64| {
        let height = |q: Vec2| base.normals[0].dot(&(pose.apply(q) - base.points[0]));
        height(other.points[0]) * height(other.points[1]) < 0.0
    };
    splits(first, second, seen) && splits(second, first, back)
}

fn is_two_sided(view: &View) -> bool {
    view.edge.is_some_and(|edge| !edge.one_sided)
}

/// Distance, as a share of the shorter of two segments, up to which one that touches the neighbour of
/// the other may be on the wrong side of that other by what is left of an overlap.
const LEFT: f64 = 1e-3;

/// The sides on which two segments lie that do not touch: those that their nearest points face. Centres
/// do not tell them, as a segment beside another may lie on both sides of its line. See [`Sight::beside`].
fn facing(
    [first, second]: &[View; 2],
    poses: &[Pose64; 2],
    (beside, motion): ([Option<usize>; 2], f64),
) -> Option<[Option<usize>; 2]> {
    let seen = relative(&poses[0], &poses[1]);
    let back = relative(&poses[1], &poses[0]);
    if cross(first, second, &seen, &back) {
        return None;
    }
    let (direction, distance, corners) = match nearest(first, second, &seen, &back) {
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
    };
    let size = size(first).min(size(second));
    if distance <= 1e-9 * size {
        return None;
    }
    let way = direction.normalize();
    let ways = [way, -way];
    let views = [first, second];
    // beyond a corner of a chain the neighbour tells the side
    let chained = |i: usize| {
        let (edge, corner) = (views[i].edge?, corners[i]?);
        let leads = edge.leads_on(corner, poses[i].unrotate(ways[i]));
        edge.next_normal(corner, 0).filter(|_| leads)
    };
    let heights = [0, 1].map(|i| {
        let normal = chained(i).unwrap_or(views[i].normals[0]);
        poses[i].rotate(normal).dot(&ways[i])
    });
    let straight = |i: usize| heights[i].abs() > std::f64::consts::FRAC_1_SQRT_2;
    let mut faces = heights.map(|height| usize::from(height < 0.0));
    // what may get to the corner in this step
    if distance <= motion {
        for i in 0..2 {
            let known = beside[i].filter(|_| chained(i).is_some());
            faces[i] = known.unwrap_or(faces[i]);
        }
    }
    let came_through = |i: usize| straight(i) && beside[i].is_some_and(|face| face != faces[i]);
    if distance <= LEFT * size && (0..2).any(came_through) {
        faces = faces.map(|face| 1 - face);
    }
    // a free end that slides towards a corner of a chain is about to be above it
    for (i, j) in [(0, 1), (1, 0)] {
        let free = |edge: &Edge| corners[i].is_some_and(|end| edge.neighbours[end].is_none());
        if views[i].edge.is_some_and(free) && !straight(i) && chained(j).is_some() {
            let normal = poses[j].rotate(views[j].normals[faces[j]]);
            faces[i] = usize::from(poses[i].rotate(views[i].normals[0]).dot(&normal) > 0.0);
        }
    }
    Some(faces.map(Some))
}

/// The sides of segments on which the other of two shapes lies. The error is how far one of them lies
/// behind a one-sided segment \[m\]. `seen` are the poses of the second in the frame of the first, and
/// of the first in that of the second.
fn sides(
    poses: [&Pose64; 2],
    views: &[View; 2],
    seen: [&Pose64; 2],
    sight: &Sight,
) -> Result<[Option<usize>; 2], f64> {
    if let Some(start) = sight.start.filter(|_| !sight.touched)
        && views.iter().all(is_two_sided)
        && let Some(sides) = facing(views, &start, (sight.beside, sight.motion))
    {
        return Ok(sides);
    }
    let mut sides = [None, None];
    for i in 0..2 {
        let (other, pose) = (&views[1 - i], seen[i]);
        sides[i] = match views[i].edge {
            Some(edge) if edge.one_sided => {
                let behind = behind(edge, other, pose);
                if behind > 0.0 && !came_through(edge, other, behind, i, sight) {
                    return Err(behind);
                }
                Some(0)
            }
            Some(edge) => {
                let points = other.points.iter().map(|q| pose.apply(*q));
                let past = sight.of(i, poses[i]);
                Some(edge.side(points, pose.apply(other.inner()), &past))
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

/// Chooses a reference face by separating axes and clips the incident face to it: at most two
/// points. Rounded cores that are apart touch at their nearest features instead.
///
/// # Arguments
/// - `rounding`: radius added all round each shape \[m\].
///
/// Returns a lower bound of the gap \[m\], or of the motion before there may be a contact.
///
/// Sources: Ericson, *Real-Time Collision Detection* (2005), §5.5; Catto, GDC 2007.
pub(super) fn convex_convex(
    poses: [&Pose64; 2],
    views: [View; 2],
    rounding: [f64; 2],
    sight: &Sight,
    reach: f64,
    out: &mut Vec<Touch>,
) -> f64 {
    let [first, second] = &views;
    let both = rounding[0] + rounding[1];
    let seen = relative(poses[0], poses[1]);
    let back = relative(poses[1], poses[0]);
    let sides = match sides(poses, &views, [&seen, &back], sight) {
        Ok(sides) => sides,
        Err(behind) => return 0.5 * behind - both,
    };
    let of1 = separation(first, second, &seen, sides);
    let of2 = separation(second, first, &back, [sides[1], sides[0]]);
    let bound = of1.any.max(of2.any) - both;
    if bound > reach {
        return bound;
    }
    let segments = first.is_segment() && second.is_segment();
    let apart = match segments {
        true => !cross(first, second, &seen, &back),
        false => bound + both > 0.0,
    };
    let mut chosen = None;
    let one_sided = |view: &View| view.edge.is_some_and(|edge| edge.one_sided);
    let both_solid = one_sided(first) && one_sided(second);
    if apart && (segments && !both_solid || both > 0.0) {
        match nearest(first, second, &seen, &back) {
            Nearest::Corners(corners, distance) => {
                if both > 0.0 && distance - both <= reach {
                    corner_touch(poses, &views, corners, rounding, out);
                }
                return distance - both;
            }
            Nearest::Face(turn, [k, corner], distance) => {
                let (base, other) = (&views[turn], &views[1 - turn]);
                let pose = [&seen, &back][turn];
                // what lies on the face is on its one side or the other by rounding
                let over = match sides[turn] {
                    Some(face) if distance <= ROUNDING * (size(first) + size(second)) => face,
                    _ => k,
                };
                let k = match (base.edge, sides[turn]) {
                    // the solid behind a one-sided face is in it, not beyond it; nor is what has
                    // come through a two-sided one
                    (Some(edge), Some(face))
                        if edge.one_sided || face != over && beyond(edge, face, other, pose) =>
                    {
                        face
                    }
                    (Some(_), Some(face)) if face != over => return distance - both,
                    _ => over,
                };
                // where a chain leads on towards the face, its corner is not what will meet it
                let n = poses[turn].rotate(base.normals[k]);
                let towards = poses[1 - turn].unrotate(-n);
                let leads_on = |edge: &Edge| k == over && edge.leads_on(corner, towards);
                chosen = (!other.edge.is_some_and(leads_on)).then_some((turn == 1, k));
            }
        }
    }
    // a tie goes to shape 1, so that resting polygons keep their reference face
    let slack = 1e-6 * size(first).min(size(second));
    let (flipped, k) = match (chosen, of1.best, of2.best) {
        (Some(chosen), ..) => chosen,
        (_, Some((s1, _)), Some((s2, k))) if s2 > s1 + slack => (true, k),
        (_, Some((_, k)), _) => (false, k),
        (_, None, Some((_, k))) => (true, k),
        (_, None, None) => return bound,
    };
    if chosen.is_none() && (first.edge.is_some() || second.edge.is_some()) {
        let turned = |flip: bool, normal: Vec2| match flip {
            true => -poses[1].rotate(normal),
            false => poses[0].rotate(normal),
        };
        let (found, from) = match of2.most.0 > of1.most.0 {
            true => (&of2, true),
            false => (&of1, false),
        };
        let (most, face) = found.most;
        let (base, own) = if flipped {
            (second, &of2)
        } else {
            (first, &of1)
        };
        let depth = own.best.map_or(f64::NEG_INFINITY, |(s, _)| s);
        let axis = turned(from, [first, second][usize::from(from)].normals[face]);
        let facing = axis.dot(&turned(flipped, base.normals[k]));
        // the solid behind a segment is taken to be as deep as the segment is long
        let longest = views.iter().filter_map(|view| view.edge).map(Edge::length);
        let deep = depth < -longest.fold(0.0, f64::max);
        // a thin shape in front of a segment is nearer to its own far face, through which it did not come
        let (other, pose) = match flipped {
            true => (first, &back),
            false => (second, &seen),
        };
        let solid = base.edge.filter(|edge| edge.one_sided);
        let in_front = solid.is_some_and(|edge| edge.height(pose.apply(other.center)) >= 0.0);
        let opposed = facing < -0.5 && !in_front || facing < 0.0 && deep;
        // a neighbour has the contact along the axis that separates the two most
        if depth < (most - slack).min(0.0) && (most > 0.0 || opposed || found.ceded) {
            return bound;
        }
    }
    let mut give = |flipped: bool, k: usize| {
        let (base, other, pose, seen, own) = match flipped {
            true => (second, first, poses[1], &back, rounding[1]),
            false => (first, second, poses[0], &seen, rounding[0]),
        };
        let normal = base.normals[k];
        let tangent = Vec2::new(-normal.y, normal.x);
        let extent = normal.dot(&base.face(k)[0]);
        let Some([a, b]) = clipped_incident(base, k, other, seen) else {
            return false;
        };
        // features are numbered along the reference face, so they persist while that face does
        let mut points = if a.0 <= b.0 { [a, b] } else { [b, a] };
        if flipped {
            points.reverse();
        }
        let world = pose.rotate(normal);
        for (i, (t, height)) in points.into_iter().enumerate() {
            let gap = height - both;
            if gap <= reach {
                out.push(Touch {
                    normal: if flipped { -world } else { world },
                    point: pose.apply(tangent * t + normal * (extent + own + 0.5 * gap)),
                    gap,
                    feature: i as u32 | u32::from(flipped) << 1 | (k as u32) << 2,
                });
            }
        }
        true
    };
    if !give(flipped, k) && chosen.is_none() {
        // what is deepest under the face of a segment lies beside it: the other shape's face may
        // press the corner between
        let (own, others) = if flipped { (&of2, &of1) } else { (&of1, &of2) };
        let direction = |from: bool, k: usize| match from {
            true => -poses[1].rotate(second.normals[k]),
            false => poses[0].rotate(first.normals[k]),
        };
        if let (Some((_, k)), Some((_, next))) = (own.best, others.best)
            && direction(flipped, k).dot(&direction(!flipped, next)) > 0.0
        {
            give(!flipped, next);
        }
    }
    bound
}

/// The incident face of `other`, clipped to face `k` of `base`: both ends as (position along the
/// face, height above it) \[m\]; `None` if nothing is left. `seen` is the pose of `other` in the
/// frame of `base`.
pub(super) fn clipped_incident(
    base: &View,
    k: usize,
    other: &View,
    seen: &Pose64,
) -> Option<[(f64, f64); 2]> {
    let normal = base.normals[k];
    let tangent = Vec2::new(-normal.y, normal.x);
    let [start, end] = base.face(k);
    let extent = normal.dot(&start);
    // incident face: the one most opposed to the normal
    let against = Vec2::new(
        seen.cos * normal.x + seen.sin * normal.y,
        seen.cos * normal.y - seen.sin * normal.x,
    );
    let incident = (0..other.normals.len())
        .min_by(|&a, &b| {
            let look = |i: usize| other.normals[i].dot(&against);
            look(a).total_cmp(&look(b))
        })
        .unwrap_or(0);
    let [mut a, mut b] = other.face(incident).map(|q| {
        let p = seen.apply(q);
        (tangent.dot(&p), normal.dot(&p) - extent)
    });
    // within the face's width, and for a penetrating ridge on this face's side of the bisector
    let limits = [(-1.0, tangent.dot(&start)), (1.0, tangent.dot(&end))];
    let ridges = base.ridges(k, other);
    for (side, limit, slope) in [
        (limits[0].0, limits[0].1, 0.0),
        (limits[1].0, limits[1].1, 0.0),
        (limits[0].0, limits[0].1, ridges[0]),
        (limits[1].0, limits[1].1, ridges[1]),
    ] {
        let over = |p: (f64, f64)| side * (p.0 - limit) - slope * p.1;
        let (da, db) = (over(a), over(b));
        let cut = |inner: (f64, f64), outer: (f64, f64), share: f64| {
            let s = inner.1 + share * (outer.1 - inner.1);
            (inner.0 + share * (outer.0 - inner.0), s)
        };
        if da > 0.0 && db > 0.0 {
            return None;
        } else if da > 0.0 {
            a = cut(b, a, db / (db - da));
        } else if db > 0.0 {
            b = cut(a, b, da / (da - db));
        }
    }
    Some([a, b])
}

/// Two rounded corners that face each other.
fn corner_touch(
    poses: [&Pose64; 2],
    views: &[View; 2],
    corners: [usize; 2],
    rounding: [f64; 2],
    out: &mut Vec<Touch>,
) {
    let p = [0, 1].map(|i| poses[i].apply(views[i].points[corners[i]]));
    let away = p[1] - p[0];
    let distance = away.norm();
    if distance == 0.0 {
        return;
    }
    let normal = away / distance;
    for i in 0..2 {
        if let Some(edge) = views[i].edge {
            let outward = if i == 0 { normal } else { -normal };
            let local = Vec2::new(
                poses[i].cos * outward.x + poses[i].sin * outward.y,
                poses[i].cos * outward.y - poses[i].sin * outward.x,
            );
            if !edge.admits(corners[i], local) {
                return;
            }
        }
    }
    let [r1, r2] = rounding;
    out.push(Touch {
        normal,
        point: 0.5 * (p[0] + p[1] + (r1 - r2) * normal),
        gap: distance - r1 - r2,
        feature: 1 << 31 | (corners[0] as u32) << 12 | corners[1] as u32,
    });
}

/// The point of a polygon nearest to a ball's centre; from inside, the nearest face.
pub(super) fn polygon_ball(
    pose: &Pose64,
    polygon: &Polygon,
    rounding: f64,
    center: Vec2,
    radius: f64,
) -> Touch {
    let c = pose.apply_inverse(center);
    let heights = polygon.normals.iter().zip(polygon.points.iter());
    let (k, separation) = heights.map(|(n, p)| n.dot(&(c - p))).enumerate().fold(
        (0, f64::NEG_INFINITY),
        |best, next| {
            if next.1 > best.1 { next } else { best }
        },
    );
    let (mut normal, mut distance) = (polygon.normals[k], separation);
    if separation > 0.0 {
        let view = polygon.view();
        let nearest = (0..polygon.points.len())
            .map(|k| nearest_on_edge(view.face(k), c))
            .min_by(|p, q| (c - p).norm_squared().total_cmp(&(c - q).norm_squared()));
        let away = c - nearest.unwrap_or(c);
        // for a centre on the face, the normal of the face
        if away.norm() > 0.0 {
            (normal, distance) = (away.normalize(), away.norm());
        }
    }
    let gap = distance - radius - rounding;
    Touch {
        normal: pose.rotate(normal),
        point: pose.apply(c - normal * (radius + 0.5 * gap)),
        gap,
        feature: 0,
    }
}

fn nearest_on_edge([a, b]: [Vec2; 2], p: Vec2) -> Vec2 {
    let along = b - a;
    a + along * ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0)
}

/// Smaller extent of the bounding box \[m\]; the length of a segment.
fn size(view: &View) -> f64 {
    let first = view.points[0];
    let (low, high) = view
        .points
        .iter()
        .fold((first, first), |(low, high), p| (low.inf(p), high.sup(p)));
    if view.is_segment() {
        (high - low).norm()
    } else {
        (high - low).min()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::sharp;
    use super::super::{Core, Part, touches};
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
                        touched: true,
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
}
