//! The user's hooks: rapier's `PhysicsHooks`, called for our contacts.
//!
//! A hook sees the world at the poses of the start of the step, and the contacts at the midpoint,
//! where they are solved. Where the time of impact is computed, the hook is called again for each
//! impact. The value that a hook stores on a pair lasts while the pair has contacts, and the hook
//! sees it once more when there are none.

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

/// The user's hooks and the world that they see. They are called on the caller's thread alone.
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
        let active = known[0].hooks() | known[1].hooks();
        !active.contains(ActiveHooks::FILTER_CONTACT_PAIRS)
            || self
                .hooks
                .filter_contact_pair(&self.pair(known))
                .is_some_and(|flags| flags.contains(SolverFlags::COMPUTE_RIGID_IMPULSES))
    }

    /// Whether the user's filter wants intersection events of two colliders.
    pub(super) fn lets_cross(&self, known: [&Known; 2]) -> bool {
        let active = known[0].hooks() | known[1].hooks();
        !active.contains(ActiveHooks::FILTER_INTERSECTION_PAIR)
            || self.hooks.filter_intersection_pair(&self.pair(known))
    }

    /// Lets the user modify the contacts of two parts. `mark` is the user's value of this pair.
    ///
    /// Returns the remaining contacts, each with the surface speed \[m/s\] that the user sets.
    pub(super) fn modify(
        &self,
        known: [&Known; 2],
        poses: [&Pose64; 2],
        subs: [u32; 2],
        touches: &[Touch],
        setting: &mut Pair,
        mark: &mut u32,
    ) -> Vec<(Touch, f64)> {
        let NormalLaw::Rigid { restitution } = setting.law else {
            // a compliant surface has no restitution to modify
            return touches.iter().map(|t| (*t, 0.0)).collect();
        };
        let (manifold, mut contacts) = as_manifold(known, poses, subs, touches);
        let (mut seen_normal, original) = (manifold.data.normal, manifold.data.normal);
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
        let normal = match seen_normal == original {
            true => None,
            false => Vec2::new(seen_normal.x.into(), seen_normal.y.into()).try_normalize(0.0),
        };
        modified(touches, &contacts, normal)
    }
}

fn real(v: Vec2) -> Vector {
    Vector::new(v.x as Real, v.y as Real)
}

/// The points of both surfaces at a contact.
fn surfaces(touch: &Touch) -> [Vec2; 2] {
    let half = 0.5 * touch.gap * touch.normal;
    [touch.point - half, touch.point + half]
}

/// Contacts of two parts as rapier shows them to a hook.
fn as_manifold(
    known: [&Known; 2],
    poses: [&Pose64; 2],
    subs: [u32; 2],
    touches: &[Touch],
) -> (ContactManifold, SolverContacts) {
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
    (manifold, contacts)
}

/// The contacts that a hook has left in `contacts`, with the surface speeds \[m/s\] that it has set;
/// `normal` is the one that it has set, if any.
fn modified(
    touches: &[Touch],
    contacts: &SolverContacts,
    normal: Option<Vec2>,
) -> Vec<(Touch, f64)> {
    let wide = |v: Vector| Vec2::new(v.x.into(), v.y.into());
    contacts
        .iter()
        .filter_map(|contact| {
            let mut touch = *touches.get(contact.contact_indices()[0] as usize)?;
            // a contact that the user did not change keeps all its digits
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
