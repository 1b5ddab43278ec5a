use crate::contact::{BodyOperator, NO_BODY};

/// No block.
pub(super) const NOTHING: u32 = u32::MAX;

/// Blocks in groups of up to four that share no body, for a sweep that takes four at a time.
///
/// The order of all blocks of a body is kept: a block comes after the groups of all earlier ones
/// that share a body with it. So a sweep over the groups is the sweep over the blocks in their own
/// order, bit for bit, and one over the groups from the last to the first is the sweep backwards.
/// Each block goes to the first group with room that its bodies allow.
///
/// Colours (a body once a colour, whatever the order) leave groups no fuller in large islands, and
/// cost sweeps: to 1e-2 in a tower of 100 boxes 11 801 against 3321 from nothing, to 1e-4 in a pyramid
/// of 5050 1301 against 401 from impulses that are off by a tenth.
///
/// # Source
/// List scheduling: Graham (1969).
#[derive(Debug, Clone, Default)]
pub(super) struct Groups {
    members: Vec<[u32; 4]>,
    /// How many blocks a group holds; 4 also where its one block wants to be alone.
    taken: Vec<u8>,
    /// The first group from this one on that may have room.
    next: Vec<u32>,
    /// The first group that the next block of a body may go to.
    after: Vec<u32>,
}

/// How much later the next group of a body is, at least: a processor begins with a group before the
/// last one is done, and here need not wait for it. Some tenth faster than 1 where groups are many.
const DISTANCE: u32 = 2;

impl Groups {
    /// Groups of the blocks of `op`; those that `alone` tells have one to themselves.
    pub fn arrange(&mut self, op: &BodyOperator, alone: impl Fn(usize) -> bool) {
        self.members.clear();
        self.taken.clear();
        self.next.clear();
        self.after.clear();
        self.after.resize(op.inverse_mass.len(), 0);
        for (i, rows) in op.rows.iter().enumerate() {
            let [a, b] = rows.bodies.map(|body| self.after.get(body as usize));
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
            for body in rows.bodies.into_iter().filter(|&b| b != NO_BODY) {
                self.after[body as usize] = group + DISTANCE;
            }
        }
        self.members.retain(|group| group[0] != NOTHING);
    }

    /// The groups in the order of a sweep; what is left of a group is [`NOTHING`].
    pub fn members(&self) -> &[[u32; 4]] {
        &self.members
    }

    /// The first group from `earliest` on with room. Shortens the ways that it goes.
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

    /// Groups of all blocks, checked: every block once, no body twice in a group, and a body's
    /// blocks in their order.
    fn arranged(op: &BodyOperator, alone: impl Fn(usize) -> bool) -> Vec<[u32; 4]> {
        let mut groups = Groups::default();
        // buffers of another problem change nothing
        let Delassus::Bodies(other) = tower(3, 0.5, |_| 1.0).problem().operator else {
            panic!("bodies");
        };
        groups.arrange(&other, |i| i == 2);
        groups.arrange(op, &alone);
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
            // lanes in use: most in a heap, one in a tower
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
