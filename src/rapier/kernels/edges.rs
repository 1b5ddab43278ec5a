//! Segments of polylines: the directions that a contact with a segment may take.
//!
//! Two segments that meet are one surface. A point near their common corner belongs to the nearer
//! segment, and to the corner itself only within the wedge between the two normals. Where the
//! surface is flat or concave that wedge is empty, and no contact catches on the corner (the "ghost
//! collisions" of rapier's issues 669 and 643). All directions outside of the wedge are refused, as
//! the neighbour has a nearer point.
//!
//! Inside the solid the bisector of two segments separates them, see [`Edge::ridge`].
//!
//! Source: Ericson, *Real-Time Collision Detection* (2005), §5.1 (Voronoi regions of features).

use super::{Past, Touch};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// Angle \[rad\] by which a part may be tilted that meets a rectangular step, or an end, at its side.
pub(super) const TILT: f64 = 1e-3;

/// A segment with the data of its neighbours, in the frame of its collider \[m\].
#[derive(Debug, Clone, PartialEq)]
pub(in crate::rapier) struct Edge {
    pub ends: [Vec2; 2],
    /// The normal on the right of its direction, and the opposite one.
    pub normals: [Vec2; 2],
    /// Direction of the neighbour from each end, as a unit vector.
    pub neighbours: [Option<Vec2>; 2],
    /// Number of the neighbour at each end, and whether it runs the other way.
    pub next: [Option<(u32, bool)>; 2],
    /// Whether this segment, rather than the neighbour, reports contacts at each corner.
    pub owns: [bool; 2],
    /// Solid behind, on the left: contacts on the right only.
    pub one_sided: bool,
    /// Depth of the solid behind its middle \[m\]; its length where that is not known.
    pub depth: f64,
}

impl Edge {
    /// A segment without neighbours, from `a` to `b`; `None` if it has no length.
    pub fn new(a: Vec2, b: Vec2, one_sided: bool) -> Option<Edge> {
        let along = (b - a).try_normalize(0.0).filter(|t| t.x.is_finite())?;
        let normal = Vec2::new(along.y, -along.x);
        Some(Edge {
            ends: [a, b],
            normals: [normal, -normal],
            neighbours: [None, None],
            next: [None, None],
            owns: [true, true],
            one_sided,
            depth: f64::from(u8::from(one_sided)) * (b - a).norm(),
        })
    }

    /// The same segment, in the other direction.
    pub fn reversed(&self) -> Edge {
        let turned = |[a, b]: [Option<_>; 2]| [b, a];
        let [a, b] = self.ends;
        Edge {
            ends: [b, a],
            normals: [self.normals[1], self.normals[0]],
            neighbours: turned(self.neighbours),
            next: [self.next[1], self.next[0]],
            owns: [self.owns[1], self.owns[0]],
            ..*self
        }
    }

    /// Of a segment within a chain with two sides, the segments with solid behind it, as seen from each face.
    /// `None` beside a free end, round which other parts may go.
    pub fn solid(&self) -> Option<[Edge; 2]> {
        let chained = !self.one_sided && self.neighbours.iter().all(Option::is_some);
        let solid = |edge: Edge| Edge {
            one_sided: true,
            depth: edge.length(),
            ..edge
        };
        chained.then(|| [self.clone(), self.reversed()].map(solid))
    }

    /// The face (0 right, 1 left) on whose side a shape with these points lies; its `center` decides.
    ///
    /// A shape that has moved across the line keeps its side, as long as it lies no farther beyond
    /// than it can have come in a step.
    pub fn side(&self, points: impl Iterator<Item = Vec2>, center: Vec2, past: &Past) -> usize {
        let face = |p: Vec2| usize::from(self.height(p) < 0.0);
        let (now, before) = (face(center), past.face);
        let before = before.unwrap_or_else(|| face(center - past.moved));
        if before == now {
            return now;
        }
        let highest = points.map(|p| self.normals[before].dot(&(p - self.ends[0])));
        match highest.fold(f64::NEG_INFINITY, f64::max) < -past.motion {
            true => now,
            false => before,
        }
    }

    /// Distance of a point \[m\].
    pub fn distance(&self, point: Vec2) -> f64 {
        let [a, b] = self.ends;
        (a + (b - a) * self.fraction(point) - point).norm()
    }

    /// Direction from the first end to the second.
    pub fn along(&self) -> Vec2 {
        Vec2::new(-self.normals[0].y, self.normals[0].x)
    }

    /// Whether this is the first or the last segment of a chain.
    pub fn ends_a_chain(&self) -> bool {
        self.neighbours.iter().flatten().count() == 1
    }

    /// Whether both ends have neighbours, within 45 degrees of this segment.
    pub fn goes_on(&self) -> bool {
        (0..2).all(|end| self.goes_on_at(end))
    }

    /// Whether an end has a neighbour within 45 degrees of this segment.
    pub fn goes_on_at(&self, end: usize) -> bool {
        let next = self.next_normal(end, 0);
        next.is_some_and(|next| next.dot(&self.normals[0]) > std::f64::consts::FRAC_1_SQRT_2)
    }

    /// Normal of the neighbour at corner `end`, on the side of `face`.
    pub fn next_normal(&self, end: usize, face: usize) -> Option<Vec2> {
        let turn = if end == face { -1.0 } else { 1.0 };
        self.neighbours[end].map(|leads| turn * Vec2::new(leads.y, -leads.x))
    }

    /// Whether corner `end` under `face`, met along a direction, is this segment's rather than its
    /// neighbour's: the one that faces the direction more has it, both if they face it alike.
    pub fn is_owner(&self, end: usize, direction: Vec2, face: usize) -> bool {
        let own = direction.dot(&self.normals[face]);
        self.next_normal(end, face)
            .is_none_or(|next| own >= direction.dot(&next) - 1e-12)
    }

    /// Whether corner `end` of a one-sided segment, met along a direction, is its neighbour's.
    pub fn cedes(&self, end: usize, direction: Vec2, face: usize) -> bool {
        const ROUNDING: f64 = 1e-9;
        let outward = self.ends[end] - self.ends[1 - end];
        self.one_sided
            && self.neighbours[end].is_some_and(|leads| direction.dot(&leads) <= ROUNDING)
            && direction.dot(&outward) >= -ROUNDING * self.length()
            && !self.is_owner(end, direction, face)
    }

    /// Whether what comes along a direction to corner `end` of a one-sided segment meets the
    /// neighbour: it faces the direction more, and either does not lead on that way or faces it
    /// within 45 degrees.
    pub fn has_neighbour_facing(&self, end: usize, direction: Vec2) -> bool {
        let next = self.next_normal(end, 0).map(|n| n.dot(&direction));
        !self.is_owner(end, direction, 0) && (!self.leads_on(end, direction) || next > Some(0.7))
    }

    /// Whether a neighbour leads on from an end in a direction.
    pub fn leads_on(&self, end: usize, direction: Vec2) -> bool {
        self.neighbours[end].is_some_and(|leads| direction.dot(&leads) > 1e-12)
    }

    /// Length \[m\].
    pub fn length(&self) -> f64 {
        (self.ends[1] - self.ends[0]).norm()
    }

    /// How deep another segment may lie in a cell of a foundation \[m\], the share of this one of the two: as
    /// deep as it is long, and not past the middle of its solid, from where the other side is nearer.
    pub fn depth_share(&self) -> f64 {
        self.length().min(0.5 * self.depth)
    }

    /// The part of the way from the first end to the second at which a point lies, within [0, 1].
    pub fn fraction(&self, point: Vec2) -> f64 {
        let along = self.ends[1] - self.ends[0];
        ((point - self.ends[0]).dot(&along) / along.norm_squared()).clamp(0.0, 1.0)
    }

    /// Depth below its middle \[m\] at which another segment ends the solid behind this one; `None` if it
    /// does not lie below the middle.
    pub fn depth_to(&self, other: &Edge) -> Option<f64> {
        let middle = 0.5 * (self.ends[0] + self.ends[1]);
        let [from, to] = other.ends.map(|p| self.along().dot(&(p - middle)));
        let share = from / (from - to);
        let foot = other.ends[0] + (other.ends[1] - other.ends[0]) * share;
        let depth = -self.height(foot);
        // a segment beside it, or one that shares the middle but for rounding, has no depth
        (from * to <= 0.0 && depth > 1e-9 * self.length()).then_some(depth)
    }

    /// Height of a point above the line on the right \[m\].
    pub fn height(&self, point: Vec2) -> f64 {
        self.normals[0].dot(&(point - self.ends[0]))
    }

    /// A distance \[m\] that the segment and a point behind it, at a negative `height`, must travel
    /// together before the point lies in front.
    ///
    /// A segment that turns by dθ travels at least dθ L/2, with L its length, and takes its line past
    /// a point at a distance D by D dθ. D grows by no more than the travel.
    fn way_to_front(&self, point: Vec2, height: f64) -> f64 {
        let far = (point - self.ends[0]).norm();
        -height / (2.0 + 3.0 * far / self.length())
    }

    /// Whether this segment, rather than its neighbour, reports a contact of corner `end` along a
    /// direction. A sharp corner of a solid is met from behind the line of its owner too; by rounding
    /// both may report it then.
    fn reports(&self, end: usize, direction: Vec2, face: usize) -> bool {
        const ROUNDING: f64 = 1e-12;
        if !self.one_sided {
            return self.owns[end];
        }
        let slack = ROUNDING * direction.norm();
        let in_front = |normal: Vec2| direction.dot(&normal);
        match self.next_normal(end, face).filter(|_| !self.owns[end]) {
            Some(owner) => in_front(owner) <= slack && in_front(self.normals[face]) >= 0.0,
            None => in_front(self.normals[face]) >= 0.0,
        }
    }

    /// Slope at corner `end` under `face`: the length of the segment that a unit of depth takes, up
    /// to the bisector with the neighbour. Zero at a flat or concave corner.
    pub fn ridge(&self, end: usize, face: usize) -> f64 {
        let Some(leads) = self.neighbours[end] else {
            return 0.0;
        };
        let outward = (self.ends[end] - self.ends[1 - end]).normalize();
        half_turn(-leads.dot(&self.normals[face]), leads.dot(&outward))
    }

    /// Whether a contact at corner `end` may have this direction.
    pub fn admits(&self, end: usize, direction: Vec2) -> bool {
        self.admits_within(end, direction, 0.0)
    }

    /// [`Edge::admits`] for a direction that is known within an angle, `slack` over its length.
    pub fn admits_within(&self, end: usize, direction: Vec2, slack: f64) -> bool {
        // the end of an open surface is met at its side, by what is tilted a little too
        let behind = match self.neighbours[end] {
            None => slack.max(TILT * direction.norm()),
            Some(_) => slack,
        };
        if self.one_sided && direction.dot(&self.normals[0]) < -behind {
            return false;
        }
        self.has_in_wedge(end, direction, slack)
    }

    /// Whether a direction leads away from both segments at corner `end`.
    pub fn has_in_wedge(&self, end: usize, direction: Vec2, slack: f64) -> bool {
        let outward = self.ends[end] - self.ends[1 - end];
        direction.dot(&outward) >= -slack * self.length()
            && self.neighbours[end].is_none_or(|leads| direction.dot(&leads) <= slack)
    }
}

/// `tan(δ/2)` of a turn by δ; zero for a turn to the other side.
pub(super) fn half_turn(sin: f64, cos: f64) -> f64 {
    // a surface folded back on itself counts as nearly closed
    sin.max(0.0) / (1.0 + cos.max(-1.0 + 1e-12))
}

/// The point of a segment nearest to a ball's centre; none if a neighbour is nearer, or from
/// behind. Returns a lower bound of the gap, or of the motion before there may be a contact \[m\].
pub(super) fn edge_ball(
    pose: &Pose64,
    edge: &Edge,
    rounding: f64,
    (center, radius): (Vec2, f64),
    past: Past,
    reach: f64,
    out: &mut Vec<Touch>,
) -> f64 {
    let c = pose.apply_inverse(center);
    let height = edge.height(c);
    if edge.one_sided && height < 0.0 {
        return reach + edge.way_to_front(c, height);
    }
    let face = match edge.one_sided {
        true => 0,
        false => edge.side(std::iter::once(c), c, &past),
    };
    let height = if face == 0 { height } else { -height };
    let [a, b] = edge.ends;
    // both segments of a corner compute the same test, so that exactly one of them reports the
    // corner
    let beyond = [(c - a).dot(&(b - a)) <= 0.0, (c - b).dot(&(a - b)) <= 0.0];
    let both = radius + rounding;
    let (normal, distance, feature) = if let Some(end) = beyond.iter().position(|&far| far) {
        let away = c - edge.ends[end];
        let distance = away.norm();
        let leads = edge.neighbours[end];
        let nearer = leads.is_some_and(|leads| away.dot(&leads) > 0.0);
        if nearer || !edge.reports(end, away, face) || distance == 0.0 {
            return distance - both;
        }
        (away / distance, distance, 1 + end as u32)
    } else {
        (edge.normals[face], height, 0)
    };
    let gap = distance - both;
    if gap <= reach {
        let surface = c - normal * (radius + 0.5 * gap);
        out.push(Touch {
            normal: pose.rotate(normal),
            point: pose.apply(surface),
            gap,
            feature,
        });
    }
    gap
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bug: of the two segments of a sharp corner only one reports it, also where it saw a ball from
    /// behind: tips of stars ran into discs.
    #[test]
    fn a_sharp_corner_meets_balls_from_all_around() {
        for half in [0.1f64, 0.4, 0.7, 1.2] {
            let tip = Vec2::zeros();
            let far = [half, -half].map(|angle| Vec2::new(-angle.cos(), angle.sin()));
            let mut edges =
                [[far[1], tip], [tip, far[0]]].map(|[a, b]| Edge::new(a, b, true).unwrap());
            edges[0].neighbours[1] = Some(far[0]);
            edges[1].neighbours[0] = Some(far[1]);
            for owner in [0, 1] {
                edges[owner].owns = [true; 2];
                edges[1 - owner].owns = [false; 2];
                let place = Pose64::new(Vec2::zeros(), 0.0);
                let past = Past {
                    face: None,
                    moved: Vec2::zeros(),
                    motion: 0.0,
                };
                let fan = 0.5 * std::f64::consts::PI - half;
                for k in -20..=20 {
                    let (sin, cos) = (0.99 * fan * f64::from(k) / 20.0).sin_cos();
                    let ball = (0.3 * Vec2::new(cos, sin), 0.31);
                    let mut out = Vec::new();
                    for edge in &edges {
                        edge_ball(&place, edge, 0.0, ball, past, 0.0, &mut out);
                    }
                    assert!((1..3).contains(&out.len()), "{half} {owner} {k}: {out:?}");
                    for touch in &out {
                        assert!((touch.gap + 0.01).abs() < 1e-12, "{touch:?}");
                        assert!((touch.normal - ball.0 / 0.3).norm() < 1e-12, "{touch:?}");
                    }
                }
            }
        }
    }
}
