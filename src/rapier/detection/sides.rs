//! Finds the side of a two-sided segment on which the other part of a pair lies.
//!
//! A segment has no inside, so positions alone do not give the side. At the midpoint of a step, a
//! part that lands on the segment may already be on its far side. A part that rests on it is on one
//! side or the other by rounding. A pair that may touch therefore keeps its side of the last step,
//! and a new pair, or one that has clearly parted, takes its side at the start of the step. That
//! includes pairs whose contact belongs to a neighbour of the segment: it may be theirs in the next
//! step. A segment that slides on to the next one of a chain may lie below their corner by rounding:
//! it keeps the side that it had. The same holds for one that slides on to the next of several flush sheets:
//! the side on which a segment touches others is remembered as well.

use super::super::kernels::{Core, Part, Sight, Touch, sides_of};
use super::couple::Couple;
use super::leaves::Name;
use super::marks::Marks;
use super::pairs::Finder;
use super::rows::Row;
use crate::contact::Vec2;
use std::f64::consts::FRAC_1_SQRT_2;

/// Mark of a pair whose contact a step has found. The marks below it are two bits for each part: 1 plus
/// the face of its segment.
pub(super) const TOUCHED: u32 = 1 << 4;

/// Share of a segment at an end where a contact lies on which it swings.
const END: f64 = 1e-2;

/// The face of part `i` in the mark of a pair.
pub(super) fn face_of(marks: u32, i: usize) -> Option<usize> {
    Some((marks >> (2 * i) & 3).checked_sub(1)? as usize)
}

/// The face of segment `i` of a pair on whose side the other part touches a neighbour of the segment.
fn side_beside(order: [u32; 4], i: usize, part: &Part, memory: &Marks) -> Option<usize> {
    let Core::Edge(edge) = &part.core else {
        return None;
    };
    let at = |end: usize| {
        let (sub, reversed) = edge.next[end].filter(|_| edge.goes_on_at(end))?;
        let mut order = order;
        order[2 + i] = sub;
        let marks = memory.before(&order);
        let face = face_of(marks, i)?;
        (marks & TOUCHED != 0).then_some(if reversed { 1 - face } else { face })
    };
    at(0).or_else(|| at(1))
}

/// The key of the side on which a part touches others: no pair has it.
fn own_order(name: &Name) -> [u32; 4] {
    [name.slot, name.slot, name.sub, name.sub]
}

/// Forgets the side on which a part touches others.
pub(super) fn forget_side(name: &Name, memory: &mut Marks) {
    memory.set(own_order(name), 0);
}

impl Finder<'_> {
    /// Data of earlier poses of a pair that the kernels need.
    pub(super) fn sight(&self, couple: &Couple, memory: &Marks) -> Sight {
        let Couple {
            leaves,
            sides,
            bodies,
            parts,
            ..
        } = *couple;
        if !parts.iter().any(|part| part.is_two_sided()) {
            return Sight::default();
        }
        let order = Row::order(leaves, &self.leaves.names);
        let known = match memory.is_empty() {
            true => 0,
            false => memory.get(&order),
        };
        // the cores of rounded parts are apart at the start of a step, those of sharp ones that touch
        // are so by rounding
        let rounded = parts.iter().any(|part| part.rounding > 0.0);
        let one_sided = parts.iter().any(|part| part.is_one_sided());
        let both = parts.iter().all(|part| part.is_two_sided());
        let starts = one_sided
            || both
                && match rounded {
                    // parts of a step are as long as they like, and begin with a memory
                    true => self.midpoint || known == 0,
                    false => self.midpoint || known & TOUCHED == 0,
                };
        let elsewhere =
            |i: usize| match memory.before(&own_order(&self.leaves.names[leaves[i] as usize])) {
                1 => Some(0),
                2 => Some(1),
                _ => None,
            };
        let back = match both && rounded && !self.midpoint {
            true => 0.0,
            false => -0.5 * self.step,
        };
        Sight {
            faces: [0, 1].map(|i| face_of(known, i)),
            moved: match self.midpoint {
                true => couple.moved(0.5 * self.step),
                false => [Vec2::zeros(); 2],
            },
            motion: match known & TOUCHED {
                0 => self.span.motion(bodies),
                _ => f64::INFINITY,
            },
            beside: match known & TOUCHED != 0 || memory.is_empty() {
                true => [None; 2],
                false => [0, 1].map(|i| side_beside(order, i, &sides[i].part, memory)),
            },
            began: rounded
                .then(|| couple.poses_at(if self.midpoint { -0.5 * self.step } else { 0.0 })),
            start: starts.then(|| couple.poses_at(back)),
            elsewhere: match both && known & TOUCHED == 0 && !memory.is_empty() {
                true => [elsewhere(0), elsewhere(1)],
                false => [None; 2],
            },
            centers: bodies.map(|body| body.center + back * body.velocity.xy()),
            touched: !rounded && known & TOUCHED != 0,
            told: None,
        }
    }

    /// The faces of segments on whose side the other part lies. `deepest` is the contact of the two.
    fn faces_of(&self, couple: &Couple, deepest: Option<&Touch>) -> Option<[Option<usize>; 2]> {
        let Couple {
            sides,
            parts,
            faces,
            ..
        } = *couple;
        let poses = sides.map(|leaf| &leaf.pose);
        // cosine of a contact's angle with the face 0 of a segment
        let cosine = |i: usize, touch: &Touch| match &sides[i].part.core {
            Core::Edge(edge) => {
                let sign = if i == 0 { 1.0 } else { -1.0 };
                Some(sign * poses[i].rotate(edge.normals[0]).dot(&touch.normal))
            }
            _ => None,
        };
        let by_contact = |i: usize, least: f64| {
            let cosine = cosine(i, deepest?).filter(|cosine| cosine.abs() >= least)?;
            Some(usize::from(cosine < 0.0))
        };
        if (0..2).all(|i| faces[i].is_some() || !sides[i].part.is_two_sided()) {
            return Some(faces);
        }
        // of balls the contact tells the side
        let told = sides_of(poses, parts, &couple.sight)
            .or(deepest.map(|_| [0, 1].map(|i| by_contact(i, 0.0))))?;
        // a sheet that swings over its end shows the other part its other face
        let both = sides.iter().all(|leaf| leaf.part.is_two_sided());
        let at_end = |i: usize| match (&sides[i].part.core, deepest) {
            (Core::Edge(edge), Some(touch)) => {
                let along = edge.fraction(poses[i].apply_inverse(touch.point));
                along.min(1.0 - along) <= END
            }
            _ => false,
        };
        let swings = |i: usize| both && sides[i].solid.is_none() && at_end(i);
        Some([0, 1].map(|i| {
            let swung = by_contact(i, FRAC_1_SQRT_2).filter(|_| swings(i));
            faces[i].or(swung).or(told[i])
        }))
    }

    /// Stores the sides on which two parts lie that are near enough to cross in the next step. Where
    /// `found` is empty, a neighbour may have the contact; `bound` is then that of their gap \[m\].
    pub(super) fn remember_sides(
        &self,
        couple: &Couple,
        (found, bound): (&[Touch], f64),
        memory: &mut Marks,
    ) {
        let Couple { leaves, sides, .. } = *couple;
        if !sides.iter().any(|leaf| leaf.part.is_two_sided()) {
            return;
        }
        self.remember_loops(couple, memory);
        let deepest = found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap));
        let rounding = sides[0].part.rounding + sides[1].part.rounding;
        // cores that cannot cross in the next step need no memory
        let motion = self.span.motion(couple.bodies);
        if deepest.map_or(bound, |touch| touch.gap) + rounding > motion {
            return;
        }
        let Some(faces) = self.faces_of(couple, deepest) else {
            return;
        };
        // at a corner each of two segments may have left the contact to the other
        let order = Row::order(leaves, &self.leaves.names);
        let stays = bound < 0.0 && memory.before(&order) & TOUCHED != 0;
        let mut known = match deepest.is_some() || stays {
            true => TOUCHED,
            false => 0,
        };
        for (i, face) in (0..).zip(faces) {
            if let Some(face) = face.filter(|_| sides[i].part.is_two_sided()) {
                known |= (1 + face as u32) << (2 * i);
                if deepest.is_some() {
                    let name = &self.leaves.names[leaves[i] as usize];
                    memory.add(own_order(name), 1 << face);
                }
            }
        }
        memory.set(order, known);
    }
}
