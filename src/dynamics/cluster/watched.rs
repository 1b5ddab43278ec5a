//! Pairs that may meet although no contact of theirs is deferred.
//!
//! Rules look at the contacts of the midpoint. Two bodies that turn may show none there, being corner to
//! corner, or one that opens, and still meet with other corners later in the interval. Such pairs are
//! therefore searched for impacts too, if the bounds of their distance and of their motion allow one.

use crate::contact::{Vec2, Vec3};
use crate::dynamics::events::touch_tolerance;
use crate::dynamics::interval::{Interval, Source};
use crate::dynamics::model::{ContactKey, ContactPoint, NearPair};
use crate::dynamics::solution::Solution;
use rustc_hash::FxHashSet;

/// A pair of surfaces that may meet in an interval.
#[derive(Debug, Clone)]
pub(super) struct Pair {
    pub surfaces: [u32; 2],
    pub bodies: [u32; 2],
    /// Bound of the speed at which any two of its points approach \[m/s\]; `None` if the pair has no
    /// bound of its distance.
    pub speed: Option<f64>,
    /// A guess of the time at which it closes.
    pub guess: f64,
    /// Its contacts that overlap all the time until then.
    pub standing: Vec<ContactKey>,
}

/// A contact that takes part in an interval, so that its rule keeps it from closing.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kept {
    pub key: ContactKey,
    pub surfaces: [u32; 2],
    /// Gap below which its surfaces touch \[m\].
    pub touch: f64,
    /// Whether it touches: then it is as near as possible.
    pub touches: bool,
}

/// What the search for a landing finds, and the time from the start of the rest.
pub(super) enum Sought {
    /// A contact that closes.
    Impact(ContactKey, f64),
    /// An interval at whose end the pair is still open, and which no landing follows at once: bodies in
    /// flight find with their velocities of then that they slide past, or others reach them.
    Open(f64),
    /// No contact that closes.
    Nothing,
}

impl Pair {
    pub fn of(contact: &ContactPoint, guess: f64) -> Pair {
        Pair {
            surfaces: contact.surfaces,
            bodies: contact.rows.bodies,
            speed: None,
            guess,
            standing: Vec::new(),
        }
    }
}

impl Pair {
    /// Whether a contact is no deeper than the pair can get in a time \[s\].
    pub fn allows(&self, contact: &ContactPoint, time: f64) -> bool {
        let deepest = |speed: f64| speed * time + 2.0 * contact.gap_noise;
        self.speed
            .is_none_or(|speed| contact.gap >= -deepest(speed))
    }
}

/// Largest speeds of a pair in an interval \[m/s\]: of its centres of mass towards each other, and of its
/// points about them.
pub(super) fn speeds(near: &NearPair, velocities: [&[Vec3]; 2]) -> [f64; 2] {
    let [mut straight, mut turning] = [0.0f64; 2];
    for all in velocities {
        let of = |side: usize| all.get(near.bodies[side] as usize).copied();
        let [a, b] = [of(0), of(1)].map(Option::unwrap_or_default);
        straight = straight.max((b - a).xy().norm());
        turning = turning.max(a.z.abs() * near.radii[0] + b.z.abs() * near.radii[1]);
    }
    [straight, turning]
}

/// The pairs of the whole step without deferred contacts that are near enough to meet in it.
pub(super) fn near_enough(main: &Interval, trial: &Solution) -> Vec<NearPair> {
    if main.detection.near.is_empty() {
        return Vec::new();
    }
    let contacts = &main.detection.contacts;
    let deferred = trial.deferred.iter().map(|&i| contacts[i].surfaces);
    let deferred: FxHashSet<[u32; 2]> = deferred.collect();
    let near = main.detection.near.iter().filter(|near| {
        let [straight, turning] = speeds(near, [&main.start, &trial.end]);
        let way = 0.5 * main.length * (straight + turning);
        way > near.bound && !is_crowded(main, near) && !deferred.contains(&near.surfaces)
    });
    near.copied().collect()
}

/// Crowds are left out unless they rebound, see [`crate::dynamics::events::find_crowds`].
pub(super) fn is_crowded(interval: &Interval, near: &NearPair) -> bool {
    let crowded = |b: &u32| interval.crowded.get(*b as usize).is_some_and(|c| *c > 0);
    near.restitution == 0.0 && near.bodies.iter().any(crowded)
}

/// The contact of block `i`, unless it is deferred.
pub(super) fn kept(interval: &Interval, solution: &Solution, i: usize, step: f64) -> Option<Kept> {
    let block = &interval.blocks[i];
    let Source::Contact(index) = block.source else {
        return None;
    };
    let contact = &interval.detection.contacts[index];
    let touch = touch_tolerance(contact, interval, step);
    let loaded = solution.impulses[i] != Vec2::zeros();
    // the rule does nothing about what overlaps and slides
    let idle = !loaded && !block.continues && contact.gap < -touch;
    (!idle && !solution.deferred.contains(&index)).then_some(Kept {
        key: contact.key,
        surfaces: contact.surfaces,
        touch,
        touches: loaded || block.continues || contact.gap <= touch,
    })
}
