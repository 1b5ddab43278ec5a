//! Which clusters run into bodies outside them.

use super::context::{Cluster, Context};
use super::watched::is_crowded;
use crate::contact::{NO_BODY, Vec3};
use crate::dynamics::events::{detect_at, touch_tolerance};
use crate::dynamics::interval::movable;
use crate::dynamics::model::{
    Configuration, ContactPoint, ModelError, MultibodyModel, NearPair, NormalLaw,
};
use rustc_hash::FxHashSet;

/// Least share of an interval by which the search for a meeting advances.
const STRIDE: f64 = 1.0 / 64.0;

/// Way of two bodies along each other, as a share of the smaller one's radius, from which on the normals of the
/// midpoint do not tell whether they meet.
const FAR: f64 = 0.25;

/// Where all bodies are on their ways through a step.
struct Paths<'a> {
    done: &'a [Cluster],
    context: &'a Context<'a>,
    /// For each body the number of its cluster, or [`NO_BODY`].
    owner: Vec<u32>,
}

/// Pairs of bodies, not of one cluster, that are in each other's way.
pub(super) fn meetings(
    model: &mut dyn MultibodyModel,
    done: &[Cluster],
    context: &Context,
) -> Result<Vec<[u32; 2]>, ModelError> {
    let paths = Paths::of(done, context);
    let mut met = paths.collisions();
    let main = context.main;
    let known: FxHashSet<[u32; 2]> = main.detection.contacts.iter().map(|c| c.surfaces).collect();
    for near in &main.detection.near {
        let bodies = movable(near.bodies, context.inverse_mass);
        // without events the pairs are near those that rebound late
        if paths.may_part(bodies)
            && bodies.iter().any(|b| paths.is_located(*b))
            && !is_crowded(main, near)
            && paths.meet(model, near, bodies, known.contains(&near.surfaces))?
        {
            met.push(bodies);
        }
    }
    Ok(met)
}

impl<'a> Paths<'a> {
    fn of(done: &'a [Cluster], context: &'a Context) -> Paths<'a> {
        let mut owner = vec![NO_BODY; context.main.start.len()];
        for (k, cluster) in done.iter().enumerate() {
            for &body in &cluster.bodies {
                owner[body as usize] = k as u32;
            }
        }
        Paths {
            done,
            context,
            owner,
        }
    }

    fn cluster(&self, body: u32) -> Option<&'a Cluster> {
        self.done.get(self.owner[body as usize] as usize)
    }

    fn is_located(&self, body: u32) -> bool {
        self.cluster(body).is_some_and(Cluster::is_bent)
    }

    /// Whether two movable bodies are not of one cluster.
    fn may_part(&self, [a, b]: [u32; 2]) -> bool {
        a != NO_BODY && b != NO_BODY && self.owner[a as usize] != self.owner[b as usize]
    }

    /// The times \[s\] from the start of the step at which intervals around located impacts of two bodies end,
    /// ascending.
    fn ends(&self, bodies: [u32; 2]) -> Vec<f64> {
        let clusters = bodies.iter().filter_map(|b| self.cluster(*b));
        let clusters = clusters.filter(|cluster| cluster.is_bent());
        let mut ends: Vec<f64> = clusters
            .flat_map(|c| &c.path)
            .map(|(end, _)| *end)
            .collect();
        ends.push(self.context.dt);
        ends.sort_unstable_by(f64::total_cmp);
        ends.dedup();
        ends
    }

    /// Displacement of a body since the start of the step, at a time \[s\] from it.
    fn moved(&self, body: u32, time: f64) -> Vec3 {
        let (k, dt) = (body as usize, self.context.dt);
        let Some(cluster) = self.cluster(body) else {
            let (start, end) = (self.context.main.start[k], self.context.trial.end[k]);
            return time * (start + 0.5 * time / dt * (end - start));
        };
        let own = cluster.bodies.partition_point(|b| *b < body);
        let next = cluster.path.partition_point(|(end, _)| *end < time);
        let at = |k: usize| cluster.path.get(k).map(|(end, moved)| (*end, moved[own]));
        let (before, from) = next.checked_sub(1).and_then(at).unwrap_or_default();
        match at(next) {
            Some((after, to)) if after > before => {
                from + (time - before) / (after - before) * (to - from)
            }
            _ => from,
        }
    }

    /// Contacts whose bodies overlap at the end of the step, or where one of them turns back at an impact.
    fn collisions(&self) -> Vec<[u32; 2]> {
        let Context { main, dt, .. } = *self.context;
        let outside = |contact: &ContactPoint| {
            let bodies = movable(contact.rows.bodies, self.context.inverse_mass);
            if !self.may_part(bodies) {
                return None;
            }
            let start = contact.gap - 0.5 * dt * contact.rows.velocity(&main.start).x;
            let opened = |side: usize, time: f64| {
                let moved = self.moved(bodies[side], time);
                contact.rows.jacobian[side][0].dot(&moved)
            };
            let gap = |time: f64| start + opened(0, time) + opened(1, time);
            let least = start.min(0.0) - touch_tolerance(contact, main, dt);
            let rigid = matches!(contact.law, NormalLaw::Rigid { .. });
            let meets = || self.ends(bodies).into_iter().any(|time| gap(time) < least);
            (rigid && meets()).then_some(bodies)
        };
        let contacts = main.detection.contacts.iter();
        contacts.filter_map(outside).collect()
    }

    /// Whether two bodies meet on their paths. What turns back at an impact need not be in the other's way at the
    /// end. If the pair is `known` to have contacts, those tell it of straight paths.
    fn meet(
        &self,
        model: &mut dyn MultibodyModel,
        near: &NearPair,
        bodies: [u32; 2],
        known: bool,
    ) -> Result<bool, ModelError> {
        let (main, dt) = (self.context.main, self.context.dt);
        let ends = self.ends(bodies);
        let apart = |from: [Vec3; 2], to: [Vec3; 2]| {
            let [a, b] = [0, 1].map(|side| to[side] - from[side]);
            (b - a).xy().norm() + a.z.abs() * near.radii[0] + b.z.abs() * near.radii[1]
        };
        let at = |time: f64| bodies.map(|body| self.moved(body, time));
        let middle = bodies.map(|body| 0.5 * dt * main.start[body as usize]);
        let ways = ends.iter().map(|end| apart(middle, at(*end)));
        let farthest = ways.fold(0.0, f64::max);
        let short = FAR * near.radii[0].min(near.radii[1]);
        if farthest <= near.bound || known && (ends.len() == 1 || farthest <= short) {
            return Ok(false);
        }
        let overlap = |contacts: &[ContactPoint]| {
            let deep = contacts
                .iter()
                .map(|c| c.gap + touch_tolerance(c, main, dt));
            deep.fold(0.0, f64::min)
        };
        let (mut time, mut first, mut free) = (0.0, None, 0.0);
        for end in ends {
            let (from, to) = (at(time), at(end));
            let way = apart(from, to);
            let mut left = way;
            while left > free || first.is_none() {
                left = (left - free.max(STRIDE * way)).max(0.0);
                let share = match first {
                    Some(_) => 1.0 - left / way,
                    None => 0.0,
                };
                left = (1.0 - share) * way;
                let places = [0, 1].map(|side| {
                    let moved = from[side] + share * (to[side] - from[side]);
                    self.place(model, bodies[side], &moved)
                });
                let place = |body: u32| bodies.iter().position(|b| *b == body).map(|k| places[k]);
                let found = detect_at(model, &[near.surfaces], bodies.to_vec(), place, dt)?;
                let deep = overlap(&found.contacts);
                if deep < *first.get_or_insert(deep) {
                    return Ok(true);
                }
                free = found.near.first().map_or(0.0, |near| near.bound.max(0.0));
                if left == 0.0 {
                    break;
                }
            }
            free -= left;
            time = end;
        }
        Ok(false)
    }

    /// Configuration of a body that has `moved` since the start of the step.
    fn place(&self, model: &mut dyn MultibodyModel, body: u32, moved: &Vec3) -> Configuration {
        let k = body as usize;
        let here = model.configuration(k);
        model.set_configuration(k, &self.context.origin[k]);
        model.shift(k, moved, 1.0);
        let place = model.configuration(k);
        model.set_configuration(k, &here);
        place
    }
}
