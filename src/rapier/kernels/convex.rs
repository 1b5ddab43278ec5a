//! Gaps of convex polygons, sharp and rounded, in `f64`.
//!
//! parry's algorithm (GJK, then EPA, in `f32`) now and then chooses a wrong face for two polygons
//! that just touch, and reports a gap of minus their thickness: an arch of voussoirs bursts.

use super::edges::Edge;
use super::facing::{Nearest, ROUNDING, alone, beyond, cross, is_two_sided, nearest, sides};
use super::polygon::{View, size};
use super::{Sight, Touch, relative};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// Separations of a shape from the faces of another.
struct Separation {
    /// Largest separation \[m\]: a lower bound of the distance.
    any: f64,
    /// Largest separation along a face on the side of the other shape, and this face.
    most: (f64, usize),
    /// Whether the corner met along it lies over that face, and belongs to a neighbour of the other segment.
    ceded: bool,
    /// Largest separation along a direction that a contact may take, and its face.
    best: Option<(f64, usize)>,
}

/// Whether a point lies over or under face `k` of a shape, and not beside it.
fn lies_over(base: &View, k: usize, point: Vec2) -> bool {
    let [a, b] = base.face(k);
    let along = b - a;
    let share = (point - a).dot(&along) / along.norm_squared();
    (-1e-9..=1.0 + 1e-9).contains(&share)
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
                (other.admits(edge, nearest, -m, 0.0) && !ceded, ceded)
            }
            (Some(_), None) => (false, false),
            (None, _) => (other.has_corner(nearest, -m, base, seen), false),
        };
        let met = met && base.has_face(k, other, seen);
        // nor does a line that a chain goes on beyond separate them
        let goes_on = |edge: &Edge| edge.leads_on(nearest, -m);
        let separates = !(is_two_sided(base) && other.edge.is_some_and(goes_on));
        if looks && separates && apart > found.most.0 {
            let has = || lies_over(base, k, seen.apply(other.points[nearest]));
            (found.most, found.ceded) = ((apart, k), ceded && has());
        }
        if looks && met && found.best.is_none_or(|(most, _)| apart > most) {
            found.best = Some((apart, k));
        }
    }
    found
}

/// Two parts with corners.
struct Meeting<'a> {
    poses: [&'a Pose64; 2],
    views: [View<'a>; 2],
    rounding: [f64; 2],
    /// Per part, the pose of the other in its frame.
    seen: [Pose64; 2],
    /// See [`sides`].
    sides: [Option<usize>; 2],
}

/// What the nearest features of two parts tell.
enum Chosen {
    /// The distance is all: the contact is given already, or there is none.
    Done(f64),
    /// The reference face and its part; `None` if the separations choose it.
    Face(Option<(usize, usize)>),
}

impl Meeting<'_> {
    /// Radius added all round the two \[m\].
    fn rounding(&self) -> f64 {
        self.rounding[0] + self.rounding[1]
    }

    /// The normal of a face, from the first part to the second.
    fn direction(&self, (part, face): (usize, usize)) -> Vec2 {
        let outward = self.poses[part].rotate(self.views[part].normals[face]);
        if part == 0 { outward } else { -outward }
    }

    /// Sizes of the two \[m\].
    fn sizes(&self) -> [f64; 2] {
        [0, 1].map(|i| size(&self.views[i]))
    }

    /// The reference face by the nearest features of two parts that do not overlap.
    fn by_nearest(&self, reach: f64, out: &mut Vec<Touch>) -> Chosen {
        let Meeting {
            poses,
            views,
            seen,
            sides,
            ..
        } = self;
        let both = self.rounding();
        let (turn, [k, corner], distance) = match nearest(&views[0], &views[1], &seen[0], &seen[1])
        {
            Nearest::Corners(corners, distance) => {
                if both > 0.0 && distance - both <= reach {
                    corner_touch(*poses, views, corners, self.rounding, out);
                }
                return Chosen::Done(distance - both);
            }
            Nearest::Face(turn, features, distance) => (turn, features, distance),
        };
        let (base, other) = (&views[turn], &views[1 - turn]);
        let inward = poses[1 - turn].unrotate(-poses[turn].rotate(base.normals[k]));
        if !base.has_face(k, other, &seen[turn]) {
            return Chosen::Done(distance - both);
        }
        if !other.has_corner(corner, inward, base, &seen[turn]) {
            return Chosen::Face(None);
        }
        // what lies on the face is on its one side or the other by rounding
        let over = match sides[turn] {
            Some(face) if distance <= ROUNDING * self.sizes().iter().sum::<f64>() => face,
            _ => k,
        };
        let k = match (base.edge, sides[turn]) {
            // the solid behind a one-sided face is in it, not beyond it; nor is what has come through a
            // two-sided one
            (Some(edge), Some(face))
                if edge.one_sided || face != over && beyond(edge, face, other, &seen[turn]) =>
            {
                face
            }
            (Some(_), Some(face)) if face != over => return Chosen::Done(distance - both),
            _ => over,
        };
        // where a chain leads on towards the face, its corner is not what will meet it
        let n = poses[turn].rotate(base.normals[k]);
        let towards = poses[1 - turn].unrotate(-n);
        let leads_on = |edge: &Edge| k == over && edge.leads_on(corner, towards);
        Chosen::Face((!other.edge.is_some_and(leads_on)).then_some((turn, k)))
    }

    /// Whether two polygons do not touch along face `chosen`, under which they overlap, because parts beside them
    /// do: another axis separates the two, or separates them more along nearly the opposite direction.
    fn is_covered(&self, chosen: (usize, usize), of: [&Separation; 2], slack: f64) -> bool {
        let depth = of[chosen.0].best.map_or(f64::NEG_INFINITY, |(s, _)| s);
        let from = usize::from(of[1].most.0 > of[0].most.0);
        let (most, face) = of[from].most;
        let opposed = || self.direction((from, face)).dot(&self.direction(chosen)) < -0.5;
        let covered = self.views.iter().any(|view| view.exposed.is_some());
        covered && depth < most.min(0.0) - slack && (most > 0.0 || opposed())
    }

    /// Whether a neighbour of a segment has the contact along the axis that separates the two most, in
    /// place of that along face `chosen`. `of` are the separations from the faces of both; `moved` is that of
    /// [`Sight`].
    fn neighbour_has(
        &self,
        chosen: (usize, usize),
        of: [&Separation; 2],
        slack: f64,
        moved: [Vec2; 2],
    ) -> bool {
        let [first, second] = &self.views;
        if first.edge.is_none() && second.edge.is_none() {
            return self.is_covered(chosen, of, 1e3 * slack);
        }
        let from = usize::from(of[1].most.0 > of[0].most.0);
        let (most, face) = of[from].most;
        let part = chosen.0;
        let base = &self.views[part];
        let depth = of[part].best.map_or(f64::NEG_INFINITY, |(s, _)| s);
        let facing = self.direction((from, face)).dot(&self.direction(chosen));
        // the solid behind a segment is taken to be as deep as the segment is long
        let longest = self.views.iter().filter_map(|view| view.edge);
        let deep = depth < -longest.map(Edge::length).fold(0.0, f64::max);
        // a thin shape in front of a segment, now or half a step before, is nearer to its own far face, through
        // which it did not come
        let other = self.seen[part].apply(self.views[1 - part].center);
        let solid = base.edge.filter(|edge| edge.one_sided);
        let thin = self.views[1 - part].edge.is_none();
        let before = other - self.poses[part].unrotate(moved[part]);
        let highest = |edge: &Edge| edge.height(other).max(edge.height(before));
        let in_front = thin && solid.is_some_and(|edge| highest(edge) >= 0.0);
        // a corner that a face of a polygon meets is met, however near the polygon's far face is
        let on_segment = base.edge.is_some();
        let opposed = facing < -0.5 && on_segment && !in_front || facing < 0.0 && deep;
        depth < (most - slack).min(0.0) && (most > 0.0 || opposed || of[from].ceded)
    }

    /// Adds the contacts of the other's face, clipped to face `k` of a part. Returns whether anything
    /// was left of it.
    fn give(&self, face: (usize, usize), reach: f64, out: &mut Vec<Touch>) -> bool {
        self.give_if(face, reach, out, |_| true)
    }

    /// Adds a corner of a polygon above a one-sided segment that leaves its contact to a neighbour: beside its end
    /// another corner lies below its line. The polygon may turn down on the segment within the step.
    fn give_corner(&self, face: (usize, usize), reach: f64, out: &mut Vec<Touch>) {
        let (base, other) = (&self.views[face.0], &self.views[1 - face.0]);
        if base.edge.is_none_or(|edge| !edge.one_sided) || other.edge.is_some() {
            return;
        }
        let [a, b] = base.face(face.1);
        let normal = base.normals[face.1];
        let along = Vec2::new(-normal.y, normal.x);
        let noise = 1e-9 * ((b - a).norm() + 1e-6 * a.norm());
        let is_corner = |at: &(f64, f64)| {
            other.points.iter().any(|q| {
                let q = self.seen[face.0].apply(*q);
                let off = along * (along.dot(&q) - at.0) + normal * (normal.dot(&(q - a)) - at.1);
                off.norm() <= noise
            })
        };
        self.give_if(face, reach, out, |at| at.1 > 0.0 && is_corner(at));
    }

    /// [`Meeting::give`] of the points that a caller wants, by their places along the face and heights \[m\].
    fn give_if(
        &self,
        (part, k): (usize, usize),
        reach: f64,
        out: &mut Vec<Touch>,
        wants: impl Fn(&(f64, f64)) -> bool,
    ) -> bool {
        let (base, other) = (&self.views[part], &self.views[1 - part]);
        let (pose, own) = (self.poses[part], self.rounding[part]);
        let (both, flipped) = (self.rounding(), part == 1);
        let normal = base.normals[k];
        let tangent = Vec2::new(-normal.y, normal.x);
        let extent = normal.dot(&base.face(k)[0]);
        let Some([a, b]) = clipped_incident(base, k, other, &self.seen[part]) else {
            return false;
        };
        // features are numbered along the reference face, so they persist while that face does
        let mut points = if a.0 <= b.0 { [a, b] } else { [b, a] };
        if flipped {
            points.reverse();
        }
        let world = pose.rotate(normal);
        for (i, (t, height)) in points.into_iter().enumerate().filter(|(_, at)| wants(at)) {
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
    }
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
    mut views: [View; 2],
    rounding: [f64; 2],
    sight: &Sight,
    reach: f64,
    out: &mut Vec<Touch>,
) -> f64 {
    let both = rounding[0] + rounding[1];
    let seen = [relative(poses[0], poses[1]), relative(poses[1], poses[0])];
    let sides = match sides(poses, &views, [&seen[0], &seen[1]], sight) {
        Ok(sides) => sides,
        Err(behind) => return 0.5 * behind - both,
    };
    for i in 0..2 {
        if let Some(edge) = views[i].edge {
            views[i].alone = alone(edge, &views[1 - i], &seen[i]);
        }
    }
    let [first, second] = &views;
    let of1 = separation(first, second, &seen[0], sides);
    let of2 = separation(second, first, &seen[1], [sides[1], sides[0]]);
    let bound = of1.any.max(of2.any) - both;
    if bound > reach {
        return bound;
    }
    let segments = first.is_segment() && second.is_segment();
    let apart = match segments {
        true => !cross(first, second, &seen[0], &seen[1]),
        false => bound + both > 0.0,
    };
    let one_sided = |view: &View| view.edge.is_some_and(|edge| edge.one_sided);
    let both_solid = one_sided(first) && one_sided(second);
    let meeting = Meeting {
        poses,
        views,
        rounding,
        seen,
        sides,
    };
    let mut chosen = None;
    if apart && (segments && !both_solid || both > 0.0) {
        chosen = match meeting.by_nearest(reach, out) {
            Chosen::Done(distance) => return distance,
            Chosen::Face(face) => face,
        };
    }
    // a tie goes to shape 1, so that resting polygons keep their reference face
    let [one, two] = meeting.sizes();
    let slack = 1e-6 * one.min(two);
    let face = match (chosen, of1.best, of2.best) {
        (Some(chosen), ..) => chosen,
        (_, Some((s1, _)), Some((s2, k))) if s2 > s1 + slack => (1, k),
        (_, Some((_, k)), _) => (0, k),
        (_, None, Some((_, k))) => (1, k),
        (_, None, None) => return bound,
    };
    if chosen.is_none() && meeting.neighbour_has(face, [&of1, &of2], slack, sight.moved) {
        if bound > 0.0 {
            meeting.give_corner(face, reach, out);
        }
        return bound;
    }
    if !meeting.give(face, reach, out) && chosen.is_none() {
        // what is deepest under the face of a segment lies beside it: the other shape's face may
        // press the corner between
        let others = if face.0 == 1 { &of1 } else { &of2 };
        let next = others.best.map(|(_, k)| (1 - face.0, k));
        let along =
            |next: &(usize, usize)| meeting.direction(face).dot(&meeting.direction(*next)) > 0.0;
        if let Some(next) = next.filter(along) {
            meeting.give(next, reach, out);
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
        let local = poses[i].unrotate(if i == 0 { normal } else { -normal });
        let admits = |edge: &Edge| edge.admits(corners[i], local);
        if !views[i].edge.is_none_or(admits) || !views[i].leaves(corners[i], local) {
            return;
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

#[cfg(test)]
#[path = "convex_tests.rs"]
mod tests;
