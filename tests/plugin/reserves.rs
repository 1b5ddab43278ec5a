//! Reserves of energy and landings belong to bodies, whatever numbers these have.

use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, PipelineState};

/// A double pendulum behind a body that touches nothing: the world, that body and the last rod.
fn swing() -> (PhysicsWorld, RigidBodyHandle, RigidBodyHandle) {
    let mut world = PhysicsWorld::new();
    let ball = RigidBodyBuilder::dynamic().translation(Vector::new(50.0, 0.0));
    let far = world.insert(ball, ColliderBuilder::ball(0.5)).0;
    let mut last = world.bodies.insert(RigidBodyBuilder::fixed());
    for x in [0.5, 1.5] {
        let rod = RigidBodyBuilder::dynamic().translation(Vector::new(x, 0.0));
        let rod = world.insert(rod, ColliderBuilder::cuboid(0.45, 0.05)).0;
        let end = if x < 1.0 { 0.0 } else { 0.5 };
        let pin = RevoluteJointBuilder::new()
            .local_anchor1(Vector::new(end, 0.0))
            .local_anchor2(Vector::new(-0.5, 0.0));
        world.insert_impulse_joint(last, rod, pin);
        last = rod;
    }
    (world, far, last)
}

fn pipeline() -> MoreauPipeline {
    MoreauPipeline::new(MoreauSettings::default()).unwrap()
}

/// What is done to the far body.
type Change = fn(&mut PhysicsWorld, RigidBodyHandle);

const CHANGES: [(&str, Change); 2] = [
    ("removed", |world, far| {
        world.remove_body(far);
    }),
    ("disabled", |world, far| {
        world.bodies[far].set_enabled(false);
    }),
];

/// Bug: reserves were kept by body number, and a body that went passed its own on to the next one.
#[test]
fn a_body_that_goes_moves_no_reserve() {
    for (what, change) in CHANGES {
        let (mut kept, _, last) = swing();
        let (mut world, far, _) = swing();
        let (mut whole, mut p) = (pipeline(), pipeline());
        let mut paid = 0;
        for step in 0..240 {
            if step == 30 {
                change(&mut world, far);
                // as it does where the run is resumed in between
                let text = serde_json::to_string(&p.state_in(&world)).unwrap();
                let state: PipelineState = serde_json::from_str(&text).unwrap();
                p = MoreauPipeline::resume(&state, &mut world).unwrap();
            }
            paid += whole.step(&mut kept).unwrap().drag.len();
            p.step(&mut world).unwrap();
            let [a, b] = [&whole, &p].map(|p| (p.pose(last).unwrap(), p.velocity(last).unwrap()));
            assert_eq!(a, b, "{what}, step {step}");
        }
        assert!(paid > 0, "no energy was returned");
    }
}

/// Bug: a landing that takes two steps was that of the next body if one went in between.
#[test]
fn a_body_that_goes_moves_no_landing() {
    let mut late = 0;
    for height in (0..24).map(|k| 1.0 + 0.03 * k as Real) {
        let mut world = PhysicsWorld::new();
        let ball = |x, y| RigidBodyBuilder::dynamic().translation(Vector::new(x, y));
        let far = world.insert(ball(50.0, 0.0), ColliderBuilder::ball(0.5)).0;
        let floor = ColliderBuilder::cuboid(10.0, 0.5);
        let floor = world.insert(RigidBodyBuilder::fixed(), floor).0;
        let fallen = world
            .insert(ball(0.0, height), ColliderBuilder::ball(0.5))
            .0;
        world.insert(ball(5.0, 50.0), ColliderBuilder::ball(0.5));
        let (mut p, mut gone) = (pipeline(), false);
        for _ in 0..60 {
            let record = p.step(&mut world).unwrap();
            for impact in &record.impacts {
                let bodies = impact.bodies.map(|body| p.body(body));
                let both = [Some(floor), Some(fallen)];
                let met = both.iter().all(|body| bodies.contains(body));
                assert!(met, "{height}: {impact:?}");
                late += usize::from(gone);
            }
            if !record.contacts.is_empty() && !gone {
                world.remove_body(far);
                gone = true;
            }
        }
        assert!(gone);
    }
    assert!(late > 0, "no landing took two steps");
}
