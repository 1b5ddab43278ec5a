//! Bodies that cross others within a step: nothing passes through that rapier would stop.

use moreau2d::dynamics::Scheme;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, widen};

fn pipeline() -> MoreauPipeline {
    MoreauPipeline::new(MoreauSettings::default()).unwrap()
}

fn empty() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    world
}

fn bullet(x: Real, y: Real, speed: Real) -> RigidBodyBuilder {
    let body = RigidBodyBuilder::dynamic().translation(Vector::new(x, y));
    body.linvel(Vector::new(speed, 0.0)).ccd_enabled(true)
}

/// Steps both ways: with ours and with rapier's own; the same world twice.
fn both(build: impl Fn() -> PhysicsWorld, steps: usize) -> [PhysicsWorld; 2] {
    let (mut ours, mut theirs) = (build(), build());
    let mut p = pipeline();
    for _ in 0..steps {
        let record = p.step(&mut ours).unwrap();
        assert_eq!(record.unsolved, 0);
        let scale = record.energy.kinetic_start.max(1.0);
        assert!(record.energy.imbalance().abs() < 1e-9 * scale);
        theirs.step();
    }
    [ours, theirs]
}

const SPEEDS: [Real; 6] = [20.0, 57.3, 100.0, 333.0, 700.0, 1000.0];

/// Offsets of the start, so that a step ends before, in and behind the wall.
const STARTS: [Real; 5] = [-3.0, -3.37, -3.81, -4.13, -5.9];

/// At 1000 m/s and 1/60 a step is 16.7 m; the wall is 1 cm.
#[test]
fn bullets_stop_at_thin_walls() {
    let mut stopped = 0;
    for fixed in [true, false] {
        for (speed, start) in SPEEDS.iter().flat_map(|v| STARTS.map(|x| (*v, x))) {
            let mut world = empty();
            let wall = if fixed {
                RigidBodyBuilder::fixed()
            } else {
                RigidBodyBuilder::dynamic()
            };
            let plate = ColliderBuilder::cuboid(0.005, 4.0)
                .density(1e6)
                .restitution(0.0);
            let (wall, _) = world.insert(wall, plate);
            let ball = ColliderBuilder::ball(0.05).restitution(0.0);
            let (ball, _) = world.insert(bullet(start, 0.3, speed), ball);
            let mut p = pipeline();
            for _ in 0..40 {
                let record = p.step(&mut world).unwrap();
                assert_eq!(record.unsolved, 0);
                let ahead =
                    p.pose(wall).unwrap().translation.x - p.pose(ball).unwrap().translation.x;
                assert!(
                    ahead > 0.0549,
                    "{speed} m/s from {start}, fixed {fixed}: {ahead}"
                );
            }
            stopped += 1;
        }
    }
    assert_eq!(stopped, 60);
}

/// A bar 2 cm thin that turns with 10 rad/s, its ends at 20 m/s, and a bullet that it meets: it
/// never gets to the other side of the bar within its reach.
#[test]
fn bullets_do_not_cross_a_bar_that_turns_fast() {
    for (spin, speed) in [(5.0, 30.0), (10.0, 200.0), (-10.0, 100.0), (10.0, 1.0)] {
        for start in STARTS {
            let mut world = empty();
            let bar = RigidBodyBuilder::kinematic_velocity_based().angvel(spin);
            let (bar, _) = world.insert(bar, ColliderBuilder::cuboid(2.0, 0.01));
            let ball = ColliderBuilder::ball(0.1).restitution(0.0);
            let (ball, _) = world.insert(bullet(start, 0.7, speed), ball);
            let mut p = pipeline();
            let mut side = None;
            for k in 0..60 {
                p.step(&mut world).unwrap();
                let at = p.pose(bar).unwrap();
                let local = at.apply_inverse(p.pose(ball).unwrap().translation);
                let now = local.y.signum();
                if local.x.abs() < 1.9 && local.y.abs() < 0.5 {
                    let what = format!("{spin} rad/s, {speed} m/s from {start}, step {k}");
                    if let Some(before) = side {
                        assert_eq!(now, before, "{what}: {local}");
                    }
                    side = Some(now);
                } else {
                    side = None;
                }
            }
        }
    }
}

/// Head on, rapier's bullets do not see each other; ours do.
#[test]
fn bullets_meet_each_other() {
    for speed in SPEEDS {
        for start in STARTS {
            let mut world = empty();
            let ball = || ColliderBuilder::ball(0.05).restitution(1.0).friction(0.0);
            let (a, _) = world.insert(bullet(start, 0.0, speed), ball());
            let (b, _) = world.insert(bullet(2.0, 0.0, -0.5 * speed), ball());
            let mut p = pipeline();
            for _ in 0..30 {
                p.step(&mut world).unwrap();
            }
            let (ua, ub) = (p.velocity(a).unwrap(), p.velocity(b).unwrap());
            let v = widen(speed);
            assert!((ua.x + 0.5 * v).abs() < 1e-9 * v, "{speed} {start}: {ua}");
            assert!((ub.x - v).abs() < 1e-9 * v, "{speed} {start}: {ub}");
        }
    }
}

/// A bounce between two walls many times a step keeps its energy.
#[test]
fn a_bullet_in_a_box_keeps_its_energy() {
    let mut world = empty();
    let wall = || {
        ColliderBuilder::cuboid(0.01, 1.0)
            .restitution(1.0)
            .friction(0.0)
    };
    for x in [-1.0, 1.0] {
        let at = RigidBodyBuilder::fixed().translation(Vector::new(x, 0.0));
        world.insert(at, wall());
    }
    let ball = ColliderBuilder::ball(0.05).restitution(1.0).friction(0.0);
    let (ball, _) = world.insert(bullet(0.1, 0.0, 1000.0), ball);
    let mut p = pipeline();
    for _ in 0..30 {
        p.step(&mut world).unwrap();
        let x = p.pose(ball).unwrap().translation.x;
        assert!(x.abs() < 0.9401, "{x}");
        assert!((p.velocity(ball).unwrap().x.abs() - 1000.0).abs() < 1e-9);
    }
}

/// Soft prediction is what every pair of ours has: with it or without it the same happens.
#[test]
fn soft_prediction_changes_nothing() {
    let run = |prediction: Real| {
        let mut world = empty();
        world.insert(
            RigidBodyBuilder::fixed(),
            ColliderBuilder::cuboid(0.02, 4.0),
        );
        let body = bullet(-3.3, 0.2, 40.0).ccd_enabled(false);
        let ball = ColliderBuilder::ball(0.3);
        let (ball, _) = world.insert(body.soft_ccd_prediction(prediction), ball);
        let mut p = pipeline();
        for _ in 0..30 {
            p.step(&mut world).unwrap();
        }
        p.pose(ball).unwrap()
    };
    assert_eq!(run(0.0), run(2.0));
    assert!(run(2.0).translation.x < -0.3);
}

/// Without any flag, rapier sweeps fast bodies against fixed ones.
#[test]
fn nothing_passes_a_wall_that_rapier_would_stop() {
    let (mut tried, mut held) = (0, 0);
    for speed in [20.0, 40.0, 80.0, 120.0, 200.0] {
        for thickness in [0.05, 0.1, 0.3, 1.0] {
            for start in STARTS {
                for shape in 0..3 {
                    let build = || {
                        let mut world = empty();
                        let wall = ColliderBuilder::cuboid(0.5 * thickness, 5.0);
                        world.insert(RigidBodyBuilder::fixed(), wall);
                        let body = bullet(start, 0.3, speed).ccd_enabled(false);
                        let shape = match shape {
                            0 => ColliderBuilder::ball(0.1),
                            1 => ColliderBuilder::cuboid(0.15, 0.1),
                            _ => ColliderBuilder::capsule_y(0.2, 0.1),
                        };
                        world.insert(body, shape);
                        world
                    };
                    let [ours, theirs] = both(build, 40).map(|world| {
                        let body = world.bodies.iter().find(|(_, b)| b.is_dynamic());
                        body.unwrap().1.translation().x < 0.0
                    });
                    tried += 1;
                    held += usize::from(theirs);
                    let what = format!("{speed} m/s, {thickness} m, from {start}, shape {shape}");
                    assert!(ours || !theirs, "{what}");
                }
            }
        }
    }
    assert!(held > tried / 2, "{held} of {tried}");
}

/// A stick that turns fast and falls onto a thin floor.
#[test]
fn nothing_turns_through_a_floor_that_rapier_would_hold() {
    let mut held = 0;
    for spin in [10.0, 40.0, 80.0] {
        for fall in [5.0, 30.0, 90.0] {
            for thickness in [0.05, 0.3] {
                for height in [1.5, 1.73, 2.2] {
                    let build = || {
                        let mut world = PhysicsWorld::new();
                        let floor = ColliderBuilder::cuboid(20.0, 0.5 * thickness);
                        world.insert(RigidBodyBuilder::fixed(), floor);
                        let stick = RigidBodyBuilder::dynamic()
                            .translation(Vector::new(0.0, height))
                            .linvel(Vector::new(0.0, -fall))
                            .angvel(spin);
                        world.insert(stick, ColliderBuilder::cuboid(1.0, 0.04));
                        world
                    };
                    let [ours, theirs] = both(build, 90).map(|world| {
                        let body = world.bodies.iter().find(|(_, b)| b.is_dynamic());
                        body.unwrap().1.translation().y > -0.1
                    });
                    held += usize::from(theirs);
                    let what = format!("{spin} rad/s, {fall} m/s, {thickness} m, from {height}");
                    assert!(ours || !theirs, "{what}");
                }
            }
        }
    }
    assert!(held > 10, "{held}");
}

/// The published rule knows no gaps.
#[test]
fn the_published_scheme_follows_nothing() {
    let mut settings = MoreauSettings::default();
    settings.stepper.scheme = Scheme::Moreau;
    let mut p = MoreauPipeline::new(settings).unwrap();
    let mut world = empty();
    world.insert(bullet(0.0, 0.0, 1.0), ColliderBuilder::ball(0.1));
    let error = p.step(&mut world).unwrap_err().to_string();
    assert!(
        error.contains("body 0") && error.contains("'moreau'"),
        "{error}"
    );
}
