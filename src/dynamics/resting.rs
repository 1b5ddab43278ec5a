//! Islands at rest, which repeat their last step.
//!
//! If nothing moves in a step, the next step poses the same contact problem. So an island whose
//! certified solution leaves its bodies at rest, as far as the solution can tell, is put to rest
//! exactly: its bodies stop where the contacts were found, at the midpoint. From then on it keeps
//! its impulses `P` from step to step, without detection and without a solve, until anything that
//! its problem depends on changes.
//!
//! [`super::at_rest`] tells which islands are at rest.
//!
//! # What ends the rest
//! - a body of the island moves, by the user's hand, or has another mass or force;
//! - a contact is detected between the island and anything that moves or may be pushed, or a joint;
//! - the step has another length, an immovable body has been displaced, or the model's
//!   [`revision`](MultibodyModel::revision) is another.
//!
//! Islands with joints, springs, moving surfaces, given loads or dominance are always solved, and so
//! are those with pairs that are moved apart.

use super::at_rest::{Solved, State, first, linked, members, state_of};
use super::contact_cache::{CachedContact, CachedContacts, ContactCache};
use super::model::{Configuration, ContactKey, Detection, MultibodyModel};
use super::outcome::SolvedProblem;
use super::record::{ContactRecord, StepRecord};
use super::recording::{record_interval, working_velocities};
use super::solution::Solution;
use crate::contact::{NO_BODY, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Most steps between two stops.
const LONGEST_PAUSE: u32 = 1 << 20;

/// An island at rest.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct RestingIsland {
    bodies: Vec<RestingBody>,
    /// Its part of every record, without the time.
    contacts: Vec<ContactRecord>,
    penetration: f64,
    redundant: bool,
    /// The relative residual of the last solve, and the bound (2) of [`super::at_rest`] \[m/s\].
    residual: [f64; 2],
    /// For the contact cache, when it is solved again.
    entries: Vec<(ContactKey, CachedContact)>,
    /// The problem solved last, if problems are stored.
    #[serde(skip)]
    problem: Option<SolvedProblem>,
}

/// A body at rest, and what its rest depends on.
#[derive(Clone, Copy, PartialEq, Serialize, Deserialize)]
struct RestingBody {
    number: u32,
    place: Configuration,
    inverse_mass: [f64; 3],
    force: [f64; 3],
}

/// All islands at rest.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct RestingIslands {
    islands: Vec<RestingIsland>,
    /// Length of their step \[s\].
    dt: f64,
    /// The model's revision; that of the next step if `None`.
    #[serde(skip)]
    revision: Option<u64>,
    /// Immovable bodies at the end of the last step.
    immovable: Vec<(u32, Configuration)>,
    /// The island of each body, from 1; 0 if it does not rest. Empty without islands.
    #[serde(skip)]
    island_of: Vec<u32>,
    /// For the first body of each island that was stopped in vain: steps until the next stop, and the
    /// pause after it.
    pauses: BTreeMap<u32, [u32; 2]>,
}

/// The state of a step before anything moves.
#[derive(Clone, Copy)]
pub(super) struct Begin<'a> {
    pub start: &'a [Vec3],
    pub inverse_mass: &'a [Vec3],
    pub origin: &'a [Configuration],
    /// Whether bodies dominate others.
    pub dominance: bool,
    /// Of the midpoint \[s\].
    pub time: f64,
    pub dt: f64,
}

impl RestingIslands {
    pub fn clear(&mut self) {
        *self = RestingIslands::default();
    }

    /// The islands for a saved state: the model that resumes it counts its revisions anew.
    pub fn saved(&self) -> RestingIslands {
        RestingIslands {
            revision: None,
            ..self.clone()
        }
    }

    /// Ends the rest of all islands among so many bodies.
    pub fn end_all(&mut self, cache: &mut ContactCache, bodies: usize) {
        self.release(cache, |_| true);
        self.number(bodies);
    }

    pub fn is_empty(&self) -> bool {
        self.islands.is_empty()
    }

    /// Whether each body rests; empty if none does.
    pub fn flags(&self) -> Vec<bool> {
        self.island_of.iter().map(|k| *k != 0).collect()
    }

    /// The contacts of all islands at rest.
    pub fn contacts(&self) -> impl Iterator<Item = &ContactRecord> {
        self.islands.iter().flat_map(|island| &island.contacts)
    }

    /// The problems of all islands at rest, if they are stored.
    pub fn problems(&self) -> impl Iterator<Item = SolvedProblem> {
        let stored = self.islands.iter().map(|island| &island.problem);
        stored.flatten().cloned()
    }

    /// Begins a step: ends the rest of islands that something changed for.
    pub fn begin(&mut self, model: &dyn MultibodyModel, at: Begin, cache: &mut ContactCache) {
        let now = model.revision();
        let same = now.is_some() && self.revision.is_none_or(|known| Some(known) == now);
        self.revision = now;
        if !self.is_empty() {
            let stays = |(body, place): &(u32, Configuration)| {
                let k = *body as usize;
                at.start.get(k).is_some_and(|u| *u != Vec3::zeros())
                    || at.origin.get(k) == Some(place)
            };
            let same =
                same && !at.dominance && self.dt == at.dt && self.immovable.iter().all(stays);
            let mut forces = vec![Vec3::zeros(); at.start.len()];
            model.forces(at.time, &mut forces);
            let rests = |body: &RestingBody| {
                let k = body.number as usize;
                at.start.get(k) == Some(&Vec3::zeros())
                    && at.origin[k] == body.place
                    && at.inverse_mass[k] == Vec3::from(body.inverse_mass)
                    && forces[k] == Vec3::from(body.force)
            };
            self.release(cache, |island| !same || !island.bodies.iter().all(rests));
        }
        self.number(at.start.len());
    }

    /// Ends the rest of islands that a contact or joint connects with something that is not at rest.
    /// Returns whether there are any: their contacts are then still to be detected.
    pub fn disturbed(
        &mut self,
        found: &Detection,
        start: &[Vec3],
        inverse_mass: &[Vec3],
        cache: &mut ContactCache,
    ) -> bool {
        if self.is_empty() {
            return false;
        }
        let mut hit = vec![false; self.islands.len() + 1];
        let island = |body: u32| self.island_of.get(body as usize).copied().unwrap_or(0);
        let moves = |body: u32| {
            let k = body as usize;
            body != NO_BODY && (inverse_mass[k] != Vec3::zeros() || start[k] != Vec3::zeros())
        };
        for contact in &found.contacts {
            let [a, b] = contact.rows.bodies;
            for (own, other) in [(a, b), (b, a)] {
                hit[island(own) as usize] |= moves(other);
            }
        }
        let joined = found.joints.iter().flat_map(|joint| joint.rows.bodies);
        joined.for_each(|body| hit[island(body) as usize] = true);
        if !hit[1..].contains(&true) {
            return false;
        }
        let mut hit = hit.into_iter().skip(1);
        self.release(cache, |_| hit.next() == Some(true));
        self.number(start.len());
        true
    }

    /// Adds all islands at rest to the record of a step.
    pub fn record(&self, record: &mut StepRecord) {
        let count = self.islands.iter().map(|island| island.contacts.len());
        record.contacts.reserve(count.sum());
        for island in &self.islands {
            let time = record.time;
            let contacts = island.contacts.iter();
            (record.contacts).extend(contacts.map(|c| ContactRecord { time, ..*c }));
            record.islands += 1;
            record.resting += 1;
            record.redundant += usize::from(island.redundant);
            record.residual = record.residual.max(island.residual[0]);
            record.residual_velocity = record.residual_velocity.max(island.residual[1]);
            record.penetration = record.penetration.max(island.penetration);
        }
    }

    /// Puts the islands of a solved step of `dt` \[s\] to rest that are at rest: sets their end
    /// velocities to zero. The model is still at the midpoint.
    pub fn add(
        &mut self,
        model: &dyn MultibodyModel,
        step: Solved,
        solution: &mut Solution,
        dt: f64,
    ) {
        let interval = step.interval;
        if model.revision().is_none() || !interval.roles.dominance.is_empty() {
            return;
        }
        let mut found = Vec::new();
        for k in 0..solution.islands.len() {
            match state_of(k, &step, solution) {
                State::Moves if self.pauses.is_empty() => {}
                State::Moves => drop(self.pauses.remove(&first(interval, solution, k))),
                state => found.push((k, state)),
            }
        }
        if found.is_empty() {
            return;
        }
        let mut island_of = vec![0; step.inverse_mass.len()];
        for (n, (k, _)) in found.iter().enumerate() {
            members(interval, solution, *k).for_each(|body| island_of[body] = n + 1);
        }
        let linked = linked(&step, &island_of, found.len());
        let mut rests = Vec::new();
        for ((k, state), linked) in found.into_iter().zip(linked) {
            let stops = !linked && self.stops(state, first(interval, solution, k));
            if let (true, State::Rests(residual)) = (stops, state) {
                rests.push((k, residual));
            }
            let bodies = members(interval, solution, k).filter(|_| stops);
            for body in bodies.collect::<Vec<_>>() {
                solution.end[body] = Vec3::zeros();
                if let Some(solved) = solution.unpaid.get_mut(body) {
                    *solved = Vec3::zeros();
                }
            }
        }
        if rests.is_empty() {
            return;
        }
        let w = step.inverse_mass;
        let mean = working_velocities(interval, solution, w);
        self.dt = dt;
        for (k, residual) in rests {
            let mut own = StepRecord::default();
            let mut entries = CachedContacts::default();
            let blocks = solution.islands.blocks(k).iter().map(|i| *i as usize);
            record_interval(
                interval,
                solution,
                blocks,
                &mean,
                0.0,
                &mut own,
                &mut entries,
            );
            let stopped = own.contacts.iter().map(|contact| ContactRecord {
                slip: 0.0,
                load_slip: 0.0,
                friction_work: 0.0,
                normal_work: 0.0,
                ..*contact
            });
            let mut numbers: Vec<usize> = members(interval, solution, k).collect();
            numbers.sort_unstable();
            numbers.dedup();
            self.islands.push(RestingIsland {
                bodies: (numbers.iter())
                    .map(|&body| RestingBody {
                        number: body as u32,
                        place: model.configuration(body),
                        inverse_mass: w[body].into(),
                        force: interval.forces[body].into(),
                    })
                    .collect(),
                contacts: stopped.collect(),
                penetration: own.penetration,
                redundant: solution.outcomes[k].redundant,
                residual,
                problem: problem_of(k, &step, solution),
                entries: entries.entries().to_vec(),
            });
        }
    }

    /// Whether an island is stopped now; `first` is the number of its first body.
    fn stops(&mut self, state: State, first: u32) -> bool {
        if let State::Rests(_) = state {
            self.pauses.remove(&first);
            return true;
        }
        let [wait, pause] = self.pauses.entry(first).or_default();
        if *wait > 0 {
            *wait -= 1;
            return false;
        }
        *pause = (2 * *pause + 1).min(LONGEST_PAUSE);
        *wait = *pause;
        true
    }

    /// Notes the places of immovable bodies at the end of a step.
    pub fn end(&mut self, model: &dyn MultibodyModel) {
        self.immovable.clear();
        if self.is_empty() {
            return;
        }
        let masses = model.inverse_mass().iter().enumerate();
        let fixed = masses.filter(|(_, w)| **w == Vec3::zeros());
        (self.immovable).extend(fixed.map(|(k, _)| (k as u32, model.configuration(k))));
    }

    /// Ends the rest of islands whose bodies have a number of `group`, and returns their cache
    /// entries with it.
    pub fn set_aside(
        &mut self,
        group: impl Fn(u32) -> u32,
    ) -> Vec<(u32, ContactKey, CachedContact)> {
        let mut aside = Vec::new();
        self.islands.retain(|island| {
            let numbers = island.bodies.iter().map(|body| group(body.number));
            let number = numbers.max().unwrap_or(0);
            if number != 0 {
                let entries = island.entries.iter();
                aside.extend(entries.map(|(key, entry)| (number, *key, *entry)));
            }
            number == 0
        });
        aside
    }

    /// Ends the rest of some islands: the cache has their entries again.
    fn release(&mut self, cache: &mut ContactCache, mut which: impl FnMut(&RestingIsland) -> bool) {
        self.islands.retain(|island| {
            let released = which(island);
            if released {
                cache.take_back(&island.entries);
            }
            !released
        });
    }

    fn number(&mut self, bodies: usize) {
        self.island_of.clear();
        if self.is_empty() {
            return;
        }
        self.island_of.resize(bodies, 0);
        for (k, island) in self.islands.iter().enumerate() {
            for body in &island.bodies {
                self.island_of[body.number as usize] = k as u32 + 1;
            }
        }
    }
}

/// The problem of an island, if problems are stored: that of islands in clusters is not.
fn problem_of(island: usize, step: &Solved, solution: &Solution) -> Option<SolvedProblem> {
    step.problems.first()?;
    let used = |k: &usize| {
        let mut blocks = solution.islands.blocks(*k).iter();
        blocks.any(|&i| step.interval.is_used(i as usize, step.in_cluster))
    };
    let before = (0..island).filter(used).count();
    step.problems.get(before).cloned()
}
