//! Two bodies that meet in free flight, measured on their corners alone.

use crate::common::{Random, parse};
use moreau2d::contact::Vec2;
use moreau2d::experiment::{Engine, simulate};
use moreau2d::scene::Built;

/// Corners of a box of half sizes `h`.
pub fn corners(built: &Built, k: usize, h: [f64; 2]) -> [Vec2; 4] {
    let (pose, _) = built.state(k).unwrap();
    [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[x, y]| pose.apply(Vec2::new(x * h[0], y * h[1])))
}

/// Depth \[m\] of two convex quadrilaterals in each other by separating axes; negative if apart.
pub fn depth(a: &[Vec2; 4], b: &[Vec2; 4]) -> f64 {
    let mut least = f64::INFINITY;
    for (own, other) in [(a, b), (b, a)] {
        for i in 0..4 {
            let edge = own[(i + 1) % 4] - own[i];
            let normal = Vec2::new(edge.y, -edge.x).normalize();
            let heights = other.iter().map(|p| normal.dot(&(p - own[i])));
            least = least.min(-heights.fold(f64::INFINITY, f64::min));
        }
    }
    least
}

/// Two boxes that meet at up to 12 m/s and turn at up to 20 rad/s, without gravity: the deepest overlap
/// at the end of a step \[m\].
fn meeting(seed: u64, [e, friction]: [f64; 2], dt: f64, events: bool) -> f64 {
    let mut random = Random(seed);
    let mut text = format!(
        "[scene]\nname = \"meeting\"\ntitle = \"Two boxes meet\"\n[gravity]\ny = 0\n[step]\n\
         time = 1\ndt = {dt:?}\nevents = {events}\n[[material]]\nname = \"m\"\n\
         friction = {friction}\nrestitution = {e}\n"
    );
    let mut halves = [[0.0; 2]; 2];
    for (k, side) in [-1.0, 1.0].into_iter().enumerate() {
        let size = [(); 2].map(|()| random.between(0.1, 0.6));
        halves[k] = size.map(|s| 0.5 * s);
        text += &format!(
            "[[body]]\nname = \"b{k}\"\nbox = [{:?}, {:?}]\nposition = [{:?}, {:?}]\n\
             angle = {:?}\nvelocity = [{:?}, {:?}]\nspin = {:?}\n",
            size[0],
            size[1],
            side * 0.6,
            random.between(-0.2, 0.2),
            random.between(-3.0, 3.0),
            -side * random.between(1.0, 6.0),
            random.between(-1.0, 1.0),
            random.between(-20.0, 20.0),
        );
    }
    let mut built = parse(&text).build().unwrap();
    let mut deepest = f64::NEG_INFINITY;
    simulate(
        &mut built,
        Engine::Moreau,
        (0.3 / dt) as usize,
        |_, built| {
            let [a, b] = [0, 1].map(|k| corners(built, k, halves[k]));
            deepest = deepest.max(depth(&a, &b));
            Ok(())
        },
    )
    .unwrap();
    deepest
}

/// Bug: two boxes that show no contact at the midpoint of a step, being corner to corner, or one that
/// opens, ended it up to 94 mm deep in each other, in 10 of the first 1000 meetings.
#[test]
fn boxes_that_rebound_in_flight_never_overlap() {
    let mut met = 0;
    for (dt, count) in [(1.0 / 60.0, 1000), (1.0 / 240.0, 300)] {
        for seed in 0..count {
            let friction = [0.0, 0.5][seed as usize % 2];
            let deepest = meeting(seed, [1.0, friction], dt, true);
            assert!(deepest < 1e-6, "{seed} at {dt}: {deepest:e} m");
            met += usize::from(deepest > -0.05);
        }
    }
    assert!(met > 1000, "{met}");
}

/// Bodies that stay in contact while they turn fast overlap by the curve of their path, to second order in
/// the step, less than without events. Without restitution the step sees that curve ahead.
///
/// Bug: bodies that turned by more than a tenth of a radian after an impact inside a step kept the overlap of that turn:
/// the sums were 60 and 2.8 mm, now 31 and 0.2 mm.
#[test]
fn boxes_that_land_in_flight_overlap_less_than_without_events() {
    for (e, count) in [(0.0, 200), (0.5, 200)] {
        let mut sums = [0.0; 2];
        let mut over = [0; 2];
        for seed in 0..count {
            for (k, events) in [false, true].into_iter().enumerate() {
                let deepest = meeting(seed, [e, 0.0], 1.0 / 60.0, events).max(0.0);
                sums[k] += deepest;
                over[k] += usize::from(deepest > 1e-3);
            }
        }
        println!("e {e}: {sums:?} {over:?}");
        let (share, most) = if e == 0.0 {
            (0.25, 0.04)
        } else {
            (0.01, 0.001)
        };
        assert!(
            sums[1] < most && sums[1] < share * sums[0] && 4 * over[1] < over[0],
            "{sums:?} {over:?}"
        );
    }
}

/// Bug: without events, boxes that were corner to corner at a midpoint, or had nearly parallel faces,
/// were met along the wrong axis, at one of two corners, or not at all: 9 of these 500 ended a step more than
/// 30 mm deep in each other, and 28 more than 10 mm, by the second order of their turn, up to 0.7 rad in a step.
#[test]
fn boxes_in_flight_are_met_along_the_axis_that_they_cross_last() {
    let deepest = (5000..5500).map(|seed| meeting(seed, [0.0, 0.5], 1.0 / 60.0, false));
    let deepest: Vec<f64> = deepest.collect();
    let over = |depth: f64| deepest.iter().filter(|d| **d > depth).count();
    println!("over 10 mm: {}, over 30 mm: {}", over(1e-2), over(3e-2));
    assert!(over(0.0) > 50 && over(1e-2) <= 1 && over(3e-2) == 0);
}
