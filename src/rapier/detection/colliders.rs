//! Collider properties, stored until the user changes them.

use super::super::bodies::Bodies;
use super::super::changes::ColliderWatch;
use super::super::engine::prelude::*;
use super::super::joints::OUTSIDE;
use super::super::widen;
use super::SurfaceLaw;
use super::loops::outer_face;
use super::shapes::{self, Piece};
use crate::contact::Vec2;
use crate::dynamics::{ModelError, NormalLaw, Pose64};
use rustc_hash::FxHashMap;

/// The properties that the narrow phase reads of every pair; the leaves have a copy.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    pub handle: ColliderHandle,
    /// Larger extent \[m\], without the skin.
    pub size: f64,
    friction: f64,
    restitution: f64,
    rules: [CoefficientCombineRule; 2],
    /// Whether its segments are cells of a foundation.
    pub foundation: bool,
    /// No sensor, groups, hooks or surface law. Two plain colliders touch unless neither body can
    /// move.
    pub plain: bool,
}

impl Surface {
    fn of(handle: ColliderHandle, collider: &Collider, law: &SurfaceLaw) -> Surface {
        let extents = collider.shape().compute_local_aabb().extents();
        let groups = [collider.collision_groups(), collider.solver_groups()];
        let open = |groups: &InteractionGroups| {
            *groups == InteractionGroups::default() || *groups == InteractionGroups::all()
        };
        Surface {
            handle,
            size: f64::from(extents.x.max(extents.y)),
            friction: widen(collider.friction()),
            restitution: widen(collider.restitution()),
            rules: [
                collider.friction_combine_rule(),
                collider.restitution_combine_rule(),
            ],
            foundation: law.is_foundation(),
            plain: !collider.is_sensor()
                && groups.iter().all(open)
                && collider.active_collision_types() == ActiveCollisionTypes::default()
                && collider.active_hooks().is_empty()
                && *law == SurfaceLaw::default(),
        }
    }

    pub fn friction_with(&self, other: &Surface) -> f64 {
        let rule = self.rules[0].max(other.rules[0]);
        combine(self.friction, other.friction, rule).max(0.0)
    }

    pub fn restitution_with(&self, other: &Surface) -> f64 {
        let rule = self.rules[1].max(other.rules[1]);
        combine(self.restitution, other.restitution, rule).clamp(0.0, 1.0)
    }
}

/// Properties of a collider in `f64`.
pub(super) struct Known {
    pub surface: Surface,
    parent: Option<RigidBodyHandle>,
    groups: [InteractionGroups; 2],
    types: ActiveCollisionTypes,
    hooks: ActiveHooks,
    events: ActiveEvents,
    sensor: bool,
    /// Pose in the body's frame.
    pub local: Pose64,
    pub pieces: Vec<Piece>,
    /// See [`outer_face`].
    pub outer_face: Option<usize>,
    pub law: SurfaceLaw,
    /// Bounding circle in the body's frame.
    circle: (Vec2, f64),
}

impl Known {
    fn new(handle: ColliderHandle, collider: &Collider, law: SurfaceLaw) -> Known {
        let parent = collider.parent();
        let local = match parent {
            Some(_) => collider.position_wrt_parent(),
            None => Some(collider.position()),
        };
        let local = local.map_or(Pose64::new(Vec2::zeros(), 0.0), Pose64::from_rapier);
        let sphere = collider.shape().compute_local_bounding_sphere();
        let center = Vec2::new(sphere.center.x.into(), sphere.center.y.into());
        let skin = widen(collider.contact_skin());
        let pieces = shapes::pieces(collider.shared_shape(), skin);
        Known {
            surface: Surface::of(handle, collider, &law),
            parent,
            groups: [collider.collision_groups(), collider.solver_groups()],
            types: collider.active_collision_types(),
            hooks: collider.active_hooks(),
            events: collider.active_events(),
            sensor: collider.is_sensor(),
            outer_face: outer_face(&pieces),
            pieces,
            local,
            law,
            circle: (local.apply(center), f64::from(sphere.radius) + skin),
        }
    }

    pub fn handle(&self) -> ColliderHandle {
        self.surface.handle
    }

    pub fn parent(&self) -> Option<RigidBodyHandle> {
        self.parent
    }

    pub fn is_sensor(&self) -> bool {
        self.sensor
    }

    pub fn hooks(&self) -> ActiveHooks {
        self.hooks
    }

    pub fn events(&self) -> ActiveEvents {
        self.events
    }

    /// Whether nothing comes into it: what lies behind it cannot be touched.
    pub fn covers(&self) -> bool {
        !self.sensor && self.law.compliance.is_none()
    }

    /// Whether two colliders meet the same others.
    pub fn is_like(&self, other: &Known) -> bool {
        (self.groups, self.types) == (other.groups, other.types)
    }

    /// Whether two colliders may touch by their groups and the kinds of their bodies, in rapier's
    /// order of tests. Sensors do not count as touching.
    pub fn may_meet(&self, other: &Known, kinds: [RigidBodyType; 2]) -> bool {
        let types = [self.types, other.types];
        types.iter().any(|t| t.test(kinds[0], kinds[1])) && self.groups[0].test(other.groups[0])
    }

    /// Whether contacts of two colliders are solved, rather than reported as events only.
    pub fn may_push(&self, other: &Known) -> bool {
        self.groups[1].test(other.groups[1])
    }

    pub fn combined_law(&self, other: &Known) -> NormalLaw {
        match (self.law.compliance, other.law.compliance) {
            (None, None) => NormalLaw::Rigid {
                restitution: self.surface.restitution_with(&other.surface),
            },
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
    /// Properties that rapier's collider cannot store; set by the user.
    pub surfaces: FxHashMap<ColliderHandle, SurfaceLaw>,
    /// Whether a surface law was set since the last check.
    unchecked: bool,
    /// Slots whose collider or shape is not the one of the last call.
    pub changed: Vec<u32>,
}

impl Colliders {
    pub fn get(&self, slot: u32) -> Option<&Known> {
        self.list.get(slot as usize)?.as_ref()
    }

    pub fn any_sensor(&self) -> bool {
        self.list.iter().flatten().any(Known::is_sensor)
    }

    pub fn any_hooks(&self) -> bool {
        let mut all = self.list.iter().flatten();
        all.any(|known| !known.hooks().is_empty())
    }

    pub fn any_foundation(&self) -> bool {
        self.surfaces.values().any(SurfaceLaw::is_foundation)
    }

    pub fn set_surface(&mut self, handle: ColliderHandle, law: SurfaceLaw) {
        self.surfaces.insert(handle, law);
        self.unchecked = true;
        let slot = handle.into_raw_parts().0 as usize;
        if let Some(Some(known)) = self.list.get_mut(slot)
            && known.handle() == handle
        {
            known.law = law;
            known.surface.plain &= law == SurfaceLaw::default();
            known.surface.foundation = law.is_foundation();
        }
    }

    /// Reads the changes that `watch` has found since the last call; `all` reads all colliders, for
    /// when bodies may have been disabled too.
    ///
    /// # Errors
    /// [`ModelError`] for a surface law that is not finite; nothing is read then.
    pub fn refresh(
        &mut self,
        world: &PhysicsWorld,
        watch: &mut ColliderWatch,
        all: bool,
    ) -> Result<(), ModelError> {
        self.changed.clear();
        if self.unchecked {
            let there = |h: &ColliderHandle| world.colliders.contains(*h);
            for (handle, law) in self.surfaces.iter().filter(|(h, _)| there(h)) {
                validate_law(*handle, law)?;
            }
            self.unchecked = false;
        }
        if all {
            for slot in 0..self.list.len() as u32 {
                let collider = watch.handle(slot).and_then(|h| world.colliders.get(h));
                if collider.is_some_and(|c| runs(c, world)) != self.get(slot).is_some() {
                    watch.pending.push(slot);
                }
            }
        }
        watch.pending.sort_unstable();
        watch.pending.dedup();
        for slot in watch.pending.drain(..) {
            self.changed.push(slot);
            let k = slot as usize;
            if self.list.len() <= k {
                self.list.resize_with(k + 1, || None);
            }
            self.list[k] = None;
        }
        for &slot in &self.changed {
            let Some(handle) = watch.handle(slot) else {
                continue;
            };
            if let Some(collider) = world.colliders.get(handle).filter(|c| runs(c, world)) {
                let law = self.surfaces.get(&handle).copied().unwrap_or_default();
                self.list[slot as usize] = Some(Known::new(handle, collider, law));
            }
        }
        Ok(())
    }

    /// Distance of the farthest collider point from each body's centre of mass, which bounds point
    /// speeds, and the number of its parts.
    pub fn measure_bodies(&self, bodies: &mut Bodies) {
        for shadow in &mut bodies.list {
            (shadow.radius, shadow.parts) = (0.0, 0);
        }
        for known in self.list.iter().flatten() {
            if let Some(k) = known.parent.and_then(|h| bodies.index_of(h)) {
                let shadow = &mut bodies.list[k as usize];
                let (center, radius) = known.circle;
                let distance = (center - shadow.center).norm();
                shadow.radius = shadow.radius.max(distance + radius);
                shadow.parts += known.pieces.len();
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

/// Whether a collider and its body are enabled.
fn runs(collider: &Collider, world: &PhysicsWorld) -> bool {
    let body = collider.parent().map(|h| world.bodies.get(h));
    collider.is_enabled() && body.is_none_or(|b| b.is_some_and(|b| b.is_enabled()))
}
