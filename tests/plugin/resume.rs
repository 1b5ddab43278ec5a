//! A pipeline saved as text and resumed goes on bit for bit, and the same run gives the same bytes.

use crate::common::load;
use moreau2d::contact::{Vec2, Vec3};
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{
    ExactBody, MoreauPipeline, MoreauSettings, PipelineState, Pose64, StateError, SurfaceLaw,
};

type Scene = (&'static str, fn() -> (PhysicsWorld, MoreauPipeline));

fn pipeline(events: bool) -> MoreauPipeline {
    let mut settings = MoreauSettings::default();
    settings.stepper.events = events;
    MoreauPipeline::new(settings).unwrap()
}

fn grounded() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    world.insert(
        RigidBodyBuilder::fixed().translation(Vector::new(0.0, -0.5)),
        ColliderBuilder::cuboid(20.0, 0.5),
    );
    world
}

fn at(x: Real, y: Real) -> RigidBodyBuilder {
    RigidBodyBuilder::dynamic().translation(Vector::new(x, y))
}

/// A heap of all kinds of shapes, dropped.
fn heap(world: &mut PhysicsWorld, restitution: Real) -> Vec<RigidBodyHandle> {
    (0..24)
        .map(|k| {
            let body = at(0.37 * (k % 5) as Real, 0.6 + 0.7 * (k / 5) as Real);
            let shape = match k % 4 {
                0 => ColliderBuilder::ball(0.3),
                1 => ColliderBuilder::cuboid(0.3, 0.2),
                2 => ColliderBuilder::capsule_x(0.2, 0.15),
                _ => ColliderBuilder::round_cuboid(0.2, 0.2, 0.05),
            };
            let body = body.rotation(0.2 * k as Real);
            world.insert(body, shape.restitution(restitution)).0
        })
        .collect()
}

fn pyramid(world: &mut PhysicsWorld) {
    for row in 0..6 {
        for k in 0..6 - row {
            let x = k as Real + 0.5 * row as Real;
            let square = ColliderBuilder::cuboid(0.4, 0.4);
            world.insert(at(x, 0.4 + 0.8 * row as Real), square);
        }
    }
}

const SCENES: [Scene; 11] = [
    ("a heap", || {
        let mut world = grounded();
        heap(&mut world, 0.0);
        (world, pipeline(false))
    }),
    ("a heap that bounces, with events", || {
        let mut world = grounded();
        heap(&mut world, 0.7);
        (world, pipeline(true))
    }),
    // 30 steps of rest
    ("a pyramid that sleeps", || {
        let mut world = grounded();
        pyramid(&mut world);
        (world, pipeline(false))
    }),
    ("a pyramid asleep that is hit", || {
        let mut world = grounded();
        pyramid(&mut world);
        let ball = at(-9.0, 0.5).linvel(Vector::new(8.0, 0.0));
        world.insert(ball, ColliderBuilder::ball(0.5).friction(0.0));
        (world, pipeline(false))
    }),
    ("a chain with a motor", || {
        let mut world = grounded();
        let (mut last, _) = world.insert(
            RigidBodyBuilder::fixed().translation(Vector::new(0.0, 8.0)),
            ColliderBuilder::ball(0.05).sensor(true),
        );
        for k in 0..5 {
            let (link, _) =
                world.insert(at(0.5 + k as Real, 8.0), ColliderBuilder::cuboid(0.4, 0.1));
            let joint = RevoluteJointBuilder::new()
                .local_anchor1(Vector::new(if k == 0 { 0.0 } else { 0.5 }, 0.0))
                .local_anchor2(Vector::new(-0.5, 0.0))
                .contacts_enabled(false);
            let driven = joint.motor_velocity(2.0, 1e6).motor_max_force(5.0);
            world.insert_impulse_joint(last, link, if k == 0 { driven } else { joint });
            last = link;
        }
        (world, pipeline(false))
    }),
    ("a plate that is driven", || {
        let mut world = grounded();
        world.insert(
            RigidBodyBuilder::kinematic_velocity_based()
                .translation(Vector::new(0.0, 0.3))
                .linvel(Vector::new(0.7, 0.0))
                .angvel(0.1),
            ColliderBuilder::cuboid(3.0, 0.1),
        );
        heap(&mut world, 0.2);
        (world, pipeline(false))
    }),
    ("what started overlapped", || {
        let mut world = grounded();
        for k in 0..5 {
            let square = ColliderBuilder::cuboid(0.4, 0.4);
            world.insert(at(0.1 * k as Real, 0.3 + 0.6 * k as Real), square);
        }
        (world, pipeline(false))
    }),
    ("bullets, dominance, damping", || {
        let mut world = grounded();
        for (k, body) in heap(&mut world, 0.3).into_iter().enumerate() {
            let body = &mut world.bodies[body];
            body.set_dominance_group((k % 3) as i8);
            body.set_linear_damping(0.1 * (k % 2) as Real);
            body.enable_ccd(k % 4 == 0);
        }
        let shot = at(-30.0, 0.7)
            .linvel(Vector::new(60.0, 1.0))
            .ccd_enabled(true);
        world.insert(shot, ColliderBuilder::ball(0.1));
        (world, pipeline(false))
    }),
    ("exact masses and places, a belt that yields", || {
        let mut world = grounded();
        let floor = world.colliders.iter().next().unwrap().0;
        let mut p = pipeline(false);
        p.set_surface(
            floor,
            SurfaceLaw {
                compliance: Some((1e5, 100.0)),
                speed: 0.3,
                ..SurfaceLaw::default()
            },
        );
        for (k, body) in heap(&mut world, 0.0).into_iter().enumerate() {
            let mass = 0.1 + 1.0 / (3.0 + k as f64);
            let exact = ExactBody {
                mass,
                inertia: mass / 7.0,
            };
            p.set_exact_mass(body, exact).unwrap();
            let pose = Pose64::new(Vec2::new(0.1 * k as f64 / 3.0, 1.0 + 0.7 * k as f64), 0.1);
            let velocity = Vec3::new(1.0 / 3.0, 0.0, 0.1);
            p.place(&mut world, body, pose, velocity).unwrap();
        }
        (world, p)
    }),
    ("a column at rest, hit after a second", || {
        let mut world = grounded();
        for k in 0..3 {
            world.insert(at(0.0, 0.5 + k as Real), ColliderBuilder::cuboid(0.5, 0.5));
        }
        world.insert(at(0.2, 10.0), ColliderBuilder::ball(0.3));
        let settings = MoreauSettings {
            stay_awake: true,
            ..MoreauSettings::default()
        };
        (world, MoreauPipeline::new(settings).unwrap())
    }),
    ("an arch of wedges, redundant", || {
        let mut world = grounded();
        for k in 0..9 {
            let square = ColliderBuilder::cuboid(0.5, 0.2).friction(1.0);
            world.insert(at(0.05 * (k % 2) as Real, 0.2 + 0.4 * k as Real), square);
        }
        (world, pipeline(false))
    }),
];

/// The same world in other memory.
fn copy(world: &PhysicsWorld) -> PhysicsWorld {
    let mut copy = PhysicsWorld::new();
    copy.gravity = world.gravity;
    copy.integration_parameters = world.integration_parameters;
    copy.islands = world.islands.clone();
    copy.bodies = world.bodies.clone();
    copy.colliders = world.colliders.clone();
    copy.impulse_joints = world.impulse_joints.clone();
    copy
}

/// All that moves, to the last bit, and what the step said.
fn bits(p: &MoreauPipeline, world: &PhysicsWorld, record: impl std::fmt::Debug) -> Vec<u64> {
    let mut out: Vec<u64> = format!("{record:?}").bytes().map(u64::from).collect();
    for (handle, body) in world.bodies.iter() {
        let (Some(pose), Some(u)) = (p.pose(handle), p.velocity(handle)) else {
            continue;
        };
        let at = pose.translation;
        out.extend([at.x, at.y, pose.cos, pose.sin, u.x, u.y, u.z].map(f64::to_bits));
        out.push(u64::from(body.is_sleeping()));
        out.push(f64::from(body.translation().x).to_bits());
    }
    out
}

fn resume_and_compare(name: &str, restore: impl Fn(&PhysicsWorld) -> PhysicsWorld) {
    let (_, build) = SCENES.iter().find(|s| s.0 == name).unwrap();
    let (mut world, mut p) = build();
    let mut met = 0;
    for _ in 0..37 {
        let record = p.step(&mut world).unwrap();
        met += record.contacts.len() + usize::from(record.energy.kinetic_end > 0.0);
    }
    let text = serde_json::to_string(&p.state()).unwrap();
    let mut other = restore(&world);
    let state: PipelineState = serde_json::from_str(&text).unwrap();
    let mut resumed = MoreauPipeline::resume(&state, &mut other).unwrap();
    // saved again it is the same text
    assert_eq!(
        serde_json::to_string(&resumed.state()).unwrap(),
        text,
        "{name}"
    );
    for step in 0..100 {
        let one = p.step(&mut world).unwrap();
        let one = bits(&p, &world, one);
        let two = resumed.step(&mut other).unwrap();
        assert!(one == bits(&resumed, &other, two), "{name}: step {step}");
    }
    assert!(
        met > 0 || name == "a pyramid that sleeps",
        "{name}: nothing met"
    );
}

#[test]
fn what_is_resumed_goes_on_bit_for_bit() {
    for (name, _) in SCENES {
        resume_and_compare(name, copy);
    }
}

/// Bug: a state saved after a body was removed could not be resumed. What rested on the body that is gone falls,
/// as it does without the pause.
#[test]
fn a_body_removed_before_saving_is_not_missed() {
    for ((name, build), steps) in SCENES.iter().flat_map(|s| [3, 37, 90].map(|n| (s, n))) {
        let (mut world, mut p) = build();
        for _ in 0..steps {
            p.step(&mut world).unwrap();
        }
        let first = |world: &PhysicsWorld| {
            let mut bodies = world.bodies.iter();
            bodies.find(|(_, body)| body.is_dynamic()).unwrap().0
        };
        let gone = first(&world);
        world.remove_body(gone);
        let mut other = copy(&world);
        let text = serde_json::to_string(&p.state_in(&world)).unwrap();
        let state: PipelineState = serde_json::from_str(&text).unwrap();
        let mut resumed = MoreauPipeline::resume(&state, &mut other).unwrap();
        for step in 0..60 {
            let one = p.step(&mut world).unwrap();
            let one = bits(&p, &world, one);
            let two = resumed.step(&mut other).unwrap();
            let two = bits(&resumed, &other, two);
            assert!(one == two, "{name}, {steps} steps: step {step}");
        }
    }
}

/// Which islands are crowds is part of the state; threads change nothing.
#[test]
fn a_jammed_heap_is_resumed_bit_for_bit() {
    let mut built = load("box-drum", &[]).build().unwrap();
    let simulation = built.simulation_mut().unwrap();
    let (world, p) = (&mut simulation.world, &mut simulation.pipeline);
    let gave_way: usize = (0..6).map(|_| p.step(world).unwrap().crowds).sum();
    assert!(gave_way > 0);
    let text = serde_json::to_string(&p.state()).unwrap();
    let crowds = &serde_json::to_value(p.state()).unwrap()["stepper"]["islands"]["crowds"];
    assert!(!crowds.as_array().unwrap().is_empty(), "{crowds}");
    let mut other = copy(world);
    let mut resumed =
        MoreauPipeline::resume(&serde_json::from_str(&text).unwrap(), &mut other).unwrap();
    resumed.set_threads(2).unwrap();
    for step in 0..4 {
        let one = p.step(world).unwrap();
        let one = bits(p, world, one);
        let two = resumed.step(&mut other).unwrap();
        assert!(one == bits(&resumed, &other, two), "step {step}");
    }
}

/// What the user changes between resuming and the first step ends the rest of a pile.
#[test]
fn a_change_after_resuming_counts() {
    let (mut world, mut p) = SCENES[9].1();
    (0..60).for_each(|_| assert_eq!(p.step(&mut world).unwrap().unsolved, 0));
    assert_eq!(p.step(&mut world).unwrap().resting, 1);
    let state = p.state();
    for change in 0..3 {
        let mut other = copy(&world);
        let mut resumed = MoreauPipeline::resume(&state, &mut other).unwrap();
        let (floor, _) = other.colliders.iter().next().unwrap();
        match change {
            0 => {}
            1 => other.colliders[floor].set_friction(0.1),
            _ => drop(other.remove_collider(floor)),
        }
        let record = resumed.step(&mut other).unwrap();
        // the ball is still on its way
        let carried = record.contacts.iter().any(|c| c.bodies.contains(&0));
        assert_eq!(
            (record.resting == 1, carried),
            (change == 0, change < 2),
            "{change}"
        );
    }
}

/// With rapier's own serialisation of the world.
#[cfg(feature = "serde-serialize")]
#[test]
fn a_world_saved_as_text_goes_on_bit_for_bit() {
    for (name, _) in SCENES {
        resume_and_compare(name, |world| {
            let text = serde_json::to_string(world).unwrap();
            serde_json::from_str(&text).unwrap()
        });
    }
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    for (name, build) in SCENES {
        let run = || {
            let (mut world, mut p) = build();
            let mut all = Vec::new();
            for _ in 0..60 {
                let record = p.step(&mut world).unwrap();
                all.extend(bits(&p, &world, record));
            }
            (all, serde_json::to_string(&p.state()).unwrap())
        };
        let (one, two) = (run(), run());
        assert!(one == two, "{name}");
        assert!(one.0.len() > 1000);
    }
}

#[test]
fn states_that_do_not_fit_are_refused() {
    let (mut world, mut p) = SCENES[0].1();
    p.step(&mut world).unwrap();
    let text = serde_json::to_string(&p.state()).unwrap();
    let changed = |from: &str, to: &str| -> PipelineState {
        assert!(text.contains(from));
        serde_json::from_str(&text.replacen(from, to, 1)).unwrap()
    };
    let older = changed("\"version\":8", "\"version\":3");
    let error = MoreauPipeline::resume(&older, &mut world).err().unwrap();
    assert!(
        matches!(error, StateError::Version { found: 3, .. }),
        "{error}"
    );
    let precision = format!("\"{}\"", moreau2d::rapier::PRECISION);
    let other = changed(&precision, "\"f16\"");
    let error = MoreauPipeline::resume(&other, &mut world).err().unwrap();
    assert!(matches!(error, StateError::Precision { .. }), "{error}");
    let solver = changed("\"solver\":\"auto\"", "\"solver\":\"otto\"");
    let error = MoreauPipeline::resume(&solver, &mut world).err().unwrap();
    assert!(error.to_string().contains("otto"), "{error}");
    let state: PipelineState = serde_json::from_str(&text).unwrap();
    let body = world.bodies.iter().last().unwrap().0;
    world.remove_body(body);
    let error = MoreauPipeline::resume(&state, &mut world).err().unwrap();
    assert!(error.to_string().contains("not in the world"), "{error}");
}

struct OneWay;

impl PhysicsHooks for OneWay {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext) {
        context.update_as_oneway_platform(Vector::Y, 0.1);
    }
}

/// Half way through a platform it depends on where it came from whether it is let pass.
#[test]
fn who_is_half_way_through_a_one_way_platform_goes_on() {
    let mut world = PhysicsWorld::new();
    let platform =
        ColliderBuilder::cuboid(5.0, 0.1).active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
    world.insert(RigidBodyBuilder::fixed(), platform);
    let rising = at(0.0, -1.5).linvel(Vector::new(0.0, 8.0));
    world.insert(rising, ColliderBuilder::cuboid(0.5, 0.5));
    let mut p = pipeline(false);
    let height = |p: &MoreauPipeline| p.pose(p.body(1).unwrap()).unwrap().translation.y;
    for _ in 0..60 {
        p.step_with_events(&mut world, &OneWay, &()).unwrap();
        if height(&p) > 0.2 {
            break;
        }
    }
    assert!(height(&p) < 0.5);
    let text = serde_json::to_string(&p.state()).unwrap();
    assert!(!text.contains("\"marks\":[]"), "{text}");
    let mut other = copy(&world);
    let state: PipelineState = serde_json::from_str(&text).unwrap();
    let mut resumed = MoreauPipeline::resume(&state, &mut other).unwrap();
    assert_eq!(serde_json::to_string(&resumed.state()).unwrap(), text);
    let mut top: f64 = 0.0;
    for step in 0..120 {
        let one = p.step_with_events(&mut world, &OneWay, &()).unwrap();
        let two = resumed.step_with_events(&mut other, &OneWay, &()).unwrap();
        let (one, two) = (bits(&p, &world, one), bits(&resumed, &other, two));
        assert!(one == two, "step {step}");
        top = top.max(height(&p));
    }
    assert!(top > 1.0 && (height(&p) - 0.6).abs() < 1e-4, "{top}");
}
