//! Closed chains of two-sided segments: whether another part is inside or outside.
//!
//! A part gets from the one to the other only through the chain. So its side is found once, by parity, where it
//! does not touch the chain, and kept as long as the two are near each other. The segments of the chain then
//! count as borders of a solid on the far side. Positions alone tell no side where the two overlap: what has
//! come through a corner by a little is then on the far side of one of its segments.
//!
//! Source for the parity: Shimrat, *Algorithm 112: Position of point relative to polygon*, CACM 5 (1962).

use super::super::kernels::{Core, Edge, Part, approach};
use super::couple::Couple;
use super::leaves::Name;
use super::marks::Marks;
use super::pairs::Finder;
use super::shapes::{self, Piece};
use crate::contact::Vec2;
use rustc_hash::FxHashSet;

/// Most segments of a loop that is tested for crossing itself.
const MOST: usize = 4096;

/// The key of the side of a loop on which a part lies: no pair of parts has it.
fn order(chain: &Name, other: &Name) -> [u32; 4] {
    [chain.slot, other.slot, u32::MAX, other.sub]
}

/// Forgets the sides of two parts.
pub(super) fn forget_loops(names: [&Name; 2], memory: &mut Marks) {
    memory.set(order(names[0], names[1]), 0);
    memory.set(order(names[1], names[0]), 0);
}

/// Forgets the sides of all parts of some colliders: their bodies were placed elsewhere, and did not get there
/// through a chain.
pub(super) fn forget_placed(slots: &FxHashSet<u32>, memory: &mut Marks) {
    let placed = |slot: &u32| slots.contains(slot);
    memory.retain(|order| order[2] != u32::MAX || !order[..2].iter().any(placed));
}

/// Keeps the sides of two parts that a pass does not look at.
pub(super) fn keep_loops(names: [&Name; 2], memory: &mut Marks) {
    memory.keep(&order(names[0], names[1]));
    memory.keep(&order(names[1], names[0]));
}

fn edge(piece: &Piece) -> Option<&Edge> {
    match &piece.part.core {
        Core::Edge(edge) => Some(edge),
        _ => None,
    }
}

/// The face of the segments of a collider that looks out of it, if they form one closed chain that does not cross
/// itself, in one direction, and have two sides.
pub(super) fn outer_face(pieces: &[Piece]) -> Option<usize> {
    let first = pieces.first()?;
    let chained = |piece: &Piece| piece.solid.is_some() && piece.local == first.local;
    if !(3..=MOST).contains(&pieces.len()) || !pieces.iter().all(chained) {
        return None;
    }
    let place = |sub: u32| pieces.binary_search_by_key(&sub, |piece| piece.sub).ok();
    let (mut at, mut steps) = (0, 0);
    loop {
        let (sub, reversed) = edge(&pieces[at])?.next[1]?;
        if reversed || steps == pieces.len() {
            return None;
        }
        (at, steps) = (place(sub)?, steps + 1);
        if at == 0 {
            break;
        }
    }
    let ends: Vec<[Vec2; 2]> = pieces.iter().filter_map(|p| Some(edge(p)?.ends)).collect();
    let sides = |[a, b]: [Vec2; 2], p: Vec2| (b - a).perp(&(p - a));
    let cross = |one: [Vec2; 2], two: [Vec2; 2]| {
        sides(one, two[0]) * sides(one, two[1]) < 0.0
            && sides(two, one[0]) * sides(two, one[1]) < 0.0
    };
    let simple = |i: usize| ends[..i].iter().all(|other| !cross(ends[i], *other));
    let area: f64 = ends.iter().map(|[a, b]| a.perp(b)).sum();
    (steps == pieces.len() && area != 0.0 && (0..ends.len()).all(simple))
        .then_some(usize::from(area < 0.0))
}

/// Whether a point lies within a loop: a ray from it crosses the loop an odd number of times.
fn within(pieces: &[Piece], point: Vec2) -> bool {
    let crossed = |&[a, b]: &[Vec2; 2]| {
        (a.y > point.y) != (b.y > point.y)
            && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x)
    };
    let ends = pieces.iter().filter_map(|piece| Some(edge(piece)?.ends));
    ends.filter(crossed).count() % 2 == 1
}

impl Finder<'_> {
    /// Per part that belongs to a loop, the face on whose side the other one lies.
    pub(super) fn faces_of_loops(&self, couple: &Couple, memory: &Marks) -> [Option<usize>; 2] {
        [0, 1].map(|i| self.face_of_loop(couple, i, memory))
    }

    fn face_of_loop(&self, couple: &Couple, i: usize, memory: &Marks) -> Option<usize> {
        couple.sides[i].solid.as_ref()?;
        let chain = self.colliders.get(couple.sides[i].slot)?;
        let outer = chain.outer_face?;
        let names = couple.leaves.map(|leaf| &self.leaves.names[leaf as usize]);
        let known = memory.before(&order(names[i], names[1 - i]));
        if let Some(face) = known.checked_sub(1) {
            return Some(face as usize);
        }
        let other = &couple.sides[1 - i].part;
        if matches!(
            other.core,
            Core::Ball(_) | Core::HalfPlane(_) | Core::Other(_)
        ) {
            return None;
        }
        let start = couple.poses_at(-0.5 * self.step);
        let (center, radius) = shapes::circle(other, &start[1 - i]);
        let place = start[i].apply_inverse(center);
        let touches = |piece: &Piece| {
            edge(piece).is_none_or(|edge| edge.distance(place) <= radius) && {
                let poses = [start[i], start[1 - i]];
                approach(&poses, [&piece.part, other]).touches
            }
        };
        if chain.pieces.iter().any(touches) {
            return None;
        }
        let point = start[i].apply_inverse(start[1 - i].apply(a_point(other)?));
        Some(if within(&chain.pieces, point) {
            1 - outer
        } else {
            outer
        })
    }

    /// Stores the sides of loops on which two parts lie.
    pub(super) fn remember_loops(&self, couple: &Couple, memory: &mut Marks) {
        let names = couple.leaves.map(|leaf| &self.leaves.names[leaf as usize]);
        for i in 0..2 {
            if let Some(face) = couple.loops[i] {
                memory.set(order(names[i], names[1 - i]), 1 + face as u32);
            }
        }
    }
}

/// A point of a part.
fn a_point(part: &Part) -> Option<Vec2> {
    match &part.core {
        Core::Box(_) => Some(Vec2::zeros()),
        Core::Polygon(polygon) => Some(polygon.center),
        Core::Edge(edge) => Some(0.5 * (edge.ends[0] + edge.ends[1])),
        Core::Ball(_) | Core::HalfPlane(_) | Core::Other(_) => None,
    }
}
