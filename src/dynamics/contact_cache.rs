//! The contact cache: data of contacts and joints for the next step.

use super::model::ContactKey;
use super::pair_set::PairSet;
use super::record::ImpactRecord;
use crate::contact::{NO_BODY, Vec2};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// One joint's share of the energy that the pins and locks of its island have added; all have equal
/// shares.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
pub(crate) struct JointEnergy {
    /// Energy added so far \[J\].
    pub added: f64,
    /// Energy that they and the contacts of the island have added together, 0 or more \[J\].
    pub total: f64,
    /// Largest energy of recent steps, the scale of the bound \[J\].
    pub scale: f64,
}

/// Cached data of one contact or joint.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct CachedContact {
    /// [N s], in an interval of length `dt`.
    #[serde(with = "super::saved::pair")]
    pub impulse: Vec2,
    #[serde(with = "super::saved::endless")]
    pub dt: f64,
    /// Whether the contact stuck.
    pub stuck: bool,
    /// Relative velocity at the end of the interval, if it had an impulse.
    pub left: Option<Left>,
    /// Whether it rebounded: then its impulse is not a persistent load.
    pub rebounded: bool,
    /// For a pin or lock.
    pub energy: JointEnergy,
}

/// Relative velocity that an interval left a loaded contact with.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Left {
    /// `γ_E` on the rows of the interval's midpoint \[m/s\].
    #[serde(with = "super::saved::pair")]
    pub gamma: Vec2,
    /// Time from that midpoint to the end \[s\]; 0 after an instant.
    pub ago: f64,
    /// `c` of [`Situation`](super::rules::Situation) \[m/s²\] in that interval.
    #[serde(with = "super::saved::some_pair", default)]
    pub turning: Option<Vec2>,
    /// Whether the contact began with a gap of 0: at the start of the simulation, or at the instant
    /// of an impact.
    pub on_surface: bool,
    /// Largest depth \[m\] at which the scheme has held the contact on a curved path since it is
    /// loaded.
    pub held: f64,
}

/// A landing that takes a second step.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Landing {
    /// Impulses and energy so far.
    pub record: ImpactRecord,
    /// Force that holds the pair at rest, (n, t) \[N\].
    #[serde(with = "super::saved::pair")]
    pub load: Vec2,
    /// Change of the relative velocity by the applied forces from the end of the step to the instant of
    /// touching, if that is later \[m/s\].
    #[serde(with = "super::saved::pair")]
    pub ahead: Vec2,
    /// How far from its place its contacts of the next step may lie \[m\].
    pub reach: f64,
    /// End of the last step with an impulse \[s\].
    pub until: f64,
}

/// A pulled link for the next step, named by one side of one of its pins.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct PulledLink {
    pub pin: ContactKey,
    pub side: usize,
    /// `k` \[N m\] and `m r²` \[kg m²\] of (2) of [`super::pulled_links`].
    pub stiffness: f64,
    pub support: f64,
    /// `Ĩ` of the last step \[kg m²\].
    pub inertia: f64,
    /// `√(k / (2 (I + m r²)))` [1/s] with the true inertia.
    pub rate: f64,
    /// The same with the least `k` of all parts of the last step: of what lasts longer than an impact.
    pub lasting: f64,
    /// Whether its island is stepped in parts where they suffice, and whether it was so in the last step:
    /// see [`super::cut_links`].
    pub cut: bool,
    pub in_parts: bool,
}

impl PulledLink {
    /// What its step finds it by.
    pub fn name(&self) -> (ContactKey, usize) {
        (self.pin, self.side)
    }
}

/// All data of contacts and joints for the next step, and the reserves of energy.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct ContactCache {
    #[serde(with = "in_order")]
    pub contacts: CachedContacts,
    pub overlaps: Overlaps,
    /// In the order of their pins.
    pub links: Vec<PulledLink>,
    /// Landings that take another step.
    pub landings: Vec<Landing>,
    /// Whether some contact rebounds little: see [`super::events::find_crowds`].
    pub lands: bool,
    /// For each body its share of the reserve of its island \[J\], see [`super::reserve`].
    pub reserves: Vec<f64>,
}

impl ContactCache {
    /// Adds the entries of an island that was left out of the last steps; those that the cache has
    /// stay.
    pub fn take_back(&mut self, entries: &[(ContactKey, CachedContact)]) {
        let missing = entries
            .iter()
            .filter(|(key, _)| self.contacts.get(key).is_none());
        let missing: Vec<_> = missing.copied().collect();
        self.contacts.extend(missing);
        let pairs = entries.iter().map(|(key, _)| key.pair);
        self.overlaps.seen.extend(pairs);
    }

    /// Follows bodies that get other numbers: `before` has the old number of each, or that of no body.
    pub fn renumber(&mut self, before: &[u32]) {
        let old = std::mem::take(&mut self.reserves);
        let of = |body: &u32| old.get(*body as usize).copied().unwrap_or(0.0);
        self.reserves.extend(before.iter().map(of));
        let now = |old: u32| before.iter().position(|b| *b == old && old != NO_BODY);
        for landing in &mut self.landings {
            let bodies = &mut landing.record.bodies;
            *bodies = bodies.map(|old| now(old).map_or(NO_BODY, |body| body as u32));
        }
    }
}

/// Pairs of surfaces that are moved apart by position.
#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct Overlaps {
    /// All pairs of the last step, in its order.
    pub seen: Vec<u64>,
    /// Pairs that have overlapped since they were first seen.
    pub open: PairSet,
    /// Pairs that came to overlap later.
    pub late: PairSet,
}

impl Overlaps {
    /// Whether there is nothing to move apart.
    pub fn is_empty(&self) -> bool {
        self.open.is_empty() && self.late.is_empty()
    }
}

/// Contacts and joints in the order in which a step met them.
///
/// The next step meets nearly the same ones in nearly the same order. So a search starts behind the
/// entry found last, and uses the index by key only if that fails.
#[derive(Debug, Default)]
pub(super) struct CachedContacts {
    entries: Vec<(ContactKey, CachedContact)>,
    /// Position behind the entry found last. Only the time of a search depends on it.
    next: AtomicUsize,
    /// Built at its first use.
    index: OnceLock<FxHashMap<ContactKey, u32>>,
}

impl Clone for CachedContacts {
    fn clone(&self) -> Self {
        self.entries.iter().copied().collect()
    }
}

/// Number of entries to compare before the index is used.
const AHEAD: usize = 4;

/// Number of entries on either side of a guess to compare.
const AROUND: usize = 64;

impl CachedContacts {
    pub fn get(&self, key: &ContactKey) -> Option<&CachedContact> {
        let mut next = self.next();
        let found = self.find(key, &mut next);
        self.set_next(next);
        found
    }

    /// Position behind the entry found last.
    pub fn next(&self) -> usize {
        self.next.load(Ordering::Relaxed)
    }

    pub fn set_next(&self, next: usize) {
        self.next.store(next, Ordering::Relaxed);
    }

    /// The position from which to search for a key and those after it, near a guess.
    pub fn place(&self, key: &ContactKey, guess: usize) -> usize {
        let is_it = |at: &usize| self.entries.get(*at).is_some_and(|(k, _)| k == key);
        let around = (0..AROUND).flat_map(|d| [guess + d, guess.saturating_sub(d)]);
        around.into_iter().find(is_it).unwrap_or(guess)
    }

    /// The entry of a key; `next` is the position behind the entry found last, of this search.
    #[inline]
    pub fn find(&self, key: &ContactKey, next: &mut usize) -> Option<&CachedContact> {
        // wrap around behind the last entry
        let from = *next % self.entries.len().max(1);
        let ahead = self.entries.get(from..).unwrap_or(&[]).iter();
        let found = match ahead.take(AHEAD).position(|(k, _)| k == key) {
            Some(steps) => from + steps,
            None => {
                let index = self.index.get_or_init(|| {
                    let all = self.entries.iter().enumerate();
                    all.map(|(i, (key, _))| (*key, i as u32)).collect()
                });
                *index.get(key)? as usize
            }
        };
        *next = found + 1;
        Some(&self.entries[found].1)
    }

    /// Adds a key that is not in the cache yet.
    pub fn push(&mut self, key: ContactKey, contact: CachedContact) {
        self.index.take();
        self.entries.push((key, contact));
    }

    /// Adds `contact`, or replaces the entry of its key.
    pub fn insert(&mut self, key: ContactKey, contact: CachedContact) {
        match self.entries.iter_mut().find(|(k, _)| *k == key) {
            Some(entry) => entry.1 = contact,
            None => self.push(key, contact),
        }
    }

    pub fn clear(&mut self) {
        self.entries.clear();
        self.set_next(0);
        self.index.take();
    }

    pub fn entries(&self) -> &[(ContactKey, CachedContact)] {
        &self.entries
    }

    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut CachedContact> {
        self.entries.iter_mut().map(|(_, contact)| contact)
    }
}

impl FromIterator<(ContactKey, CachedContact)> for CachedContacts {
    fn from_iter<I: IntoIterator<Item = (ContactKey, CachedContact)>>(all: I) -> Self {
        CachedContacts {
            entries: all.into_iter().collect(),
            ..CachedContacts::default()
        }
    }
}

impl Extend<(ContactKey, CachedContact)> for CachedContacts {
    fn extend<I: IntoIterator<Item = (ContactKey, CachedContact)>>(&mut self, all: I) {
        self.index.take();
        self.entries.extend(all);
    }
}

/// Saves [`CachedContacts`] as a list of entries in order.
mod in_order {
    use super::{CachedContact, CachedContacts, ContactKey};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(all: &CachedContacts, to: S) -> Result<S::Ok, S::Error> {
        all.entries().serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<CachedContacts, D::Error> {
        let entries = Vec::<(ContactKey, CachedContact)>::deserialize(from)?;
        Ok(entries.into_iter().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(feature: u64) -> ContactKey {
        ContactKey { pair: 7, feature }
    }

    fn cached(load: f64) -> CachedContact {
        CachedContact {
            impulse: Vec2::new(load, 0.0),
            dt: 0.01,
            stuck: false,
            left: None,
            rebounded: false,
            energy: JointEnergy::default(),
        }
    }

    /// Keys in order, backwards, with gaps, and missing keys; the last entry of a key counts.
    #[test]
    fn everything_is_found_in_any_order() {
        let mut cached_contacts: CachedContacts =
            (0..20).map(|k| (key(k), cached(k as f64))).collect();
        let orders: [Vec<u64>; 3] = [
            (0..20).collect(),
            (0..20).rev().collect(),
            vec![0, 1, 9, 10, 3, 30, 4, 19],
        ];
        for order in orders {
            for k in order {
                let found = cached_contacts.get(&key(k)).map(|m| m.impulse.x);
                assert_eq!(found, (k < 20).then_some(k as f64), "{k}");
            }
        }
        cached_contacts.insert(key(3), cached(-3.0));
        cached_contacts.insert(key(40), cached(40.0));
        assert_eq!(cached_contacts.entries().len(), 21);
        for (k, load) in [(40, 40.0), (3, -3.0), (4, 4.0)] {
            assert_eq!(
                cached_contacts.get(&key(k)).map(|m| m.impulse.x),
                Some(load)
            );
        }
        cached_contacts.clear();
        assert!(cached_contacts.get(&key(4)).is_none());
    }
}
