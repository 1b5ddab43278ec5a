//! Measures overlaps of a scene's bodies from their poses alone: how deep and how long they overlap,
//! and whether one passed through another. The measures are the same for every engine.

use super::convex::{gap, hull, width};
use super::crossing::Crossing;
use super::lasting::{Deepest, Lasting};
use super::passing::{Passing, Via, Way};
use super::slabs::slabs;
use super::{Body, BodyKind, Joint, Shape};
use crate::contact::Vec2;
use crate::dynamics::{LASTING, Pose64};
use rustc_hash::{FxHashMap, FxHashSet};
use serde::{Deserialize, Serialize};

/// Computes the overlaps of bodies in `f64`, without using the contacts of any engine.
///
/// Each shape is a core (a convex polygon, a segment or a point) with a radius r around it. If two
/// cores are at a distance d, the depth is `r₁ + r₂ − d`. If they overlap, the depth is `r₁ + r₂` plus
/// the least overlap along the normal of an edge (Gottschalk, Lin & Manocha 1996, in the plane). An
/// edge of a polyline counts as a piece of the solid behind it, see [`slabs`], no thicker than the
/// largest other body. An edge of a two-sided polyline counts as a segment.
///
/// One-way bodies are left out, because other bodies may pass through them. An overlap at the start
/// is not an error of a step: for such a pair only the depth beyond its least depth so far counts.
///
/// As plain data it holds what has been measured so far, without what the scene says.
#[derive(Serialize, Deserialize)]
pub(super) struct Overlaps {
    #[serde(skip)]
    leaves: Vec<Leaf>,
    /// Size \[m\] of each body: the diameter of a circle about its origin that contains it.
    #[serde(skip)]
    sizes: Vec<f64>,
    /// Least extent \[m\] of each body over all directions.
    #[serde(skip)]
    widths: Vec<f64>,
    /// Pairs of bodies that a joint connects, which are left out; the smaller number first.
    #[serde(skip)]
    tied: FxHashSet<(u32, u32)>,
    /// Least depth so far \[m\] of the pairs of leaves that overlapped at the start.
    least: FxHashMap<(u32, u32), f64>,
    /// Leaves sorted by the left ends of their boxes, from the last call.
    order: Vec<u32>,
    /// Corners \[m\] in the world, and their box.
    #[serde(skip)]
    placed: Vec<(Vec<Vec2>, [Vec2; 2])>,
    /// Poses now; `None` for a removed body.
    poses: Vec<Option<Pose64>>,
    passing: Passing,
    crossing: Crossing,
    lasting: Lasting,
}

/// What [`Built::measure`](super::Built::measure) finds after a step.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Measured {
    /// Worst overlap \[m\].
    pub worst: f64,
    /// Pairs of bodies of which one passed through the other, in the scene's numbers.
    pub passed: Vec<[u32; 2]>,
}

/// A convex piece of a body.
pub(super) struct Leaf {
    pub body: u32,
    /// In the body's frame \[m\]: one point, two points, or a counter-clockwise polygon.
    pub core: Vec<Vec2>,
    pub radius: f64,
    /// Least extent over all directions \[m\].
    pub thickness: f64,
    /// Largest distance of a point from the body's origin \[m\].
    pub reach: f64,
    /// Mean of the corners \[m\], and the largest distance of a point from it \[m\].
    pub centre: Vec2,
    pub radius_of_all: f64,
    /// Whether it is solid behind its first edge only, the slab of a one-sided polyline.
    pub slab: bool,
    moves: bool,
    one_way: bool,
}

impl Leaf {
    /// Whether it is a two-sided segment.
    pub fn is_sheet(&self) -> bool {
        self.core.len() == 2 && self.thickness == 0.0
    }
}

impl Overlaps {
    /// # Arguments
    /// - `dt`: time between two calls of [`Overlaps::measure`] \[s\].
    pub fn new(bodies: &[Body], joints: &[Joint], dt: f64) -> Self {
        let extents: Vec<f64> = bodies.iter().map(|body| extent(&body.shape)).collect();
        // a closed outline that moves is a body like others, a floor of lines is none
        let thin = |body: &Body| match body.shape {
            Shape::Polyline { closed, .. } => !(closed && body.kind == BodyKind::Dynamic),
            _ => false,
        };
        let solid = bodies.iter().zip(&extents).filter(|(b, _)| !thin(b));
        let largest = solid.map(|(_, e)| *e).fold(0.0, f64::max);
        let mut leaves = Vec::new();
        for (k, body) in bodies.iter().enumerate() {
            let from = leaves.len();
            add(
                body,
                &body.shape,
                &Pose64::new(Vec2::zeros(), 0.0),
                largest,
                &mut leaves,
            );
            leaves[from..]
                .iter_mut()
                .for_each(|leaf| leaf.body = k as u32);
        }
        let tied: FxHashSet<(u32, u32)> = joints
            .iter()
            .filter_map(|joint| {
                let [a, b] = joint.bodies;
                let (a, b) = (a? as u32, b? as u32);
                Some((a.min(b), a.max(b)))
            })
            .collect();
        Overlaps {
            crossing: Crossing::new(&leaves, |i, j| counts(&leaves, &tied, i, j)),
            order: (0..leaves.len() as u32).collect(),
            placed: vec![(Vec::new(), [Vec2::zeros(); 2]); leaves.len()],
            widths: widths(&leaves, &extents),
            leaves,
            sizes: extents,
            tied,
            least: FxHashMap::default(),
            poses: Vec::new(),
            passing: Passing::new((LASTING / dt).ceil() as usize),
            lasting: Lasting::new(((LASTING / dt).ceil() as usize).max(1)),
        }
    }

    /// Goes on from what was measured in the same scene.
    ///
    /// # Errors
    /// What the scene lacks.
    pub fn resume(&mut self, saved: Overlaps) -> Result<(), String> {
        // nothing is measured before the first call
        let bodies = [0, self.sizes.len()].contains(&saved.poses.len());
        if !bodies || saved.order.len() != self.leaves.len() {
            return Err("it has other bodies".to_owned());
        }
        self.least = saved.least;
        self.order = saved.order;
        self.poses = saved.poses;
        self.passing = saved.passing;
        self.crossing.resume(saved.crossing);
        self.lasting = saved.lasting;
        Ok(())
    }

    /// Measures the bodies at their poses after a step; the first call records the overlaps of the
    /// start. Between the poses bodies go straight, or by way of the places `via`.
    pub fn measure(&mut self, pose: impl Fn(usize) -> Option<Pose64>, via: &Via) -> Measured {
        let poses = (0..self.sizes.len()).map(pose).collect();
        let before = std::mem::replace(&mut self.poses, poses);
        let started = !before.is_empty();
        self.place();
        let mut order = std::mem::take(&mut self.order);
        let left = |k: &u32| self.placed[*k as usize].1[0].x;
        order.sort_by(|a, b| left(a).total_cmp(&left(b)));
        let mut measured = Measured::default();
        for (at, &i) in order.iter().enumerate() {
            let [low, high] = self.placed[i as usize].1;
            for &j in &order[at + 1..] {
                let [other_low, other_high] = self.placed[j as usize].1;
                if other_low.x >= high.x {
                    break;
                }
                if other_low.y < high.y && low.y < other_high.y && self.counts(i, j) {
                    let (i, j) = (i.min(j), i.max(j));
                    let excess = self.excess(i, j, started, &before);
                    measured.worst = measured.worst.max(excess);
                }
            }
        }
        self.order = order;
        if started {
            self.lasting.step();
            let (leaves, tied) = (&self.leaves, &self.tied);
            let thick = |i, j| counts(leaves, tied, i, j) && !are_sheets(leaves, i, j);
            let way = Way {
                before: &before,
                now: &self.poses,
                via,
            };
            let mut passed = self.passing.step(leaves, way, thick);
            passed.append(&mut self.crossing.step(&before, &self.poses));
            measured.passed = passed.into_iter().collect();
        }
        measured
    }

    /// Pairs of bodies, the smaller number first, with pieces that overlapped at the first measurement, and how deep
    /// \[m\].
    pub fn at_start(&self) -> impl Iterator<Item = ([u32; 2], f64)> + '_ {
        let body = |leaf: u32| self.leaves[leaf as usize].body;
        let pair = move |(i, j)| [body(i).min(body(j)), body(i).max(body(j))];
        self.least
            .iter()
            .map(move |(leaves, depth)| (pair(*leaves), *depth))
    }

    /// The worst overlap that lasted for [`LASTING`], or for the whole of a shorter run, over the
    /// size of the smaller of its two bodies; and these bodies.
    pub fn lasting(&self) -> (f64, Option<[u32; 2]>) {
        self.lasting.worst()
    }

    /// The deepest overlap so far.
    pub fn deepest(&self) -> Option<Deepest> {
        self.lasting.deepest()
    }

    /// Size \[m\] of a body.
    pub fn size(&self, body: usize) -> f64 {
        self.sizes[body]
    }

    /// Places all leaves in the world.
    fn place(&mut self) {
        for (leaf, (corners, bounds)) in self.leaves.iter().zip(&mut self.placed) {
            // a removed body overlaps nothing
            let Some(pose) = self.poses[leaf.body as usize] else {
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
    }

    fn counts(&self, i: u32, j: u32) -> bool {
        counts(&self.leaves, &self.tied, i, j)
    }

    /// Depth \[m\] of a pair beyond its initial overlap.
    fn excess(&mut self, i: u32, j: u32, started: bool, before: &[Option<Pose64>]) -> f64 {
        let (a, b) = (&self.leaves[i as usize], &self.leaves[j as usize]);
        let corners = [i, j].map(|k| self.placed[k as usize].0.as_slice());
        let touch = a.radius + b.radius;
        let depth = touch - gap(corners[0], corners[1], touch);
        if !started {
            if depth > 0.0 {
                self.least.insert((i, j), depth);
            }
            return 0.0;
        }
        let excess = match self.least.get_mut(&(i, j)) {
            Some(least) => {
                *least = least.min(depth.max(0.0));
                depth - *least
            }
            None => {
                if !are_sheets(&self.leaves, i, j) {
                    self.passing.overlap(&self.leaves, i, j, depth, before);
                }
                depth
            }
        };
        if excess > 0.0 {
            let size = self.sizes[a.body as usize].min(self.sizes[b.body as usize]);
            let width = self.widths[a.body as usize].min(self.widths[b.body as usize]);
            let pair = (a.body.min(b.body), a.body.max(b.body));
            self.lasting.add(pair, excess / size);
            self.lasting.deepen(pair, excess / width);
        }
        excess
    }
}

/// Whether an overlap of two leaves counts: they belong to different bodies, at least one moves, no
/// joint connects them, and neither is one-way.
fn counts(leaves: &[Leaf], tied: &FxHashSet<(u32, u32)>, i: u32, j: u32) -> bool {
    let (a, b) = (&leaves[i as usize], &leaves[j as usize]);
    let pair = (a.body.min(b.body), a.body.max(b.body));
    let apart = a.body != b.body && (a.moves || b.moves) && !tied.contains(&pair);
    apart && !a.one_way && !b.one_way
}

/// Whether two leaves are two-sided segments.
fn are_sheets(leaves: &[Leaf], i: u32, j: u32) -> bool {
    [i, j].iter().all(|k| leaves[*k as usize].is_sheet())
}

/// Least extent \[m\] of each body, at least a hundredth of its size. A sheet has none, so that its size counts:
/// in a pair the other body then sets the width.
fn widths(leaves: &[Leaf], sizes: &[f64]) -> Vec<f64> {
    let mut widths: Vec<f64> = sizes.iter().map(|size| 0.01 * size).collect();
    for own in leaves.chunk_by(|a, b| a.body == b.body) {
        let widest = &mut widths[own[0].body as usize];
        if own.iter().all(Leaf::is_sheet) {
            *widest = sizes[own[0].body as usize];
            continue;
        }
        let corners = own.iter().flat_map(|leaf| &leaf.core).copied().collect();
        let radius = own.iter().map(|leaf| leaf.radius).fold(0.0, f64::max);
        *widest = widest.max(width(&hull(corners)) + 2.0 * radius);
    }
    widths
}

/// Largest distance of a point of the shape from its body's origin, twice \[m\].
fn extent(shape: &Shape) -> f64 {
    let far = |points: &[[f64; 2]]| points.iter().map(|p| p[0].hypot(p[1])).fold(0.0, f64::max);
    2.0 * match shape {
        Shape::Disc { radius } => *radius,
        Shape::Box { width, height } => 0.5 * width.hypot(*height),
        Shape::Capsule { length, radius } => 0.5 * length + radius,
        Shape::Polygon { points } | Shape::Polyline { points, .. } => far(points),
        Shape::Compound(parts) => {
            let reach = |part: &super::Part| far(&[part.position]) + 0.5 * extent(&part.shape);
            parts.iter().map(reach).fold(0.0, f64::max)
        }
        // scenes with these shapes use models with closed forms
        Shape::Rod { .. } | Shape::Line | Shape::Bowl { .. } => 0.0,
    }
}

/// Adds the convex pieces of a shape at `place` in its body.
fn add(body: &Body, shape: &Shape, place: &Pose64, largest: f64, out: &mut Vec<Leaf>) {
    let mut leaf = |core: &[[f64; 2]], radius: f64, slab: bool| {
        let core: Vec<Vec2> = core.iter().map(|p| place.apply(Vec2::from(*p))).collect();
        let centre = core.iter().sum::<Vec2>() / core.len() as f64;
        let far = |from: Vec2| core.iter().map(|p| (p - from).norm()).fold(0.0, f64::max) + radius;
        out.push(Leaf {
            body: 0,
            centre,
            radius_of_all: far(centre),
            thickness: width(&core) + 2.0 * radius,
            reach: far(Vec2::zeros()),
            core,
            radius,
            slab,
            moves: body.kind == BodyKind::Dynamic,
            one_way: body.one_way.is_some(),
        });
    };
    match shape {
        Shape::Disc { radius } => leaf(&[[0.0; 2]], *radius, false),
        Shape::Box { width, height } => {
            let (x, y) = (0.5 * width, 0.5 * height);
            leaf(&[[-x, -y], [x, -y], [x, y], [-x, y]], 0.0, false);
        }
        Shape::Capsule { length, radius } => {
            leaf(&[[-0.5 * length, 0.0], [0.5 * length, 0.0]], *radius, false);
        }
        Shape::Polygon { points } => leaf(points, 0.0, false),
        Shape::Polyline { points, closed } if body.two_sided => {
            let edges = points.len() - usize::from(!closed);
            for k in 0..edges {
                leaf(&[points[k], points[(k + 1) % points.len()]], 0.0, false);
            }
        }
        Shape::Polyline { points, closed } => {
            for slab in slabs(points, *closed, largest) {
                leaf(&slab, 0.0, true);
            }
        }
        Shape::Compound(parts) => {
            for part in parts {
                let place = Pose64::new(Vec2::from(part.position), part.angle);
                add(body, &part.shape, &place, largest, out);
            }
        }
        Shape::Rod { .. } | Shape::Line | Shape::Bowl { .. } => {}
    }
}
