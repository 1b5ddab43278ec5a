//! The reference drive: rapier finds the pairs, parry or our kernels the gaps.
//!
//! All poses are written to the world and rapier's `CollisionPipeline` runs on it. Pairs of balls,
//! boxes and convex polygons get their gaps from `f64` kernels (1e-15 m); all others from parry in
//! `f32` (3e-7 m for 1 m shapes at the origin, 2e-6 m at 10 m, 2e-5 m at 100 m), manifolds always
//! fresh. Costs about what rapier's own detection does. Between steps the world's own query tree and
//! contact graph stand at the last midpoint.

use super::bodies::Bodies;
use super::dispatcher::FreshManifolds;
use super::engine::geometry::{ContactManifold, ContactPair, SolverFlags};
use super::engine::parry::query::PersistentQueryDispatcher;
use super::engine::parry::shape::TypedShape;
use super::engine::prelude::*;
use super::joints::OUTSIDE;
use super::kernels::{Exact, Touch, touches};
use super::points::{Pair, mix, parry_points, same_place, segment_length};
use super::widen;
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use crate::dynamics::{ContactPoint, Detection, ModelError, NormalLaw};
use rustc_hash::FxHashMap;

/// The cell of a contact on a collider without cells.
pub const NO_CELL: u32 = 0;

/// What rapier's collider cannot say about a surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SurfaceLaw {
    /// Kelvin-Voigt stiffness \[N/m\] and damping [N s/m] of each contact point, in place of
    /// rigidity and restitution. Two compliant surfaces act in series. With
    /// `one_point_per_segment` both are per metre of segment length: a Winkler foundation.
    pub compliance: Option<(f64, f64)>,
    /// Speed of the surface along itself \[m/s\], positive counter-clockwise round the collider:
    /// a belt whose top runs to −x has a positive one.
    pub speed: f64,
    /// Keep only the deepest point a segment of this polyline: its segments are cells.
    pub one_point_per_segment: bool,
}

/// A collider's facts in `f64`, kept while rapier's do not change.
#[derive(Clone)]
struct Known {
    handle: ColliderHandle,
    /// Kept alive, so that a new shape cannot come to lie at the same address.
    shape: SharedShape,
    local_seen: Option<Pose>,
    material_seen: (Real, Real),
    local: Pose64,
    exact: Option<Exact>,
    size: f64,
    /// Bounding sphere in the collider's frame.
    sphere: (Vec2, f64),
    friction: f64,
    restitution: f64,
}

/// The reference drive's memory.
#[derive(Default)]
pub(super) struct Detector {
    known: Vec<Option<Known>>,
    pub surfaces: FxHashMap<ColliderHandle, SurfaceLaw>,
    touches: Vec<Touch>,
    /// Of the last full pass.
    span: Span,
    order: Vec<([u32; 4], ContactPoint)>,
}

impl Detector {
    /// Finds all contacts at the present poses; `acceleration` \[m/s²\] bounds that of any body.
    ///
    /// # Errors
    /// [`ModelError`] for colliders that use what is not supported.
    pub fn detect(
        &mut self,
        world: &mut PhysicsWorld,
        bodies: &mut Bodies,
        acceleration: f64,
        dt: f64,
        out: &mut Detection,
    ) -> Result<(), ModelError> {
        self.refresh(world)?;
        self.measure_bodies(world, bodies);
        let bodies = &*bodies;
        let span = Span::new(bodies, acceleration, dt);
        self.span = span;
        world.collision_pipeline.step(
            span.prediction as Real,
            &mut world.islands,
            &mut world.broad_phase,
            &mut world.narrow_phase,
            &mut world.bodies,
            &mut world.colliders,
            &(),
            &(),
        );
        self.order.clear();
        for pair in world.narrow_phase.contact_pairs() {
            if pair.manifolds().iter().any(live) && !joined(world, pair) {
                let manifolds = pair.manifolds().iter().filter(|m| live(m));
                self.pair_points(
                    world,
                    bodies,
                    [pair.collider1, pair.collider2],
                    Some(manifolds),
                    span,
                );
            }
        }
        self.give(out);
        Ok(())
    }

    /// Contacts of pairs that [`Detector::detect`] has found before, at the present poses and
    /// without the world: gaps of exact shapes from our kernels, others from parry.
    pub fn detect_pairs(
        &mut self,
        world: &PhysicsWorld,
        bodies: &Bodies,
        pairs: &[[u32; 2]],
        dt: f64,
        out: &mut Detection,
    ) {
        let span = Span { dt, ..self.span };
        self.order.clear();
        for pair in pairs {
            let known = pair.map(|slot| self.known.get(slot as usize).and_then(Option::as_ref));
            let [Some(k1), Some(k2)] = known else {
                continue;
            };
            let handles = [k1.handle, k2.handle];
            if k1.exact.is_some() && k2.exact.is_some() {
                let none: Option<std::iter::Empty<&ContactManifold>> = None;
                self.pair_points(world, bodies, handles, none, span);
                continue;
            }
            let colliders = handles.map(|h| &world.colliders[h]);
            let poses = [k1, k2].map(|k| k.pose(world, bodies).to_rapier());
            let mut manifolds = Vec::new();
            // parry refuses only pairs that it refused in the full pass as well
            let _ = FreshManifolds.contact_manifolds(
                &poses[0].inv_mul(&poses[1]),
                colliders[0].shape(),
                colliders[1].shape(),
                span.prediction as Real,
                &mut manifolds,
                &mut None,
            );
            let found = manifolds.iter().filter(|m| !m.points.is_empty());
            self.pair_points(world, bodies, handles, Some(found), span);
        }
        self.give(out);
    }

    /// Hands over what was found, in an order of its own: rapier's graph order depends on
    /// history, and a stored state must not.
    fn give(&mut self, out: &mut Detection) {
        self.order.sort_by_key(|(order, p)| (p.surfaces, *order));
        out.contacts.extend(self.order.iter().map(|(_, p)| *p));
    }

    /// Adds the contact points of one pair; `manifolds` are parry's, where the shapes need them.
    fn pair_points<'a>(
        &mut self,
        world: &PhysicsWorld,
        bodies: &Bodies,
        handles: [ColliderHandle; 2],
        manifolds: Option<impl Iterator<Item = &'a ContactManifold>>,
        span: Span,
    ) {
        let (Some(k1), Some(k2)) = (self.look(handles[0]), self.look(handles[1])) else {
            return;
        };
        let (c1, c2) = (&world.colliders[handles[0]], &world.colliders[handles[1]]);
        let numbers = [k1, k2].map(|k| k.body(world, bodies));
        let poses = [k1, k2].map(|k| k.pose(world, bodies));
        let speeds = numbers.map(|b| match b {
            OUTSIDE => 0.0,
            body => speed_bound(bodies, body),
        });
        // what these two can do in a step, or what a neighbour can do to them
        let reach = (1.1 * (speeds[0] + speeds[1]) * span.dt + 2.0 * span.drop)
            .max(span.prediction.min(k1.size.min(k2.size)));
        let setting = Pair {
            numbers,
            surfaces: handles.map(|h| h.into_raw_parts().0),
            key: pair_key(handles),
            law: self.normal_law(handles, combine_restitution(c1, c2, k1, k2)),
            friction: combine_friction(c1, c2, k1, k2),
            // on side 1 the surface runs along +t, on side 2 along −t
            belt: -self.speed(handles[0]) - self.speed(handles[1]),
            size: k1.size.min(k2.size),
        };
        if let (Some(s1), Some(s2)) = (k1.exact.clone(), k2.exact.clone()) {
            let mut found = std::mem::take(&mut self.touches);
            touches(&poses[0], &s1, &poses[1], &s2, reach, &mut found);
            for touch in &found {
                let point = setting.point(bodies, touch, [0, 0], touch.feature.into(), true);
                self.order.push(([0, 0, touch.feature, 0], point));
            }
            self.touches = found;
            return;
        }
        let one = handles.map(|h| {
            self.surfaces
                .get(&h)
                .is_some_and(|s| s.one_point_per_segment)
        });
        let from = self.order.len();
        for manifold in manifolds.into_iter().flatten() {
            let setting = match (one[0], one[1]) {
                (true, _) => setting.over(segment_length(c1, manifold.subshape1)),
                (_, true) => setting.over(segment_length(c2, manifold.subshape2)),
                _ => setting,
            };
            parry_points(manifold, &poses, reach, one[0] || one[1], |touch, order| {
                if self.order[from..]
                    .iter()
                    .any(|(_, p)| same_place(p, &touch, setting.size))
                {
                    return;
                }
                let sub = [order[0], order[1]];
                let point = setting.point(bodies, &touch, sub, mix(order), false);
                self.order.push((order, point));
            });
        }
    }

    fn look(&self, handle: ColliderHandle) -> Option<&Known> {
        self.known
            .get(handle.into_raw_parts().0 as usize)?
            .as_ref()
            .filter(|k| k.handle == handle)
    }

    fn speed(&self, handle: ColliderHandle) -> f64 {
        self.surfaces.get(&handle).map_or(0.0, |s| s.speed)
    }

    fn normal_law(&self, pair: [ColliderHandle; 2], restitution: f64) -> NormalLaw {
        let of = |h| self.surfaces.get(&h).and_then(|s| s.compliance);
        match (of(pair[0]), of(pair[1])) {
            (None, None) => NormalLaw::Rigid { restitution },
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

    /// Farthest point of every body's colliders from its centre of mass: bounds their speed.
    fn measure_bodies(&self, world: &PhysicsWorld, bodies: &mut Bodies) {
        bodies
            .list
            .iter_mut()
            .for_each(|shadow| shadow.radius = 0.0);
        for (handle, collider) in world.colliders.iter() {
            let number = collider.parent().and_then(|h| bodies.index_of(h));
            if let (Some(k), Some(known)) = (number, self.look(handle)) {
                let shadow = &mut bodies.list[k as usize];
                let (centre, radius) = known.sphere;
                let distance = (known.local.apply(centre) - shadow.center).norm();
                shadow.radius = shadow.radius.max(distance + radius);
            }
        }
    }

    /// Takes over what changed about the colliders.
    fn refresh(&mut self, world: &PhysicsWorld) -> Result<(), ModelError> {
        for (handle, collider) in world.colliders.iter() {
            let slot = handle.into_raw_parts().0 as usize;
            if self.known.len() <= slot {
                self.known.resize(slot + 1, None);
            }
            refuse_unsupported(handle, collider)?;
            let shape = collider.shared_shape();
            let local = match collider.parent() {
                Some(_) => collider.position_wrt_parent().copied(),
                None => Some(*collider.position()),
            };
            let material = (collider.friction(), collider.restitution());
            if let Some(known) = &self.known[slot]
                && known.handle == handle
                && std::sync::Arc::ptr_eq(&known.shape.0, &shape.0)
                && known.local_seen == local
                && known.material_seen == material
            {
                continue;
            }
            self.known[slot] = Some(Known {
                handle,
                shape: shape.clone(),
                local_seen: local,
                material_seen: material,
                local: local.map_or(Pose64::new(Vec2::zeros(), 0.0), |p| Pose64::from_rapier(&p)),
                exact: match collider.shape().as_typed_shape() {
                    TypedShape::Ball(b) => Some(Exact::Ball(widen(b.radius))),
                    TypedShape::Cuboid(c) => Some(Exact::Box(Vec2::new(
                        widen(c.half_extents.x),
                        widen(c.half_extents.y),
                    ))),
                    TypedShape::ConvexPolygon(p) => Some(Exact::Polygon(
                        p.points()
                            .iter()
                            .map(|q| Vec2::new(widen(q.x), widen(q.y)))
                            .collect(),
                    )),
                    _ => None,
                },
                size: {
                    let extents = collider.shape().compute_local_aabb().extents();
                    f64::from(extents.x.max(extents.y))
                },
                sphere: {
                    let sphere = collider.shape().compute_local_bounding_sphere();
                    let centre = Vec2::new(sphere.center.x.into(), sphere.center.y.into());
                    (centre, sphere.radius.into())
                },
                friction: widen(material.0),
                restitution: widen(material.1),
            });
        }
        Ok(())
    }
}

impl Known {
    /// The body it belongs to, or [`OUTSIDE`].
    fn body(&self, world: &PhysicsWorld, bodies: &Bodies) -> u32 {
        world.colliders[self.handle]
            .parent()
            .and_then(|h| bodies.index_of(h))
            .unwrap_or(OUTSIDE)
    }

    fn pose(&self, world: &PhysicsWorld, bodies: &Bodies) -> Pose64 {
        match self.body(world, bodies) {
            OUTSIDE => self.local,
            body => bodies.list[body as usize].pose.compose(&self.local),
        }
    }
}

/// How far things can come in a step.
#[derive(Clone, Copy, Default)]
struct Span {
    dt: f64,
    /// By acceleration alone \[m\].
    drop: f64,
    /// Of the fastest two together \[m\].
    prediction: f64,
}

impl Span {
    fn new(bodies: &Bodies, acceleration: f64, dt: f64) -> Span {
        let fastest = (0..bodies.list.len())
            .map(|k| speed_bound(bodies, k as u32))
            .fold(0.0, f64::max);
        let drop = acceleration * dt * dt;
        Span {
            dt,
            drop,
            prediction: 2.0 * (fastest * dt + drop) + 1e-6,
        }
    }
}

fn pair_key(handles: [ColliderHandle; 2]) -> u64 {
    let [(a, of_a), (b, of_b)] = handles.map(|h| h.into_raw_parts());
    mix([a, of_a, b, of_b])
}

fn live(manifold: &ContactManifold) -> bool {
    !manifold.points.is_empty()
        && manifold
            .data
            .solver_flags
            .contains(SolverFlags::COMPUTE_RIGID_IMPULSES)
}

/// Whether a joint between the two bodies switches their contacts off.
fn joined(world: &PhysicsWorld, pair: &ContactPair) -> bool {
    let parent = |h: ColliderHandle| world.colliders.get(h).and_then(|c| c.parent());
    let (Some(a), Some(b)) = (parent(pair.collider1), parent(pair.collider2)) else {
        return false;
    };
    world
        .impulse_joints
        .joints_between(a, b)
        .any(|(_, joint)| !joint.data.contacts_enabled)
}

fn speed_bound(bodies: &Bodies, k: u32) -> f64 {
    let u = &bodies.velocities[k as usize];
    u.xy().norm() + u.z.abs() * bodies.list[k as usize].radius
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

fn combine_friction(c1: &Collider, c2: &Collider, k1: &Known, k2: &Known) -> f64 {
    let rule = c1.friction_combine_rule().max(c2.friction_combine_rule());
    combine(k1.friction, k2.friction, rule).max(0.0)
}

fn combine_restitution(c1: &Collider, c2: &Collider, k1: &Known, k2: &Known) -> f64 {
    let rule = c1
        .restitution_combine_rule()
        .max(c2.restitution_combine_rule());
    combine(k1.restitution, k2.restitution, rule).clamp(0.0, 1.0)
}

fn refuse_unsupported(handle: ColliderHandle, collider: &Collider) -> Result<(), ModelError> {
    let id = handle.into_raw_parts().0;
    let refuse = |what: &str| {
        Err(ModelError::Unsupported(format!(
            "collider {id}: {what} not supported yet"
        )))
    };
    if collider.contact_skin() > 0.0 {
        return refuse("contact skin is");
    }
    if !collider.active_hooks().is_empty() {
        return refuse("physics hooks are");
    }
    if !collider.active_events().is_empty() {
        return refuse("collision and contact-force events are");
    }
    if !collider.friction().is_finite() || collider.friction() < 0.0 {
        return Err(ModelError::Invalid(format!(
            "collider {id}: friction is {}, must be finite and at least 0",
            collider.friction()
        )));
    }
    if !collider.restitution().is_finite() {
        return Err(ModelError::Invalid(format!(
            "collider {id}: restitution is {}, must be finite",
            collider.restitution()
        )));
    }
    Ok(())
}
