//! What a cluster records of its intervals.

use super::context::{Cluster, Context};
use super::runner::Runner;
use super::search::LAST;
use crate::dynamics::impacts::{find_impacts, finish_landings};
use crate::dynamics::recording::{forces_work, record_interval, working_velocities};

impl Runner {
    /// Records the interval solved last.
    pub(super) fn record_last(&mut self, context: &Context, time: f64, cluster: &mut Cluster) {
        self.problems.append(&mut self.solution.problems);
        let (interval, solution, w) = (&self.interval, &self.solution, context.inverse_mass);
        let (record, cache) = (&mut self.record, &mut cluster.contacts);
        for (k, outcome) in solution.outcomes.iter().enumerate() {
            outcome.count(solution.islands.blocks(k).len(), record);
        }
        cache.clear();
        let (all, mean) = (
            0..interval.blocks.len(),
            working_velocities(interval, solution, w),
        );
        let from = record.contacts.len();
        record_interval(interval, solution, all, &mean, time, record, cache);
        // what lands in a part goes on in the next one
        let before = match cluster.in_parts {
            true => std::mem::take(&mut cluster.landings),
            false => Vec::new(),
        };
        let (impacts, landings) = (&mut record.impacts, &mut cluster.landings);
        finish_landings(&before, &record.contacts[from..], impacts, w);
        let landings = (before.as_slice(), landings);
        find_impacts(interval, solution, |_| true, w, time, impacts, landings);
        record.energy.forces += forces_work(interval, solution, w, |k| self.members[k]);
        for (&b, d) in cluster.bodies.iter().zip(&mut cluster.displacement) {
            *d += 0.5 * interval.length * (interval.start[b as usize] + solution.end[b as usize]);
        }
        // the last interval ends with the step, whatever the sum of the times says
        let elapsed = match context.time + context.dt - time > LAST * context.dt {
            true => time - context.time,
            false => context.dt,
        };
        cluster.path.push((elapsed, cluster.displacement.clone()));
    }
}
