//! An impact of no duration, where a cluster stands.

use super::runner::{Context, Rest, Runner};
use crate::dynamics::contact_cache::{CachedContact, CachedContacts};
use crate::dynamics::events::touch_tolerance;
use crate::dynamics::interval::belongs;
use crate::dynamics::model::{ContactKey, ContactPoint, NormalLaw};
use crate::dynamics::recording::record_interval;
use crate::dynamics::rules::{applied_acceleration, rest_velocity};
use crate::dynamics::solve::IslandSolver;

impl Runner {
    /// An impact disturbs what stuck: the correction of its drift would see a jump.
    pub(super) fn forget_sticking(&mut self, context: &Context) {
        let mut memory = self.remembered.take().unwrap_or_else(|| {
            let found = &self.instant.detection;
            let keys = found.contacts.iter().map(|c| c.key);
            keys.chain(found.joints.iter().map(|j| j.key))
                .filter_map(|key| Some((key, *context.cache.get(&key)?)))
                .collect()
        });
        memory.iter_mut().for_each(|m| m.stuck = None);
        self.remembered = Some(memory);
    }

    /// Impact without duration at the present configuration; whether it was a lone one.
    ///
    /// Two bodies that touch nothing else are followed from bounce to bounce until all that are
    /// left fit into the rest of the step: with closing velocity `v` and relative acceleration
    /// `a` they take `2 e v / (a (1 − e))`, and together give the impulse of a landing without
    /// rebound and of the rest that follows it.
    pub(super) fn impact(
        &mut self,
        solver: &mut IslandSolver,
        context: &Context,
        key: ContactKey,
        rest: Rest,
        bodies: usize,
    ) -> bool {
        let w = context.inverse_mass;
        let idle = self.idle();
        let members = Some(self.members.as_slice());
        let carried = |k: &ContactKey| {
            let known = self.remembered.as_ref().and_then(|m| m.get(k));
            known.is_some_and(|m| m.impulse.x > 0.0)
        };
        let instant = &mut self.instant;
        let contacts = &instant.detection.contacts;
        let touching: Vec<bool> = contacts
            .iter()
            .map(|c| {
                let near = c.gap <= touch_tolerance(c, instant, context.dt);
                c.key == key || near || carried(&c.key)
            })
            .collect();
        let mut joints = instant.detection.joints.iter();
        let lone = idle
            && bodies <= 2
            && touching.iter().filter(|t| **t).count() == 1
            && !joints.any(|j| belongs(j.rows.bodies, members, w));
        let acceleration = |c: &ContactPoint| -c.rows.velocity(&instant.accelerations).x;
        let slow = |c: &ContactPoint, e: f64, v: f64| {
            if lone {
                2.0 * e * v <= acceleration(c) * (1.0 - e) * rest.length
            } else {
                let a = applied_acceleration(c, &instant.accelerations);
                e * v <= rest_velocity(a, context.dt)
            }
        };
        let mut over = rest.at;
        let in_force: Vec<f64> = contacts
            .iter()
            .map(|c| {
                let NormalLaw::Rigid { restitution: e } = c.law else {
                    return 0.0;
                };
                let v = -c.rows.velocity(&instant.start).x;
                if !slow(c, e, v) {
                    return e;
                }
                if lone && c.key == key && e > 0.0 {
                    over += 2.0 * e * v / (acceleration(c) * (1.0 - e));
                }
                0.0
            })
            .collect();
        instant.collect_impact(
            &context.rules,
            &self.members,
            w,
            |i| touching[i].then_some(in_force[i]),
            carried,
        );
        let hit = &mut self.hit;
        solver.solve(instant, hit, w, &context.rules);
        hit.end_velocities(instant, w);
        self.problems.append(&mut hit.problems);
        let record = &mut self.record;
        for outcome in &hit.outcomes {
            outcome.count_work(record);
            outcome.count(record);
        }
        let mut pressed = CachedContacts::default();
        record_interval(instant, hit, |_| true, w, over, record, &mut pressed);
        record.events += 1;
        // what landed alone stays in contact, rolls on along a curve, say; what it pressed in an
        // instant says nothing of a load
        let lands = |i: usize| lone && in_force[i] == 0.0;
        let landed = (0..in_force.len()).filter(|&i| lands(i));
        for key in landed.map(|i| instant.detection.contacts[i].key) {
            let hit = pressed.get(&key).filter(|m| m.impulse.x > 0.0);
            if let (Some(hit), Some(remembered)) = (hit, &mut self.remembered) {
                let dt = f64::INFINITY;
                remembered.insert(
                    key,
                    CachedContact {
                        dt,
                        stuck: None,
                        ..*hit
                    },
                );
            }
        }
        lone
    }
}
