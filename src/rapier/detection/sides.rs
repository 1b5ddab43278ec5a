//! Finds the side of a two-sided segment on which the other part of a pair lies.
//!
//! A segment has no inside, so positions alone do not give the side. At the midpoint of a step, a
//! part that lands on the segment may already be on its far side. A part that rests on it is on one
//! side or the other by rounding. A pair that may touch therefore keeps its side of the last step, and
//! a new pair takes its side at the start of the step. That includes pairs whose contact belongs to a
//! neighbour of the segment: it may be theirs in the next step. Where a segment that touched slides on to
//! the next one of a chain, it has the side that it had on the last one: it may lie below the common
//! corner by rounding.

use super::super::kernels::{Core, Part, Sight, Touch, sides_of};
use super::Present;
use super::leaves::Leaf;
use super::pairs::{Finder, Marks};
use super::rows::Row;
use super::seams::poses_at;
use crate::contact::Vec2;

/// Mark of a pair whose contact a step has found. The marks below it are two bits for each part: 1 plus
/// the face of its segment.
const TOUCHED: u32 = 1 << 4;

fn is_two_sided(part: &Part) -> bool {
    matches!(&part.core, Core::Edge(edge) if !edge.one_sided)
}

fn is_one_sided(part: &Part) -> bool {
    matches!(&part.core, Core::Edge(edge) if edge.one_sided)
}

impl Finder<'_> {
    /// Data of earlier poses of a pair that the kernels need.
    pub(super) fn sight(
        &self,
        leaves: [u32; 2],
        sides: [&Leaf; 2],
        bodies: [&Present; 2],
        memory: &Marks,
    ) -> Sight {
        if !sides.iter().any(|leaf| is_two_sided(&leaf.part)) {
            return Sight::default();
        }
        let known = match memory.is_empty() {
            true => 0,
            false => self.known_sides(leaves, sides, memory),
        };
        // motion of `other` relative to `base` since the start of the step
        let moved = |base: usize, other: usize| {
            let place = sides[other].pose.translation;
            let u = bodies[other].velocity_at(place) - bodies[base].velocity_at(place);
            0.5 * self.step * u
        };
        // the cores of rounded parts cross only where these are deep in each other
        let sharp = sides.iter().any(|leaf| is_one_sided(&leaf.part))
            || sides
                .iter()
                .all(|leaf| is_two_sided(&leaf.part) && leaf.part.rounding == 0.0);
        Sight {
            faces: [0, 1].map(|i| match known >> (2 * i) & 3 {
                0 => None,
                face => Some(face as usize - 1),
            }),
            moved: match self.midpoint {
                true => [moved(0, 1), moved(1, 0)],
                false => [Vec2::zeros(); 2],
            },
            motion: match known & TOUCHED {
                0 => self.span.motion(bodies),
                _ => f64::INFINITY,
            },
            touched: known & TOUCHED != 0,
            start: sharp.then(|| poses_at(sides, bodies, -0.5 * self.step)),
        }
    }

    /// The marks of a pair. A pair of two segments that did not touch has those of a neighbour of either
    /// that touched the other.
    fn known_sides(&self, leaves: [u32; 2], sides: [&Leaf; 2], memory: &Marks) -> u32 {
        let order = Row::order(leaves, &self.leaves.names);
        let known = memory.get(&order);
        let lines = sides.iter().all(|leaf| is_two_sided(&leaf.part));
        if known & TOUCHED != 0 || !lines || sides.iter().any(|leaf| leaf.part.rounding > 0.0) {
            return known;
        }
        let beside = |i: usize, end: usize| {
            let Core::Edge(edge) = &sides[i].part.core else {
                return None;
            };
            let (sub, reversed) = edge.next[end].filter(|_| edge.goes_on_at(end))?;
            let mut order = order;
            order[2 + i] = sub;
            let marks = memory.get(&order);
            let own = marks >> (2 * i) & 3;
            let turned = match reversed && own != 0 {
                true => marks ^ 3 << (2 * i),
                false => marks,
            };
            (marks & TOUCHED != 0).then_some(turned)
        };
        let ends = (0..4).map(|k| [k / 2, k % 2]);
        ends.filter_map(|[i, end]| beside(i, end))
            .next()
            .unwrap_or(known)
    }

    /// Stores the sides on which two parts lie that are near enough to cross in the next step. Where
    /// `found` is empty, a neighbour may have the contact; `bound` is then that of their gap \[m\].
    pub(super) fn remember_sides(
        &self,
        leaves: [u32; 2],
        sides: [&Leaf; 2],
        bodies: [&Present; 2],
        (found, bound): (&[Touch], f64),
        sight: &Sight,
        memory: &mut Marks,
    ) {
        if !sides.iter().any(|leaf| is_two_sided(&leaf.part)) {
            return;
        }
        let deepest = found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap));
        let rounding = sides[0].part.rounding + sides[1].part.rounding;
        // cores that cannot cross in the next step need no memory
        let motion = self.span.motion(bodies);
        if deepest.map_or(bound, |touch| touch.gap) + rounding > motion {
            return;
        }
        let (poses, parts) = (sides.map(|leaf| &leaf.pose), sides.map(|leaf| &leaf.part));
        // of balls the contact tells the side
        let by_contact = |touch: &Touch| {
            [(0, 1.0), (1, -1.0)].map(|(i, sign)| match &sides[i].part.core {
                Core::Edge(edge) => {
                    let right = poses[i].rotate(edge.normals[0]);
                    Some(usize::from(sign * right.dot(&touch.normal) < 0.0))
                }
                _ => None,
            })
        };
        let faces = sides_of(poses, parts, sight).or(deepest.map(by_contact));
        let Some(faces) = faces else {
            return;
        };
        let mut known = if deepest.is_some() { TOUCHED } else { 0 };
        for (i, face) in (0..).zip(faces) {
            if let Some(face) = face.filter(|_| is_two_sided(&sides[i].part)) {
                known |= (1 + face as u32) << (2 * i);
            }
        }
        memory.set(Row::order(leaves, &self.leaves.names), known);
    }
}
