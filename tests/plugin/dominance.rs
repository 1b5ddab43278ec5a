//! Bodies of higher dominance are as of infinite mass to those of lower.

use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};

const DT: f64 = 1.0 / 120.0;

fn pipeline() -> MoreauPipeline {
    MoreauPipeline::new(MoreauSettings {
        dt: Some(DT),
        ..MoreauSettings::default()
    })
    .unwrap()
}

fn body(x: Real, y: Real, v: Real, dominance: i8) -> RigidBodyBuilder {
    RigidBodyBuilder::dynamic()
        .translation(Vector::new(x, y))
        .linvel(Vector::new(v, 0.0))
        .dominance_group(dominance)
        .can_sleep(false)
}

/// A square of 1 m and `mass` \[kg\].
fn square(mass: Real) -> ColliderBuilder {
    ColliderBuilder::cuboid(0.5, 0.5)
        .density(mass)
        .friction(0.0)
}

/// A feather of higher dominance stops a rock and does not notice.
#[test]
fn the_higher_one_does_not_notice() {
    for (feather, rock, expected) in [(1, 0, 2.0), (5, 4, 2.0), (127, -128, 2.0)] {
        let mut world = PhysicsWorld::new();
        world.gravity = Vector::ZERO;
        let (light, _) = world.insert(body(-2.0, 0.0, 2.0, feather), square(0.01));
        let (heavy, _) = world.insert(body(2.0, 0.0, -3.0, rock), square(100.0));
        let mut p = pipeline();
        for _ in 0..200 {
            let record = p.step(&mut world).unwrap();
            assert!(record.energy.imbalance().abs() < 1e-9);
        }
        let (u, v) = (p.velocity(light).unwrap(), p.velocity(heavy).unwrap());
        assert_eq!(u.x, 2.0);
        assert!((v.x - expected).abs() < 1e-12, "{v}");
        let apart = p.pose(heavy).unwrap().translation.x - p.pose(light).unwrap().translation.x;
        assert!((apart - 1.0).abs() < 1e-5, "{apart}");
    }
}

/// A rock on a feather on the floor: each contact carries what is not held from above.
#[test]
fn weight_stops_at_the_higher_one() {
    let mut world = PhysicsWorld::new();
    world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(5.0, 0.5));
    let (low, _) = world.insert(body(0.0, 1.0, 0.0, 1), square(1.0));
    let (high, _) = world.insert(body(0.0, 2.0, 0.0, 0), square(50.0));
    let mut p = pipeline();
    let mut record = p.step(&mut world).unwrap();
    for _ in 0..240 {
        record = p.step(&mut world).unwrap();
        assert_eq!(record.unsolved, 0);
    }
    let numbers = [low, high].map(|h| p.number(h).unwrap());
    let load = |with: u32, without: u32| -> f64 {
        let of = record.contacts.iter();
        let of = of.filter(|c| c.bodies.contains(&with) && !c.bodies.contains(&without));
        of.map(|c| c.impulse_n).sum()
    };
    assert!((load(numbers[0], numbers[1]) - 9.81 * DT).abs() < 1e-9);
    assert!((load(numbers[1], 0) - 50.0 * 9.81 * DT).abs() < 1e-7);
    assert!((p.pose(high).unwrap().translation.y - 2.0).abs() < 1e-5);
}

/// Of three in a row the first, as dominant as the second, pushes it in this very step: the third
/// meets the second with the velocity that it ends the step with.
#[test]
fn the_lower_one_meets_the_end_velocity() {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    let (first, _) = world.insert(body(-2.0, 0.0, 6.0, 1), square(1.0));
    let (second, _) = world.insert(body(0.0, 0.0, 0.0, 1), square(1.0));
    let (third, _) = world.insert(body(1.0, 0.0, 0.0, 0), square(100.0));
    let mut p = pipeline();
    for _ in 0..60 {
        let record = p.step(&mut world).unwrap();
        assert_eq!(record.unsolved, 0);
        assert!(record.penetration < 1e-9, "{}", record.penetration);
        assert!(record.energy.imbalance().abs() < 1e-9);
        let u = [first, second, third].map(|h| p.velocity(h).unwrap().x);
        // as of one mass until they have met, and then as of two, whatever the third weighs
        assert!((u[0] + u[1] - 6.0).abs() < 1e-12, "{u:?}");
        assert!((u[2] - u[1]).abs() < 1e-9, "{u:?}");
    }
    assert!((p.velocity(third).unwrap().x - 3.0).abs() < 1e-9);
}

/// One dominance for all is none, to the last bit, and what nothing moves is above them all.
#[test]
fn equals_are_equal() {
    let run = |dominance: i8| {
        let mut world = PhysicsWorld::new();
        world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(5.0, 0.5));
        let plate = RigidBodyBuilder::kinematic_velocity_based();
        let plate = plate
            .translation(Vector::new(0.0, 0.6))
            .linvel(Vector::new(0.1, 0.0));
        world.insert(plate, ColliderBuilder::cuboid(2.0, 0.1));
        let boxes: Vec<_> = (0..4)
            .map(|k| {
                let y = 1.21 + 1.01 * k as Real;
                let shape = ColliderBuilder::cuboid(0.5, 0.5);
                world
                    .insert(body(0.1 * k as Real, y, 0.0, dominance), shape)
                    .0
            })
            .collect();
        let mut p = pipeline();
        for _ in 0..120 {
            p.step(&mut world).unwrap();
        }
        boxes
            .iter()
            .map(|h| p.pose(*h).unwrap())
            .collect::<Vec<_>>()
    };
    assert_eq!(run(0), run(7));
    assert!(run(-3)[0].translation.y > 1.19);
}

#[test]
fn a_joint_between_bodies_of_different_dominance_is_refused() {
    let mut world = PhysicsWorld::new();
    let (a, _) = world.insert(body(0.0, 0.0, 0.0, 1), square(1.0));
    let (b, _) = world.insert(body(3.0, 0.0, 0.0, 0), square(1.0));
    world.insert_impulse_joint(a, b, RevoluteJointBuilder::new());
    let error = pipeline().step(&mut world).unwrap_err().to_string();
    assert!(
        error.contains("joint 0") && error.contains("dominance"),
        "{error}"
    );
    world.bodies[a].set_dominance_group(0);
    pipeline().step(&mut world).unwrap();
}
