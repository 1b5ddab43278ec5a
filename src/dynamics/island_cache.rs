//! The island cache: data of islands for the next step.

use super::model::ContactKey;
use crate::solver::{FactorCache, FactorState};
use rustc_hash::{FxHashMap, FxHashSet};
use serde::{Deserialize, Serialize};

/// Data of the islands of one step.
#[derive(Default)]
struct Generation {
    /// Factors of a Newton system, by the key of the island's first block.
    factors: FxHashMap<ContactKey, FactorCache>,
    /// The blocks of all crowds: in a moving heap any of them may be gone in the next step.
    crowds: FxHashSet<ContactKey>,
}

/// All data of islands for the next step.
///
/// A step reads the last generation and writes the next one. [`IslandCache::commit`] then replaces
/// the last generation.
#[derive(Default)]
pub(super) struct IslandCache {
    last: Generation,
    next: Generation,
    /// The blocks of islands that were crowds in a part of this step.
    within: FxHashSet<ContactKey>,
    /// Whether the displacement problem of a large island had no solution. It is then regularised
    /// at once, as long as any pair overlaps.
    pub wedged: bool,
}

/// [`IslandCache`] in a saved state, in the order of its keys.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct IslandCacheState {
    factors: Vec<(ContactKey, FactorState)>,
    crowds: Vec<ContactKey>,
    wedged: bool,
}

impl IslandCache {
    /// Forgets all islands, after a change of solver or shapes.
    pub fn clear(&mut self) {
        self.drop_step();
        self.last.crowds.clear();
    }

    /// Begins a step.
    pub fn begin(&mut self) {
        self.within.clear();
    }

    /// Ends a successful step.
    pub fn commit(&mut self) {
        std::mem::swap(&mut self.last, &mut self.next);
        // the sets of a crowd are large: they keep their memory
        self.next.factors.clear();
        self.next.crowds.clear();
    }

    /// Ends a failed step. Its islands may have taken factors out of the last generation, so all
    /// factors are dropped. Crowds do not change.
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

    /// Whether one of these blocks belongs to a crowd: of the last step in a `whole` step, of this one in
    /// a part of a step.
    pub fn is_crowd(&self, mut keys: impl Iterator<Item = ContactKey>, whole: bool) -> bool {
        let known = match whole {
            true => [&self.last.crowds, &self.last.crowds],
            false => [&self.within, &self.next.crowds],
        };
        known.iter().any(|crowds| !crowds.is_empty())
            && keys.any(|key| known.iter().any(|crowds| crowds.contains(&key)))
    }

    /// Stores whether an island with these blocks is a crowd.
    pub fn store_crowd(
        &mut self,
        keys: impl Iterator<Item = ContactKey>,
        whole: bool,
        crowd: bool,
    ) {
        let crowds = if whole {
            &mut self.next.crowds
        } else {
            &mut self.within
        };
        if crowd {
            crowds.extend(keys);
        } else if whole && !crowds.is_empty() {
            // an earlier round of the step may have stored another state
            for key in keys {
                crowds.remove(&key);
            }
        }
    }

    /// All data, to be saved.
    pub fn state(&self) -> IslandCacheState {
        let all = self.last.factors.iter();
        let factors = all.filter_map(|(key, factors)| Some((*key, factors.state()?)));
        let mut state = IslandCacheState {
            factors: factors.collect(),
            crowds: self.last.crowds.iter().copied().collect(),
            wedged: self.wedged,
        };
        state.factors.sort_by_key(|(key, _)| *key);
        state.crowds.sort();
        state
    }

    /// Restores what [`IslandCache::state`] returned.
    pub fn restore(&mut self, state: &IslandCacheState) {
        let restored = |(key, state): &(_, _)| (*key, FactorCache::restored(state));
        *self = IslandCache {
            last: Generation {
                factors: state.factors.iter().map(restored).collect(),
                crowds: state.crowds.iter().copied().collect(),
            },
            wedged: state.wedged,
            ..IslandCache::default()
        };
    }
}
