use crate::contact::{BodyOperator, NO_BODY};

/// No block.
pub(super) const NOTHING: u32 = u32::MAX;

/// Groups of up to four blocks that share no body, for a sweep over four blocks at a time.
///
/// The blocks of each body stay in order: a block comes after the groups of all earlier blocks that
/// share a body with it. So a sweep over the groups equals the sweep over the blocks in their own
/// order, bit for bit. A sweep over the groups from the last to the first equals the backward
/// sweep. Each block goes to the first group with room that its bodies allow.
///
/// Graph colouring (each body at most once per colour, in any order) fills groups no better in
/// large islands and needs more sweeps: to 1e-2 in a tower of 100 boxes 11 801 against 3321 from a
/// cold start; to 1e-4 in a pyramid of 5050 boxes 1301 against 401 from impulses with an error of a
/// tenth.
///
/// # Source
/// List scheduling: Graham (1969).
#[derive(Debug, Clone, Default)]
pub(super) struct Groups {
    members: Vec<[u32; 4]>,
    /// Number of blocks in each group; 4 as well for a group reserved for a single block.
    taken: Vec<u8>,
    /// For each group, the first group from it on that may have room.
    next: Vec<u32>,
    /// For each body, the first group that its next block may go to.
    after: Vec<u32>,
}

/// Least distance between the groups of a body. A processor starts a group before it has finished
/// the last one, and at this distance it need not wait. About a tenth faster than a distance of 1
/// if there are many groups.
const DISTANCE: u32 = 2;

impl Groups {
    /// Groups the blocks of `op`, taken in this `order`. Each block for which `alone` returns true
    /// gets a group of its own.
    pub fn arrange(
        &mut self,
        op: &BodyOperator,
        order: impl Iterator<Item = usize>,
        alone: impl Fn(usize) -> bool,
    ) {
        let blocks = order.map(|i| (i, op.rows[i].bodies));
        self.arrange_pairs(op.inverse_mass.len(), blocks, alone);
    }

    /// As [`Groups::arrange`], for blocks and the numbers of their bodies, of `count` bodies.
    pub fn arrange_pairs(
        &mut self,
        count: usize,
        blocks: impl Iterator<Item = (usize, [u32; 2])>,
        alone: impl Fn(usize) -> bool,
    ) {
        self.members.clear();
        self.taken.clear();
        self.next.clear();
        self.after.clear();
        self.after.resize(count, 0);
        for (i, bodies) in blocks {
            let [a, b] = bodies.map(|body| self.after.get(body as usize));
            let earliest = a.max(b).map_or(0, |&group| group);
            let alone = alone(i);
            let group = if alone {
                earliest.max(self.members.len() as u32)
            } else {
                self.with_room(earliest)
            };
            while self.members.len() <= group as usize {
                self.next.push(self.members.len() as u32);
                self.members.push([NOTHING; 4]);
                self.taken.push(0);
            }
            let g = group as usize;
            self.members[g][usize::from(self.taken[g])] = i as u32;
            self.taken[g] = if alone { 4 } else { self.taken[g] + 1 };
            if self.taken[g] == 4 {
                self.next[g] = group + 1;
            }
            for body in bodies.into_iter().filter(|&b| b != NO_BODY) {
                self.after[body as usize] = group + DISTANCE;
            }
        }
        self.members.retain(|group| group[0] != NOTHING);
    }

    /// The groups in the order of a sweep; unused places hold [`NOTHING`].
    pub fn members(&self) -> &[[u32; 4]] {
        &self.members
    }

    /// The first group from `earliest` on with room. Compresses the paths it follows.
    fn with_room(&mut self, earliest: u32) -> u32 {
        let follow = |next: &[u32], group: u32| next.get(group as usize).map_or(group, |&g| g);
        let mut group = earliest;
        while follow(&self.next, group) != group {
            group = follow(&self.next, group);
        }
        let mut passed = earliest;
        while passed != group {
            let further = follow(&self.next, passed);
            self.next[passed as usize] = group;
            passed = further;
        }
        group
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Delassus;
    use crate::contact::examples::{heap, pyramid, tower};

    /// Groups all blocks and checks them: every block once, no body twice in a group, and the
    /// blocks of each body in order.
    fn arranged(op: &BodyOperator, alone: impl Fn(usize) -> bool) -> Vec<[u32; 4]> {
        let mut groups = Groups::default();
        // buffers filled by another problem change nothing
        let Delassus::Bodies(other) = tower(3, 0.5, |_| 1.0).problem().operator else {
            panic!("bodies");
        };
        groups.arrange(&other, 0..other.rows.len(), |i| i == 2);
        groups.arrange(op, 0..op.rows.len(), &alone);
        let mut seen = vec![false; op.rows.len()];
        let mut last = vec![None; op.inverse_mass.len()];
        for group in groups.members() {
            let blocks = group.iter().filter(|&&b| b != NOTHING);
            let moved = |&&b: &&u32| op.rows[b as usize].bodies.into_iter();
            let mut bodies: Vec<u32> = blocks.clone().flat_map(|b| moved(&b)).collect();
            bodies.retain(|&b| b != NO_BODY);
            let count = bodies.len();
            bodies.sort_unstable();
            bodies.dedup();
            assert_eq!(bodies.len(), count, "a body twice in {group:?}");
            for &block in blocks {
                assert!(!std::mem::replace(&mut seen[block as usize], true));
                assert!(!alone(block as usize) || group[1..] == [NOTHING; 3]);
                for body in op.rows[block as usize].bodies {
                    if let Some(last) = last.get_mut(body as usize) {
                        assert!(*last < Some(block), "body {body}: {last:?} before {block}");
                        *last = Some(block);
                    }
                }
            }
        }
        assert!(seen.iter().all(|seen| *seen));
        groups.members().to_vec()
    }

    #[test]
    fn groups_share_no_body_and_keep_the_order_of_each() {
        for (bodies, most) in [
            // share of lanes in use: largest in a heap, one in four in a tower
            (heap(20, 10, 0.5, 1.0, 3), 0.7),
            (pyramid(12, 0.5), 0.6),
            (tower(20, 0.5, |_| 1.0), 0.25),
        ] {
            let problem = bodies.problem();
            let Delassus::Bodies(op) = &problem.operator else {
                panic!("bodies");
            };
            let full = arranged(op, |_| false);
            let share = problem.len() as f64 / (4 * full.len()) as f64;
            assert!(share >= most, "{share}");
            arranged(op, |i| i % 5 == 0);
            arranged(op, |_| true);
        }
    }
}
