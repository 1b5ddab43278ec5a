//! Momentum of rapier bodies in one step, symmetries of a pile, and landings.

use crate::common::Random;
use moreau2d::contact::{Vec2, Vec3};
use moreau2d::dynamics::StepperSettings;
use moreau2d::peers::{BodyId, MassSpec, Motion, ShapeSpec, Simulation, Surface};
use moreau2d::rapier::Pose64;

/// What the tests of momentum and symmetry add to a world.
struct World {
    simulation: Simulation,
    bodies: Vec<(BodyId, f64, f64)>,
}

impl World {
    fn new(gravity: Vec2, tolerance: f64) -> World {
        let settings = StepperSettings {
            tolerance,
            ..StepperSettings::default()
        };
        World {
            simulation: Simulation::new(settings, gravity, 1.0 / 120.0).unwrap(),
            bodies: Vec::new(),
        }
    }

    fn fixed(&mut self, pose: Pose64, half: Vec2, surface: &Surface) {
        let shape = ShapeSpec::Box { half };
        self.simulation
            .add_body(Motion::Fixed, pose, Vec3::zeros(), &shape, surface, None)
            .unwrap();
    }

    fn add(&mut self, pose: Pose64, velocity: Vec3, shape: &ShapeSpec, mass: f64, s: &Surface) {
        let inertia = match shape {
            ShapeSpec::Ball { radius } => 0.5 * mass * radius * radius,
            ShapeSpec::Box { half } => mass * half.norm_squared() / 3.0,
            _ => unreachable!(),
        };
        let spec = Some(MassSpec::Given { mass, inertia });
        let (id, _) = self
            .simulation
            .add_body(Motion::Dynamic, pose, velocity, shape, s, spec)
            .unwrap();
        self.bodies.push((id, mass, inertia));
    }
}

/// Every impulse in the record, at the place it gives, makes the change of momentum and spin.
#[test]
fn impulses_of_the_record_make_the_change_of_momentum() {
    let gravity = Vec2::new(0.3, -9.81);
    let surface = Surface {
        restitution: 0.4,
        ..Surface::default()
    };
    let mut world = World::new(gravity, 1e-8);
    world.fixed(
        Pose64::new(Vec2::new(0.0, -1.0), 0.0),
        Vec2::new(20.0, 1.0),
        &surface,
    );
    world.fixed(
        Pose64::new(Vec2::new(3.0, 2.0), 0.4),
        Vec2::new(1.0, 3.0),
        &surface,
    );
    let mut random = Random(8);
    for k in 0..24 {
        let at = Vec2::new(0.7 * f64::from(k % 5) - 1.0, 0.4 + 0.75 * f64::from(k / 5));
        let (shape, mass) = if k % 2 == 0 {
            (ShapeSpec::Ball { radius: 0.3 }, 1.0)
        } else {
            let half = Vec2::new(0.25, 0.3);
            (ShapeSpec::Box { half }, 3.0)
        };
        let velocity = Vec3::new(random.between(-2.0, 2.0), -1.0, random.between(-3.0, 3.0));
        let pose = Pose64::new(at, random.between(-1.0, 1.0));
        world.add(pose, velocity, &shape, mass, &surface);
    }
    let dt = 1.0 / 120.0;
    let mut most = 0;
    for step in 0..150 {
        let s = &world.simulation;
        let before: Vec<(Vec3, Vec2)> = world
            .bodies
            .iter()
            .map(|(id, ..)| (s.velocity(*id).unwrap(), s.pose(*id).unwrap().translation))
            .collect();
        let record = world.simulation.step().unwrap();
        most = most.max(record.contacts.len());
        for ((id, mass, inertia), (u, x)) in world.bodies.iter().zip(&before) {
            let number = world.simulation.number(*id).unwrap();
            let centre = x + u.xy() * (0.5 * dt);
            let (mut push, mut turn) = (gravity * (mass * dt), 0.0);
            let mut size = push.norm() + mass * u.xy().norm();
            for c in &record.contacts {
                for (side, sign) in [(0, -1.0), (1, 1.0)] {
                    if c.bodies[side] == number {
                        let tangent = Vec2::new(-c.normal.y, c.normal.x);
                        let p = (c.normal * c.impulse_n + tangent * c.impulse_t) * sign;
                        push += p;
                        turn += (c.position - centre).perp(&p);
                        size += p.norm();
                    }
                }
            }
            for (_, drag) in record.drag.iter().filter(|(body, _)| *body == number) {
                push += drag.xy();
                turn += drag.z;
            }
            let v = world.simulation.velocity(*id).unwrap();
            // round-off of at most a dozen sums
            let miss = ((v - u).xy() * *mass - push).norm();
            assert!(miss <= 1e-13 * size.max(1.0) * 10.0, "step {step}: {miss}");
            let miss = (inertia * (v.z - u.z) - turn).abs();
            assert!(miss <= 1e-12 * size.max(1.0), "step {step}: {miss}");
        }
    }
    assert!(most > 25, "{most} contacts at once");
}

/// Where a small pile is after half a second, seen in the pile's own frame.
fn pile(angle: f64, offset: Vec2, mirror: bool) -> Vec<(Vec2, f64)> {
    let turn = Pose64::new(offset, angle);
    let flip = if mirror { -1.0 } else { 1.0 };
    let at = |x: f64, y: f64, a: f64| turn.compose(&Pose64::new(Vec2::new(flip * x, y), flip * a));
    let surface = Surface {
        friction: 0.4,
        restitution: 0.2,
        ..Surface::default()
    };
    // a tolerance of 1e-12: the motion must not show how the solver got there
    let mut world = World::new(turn.rotate(Vec2::new(0.0, -9.81)), 1e-12);
    world.fixed(at(0.0, -1.0, 0.0), Vec2::new(5.0, 1.0), &surface);
    world.fixed(at(2.2, 1.0, 0.3), Vec2::new(0.5, 1.5), &surface);
    let bodies = [
        (0.0, 0.45, 0.1, 0.0, 0.0, 0.0, true),
        (0.5, 1.3, -0.2, 1.0, 0.0, 2.0, false),
        (-0.9, 0.8, 0.4, 0.5, -1.0, -1.0, true),
        (1.0, 0.31, 0.0, 1.5, 0.0, -4.0, false),
    ];
    for (x, y, a, vx, vy, w, square) in bodies {
        let v = turn.rotate(Vec2::new(flip * vx, vy));
        let shape = if square {
            let half = Vec2::new(0.4, 0.3);
            ShapeSpec::Box { half }
        } else {
            ShapeSpec::Ball { radius: 0.3 }
        };
        world.add(
            at(x, y, a),
            Vec3::new(v.x, v.y, flip * w),
            &shape,
            1.0,
            &surface,
        );
    }
    for _ in 0..60 {
        let record = world.simulation.step().unwrap();
        assert_eq!(record.unsolved, 0);
    }
    world
        .bodies
        .iter()
        .map(|(id, ..)| {
            let pose = world.simulation.pose(*id).unwrap();
            let place = turn.apply_inverse(pose.translation);
            let twist = (pose.angle() - angle).sin();
            (Vec2::new(flip * place.x, place.y), flip * twist)
        })
        .collect()
}

/// 1e-9 m: half a second of a pile with a dozen impacts grows round-off by some powers of ten.
#[track_caller]
fn assert_same(a: &[(Vec2, f64)], b: &[(Vec2, f64)]) {
    for (k, ((p, s), (q, t))) in a.iter().zip(b).enumerate() {
        assert!((p - q).norm() < 1e-9, "body {k}: {p} {q}");
        assert!((s - t).abs() < 1e-9, "body {k}: {s} {t}");
    }
}

#[test]
fn a_mirrored_pile_falls_like_the_mirror_image() {
    let plain = pile(0.0, Vec2::zeros(), false);
    assert!(plain.iter().all(|(p, _)| p.y < 1.2), "they fell: {plain:?}");
    assert_same(&plain, &pile(0.0, Vec2::zeros(), true));
}

#[test]
fn a_turned_pile_falls_the_same_way() {
    let plain = pile(0.0, Vec2::zeros(), false);
    for angle in [0.3, -2.0, std::f64::consts::FRAC_PI_2] {
        assert_same(&plain, &pile(angle, Vec2::zeros(), false));
    }
}

#[test]
fn a_pile_falls_the_same_way_elsewhere() {
    let plain = pile(0.0, Vec2::zeros(), false);
    assert_same(&plain, &pile(0.0, Vec2::new(30.0, -12.0), false));
}

/// Bug: a contact that closes without having carried a load before (bodies that touch at the
/// start, a velocity set by the user) stands half a step deep at its first midpoint. The staggered
/// rule pushes that out at −g/Δt = |γ_A|/2, so a ball without restitution rebounds with half its
/// speed.
#[test]
fn a_landing_without_restitution_does_not_rebound() {
    let surface = Surface::default();
    let mut world = World::new(Vec2::zeros(), 1e-8);
    world.fixed(
        Pose64::new(Vec2::new(0.0, -1.0), 0.0),
        Vec2::new(5.0, 1.0),
        &surface,
    );
    let ball = ShapeSpec::Ball { radius: 0.5 };
    let pose = Pose64::new(Vec2::new(0.0, 0.5), 0.0);
    world.add(pose, Vec3::new(0.0, -1.0, 0.0), &ball, 1.0, &surface);
    for _ in 0..3 {
        world.simulation.step().unwrap();
        let v = world.simulation.velocity(world.bodies[0].0).unwrap().y;
        assert!(v <= 1e-9, "leaves the floor with {v} m/s");
    }
}
