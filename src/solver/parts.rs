use crate::contact::{BodyOperator, NO_BODY};

/// Stands for a body of no part.
pub(super) const BETWEEN: u32 = u32::MAX;

/// The bodies of a problem in parts of about as many blocks each, with few blocks between the parts.
///
/// Threads sweep the parts at the same time, and the caller's thread what lies between them. The parts
/// do not depend on the number of threads.
///
/// Bodies are put in the order in which a search in breadth from one end of the heap meets them, and this
/// order is cut: then a cut goes through few contacts. The end is the body that a search from any body
/// meets last. A body that touches very many others, as a drum does, belongs to no part: through it all
/// others would be near each other.
///
/// # Source
/// The search, twice, is that of the pseudo-peripheral node of Gibbs, Poole & Stockmeyer (1976).
#[derive(Debug, Clone, Default)]
pub(super) struct Parts {
    /// For each body, its part, or [`BETWEEN`].
    of_body: Vec<u32>,
    count: usize,
    /// Of each body, the first of its neighbours in the list.
    first: Vec<u32>,
    near: Vec<u32>,
    order: Vec<u32>,
    seen: Vec<bool>,
}

/// Least blocks of a part: some 20 µs a sweep. Smaller parts have more blocks between them.
const BLOCKS: usize = 3000;
/// Blocks from which on a problem has several parts.
pub(crate) const SEVERAL: usize = 2 * BLOCKS;
/// Most parts.
const MOST: usize = 16;
/// Blocks between a body and others that can move, above which it belongs to no part.
const MANY: u32 = 64;

impl Parts {
    /// Splits the bodies of `op`.
    pub fn split(&mut self, op: &BodyOperator) {
        let (bodies, blocks) = (op.inverse_mass.len(), op.rows.len());
        // a power of two, so that two or four threads have as many parts each
        self.count = match (blocks / BLOCKS).min(MOST) {
            0 => 1,
            parts => 1 << parts.ilog2(),
        };
        self.of_body.clear();
        self.of_body.resize(bodies, 0);
        if self.count == 1 {
            return;
        }
        self.neighbours(op);
        self.search(0);
        if let Some(&last) = self.order.last() {
            self.search(last);
        }
        // cut where the blocks so far reach the share of a part
        let weight = |k: u32| u64::from(self.first[k as usize + 1] - self.first[k as usize]) + 1;
        let all: u64 = self.order.iter().map(|&k| weight(k)).sum();
        let mut before = 0;
        for &k in &self.order {
            let part = before * self.count as u64 / all.max(1);
            before += weight(k);
            self.of_body[k as usize] = part as u32;
        }
    }

    /// Number of parts.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The part of a body, or [`BETWEEN`].
    pub fn of(&self, body: u32) -> u32 {
        self.of_body[body as usize]
    }

    /// The part in which a block between two bodies lies, or [`BETWEEN`].
    pub fn of_block(&self, bodies: [u32; 2]) -> u32 {
        let [a, b] = bodies.map(|body| (body != NO_BODY).then(|| self.of(body)));
        match (a, b) {
            (Some(a), Some(b)) if a != b => BETWEEN,
            (a, b) => a.or(b).unwrap_or(0),
        }
    }

    /// Lists the neighbours of every body. Those with very many belong to no part.
    fn neighbours(&mut self, op: &BodyOperator) {
        let movable = || {
            let both = |bodies: &[u32; 2]| bodies.iter().all(|b| *b != NO_BODY);
            op.rows.iter().map(|rows| rows.bodies).filter(both)
        };
        let first = &mut self.first;
        first.clear();
        first.resize(op.inverse_mass.len() + 1, 0);
        for body in movable().flatten() {
            first[body as usize + 1] += 1;
        }
        for (part, count) in self.of_body.iter_mut().zip(&first[1..]) {
            *part = if *count > MANY { BETWEEN } else { 0 };
        }
        for k in 1..first.len() {
            first[k] += first[k - 1];
        }
        self.near.clear();
        self.near.resize(first.last().map_or(0, |n| *n as usize), 0);
        // each start moves on to the end, and is that of the next body then
        for [a, b] in movable() {
            for (body, other) in [(a, b), (b, a)] {
                let at = &mut first[body as usize];
                self.near[*at as usize] = other;
                *at += 1;
            }
        }
        first.rotate_right(1);
        first[0] = 0;
    }

    /// Orders the bodies by a search in breadth from `start`, and from the next one where it ends.
    fn search(&mut self, start: u32) {
        let bodies = self.of_body.len() as u32;
        self.order.clear();
        self.seen.clear();
        (self.seen).extend(self.of_body.iter().map(|part| *part == BETWEEN));
        let mut next = 0;
        for root in std::iter::once(start).chain(0..bodies) {
            if self.seen.get(root as usize).is_none_or(|seen| *seen) {
                continue;
            }
            self.seen[root as usize] = true;
            self.order.push(root);
            while let Some(&k) = self.order.get(next) {
                next += 1;
                let [from, to] = [k, k + 1].map(|k| self.first[k as usize] as usize);
                for &other in &self.near[from..to] {
                    if !std::mem::replace(&mut self.seen[other as usize], true) {
                        self.order.push(other);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Delassus;
    use crate::contact::examples::heap;

    /// Parts of a large heap have about as many blocks each, few lie between them, and a small heap is one.
    #[test]
    fn a_heap_is_cut_through_few_contacts() {
        for (size, parts) in [((60, 60), 2..=16), ((10, 10), 1..=1)] {
            let problem = heap(size.0, size.1, 0.5, 1.0, 3).problem();
            let Delassus::Bodies(op) = &problem.operator else {
                panic!("bodies");
            };
            let mut split = Parts::default();
            split.split(op);
            assert!(parts.contains(&split.count()), "{}", split.count());
            let mut blocks = vec![0; split.count()];
            let mut between = 0;
            for rows in &op.rows {
                match split.of_block(rows.bodies) {
                    BETWEEN => between += 1,
                    part => blocks[part as usize] += 1,
                }
            }
            let mean = op.rows.len() as f64 / split.count() as f64;
            println!("{} blocks: {blocks:?}, between {between}", op.rows.len());
            assert!(between as f64 <= 0.12 * op.rows.len() as f64, "{between}");
            for own in blocks {
                assert!(
                    own as f64 > 0.6 * mean && (own as f64) < 1.2 * mean,
                    "{own} {mean}"
                );
            }
        }
    }
}
