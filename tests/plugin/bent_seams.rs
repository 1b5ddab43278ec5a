//! One body slides over a smooth chain of segments: whether the chain or the outline has one side or two makes no
//! difference, since the body comes from above.

use crate::common::at;
use crate::common::series::Series;
use moreau2d::dynamics::StepperSettings;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};

/// Largest loss of energy in a step \[J\], of a body of 1 kg, after the first half second.
fn largest_loss(seed: u64, two_sided_body: bool, two_sided_floor: bool) -> f64 {
    let mut series = Series(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    for _ in 0..4 {
        series.next();
    }
    let events = series.next() < 0.5;
    let dt = [1.0 / 60.0, 1.0 / 120.0, 1.0 / 240.0][(3.0 * series.next()) as usize];
    let wave = if series.next() < 0.5 { 0.1 } else { 0.0 };
    let height = |x: f64| wave * (1.3 * x).sin() + 0.04 * x * x;
    let mut line: Vec<Vector> = (0..25)
        .map(|i| 0.5 * f64::from(i) - 6.0)
        .map(|x| at(x, height(x)))
        .collect();
    let corners = 3 + (4.0 * series.next()) as u32;
    let size = series.within(0.24, 0.54);
    let outline = (0..corners).map(|k| {
        let turn = (f64::from(k) + 0.3 * series.next()) / f64::from(corners);
        let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
        at(size * cos, size * sin)
    });
    let outline: Vec<Vector> = outline.collect();
    let ring = Some((0..corners).map(|k| [k, (k + 1) % corners]).collect());
    let collider = match two_sided_body {
        true => ColliderBuilder::polyline(outline, ring),
        false => ColliderBuilder::oriented_polyline(outline, ring),
    };
    let floor = match two_sided_floor {
        true => ColliderBuilder::polyline(line, None),
        false => {
            line.reverse();
            ColliderBuilder::oriented_polyline(line, None)
        }
    };
    let mut world = PhysicsWorld::new();
    world.gravity = at(0.0, -9.81);
    world.insert(RigidBodyBuilder::fixed(), floor.friction(0.0));
    let x = series.within(-3.0, 3.0);
    let body = RigidBodyBuilder::dynamic()
        .translation(at(x, height(x) + 1.0))
        .rotation(series.within(-3.0, 3.0) as Real)
        .linvel(at(series.within(-3.0, 3.0), series.within(-3.0, 0.0)))
        .angvel(series.within(-5.0, 5.0) as Real)
        .additional_mass_properties(MassProperties::new(Vector::ZERO, 1.0, 0.03))
        .can_sleep(false);
    let (body, _) = world.insert(body, collider.density(0.0).friction(0.0));
    let settings = MoreauSettings {
        stepper: StepperSettings {
            events,
            ..StepperSettings::default()
        },
        dt: Some(dt),
        ..MoreauSettings::default()
    };
    let mut pipeline = MoreauPipeline::new(settings).unwrap();
    let (mut last, mut most) = (f64::INFINITY, 0.0f64);
    for step in 0..(2.5 / dt) as usize {
        pipeline.step(&mut world).unwrap();
        let (pose, u) = (
            pipeline.pose(body).unwrap(),
            pipeline.velocity(body).unwrap(),
        );
        let moves = 0.5 * (u.x * u.x + u.y * u.y + 0.03 * u.z * u.z);
        let energy = moves + 9.81 * pose.translation.y;
        if step as f64 * dt > 0.5 {
            most = most.max(last - energy);
        }
        last = energy;
    }
    most
}

/// Open: 35 of 120 bodies stop at a bend. The side of a chain is decided for each of its segments alone, and one of
/// them is then met from below.
/// `cargo test --release --test plugin -- --ignored bends --nocapture`
#[test]
#[ignore = "open: two-sided chains stop bodies at their bends"]
fn nothing_stops_at_the_bends_of_a_smooth_chain() {
    let mut stopped = Vec::new();
    for seed in 0..40 {
        let solid = largest_loss(seed, false, false);
        for (body, floor) in [(false, true), (true, false), (true, true)] {
            let loss = largest_loss(seed, body, floor);
            if loss > 2.0 * solid + 0.3 {
                println!(
                    "{seed}, body two-sided {body}, floor {floor}: {loss:.3} J, solid {solid:.3} J"
                );
                stopped.push(seed);
            }
        }
    }
    assert!(
        stopped.is_empty(),
        "{} of 120 stop: {stopped:?}",
        stopped.len()
    );
}
