//! The narrow phase: passes over pairs of parts. The contacts of one pair, see [`super::narrow`].

use super::super::engine::prelude::*;
use super::super::kernels::Part;
use super::colliders::Colliders;
use super::grid::Grid;
use super::hooks::Hooks;
use super::leaves::{Leaf, Leaves};
use super::loops::{forget_loops, forget_placed, keep_loops};
use super::marks::Marks;
use super::output::Group;
use super::rows::{Row, Rows, retain};
use super::scratch::{EventContact, Scratch};
use super::sides::forget_side;
use super::terms::Apart;
use super::{Present, Span, present};
use crate::dynamics::Detection;
use crate::threads::Threads;
use rustc_hash::FxHashSet;

/// All pairs of parts, and the buffers of the narrow phase.
#[derive(Default)]
pub(super) struct Pairs {
    pub rows: Rows,
    scratch: Scratch,
    /// Of the further parts of a pass that several threads share.
    parts: Vec<PassPart>,
    /// Number of contacts of the last pass, for the size of the next.
    contacts: usize,
}

/// What one further part of a pass finds.
#[derive(Default)]
struct PassPart {
    scratch: Scratch,
    out: Detection,
}

/// Way in a step, as a share of the radius, from which on a body moves. Where most do not, a contact costs
/// some 60 ns, less than to share it out.
const MOVES: f64 = 1e-6;
/// Least work of a part of a pass, in contacts: some 100 µs.
const LEAST: usize = 500;

/// Number of pairs out of reach that take as long as one contact.
const FAR: usize = 16;

/// What holds in all of a pass over all pairs.
struct Pass<'a> {
    grid: Option<&'a Grid>,
    /// Whether a hook has stored values.
    marked: bool,
    any_asleep: bool,
}

impl Pairs {
    /// Drops all pairs of these leaves.
    pub fn forget(&mut self, gone: &FxHashSet<u32>, leaves: &Leaves) {
        let Scratch { marks, faces, .. } = &mut self.scratch;
        self.rows.forget(gone, |pair| {
            let order = Row::order(pair, &leaves.names);
            marks.set(order, 0);
            faces.set(order, 0);
            forget_loops(pair.map(|leaf| &leaves.names[leaf as usize]), faces);
        });
        for leaf in gone {
            forget_side(&leaves.names[*leaf as usize], faces);
        }
    }

    pub fn faces_now(&self) -> &Marks {
        &self.scratch.faces
    }

    /// See [`forget_placed`].
    pub fn forget_placed(&mut self, slots: &FxHashSet<u32>) {
        forget_placed(slots, &mut self.scratch.faces);
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
    pub fn all(
        &mut self,
        finder: &Finder,
        grid: Option<&Grid>,
        threads: &Threads,
        out: &mut Detection,
    ) {
        let scratch = &mut self.scratch;
        scratch.event_contacts.clear();
        scratch.ties.clear();
        scratch.suspects.clear();
        scratch.marks.begin();
        if finder.midpoint {
            scratch.faces.begin();
        }
        // a pair with a stored value goes to the hook once more when it has no contacts
        let pass = Pass {
            grid,
            marked: scratch.marks.any_past(),
            any_asleep: finder.present.iter().any(|body| body.asleep),
        };
        let before = out.contacts.len();
        let moving = finder
            .present
            .iter()
            .filter(|body| body.speed * finder.step > MOVES * body.radius);
        let most =
            match pass.marked || !finder.midpoint || 2 * moving.count() < finder.present.len() {
                true => 1,
                false => (self.rows.len() / FAR + self.contacts) / LEAST,
            };
        let ends = threads.split(self.rows.len(), most);
        if ends.is_empty() || finder.colliders.any_hooks() {
            let mut group = Group::default();
            (self.rows).retain(|pair, budget| {
                finder.visit(&pass, pair, budget, &mut group, &mut self.scratch, out)
            });
        } else {
            self.share_out(&pass, finder, threads, &ends, out);
        }
        finder.look_at_seams((&self.rows, grid), &mut self.scratch, out);
        self.contacts = out.contacts.len() - before;
        self.scratch.marks.end();
        self.scratch.faces.end();
        finder.break_ties(&self.scratch.ties, &mut out.contacts);
    }

    /// [`Pairs::all`] in parts, for the threads to share: each finds the contacts of its pairs, which
    /// are then put together in order.
    fn share_out(
        &mut self,
        pass: &Pass,
        finder: &Finder,
        threads: &Threads,
        ends: &[usize],
        out: &mut Detection,
    ) {
        self.parts.resize_with(ends.len() - 1, PassPart::default);
        for part in &mut self.parts {
            part.scratch.begin_part(&self.scratch);
            part.out.wants_near = out.wants_near;
        }
        let slices = self.rows.split(ends, &finder.leaves.names);
        let lengths: Vec<usize> = slices.iter().map(|rows| rows.len()).collect();
        // the first part needs no copy
        let first = std::iter::once((&mut self.scratch, &mut *out));
        let others = self.parts.iter_mut();
        let buffers = first.chain(others.map(|part| (&mut part.scratch, &mut part.out)));
        let copy = finder.without_hooks();
        let kept = threads.map(
            slices.into_iter().zip(buffers).collect(),
            |(rows, (scratch, out))| {
                let (finder, mut group) = (copy(), Group::default());
                retain(rows, |pair, budget| {
                    finder.visit(pass, pair, budget, &mut group, scratch, out)
                })
            },
        );
        self.rows.close_up(lengths.into_iter().zip(kept));
        for part in &mut self.parts {
            self.scratch.end_part(&mut part.scratch, out.contacts.len());
            out.append(&mut part.out);
        }
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
    pub fn some(
        &mut self,
        finder: &Finder,
        grid: Option<&Grid>,
        pairs: &[[u32; 2]],
        out: &mut Detection,
    ) {
        let mut sorted = pairs.to_vec();
        sorted.sort_unstable();
        sorted.dedup();
        let names = &finder.leaves.names;
        self.scratch.ties.clear();
        self.scratch.suspects.clear();
        for slots in sorted {
            let mut group = Group::default();
            for row in self.rows.between(slots, names) {
                finder.contacts(row.leaves, &mut group, &mut self.scratch, out);
            }
        }
        finder.look_at_seams((&self.rows, grid), &mut self.scratch, out);
        finder.break_ties(&self.scratch.ties, &mut out.contacts);
    }
}

/// Everything that the narrow phase reads.
#[derive(Clone, Copy)]
pub(super) struct Finder<'a> {
    pub colliders: &'a Colliders,
    pub leaves: &'a Leaves,
    pub apart: &'a Apart,
    /// `None` if they are not asked: no collider has any.
    pub hooks: Option<Hooks<'a>>,
    pub present: &'a [Present],
    pub span: Span,
    /// Length of the step \[s\]; the span may look farther ahead.
    pub step: f64,
    /// Whether the parts are at the midpoint of a step: half a step ago they were where their
    /// velocities take them back.
    pub midpoint: bool,
    /// Whether the parts are somewhere within a step, with velocities of that time.
    pub within: bool,
    /// Whether there is but one pair of parts: no other contact tells the direction of its own.
    pub alone: bool,
    /// The two parts of the only pair that it is asked for, where others cover them: see [`super::beds`].
    pub covered: [Option<&'a Part>; 2],
}

impl<'a> Finder<'a> {
    /// Makes copies for other threads, where the user's hooks cannot be called.
    fn without_hooks(&self) -> impl Fn() -> Finder<'a> + Sync + use<'a> {
        let (colliders, leaves, apart) = (self.colliders, self.leaves, self.apart);
        let (present, span, step) = (self.present, self.span, self.step);
        let (midpoint, within, alone) = (self.midpoint, self.within, self.alone);
        move || Finder {
            colliders,
            leaves,
            apart,
            hooks: None,
            present,
            span,
            step,
            midpoint,
            within,
            alone,
            covered: [None; 2],
        }
    }
}

impl Finder<'_> {
    /// Visits one pair in a pass over all, see [`retain`].
    #[inline]
    fn visit(
        &self,
        pass: &Pass,
        [a, b]: [u32; 2],
        budget: f64,
        group: &mut Group,
        scratch: &mut Scratch,
        out: &mut Detection,
    ) -> Option<f64> {
        if pass.any_asleep && self.asleep([a, b]) {
            let order = Row::order([a, b], &self.leaves.names);
            scratch.marks.keep(&order);
            scratch.faces.keep(&order);
            if !scratch.faces.is_empty() {
                let names = [a, b].map(|leaf| &self.leaves.names[leaf as usize]);
                keep_loops(names, &mut scratch.faces);
            }
            return Some(budget);
        }
        if let Some(grid) = pass.grid {
            let near = &self.leaves.near;
            let (one, two) = (&near[a as usize], &near[b as usize]);
            if one.reached + two.reached < budget {
                return Some(budget);
            }
            if (grid.moved(a) || grid.moved(b)) && !grid.overlap(a, b) {
                return None;
            }
            if one.apart(two) && !pass.marked {
                return Some(budget);
            }
        }
        let travel = &self.leaves.travel;
        match self.contacts([a, b], group, scratch, out) {
            Some(bound) => Some(travel[a as usize] + travel[b as usize] + bound),
            None => Some(budget),
        }
    }

    pub(super) fn present(&self, leaf: &Leaf) -> &Present {
        present(self.present, leaf.body)
    }

    /// Whether neither side can change and one sleeps: the contacts of that side are stored.
    fn asleep(&self, leaves: [u32; 2]) -> bool {
        let sides = leaves.map(|leaf| self.present(self.leaves.get(leaf)));
        sides.iter().any(|b| b.asleep) && sides.iter().all(|b| b.still)
    }
}
