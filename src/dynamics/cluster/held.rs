//! Contacts that land twice in a step.
//!
//! A body that turns about one corner is deeper with another one at the midpoint of an interval, and a
//! kernel may then report that one alone. Without the first the body falls, lands on it again, and so on:
//! the impulses of 64 landings of one contact fell as 1/k. What lands a second time is therefore held
//! through the interval that follows, with the rows of its start.

use super::runner::Runner;
use crate::dynamics::interval::Source;
use crate::dynamics::model::ContactPoint;

impl Runner {
    /// Finds the contacts that landed without rebound at the instant, and had landed before in the
    /// step.
    pub(super) fn hold_landed(&mut self) {
        self.held.clear();
        let (instant, hit) = (&self.instant, &self.hit);
        for (block, p) in instant.blocks.iter().zip(&hit.impulses) {
            let Source::Contact(index) = block.source else {
                continue;
            };
            let contact = &instant.detection.contacts[index];
            if p.x <= 0.0 || block.impact {
                continue;
            }
            match self.landed.contains(&contact.key) {
                true => self.held.push(*contact),
                false => self.landed.push(contact.key),
            }
        }
    }

    /// Adds the contacts that [`Runner::hold_landed`] found to the interval, where its midpoint does not
    /// show them: with the rows of its start, and the gap on the straight path from there.
    pub(super) fn add_held(&mut self) {
        let interval = &mut self.interval;
        for held in &self.held {
            let known = &interval.detection.contacts;
            if known.iter().any(|c| c.key == held.key) {
                continue;
            }
            let way = 0.5 * interval.length * held.rows.velocity(&interval.start).x;
            let at_end = |c: &ContactPoint| c.surfaces == held.surfaces;
            let place = known
                .iter()
                .rposition(at_end)
                .map_or(known.len(), |k| k + 1);
            let contact = ContactPoint {
                gap: held.gap + way,
                ..*held
            };
            interval.detection.contacts.insert(place, contact);
        }
    }
}
