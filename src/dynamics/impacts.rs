//! Records each impact once, even if several contact points and steps share its impulse.
//!
//! An impact gives a pair of surfaces a jump of velocity. Its impulse is the momentum that it
//! takes or reverses. The impulse of a step also balances the applied forces of that step, so their
//! share is subtracted: see [`ImpactRecord`].
//!
//! Without event location a landing without rebound takes up to two steps. After the first step the
//! contact point has the velocity that closes the gap at the next midpoint. In the second step it
//! comes to rest. With the approach speed `v` at the instant `t*` of touching, the effective
//! mass `m` and the acceleration `a` of the applied forces, the two impulses are
//!
//! ```text
//! P₁ + P₂ = m v_A + 2 m a Δt = m v + m a (T − t*)     v = v_A + a (t* − t_A)
//! ```
//!
//! where `T` is the end of the second step. `m a` is the force that holds the contact at rest, so
//! `P₁ + P₂ − m a (T − t*) = m v` at every step length.

use super::contact_cache::Landing;
use super::interval::{Interval, Source};
use super::model::{ContactPoint, NormalLaw};
use super::record::{ContactRecord, ContactStatus, ImpactRecord, StepRecord};
use super::rules::applied_acceleration;
use super::solution::Solution;
use crate::contact::{Mat2, Rows, Vec2, Vec3};
use rustc_hash::FxHashMap;

/// Cosine of the angle up to which normals count as parallel.
const PARALLEL: f64 = 0.99;

/// Share of the approach speed below which a contact point has come to rest.
const RESTS: f64 = 1e-9;

impl Landing {
    /// Whether a contact of the next step belongs to it.
    fn is_at(&self, surfaces: [u32; 2], normal: Vec2, position: Vec2) -> bool {
        let own = &self.record;
        own.surfaces == surfaces
            && own.normal.dot(&normal) > PARALLEL
            && (own.position - position).norm() <= self.reach
    }

    /// Adds what the contacts of the pair did in the next step.
    fn add(&mut self, step: &[&ContactRecord]) {
        let normal: f64 = step.iter().map(|c| c.impulse_n).sum();
        if normal <= 0.0 {
            return;
        }
        let record = &mut self.record;
        let until = step.iter().map(|c| c.time).fold(self.until, f64::max);
        let loaded = (until - self.until.max(record.time)).max(0.0);
        let (mut p, mut lost, mut mean) = (-self.load * loaded, 0.0, Vec2::zeros());
        for c in step {
            p += Vec2::new(c.impulse_n, c.impulse_t);
            lost += c.friction_work - c.normal_work;
            if loaded > 0.0 {
                let slip = c.impulse_n * c.slip / (until - self.until);
                mean += Vec2::new(c.normal_work, slip) / normal;
            }
        }
        record.impulse_n += p.x;
        record.impulse_t += p.y;
        record.energy_lost += lost + loaded * self.load.dot(&mean) - 0.5 * p.dot(&self.ahead);
        self.until = until;
    }
}

/// A block that is a contact.
#[derive(Clone, Copy)]
struct Touching<'a> {
    block: usize,
    contact: &'a ContactPoint,
}

/// The contacts of one pair of surfaces with parallel normals, in an interval. Means are weighted
/// by the normal impulse.
#[derive(Default)]
struct Hit {
    impulse: Vec2,
    rows: Vec<(Rows, f64)>,
    position: Vec2,
    gap: f64,
    gamma_a: Vec2,
    gamma_f: Vec2,
    gamma_e: Vec2,
    /// Smallest normal velocity at the end.
    closing: f64,
}

impl Hit {
    fn of(interval: &Interval, solution: &Solution, group: &[Touching]) -> Hit {
        let mut hit = Hit {
            closing: f64::INFINITY,
            ..Hit::default()
        };
        let normal = |t: &Touching| solution.impulses[t.block].x;
        let total: f64 = group.iter().map(normal).sum();
        for touching in group {
            let (i, contact) = (touching.block, touching.contact);
            let (block, share) = (&interval.blocks[i], normal(touching) / total);
            let surface = Vec2::new(0.0, contact.surface_velocity);
            let gamma_e = contact.rows.velocity(&solution.end) + surface;
            hit.impulse += solution.impulses[i];
            hit.rows.push((interval.rows(i), share));
            hit.position += share * contact.position;
            hit.gap += share * contact.gap;
            hit.gamma_a += share * block.gamma_a;
            hit.gamma_f += share * block.gamma_f;
            hit.gamma_e += share * gamma_e;
            hit.closing = hit.closing.min(gamma_e.x);
        }
        hit
    }

    /// `G` of the mean row [1/kg].
    fn effective(&self, inverse_mass: &[Vec3]) -> Mat2 {
        let mut mean = self.rows[0].0;
        for (side, rows) in mean.jacobian.iter_mut().enumerate() {
            for (k, row) in rows.iter_mut().enumerate() {
                let all = self.rows.iter();
                *row = all.map(|(r, share)| *share * r.jacobian[side][k]).sum();
            }
        }
        mean.diagonal(inverse_mass)
    }

    /// The time after the start of an interval of length `h` at which the gap closes under the
    /// applied forces, and the speed then \[s, m/s\]. Impulses of other contacts may close it sooner: at
    /// the latest at the next midpoint, where this impulse lets it touch.
    fn touch(&self, h: f64) -> (f64, f64) {
        let (v, a) = (
            -self.gamma_a.x,
            (self.gamma_a.x - self.gamma_f.x) / h.max(f64::MIN_POSITIVE),
        );
        let gap = (self.gap + 0.5 * h * v).max(0.0);
        let square = v * v + 2.0 * a * gap;
        if square <= 0.0 {
            return (0.0, v.max(0.0));
        }
        let speed = square.sqrt();
        let time = 2.0 * gap / (v + speed).max(f64::MIN_POSITIVE);
        (time.min(1.5 * h), speed)
    }
}

/// Finds the impacts of an interval among the blocks that `used` selects. Adds them to `impacts`, and
/// those that need another step to `landings`. `time` is the end of the interval \[s\].
///
/// The landings of the last step, `before`, go on in this one, if on another edge of the same surfaces
/// near by: see [`finish_landings`].
pub(super) fn find_impacts(
    interval: &Interval,
    solution: &Solution,
    used: impl Fn(usize) -> bool,
    inverse_mass: &[Vec3],
    time: f64,
    impacts: &mut Vec<ImpactRecord>,
    (before, landings): (&[Landing], &mut Vec<Landing>),
) {
    for mut group in groups(interval, solution, used) {
        let first = group[0].contact;
        let rebounds = interval.blocks[group[0].block].impact;
        if !rebounds && interval.length > 0.0 {
            let goes_on = |c: &ContactPoint| {
                let is_at = |l: &Landing| l.is_at(c.surfaces, c.normal, c.position);
                before.iter().any(is_at)
            };
            group.retain(|touching| !goes_on(touching.contact));
        }
        if group.is_empty() {
            continue;
        }
        let hit = Hit::of(interval, solution, &group);
        let h = interval.length;
        let (touch, speed) = hit.touch(h);
        let mut record = ImpactRecord {
            time,
            bodies: first.bodies,
            surfaces: first.surfaces,
            position: hit.position,
            normal: first.normal,
            approach_speed: (-hit.gamma_a.x).max(0.0),
            impulse_n: hit.impulse.x,
            impulse_t: hit.impulse.y,
            energy_lost: -0.5 * hit.impulse.dot(&(hit.gamma_a + hit.gamma_e)),
        };
        if h == 0.0 {
            impacts.push(record);
            continue;
        }
        // a contact slower than the speed that the forces give over the resolution of the gap is at
        // rest
        let forces = applied_acceleration(first, &interval.accelerations);
        if speed * speed <= 8.0 * forces * first.gap_noise {
            continue;
        }
        let effective = hit.effective(inverse_mass);
        let acceleration = (hit.gamma_f - hit.gamma_a) / h;
        let load = resting_load(&effective, acceleration, first.friction, hit.impulse);
        record.time = time - h + touch;
        if rebounds {
            record.time = record.time.min(time);
            let p = hit.impulse - load * h;
            (record.impulse_n, record.impulse_t) = (p.x, p.y);
            record.energy_lost = -0.5 * p.dot(&(hit.gamma_a + hit.gamma_e));
            impacts.extend((p.x > 0.0).then_some(record));
            continue;
        }
        record.approach_speed = speed;
        let p = hit.impulse - load * (h - touch).max(0.0);
        let ahead = acceleration * (touch - h).max(0.0);
        let before = hit.gamma_a + acceleration * touch;
        (record.impulse_n, record.impulse_t) = (p.x, p.y);
        record.energy_lost = -0.5 * p.dot(&(before + hit.gamma_e + ahead));
        if hit.closing >= -RESTS * speed && touch <= h {
            impacts.extend((p.x > 0.0).then_some(record));
        } else {
            let far = |t: &Touching| (t.contact.position - hit.position).norm();
            let width = group.iter().map(far).fold(0.0, f64::max);
            landings.push(Landing {
                record,
                load,
                ahead,
                until: time,
                reach: width + 1.5 * h * hit.gamma_a.norm().max(hit.gamma_f.norm()),
            });
        }
    }
}

/// The blocks of rigid contacts that may be impacts, by pair of surfaces and normal.
fn groups<'a>(
    interval: &'a Interval,
    solution: &Solution,
    used: impl Fn(usize) -> bool,
) -> Vec<Vec<Touching<'a>>> {
    let instant = interval.length == 0.0;
    let mut groups: Vec<Vec<Touching>> = Vec::new();
    for (i, block) in interval.blocks.iter().enumerate() {
        let Source::Contact(index) = block.source else {
            continue;
        };
        let starts = instant || block.impact || !block.continues;
        if !starts || solution.impulses[i].x <= 0.0 || !used(i) {
            continue;
        }
        let contact = &interval.detection.contacts[index];
        if !matches!(contact.law, NormalLaw::Rigid { .. }) {
            continue;
        }
        // contacts of a pair follow each other
        let same = |group: &&mut Vec<Touching>| {
            let known = group[0];
            known.contact.surfaces == contact.surfaces
                && interval.blocks[known.block].impact == block.impact
                && known.contact.normal.dot(&contact.normal) > PARALLEL
        };
        let touching = Touching { block: i, contact };
        match groups.iter_mut().rev().take(4).find(same) {
            Some(group) => group.push(touching),
            None => groups.push(vec![touching]),
        }
    }
    groups
}

/// The force (n, t) \[N\] that keeps a pair from accelerating into each other under the applied
/// forces, with the friction of the impulse `p`: sliding if `p` is on the border of the cone.
fn resting_load(g: &Mat2, acceleration: Vec2, friction: f64, p: Vec2) -> Vec2 {
    let sliding = |side: f64| {
        let n = -acceleration.x / (g[(0, 0)] + side * friction * g[(0, 1)]);
        if n.is_finite() && n > 0.0 {
            Vec2::new(n, side * friction * n)
        } else {
            Vec2::zeros()
        }
    };
    if p.y.abs() >= (1.0 - 1e-9) * friction * p.x {
        return sliding(if p.y < 0.0 { -1.0 } else { 1.0 });
    }
    match g.try_inverse().map(|inverse| -(inverse * acceleration)) {
        Some(load) if load.x > 0.0 && load.y.abs() <= friction * load.x => load,
        Some(load) if load.x > 0.0 => sliding(load.y.signum()),
        _ => Vec2::zeros(),
    }
}

/// Ends the landings of the last step with the impulses of this one.
pub(super) fn finish_landings(landings: &[Landing], record: &mut StepRecord) {
    if landings.is_empty() {
        return;
    }
    let mut landings = landings.to_vec();
    let mut of: FxHashMap<[u32; 2], Vec<usize>> = FxHashMap::default();
    for (k, landing) in landings.iter().enumerate() {
        of.entry(landing.record.surfaces).or_default().push(k);
    }
    let mut steps = vec![Vec::new(); landings.len()];
    for contact in &record.contacts {
        let Some(own) = of.get(&contact.surfaces) else {
            continue;
        };
        let here =
            |k: &&usize| landings[**k].is_at(contact.surfaces, contact.normal, contact.position);
        let found = own.iter().find(here);
        if let Some(&k) = found.filter(|_| contact.status != ContactStatus::Impact) {
            steps[k].push(contact);
        }
    }
    for (landing, step) in landings.iter_mut().zip(&steps) {
        landing.add(step);
    }
    // one that only bore the weight of its step was none
    let finished = landings.into_iter().map(|landing| landing.record);
    let impacts = finished.filter(|impact| impact.impulse_n > 0.0);
    record.impacts.extend(impacts);
}
