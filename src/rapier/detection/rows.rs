//! Pairs of parts whose fat boxes overlap, in the order of their contacts.

use super::super::joints::OUTSIDE;
use super::leaves::Name;
use rustc_hash::FxHashSet;

/// Two parts whose fat boxes overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    /// The leaf of the lower collider first, as in rapier.
    pub leaves: [u32; 2],
    /// Travelled distance \[m\] of the two together below which they are out of reach.
    pub budget: f64,
}

/// Sort key of pairs of parts: colliders, then parts, which do not depend on history. The leaves
/// come last and make keys unique.
type Key = [u64; 3];

impl Row {
    fn of(key: &Key) -> Row {
        Row {
            leaves: [(key[2] >> 32) as u32, key[2] as u32],
            budget: f64::NEG_INFINITY,
        }
    }

    #[inline]
    fn key(&self, names: &[Name]) -> Key {
        let [a, b] = self.leaves;
        let (one, two) = (&names[a as usize], &names[b as usize]);
        [(one.slot, two.slot), (one.sub, two.sub), (a, b)]
            .map(|(high, low)| u64::from(high) << 32 | u64::from(low))
    }

    /// Indices of both colliders, then numbers of both parts: identifies a pair between steps.
    pub fn order(leaves: [u32; 2], names: &[Name]) -> [u32; 4] {
        let [one, two] = leaves.map(|leaf| &names[leaf as usize]);
        [one.slot, two.slot, one.sub, two.sub]
    }
}

/// All pairs of parts, sorted.
#[derive(Default)]
pub(super) struct Rows {
    list: Vec<Row>,
    /// Pairs added since the last sort.
    fresh: Vec<Key>,
}

impl Rows {
    /// Adds a pair of near leaves, unless they can never meet.
    pub fn add(&mut self, a: u32, b: u32, names: &[Name]) {
        let (one, two) = (&names[a as usize], &names[b as usize]);
        if one.slot == two.slot || one.body == two.body && one.body != OUTSIDE {
            return;
        }
        let leaves = if one.slot < two.slot { [a, b] } else { [b, a] };
        let row = Row {
            leaves,
            budget: f64::NEG_INFINITY,
        };
        self.fresh.push(row.key(names));
    }

    /// Merges the added pairs into the sorted list. Drops duplicates: boxes may part and meet again
    /// before their row is visited.
    pub fn sort(&mut self, names: &[Name]) {
        let (rows, fresh) = (&mut self.list, &mut self.fresh);
        fresh.sort_unstable();
        fresh.dedup();
        let (mut places, mut at) = (Vec::with_capacity(fresh.len()), 0);
        fresh.retain(|key| {
            at += below(&rows[at..], key, names);
            let is_new = rows.get(at).is_none_or(|row| row.key(names) != *key);
            if is_new {
                places.push(at);
            }
            is_new
        });
        let mut end = rows.len();
        rows.extend(fresh.iter().map(Row::of));
        for (k, (new, &place)) in fresh.iter().zip(&places).enumerate().rev() {
            rows.copy_within(place..end, place + k + 1);
            rows[place + k] = Row::of(new);
            end = place;
        }
        fresh.clear();
    }

    pub fn clear(&mut self) {
        self.list.clear();
        self.fresh.clear();
    }

    /// Removes all pairs of these leaves, and calls `dropped` for each.
    pub fn forget(&mut self, gone: &FxHashSet<u32>, mut dropped: impl FnMut([u32; 2])) {
        self.list.retain(|row| {
            let stays = row.leaves.iter().all(|leaf| !gone.contains(leaf));
            if !stays {
                dropped(row.leaves);
            }
            stays
        });
    }

    pub fn iter(&self) -> impl Iterator<Item = &Row> {
        self.list.iter()
    }

    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Visits all pairs in their order, see [`retain`].
    pub fn retain(&mut self, look: impl FnMut([u32; 2], f64) -> Option<f64>) {
        let kept = retain(&mut self.list, look);
        self.list.truncate(kept);
    }

    /// Splits the pairs near these places, of which the last is their number. No two parts have pairs
    /// of the same two colliders: what is found for a pair depends on others of its colliders.
    pub fn split(&mut self, ends: &[usize], names: &[Name]) -> Vec<&mut [Row]> {
        let of = |row: &Row| row.leaves.map(|leaf| names[leaf as usize].slot);
        let (mut rest, mut start) = (self.list.as_mut_slice(), 0);
        let mut found = Vec::with_capacity(ends.len());
        for end in ends {
            let mut end = end.saturating_sub(start).min(rest.len());
            while end > 0 && end < rest.len() && of(&rest[end - 1]) == of(&rest[end]) {
                end += 1;
            }
            let (part, others) = rest.split_at_mut(end);
            (rest, start) = (others, start + end);
            found.push(part);
        }
        found
    }

    /// Drops what [`retain`] has left over in parts of these lengths, of which it has kept so many.
    pub fn close_up(&mut self, parts: impl Iterator<Item = (usize, usize)>) {
        let (mut start, mut end) = (0, 0);
        for (length, kept) in parts {
            self.list.copy_within(start..start + kept, end);
            (start, end) = (start + length, end + kept);
        }
        self.list.truncate(end);
    }

    /// The pairs of parts of two colliders.
    pub fn between(&self, slots: [u32; 2], names: &[Name]) -> impl Iterator<Item = &Row> {
        let of = move |row: &Row| row.leaves.map(|leaf| names[leaf as usize].slot);
        let start = self.list.partition_point(|row| of(row) < slots);
        self.list[start..]
            .iter()
            .take_while(move |row| of(row) == slots)
    }
}

/// Visits some pairs in their order. `look` receives the leaves and the budget of a pair and returns
/// its new budget, or `None` to drop the pair. Returns how many pairs it keeps: they come first.
pub(super) fn retain(
    rows: &mut [Row],
    mut look: impl FnMut([u32; 2], f64) -> Option<f64>,
) -> usize {
    let mut end = 0;
    for k in 0..rows.len() {
        // by value: reading a row as a whole just after writing its halves would stall
        let Row { leaves, budget } = rows[k];
        if let Some(budget) = look(leaves, budget) {
            rows[end] = Row { leaves, budget };
            end += 1;
        }
    }
    end
}

/// Number of rows before a key. A galloping search from the front, where memory is read anyway.
fn below(rows: &[Row], key: &Key, names: &[Name]) -> usize {
    let before = |row: &Row| row.key(names) < *key;
    let mut step = 1;
    while rows.get(step).is_some_and(before) {
        step *= 2;
    }
    let (low, high) = (step / 2, rows.len().min(step));
    low + rows[low..high].partition_point(before)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// New pairs are merged at their place, once; a pair that was there keeps its budget.
    #[test]
    fn new_rows_are_merged_and_none_stands_twice() {
        let mut rows = Rows::default();
        // leaves are numbered in another order than colliders
        let names = (0..40).map(|leaf| Name {
            slot: (7 * leaf) % 40,
            sub: 0,
            body: leaf,
        });
        let names: Vec<_> = names.collect();
        for stride in [7, 3, 11, 2, 5, 1] {
            let before = rows.list.len();
            rows.retain(|_, _| Some(1.0));
            let all = (0..40u32).flat_map(|b| (0..b).map(move |a| [a, b]));
            let new: Vec<_> = all.filter(|[a, b]| (3 * a + 7 * b) % stride == 0).collect();
            new.iter().rev().for_each(|[a, b]| rows.add(*a, *b, &names));
            rows.add(new[0][1], new[0][0], &names);
            rows.sort(&names);
            let key = |row: &Row| row.key(&names);
            assert!(rows.list.is_sorted_by(|one, two| key(one) < key(two)));
            let low_first =
                |row: &Row| Row::order(row.leaves, &names)[0] < Row::order(row.leaves, &names)[1];
            assert!(rows.iter().all(low_first));
            let old = rows.iter().filter(|row| row.budget == 1.0);
            assert_eq!(old.count(), before);
            let same = |row: &Row, pair: &[u32; 2]| pair.iter().all(|l| row.leaves.contains(l));
            assert!(
                new.iter()
                    .all(|pair| rows.iter().any(|row| same(row, pair)))
            );
        }
        assert_eq!(rows.list.len(), 40 * 39 / 2);
        let between = rows.between([3, 9], &names);
        assert_eq!(
            between
                .map(|row| Row::order(row.leaves, &names))
                .collect::<Vec<_>>(),
            [[3, 9, 0, 0]]
        );
    }

    /// No part begins within the pairs of two colliders; what a visit drops is gone, the rest in order.
    #[test]
    fn parts_end_between_colliders_and_close_up() {
        // 60 leaves, of which collider 5 has 40
        let slot = |leaf: u32| if leaf < 40 { 5 } else { leaf - 30 };
        let names = (0..60).map(|leaf| Name {
            slot: slot(leaf),
            sub: leaf,
            body: slot(leaf),
        });
        let names: Vec<_> = names.collect();
        for parts in [1, 2, 3, 7, 100, 2000] {
            let (mut one, mut several) = (Rows::default(), Rows::default());
            for rows in [&mut one, &mut several] {
                let all = (0..60u32).flat_map(|b| (0..b).map(move |a| [a, b]));
                all.for_each(|[a, b]| rows.add(a, b, &names));
                rows.sort(&names);
            }
            let look = |[a, b]: [u32; 2], _| ((a + b) % 3 > 0).then(|| f64::from(a));
            one.retain(look);
            let count = several.len();
            let ends: Vec<_> = (1..=parts).map(|k| k * count / parts).collect();
            let slices = several.split(&ends, &names);
            assert_eq!(slices.len(), parts);
            let ends: Vec<_> = slices
                .iter()
                .filter_map(|part| Some([part.first()?, part.last()?]))
                .map(|ends| ends.map(|row| row.leaves.map(|leaf| names[leaf as usize].slot)))
                .collect();
            assert!(ends.windows(2).all(|two| two[0][1] < two[1][0]));
            let kept: Vec<_> = slices
                .into_iter()
                .map(|part| (part.len(), retain(part, look)))
                .collect();
            several.close_up(kept.into_iter());
            assert_eq!(one.list, several.list);
        }
    }
}
