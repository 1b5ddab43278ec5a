//! Coefficients and groups.

use super::{DT, floor, free, pipeline, square, world};
use moreau2d::dynamics::record::ContactStatus;
use moreau2d::rapier::engine::prelude::*;

#[test]
fn friction_and_restitution_combine_by_rapiers_rules() {
    use CoefficientCombineRule::{Average, Max, Min, Multiply};
    let cases = [
        (Average, Average, 0.5),
        (Average, Min, 0.2),
        (Multiply, Min, 0.16),
        (Max, Multiply, 0.8),
        (Min, Average, 0.2),
    ];
    for (one, two, expected) in cases {
        let mut world = world(-9.81);
        let (ground, slab) = floor();
        world.insert(ground, slab.friction(0.2).friction_combine_rule(one));
        let (body, _) = world.insert(
            free()
                .translation(Vector::new(0.0, 0.5))
                .linvel(Vector::new(3.0, 0.0)),
            square().friction(0.8).friction_combine_rule(two),
        );
        let mut pipeline = pipeline();
        pipeline.step(&mut world).unwrap();
        let v = pipeline.velocity(body).unwrap().x;
        let mu = (3.0 - v) / (9.81 * DT);
        assert!(
            (mu - expected).abs() < 1e-9,
            "friction {one:?} {two:?}: {mu}"
        );

        let mut world = self::world(0.0);
        let (ground, slab) = floor();
        world.insert(ground, slab.restitution(0.2).restitution_combine_rule(one));
        let (body, _) = world.insert(
            free()
                .translation(Vector::new(0.0, 0.51))
                .linvel(Vector::new(0.0, -3.0)),
            ColliderBuilder::ball(0.5)
                .restitution(0.8)
                .restitution_combine_rule(two),
        );
        let mut pipeline = self::pipeline();
        let record = pipeline.step(&mut world).unwrap();
        assert_eq!(record.contacts[0].status, ContactStatus::Impact);
        let e = pipeline.velocity(body).unwrap().y / 3.0;
        assert!(
            (e - expected).abs() < 1e-9,
            "restitution {one:?} {two:?}: {e}"
        );
    }
}

#[test]
fn groups_and_sensors_let_bodies_through() {
    let group = |member: u32, filter: u32| {
        let bits = Group::from_bits_truncate;
        InteractionGroups::new(bits(member), bits(filter), InteractionTestMode::And)
    };
    let cases = [
        (square().collision_groups(group(1, 1)), true),
        (square().collision_groups(group(2, 1)), false),
        (square().collision_groups(group(1, 2)), false),
        (square().sensor(true), false),
        (square().enabled(false).mass(1.0), false),
    ];
    for (k, (shape, holds)) in cases.into_iter().enumerate() {
        let mut world = world(-9.81);
        let (ground, slab) = floor();
        world.insert(ground, slab.collision_groups(group(1, 1)));
        let body = free()
            .translation(Vector::new(0.0, 0.5))
            .additional_mass(1.0);
        let (body, _) = world.insert(body, shape);
        let mut pipeline = pipeline();
        for _ in 0..60 {
            pipeline.step(&mut world).unwrap();
        }
        let y = pipeline.pose(body).unwrap().translation.y;
        assert_eq!((y - 0.5).abs() < 1e-6, holds, "case {k}: {y}");
    }
}
