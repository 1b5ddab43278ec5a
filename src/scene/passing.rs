//! Detects that one body passed through another, from their poses alone.

use super::convex::gap;
use super::overlap::Leaf;
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Ratio of depth to the thickness of the thinner leaf above which two leaves on a straight path are
/// inside each other, not just touching.
const INSIDE: f64 = 0.25;

/// Ratio of depth to the thickness of the thinner leaf up to which two leaves count as apart.
const APART: f64 = 0.01;

/// Thickness that a pair of segments counts with, over the shorter one.
const THIN: f64 = 4e-3;

/// Largest number of poses that are tested on a path.
const MOST_SAMPLES: f64 = 256.0;

/// Finds pairs of leaves that were apart before, are apart now, and were deep inside each other on
/// the straight path between the two poses. On this path translation and angle are proportional to
/// time.
///
/// A pair that begins to overlap is followed from the last poses at which it was apart, for a window
/// of steps. An overlap beyond this window counts as a lasting overlap, not as a passage. Followed pairs
/// must have been deep inside each other on the paths of their single steps as well: the link of a belt
/// that runs around a pulley, and touches it all the way, would pass through it on a straight path.
#[derive(Serialize, Deserialize)]
pub(super) struct Passing {
    /// Steps for which an overlapped pair is followed.
    window: usize,
    step: usize,
    followed: FxHashMap<(u32, u32), Followed>,
}

#[derive(Serialize, Deserialize)]
struct Followed {
    /// Poses of both bodies when the leaves were last apart, and the step after it.
    from: [Pose64; 2],
    since: usize,
    /// The last step in which they overlapped.
    last: usize,
    /// Whether they were deep inside each other on the path of a step.
    deep: bool,
}

impl Passing {
    pub fn new(window: usize) -> Self {
        Passing {
            window,
            step: 0,
            followed: FxHashMap::default(),
        }
    }

    /// Notes the depth \[m\] of two leaves in this step; `before` are the poses before it.
    pub fn overlap(
        &mut self,
        leaves: &[Leaf],
        i: u32,
        j: u32,
        depth: f64,
        before: &[Option<Pose64>],
    ) {
        let pair = [&leaves[i as usize], &leaves[j as usize]];
        if depth <= APART * thinner(pair) {
            return;
        }
        let step = self.step;
        if let Some(known) = self.followed.get_mut(&(i, j)) {
            known.last = step;
        } else if let [Some(a), Some(b)] = pair.map(|leaf| before[leaf.body as usize]) {
            self.followed.insert(
                (i, j),
                Followed {
                    from: [a, b],
                    since: step,
                    last: step,
                    deep: false,
                },
            );
        }
    }

    /// Ends a step. Returns the pairs of bodies that passed through each other, in order.
    pub fn step(
        &mut self,
        leaves: &[Leaf],
        before: &[Option<Pose64>],
        now: &[Option<Pose64>],
        counts: impl Fn(u32, u32) -> bool,
    ) -> Vec<[u32; 2]> {
        let mut passed = BTreeSet::new();
        let (step, window) = (self.step, self.window);
        for (&(i, j), known) in &mut self.followed {
            let pair = [&leaves[i as usize], &leaves[j as usize]];
            let at = |poses: &[Option<Pose64>]| {
                let [a, b] = pair.map(|leaf| poses[leaf.body as usize]);
                Some([a?, b?])
            };
            if let (false, Some(from), Some(to)) = (known.deep, at(before), at(now)) {
                known.deep = is_deep(pair, from, to);
            }
        }
        let followed = &self.followed;
        let mut note = |i: u32, j: u32, from: [Pose64; 2], to: [Pose64; 2]| {
            let pair = [&leaves[i as usize], &leaves[j as usize]];
            if passes(pair, from, to) {
                let bodies = pair.map(|leaf| leaf.body);
                passed.insert([bodies[0].min(bodies[1]), bodies[0].max(bodies[1])]);
            }
        };
        for (i, j) in crossed(leaves, before, now) {
            let at = |poses: &[Option<Pose64>]| {
                let [a, b] = [i, j].map(|k| poses[leaves[k as usize].body as usize]);
                Some([a?, b?])
            };
            if !counts(i, j) || followed.contains_key(&(i, j)) {
                continue;
            }
            if let (Some(from), Some(to)) = (at(before), at(now)) {
                note(i, j, from, to);
            }
        }
        let parted = (followed.iter()).filter(|(_, known)| known.last < step && known.deep);
        for (&(i, j), known) in parted {
            let [a, b] = [i, j].map(|k| now[leaves[k as usize].body as usize]);
            if let (Some(a), Some(b)) = (a, b) {
                note(i, j, known.from, [a, b]);
                // a bar on a pin turns past a post: the post passes the bar on a straight path, seen from it
                for base in 0..2 {
                    let [from, to] = [known.from, [a, b]].map(|poses| seen_from(base, poses));
                    note(i, j, from, to);
                }
            }
        }
        self.followed
            .retain(|_, known| known.last == step && step - known.since < window);
        self.step += 1;
        passed.into_iter().collect()
    }
}

/// Pairs of leaves, the smaller number first, whose boxes over the whole step meet and of which one
/// moved by more than a quarter of its thickness.
fn crossed(leaves: &[Leaf], before: &[Option<Pose64>], now: &[Option<Pose64>]) -> Vec<(u32, u32)> {
    let fast: Vec<bool> = leaves
        .iter()
        .map(|leaf| {
            let k = leaf.body as usize;
            let (Some(from), Some(to)) = (before[k], now[k]) else {
                return false;
            };
            travel(leaf, [from, to]) > INSIDE * leaf.thickness && from != to
        })
        .collect();
    if !fast.contains(&true) {
        return Vec::new();
    }
    let mut boxes: Vec<(u32, [Vec2; 2])> = Vec::new();
    for (k, leaf) in leaves.iter().enumerate() {
        let body = leaf.body as usize;
        let (Some(from), Some(to)) = (before[body], now[body]) else {
            continue;
        };
        let (a, b) = (from.apply(leaf.centre), to.apply(leaf.centre));
        // the centre moves on an arc: its distance from the chord is at most the arc's height
        let height = leaf.centre.norm() * (1.0 - (0.5 * turn(&from, &to)).cos());
        let r = leaf.radius_of_all + height;
        boxes.push((
            k as u32,
            [a.inf(&b).add_scalar(-r), a.sup(&b).add_scalar(r)],
        ));
    }
    boxes.sort_by(|a, b| a.1[0].x.total_cmp(&b.1[0].x));
    let mut found = Vec::new();
    for (at, (i, [low, high])) in boxes.iter().enumerate() {
        for (j, [other_low, other_high]) in &boxes[at + 1..] {
            if other_low.x >= high.x {
                break;
            }
            let meets = other_low.y < high.y && low.y < other_high.y;
            if meets && (fast[*i as usize] || fast[*j as usize]) {
                found.push((*i.min(j), *i.max(j)));
            }
        }
    }
    found
}

/// Poses of two bodies in the frame of one of them.
fn seen_from(base: usize, poses: [Pose64; 2]) -> [Pose64; 2] {
    let own = poses[base];
    poses.map(|pose| {
        let place = own.apply_inverse(pose.translation);
        Pose64::new(place, turn(&own, &pose))
    })
}

/// Longest way \[m\] of any point of a leaf between the poses.
fn travel(leaf: &Leaf, [from, to]: [Pose64; 2]) -> f64 {
    (to.translation - from.translation).norm() + swept(leaf, [from, to])
}

/// Longest arc \[m\] of any point of a leaf about the origin of its body.
fn swept(leaf: &Leaf, [from, to]: [Pose64; 2]) -> f64 {
    turn(&from, &to).abs() * leaf.reach
}

/// Angle \[rad\] between two poses, at most half a turn.
fn turn(from: &Pose64, to: &Pose64) -> f64 {
    (from.cos * to.sin - from.sin * to.cos).atan2(from.cos * to.cos + from.sin * to.sin)
}

/// Thickness \[m\] of the thinner leaf. If one leaf is a segment, that of the other; if both are, a share of
/// the shorter one: an outline of segments that lies on a line crosses it by rounding.
fn thinner([a, b]: [&Leaf; 2]) -> f64 {
    match (a.thickness > 0.0, b.thickness > 0.0) {
        (true, true) => a.thickness.min(b.thickness),
        (false, false) => THIN * a.radius_of_all.min(b.radius_of_all),
        _ => a.thickness.max(b.thickness),
    }
}

/// Whether two leaves, apart at both ends of a straight path, were inside each other on it.
fn passes(pair: [&Leaf; 2], from: [Pose64; 2], to: [Pose64; 2]) -> bool {
    let apart = |poses: [Pose64; 2]| depth(pair, poses) <= APART * thinner(pair);
    way(pair, from, to) > INSIDE * thinner(pair)
        && !is_behind(pair, from)
        && apart(from)
        && apart(to)
        && is_deep(pair, from, to)
}

/// How far \[m\] any point of one leaf moves seen from the other: a translation of both changes nothing.
fn way(pair: [&Leaf; 2], from: [Pose64; 2], to: [Pose64; 2]) -> f64 {
    let [a, b] = [0, 1].map(|k| to[k].translation - from[k].translation);
    let arcs = [0, 1].map(|k| swept(pair[k], [from[k], to[k]]));
    (a - b).norm() + arcs[0] + arcs[1]
}

/// Whether two leaves were inside each other on a straight path.
fn is_deep(pair: [&Leaf; 2], from: [Pose64; 2], to: [Pose64; 2]) -> bool {
    let (thin, way) = (thinner(pair), way(pair, from, to));
    let samples = (4.0 * way / (INSIDE * thin)).ceil();
    // two points have no thickness
    let samples = if samples.is_nan() {
        1.0
    } else {
        samples.clamp(1.0, MOST_SAMPLES)
    };
    let depth = |s: f64| depth(pair, [0, 1].map(|k| between(&from[k], &to[k], s)));
    let mut k = 0.0;
    while k <= samples {
        let now = depth(k / samples);
        if now > INSIDE * thin {
            return true;
        }
        // as long as the way is shorter than the gap they stay apart
        k += (-now / way * samples).floor().max(1.0);
    }
    false
}

/// Whether one of the leaves is a slab and the other lies behind its edge.
fn is_behind(pair: [&Leaf; 2], poses: [Pose64; 2]) -> bool {
    (0..2).filter(|&k| pair[k].slab).any(|k| {
        let (slab, other) = (pair[k], pair[1 - k]);
        let [a, b] = [slab.core[0], slab.core[1]].map(|p| poses[k].apply(p));
        let corners = other.core.iter().map(|p| poses[1 - k].apply(*p));
        let centre = corners.sum::<Vec2>() / other.core.len() as f64;
        // the solid is on the left of the edge
        (b - a).perp(&(centre - a)) > 0.0
    })
}

/// Depth \[m\] of two leaves at these poses. Negative if they are apart, by at least as much.
fn depth(pair: [&Leaf; 2], poses: [Pose64; 2]) -> f64 {
    let place = |k: usize| -> Vec<Vec2> {
        let corners = pair[k].core.iter();
        corners.map(|p| poses[k].apply(*p)).collect()
    };
    let touch = pair[0].radius + pair[1].radius;
    touch - gap(&place(0), &place(1), touch)
}

/// The pose at share `s` of the way.
fn between(from: &Pose64, to: &Pose64, s: f64) -> Pose64 {
    Pose64::new(
        from.translation + (to.translation - from.translation) * s,
        from.angle() + turn(from, to) * s,
    )
}

#[cfg(test)]
mod tests {
    use super::super::Scene;
    use super::super::overlap::Overlaps;
    use super::*;

    /// A wall 0.1 m thick, a one-sided floor at y = -2 and a mover of the shape `shape`.
    fn scene(shape: &str) -> Overlaps {
        let text = format!(
            "[scene]\nname = \"s\"\ntitle = \"t\"\n\
             [[body]]\nname = \"wall\"\nkind = \"fixed\"\nbox = [0.1, 2]\n\
             [[body]]\nname = \"floor\"\nkind = \"fixed\"\npolyline = [[9, -2], [-9, -2]]\n\
             [[body]]\nname = \"mover\"\n{shape}\nposition = [-3, 0]\n"
        );
        let scene = Scene::parse("s.toml", &text, &[]).unwrap();
        Overlaps::new(&scene.bodies, &scene.joints, 0.01)
    }

    /// Passages over a series of poses (x, y, angle) of the mover, each with the step it ends in.
    fn passages(shape: &str, poses: &[[f64; 3]]) -> Vec<(usize, [u32; 2])> {
        let mut overlaps = scene(shape);
        let mut found = Vec::new();
        for (k, [x, y, angle]) in poses.iter().enumerate() {
            let still = Pose64::new(Vec2::zeros(), 0.0);
            let moved = Pose64::new(Vec2::new(*x, *y), *angle);
            let measured = overlaps.measure(|body| Some(if body == 2 { moved } else { still }));
            found.extend(measured.passed.into_iter().map(|pair| (k, pair)));
        }
        found
    }

    const WALL: [u32; 2] = [0, 2];

    #[test]
    fn through_a_wall_in_one_step_and_in_several() {
        for shape in ["disc = 0.2", "box = [0.3, 0.3]", "capsule = [0.2, 0.1]"] {
            let fast = [[-3.0, 0.0, 0.0], [3.0, 0.5, 1.0], [4.0, 0.5, 0.0]];
            assert_eq!(passages(shape, &fast), [(1, WALL)], "{shape}");
            let slow: Vec<_> = (0..13).map(|k| [-0.6 + 0.1 * k as f64, 0.0, 0.0]).collect();
            let found = passages(shape, &slow);
            assert!(found.len() == 1 && found[0].1 == WALL, "{shape}: {found:?}");
        }
    }

    #[test]
    fn bounces_grazes_and_ways_around_are_none() {
        // back from the wall; into it and back; over its end; along it
        let ways: [&[[f64; 3]]; 4] = [
            &[[-3.0, 0.0, 0.0], [-0.26, 0.0, 0.0], [-3.0, 0.0, 0.0]],
            &[[-3.0, 0.0, 0.0], [-0.1, 0.0, 0.0], [-3.0, 0.0, 0.0]],
            &[[-3.0, 1.3, 0.0], [3.0, 1.3, 0.0]],
            &[[-0.251, -1.5, 0.0], [-0.251, 1.5, 0.0]],
        ];
        for way in ways {
            assert_eq!(passages("disc = 0.2", way), [], "{way:?}");
        }
    }

    /// Bug: the links of a belt passed through its pulleys, it was said.
    #[test]
    fn a_way_around_that_touches_all_along_is_none() {
        // around the upper end of the wall, 3 mm deep
        let (reach, mut way) = (0.197, vec![[-0.4, 0.9, 0.0], [-0.05 - 0.197, 0.9, 0.0]]);
        for k in 0..=8 {
            let angle = std::f64::consts::PI * (1.0 - f64::from(k) / 8.0);
            let corner = if k < 4 { -0.05 } else { 0.05 };
            way.push([corner + reach * angle.cos(), 1.0 + reach * angle.sin(), 0.0]);
        }
        way.extend([[0.05 + reach, 0.9, 0.0], [0.4, 0.9, 0.0]]);
        assert_eq!(passages("disc = 0.2", &way), []);
    }

    #[test]
    fn a_turning_bar_sweeps_what_it_turns_through() {
        let bar = "box = [2, 0.04]";
        // from above the wall down through it, or up and away
        let way = |turn: f64| [[-0.6, 1.1, 0.1], [-0.6, 1.1, 0.1 + turn]];
        assert_eq!(passages(bar, &way(-2.1)), [(1, WALL)]);
        assert_eq!(passages(bar, &way(0.8)), []);
    }

    /// Bug: a bar on a pin turned past a thin post in two steps, 7 cm off its pin in the first, and on the
    /// straight path between the two poses it missed the post.
    #[test]
    fn a_bar_on_a_pin_turns_past_a_post() {
        let text = "[scene]\nname = \"s\"\ntitle = \"t\"\n\
                    [[body]]\nname = \"post\"\nkind = \"fixed\"\ndisc = 0.02\n\
                    position = [0.6272360961524434, -0.5663358457428]\n\
                    [[body]]\nname = \"bar\"\nbox = [1, 0.02]\nposition = [0.5, 0]\n";
        let scene = Scene::parse("s.toml", text, &[]).unwrap();
        let mut overlaps = Overlaps::new(&scene.bodies, &scene.joints, 0.01);
        let post = Pose64::new(Vec2::new(0.6272360961524434, -0.5663358457428), 0.0);
        let bar = [
            [0.5, 0.0, 0.0],
            [0.3715444792953838, -0.2513629988468769, -0.8396649319038146],
            [
                -0.15334733975186868,
                -0.4759039749687167,
                -1.8825147312734194,
            ],
        ];
        let passed = bar.map(|[x, y, angle]| {
            let bar = Pose64::new(Vec2::new(x, y), angle);
            let measured = overlaps.measure(|body| Some(if body == 0 { post } else { bar }));
            measured.passed.len()
        });
        assert_eq!(passed, [0, 0, 1]);
    }

    /// Bug: an outline that spun up in the wall was not said to have passed it.
    #[test]
    fn a_closed_outline_passes_an_open_line() {
        let text = "[scene]\nname = \"s\"\ntitle = \"t\"\n\
                    [[body]]\nname = \"w\"\nkind = \"fixed\"\npolyline = [[0, -3], [0, 0.1], [0, 3]]\n\
                    [[body]]\nname = \"b\"\nclosed = true\n\
                    polyline = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]\nposition = [2, 0]\n";
        let scene = Scene::parse("s.toml", text, &[]).unwrap();
        let mut overlaps = Overlaps::new(&scene.bodies, &scene.joints, 1.0 / 60.0);
        let still = Pose64::new(Vec2::zeros(), 0.0);
        let poses = [
            [1.6072352154946181, 0.437815218967716, 1.494349159535636],
            [
                -0.40709324108320993,
                0.9025679648379035,
                -0.2600825668095515,
            ],
            [-1.113095956416041, 1.9691719144227193, 2.6050830946292907],
        ];
        let passed = poses.map(|[x, y, angle]| {
            let moved = Pose64::new(Vec2::new(x, y), angle);
            let measured = overlaps.measure(|body| Some(if body == 1 { moved } else { still }));
            measured.passed.len()
        });
        assert_eq!(passed.iter().sum::<usize>(), 1, "{passed:?}");
    }

    /// Bug: an outline of two-sided segments that lay on a line was said to have passed it, by 1e-7 m.
    #[test]
    fn an_outline_that_lies_on_a_line_passes_nothing() {
        let text = "[scene]\nname = \"s\"\ntitle = \"t\"\n\
                    [[body]]\nname = \"w\"\nkind = \"fixed\"\ntwo_sided = true\npolyline = [[-3, 0], [3, 0]]\n\
                    [[body]]\nname = \"b\"\nclosed = true\ntwo_sided = true\nmass = 1\n\
                    polyline = [[-0.1, 0], [0.1, 0], [0.1, 0.2], [-0.1, 0.2]]\nposition = [0, 0]\n";
        let scene = Scene::parse("s.toml", text, &[]).unwrap();
        let passes = |depths: &[f64]| {
            let mut overlaps = Overlaps::new(&scene.bodies, &scene.joints, 1.0 / 60.0);
            let still = Pose64::new(Vec2::zeros(), 0.0);
            let count = |(k, y): (usize, &f64)| {
                let moved = Pose64::new(Vec2::new(0.01 * k as f64, *y), 1e-6 * k as f64);
                let measured = overlaps.measure(|body| Some(if body == 1 { moved } else { still }));
                measured.passed.len()
            };
            depths.iter().enumerate().map(count).sum::<usize>()
        };
        assert_eq!(passes(&[1e-3, -1e-7, 1e-7, -2e-7, 1e-3, 2e-3]), 0);
        assert_eq!(passes(&[1e-3, -0.1, -0.25, -0.3]), 1);
    }

    /// A one-sided edge stops what comes from its outer side only.
    #[test]
    fn one_sided_edges_are_passed_from_outside() {
        let down = [[5.0, 0.0, 0.0], [5.0, -6.0, 0.0]];
        let mut up = down;
        up.reverse();
        assert_eq!(passages("disc = 0.2", &down), [(1, [1, 2])]);
        assert_eq!(passages("disc = 0.2", &up), []);
    }

    /// What stays inside is an overlap that lasts, over the size of the smaller body.
    #[test]
    fn what_stays_inside_lasts() {
        let mut overlaps = scene("disc = 0.2");
        for k in 0..60 {
            let x = if k == 0 { -3.0 } else { -0.15 };
            let still = Pose64::new(Vec2::zeros(), 0.0);
            let moved = Pose64::new(Vec2::new(x, 0.0), 0.0);
            let measured = overlaps.measure(|body| Some(if body == 2 { moved } else { still }));
            assert_eq!(measured.passed, [] as [[u32; 2]; 0]);
        }
        let (ratio, pair) = overlaps.lasting();
        // 0.1 m of a disc of 0.4 m
        assert!((ratio - 0.25).abs() < 1e-12, "{ratio}");
        assert_eq!(pair, Some(WALL));
    }
}
