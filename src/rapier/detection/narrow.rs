//! The contacts of one pair of parts.

use super::super::engine::prelude::*;
use super::super::kernels::{Sight, Touch, cell_touches, relative, touches};
use super::couple::Couple;
use super::leaves::Leaf;
use super::output::Group;
use super::pairs::Finder;
use super::points::Pair;
use super::rows::Row;
use super::scratch::{EventContact, Scratch};
use super::shapes;
use super::terms::Terms;
use crate::dynamics::{Detection, NearWanted, NormalLaw};
use crate::rapier::parry::query::{DefaultQueryDispatcher, QueryDispatcher};

/// Whether the caller wants two parts in [`Detection::near`].
fn is_near_wanted(out: &Detection, [one, two]: [&Leaf; 2]) -> bool {
    match out.wants_near {
        NearWanted::None => false,
        NearWanted::Rebounding => one.surface.restitution_with(&two.surface) > 0.0,
        NearWanted::All => true,
    }
}

/// Whether the bounding boxes of two parts are more than `reach` \[m\] apart.
pub(super) fn are_boxes_apart(sides: [&Leaf; 2], reach: f64) -> bool {
    let [a, b] = sides.map(|leaf| shapes::extent(&leaf.part, &leaf.pose));
    (0..2).any(|k| a[k] > b[k + 2] + reach || b[k] > a[k + 2] + reach)
}

impl Finder<'_> {
    /// Adds the contacts of a pair; `group` is the state of the pairs before.
    ///
    /// Returns a lower bound of the gap \[m\]; `None` if no kernel was called.
    pub(super) fn contacts(
        &self,
        leaves: [u32; 2],
        group: &mut Group,
        scratch: &mut Scratch,
        out: &mut Detection,
    ) -> Option<f64> {
        let sides = leaves.map(|leaf| self.leaves.get(leaf));
        let bodies = sides.map(|leaf| self.present(leaf));
        let plain = sides.iter().all(|leaf| leaf.surface.plain) && !self.is_apart(sides);
        let moving = bodies
            .iter()
            .any(|body| body.kind == RigidBodyType::Dynamic);
        let immovable = bodies.iter().all(|body| body.immovable && !body.asleep);
        let sizes = sides.map(|leaf| leaf.surface.size);
        let reach = self.span.reach(bodies, sizes);
        if !(plain && moving && !immovable) {
            let terms = self.terms(sides)?;
            return self.contacts_on(&terms, leaves, sides, reach, group, scratch, out);
        }
        let poses = sides.map(|leaf| &leaf.pose);
        let couple = Couple::new(self, leaves, sides, bodies, &scratch.faces);
        let found = &mut scratch.touches;
        found.clear();
        let bound = touches(poses, couple.parts, &couple.sight, reach, found);
        let Some(bound) = bound else {
            return self.contacts_on(&Terms::default(), leaves, sides, reach, group, scratch, out);
        };
        if (self.within || bound <= reach) && is_near_wanted(out, sides) {
            let setting = self.plain_setting(sides);
            if let Some(near) = self.near(&setting, bodies, bound) {
                out.add_near(near);
            }
        }
        let met = self.meet_fast(&couple, bound, found);
        if self.midpoint && !met {
            self.meet_in_flight(&couple, (bound, reach), found);
        }
        let mut moves = met;
        if !met && (self.midpoint || self.within) {
            match found.is_empty() {
                true => self.meet_at_corner(&couple, (bound, reach), found),
                false => moves = self.meet_moving(&couple, reach, found),
            }
        }
        if self.midpoint {
            let near = (found.as_slice(), bound);
            self.remember_sides(&couple, near, &mut scratch.faces);
        }
        if !found.is_empty() {
            self.add_ends(&couple, reach, found);
            let setting = self.plain_setting(sides);
            let next = out.contacts.len();
            self.give(setting, sides, &Terms::default(), group, found, out);
            if out.contacts.len() == next + found.len() {
                let tie = self.tie(&couple, &setting, found, next);
                scratch.ties.extend(tie);
            }
            let suspect = moves.then(|| self.suspect(&couple, found, next..out.contacts.len()));
            scratch.suspects.extend(suspect.flatten());
        }
        Some(bound)
    }

    /// Whether two parts are certainly too far apart to meet in this step, whatever their terms.
    pub(super) fn out_of_reach(&self, leaves: [u32; 2], found: &mut Vec<Touch>) -> bool {
        let sides = leaves.map(|leaf| self.leaves.get(leaf));
        let bodies = sides.map(|leaf| self.present(leaf));
        let reach = self.span.reach(bodies, sides.map(|leaf| leaf.surface.size));
        let (poses, parts) = (sides.map(|leaf| &leaf.pose), sides.map(|leaf| &leaf.part));
        found.clear();
        match touches(poses, parts, &Sight::default(), reach, found) {
            Some(_) => found.is_empty(),
            // only parry knows the gap of this pair
            None => are_boxes_apart(sides, reach),
        }
    }

    /// [`Finder::contacts`] without the fast path: all terms, all shapes.
    #[allow(clippy::too_many_arguments)]
    #[inline(never)]
    fn contacts_on(
        &self,
        terms: &Terms,
        leaves: [u32; 2],
        sides: [&Leaf; 2],
        reach: f64,
        group: &mut Group,
        scratch: &mut Scratch,
        out: &mut Detection,
    ) -> Option<f64> {
        let bodies = sides.map(|leaf| self.present(leaf));
        let couple = Couple::new(self, leaves, sides, bodies, &scratch.faces);
        let found = &mut scratch.touches;
        let (poses, parts) = (sides.map(|leaf| &leaf.pose), sides.map(|leaf| &leaf.part));
        found.clear();
        let cell = terms.foundation;
        let pressed = cell.and_then(|cell| cell_touches(poses, parts, cell, reach, found));
        let (parts, sight) = (couple.parts, &couple.sight);
        if let Some(bound) = pressed.or_else(|| touches(poses, parts, sight, reach, found)) {
            let met = pressed.is_some() || self.meet_fast(&couple, bound, found);
            if self.midpoint && !met {
                self.meet_in_flight(&couple, (bound, reach), found);
            }
            let mut moves = met;
            if !met && (self.midpoint || self.within) {
                moves = self.meet_moving(&couple, reach, found);
            }
            if self.midpoint {
                let near = (found.as_slice(), bound);
                self.remember_sides(&couple, near, &mut scratch.faces);
            }
            if terms.events_only {
                let least = found.iter().map(|t| t.gap).reduce(f64::min);
                scratch.event_contacts.extend(least.map(|gap| EventContact {
                    colliders: sides.map(|leaf| leaf.surface.handle),
                    gap,
                }));
                return Some(bound);
            }
            let covered = match terms.cells {
                true => self.covered(poses, sides, reach, found),
                false => None,
            };
            if !terms.modified
                && !terms.cells
                && (self.within || bound <= reach)
                && is_near_wanted(out, sides)
            {
                let setting = self.setting(sides, terms, covered);
                if let Some(near) = self.near(&setting, bodies, bound) {
                    out.add_near(near);
                }
            }
            if terms.modified
                && let Some(hooks) = self.hooks
            {
                let known = self.known(sides)?;
                let order = Row::order(leaves, &self.leaves.names);
                let mut mark = scratch.marks.get(&order);
                let none = found.is_empty();
                if none && mark == 0 {
                    return Some(bound);
                }
                let mut setting = self.setting(sides, terms, covered);
                let subs = sides.map(|leaf| leaf.sub);
                let left = hooks.modify(known, poses, subs, found, &mut setting, &mut mark);
                scratch.marks.set(order, if none { 0 } else { mark });
                for (touch, speed) in left {
                    found.clear();
                    found.push(touch);
                    let belt = setting.belt - speed;
                    self.give(Pair { belt, ..setting }, sides, terms, group, found, out);
                }
            } else if !found.is_empty() {
                let setting = self.setting(sides, terms, covered);
                // more points would be more springs
                if matches!(setting.law, NormalLaw::Rigid { .. }) {
                    self.add_ends(&couple, reach, found);
                }
                let next = out.contacts.len();
                self.give(setting, sides, terms, group, found, out);
                let suspect = moves.then(|| self.suspect(&couple, found, next..out.contacts.len()));
                scratch.suspects.extend(suspect.flatten());
            }
            return Some(bound);
        }
        if terms.events_only {
            return None;
        }
        // only shapes with a kernel support hooks that modify contacts; user-defined shapes have
        // none
        let setting = self.setting(sides, terms, None);
        self.ask_parry(sides, setting, reach, group, terms.cells, out);
        Some(f64::NEG_INFINITY)
    }

    pub(super) fn overlap(&self, sides: [&Leaf; 2], found: &mut Vec<Touch>) -> bool {
        let poses = sides.map(|leaf| &leaf.pose);
        let parts = sides.map(|leaf| &leaf.part);
        found.clear();
        match touches(poses, parts, &Sight::default(), 0.0, found) {
            Some(_) => !found.is_empty(),
            None => DefaultQueryDispatcher
                .intersection_test(
                    &relative(poses[0], poses[1]).to_rapier(),
                    &*shapes::for_parry(&parts[0].core),
                    &*shapes::for_parry(&parts[1].core),
                )
                .is_ok_and(|answer| answer.intersecting),
        }
    }
}
