//! The user's hooks, sensors and events: the same calls as rapier's own step makes, with our
//! impulses.

use crate::common::at;
use moreau2d::dynamics::record::StepRecord;
use moreau2d::rapier::engine::geometry::{ContactPair, SolverFlags};
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
use std::sync::Mutex;

const DT: f64 = 1.0 / 60.0;
const G: f64 = 9.81;

fn pipeline() -> MoreauPipeline {
    MoreauPipeline::new(MoreauSettings {
        dt: Some(DT),
        stay_awake: true,
        ..MoreauSettings::default()
    })
    .unwrap()
}

fn floor() -> (RigidBodyBuilder, ColliderBuilder) {
    let body = RigidBodyBuilder::fixed().translation(at(0.0, -0.5));
    (body, ColliderBuilder::cuboid(20.0, 0.5))
}

fn free(x: f64, y: f64) -> RigidBodyBuilder {
    RigidBodyBuilder::dynamic()
        .translation(at(x, y))
        .can_sleep(false)
}

fn square() -> ColliderBuilder {
    ColliderBuilder::cuboid(0.5, 0.5)
}

// --- hooks ------------------------------------------------------------------------------------

struct Filter {
    answer: Option<SolverFlags>,
}

impl PhysicsHooks for Filter {
    fn filter_contact_pair(&self, context: &PairFilterContext) -> Option<SolverFlags> {
        assert!(context.colliders.get(context.collider1).is_some());
        assert!(context.rigid_body2.is_some());
        self.answer
    }
}

#[test]
fn a_filter_lets_pass_what_it_forbids() {
    for (answer, falls) in [
        (Some(SolverFlags::COMPUTE_RIGID_IMPULSES), false),
        (Some(SolverFlags::empty()), true),
        (None, true),
    ] {
        let mut world = PhysicsWorld::new();
        let (ground, slab) = floor();
        world.insert(ground, slab);
        let hooked = square().active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS);
        let (body, _) = world.insert(free(0.0, 0.5), hooked);
        let mut pipeline = pipeline();
        for _ in 0..30 {
            let hooks = Filter { answer };
            pipeline.step_with_events(&mut world, &hooks, &()).unwrap();
        }
        let y = pipeline.pose(body).unwrap().translation.y;
        assert_eq!(y < 0.4, falls, "{answer:?}: {y}");
    }
}

/// One-way platforms as rapier's own example makes them.
struct OneWay {
    platform: ColliderHandle,
}

impl PhysicsHooks for OneWay {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext) {
        let up = if context.collider1 == self.platform {
            Vector::Y
        } else {
            -Vector::Y
        };
        context.update_as_oneway_platform(up, 0.1);
    }
}

#[test]
fn a_one_way_platform_is_passed_from_below_and_carries_from_above() {
    let mut world = PhysicsWorld::new();
    let hooked =
        ColliderBuilder::cuboid(5.0, 0.1).active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
    let (_, platform) = world.insert(RigidBodyBuilder::fixed(), hooked);
    let rising = free(0.0, -1.5).linvel(at(0.0, 8.0)).lock_rotations();
    let (rising, _) = world.insert(rising, square());
    let (falling, _) = world.insert(free(2.0, 2.0).lock_rotations(), square());
    let mut pipeline = pipeline();
    let hooks = OneWay { platform };
    let mut top: f64 = 0.0;
    for step in 0..240 {
        let record = pipeline.step_with_events(&mut world, &hooks, &()).unwrap();
        assert_eq!(record.unsolved, 0);
        if step < 6 {
            // nothing holds it back on its way up
            let free = 8.0 - G * DT * f64::from(step + 1);
            let v = pipeline.velocity(rising).unwrap().y;
            assert!((v - free).abs() < 1e-5, "step {step}: {v} for {free}");
        }
        top = top.max(pipeline.pose(rising).unwrap().translation.y);
    }
    assert!(top > 1.0, "{top}");
    for body in [rising, falling] {
        let y = pipeline.pose(body).unwrap().translation.y;
        assert!((y - 0.6).abs() < 1e-4, "{y}");
    }
}

/// A surface that runs, a surface that is slippery, a contact that is taken away.
struct Belt {
    velocity: Vector,
    friction: Option<Real>,
    restitution: Option<Real>,
    clear: bool,
}

impl PhysicsHooks for Belt {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext) {
        let rigid = context.rigid_mut().unwrap();
        for contact in rigid.solver_contacts.iter_mut() {
            contact.tangent_velocity = self.velocity;
        }
        if let Some(friction) = self.friction {
            *rigid.friction = friction;
        }
        if let Some(restitution) = self.restitution {
            *rigid.restitution = restitution;
        }
        if self.clear {
            rigid.solver_contacts.clear();
        }
    }
}

const STILL: Belt = Belt {
    velocity: Vector::ZERO,
    friction: None,
    restitution: None,
    clear: false,
};

fn on_a_hooked_floor(hooks: &Belt, start: Vector, steps: usize) -> [f64; 2] {
    let speed = |ours: bool| {
        let mut world = PhysicsWorld::new();
        let (ground, slab) = floor();
        let hooked = slab
            .friction(0.5)
            .active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
        world.insert(ground, hooked);
        let body = free(0.0, 0.5).linvel(start).lock_rotations();
        let (body, _) = world.insert(body, square().friction(0.5));
        let mut pipeline = pipeline();
        for _ in 0..steps {
            if ours {
                pipeline.step_with_events(&mut world, hooks, &()).unwrap();
            } else {
                world.step_with_events(hooks, &());
            }
        }
        f64::from(world.bodies[body].linvel().x)
    };
    [speed(true), speed(false)]
}

#[test]
fn a_tangent_velocity_drives_as_in_rapier() {
    let hooks = Belt {
        velocity: at(2.0, 0.0),
        ..STILL
    };
    let [ours, rapiers] = on_a_hooked_floor(&hooks, Vector::ZERO, 120);
    assert!(rapiers.abs() > 1.5, "{rapiers}");
    assert!((ours.abs() - 2.0).abs() < 1e-6, "{ours}");
    assert_eq!(ours.signum(), rapiers.signum(), "{ours} and {rapiers}");
}

#[test]
fn a_hook_sets_friction_and_takes_contacts_away() {
    let ice = Belt {
        friction: Some(0.1),
        ..STILL
    };
    let [ours, _] = on_a_hooked_floor(&ice, at(3.0, 0.0), 60);
    let expected = 3.0 - 0.1 * G;
    assert!((ours - expected).abs() < 1e-5, "{ours} for {expected}");

    let open = Belt {
        clear: true,
        ..STILL
    };
    let [ours, _] = on_a_hooked_floor(&open, at(3.0, 0.0), 30);
    assert!((ours - 3.0).abs() < 1e-6, "{ours}");
}

#[test]
fn a_hook_sets_restitution() {
    let mut world = PhysicsWorld::new();
    let (ground, slab) = floor();
    world.insert(
        ground,
        slab.active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS),
    );
    let (ball, _) = world.insert(free(0.0, 1.5), ColliderBuilder::ball(0.5));
    let bouncy = Belt {
        restitution: Some(1.0),
        ..STILL
    };
    let mut pipeline = pipeline();
    let mut fastest: f64 = 0.0;
    for _ in 0..60 {
        pipeline.step_with_events(&mut world, &bouncy, &()).unwrap();
        fastest = fastest.max(pipeline.velocity(ball).unwrap().y);
    }
    // it fell by a metre
    assert!((fastest - (2.0 * G).sqrt()).abs() < 0.2, "{fastest}");
}

// --- sensors and events -----------------------------------------------------------------------

#[derive(Default)]
struct Log {
    collisions: Mutex<Vec<(u32, CollisionEvent, Option<usize>)>>,
    forces: Mutex<Vec<(u32, ContactForceEvent)>>,
    step: Mutex<u32>,
}

impl EventHandler for Log {
    fn handle_collision_event(
        &self,
        _: &RigidBodySet,
        _: &ColliderSet,
        event: CollisionEvent,
        pair: Option<&ContactPair>,
    ) {
        let points = pair.map(|p| p.manifolds().iter().map(|m| m.points.len()).sum());
        let step = *self.step.lock().unwrap();
        self.collisions.lock().unwrap().push((step, event, points));
    }

    fn handle_contact_force_event(
        &self,
        dt: Real,
        _: &RigidBodySet,
        _: &ColliderSet,
        pair: &ContactPair,
        total: Real,
    ) {
        let event = ContactForceEvent::from_contact_pair(dt, pair, total);
        let step = *self.step.lock().unwrap();
        self.forces.lock().unwrap().push((step, event));
    }

    fn handle_soft_body_tear_event(&self, _: &SoftBodySet, _: &SoftBodyTearEvent) {}
}

fn run(
    world: &mut PhysicsWorld,
    pipeline: &mut MoreauPipeline,
    log: &Log,
    steps: u32,
) -> StepRecord {
    let mut last = StepRecord::default();
    for _ in 0..steps {
        last = pipeline.step_with_events(world, &(), log).unwrap();
        *log.step.lock().unwrap() += 1;
    }
    last
}

#[test]
fn collisions_start_once_and_stop_once() {
    let mut world = PhysicsWorld::new();
    let (ground, slab) = floor();
    world.insert(ground, slab);
    let told = square().active_events(ActiveEvents::COLLISION_EVENTS);
    let (body, collider) = world.insert(free(0.0, 0.8), told);
    let (mut pipeline, log) = (pipeline(), Log::default());
    run(&mut world, &mut pipeline, &log, 120);
    {
        let seen = log.collisions.lock().unwrap();
        assert_eq!(seen.len(), 1, "{seen:?}");
        let (step, event, points) = seen[0];
        assert!(event.started() && event.collider2() == collider);
        assert!(!event.sensor() && points == Some(2), "{seen:?}");
        // it falls by 0.3 m in 0.247 s
        assert!((14..=16).contains(&step), "{step}");
    }
    world.bodies[body].set_translation(at(0.0, 3.0), true);
    world.bodies[body].set_linvel(Vector::ZERO, true);
    run(&mut world, &mut pipeline, &log, 2);
    {
        let seen = log.collisions.lock().unwrap();
        assert_eq!(seen.len(), 2, "{seen:?}");
        assert!(seen[1].1.stopped() && seen[1].0 == 120);
    }
    // and what is removed while it touches stops with a flag
    world.bodies[body].set_translation(at(0.0, 0.5), true);
    run(&mut world, &mut pipeline, &log, 2);
    world.remove_body(body);
    run(&mut world, &mut pipeline, &log, 1);
    let seen = log.collisions.lock().unwrap();
    assert_eq!(
        seen.len(),
        3,
        "the one that wanted to hear is gone: {seen:?}"
    );
}

#[test]
fn who_falls_asleep_touches_on() {
    let mut world = PhysicsWorld::new();
    let (ground, slab) = floor();
    let told = slab.active_events(ActiveEvents::COLLISION_EVENTS);
    world.insert(ground, told);
    let body = RigidBodyBuilder::dynamic().translation(at(0.0, 0.5));
    let (body, _) = world.insert(body, square());
    let mut pipeline = MoreauPipeline::new(MoreauSettings::default()).unwrap();
    let log = Log::default();
    run(&mut world, &mut pipeline, &log, 300);
    assert!(world.bodies[body].is_sleeping());
    let seen = log.collisions.lock().unwrap();
    assert_eq!(seen.len(), 1, "{seen:?}");
}

#[test]
fn sensors_tell_what_enters_and_leaves_and_push_nothing() {
    for (name, zone) in [
        ("box", ColliderBuilder::cuboid(1.0, 0.5)),
        ("ball", ColliderBuilder::ball(0.5)),
        ("polygon", ColliderBuilder::round_cuboid(0.9, 0.4, 0.1)),
    ] {
        let mut world = PhysicsWorld::new();
        let zone = zone
            .sensor(true)
            .active_events(ActiveEvents::COLLISION_EVENTS);
        let (_, sensor) = world.insert(RigidBodyBuilder::fixed(), zone);
        let (body, collider) = world.insert(free(0.0, 2.0), ColliderBuilder::ball(0.1));
        let (mut pipeline, log) = (pipeline(), Log::default());
        let mut inside = 0;
        for _ in 0..80 {
            run(&mut world, &mut pipeline, &log, 1);
            let now: Vec<_> = pipeline.intersections().collect();
            if !now.is_empty() {
                assert_eq!(now, [[sensor, collider]]);
                inside += 1;
            }
        }
        // free fall all along
        let v = pipeline.velocity(body).unwrap().y;
        assert!((v + G * DT * 80.0).abs() < 1e-4, "{name}: {v}");
        let seen = log.collisions.lock().unwrap();
        assert_eq!(seen.len(), 2, "{name}: {seen:?}");
        assert!(seen[0].1.started() && seen[0].1.sensor() && seen[0].2.is_none());
        assert!(seen[1].1.stopped() && seen[1].1.sensor());
        assert_eq!(seen[1].0 - seen[0].0, inside);
        // in at 0.6 m, out at −0.6 m
        let time = |y: f64| (2.0 * (2.0 - y) / G).sqrt() / DT;
        assert!((f64::from(seen[0].0) - time(0.6)).abs() < 2.0, "{name}");
        assert!((f64::from(seen[1].0) - time(-0.6)).abs() < 2.0, "{name}");
    }
}

#[test]
fn groups_that_do_not_push_still_tell() {
    let mut world = PhysicsWorld::new();
    let (ground, slab) = floor();
    world.insert(ground, slab);
    let ghost = InteractionGroups::new(Group::GROUP_1, Group::NONE, InteractionTestMode::And);
    let told = square()
        .solver_groups(ghost)
        .active_events(ActiveEvents::COLLISION_EVENTS);
    let (body, _) = world.insert(free(0.0, 0.8), told);
    let (mut pipeline, log) = (pipeline(), Log::default());
    run(&mut world, &mut pipeline, &log, 30);
    let v = pipeline.velocity(body).unwrap().y;
    assert!((v + G * DT * 30.0).abs() < 1e-5, "{v}");
    let seen = log.collisions.lock().unwrap();
    assert!(seen.len() == 1 && seen[0].1.started(), "{seen:?}");
}

/// At rest the force is the weight, and `started` is told once.
#[test]
fn contact_forces_are_impulses_over_the_step() {
    let mut world = PhysicsWorld::new();
    let (ground, slab) = floor();
    world.insert(ground, slab);
    let told = square()
        .active_events(ActiveEvents::CONTACT_FORCE_EVENTS)
        .contact_force_event_threshold(5.0);
    let (body, _) = world.insert(free(0.0, 0.5), told);
    let (mut pipeline, log) = (pipeline(), Log::default());
    let record = run(&mut world, &mut pipeline, &log, 20);
    let weight = G * f64::from(world.bodies[body].mass());
    {
        let seen = log.forces.lock().unwrap();
        assert_eq!(seen.len(), 20);
        for (step, event) in seen.iter() {
            assert_eq!(event.started, *step == 0, "step {step}");
            let total = f64::from(event.total_force_magnitude);
            assert!((total - weight).abs() < 1e-5, "{total} for {weight}");
            // on the second collider, as rapier's manifold normal runs from 1 to 2
            assert!((f64::from(event.total_force.y) - weight).abs() < 1e-5);
        }
        let sum: f64 = record.contacts.iter().map(|c| c.impulse_n).sum();
        assert!((sum / DT - weight).abs() < 1e-9);
    }
    // too light for the threshold: nothing is told, and then it starts again
    let collider = world.bodies[body].colliders()[0];
    world.colliders[collider].set_contact_force_event_threshold(100.0);
    run(&mut world, &mut pipeline, &log, 5);
    assert_eq!(log.forces.lock().unwrap().len(), 20);
    world.colliders[collider].set_contact_force_event_threshold(1.0);
    run(&mut world, &mut pipeline, &log, 2);
    let seen = log.forces.lock().unwrap();
    let last: Vec<bool> = seen[20..].iter().map(|(_, e)| e.started).collect();
    assert_eq!(last, [true, false]);
}

/// Writes a mark on every pair it is shown, and notes how many contacts and which mark it had.
struct Marks(std::sync::Mutex<Vec<(usize, u32)>>);

impl PhysicsHooks for Marks {
    fn modify_solver_contacts(&self, context: &mut ContactModificationContext) {
        let rigid = context.rigid_mut().unwrap();
        let seen = (rigid.solver_contacts.len(), *rigid.user_data);
        *rigid.user_data = 7;
        self.0.lock().unwrap().push(seen);
    }
}

/// However far the two are by then: who wrote a mark may want to take something back.
#[test]
fn a_marked_pair_is_shown_once_more_when_its_contacts_are_gone() {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    let ball = || ColliderBuilder::ball(0.5).active_hooks(ActiveHooks::MODIFY_SOLVER_CONTACTS);
    world.insert(free(0.0, 0.0), ball());
    let (other, _) = world.insert(free(1.0, 0.0), ball());
    let mut pipeline = pipeline();
    let hooks = Marks(std::sync::Mutex::default());
    let mut shown = |world: &mut PhysicsWorld| {
        pipeline.step_with_events(world, &hooks, &()).unwrap();
        std::mem::take(&mut *hooks.0.lock().unwrap())
    };
    let first = shown(&mut world);
    assert!(first.iter().all(|(contacts, _)| *contacts == 1) && !first.is_empty());
    world.bodies[other].set_translation(at(1.05, 0.0), true);
    assert_eq!(shown(&mut world), [(0, 7)]);
    assert_eq!(shown(&mut world), []);
}
