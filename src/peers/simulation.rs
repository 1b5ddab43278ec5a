use super::mass::area_moments;
use super::surfaces::SurfaceHooks;
use crate::checkpoint::{CheckpointError, Reader, Writer};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::Pose64;
use crate::dynamics::record::StepRecord;
use crate::dynamics::{ModelError, StepError};
use crate::oracles::solver_by_name;
use crate::rapier::ExactBody;
use crate::rapier::SurfaceLaw;
use crate::rapier::engine::prelude::*;
use crate::rapier::{MoreauPipeline, MoreauSettings, PipelineState};
use serde::{Deserialize, Serialize};

/// How a body moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    Dynamic,
    Fixed,
    /// At its own constant velocity, whatever it touches.
    Kinematic,
}

/// A shape in the body's frame \[m\].
#[derive(Debug, Clone, PartialEq)]
pub enum ShapeSpec {
    Ball {
        radius: f64,
    },
    Box {
        half: Vec2,
    },
    /// Along x; `half_length` is the distance from the centre to the centres of the round ends.
    Capsule {
        half_length: f64,
        radius: f64,
    },
    /// Convex, counter-clockwise.
    Polygon {
        points: Vec<Vec2>,
    },
    /// One-sided, the solid on the left of its direction.
    Chain {
        points: Vec<Vec2>,
        closed: bool,
    },
    /// Several colliders, each with its pose in the body's frame; none of them a compound.
    Compound(Vec<(Pose64, ShapeSpec)>),
}

impl ShapeSpec {
    /// Area \[m²\]; 0 for a chain that encloses no solid.
    pub fn area(&self) -> f64 {
        area_moments(self).map_or(0.0, |m| m.area)
    }
}

/// The surface of a collider.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    pub friction: f64,
    pub restitution: f64,
    pub law: SurfaceLaw,
    /// Collision groups as bits: the memberships, and the filter.
    pub groups: (u32, u32),
    /// How its friction combines with the other surface's.
    pub friction_rule: PairRule,
    /// How its restitution combines with the other surface's.
    pub restitution_rule: PairRule,
    /// Direction in the body's frame in which the surface pushes, within 0.1 rad, bodies that did
    /// not come through it; `None` pushes in all directions.
    pub one_way: Option<Vec2>,
}

/// How the coefficients of two surfaces make that of the pair. A rule further down prevails over one
/// above it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PairRule {
    /// The mean, rapier's default.
    #[default]
    Mean,
    /// The smaller one, and the larger one: for a surface that has the coefficient of the pair.
    Smaller,
    Larger,
}

impl PairRule {
    /// The rule by which a surface with the coefficient `own` has it towards surfaces with `other` and
    /// [`PairRule::Mean`], whichever is larger.
    pub fn prevails(own: f64, other: f64) -> PairRule {
        match own < other {
            true => PairRule::Smaller,
            false => PairRule::Larger,
        }
    }

    fn to_rapier(self) -> CoefficientCombineRule {
        match self {
            PairRule::Mean => CoefficientCombineRule::Average,
            PairRule::Smaller => CoefficientCombineRule::Min,
            PairRule::Larger => CoefficientCombineRule::Max,
        }
    }
}

impl Default for Surface {
    fn default() -> Self {
        Surface {
            friction: 0.5,
            restitution: 0.0,
            law: SurfaceLaw::default(),
            groups: (u32::MAX, u32::MAX),
            friction_rule: PairRule::Mean,
            restitution_rule: PairRule::Mean,
            one_way: None,
        }
    }
}

/// The inertia of a dynamic body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MassSpec {
    /// Mass per area \[kg/m²\] of its only shape.
    Density(f64),
    /// Mass \[kg\], distributed uniformly over its only shape.
    Spread(f64),
    /// Mass \[kg\] and moment of inertia about the body's origin [kg m²], which is its centre of
    /// mass.
    Given { mass: f64, inertia: f64 },
}

/// A body of a [`Simulation`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct BodyId(pub(super) RigidBodyHandle);

/// A collider of a [`Simulation`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct ColliderId(pub(super) ColliderHandle);

impl ColliderId {
    /// The number that records use for this surface.
    pub fn number(self) -> u32 {
        self.0.into_raw_parts().0
    }
}

/// A rapier world and our pipeline on it, described in `f64`.
///
/// `world` contains everything as ordinary rapier bodies and colliders, so that rapier's own solver
/// can step the same scene ([`Simulation::step_with_rapier`]).
pub struct Simulation {
    pub world: PhysicsWorld,
    pub pipeline: MoreauPipeline,
    /// A fixed body for joints with the world.
    ground: Option<RigidBodyHandle>,
    pub(super) peer_time: f64,
    pub(super) peer_seconds: f64,
    /// Whether a peer's step reads its contacts and energies for the record; otherwise the record is
    /// empty. A clean measurement of its time does nothing else between two steps.
    pub peer_records: bool,
    pub(super) hooks: SurfaceHooks,
}

impl Simulation {
    /// An empty world. `gravity` \[m/s²\], `dt` \[s\].
    ///
    /// # Errors
    /// Those of [`MoreauPipeline::new`].
    pub fn new(
        stepper: crate::dynamics::StepperSettings,
        gravity: Vec2,
        dt: f64,
    ) -> Result<Self, StepError> {
        let mut world = PhysicsWorld::new();
        world.gravity = vector(gravity);
        world.integration_parameters.dt = dt as Real;
        Ok(Simulation {
            world,
            pipeline: MoreauPipeline::with_solvers(
                MoreauSettings {
                    stepper,
                    gravity: Some(gravity),
                    dt: Some(dt),
                    stay_awake: true,
                    ..MoreauSettings::default()
                },
                solver_by_name,
            )?,
            ground: None,
            peer_time: 0.0,
            peer_seconds: 0.0,
            peer_records: true,
            hooks: SurfaceHooks::default(),
        })
    }

    /// Adds a body with its first collider.
    ///
    /// `velocity` is the velocity of the centre of mass, and the spin.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] for a mass that is not positive, or a shape without area for a mass
    /// that is distributed over it.
    pub fn add_body(
        &mut self,
        motion: Motion,
        pose: Pose64,
        velocity: Vec3,
        shape: &ShapeSpec,
        surface: &Surface,
        mass: Option<MassSpec>,
    ) -> Result<(BodyId, ColliderId), ModelError> {
        let builder = match motion {
            Motion::Dynamic => RigidBodyBuilder::dynamic(),
            Motion::Fixed => RigidBodyBuilder::fixed(),
            Motion::Kinematic => RigidBodyBuilder::kinematic_velocity_based(),
        };
        let mut builder = builder.can_sleep(false);
        let mut exact = None;
        if motion == Motion::Dynamic {
            let (body, centre) = exact_mass(shape, mass)?;
            let properties =
                MassProperties::new(vector(centre), body.mass as Real, body.inertia as Real);
            builder = builder.additional_mass_properties(properties);
            exact = Some(body);
        }
        let handle = self.world.bodies.insert(builder);
        let collider = self.add_collider(BodyId(handle), shape, surface)?;
        if let Some(body) = self.world.bodies.get_mut(handle) {
            // rapier computes masses only in its first step: the energy before would be 0
            body.recompute_mass_properties_from_colliders(&self.world.colliders);
        }
        if let Some(exact) = exact {
            self.pipeline.set_exact_mass(handle, exact)?;
        }
        self.pipeline
            .place(&mut self.world, handle, pose, velocity)?;
        Ok((BodyId(handle), collider))
    }

    /// Adds a massless collider to a body, in the body's frame; for a compound, all its parts.
    ///
    /// # Returns
    /// The collider; for a compound, the first one.
    ///
    /// # Errors
    /// [`ModelError::Invalid`] for a polygon that parry cannot make convex, an empty compound, or
    /// an unknown body.
    pub fn add_collider(
        &mut self,
        body: BodyId,
        shape: &ShapeSpec,
        surface: &Surface,
    ) -> Result<ColliderId, ModelError> {
        if !self.world.bodies.contains(body.0) {
            return Err(ModelError::Invalid("the body is not in the world".into()));
        }
        if let ShapeSpec::Compound(parts) = shape {
            let ids: Vec<ColliderId> = parts
                .iter()
                .map(|(place, part)| self.add_part(body, place, part, surface))
                .collect::<Result<_, _>>()?;
            let none = || ModelError::Invalid("a compound needs a part".into());
            return ids.first().copied().ok_or_else(none);
        }
        self.add_part(body, &Pose64::new(Vec2::zeros(), 0.0), shape, surface)
    }

    fn add_part(
        &mut self,
        body: BodyId,
        place: &Pose64,
        shape: &ShapeSpec,
        surface: &Surface,
    ) -> Result<ColliderId, ModelError> {
        let groups = InteractionGroups::new(
            Group::from_bits_truncate(surface.groups.0),
            Group::from_bits_truncate(surface.groups.1),
            InteractionTestMode::And,
        );
        let collider = collider(shape)?
            .position(place.to_rapier())
            .density(0.0)
            .friction(surface.friction as Real)
            .friction_combine_rule(surface.friction_rule.to_rapier())
            .restitution(surface.restitution as Real)
            .restitution_combine_rule(surface.restitution_rule.to_rapier())
            .collision_groups(groups)
            .active_hooks(match surface.one_way {
                Some(_) => ActiveHooks::MODIFY_SOLVER_CONTACTS,
                None => ActiveHooks::empty(),
            });
        let handle = self.world.insert_collider(collider, Some(body.0));
        self.pipeline.set_surface(handle, surface.law);
        if surface.law.speed != 0.0 {
            self.hooks.speeds.insert(handle, surface.law.speed);
        }
        if let Some(direction) = surface.one_way {
            self.hooks.one_way.insert(handle, direction);
        }
        Ok(ColliderId(handle))
    }

    /// rapier's handle of the first collider of a body, for what works on a world.
    pub fn collider(&self, body: BodyId) -> Option<ColliderHandle> {
        self.world.bodies.get(body.0)?.colliders().first().copied()
    }

    /// Replaces what rapier cannot store of a collider's surface; friction and restitution stay.
    pub fn set_law(&mut self, collider: ColliderId, law: SurfaceLaw) {
        self.pipeline.set_surface(collider.0, law);
    }

    /// Makes a body's chains two-sided, like rapier's plain polylines.
    pub fn open_chains(&mut self, body: BodyId) {
        let Some(body) = self.world.bodies.get(body.0) else {
            return;
        };
        for &handle in body.colliders() {
            let Some(collider) = self.world.colliders.get_mut(handle) else {
                continue;
            };
            if let Some(chain) = collider.shape().as_polyline() {
                let (points, edges) = (chain.vertices().to_vec(), chain.indices().to_vec());
                collider.set_shape(SharedShape::polyline(points, Some(edges)));
            }
        }
    }

    /// Sets the gravity scale of a body, and the damping of its velocity and spin [1/s].
    pub fn set_drag(&mut self, body: BodyId, gravity_scale: f64, damping: [f64; 2]) {
        if let Some(body) = self.world.bodies.get_mut(body.0) {
            body.set_gravity_scale(gravity_scale as Real, false);
            body.set_linear_damping(damping[0] as Real);
            body.set_angular_damping(damping[1] as Real);
        }
    }

    /// Sets whether the impacts of a body are located in time, in rapier's step and in ours.
    pub fn set_ccd(&mut self, body: BodyId, on: bool) {
        if let Some(body) = self.world.bodies.get_mut(body.0) {
            body.enable_ccd(on);
        }
    }

    /// Replaces a collider by another, so that rapier keeps no stale contacts.
    ///
    /// # Errors
    /// As [`Simulation::add_collider`]; the old collider then remains.
    pub fn replace_collider(
        &mut self,
        old: ColliderId,
        body: BodyId,
        shape: &ShapeSpec,
        surface: &Surface,
    ) -> Result<ColliderId, ModelError> {
        let new = self.add_collider(body, shape, surface)?;
        self.world.remove_collider(old.0);
        self.pipeline.forget_surface(old.0);
        self.hooks.forget(old.0);
        Ok(new)
    }

    /// Removes a body, its colliders and joints.
    pub fn remove_body(&mut self, body: BodyId) {
        if let Some(body) = self.world.bodies.get(body.0) {
            for &handle in body.colliders() {
                self.pipeline.forget_surface(handle);
                self.hooks.forget(handle);
            }
        }
        self.world.remove_body(body.0);
    }

    /// Makes a kinematic body dynamic, with its present velocity.
    ///
    /// # Errors
    /// As [`Simulation::add_body`].
    pub fn release(
        &mut self,
        body: BodyId,
        shape: &ShapeSpec,
        mass: MassSpec,
    ) -> Result<(), ModelError> {
        let (exact, centre) = exact_mass(shape, Some(mass))?;
        self.pipeline.set_exact_mass(body.0, exact)?;
        if let Some(body) = self.world.bodies.get_mut(body.0) {
            let properties =
                MassProperties::new(vector(centre), exact.mass as Real, exact.inertia as Real);
            body.set_additional_mass_properties(properties, false);
            body.set_body_type(RigidBodyType::Dynamic, false);
            body.recompute_mass_properties_from_colliders(&self.world.colliders);
        }
        Ok(())
    }

    /// The fixed body for joints with the world.
    pub(super) fn ground(&mut self) -> RigidBodyHandle {
        *self
            .ground
            .get_or_insert_with(|| self.world.bodies.insert(RigidBodyBuilder::fixed()))
    }

    /// One nonsmooth step.
    ///
    /// # Errors
    /// [`StepError`].
    pub fn step(&mut self) -> Result<StepRecord, StepError> {
        self.pipeline
            .step_with_events(&mut self.world, &self.hooks, &())
    }

    /// Saves all that the next nonsmooth step depends on.
    ///
    /// # Errors
    /// [`CheckpointError::Write`].
    pub fn save(&self, to: &mut Writer) -> Result<(), CheckpointError> {
        to.put(&self.world)?;
        to.put(&self.pipeline.state_in(&self.world))?;
        to.put(&(self.ground, &self.hooks))
    }

    /// Goes on from what [`Simulation::save`] saved of the same scene, bit for bit, with its own settings.
    ///
    /// # Errors
    /// [`CheckpointError::Read`].
    pub fn load(&mut self, from: &mut Reader) -> Result<(), CheckpointError> {
        self.world = from.take()?;
        let state: PipelineState = from.take()?;
        let state = state.with_settings_of(&self.pipeline);
        let pipeline = MoreauPipeline::resume_with_solvers(&state, &mut self.world, solver_by_name);
        self.pipeline = pipeline.map_err(CheckpointError::unfit)?;
        (self.ground, self.hooks) = from.take()?;
        Ok(())
    }

    /// `f64` pose of a body's frame.
    pub fn pose(&self, body: BodyId) -> Option<Pose64> {
        self.pipeline.pose(body.0)
    }

    /// `f64` velocity of a body's centre of mass, and its spin.
    pub fn velocity(&self, body: BodyId) -> Option<Vec3> {
        self.pipeline.velocity(body.0)
    }

    /// Mass of a body \[kg\]; `None` if it is not in the world.
    pub fn mass(&self, body: BodyId) -> Option<f64> {
        Some(f64::from(self.world.bodies.get(body.0)?.mass()))
    }

    /// The number that records use for a body.
    pub fn number(&self, body: BodyId) -> Option<u32> {
        self.pipeline.number(body.0)
    }
}

pub(super) fn vector(v: Vec2) -> Vector {
    Vector::new(v.x as Real, v.y as Real)
}

fn exact_mass(shape: &ShapeSpec, mass: Option<MassSpec>) -> Result<(ExactBody, Vec2), ModelError> {
    let invalid = |what: &str| ModelError::Invalid(format!("a dynamic body {what}"));
    let moments = area_moments(shape);
    let spread = |mass: f64| {
        let m = moments.ok_or_else(|| invalid("whose shape has no area needs an inertia"))?;
        let body = ExactBody {
            mass,
            inertia: mass * m.polar / m.area,
        };
        Ok((body, m.centroid))
    };
    match mass {
        None => Err(invalid("needs a mass or a density")),
        Some(MassSpec::Given { mass, inertia }) => Ok((ExactBody { mass, inertia }, Vec2::zeros())),
        Some(MassSpec::Spread(mass)) => spread(mass),
        Some(MassSpec::Density(density)) => spread(density * moments.map_or(0.0, |m| m.area)),
    }
}

fn collider(shape: &ShapeSpec) -> Result<ColliderBuilder, ModelError> {
    Ok(match shape {
        ShapeSpec::Ball { radius } => ColliderBuilder::ball(*radius as Real),
        ShapeSpec::Box { half } => ColliderBuilder::cuboid(half.x as Real, half.y as Real),
        ShapeSpec::Capsule {
            half_length,
            radius,
        } => ColliderBuilder::capsule_x(*half_length as Real, *radius as Real),
        ShapeSpec::Polygon { points } => {
            ColliderBuilder::convex_polyline(points.iter().map(|&p| vector(p)).collect())
                .ok_or_else(|| ModelError::Invalid("a polygon is degenerate".into()))?
        }
        ShapeSpec::Chain { points, closed } => {
            let n = points.len() as u32;
            let last = if *closed { n } else { n.saturating_sub(1) };
            let edges: Vec<[u32; 2]> = (0..last).map(|i| [i, (i + 1) % n]).collect();
            if edges.is_empty() {
                return Err(ModelError::Invalid("a chain needs two points".into()));
            }
            let points = points.iter().map(|&p| vector(p)).collect();
            ColliderBuilder::oriented_polyline(points, Some(edges))
        }
        ShapeSpec::Compound(_) => {
            return Err(ModelError::Unsupported(
                "a compound within a compound".into(),
            ));
        }
    })
}
