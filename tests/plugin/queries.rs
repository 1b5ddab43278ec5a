//! rapier's own queries between our steps: behind until they are refreshed, right afterwards, and
//! nothing else changed.

use moreau2d::rapier::engine::control::KinematicCharacterController;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
use std::collections::BTreeSet;
use std::sync::Mutex;

fn pipeline() -> MoreauPipeline {
    MoreauPipeline::new(MoreauSettings::default()).unwrap()
}

/// A floor, a wall that stands on it, and boxes that fall in four rows.
fn yard() -> (PhysicsWorld, Vec<RigidBodyHandle>) {
    let mut world = PhysicsWorld::new();
    world.insert(
        RigidBodyBuilder::fixed().translation(Vector::new(0.0, -0.5)),
        ColliderBuilder::cuboid(10.0, 0.5),
    );
    world.insert_collider(
        ColliderBuilder::cuboid(0.1, 1.0).translation(Vector::new(-4.0, 1.0)),
        None,
    );
    let mut boxes = Vec::new();
    for k in 0..40 {
        let (column, row) = ((k % 10) as Real, (k / 10) as Real);
        let place = Vector::new(0.36 * column - 1.5 + 0.05 * row, 0.3 + 0.5 * row);
        let body = RigidBodyBuilder::dynamic().translation(place);
        boxes.push(world.insert(body, ColliderBuilder::cuboid(0.15, 0.15)).0);
    }
    (world, boxes)
}

/// The first that a ray straight down meets at `x`, by brute force over all colliders.
fn below(world: &PhysicsWorld, ray: &Ray) -> Option<(ColliderHandle, Real)> {
    let hits = world.colliders.iter().filter_map(|(handle, collider)| {
        let shape = collider.shape();
        let way = shape.cast_ray(collider.position(), ray, 100.0, true)?;
        Some((handle, way))
    });
    hits.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Casts 60 rays into the yard; returns how many found what trying all colliders finds.
#[track_caller]
fn rays_that_agree(world: &PhysicsWorld) -> usize {
    let mut hits = 0;
    let agree = (0..60).filter(|k| {
        let x = 0.15 * *k as Real - 4.5;
        let ray = Ray::new(Vector::new(x, 5.0), Vector::new(0.0, -1.0));
        let expected = below(world, &ray);
        hits += usize::from(expected.is_some());
        world.cast_ray(&ray, 100.0, true, QueryFilter::default()) == expected
    });
    let agree = agree.count();
    assert_eq!(hits, 60, "the floor is below all");
    agree
}

fn pair(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

#[test]
fn queries_are_behind_until_they_are_refreshed() {
    let (mut world, _) = yard();
    // who sleeps is in no record
    let mut pipeline = MoreauPipeline::new(MoreauSettings {
        stay_awake: true,
        ..MoreauSettings::default()
    })
    .unwrap();
    for step in 0..90 {
        let record = pipeline.step(&mut world).unwrap();
        assert_eq!(record.unsolved, 0);
        if step == 0 {
            // what the docs say of a world that rapier never stepped
            assert_eq!(rays_that_agree(&world), 0);
            assert_eq!(world.contact_pairs().count(), 0);
        }
        if step % 15 != 0 {
            continue;
        }
        MoreauPipeline::refresh_queries(&mut world, &()).unwrap();
        assert_eq!(rays_that_agree(&world), 60, "step {step}");
        // what our next step finds at its middle, some millimetres on, and rapier here
        let ours: BTreeSet<(u32, u32)> = record
            .contacts
            .iter()
            .filter(|c| c.impulse_n > 0.0)
            .map(|c| pair(c.surfaces[0], c.surfaces[1]))
            .collect();
        let theirs: BTreeSet<(u32, u32)> = world
            .contact_pairs()
            .filter(|p| p.has_any_active_contact())
            .map(|p| {
                pair(
                    p.collider1.into_raw_parts().0,
                    p.collider2.into_raw_parts().0,
                )
            })
            .collect();
        assert!(ours.is_subset(&theirs), "step {step}: {ours:?} {theirs:?}");
        assert!(step < 60 || ours.len() >= 40, "{}", ours.len());
    }
}

/// With and without, bit for bit; asleep or not.
#[test]
fn refreshing_changes_nothing() {
    let run = |every: usize| {
        let (mut world, boxes) = yard();
        let (platform, _) = world.insert(
            RigidBodyBuilder::kinematic_position_based().translation(Vector::new(3.0, 0.5)),
            ColliderBuilder::cuboid(0.5, 0.1),
        );
        let rider = RigidBodyBuilder::dynamic().translation(Vector::new(3.0, 0.7));
        let (rider, _) = world.insert(rider, ColliderBuilder::cuboid(0.1, 0.1));
        let mut pipeline = pipeline();
        let mut asleep = 0;
        for step in 0..400 {
            let x = 3.0 + 0.2 * (0.02 * step as Real).sin();
            world.bodies[platform].set_next_kinematic_position(Pose::translation(x, 0.5));
            if (step + 1) % every == 0 {
                MoreauPipeline::refresh_queries(&mut world, &()).unwrap();
            }
            pipeline.step(&mut world).unwrap();
            let sleeping = |h: &&RigidBodyHandle| world.bodies[**h].is_sleeping();
            asleep = boxes.iter().filter(sleeping).count();
        }
        MoreauPipeline::refresh_queries(&mut world, &()).unwrap();
        assert_eq!(rays_that_agree(&world), 60, "of which most sleep");
        let all = boxes.iter().chain([&rider, &platform]);
        let states = all.map(|h| (pipeline.pose(*h), pipeline.velocity(*h)));
        (states.collect::<Vec<_>>(), asleep)
    };
    let (with, asleep) = run(7);
    let (without, as_many) = run(usize::MAX);
    assert!(asleep > 20, "{asleep}");
    assert_eq!(asleep, as_many);
    assert_eq!(with, without);
}

struct Deaf(Mutex<usize>);

impl PhysicsHooks for Deaf {
    fn filter_contact_pair(&self, _: &PairFilterContext) -> Option<SolverFlags> {
        *self.0.lock().unwrap() += 1;
        None
    }
}

#[test]
fn hooks_are_asked_which_pairs_to_leave_out() {
    let mut world = PhysicsWorld::new();
    world.insert(
        RigidBodyBuilder::fixed(),
        ColliderBuilder::cuboid(10.0, 0.5).active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS),
    );
    let body = RigidBodyBuilder::dynamic().translation(Vector::new(0.0, 0.99));
    world.insert(body, ColliderBuilder::ball(0.5));
    let hooks = Deaf(Mutex::new(0));
    MoreauPipeline::refresh_queries(&mut world, &hooks).unwrap();
    let touching = |world: &PhysicsWorld| {
        let active = |p: &&ContactPair| p.has_any_active_contact();
        world.contact_pairs().filter(active).count()
    };
    assert_eq!(touching(&world), 0);
    assert!(*hooks.0.lock().unwrap() > 0);
    MoreauPipeline::refresh_queries(&mut world, &()).unwrap();
    assert_eq!(touching(&world), 1);
}

/// Refreshed or not, rapier goes on from where we left: what lay stays up, what fell lands.
#[test]
fn rapiers_own_step_works_afterwards() {
    for (every, lamed) in [
        (usize::MAX, false),
        (9, false),
        (1, false),
        (9, true),
        (usize::MAX, true),
    ] {
        let (mut world, boxes) = yard();
        if lamed {
            let spare = ColliderBuilder::ball(0.1).enabled(false);
            world.insert_collider(spare, Some(boxes[7]));
        }
        let mut pipeline = pipeline();
        for step in 0..30 {
            pipeline.step(&mut world).unwrap();
            if (step + 1) % every == 0 {
                MoreauPipeline::refresh_queries(&mut world, &()).unwrap();
            }
        }
        for _ in 0..240 {
            world.step();
        }
        for handle in &boxes {
            let body = &world.bodies[*handle];
            let (x, y) = (body.translation().x, body.translation().y);
            // on the floor or on others; rapier lets a pile sink by some millimetres
            assert!(
                y > 0.13 && y < 1.5 && x.abs() < 9.0,
                "{every} {lamed}: ({x}, {y})"
            );
        }
    }
}

/// What sleeps in our steps sleeps on in rapier's, with a refresh between them and without, alone, in
/// a pile, and beside what is awake.
#[test]
fn sleepers_stay_where_they_are_when_rapier_takes_over() {
    for (count, refreshed, beside) in [
        (1, true, false),
        (1, false, false),
        (4, true, false),
        (4, false, false),
        (4, true, true),
        (4, false, true),
    ] {
        let mut world = PhysicsWorld::new();
        let floor = RigidBodyBuilder::fixed().translation(Vector::new(0.0, -0.5));
        world.insert(floor, ColliderBuilder::cuboid(10.0, 0.5));
        let mut insert = |x: Real, y: Real| {
            let body = RigidBodyBuilder::dynamic().translation(Vector::new(x, y));
            world.insert(body, ColliderBuilder::cuboid(0.5, 0.5)).0
        };
        let pile: Vec<_> = (0..count).map(|k| insert(0.0, k as Real + 0.5)).collect();
        let falling = beside.then(|| insert(5.0, 60.0));
        let mut pipeline = pipeline();
        for _ in 0..180 {
            pipeline.step(&mut world).unwrap();
        }
        let case = format!("{count} {refreshed} {beside}");
        assert!(
            pile.iter().all(|h| world.bodies[*h].is_sleeping()),
            "{case}"
        );
        if refreshed {
            MoreauPipeline::refresh_queries(&mut world, &()).unwrap();
        }
        for _ in 0..240 {
            world.step();
        }
        for (k, handle) in pile.iter().enumerate() {
            let y = world.bodies[*handle].translation().y;
            assert!(
                (y - (k as Real + 0.5)).abs() < 0.01,
                "{case}: box {k} at {y}"
            );
        }
        if let Some(handle) = falling {
            let y = world.bodies[handle].translation().y;
            assert!((y - 0.5).abs() < 0.01, "{case}: the falling box at {y}");
        }
    }
}

/// A controller asks rapier's queries where it can go: into a box that fell in its way only as far
/// as that is known.
#[test]
fn a_character_stops_at_what_our_steps_have_moved() {
    let mut world = PhysicsWorld::new();
    let floor = RigidBodyBuilder::fixed().translation(Vector::new(0.0, -0.5));
    world.insert(floor, ColliderBuilder::cuboid(10.0, 0.5));
    let body = RigidBodyBuilder::dynamic().translation(Vector::new(2.0, 1.0));
    world.insert(body, ColliderBuilder::cuboid(0.5, 0.5));
    let mut pipeline = pipeline();
    for _ in 0..60 {
        pipeline.step(&mut world).unwrap();
    }
    let walk = |world: &PhysicsWorld| {
        let character = SharedShape::ball(0.3);
        let moved = KinematicCharacterController::default().move_shape(
            1.0 / 60.0,
            &world.query_pipeline(),
            &*character,
            &Pose::translation(0.0, 0.35),
            Vector::new(3.0, 0.0),
            |_| {},
        );
        moved.translation.x
    };
    assert!(walk(&world) > 2.9);
    MoreauPipeline::refresh_queries(&mut world, &()).unwrap();
    // the box's side is at 1.5 m
    assert!((walk(&world) - 1.2).abs() < 0.05, "{}", walk(&world));
}

/// rapier would switch such a body off, and say so nowhere.
#[test]
fn what_is_not_finite_is_refused_and_stays_on() {
    let (mut world, boxes) = yard();
    MoreauPipeline::refresh_queries(&mut world, &()).unwrap();
    world.bodies[boxes[3]].set_linvel(Vector::new(Real::NAN, 0.0), true);
    let error = MoreauPipeline::refresh_queries(&mut world, &()).unwrap_err();
    assert!(error.to_string().contains("velocity"), "{error}");
    assert!(world.bodies[boxes[3]].is_enabled());
    world.bodies[boxes[3]].set_linvel(Vector::ZERO, true);
    MoreauPipeline::refresh_queries(&mut world, &()).unwrap();
    assert_eq!(rays_that_agree(&world), 60);
}

/// Our steps empty rapier's notes now and then: its own step still works, and knows nothing of who
/// is gone.
#[test]
fn rapier_steps_on_after_many_bodies_came_and_went() {
    let (mut world, boxes) = yard();
    // what rapier knows, and what it never hears of
    for _ in 0..30 {
        world.step();
    }
    let mut pipeline = pipeline();
    for body in &boxes[20..] {
        world.remove_body(*body);
    }
    for k in 0..400 {
        let at = Vector::new(0.4 * (k % 7) as Real - 1.5, 3.0 + (k % 3) as Real);
        let body = RigidBodyBuilder::dynamic().translation(at);
        let (body, _) = world.insert(body, ColliderBuilder::ball(0.15));
        pipeline.step(&mut world).unwrap();
        world.remove_body(body);
    }
    let noted = world.colliders.take_removed().len();
    assert!(noted < 200, "{noted} of 420 are still noted");
    for _ in 0..120 {
        world.step();
    }
    assert_eq!(rays_that_agree(&world), 60);
    for pair in world.contact_pairs() {
        for collider in [pair.collider1, pair.collider2] {
            assert!(world.colliders.contains(collider));
        }
    }
    for body in &boxes[..20] {
        let y = world.bodies[*body].translation().y;
        assert!((0.14..2.0).contains(&y), "{y}");
    }
}
