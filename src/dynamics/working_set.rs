//! The working set: the blocks that take part in the contact problems of an interval. Distant
//! contacts are left out at first, and added if the solution would close them.

use super::interval::{Interval, with_block_rows};
use super::islands::Islands;
use super::outcome::IslandResult;
use super::solution::Solution;
use crate::contact::{Law, Vec2};
use crate::solver::SolveReport;

/// Some blocks of an interval, and the results of their islands.
///
/// Detection finds every contact that may close within a step for any motion of its neighbours: in
/// a heap about four for each one that does close. A contact without an impulse is left out if it
/// would open by more than the fastest contact of its island closes,
///
/// ```text
/// b_N > max(−b_N)   over the contacts of its island                          (1)
/// ```
///
/// It is added if the solution without it has `ξ_N < 0`. If no such contact is left, the impulses
/// of the set solve the whole problem: `P = 0` satisfies the law of all contacts left out.
#[derive(Default)]
pub(super) struct WorkingSet {
    included: Vec<bool>,
    round: usize,
    /// Blocks added in the last round.
    added: Vec<bool>,
    /// For each island its first block, and its result until it is solved again; sorted at the start of a
    /// round.
    solved: Vec<(u32, Option<IslandResult>)>,
}

/// After this many rounds all blocks are in the set.
const ROUNDS: usize = 4;

impl WorkingSet {
    /// Begins with all blocks of an interval.
    pub fn begin_with_all(&mut self, count: usize) {
        self.round = 0;
        self.included.clear();
        self.included.resize(count, true);
        self.added.clear();
        self.solved.clear();
    }

    /// Goes on with further blocks: only islands with one of them are solved again.
    pub fn add(&mut self, count: usize) {
        let before = self.included.len();
        self.round = 1;
        self.included.resize(count, true);
        self.added.clear();
        self.added.resize(before, false);
        self.added.resize(count, true);
    }

    /// Begins with the blocks that (1) leaves in, with `islands` of all blocks.
    pub fn begin_with_near(&mut self, interval: &Interval, islands: &Islands) {
        let count = interval.blocks.len();
        self.begin_with_all(count);
        let included = &mut self.included;
        for k in 0..islands.len() {
            let members = islands.blocks(k);
            let opening = |i: &u32| interval.bias[*i as usize].x;
            let closing = members.iter().map(|i| -opening(i)).fold(0.0, f64::max);
            for i in members {
                let idle = interval.warm[*i as usize] == Vec2::zeros();
                let contact = matches!(interval.laws[*i as usize], Law::Contact { .. });
                included[*i as usize] = !(contact && idle && opening(i) > closing);
            }
        }
        if included.contains(&false) {
            self.added.resize(count, false);
        }
    }

    /// Groups the blocks of the set into islands; on entry `islands` are those of all blocks.
    /// Returns whether the set contains all blocks.
    pub fn group(&self, interval: &Interval, islands: &mut Islands, bodies: usize) -> bool {
        let all = !self.included.contains(&false);
        if !all || self.round > 0 {
            let included = (0..self.included.len() as u32).filter(|&i| self.included[i as usize]);
            let included: Vec<u32> = included.collect();
            islands.build_of(bodies, &included, &interval.sides);
        }
        all
    }

    /// The work on earlier parts of an island if it must be solved; `None` if it is already solved.
    pub fn begin(&mut self, members: &[u32]) -> Option<Vec<SolveReport>> {
        if self.round == 0 {
            return Some(Vec::new());
        }
        if !members.iter().any(|i| self.added[*i as usize]) {
            return None;
        }
        let solved = &mut self.solved;
        let part = |i: &u32| {
            let k = solved.binary_search_by_key(i, |(first, _)| *first).ok()?;
            solved[k].1.take()
        };
        let parts = members.iter().filter_map(part);
        Some(parts.map(|part| part.outcome.report).collect())
    }

    /// Stores the result of the island with this first block.
    pub fn store(&mut self, first: u32, result: IslandResult) {
        self.solved.push((first, Some(result)));
    }

    /// The results of all islands, in the order of their first blocks.
    pub fn results(&mut self) -> impl Iterator<Item = &IslandResult> {
        self.sort();
        self.solved.iter().filter_map(|(_, result)| result.as_ref())
    }

    /// Sorts the results that count.
    fn sort(&mut self) {
        self.solved.retain(|(_, result)| result.is_some());
        self.solved.sort_by_key(|(first, _)| *first);
    }

    /// Adds the contacts that would close at the end velocities. Returns whether there were none.
    pub fn include_closed(&mut self, interval: &Interval, solution: &Solution) -> bool {
        self.round += 1;
        self.sort();
        self.added.fill(false);
        let mut complete = true;
        for i in 0..self.included.len() {
            if self.included[i] {
                continue;
            }
            let (block, sides) = (&interval.blocks[i], interval.sides[i]);
            let change = with_block_rows(&interval.detection, block, sides, |rows| {
                rows.velocity(&solution.end).x - rows.velocity(&interval.free).x
            });
            if interval.bias[i].x + change < 0.0 {
                complete = false;
                (self.included[i], self.added[i]) = (true, true);
            }
        }
        if !complete && self.round == ROUNDS {
            for i in 0..self.included.len() {
                self.added[i] |= !self.included[i];
                self.included[i] = true;
            }
        }
        complete
    }
}
