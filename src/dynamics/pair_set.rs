//! Sets of surface pairs: most are empty, and few are large.

use serde::{Deserialize, Serialize};

/// Surface pairs, in order.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "Vec<u64>", into = "Vec<u64>")]
pub(super) struct PairSet(Vec<u64>);

impl From<Vec<u64>> for PairSet {
    fn from(mut pairs: Vec<u64>) -> PairSet {
        pairs.sort_unstable();
        pairs.dedup();
        PairSet(pairs)
    }
}

impl From<PairSet> for Vec<u64> {
    fn from(set: PairSet) -> Vec<u64> {
        set.0
    }
}

impl PairSet {
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub fn len(&self) -> usize {
        self.0.len()
    }

    pub fn contains(&self, pair: u64) -> bool {
        self.0.binary_search(&pair).is_ok()
    }

    pub fn insert(&mut self, pair: u64) {
        if let Err(place) = self.0.binary_search(&pair) {
            self.0.insert(place, pair);
        }
    }

    pub fn retain(&mut self, stays: impl Fn(u64) -> bool) {
        self.0.retain(|pair| stays(*pair));
    }

    pub fn clear(&mut self) {
        self.0.clear();
    }
}
