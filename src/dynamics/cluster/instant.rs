//! An impact of zero duration at the current configuration of a cluster.

use super::bounce::Bounce;
use super::context::{Context, Rest};
use super::runner::Runner;
use crate::contact::{Vec2, Vec3};
use crate::dynamics::contact_cache::{CachedContact, CachedContacts, Left};
use crate::dynamics::events::touch_tolerance;
use crate::dynamics::impacts::find_impacts;
use crate::dynamics::interval::belongs;
use crate::dynamics::model::{ContactKey, ContactPoint, NormalLaw};
use crate::dynamics::recording::{record_interval, working_velocities};
use crate::dynamics::rules::{ImpactLaw, Rules, applied_acceleration, rest_velocity};
use crate::dynamics::solve::IslandSolver;

impl Runner {
    /// Whether impacts of a cluster may lose their restitution: those of a few bodies, since others are left to the
    /// plain rule; not what rebounds without loss, which comes to an end; and not under the uniform law, which is
    /// one of a single coefficient.
    pub(super) fn may_be_plastic(&self, rules: &Rules, few: bool) -> bool {
        let mut contacts = self.instant.detection.contacts.iter();
        !self.plastic
            && rules.law != ImpactLaw::Uniform
            && few
            && contacts.all(|c| c.law.restitution() < 1.0)
    }

    /// Clears the velocities of the last interval. An impact makes them jump.
    pub(super) fn forget_sticking(&mut self, context: &Context) {
        let mut contacts = self.own_contacts.take().unwrap_or_else(|| {
            let found = &self.instant.detection;
            let keys = found.contacts.iter().map(|c| c.key);
            keys.chain(found.joints.iter().map(|j| j.key))
                .filter_map(|key| Some((key, *context.cache.get(&key)?)))
                .collect()
        });
        contacts
            .iter_mut()
            .for_each(|m| (m.stuck, m.left) = (false, None));
        self.own_contacts = Some(contacts);
    }

    /// Solves an impact of zero duration at the current configuration. Returns whether it was
    /// between two bodies that touch nothing else, and whether impulses were found that solve it.
    ///
    /// Two such bodies are followed from bounce to bounce until all remaining bounces fit into the
    /// rest of the step. With closing velocity `v` and relative acceleration `a` these take
    /// `2 e v / (a (1 − e))`. Together they give the impulse of a landing without rebound and of
    /// the rest that follows it. `a` is that of the applied forces, or as the contact was accelerated
    /// since it bounced before: bodies that turn may close without any force.
    pub(super) fn impact(
        &mut self,
        solver: &mut IslandSolver,
        context: &Context,
        key: ContactKey,
        rest: Rest,
        bodies: usize,
    ) -> [bool; 2] {
        let w = context.inverse_mass;
        let participants = self.participants(context, key, rest, bodies);
        let pressed = |k: &ContactKey| pressed(self.own_contacts.as_ref(), k);
        let in_force = |i: usize| participants.in_force[i];
        let instant = &mut self.instant;
        instant.reserves.clone_from(&self.interval.reserves);
        instant.collect_impact(&context.rules, &self.members, w, in_force, pressed);
        let hit = &mut self.hit;
        solver.solve(instant, hit, w, &context.rules);
        hit.end_velocities(instant, w);
        self.problems.append(&mut hit.problems);
        let record = &mut self.record;
        for (k, outcome) in hit.outcomes.iter().enumerate() {
            outcome.count_work(record);
            outcome.count(hit.islands.blocks(k).len(), record);
        }
        let solved = hit.outcomes.iter().all(|o| o.report.solved());
        let mut contacts = CachedContacts::default();
        let (over, mean) = (participants.over, working_velocities(instant, hit, w));
        let all = 0..instant.blocks.len();
        record_interval(instant, hit, all, &mean, over, record, &mut contacts);
        let impacts = &mut record.impacts;
        let landings = (&[][..], &mut Vec::new());
        find_impacts(instant, hit, |_| true, w, over, impacts, landings);
        record.events += 1;
        self.bounced = participants.lone.then(|| Bounce {
            key,
            velocity: self.velocity(key, &self.hit.end),
            time: rest.at,
        });
        if participants.lone {
            self.cache_landed(&participants.in_force, &contacts);
        }
        self.cache_instant(&contacts);
        self.release_absent();
        [participants.lone, solved]
    }

    /// Speed \[m/s\] at which a contact closes before the impact.
    pub(super) fn approach(&self, key: ContactKey) -> f64 {
        -self.velocity(key, &self.instant.start)
    }

    /// Normal velocity \[m/s\] of a contact with some velocities of the bodies.
    fn velocity(&self, key: ContactKey, velocities: &[Vec3]) -> f64 {
        let mut contacts = self.instant.detection.contacts.iter();
        let contact = contacts.find(|c| c.key == key);
        contact.map_or(0.0, |c| c.rows.velocity(velocities).x)
    }

    /// Finds which contacts take part in the impact at `key`, and how.
    fn participants(
        &self,
        context: &Context,
        key: ContactKey,
        rest: Rest,
        bodies: usize,
    ) -> Participants {
        let instant = &self.instant;
        let contacts = &instant.detection.contacts;
        let touches = |c: &ContactPoint| {
            let near = c.gap <= touch_tolerance(c, instant, context.dt);
            c.key == key || near || pressed(self.own_contacts.as_ref(), &c.key)
        };
        let touching: Vec<bool> = contacts.iter().map(touches).collect();
        let members = Some(self.members.as_slice());
        let mut joints = instant.detection.joints.iter();
        let lone = self.idle()
            && bodies <= 2
            && touching.iter().filter(|t| **t).count() == 1
            && !joints.any(|j| belongs(j.rows.bodies, members, context.inverse_mass));
        let acceleration = |c: &ContactPoint| {
            let forces = -c.rows.velocity(&instant.accelerations).x;
            let bounced = self.bounced;
            let since = bounced.and_then(|b| b.acceleration(c, &instant.start, rest.at));
            since.map_or(forces, |a| a.max(forces))
        };
        let slow = |c: &ContactPoint, e: f64, v: f64| {
            if lone {
                2.0 * e * v <= acceleration(c) * (1.0 - e) * rest.length
            } else {
                let a = applied_acceleration(c, &instant.accelerations);
                e * v <= rest_velocity(a, context.dt)
            }
        };
        let mut over = rest.at;
        let mut coefficient = |c: &ContactPoint| {
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
        };
        let all: Vec<f64> = contacts.iter().map(&mut coefficient).collect();
        let in_force = touching.iter().zip(all);
        Participants {
            in_force: in_force.map(|(touches, e)| touches.then_some(e)).collect(),
            over,
            lone,
        }
    }

    /// Caches a lone contact that landed; it may roll on along a curve. Its impulse is that of an
    /// instant and not a load.
    fn cache_landed(&mut self, in_force: &[Option<f64>], contacts: &CachedContacts) {
        let found = self.instant.detection.contacts.iter().zip(in_force);
        for (contact, _) in found.filter(|(_, e)| **e == Some(0.0)) {
            let hit = contacts.get(&contact.key).filter(|m| m.impulse.x > 0.0);
            if let (Some(hit), Some(own)) = (hit, &mut self.own_contacts) {
                let landed = CachedContact {
                    dt: f64::INFINITY,
                    stuck: false,
                    ..*hit
                };
                own.insert(contact.key, landed);
            }
        }
    }

    /// Forgets the load of contacts that the instant does not show: what turned to another corner or face
    /// took no part in the impact, and may close fast after it.
    fn release_absent(&mut self) {
        let Some(own) = &mut self.own_contacts else {
            return;
        };
        let shown = &self.instant.detection.contacts;
        for contact in &self.interval.detection.contacts {
            let absent = shown.iter().all(|c| c.key != contact.key);
            if let Some(known) = own.get(&contact.key).filter(|_| absent) {
                let open = CachedContact {
                    impulse: Vec2::zeros(),
                    ..*known
                };
                own.insert(contact.key, open);
            }
        }
    }

    /// Caches the velocities that the instant left its contacts with, for the interval after it. An
    /// impulse of the instant is no load.
    fn cache_instant(&mut self, contacts: &CachedContacts) {
        let Some(own) = &mut self.own_contacts else {
            return;
        };
        let pressed = contacts.entries().iter();
        for (key, hit) in pressed.filter(|(_, hit)| hit.left.is_some()) {
            let known = own.get(key).copied().unwrap_or(CachedContact {
                impulse: Vec2::zeros(),
                dt: f64::INFINITY,
                rebounded: false,
                ..*hit
            });
            let on_surface = |left| Left {
                on_surface: true,
                ..left
            };
            let (stuck, left) = (hit.stuck, hit.left.map(on_surface));
            own.insert(
                *key,
                CachedContact {
                    stuck,
                    left,
                    ..known
                },
            );
        }
    }
}

/// How contacts take part in an impact.
struct Participants {
    /// For each contact of the instant its coefficient of restitution; `None` if it does not take
    /// part.
    in_force: Vec<Option<f64>>,
    /// End \[s\] of the impact and of the ever smaller ones that follow it.
    over: f64,
    /// Whether two bodies that touch nothing else collide at one contact.
    lone: bool,
}

/// Whether a contact had a normal impulse in the interval before.
fn pressed(contacts: Option<&CachedContacts>, key: &ContactKey) -> bool {
    let cached = contacts.and_then(|all| all.get(key));
    cached.is_some_and(|m| m.impulse.x > 0.0)
}
