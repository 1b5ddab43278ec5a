//! Steps of worlds of every kind.

use super::{THREADS, at, grounded, heap, places};
use moreau2d::dynamics::{Detection, Scheme, StepperSettings};
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};
use moreau2d::solver::Shares;

/// Chains of links with limits, hung up at one end, that swing down onto a post.
fn chains(world: &mut PhysicsWorld) {
    for x in places() {
        let (hook, _) = world.insert(
            RigidBodyBuilder::fixed().translation(Vector::new(x, 8.0)),
            ColliderBuilder::ball(0.1),
        );
        world.insert(
            RigidBodyBuilder::fixed().translation(Vector::new(x + 1.0, 5.0 + 0.01 * x)),
            ColliderBuilder::ball(0.4),
        );
        let mut before = hook;
        for k in 0..24 {
            let place = at(x + 0.4 * k as Real + 0.2, 8.0);
            let link = ColliderBuilder::cuboid(0.15, 0.05).density(1.0 + k as Real);
            let (link, _) = world.insert(place, link);
            let joint = RevoluteJointBuilder::new()
                // every fourth joint is built with a gap, which the energy bound does not let close at once
                .local_anchor1(Vector::new(
                    if k == 0 {
                        0.0
                    } else if k % 4 == 0 {
                        0.6
                    } else {
                        0.2
                    },
                    0.0,
                ))
                .local_anchor2(Vector::new(-0.2, 0.0))
                .limits([-0.9, 0.9])
                .contacts_enabled(false);
            world.insert_impulse_joint(before, link, joint);
            before = link;
        }
    }
}

/// Towers that a piston presses down further than they give way.
fn pressed(world: &mut PhysicsWorld) {
    for x in places() {
        for k in 0..12 {
            let square = ColliderBuilder::cuboid(0.25, 0.25);
            world.insert(at(x, 0.25 + 0.5 * k as Real), square);
        }
        let piston = RigidBodyBuilder::kinematic_velocity_based()
            .translation(Vector::new(x, 6.6))
            .linvel(Vector::new(0.0, -1.0 - 1e-3 * x));
        world.insert(piston, ColliderBuilder::cuboid(0.5, 0.5));
    }
}

/// A heap of boxes, balls and compounds in a trough of two-sided segments, with so many contacts in one
/// place that threads share their detection and the choice of their rules.
fn trough(world: &mut PhysicsWorld) {
    let wave = |k: usize| Vector::new(0.5 * k as Real - 12.0, 0.1 * (k % 2) as Real + 1.0);
    let floor = std::iter::once(Vector::new(-12.5, 9.0));
    let floor = floor
        .chain((0..49).map(wave))
        .chain([Vector::new(12.5, 9.0)]);
    world.insert(
        RigidBodyBuilder::fixed(),
        ColliderBuilder::polyline(floor.collect(), None),
    );
    for k in 0..2000usize {
        let (column, row) = (k % 40, k / 40);
        let place = at(
            0.53 * column as Real - 10.4 + 0.02 * (row % 3) as Real,
            1.5 + 0.47 * row as Real,
        );
        let body = place.rotation(0.02 * (k % 7) as Real);
        let part = |y: Real| (Pose::from_translation(Vector::new(0.0, y)), half(k));
        match k % 4 {
            0 => world.insert(body, ColliderBuilder::ball(0.22)),
            1 => world.insert(body, ColliderBuilder::compound(vec![part(-0.1), part(0.1)])),
            _ => world.insert(body, ColliderBuilder::cuboid(0.24, 0.2)),
        };
    }
}

/// Boxes at rest whose corner is at the seam of two tiles: which way it is met is decided after all contacts are
/// found. As many balls in flight as make threads share that.
fn seams(world: &mut PhysicsWorld) {
    // nothing moves a box off its seam
    world.gravity = Vector::ZERO;
    for k in 0..600 {
        let tile = RigidBodyBuilder::fixed().translation(Vector::new(k as Real, -0.5));
        world.insert(tile, ColliderBuilder::cuboid(0.5, 0.5));
        world.insert(
            at(k as Real + 0.25, 0.25),
            ColliderBuilder::cuboid(0.25, 0.25),
        );
        for row in 0..3 {
            let ball = at(k as Real, 5.0 + row as Real).linvel(Vector::new(0.0, 9.0));
            world.insert(ball, ColliderBuilder::ball(0.2));
        }
    }
}

/// Open outlines of two-sided segments that slide over flush ones: the sides on which they touch are
/// remembered from step to step.
fn sheets(world: &mut PhysicsWorld) {
    let line = |points: &[(Real, Real)]| {
        let points = points.iter().map(|p| Vector::new(p.0, p.1)).collect();
        ColliderBuilder::polyline(points, None).friction(0.0)
    };
    for k in 0..1300 {
        let tile = RigidBodyBuilder::fixed().translation(Vector::new(0.375 * k as Real, 50.0));
        world.insert(tile, line(&[(-0.1875, 0.0), (0.0375, 0.0), (0.1875, 0.0)]));
    }
    for k in 0..600 {
        let tray = at(0.8 * k as Real, 50.2).linvel(Vector::new(8.0, 0.0));
        let tray = tray.additional_mass_properties(MassProperties::new(Vector::ZERO, 1.0, 0.02));
        let outline = [(-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2), (0.3, 0.2)];
        world.insert(tray, line(&outline).density(0.0));
    }
}

/// One of the two flat boxes of a compound.
fn half(k: usize) -> SharedShape {
    SharedShape::cuboid(0.2 + 0.002 * (k % 5) as Real, 0.1)
}

/// What a case is stepped with, for how many steps, and what its records must show.
struct Case {
    name: &'static str,
    settings: StepperSettings,
    world: fn(&mut PhysicsWorld),
    steps: usize,
    shows: fn(&Counts) -> bool,
}

#[derive(Debug, Default)]
struct Counts {
    unsolved: usize,
    relaxed: usize,
    events: usize,
    joints_capped: usize,
    redundant: usize,
    most_islands: usize,
    /// Contacts found at the end, near ones too.
    found: usize,
}

fn cases() -> Vec<Case> {
    let settings = StepperSettings::default;
    vec![
        Case {
            name: "heaps",
            settings: settings(),
            world: |w| places().for_each(|x| heap(w, x, 0.0, 0)),
            steps: 50,
            shows: |c| c.most_islands >= 10,
        },
        Case {
            name: "heaps that bounce, with events",
            settings: StepperSettings {
                events: true,
                ..settings()
            },
            world: |w| places().for_each(|x| heap(w, x, 0.7, 0)),
            steps: 16,
            shows: |c| c.events > 0,
        },
        Case {
            name: "heaps with dominance",
            settings: settings(),
            world: |w| places().for_each(|x| heap(w, x, 0.0, 1)),
            steps: 8,
            shows: |c| c.most_islands >= 10,
        },
        Case {
            name: "heaps that sweeps do not solve",
            settings: StepperSettings {
                solver: "nsgs".to_owned(),
                tolerance: 1e-14,
                ..settings()
            },
            world: |w| places().for_each(|x| heap(w, x, 0.0, 0)),
            steps: 20,
            shows: |c| c.unsolved > 0,
        },
        Case {
            name: "heaps with least shares",
            settings: StepperSettings {
                shares: Shares::MinimumNorm,
                ..settings()
            },
            world: |w| places().for_each(|x| heap(w, x, 0.0, 0)),
            steps: 40,
            shows: |c| c.redundant > 0,
        },
        Case {
            name: "heaps of the published scheme",
            settings: StepperSettings {
                scheme: Scheme::Moreau,
                ..settings()
            },
            world: |w| places().for_each(|x| heap(w, x, 0.0, 0)),
            steps: 30,
            shows: |c| c.most_islands >= 10,
        },
        Case {
            name: "chains",
            settings: settings(),
            world: chains,
            steps: 60,
            shows: |c| c.joints_capped > 0,
        },
        Case {
            name: "a heap in a trough",
            settings: settings(),
            world: trough,
            steps: 30,
            // below 2000 contacts no work is shared out
            shows: |c| c.found >= 3000,
        },
        Case {
            name: "boxes at seams",
            settings: StepperSettings {
                keep_rest: false,
                ..settings()
            },
            world: seams,
            steps: 4,
            shows: |c| c.found >= 2000,
        },
        Case {
            name: "sheets on sheets",
            settings: settings(),
            world: sheets,
            steps: 6,
            shows: |c| c.found >= 2000,
        },
        Case {
            name: "a heap in a trough, with events",
            settings: StepperSettings {
                events: true,
                ..settings()
            },
            world: trough,
            steps: 30,
            shows: |c| c.found >= 3000,
        },
        Case {
            name: "towers pressed flat",
            settings: settings(),
            world: pressed,
            steps: 10,
            shows: |c| c.unsolved > 0 && c.relaxed > 0,
        },
    ]
}

/// The record, and pose and velocity of every body, of each step as text: it tells every bit of a
/// float.
fn trace(case: &Case, threads: usize) -> (Vec<String>, Counts) {
    let mut world = grounded();
    (case.world)(&mut world);
    let mut pipeline = MoreauPipeline::new(MoreauSettings {
        stepper: StepperSettings {
            threads,
            ..case.settings.clone()
        },
        ..MoreauSettings::default()
    })
    .unwrap();
    let mut counts = Counts::default();
    let mut steps = Vec::new();
    for _ in 0..case.steps {
        let record = pipeline.step(&mut world).unwrap();
        // bodies move as the impulses that are told have them, capped or not
        let energy = &record.energy;
        let scale = energy.kinetic_start + energy.kinetic_end + energy.forces.abs();
        let left = energy.imbalance().abs();
        assert!(left <= 1e-9 * scale, "{}: {left} J of {scale}", case.name);
        counts.unsolved += record.unsolved;
        counts.relaxed += record.relaxed;
        counts.events += record.events;
        counts.joints_capped += record.joints_capped;
        counts.redundant += record.redundant;
        counts.most_islands = counts.most_islands.max(record.islands);
        let bodies = world.bodies.iter().map(|(handle, _)| handle);
        let states: Vec<_> = bodies
            .map(|b| (pipeline.pose(b), pipeline.velocity(b)))
            .collect();
        steps.push(format!("{record:?} {states:?}"));
    }
    let mut found = Detection::default();
    pipeline.find_contacts(&mut world, &mut found).unwrap();
    counts.found = found.contacts.len();
    (steps, counts)
}

#[test]
fn every_number_of_threads_gives_the_same_bytes() {
    for case in cases() {
        let (one, counts) = trace(&case, 1);
        assert!((case.shows)(&counts), "{}: {counts:?}", case.name);
        for threads in THREADS {
            let (others, _) = trace(&case, threads);
            let same = one.iter().zip(&others).position(|(a, b)| a != b);
            assert_eq!(same, None, "{}, {threads} threads: first step", case.name);
            assert_eq!(one.len(), others.len());
        }
    }
}
