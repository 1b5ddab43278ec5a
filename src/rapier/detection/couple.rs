//! Two parts that may meet, and what is known of them.

use super::super::kernels::{Part, Sight, Touch};
use super::Present;
use super::leaves::Leaf;
use super::marks::Marks;
use super::pairs::Finder;
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// Two parts that may meet.
pub(super) struct Couple<'a> {
    pub leaves: [u32; 2],
    pub sides: [&'a Leaf; 2],
    pub bodies: [&'a Present; 2],
    /// Their parts. Of a chain whose side is known the part has solid on the far side.
    pub parts: [&'a Part; 2],
    /// Per part of a chain, this side: see [`super::chains`].
    pub faces: [Option<usize>; 2],
    /// Per part of a closed chain, this side, if the other part does not touch the chain or has not done so
    /// when the two came near each other: see [`super::loops`].
    pub loops: [Option<usize>; 2],
    pub sight: Sight,
}

impl<'a> Couple<'a> {
    /// Two parts, by what the last step has remembered of them.
    #[inline(always)]
    pub fn new(
        finder: &Finder<'a>,
        leaves: [u32; 2],
        sides: [&'a Leaf; 2],
        bodies: [&'a Present; 2],
        memory: &Marks,
    ) -> Couple<'a> {
        let mut couple = Couple {
            leaves,
            sides,
            bodies,
            parts: [0, 1].map(|i: usize| finder.covered[i].unwrap_or(&sides[i].part)),
            faces: [None; 2],
            loops: [None; 2],
            sight: Sight::default(),
        };
        if sides.iter().any(|leaf| leaf.part.is_two_sided()) {
            couple.loops = finder.faces_of_loops(&couple, memory);
            let loops = couple.loops;
            let looped = (0..2).all(|i| loops[i].is_some() || sides[i].solid.is_none());
            let told = match looped {
                true => None,
                false => finder.sides_of_chains(&couple, memory),
            };
            // beside a free end there is none
            let known = |faces: &[Option<usize>; 2], asked: fn(&Leaf) -> bool| {
                (0..2).all(|i| loops[i].is_some() || !asked(sides[i]) || faces[i].is_some())
            };
            // at the end of a chain the segments would follow different rules
            let ends = sides.iter().any(|leaf| leaf.part.ends_a_chain());
            let within = told.filter(|faces| !ends && known(faces, |leaf| leaf.solid.is_some()));
            couple.faces = [0, 1].map(|i| {
                let face = loops[i].or_else(|| within?[i]);
                face.filter(|_| sides[i].solid.is_some())
            });
            couple.parts = [0, 1].map(|i| match (&sides[i].solid, couple.faces[i]) {
                (Some(solid), Some(face)) => &solid[face],
                _ => couple.parts[i],
            });
            couple.sight = finder.sight(&couple, memory);
            if ends && loops == [None; 2] {
                let sheets = sides.iter().all(|leaf| leaf.part.is_sheet());
                couple.sight.told = told.filter(|faces| sheets && known(faces, |_| true));
            }
        }
        let any = |of: fn(&Part) -> bool| couple.parts.into_iter().any(of);
        if any(Part::is_one_sided) && !any(Part::is_two_sided) {
            couple.sight.moved = couple.moved(0.5 * finder.step);
        }
        couple
    }

    /// Motion of the other part relative to each in a time \[s\], by their present velocities.
    pub fn moved(&self, time: f64) -> [Vec2; 2] {
        [0, 1].map(|base: usize| {
            let other = self.sides[1 - base];
            let place = other.pose.apply(other.part.middle());
            let [own, other] = [base, 1 - base].map(|i| self.bodies[i].velocity_at(place));
            time * (other - own)
        })
    }

    pub fn poses(&self) -> [Pose64; 2] {
        self.sides.map(|leaf| leaf.pose)
    }

    /// Poses of the two at another time \[s\] from now, by their present velocities.
    pub fn poses_at(&self, time: f64) -> [Pose64; 2] {
        [0, 1].map(|i: usize| {
            let mut pose = self.sides[i].pose;
            let center = pose.apply_inverse(self.bodies[i].center);
            pose.advance(&self.bodies[i].velocity, center, time);
            pose
        })
    }

    /// Size of the smaller one \[m\].
    pub fn size(&self) -> f64 {
        let [one, two] = self.sides;
        one.surface.size.min(two.surface.size)
    }

    /// Bound of the speed of the two towards each other \[m/s\].
    pub fn speed(&self) -> f64 {
        self.bodies[0].speed + self.bodies[1].speed
    }

    /// Bound of the speed at which any two points of the two come closer \[m/s\].
    pub fn closing(&self) -> f64 {
        self.bodies[0].closing(self.bodies[1])
    }

    /// Resolution of positions \[m\]: the larger of 1e-7 of the smaller part's size, and the resolution
    /// of the user's coordinates in `f32`.
    pub fn noise(&self, found: &[Touch]) -> f64 {
        let [one, two] = self.bodies;
        let far = one.coordinate.max(two.coordinate);
        let far = found.iter().map(|t| t.point.amax()).fold(far, f64::max);
        (1e-7 * self.size()).max(4.0 * f64::from(f32::EPSILON) * far)
    }

    /// Whether the parts overlap and move so far in a step \[s\] that they may have passed each other before
    /// its midpoint. The direction of least depth then tells nothing.
    pub fn may_have_passed(&self, step: f64, noise: f64, found: &[Touch]) -> bool {
        self.speed() * step > 0.5 * self.size() && found.iter().any(|touch| touch.gap < -noise)
    }
}
