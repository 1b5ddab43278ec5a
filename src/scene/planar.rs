//! Scenes of rods, lines and bowls as a [`Planar`] model.

use super::{Body, Joint, Mass, Scene, Shape};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::{ModelError, Pose64};
use crate::models::{Oscillation, Pivot, Planar, PlanarBody, PlanarShape, RotorMotor};
use std::f64::consts::PI;

/// The model of a scene whose every shape has closed-form gaps.
///
/// # Errors
/// [`ModelError`]; it does not occur for a scene that passed its checks.
pub(super) fn build(scene: &Scene) -> Result<Planar, ModelError> {
    let bodies = scene
        .bodies
        .iter()
        .map(|body| planar_body(scene, body))
        .collect::<Result<Vec<_>, _>>()?;
    let pivots = scene.joints.iter().map(|joint| Pivot {
        bodies: joint.bodies,
        anchors: scene.anchors(joint),
        motor: joint.motor.map(|m| RotorMotor {
            speed: m.speed.unwrap_or(0.0),
            max_torque: m.bound(),
        }),
    });
    let gravity = Vec2::from(scene.gravity);
    Planar::new(gravity, bodies, pivots.collect(), &apart(&scene.bodies))
}

/// The shape, if its gaps have a closed form.
pub(super) fn shape(shape: &Shape) -> Option<PlanarShape> {
    Some(match *shape {
        Shape::Disc { radius } => PlanarShape::Disc { radius },
        Shape::Rod { length } => PlanarShape::Rod { length },
        Shape::Box { width, height } => PlanarShape::Box {
            half: Vec2::new(0.5 * width, 0.5 * height),
        },
        Shape::Line => PlanarShape::Line,
        Shape::Bowl { radius } => PlanarShape::Bowl { radius },
        Shape::Capsule { .. }
        | Shape::Polygon { .. }
        | Shape::Polyline { .. }
        | Shape::Compound(_) => return None,
    })
}

/// Pairs that `touches` of one of the two bodies excludes.
fn apart(bodies: &[Body]) -> Vec<[usize; 2]> {
    let mut apart = Vec::new();
    for i in 0..bodies.len() {
        for j in i + 1..bodies.len() {
            if !may_touch(bodies, i, j) {
                apart.push([i, j]);
            }
        }
    }
    apart
}

/// Whether `touches` of both bodies allows contact.
pub(super) fn may_touch(bodies: &[Body], i: usize, j: usize) -> bool {
    let allows = |a: usize, b: usize| {
        let touches: Option<&Vec<usize>> = bodies[a].touches.as_ref();
        touches.is_none_or(|list| list.contains(&b))
    };
    allows(i, j) && allows(j, i)
}

/// Whether a joint connects the two.
pub(super) fn tied(joints: &[Joint], i: usize, j: usize) -> bool {
    joints
        .iter()
        .any(|joint| joint.bodies == [Some(i), Some(j)] || joint.bodies == [Some(j), Some(i)])
}

impl Body {
    /// Mass \[kg\] and moment of inertia about the centre [kg m²] of a dynamic disc, box or rod;
    /// `None` for other bodies.
    pub fn mass_and_inertia(&self) -> Option<(f64, f64)> {
        Some(mass_and_inertia(self.mass?, &shape(&self.shape)?))
    }
}

fn planar_body(scene: &Scene, body: &Body) -> Result<PlanarBody, ModelError> {
    let material = &scene.materials[body.material];
    let shape = shape(&body.shape).ok_or_else(|| {
        ModelError::Unsupported(format!("body {}: its gaps are no closed form", body.name))
    })?;
    Ok(PlanarBody {
        shape,
        mass: body.mass.map(|mass| mass_and_inertia(mass, &shape)),
        pose: Pose64::new(Vec2::from(body.position), body.angle),
        velocity: Vec3::new(body.velocity[0], body.velocity[1], body.spin),
        oscillation: body.oscillation.map(|o| Oscillation {
            amplitude: Vec2::from(o.amplitude),
            angular_frequency: o.angular_frequency,
        }),
        friction: material.friction,
        restitution: material.restitution,
        surface_velocity: body.surface_velocity,
    })
}

/// Mass \[kg\] and moment of inertia [kg m²]: as given, or of mass spread evenly over the shape.
fn mass_and_inertia(mass: Mass, shape: &PlanarShape) -> (f64, f64) {
    // area [m²] and square of the radius of gyration [m²]
    let (area, gyration) = match *shape {
        PlanarShape::Disc { radius } => (PI * radius * radius, 0.5 * radius * radius),
        PlanarShape::Box { half } => (4.0 * half.x * half.y, half.norm_squared() / 3.0),
        PlanarShape::Rod { length } => (0.0, length * length / 12.0),
        PlanarShape::Line | PlanarShape::Bowl { .. } => (0.0, 0.0),
    };
    match mass {
        Mass::Density(density) => (density * area, density * area * gyration),
        Mass::Given { mass, inertia } => (mass, inertia.unwrap_or(mass * gyration)),
    }
}
