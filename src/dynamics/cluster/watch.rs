//! Finds the pairs of a cluster that may meet although no contact of theirs is deferred, see
//! [`super::watched`].

use super::context::Context;
use super::runner::{Runner, places};
use super::watched::{Pair, is_crowded, speeds};
use crate::contact::NO_BODY;
use crate::dynamics::interval::belongs;
use crate::dynamics::model::{MultibodyModel, NearPair};
use crate::dynamics::rules::rest_velocity;
use crate::dynamics::settings::StepError;

impl Runner {
    /// Whether a pair of the trial meets that has no deferred contact. Of `bodies`, those that move.
    pub fn meets(
        &mut self,
        model: &mut dyn MultibodyModel,
        context: &Context,
        surfaces: [u32; 2],
        bodies: &[u32],
    ) -> Result<bool, StepError> {
        self.gather(context, bodies);
        let middle = places(model, &self.moved);
        self.start(context);
        self.take_trial(context);
        let pair = self
            .watched(context)
            .into_iter()
            .find(|p| p.surfaces == surfaces);
        let time = match pair {
            Some(mut pair) => self.locate(model, context, &mut pair, f64::INFINITY)?,
            None => None,
        };
        self.place_all(model, &middle);
        Ok(time.is_some())
    }

    /// The pairs of the interval solved last that may meet in it, besides those with deferred contacts.
    pub(super) fn watched(&self, context: &Context) -> Vec<Pair> {
        let near = self.interval.detection.near.iter();
        let deferred = |n: &NearPair| {
            let contacts = &self.interval.detection.contacts;
            let mut all = self.solution.deferred.iter().map(|&i| &contacts[i]);
            all.any(|c| c.surfaces == n.surfaces)
        };
        let members = Some(self.members.as_slice());
        near.filter(|n| belongs(n.bodies, members, context.inverse_mass) && !deferred(n))
            .filter_map(|n| self.watch(context, n))
            .collect()
    }

    /// A pair near enough to meet in the interval.
    fn watch(&self, context: &Context, near: &NearPair) -> Option<Pair> {
        if is_crowded(&self.interval, near) {
            return None;
        }
        let mut kept = self.kept.iter().filter(|k| k.surfaces == near.surfaces);
        let [straight, turning] = self.speeds(near);
        // a rule keeps contacts from closing on straight paths
        let (speed, least) = match kept.clone().map(|k| k.touch).reduce(f64::max) {
            Some(touch) => (turning, touch),
            None => (straight + turning, self.resolved(context, near)),
        };
        let way = 0.5 * self.interval.length * speed;
        if kept.any(|k| k.touches) || way < near.bound.max(least) {
            return None;
        }
        Some(Pair {
            surfaces: near.surfaces,
            bodies: near.bodies,
            speed: Some(straight + turning),
            guess: 0.0,
            standing: Vec::new(),
        })
    }

    /// See [`Pair::speed`]. A pair that touches has no bound.
    pub(super) fn speed_of(&self, surfaces: [u32; 2]) -> Option<f64> {
        let mut kept = self.kept.iter();
        if kept.any(|k| k.touches && k.surfaces == surfaces) {
            return None;
        }
        let mut near = self.interval.detection.near.iter();
        let near = near.find(|n| n.surfaces == surfaces)?;
        Some(self.speeds(near).iter().sum())
    }

    fn speeds(&self, near: &NearPair) -> [f64; 2] {
        speeds(near, [&self.interval.start, &self.solution.end])
    }

    /// Distance \[m\] that the applied forces cover in a hundredth of a step, see
    /// [`crate::dynamics::events::touch_tolerance`].
    fn resolved(&self, context: &Context, near: &NearPair) -> f64 {
        let of = |b: &u32| self.interval.accelerations.get(*b as usize);
        let all = near.bodies.iter().filter(|b| **b != NO_BODY).filter_map(of);
        let most = all.map(|a| a.xy().norm()).fold(0.1, f64::max);
        1e-4 * rest_velocity(most, context.dt) * context.dt
    }
}
