//! From touches of two parts to contacts of the output.

use super::super::engine::geometry::ContactManifold;
use super::super::engine::prelude::*;
use super::super::kernels::{Touch, relative};
use super::leaves::Leaf;
use super::pairs::Finder;
use super::points::{Pair, mix, parry_points, places, rolls_on, same_place};
use super::shapes;
use super::terms::Terms;
use crate::dynamics::{ContactPoint, Detection, SurfacePoint};
use crate::rapier::parry::query::{DefaultQueryDispatcher, PersistentQueryDispatcher};

/// Start of the contacts of the present pair of colliders in the output, if either has several
/// parts.
#[derive(Default)]
pub(super) struct Group {
    slots: [u32; 2],
    start: usize,
}

impl Group {
    #[inline]
    fn start(&mut self, sides: [&Leaf; 2], out: &Detection) -> usize {
        let slots = sides.map(|leaf| leaf.slot);
        if slots != self.slots {
            *self = Group {
                slots,
                start: out.contacts.len(),
            };
        }
        self.start
    }
}

impl Finder<'_> {
    #[inline]
    pub(super) fn give(
        &self,
        setting: Pair,
        sides: [&Leaf; 2],
        terms: &Terms,
        group: &mut Group,
        found: &[Touch],
        out: &mut Detection,
    ) {
        // at the common end of two cells each has its own share of the load
        if terms.foundation.is_some() || sides.iter().all(|leaf| leaf.lone) {
            let points = found.iter().map(|t| self.point(&setting, sides, t));
            out.contacts.extend(points);
            return;
        }
        let from = group.start(sides, out);
        for touch in found.iter() {
            let old = &out.contacts[from..];
            if !old.iter().any(|p| same_place(p, touch, setting.size)) {
                out.contacts.push(self.point(&setting, sides, touch));
            }
        }
    }

    /// A contact of two parts with kernels.
    #[inline]
    pub(super) fn point(&self, setting: &Pair, sides: [&Leaf; 2], touch: &Touch) -> ContactPoint {
        let bodies = sides.map(|leaf| self.present(leaf));
        let feature = match sides.iter().all(|leaf| leaf.lone) {
            true => touch.feature.into(),
            false => mix([sides[0].sub, sides[1].sub, touch.feature, 0]),
        };
        let setting = Pair {
            rolls_on: rolls_on(sides, touch),
            ..*setting
        };
        setting.point(bodies, touch, places(sides, touch), feature, true)
    }

    pub(super) fn ask_parry(
        &self,
        sides: [&Leaf; 2],
        setting: Pair,
        reach: f64,
        group: &mut Group,
        one: bool,
        out: &mut Detection,
    ) {
        let poses = sides.map(|leaf| leaf.pose);
        let bodies = sides.map(|leaf| self.present(leaf));
        let shapes = sides.map(|leaf| shapes::for_parry(&leaf.part.core));
        let rounding = sides[0].part.rounding + sides[1].part.rounding;
        let from = group.start(sides, out);
        let mut manifolds: Vec<ContactManifold> = Vec::new();
        // a pair that parry does not support has no contact in rapier either
        let _ = DefaultQueryDispatcher.contact_manifolds(
            &relative(&poses[0], &poses[1]).to_rapier(),
            &*shapes[0],
            &*shapes[1],
            (reach + rounding) as Real,
            &mut manifolds,
            &mut None,
        );
        for manifold in manifolds.iter().filter(|m| !m.points.is_empty()) {
            parry_points(manifold, &poses, reach + rounding, one, |touch, order| {
                let touch = Touch {
                    gap: touch.gap - rounding,
                    ..touch
                };
                let old = &out.contacts[from..];
                if old.iter().any(|p| same_place(p, &touch, setting.size)) {
                    return;
                }
                let on = [sides[0].sub.max(order[0]), sides[1].sub.max(order[1])];
                let on = on.map(SurfacePoint::on);
                let feature = mix([sides[0].sub, sides[1].sub, mix(order) as u32, order[0]]);
                let point = setting.point(bodies, &touch, on, feature, false);
                out.contacts.push(point);
            });
        }
    }
}
