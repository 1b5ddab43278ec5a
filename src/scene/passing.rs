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

/// Largest number of poses that are tested on a path.
const MOST_SAMPLES: f64 = 256.0;

/// For some bodies their poses inside a step, each after a share of it, ascending.
pub(super) type Via = FxHashMap<u32, Vec<(f64, Pose64)>>;

/// How all bodies go through a step.
#[derive(Clone, Copy)]
pub(super) struct Way<'a> {
    pub before: &'a [Option<Pose64>],
    pub now: &'a [Option<Pose64>],
    pub via: &'a Via,
}

impl Way<'_> {
    /// The poses of the bodies of two leaves where either of them turns.
    fn places(&self, pair: [&Leaf; 2]) -> Option<Vec<[Pose64; 2]>> {
        let bodies = pair.map(|leaf| leaf.body);
        let [from, to] = [self.before, self.now].map(|poses| {
            let [a, b] = bodies.map(|body| poses[body as usize]);
            Some([a?, b?])
        });
        let (from, to) = (from?, to?);
        let via = bodies.map(|body| self.via.get(&body).map_or(&[][..], |via| via));
        if via.iter().all(|via| via.is_empty()) {
            return Some(vec![from, to]);
        }
        let ways = [0, 1].map(|k| [&[(0.0, from[k])], via[k], &[(1.0, to[k])]].concat());
        let mut shares: Vec<f64> = ways.iter().flatten().map(|(share, _)| *share).collect();
        shares.sort_unstable_by(f64::total_cmp);
        shares.dedup();
        let at = |way: &[(f64, Pose64)], share: f64| {
            let next = way.partition_point(|(end, _)| *end < share);
            let (after, to) = way[next];
            match next.checked_sub(1).map(|k| way[k]) {
                Some((before, from)) => between(&from, &to, (share - before) / (after - before)),
                None => to,
            }
        };
        let places = shares
            .iter()
            .map(|share| [at(&ways[0], *share), at(&ways[1], *share)]);
        Some(places.collect())
    }
}

/// Finds pairs of leaves that were apart before, are apart now, and were deep inside each other on
/// the path between the two poses, straight but for the places where impacts turned them. On this path translation and angle are proportional to
/// time.
///
/// A pair that begins to overlap is followed from the last poses at which it was apart, for a window
/// of steps. An overlap beyond this window counts as a lasting overlap, not as a passage. Followed pairs
/// must have been deep inside each other on the paths of their single steps as well: the link of a belt
/// that runs around a pulley, and touches it all the way, would pass through it on a straight path.
///
/// Two segments have no thickness and are not given to it, see [`Crossing`](super::crossing::Crossing).
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

    /// Ends a step. Returns the pairs of bodies that passed through each other.
    pub fn step(
        &mut self,
        leaves: &[Leaf],
        way: Way,
        counts: impl Fn(u32, u32) -> bool,
    ) -> BTreeSet<[u32; 2]> {
        let mut passed = BTreeSet::new();
        let (step, window) = (self.step, self.window);
        for (&(i, j), known) in &mut self.followed {
            let pair = [&leaves[i as usize], &leaves[j as usize]];
            if let (false, Some(places)) = (known.deep, way.places(pair)) {
                known.deep = is_deep_on(pair, &places);
            }
        }
        let followed = &self.followed;
        let mut note = |i: u32, j: u32, places: &[[Pose64; 2]]| {
            let pair = [&leaves[i as usize], &leaves[j as usize]];
            if passes(pair, places) {
                let bodies = pair.map(|leaf| leaf.body);
                passed.insert([bodies[0].min(bodies[1]), bodies[0].max(bodies[1])]);
            }
        };
        for (i, j) in crossed(leaves, way) {
            let pair = [&leaves[i as usize], &leaves[j as usize]];
            let counts = !followed.contains_key(&(i, j)) && counts(i, j);
            if let (true, Some(places)) = (counts, way.places(pair)) {
                note(i, j, &places);
            }
        }
        let parted = (followed.iter()).filter(|(_, known)| known.last < step && known.deep);
        for (&(i, j), known) in parted {
            let [a, b] = [i, j].map(|k| way.now[leaves[k as usize].body as usize]);
            if let (Some(a), Some(b)) = (a, b) {
                note(i, j, &[known.from, [a, b]]);
                // a bar on a pin turns past a post: the post passes the bar on a straight path, seen from it
                // a disc that turns about its centre passes nothing
                let round = |base: &usize| leaves[[i, j][*base] as usize].core.len() == 1;
                for base in (0..2).filter(|base| !round(base)) {
                    note(
                        i,
                        j,
                        &[known.from, [a, b]].map(|poses| seen_from(base, poses)),
                    );
                }
            }
        }
        self.followed
            .retain(|_, known| known.last == step && step - known.since < window);
        self.step += 1;
        passed
    }
}

/// Pairs of leaves, the smaller number first, whose boxes over the whole step meet and of which one
/// moved by more than a quarter of its thickness.
fn crossed(leaves: &[Leaf], way: Way) -> Vec<(u32, u32)> {
    let Way { before, now, via } = way;
    let fast: Vec<bool> = leaves
        .iter()
        .map(|leaf| {
            let k = leaf.body as usize;
            let (Some(from), Some(to)) = (before[k], now[k]) else {
                return false;
            };
            travel(leaf, [from, to]) > INSIDE * leaf.thickness && from != to
                || via.contains_key(&leaf.body)
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
        let (mut low, mut high) = (a.inf(&b), a.sup(&b));
        for (_, pose) in via.get(&leaf.body).into_iter().flatten() {
            let centre = pose.apply(leaf.centre);
            (low, high) = (low.inf(&centre), high.sup(&centre));
        }
        boxes.push((k as u32, [low.add_scalar(-r), high.add_scalar(r)]));
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
pub(super) fn turn(from: &Pose64, to: &Pose64) -> f64 {
    (from.cos * to.sin - from.sin * to.cos).atan2(from.cos * to.cos + from.sin * to.sin)
}

/// Thickness \[m\] of the thinner leaf. If one leaf is a segment, that of the other.
fn thinner([a, b]: [&Leaf; 2]) -> f64 {
    if a.thickness > 0.0 && b.thickness > 0.0 {
        a.thickness.min(b.thickness)
    } else {
        a.thickness.max(b.thickness)
    }
}

/// Whether two leaves, apart at both ends of a path, were inside each other on it.
fn passes(pair: [&Leaf; 2], places: &[[Pose64; 2]]) -> bool {
    let (from, to) = (places[0], places[places.len() - 1]);
    let apart = |poses: [Pose64; 2]| depth(pair, poses) <= APART * thinner(pair);
    let ways = places.windows(2).map(|ends| way(pair, ends[0], ends[1]));
    ways.sum::<f64>() > INSIDE * thinner(pair)
        && !is_behind(pair, from)
        && apart(from)
        && apart(to)
        && is_deep_on(pair, places)
}

/// Whether two leaves were inside each other on a path that is straight between these places.
fn is_deep_on(pair: [&Leaf; 2], places: &[[Pose64; 2]]) -> bool {
    let mut pieces = places.windows(2);
    pieces.any(|ends| is_deep(pair, ends[0], ends[1]))
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
pub(super) fn between(from: &Pose64, to: &Pose64, s: f64) -> Pose64 {
    Pose64::new(
        from.translation + (to.translation - from.translation) * s,
        from.angle() + turn(from, to) * s,
    )
}

#[cfg(test)]
#[path = "passing_tests.rs"]
mod tests;
