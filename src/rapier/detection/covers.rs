//! Finds which parts cover each other's faces: those of one body, and those of all fixed bodies.
//!
//! These stay where they are, so this is done when colliders change or a body is placed elsewhere. What it is good
//! for, see `kernels/exposed.rs`. Parts of other bodies that lie flush, see [`super::beds`] and [`super::seams`].

use super::super::bodies::Bodies;
use super::super::engine::prelude::*;
use super::super::joints::OUTSIDE;
use super::super::kernels::{Beyond, Part, Polygon};
use super::colliders::{Colliders, Known};
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
    /// The members of each group, sorted by collider and part, by the leaf of the first.
    groups: FxHashMap<u32, Vec<Member>>,
    /// What is left of groups of which a part is gone.
    loose: Vec<Member>,
    /// Fixed bodies that a joint keeps apart from others: what passes through them can touch what they cover.
    passed: Vec<u32>,
    /// Those of the last step.
    old_passed: Vec<u32>,
    /// Whether colliders or bodies have changed since the groups were found.
    stale: bool,
}

impl Covers {
    /// Parts may have changed, those `gone` among them.
    pub fn touch(&mut self, gone: &FxHashSet<u32>) {
        self.stale = true;
        if !gone.is_empty() {
            self.loosen(|members| members.iter().any(|member| gone.contains(&member.leaf)));
            self.loose.retain(|member| !gone.contains(&member.leaf));
        }
    }

    /// Everything may have changed.
    pub fn touch_all(&mut self) {
        self.stale = true;
        self.loosen(|_| true);
    }

    fn loosen(&mut self, is_changed: impl Fn(&[Member]) -> bool) {
        let loose = &mut self.loose;
        self.groups.retain(|_, members| {
            let changed = is_changed(members);
            if changed {
                loose.append(members);
            }
            !changed
        });
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
        let groups = self.find(leaves, colliders, bodies);
        let old = std::mem::replace(&mut self.groups, groups);
        let stays = |first: &u32, own: &Vec<Member>| self.groups.get(first) == Some(own);
        let left = old.iter().filter(|(first, own)| !stays(first, own));
        for member in left.flat_map(|(_, own)| own).chain(&self.loose) {
            if let Some(part) = plain(member, leaves, colliders) {
                leaves.set_part(member.leaf, part);
            }
        }
        self.loose.clear();
        for (first, members) in &self.groups {
            if old.get(first) != Some(members) {
                cover(members, leaves, colliders);
            }
        }
    }

    fn find(
        &self,
        leaves: &Leaves,
        colliders: &Colliders,
        bodies: &Bodies,
    ) -> FxHashMap<u32, Vec<Member>> {
        // what a hook lets through one part can touch what this covers
        if colliders.any_hooks() {
            return FxHashMap::default();
        }
        let passed = |body: &u32| self.passed.binary_search(body).is_ok();
        let is_fixed = |body: &u32| bodies.list[*body as usize].kind == RigidBodyType::Fixed;
        let mut groups: FxHashMap<Group, Vec<Member>> = FxHashMap::default();
        for (leaf, own) in leaves.iter() {
            let group = match own.body {
                OUTSIDE => Group::Fixed,
                body if is_fixed(&body) && !passed(&body) => Group::Fixed,
                body if bodies.list[body as usize].parts == 1 => continue,
                body => Group::Body(body),
            };
            let covers = colliders.get(own.slot).is_some_and(Known::covers);
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
        let several = groups.into_values().filter(|members| members.len() > 1);
        let sorted = several.map(|mut members| {
            let name = |member: &Member| leaves.names[member.leaf as usize];
            members.sort_unstable_by_key(|member| (name(member).slot, name(member).sub));
            (members[0].leaf, members)
        });
        sorted.collect()
    }
}

/// The part of a member without what others cover of it.
fn plain(member: &Member, leaves: &Leaves, colliders: &Colliders) -> Option<Part> {
    let leaf = leaves.get(member.leaf);
    let pieces = &colliders.get(leaf.slot)?.pieces;
    let at = pieces
        .binary_search_by_key(&leaf.sub, |piece| piece.sub)
        .ok()?;
    Some(pieces[at].part.clone())
}

/// A member that has an area: its part, the corners of this in the frame of the group, and bounds of these.
struct Placed {
    member: Member,
    slot: u32,
    part: Part,
    polygon: Polygon,
    bounds: Aabb,
}

/// Sets the part of each member of a group, none of which is covered so far, to what the others leave exposed of it.
fn cover(members: &[Member], leaves: &mut Leaves, colliders: &Colliders) {
    let placed = members.iter().filter_map(|member| {
        let part = plain(member, leaves, colliders)?;
        let polygon = part.sharp_polygon(&member.pose)?;
        Some(Placed {
            member: *member,
            slot: leaves.names[member.leaf as usize].slot,
            bounds: bounds(&polygon.points),
            part,
            polygon,
        })
    });
    let all: Vec<Placed> = placed.collect();
    let boxes: Vec<Aabb> = all.iter().map(|own| own.bounds).collect();
    let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    let alike = |one: &Placed, other: &Placed| {
        let [one, other] = [one, other].map(|own| colliders.get(own.slot));
        one.zip(other).is_some_and(|(a, b)| a.is_like(b))
    };
    let beside = (0..all.len()).map(|k| {
        let near = tree.intersect_aabb(&boxes[k]).map(|other| other as usize);
        let near = near.filter(|other| *other != k && alike(&all[k], &all[*other]));
        let mut near: Vec<usize> = near.collect();
        near.sort_unstable();
        near
    });
    let beside: Vec<Vec<usize>> = beside.collect();
    let polygon = |k: usize, other: usize| (&all[other].polygon, flush([&boxes[k], &boxes[other]]));
    // how far the surface goes on from a corner of a member
    let run = |member: usize, corner: Vec2, beyond: &Beyond| {
        let (mut k, mut far) = (member, 0.0);
        for _ in 0..MOST {
            let next = beside[k].iter().filter_map(|&other| {
                let (polygon, flush) = polygon(k, other);
                let reach = beyond.reach(polygon, corner + far * beyond.way, flush)?;
                Some((reach, other))
            });
            match next.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((way, other)) => (k, far) = (other, far + way),
                None => return far,
            }
        }
        f64::INFINITY
    };
    for (k, own) in all.iter().enumerate() {
        let others: Vec<_> = beside[k].iter().map(|&other| polygon(k, other)).collect();
        let run = |corner, beyond| run(k, corner, &beyond);
        let covered = own
            .part
            .covered((&own.member.pose, &own.polygon), &others, run, |_| true);
        if let Some(part) = covered {
            leaves.set_part(own.member.leaf, part);
        }
    }
}

/// Most parts that are followed to the end of a flat surface. Beyond them it is taken to go on: few bodies lie on
/// more.
pub(super) const MOST: usize = 100;

/// Bounds of points, and of what may lie flush with them.
pub(super) fn bounds(points: &[Vec2]) -> Aabb {
    let single = |p: &Vec2| Vector::new(p.x as Real, p.y as Real);
    let tight = Aabb::from_points(points.iter().map(single));
    let extents = tight.extents();
    let far = tight.mins.abs().max(tight.maxs.abs());
    let most = f64::from(far.x.max(far.y)) * ROUNDING + f64::from(extents.x.max(extents.y)) * SHARE;
    tight.loosened(most as Real)
}

/// Resolution of coordinates that the user gives in `f32`, as a share of them.
pub(super) const ROUNDING: f64 = 4.0 * f32::EPSILON as f64;

/// Resolution of positions as a share of the smaller part's size, as in [`super::couple::Couple::noise`].
pub(super) const SHARE: f64 = 1e-7;

/// Distance \[m\] within which faces of two parts in these boxes lie flush.
pub(super) fn flush([one, two]: [&Aabb; 2]) -> f64 {
    let size = |b: &Aabb| f64::from(b.extents().x.max(b.extents().y));
    let (low, high) = (one.mins.max(two.mins), one.maxs.min(two.maxs));
    let far = low.abs().max(high.abs());
    (SHARE * size(one).min(size(two))).max(ROUNDING * f64::from(far.x.max(far.y)))
}
