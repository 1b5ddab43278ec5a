//! Splits rapier's shapes into parts with closed-form gaps.

use super::super::engine::prelude::*;
use super::super::kernels::{Core, Edge, Part, Polygon, corners};
use super::super::widen;
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use crate::rapier::parry::bounding_volume::{Aabb, BoundingVolume};
use crate::rapier::parry::shape::{PolylineFlags, TriMesh, TypedShape, VoxelData, Voxels};
use rustc_hash::{FxHashMap, FxHashSet};
use std::sync::Arc;

/// One part of a collider.
#[derive(Clone)]
pub(super) struct Piece {
    pub part: Part,
    /// Of a segment of a chain with two sides, the parts with solid behind it, as seen from each face.
    pub solid: Option<Arc<[Part; 2]>>,
    /// Pose in the collider's frame.
    pub local: Pose64,
    /// Number of the segment, triangle or sub-shape.
    pub sub: u32,
}

/// The parts of a shape.
///
/// Segments of polylines and height fields know their neighbours, see [`Edge`]. A triangle mesh
/// collides with its outline, like an oriented polyline: the borders between its triangles are no
/// surface. A mesh without an outline collides triangle by triangle. Voxels collide with their
/// border, in the same way. `skin` \[m\] is added all
/// round.
pub(super) fn pieces(shape: &SharedShape, skin: f64) -> Vec<Piece> {
    let mut out = Vec::new();
    add(shape, skin, Pose64::new(Vec2::zeros(), 0.0), &mut out);
    out
}

fn vec2(v: Vector) -> Vec2 {
    Vec2::new(widen(v.x), widen(v.y))
}

fn polygon(points: impl IntoIterator<Item = Vector>) -> Option<Core> {
    let polygon = Polygon::new(points.into_iter().map(vec2).collect());
    polygon.map(|p| Core::Polygon(p.into()))
}

fn alone(a: Vector, b: Vector) -> Option<Core> {
    let edge = Edge::new(vec2(a), vec2(b), false);
    edge.map(|e| Core::Edge(e.into()))
}

/// The core of a shape of one part, if it has a kernel, and its rounding \[m\].
fn single(shape: &TypedShape<'_>) -> (Option<Core>, f64) {
    match shape {
        TypedShape::Ball(b) => (Some(Core::Ball(widen(b.radius))), 0.0),
        TypedShape::Cuboid(c) => (Some(Core::Box(vec2(c.half_extents))), 0.0),
        TypedShape::RoundCuboid(c) => {
            let half = vec2(c.inner_shape.half_extents);
            (Some(Core::Box(half)), widen(c.border_radius))
        }
        TypedShape::Capsule(c) => (alone(c.segment.a, c.segment.b), widen(c.radius)),
        TypedShape::Segment(s) => (alone(s.a, s.b), 0.0),
        TypedShape::Triangle(t) => (polygon([t.a, t.b, t.c]), 0.0),
        TypedShape::RoundTriangle(t) => {
            let inner = &t.inner_shape;
            (polygon([inner.a, inner.b, inner.c]), widen(t.border_radius))
        }
        TypedShape::ConvexPolygon(p) => (polygon(p.points().iter().copied()), 0.0),
        TypedShape::RoundConvexPolygon(p) => {
            let points = p.inner_shape.points().iter().copied();
            (polygon(points), widen(p.border_radius))
        }
        TypedShape::HalfSpace(h) => (Some(Core::HalfPlane(vec2(h.normal).normalize())), 0.0),
        _ => (None, 0.0),
    }
}

fn add(shape: &SharedShape, skin: f64, local: Pose64, out: &mut Vec<Piece>) {
    let sub = out.len() as u32;
    match shape.as_typed_shape() {
        // a capsule without length is a ball
        TypedShape::Capsule(c) if alone(c.segment.a, c.segment.b).is_none() => {
            let core = Core::Ball(widen(c.radius));
            let rounding = skin;
            out.push(Piece {
                part: Part { core, rounding },
                solid: None,
                local: local.compose(&Pose64::new(vec2(c.segment.a), 0.0)),
                sub,
            });
        }
        TypedShape::Polyline(line) => {
            let one_sided = line.flags().contains(PolylineFlags::ORIENTED);
            let ends = line.segments().map(|s| [vec2(s.a), vec2(s.b)]);
            surface(ends.enumerate(), one_sided, skin, local, out);
        }
        TypedShape::HeightField(field) => {
            // parry computes the common end of two segments twice, one ulp apart
            let mut last = Vec2::repeat(f64::INFINITY);
            let ends = field.segments().map(|s| {
                let [mut a, b] = [vec2(s.a), vec2(s.b)];
                if (a - last).norm() < 1e-5 * (b - a).norm() {
                    a = last;
                }
                last = b;
                [a, b]
            });
            surface(ends.enumerate(), false, skin, local, out);
        }
        TypedShape::TriMesh(mesh) => match outline(mesh) {
            Some(sides) => surface(sides.into_iter(), true, skin, local, out),
            None => {
                for (t, triangle) in mesh.triangles().enumerate() {
                    let core = polygon([triangle.a, triangle.b, triangle.c]);
                    out.extend(core.map(|core| Piece {
                        part: Part {
                            core,
                            rounding: skin,
                        },
                        solid: None,
                        local,
                        sub: 3 * t as u32,
                    }));
                }
            }
        },
        TypedShape::Voxels(voxels) => {
            surface(border(voxels).into_iter(), true, skin, local, out);
        }
        TypedShape::Compound(compound) => {
            for (pose, shape) in compound.shapes() {
                add(shape, skin, local.compose(&Pose64::from_rapier(pose)), out);
            }
        }
        one => {
            let (core, rounding) = single(&one);
            out.push(Piece {
                part: Part {
                    core: core.unwrap_or_else(|| Core::Other(shape.clone())),
                    rounding: rounding + skin,
                },
                solid: None,
                local,
                sub,
            });
        }
    }
}

/// A point as a key; −0 counts as 0.
fn place(p: Vec2) -> [u64; 2] {
    [(p.x + 0.0).to_bits(), (p.y + 0.0).to_bits()]
}

/// Most segments of a surface whose depths are measured, which takes the square of their number. Those of
/// finer ones are shorter than the solid is thick.
const COARSE: usize = 1000;

/// Numbers the segments, and makes two of them neighbours where exactly two meet.
fn surface(
    segments: impl Iterator<Item = (usize, [Vec2; 2])>,
    one_sided: bool,
    skin: f64,
    local: Pose64,
    out: &mut Vec<Piece>,
) {
    let mut edges: Vec<(u32, Edge)> = segments
        .filter_map(|(sub, [a, b])| Some((sub as u32, Edge::new(a, b, one_sided)?)))
        .collect();
    let mut meeting: FxHashMap<[u64; 2], Vec<(usize, usize)>> = FxHashMap::default();
    for (i, (_, edge)) in edges.iter().enumerate() {
        for end in 0..2 {
            let key = place(edge.ends[end]);
            meeting.entry(key).or_default().push((i, end));
        }
    }
    for joint in meeting.values() {
        let &[(i, at_i), (j, at_j)] = joint.as_slice() else {
            continue;
        };
        if i == j {
            continue;
        }
        for (mine, end, other, at) in [(i, at_i, j, at_j), (j, at_j, i, at_i)] {
            let leads = edges[other].1.ends[1 - at] - edges[other].1.ends[at];
            edges[mine].1.neighbours[end] = Some(leads.normalize());
            edges[mine].1.next[end] = Some((edges[other].0, end == at));
            edges[mine].1.owns[end] = mine < other;
        }
    }
    // the solid behind a segment ends where another one is
    let measured = |edge: Edge| match edges.len() <= COARSE {
        true => {
            let depths = edges.iter().filter_map(|(_, other)| edge.depth_to(other));
            let depth = depths.fold(edge.depth, f64::min);
            Edge { depth, ..edge }
        }
        false => edge,
    };
    let part = |edge: Edge| Part {
        core: Core::Edge(edge.into()),
        rounding: skin,
    };
    let piece = |(sub, edge): &(u32, Edge)| Piece {
        part: part(match one_sided {
            true => measured(edge.clone()),
            false => edge.clone(),
        }),
        solid: edge
            .solid()
            .map(|both| Arc::new(both.map(|edge| part(measured(edge))))),
        local,
        sub: *sub,
    };
    out.extend(edges.iter().map(piece));
}

/// The sides of triangles that no other triangle shares, solid on their left, numbered three to a
/// triangle. `None` where triangles overlap, or meet along part of a side: such a side has solid on
/// both sides and is no border.
fn outline(mesh: &TriMesh) -> Option<Vec<(usize, [Vec2; 2])>> {
    let triangles: Vec<[Vec2; 3]> = mesh
        .triangles()
        .map(|t| {
            let mut points = [t.a, t.b, t.c].map(vec2);
            if (points[1] - points[0]).perp(&(points[2] - points[0])) < 0.0 {
                points.swap(1, 2);
            }
            points
        })
        .collect();
    let mut directed: FxHashSet<[[u64; 2]; 2]> = FxHashSet::default();
    let mut sides = Vec::new();
    for (t, points) in triangles.iter().enumerate() {
        for k in 0..3 {
            let ends = [points[k], points[(k + 1) % 3]];
            if ends[0] != ends[1] && !directed.insert(ends.map(place)) {
                return None;
            }
            sides.push((3 * t + k, ends));
        }
    }
    sides.retain(|(_, [a, b])| !directed.contains(&[place(*b), place(*a)]));
    let conforms = sides.iter().all(|(sub, [a, b])| {
        let slack = ROUNDING * a.abs().sup(&b.abs()).amax();
        let corner = |p: Vec2| Vector::new(p.x as Real, p.y as Real);
        let room = Aabb::new(corner(a.inf(b)), corner(a.sup(b))).loosened(slack as Real);
        let others = mesh.bvh().intersect_aabb(&room).map(|t| t as usize);
        let mut others = others.filter(|t| *t != sub / 3);
        others.all(|t| share_inside(&triangles[t], [*a, *b], slack) < 1e-3)
    });
    conforms.then_some(sides)
}

/// The sides of voxels that no other voxel shares, solid on their left, numbered four to a voxel.
fn border(voxels: &Voxels) -> Vec<(usize, [Vec2; 2])> {
    let full = voxels.voxels().filter(|voxel| !voxel.state.is_empty());
    // 32 bits, or 64 with rapier's feature f64
    let key = |v: VoxelData| [v.grid_coords.x, v.grid_coords.y].map(i64::from);
    let mut keys: Vec<[i64; 2]> = full.map(key).collect();
    keys.sort_unstable();
    let taken: FxHashSet<[i64; 2]> = keys.iter().copied().collect();
    let size = vec2(voxels.voxel_size());
    let corner = |[i, j]: [i64; 2]| Vec2::new(size.x * i as f64, size.y * j as f64);
    let mut sides = Vec::new();
    for (id, &[i, j]) in keys.iter().enumerate() {
        let corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
        let beside = [[i, j - 1], [i + 1, j], [i, j + 1], [i - 1, j]];
        for k in (0..4).filter(|k| !taken.contains(&beside[*k])) {
            sides.push((4 * id + k, [corners[k], corners[(k + 1) % 4]].map(corner)));
        }
    }
    sides
}

/// Relative rounding of single precision between two computations of one corner.
const ROUNDING: f64 = 1e-6;

/// Fraction of a segment that lies in a triangle (counter-clockwise) or within `slack` \[m\] of it.
fn share_inside(triangle: &[Vec2; 3], [a, b]: [Vec2; 2], slack: f64) -> f64 {
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    for k in 0..3 {
        let (p, q) = (triangle[k], triangle[(k + 1) % 3]);
        let Some(along) = (q - p).try_normalize(0.0) else {
            return 0.0;
        };
        let (from, to) = (along.perp(&(a - p)) + slack, along.perp(&(b - p)) + slack);
        match (from >= 0.0, to >= 0.0) {
            (true, true) => {}
            (false, false) => return 0.0,
            (true, false) => high = high.min(from / (from - to)),
            (false, true) => low = low.max(from / (from - to)),
        }
    }
    high - low
}

/// Extent of a part in the frame given by `pose`: low x, low y, high x, high y \[m\].
pub(super) fn extent(part: &Part, pose: &Pose64) -> [f64; 4] {
    let at = pose.translation;
    let grown = |low: Vec2, high: Vec2, by: f64| [low.x - by, low.y - by, high.x + by, high.y + by];
    let round = |points: &[Vec2]| {
        let first = pose.apply(points[0]);
        let (low, high) = points[1..].iter().fold((first, first), |(low, high), p| {
            let p = pose.apply(*p);
            (low.inf(&p), high.sup(&p))
        });
        grown(low, high, part.rounding)
    };
    match &part.core {
        Core::Ball(r) => grown(at, at, r + part.rounding),
        Core::Box(h) => {
            let (c, s) = (pose.cos.abs(), pose.sin.abs());
            let reach = Vec2::new(c * h.x + s * h.y, s * h.x + c * h.y);
            grown(at - reach, at + reach, part.rounding)
        }
        Core::Polygon(polygon) => round(&polygon.points),
        Core::Edge(edge) => round(&edge.ends),
        Core::HalfPlane(_) => [-FAR, -FAR, FAR, FAR],
        Core::Other(shape) => {
            let aabb = shape.compute_aabb(&pose.to_rapier());
            let wide = |v: Vector| Vec2::new(f64::from(v.x), f64::from(v.y));
            // covers the rounding of the pose
            let slack = 1e-6 * (1.0 + at.amax());
            grown(wide(aabb.mins), wide(aabb.maxs), part.rounding + slack)
        }
    }
}

/// Border of the box of a half-plane \[m\]: its area is still finite in single precision.
const FAR: f64 = 1e15;

/// Farthest point of a part from the origin of the frame given by `pose` \[m\].
pub(super) fn radius(part: &Part, pose: &Pose64) -> f64 {
    let far = |points: &[Vec2]| {
        let points = points.iter().map(|p| pose.apply(*p).norm());
        points.fold(0.0, f64::max)
    };
    part.rounding
        + match &part.core {
            Core::Ball(r) => pose.translation.norm() + r,
            Core::Box(h) => far(&corners(*h)),
            Core::Polygon(polygon) => far(&polygon.points),
            Core::Edge(edge) => far(&edge.ends),
            // a half-plane that rotates sweeps everything
            Core::HalfPlane(_) => FAR,
            Core::Other(shape) => {
                let sphere = shape.compute_local_bounding_sphere();
                let center = Vec2::new(sphere.center.x.into(), sphere.center.y.into());
                pose.apply(center).norm() + f64::from(sphere.radius)
            }
        }
}

/// A bounding circle of a part in the frame given by `pose`: centre and radius \[m\]. The radius is
/// infinite for unbounded parts and parts without an exact gap.
pub(super) fn circle(part: &Part, pose: &Pose64) -> (Vec2, f64) {
    let round = |points: &[Vec2]| {
        let (low, high) = points
            .iter()
            .fold((points[0], points[0]), |(low, high), p| {
                (low.inf(p), high.sup(p))
            });
        let middle = 0.5 * (low + high);
        let far = points.iter().map(|p| (p - middle).norm());
        (middle, far.fold(0.0, f64::max))
    };
    let (center, radius) = match &part.core {
        Core::Ball(r) => (Vec2::zeros(), *r),
        Core::Box(h) => (Vec2::zeros(), h.norm()),
        Core::Polygon(polygon) => round(&polygon.points),
        Core::Edge(edge) => round(&edge.ends),
        Core::HalfPlane(_) | Core::Other(_) => (Vec2::zeros(), f64::INFINITY),
    };
    (pose.apply(center), radius + part.rounding)
}

/// A shape of parry for the core of a part, without its rounding.
pub(super) fn for_parry(core: &Core) -> SharedShape {
    let v = |p: Vec2| Vector::new(p.x as Real, p.y as Real);
    match core {
        Core::Ball(r) => SharedShape::ball(*r as Real),
        Core::Box(h) => SharedShape::cuboid(h.x as Real, h.y as Real),
        Core::Polygon(polygon) => {
            let points: Vec<_> = polygon.points.iter().map(|p| v(*p)).collect();
            let first = points[0];
            SharedShape::convex_polyline(points)
                .unwrap_or_else(|| SharedShape::segment(first, first))
        }
        Core::Edge(edge) => SharedShape::segment(v(edge.ends[0]), v(edge.ends[1])),
        Core::HalfPlane(n) => SharedShape::halfspace(v(*n)),
        Core::Other(shape) => shape.clone(),
    }
}
