//! What bodies of a rapier world hold, against closed forms, and what they may not hold.

mod bad_input;
mod forces;
mod kinds;
mod mass;

use moreau2d::dynamics::record::StepRecord;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};

const DT: f64 = 1.0 / 120.0;
const G: f64 = 9.81;
/// Of rapier's inertia.
const ROUNDING: f64 = 1e-7;

/// A pipeline that steps by `DT`, whatever the world says.
fn pipeline() -> MoreauPipeline {
    MoreauPipeline::new(MoreauSettings {
        dt: Some(DT),
        ..MoreauSettings::default()
    })
    .unwrap()
}

fn world(gravity: Real) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::new(0.0, gravity);
    world
}

/// A world without weight and a box of 2 kg, 1 m wide and high.
fn floating(body: RigidBodyBuilder) -> (PhysicsWorld, RigidBodyHandle, ColliderHandle) {
    let mut world = world(0.0);
    let (body, collider) = world.insert(body, ColliderBuilder::cuboid(0.5, 0.5).density(2.0));
    (world, body, collider)
}

fn free() -> RigidBodyBuilder {
    RigidBodyBuilder::dynamic()
}

fn steps(p: &mut MoreauPipeline, world: &mut PhysicsWorld, n: usize) -> StepRecord {
    let mut last = StepRecord::default();
    for _ in 0..n {
        last = p.step(world).unwrap();
        assert_eq!(last.unsolved, 0);
        let scale = last.energy.kinetic_end.abs().max(1.0);
        assert!(last.energy.imbalance().abs() < 1e-12 * scale);
    }
    last
}

fn near(a: f64, b: f64, tolerance: f64, what: &str) {
    assert!((a - b).abs() <= tolerance, "{what}: {a} is not {b}");
}

type Change = fn(&mut PhysicsWorld, RigidBodyHandle, ColliderHandle);
