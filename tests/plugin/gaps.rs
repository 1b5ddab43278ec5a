//! Contacts of random pairs that collide, against the two shapes as convex sets: no kernel is used.

use crate::common::series::Series;
use moreau2d::contact::Vec2;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings, Pose64};

const DT: f64 = 1.0 / 60.0;

/// Corners of a convex set, and the radius added all round.
struct Set {
    points: Vec<Vec2>,
    rounding: f64,
}

impl Set {
    fn support(&self, pose: &Pose64, direction: Vec2) -> f64 {
        let points = self.points.iter().map(|p| direction.dot(&pose.apply(*p)));
        points.fold(f64::NEG_INFINITY, f64::max) + self.rounding
    }
}

/// Separation of two sets along a direction from the first to the second \[m\].
fn separation(sets: [&Set; 2], poses: [&Pose64; 2], direction: Vec2) -> f64 {
    -sets[1].support(poses[1], -direction) - sets[0].support(poses[0], direction)
}

/// The largest separation over all directions, by trying them: good to 1e-3 of the size.
fn apart(sets: [&Set; 2], poses: [&Pose64; 2]) -> f64 {
    let all = (0..720).map(|k| {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 720.0).sin_cos();
        separation(sets, poses, Vec2::new(cos, sin))
    });
    all.fold(f64::NEG_INFINITY, f64::max)
}

const KINDS: [&str; 8] = [
    "ball",
    "box",
    "round box",
    "capsule",
    "triangle",
    "polygon",
    "outline",
    "mesh",
];

fn shape(kind: &str, series: &mut Series) -> (ColliderBuilder, Set) {
    // numbers that single precision holds
    let number = |series: &mut Series, low, high| f64::from(series.within(low, high) as f32);
    let (a, b) = (number(series, 0.2, 0.5), number(series, 0.15, 0.4));
    let r = number(series, 0.05, 0.2);
    let vector = |p: &Vec2| Vector::new(p.x as Real, p.y as Real);
    let rectangle = [(-a, -b), (a, -b), (a, b), (-a, b)].map(|(x, y)| Vec2::new(x, y));
    let ring: Vec<Vec2> = (0..5)
        .map(|k| {
            let angle = std::f64::consts::TAU * (f64::from(k) + 0.6 * series.next()) / 5.0;
            let p = Vec2::new(a * angle.cos(), b * angle.sin());
            p.map(|x| f64::from(x as f32))
        })
        .collect();
    let vectors = |points: &[Vec2]| points.iter().map(vector).collect::<Vec<_>>();
    let set = |points: &[Vec2], rounding| Set {
        points: points.to_vec(),
        rounding,
    };
    let (x, y, radius) = (a as Real, b as Real, r as Real);
    match kind {
        "ball" => (ColliderBuilder::ball(radius), set(&[Vec2::zeros()], r)),
        "box" => (ColliderBuilder::cuboid(x, y), set(&rectangle, 0.0)),
        "round box" => {
            let round = ColliderBuilder::round_cuboid(x, y, radius);
            (round, set(&rectangle, r))
        }
        "capsule" => {
            let ends = [Vec2::new(-a, 0.0), Vec2::new(a, 0.0)];
            (ColliderBuilder::capsule_x(x, radius), set(&ends, r))
        }
        "triangle" => {
            let [p, q, s] = [&ring[0], &ring[2], &ring[3]].map(vector);
            let points = [ring[0], ring[2], ring[3]];
            (ColliderBuilder::triangle(p, q, s), set(&points, 0.0))
        }
        "polygon" => (
            ColliderBuilder::convex_polyline(vectors(&ring)).unwrap(),
            set(&ring, 0.0),
        ),
        "outline" => {
            let edges = (0..5).map(|i| [i, (i + 1) % 5]).collect();
            let outline = ColliderBuilder::oriented_polyline(vectors(&ring), Some(edges));
            (outline, set(&ring, 0.0))
        }
        _ => {
            let faces = vec![[0, 1, 2], [0, 2, 3]];
            let mesh = ColliderBuilder::trimesh(vectors(&rectangle), faces).unwrap();
            (mesh, set(&rectangle, 0.0))
        }
    }
}

/// Every impulse of a pair that is apart at the start of a step acts along a direction that separates
/// the two there, and across the gap that the two have along it at the midpoint.
#[test]
fn contacts_separate_a_pair_at_the_start_by_the_gap_that_it_has() {
    let mut series = Series(77);
    let (mut met, mut bad) = (0, Vec::new());
    for (one, two) in KINDS.iter().flat_map(|a| KINDS.map(|b| (*a, b))) {
        for trial in 0..60 {
            let (shapes, sets): (Vec<_>, Vec<_>) = [one, two]
                .map(|kind| shape(kind, &mut series))
                .into_iter()
                .unzip();
            let sets = [&sets[0], &sets[1]];
            // a face that turns had another direction at the start
            let spin = f64::from(trial % 2) * series.within(-3.0, 3.0);
            let turn = series.within(-3.0, 3.0);
            let way = series.within(-3.0, 3.0);
            let toward = Vec2::new(way.cos(), way.sin());
            let still = Pose64::new(Vec2::zeros(), 0.0);
            let placed = |t: f64| {
                let pose = Pose::new(
                    Vector::new((t * toward.x) as Real, (t * toward.y) as Real),
                    turn as Real,
                );
                Pose64::from_rapier(&pose)
            };
            // half a millimetre to three centimetres apart
            let gap = series.within(5e-4, 0.03);
            let (mut low, mut high) = (0.0, 4.0);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                match apart(sets, [&still, &placed(middle)]) < gap {
                    true => low = middle,
                    false => high = middle,
                }
            }
            let start = placed(high);
            let speed = series.within(2.5, 4.0);
            let across = series.within(-2.0, 2.0);
            let u = -toward * speed + Vec2::new(-toward.y, toward.x) * across;
            let mut world = PhysicsWorld::new();
            world.gravity = Vector::ZERO;
            let mass = MassProperties::new(Vector::ZERO, 1.0, 0.05);
            let body = || RigidBodyBuilder::dynamic().additional_mass_properties(mass);
            let mut shapes = shapes.into_iter();
            let mut add = |body: RigidBodyBuilder| {
                let shape = shapes.next().unwrap().density(0.0).friction(0.0);
                world.insert(body, shape).0
            };
            add(body());
            let second = add(body()
                .translation(Vector::new(
                    start.translation.x as Real,
                    start.translation.y as Real,
                ))
                .rotation(turn as Real)
                .linvel(Vector::new(u.x as Real, u.y as Real))
                .angvel(spin as Real));
            let settings = MoreauSettings {
                dt: Some(DT),
                ..MoreauSettings::default()
            };
            let mut pipeline = MoreauPipeline::new(settings).unwrap();
            pipeline
                .find_contacts(&mut world, &mut Default::default())
                .unwrap();
            let start = pipeline.pose(second).unwrap();
            let velocity = pipeline.velocity(second).unwrap();
            let record = pipeline.step(&mut world).unwrap();
            // what would get deep is located in time: until then the body flies
            let times = record.contacts.iter().map(|c| c.time);
            let (first, located) = (times.fold(DT, f64::min), record.events > 0);
            let time = if located { first } else { 0.5 * DT };
            let there = Pose64::new(
                start.translation + time * velocity.xy(),
                start.angle() + time * velocity.z,
            );
            let pressed: Vec<_> = (record.contacts.iter())
                .filter(|c| c.impulse_n > 0.0 && (!located || c.time == first))
                .collect();
            met += usize::from(!pressed.is_empty());
            for c in &pressed {
                let before = separation(sets, [&still, &start], c.normal);
                let now = separation(sets, [&still, &there], c.normal);
                let least = record.contacts.iter().filter(|d| d.normal == c.normal);
                let least = least.map(|d| d.gap).fold(f64::INFINITY, f64::min);
                // so had the direction between a round part and a corner that it passes
                let faces = spin == 0.0 && sets.iter().all(|set| set.rounding == 0.0);
                // of a chain other corners than the deepest may have the contact
                let convex = ![one, two]
                    .iter()
                    .any(|kind| ["outline", "mesh"].contains(kind));
                // sets that overlap do so along the direction; open ones may be nearest elsewhere
                let off = if now < 0.0 {
                    (least - now).abs()
                } else {
                    now - least
                };
                // numbers of size one in f64; poses are read from single precision
                if faces && before < -1e-6 || convex && off > 1e-6 {
                    bad.push(format!(
                        "{one} {two} {trial}: {before:.2e} at the start, {least:.3e} for {now:.3e}, \
                         normal {:.3} {:.3}",
                        c.normal.x, c.normal.y
                    ));
                }
            }
        }
    }
    bad.iter().for_each(|line| println!("{line}"));
    assert!(bad.is_empty(), "{} of {met}", bad.len());
    assert!(met > 1500, "{met}");
}
