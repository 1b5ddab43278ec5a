//! A body on many springs, each of which a step resolves though not all of them together.

use crate::common::at;
use moreau2d::contact::Vec2;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, SurfaceLaw};

const FEET: u32 = 64;
const MASS: f64 = 2.0;
const DT: f64 = 1.0 / 60.0;
const GRAVITY: f64 = 10.0;

/// Where the springs are.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Springs {
    /// On one collider of the body and one under it.
    OnePair,
    /// On many colliders of the body.
    Feet,
    /// On many colliders of one body under it.
    Ground,
    /// On many bodies under it.
    Stones,
}

/// Load on a body over its weight in the last of many steps, after it fell from `height` \[m\].
///
/// All springs together have `kappa = Σk Δt²/m`, and all dampers `z = Σc Δt/m`.
fn loads(springs: Springs, [kappa, z, height]: [f64; 3]) -> Vec<f64> {
    let mut world = PhysicsWorld::new();
    let mut pipeline = MoreauPipeline::new(MoreauSettings {
        gravity: Some(Vec2::new(0.0, -GRAVITY)),
        dt: Some(DT),
        // a body that sleeps is in no record
        stay_awake: true,
        ..MoreauSettings::default()
    })
    .unwrap();
    let mass = MassProperties::new(Vector::ZERO, MASS as Real, 1.0);
    let body = RigidBodyBuilder::dynamic().additional_mass_properties(mass);
    let body = body.lock_rotations().enabled_translations(false, true);
    let body = world.bodies.insert(body.translation(at(0.0, height)));
    let ground = world.bodies.insert(RigidBodyBuilder::fixed());
    // boxes of 10 mm, 20 mm apart, the upper ones with their lower side at y = 0
    let place = |k: u32, y: f64| at(0.02 * f64::from(k), y);
    let small = || {
        ColliderBuilder::cuboid(0.005, 0.005)
            .density(0.0)
            .friction(0.0)
    };
    let middle = 0.01 * f64::from(FEET - 1);
    let wide = |y: f64| {
        let half = (middle + 0.01) as Real;
        let wide = ColliderBuilder::cuboid(half, 0.005).translation(at(middle, y));
        wide.density(0.0).friction(0.0)
    };
    let (mut above, mut below) = (Vec::new(), Vec::new());
    match springs {
        Springs::OnePair => {
            above.push(wide(0.005));
            below.push((ground, wide(-0.005)));
        }
        Springs::Feet => {
            above.extend((0..FEET).map(|k| small().translation(place(k, 0.005))));
            below.push((ground, wide(-0.005)));
        }
        Springs::Ground | Springs::Stones => {
            above.push(wide(0.005));
            for k in 0..FEET {
                let stone = match springs {
                    Springs::Ground => ground,
                    _ => world.bodies.insert(RigidBodyBuilder::fixed()),
                };
                below.push((stone, small().translation(place(k, -0.005))));
            }
        }
    }
    // two contacts for each pair of boxes
    let number = f64::from(if springs == Springs::OnePair {
        2
    } else {
        2 * FEET
    });
    let law = (kappa * MASS / (DT * DT) / number, z * MASS / DT / number);
    let own = above.into_iter().map(|collider| (body, collider));
    for (parent, collider) in own.chain(below) {
        let (colliders, bodies) = (&mut world.colliders, &mut world.bodies);
        let collider = colliders.insert_with_parent(collider, parent, bodies);
        let law = SurfaceLaw {
            compliance: (parent == body).then_some(law),
            ..SurfaceLaw::default()
        };
        pipeline.set_surface(collider, law);
    }
    let weight = MASS * GRAVITY * DT;
    let mut found = Vec::new();
    for step in 0..400 {
        let record = pipeline.step(&mut world).unwrap();
        assert_eq!(
            record.unsolved, 0,
            "{springs:?}: residual {}",
            record.residual
        );
        if step >= 380 {
            let load: f64 = record.contacts.iter().map(|c| c.impulse_n).sum();
            found.push(load / weight);
        }
    }
    found
}

/// Bug: springs were counted by pair of colliders. A body on 64 of them rang for ever between two states,
/// as each alone is resolved by the step, and the largest load was right on average alone.
#[test]
fn a_body_comes_to_rest_on_all_its_springs() {
    for springs in [
        Springs::OnePair,
        Springs::Feet,
        Springs::Ground,
        Springs::Stones,
    ] {
        for case in [[13.6, 1.0, 2e-4], [50.0, 1.0, 5e-3], [50.0, 7.4, 2e-4]] {
            let found = loads(springs, case);
            let off = found
                .iter()
                .map(|load| (load - 1.0).abs())
                .fold(0.0, f64::max);
            println!("{springs:?} {case:?}: {off:.1e}");
            assert!(off < 1e-6, "{springs:?} {case:?}: {found:?}");
        }
    }
}
