//! Whether two parts may touch, push or cross each other, and how the narrow phase treats them.

use super::super::bodies::Bodies;
use super::super::engine::prelude::*;
use super::SurfaceLaw;
use super::colliders::Known;
use super::leaves::Leaf;
use super::pairs::Finder;
use rustc_hash::FxHashSet;

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
pub(super) struct Terms {
    /// The parts do not push each other; a handler gets events.
    pub events_only: bool,
    /// A hook modifies their contacts.
    pub modified: bool,
    /// A side's segments are cells, see [`SurfaceLaw::cells`].
    pub cells: bool,
    /// The side whose segments are cells of a foundation.
    pub foundation: Option<usize>,
    /// A surface has a [`SurfaceLaw`].
    pub own_law: bool,
}

impl Finder<'_> {
    /// The terms of two parts of which one is not plain; `None` if they do not meet.
    pub(super) fn terms(&self, sides: [&Leaf; 2]) -> Option<Terms> {
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

    #[inline]
    pub(super) fn known(&self, sides: [&Leaf; 2]) -> Option<[&Known; 2]> {
        let [a, b] = sides.map(|leaf| self.colliders.get(leaf.slot));
        Some([a?, b?])
    }

    fn kinds(&self, sides: [&Leaf; 2]) -> [RigidBodyType; 2] {
        sides.map(|leaf| self.present(leaf).kind)
    }

    /// Whether two colliders may touch at all: rapier's tests in rapier's order.
    fn may_touch(&self, sides: [&Leaf; 2], known: [&Known; 2]) -> bool {
        !known.iter().any(|k| k.is_sensor())
            && !self.is_apart(sides)
            && known[0].may_meet(known[1], self.kinds(sides))
    }

    /// Whether a joint disables the contacts between the bodies of two parts.
    #[inline]
    pub(super) fn is_apart(&self, sides: [&Leaf; 2]) -> bool {
        let [a, b] = sides.map(|leaf| leaf.body);
        !self.apart.is_empty() && self.apart.contains(&[a.min(b), a.max(b)])
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
            && self.hooks.is_none_or(|hooks| hooks.lets_push(known))
    }

    /// Whether two colliders may make an intersection event.
    pub(super) fn may_cross(&self, sides: [&Leaf; 2], known: [&Known; 2]) -> bool {
        known[0].may_meet(known[1], self.kinds(sides))
            && self.hooks.is_none_or(|hooks| hooks.lets_cross(known))
    }
}
