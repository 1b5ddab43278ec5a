//! Impacts that take bodies farther than detection has looked.
//!
//! Detection finds what bodies may meet with the velocities of the start of the step, and somewhat more. A
//! heavy body can throw a light one at a multiple of that, and then nothing would stop it before the next
//! step: it would be in a wall by then, or behind it. A step with rebounds is therefore detected and solved
//! again, with the ways that its bodies went.

use super::cluster::Cluster;
use super::interval::movable;
use super::model::MultibodyModel;
use super::record::StepRecord;
use super::rules::Rules;
use super::settings::StepError;
use super::stepper::MoreauStepper;
use crate::contact::{NO_BODY, Vec3};

/// Most times that a step is detected again: what is found may throw other bodies.
pub(super) const ROUNDS: usize = 3;

impl MoreauStepper {
    /// Whether bodies that rebound move farther from the midpoint than the model has looked. It will look so far
    /// the next time.
    pub(super) fn moves_too_far(
        &mut self,
        model: &dyn MultibodyModel,
        clusters: &[Cluster],
        dt: f64,
    ) -> bool {
        let interval = &self.interval;
        let (start, end) = (&interval.start, &self.solution.end);
        let mut moved: Vec<(u32, Vec3)> = Vec::new();
        for cluster in clusters.iter().filter(|cluster| cluster.is_bent()) {
            for (k, &body) in cluster.bodies.iter().enumerate() {
                let middle = 0.5 * dt * start[body as usize];
                let ways = cluster.path.iter().map(|(_, ways)| ways[k] - middle);
                let farthest = ways.fold(Vec3::zeros(), |most, way| most.sup(&way.abs()));
                moved.push((body, farthest));
            }
        }
        let stepped = |body: &u32| {
            clusters
                .iter()
                .any(|c| c.bodies.binary_search(body).is_ok())
        };
        for &index in &interval.rebounding {
            let bodies = interval.detection.contacts[index].rows.bodies;
            let own = movable(bodies, &self.inverse_mass).into_iter();
            for body in own.filter(|b| *b != NO_BODY && !stepped(b)) {
                moved.push((body, 0.5 * dt * end[body as usize].abs()));
            }
        }
        moved.retain(|(body, moved)| !model.reaches(*body as usize, moved));
        let bodies = start.len();
        let known = &mut self.interval.detection.moved;
        for (body, moved) in &moved {
            known.resize(bodies, Vec3::zeros());
            let known = &mut known[*body as usize];
            *known = known.sup(moved);
        }
        !moved.is_empty()
    }

    /// Begins the step again from its start, also of the `clusters`.
    ///
    /// # Errors
    /// Those of the model.
    pub(super) fn begin_again(
        &mut self,
        model: &mut dyn MultibodyModel,
        rules: &Rules,
        clusters: &[Cluster],
        record: &mut StepRecord,
    ) -> Result<(), StepError> {
        let solved = &self.solution.outcomes;
        solved.iter().for_each(|outcome| outcome.count_work(record));
        clusters.iter().for_each(|c| record.add_work(&c.record));
        self.solver.cache.drop_step();
        self.solver.cache.begin();
        self.cancel(model);
        self.interval.start = self.true_start().into_owned();
        let w = model.inverse_mass();
        for link in &self.stiff {
            self.inverse_mass[link.body] = w[link.body];
        }
        Ok(self.look(model, rules, record.dt)?)
    }
}
