//! The narrow phase: pairs of parts, and the contacts of pairs that are near.

use super::super::bodies::Bodies;
use super::super::engine::geometry::ContactManifold;
use super::super::engine::prelude::*;
use super::super::kernels::{Core, Sight, Touch, cell_touches, relative, touches};
use super::colliders::{Colliders, Known};
use super::grid::Grid;
use super::hooks::Hooks;
use super::leaves::{Leaf, Leaves};
use super::points::{Pair, mix, parry_points, places, same_place};
use super::rows::{Row, Rows};
use super::seams::Tie;
use super::{Present, Span, SurfaceLaw, present, shapes};
use crate::dynamics::{ContactPoint, Detection, NearPair, NormalLaw, Pose64, SurfacePoint};
use crate::rapier::parry::query::{
    DefaultQueryDispatcher, PersistentQueryDispatcher, QueryDispatcher,
};
use rustc_hash::{FxHashMap, FxHashSet};

/// All pairs of parts, and the buffers of the narrow phase.
#[derive(Default)]
pub(super) struct Pairs {
    pub rows: Rows,
    scratch: Scratch,
}

/// A contact that only makes events: its groups or a hook forbid it to push, or neither body can
/// move.
#[derive(Debug, Clone, Copy)]
pub(in crate::rapier) struct EventContact {
    pub colliders: [ColliderHandle; 2],
    /// Gap \[m\].
    pub gap: f64,
}

/// Output of the narrow phase besides the contacts.
#[derive(Default)]
struct Scratch {
    event_contacts: Vec<EventContact>,
    touches: Vec<Touch>,
    marks: Marks,
    ties: Vec<Tie>,
    /// Sides of two-sided segments on which pairs touch.
    faces: Marks,
}

/// Values stored on pairs of parts, by [`Row::order`]. A value lasts while the pair has contacts, and
/// is read once more when the pair has none. It does not last as long as the boxes overlap, as that
/// depends on earlier queries.
#[derive(Default)]
pub(super) struct Marks {
    now: FxHashMap<[u32; 4], u32>,
    /// The values of the last pass, during a pass over all pairs.
    past: FxHashMap<[u32; 4], u32>,
}

impl Marks {
    /// Starts a pass over all pairs: a value that the pass does not store again is dropped.
    fn begin(&mut self) {
        self.past = std::mem::take(&mut self.now);
    }

    pub fn is_empty(&self) -> bool {
        self.past.is_empty() && self.now.is_empty()
    }

    /// Keeps the value of a pair that the pass does not look at.
    fn keep(&mut self, order: &[u32; 4]) {
        let known = self.get(order);
        self.set(*order, known);
    }

    /// All values, sorted: indices of colliders, numbers of parts, value.
    fn sorted(&self) -> Vec<([u32; 4], u32)> {
        let all = self.now.iter();
        let mut all: Vec<_> = all.map(|(order, mark)| (*order, *mark)).collect();
        all.sort_unstable();
        all
    }

    fn restore(&mut self, marks: &[([u32; 4], u32)]) {
        self.now = marks.iter().copied().collect();
    }

    pub fn get(&self, order: &[u32; 4]) -> u32 {
        let known = self.past.get(order).or_else(|| self.now.get(order));
        known.copied().unwrap_or(0)
    }

    pub fn set(&mut self, order: [u32; 4], mark: u32) {
        match mark {
            0 => self.now.remove(&order),
            mark => self.now.insert(order, mark),
        };
    }
}

impl Pairs {
    /// Drops all pairs of these leaves.
    pub fn forget(&mut self, gone: &FxHashSet<u32>, leaves: &Leaves) {
        let Scratch { marks, faces, .. } = &mut self.scratch;
        self.rows.forget(gone, |pair| {
            let order = Row::order(pair, &leaves.names);
            marks.now.remove(&order);
            faces.now.remove(&order);
        });
    }

    /// See [`super::Detector::event_contacts`].
    pub fn event_contacts(&self) -> &[EventContact] {
        &self.scratch.event_contacts
    }

    /// See [`super::Detector::intersections`].
    pub fn intersections(&mut self, finder: &Finder) -> Vec<[ColliderHandle; 2]> {
        let mut found: Vec<[ColliderHandle; 2]> = Vec::new();
        for row in self.rows.iter() {
            let sides = row.leaves.map(|leaf| finder.leaves.get(leaf));
            let known = sides.map(|leaf| finder.colliders.get(leaf.slot));
            let [Some(one), Some(two)] = known else {
                continue;
            };
            let handles = [one.handle(), two.handle()];
            if (one.is_sensor() || two.is_sensor())
                && found.last() != Some(&handles)
                && finder.may_cross(sides, [one, two])
                && finder.overlap(sides, &mut self.scratch.touches)
            {
                found.push(handles);
            }
        }
        found
    }

    /// Contacts of all pairs; drops pairs whose boxes no longer overlap.
    pub fn all(&mut self, finder: &Finder, grid: Option<&Grid>, out: &mut Detection) {
        let scratch = &mut self.scratch;
        let mut group = Group::default();
        scratch.event_contacts.clear();
        scratch.ties.clear();
        scratch.marks.begin();
        if finder.midpoint {
            scratch.faces.begin();
        }
        // a pair with a stored value goes to the hook once more when it has no contacts
        let marked = !scratch.marks.past.is_empty();
        let near = &finder.leaves.near;
        let any_asleep = finder.present.iter().any(|body| body.asleep);
        self.rows.retain(|[a, b], budget| {
            if any_asleep && finder.asleep([a, b]) {
                let order = Row::order([a, b], &finder.leaves.names);
                scratch.marks.keep(&order);
                scratch.faces.keep(&order);
                return Some(budget);
            }
            if let Some(grid) = grid {
                let (one, two) = (&near[a as usize], &near[b as usize]);
                if one.reached + two.reached < budget {
                    return Some(budget);
                }
                if (grid.moved(a) || grid.moved(b)) && !grid.overlap(a, b) {
                    return None;
                }
                if one.apart(two) && !marked {
                    return Some(budget);
                }
            }
            let travel = &finder.leaves.travel;
            match finder.contacts([a, b], &mut group, scratch, out) {
                Some(bound) => Some(travel[a as usize] + travel[b as usize] + bound),
                None => Some(budget),
            }
        });
        scratch.marks.past.clear();
        scratch.faces.past.clear();
        finder.break_ties(&scratch.ties, &mut out.contacts);
    }

    /// Whether all pairs of parts of two `relevant` bodies are out of reach.
    pub fn none_meet(&mut self, finder: &Finder, relevant: impl Fn(u32, u32) -> bool) -> bool {
        let (leaves, found) = (finder.leaves, &mut self.scratch.touches);
        self.rows.iter().all(|row| {
            let [a, b] = row.leaves.map(|leaf| leaf as usize);
            !relevant(leaves.names[a].body, leaves.names[b].body)
                || leaves.near[a].apart(&leaves.near[b])
                || finder.out_of_reach(row.leaves, found)
        })
    }

    /// Values that the user's hook stored on pairs of parts, see [`Marks::sorted`].
    pub fn marks(&self) -> Vec<([u32; 4], u32)> {
        self.scratch.marks.sorted()
    }

    pub fn restore_marks(&mut self, marks: &[([u32; 4], u32)]) {
        self.scratch.marks.restore(marks);
    }

    /// Sides of two-sided segments on which pairs of parts touch: see [`super::sides`].
    pub fn faces(&self) -> Vec<([u32; 4], u32)> {
        self.scratch.faces.sorted()
    }

    pub fn restore_faces(&mut self, faces: &[([u32; 4], u32)]) {
        self.scratch.faces.restore(faces);
    }

    /// Contacts of some pairs of colliders, sorted as by [`Pairs::all`].
    pub fn some(&mut self, finder: &Finder, pairs: &[[u32; 2]], out: &mut Detection) {
        let mut sorted = pairs.to_vec();
        sorted.sort_unstable();
        sorted.dedup();
        let names = &finder.leaves.names;
        self.scratch.ties.clear();
        for slots in sorted {
            let mut group = Group::default();
            for row in self.rows.between(slots, names) {
                finder.contacts(row.leaves, &mut group, &mut self.scratch, out);
            }
        }
        finder.break_ties(&self.scratch.ties, &mut out.contacts);
    }
}

/// Start of the contacts of the present pair of colliders in the output, if either has several
/// parts.
#[derive(Default)]
struct Group {
    slots: [u32; 2],
    start: usize,
}

impl Group {
    fn start(&mut self, sides: [&Leaf; 2], out: &Detection) -> usize {
        let slots = sides.map(|leaf| leaf.slot);
        if slots != self.slots {
            *self = Group {
                slots,
                start: out.contacts.len(),
            };
        }
        self.start
    }
}

/// Pairs of bodies whose joint disables contacts between them, smaller number first.
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

/// How the narrow phase treats a pair of parts.
#[derive(Default)]
struct Terms {
    /// The parts do not push each other; a handler gets events.
    events_only: bool,
    /// A hook modifies their contacts.
    modified: bool,
    /// A side's segments are cells, see [`SurfaceLaw::cells`].
    cells: bool,
    /// The side whose segments are cells of a foundation.
    foundation: Option<usize>,
    /// A surface has a [`SurfaceLaw`].
    own_law: bool,
}

/// Everything that the narrow phase reads.
pub(super) struct Finder<'a> {
    pub colliders: &'a Colliders,
    pub leaves: &'a Leaves,
    pub apart: &'a Apart,
    pub hooks: Hooks<'a>,
    pub present: &'a [Present],
    pub span: Span,
    /// Length of the step \[s\]; the span may look farther ahead.
    pub step: f64,
    /// Whether the parts are at the midpoint of a step: half a step ago they were where their
    /// velocities take them back.
    pub midpoint: bool,
    /// Whether the parts are somewhere within a step, with velocities of that time.
    pub within: bool,
}

impl Finder<'_> {
    /// Adds the contacts of a pair; `group` is the state of the pairs before.
    ///
    /// Returns a lower bound of the gap \[m\]; `None` if no kernel was called.
    fn contacts(
        &self,
        leaves: [u32; 2],
        group: &mut Group,
        scratch: &mut Scratch,
        out: &mut Detection,
    ) -> Option<f64> {
        let sides = leaves.map(|leaf| self.leaves.get(leaf));
        let bodies = sides.map(|leaf| self.present(leaf));
        let plain = sides.iter().all(|leaf| leaf.surface.plain) && self.apart.is_empty();
        let moving = bodies
            .iter()
            .any(|body| body.kind == RigidBodyType::Dynamic);
        let immovable = bodies.iter().all(|body| body.immovable && !body.asleep);
        let sizes = sides.map(|leaf| leaf.surface.size);
        let reach = self.span.reach(bodies, sizes);
        if !(plain && moving && !immovable) {
            let terms = self.terms(sides)?;
            return self.contacts_on(&terms, leaves, sides, reach, group, scratch, out);
        }
        let (poses, parts) = (sides.map(|leaf| &leaf.pose), sides.map(|leaf| &leaf.part));
        let sight = self.sight(leaves, sides, bodies, &scratch.faces);
        let found = &mut scratch.touches;
        found.clear();
        let bound = touches(poses, parts, &sight, reach, found);
        if bound.is_none() {
            return self.contacts_on(&Terms::default(), leaves, sides, reach, group, scratch, out);
        }
        if out.wants_near
            && let Some(bound) = bound.filter(|bound| self.within || *bound <= reach)
        {
            let setting = self.plain_setting(sides);
            if let Some(near) = self.near(&setting, bodies, bound) {
                out.add_near(near);
            }
        }
        let met = self.meet_fast(sides, bodies, found);
        if self.midpoint
            && !met
            && let Some(bound) = bound
        {
            self.meet_in_flight(sides, bodies, (bound, reach), found);
        }
        if !found.is_empty() && !met && (self.midpoint || self.within) {
            self.meet_moving(sides, bodies, reach, found);
        }
        if self.midpoint
            && let Some(bound) = bound
        {
            let near = (found.as_slice(), bound);
            self.remember_sides(leaves, sides, bodies, near, &sight, &mut scratch.faces);
        }
        if !found.is_empty() {
            let setting = self.plain_setting(sides);
            let next = out.contacts.len();
            self.give(setting, sides, &Terms::default(), group, found, out);
            if out.contacts.len() == next + found.len() {
                let tie = self.tie(sides, leaves, &setting, found, next);
                scratch.ties.extend(tie);
            }
        }
        bound
    }

    /// Whether two parts are certainly too far apart to meet in this step, whatever their terms.
    fn out_of_reach(&self, leaves: [u32; 2], found: &mut Vec<Touch>) -> bool {
        let sides = leaves.map(|leaf| self.leaves.get(leaf));
        let bodies = sides.map(|leaf| self.present(leaf));
        let reach = self.span.reach(bodies, sides.map(|leaf| leaf.surface.size));
        let (poses, parts) = (sides.map(|leaf| &leaf.pose), sides.map(|leaf| &leaf.part));
        found.clear();
        match touches(poses, parts, &Sight::default(), reach, found) {
            Some(_) => found.is_empty(),
            // only parry knows the gap of this pair
            None => {
                let [a, b] = sides.map(|leaf| shapes::extent(&leaf.part, &leaf.pose));
                (0..2).any(|k| a[k] > b[k + 2] + reach || b[k] > a[k + 2] + reach)
            }
        }
    }

    /// [`Finder::contacts`] without the fast path: all terms, all shapes.
    #[allow(clippy::too_many_arguments)]
    #[inline(never)]
    fn contacts_on(
        &self,
        terms: &Terms,
        leaves: [u32; 2],
        sides: [&Leaf; 2],
        reach: f64,
        group: &mut Group,
        scratch: &mut Scratch,
        out: &mut Detection,
    ) -> Option<f64> {
        let bodies = sides.map(|leaf| self.present(leaf));
        let sight = self.sight(leaves, sides, bodies, &scratch.faces);
        let found = &mut scratch.touches;
        let (poses, parts) = (sides.map(|leaf| &leaf.pose), sides.map(|leaf| &leaf.part));
        found.clear();
        let cell = terms.foundation;
        let pressed = cell.and_then(|cell| cell_touches(poses, parts, cell, reach, found));
        if let Some(bound) = pressed.or_else(|| touches(poses, parts, &sight, reach, found)) {
            let met = pressed.is_some() || self.meet_fast(sides, bodies, found);
            if self.midpoint && !met {
                self.meet_in_flight(sides, bodies, (bound, reach), found);
            }
            if !met && (self.midpoint || self.within) {
                self.meet_moving(sides, bodies, reach, found);
            }
            if self.midpoint {
                let near = (found.as_slice(), bound);
                self.remember_sides(leaves, sides, bodies, near, &sight, &mut scratch.faces);
            }
            if terms.events_only {
                let least = found.iter().map(|t| t.gap).reduce(f64::min);
                scratch.event_contacts.extend(least.map(|gap| EventContact {
                    colliders: sides.map(|leaf| leaf.surface.handle),
                    gap,
                }));
                return Some(bound);
            }
            let covered = match terms.cells {
                true => self.covered(poses, sides, reach, found),
                false => None,
            };
            if out.wants_near && !terms.modified && !terms.cells && (self.within || bound <= reach)
            {
                let setting = self.setting(sides, terms, covered);
                if let Some(near) = self.near(&setting, bodies, bound) {
                    out.add_near(near);
                }
            }
            if terms.modified {
                let known = self.known(sides)?;
                let order = Row::order(leaves, &self.leaves.names);
                let mut mark = scratch.marks.get(&order);
                let none = found.is_empty();
                if none && mark == 0 {
                    return Some(bound);
                }
                let mut setting = self.setting(sides, terms, covered);
                let subs = sides.map(|leaf| leaf.sub);
                let hooks = self.hooks;
                let left = hooks.modify(known, poses, subs, found, &mut setting, &mut mark);
                scratch.marks.set(order, if none { 0 } else { mark });
                for (touch, speed) in left {
                    found.clear();
                    found.push(touch);
                    let belt = setting.belt - speed;
                    self.give(Pair { belt, ..setting }, sides, terms, group, found, out);
                }
            } else if !found.is_empty() {
                let setting = self.setting(sides, terms, covered);
                self.give(setting, sides, terms, group, found, out);
            }
            return Some(bound);
        }
        if terms.events_only {
            return None;
        }
        // only shapes with a kernel support hooks that modify contacts; user-defined shapes have
        // none
        let setting = self.setting(sides, terms, None);
        self.ask_parry(sides, setting, reach, group, terms.cells, out);
        Some(f64::NEG_INFINITY)
    }

    /// The terms of two parts of which one is not plain; `None` if they do not meet.
    fn terms(&self, sides: [&Leaf; 2]) -> Option<Terms> {
        let known = self.known(sides)?;
        if !self.may_touch(sides, known) {
            return None;
        }
        let events_only = !self.may_push(sides, known);
        let heard = known[0].events() | known[1].events();
        if events_only && !heard.contains(ActiveEvents::COLLISION_EVENTS) {
            return None;
        }
        let hooks = known[0].hooks() | known[1].hooks();
        Some(Terms {
            events_only,
            modified: hooks.contains(ActiveHooks::MODIFY_SOLVER_CONTACTS),
            cells: known.iter().any(|k| k.law.cells),
            foundation: (0..2).find(|&i| known[i].law.is_foundation()),
            own_law: known.iter().any(|k| k.law != SurfaceLaw::default()),
        })
    }

    fn known(&self, sides: [&Leaf; 2]) -> Option<[&Known; 2]> {
        let [a, b] = sides.map(|leaf| self.colliders.get(leaf.slot));
        Some([a?, b?])
    }

    pub(super) fn present(&self, leaf: &Leaf) -> &Present {
        present(self.present, leaf.body)
    }

    /// Whether neither side can change and one sleeps: the contacts of that side are stored.
    fn asleep(&self, leaves: [u32; 2]) -> bool {
        let sides = leaves.map(|leaf| self.present(self.leaves.get(leaf)));
        sides.iter().any(|b| b.asleep) && sides.iter().all(|b| b.still)
    }

    fn kinds(&self, sides: [&Leaf; 2]) -> [RigidBodyType; 2] {
        sides.map(|leaf| self.present(leaf).kind)
    }

    /// Whether two colliders may touch at all: rapier's tests in rapier's order.
    fn may_touch(&self, sides: [&Leaf; 2], known: [&Known; 2]) -> bool {
        let [a, b] = sides.map(|leaf| leaf.body);
        !(known[0].is_sensor() || known[1].is_sensor())
            && (self.apart.is_empty() || !self.apart.contains(&[a.min(b), a.max(b)]))
            && known[0].may_meet(known[1], self.kinds(sides))
    }

    /// Whether two colliders may push each other.
    fn may_push(&self, sides: [&Leaf; 2], known: [&Known; 2]) -> bool {
        // a sleeping body can wake
        let still = |leaf: &Leaf| {
            let body = self.present(leaf);
            body.immovable && !body.asleep
        };
        !(still(sides[0]) && still(sides[1]))
            && known[0].may_push(known[1])
            && self.hooks.lets_push(known)
    }

    /// Whether two colliders may make an intersection event.
    fn may_cross(&self, sides: [&Leaf; 2], known: [&Known; 2]) -> bool {
        known[0].may_meet(known[1], self.kinds(sides)) && self.hooks.lets_cross(known)
    }

    fn overlap(&self, sides: [&Leaf; 2], found: &mut Vec<Touch>) -> bool {
        let poses = sides.map(|leaf| &leaf.pose);
        let parts = sides.map(|leaf| &leaf.part);
        found.clear();
        match touches(poses, parts, &Sight::default(), 0.0, found) {
            Some(_) => !found.is_empty(),
            None => DefaultQueryDispatcher
                .intersection_test(
                    &relative(poses[0], poses[1]).to_rapier(),
                    &*shapes::for_parry(&parts[0].core),
                    &*shapes::for_parry(&parts[1].core),
                )
                .is_ok_and(|answer| answer.intersecting),
        }
    }

    /// Length of a segment, across the contact's normal, that lies on the other part \[m\]; `None`
    /// for one-point contacts, as with a ball.
    fn covered(
        &self,
        poses: [&Pose64; 2],
        sides: [&Leaf; 2],
        reach: f64,
        found: &[Touch],
    ) -> Option<f64> {
        let width = |found: &[Touch]| match found {
            [a, b] => Some(a.normal.perp(&(b.point - a.point)).abs()),
            _ => None,
        };
        let [_] = found else {
            return width(found);
        };
        // the other end is beyond the reach
        let mut both = Vec::with_capacity(2);
        let far = reach + sides[0].surface.size.max(sides[1].surface.size);
        let parts = sides.map(|leaf| &leaf.part);
        touches(poses, parts, &Sight::default(), far, &mut both);
        width(&both)
    }

    /// Two parts whose gap is at least `bound` \[m\]; `None` if their law is not rigid.
    fn near(&self, setting: &Pair, bodies: [&Present; 2], bound: f64) -> Option<NearPair> {
        let NormalLaw::Rigid { restitution } = setting.law else {
            return None;
        };
        Some(NearPair {
            surfaces: setting.surfaces,
            bodies: setting.numbers,
            bound,
            radii: bodies.map(|body| body.radius),
            restitution,
        })
    }

    /// The settings that all contacts of two parts without surface laws share.
    fn plain_setting(&self, sides: [&Leaf; 2]) -> Pair {
        let [one, two] = sides.map(|leaf| &leaf.surface);
        Pair {
            numbers: sides.map(|leaf| leaf.body),
            surfaces: sides.map(|leaf| leaf.slot),
            key: pair_key([one.handle, two.handle]),
            law: NormalLaw::Rigid {
                restitution: one.restitution_with(two),
            },
            friction: one.friction_with(two),
            belt: 0.0,
            size: one.size.min(two.size),
            radii: sides.map(|leaf| leaf.part.radius()),
        }
    }

    fn setting(&self, sides: [&Leaf; 2], terms: &Terms, covered: Option<f64>) -> Pair {
        let setting = self.plain_setting(sides);
        let known = if terms.own_law {
            self.known(sides)
        } else {
            None
        };
        let Some(known) = known else {
            return setting;
        };
        let setting = Pair {
            law: known[0].combined_law(known[1]),
            // on side 1 the surface moves along +t, on side 2 along −t
            belt: -known[0].law.speed - known[1].law.speed,
            ..setting
        };
        let cell = (0..2).find(|&i| known[i].law.cells);
        match cell.map(|i| &sides[i].part.core) {
            Some(Core::Edge(edge)) => {
                let length = (edge.ends[1] - edge.ends[0]).norm();
                setting.over(match covered {
                    // each of the two ends has a half; a contact stays one, however little of the
                    // segment it covers
                    Some(covered) => 0.5 * covered.clamp(1e-6 * length, length),
                    None => length,
                })
            }
            _ => setting,
        }
    }

    fn give(
        &self,
        setting: Pair,
        sides: [&Leaf; 2],
        terms: &Terms,
        group: &mut Group,
        found: &[Touch],
        out: &mut Detection,
    ) {
        // at the common end of two cells each has its own share of the load
        if terms.foundation.is_some() || sides.iter().all(|leaf| leaf.lone) {
            let points = found.iter().map(|t| self.point(&setting, sides, t));
            out.contacts.extend(points);
            return;
        }
        let from = group.start(sides, out);
        for touch in found.iter() {
            let old = &out.contacts[from..];
            if !old.iter().any(|p| same_place(p, touch, setting.size)) {
                out.contacts.push(self.point(&setting, sides, touch));
            }
        }
    }

    /// A contact of two parts with kernels.
    #[inline]
    pub(super) fn point(&self, setting: &Pair, sides: [&Leaf; 2], touch: &Touch) -> ContactPoint {
        let bodies = sides.map(|leaf| self.present(leaf));
        let feature = match sides.iter().all(|leaf| leaf.lone) {
            true => touch.feature.into(),
            false => mix([sides[0].sub, sides[1].sub, touch.feature, 0]),
        };
        setting.point(bodies, touch, places(sides, touch), feature, true)
    }

    fn ask_parry(
        &self,
        sides: [&Leaf; 2],
        setting: Pair,
        reach: f64,
        group: &mut Group,
        one: bool,
        out: &mut Detection,
    ) {
        let poses = sides.map(|leaf| leaf.pose);
        let bodies = sides.map(|leaf| self.present(leaf));
        let shapes = sides.map(|leaf| shapes::for_parry(&leaf.part.core));
        let rounding = sides[0].part.rounding + sides[1].part.rounding;
        let from = group.start(sides, out);
        let mut manifolds: Vec<ContactManifold> = Vec::new();
        // a pair that parry does not support has no contact in rapier either
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
                let on = [sides[0].sub.max(order[0]), sides[1].sub.max(order[1])];
                let on = on.map(SurfacePoint::on);
                let feature = mix([sides[0].sub, sides[1].sub, mix(order) as u32, order[0]]);
                let point = setting.point(bodies, &touch, on, feature, false);
                out.contacts.push(point);
            });
        }
    }
}

fn pair_key(handles: [ColliderHandle; 2]) -> u64 {
    let [(a, of_a), (b, of_b)] = handles.map(|h| h.into_raw_parts());
    mix([a, of_a, b, of_b])
}
