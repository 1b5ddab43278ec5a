//! Floors and bodies of several flush parts: the faces between the parts are no surface, until one of them goes.

use crate::common::{Random, at, parse, run};
use moreau2d::dynamics::StepperSettings;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, SurfaceLaw};
use std::f64::consts::FRAC_PI_6;

fn pipeline(dt: f64) -> MoreauPipeline {
    MoreauPipeline::new(MoreauSettings {
        stepper: StepperSettings::default(),
        dt: Some(dt),
        stay_awake: true,
        ..MoreauSettings::default()
    })
    .unwrap()
}

/// Boxes of random widths and heights from x = −5 to 5 m, their tops at y = 0: centres and half extents \[m\].
fn tiles(random: &mut Random) -> Vec<([f64; 2], [f64; 2])> {
    let (mut all, mut left) = (Vec::new(), -5.0);
    while left < 5.0 {
        let (half, deep) = (random.between(0.08, 0.3), random.between(0.1, 0.6));
        all.push(([left + half, -deep], [half, deep]));
        left += 2.0 * half;
    }
    all
}

const FLOORS: [&str; 6] = [
    "bodies",
    "colliders",
    "compound",
    "heavy body",
    "heavy bodies",
    "bodies apart",
];

/// Flush tiles, inclined by an angle about the origin.
fn add_floor(world: &mut PhysicsWorld, kind: &str, tiles: &[([f64; 2], [f64; 2])], angle: f64) {
    let cuboid = |half: [f64; 2]| ColliderBuilder::cuboid(half[0] as Real, half[1] as Real);
    let smooth = |c: ColliderBuilder| c.friction(0.0);
    let fixed = RigidBodyBuilder::fixed().rotation(angle as Real);
    let place = |[x, y]: [f64; 2]| {
        let (sin, cos) = angle.sin_cos();
        at(cos * x - sin * y, sin * x + cos * y)
    };
    match kind {
        "bodies" | "bodies apart" | "heavy bodies" => {
            // a gap is 1e-5 m wide
            let narrower = if kind == "bodies apart" { 5e-6 } else { 0.0 };
            for (center, half) in tiles {
                let body = match kind {
                    "heavy bodies" => RigidBodyBuilder::dynamic().rotation(angle as Real),
                    _ => fixed.clone(),
                };
                let collider = cuboid([half[0] - narrower, half[1]]).density(1e9);
                world.insert(body.translation(place(*center)), smooth(collider));
            }
        }
        "compound" => {
            let part = |(center, half): &([f64; 2], [f64; 2])| {
                let pose = Pose::from_translation(at(center[0], center[1]));
                (pose, SharedShape::cuboid(half[0] as Real, half[1] as Real))
            };
            let parts = tiles.iter().map(part).collect();
            world.insert(fixed, smooth(ColliderBuilder::compound(parts)));
        }
        _ => {
            let (body, density) = match kind {
                "colliders" => (fixed, 1.0),
                _ => (RigidBodyBuilder::dynamic().rotation(angle as Real), 1e9),
            };
            let body = world.bodies.insert(body);
            for (center, half) in tiles {
                let collider = smooth(cuboid(*half)).translation(at(center[0], center[1]));
                let collider = collider.density(density as Real);
                (world.colliders).insert_with_parent(collider, body, &mut world.bodies);
            }
        }
    }
}

fn shape(kind: usize, size: f64) -> ColliderBuilder {
    let h = 0.5 * size;
    let corners = [
        [-1.0, -1.0],
        [0.8, -0.9],
        [1.1, 0.3],
        [0.0, 1.0],
        [-0.9, 0.6],
    ];
    let corners = || {
        corners
            .iter()
            .map(|[x, y]| at(h * x, h * y))
            .collect::<Vec<_>>()
    };
    let collider = match kind {
        0 => ColliderBuilder::cuboid(h as Real, (0.7 * h) as Real),
        1 => ColliderBuilder::convex_polyline(corners()).unwrap(),
        2 => ColliderBuilder::ball(h as Real),
        3 => ColliderBuilder::capsule_x((0.6 * h) as Real, (0.4 * h) as Real),
        // a box of three parts
        4 => {
            let part = |k: i32| {
                let place = Pose::from_translation(at(f64::from(k) * size / 3.0, 0.0));
                (
                    place,
                    SharedShape::cuboid((h / 3.0) as Real, (0.7 * h) as Real),
                )
            };
            ColliderBuilder::compound((-1..2).map(part).collect())
        }
        _ => ColliderBuilder::oriented_polyline(
            corners(),
            Some((0..5).map(|i| [i, (i + 1) % 5]).collect()),
        ),
    };
    collider.density(0.0).friction(0.0)
}

/// Largest relative change of the momentum along a smooth floor, on which a body tumbles that another one hits.
fn change(kind: &str, seed: u64) -> f64 {
    let mut random = Random(seed);
    let tiles = tiles(&mut random);
    let angle = [0.0, random.between(-FRAC_PI_6, FRAC_PI_6)][random.below(2)];
    let dt = 1.0 / [60.0, 120.0, 240.0][random.below(3)];
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    add_floor(&mut world, kind, &tiles, angle);
    let (sin, cos) = angle.sin_cos();
    let along = |x: f64, y: f64| at(cos * x - sin * y, sin * x + cos * y);
    let size = random.between(0.1, 0.5);
    let bodies = [random.between(0.8, 1.2), random.between(2.2, 3.0)].map(|height| {
        let mass = MassProperties::new(Vector::ZERO, 1.0, (0.1 * size * size) as Real);
        let body = RigidBodyBuilder::dynamic()
            .translation(along(random.between(-2.0, -1.9), size * height))
            .rotation(random.between(-3.0, 3.0) as Real)
            .linvel(along(random.between(0.4, 2.0), -random.between(0.5, 9.0)))
            .angvel(random.between(-25.0, 25.0) as Real)
            .additional_mass_properties(mass)
            .can_sleep(false);
        world.insert(body, shape(random.below(6), size)).0
    });
    let mut pipeline = pipeline(dt);
    let mut momentum = || {
        let step = pipeline.step(&mut world);
        step.unwrap();
        let u = bodies.map(|body| pipeline.velocity(body).unwrap());
        u.iter().map(|u| cos * u.x + sin * u.y).sum::<f64>()
    };
    let first = momentum();
    let all = (1..(1.0 / dt) as usize).map(|_| (momentum() / first - 1.0).abs());
    all.fold(0.0, f64::max)
}

/// Bug: in half of such scenes a corner that had sunk into one tile hit the side of the next, or a tile's corner a
/// side of the body. The momentum changed by up to 2.5 times itself; it stays so on a floor of one box. Long after
/// the others it still did on separate bodies that can move, and on those with a narrow gap between them.
#[test]
fn tumbling_bodies_meet_no_face_between_flush_parts() {
    let mut bad = Vec::new();
    for kind in FLOORS {
        // angles are rounded to single precision, and a floor that can move takes the share of its mass
        let most = if kind == "heavy bodies" { 2e-5 } else { 1e-6 };
        let changes = (0..60).map(|seed| (seed, change(kind, seed)));
        let own = changes.filter(|(_, change)| change.is_nan() || *change > most);
        let own: Vec<String> = own
            .map(|(seed, c)| format!("{kind} {seed}: {c:e}"))
            .collect();
        // a corner may get into a gap, and where bodies overlap since an impact it is not looked for
        if kind != "bodies apart" || own.len() > 9 {
            bad.extend(own);
        }
    }
    assert!(bad.is_empty(), "{}", bad.join("\n"));
}

/// Five bars of three flush parts each, thrown into a pit with a floor of flush tiles.
fn bars(seed: u64) -> String {
    let mut random = Random(seed);
    let mut text = "[scene]\nname = \"bars\"\ntitle = \"Bars in a pit\"\n[step]\ntime = 2\n\
                    [[material]]\nname = \"m\"\nfriction = 0.3\n"
        .to_owned();
    let mut walls = 0;
    let mut wall = |size: [f64; 2], place: [f64; 2]| {
        walls += 1;
        text += &format!(
            "[[body]]\nname = \"w{walls}\"\nkind = \"fixed\"\nmaterial = \"m\"\nbox = {size:?}\nposition = {place:?}\n"
        );
    };
    (0..8).for_each(|k| wall([0.5, 1.0], [0.5 * f64::from(k) - 1.75, -0.5]));
    wall([0.5, 5.0], [-2.25, 2.0]);
    wall([0.5, 5.0], [2.25, 2.0]);
    for k in 0..5 {
        let size = random.between(0.15, 0.25);
        let part = |x: f64| format!("{{ box = [{size}, {}], position = [{x}, 0] }}", 1.25 * size);
        text += &format!(
            "[[body]]\nname = \"b{k}\"\nmaterial = \"m\"\nmass = 1\ninertia = {}\nparts = [{}, {}, {}]\nposition = [{}, {}]\nangle = {}\n\
             velocity = [{}, {}]\nspin = {}\n",
            0.8 * size * size,
            part(-size),
            part(0.0),
            part(size),
            random.between(-0.5, 0.5),
            0.6 + 0.8 * f64::from(k),
            random.between(-3.0, 3.0),
            random.between(-2.0, 2.0),
            -random.between(0.0, 5.0),
            random.between(-10.0, 10.0),
        );
    }
    text
}

/// Bug in the first form of covers: in four of 40 such pits, a middle part of one bar on that of another was pushed
/// out on its far side, half its size deep.
#[test]
fn bodies_of_flush_parts_do_not_stay_in_each_other() {
    let mut worst = (0.0, 0);
    for seed in 0..30 {
        let run = run(&parse(&bars(seed)));
        let (lasting, _) = run.built.lasting_overlap().unwrap();
        worst = if lasting > worst.0 {
            (lasting, seed)
        } else {
            worst
        };
    }
    assert!(worst.0 < 2e-3, "{worst:?}");
}

/// How the cover of a face goes.
const GONE: [&str; 9] = [
    "soft",
    "removed",
    "disabled",
    "moved",
    "shrunk",
    "sensor",
    "other group",
    "dynamic",
    "joined",
];

/// Where a box of 0.2 m stops that flies through where the first of three tiles was, towards the side of the second
/// at x = 0. They are inserted in this order.
fn stops_at(gone: &str, order: [usize; 3]) -> f64 {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    let mut tile = |x: f64| {
        let body = RigidBodyBuilder::fixed().translation(at(x, -0.5));
        world.insert(body, ColliderBuilder::cuboid(0.5, 0.5).friction(0.0))
    };
    let mut tiles = order.map(|k| (k, tile(k as f64 - 0.5)));
    tiles.sort_by_key(|(k, _)| *k);
    let (_, (cover, own)) = tiles[0];
    let body = RigidBodyBuilder::dynamic()
        .translation(at(-3.0, -0.4))
        .can_sleep(false);
    let collider = ColliderBuilder::cuboid(0.1, 0.1).friction(0.0);
    let (body, _) = world.insert(body, collider);
    let mut pipeline = pipeline(1.0 / 60.0);
    pipeline.step(&mut world).unwrap();
    let alone = InteractionGroups::new(Group::GROUP_2, Group::NONE, InteractionTestMode::And);
    match gone {
        "soft" => {
            let law = SurfaceLaw {
                compliance: Some((1e-6, 0.0)),
                ..SurfaceLaw::default()
            };
            pipeline.set_surface(own, law);
        }
        "removed" => {
            world.remove_body(cover);
        }
        "disabled" => world.colliders[own].set_enabled(false),
        "moved" => world.bodies[cover].set_translation(at(-0.5, 5.0), true),
        "shrunk" => world.colliders[own].set_shape(SharedShape::cuboid(0.5, 0.3)),
        "sensor" => world.colliders[own].set_sensor(true),
        "other group" => world.colliders[own].set_collision_groups(alone),
        "dynamic" => {
            world.bodies[cover].set_body_type(RigidBodyType::Dynamic, true);
            world.bodies[cover].set_linvel(at(0.0, 20.0), true);
        }
        "joined" => {
            let along = PrismaticJointBuilder::new(Vector::X)
                .local_anchor1(at(0.0, 0.1))
                .contacts_enabled(false);
            world.impulse_joints.insert(cover, body, along, true);
        }
        _ => unreachable!("{gone}"),
    }
    if gone == "shrunk" {
        world.bodies[body].set_translation(at(-3.0, -0.095), true);
    }
    world.bodies[body].set_linvel(at(3.0, 0.0), true);
    for _ in 0..120 {
        pipeline.step(&mut world).unwrap();
    }
    pipeline.pose(body).unwrap().translation.x
}

#[test]
fn a_face_is_met_when_what_covered_it_is_gone() {
    for gone in GONE {
        for order in [[0, 1, 2], [1, 0, 2], [2, 1, 0]] {
            let place = stops_at(gone, order);
            assert!((place + 0.1).abs() < 1e-6, "{gone}, {order:?}: {place} m");
        }
    }
}

/// A tile whose side was covered until its body was released and the other tile removed.
#[test]
fn a_face_is_met_when_its_own_body_leaves_the_ground() {
    let mut world = PhysicsWorld::new();
    world.gravity = Vector::ZERO;
    let mut tile = |x: f64| {
        let body = RigidBodyBuilder::fixed().translation(at(x, -0.5));
        world
            .insert(
                body,
                ColliderBuilder::cuboid(0.5, 0.5).friction(0.0).density(1e6),
            )
            .0
    };
    let (left, right) = (tile(-0.5), tile(0.5));
    let body = RigidBodyBuilder::dynamic()
        .translation(at(3.0, -0.5))
        .can_sleep(false);
    let (body, _) = world.insert(body, ColliderBuilder::cuboid(0.1, 0.1).friction(0.0));
    let mut pipeline = pipeline(1.0 / 60.0);
    pipeline.step(&mut world).unwrap();
    world.bodies[left].set_body_type(RigidBodyType::Dynamic, true);
    world.remove_body(right);
    world.bodies[body].set_linvel(at(-3.0, 0.0), true);
    for _ in 0..120 {
        pipeline.step(&mut world).unwrap();
    }
    let place = pipeline.pose(body).unwrap().translation.x;
    assert!((place - 0.1).abs() < 1e-5, "{place} m");
}

#[test]
fn boxes_without_an_area_cover_nothing() {
    let mut world = PhysicsWorld::new();
    for (x, half) in [(-1.0, 0.0), (0.0, 0.5), (1.0, 0.0)] {
        let body = RigidBodyBuilder::fixed().translation(at(x, -half));
        world.insert(body, ColliderBuilder::cuboid(0.5, half as Real));
    }
    let body = RigidBodyBuilder::dynamic().translation(at(0.0, 0.1));
    let (body, _) = world.insert(body, ColliderBuilder::cuboid(0.1, 0.1));
    let mut pipeline = pipeline(1.0 / 60.0);
    for _ in 0..10 {
        pipeline.step(&mut world).unwrap();
    }
    assert!((pipeline.pose(body).unwrap().translation.y - 0.1).abs() < 1e-6);
}

/// Bug in the first form of covers between bodies: a plate that fell into a narrow slot lost its contacts with the
/// two sides, as if the slot were filled, and came out at its top.
#[test]
fn a_thin_plate_stays_in_a_narrow_slot() {
    for kind in ["kind = \"fixed\"", "mass = 50"] {
        for (gap, thick) in [(8e-4, 2e-4), (4e-5, 2e-5)] {
            let wall = |name: &str, x: f64| {
                format!("[[body]]\nname = \"{name}\"\n{kind}\nbox = [1, 1]\nposition = [{x}, 0]\n")
            };
            let text = format!(
                "[scene]\nname = \"slot\"\ntitle = \"A plate in a slot\"\n[step]\ntime = 0.4\ndt = 0.005\n\
                 [gravity]\ny = 0\n{}{}[[body]]\nname = \"plate\"\nmass = 0.1\nbox = [{thick}, 1]\n\
                 position = [{}, 0.5]\nvelocity = [{}, -0.5]\n",
                wall("left", -0.5),
                wall("right", 0.5 + gap),
                0.5 * gap,
                10.0 * gap,
            );
            let run = run(&parse(&text));
            let (plate, _) = run.state(2);
            let [x, y] = [plate.translation.x, plate.translation.y];
            let play = 0.5 * (gap - thick) + 1e-3 * gap;
            let within = (x - run.state(0).0.translation.x - 0.5 - 0.5 * gap).abs();
            assert!(
                within < play || !kind.contains("fixed"),
                "{kind}, {gap} m: {x}"
            );
            // friction takes some of its speed
            assert!((0.29..0.35).contains(&y), "{kind}, {gap} m: {y}");
        }
    }
}
