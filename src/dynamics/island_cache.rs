//! The island cache: data of islands for the next step.

use super::fallback::Fallback;
use super::model::ContactKey;
use crate::solver::{FactorCache, FactorState};
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

/// Data of the islands of one step.
#[derive(Default)]
struct Generation {
    /// Factors of a Newton system, by the key of the island's first block.
    factors: FxHashMap<ContactKey, FactorCache>,
    /// Fallback state of large islands, by the keys of all their blocks: in a moving heap any of
    /// the blocks may be gone in the next step.
    fallback: FxHashMap<ContactKey, Fallback>,
}

/// All data of islands for the next step.
///
/// A step reads the last generation and writes the next one. [`IslandCache::commit`] then replaces
/// the last generation.
#[derive(Default)]
pub(super) struct IslandCache {
    last: Generation,
    next: Generation,
    /// Fallback state of islands that were solved for only a part of this step.
    within: FxHashMap<ContactKey, Fallback>,
    /// Whether the displacement problem of a large island had no solution. It is then regularised
    /// at once, as long as any pair overlaps.
    pub wedged: bool,
}

/// [`IslandCache`] in a saved state, in the order of its keys.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct IslandCacheState {
    factors: Vec<(ContactKey, FactorState)>,
    fallback: Vec<(ContactKey, Fallback)>,
    wedged: bool,
}

impl IslandCache {
    /// Forgets all islands, after a change of solver or shapes.
    pub fn clear(&mut self) {
        self.drop_step();
        self.last.fallback.clear();
    }

    /// Begins a step.
    pub fn begin(&mut self) {
        self.within.clear();
    }

    /// Ends a successful step.
    pub fn commit(&mut self) {
        self.last = std::mem::take(&mut self.next);
    }

    /// Ends a failed step. Its islands may have taken factors out of the last generation, so all
    /// factors are dropped. Fallback states do not change.
    pub fn drop_step(&mut self) {
        self.last.factors.clear();
        self.next = Generation::default();
    }

    /// Takes out the factors of the island with this first key; empty if there are none.
    pub fn take_factors(&mut self, first: &ContactKey) -> FactorCache {
        let earlier = self.next.factors.remove(first);
        let earlier = earlier.or_else(|| self.last.factors.remove(first));
        earlier.unwrap_or_default()
    }

    /// Stores the factors of the island with this first key for the next step.
    pub fn store_factors(&mut self, first: ContactKey, factors: FactorCache) {
        if !factors.is_empty() {
            self.next.factors.insert(first, factors);
        }
    }

    /// Fallback state of an island: that of the first of its `keys` with a stored state. In a
    /// `whole` step it is that of the last step, in a part of a step that found earlier in this
    /// step.
    pub fn fallback(
        &self,
        keys: impl Iterator<Item = ContactKey> + Clone,
        whole: bool,
    ) -> Fallback {
        let stored = |states: &FxHashMap<ContactKey, Fallback>| {
            let mut keys = keys.clone().filter(|_| !states.is_empty());
            keys.find_map(|key| states.get(&key).copied())
        };
        let found = if whole {
            stored(&self.last.fallback)
        } else {
            let within = stored(&self.within).or_else(|| stored(&self.next.fallback));
            within.map(Fallback::within)
        };
        found.unwrap_or_default()
    }

    /// Stores the fallback state of an island with these keys.
    pub fn store_fallback(
        &mut self,
        keys: impl Iterator<Item = ContactKey> + Clone,
        whole: bool,
        state: Fallback,
    ) {
        // an earlier round of the step may have stored another state
        if whole && !self.next.fallback.is_empty() {
            for key in keys.clone() {
                self.next.fallback.remove(&key);
            }
        }
        if state.active() {
            let states = if whole {
                &mut self.next.fallback
            } else {
                &mut self.within
            };
            states.extend(keys.map(|key| (key, state)));
        }
    }

    /// All data, to be saved.
    pub fn state(&self) -> IslandCacheState {
        let all = self.last.factors.iter();
        let factors = all.filter_map(|(key, factors)| Some((*key, factors.state()?)));
        let fallback = self.last.fallback.iter().map(|(key, state)| (*key, *state));
        let mut state = IslandCacheState {
            factors: factors.collect(),
            fallback: fallback.collect(),
            wedged: self.wedged,
        };
        state.factors.sort_by_key(|(key, _)| *key);
        state.fallback.sort_by_key(|(key, _)| *key);
        state
    }

    /// Restores what [`IslandCache::state`] returned.
    pub fn restore(&mut self, state: &IslandCacheState) {
        let restored = |(key, state): &(_, _)| (*key, FactorCache::restored(state));
        *self = IslandCache {
            last: Generation {
                factors: state.factors.iter().map(restored).collect(),
                fallback: state.fallback.iter().copied().collect(),
            },
            wedged: state.wedged,
            ..IslandCache::default()
        };
    }
}
