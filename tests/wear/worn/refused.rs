//! What is refused, and what stays then.

use super::{K, MASS, Stand, at, foot};
use moreau2d::rapier::engine::prelude::*;
use moreau2d::worn::{WearingSurface, WornError};

/// What wears through itself is refused, and everything stays as before the jump.
#[test]
fn a_body_that_is_worn_through_keeps_what_was_before() {
    let face = ColliderBuilder::cuboid(4.0, 0.5).translation(at(0.0, -0.5));
    let mut stand = Stand::new(
        ColliderBuilder::cuboid(0.005, 0.0005),
        0.0005,
        face,
        1e-4,
        true,
    );
    let pin = stand.pin;
    stand.add(pin, foot(Some(1e-3)));
    let (outline, error) = loop {
        let before = (stand.worn.outline(0), stand.worn.seconds());
        match stand.jump(200, 1e9) {
            Ok(_) => assert!(stand.worn.seconds() < 1e6),
            Err(error) => {
                assert_eq!(before.1, stand.worn.seconds());
                break (before.0, error);
            }
        }
    };
    assert!(
        matches!(error, WornError::WornThrough { surface: 0, .. }),
        "{error}"
    );
    assert_eq!(stand.worn.outline(0), outline);
    assert!(stand.worn.state(0).depth()[0] > 8e-4);
}

#[test]
fn surfaces_that_cannot_wear_are_refused_by_name() {
    let mut stand = Stand::flat(1e-4);
    let (pin, disc) = (stand.pin, stand.disc);
    let capsule = ColliderBuilder::capsule_x(0.1, 0.1);
    let capsule = stand.world.insert(RigidBodyBuilder::fixed(), capsule).1;
    let plain = ColliderBuilder::polyline(vec![at(0.0, 9.0), at(1.0, 9.0)], None);
    let plain = stand.world.insert(RigidBodyBuilder::fixed(), plain).1;
    let ball = ColliderBuilder::ball(0.5);
    let ball = stand.world.insert(RigidBodyBuilder::fixed(), ball).1;
    let plainly = WearingSurface::new(K);
    let of_cells = |length| WearingSurface {
        cell: Some(length),
        ..plainly
    };
    let cases = [
        (
            pin,
            WearingSurface::new(-1e-13),
            "K [m²/N] is -0.0000000000001",
        ),
        (pin, WearingSurface::new(f64::NAN), "must be finite"),
        (
            pin,
            WearingSurface {
                edges: Some([0, 4]),
                ..plainly
            },
            "edges [0, 4]: the surface has the edges 0 to 3",
        ),
        (pin, of_cells(0.5), "edge 0 is 0.01 m long"),
        (
            pin,
            WearingSurface {
                density: Some(-1.0),
                ..plainly
            },
            "density",
        ),
        (disc, plainly, "moves at -0.5 m/s along itself"),
        (capsule, plainly, "Capsule cannot wear"),
        (plain, plainly, "two-sided"),
        (ColliderHandle::invalid(), plainly, "not in the world"),
        (ball, of_cells(1e-9), "at most 10000"),
        (ball, of_cells(0.0), "at most 10000"),
        (pin, of_cells(1e-9), "at most 10000"),
    ];
    for (collider, surface, expected) in cases {
        let (world, pipeline) = (&mut stand.world, &mut stand.pipeline);
        let error = stand
            .worn
            .add(world, pipeline, collider, surface)
            .unwrap_err();
        assert!(error.to_string().contains(expected), "{error}\n{expected}");
        assert!(!pipeline.is_awake());
    }
    assert!(stand.world.colliders[pin].shape().as_cuboid().is_some());
    stand.add(pin, plainly);
    let (world, pipeline) = (&mut stand.world, &mut stand.pipeline);
    let twice = stand.worn.add(world, pipeline, pin, plainly);
    assert_eq!(twice, Err(WornError::Twice { surface: 0 }));
    let jumped = stand.worn.jump(world, pipeline, 1.0);
    assert_eq!(jumped, Err(WornError::Unmeasured));
}

/// Bug: where the second of two bodies had no mass left to lose, the first was worn already.
#[test]
fn a_jump_that_fails_on_one_surface_wears_none() {
    for one_body in [false, true] {
        let mut stand = Stand::flat(1e-6);
        let pin = stand.pin;
        stand.yielding(pin, 1e11);
        let heavy = |density: f64| WearingSurface {
            density: Some(density),
            ..foot(Some(2e-3))
        };
        stand.add(pin, heavy(1e3));
        // 1e-8 m2 in a jump: more than the mass of its body
        let foot = ColliderBuilder::cuboid(0.005, 0.02).translation(at(0.1, 0.0));
        let foot = foot.density(0.0).friction(0.0);
        let body = match one_body {
            true => stand.body,
            false => {
                let mass = MassProperties::new(Vector::ZERO, MASS as Real, 1.0);
                let body = RigidBodyBuilder::dynamic().additional_mass_properties(mass);
                let body = body.lock_rotations().enabled_translations(false, true);
                let body = body.translation(at(0.0, 0.02));
                stand.world.bodies.insert(body)
            }
        };
        let (colliders, bodies) = (&mut stand.world.colliders, &mut stand.world.bodies);
        let second = colliders.insert_with_parent(foot, body, bodies);
        stand.yielding(second, 1e11);
        stand.add(second, heavy(1e12));
        // rapier has the mass of a body from its first step on
        let (world, pipeline) = (&mut stand.world, &mut stand.pipeline);
        pipeline.step(world).unwrap();
        let mass = |stand: &Stand| stand.world.bodies[stand.body].mass();
        let before = (mass(&stand), stand.worn.outline(0), stand.worn.outline(1));
        let error = stand.jump(200, 1e6).unwrap_err();
        let told = error.to_string();
        assert!(
            told.contains("wear leaves a mass of -"),
            "{one_body}: {told}"
        );
        assert_eq!(stand.worn.seconds(), 0.0);
        for surface in 0..2 {
            assert!(stand.worn.state(surface).depth().iter().all(|h| *h == 0.0));
            assert_eq!(stand.worn.state(surface).life().points().len(), 1);
        }
        let after = (mass(&stand), stand.worn.outline(0), stand.worn.outline(1));
        assert_eq!(before, after, "{one_body}");
        let shape = |collider| {
            let found = stand.pipeline.outline(&stand.world, collider, None);
            found.unwrap()
        };
        for (surface, collider) in [(0, pin), (1, second)] {
            let of_world = shape(collider).points;
            let own = stand.worn.outline(surface).points;
            // single precision of the collider
            let off = of_world.iter().zip(&own).map(|(a, b)| (a - b).norm());
            assert!(off.fold(0.0, f64::max) < 1e-8, "{one_body} {surface}");
        }
    }
}
