//! What is known of every collider, kept while the user does not change it.

use super::super::bodies::Bodies;
use super::super::engine::prelude::*;
use super::super::joints::OUTSIDE;
use super::super::widen;
use super::SurfaceLaw;
use super::shapes::{self, Piece};
use crate::contact::Vec2;
use crate::dynamics::{ModelError, NormalLaw, Pose64};
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// All that a user can change about a collider and that matters to contacts.
#[derive(Clone, PartialEq)]
struct Seen {
    parent: Option<RigidBodyHandle>,
    local: Option<Pose>,
    enabled: bool,
    sensor: bool,
    skin: Real,
    material: [Real; 2],
    rules: [CoefficientCombineRule; 2],
    groups: [InteractionGroups; 2],
    types: ActiveCollisionTypes,
    hooks: ActiveHooks,
    events: ActiveEvents,
}

impl Seen {
    fn of(collider: &Collider) -> Seen {
        let parent = collider.parent();
        Seen {
            parent,
            local: match parent {
                Some(_) => collider.position_wrt_parent().copied(),
                None => Some(*collider.position()),
            },
            enabled: collider.is_enabled(),
            sensor: collider.is_sensor(),
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
        }
    }
}

/// A collider's facts in `f64`.
pub(super) struct Known {
    pub handle: ColliderHandle,
    /// Kept alive, so that a new shape cannot come to lie at the same address.
    shape: SharedShape,
    seen: Seen,
    /// In the body's frame.
    pub local: Pose64,
    pub pieces: Vec<Piece>,
    /// Larger extent \[m\], skin not counted.
    pub size: f64,
    pub friction: f64,
    pub restitution: f64,
    pub law: SurfaceLaw,
    /// Bounding circle in the body's frame.
    circle: (Vec2, f64),
}

impl Known {
    fn new(
        handle: ColliderHandle,
        collider: &Collider,
        seen: Seen,
        law: SurfaceLaw,
    ) -> Result<Known, ModelError> {
        validate(handle, collider)?;
        let shape = collider.shared_shape().clone();
        let local = seen.local;
        let local = local.map_or(Pose64::new(Vec2::zeros(), 0.0), |p| Pose64::from_rapier(&p));
        let extents = shape.compute_local_aabb().extents();
        let sphere = shape.compute_local_bounding_sphere();
        let center = Vec2::new(sphere.center.x.into(), sphere.center.y.into());
        let skin = widen(seen.skin);
        Ok(Known {
            handle,
            pieces: shapes::pieces(&shape, skin),
            local,
            size: f64::from(extents.x.max(extents.y)),
            friction: widen(seen.material[0]),
            restitution: widen(seen.material[1]),
            law,
            circle: (local.apply(center), f64::from(sphere.radius) + skin),
            shape,
            seen,
        })
    }

    pub fn parent(&self) -> Option<RigidBodyHandle> {
        self.seen.parent
    }

    pub fn is_sensor(&self) -> bool {
        self.seen.sensor
    }

    pub fn hooks(&self) -> ActiveHooks {
        self.seen.hooks
    }

    pub fn events(&self) -> ActiveEvents {
        self.seen.events
    }

    /// Whether these two may touch by their groups and the kinds of their bodies, in rapier's
    /// order of questions; a sensor's contacts are none.
    pub fn may_meet(&self, other: &Known, kinds: [RigidBodyType; 2]) -> bool {
        let (a, b) = (&self.seen, &other.seen);
        let types = a.types.test(kinds[0], kinds[1]) || b.types.test(kinds[0], kinds[1]);
        types && a.groups[0].test(b.groups[0])
    }

    /// Whether contacts of these two carry loads, rather than being told of only.
    pub fn may_push(&self, other: &Known) -> bool {
        self.seen.groups[1].test(other.seen.groups[1])
    }

    pub fn combined_friction(&self, other: &Known) -> f64 {
        let rule = self.seen.rules[0].max(other.seen.rules[0]);
        combine(self.friction, other.friction, rule).max(0.0)
    }

    pub fn combined_law(&self, other: &Known) -> NormalLaw {
        match (self.law.compliance, other.law.compliance) {
            (None, None) => {
                let rule = self.seen.rules[1].max(other.seen.rules[1]);
                let e = combine(self.restitution, other.restitution, rule);
                NormalLaw::Rigid {
                    restitution: e.clamp(0.0, 1.0),
                }
            }
            (Some((stiffness, damping)), None) | (None, Some((stiffness, damping))) => {
                NormalLaw::ViscoElastic { stiffness, damping }
            }
            (Some((k1, c1)), Some((k2, c2))) => NormalLaw::ViscoElastic {
                stiffness: k1 * k2 / (k1 + k2),
                damping: if c1 + c2 > 0.0 {
                    c1 * c2 / (c1 + c2)
                } else {
                    0.0
                },
            },
        }
    }
}

fn combine(c1: f64, c2: f64, rule: CoefficientCombineRule) -> f64 {
    match rule {
        CoefficientCombineRule::Average => 0.5 * (c1 + c2),
        CoefficientCombineRule::Min => c1.min(c2),
        CoefficientCombineRule::Multiply => c1 * c2,
        CoefficientCombineRule::Max => c1.max(c2),
        CoefficientCombineRule::ClampedSum => (c1 + c2).clamp(0.0, 1.0),
        CoefficientCombineRule::GeometricMean => (c1 * c2).max(0.0).sqrt(),
    }
}

/// All enabled colliders of a world, by the index of their handle.
#[derive(Default)]
pub(super) struct Colliders {
    list: Vec<Option<Known>>,
    /// What rapier's collider cannot say; set by the user.
    pub surfaces: FxHashMap<ColliderHandle, SurfaceLaw>,
    /// Whether one of them was set since they were last looked at.
    unchecked: bool,
    /// Slots that hold another collider, or another shape, than at the last call.
    pub changed: Vec<u32>,
    met: Vec<bool>,
}

impl Colliders {
    pub fn get(&self, slot: u32) -> Option<&Known> {
        self.list.get(slot as usize)?.as_ref()
    }

    pub fn any_sensor(&self) -> bool {
        self.list.iter().flatten().any(Known::is_sensor)
    }

    pub fn set_surface(&mut self, handle: ColliderHandle, law: SurfaceLaw) {
        self.surfaces.insert(handle, law);
        self.unchecked = true;
        let slot = handle.into_raw_parts().0 as usize;
        if let Some(Some(known)) = self.list.get_mut(slot)
            && known.handle == handle
        {
            known.law = law;
        }
    }

    /// Takes over what the user changed since the last call.
    ///
    /// # Errors
    /// [`ModelError`] for a collider that is not finite or uses what is not supported; it is then
    /// asked again at the next call.
    pub fn refresh(&mut self, world: &PhysicsWorld) -> Result<(), ModelError> {
        if self.unchecked {
            let there = |h: &ColliderHandle| world.colliders.contains(*h);
            for (handle, law) in self.surfaces.iter().filter(|(h, _)| there(h)) {
                validate_law(*handle, law)?;
            }
            self.unchecked = false;
        }
        self.changed.clear();
        self.met.clear();
        self.met.resize(self.list.len(), false);
        for (handle, collider) in world.colliders.iter() {
            let slot = handle.into_raw_parts().0 as usize;
            if self.list.len() <= slot {
                self.list.resize_with(slot + 1, || None);
                self.met.resize(slot + 1, false);
            }
            let seen = Seen::of(collider);
            let runs = |h: RigidBodyHandle| world.bodies.get(h).is_some_and(|b| b.is_enabled());
            if !seen.enabled || seen.parent.is_some_and(|h| !runs(h)) {
                continue;
            }
            self.met[slot] = true;
            if let Some(known) = &self.list[slot]
                && known.handle == handle
                && known.seen == seen
                && Arc::ptr_eq(&known.shape.0, &collider.shared_shape().0)
            {
                continue;
            }
            let law = self.surfaces.get(&handle).copied().unwrap_or_default();
            self.list[slot] = None;
            self.changed.push(slot as u32);
            self.list[slot] = Some(Known::new(handle, collider, seen, law)?);
        }
        for (slot, met) in self.met.iter().enumerate() {
            if !met && self.list[slot].take().is_some() {
                self.changed.push(slot as u32);
            }
        }
        Ok(())
    }

    /// Farthest point of every body's colliders from its centre of mass: bounds their speed.
    pub fn measure_bodies(&self, bodies: &mut Bodies) {
        bodies
            .list
            .iter_mut()
            .for_each(|shadow| shadow.radius = 0.0);
        for known in self.list.iter().flatten() {
            if let Some(k) = known.seen.parent.and_then(|h| bodies.index_of(h)) {
                let shadow = &mut bodies.list[k as usize];
                let (center, radius) = known.circle;
                let distance = (center - shadow.center).norm();
                shadow.radius = shadow.radius.max(distance + radius);
            }
        }
    }

    /// The body of a collider, or [`OUTSIDE`].
    pub fn body(&self, slot: u32, bodies: &Bodies) -> u32 {
        self.get(slot)
            .and_then(|known| known.parent())
            .and_then(|h| bodies.index_of(h))
            .unwrap_or(OUTSIDE)
    }
}

fn validate_law(handle: ColliderHandle, law: &SurfaceLaw) -> Result<(), ModelError> {
    let id = handle.into_raw_parts().0;
    let invalid = |text: String| Err(ModelError::Invalid(format!("collider {id}: {text}")));
    if !law.speed.is_finite() {
        return invalid(format!(
            "surface speed is {} m/s, must be finite",
            law.speed
        ));
    }
    if let Some((stiffness, damping)) = law.compliance
        && !(stiffness >= 0.0
            && damping >= 0.0
            && stiffness + damping > 0.0
            && (stiffness + damping).is_finite())
    {
        return invalid(format!(
            "surface has stiffness {stiffness} N/m and damping {damping} N s/m, must be finite, at \
             least 0 and not both 0"
        ));
    }
    Ok(())
}

fn validate(handle: ColliderHandle, collider: &Collider) -> Result<(), ModelError> {
    let id = handle.into_raw_parts().0;
    let invalid = |text: String| Err(ModelError::Invalid(format!("collider {id}: {text}")));
    if !collider.friction().is_finite() || collider.friction() < 0.0 {
        return invalid(format!(
            "friction is {}, must be finite and at least 0",
            collider.friction()
        ));
    }
    if !collider.restitution().is_finite() {
        return invalid(format!(
            "restitution is {}, must be finite",
            collider.restitution()
        ));
    }
    if !(collider.contact_skin() >= 0.0 && collider.contact_skin().is_finite()) {
        return invalid(format!(
            "contact skin is {} m, must be finite and at least 0",
            collider.contact_skin()
        ));
    }
    let place = match collider.parent() {
        Some(_) => collider.position_wrt_parent(),
        None => Some(collider.position()),
    };
    if place.is_some_and(|p| !p.translation.is_finite() || !p.rotation.re.is_finite()) {
        return invalid("its position is not finite".to_owned());
    }
    let aabb = collider.shape().compute_local_aabb();
    if aabb.mins.x.is_nan() || aabb.mins.y.is_nan() || aabb.maxs.x.is_nan() || aabb.maxs.y.is_nan()
    {
        return invalid("its shape is not finite".to_owned());
    }
    Ok(())
}
