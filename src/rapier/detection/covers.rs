//! Finds which parts cover each other's faces: those of one body, and those of all fixed bodies.
//!
//! These stay where they are, so this is done when colliders change or a body is placed elsewhere. What it is good
//! for, see `kernels/exposed.rs`. Parts of bodies that move against each other do not cover each other, even if
//! they lie flush: see [`super::seams`] for these.

use super::super::bodies::Bodies;
use super::super::engine::prelude::*;
use super::super::joints::OUTSIDE;
use super::super::kernels::{Beyond, Part, Polygon};
use super::colliders::Colliders;
use super::leaves::Leaves;
use super::terms::Apart;
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use crate::rapier::parry::bounding_volume::Aabb;
use crate::rapier::parry::partitioning::{Bvh, BvhBuildStrategy};
use rustc_hash::{FxHashMap, FxHashSet};

/// Parts that may cover each other: those of a body with this number, or of all fixed ones.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Group {
    Fixed,
    Body(u32),
}

/// A sharp polygon, and its pose in the frame of its group.
#[derive(Clone, Copy, PartialEq)]
struct Member {
    leaf: u32,
    pose: Pose64,
}

/// Which parts may cover each other, as it was when it was last found out which do.
#[derive(Default)]
pub(super) struct Covers {
    /// The members of each group in the order of their leaves, by the first of these.
    groups: FxHashMap<u32, Vec<Member>>,
    /// Fixed bodies that a joint keeps apart from others: what passes through them can touch what they cover.
    passed: Vec<u32>,
    /// Those of the last step.
    old_passed: Vec<u32>,
    /// Whether colliders or bodies have changed since.
    stale: bool,
}

impl Covers {
    /// Parts may have changed, those `gone` among them.
    pub fn touch(&mut self, gone: &FxHashSet<u32>) {
        self.stale = true;
        if !gone.is_empty() {
            for members in self.groups.values_mut() {
                members.retain(|member| !gone.contains(&member.leaf));
            }
        }
    }

    /// Finds out again which parts of a group cover each other, if any of them has changed.
    pub fn update(
        &mut self,
        leaves: &mut Leaves,
        (colliders, bodies): (&Colliders, &Bodies),
        apart: &Apart,
    ) {
        let kind = |body: u32| bodies.list[body as usize].kind;
        let ends = apart.iter().flatten().copied();
        let fixed = ends.filter(|body| kind(*body) == RigidBodyType::Fixed);
        self.old_passed.clear();
        std::mem::swap(&mut self.passed, &mut self.old_passed);
        self.passed.extend(fixed);
        self.passed.sort_unstable();
        self.passed.dedup();
        if !std::mem::take(&mut self.stale) && self.passed == self.old_passed {
            return;
        }
        let passed = |body: u32| self.passed.binary_search(&body).is_ok();
        let mut groups: FxHashMap<Group, Vec<Member>> = FxHashMap::default();
        for (leaf, own) in leaves.iter() {
            let group = match own.body {
                OUTSIDE => Group::Fixed,
                body if kind(body) == RigidBodyType::Fixed && !passed(body) => Group::Fixed,
                body if bodies.list[body as usize].parts == 1 => continue,
                body => Group::Body(body),
            };
            let covers = colliders.get(own.slot).is_some_and(|known| known.covers());
            if covers && own.part.is_sharp_polygon() {
                let local = *leaves.local(leaf);
                let pose = match group {
                    // leaves follow their bodies later
                    Group::Fixed => leaves.body_pose(own.body, bodies).compose(&local),
                    Group::Body(_) => local,
                };
                groups.entry(group).or_default().push(Member { leaf, pose });
            }
        }
        let groups = groups
            .into_values()
            .map(|members| (members[0].leaf, members));
        let groups: FxHashMap<u32, Vec<Member>> = groups.collect();
        let old = std::mem::take(&mut self.groups);
        let changed = |first: &u32, members: &[Member], of: &FxHashMap<u32, Vec<Member>>| {
            of.get(first).is_none_or(|other| other != members)
        };
        for (_, members) in old
            .iter()
            .filter(|(first, own)| changed(first, own, &groups))
        {
            for member in members {
                if let Some(part) = plain(member, leaves, colliders) {
                    leaves.set_part(member.leaf, part);
                }
            }
        }
        for (_, members) in groups
            .iter()
            .filter(|(first, own)| changed(first, own, &old))
        {
            cover(members, leaves, colliders);
        }
        self.groups = groups;
    }
}

/// The part of a member without what others cover of it.
fn plain(member: &Member, leaves: &Leaves, colliders: &Colliders) -> Option<Part> {
    let leaf = leaves.get(member.leaf);
    let pieces = &colliders.get(leaf.slot)?.pieces;
    let own = pieces.iter().find(|piece| piece.sub == leaf.sub)?;
    Some(own.part.clone())
}

/// Sets the part of each member of a group to what the others leave exposed of it.
fn cover(members: &[Member], leaves: &mut Leaves, colliders: &Colliders) {
    let parts: Vec<Option<Part>> = (members.iter())
        .map(|member| plain(member, leaves, colliders))
        .collect();
    let placed = (members.iter().zip(&parts))
        .map(|(member, part)| part.as_ref()?.sharp_polygon(&member.pose));
    let placed: Vec<Option<Polygon>> = placed.collect();
    let boxes = placed
        .iter()
        .map(|polygon| bounds(polygon.as_ref().map_or(&[], |p| &p.points)));
    let boxes: Vec<Aabb> = boxes.collect();
    let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    let known = |k: usize| colliders.get(leaves.get(members[k].leaf).slot);
    let may_cover = |k: usize, other: usize| {
        k != other
            && known(k)
                .zip(known(other))
                .is_some_and(|(a, b)| a.is_like(b))
    };
    let beside: Vec<Vec<usize>> = (0..members.len())
        .map(|k| {
            let near = tree.intersect_aabb(&boxes[k]).map(|other| other as usize);
            let mut near: Vec<usize> = near.filter(|other| may_cover(k, *other)).collect();
            near.sort_unstable();
            near
        })
        .collect();
    let polygon =
        |k: usize, other: usize| Some((placed[other].as_ref()?, flush([&boxes[k], &boxes[other]])));
    // how far the surface goes on from a corner of a member
    let run = |member: usize, corner: Vec2, beyond: &Beyond| {
        let (mut k, mut far) = (member, 0.0);
        for _ in 0..MOST {
            let next = beside[k].iter().filter_map(|&other| {
                let (polygon, flush) = polygon(k, other)?;
                Some((
                    beyond.reach(polygon, corner + far * beyond.way, flush)?,
                    other,
                ))
            });
            match next.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((way, other)) => (k, far) = (other, far + way),
                None => return far,
            }
        }
        f64::INFINITY
    };
    let covered = (0..members.len()).map(|k| {
        let (own, part) = (placed[k].as_ref()?, parts[k].as_ref()?);
        let others: Vec<_> = beside[k]
            .iter()
            .filter_map(|&other| polygon(k, other))
            .collect();
        let run = |corner, beyond| run(k, corner, &beyond);
        part.covered((&members[k].pose, own), &others, run)
    });
    let covered: Vec<Option<Part>> = covered.collect();
    for ((member, part), covered) in members.iter().zip(parts).zip(covered) {
        if let Some(part) = covered.or(part) {
            leaves.set_part(member.leaf, part);
        }
    }
}

/// Most parts that are followed to the end of a flat surface. No body is thought to lie on more.
const MOST: usize = 100;

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
