//! The narrow phase: pairs of parts, and the contacts of those that are near.

use super::super::bodies::Bodies;
use super::super::engine::geometry::ContactManifold;
use super::super::engine::parry::query::{DefaultQueryDispatcher, PersistentQueryDispatcher};
use super::super::engine::prelude::*;
use super::super::joints::OUTSIDE;
use super::super::kernels::{Core, Touch, relative, touches};
use super::colliders::{Colliders, Known};
use super::leaves::{Leaf, Leaves};
use super::points::{Pair, mix, parry_points, same_place};
use super::tree::Tree;
use super::{Span, shapes, speed};
use crate::contact::Vec3;
use crate::dynamics::Detection;
use rustc_hash::FxHashSet;

/// Two parts whose fat boxes overlap.
#[derive(Debug, Clone, Copy)]
struct Row {
    /// Colliders, then parts: the order of contacts, which must not depend on history.
    order: [u32; 4],
    leaves: [u32; 2],
    /// Way \[m\] of the two together below which they are too far apart to look at.
    budget: f64,
}

/// All pairs of parts, sorted.
#[derive(Default)]
pub(super) struct Pairs {
    rows: Vec<Row>,
    known: FxHashSet<u64>,
    /// Of each leaf, its share of the reach \[m\].
    growth: Vec<f64>,
    touches: Vec<Touch>,
    added: bool,
}

fn name([a, b]: [u32; 2]) -> u64 {
    u64::from(a) << 32 | u64::from(b)
}

impl Pairs {
    pub fn set_growth(&mut self, leaf: usize, growth: f64) {
        if self.growth.len() <= leaf {
            self.growth.resize(leaf + 1, 0.0);
        }
        self.growth[leaf] = growth;
    }

    /// Notes that two leaves are near, unless that is known or they can never meet.
    pub fn add(&mut self, a: u32, b: u32, leaves: &Leaves) {
        let (la, lb) = (leaves.get(a), leaves.get(b));
        if la.slot == lb.slot || la.body == lb.body && la.body != OUTSIDE {
            return;
        }
        // the lower collider first, as in rapier
        let pair = if la.slot < lb.slot { [a, b] } else { [b, a] };
        if self.known.insert(name(pair)) {
            let [first, second] = pair.map(|leaf| leaves.get(leaf));
            self.rows.push(Row {
                order: [first.slot, second.slot, first.sub, second.sub],
                leaves: pair,
                budget: f64::NEG_INFINITY,
            });
            self.added = true;
        }
    }

    pub fn sort(&mut self) {
        if std::mem::take(&mut self.added) {
            // what is new stands at the end: two runs to merge
            self.rows.sort_by_key(|row| row.order);
        }
    }

    pub fn clear(&mut self) {
        self.rows.clear();
        self.known.clear();
    }

    /// Drops all pairs of these leaves.
    pub fn forget(&mut self, gone: &FxHashSet<u32>) {
        let known = &mut self.known;
        self.rows.retain(|row| {
            let stays = row.leaves.iter().all(|leaf| !gone.contains(leaf));
            if !stays {
                known.remove(&name(row.leaves));
            }
            stays
        });
    }

    /// Contacts of all pairs; those whose boxes parted are dropped.
    pub fn all(&mut self, finder: &Finder, tree: Option<&Tree>, out: &mut Detection) {
        let (known, growth, found) = (&mut self.known, &self.growth, &mut self.touches);
        let mut from = Group::default();
        self.rows.retain_mut(|row| {
            let [a, b] = row.leaves;
            let way = finder.leaves.way[a as usize] + finder.leaves.way[b as usize];
            if let Some(tree) = tree {
                if way + growth[a as usize] + growth[b as usize] < row.budget {
                    return true;
                }
                if (tree.moved(a) || tree.moved(b)) && !tree.overlap(a, b) {
                    known.remove(&name(row.leaves));
                    return false;
                }
            }
            if let Some(bound) = finder.contacts(row, from.of(row, out), found, out) {
                row.budget = way + bound;
            }
            true
        });
    }

    /// Contacts of some pairs of colliders, sorted as those of [`Pairs::all`].
    pub fn some(&mut self, finder: &Finder, pairs: &[[u32; 2]], out: &mut Detection) {
        let mut sorted = pairs.to_vec();
        sorted.sort_unstable();
        sorted.dedup();
        for [a, b] in sorted {
            let start = self.rows.partition_point(|row| row.order[..2] < [a, b][..]);
            let from = out.contacts.len();
            let rows = self.rows[start..].iter();
            for row in rows.take_while(|row| row.order[..2] == [a, b][..]) {
                finder.contacts(row, from, &mut self.touches, out);
            }
        }
    }
}

/// Where the contacts of the present pair of colliders start.
#[derive(Default)]
struct Group {
    slots: [u32; 2],
    start: usize,
}

impl Group {
    fn of(&mut self, row: &Row, out: &Detection) -> usize {
        let slots = [row.order[0], row.order[1]];
        if slots != self.slots {
            *self = Group {
                slots,
                start: out.contacts.len(),
            };
        }
        self.start
    }
}

/// Pairs of bodies between which a joint switches contacts off, smaller number first.
pub(super) type Apart = FxHashSet<[u32; 2]>;

pub(super) fn apart(world: &PhysicsWorld, bodies: &Bodies, out: &mut Apart) {
    out.clear();
    for (_, joint) in world.impulse_joints.iter() {
        if !joint.data.contacts_enabled
            && let (Some(a), Some(b)) = (
                bodies.index_of(joint.body1()),
                bodies.index_of(joint.body2()),
            )
        {
            out.insert([a.min(b), a.max(b)]);
        }
    }
}

/// What a look at a pair needs to know.
pub(super) struct Finder<'a> {
    pub bodies: &'a Bodies,
    pub colliders: &'a Colliders,
    pub leaves: &'a Leaves,
    pub apart: &'a Apart,
    pub span: Span,
}

impl Finder<'_> {
    /// Adds the contacts of a pair; those of the same two colliders start at `from`.
    ///
    /// Returns a lower bound of the gap \[m\]; `None` if none was asked for.
    fn contacts(
        &self,
        row: &Row,
        from: usize,
        found: &mut Vec<Touch>,
        out: &mut Detection,
    ) -> Option<f64> {
        let sides = row.leaves.map(|leaf| self.leaves.get(leaf));
        let known = [
            self.colliders.get(sides[0].slot)?,
            self.colliders.get(sides[1].slot)?,
        ];
        if !self.may_touch(sides, known) {
            return None;
        }
        let speeds = sides.map(|leaf| speed(self.bodies, leaf.body));
        let reach = self.span.reach(speeds, known.map(|k| k.size));
        let poses = row.leaves.map(|leaf| &self.leaves.pose[leaf as usize]);
        found.clear();
        let one = known.map(|k| k.law.one_point_per_segment);
        if let Some(bound) = touches(
            poses[0],
            &sides[0].part,
            poses[1],
            &sides[1].part,
            reach,
            found,
        ) {
            if !found.is_empty() {
                let setting = self.setting(sides, known);
                self.give(setting, sides, one, from, found, out);
            }
            return Some(bound);
        }
        let setting = self.setting(sides, known);
        self.ask_parry(row, sides, setting, reach, from, one[0] || one[1], out);
        Some(f64::NEG_INFINITY)
    }

    fn may_touch(&self, sides: [&Leaf; 2], known: [&Known; 2]) -> bool {
        let [a, b] = sides.map(|leaf| leaf.body);
        let still = |k: u32| k == OUTSIDE || self.bodies.inverse_mass[k as usize] == Vec3::zeros();
        if still(a) && still(b) {
            return false;
        }
        let kind = |k: u32| match k {
            OUTSIDE => RigidBodyType::Fixed,
            k => self.bodies.list[k as usize].kind,
        };
        !(known[0].is_sensor() || known[1].is_sensor())
            && (self.apart.is_empty() || !self.apart.contains(&[a.min(b), a.max(b)]))
            && known[0].may_meet(known[1], [kind(a), kind(b)])
            && known[0].may_push(known[1])
    }

    fn setting(&self, sides: [&Leaf; 2], known: [&Known; 2]) -> Pair {
        let setting = Pair {
            numbers: sides.map(|leaf| leaf.body),
            surfaces: sides.map(|leaf| leaf.slot),
            key: pair_key(known.map(|k| k.handle)),
            law: known[0].combined_law(known[1]),
            friction: known[0].combined_friction(known[1]),
            // on side 1 the surface runs along +t, on side 2 along −t
            belt: -known[0].law.speed - known[1].law.speed,
            size: known[0].size.min(known[1].size),
        };
        let cell = (0..2).find(|&i| known[i].law.one_point_per_segment);
        match cell.map(|i| &sides[i].part.core) {
            Some(Core::Edge(edge)) => setting.over((edge.ends[1] - edge.ends[0]).norm()),
            _ => setting,
        }
    }

    fn give(
        &self,
        setting: Pair,
        sides: [&Leaf; 2],
        one: [bool; 2],
        from: usize,
        found: &mut Vec<Touch>,
        out: &mut Detection,
    ) {
        if one[0] || one[1] {
            let deepest = found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap));
            if let Some(&deepest) = deepest {
                found.clear();
                // one point a segment: its feature must not flicker between the two ends
                found.push(Touch {
                    feature: 0,
                    ..deepest
                });
            }
        }
        let sub = sides.map(|leaf| leaf.sub);
        let parts = sides.map(|leaf| self.leaves.of(leaf.slot).len());
        for touch in found.iter() {
            let feature = if parts == [1, 1] {
                touch.feature.into()
            } else {
                let old = &out.contacts[from..];
                if old.iter().any(|p| same_place(p, touch, setting.size)) {
                    continue;
                }
                mix([sub[0], sub[1], touch.feature, 0])
            };
            let point = setting.point(self.bodies, touch, sub, feature, true);
            out.contacts.push(point);
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn ask_parry(
        &self,
        row: &Row,
        sides: [&Leaf; 2],
        setting: Pair,
        reach: f64,
        from: usize,
        one: bool,
        out: &mut Detection,
    ) {
        let poses = row.leaves.map(|leaf| self.leaves.pose[leaf as usize]);
        let shapes = sides.map(|leaf| shapes::for_parry(&leaf.part.core));
        let rounding = sides[0].part.rounding + sides[1].part.rounding;
        let mut manifolds: Vec<ContactManifold> = Vec::new();
        // what parry cannot do is no contact in rapier either
        let _ = DefaultQueryDispatcher.contact_manifolds(
            &relative(&poses[0], &poses[1]).to_rapier(),
            &*shapes[0],
            &*shapes[1],
            (reach + rounding) as Real,
            &mut manifolds,
            &mut None,
        );
        for manifold in manifolds.iter().filter(|m| !m.points.is_empty()) {
            parry_points(manifold, &poses, reach + rounding, one, |touch, order| {
                let touch = Touch {
                    gap: touch.gap - rounding,
                    ..touch
                };
                let old = &out.contacts[from..];
                if old.iter().any(|p| same_place(p, &touch, setting.size)) {
                    return;
                }
                let sub = [sides[0].sub.max(order[0]), sides[1].sub.max(order[1])];
                let feature = mix([sides[0].sub, sides[1].sub, mix(order) as u32, order[0]]);
                let point = setting.point(self.bodies, &touch, sub, feature, false);
                out.contacts.push(point);
            });
        }
    }
}

fn pair_key(handles: [ColliderHandle; 2]) -> u64 {
    let [(a, of_a), (b, of_b)] = handles.map(|h| h.into_raw_parts());
    mix([a, of_a, b, of_b])
}
