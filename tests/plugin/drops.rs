//! Random drops of every kind of body on every kind of floor. Nothing falls through, and nothing stays
//! inside the floor, judged by geometry that shares nothing with contact detection.

use crate::common::series::Series;
use moreau2d::dynamics::StepperSettings;
use moreau2d::rapier::engine::prelude::*;
use moreau2d::rapier::{MoreauPipeline, MoreauSettings};

type Point = [f64; 2];

fn vector([x, y]: Point) -> Vector {
    Vector::new(x as Real, y as Real)
}

const BODIES: [&str; 9] = [
    "outline",
    "gear",
    "hollow",
    "hollow, clockwise",
    "segment",
    "hull",
    "compound",
    "capsule",
    "open chain",
];

const FLOORS: [&str; 10] = [
    "box",
    "tiles",
    "polyline",
    "two-sided polyline",
    "trimesh",
    "height field",
    "half-plane",
    "voxels",
    "bowl",
    "chain",
];

/// A convex polygon about the origin, counter-clockwise.
fn hull(series: &mut Series, size: f64) -> Vec<Point> {
    let n = 3 + (5.0 * series.next()) as usize;
    let wide = series.within(0.3, 1.0);
    let turn = series.within(0.0, 1.0);
    (0..n)
        .map(|k| {
            let angle = std::f64::consts::TAU * (k as f64 + turn + 0.3 * series.next()) / n as f64;
            [0.5 * size * angle.cos(), 0.5 * size * wide * angle.sin()]
        })
        .collect()
}

/// A toothed wheel about the origin, counter-clockwise.
fn gear(series: &mut Series, size: f64) -> Vec<Point> {
    let teeth = 4 + (6.0 * series.next()) as usize;
    let depth = series.within(0.1, 0.35);
    (0..4 * teeth)
        .map(|k| {
            let r = 0.5 * size * if k % 4 < 2 { 1.0 } else { 1.0 - depth };
            let angle = std::f64::consts::TAU * k as f64 / (4 * teeth) as f64;
            [r * angle.cos(), r * angle.sin()]
        })
        .collect()
}

fn ring(n: usize) -> Vec<[u32; 2]> {
    let n = n as u32;
    (0..n).map(|i| [i, (i + 1) % n]).collect()
}

fn rectangle(x: f64, y: f64, hx: f64, hy: f64) -> Vec<Point> {
    vec![
        [x - hx, y - hy],
        [x + hx, y - hy],
        [x + hx, y + hy],
        [x - hx, y + hy],
    ]
}

/// A collider, and the outlines that it has (open ones are lines), with a rounding [m].
fn body(series: &mut Series, kind: &str, size: f64) -> (ColliderBuilder, Vec<Vec<Point>>, f64) {
    let vectors = |points: &[Point]| points.iter().map(|p| vector(*p)).collect::<Vec<_>>();
    match kind {
        "outline" | "gear" => {
            let points = if kind == "gear" {
                gear(series, size)
            } else {
                hull(series, size)
            };
            let edges = ring(points.len());
            (
                ColliderBuilder::oriented_polyline(vectors(&points), Some(edges)),
                vec![points],
                0.0,
            )
        }
        "hollow" | "hollow, clockwise" => {
            let mut points = hull(series, size);
            if kind != "hollow" {
                points.reverse();
            }
            let edges = ring(points.len());
            (
                ColliderBuilder::polyline(vectors(&points), Some(edges)),
                vec![points],
                0.0,
            )
        }
        "segment" => {
            let points = vec![[-0.5 * size, 0.0], [0.5 * size, 0.0]];
            (
                ColliderBuilder::segment(vector(points[0]), vector(points[1])),
                vec![points],
                0.0,
            )
        }
        "open chain" => {
            let h = series.within(-0.3, 0.3) * size;
            let points = vec![[-0.5 * size, 0.0], [0.0, h], [0.5 * size, 0.0]];
            (
                ColliderBuilder::polyline(vectors(&points), None),
                vec![points],
                0.0,
            )
        }
        "hull" => {
            let points = hull(series, size);
            (
                ColliderBuilder::convex_polyline(vectors(&points)).unwrap(),
                vec![points],
                0.0,
            )
        }
        "capsule" => {
            let points = vec![[-0.3 * size, 0.0], [0.3 * size, 0.0]];
            let r = 0.2 * size;
            (
                ColliderBuilder::capsule_x((0.3 * size) as Real, r as Real),
                vec![points],
                r,
            )
        }
        _ => {
            let (a, b) = (0.5 * size, 0.1 * size);
            let parts = [(0.0, 0.0, a, b), (-a + b, a, b, a - b)];
            let shapes = parts.map(|(x, y, hx, hy)| {
                (
                    Pose::from_translation(vector([x, y])),
                    SharedShape::cuboid(hx as Real, hy as Real),
                )
            });
            let outlines = parts.map(|(x, y, hx, hy)| rectangle(x, y, hx, hy)).to_vec();
            (ColliderBuilder::compound(shapes.to_vec()), outlines, 0.0)
        }
    }
}

/// Heights of the wavy floors at their points.
fn wave(series: &mut Series, bowl: bool) -> Vec<Point> {
    let steep = series.within(0.0, 0.25);
    (0..=24)
        .map(|i| {
            let x = 0.5 * f64::from(i) - 6.0;
            let y = if bowl {
                0.08 * x * x
            } else {
                steep * (0.9 * x).sin() + 0.05 * x * x
            };
            [f64::from(x as f32), f64::from(y as f32)]
        })
        .collect()
}

/// Adds a floor; returns its surface, from left to right.
fn floor(series: &mut Series, kind: &str, world: &mut PhysicsWorld) -> Vec<Point> {
    let flat = vec![[-20.0, 0.0], [20.0, 0.0]];
    let fixed = |x: f64, y: f64| RigidBodyBuilder::fixed().translation(vector([x, y]));
    let wavy = series.next() < 0.5;
    let line = match kind {
        "bowl" => wave(series, true),
        "polyline" | "two-sided polyline" | "trimesh" | "height field" if wavy => {
            wave(series, false)
        }
        _ => flat.clone(),
    };
    let rightwards: Vec<Vector> = line.iter().map(|p| vector(*p)).collect();
    let leftwards: Vec<Vector> = rightwards.iter().rev().copied().collect();
    match kind {
        "box" => {
            let (half, x) = (series.within(0.6, 10.0), series.within(-0.5, 0.5));
            let deep = series.within(0.1, 2.0);
            world.insert(
                fixed(x, -deep),
                ColliderBuilder::cuboid(half as Real, deep as Real).friction(0.5),
            );
            let (a, b) = (x - half, x + half);
            // beside the box lies another floor, far below
            return vec![
                [-20.0, -50.0],
                [a, -50.0],
                [a, 0.0],
                [b, 0.0],
                [b, -50.0],
                [20.0, -50.0],
            ];
        }
        "tiles" => {
            for k in -30..30 {
                let x = 0.37 * (f64::from(k) + 0.5);
                world.insert(fixed(x, -0.5), ColliderBuilder::cuboid(0.185, 0.5));
            }
            return vec![[-0.37 * 30.0, 0.0], [0.37 * 30.0, 0.0]];
        }
        "polyline" | "bowl" => {
            world.insert(
                fixed(0.0, 0.0),
                ColliderBuilder::oriented_polyline(leftwards, None),
            );
        }
        "chain" => {
            // collinear segments, one-sided
            let points = (0..=40).map(|i| vector([10.0 - 0.5 * f64::from(i), 0.0]));
            world.insert(
                fixed(0.0, 0.0),
                ColliderBuilder::oriented_polyline(points.collect(), None),
            );
            return vec![[-10.0, 0.0], [10.0, 0.0]];
        }
        "two-sided polyline" => {
            world.insert(fixed(0.0, 0.0), ColliderBuilder::polyline(rightwards, None));
        }
        "trimesh" => {
            let n = rightwards.len() as u32;
            let mut points = rightwards.clone();
            points.extend(rightwards.iter().map(|p| Vector::new(p.x, -1.0)));
            let faces = (0..n - 1).flat_map(|i| [[i, n + i, i + 1], [i + 1, n + i, n + i + 1]]);
            world.insert(
                fixed(0.0, 0.0),
                ColliderBuilder::trimesh(points, faces.collect()).unwrap(),
            );
        }
        "height field" => {
            let heights = match line.len() {
                2 => vec![0.0; 25],
                _ => line.iter().map(|p| p[1] as Real).collect(),
            };
            let width = line[line.len() - 1][0] - line[0][0];
            world.insert(
                fixed(0.0, 0.0),
                ColliderBuilder::heightfield(heights, Vector::new(width as Real, 1.0)),
            );
        }
        "half-plane" => {
            world.insert(
                fixed(0.0, 0.0),
                ColliderBuilder::new(SharedShape::halfspace(Vector::Y)),
            );
        }
        _ => {
            let cells: Vec<_> = (-24..24)
                .flat_map(|i| [-1, -2].map(|j| IVector::new(i, j)))
                .collect();
            world.insert(
                fixed(0.0, 0.0),
                ColliderBuilder::voxels(Vector::new(0.5, 0.5), &cells),
            );
            return vec![[-12.0, 0.0], [12.0, 0.0]];
        }
    }
    line
}

/// Height of a floor at x; far below beside it.
fn surface(line: &[Point], x: f64) -> f64 {
    let pair = line.windows(2).find(|w| w[0][0] < x && x <= w[1][0]);
    match pair {
        Some([a, b]) => a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0]),
        _ => -50.0,
    }
}

fn distance(p: Point, [a, b]: [Point; 2]) -> f64 {
    let (d, e) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
    let t = ((d[0] * e[0] + d[1] * e[1]) / (d[0] * d[0] + d[1] * d[1])).clamp(0.0, 1.0);
    (e[0] - t * d[0]).hypot(e[1] - t * d[1])
}

fn inside(p: Point, outline: &[Point]) -> bool {
    let n = outline.len();
    let crossed = (0..n).filter(|&i| {
        let (a, b) = (outline[i], outline[(i + 1) % n]);
        (a[1] > p[1]) != (b[1] > p[1])
            && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    });
    crossed.count() % 2 == 1
}

/// How deep a body lies in a floor [m]: corners of one within the other.
fn depth(outlines: &[Vec<Point>], open: bool, rounding: f64, line: &[Point]) -> f64 {
    let to_floor = |p: Point| {
        let all = line.windows(2).map(|w| distance(p, [w[0], w[1]]));
        all.fold(f64::INFINITY, f64::min)
    };
    let mut most = 0.0f64;
    for points in outlines {
        for &p in points {
            let away = to_floor(p);
            let height = if p[1] < surface(line, p[0]) {
                -away
            } else {
                away
            };
            most = most.max(rounding - height);
        }
        if open {
            // of an outline that is a line, everything lies above the floor
            for (&q, w) in line
                .iter()
                .flat_map(|q| points.windows(2).map(move |w| (q, w)))
            {
                let share = (q[0] - w[0][0]) / (w[1][0] - w[0][0]);
                let above = q[1] - (w[0][1] + share * (w[1][1] - w[0][1]));
                if (0.0..=1.0).contains(&share) {
                    let away = distance(q, [w[0], w[1]]).copysign(above);
                    most = most.max(rounding + away);
                }
            }
        } else {
            for &q in line.iter().filter(|q| inside(**q, points)) {
                let n = points.len();
                let all = (0..n).map(|i| distance(q, [points[i], points[(i + 1) % n]]));
                most = most.max(all.fold(f64::INFINITY, f64::min));
            }
        }
    }
    most
}

/// What became of a drop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    Held,
    Inside,
    Through,
}

/// One drop; the seed chooses sizes, pose and speed.
pub fn drop_one(kind: &str, on: &str, seed: u64, dt: f64, events: bool) -> (End, f64) {
    let mut series = Series(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    for _ in 0..4 {
        series.next();
    }
    let size = series.within(0.3, 1.2);
    let mut world = PhysicsWorld::new();
    let line = floor(&mut series, on, &mut world);
    let (collider, outlines, rounding) = body(&mut series, kind, size);
    let parallel = series.next() < 0.3;
    let turn = if parallel {
        0.0
    } else {
        series.within(-3.2, 3.2)
    };
    let spin = if parallel {
        0.0
    } else {
        series.within(-8.0, 8.0)
    };
    let start = vector([
        series.within(-1.0, 1.0),
        size * series.within(1.2, 3.0) + 0.5,
    ]);
    let u = vector([series.within(-2.0, 2.0), series.within(-5.0, 0.0)]);
    let builder = RigidBodyBuilder::dynamic()
        .translation(start)
        .rotation(turn as Real)
        .linvel(if parallel { Vector::new(0.0, u.y) } else { u })
        .angvel(spin as Real)
        .additional_mass_properties(MassProperties::new(
            Vector::ZERO,
            1.0,
            (0.1 * size * size) as Real,
        ));
    let (handle, _) = world.insert(builder, collider.density(0.0).friction(0.5));
    let settings = MoreauSettings {
        stepper: StepperSettings {
            events,
            ..StepperSettings::default()
        },
        dt: Some(dt),
        ..MoreauSettings::default()
    };
    let mut pipeline = MoreauPipeline::new(settings).unwrap();
    let mut deep = 0.0;
    for step in 0..(4.0 / dt) as usize {
        pipeline.step(&mut world).unwrap();
        let pose = pipeline.pose(handle).unwrap();
        // off the floor's end it may fall
        let x = pose.translation.x;
        let (low, high) = match on {
            "box" => (line[1][0] - 0.5 * size, line[4][0] + 0.5 * size),
            _ => (line[0][0] + size, line[line.len() - 1][0] - size),
        };
        if x < low || x > high {
            return (End::Held, 0.0);
        }
        if step % 8 == 0 || step + 1 == (4.0 / dt) as usize {
            let placed: Vec<Vec<Point>> = outlines
                .iter()
                .map(|points| {
                    points
                        .iter()
                        .map(|&[x, y]| {
                            let p = pose.apply(moreau2d::contact::Vec2::new(x, y));
                            [p.x, p.y]
                        })
                        .collect()
                })
                .collect();
            let open = ["segment", "open chain", "capsule"].contains(&kind);
            deep = depth(&placed, open, rounding, &line);
            let top = placed
                .iter()
                .flatten()
                .map(|p| p[1] - surface(&line, p[0]))
                .fold(f64::NEG_INFINITY, f64::max);
            if top < -rounding - 0.05 * size && on != "box" {
                return (End::Through, deep / size);
            }
            if on == "box" && pose.translation.y < -0.5 * size - 0.05 {
                let fell_beside =
                    pose.translation.x < line[1][0] || pose.translation.x > line[4][0];
                return (
                    if fell_beside { End::Held } else { End::Through },
                    deep / size,
                );
            }
        }
    }
    let end = if deep > 1e-4 * size {
        End::Inside
    } else {
        End::Held
    };
    (end, deep / size)
}

/// How many drops of each kind on each floor, one per seed, end badly: through, inside.
fn ladder(seeds: std::ops::Range<u64>, dts: &[f64]) -> [usize; 2] {
    let mut all = [0, 0];
    for kind in BODIES {
        for on in FLOORS {
            let mut bad = [Vec::new(), Vec::new()];
            for (k, &dt) in seeds
                .clone()
                .flat_map(|k| dts.iter().map(move |dt| (k, dt)))
            {
                for events in [false, true] {
                    let (end, deep) = drop_one(kind, on, k, dt, events);
                    let name = format!(
                        "{k}@{}{}",
                        (1.0 / dt).round(),
                        if events { "e" } else { "" }
                    );
                    match end {
                        End::Held => {}
                        End::Inside => bad[0].push(format!("{name}:{deep:.1e}")),
                        End::Through => bad[1].push(name),
                    }
                }
            }
            if bad.iter().any(|list| !list.is_empty()) {
                println!("{kind} on {on}: through {:?}, inside {:?}", bad[1], bad[0]);
            }
            all[0] += bad[1].len();
            all[1] += bad[0].len();
        }
    }
    all
}

/// Bug: a closed outline fell through a box or stayed inside in 27 of 60 drops, and a segment that
/// lay parallel fell through every floor made of segments.
#[test]
fn nothing_falls_through() {
    let [through, inside] = ladder(0..1, &[1.0 / 60.0]);
    assert_eq!(through, 0);
    // what an impact leaves is parted by the stepper
    assert_eq!(inside, 0);
}

/// Bugs: a segment that rested a little too deep in one-sided segments fell through them; two segments
/// that cross at the corner of a chain were pressed through each other, as their centres told the sides; a
/// segment that slid into a valley passed below the next segment, whose corner seemed to press on it;
/// a thin outline took a floor beneath its upper face for one above it.
#[test]
fn drops_that_once_ended_badly_hold() {
    for (kind, on, seed, hz, events) in [
        ("segment", "polyline", 101, 60.0, false),
        ("segment", "trimesh", 300, 240.0, false),
        ("segment", "height field", 302, 60.0, true),
        ("segment", "two-sided polyline", 102, 240.0, false),
        ("segment", "two-sided polyline", 201, 60.0, false),
        ("open chain", "polyline", 301, 60.0, true),
        ("open chain", "two-sided polyline", 103, 60.0, true),
        ("outline", "two-sided polyline", 202, 60.0, false),
        ("outline", "height field", 202, 240.0, false),
        // the bottom of a valley between two segments
        ("segment", "two-sided polyline", 1002, 60.0, false),
        ("segment", "height field", 1002, 240.0, true),
        ("segment", "bowl", 1400, 60.0, false),
        // a corner that landed is not seen where another one is deeper
        ("open chain", "height field", 301, 60.0, true),
        ("hollow, clockwise", "tiles", 1701, 60.0, true),
        // a segment of the floor is overlapped all the time, another one is passed in the step
        ("segment", "two-sided polyline", 7101, 60.0, false),
        ("segment", "height field", 7100, 240.0, false),
        ("open chain", "two-sided polyline", 1602, 60.0, true),
        // an overlap hides what another contact of the pair does
        ("segment", "two-sided polyline", 6903, 60.0, false),
        ("segment", "height field", 7101, 240.0, false),
        // a corner that lies on a segment to the last digit
        ("hollow", "height field", 5602, 60.0, false),
        ("hollow", "two-sided polyline", 7401, 60.0, false),
        // slides over the corner of two segments, below it by rounding
        ("segment", "two-sided polyline", 2901, 60.0, false),
        // an end of a segment lands on the seam of two boxes
        ("segment", "tiles", 2600, 60.0, false),
        // a free end that slides over a corner, flat or on a hill
        ("open chain", "height field", 1701, 60.0, true),
        ("open chain", "two-sided polyline", 3601, 240.0, true),
        // corners of two chains meet, above each other for a step
        ("open chain", "two-sided polyline", 8401, 60.0, false),
        ("open chain", "height field", 9803, 60.0, true),
        // not below the corner, but beside it
        ("segment", "height field", 1200, 60.0, false),
        ("open chain", "two-sided polyline", 402, 240.0, true),
        // nearer to the neighbour of a segment than to the segment: outside, and behind it
        ("hollow", "two-sided polyline", 1, 240.0, true),
        // each of three segments of a floor leaves a sheet to the next
        ("segment", "two-sided polyline", 5202, 60.0, false),
        // nearly in line with a segment, and a little behind it
        ("hollow", "two-sided polyline", 5603, 60.0, true),
        // a tooth lands while another one rises
        ("gear", "voxels", 5300, 60.0, true),
        ("gear", "polyline", 6103, 60.0, true),
    ] {
        let (end, deep) = drop_one(kind, on, seed, 1.0 / hz, events);
        assert_eq!(end, End::Held, "{kind} on {on}, {seed}: {deep:e}");
    }
}

/// `cargo test --release --test plugin -- --ignored drops --nocapture`
#[test]
#[ignore = "a minute"]
fn nothing_falls_through_in_a_thousand_drops() {
    let first = std::env::var("SEED").map_or(0, |seed| seed.parse().unwrap());
    let [through, inside] = ladder(first..first + 4, &[1.0 / 60.0, 1.0 / 240.0]);
    println!("{through} through, {inside} inside");
    assert_eq!([through, inside], [0, 0]);
}
