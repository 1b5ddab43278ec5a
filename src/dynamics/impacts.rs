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
use super::record::{ContactRecord, ContactStatus, ImpactRecord};
use super::rules::applied_acceleration;
use super::solution::Solution;
use crate::contact::{Mat2, Rows, Vec2, Vec3};
use rustc_hash::FxHashMap;

/// Cosine of the angle up to which normals count as parallel.
const PARALLEL: f64 = 0.99;

/// Share of the approach speed below which a contact point has come to rest.
const RESTS: f64 = 1e-9;

impl Landing {
    /// Whether a contact of the next step belongs to it, if it has one of its [`Place::names`].
    fn is_at(&self, contact: &Place) -> bool {
        let own = &self.record;
        own.normal.dot(&contact.normal) > PARALLEL
            && (own.position - contact.position).norm() <= self.reach
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

/// Where a contact is, and whose.
struct Place {
    bodies: [u32; 2],
    surfaces: [u32; 2],
    normal: Vec2,
    position: Vec2,
}

impl Place {
    fn of_point(contact: &ContactPoint) -> Place {
        Place {
            bodies: contact.bodies,
            surfaces: contact.surfaces,
            normal: contact.normal,
            position: contact.position,
        }
    }

    fn of_record(contact: &ContactRecord) -> Place {
        Place {
            bodies: contact.bodies,
            surfaces: contact.surfaces,
            normal: contact.normal,
            position: contact.position,
        }
    }

    fn of_impact(impact: &ImpactRecord) -> Place {
        Place {
            bodies: impact.bodies,
            surfaces: impact.surfaces,
            normal: impact.normal,
            position: impact.position,
        }
    }

    /// By what a landing finds its contacts: its surfaces, and on a body that cannot move the other one's
    /// alone, as a floor may go on in the next body.
    fn names(&self, inverse_mass: &[Vec3]) -> impl Iterator<Item = [Option<u32>; 2]> {
        let [a, b] = self.surfaces;
        let fixed = self.bodies.map(|body| {
            let w = inverse_mass.get(body as usize);
            w.is_none_or(|w| *w == Vec3::zeros())
        });
        let on_floor = [[Some(a), None], [None, Some(b)]].into_iter();
        let on_floor = on_floor.zip([fixed[1], fixed[0]]);
        let alone = on_floor.filter_map(|(name, fixed)| fixed.then_some(name));
        std::iter::once([Some(a), Some(b)]).chain(alone)
    }
}

/// The landings of the last step by the names of their places.
struct Landings<'a> {
    all: &'a [Landing],
    /// The last one of each name, as its place in `others`.
    of: FxHashMap<[Option<u32>; 2], u32>,
    /// Landings, each with the place of one of the same name before it.
    others: Vec<(usize, Option<u32>)>,
}

impl<'a> Landings<'a> {
    fn new(all: &'a [Landing], inverse_mass: &[Vec3]) -> Landings<'a> {
        let (mut of, mut others) = (FxHashMap::default(), Vec::new());
        // the first one of a name comes last, so that a search begins with it
        for (k, landing) in all.iter().enumerate().rev() {
            for name in Place::of_impact(&landing.record).names(inverse_mass) {
                let next = of.insert(name, others.len() as u32);
                others.push((k, next));
            }
        }
        Landings { all, of, others }
    }

    /// The landing that goes on in a contact.
    fn find(&self, contact: &Place, inverse_mass: &[Vec3]) -> Option<usize> {
        if self.all.is_empty() {
            return None;
        }
        contact.names(inverse_mass).find_map(|name| {
            let mut place = self.of.get(&name).copied();
            while let Some(at) = place {
                let (k, next) = self.others[at as usize];
                if self.all[k].is_at(contact) {
                    return Some(k);
                }
                place = next;
            }
            None
        })
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
    let groups = groups(interval, solution, used);
    if groups.is_empty() {
        return;
    }
    let before = Landings::new(before, inverse_mass);
    for mut group in groups {
        let first = group[0].contact;
        let rebounds = interval.blocks[group[0].block].impact;
        if !rebounds && interval.length > 0.0 {
            let goes_on = |c: &ContactPoint| {
                let place = Place::of_point(c);
                before.find(&place, inverse_mass).is_some()
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
            let width = width(interval, group[0].block, &hit);
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

/// Largest distance \[m\] from `hit` of a contact of its pair that lands with it: also of one without an
/// impulse, as the corners of a box that lies flat share it in any way. `block` is one of its blocks.
fn width(interval: &Interval, block: usize, hit: &Hit) -> f64 {
    let all = &interval.detection.contacts;
    let Source::Contact(index) = interval.blocks[block].source else {
        return 0.0;
    };
    let own = &all[index];
    // contacts of a pair follow each other
    let of_pair = |c: &&ContactPoint| c.surfaces == own.surfaces;
    let before = all[..index].iter().rev().take_while(of_pair);
    let after = all[index..].iter().take_while(of_pair);
    let level = hit.gap + 2.0 * own.gap_noise;
    let lands = |c: &&ContactPoint| c.normal.dot(&own.normal) > PARALLEL && c.gap <= level;
    let far = |c: &ContactPoint| (c.position - hit.position).norm();
    before
        .chain(after)
        .filter(lands)
        .map(far)
        .fold(0.0, f64::max)
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

/// Ends the landings of the last step, or part of a step, with the impulses of the `contacts` of this one.
pub(super) fn finish_landings(
    landings: &[Landing],
    contacts: &[ContactRecord],
    impacts: &mut Vec<ImpactRecord>,
    inverse_mass: &[Vec3],
) {
    if landings.is_empty() {
        return;
    }
    let known = Landings::new(landings, inverse_mass);
    let mut steps = vec![Vec::new(); landings.len()];
    for contact in contacts {
        let found = known.find(&Place::of_record(contact), inverse_mass);
        if let Some(k) = found.filter(|_| contact.status != ContactStatus::Impact) {
            steps[k].push(contact);
        }
    }
    let mut landings = landings.to_vec();
    for (landing, step) in landings.iter_mut().zip(&steps) {
        landing.add(step);
    }
    // one that only bore the weight of its step was none
    let finished = landings.into_iter().map(|landing| landing.record);
    impacts.extend(finished.filter(|impact| impact.impulse_n > 0.0));
}
