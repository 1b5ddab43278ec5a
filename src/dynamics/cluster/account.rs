//! The account of energy of a cluster, see [`crate::dynamics::reserve`].
//!
//! The reserves of its bodies are kept from interval to interval and from impact to impact. Debts are paid
//! in the last interval of the step alone: what ends at an event is moved to its place with the velocities
//! that were solved, and would miss it with others.

use super::context::Context;
use super::runner::Runner;
use crate::dynamics::debts::Debtors;
use crate::dynamics::deep_impacts::deep_impacts;
use crate::dynamics::model::MultibodyModel;

impl Runner {
    /// Takes the interval solved last into the account, and notes without events whether it leaves contacts deep.
    /// With `pays` its bodies must be at its midpoint.
    pub(super) fn settle(&mut self, model: &dyn MultibodyModel, context: &Context, pays: bool) {
        // with events it is stepped as finely as it can be
        if !context.rules.events && !self.deep {
            let (interval, w) = (&self.interval, context.inverse_mass);
            self.deep = !deep_impacts(model, interval, &self.solution, w).is_empty();
        }
        if !context.rules.keeps_account() {
            return;
        }
        let debtors = Debtors {
            model,
            interval: &self.interval,
            inverse_mass: context.inverse_mass,
            pays,
        };
        let reserves = &mut self.instant.reserves;
        debtors.settle(&mut self.solution, |_| true, reserves, &mut self.record);
        self.interval.reserves.clone_from(reserves);
    }

    /// Takes the impact solved last into the account.
    pub(super) fn settle_hit(&mut self, model: &dyn MultibodyModel, context: &Context) {
        if !context.rules.keeps_account() {
            return;
        }
        let debtors = Debtors {
            model,
            interval: &self.instant,
            inverse_mass: context.inverse_mass,
            pays: false,
        };
        let reserves = &mut self.interval.reserves;
        debtors.settle(&mut self.hit, |_| true, reserves, &mut self.record);
    }
}
