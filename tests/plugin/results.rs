//! The gate of momentum: what the contacts gave is what the bodies got, for every pair of shapes.

use moreau2d::contact::{Vec2, Vec3};
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, widen};

const DT: f64 = 1.0 / 120.0;

fn pipeline(events: bool) -> MoreauPipeline {
    let mut settings = MoreauSettings {
        dt: Some(DT),
        ..MoreauSettings::default()
    };
    settings.stepper.events = events;
    MoreauPipeline::new(settings).unwrap()
}

type Build = fn() -> ColliderBuilder;

/// About 1 m wide; the last four have no area of their own.
const SHAPES: [(&str, Build); 14] = [
    ("ball", || ColliderBuilder::ball(0.5)),
    ("cuboid", || ColliderBuilder::cuboid(0.5, 0.4)),
    ("capsule", || ColliderBuilder::capsule_x(0.3, 0.3)),
    ("convex polygon", || {
        let corner = |k: u32| Vector::new((k as Real).cos(), (k as Real).sin()) * 0.5;
        ColliderBuilder::convex_hull(&[0, 1, 2, 3, 4, 5, 6].map(corner)).unwrap()
    }),
    ("round cuboid", || {
        ColliderBuilder::round_cuboid(0.4, 0.3, 0.1)
    }),
    ("round convex", || {
        let corners = [[-0.4, -0.3], [0.4, -0.3], [0.0, 0.4]];
        let corners = corners.map(|[x, y]| Vector::new(x, y));
        ColliderBuilder::round_convex_hull(&corners, 0.1).unwrap()
    }),
    ("triangle", || {
        let at = |x, y| Vector::new(x, y);
        ColliderBuilder::triangle(at(-0.5, -0.4), at(0.5, -0.4), at(0.0, 0.5))
    }),
    ("round triangle", || {
        let at = |x, y| Vector::new(x, y);
        ColliderBuilder::round_triangle(at(-0.4, -0.3), at(0.4, -0.3), at(0.0, 0.4), 0.1)
    }),
    ("compound", || {
        let part = |x| {
            (
                Pose::from_translation(Vector::new(x, 0.0)),
                SharedShape::ball(0.3),
            )
        };
        ColliderBuilder::compound(vec![part(-0.3), part(0.3)])
    }),
    ("segment", || {
        ColliderBuilder::segment(Vector::new(-0.6, 0.0), Vector::new(0.6, 0.0))
    }),
    ("polyline", || {
        let points = [[-3.0, 0.3], [-1.0, 0.0], [0.0, 0.1], [1.0, 0.0], [3.0, 0.3]];
        ColliderBuilder::polyline(points.map(|[x, y]| Vector::new(x, y)).to_vec(), None)
    }),
    ("trimesh", || {
        let points = [[-3.0, -1.0], [3.0, -1.0], [3.0, 0.0], [-3.0, 0.1]];
        let points = points.map(|[x, y]| Vector::new(x, y)).to_vec();
        ColliderBuilder::trimesh(points, vec![[0, 1, 2], [0, 2, 3]]).unwrap()
    }),
    ("heightfield", || {
        ColliderBuilder::heightfield(vec![0.2, 0.0, 0.1, 0.0, 0.2], Vector::new(6.0, 1.0))
    }),
    ("halfspace", || {
        ColliderBuilder::new(SharedShape::halfspace(Vector::Y))
    }),
];

/// Solid ones can be bodies of their own.
const SOLID: usize = 10;

/// Steps a world and holds every body to `m Δu = F Δt + Σ P + D`, `J Δω = Σ r × P + D` with the drag `D`;
/// the contacts met, and the bodies with a drag.
fn hold_to_momentum(world: &mut PhysicsWorld, p: &mut MoreauPipeline, what: &str) -> [usize; 2] {
    let (mut met, mut dragged) = (0, 0);
    let gravity = Vec2::new(widen(world.gravity.x), widen(world.gravity.y));
    for _ in 0..90 {
        let before: Vec<Option<Vec3>> = world.bodies.iter().map(|(h, _)| p.velocity(h)).collect();
        let record = p.step(world).unwrap();
        let results = p.results(&record);
        met += record.contacts.iter().filter(|c| c.impulse_n > 0.0).count();
        for ((handle, body), start) in world.bodies.iter().zip(before) {
            let Some(start) = start else { continue };
            let mass = widen(body.mass());
            let inertia = widen(1.0 / body.mass_properties().local_mprops.inv_principal_inertia);
            let (got, change) = (results.on_body(handle), p.velocity(handle).unwrap() - start);
            if !body.is_dynamic() {
                assert_eq!((got.contacts, change), (0, Vec3::zeros()), "{what}");
                continue;
            }
            let forces = gravity * mass * DT;
            let scale = mass * (forces.norm() / mass + start.xy().norm()) + got.pressure;
            dragged += usize::from(got.drag != Vec2::zeros());
            let linear = mass * change.xy() - forces - got.impulse - got.drag;
            assert!(linear.norm() < 1e-12 * scale, "{what}: {linear} of {scale}");
            let angular = inertia * change.z - got.moment - got.drag_moment;
            let scale = scale + inertia * start.z.abs();
            assert!(
                angular.abs() < 1e-12 * scale,
                "{what}: {angular} of {scale}"
            );
        }
        // between two movable bodies what one gets the other gives
        for contact in results.contacts() {
            let [a, b] = contact.colliders.map(Option::unwrap);
            let (ab, ba) = (results.between(a, b), results.between(b, a));
            assert_eq!(ab.impulse, -ba.impulse);
            assert_eq!(ab.contacts, ba.contacts);
        }
    }
    [met, dragged]
}

/// Every solid on every shape, fixed, and on every solid that moves and lies on the ground.
#[test]
fn impulses_are_the_change_of_momentum() {
    let (mut pairs, mut dragged) = (0, 0);
    for (upper, high) in &SHAPES[..SOLID] {
        for (lower, low) in &SHAPES {
            for events in [false, true] {
                let what = format!("{upper} on {lower}, events {events}");
                let mut world = PhysicsWorld::new();
                let coat = |shape: ColliderBuilder| shape.friction(0.6).restitution(0.3);
                world.insert(RigidBodyBuilder::fixed(), coat(low()));
                let at = RigidBodyBuilder::dynamic().translation(Vector::new(0.1, 1.2));
                let moving = at.rotation(0.3).angvel(2.0).linvel(Vector::new(0.5, -1.0));
                // a segment has no area
                let body = moving.additional_mass_properties(MassProperties::new(
                    Vector::new(0.05, 0.0),
                    1.5,
                    0.3,
                ));
                world.insert(body, coat(high()));
                let [met, drags] = hold_to_momentum(&mut world, &mut pipeline(events), &what);
                assert!(met > 0, "{what}: never met");
                pairs += 1;
                dragged += drags;
            }
        }
    }
    assert_eq!(pairs, 2 * SOLID * SHAPES.len());
    assert!(dragged > 0, "no energy was taken back");
}

#[test]
fn impulses_are_the_change_of_momentum_of_two_that_move() {
    for (upper, high) in &SHAPES[..SOLID] {
        for (lower, low) in &SHAPES[..SOLID] {
            let what = format!("{upper} against {lower}");
            let mut world = PhysicsWorld::new();
            world.gravity = Vector::ZERO;
            let more = MassProperties::new(Vector::ZERO, 1.0, 0.2);
            let body = |y: Real, v: Real| {
                let at = RigidBodyBuilder::dynamic().translation(Vector::new(0.02 * y, y));
                let at = at.linvel(Vector::new(0.1 * v, v)).angvel(v);
                at.additional_mass_properties(more)
            };
            world.insert(body(0.0, 0.5), low().friction(0.4));
            world.insert(body(1.3, -1.5), high().friction(0.4));
            let [met, _] = hold_to_momentum(&mut world, &mut pipeline(false), &what);
            assert!(met > 0, "{what}: never met");
        }
    }
}

/// Numbers and handles name the same things, also after some are gone.
#[test]
fn handles_are_those_of_the_world() {
    let mut world = PhysicsWorld::new();
    let (gone, _) = world.insert(
        RigidBodyBuilder::dynamic().translation(Vector::new(9.0, 9.0)),
        ColliderBuilder::ball(0.5),
    );
    let floor = world.insert_collider(ColliderBuilder::cuboid(5.0, 0.5), None);
    let (body, side) = world.insert(
        RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 1.0)),
        ColliderBuilder::cuboid(0.5, 0.5),
    );
    let mut p = pipeline(false);
    for taken in [false, true] {
        if taken {
            world.remove_body(gone);
        }
        let record = p.step(&mut world).unwrap();
        let results = p.results(&record);
        assert_eq!(results.contacts().count(), 2);
        for contact in results.contacts() {
            assert_eq!(contact.bodies, [None, Some(body)]);
            assert_eq!(contact.colliders, [Some(floor), Some(side)]);
            assert_eq!(contact.record.moments[0], None);
        }
        let number = p.number(body).unwrap();
        assert_eq!(p.body(number), Some(body));
        assert_eq!(results.of_collider(side).count(), 2);
        let load = results.on_body(body);
        let weight = 9.81 * DT;
        assert!((load.impulse - Vec2::new(0.0, weight)).norm() < 1e-7);
        assert!((load.pressure - weight).abs() < 1e-7 && load.moment.abs() < 1e-8);
        assert_eq!(results.between(floor, side).impulse, load.impulse);
        assert_eq!(results.between(side, floor).impulse, -load.impulse);
        assert_eq!(results.on_body(gone).contacts, 0);
    }
    assert_eq!(p.body(99), None);
    assert_eq!(p.collider(99), None);
}
