//! Memory stays flat while bodies and colliders come and go.

use allocation_counter::measure;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, SurfaceLaw};
use std::collections::VecDeque;

/// Boxes and balls dropped into bins, the oldest taken away for each that is added.
struct Churn {
    world: PhysicsWorld,
    p: MoreauPipeline,
    bodies: VecDeque<RigidBodyHandle>,
    extra: VecDeque<ColliderHandle>,
    floor: RigidBodyHandle,
    added: usize,
    steps: usize,
    /// Whether some bodies are tied for a moment.
    joints: bool,
}

const BINS: usize = 20;

impl Churn {
    fn new(bodies: usize) -> Churn {
        let mut world = PhysicsWorld::new();
        let (floor, _) = world.insert(
            RigidBodyBuilder::fixed().translation(Vector::new(0.0, -0.5)),
            ColliderBuilder::cuboid(100.0, 0.5),
        );
        for k in 0..=BINS {
            let wall = ColliderBuilder::cuboid(0.1, 20.0);
            let at = Vector::new(3.0 * k as Real - 1.5, 20.0);
            world.insert_collider(wall.translation(at), Some(floor));
        }
        let mut churn = Churn {
            world,
            p: MoreauPipeline::new(MoreauSettings::default()).unwrap(),
            bodies: VecDeque::new(),
            extra: VecDeque::new(),
            floor,
            added: 0,
            steps: 0,
            joints: false,
        };
        // in rows, so that nothing starts overlapped
        for k in 0..bodies {
            churn.add(0.5 + 0.8 * (k / (3 * BINS)) as Real, k % (3 * BINS));
        }
        churn
    }

    fn add(&mut self, y: Real, place: usize) {
        let (bin, column) = (place % BINS, place / BINS);
        let x = 3.0 * bin as Real + 0.8 * (column as Real - 1.0);
        let shape = if self.added.is_multiple_of(3) {
            ColliderBuilder::ball(0.3)
        } else {
            ColliderBuilder::cuboid(0.3, 0.3)
        };
        let body = RigidBodyBuilder::dynamic().translation(Vector::new(x, y));
        let (body, collider) = self.world.insert(body, shape);
        self.p.set_surface(collider, SurfaceLaw::default());
        self.bodies.push_back(body);
        self.added += 1;
    }

    /// Every `often` steps a body goes and another comes; a peg too.
    fn run(&mut self, steps: usize, often: usize) {
        for _ in 0..steps {
            self.steps += 1;
            if self.steps.is_multiple_of(often) {
                let gone = self.bodies.pop_front().unwrap();
                self.world.remove_body(gone);
                self.add(25.0, 7 * self.added % (3 * BINS));
                if self.joints && self.added.is_multiple_of(5) {
                    let (a, b) = (self.bodies[self.bodies.len() - 1], self.bodies[0]);
                    let joint = RevoluteJointBuilder::new().build();
                    let joint = self.world.insert_impulse_joint(a, b, joint);
                    self.world.remove_impulse_joint(joint);
                }
                let peg = ColliderBuilder::ball(0.05);
                let at = Vector::new(-50.0, 1.0 + (self.added % 7) as Real);
                let peg = peg.translation(at);
                self.extra
                    .push_back(self.world.insert_collider(peg, Some(self.floor)));
                if self.extra.len() > 5 {
                    let gone = self.extra.pop_front().unwrap();
                    self.world.remove_collider(gone);
                }
            }
            self.p.step(&mut self.world).unwrap();
        }
    }

    /// Bytes that a stretch leaves behind.
    fn growth(&mut self, steps: usize, often: usize) -> i64 {
        measure(|| self.run(steps, often)).bytes_current
    }
}

/// What a churn of 60 bodies leaves, of all that it holds: below 1 %, though rapier takes notes of
/// every exchange for a step of its own that never comes.
#[test]
fn memory_is_flat_while_bodies_come_and_go() {
    let mut churn = None;
    let held = measure(|| {
        let mut new = Churn::new(60);
        new.run(1500, 3);
        churn = Some(new);
    });
    let mut churn = churn.unwrap();
    let held = held.bytes_current;
    // vectors grow by doubling: over a long stretch; notes grow and are emptied: means of many
    let mut level = 0;
    let mut mean = || {
        let levels = (0..100).map(|_| {
            level += churn.growth(60, 3);
            level
        });
        levels.sum::<i64>() / 100
    };
    let (early, late) = (mean(), mean());
    let left = late - early;
    println!("{held} bytes held; 2000 exchanges leave {left}");
    assert!(held > 100_000);
    assert!(left.abs() * 100 < held, "{left} of {held} bytes");
}

/// Joints leave notes in rapier, and nothing else.
#[test]
fn joints_that_come_and_go_leave_only_their_notes() {
    let mut churn = Churn::new(60);
    churn.joints = true;
    churn.run(7500, 3);
    let left = churn.growth(6000, 3);
    println!("400 joints leave {left} bytes");
    assert!((0..400 * 250).contains(&left), "{left}");
}

/// An hour of 1000 bodies, one exchanged every ten steps.
#[test]
#[ignore = "minutes"]
fn memory_is_flat_over_an_hour() {
    let mut churn = None;
    let held = measure(|| {
        let mut new = Churn::new(1000);
        new.run(6 * 3600, 10);
        churn = Some(new);
    });
    let mut churn = churn.unwrap();
    let held = held.bytes_current;
    println!("{held} bytes after 6 min");
    let grow = |_| {
        let left = churn.growth(6 * 3600, 10);
        println!("{left} bytes in 6 min more");
        left
    };
    let left: Vec<i64> = (0..9).map(grow).collect();
    let all: i64 = left.iter().sum();
    assert!(all.abs() * 100 < held, "{left:?} of {held} bytes");
}
