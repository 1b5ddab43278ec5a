//! Sets of surface pairs: most are empty, and few are large.

use rustc_hash::FxHashMap;
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

/// The pairs of a step, to be asked for in nearly its order.
pub(super) struct KnownPairs<'a> {
    all: &'a [u64],
    /// Behind the pair found last.
    next: usize,
    /// Places in the list, built at the first use.
    index: Option<FxHashMap<u64, usize>>,
}

/// Number of pairs to compare before the index is used.
const AHEAD: usize = 4;

impl<'a> KnownPairs<'a> {
    pub fn new(all: &'a [u64]) -> Self {
        KnownPairs {
            all,
            next: 0,
            index: None,
        }
    }

    pub fn contains(&mut self, pair: u64) -> bool {
        // contacts of a pair follow each other
        let from = self.next.saturating_sub(1);
        let mut ahead = self.all.iter().skip(from).take(AHEAD + 1);
        let place = match ahead.position(|known| *known == pair) {
            Some(steps) => Some(from + steps),
            None => {
                let places = || self.all.iter().copied().zip(0..).collect();
                self.index.get_or_insert_with(places).get(&pair).copied()
            }
        };
        self.next = place.map_or(self.next, |at| at + 1);
        place.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In order, with pairs missing and new ones between, and backwards.
    #[test]
    fn pairs_are_known_in_any_order() {
        let all: Vec<u64> = (0..40).map(|k| 3 * k).collect();
        let orders: [Vec<u64>; 3] = [
            (0..130).collect(),
            (0..130).rev().collect(),
            vec![0, 0, 0, 99, 99, 3, 7, 117, 120, 6],
        ];
        for order in orders {
            let mut known = KnownPairs::new(&all);
            for pair in order {
                assert_eq!(known.contains(pair), all.contains(&pair), "{pair}");
            }
        }
    }
}
