//! The seam with rapier: what is read from a world, what is written back, what is refused.

mod changes;
mod exchanged_shapes;
mod gaps;
mod joints;
mod refusals;
mod surfaces;

use moreau2d::contact::Vec2;
use moreau2d::dynamics::StepperSettings;
use moreau2d::peers::{MassSpec, ShapeSpec, Simulation};
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, Pose64};

const DT: f64 = 1.0 / 120.0;

fn pipeline() -> MoreauPipeline {
    MoreauPipeline::new(MoreauSettings {
        dt: Some(DT),
        ..MoreauSettings::default()
    })
    .unwrap()
}

fn simulation(gravity: f64) -> Simulation {
    Simulation::new(StepperSettings::default(), Vec2::new(0.0, gravity), DT).unwrap()
}

fn world(gravity: Real) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::new(0.0, gravity);
    world
}

fn floor() -> (RigidBodyBuilder, ColliderBuilder) {
    let body = RigidBodyBuilder::fixed().translation(Vector::new(0.0, -1.0));
    (body, ColliderBuilder::cuboid(20.0, 1.0))
}

fn at(x: f64, y: f64) -> Pose64 {
    Pose64::new(Vec2::new(x, y), 0.0)
}

/// Shapes that reach from −0.5 to 0.5 in y, chains with their solid inside.
fn shapes() -> Vec<(&'static str, ShapeSpec)> {
    let square = vec![
        Vec2::new(-0.5, -0.5),
        Vec2::new(0.5, -0.5),
        Vec2::new(0.5, 0.5),
        Vec2::new(-0.5, 0.5),
    ];
    let half = Vec2::new(0.5, 0.5);
    vec![
        ("ball", ShapeSpec::Ball { radius: 0.5 }),
        ("box", ShapeSpec::Box { half }),
        (
            "capsule",
            ShapeSpec::Capsule {
                half_length: 0.5,
                radius: 0.5,
            },
        ),
        (
            "polygon",
            ShapeSpec::Polygon {
                points: square.clone(),
            },
        ),
        (
            "chain",
            ShapeSpec::Chain {
                points: square,
                closed: true,
            },
        ),
    ]
}

const UNIT: Option<MassSpec> = Some(MassSpec::Given {
    mass: 1.0,
    inertia: 0.2,
});

fn free() -> RigidBodyBuilder {
    RigidBodyBuilder::dynamic()
}

fn square() -> ColliderBuilder {
    ColliderBuilder::cuboid(0.5, 0.5)
}
