//! Worst penetration of a scene's bodies, computed from geometry alone: the same for every engine.

use super::outline::signed_area;
use super::{Body, BodyKind, Joint, Shape};
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use rustc_hash::{FxHashMap, FxHashSet};

/// Computes the penetration of bodies in `f64`, without using the contacts of any engine.
///
/// Shapes are convex polygons, segments or points with a radius r around them. For cores apart by
/// d the depth is `r₁ + r₂ − d`, for cores that overlap `r₁ + r₂` and the least overlap along the
/// normal of an edge (Gottschalk, Lin & Manocha 1996, in the plane). An edge of a polyline counts
/// as a slab on its solid side, as thick as the largest other body but no thicker than the solid.
///
/// One-way bodies are left out, because other bodies may pass through them. An overlap of the start is
/// not an error of a step: the depth of such a pair counts only beyond its least depth so far.
pub(super) struct Overlaps {
    leaves: Vec<Leaf>,
    /// Pairs of bodies that a joint connects, which are left out; the smaller number first.
    tied: FxHashSet<(u32, u32)>,
    /// Least depth so far \[m\] of the pairs of leaves that overlapped at the start.
    least: FxHashMap<(u32, u32), f64>,
    started: bool,
    /// Leaves sorted by the left ends of their boxes, from the last call.
    order: Vec<u32>,
    /// Corners \[m\] in the world, and their box.
    placed: Vec<(Vec<Vec2>, [Vec2; 2])>,
}

/// A convex piece of a body.
struct Leaf {
    body: u32,
    /// In the body's frame \[m\]: one point, two, or a polygon counter-clockwise.
    core: Vec<Vec2>,
    radius: f64,
    moves: bool,
    one_way: bool,
}

impl Overlaps {
    pub fn new(bodies: &[Body], joints: &[Joint]) -> Self {
        let largest = bodies.iter().map(|body| extent(&body.shape));
        let largest = largest.fold(0.0, f64::max);
        let mut leaves = Vec::new();
        for (k, body) in bodies.iter().enumerate() {
            let from = leaves.len();
            add(
                &body.shape,
                &Pose64::new(Vec2::zeros(), 0.0),
                largest,
                &mut leaves,
            );
            for leaf in &mut leaves[from..] {
                leaf.body = k as u32;
                leaf.moves = body.kind == BodyKind::Dynamic;
                leaf.one_way = body.one_way.is_some();
            }
        }
        Overlaps {
            order: (0..leaves.len() as u32).collect(),
            placed: vec![(Vec::new(), [Vec2::zeros(); 2]); leaves.len()],
            leaves,
            tied: joints
                .iter()
                .filter_map(|joint| {
                    let [a, b] = joint.bodies;
                    let (a, b) = (a? as u32, b? as u32);
                    Some((a.min(b), a.max(b)))
                })
                .collect(),
            least: FxHashMap::default(),
            started: false,
        }
    }

    /// Worst penetration \[m\] with each body at its pose; the first call records the overlaps of the
    /// start.
    pub fn worst(&mut self, pose: impl Fn(usize) -> Option<Pose64>) -> f64 {
        for (leaf, (corners, bounds)) in self.leaves.iter().zip(&mut self.placed) {
            // a removed body overlaps nothing
            let Some(pose) = pose(leaf.body as usize) else {
                *bounds = [Vec2::repeat(f64::INFINITY); 2];
                continue;
            };
            corners.clear();
            corners.extend(leaf.core.iter().map(|p| pose.apply(*p)));
            let (mut low, mut high) = (corners[0], corners[0]);
            for p in &corners[1..] {
                (low, high) = (low.inf(p), high.sup(p));
            }
            *bounds = [low.add_scalar(-leaf.radius), high.add_scalar(leaf.radius)];
        }
        let mut order = std::mem::take(&mut self.order);
        let left = |k: &u32| self.placed[*k as usize].1[0].x;
        order.sort_by(|a, b| left(a).total_cmp(&left(b)));
        let mut worst: f64 = 0.0;
        for (at, &i) in order.iter().enumerate() {
            let [low, high] = self.placed[i as usize].1;
            for &j in &order[at + 1..] {
                let [other_low, other_high] = self.placed[j as usize].1;
                if other_low.x >= high.x {
                    break;
                }
                if other_low.y < high.y && low.y < other_high.y {
                    worst = worst.max(self.excess(i.min(j), i.max(j)));
                }
            }
        }
        self.order = order;
        self.started = true;
        worst
    }

    /// Depth \[m\] of a pair beyond its initial overlap.
    fn excess(&mut self, i: u32, j: u32) -> f64 {
        let (a, b) = (&self.leaves[i as usize], &self.leaves[j as usize]);
        let pair = (a.body.min(b.body), a.body.max(b.body));
        let apart = a.body != b.body && (a.moves || b.moves) && !self.tied.contains(&pair);
        if !apart || a.one_way || b.one_way {
            return 0.0;
        }
        let corners = [i, j].map(|k| self.placed[k as usize].0.as_slice());
        let depth = a.radius + b.radius - gap(corners[0], corners[1]);
        if !self.started {
            if depth > 0.0 {
                self.least.insert((i, j), depth);
            }
            return 0.0;
        }
        match self.least.get_mut(&(i, j)) {
            Some(least) => {
                *least = least.min(depth.max(0.0));
                depth - *least
            }
            None => depth,
        }
    }
}

/// Largest distance of a point of the shape from its body's origin, twice \[m\]; 0 for a polyline.
fn extent(shape: &Shape) -> f64 {
    let far = |points: &[[f64; 2]]| points.iter().map(|p| p[0].hypot(p[1])).fold(0.0, f64::max);
    2.0 * match shape {
        Shape::Disc { radius } => *radius,
        Shape::Box { width, height } => 0.5 * width.hypot(*height),
        Shape::Capsule { length, radius } => 0.5 * length + radius,
        Shape::Polygon { points } => far(points),
        Shape::Compound(parts) => {
            let reach = |part: &super::Part| far(&[part.position]) + 0.5 * extent(&part.shape);
            parts.iter().map(reach).fold(0.0, f64::max)
        }
        Shape::Polyline { .. } | Shape::Rod { .. } | Shape::Line | Shape::Bowl { .. } => 0.0,
    }
}

/// The convex pieces of a shape at `place` in its body.
fn add(shape: &Shape, place: &Pose64, largest: f64, out: &mut Vec<Leaf>) {
    let mut leaf = |core: &[[f64; 2]], radius: f64| {
        let core = core.iter().map(|p| place.apply(Vec2::from(*p))).collect();
        out.push(Leaf {
            body: 0,
            core,
            radius,
            moves: false,
            one_way: false,
        });
    };
    match shape {
        Shape::Disc { radius } => leaf(&[[0.0; 2]], *radius),
        Shape::Box { width, height } => {
            let (x, y) = (0.5 * width, 0.5 * height);
            leaf(&[[-x, -y], [x, -y], [x, y], [-x, y]], 0.0);
        }
        Shape::Capsule { length, radius } => {
            leaf(&[[-0.5 * length, 0.0], [0.5 * length, 0.0]], *radius);
        }
        Shape::Polygon { points } => leaf(points, 0.0),
        Shape::Polyline { points, closed } => {
            for slab in slabs(points, *closed, largest) {
                leaf(&slab, 0.0);
            }
        }
        Shape::Compound(parts) => {
            for part in parts {
                let place = Pose64::new(Vec2::from(part.position), part.angle);
                add(&part.shape, &place, largest, out);
            }
        }
        // scenes with these shapes use models with closed forms
        Shape::Rod { .. } | Shape::Line | Shape::Bowl { .. } => {}
    }
}

/// The solid behind each edge of a polyline, at most `thickness` \[m\] of it.
fn slabs(points: &[[f64; 2]], closed: bool, thickness: f64) -> Vec<[[f64; 2]; 4]> {
    let n = points.len();
    let edges = if closed { n } else { n.saturating_sub(1) };
    let edge = |k: usize| [points[k], points[(k + 1) % n]].map(Vec2::from);
    let length: f64 = (0..edges).map(|k| (edge(k)[1] - edge(k)[0]).norm()).sum();
    let area = if closed { signed_area(points) } else { 0.0 };
    // twice the area over the outline is the radius of the largest circle inside, or more
    let thickness = if area > 0.0 {
        thickness.min(area / length)
    } else {
        thickness
    };
    (0..edges)
        .map(|k| {
            let [a, b] = edge(k);
            let along = (b - a).normalize();
            let inwards = Vec2::new(-along.y, along.x) * thickness;
            [a, b, b + inwards, a + inwards].map(|p| [p.x, p.y])
        })
        .collect()
}

/// Distance of two cores \[m\], negative by the least overlap where both are more than a point.
fn gap(a: &[Vec2], b: &[Vec2]) -> f64 {
    let apart = faces(a, b).max(faces(b, a));
    if apart < 0.0 && apart.is_finite() {
        return apart;
    }
    corners(a, b).min(corners(b, a))
}

/// Largest distance of `other` from an edge, seen along its normal; −∞ for a point.
fn faces(core: &[Vec2], other: &[Vec2]) -> f64 {
    let n = core.len();
    let edges = if n > 1 { n } else { 0 };
    let face = |k: usize| {
        let along = core[(k + 1) % n] - core[k];
        let normal = Vec2::new(along.y, -along.x).normalize();
        let nearest = other.iter().map(|p| normal.dot(&(p - core[k])));
        nearest.fold(f64::INFINITY, f64::min)
    };
    (0..edges).map(face).fold(f64::NEG_INFINITY, f64::max)
}

/// Least distance of a corner from an edge of `other`.
fn corners(points: &[Vec2], other: &[Vec2]) -> f64 {
    let n = other.len();
    let nearest = |p: &Vec2| {
        let edges = (0..n).map(|k| to_segment(p, &other[k], &other[(k + 1) % n]));
        edges.fold(f64::INFINITY, f64::min)
    };
    points.iter().map(nearest).fold(f64::INFINITY, f64::min)
}

fn to_segment(p: &Vec2, a: &Vec2, b: &Vec2) -> f64 {
    let along = b - a;
    let length = along.norm_squared();
    let t = if length > 0.0 {
        ((p - a).dot(&along) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p - a - along * t).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn depth(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
        let [a, b] = [a, b].map(|c| c.iter().map(|p| Vec2::from(*p)).collect::<Vec<_>>());
        let found = -gap(&a, &b);
        // either order, a few roundings apart
        assert!((found + gap(&b, &a)).abs() < 1e-15);
        found
    }

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    #[test]
    fn depths_of_cores_in_each_other_and_apart() {
        let moved = |x: f64, y: f64| SQUARE.map(|p| [p[0] + x, p[1] + y]);
        assert_eq!(depth(&SQUARE, &moved(0.75, 0.5)), 0.25);
        // apart along x, and apart by a diagonal of 3-4-5
        assert_eq!(depth(&SQUARE, &moved(1.5, 0.5)), -0.5);
        assert_eq!(depth(&SQUARE, &moved(4.0, 5.0)), -5.0);
        // points: two, one above a square, one in it
        assert_eq!(depth(&[[0.0, 0.0]], &[[3.0, 4.0]]), -5.0);
        assert_eq!(depth(&SQUARE, &[[0.5, 1.25]]), -0.25);
        assert_eq!(depth(&SQUARE, &[[0.5, 0.875]]), 0.125);
        // segments: crossed, one after the other, and one that cuts a corner off by 0.1 sqrt 2
        let along = [[-1.0, 0.0], [1.0, 0.0]];
        assert_eq!(depth(&along, &[[0.0, -0.5], [0.0, 2.0]]), 0.5);
        assert_eq!(depth(&along, &[[2.0, 0.0], [3.0, 0.0]]), -1.0);
        let cut = depth(&SQUARE, &[[1.2, 0.6], [0.6, 1.2]]);
        assert!((cut - 0.1 * 2f64.sqrt()).abs() < 1e-15, "{cut}");
    }
}
