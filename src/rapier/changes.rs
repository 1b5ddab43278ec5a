//! What the user changed about colliders since the last step.

use super::engine::prelude::*;
use crate::dynamics::ModelError;

/// A collider as the last scan found it: all properties that a user can change and that matter
/// here.
#[derive(Clone)]
struct Seen {
    handle: ColliderHandle,
    /// Holds a reference, so that a new shape cannot get the same address.
    shape: SharedShape,
    traits: Traits,
    scan: u32,
}

#[derive(Clone, PartialEq)]
struct Traits {
    parent: Option<RigidBodyHandle>,
    place: Pose,
    mass: (Real, Real, Vector),
    skin: Real,
    material: [Real; 2],
    rules: [CoefficientCombineRule; 2],
    groups: [InteractionGroups; 2],
    types: ActiveCollisionTypes,
    hooks: ActiveHooks,
    events: ActiveEvents,
    enabled: bool,
    sensor: bool,
}

/// Finds new, removed, moved, re-shaped, re-massed and switched colliders by comparing all of them:
/// rapier's own modification notes are for its own step.
#[derive(Clone, Default)]
pub(super) struct ColliderWatch {
    seen: Vec<Option<Seen>>,
    known: usize,
    scan: u32,
    /// Result of the last scan: changed or new colliders, and removed ones, each with its body at
    /// that time.
    pub changed: Vec<(ColliderHandle, Option<RigidBodyHandle>)>,
    pub gone: Vec<(ColliderHandle, Option<RigidBodyHandle>)>,
    /// Slots of all colliders that changed, came or went since detection last read this list.
    pub pending: Vec<u32>,
    /// Counts the scans that found changes.
    pub revision: u64,
}

impl ColliderWatch {
    /// Compares all colliders with the last scan.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] names a collider whose pose or shape is not finite. That collider
    /// keeps its former state, and the scan still compares the others.
    pub fn scan(&mut self, colliders: &ColliderSet) -> Result<(), ModelError> {
        self.changed.clear();
        self.gone.clear();
        self.scan = self.scan.wrapping_add(1);
        let (mut met, mut result) = (0, Ok(()));
        for (handle, collider) in colliders.iter() {
            let slot = handle.into_raw_parts().0 as usize;
            if self.seen.len() <= slot {
                self.seen.resize(slot + 1, None);
            }
            let entry = &mut self.seen[slot];
            let old = entry.as_mut().filter(|s| s.handle == handle);
            if let Some(old) = old
                && old.is(collider)
            {
                old.scan = self.scan;
                met += 1;
                continue;
            }
            if let Err(error) = check(handle, collider) {
                if let Some(old) = entry.as_mut().filter(|s| s.handle == handle) {
                    old.scan = self.scan;
                    met += 1;
                }
                result = result.and(Err(error));
                continue;
            }
            if let Some(other) = entry.take() {
                self.known -= 1;
                // a former collider in the same slot, or the same collider before its change
                if other.handle != handle {
                    self.gone.push((other.handle, other.traits.parent));
                } else if other.traits.parent != collider.parent() {
                    self.changed.push((handle, other.traits.parent));
                }
            }
            *entry = Some(Seen::new(handle, collider, self.scan));
            self.known += 1;
            met += 1;
            self.changed.push((handle, collider.parent()));
        }
        if met < self.known {
            for entry in &mut self.seen {
                if let Some(gone) = entry.take_if(|s| s.scan != self.scan) {
                    self.gone.push((gone.handle, gone.traits.parent));
                }
            }
            self.known = met;
        }
        self.revision += u64::from(!self.changed.is_empty() || !self.gone.is_empty());
        let touched = self.changed.iter().chain(&self.gone);
        self.pending
            .extend(touched.map(|(handle, _)| handle.into_raw_parts().0));
        result
    }
}

impl ColliderWatch {
    /// The collider that had this index at the last scan.
    pub fn handle(&self, slot: u32) -> Option<ColliderHandle> {
        Some(self.seen.get(slot as usize)?.as_ref()?.handle)
    }
}

impl Seen {
    fn new(handle: ColliderHandle, collider: &Collider, scan: u32) -> Self {
        Seen {
            handle,
            shape: collider.shared_shape().clone(),
            traits: Traits::of(collider),
            scan,
        }
    }

    fn is(&self, collider: &Collider) -> bool {
        std::sync::Arc::ptr_eq(&self.shape.0, &collider.shared_shape().0)
            && self.traits == Traits::of(collider)
    }
}

impl Traits {
    fn of(collider: &Collider) -> Traits {
        Traits {
            parent: collider.parent(),
            place: place(collider),
            mass: mass(collider),
            skin: collider.contact_skin(),
            material: [collider.friction(), collider.restitution()],
            rules: [
                collider.friction_combine_rule(),
                collider.restitution_combine_rule(),
            ],
            groups: [collider.collision_groups(), collider.solver_groups()],
            types: collider.active_collision_types(),
            hooks: collider.active_hooks(),
            events: collider.active_events(),
            enabled: collider.is_enabled(),
            sensor: collider.is_sensor(),
        }
    }
}

fn place(collider: &Collider) -> Pose {
    *collider
        .position_wrt_parent()
        .unwrap_or_else(|| collider.position())
}

/// Detects a change of mass. The mass of a ball, box or capsule is cheap to compute. For other
/// shapes the density stands in for the mass, so that a change of the inertia alone goes unnoticed.
fn mass(collider: &Collider) -> (Real, Real, Vector) {
    match collider.shape().shape_type() {
        ShapeType::Ball | ShapeType::Cuboid | ShapeType::Capsule => {
            let all = collider.mass_properties();
            (all.inv_mass, all.inv_principal_inertia, all.local_com)
        }
        _ => (collider.density(), 0.0, Vector::ZERO),
    }
}

/// Refuses a collider with invalid numbers, by name.
pub(super) fn check(handle: ColliderHandle, collider: &Collider) -> Result<(), ModelError> {
    let id = handle.into_raw_parts();
    let at = place(collider);
    if !finite(&at) {
        return Err(ModelError::Invalid(format!(
            "collider {} (handle {id:?}): position is ({}, {}) m, must be finite",
            id.0, at.translation.x, at.translation.y
        )));
    }
    let room = collider.shape().compute_local_aabb();
    if room.mins.x == Real::MAX && room.maxs.x == -Real::MAX {
        return Err(ModelError::Invalid(format!(
            "collider {} (handle {id:?}): its shape has no points",
            id.0
        )));
    }
    let ordered = room.mins.x <= room.maxs.x && room.mins.y <= room.maxs.y;
    if !room.mins.is_finite() || !room.maxs.is_finite() || !ordered {
        return Err(ModelError::Invalid(format!(
            "collider {} (handle {id:?}): shape reaches from ({}, {}) to ({}, {}) m, must be finite \
             and ordered",
            id.0, room.mins.x, room.mins.y, room.maxs.x, room.maxs.y
        )));
    }
    let (friction, restitution) = (collider.friction(), collider.restitution());
    let skin = collider.contact_skin();
    let bad = |what: &str| {
        let of = format!("collider {} (handle {id:?})", id.0);
        Err(ModelError::Invalid(format!("{of}: {what}")))
    };
    if !(friction >= 0.0 && friction.is_finite()) {
        return bad(&format!(
            "friction is {friction}, must be finite and at least 0"
        ));
    }
    if !restitution.is_finite() {
        return bad(&format!("restitution is {restitution}, must be finite"));
    }
    if !(skin >= 0.0 && skin.is_finite()) {
        return bad(&format!(
            "contact skin is {skin} m, must be finite and at least 0"
        ));
    }
    let mass = mass(collider);
    if !(mass.0.is_finite() && mass.1.is_finite() && mass.2.is_finite()) {
        return bad("mass or density is not finite");
    }
    Ok(())
}

/// Whether all numbers of a pose are finite.
pub(super) fn finite(pose: &Pose) -> bool {
    pose.translation.is_finite() && (pose.rotation.re + pose.rotation.im).is_finite()
}
