//! Finds the side of a two-sided segment on which the other part of a pair lies.
//!
//! A segment has no inside, so positions alone do not give the side. At the midpoint of a step, a
//! part that lands on the segment may already be on its far side. A part that rests on it is on one
//! side or the other by rounding. A pair that touches therefore keeps its side of the last step, and
//! a new pair takes its side at the start of the step.

use super::super::kernels::{Core, Part, Sight, Touch};
use super::Present;
use super::leaves::Leaf;
use super::pairs::{Finder, Marks};
use super::rows::Row;
use super::seams::poses_at;
use crate::contact::Vec2;

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
            false => memory.get(&Row::order(leaves, &self.leaves.names)),
        };
        // motion of `other` relative to `base` since the start of the step
        let moved = |base: usize, other: usize| {
            let place = sides[other].pose.translation;
            let u = bodies[other].velocity_at(place) - bodies[base].velocity_at(place);
            0.5 * self.step * u
        };
        Sight {
            faces: [0, 1].map(|i| match known >> (2 * i) & 3 {
                0 => None,
                face => Some(face as usize - 1),
            }),
            moved: match self.midpoint {
                true => [moved(0, 1), moved(1, 0)],
                false => [Vec2::zeros(); 2],
            },
            motion: self.span.motion(bodies),
            start: sides
                .iter()
                .any(|leaf| is_one_sided(&leaf.part))
                .then(|| poses_at(sides, bodies, -0.5 * self.step)),
        }
    }

    /// Stores the sides on which two parts touch, or may touch in this step.
    pub(super) fn remember_sides(
        &self,
        leaves: [u32; 2],
        sides: [&Leaf; 2],
        bodies: [&Present; 2],
        found: &[Touch],
        memory: &mut Marks,
    ) {
        if !sides.iter().any(|leaf| is_two_sided(&leaf.part)) {
            return;
        }
        let Some(deepest) = found.iter().min_by(|a, b| a.gap.total_cmp(&b.gap)) else {
            return;
        };
        let rounding = sides[0].part.rounding + sides[1].part.rounding;
        // cores that cannot cross in the next step need no memory
        if deepest.gap + rounding > self.span.motion(bodies) {
            return;
        }
        let mut known = 0;
        for (i, sign) in [(0, 1.0), (1, -1.0)] {
            if let Core::Edge(edge) = &sides[i].part.core
                && !edge.one_sided
            {
                let right = sides[i].pose.rotate(edge.normals[0]);
                let face = u32::from(sign * right.dot(&deepest.normal) < 0.0);
                known |= (1 + face) << (2 * i);
            }
        }
        memory.set(Row::order(leaves, &self.leaves.names), known);
    }
}
