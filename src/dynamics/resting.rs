//! Islands at rest, which repeat their last step.
//!
//! If nothing moves in a step, the next step poses the same contact problem. So an island whose
//! certified solution leaves its bodies at rest, as far as the solution can tell, is put to rest
//! exactly: its bodies stop where the contacts were found, at the midpoint. From then on it keeps
//! its impulses `P` from step to step, without detection and without a solve, until anything that
//! its problem depends on changes.
//!
//! # What is at rest
//! Motion that the solution resolves is never stopped, however slow: with `F` of
//! [`Residual`](crate::contact::Residual) and `r` its velocity, an island rests if
//!
//! ```text
//! r ≤ ε v,   |u_A|_k + |u_E|_k ≤ min(1000 r + δ, ε v),   |u| = |v| + a |ω|    (1)
//! ```
//!
//! for all its bodies `k`; `v` is the velocity scale of the island, `δ` the round-off of its
//! impulses, `a` the longest arm of the body's contacts. At the top of a tower of 50 boxes the speed
//! is a thousand times the residual of its contacts. `ε` = [`REST`] bounds what can be lost: a
//! body that should start with less than `ε v` in a step may stay. The solver's tolerance does not
//! matter, only what the solve reached.
//!
//! The repeated problem has the same rows and gaps, and differs in `u_A` alone, which is zero now.
//! With friction `μ` the residual velocity of `P` in it is at most
//!
//! ```text
//! r + 4 (1 + μ) max_k (|u_A| + |u_E|)_k                                       (2)
//! ```
//!
//! which the record states. The state is the same in all later steps, bit for bit, so no error adds
//! up.
//!
//! # What ends the rest
//! - a body of the island moves, by the user's hand, or has another mass or force;
//! - a contact is detected between the island and anything that moves or may be pushed, or a joint;
//! - the step has another length, an immovable body has been displaced, or the model's
//!   [`revision`](MultibodyModel::revision) is another.
//!
//! Islands with joints, springs, moving surfaces, given loads or dominance are always solved, and so
//! are those with pairs that are moved apart.

use super::contact_cache::{CachedContact, CachedContacts, ContactCache, Overlaps};
use super::interval::{Interval, Source};
use super::model::{Configuration, ContactKey, Detection, MultibodyModel, NormalLaw};
use super::outcome::SolvedProblem;
use super::record::{ContactRecord, StepRecord};
use super::recording::{record_interval, working_velocities};
use super::solution::Solution;
use crate::contact::{NO_BODY, Vec3};
use serde::{Deserialize, Serialize};

/// Largest speed of a body at rest, as a share of the velocity scale of its island: see (1). What can be lost is
/// an acceleration of 1e-9 m/s² under gravity, 5 nm in the first three seconds; less, and large
/// islands, which are solved to some 1e-11, never rest.
const REST: f64 = 1e-10;
/// Largest speed of a body that a residual of the contacts of its island explains, see (1).
const SPREAD: f64 = 1e3;

/// An island at rest.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct RestingIsland {
    bodies: Vec<RestingBody>,
    /// Its part of every record, without the time.
    contacts: Vec<ContactRecord>,
    penetration: f64,
    redundant: bool,
    /// The relative residual of the last solve, and the bound (2) \[m/s\].
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
    /// The island of each body, from 1; 0 if it does not rest.
    #[serde(skip)]
    island_of: Vec<u32>,
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

/// A solved step before it is recorded.
#[derive(Clone, Copy)]
pub(super) struct Solved<'a> {
    pub interval: &'a Interval,
    pub inverse_mass: &'a [Vec3],
    pub in_cluster: &'a [bool],
    /// Pairs that are moved apart.
    pub overlaps: Option<&'a Overlaps>,
    /// Of the islands that are used, in their order; empty if they are not stored.
    pub problems: &'a [SolvedProblem],
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

    /// Whether each body rests.
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
    pub fn begin<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &M,
        at: Begin,
        cache: &mut ContactCache,
    ) {
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
    pub fn add<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &M,
        step: Solved,
        solution: &mut Solution,
        dt: f64,
    ) {
        let interval = step.interval;
        if model.revision().is_none() || !interval.roles.dominance.is_empty() {
            return;
        }
        let mut found: Vec<(usize, [f64; 2])> = (0..solution.islands.len())
            .filter_map(|k| Some((k, rest_of(k, &step, solution)?)))
            .collect();
        if found.is_empty() {
            return;
        }
        let mut island_of = vec![0; step.inverse_mass.len()];
        for (n, (k, _)) in found.iter().enumerate() {
            members(interval, solution, *k).for_each(|body| island_of[body] = n + 1);
        }
        let linked = linked(&step, &island_of, found.len());
        let mut linked = linked.iter();
        found.retain(|_| linked.next() == Some(&false));
        for (k, _) in &found {
            let bodies: Vec<usize> = members(interval, solution, *k).collect();
            bodies
                .iter()
                .for_each(|&body| solution.end[body] = Vec3::zeros());
        }
        let w = step.inverse_mass;
        let mean = working_velocities(interval, solution, w);
        self.dt = dt;
        for (k, residual) in found {
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

    /// Notes the places of immovable bodies at the end of a step.
    pub fn end<M: MultibodyModel + ?Sized>(&mut self, model: &M) {
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
        self.island_of.resize(bodies, 0);
        for (k, island) in self.islands.iter().enumerate() {
            for body in &island.bodies {
                self.island_of[body.number as usize] = k as u32 + 1;
            }
        }
    }
}

/// The movable bodies of an island, once for each of their contacts.
fn members<'a>(
    interval: &'a Interval,
    solution: &'a Solution,
    island: usize,
) -> impl Iterator<Item = usize> + 'a {
    let blocks = solution.islands.blocks(island).iter();
    let sides = blocks.flat_map(|&i| interval.sides[i as usize]);
    sides
        .filter(|body| *body != NO_BODY)
        .map(|body| body as usize)
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

/// The relative residual of an island and the bound (2) \[m/s\], if it is at rest by itself.
fn rest_of(island: usize, step: &Solved, solution: &Solution) -> Option<[f64; 2]> {
    let (interval, outcome) = (step.interval, &solution.outcomes[island]);
    let residual = &outcome.report.residual;
    let most = REST * residual.velocity_scale;
    let room = (SPREAD * residual.velocity + residual.round_off).min(most);
    let plain = outcome.report.solved()
        && !(outcome.relaxed || outcome.contacts_bounded || outcome.joints_bounded);
    if !(plain && residual.velocity <= most && room > 0.0) {
        return None;
    }
    let mut roughest: f64 = 0.0;
    let mut fastest: f64 = 0.0;
    for &i in solution.islands.blocks(island) {
        let (i, block) = (i as usize, &interval.blocks[i as usize]);
        let Source::Contact(index) = block.source else {
            return None;
        };
        let contact = &interval.detection.contacts[index];
        let rigid = matches!(contact.law, NormalLaw::Rigid { .. });
        let pair = &contact.key.pair;
        let apart = |o: &Overlaps| o.open.contains(pair) || o.late.contains(pair);
        let moved = step.overlaps.is_some_and(apart);
        if !rigid || contact.surface_velocity != 0.0 || block.impact || moved {
            return None;
        }
        roughest = roughest.max(contact.friction);
        for (side, &body) in contact.rows.bodies.iter().enumerate() {
            if body == NO_BODY {
                continue;
            }
            let k = body as usize;
            let [n, t] = contact.rows.jacobian[side];
            let arm = n.z.hypot(t.z);
            let of = |u: &Vec3| u.xy().norm() + arm * u.z.abs();
            if interval.sides[i][side] != NO_BODY {
                fastest = fastest.max(of(&interval.start[k]) + of(&solution.end[k]));
            } else if interval.start[k] != Vec3::zeros() {
                return None;
            }
            if fastest > room || step.in_cluster[k] {
                return None;
            }
        }
        if solution.deferred.contains(&index) {
            return None;
        }
    }
    let bound = residual.velocity + 2.0 * fastest;
    Some([
        residual.relative.max(bound / residual.velocity_scale),
        bound,
    ])
}

/// Which of the islands, by `island_of` each body from 1, a contact that is no block of theirs or a
/// joint connects with something that moves or may be pushed.
fn linked(step: &Solved, island_of: &[usize], islands: usize) -> Vec<bool> {
    let mut linked = vec![false; islands + 1];
    let (found, start) = (&step.interval.detection, &step.interval.start);
    let island = |body: u32| island_of.get(body as usize).copied().unwrap_or(0);
    let moves = |body: u32| {
        let k = body as usize;
        body != NO_BODY && (step.inverse_mass[k] != Vec3::zeros() || start[k] != Vec3::zeros())
    };
    for contact in &found.contacts {
        let [a, b] = contact.rows.bodies;
        for (own, other) in [(a, b), (b, a)] {
            linked[island(own)] |= moves(other) && island(own) != island(other);
        }
    }
    let joined = found.joints.iter().flat_map(|joint| joint.rows.bodies);
    joined.for_each(|body| linked[island(body)] = true);
    linked.split_off(1)
}
