//! Values that are remembered for pairs of parts from one query to the next.

use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Values stored on pairs of parts, by [`super::rows::Row::order`]. A value lasts while the pair has contacts,
/// and is read once more when the pair has none. It does not last as long as the boxes overlap, as that
/// depends on earlier queries.
#[derive(Default)]
pub(super) struct Marks {
    now: FxHashMap<[u32; 4], u32>,
    /// The values of the last pass, if there are any, during a pass over all pairs. All threads read
    /// them.
    past: Option<Arc<FxHashMap<[u32; 4], u32>>>,
    /// Whether a pass is going on.
    passing: bool,
}

impl Marks {
    /// Starts a pass over all pairs: a value that the pass does not store again is dropped.
    pub fn begin(&mut self) {
        let now = std::mem::take(&mut self.now);
        self.past = (!now.is_empty()).then(|| Arc::new(now));
        self.passing = true;
    }

    /// Values for a part of a pass that has begun, over pairs of its own.
    pub fn begin_part(&mut self, pass: &Marks) {
        self.now.clear();
        self.past.clone_from(&pass.past);
        self.passing = true;
    }

    /// Takes over the values that a part of the pass has stored, and ends the part.
    pub fn end_part(&mut self, part: &mut Marks) {
        for (order, mark) in part.now.drain() {
            self.add(order, mark);
        }
        part.past = None;
    }

    /// Ends it.
    pub fn end(&mut self) {
        self.past = None;
        self.passing = false;
    }

    /// Whether the last pass stored values, during a pass.
    pub fn any_past(&self) -> bool {
        self.past.is_some()
    }

    pub fn is_empty(&self) -> bool {
        self.past.is_none() && self.now.is_empty()
    }

    /// Keeps the value of a pair that the pass does not look at.
    pub fn keep(&mut self, order: &[u32; 4]) {
        let known = self.get(order);
        self.set(*order, known);
    }

    /// All values, sorted: indices of colliders, numbers of parts, value.
    pub fn sorted(&self) -> Vec<([u32; 4], u32)> {
        let all = self.now.iter();
        let mut all: Vec<_> = all.map(|(order, mark)| (*order, *mark)).collect();
        all.sort_unstable();
        all
    }

    /// Drops the values of all other keys.
    pub fn retain(&mut self, keep: impl Fn(&[u32; 4]) -> bool) {
        self.now.retain(|order, _| keep(order));
    }

    pub fn restore(&mut self, marks: &[([u32; 4], u32)]) {
        self.now = marks.iter().copied().collect();
    }

    pub fn get(&self, order: &[u32; 4]) -> u32 {
        let past = self.past.as_ref().and_then(|past| past.get(order));
        let known = past.or_else(|| self.now.get(order));
        known.copied().unwrap_or(0)
    }

    /// The value before the pass that is going on: that of the pass so far depends on the order of pairs.
    pub fn before(&self, order: &[u32; 4]) -> u32 {
        let known = match (self.passing, &self.past) {
            (true, past) => past.as_ref().and_then(|past| past.get(order)),
            (false, _) => self.now.get(order),
        };
        known.copied().unwrap_or(0)
    }

    /// Adds bits to the value that this pass stores.
    pub fn add(&mut self, order: [u32; 4], bits: u32) {
        *self.now.entry(order).or_default() |= bits;
    }

    pub fn set(&mut self, order: [u32; 4], mark: u32) {
        match mark {
            0 => self.now.remove(&order),
            mark => self.now.insert(order, mark),
        };
    }
}
