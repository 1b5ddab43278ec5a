//! The user's hooks: rapier's `PhysicsHooks`, asked about our contacts.
//!
//! A hook sees the world at the poses of the start of the step, the contacts at the middle of it,
//! where they are solved. Where impacts are located in time it is asked again for each. What it
//! writes on a pair is kept while the pair has contacts, and shown to it once more without any.

use super::super::engine::geometry::{
    ContactManifold, ContactManifoldData, SolverContact, SolverContacts, SolverFlags,
};
use super::super::engine::prelude::*;
use super::super::kernels::Touch;
use super::super::widen;
use super::colliders::Known;
use super::points::Pair;
use crate::contact::Vec2;
use crate::dynamics::{NormalLaw, Pose64};
use crate::rapier::parry::query::TrackedContact;
use crate::rapier::parry::shape::PackedFeatureId;

/// Who is asked, and about which world.
#[derive(Clone, Copy)]
pub(in crate::rapier) struct Hooks<'a> {
    pub hooks: &'a dyn PhysicsHooks,
    pub world: &'a PhysicsWorld,
}

impl Hooks<'_> {
    fn pair<'b>(&'b self, known: [&Known; 2]) -> PairFilterContext<'b> {
        PairFilterContext {
            bodies: &self.world.bodies,
            colliders: &self.world.colliders,
            collider1: known[0].handle(),
            collider2: known[1].handle(),
            rigid_body1: known[0].parent(),
            rigid_body2: known[1].parent(),
        }
    }

    /// Whether the user's filter lets two colliders push each other.
    pub(super) fn lets_push(&self, known: [&Known; 2]) -> bool {
        let asked = known[0].hooks() | known[1].hooks();
        !asked.contains(ActiveHooks::FILTER_CONTACT_PAIRS)
            || self
                .hooks
                .filter_contact_pair(&self.pair(known))
                .is_some_and(|flags| flags.contains(SolverFlags::COMPUTE_RIGID_IMPULSES))
    }

    /// Whether the user's filter wants to know of two colliders that cross.
    pub(super) fn lets_cross(&self, known: [&Known; 2]) -> bool {
        let asked = known[0].hooks() | known[1].hooks();
        !asked.contains(ActiveHooks::FILTER_INTERSECTION_PAIR)
            || self.hooks.filter_intersection_pair(&self.pair(known))
    }

    /// Lets the user change the contacts of two parts. `mark` is what the user wrote on this pair.
    ///
    /// Returns what is left of them, each with the speed \[m/s\] that the user gives its surface.
    pub(super) fn modify(
        &self,
        known: [&Known; 2],
        poses: [&Pose64; 2],
        subs: [u32; 2],
        touches: &[Touch],
        setting: &mut Pair,
        mark: &mut u32,
    ) -> Vec<(Touch, f64)> {
        let real = |v: Vec2| Vector::new(v.x as Real, v.y as Real);
        let surfaces = |t: &Touch| {
            let half = 0.5 * t.gap * t.normal;
            [t.point - half, t.point + half]
        };
        let mut data = ContactManifoldData::default();
        (data.rigid_body1, data.rigid_body2) = (known[0].parent(), known[1].parent());
        data.solver_flags = SolverFlags::COMPUTE_RIGID_IMPULSES;
        let mut manifold = ContactManifold::with_data(subs[0], subs[1], data);
        let normal = touches.first().map_or(Vec2::zeros(), |t| t.normal);
        manifold.data.normal = real(normal);
        let turned = |pose: &Pose64, v: Vec2| {
            real(Vec2::new(
                pose.cos * v.x + pose.sin * v.y,
                pose.cos * v.y - pose.sin * v.x,
            ))
        };
        manifold.local_n1 = turned(poses[0], normal);
        manifold.local_n2 = turned(poses[1], -normal);
        let mut contacts = SolverContacts::new();
        for (i, touch) in touches.iter().enumerate() {
            let [p1, p2] = surfaces(touch);
            manifold.points.push(TrackedContact::new(
                real(poses[0].apply_inverse(p1)),
                real(poses[1].apply_inverse(p2)),
                PackedFeatureId(touch.feature),
                PackedFeatureId(touch.feature),
                touch.gap as Real,
            ));
            contacts.push(SolverContact {
                anchor1: real(p1),
                anchor2: real(p2),
                dist: touch.gap as Real,
                tangent_velocity: Vector::ZERO,
                contact_id: [i as _],
            });
        }
        let NormalLaw::Rigid { restitution } = setting.law else {
            // a compliant surface has no restitution to change
            return touches.iter().map(|t| (*t, 0.0)).collect();
        };
        let (mut seen_normal, given) = (manifold.data.normal, manifold.data.normal);
        let (mut friction, mut bounce) = (setting.friction as Real, restitution as Real);
        let mut context = ContactModificationContext {
            bodies: &self.world.bodies,
            colliders: &self.world.colliders,
            collider1: known[0].handle(),
            collider2: known[1].handle(),
            rigid_body1: known[0].parent(),
            rigid_body2: known[1].parent(),
            contacts: ModifiableContacts::Rigid(ModifiableManifold {
                manifold: &manifold,
                solver_contacts: &mut contacts,
                normal: &mut seen_normal,
                friction: &mut friction,
                restitution: &mut bounce,
                user_data: mark,
            }),
        };
        self.hooks.modify_solver_contacts(&mut context);
        if friction != setting.friction as Real {
            setting.friction = widen(friction).max(0.0);
        }
        if bounce != restitution as Real {
            setting.law = NormalLaw::Rigid {
                restitution: widen(bounce).clamp(0.0, 1.0),
            };
        }
        let normal = match seen_normal == given {
            true => None,
            false => Vec2::new(seen_normal.x.into(), seen_normal.y.into()).try_normalize(0.0),
        };
        let wide = |v: Vector| Vec2::new(v.x.into(), v.y.into());
        contacts
            .iter()
            .filter_map(|contact| {
                let mut touch = *touches.get(contact.contact_indices()[0] as usize)?;
                // what the user left alone keeps its digits
                if contact.dist != touch.gap as Real {
                    touch.gap = widen(contact.dist);
                }
                let [p1, p2] = surfaces(&touch);
                if contact.anchor1 != real(p1) || contact.anchor2 != real(p2) {
                    touch.point = 0.5 * (wide(contact.anchor1) + wide(contact.anchor2));
                }
                touch.normal = normal.unwrap_or(touch.normal);
                let tangent = Vec2::new(-touch.normal.y, touch.normal.x);
                let speed = wide(contact.tangent_velocity).dot(&tangent);
                (touch.gap.is_finite() && speed.is_finite()).then_some((touch, speed))
            })
            .collect()
    }
}
