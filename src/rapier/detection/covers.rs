//! Finds which parts cover each other's faces: those of one body, and those of all fixed bodies.
//!
//! They stay where they are, so this is done when colliders change or a body is placed elsewhere. See
//! [`Exposed`](super::super::kernels::Exposed) for what it is good for.

use super::super::bodies::Bodies;
use super::super::engine::prelude::*;
use super::super::joints::OUTSIDE;
use super::super::kernels::Polygon;
use super::colliders::Colliders;
use super::leaves::Leaves;
use super::terms::Apart;
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use crate::rapier::parry::bounding_volume::Aabb;
use crate::rapier::parry::partitioning::{Bvh, BvhBuildStrategy};
use rustc_hash::FxHashSet;

/// Parts that may cover each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Group {
    Fixed,
    /// The number of the body.
    Body(u32),
}

/// A sharp polygon that others of its group may cover.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Member {
    leaf: u32,
    group: Group,
    /// In the frame of its group.
    pose: Pose64,
}

/// The parts that may cover each other, as they were when it was last found out which do.
#[derive(Default)]
pub(super) struct Covers {
    members: Vec<Member>,
    /// Fixed bodies that a joint keeps apart from others: what passes through them can touch what they cover.
    passed: Vec<u32>,
    /// Whether colliders or bodies have changed since.
    stale: bool,
}

impl Covers {
    /// Parts may have changed, those `gone` among them.
    pub fn touch(&mut self, gone: &FxHashSet<u32>) {
        self.stale = true;
        if self.members.iter().any(|m| gone.contains(&m.leaf)) {
            self.members.clear();
        }
    }

    /// Finds out again which parts cover each other, if any of them has changed.
    pub fn update(
        &mut self,
        leaves: &mut Leaves,
        (colliders, bodies): (&Colliders, &Bodies),
        apart: &Apart,
    ) {
        let kind = |body: u32| bodies.list[body as usize].kind;
        let ends = apart.iter().flatten().copied();
        let mut passed: Vec<u32> = ends
            .filter(|body| kind(*body) == RigidBodyType::Fixed)
            .collect();
        passed.sort_unstable();
        passed.dedup();
        if !std::mem::take(&mut self.stale) && passed == self.passed {
            return;
        }
        let old = std::mem::take(&mut self.members);
        let group = |body: u32| match body {
            OUTSIDE => Group::Fixed,
            _ if kind(body) == RigidBodyType::Fixed && !passed.contains(&body) => Group::Fixed,
            _ => Group::Body(body),
        };
        self.members.extend(leaves.iter().filter_map(|(leaf, own)| {
            let known = colliders.get(own.slot)?;
            let group = group(own.body);
            let alone =
                own.lone && group != Group::Fixed && bodies.list[own.body as usize].parts == 1;
            let pose = match group {
                // leaves follow their bodies later
                Group::Fixed => leaves
                    .body_pose(own.body, bodies)
                    .compose(leaves.local(leaf)),
                Group::Body(_) => *leaves.local(leaf),
            };
            let member = Member { leaf, group, pose };
            (!alone && known.covers() && own.part.is_sharp_polygon()).then_some(member)
        }));
        self.passed = passed;
        if self.members != old {
            cover(&self.members, leaves, colliders);
        }
    }
}

/// Sets the part of each member to what the others of its group leave exposed of it.
fn cover(members: &[Member], leaves: &mut Leaves, colliders: &Colliders) {
    let part = |member: &Member| {
        let leaf = leaves.get(member.leaf);
        let pieces = colliders.get(leaf.slot).map(|known| &known.pieces)?;
        pieces
            .iter()
            .find(|piece| piece.sub == leaf.sub)
            .map(|piece| &piece.part)
    };
    let placed = members
        .iter()
        .map(|member| part(member)?.sharp_polygon(&member.pose));
    let placed: Vec<Option<Polygon>> = placed.collect();
    let boxes = placed
        .iter()
        .map(|polygon| bounds(polygon.as_ref().map_or(&[], |p| &p.points)));
    let boxes: Vec<Aabb> = boxes.collect();
    let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    let slot = |k: usize| colliders.get(leaves.get(members[k].leaf).slot);
    let may_cover = |k: usize, other: usize| {
        k != other
            && members[k].group == members[other].group
            && slot(k).zip(slot(other)).is_some_and(|(a, b)| a.is_like(b))
    };
    let mut parts = Vec::new();
    for (k, member) in members.iter().enumerate() {
        let (Some(own), Some(plain)) = (&placed[k], part(member)) else {
            continue;
        };
        let near = tree.intersect_aabb(&boxes[k]).map(|other| other as usize);
        let others = near
            .filter(|other| may_cover(k, *other))
            .filter_map(|other| {
                let flush = flush([&boxes[k], &boxes[other]]);
                Some((placed[other].as_ref()?, flush))
            });
        let others: Vec<(&Polygon, f64)> = others.collect();
        let covered = plain.covered(&member.pose, own, &others);
        parts.push((member.leaf, covered.unwrap_or_else(|| plain.clone())));
    }
    for (leaf, part) in parts {
        leaves.set_part(leaf, part);
    }
}

/// Bounds of points, and of what may lie flush with them.
fn bounds(points: &[Vec2]) -> Aabb {
    let single = |p: &Vec2| Vector::new(p.x as Real, p.y as Real);
    let tight = Aabb::from_points(points.iter().map(single));
    let extents = tight.extents();
    let far = tight.mins.abs().max(tight.maxs.abs());
    let most = f64::from(far.x.max(far.y)) * ROUNDING + f64::from(extents.x.max(extents.y)) * SHARE;
    tight.loosened(most as Real)
}

/// Resolution of coordinates that the user gives in `f32`, as a share of them.
const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

/// Resolution of positions as a share of the smaller part's size, as in [`super::couple::Couple::noise`].
const SHARE: f64 = 1e-7;

/// Distance \[m\] within which faces of two parts in these boxes lie flush.
fn flush([one, two]: [&Aabb; 2]) -> f64 {
    let size = |b: &Aabb| f64::from(b.extents().x.max(b.extents().y));
    let (low, high) = (one.mins.max(two.mins), one.maxs.min(two.maxs));
    let far = low.abs().max(high.abs());
    (SHARE * size(one).min(size(two))).max(ROUNDING * f64::from(far.x.max(far.y)))
}
