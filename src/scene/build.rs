//! From a scene file to a world that can be stepped.

use super::joint::WORLD;
use super::overlap::Overlaps;
use super::world::{Built, HandWritten, World};
use super::{Body, BodyKind, Joint, Mass, Model, Scene, Shape, Step, planar};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::{ModelError, MoreauStepper, StepError, StepperSettings};
use crate::oracles::solver_by_name;
use crate::peers::{JointSpec, MassSpec, Motion, ShapeSpec, Simulation, Surface};
use crate::rapier::{Pose64, SurfaceLaw};

impl Step {
    /// The stepper with the settings of `[step]`.
    pub fn stepper(&self) -> StepperSettings {
        StepperSettings {
            scheme: self.scheme,
            events: self.events,
            impact_law: self.impact_law,
            recovery: self.recovery,
            keep_rest: self.keep_rest,
            split_islands: self.split_islands,
            skip_distant: self.skip_distant,
            skip_tangents: self.skip_tangents,
            shares: self.shares,
            effort: self.effort,
            solver: self.solver.clone(),
            tolerance: self.tolerance,
            threads: self.threads,
        }
    }
}

impl Scene {
    /// Builds the world of a scene of bodies and joints, or of a `[linear]` block.
    ///
    /// # Errors
    /// [`StepError`] if rapier cannot represent the scene. A scene that passed its checks fails here
    /// only for shapes that are degenerate in `f32`.
    pub fn build(&self) -> Result<Built, StepError> {
        let stepper = || MoreauStepper::with_solvers(self.step.stepper(), solver_by_name);
        let world = match (self.model(), &self.linear) {
            (Model::Linear, Some(block)) => World::Linear(HandWritten {
                model: block.model()?,
                stepper: stepper()?,
                dt: self.step.dt,
            }),
            (Model::Planar, _) => World::Planar(HandWritten {
                model: planar::build(self)?,
                stepper: stepper()?,
                dt: self.step.dt,
            }),
            _ => self.build_on_rapier()?,
        };
        let rapier = matches!(world, World::Rapier { .. });
        let names = match rapier {
            true => self.bodies.iter().map(|body| body.name.clone()).collect(),
            false => Vec::new(),
        };
        Ok(Built {
            world,
            names,
            overlaps: rapier.then(|| Overlaps::new(&self.bodies, &self.joints, self.step.dt)),
            box2d: None,
        })
    }

    fn build_on_rapier(&self) -> Result<World, StepError> {
        let gravity = Vec2::from(self.gravity);
        let mut simulation = Simulation::new(self.step.stepper(), gravity, self.step.dt)?;
        let mut bodies = Vec::with_capacity(self.bodies.len());
        for body in &self.bodies {
            let what = format!("body {}", body.name);
            let (id, _) = simulation
                .add_body(
                    motion(body.kind),
                    Pose64::new(Vec2::from(body.position), body.angle),
                    Vec3::new(body.velocity[0], body.velocity[1], body.spin),
                    &shape(&body.shape).map_err(|error| named(error, &what))?,
                    &self.surface(body),
                    mass(body),
                )
                .map_err(|error| named(error, &what))?;
            if body.two_sided {
                simulation.open_chains(id);
            }
            simulation.set_drag(id, body.gravity_scale, body.damping);
            simulation.set_ccd(id, body.ccd);
            bodies.push(id);
        }
        for joint in &self.joints {
            let spec = JointSpec {
                shape: joint.shape(),
                bodies: joint.bodies.map(|b| b.map(|k| bodies[k])),
                anchors: self.anchors(joint),
                angles: joint
                    .bodies
                    .map(|b| joint.axis - b.map_or(0.0, |k| self.bodies[k].angle)),
                limits: joint.limits,
                drive: joint.motor.map(|motor| motor.drive()),
                turn: None,
                contacts: joint.contacts,
            };
            let name = |b: Option<usize>| b.map_or(WORLD, |k| &self.bodies[k].name);
            let [a, b] = joint.bodies.map(name);
            let what = || format!("joint {a}-{b}");
            simulation
                .add_joint(&spec)
                .map_err(|error| named(error, &what()))?;
        }
        Ok(World::Rapier {
            simulation: Box::new(simulation),
            bodies,
        })
    }

    /// The joint's points in the frame of each of its bodies \[m\].
    pub(crate) fn anchors(&self, joint: &Joint) -> [Vec2; 2] {
        [0, 1].map(|side| {
            let at = Vec2::from(joint.at[side]);
            match joint.bodies[side] {
                Some(k) => {
                    let b = &self.bodies[k];
                    Pose64::new(Vec2::from(b.position), b.angle).apply_inverse(at)
                }
                None => at,
            }
        })
    }

    fn surface(&self, body: &Body) -> Surface {
        let material = &self.materials[body.material];
        let compliance = material.stiffness.map(|stiffness| {
            let damping = match (material.damping, material.damping_restitution) {
                (Some(damping), _) => damping,
                (None, Some(e)) => {
                    let m = body_mass(body);
                    crate::models::damping_for_restitution(e, stiffness, m)
                }
                (None, None) => 0.0,
            };
            (stiffness, damping)
        });
        Surface {
            friction: material.friction,
            restitution: material.restitution,
            law: SurfaceLaw {
                compliance,
                speed: body.surface_velocity,
                cells: false,
            },
            one_way: body.one_way.map(Vec2::from),
            ..Surface::default()
        }
    }
}

fn named(error: ModelError, name: &str) -> ModelError {
    match error {
        ModelError::Invalid(what) => ModelError::Invalid(format!("{name}: {what}")),
        ModelError::Unsupported(what) => ModelError::Unsupported(format!("{name}: {what}")),
    }
}

fn motion(kind: BodyKind) -> Motion {
    match kind {
        BodyKind::Dynamic => Motion::Dynamic,
        BodyKind::Fixed => Motion::Fixed,
        BodyKind::Kinematic => Motion::Kinematic,
    }
}

/// rapier's shape.
///
/// # Errors
/// [`ModelError::Unsupported`] for shapes that rapier lacks.
fn shape(shape: &Shape) -> Result<ShapeSpec, ModelError> {
    let points = |p: &[[f64; 2]]| p.iter().map(|&p| Vec2::from(p)).collect();
    Ok(match shape {
        Shape::Disc { radius } => ShapeSpec::Ball { radius: *radius },
        Shape::Box { width, height } => ShapeSpec::Box {
            half: Vec2::new(0.5 * width, 0.5 * height),
        },
        Shape::Capsule { length, radius } => ShapeSpec::Capsule {
            half_length: 0.5 * length,
            radius: *radius,
        },
        Shape::Polygon { points: p } => ShapeSpec::Polygon { points: points(p) },
        Shape::Polyline { points: p, closed } => ShapeSpec::Chain {
            points: points(p),
            closed: *closed,
        },
        Shape::Compound(parts) => ShapeSpec::Compound(
            parts
                .iter()
                .map(|part| {
                    let place = Pose64::new(Vec2::from(part.position), part.angle);
                    Ok((place, self::shape(&part.shape)?))
                })
                .collect::<Result<_, ModelError>>()?,
        ),
        Shape::Rod { .. } | Shape::Line | Shape::Bowl { .. } => {
            return Err(ModelError::Unsupported(
                "rapier has no rod, line or bowl".to_owned(),
            ));
        }
    })
}

fn mass(body: &Body) -> Option<MassSpec> {
    body.mass.map(|mass| match mass {
        Mass::Density(density) => MassSpec::Density(density),
        Mass::Given {
            mass,
            inertia: Some(inertia),
        } => MassSpec::Given { mass, inertia },
        Mass::Given {
            mass,
            inertia: None,
        } => MassSpec::Spread(mass),
    })
}

/// Mass \[kg\] of a body for the damping of its contacts; a fixed body counts with the other's mass.
pub(super) fn body_mass(body: &Body) -> f64 {
    match body.mass {
        Some(Mass::Given { mass, .. }) => mass,
        Some(Mass::Density(density)) => density * shape(&body.shape).map_or(0.0, |s| s.area()),
        None => 1.0,
    }
}
