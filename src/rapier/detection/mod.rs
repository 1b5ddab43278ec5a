//! Contact detection in a rapier world.
//!
//! There are two drives, tested to find the same contacts. [`DetectionDrive::Tree`] puts every part
//! of a collider as a leaf into a grid of fat bounding boxes. It stores the pairs of leaves whose
//! fat boxes overlap, sorted, and runs the narrow phase on a pair only when its two sides may have
//! come close. [`DetectionDrive::Exhaustive`] stores nothing and tests every part against every
//! other. Gaps come from `f64` kernels (accurate to 1e-15 m; 1e-13 m a kilometre from the origin).
//! Shapes without a kernel (user-defined shapes) use parry, at relative poses computed in
//! `f64` and never from a recycled manifold (accurate to 3e-7 m for 1 m shapes).
//!
//! rapier's own broad and narrow phase are not used: they would cost as much as rapier's step, and
//! they recycle manifolds while a pair moves by up to a millimetre.

mod beds;
mod chains;
mod colliders;
mod couple;
mod covers;
mod driven;
mod ends;
mod exhaustive;
mod flights;
mod grid;
mod hooks;
mod leaves;
mod loops;
mod marks;
mod narrow;
mod output;
mod pairs;
mod points;
mod rows;
mod scratch;
mod seams;
mod settings;
mod shapes;
mod sides;
mod span;
mod sweeps;
mod terms;
mod ties;

use super::bodies::Bodies;
use super::engine::prelude::*;
use super::joints::OUTSIDE;
use crate::contact::{Vec2, Vec3};
use crate::dynamics::{Detection, ModelError};
use crate::threads::Threads;
use colliders::{Colliders, Known};
use covers::Covers;
use grid::Grid;
pub(super) use hooks::Hooks;
use leaves::{Leaf, Leaves};
use pairs::{Finder, Pairs};
use rustc_hash::FxHashSet;
pub(super) use scratch::EventContact;
use serde::{Deserialize, Serialize};
use span::Span;
use terms::{Apart, apart};

/// How detection finds the pairs of colliders that are near each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DetectionDrive {
    /// A grid of boxes that reuses the results of the steps before.
    #[default]
    Tree,
    /// Tests every part against every other. The reference, at a cost that grows with the square of
    /// the number of parts.
    Exhaustive,
}

/// Properties of a surface that rapier's collider cannot store.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct SurfaceLaw {
    /// Kelvin-Voigt stiffness \[N/m\] and damping [N s/m] of each contact point, in place of
    /// rigidity and restitution. Two compliant surfaces act in series. With `cells` both are per
    /// metre of the segment that the other shape covers: a Winkler foundation.
    pub compliance: Option<(f64, f64)>,
    /// Tangential speed of the surface \[m/s\], positive counter-clockwise round the collider: a
    /// belt whose top runs to −x has a positive speed.
    pub speed: f64,
    /// The segments of this polyline are cells: a compliant contact with a segment has a point at
    /// either end of what the other shape covers, with half of its length each, whatever the
    /// neighbours report; the two together carry a pressure that is linear along the cell. A ball
    /// has one point, for the whole segment. Compliant cells of one-sided polylines are pressed along
    /// their own normal. They may overlap with another polyline as far as the segments of both are
    /// long, and not past the middles of both solids.
    pub cells: bool,
}

impl SurfaceLaw {
    /// Whether the segments of the surface are cells with springs along their normals.
    fn is_foundation(&self) -> bool {
        self.cells && self.compliance.is_some()
    }
}

/// State that detection keeps from step to step.
#[derive(Default)]
pub(super) struct Detector {
    drive: DetectionDrive,
    colliders: Colliders,
    leaves: Leaves,
    grid: Grid,
    pairs: Pairs,
    apart: Apart,
    covers: Covers,
    /// Numbering of the bodies that the leaves refer to.
    numbering: Option<u64>,
    /// Span of the last full pass.
    span: Span,
    /// Per body, in this step.
    present: Vec<Present>,
    /// How far the last full pass has looked for each body because of its own motion \[m\].
    looked: Vec<f64>,
    /// Counts the changes of surface laws.
    laws: u64,
    /// The threads that share a pass over all pairs.
    threads: Threads,
}

impl Detector {
    pub fn new(drive: DetectionDrive, threads: &Threads) -> Detector {
        Detector {
            drive,
            threads: threads.clone(),
            ..Detector::default()
        }
    }

    pub fn set_threads(&mut self, threads: &Threads) {
        self.threads = threads.clone();
    }

    /// A number that changes with the properties of surfaces; `None` if hooks may change contacts
    /// at any time.
    pub fn revision(&self) -> Option<u64> {
        (!self.colliders.any_hooks()).then_some(self.laws)
    }

    pub fn set_surface(&mut self, collider: ColliderHandle, law: SurfaceLaw) {
        self.laws += 1;
        let slot = collider.into_raw_parts().0;
        let covers = |own: &Colliders| own.get(slot).is_some_and(Known::covers);
        let before = covers(&self.colliders);
        self.colliders.set_surface(collider, law);
        if covers(&self.colliders) != before {
            self.covers.touch_all();
        }
        self.leaves.resurface(slot, &self.colliders);
    }

    pub fn surfaces(&self) -> impl Iterator<Item = (ColliderHandle, SurfaceLaw)> + '_ {
        let all = self.colliders.surfaces.iter();
        all.map(|(handle, law)| (*handle, *law))
    }

    pub fn forget_surface(&mut self, collider: ColliderHandle) {
        self.laws += 1;
        self.colliders.surfaces.remove(&collider);
    }

    /// Finds all contacts at the present poses. `acceleration` \[m/s²\] bounds the acceleration of
    /// every body. `step` is the length of the step \[s\] of whose midpoint they are, if of any. All
    /// contacts that may close within `dt` \[s\] are found, which may be longer.
    ///
    /// # Errors
    /// [`ModelError`] for colliders that use unsupported features.
    pub fn detect(
        &mut self,
        hooks: Hooks,
        bodies: &mut Bodies,
        (acceleration, step): (f64, Option<f64>),
        dt: f64,
        out: &mut Detection,
    ) -> Result<(), ModelError> {
        let world = hooks.world;
        self.sync(world, bodies)?;
        apart(world, bodies, &mut self.apart);
        let known = (&self.colliders, &*bodies);
        self.covers.update(&mut self.leaves, known, &self.apart);
        self.present.clear();
        let all = 0..bodies.list.len() as u32;
        self.present.extend(all.map(|k| Present::of(bodies, k)));
        for (_, joint) in world.impulse_joints.iter() {
            for body in [joint.body1(), joint.body2()] {
                if let Some(k) = bodies.index_of(body) {
                    self.present[k as usize].joints += 1;
                }
            }
        }
        for (body, moved) in self.present.iter_mut().zip(&out.moved) {
            body.way = body.way_of(moved);
        }
        let span = Span::new(&self.present, acceleration, dt);
        self.looked.clear();
        self.looked.extend(self.present.iter().map(|b| span.own(b)));
        self.look_ahead(span);
        self.find_pairs(bodies);
        if self.span.is_split() && !self.fast_are_alone(hooks, bodies) {
            self.look_ahead(self.span.whole());
            self.grid.begin(self.leaves.list.len());
            self.find_pairs(bodies);
        }
        let mut pairs = std::mem::take(&mut self.pairs);
        let finder = Finder {
            midpoint: step.is_some(),
            step: step.unwrap_or(dt),
            alone: pairs.rows.len() == 1,
            ..self.finder(hooks, self.span)
        };
        let grid = (self.drive == DetectionDrive::Tree).then_some(&self.grid);
        pairs.all(&finder, grid, &self.threads, out);
        self.pairs = pairs;
        Ok(())
    }

    fn finder<'a>(&'a self, hooks: Hooks<'a>, span: Span) -> Finder<'a> {
        Finder {
            colliders: &self.colliders,
            leaves: &self.leaves,
            apart: &self.apart,
            hooks: Some(hooks),
            present: &self.present,
            span,
            step: span.dt,
            midpoint: false,
            within: false,
            alone: false,
            covered: [None; 2],
        }
    }

    /// See [`MultibodyModel::reaches`](crate::dynamics::MultibodyModel::reaches).
    pub fn reaches(&self, body: u32, moved: &Vec3) -> bool {
        let known = &self.present[body as usize];
        let way = known.way_of(moved);
        if way <= self.looked[body as usize] {
            return true;
        }
        // what others may drive it, towards the smallest part; its speed is that of an event by now
        let driven = Present {
            speed: 0.0,
            ..*known
        };
        let within = |leaf: &Leaf| way <= self.span.growth(&driven, leaf.surface.size);
        self.leaves.list.iter().flatten().all(within)
    }

    /// Contacts, at the present poses, of pairs that [`Detector::detect`] has found before.
    pub fn detect_pairs(
        &mut self,
        hooks: Hooks,
        bodies: &Bodies,
        wanted: &[[u32; 2]],
        dt: f64,
        out: &mut Detection,
    ) {
        for &slot in wanted.iter().flatten() {
            let body = self.colliders.body(slot, bodies);
            if body != OUTSIDE {
                self.leaves.follow_collider(slot, bodies);
                let known = &mut self.present[body as usize];
                // a body that was fast has driven others in this step, even if it is slow now
                *known = Present {
                    fast: known.fast,
                    joints: known.joints,
                    ..Present::of(bodies, body)
                };
            }
        }
        let mut pairs = std::mem::take(&mut self.pairs);
        let finder = Finder {
            within: true,
            alone: pairs.rows.len() == 1,
            ..self.finder(hooks, self.span.over(dt))
        };
        let grid = (self.drive == DetectionDrive::Tree).then_some(&self.grid);
        pairs.some(&finder, grid, wanted, out);
        self.pairs = pairs;
    }

    /// Pairs of colliders, one of them a sensor, that overlap at the present poses.
    pub fn intersections(&mut self, hooks: Hooks, bodies: &Bodies) -> Vec<[ColliderHandle; 2]> {
        if !self.colliders.any_sensor() {
            return Vec::new();
        }
        self.leaves.follow(bodies);
        let mut pairs = std::mem::take(&mut self.pairs);
        let finder = self.finder(hooks, self.span);
        let found = pairs.intersections(&finder);
        self.pairs = pairs;
        found
    }

    /// See [`Pairs::marks`].
    pub fn marks(&self) -> Vec<([u32; 4], u32)> {
        self.pairs.marks()
    }

    pub fn restore_marks(&mut self, marks: &[([u32; 4], u32)]) {
        self.pairs.restore_marks(marks);
    }

    /// See [`Pairs::faces`].
    pub fn faces(&self) -> Vec<([u32; 4], u32)> {
        self.pairs.faces()
    }

    pub fn restore_faces(&mut self, faces: &[([u32; 4], u32)]) {
        self.pairs.restore_faces(faces);
    }

    /// Contacts that are not solved but for which a handler wants events, with their gap \[m\].
    pub fn event_contacts(&self) -> &[EventContact] {
        self.pairs.event_contacts()
    }

    /// Reads what the user changed about colliders and bodies.
    fn sync(&mut self, world: &PhysicsWorld, bodies: &mut Bodies) -> Result<(), ModelError> {
        let renumbered = self.numbering != Some(bodies.numbering);
        let refreshed = self.colliders.refresh(world, &mut bodies.watch, renumbered);
        let mut gone = FxHashSet::default();
        for k in 0..self.colliders.changed.len() {
            let slot = self.colliders.changed[k];
            for leaf in self.leaves.remove(slot) {
                self.grid.remove(leaf);
                gone.insert(leaf);
            }
        }
        // before the numbers of removed leaves are used again
        if !gone.is_empty() {
            self.pairs.forget(&gone, &self.leaves);
        }
        if renumbered || !self.colliders.changed.is_empty() || !bodies.placed.is_empty() {
            self.covers.touch(&gone);
        }
        if !bodies.placed.is_empty() {
            let placed = bodies.placed.drain(..).filter_map(|h| world.bodies.get(h));
            let own = placed.flat_map(|body| body.colliders());
            self.pairs
                .forget_placed(&own.map(|h| h.into_raw_parts().0).collect());
        }
        for &slot in &self.colliders.changed {
            self.leaves.insert(slot, &self.colliders, bodies);
        }
        if renumbered {
            self.numbering = Some(bodies.numbering);
            self.leaves.renumber(&self.colliders, bodies);
            self.colliders.measure_bodies(bodies);
        } else if !self.colliders.changed.is_empty() {
            self.colliders.measure_bodies(bodies);
        }
        self.grid.begin(self.leaves.list.len());
        refreshed
    }

    /// Sets how far detection looks ahead in this step.
    fn look_ahead(&mut self, span: Span) {
        self.span = span;
        for body in &mut self.present {
            body.fast = span.is_fast(body.speed);
        }
    }

    /// Moves all leaves and finds all pairs within the reach of the span.
    fn find_pairs(&mut self, bodies: &Bodies) {
        match self.drive {
            DetectionDrive::Tree => self.find_near(bodies),
            DetectionDrive::Exhaustive => {
                self.leaves.follow(bodies);
                self.try_all();
            }
        }
    }

    /// Whether no fast body can meet, or is joined to, a slow one that it could push.
    fn fast_are_alone(&mut self, hooks: Hooks, bodies: &Bodies) -> bool {
        let side = |handle| bodies.index_of(handle).unwrap_or(OUTSIDE);
        let mut joints = hooks.world.impulse_joints.iter();
        if joints.any(|(_, joint)| self.drives(side(joint.body1()), side(joint.body2()))) {
            return false;
        }
        let mut pairs = std::mem::take(&mut self.pairs);
        let finder = self.finder(hooks, self.span);
        let alone = pairs.none_meet(&finder, |a, b| self.drives(a, b));
        self.pairs = pairs;
        alone
    }

    /// Whether one of two bodies is fast, and the other slow and movable.
    fn drives(&self, a: u32, b: u32) -> bool {
        let [a, b] = [a, b].map(|body| present(&self.present, body));
        let slow = if a.fast { b } else { a };
        // a sleeping body can wake
        a.fast != b.fast && (!slow.immovable || slow.asleep)
    }

    /// Moves all leaves, and brings the grid and the pairs up to date.
    fn find_near(&mut self, bodies: &Bodies) {
        let (span, leaves) = (self.span, &mut self.leaves);
        let any_foundation = self.colliders.any_foundation();
        for k in 0..leaves.list.len() {
            let Some(leaf) = leaves.follow_one(k, bodies) else {
                continue;
            };
            let body = leaf.body;
            let depth = if any_foundation { leaf.depth() } else { 0.0 };
            let growth = span.growth(present(&self.present, body), leaf.surface.size) + depth;
            let travel = leaves.travel[k];
            leaves.reach(k, growth);
            if self.grid.holds(k, travel, growth) {
                continue;
            }
            let leaf = leaves.get(k as u32);
            let tight = shapes::extent(&leaf.part, &leaf.pose);
            let ahead = span.ahead(bodies, body);
            self.grid.place(k, tight, travel, growth, ahead);
        }
        let (rows, leaves) = (&mut self.pairs.rows, &self.leaves);
        self.grid.pairs(|a, b| rows.add(a, b, &leaves.names));
        rows.sort(&leaves.names);
    }
}

/// The properties of a body that the narrow phase reads, close together in memory.
#[derive(Debug, Clone, Copy)]
struct Present {
    /// Bound of the speed of all its points \[m/s\].
    speed: f64,
    /// Way of its points \[m\] that impacts of the step are known to give it; 0 if none is known.
    way: f64,
    /// Distance of the farthest point from the centre of mass \[m\].
    radius: f64,
    /// Of the centre of mass, and spin.
    velocity: Vec3,
    /// Centre of mass \[m\], and the largest coordinate of its frame's origin \[m\].
    center: Vec2,
    coordinate: f64,
    kind: RigidBodyType,
    /// Asleep or at rest: its contacts with what is still are stored.
    asleep: bool,
    /// No contact can push the body.
    immovable: bool,
    /// The body neither moves nor can be pushed in this step.
    still: bool,
    /// Whether the body has but one part.
    single: bool,
    /// How many joints it has.
    joints: u32,
    /// See [`Span`].
    fast: bool,
}

/// Stands for colliders without a body.
static OUTER: Present = Present {
    speed: 0.0,
    way: 0.0,
    radius: 0.0,
    velocity: Vec3::new(0.0, 0.0, 0.0),
    center: Vec2::new(0.0, 0.0),
    coordinate: 0.0,
    kind: RigidBodyType::Fixed,
    asleep: false,
    immovable: true,
    still: true,
    single: false,
    joints: 0,
    fast: false,
};

impl Present {
    fn of(bodies: &Bodies, k: u32) -> Present {
        let (shadow, u) = (&bodies.list[k as usize], &bodies.velocities[k as usize]);
        Present {
            speed: u.xy().norm() + u.z.abs() * shadow.radius,
            way: 0.0,
            radius: shadow.radius,
            velocity: *u,
            center: shadow.pose.apply(shadow.center),
            coordinate: shadow.pose.translation.amax(),
            kind: shadow.kind,
            asleep: shadow.group != 0 || bodies.rests(k),
            immovable: bodies.inverse_mass[k as usize] == Vec3::zeros() || bodies.rests(k),
            still: bodies.still(k),
            single: shadow.parts == 1,
            joints: 0,
            fast: false,
        }
    }

    /// Bound of the way of its points \[m\] in a displacement.
    fn way_of(&self, moved: &Vec3) -> f64 {
        moved.xy().norm() + moved.z.abs() * self.radius
    }

    /// Bound of the speed at which any two points of two bodies come closer \[m/s\]. A velocity that both
    /// share brings nothing closer.
    fn closing(&self, other: &Present) -> f64 {
        let spin = |body: &Present| body.velocity.z.abs() * body.radius;
        (self.velocity.xy() - other.velocity.xy()).norm() + spin(self) + spin(other)
    }

    /// Velocity of the body's point at a place of the world \[m/s\].
    fn velocity_at(&self, place: Vec2) -> Vec2 {
        let r = place - self.center;
        self.velocity.xy() + self.velocity.z * Vec2::new(-r.y, r.x)
    }
}

fn present(list: &[Present], body: u32) -> &Present {
    // the number outside of the model belongs to no body
    list.get(body as usize).unwrap_or(&OUTER)
}
