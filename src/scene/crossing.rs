//! Detects that two-sided segments of one body passed through those of another, from their poses alone.

use super::convex::{gap, to_segment};
use super::overlap::Leaf;
use super::passing::{between, turn};
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Distance of a corner from the other body's segments above which it is clear of them, over half the
/// shortest segment of both bodies.
const CLEAR: f64 = 0.05;

/// Depth of two crossed segments up to which they count as apart, over half the shorter one: an outline
/// that lies on a line crosses it by rounding.
const APART: f64 = 1e-3;

/// Share of a segment at an end where no other one follows: what goes through it may have gone around it.
const END: f64 = 0.01;

/// Largest turn \[rad\] of one body seen from the other for which the path of a corner counts as straight.
const TURN: f64 = 0.2;

/// Largest number of straight pieces of such a path in a step.
const MOST_PIECES: f64 = 64.0;

/// Follows on which side of each other the two-sided segments of two bodies are.
///
/// Segments that are apart come to cross only where a corner of one goes through another one. A corner
/// that came through a chain of segments and back went through an even number of times, through whichever
/// segments of the chain. So one body has passed through another if they are apart, and a corner that went
/// through an odd number of times is clear of the other body.
///
/// Bodies that cross at the start are followed once they are apart. If they cross by less than what is clear,
/// they are followed from the start, but for the corners that are not clear then.
#[derive(Serialize, Deserialize)]
pub(super) struct Crossing {
    #[serde(skip)]
    sheets: Vec<Sheets>,
    /// Pairs of `sheets` whose overlaps count.
    #[serde(skip)]
    pairs: Vec<[u32; 2]>,
    started: bool,
    /// Pairs that have crossed since the start.
    crossed: BTreeSet<[u32; 2]>,
    /// Corners that were on either side at the start.
    unclear: BTreeSet<Corner>,
    /// Corners that went through an odd number of times.
    odd: BTreeSet<Corner>,
}

/// The pair, which of its bodies, and the corner.
type Corner = ([u32; 2], u32, u32);

/// The two-sided segments of a body, in its frame.
struct Sheets {
    body: u32,
    /// Its first leaf.
    leaf: u32,
    corners: Vec<Vec2>,
    /// Corners of each segment, sorted by the segments' left ends.
    edges: Vec<[u32; 2]>,
    /// Whether no other segment ends at the first and at the second corner.
    free: Vec<[bool; 2]>,
    /// Largest extent of a segment in x, half of the shortest one, and the largest distance of a corner
    /// from the body's origin \[m\].
    widest: f64,
    half: f64,
    reach: f64,
}

impl Crossing {
    /// # Arguments
    /// - `leaves`: of all bodies, one body after the other.
    /// - `counts`: whether overlaps of two leaves count.
    pub fn new(leaves: &[Leaf], counts: impl Fn(u32, u32) -> bool) -> Self {
        let mut sheets = Vec::new();
        let mut from = 0;
        for of_body in leaves.chunk_by(|a, b| a.body == b.body) {
            sheets.extend(Sheets::new(of_body, from));
            from += of_body.len() as u32;
        }
        let mut pairs = Vec::new();
        for (i, a) in sheets.iter().enumerate() {
            let others = sheets.iter().enumerate().skip(i + 1);
            let counted = others.filter(|(_, b)| counts(a.leaf, b.leaf));
            pairs.extend(counted.map(|(j, _)| [i as u32, j as u32]));
        }
        Crossing {
            sheets,
            pairs,
            started: false,
            crossed: BTreeSet::new(),
            unclear: BTreeSet::new(),
            odd: BTreeSet::new(),
        }
    }

    /// Goes on from what was found in the same scene.
    pub fn resume(&mut self, saved: Crossing) {
        let (sheets, pairs) = (
            std::mem::take(&mut self.sheets),
            std::mem::take(&mut self.pairs),
        );
        *self = Crossing {
            sheets,
            pairs,
            ..saved
        };
    }

    /// Ends a step. Returns the pairs of bodies that passed through each other.
    ///
    /// # Arguments
    /// - `before`, `now`: poses of all bodies, `None` where one is removed.
    pub fn step(
        &mut self,
        before: &[Option<Pose64>],
        now: &[Option<Pose64>],
    ) -> BTreeSet<[u32; 2]> {
        let mut passed = BTreeSet::new();
        for &pair in &self.pairs {
            let both = pair.map(|k| &self.sheets[k as usize]);
            let at = |poses: &[Option<Pose64>]| {
                let [a, b] = both.map(|sheets| poses[sheets.body as usize]);
                Some([a?, b?])
            };
            let (Some(from), Some(to)) = (at(before), at(now)) else {
                self.crossed.remove(&pair);
                self.odd.retain(|(of, ..)| *of != pair);
                continue;
            };
            let near = are_near(both, from, to);
            if !self.started && near && are_crossed(both, from, APART) {
                if are_crossed(both, from, CLEAR) {
                    self.crossed.insert(pair);
                }
                for side in 0..2 {
                    let corners = 0..both[side].corners.len() as u32;
                    let unclear = corners.filter(|c| !is_clear(both, side, *c, from));
                    self.unclear.extend(unclear.map(|c| (pair, side as u32, c)));
                }
            }
            if self.crossed.contains(&pair) {
                if !(near && are_crossed(both, to, APART)) {
                    self.crossed.remove(&pair);
                    self.unclear.retain(|(of, ..)| *of != pair);
                }
                continue;
            }
            if near && from != to {
                for side in 0..2 {
                    for corner in through(both, side, from, to) {
                        let key = (pair, side as u32, corner);
                        if !self.odd.remove(&key) && !self.unclear.contains(&key) {
                            self.odd.insert(key);
                        }
                    }
                }
            }
            self.odd.retain(|&(of, side, corner)| {
                of != pair || !goes_round(both, side as usize, corner, [from, to])
            });
            let odd = || self.odd.range((pair, 0, 0)..=(pair, 1, u32::MAX));
            if odd().next().is_none() || near && are_crossed(both, to, APART) {
                continue;
            }
            if odd().any(|&(_, side, corner)| is_clear(both, side as usize, corner, to)) {
                let [a, b] = both.map(|sheets| sheets.body);
                passed.insert([a.min(b), a.max(b)]);
                self.odd.retain(|(of, ..)| *of != pair);
            }
        }
        self.started = true;
        passed
    }
}

impl Sheets {
    /// From the leaves of a body, the first of them with number `from`. `None` if it has no segments.
    fn new(leaves: &[Leaf], from: u32) -> Option<Self> {
        let (mut corners, mut edges) = (Vec::new(), Vec::new());
        let mut known: FxHashMap<[u64; 2], u32> = FxHashMap::default();
        for leaf in leaves.iter().filter(|leaf| leaf.is_sheet()) {
            edges.push([leaf.core[0], leaf.core[1]].map(|p| {
                // −0 is 0
                let bits = [p.x + 0.0, p.y + 0.0].map(f64::to_bits);
                *known.entry(bits).or_insert_with(|| {
                    corners.push(p);
                    corners.len() as u32 - 1
                })
            }));
        }
        let mut ends = vec![0; corners.len()];
        edges.iter().flatten().for_each(|k| ends[*k as usize] += 1);
        let x = |edge: &[u32; 2]| edge.map(|k| corners[k as usize].x);
        let left = |edge: &[u32; 2]| x(edge)[0].min(x(edge)[1]);
        edges.sort_by(|a, b| left(a).total_cmp(&left(b)));
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        let segments = || leaves.iter().filter(|leaf| leaf.is_sheet());
        Some(Sheets {
            body: leaves.first()?.body,
            leaf: from,
            free: edges
                .iter()
                .map(|edge| edge.map(|k| ends[k as usize] == 1))
                .collect(),
            widest: largest(&mut edges.iter().map(|edge| (x(edge)[0] - x(edge)[1]).abs())),
            half: segments().map(|leaf| leaf.radius_of_all).reduce(f64::min)?,
            reach: largest(&mut corners.iter().map(|p| p.norm())),
            corners,
            edges,
        })
    }

    /// Corners that another body, on a way between two poses of both, may come within its reach of, grown by
    /// `rise` \[m\].
    fn corners_around(&self, other: &Sheets, poses: [[Pose64; 2]; 2], rise: f64) -> BTreeSet<u32> {
        let [a, b] = poses.map(|[own, its]| own.apply_inverse(its.translation));
        let margin = Vec2::repeat(other.reach + rise);
        let near = self.near(a.inf(&b) - margin, a.sup(&b) + margin);
        near.flat_map(|(k, _)| self.edges[k]).collect()
    }

    /// Segments whose boxes meet the box of `a` and `b`, with the corners of each.
    fn near(&self, a: Vec2, b: Vec2) -> impl Iterator<Item = (usize, [Vec2; 2])> {
        let (low, high) = (a.inf(&b), a.sup(&b));
        let ends = move |k: usize| self.edges[k].map(|c| self.corners[c as usize]);
        let left = move |k: usize| ends(k)[0].x.min(ends(k)[1].x);
        let first = self.edges.partition_point(|edge| {
            let [a, b] = edge.map(|c| self.corners[c as usize].x);
            a.min(b) < low.x - self.widest
        });
        (first..self.edges.len())
            .take_while(move |k| left(*k) <= high.x)
            .map(move |k| (k, ends(k)))
            .filter(move |(_, [p, q])| {
                let (lower, upper) = (p.inf(q), p.sup(q));
                lower <= high && low <= upper
            })
    }
}

/// Whether the circles about the origins of two bodies meet on the way.
fn are_near(both: [&Sheets; 2], from: [Pose64; 2], to: [Pose64; 2]) -> bool {
    let apart = |poses: [Pose64; 2]| poses[1].translation - poses[0].translation;
    let nearest = to_segment(&Vec2::zeros(), &apart(from), &apart(to));
    nearest <= both[0].reach + both[1].reach
}

/// Corners of the body `side` that went through segments of the other one an odd number of times.
fn through(both: [&Sheets; 2], side: usize, from: [Pose64; 2], to: [Pose64; 2]) -> Vec<u32> {
    let (sheets, other) = (both[side], both[1 - side]);
    let turns: f64 = [0, 1].map(|k| turn(&from[k], &to[k]).abs()).iter().sum();
    let pieces = (turns / TURN).ceil().clamp(1.0, MOST_PIECES);
    // an arc rises by its radius times a² / 8 over the chord
    let rise = (turns / pieces).powi(2) / 8.0 * (sheets.reach + other.reach);
    let mut odd = BTreeSet::new();
    let seen = |poses: &[Pose64; 2], p: Vec2| poses[1 - side].apply_inverse(poses[side].apply(p));
    let mut start = from;
    for piece in 1..=pieces as usize {
        // the end of a step is the start of the next one, to the bit
        let end = if piece == pieces as usize {
            to
        } else {
            [0, 1].map(|k| between(&from[k], &to[k], piece as f64 / pieces))
        };
        let ends = [start, end].map(|poses| [poses[side], poses[1 - side]]);
        for corner in sheets.corners_around(other, ends, rise) {
            let [p, q] = [&start, &end].map(|poses| seen(poses, sheets.corners[corner as usize]));
            for (edge, [a, b]) in other.near(p, q) {
                if goes_through([p, q], [a, b], other.free[edge]) && !odd.remove(&corner) {
                    odd.insert(corner);
                }
            }
        }
        start = end;
    }
    odd.into_iter().collect()
}

/// Whether the way from `p` to `q` goes through the segment from `a` to `b`, and not past a free end of it.
/// Of two segments with a common corner it goes through one, however near to the corner.
fn goes_through([p, q]: [Vec2; 2], [a, b]: [Vec2; 2], free: [bool; 2]) -> bool {
    if !are_across([p, q], [a, b]) {
        return false;
    }
    let (along, way) = (b - a, q - p);
    let share = (p - a).perp(&way) / along.perp(&way);
    !(free[0] && share < END || free[1] && share > 1.0 - END)
}

/// Whether two segments cross. A point on a line counts as on its right.
fn are_across([p, q]: [Vec2; 2], [a, b]: [Vec2; 2]) -> bool {
    let left = |a: Vec2, b: Vec2, p: Vec2| (b - a).perp(&(p - a)) > 0.0;
    left(a, b, p) != left(a, b, q) && left(p, q, a) != left(p, q, b)
}

/// Whether a segment of one body crosses one of the other, by more than a share of half the shorter one.
fn are_crossed(both: [&Sheets; 2], poses: [Pose64; 2], share: f64) -> bool {
    let few = usize::from(both[1].edges.len() < both[0].edges.len());
    let (one, other) = (both[few], both[1 - few]);
    let (own, its) = (poses[few], poses[1 - few]);
    let deep = |edge: &[u32; 2]| {
        let [p, q] = edge.map(|k| its.apply_inverse(own.apply(one.corners[k as usize])));
        other.near(p, q).any(|(_, [a, b])| {
            let shorter = (q - p).norm().min((b - a).norm());
            are_across([p, q], [a, b]) && -gap(&[p, q], &[a, b], 0.0) > share * 0.5 * shorter
        })
    };
    one.edges.iter().any(deep)
}

/// Whether a corner of the body `side` is clear of the other one's segments.
fn is_clear(both: [&Sheets; 2], side: usize, corner: u32, poses: [Pose64; 2]) -> bool {
    let (own, other) = (both[side], both[1 - side]);
    let p = poses[1 - side].apply_inverse(poses[side].apply(own.corners[corner as usize]));
    let clear = CLEAR * own.half.min(other.half);
    let margin = Vec2::repeat(clear);
    let mut near = other.near(p - margin, p + margin);
    near.all(|(_, [a, b])| to_segment(&p, &a, &b) > clear)
}

/// Whether a corner of the body `side` that lay on the other one's segments, on the one side or the other by
/// what is left of an overlap, has gone beyond a free end of them: it may go round this end.
fn goes_round(both: [&Sheets; 2], side: usize, corner: u32, [from, to]: [[Pose64; 2]; 2]) -> bool {
    if is_clear(both, side, corner, from) {
        return false;
    }
    let (own, other) = (both[side], both[1 - side]);
    let p = to[1 - side].apply_inverse(to[side].apply(own.corners[corner as usize]));
    let ends = |k: usize| other.edges[k].map(|c| other.corners[c as usize]);
    let far = |k: &usize| to_segment(&p, &ends(*k)[0], &ends(*k)[1]);
    let nearest = (0..other.edges.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
    nearest.is_some_and(|k| {
        let [a, b] = ends(k);
        let share = (p - a).dot(&(b - a)) / (b - a).norm_squared();
        share < 0.0 && other.free[k][0] || share > 1.0 && other.free[k][1]
    })
}

#[cfg(test)]
#[path = "crossing_tests.rs"]
mod tests;
