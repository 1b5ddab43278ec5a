//! The side of a chain of two-sided segments on which another part lies.
//!
//! A segment alone does not tell it: beyond a bend, what lies above the chain may lie below the line of the
//! segment. The side is therefore found where the chain is nearest to the part. From the segment of the pair
//! the search goes on to the neighbour, as long as it leads towards the other part or is nearer, and so along
//! the other part's chain. The distance falls at each step. There the nearest points tell the side, or what touched
//! in the last step. With the side known, a segment counts as the border of a solid behind it, and follows all
//! rules of one.
//!
//! At a free end of a chain no side is told: a part may go round it.

use super::super::kernels::{Core, Edge, Part, approach};
use super::couple::Couple;
use super::marks::Marks;
use super::pairs::Finder;
use super::sides::{TOUCHED, face_of};
use crate::dynamics::Pose64;

/// Most neighbours that are looked at: where rounding decides, the search may not end.
const MOST: usize = 100;

/// A part of a chain that is reached from the part of a pair.
#[derive(Clone, Copy)]
struct Reached<'a> {
    part: &'a Part,
    sub: u32,
    /// Whether it runs the other way.
    turned: bool,
}

impl<'a> Reached<'a> {
    fn edge(&self) -> Option<&'a Edge> {
        match &self.part.core {
            Core::Edge(edge) => Some(edge),
            _ => None,
        }
    }

    /// A face of this part as the face of the part of the pair.
    fn seen(&self, face: usize) -> usize {
        if self.turned { 1 - face } else { face }
    }
}

impl Finder<'_> {
    /// Per part with two sides, the face on whose side the other one lies, where it is known. `None` unless
    /// one of them is within a chain.
    #[inline(never)]
    pub(super) fn sides_of_chains(
        &self,
        couple: &Couple,
        memory: &Marks,
    ) -> Option<[Option<usize>; 2]> {
        let sides = couple.sides;
        let round = |part: &Part| matches!(part.core, Core::Ball(_));
        let within = sides.iter().any(|leaf| leaf.solid.is_some());
        if !within || sides.iter().any(|leaf| round(&leaf.part)) {
            return None;
        }
        let start = couple.poses_at(-0.5 * self.step);
        let mut at = [0, 1].map(|i| Reached {
            part: &sides[i].part,
            sub: sides[i].sub,
            turned: false,
        });
        for _ in 0..MOST {
            if let Some(faces) = self.touched_at(couple, &at, memory) {
                return Some(faces);
            }
            let found = approach(&start, at.map(|reached| reached.part));
            if found.touches
                && let Some(faces) = self.touched_beside(couple, &at, memory)
            {
                return Some(faces);
            }
            let nearer = || self.nearer_neighbour(couple, &start, &at, found.distance);
            let Some((i, end)) = found.leads.or_else(nearer) else {
                let seen = |i: usize| found.faces[i].map(|face| at[i].seen(face));
                return Some([seen(0), seen(1)]);
            };
            at[i] = self.neighbour(couple, at[i], i, end)?;
        }
        None
    }

    /// The side and the end at which a neighbour is nearer than `distance` \[m\]: beyond the far side of an
    /// outline no segment leads towards the other part.
    fn nearer_neighbour(
        &self,
        couple: &Couple,
        start: &[Pose64; 2],
        at: &[Reached; 2],
        distance: f64,
    ) -> Option<(usize, usize)> {
        let mut ends = (0..2).flat_map(|i| [(i, 0), (i, 1)]);
        ends.find(|&(i, end)| {
            let next = self.neighbour(couple, at[i], i, end);
            next.is_some_and(|next| {
                let mut parts = at.map(|reached| reached.part);
                parts[i] = next.part;
                approach(start, parts).distance < distance * (1.0 - 1e-9)
            })
        })
    }

    /// The neighbour at an end of a segment of side `i`.
    fn neighbour<'a>(
        &'a self,
        couple: &Couple,
        from: Reached<'a>,
        i: usize,
        end: usize,
    ) -> Option<Reached<'a>> {
        let (sub, reversed) = from.edge()?.next[end]?;
        let leaf = self.leaves.of(couple.sides[i].slot, sub)?;
        Some(Reached {
            part: &leaf.part,
            sub,
            turned: from.turned != reversed,
        })
    }

    /// The sides that two parts, or neighbours of theirs, had if they touched in the last step.
    fn touched_beside(
        &self,
        couple: &Couple,
        at: &[Reached; 2],
        memory: &Marks,
    ) -> Option<[Option<usize>; 2]> {
        let near = [0, 1].map(|i| {
            let beside = |end| self.neighbour(couple, at[i], i, end);
            [Some(at[i]), beside(0), beside(1)]
        });
        let [near1, near2] = near.map(|near| near.into_iter().flatten());
        let mut all = near1.flat_map(|one| near2.clone().map(move |two| [one, two]));
        all.find_map(|at| self.touched_at(couple, &at, memory))
    }

    /// The sides that two parts had if they touched in the last step.
    fn touched_at(
        &self,
        couple: &Couple,
        at: &[Reached; 2],
        memory: &Marks,
    ) -> Option<[Option<usize>; 2]> {
        let [one, two] = couple.sides;
        let marks = memory.before(&[one.slot, two.slot, at[0].sub, at[1].sub]);
        let faces = [0, 1].map(|i| face_of(marks, i).map(|face| at[i].seen(face)));
        (marks & TOUCHED != 0).then_some(faces)
    }
}
