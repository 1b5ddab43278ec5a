//! Every kind of slider over every kind of flush floor: none loses its speed, solids not as they land either, and a
//! real step of 0.1 mm is met.

use crate::common::at;
use moreau2d::dynamics::StepperSettings;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, widen};

const SPEED: f64 = 8.0;
/// Exact in single precision, so that the parts are flush.
const TILE: f64 = 0.375;
const TILES: std::ops::Range<i32> = -15..40;
/// Radius of discs and half the height of all others \[m\].
const HALF: f64 = 0.2;
const STEP: f64 = 1e-4;

/// Sliders with a flat side in front, and all others.
const SHARP: [&str; 9] = [
    "box",
    "hull",
    "outline",
    "two-sided outline",
    "two-sided clockwise",
    "open chain",
    "open solid",
    "trimesh",
    "compound",
];
const OTHERS: [&str; 6] = [
    "disc",
    "capsule",
    "round box",
    "triangle",
    "segment",
    "voxels",
];

const FLOORS: [&str; 15] = [
    "half-plane",
    "one box",
    "one trimesh",
    "one height field",
    "boxes",
    "trimeshes",
    "height fields",
    "chains",
    "two-sided chains",
    "segments",
    "voxels",
    "compound",
    "T-joint",
    "belt of boxes",
    "mixed",
];

fn points(list: &[(f64, f64)]) -> Vec<Vector> {
    list.iter().map(|&(x, y)| at(x, y)).collect()
}

fn ring(n: u32) -> Option<Vec<[u32; 2]>> {
    Some((0..n).map(|i| [i, (i + 1) % n]).collect())
}

fn slider(kind: &str) -> ColliderBuilder {
    let mut corners = [
        (-0.3, -HALF),
        (0.3, -HALF),
        (0.3, 0.1),
        (0.2, HALF),
        (-0.3, HALF),
    ];
    let tray = points(&[(-0.3, HALF), (-0.3, -HALF), (0.3, -HALF), (0.3, HALF)]);
    match kind {
        "box" => ColliderBuilder::cuboid(0.3, HALF as Real),
        "hull" => ColliderBuilder::convex_polyline(points(&corners)).unwrap(),
        "outline" => ColliderBuilder::oriented_polyline(points(&corners), ring(5)),
        "two-sided outline" => ColliderBuilder::polyline(points(&corners), ring(5)),
        "two-sided clockwise" => {
            corners.reverse();
            ColliderBuilder::polyline(points(&corners), ring(5))
        }
        "open chain" => ColliderBuilder::polyline(tray, None),
        "open solid" => ColliderBuilder::oriented_polyline(tray, None),
        "trimesh" => mesh(-0.3, 0.3, -HALF, HALF),
        "compound" => {
            let half = |x: f64| {
                (
                    Pose::from_translation(at(x, 0.0)),
                    SharedShape::cuboid(0.15, HALF as Real),
                )
            };
            ColliderBuilder::compound(vec![half(-0.15), half(0.15)])
        }
        "disc" => ColliderBuilder::ball(HALF as Real),
        "capsule" => ColliderBuilder::capsule_x(0.2, HALF as Real),
        "round box" => ColliderBuilder::round_cuboid(0.25, 0.15, 0.05),
        "triangle" => ColliderBuilder::triangle(at(-0.3, -HALF), at(0.3, -HALF), at(0.0, HALF)),
        "segment" => ColliderBuilder::segment(at(-0.3, -HALF), at(0.3, -HALF)),
        "voxels" => {
            let cells = [[-1, -1], [0, -1], [-1, 0], [0, 0]].map(|[i, j]| IVector::new(i, j));
            ColliderBuilder::voxels(at(HALF, HALF), &cells)
        }
        _ => unreachable!("{kind}"),
    }
}

fn mesh(left: f64, right: f64, low: f64, high: f64) -> ColliderBuilder {
    let corners = points(&[(left, high), (left, low), (right, high), (right, low)]);
    ColliderBuilder::trimesh(corners, vec![[0, 1, 2], [2, 1, 3]]).unwrap()
}

/// A tile of a floor of several, its top at y = 0.
fn tile(on: &str) -> ColliderBuilder {
    let half = 0.5 * TILE;
    match on {
        "trimeshes" => mesh(-half, half, -0.5, 0.0),
        "height fields" => ColliderBuilder::heightfield(vec![0.0; 3], at(TILE, 1.0)),
        // the solid below
        "chains" => {
            let chain = points(&[(half, 0.0), (0.1 * TILE, 0.0), (-half, 0.0)]);
            ColliderBuilder::oriented_polyline(chain, None)
        }
        "two-sided chains" => {
            let chain = points(&[(-half, 0.0), (0.1 * TILE, 0.0), (half, 0.0)]);
            ColliderBuilder::polyline(chain, None)
        }
        "segments" => ColliderBuilder::segment(at(-half, 0.0), at(half, 0.0)),
        "voxels" => {
            let cells = [-1, 0].map(|i| IVector::new(i, -1));
            ColliderBuilder::voxels(at(half, half), &cells)
        }
        _ => ColliderBuilder::cuboid(half as Real, 0.25).translation(at(0.0, -0.25)),
    }
}

/// A floor whose top is y = 0; from the tile `raised` on it is higher by [`STEP`].
fn floor(on: &str, raised: i32) -> PhysicsWorld {
    let mut world = PhysicsWorld::new();
    let up = |k: i32| if k >= raised { STEP } else { 0.0 };
    let fixed = |x: f64, y: f64| RigidBodyBuilder::fixed().translation(at(x, y));
    let smooth = |c: ColliderBuilder| c.friction(0.0);
    let wide = |x: f64, y: f64| {
        (
            fixed(x, y - 0.5),
            smooth(ColliderBuilder::cuboid(10.0, 0.5)),
        )
    };
    let mut add = |(body, collider): (RigidBodyBuilder, ColliderBuilder)| {
        world.insert(body, smooth(collider));
    };
    match on {
        "half-plane" => add((
            fixed(0.0, 0.0),
            ColliderBuilder::new(SharedShape::halfspace(Vector::Y)),
        )),
        "one box" => add((fixed(4.0, -0.5), ColliderBuilder::cuboid(12.0, 0.5))),
        "one trimesh" => {
            let at_x = |i: u32| -6.0 + TILE * f64::from(i);
            let corners = (0..=54).flat_map(|i| [at(at_x(i), 0.0), at(at_x(i), -0.5)]);
            let cells = (0..54).map(|i| 2 * i);
            let triangles = cells.flat_map(|i| [[i, i + 1, i + 2], [i + 2, i + 1, i + 3]]);
            let mesh = ColliderBuilder::trimesh(corners.collect(), triangles.collect());
            add((fixed(0.0, 0.0), mesh.unwrap()));
        }
        "one height field" => {
            add((
                fixed(4.0, 0.0),
                ColliderBuilder::heightfield(vec![0.0; 55], at(20.25, 1.0)),
            ));
        }
        "T-joint" => {
            add(wide(-10.0, 0.0));
            add((fixed(0.25, up(0) - 2.0), ColliderBuilder::cuboid(0.25, 2.0)));
            add(wide(10.5, up(0)));
        }
        "compound" => {
            let part = |k: i32| {
                let place = Pose::from_translation(at(TILE * f64::from(k), up(k) - 0.25));
                (place, SharedShape::cuboid((0.5 * TILE) as Real, 0.25))
            };
            add((
                fixed(0.0, 0.0),
                ColliderBuilder::compound(TILES.map(part).collect()),
            ));
        }
        "belt of boxes" => {
            for k in TILES {
                let place = at(TILE * f64::from(k), up(k));
                add((
                    RigidBodyBuilder::kinematic_velocity_based().translation(place),
                    tile(on),
                ));
            }
        }
        _ => {
            let kinds = ["boxes", "trimeshes", "height fields", "chains", "voxels"];
            for k in TILES {
                let kind = if on == "mixed" {
                    kinds[k.rem_euclid(5) as usize]
                } else {
                    on
                };
                add((fixed(TILE * f64::from(k), up(k)), tile(kind)));
            }
        }
    }
    world.gravity = at(0.0, -9.81);
    world
}

/// How a slider starts: its place, its height over the floor \[m\] and its speed [m/s].
#[derive(Clone, Copy)]
struct Start {
    place: f64,
    height: f64,
    speed: f64,
}

/// How a run is stepped.
#[derive(Clone, Copy, Debug)]
struct Run {
    dt: f64,
    events: bool,
}

const RUNS: [Run; 3] = [
    Run {
        dt: 1.0 / 60.0,
        events: false,
    },
    Run {
        dt: 1.0 / 240.0,
        events: false,
    },
    Run {
        dt: 1.0 / 60.0,
        events: true,
    },
];

/// Largest relative change of speed within a time \[s\], the last one, and how far it is from its height over
/// the floor at the end \[m\].
fn slide(kind: &str, mut world: PhysicsWorld, start: Start, run: Run, time: f64) -> [f64; 3] {
    let body = RigidBodyBuilder::dynamic()
        .translation(at(start.place, HALF + start.height))
        .linvel(at(start.speed, 0.0))
        .additional_mass_properties(MassProperties::new(Vector::ZERO, 1.0, 0.02))
        .can_sleep(false);
    let (body, _) = world.insert(body, slider(kind).density(0.0).friction(0.0));
    let mut pipeline = MoreauPipeline::new(MoreauSettings {
        stepper: StepperSettings {
            events: run.events,
            ..StepperSettings::default()
        },
        dt: Some(run.dt),
        stay_awake: true,
        ..MoreauSettings::default()
    })
    .unwrap();
    let speed = widen(start.speed as Real);
    let (mut worst, mut last) = (0.0f64, 0.0);
    for _ in 0..(time / run.dt).round() as usize {
        pipeline.step(&mut world).unwrap();
        let now = pipeline.velocity(body).unwrap().x;
        last = now / speed;
        worst = worst.max(((now - speed) / speed.max(0.1)).abs());
    }
    let height = pipeline.pose(body).unwrap().translation.y - HALF;
    [worst, last, height]
}

fn all() -> impl Iterator<Item = (&'static str, &'static str)> {
    let sliders = SHARP.into_iter().chain(OTHERS);
    sliders.flat_map(|kind| FLOORS.map(|on| (kind, on)))
}

/// Bugs: outlines of two-sided segments lost all of their speed on meshes, height fields and chains, one-sided
/// ones half of it on flush height fields; segments fell through flush sheets.
#[test]
fn no_slider_catches_on_a_seam() {
    let mut bad = Vec::new();
    for (kind, on) in all() {
        for (speed, place) in [
            (SPEED, -2.0),
            (SPEED, 0.05),
            (0.3, 0.5 * TILE - 0.3),
            (1e-3, 0.0),
        ] {
            for run in RUNS {
                let start = Start {
                    place,
                    height: 0.0,
                    speed,
                };
                let [lost, _, height] = slide(kind, floor(on, i32::MAX), start, run, 0.6);
                if lost > 1e-9 || height.abs() > 1e-6 {
                    bad.push(format!(
                        "{kind} on {on} from {place} at {speed}, {run:?}: {lost:e}, {height:e} m"
                    ));
                }
            }
        }
    }
    assert!(bad.is_empty(), "{} runs\n{}", bad.len(), bad.join("\n"));
}

/// What lands with a flat side below and a solid behind it. Not yet so: with events, round parts on meshes and
/// voxels, and sheets.
#[test]
fn no_solid_with_flat_sides_catches_on_a_seam_as_it_lands() {
    let solids = [
        "box",
        "hull",
        "outline",
        "open solid",
        "trimesh",
        "compound",
    ];
    let mut bad = Vec::new();
    for (kind, on) in all().filter(|(kind, _)| solids.contains(kind)) {
        for (height, place) in [(1e-4, -2.0), (1e-3, -1.9), (0.01, -1.8), (0.1, -1.65)] {
            for run in RUNS.into_iter().filter(|run| !run.events) {
                let start = Start {
                    place,
                    height,
                    speed: SPEED,
                };
                let [lost, _, height] = slide(kind, floor(on, i32::MAX), start, run, 0.6);
                if lost > 1e-9 || height.abs() > 1e-3 {
                    bad.push(format!(
                        "{kind} on {on} from {place}, {run:?}: {lost:e}, {height:e} m"
                    ));
                }
            }
        }
    }
    assert!(bad.is_empty(), "{} runs\n{}", bad.len(), bad.join("\n"));
}

/// The control: nothing with a flat side in front passes a step of 0.1 mm, at seven phases of the time step.
#[test]
fn a_real_step_is_met_on_every_floor() {
    let mut bad = Vec::new();
    for (kind, on) in all()
        .filter(|(kind, on)| SHARP.contains(kind) && !on.starts_with("one ") && *on != "half-plane")
    {
        let (raised, seam) = if on == "T-joint" {
            (0, 0.0)
        } else {
            (5, 4.5 * TILE)
        };
        for phase in 0..7 {
            let place = seam - 1.0 - SPEED / 60.0 * f64::from(phase) / 7.0;
            for run in RUNS {
                let start = Start {
                    place,
                    height: 0.0,
                    speed: SPEED,
                };
                let [_, left, _] = slide(kind, floor(on, raised), start, run, 0.2);
                if left > 0.9 {
                    bad.push(format!(
                        "{kind} on {on}, phase {phase}, {run:?}: {left} of the speed"
                    ));
                }
            }
        }
    }
    assert!(bad.is_empty(), "{} runs\n{}", bad.len(), bad.join("\n"));
}
