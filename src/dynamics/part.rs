//! The blocks of a stage that its contact problem is made of: who is far away is left out, and
//! taken in where the solution shows that it was needed.

use super::contact_cache::JointEnergy;
use super::island::{IslandOutcome, SolvedProblem};
use super::islands::Islands;
use super::stage::{Source, Stage};
use crate::contact::{Law, Vec2};
use crate::solver::SolveReport;
use std::collections::BTreeMap;

/// Some blocks of a stage, and what is known of their islands.
///
/// Detection finds all that may close within a step, however its neighbours are thrown about: in a
/// heap four contacts for each that does. One that carried nothing is left out if it would open by
/// more than the fastest contact of its island closes,
///
/// ```text
/// b_N > max(−b_N)   over the contacts of its island                          (1)
/// ```
///
/// and is taken in if the solution without it has `ξ_N < 0`. Where none has, the impulses of the
/// part solve the whole: `P = 0` solves the law of those that are left out.
pub(super) struct Part {
    pub taken: Vec<bool>,
    pub round: usize,
    /// Of each island its first block, and what became of it.
    solved: BTreeMap<u32, (IslandOutcome, Option<SolvedProblem>)>,
    added: Vec<bool>,
    /// `b` of each block and the account of each joint as they were: a cap on joints changes them.
    asked: Vec<Vec2>,
    accounts: Vec<JointEnergy>,
    loose: Vec<usize>,
}

/// What is to be done with an island.
pub(super) enum Begin {
    /// It is solved.
    Stands,
    /// It is to be solved; work was spent on parts of it.
    Anew(Vec<SolveReport>),
}

/// Rounds after which nothing is left out any more.
const ROUNDS: usize = 4;

impl Part {
    /// What is left by (1), with the islands of all blocks.
    pub fn near(stage: &Stage, islands: &Islands) -> Part {
        let count = stage.blocks.len();
        let mut taken = vec![true; count];
        for k in 0..islands.len() {
            let members = islands.blocks(k);
            let opening = |i: &u32| stage.asked[*i as usize].x;
            let closing = members.iter().map(|i| -opening(i)).fold(0.0, f64::max);
            for i in members {
                let idle = stage.impulses[*i as usize] == Vec2::zeros();
                let contact = matches!(stage.laws[*i as usize], Law::Contact { .. });
                taken[*i as usize] = !(contact && idle && opening(i) > closing);
            }
        }
        let mut part = Part {
            round: 0,
            solved: BTreeMap::new(),
            added: Vec::new(),
            asked: Vec::new(),
            accounts: Vec::new(),
            loose: Vec::new(),
            taken,
        };
        if part.taken.contains(&false) {
            part.added.resize(count, false);
            part.asked.clone_from(&stage.asked);
            part.accounts.clone_from(&stage.accounts);
            part.loose.clone_from(&stage.loose);
        }
        part
    }

    /// Readies an island for its solve, unless it stands as it was solved.
    pub fn begin(&mut self, members: &[u32], stage: &mut Stage) -> Begin {
        let new = |i: &u32| self.added[*i as usize];
        if self.round == 0 {
            return Begin::Anew(Vec::new());
        }
        if !members.iter().any(new) {
            return Begin::Stands;
        }
        let mut spent = Vec::new();
        for &i in members {
            stage.asked[i as usize] = self.asked[i as usize];
            if let Source::Joint(index) = stage.blocks[i as usize].source {
                stage.accounts[index] = self.accounts[index];
                if !self.loose.contains(&index) {
                    stage.loose.retain(|j| *j != index);
                }
            }
            spent.extend(self.solved.remove(&i).map(|(o, _)| o.report));
        }
        Begin::Anew(spent)
    }

    /// Notes what became of the island with this first block.
    pub fn keep(&mut self, first: u32, outcome: IslandOutcome, kept: Option<SolvedProblem>) {
        self.solved.insert(first, (outcome, kept));
    }

    /// What became of all islands, in the order of their first blocks.
    pub fn into_solved(self) -> impl Iterator<Item = (IslandOutcome, Option<SolvedProblem>)> {
        self.solved.into_values()
    }

    /// Takes in who would be closed at the end velocities. Whether there was nobody.
    pub fn take_closed(&mut self, stage: &Stage) -> bool {
        self.round += 1;
        self.added.fill(false);
        let mut complete = true;
        for i in 0..self.taken.len() {
            if self.taken[i] {
                continue;
            }
            let rows = stage.rows(i);
            let change = rows.velocity(&stage.end).x - rows.velocity(&stage.free).x;
            if stage.asked[i].x + change < 0.0 {
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
