//! What becomes of a solved step: its record, and velocities and poses of the model.

use super::angular_momentum::restore_angular_momentum;
use super::cluster::Cluster;
use super::contact_cache::Overlaps;
use super::crowd::{crowd_bodies, part_crowd};
use super::debts::Debtors;
use super::ends::Ends;
use super::impacts::{find_impacts, finish_landings};
use super::joint_recovery::{Closed, close_joints, excess_gaps, take_up_excess};
use super::kinetic::kinetic;
use super::model::{Detection, MultibodyModel, Shown};
use super::overlapping::{exempt_bodies, find_late};
use super::record::StepRecord;
use super::recording::{forces_work, record_interval, working_velocities};
use super::recovery::part_overlaps;
use super::settings::StepError;
use super::stepper::MoreauStepper;
use crate::contact::Vec3;

impl MoreauStepper {
    /// Adds the solver work of all islands to the record. Adds the results and problems of an island
    /// only if at least one of its blocks is used, see [`Interval::is_used`].
    pub(super) fn count_islands(
        &mut self,
        record: &mut StepRecord,
        clusters: &mut [Cluster],
        in_cluster: &[bool],
    ) {
        let (interval, solution) = (&self.interval, &mut self.solution);
        let mut problems = solution.problems.drain(..);
        for (k, outcome) in solution.outcomes.iter().enumerate() {
            outcome.count_work(record);
            let blocks = solution.islands.blocks(k);
            let used = |i: &u32| interval.is_used(*i as usize, in_cluster);
            let counts = blocks.iter().any(used);
            if counts {
                outcome.count(blocks.len(), record);
            }
            if let Some(problem) = problems.next()
                && counts
            {
                self.problems.push(problem);
            }
        }
        if self.solver.store_problems {
            let located = clusters.iter_mut().map(|c| &mut c.problems);
            located.for_each(|own| self.problems.append(own));
        }
    }

    /// Takes back the energy that constraints gave beyond their reserves.
    pub(super) fn pay_debts(
        &mut self,
        model: &dyn MultibodyModel,
        record: &mut StepRecord,
        clusters: &[Cluster],
        in_cluster: &[bool],
    ) {
        let debtors = Debtors {
            model,
            interval: &self.interval,
            inverse_mass: &self.inverse_mass,
            pays: true,
        };
        let (interval, none) = (&self.interval, !in_cluster.contains(&true));
        let used = |i| none || interval.is_used(i, in_cluster);
        let reserves = &mut self.reserves_next;
        debtors.settle(&mut self.solution, used, reserves, record);
        for cluster in clusters {
            for (&body, reserve) in cluster.bodies.iter().zip(&cluster.reserves) {
                reserves[body as usize] = *reserve;
            }
        }
    }

    /// Records contacts and energies: from the clusters for the bodies `in_cluster`, from the
    /// interval for all others.
    pub(super) fn record(
        &mut self,
        model: &dyn MultibodyModel,
        record: &mut StepRecord,
        clusters: &[Cluster],
        in_cluster: &[bool],
    ) {
        let (interval, solution) = (&self.interval, &mut self.solution);
        let (w, next) = (self.inverse_mass.as_slice(), &mut self.contacts_next);
        next.clear();
        let used = |i: usize| interval.is_used(i, in_cluster);
        let (blocks, mean) = (
            0..interval.blocks.len(),
            working_velocities(interval, solution, w),
        );
        record.contacts.reserve(interval.blocks.len());
        let blocks = blocks.filter(|i| used(*i));
        record_interval(interval, solution, blocks, &mean, record.time, record, next);
        record.energy.forces += forces_work(interval, solution, w, |body| !in_cluster[body]);
        let landings = &mut self.landings_next;
        landings.clear();
        let impacts = &mut record.impacts;
        let (time, both) = (
            record.time,
            (self.cache.landings.as_slice(), &mut *landings),
        );
        find_impacts(interval, solution, used, w, time, impacts, both);
        let inside = |b: &u32| in_cluster.get(*b as usize).is_some_and(|c| *c);
        let joints = &interval.detection.joints;
        let outside = |k: &usize| !joints[*k].rows.bodies.iter().any(inside);
        solution.unclosed.retain(outside);
        for cluster in clusters {
            record.add(&cluster.record);
            landings.extend_from_slice(&cluster.landings);
            solution.unclosed.extend_from_slice(&cluster.unclosed);
            next.extend(cluster.contacts.entries().iter().copied());
            for (&body, u) in cluster.bodies.iter().zip(&cluster.end) {
                solution.end[body as usize] = *u;
            }
        }
        solution.unclosed.sort_unstable();
        finish_landings(
            &self.cache.landings,
            &record.contacts,
            &mut record.impacts,
            w,
        );
        record.impacts.sort_by(|a, b| a.time.total_cmp(&b.time));
        record.energy.kinetic_end = kinetic(&solution.end, w);
        for link in &self.stiff {
            record.energy.kinetic_end += link.correction(&solution.end);
            record.energy.joints += link.added_work(&solution.end);
        }
        let end = &self.solution.end;
        let own = [self.true_start().as_ref(), end].map(|u| model.kinetic_energy(u));
        if let [Some(start), Some(end)] = own {
            let energy = &mut record.energy;
            let change = energy.kinetic_end - energy.kinetic_start;
            energy.forces += end - start - change;
            (energy.kinetic_start, energy.kinetic_end) = (start, end);
        }
        self.solver.clock.lap(|t| &mut t.record);
    }

    /// Writes velocities and poses at the end of the step to the model.
    pub(super) fn write(
        &self,
        model: &mut dyn MultibodyModel,
        clusters: &[Cluster],
        in_cluster: &[bool],
        dt: f64,
    ) {
        let end = &self.solution.end;
        model.set_velocities(end);
        for body in (0..in_cluster.len()).filter(|&body| !in_cluster[body]) {
            model.shift(body, &end[body], 0.5 * dt);
        }
        for cluster in clusters {
            for (&body, place) in cluster.bodies.iter().zip(&cluster.configuration) {
                model.set_configuration(body as usize, place);
            }
        }
    }

    /// Mean velocities of all bodies from the midpoint of the step, where contacts are detected, to the
    /// next one. `None` if these are the velocities at the end: no body is in a cluster.
    pub(super) fn path(&self, clusters: &[Cluster], dt: f64) -> Option<Vec<Vec3>> {
        if clusters.is_empty() {
            return None;
        }
        let (start, mut path) = (&self.interval.start, self.solution.end.clone());
        for cluster in clusters {
            for (&body, way) in cluster.bodies.iter().zip(&cluster.displacement) {
                let body = body as usize;
                path[body] = way / dt + 0.5 * (path[body] - start[body]);
            }
        }
        Some(path)
    }

    /// Closes gaps of joints and moves overlapped pairs apart. Both change positions alone. Returns
    /// the potential energy \[J\] before, if any body may have moved.
    pub(super) fn close_gaps(
        &mut self,
        model: &mut dyn MultibodyModel,
        record: &mut StepRecord,
        mut overlaps: Option<Overlaps>,
        in_cluster: Vec<bool>,
        path: Option<&[Vec3]>,
    ) -> Result<Option<f64>, StepError> {
        let (interval, solution) = (&self.interval, &self.solution);
        // positions are corrected with the true masses
        let own = (!self.stiff.is_empty()).then(|| model.inverse_mass().to_vec());
        let w = own.as_ref().unwrap_or(&self.inverse_mass);
        let unclosed = !solution.unclosed.is_empty();
        let excess = match self.settings.rules().corrects_gaps() {
            true => excess_gaps(interval, solution, &in_cluster),
            false => Vec::new(),
        };
        let mut struck = Vec::new();
        if !record.waypoints.is_empty() {
            struck.resize(w.len(), false);
            let bodies = record.waypoints.iter().map(|w| w.body as usize);
            bodies.for_each(|body| struck[body] = true);
        }
        let ends = match &overlaps {
            Some(_) => Ends::find(model, interval, solution, &in_cluster, path)?,
            None => Ends::default(),
        };
        let exempt = exempt_bodies(&ends, interval, solution);
        if let Some(overlaps) = &mut overlaps {
            let skipped = (&exempt[..], &struck[..]);
            let at_end = |pairs: &[[u32; 2]]| {
                let mut found = Detection::default();
                let seen = model.detect_pairs(pairs, interval.length, &mut found);
                seen.map(|()| found)
            };
            find_late(overlaps, interval, solution, &ends, w, skipped, at_end)?;
        }
        let crowd = match overlaps {
            Some(_) => crowd_bodies(w.len(), interval, solution),
            None => Vec::new(),
        };
        let moves = !crowd.is_empty()
            || unclosed
            || !excess.is_empty()
            || overlaps.as_ref().is_some_and(|o| !o.is_empty());
        let potential = moves.then(|| model.potential_energy());
        if unclosed {
            let closed = close_joints(model, interval, solution, path, w, &mut self.solver)?;
            keep_momenta(model, &closed, w, &mut self.solution.end, record);
        }
        if !excess.is_empty() {
            let (interval, solution) = (&self.interval, &self.solution);
            let solver = &mut self.solver;
            let closed = take_up_excess(model, interval, solution, path, &excess, w, solver)?;
            keep_momenta(model, &closed, w, &mut self.solution.end, record);
        }
        self.parted.clear();
        if let Some(mut overlaps) = overlaps {
            let (solver, solution) = (&mut self.solver, &self.solution);
            let skipped = (&exempt[..], &crowd[..]);
            let mut parted =
                part_overlaps(&mut overlaps, interval, solution, &ends, w, skipped, solver);
            if !crowd.is_empty() {
                parted.extend(part_crowd(
                    &crowd,
                    &overlaps.open,
                    interval,
                    solution,
                    path,
                    w,
                    &mut solver.worker.crowd,
                ));
            }
            self.parted = parted;
            record.recovering = overlaps.open.len();
            self.cache.overlaps = overlaps;
            for (body, d) in &self.parted {
                model.shift(*body as usize, d, 1.0);
            }
        }
        Ok(potential)
    }
}

impl MoreauStepper {
    /// What the step shows of bodies with open joints: see [`Shows`](super::shown::Shows).
    pub(super) fn shown(
        &mut self,
        model: &mut dyn MultibodyModel,
        path: Option<&[Vec3]>,
    ) -> Result<Vec<Shown>, StepError> {
        let (interval, solution) = (&self.interval, &self.solution);
        if !self.settings.rules().corrects_gaps() || interval.detection.joints.is_empty() {
            return Ok(Vec::new());
        }
        // positions are corrected with the true masses
        let own = (!self.stiff.is_empty()).then(|| model.inverse_mass().to_vec());
        let w = own.as_ref().unwrap_or(&self.inverse_mass);
        Ok(self.shows.find(model, interval, solution, path, w)?)
    }
}

/// Restores the angular momentum that a displacement of bodies changed, see
/// [`restore_angular_momentum`].
fn keep_momenta(
    model: &mut dyn MultibodyModel,
    closed: &Closed,
    inverse_mass: &[Vec3],
    end: &mut [Vec3],
    record: &mut StepRecord,
) {
    let change = restore_angular_momentum(model, closed, inverse_mass, end);
    record.energy.kinetic_end += change;
    record.energy.joints += change;
    model.set_velocities(end);
}
