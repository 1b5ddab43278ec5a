//! The blocks of an interval that its contact problems are made of: contacts that are far away are
//! left out, and taken in where the solution shows that they were needed.

use super::interval::Interval;
use super::islands::Islands;
use super::outcome::IslandResult;
use super::solution::Solution;
use crate::contact::{Law, Vec2};
use crate::solver::SolveReport;
use std::collections::BTreeMap;

/// Some blocks of an interval, and what is known of their islands.
///
/// Detection finds all contacts that may close within a step, however their neighbours are thrown
/// about: in a heap four for each that does. One without an impulse is left out if it would open by
/// more than the fastest contact of its island closes,
///
/// ```text
/// b_N > max(−b_N)   over the contacts of its island                          (1)
/// ```
///
/// and is taken in if the solution without it has `ξ_N < 0`. Where none has, the impulses of the
/// set solve the whole: `P = 0` solves the law of those that are left out.
pub(super) struct WorkingSet {
    taken: Vec<bool>,
    round: usize,
    /// Those taken in by the last round.
    added: Vec<bool>,
    /// Of each island its first block, and what became of it.
    solved: BTreeMap<u32, IslandResult>,
}

/// Rounds after which nothing is left out any more.
const ROUNDS: usize = 4;

impl WorkingSet {
    /// What is left by (1), with the islands of all blocks.
    pub fn near(interval: &Interval, islands: &Islands) -> WorkingSet {
        let count = interval.blocks.len();
        let mut taken = vec![true; count];
        for k in 0..islands.len() {
            let members = islands.blocks(k);
            let opening = |i: &u32| interval.bias[*i as usize].x;
            let closing = members.iter().map(|i| -opening(i)).fold(0.0, f64::max);
            for i in members {
                let idle = interval.warm[*i as usize] == Vec2::zeros();
                let contact = matches!(interval.laws[*i as usize], Law::Contact { .. });
                taken[*i as usize] = !(contact && idle && opening(i) > closing);
            }
        }
        WorkingSet {
            round: 0,
            added: vec![false; if taken.contains(&false) { count } else { 0 }],
            solved: BTreeMap::new(),
            taken,
        }
    }

    /// Groups the blocks of the set into islands; at first `islands` are those of all blocks.
    /// Whether the set is all blocks.
    pub fn group(&self, interval: &Interval, islands: &mut Islands, bodies: usize) -> bool {
        let taken = (0..self.taken.len() as u32).filter(|&i| self.taken[i as usize]);
        let taken: Vec<u32> = taken.collect();
        let all = taken.len() == self.taken.len();
        if !all || self.round > 0 {
            islands.build_of(bodies, &taken, &interval.sides);
        }
        all
    }

    /// The work spent on parts of an island, if it is to be solved; `None` if it was solved already.
    pub fn begin(&mut self, members: &[u32]) -> Option<Vec<SolveReport>> {
        if self.round == 0 {
            return Some(Vec::new());
        }
        if !members.iter().any(|i| self.added[*i as usize]) {
            return None;
        }
        let parts = members.iter().filter_map(|i| self.solved.remove(i));
        Some(parts.map(|part| part.outcome.report).collect())
    }

    /// Keeps the result of the island with this first block.
    pub fn keep(&mut self, first: u32, result: IslandResult) {
        self.solved.insert(first, result);
    }

    /// The results of all islands, in the order of their first blocks.
    pub fn into_results(self) -> impl Iterator<Item = IslandResult> {
        self.solved.into_values()
    }

    /// Takes in the contacts that would be closed at the end velocities. Whether there were none.
    pub fn take_closed(&mut self, interval: &Interval, solution: &Solution) -> bool {
        self.round += 1;
        self.added.fill(false);
        let mut complete = true;
        for i in 0..self.taken.len() {
            if self.taken[i] {
                continue;
            }
            let rows = interval.rows(i);
            let change = rows.velocity(&solution.end).x - rows.velocity(&interval.free).x;
            if interval.bias[i].x + change < 0.0 {
                complete = false;
                (self.taken[i], self.added[i]) = (true, true);
            }
        }
        if !complete && self.round == ROUNDS {
            for i in 0..self.taken.len() {
                self.added[i] |= !self.taken[i];
                self.taken[i] = true;
            }
        }
        complete
    }
}
