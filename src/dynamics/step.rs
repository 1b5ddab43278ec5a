//! One step: detects contacts, sets up and solves an interval, records the result and writes it to
//! the model.

use super::at_rest::Solved;
use super::cluster::{Cluster, Context, locate_impacts};
use super::contact_cache::{Overlaps, PulledLink};
use super::cut_links::{CutLink, links_to_cut, parts_suffice};
use super::deep_impacts::deep_impacts;
use super::events::{detect_at, find_crowds, find_plain, lands, release_lone, see_from_the_start};
use super::farther;
use super::first_step::cache_touching;
use super::gap_resolution::widen_gap_noise;
use super::interval::Interval;
use super::joint_recovery::close_rounded;
use super::kinetic::kinetic;
use super::late_rebounds::late_rebounds;
use super::model::{Detection, ModelError, MultibodyModel, NearWanted};
use super::overlapping::find_overlaps;
use super::pulled_links::{find_links, stiffen};
use super::record::StepRecord;
use super::resting::Begin;
use super::roles::BodyRoles;
use super::rules::{Rules, Span};
use super::settings::{StepError, check_finite};
use super::stepper::MoreauStepper;
use super::turned_impacts::turned_impacts;
use crate::contact::Vec3;
use std::borrow::Cow;

/// A step after [`MoreauStepper::begin`]: the bodies are at its midpoint, contacts are detected,
/// nothing is solved.
pub(crate) struct BegunStep {
    rules: Rules,
    /// That of the whole step once it is finished.
    pub record: StepRecord,
}

/// What a step has besides its solution.
struct SolvedStep {
    /// The pairs to move apart after it.
    overlaps: Option<Overlaps>,
    /// Links under tension, each with its body.
    links: Vec<(usize, PulledLink)>,
    /// Bodies that were stepped by themselves.
    clusters: Vec<Cluster>,
}

impl MoreauStepper {
    /// Advances `model` by `dt` \[s\].
    ///
    /// # Errors
    /// [`StepError::Dt`], [`StepError::NonFinite`], [`StepError::Model`]. The model is then
    /// unchanged, including its velocities; but gaps of pins that are round-off may be closed.
    pub fn step(
        &mut self,
        model: &mut dyn MultibodyModel,
        dt: f64,
    ) -> Result<StepRecord, StepError> {
        let mut begun = self.begin(model, dt)?;
        self.finish(model, &mut begun)?;
        Ok(begun.record)
    }

    /// The first part of a step: moves the bodies to its midpoint and detects the contacts there.
    /// [`MoreauStepper::finish`] or [`MoreauStepper::cancel`] must follow.
    ///
    /// # Errors
    /// As [`MoreauStepper::step`].
    pub(crate) fn begin(
        &mut self,
        model: &mut dyn MultibodyModel,
        dt: f64,
    ) -> Result<BegunStep, StepError> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(StepError::Dt(dt));
        }
        self.solver.clock.start();
        model.begin_step(dt)?;
        self.solver.cache.begin();
        self.problems.clear();
        let interval = &mut self.interval;
        interval.start.clear();
        interval.start.extend_from_slice(model.velocities());
        check_finite(&interval.start, self.time)?;
        match model.roles() {
            Some(roles) => interval.roles.clone_from(roles),
            None => interval.roles = BodyRoles::default(),
        }
        interval.reserves.clone_from(&self.cache.reserves);
        self.inverse_mass.clear();
        self.inverse_mass.extend_from_slice(model.inverse_mass());
        if self.time == 0.0 && self.settings.rules().corrects_gaps() {
            close_rounded(model, dt, &self.inverse_mass, &mut self.solver)?;
        }
        self.origin.clear();
        let bodies = 0..interval.start.len();
        self.origin
            .extend(bodies.map(|body| model.configuration(body)));
        let mut rules = self.settings.rules();
        // event location already follows all fast bodies: sweeps then matter only for bodies that
        // are swept against all others
        let sweeps = &interval.roles.sweeps;
        let against_all = sweeps.iter().any(|s| s.all);
        rules.sweeps =
            rules.corrects_gaps() && (against_all || !rules.events && !sweeps.is_empty());
        let mut record = StepRecord {
            time: self.time + dt,
            dt,
            accounted: true,
            ..StepRecord::default()
        };
        record.energy.potential_start = model.potential_energy();
        record.energy.kinetic_start = kinetic(&interval.start, &self.inverse_mass);
        interval.detection.moved.clear();
        self.begin_rest(model, dt);
        if let Err(error) = self.look(model, &rules, dt) {
            self.cancel(model);
            return Err(error.into());
        }
        Ok(BegunStep { rules, record })
    }

    /// Moves the bodies to the midpoint and detects the contacts there.
    pub(super) fn look(
        &mut self,
        model: &mut dyn MultibodyModel,
        rules: &Rules,
        dt: f64,
    ) -> Result<(), ModelError> {
        model.advance(0.5 * dt);
        // contacts that close together must be detected one step earlier: see `find_crowds`
        let ahead = if rules.events && self.cache.lands {
            2.0 * dt
        } else {
            dt
        };
        self.stiff.clear();
        self.interval.detection.wants_near = match rules.events {
            true => NearWanted::All,
            false if rules.corrects_gaps() => NearWanted::Rebounding,
            false => NearWanted::None,
        };
        self.detect(model, ahead)?;
        let interval = &mut self.interval;
        let links = &self.cache.links;
        let in_parts = parts_suffice(links, dt);
        self.stiff = stiffen(links, in_parts, interval, &mut self.inverse_mass, dt);
        Ok(())
    }

    /// Finds which islands rest in this step, and makes their bodies immovable.
    fn begin_rest(&mut self, model: &mut dyn MultibodyModel, dt: f64) {
        if !self.settings.keep_rest {
            // a state from a stepper that keeps islands at rest goes on with their impulses
            self.resting.end_all(&mut self.cache, 0);
            self.resting.clear();
            model.set_resting(&[]);
            return;
        }
        let at = Begin {
            start: &self.interval.start,
            inverse_mass: &self.inverse_mass,
            origin: &self.origin,
            dominance: !self.interval.roles.dominance.is_empty(),
            time: self.time + 0.5 * dt,
            dt,
        };
        self.resting.begin(model, at, &mut self.cache);
        self.set_resting(model);
    }

    fn set_resting(&mut self, model: &mut dyn MultibodyModel) {
        let resting = self.resting.flags();
        for (w, _) in (self.inverse_mass.iter_mut().zip(&resting)).filter(|(_, rests)| **rests) {
            *w = Vec3::zeros();
        }
        model.set_resting(&resting);
    }

    /// Detects all contacts that may close within `ahead` \[s\]: once more if they end the rest of
    /// an island.
    fn detect(&mut self, model: &mut dyn MultibodyModel, ahead: f64) -> Result<(), ModelError> {
        for round in 0.. {
            self.interval.detect(model, ahead)?;
            let Interval {
                detection, start, ..
            } = &self.interval;
            let (w, cache) = (&self.inverse_mass, &mut self.cache);
            if !self.resting.disturbed(detection, start, w, cache) {
                break;
            }
            // where each island would disturb the next one, none can rest
            if round > 0 {
                self.resting
                    .end_all(&mut self.cache, self.interval.start.len());
            }
            self.inverse_mass.copy_from_slice(model.inverse_mass());
            self.set_resting(model);
        }
        Ok(())
    }

    /// The detection of the step.
    pub(crate) fn detection(&self) -> &Detection {
        &self.interval.detection
    }

    /// Restores the model at the start of the step.
    pub(crate) fn cancel(&self, model: &mut dyn MultibodyModel) {
        model.set_velocities(&self.true_start());
        for (body, place) in self.origin.iter().enumerate() {
            model.set_configuration(body, place);
        }
    }

    /// Velocities at the start of the step, without those of [`stiffen`].
    pub(super) fn true_start(&self) -> Cow<'_, [Vec3]> {
        let mut start = Cow::from(&self.interval.start);
        for link in &self.stiff {
            link.restore(start.to_mut());
        }
        start
    }

    /// The rest of a step.
    ///
    /// # Errors
    /// As [`MoreauStepper::step`].
    pub(crate) fn finish(
        &mut self,
        model: &mut dyn MultibodyModel,
        BegunStep { rules, record }: &mut BegunStep,
    ) -> Result<(), StepError> {
        let result = self.take_step(model, rules, record);
        if result.is_err() {
            self.solver.cache.drop_step();
            self.cancel(model);
        }
        result
    }

    /// Sets up, solves, records and writes a step. Changes the caches only when no more error can
    /// occur.
    fn take_step(
        &mut self,
        model: &mut dyn MultibodyModel,
        rules: &Rules,
        record: &mut StepRecord,
    ) -> Result<(), StepError> {
        let dt = record.dt;
        let mut solved = self.solve_all(model, rules, record)?;
        for _ in 0..farther::ROUNDS {
            if !rules.corrects_gaps() || !self.moves_too_far(model, &solved.clusters, dt) {
                break;
            }
            self.begin_again(model, rules, &solved.clusters, record)?;
            solved = self.solve_all(model, rules, record)?;
        }
        let SolvedStep {
            overlaps,
            mut links,
            mut clusters,
        } = solved;
        for cut in clusters.iter().filter(|c| !c.links.is_empty()) {
            links.retain(|(body, _)| !cut.bodies.contains(&(*body as u32)));
        }
        let mut in_cluster = vec![false; self.inverse_mass.len()];
        for &body in clusters.iter().flat_map(|c| &c.bodies) {
            in_cluster[body as usize] = true;
        }
        self.count_islands(record, &mut clusters, &in_cluster);
        self.resting.record(record);
        if rules.keeps_account() {
            self.pay_debts(model, record, &clusters, &in_cluster);
        }
        self.record(model, record, &clusters, &in_cluster);
        self.rest(model, &in_cluster, overlaps.as_ref(), dt);
        self.write(model, &clusters, &in_cluster, dt);
        let path = self.path(&clusters, dt);
        let potential = self.close_gaps(model, record, overlaps, in_cluster, path.as_deref())?;
        let shown = self.shown(model, path.as_deref())?;
        self.cache.links = links.into_iter().map(|(_, link)| link).collect();
        let cut = clusters.iter_mut().map(|c| &mut c.links);
        cut.for_each(|links| self.cache.links.append(links));
        self.cache.links.sort_unstable_by_key(PulledLink::name);
        std::mem::swap(&mut self.cache.contacts, &mut self.contacts_next);
        std::mem::swap(&mut self.cache.landings, &mut self.landings_next);
        if rules.keeps_account() {
            std::mem::swap(&mut self.cache.reserves, &mut self.reserves_next);
        }
        self.solver.cache.commit();
        self.resting.end(model);
        model.show(&shown);
        model.end_step();
        self.solver.clock.lap(|t| &mut t.write);
        record.energy.potential_end = model.potential_energy();
        if let Some(before) = potential {
            record.energy.recovery = record.energy.potential_end - before;
        }
        self.solver.clock.lap(|t| &mut t.record);
        self.time += dt;
        Ok(())
    }

    /// Solves the step from its detection on.
    fn solve_all(
        &mut self,
        model: &mut dyn MultibodyModel,
        rules: &Rules,
        record: &mut StepRecord,
    ) -> Result<SolvedStep, StepError> {
        let dt = record.dt;
        let overlaps = self.set_up(model, rules, dt)?;
        self.solve(rules, dt)?;
        if self.interval.first {
            self.stiffen_first(model, rules, record)?;
        }
        self.solve_driven(model, rules, record)?;
        if self.interval.first {
            self.solve_again(model, rules, record)?;
        }
        let (links, cuts) = self.cut_links(model, rules, dt);
        let mut late = Vec::new();
        if !rules.events && rules.corrects_gaps() {
            let (interval, solution, w) = (&self.interval, &self.solution, &self.inverse_mass);
            late = late_rebounds(model, interval, solution, w);
            late.extend(deep_impacts(model, interval, solution, w));
            late.extend(turned_impacts(model, interval, solution, w, &self.origin)?);
        }
        let clusters = self.locate(model, rules, &cuts, &late, record)?;
        Ok(SolvedStep {
            overlaps,
            links,
            clusters,
        })
    }

    /// Sets up the interval of the step. Returns the pairs to move apart after it.
    fn set_up(
        &mut self,
        model: &mut dyn MultibodyModel,
        rules: &Rules,
        dt: f64,
    ) -> Result<Option<Overlaps>, StepError> {
        let (interval, w) = (&mut self.interval, self.inverse_mass.as_slice());
        self.cache.lands |= rules.events && interval.detection.contacts.iter().any(lands);
        interval.apply_forces(model, w, self.time + 0.5 * dt);
        if rules.locates() {
            let place = |body: u32| Some(self.origin[body as usize]);
            see_from_the_start(model, interval, &self.cache.contacts, rules, place, dt, dt)?;
        }
        self.solver.clock.lap(|t| &mut t.detection);
        interval.free_velocities(w, dt);
        widen_gap_noise(interval, self.solver.tolerance, dt);
        interval.first = self.time == 0.0 && rules.corrects_gaps();
        interval.ahead.clear();
        interval.crowded.clear();
        interval.plain.clear();
        if interval.first {
            cache_touching(model, interval, &self.origin, &mut self.cache.contacts, dt)?;
        }
        if rules.locates() {
            find_crowds(interval, w);
        }
        if !rules.events && rules.sweeps {
            find_plain(interval, w, dt);
        }
        let (cache, span) = (&self.cache.contacts, Span::whole(dt));
        interval.collect(rules, cache, None, w, span, &self.threads);
        let overlaps = match self.settings.recovers() {
            true => {
                let (known, origin) = (&self.cache.overlaps, &self.origin);
                let at_start = |pairs: &[[u32; 2]], bodies| {
                    detect_at(model, pairs, bodies, |b| Some(origin[b as usize]), dt)
                };
                Some(find_overlaps(known, interval, w, rules.events, at_start)?)
            }
            false => None,
        };
        match &overlaps {
            Some(overlaps) => interval.known_overlaps.clone_from(&overlaps.open),
            None => interval.known_overlaps.clear(),
        }
        Ok(overlaps)
    }

    /// Solves the interval of the step.
    pub(super) fn solve(&mut self, rules: &Rules, dt: f64) -> Result<(), StepError> {
        let (interval, solution) = (&self.interval, &mut self.solution);
        let w = self.inverse_mass.as_slice();
        self.solver.solve(interval, solution, w, rules);
        if rules.locates() {
            release_lone(interval, solution, rules, w, dt);
        }
        solution.end_velocities(interval, w);
        check_finite(&solution.end, self.time)
    }

    /// Links under tension for the next step, and those because of which their islands are stepped in
    /// parts, with the true inertia.
    fn cut_links(
        &mut self,
        model: &dyn MultibodyModel,
        rules: &Rules,
        dt: f64,
    ) -> (Vec<(usize, PulledLink)>, Vec<CutLink>) {
        let (interval, solution, w) = (&self.interval, &self.solution, model.inverse_mass());
        let mut links = find_links(&self.stiff, interval, solution, w, dt);
        let start = self.true_start();
        let in_parts = parts_suffice(&self.cache.links, dt);
        // Moreau's own scheme closes no gaps, so that parts would not close them either
        let cuts = match rules.corrects_gaps() {
            true => links_to_cut(&links, interval, solution, (&start, w), in_parts),
            false => Vec::new(),
        };
        if !cuts.is_empty() {
            let is_cut = |body: usize| cuts.iter().any(|c| c.link.body == body);
            for link in self.stiff.iter().filter(|link| is_cut(link.body)) {
                link.restore(&mut self.interval.start);
                self.inverse_mass[link.body] = w[link.body];
            }
            self.stiff.retain(|link| !is_cut(link.body));
            links.retain(|(body, _)| !is_cut(*body));
        }
        (links, cuts)
    }

    /// Steps the clusters of bodies that collide within the step, `late` ones among them, or that `cuts`
    /// step in parts.
    fn locate(
        &mut self,
        model: &mut dyn MultibodyModel,
        rules: &Rules,
        cuts: &[CutLink],
        late: &[[u32; 2]],
        record: &mut StepRecord,
    ) -> Result<Vec<Cluster>, StepError> {
        // small clusters may be stepped with events
        if !(rules.locates() || late.is_empty()) {
            find_crowds(&mut self.interval, &self.inverse_mass);
        }
        let clusters = if rules.locates() || !cuts.is_empty() || !late.is_empty() {
            let context = Context {
                main: &self.interval,
                trial: &self.solution,
                cache: &self.cache.contacts,
                cuts,
                late,
                anew: false,
                parts: 1.0,
                rules: *rules,
                inverse_mass: &self.inverse_mass,
                origin: &self.origin,
                time: self.time,
                dt: record.dt,
            };
            locate_impacts(model, &mut self.solver, &context, record)?
        } else {
            Vec::new()
        };
        self.solver.clock.lap(|t| &mut t.solve);
        Ok(clusters)
    }

    /// Puts the solved islands that are at rest to rest exactly, once the step is recorded as it was
    /// solved.
    fn rest(
        &mut self,
        model: &dyn MultibodyModel,
        in_cluster: &[bool],
        overlaps: Option<&Overlaps>,
        dt: f64,
    ) {
        if !self.settings.keep_rest {
            return;
        }
        let step = Solved {
            interval: &self.interval,
            inverse_mass: &self.inverse_mass,
            in_cluster,
            overlaps,
            problems: &self.problems,
        };
        let resting: Vec<_> = self.resting.problems().collect();
        self.resting.add(model, step, &mut self.solution, dt);
        self.problems.extend(resting);
    }
}
