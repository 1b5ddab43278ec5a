//! Groups of bodies that share contacts: each is a contact problem of its own.

use crate::contact::NO_BODY;

/// Splits blocks of rows into islands of connected bodies.
#[derive(Debug, Clone, Default)]
pub(crate) struct Islands {
    parent: Vec<u32>,
    /// Blocks grouped by island: `blocks[start\[k\]..start[k + 1]]`, ascending within an island.
    blocks: Vec<u32>,
    start: Vec<u32>,
    /// Input of the last build: the bodies of each block, and the block numbers if only some take
    /// part.
    pairs: Vec<[u32; 2]>,
    some: Vec<u32>,
    /// Whether all blocks are one island.
    merged: bool,
}

impl Islands {
    /// Groups blocks by the two bodies of each, with `bodies` bodies in all. Islands are in the
    /// order of their first blocks.
    pub fn build(&mut self, bodies: usize, rows: impl ExactSizeIterator<Item = [u32; 2]> + Clone) {
        if !self.is_current(bodies, &[], rows.clone()) {
            self.find_all(bodies, rows);
            self.some.clear();
        }
    }

    /// Whether all blocks are one island from the next build on.
    pub fn merge_all(&mut self, merged: bool) {
        if self.merged != merged {
            self.merged = merged;
            self.start.clear();
        }
    }

    /// Whether the last build had the same input, as in most steps.
    fn is_current(
        &self,
        bodies: usize,
        some: &[u32],
        rows: impl ExactSizeIterator<Item = [u32; 2]>,
    ) -> bool {
        !self.start.is_empty()
            && self.parent.len() == bodies
            && self.some == some
            && self.pairs.len() == rows.len()
            && rows.eq(self.pairs.iter().copied())
    }

    fn find_all(&mut self, bodies: usize, rows: impl ExactSizeIterator<Item = [u32; 2]> + Clone) {
        let count_of_blocks = rows.len();
        self.pairs.clear();
        self.pairs.extend(rows.clone());
        self.parent.clear();
        self.parent.extend(0..bodies as u32);
        for [a, b] in rows.clone() {
            if a != NO_BODY && b != NO_BODY {
                let (a, b) = (self.find(a), self.find(b));
                self.parent[a.max(b) as usize] = a.min(b);
            }
        }
        let mut number = vec![u32::MAX; bodies];
        let mut count: Vec<u32> = Vec::new();
        let mut of_block = Vec::with_capacity(count_of_blocks);
        for [a, b] in rows {
            let root = match self.merged {
                true => 0,
                false => self.find(if a != NO_BODY { a } else { b }) as usize,
            };
            if number[root] == u32::MAX {
                number[root] = count.len() as u32;
                count.push(0);
            }
            count[number[root] as usize] += 1;
            of_block.push(number[root]);
        }
        self.start.clear();
        self.start.push(0);
        for &c in &count {
            self.start.push(self.start[self.start.len() - 1] + c);
        }
        let mut next = self.start.clone();
        self.blocks.clear();
        self.blocks.resize(count_of_blocks, 0);
        for (block, &island) in of_block.iter().enumerate() {
            let slot = &mut next[island as usize];
            self.blocks[*slot as usize] = block as u32;
            *slot += 1;
        }
    }

    /// Groups only some blocks, given by their numbers.
    pub fn build_of(&mut self, bodies: usize, some: &[u32], rows: &[[u32; 2]]) {
        let rows = some.iter().map(|&i| rows[i as usize]);
        if self.is_current(bodies, some, rows.clone()) {
            return;
        }
        self.find_all(bodies, rows);
        for block in &mut self.blocks {
            *block = some[*block as usize];
        }
        self.some.clear();
        self.some.extend_from_slice(some);
    }

    /// Number of islands.
    pub fn len(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// The blocks of island `k`, ascending.
    pub fn blocks(&self, k: usize) -> &[u32] {
        &self.blocks[self.start[k] as usize..self.start[k + 1] as usize]
    }

    fn find(&mut self, mut body: u32) -> u32 {
        while self.parent[body as usize] != body {
            let up = self.parent[body as usize];
            self.parent[body as usize] = self.parent[up as usize];
            body = self.parent[body as usize];
        }
        body
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_supports_do_not_join_islands() {
        let mut islands = Islands::default();
        let all = [[NO_BODY, 3], [0, 1], [NO_BODY, 1], [2, 3]];
        islands.build(5, all.into_iter());
        assert_eq!(islands.len(), 2);
        assert_eq!(islands.blocks(0), &[0, 3]);
        assert_eq!(islands.blocks(1), &[1, 2]);
    }

    /// A rebuild from the same blocks, some of them or others equals a new build.
    #[test]
    fn what_was_built_before_does_not_matter() {
        let all = [[NO_BODY, 3], [0, 1], [NO_BODY, 1], [2, 3], [0, 2]];
        let mut reused = Islands::default();
        let lists = |islands: &Islands| -> Vec<Vec<u32>> {
            (0..islands.len())
                .map(|k| islands.blocks(k).to_vec())
                .collect()
        };
        let choices: [&[u32]; 8] = [
            &[],
            &[0, 1, 3],
            &[0, 1, 3],
            &[],
            &[1, 2, 4],
            &[1, 2, 3],
            &[0],
            &[0, 1, 2, 3, 4],
        ];
        for some in choices {
            let mut fresh = Islands::default();
            for islands in [&mut reused, &mut fresh] {
                match some {
                    [] => islands.build(4, all.into_iter()),
                    _ => islands.build_of(4, some, &all),
                }
            }
            assert_eq!(lists(&reused), lists(&fresh), "{some:?}");
        }
        reused.build(5, [].into_iter());
        assert_eq!(reused.len(), 0);
    }
}
