//! Contacts that the solution of a step makes necessary.
//!
//! Contacts keep bodies apart to first order, in the directions of the midpoint. Where the solution
//! turns bodies by large angles, or pushes them past a corner, they overlap at the next midpoint all the
//! same. The model finds these overlaps from the solved velocities
//! ([`MultibodyModel::detect_driven`]), and the step is solved once more with a contact for each.
//!
//! Islands that have none of these contacts keep their solution. In a crowd the contacts near a new one are
//! swept first, then a few times all.

use super::model::{Detection, MultibodyModel};
use super::record::StepRecord;
use super::rules::{Rules, Span};
use super::settings::StepError;
use super::stepper::MoreauStepper;
use crate::contact::Vec2;

/// Most times that a step is solved again. What overlaps then is moved apart by the position pass.
const ROUNDS: usize = 2;

impl MoreauStepper {
    /// Solves the step again as long as its solution drives bodies into each other.
    ///
    /// # Errors
    /// [`StepError::NonFinite`].
    pub(super) fn solve_driven(
        &mut self,
        model: &mut dyn MultibodyModel,
        rules: &Rules,
        record: &mut StepRecord,
    ) -> Result<(), StepError> {
        // events find the contacts of each instant
        if rules.events || !rules.corrects_gaps() {
            return Ok(());
        }
        let dt = record.dt;
        let detected = self.interval.detection.contacts.len();
        for _ in 0..ROUNDS {
            let mut driven = Detection::default();
            let known = &self.interval.detection.contacts[..detected];
            model.detect_driven(&self.solution.end, dt, known, &mut driven);
            if driven.contacts.is_empty() {
                break;
            }
            let (interval, w) = (&mut self.interval, self.inverse_mass.as_slice());
            let released = self.solution.deferred[interval.deferred.len()..].to_vec();
            let (first, contacts) = (interval.blocks.len(), &mut interval.detection.contacts);
            let from = contacts.len();
            // the same corner may be found again where it is now: a contact of its own
            for contact in &mut driven.contacts {
                if contacts[detected..].iter().any(|c| c.key == contact.key) {
                    contact.key.feature = !contact.key.feature;
                }
            }
            contacts.append(&mut driven.contacts);
            let (cache, span) = (&self.cache.contacts, Span::whole(dt));
            interval.collect_more(rules, cache, w, span, from);
            if interval.blocks.len() == first {
                break;
            }
            // with dominance all islands are solved again, else the working set keeps their work
            if !interval.roles.dominance.is_empty() {
                let solved = &self.solution.outcomes;
                solved.iter().for_each(|outcome| outcome.count_work(record));
            }
            let warm = interval.warm.iter_mut().zip(&self.solution.impulses);
            warm.for_each(|(warm, solved)| *warm = *solved);
            interval.driven_from = Some(first as u32);
            self.solve(rules, dt)?;
            self.release_again(&released);
        }
        self.interval.driven_from = None;
        Ok(())
    }

    /// Defers lone contacts that were `released` before the last solve. Where their islands have kept their solution,
    /// that is one without them.
    fn release_again(&mut self, released: &[usize]) {
        let solution = &mut self.solution;
        let idle = |index: usize| {
            let block = self.interval.block_of(index);
            block.is_none_or(|i| solution.impulses[i] == Vec2::zeros())
        };
        let again = |index: &usize| !solution.deferred.contains(index) && idle(*index);
        let again: Vec<usize> = released.iter().copied().filter(again).collect();
        solution.deferred.extend(again);
    }
}
