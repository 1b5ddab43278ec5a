//! What is remembered of contacts and joints from one step to the next.

use super::joint_cap::Account;
use super::model::ContactKey;
use crate::contact::Vec2;
use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};
use std::cell::{Cell, OnceCell};

/// What is kept of a contact from one step to the next.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Memory {
    /// [N s], in an interval of length `dt`.
    #[serde(with = "super::saved::pair")]
    pub impulse: Vec2,
    #[serde(with = "super::saved::endless")]
    pub dt: f64,
    /// Tangential velocity at the end of it, if it stuck.
    pub stuck: Option<f64>,
    /// Whether it was a rebound: no load that goes on.
    pub rebounded: bool,
    /// Of a joint: its share of what its island's joints have put in.
    pub account: Account,
}

/// What is remembered of all contacts and joints, in the order in which a step met them.
///
/// The next step meets nearly the same ones in nearly the same order: each is looked for behind the
/// one found last, and only what is not there by its key.
#[derive(Debug, Clone, Default)]
pub(super) struct Memories {
    entries: Vec<(ContactKey, Memory)>,
    /// Behind the entry found last.
    next: Cell<usize>,
    /// Made when it is first needed.
    index: OnceCell<FxHashMap<ContactKey, u32>>,
}

/// Entries looked at before the index is asked.
const AHEAD: usize = 4;

impl Memories {
    pub fn get(&self, key: &ContactKey) -> Option<&Memory> {
        // behind the last one a new round begins
        let from = self.next.get() % self.entries.len().max(1);
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
        self.next.set(found + 1);
        Some(&self.entries[found].1)
    }

    /// Adds what is not there yet.
    pub fn push(&mut self, key: ContactKey, memory: Memory) {
        self.index.take();
        self.entries.push((key, memory));
    }

    /// Adds `memory`, or puts it in the place of what is there.
    pub fn insert(&mut self, key: ContactKey, memory: Memory) {
        match self.entries.iter_mut().find(|(k, _)| *k == key) {
            Some(entry) => entry.1 = memory,
            None => self.push(key, memory),
        }
    }

    pub fn clear(&mut self) {
        self.entries.clear();
        self.next.set(0);
        self.index.take();
    }

    pub fn entries(&self) -> &[(ContactKey, Memory)] {
        &self.entries
    }

    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut Memory> {
        self.entries.iter_mut().map(|(_, memory)| memory)
    }
}

impl FromIterator<(ContactKey, Memory)> for Memories {
    fn from_iter<I: IntoIterator<Item = (ContactKey, Memory)>>(all: I) -> Self {
        Memories {
            entries: all.into_iter().collect(),
            ..Memories::default()
        }
    }
}

impl Extend<(ContactKey, Memory)> for Memories {
    fn extend<I: IntoIterator<Item = (ContactKey, Memory)>>(&mut self, all: I) {
        self.index.take();
        self.entries.extend(all);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(feature: u64) -> ContactKey {
        ContactKey { pair: 7, feature }
    }

    fn memory(load: f64) -> Memory {
        Memory {
            impulse: Vec2::new(load, 0.0),
            dt: 0.01,
            stuck: None,
            rebounded: false,
            account: Account::default(),
        }
    }

    /// In order, backwards, with gaps, and what is not there; an entry that came later counts.
    #[test]
    fn everything_is_found_in_any_order() {
        let mut memories: Memories = (0..20).map(|k| (key(k), memory(k as f64))).collect();
        let orders: [Vec<u64>; 3] = [
            (0..20).collect(),
            (0..20).rev().collect(),
            vec![0, 1, 9, 10, 3, 30, 4, 19],
        ];
        for order in orders {
            for k in order {
                let found = memories.get(&key(k)).map(|m| m.impulse.x);
                assert_eq!(found, (k < 20).then_some(k as f64), "{k}");
            }
        }
        memories.insert(key(3), memory(-3.0));
        memories.insert(key(40), memory(40.0));
        assert_eq!(memories.entries().len(), 21);
        for (k, load) in [(40, 40.0), (3, -3.0), (4, 4.0)] {
            assert_eq!(memories.get(&key(k)).map(|m| m.impulse.x), Some(load));
        }
        memories.clear();
        assert!(memories.get(&key(4)).is_none());
    }
}
