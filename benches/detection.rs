//! What finding the contacts costs, against the whole of rapier's default step.
//!
//! `cargo bench --bench detection` steps five scenes with rapier's default solver and finds the
//! contacts of each state with ours, in turns; `-- --test` looks at a few steps only, `-- drum discs`
//! at scenes with one of these words in their names. Ratios are of the medians; bookkeeping and what
//! the user may have changed are counted in, and every pose and velocity read anew, as it was rapier
//! that moved all. The last column has a copy of the world that our own steps move, in turns with
//! rapier's, from its start: what finding contacts costs within a step. Nothing here asserts a time.

use moreau2d::dynamics::Detection;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{DetectionDrive, MoreauPipeline, MoreauSettings};
use std::f64::consts::TAU;
use std::time::Instant;

/// A repeatable series of numbers in [0, 1).
struct Series(u64);

impl Series {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }
}

fn at(x: f64, y: f64) -> Vector {
    Vector::new(x as Real, y as Real)
}

fn moving(x: f64, y: f64) -> RigidBodyBuilder {
    RigidBodyBuilder::dynamic()
        .translation(at(x, y))
        .can_sleep(false)
}

fn boxed(x: f64, y: f64) -> ColliderBuilder {
    ColliderBuilder::cuboid(x as Real, y as Real).friction(0.6)
}

fn disc(radius: f64) -> ColliderBuilder {
    ColliderBuilder::ball(radius as Real).friction(0.6)
}

fn wall(world: &mut PhysicsWorld, center: [f64; 2], half: [f64; 2]) {
    let body = RigidBodyBuilder::fixed().translation(at(center[0], center[1]));
    world.insert(body, boxed(half[0], half[1]));
}

/// Boxes of one metre, `base` in the lowest row.
fn pile(world: &mut PhysicsWorld, base: usize, x: f64, y: f64) {
    for row in 0..base {
        for column in 0..base - row {
            let left = x - 0.5 * (base - row) as f64;
            let body = moving(left + 0.5 + column as f64, y + 0.5 + row as f64);
            world.insert(body, boxed(0.5, 0.5));
        }
    }
}

fn pyramid() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    wall(&mut world, [0.0, -1.0], [200.0, 1.0]);
    pile(&mut world, 100, 0.0, 0.0);
    world
}

fn pyramids() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    for i in 0..10 {
        let y = 12.0 * f64::from(i);
        wall(&mut world, [0.0, y - 0.5], [70.0, 0.5]);
        for j in 0..10 {
            pile(&mut world, 10, -58.5 + 13.0 * f64::from(j), y);
        }
    }
    world
}

fn discs() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    wall(&mut world, [0.0, -1.0], [27.0, 1.0]);
    wall(&mut world, [-26.0, 60.0], [1.0, 62.0]);
    wall(&mut world, [26.0, 60.0], [1.0, 62.0]);
    let mut series = Series(7);
    for i in 0..5000 {
        let r = series.next();
        let x = -24.5 + f64::from(i % 49) + 0.3 * (r - 0.5);
        world.insert(moving(x, 0.5 + f64::from(i / 49)), disc(0.4 + 0.08 * r));
    }
    world
}

fn terrain() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    let points = (0..=200).map(|i| {
        let x = -50.0 + 0.5 * f64::from(i);
        at(x, 0.002 * x * x + 0.4 * (0.9 * x).sin())
    });
    let line = ColliderBuilder::polyline(points.collect(), None).friction(0.6);
    world.insert(RigidBodyBuilder::fixed(), line);
    let mut series = Series(7);
    for i in 0..500 {
        let body = moving(-20.0 + f64::from(i % 40), 4.0 + f64::from(i / 40));
        world.insert(body, disc(0.3 + 0.15 * series.next()));
    }
    world
}

/// Discs in a turning drum with ribs.
fn drum() -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    let body = RigidBodyBuilder::kinematic_velocity_based().angvel(0.3);
    let (shell, _) = world.insert(body, disc(0.01));
    for k in 0..8 {
        let rib = |i: i32| {
            let angle = f64::from(k * 26 + i) / 208.0 * TAU;
            let r = if i % 2 == 0 { 35.0 } else { 34.0 };
            at(r * angle.cos(), r * angle.sin())
        };
        let line = ColliderBuilder::polyline((0..=26).map(rib).collect(), None);
        world.insert_collider(line.friction(0.6), Some(shell));
    }
    let mut series = Series(7);
    let grid = (0..3600).map(|i| (f64::from(i % 60) - 30.0, f64::from(i / 60) - 30.0));
    for (x, y) in grid.filter(|(x, y)| x.hypot(*y) < 32.0).take(2000) {
        world.insert(moving(x, y), disc(0.4 + 0.09 * series.next()));
    }
    world
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Time that a step of ours spends on finding contacts over that of a whole step of rapier's, of two
/// copies of a world, each stepped by its own.
fn within_a_step(build: fn() -> PhysicsWorld, warm: usize, steps: usize) -> f64 {
    let (mut theirs, mut own) = (build(), build());
    let mut pipeline = MoreauPipeline::new(MoreauSettings {
        stay_awake: true,
        ..MoreauSettings::default()
    })
    .expect("settings");
    let mut times = [vec![], vec![]];
    for step in 0..warm + steps {
        let start = Instant::now();
        theirs.step();
        let whole = start.elapsed().as_secs_f64();
        pipeline.time_phases(Some(moreau2d::peers::seconds));
        pipeline.step(&mut own).expect("a sound world");
        if step >= warm {
            times[0].push(whole);
            times[1].push(pipeline.phases().detection);
        }
    }
    let [rapier, ours] = times.map(|mut t| median(&mut t));
    ours / rapier
}

fn main() {
    let short = std::env::args().any(|a| a == "--test");
    let named: Vec<_> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .collect();
    let (warm, steps) = if short { (2, 3) } else { (200, 100) };
    type Build = fn() -> PhysicsWorld;
    let scenes: [(&str, Build); 5] = [
        ("pyramid of 5050 boxes", pyramid),
        ("5000 discs", discs),
        ("100 pyramids", pyramids),
        ("polyline and 500 discs", terrain),
        ("drum with 2000 discs", drum),
    ];
    let known = |part: &&String| scenes.iter().any(|(name, _)| name.contains(*part));
    if let Some(part) = named.iter().find(|part| !known(part)) {
        let names = scenes.map(|(name, _)| name).join(", ");
        eprintln!("error: no scene has '{part}' in its name; there are: {names}");
        std::process::exit(1);
    }
    println!("scene                    rapier ms   ours ms  ratio  contacts  in a step of ours");
    let wanted = |name: &str| named.is_empty() || named.iter().any(|part| name.contains(part));
    for (name, build) in scenes.into_iter().filter(|(name, _)| wanted(name)) {
        let mut world = build();
        for _ in 0..warm {
            world.step();
        }
        let pipeline = |detection| {
            MoreauPipeline::new(MoreauSettings {
                detection,
                stay_awake: true,
                ..MoreauSettings::default()
            })
            .expect("settings")
        };
        let mut ours = pipeline(DetectionDrive::Tree);
        let mut reference = pipeline(DetectionDrive::Exhaustive);
        let mut times = [vec![], vec![]];
        let (mut found, mut all) = (Detection::default(), Detection::default());
        for step in 0..steps {
            let start = Instant::now();
            world.step();
            times[0].push(start.elapsed().as_secs_f64());
            let start = Instant::now();
            ours.find_contacts(&mut world, &mut found)
                .expect("a sound world");
            times[1].push(start.elapsed().as_secs_f64());
            if step % 50 == 0 {
                reference
                    .find_contacts(&mut world, &mut all)
                    .expect("a sound world");
                let equal = all.contacts == found.contacts;
                assert!(equal, "{name}: not what trying all pairs finds");
            }
        }
        let [rapier, ours] = times.map(|mut t| 1e3 * median(&mut t));
        // steps of ours are dear where heaps settle
        let within = within_a_step(build, warm.min(20), steps.min(20));
        println!(
            "{name:24} {rapier:9.3} {ours:9.3} {:6.2} {:9} {within:18.2}",
            ours / rapier,
            found.contacts.len()
        );
    }
}
