//! What all contacts of two parts share.

use super::super::engine::prelude::*;
use super::super::kernels::{Core, Sight, Touch, touches};
use super::Present;
use super::leaves::Leaf;
use super::pairs::Finder;
use super::points::{Pair, mix};
use super::terms::Terms;
use crate::dynamics::{NearPair, NormalLaw, Pose64};

impl Finder<'_> {
    /// Length of a segment, across the contact's normal, that lies on the other part \[m\]; `None`
    /// for one-point contacts, as with a ball.
    pub(super) fn covered(
        &self,
        poses: [&Pose64; 2],
        sides: [&Leaf; 2],
        reach: f64,
        found: &[Touch],
    ) -> Option<f64> {
        let width = |found: &[Touch]| match found {
            [a, b] => Some(a.normal.perp(&(b.point - a.point)).abs()),
            _ => None,
        };
        let [_] = found else {
            return width(found);
        };
        // the other end is beyond the reach
        let mut both = Vec::with_capacity(2);
        let far = reach + sides[0].surface.size.max(sides[1].surface.size);
        let parts = sides.map(|leaf| &leaf.part);
        touches(poses, parts, &Sight::default(), far, &mut both);
        width(&both)
    }

    /// Two parts whose gap is at least `bound` \[m\]; `None` if their law is not rigid.
    #[inline]
    pub(super) fn near(
        &self,
        setting: &Pair,
        bodies: [&Present; 2],
        bound: f64,
    ) -> Option<NearPair> {
        let NormalLaw::Rigid { restitution } = setting.law else {
            return None;
        };
        Some(NearPair {
            surfaces: setting.surfaces,
            bodies: setting.numbers,
            bound,
            radii: bodies.map(|body| body.radius),
            restitution,
        })
    }

    /// The settings that all contacts of two parts without surface laws share.
    #[inline]
    pub(super) fn plain_setting(&self, sides: [&Leaf; 2]) -> Pair {
        let [one, two] = sides.map(|leaf| &leaf.surface);
        Pair {
            numbers: sides.map(|leaf| leaf.body),
            surfaces: sides.map(|leaf| leaf.slot),
            key: pair_key([one.handle, two.handle]),
            law: NormalLaw::Rigid {
                restitution: one.restitution_with(two),
            },
            friction: one.friction_with(two),
            belt: 0.0,
            size: one.size.min(two.size),
            radii: sides.map(|leaf| leaf.part.radius()),
            rolls_on: [0.0; 2],
        }
    }

    pub(super) fn setting(&self, sides: [&Leaf; 2], terms: &Terms, covered: Option<f64>) -> Pair {
        let setting = self.plain_setting(sides);
        let known = if terms.own_law {
            self.known(sides)
        } else {
            None
        };
        let Some(known) = known else {
            return setting;
        };
        let setting = Pair {
            law: known[0].combined_law(known[1]),
            // on side 1 the surface moves along +t, on side 2 along −t
            belt: -known[0].law.speed - known[1].law.speed,
            ..setting
        };
        let cell = (0..2).find(|&i| known[i].law.cells);
        match cell.map(|i| &sides[i].part.core) {
            Some(Core::Edge(edge)) => {
                let length = (edge.ends[1] - edge.ends[0]).norm();
                setting.over(match covered {
                    // each of the two ends has a half; a contact stays one, however little of the
                    // segment it covers
                    Some(covered) => 0.5 * covered.clamp(1e-6 * length, length),
                    None => length,
                })
            }
            _ => setting,
        }
    }
}

fn pair_key(handles: [ColliderHandle; 2]) -> u64 {
    let [(a, of_a), (b, of_b)] = handles.map(|h| h.into_raw_parts());
    mix([a, of_a, b, of_b])
}
