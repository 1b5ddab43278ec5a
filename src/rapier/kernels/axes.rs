//! The directions along which two convex parts can be separated: the normals of all their faces.

use super::convex::clipped_incident;
use super::edges::TILT;
use super::facing;
use super::polygon::View;
use super::{BOX_NORMALS, Core, Part, Sight, Touch, corners, relative};
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// A face of one of two parts; for a segment, `2 + end` stands for that of the neighbour at an end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::rapier) struct Axis {
    pub part: usize,
    pub face: usize,
}

/// Two parts with corners; a ball has one corner and a rounding.
pub(in crate::rapier) struct Axes<'a> {
    views: [View<'a>; 2],
    /// Half the sides of a part that is a box.
    boxes: [Option<Vec2>; 2],
    rounding: [f64; 2],
    /// Per part that is a segment, the face on whose side the other part lies.
    sides: [Option<usize>; 2],
    /// Whether both are segments with solid behind them.
    solid: bool,
}

/// Calls `run` with two parts at their poses. The second part lies in the direction `toward` of the
/// first. Of two segments of which one has two sides `sight` tells the sides.
///
/// `None` if a part has no corners, for a ball with a segment within a chain, whose own kernel chooses the
/// face at corners, and where the sides are not known.
pub(in crate::rapier) fn with_axes<R>(
    parts: [&Part; 2],
    poses: &[Pose64; 2],
    (toward, sight): (Vec2, Option<&Sight>),
    run: impl FnOnce(&Axes) -> R,
) -> Option<R> {
    let corners_of = |part: &Part| match part.core {
        Core::Box(h) => corners(h),
        _ => [Vec2::zeros(); 4],
    };
    let own = parts.map(corners_of);
    let view = |i: usize| {
        let (points, normals): (&[Vec2], &[Vec2]) = match &parts[i].core {
            Core::Ball(_) => (&own[i][..1], &[]),
            Core::Box(_) => (&own[i], &BOX_NORMALS),
            Core::Polygon(polygon) => return Some(View::from(polygon.as_ref())),
            Core::Edge(edge) => return Some(View::from(edge.as_ref())),
            Core::HalfPlane(_) | Core::Other(_) => return None,
        };
        Some(View {
            points,
            normals,
            center: Vec2::zeros(),
            exposed: None,
            edge: None,
            alone: [false; 2],
        })
    };
    let mut views = [view(0)?, view(1)?];
    let [a, b] = poses;
    let seen = [relative(a, b), relative(b, a)];
    for i in 0..2 {
        if let Some(edge) = views[i].edge {
            views[i].alone = facing::alone(edge, &views[1 - i], &seen[i]);
        }
    }
    let ball = |part: &Part| matches!(part.core, Core::Ball(_));
    let chain = |view: &View| view.edge.is_some_and(|edge| edge.goes_on());
    let rounding = parts.map(|part| match part.core {
        Core::Ball(radius) => radius + part.rounding,
        _ => part.rounding,
    });
    let chained_ball = parts.iter().any(|part| ball(part)) && views.iter().any(chain);
    let lines = views.iter().all(|view| view.edge.is_some());
    let solid = views
        .iter()
        .all(|view| view.edge.is_some_and(|edge| edge.one_sided));
    if chained_ball {
        return None;
    }
    let side = |i: usize, sign: f64| {
        let edge = views[i].edge?;
        let right = poses[i].rotate(edge.normals[0]);
        Some(usize::from(
            !edge.one_sided && sign * right.dot(&toward) < 0.0,
        ))
    };
    let sides = match lines && !solid && rounding == [0.0; 2] {
        true => facing::sides([a, b], &views, [&seen[0], &seen[1]], sight?).ok()?,
        false => [side(0, 1.0), side(1, -1.0)],
    };
    let half_sides = |part: &Part| match part.core {
        Core::Box(h) => Some(h),
        _ => None,
    };
    Some(run(&Axes {
        views,
        boxes: parts.map(half_sides),
        rounding,
        sides,
        solid,
    }))
}

impl Axes<'_> {
    /// Whether one of the parts is rounded.
    pub fn is_round(&self) -> bool {
        self.rounding != [0.0; 2]
    }

    /// Whether these are two sharp segments of which one has two sides.
    pub fn with_sheet(&self) -> bool {
        let edges = [0, 1].map(|i| self.views[i].edge);
        !self.is_round()
            && edges.iter().all(Option::is_some)
            && edges.iter().flatten().any(|edge| !edge.one_sided)
    }

    /// All faces on the sides of the other part.
    pub fn all(&self) -> impl Iterator<Item = Axis> + '_ {
        (0..2).flat_map(move |part| {
            let faces = match self.sides[part] {
                Some(face) => face..face + 1,
                None => 0..self.views[part].normals.len(),
            };
            let beside = (2..4).filter(move |face| self.beside(part, *face).is_some());
            faces.chain(beside).map(move |face| Axis { part, face })
        })
    }

    /// Those of [`Axes::all`] along which the parts can meet.
    pub fn open<'b>(&'b self, poses: &'b [Pose64; 2]) -> impl Iterator<Item = Axis> + 'b {
        self.all().filter(|axis| self.is_open(poses, *axis))
    }

    /// Whether the parts can meet along an axis. Parts beside them may cover its face, or the corner that would
    /// touch it.
    pub fn is_open(&self, poses: &[Pose64; 2], axis: Axis) -> bool {
        let Axis { part, face } = axis;
        let (base, other) = (&self.views[part], &self.views[1 - part]);
        let covered = base.exposed.is_some() || other.exposed.is_some();
        if !covered || self.beside(part, face).is_some() {
            return true;
        }
        let seen = relative(&poses[part], &poses[1 - part]);
        let outward = self.direction(poses, axis);
        let inward = poses[1 - part].unrotate(if part == 0 { -outward } else { outward });
        let heights = other.points.iter().map(|q| inward.dot(q)).enumerate();
        let lowest = heights.max_by(|a, b| a.1.total_cmp(&b.1));
        let corner = lowest.map_or(0, |(corner, _)| corner);
        base.has_face(face, other, &seen) && other.has_corner(corner, inward, base, &seen)
    }

    /// Normal of the neighbour of a segment, see [`Axis`].
    fn beside(&self, part: usize, face: usize) -> Option<Vec2> {
        let end = face.checked_sub(2)?;
        self.views[part].edge?.next_normal(end, self.sides[part]?)
    }

    /// The direction of an axis, from part 1 to part 2.
    pub fn direction(&self, poses: &[Pose64; 2], axis: Axis) -> Vec2 {
        let Axis { part, face } = axis;
        let beside = self.beside(part, face);
        let normal = beside.unwrap_or_else(|| self.views[part].normals[face]);
        let outward = poses[part].rotate(normal);
        if part == 0 { outward } else { -outward }
    }

    /// Separation \[m\] of the parts along a direction from part 1 to part 2; negative if they overlap.
    pub fn separation(&self, poses: &[Pose64; 2], direction: Vec2) -> f64 {
        -self.extent(poses, 0, direction) - self.extent(poses, 1, -direction)
    }

    /// How far a part reaches along a direction from the origin \[m\].
    fn extent(&self, poses: &[Pose64; 2], part: usize, outward: Vec2) -> f64 {
        let own = poses[part].unrotate(outward);
        let far = match self.boxes[part] {
            // the largest of the sums over the corners, to the last bit
            Some(h) => own.x.abs() * h.x + own.y.abs() * h.y,
            None => {
                let view = &self.views[part];
                let behind = match self.solid {
                    true => own.dot(&view.inner()),
                    false => f64::NEG_INFINITY,
                };
                let points = view.points.iter().map(|p| own.dot(p));
                points.fold(behind, f64::max)
            }
        };
        outward.dot(&poses[part].translation) + far + self.rounding[part]
    }

    /// How far a point lies beyond the nearer end of a face, along it \[m\]; negative above the face.
    pub fn beyond(&self, poses: &[Pose64; 2], Axis { part, face }: Axis, point: Vec2) -> f64 {
        let points = self.views[part].points;
        let [a, b] = [face, (face + 1) % points.len()].map(|k| poses[part].apply(points[k]));
        let along = (b - a).try_normalize(0.0).unwrap_or_default();
        (a - point).dot(&along).max((point - b).dot(&along))
    }

    /// The contact along an axis, at the other part's corner that is nearest to the face. Of several
    /// corners within `noise` \[m\], it takes the one nearest to the middle of the face. `None` if a
    /// segment does not admit the contact, or a neighbour has it.
    pub fn touch(&self, poses: &[Pose64; 2], axis: Axis, noise: f64) -> Option<Touch> {
        let Axis { part, face } = axis;
        if self.beside(part, face).is_some() {
            return None;
        }
        let (base, other) = (&self.views[part], &self.views[1 - part]);
        let outward = poses[part].rotate(base.normals[face]);
        let ends = [
            base.points[face],
            base.points[(face + 1) % base.points.len()],
        ];
        let middle = poses[part].apply(0.5 * (ends[0] + ends[1]));
        let (j, p) = self.lowest(poses, 1 - part, (outward, middle), noise)?;
        if let Some(edge) = base.edge {
            // beyond an end with a neighbour, the contact belongs to the neighbour
            let reached = poses[part].apply_inverse(p);
            let out =
                |end: usize| (reached - edge.ends[end]).dot(&(edge.ends[end] - edge.ends[1 - end]));
            let left = |end: usize| edge.neighbours[end].is_some() && !base.alone[end];
            if (0..2).any(|end| left(end) && out(end) > 0.0) {
                return None;
            }
        }
        if let (Some(edge), Some(face)) = (other.edge, self.sides[1 - part]) {
            let inward = poses[1 - part].unrotate(-outward);
            let facing = edge.normals[face].dot(&inward);
            // both faces of a two-sided segment end in its free end
            let free_end = !edge.one_sided && edge.neighbours[j].is_none() || other.alone[j];
            // at a rectangular corner both segments may then have the contact
            if facing < -TILT && !free_end
                || facing < 1.0 - 1e-12 && !other.admits(edge, j, inward, TILT)
            {
                return None;
            }
        }
        Some(self.touch_of(poses, axis, (j, p), outward))
    }

    /// The corner of a part, and its place, that is lowest along a direction; of several within `noise` \[m\]
    /// the one nearest to a point.
    fn lowest(
        &self,
        poses: &[Pose64; 2],
        part: usize,
        (up, near): (Vec2, Vec2),
        noise: f64,
    ) -> Option<(usize, Vec2)> {
        let along = Vec2::new(-up.y, up.x);
        let placed = || {
            let points = self.views[part].points.iter().enumerate();
            points.map(|(j, q)| (j, poses[part].apply(*q)))
        };
        let low = placed().map(|(_, p)| up.dot(&p));
        let low = low.fold(f64::INFINITY, f64::min);
        let off = |p: &Vec2| along.dot(&(p - near)).abs();
        placed()
            .filter(|(_, p)| up.dot(p) <= low + noise)
            .min_by(|a, b| off(&a.1).total_cmp(&off(&b.1)))
    }

    /// The contact of a corner, at its place, along an axis that leads `outward` from its part.
    fn touch_of(
        &self,
        poses: &[Pose64; 2],
        Axis { part, face }: Axis,
        (corner, place): (usize, Vec2),
        outward: Vec2,
    ) -> Touch {
        let direction = if part == 0 { outward } else { -outward };
        let gap = self.separation(poses, direction);
        Touch {
            normal: direction,
            point: place - outward * (self.rounding[1 - part] + 0.5 * gap),
            gap,
            feature: 1 << 30 | (part as u32) << 29 | (face as u32) << 12 | corner as u32,
        }
    }

    /// The other contact of two sharp polygons along an axis, at the far end of the face that lies over
    /// that of the axis. `touch` is the one at the nearest corner. `None` if no face lies over it, or
    /// within `noise` \[m\] of that corner.
    pub fn second(
        &self,
        poses: &[Pose64; 2],
        Axis { part, face }: Axis,
        touch: &Touch,
        noise: f64,
    ) -> Option<Touch> {
        let (base, other) = (&self.views[part], &self.views[1 - part]);
        let polygon = |view: &View| view.edge.is_none() && view.points.len() > 2;
        if self.is_round() || !polygon(base) || !polygon(other) {
            return None;
        }
        let seen = relative(&poses[part], &poses[1 - part]);
        let ends = clipped_incident(base, face, other, &seen)?;
        let normal = base.normals[face];
        let along = Vec2::new(-normal.y, normal.x);
        let own = along.dot(&poses[part].apply_inverse(touch.point));
        let off = |end: &(f64, f64)| (end.0 - own).abs();
        let [a, b] = ends;
        let (place, gap) = if off(&a) > off(&b) { a } else { b };
        let extent = normal.dot(&base.points[face]);
        (off(&(place, gap)) > noise).then(|| Touch {
            normal: touch.normal,
            point: poses[part].apply(along * place + normal * (extent + 0.5 * gap)),
            gap,
            feature: touch.feature ^ 1 << 28,
        })
    }
}
