//! Colliders that are worn, exchanged or given another shape.

use super::{DT, UNIT, at, free, pipeline, shapes, simulation, world};
use moreau2d::contact::{Vec2, Vec3};
use moreau2d::dynamics::record::StepRecord;
use moreau2d::peers::{ColliderId, Motion, ShapeSpec, Simulation, Surface};
use moreau2d::rapier::engine::prelude::*;

/// Where a 1 m shape rests with gaps from parry \[m\]: the dead band of 2e-6 and parry's 3e-7.
const RESOLVED: f64 = 2.5e-6;

/// The same solid of height `h` on y = 0, as each kind of shape.
fn tooth(kind: &str, h: f64) -> ShapeSpec {
    let corners = vec![
        Vec2::new(-0.5, -0.5),
        Vec2::new(0.5, -0.5),
        Vec2::new(0.5, h),
        Vec2::new(0.0, h),
        Vec2::new(-0.5, h),
    ];
    match kind {
        "chain" => ShapeSpec::Chain {
            points: corners,
            closed: true,
        },
        "polygon" => ShapeSpec::Polygon {
            // parry takes no corner of 180 degrees
            points: corners.into_iter().filter(|p| p.x != 0.0).collect(),
        },
        // the top is at h wherever the box's centre is
        _ => ShapeSpec::Box {
            half: Vec2::new(0.5, h),
        },
    }
}

fn settle(s: &mut Simulation, steps: usize) -> StepRecord {
    let mut record = StepRecord::default();
    for _ in 0..steps {
        record = s.step().unwrap();
    }
    record
}

/// Bug that this guards: `Collider::set_shape` left contacts of the old shape for many steps, and
/// wear seemed never to reach the dynamics.
#[test]
fn a_worn_tooth_is_met_later_and_where_it_is() {
    for kind in ["chain", "box", "polygon"] {
        for load in ["ball", "box", "polygon"] {
            let shape = shapes().into_iter().find(|(n, _)| *n == load).unwrap().1;
            let mut s = simulation(-9.81);
            let surface = Surface::default();
            let (base, first) = s
                .add_body(
                    Motion::Fixed,
                    at(0.0, 0.0),
                    Vec3::zeros(),
                    &tooth(kind, 0.3),
                    &surface,
                    None,
                )
                .unwrap();
            let (body, _) = s
                .add_body(
                    Motion::Dynamic,
                    at(0.05, 0.81),
                    Vec3::zeros(),
                    &shape,
                    &surface,
                    UNIT,
                )
                .unwrap();
            let height = |s: &Simulation| s.pose(body).unwrap().translation.y;
            settle(&mut s, 60);
            let what = format!("{load} on {kind}");
            assert!(
                (height(&s) - 0.8).abs() < RESOLVED,
                "{what}: {}",
                height(&s)
            );

            let mut collider: ColliderId = first;
            for (h, wear) in [(0.25, 0.05), (0.249, 0.001), (0.05, 0.199)] {
                collider = s
                    .replace_collider(collider, base, &tooth(kind, h), &surface)
                    .unwrap();
                let from = height(&s);
                let mut steps = 0;
                loop {
                    let record = s.step().unwrap();
                    steps += 1;
                    if record.contacts.iter().any(|c| c.impulse_n > 0.0) {
                        break;
                    }
                    assert!(steps < 60, "{what} at {h}: never met");
                }
                // free fall through what was worn off: sqrt(2 wear/g), a step more or less
                let fall = (2.0 * wear / 9.81f64).sqrt() / DT;
                assert!(
                    (f64::from(steps) - fall).abs() <= 1.5,
                    "{what} at {h}: met after {steps} steps, {fall} expected, from {from}"
                );
                settle(&mut s, 30);
                assert!(
                    (height(&s) - h - 0.5).abs() < RESOLVED,
                    "{what} at {h}: rests at {}",
                    height(&s)
                );
            }
        }
    }
}

/// The same from the outside: the user removes a collider and inserts a lower one.
#[test]
fn a_collider_that_the_user_exchanges_is_met_where_it_is() {
    let mut world = world(-9.81);
    let (ground, old) = world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::cuboid(2.0, 0.3));
    let (body, _) = world.insert(
        free().translation(Vector::new(0.0, 0.8)),
        ColliderBuilder::cuboid(0.5, 0.5),
    );
    let mut pipeline = pipeline();
    for _ in 0..20 {
        pipeline.step(&mut world).unwrap();
    }
    world.remove_collider(old);
    world.insert_collider(ColliderBuilder::cuboid(2.0, 0.25), Some(ground));
    let record = pipeline.step(&mut world).unwrap();
    assert!(
        record.contacts.iter().all(|c| c.impulse_n == 0.0),
        "{record:?}"
    );
    for _ in 0..60 {
        pipeline.step(&mut world).unwrap();
    }
    let y = pipeline.pose(body).unwrap().translation.y;
    assert!((y - 0.75).abs() < 1e-9, "{y}");
}

/// And in place, with rapier's own `set_shape`, whose contacts went stale.
#[test]
fn a_shape_that_the_user_sets_is_met_where_it_is() {
    for polygon in [false, true] {
        let make = |h: Real| {
            if polygon {
                let point = Vector::new;
                let corners = vec![
                    point(-2.0, -h),
                    point(2.0, -h),
                    point(2.0, h),
                    point(-2.0, h),
                ];
                SharedShape::convex_polyline(corners).unwrap()
            } else {
                SharedShape::cuboid(2.0, h)
            }
        };
        let mut world = world(-9.81);
        let (_, slab) = world.insert(RigidBodyBuilder::fixed(), ColliderBuilder::new(make(0.3)));
        let (body, _) = world.insert(
            free().translation(Vector::new(0.0, 0.8)),
            ColliderBuilder::cuboid(0.5, 0.5),
        );
        let mut pipeline = pipeline();
        for _ in 0..20 {
            pipeline.step(&mut world).unwrap();
        }
        world.colliders[slab].set_shape(make(0.25));
        let record = pipeline.step(&mut world).unwrap();
        let loaded = record.contacts.iter().any(|c| c.impulse_n > 0.0);
        assert!(!loaded, "polygon {polygon}");
        for _ in 0..60 {
            pipeline.step(&mut world).unwrap();
        }
        let y = pipeline.pose(body).unwrap().translation.y;
        assert!((y - 0.75).abs() < RESOLVED, "polygon {polygon}: {y}");
    }
}
