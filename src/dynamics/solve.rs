//! The contact problems of a stage: island after island, each solved, capped and judged.

use super::cap::{CapBlock, cap, is_rigid, work};
use super::islands::Islands;
use super::joint_cap::cap_joints;
use super::model::ContactKey;
use super::outcome::redundant;
use super::part::{Begin, Part};
use super::phases::PhaseClock;
use super::record::StepRecord;
use super::rules::{ImpactLaw, Rules, Scheme};
use super::stage::{Block, Stage};
use crate::contact::{ContactProblem, Law, NO_BODY, Vec2, Vec3, natural_map};
use crate::solver::{
    Carried, CarriedState, ImpulseSolver, Shares, Sharing, SolveReport, SolveStatus,
};
use rustc_hash::FxHashMap;

/// How one island was solved.
#[derive(Debug, Clone, Copy)]
pub(super) struct IslandOutcome {
    pub report: SolveReport,
    capped: bool,
    relaxed: bool,
    joints_capped: bool,
    redundant: bool,
    /// Energy that an impact added \[J\], 0 or more.
    gain: f64,
}

impl IslandOutcome {
    /// Adds the work, whether the result is used or not.
    pub fn count_work(&self, record: &mut StepRecord) {
        record.sweeps += self.report.sweeps;
        record.factorisations += self.report.factorisations;
        record.pivots += self.report.pivots;
    }

    /// Adds what can be said of a result that is used.
    pub fn count(&self, record: &mut StepRecord) {
        record.unsolved += usize::from(!self.report.solved());
        record.residual = record.residual.max(self.report.residual.relative);
        record.residual_velocity = record.residual_velocity.max(self.report.residual.velocity);
        record.islands += 1;
        record.capped += usize::from(self.capped);
        record.relaxed += usize::from(self.relaxed);
        record.joints_capped += usize::from(self.joints_capped);
        record.redundant += usize::from(self.redundant);
        record.impact_gain += self.gain;
    }
}

/// The contact problem of an island as a step posed it, and what the solver made of it.
#[derive(Debug, Clone)]
pub struct SolvedProblem {
    pub problem: ContactProblem,
    /// A pair a block [N s], before any cap on what an impact returns.
    pub impulses: Vec<Vec2>,
    pub report: SolveReport,
}

/// Splits stages into islands and solves them.
pub(super) struct IslandSolver {
    pub solver: Box<dyn ImpulseSolver>,
    pub tolerance: f64,
    sharing: Sharing,
    pub islands: Islands,
    /// Of the last stage, one an island.
    pub outcomes: Vec<IslandOutcome>,
    /// Copies of all problems of a step, where they are asked for.
    pub kept: Option<Vec<SolvedProblem>>,
    /// What islands of the last step carry, by the key of their first block, and those of this one.
    carried: FxHashMap<ContactKey, Carried>,
    carried_next: FxHashMap<ContactKey, Carried>,
    work: Work,
    pub clock: PhaseClock,
}

/// What the solve of an island fills, kept for the next one.
#[derive(Default)]
struct Work {
    problem: ContactProblem,
    warm: Vec<Vec2>,
    impulses: Vec<Vec2>,
    /// `G P + b`.
    velocities: Vec<Vec2>,
    blocks: Vec<CapBlock>,
}

/// Blocks from which on an island carries factors from step to step: fewer are factorised at once.
const CARRIES: usize = 32;

impl IslandSolver {
    pub fn new(solver: Box<dyn ImpulseSolver>, tolerance: f64) -> Self {
        IslandSolver {
            solver,
            tolerance,
            sharing: Sharing::default(),
            islands: Islands::default(),
            outcomes: Vec::new(),
            kept: None,
            carried: FxHashMap::default(),
            carried_next: FxHashMap::default(),
            work: Work::default(),
            clock: PhaseClock::default(),
        }
    }

    /// Begins a step: what one that failed has left is not carried.
    pub fn begin(&mut self) {
        self.carried_next.clear();
        if let Some(kept) = &mut self.kept {
            kept.clear();
        }
    }

    /// Ends a step: what its islands carry is for the next one.
    pub fn carry_on(&mut self) {
        self.carried = std::mem::take(&mut self.carried_next);
    }

    /// What islands carry, in the order of their keys.
    pub fn carried_state(&self) -> Vec<(ContactKey, CarriedState)> {
        let all = self.carried.iter();
        let states = all.filter_map(|(key, carried)| Some((*key, carried.state()?)));
        let mut states: Vec<_> = states.collect();
        states.sort_by_key(|(key, _)| (key.pair, key.feature));
        states
    }

    /// Goes on with what [`IslandSolver::carried_state`] gave.
    pub fn restore_carried(&mut self, states: &[(ContactKey, CarriedState)]) {
        let restored = |(key, state): &(_, _)| (*key, Carried::restored(state));
        self.carried = states.iter().map(restored).collect();
    }

    /// Number of problems kept so far.
    pub fn kept_count(&self) -> usize {
        self.kept.as_ref().map_or(0, Vec::len)
    }

    /// Takes out the problems kept since there were `count`.
    pub fn take_kept(&mut self, count: usize) -> Vec<SolvedProblem> {
        let kept = self.kept.as_mut();
        kept.map_or(Vec::new(), |all| all.split_off(count.min(all.len())))
    }

    /// Finds the impulses of all blocks of `stage`.
    pub fn solve(&mut self, stage: &mut Stage, inverse_mass: &[Vec3], rules: &Rules) {
        let rows = stage.rows.iter().map(|r| r.bodies);
        self.islands.build(inverse_mass.len(), rows);
        self.outcomes.clear();
        if stage.standing.dominance.is_empty() {
            let mut part = Part::near(stage, &self.islands);
            while !self.solve_part(&mut part, stage, inverse_mass, rules) {}
            for (outcome, kept) in part.into_solved() {
                self.outcomes.push(outcome);
                if let Some(all) = &mut self.kept {
                    all.extend(kept);
                }
            }
            stage.loose.sort_unstable();
            return;
        }
        // bodies that press on each other both ways are of one dominance
        let level = |k: usize| {
            let rows = &stage.rows[self.islands.blocks(k)[0] as usize];
            let own = rows.bodies.iter().find(|b| **b != NO_BODY);
            own.map_or(0, |b| stage.standing.dominance[*b as usize])
        };
        let mut order: Vec<(i16, usize)> = (0..self.islands.len()).map(|k| (level(k), k)).collect();
        order.sort_by_key(|&(level, k)| (std::cmp::Reverse(level), k));
        let mut outcomes = vec![None; order.len()];
        let mut above = None;
        for (level, k) in order {
            if above != Some(level) {
                stage.end_velocities(inverse_mass);
                above = Some(level);
            }
            stage.look_up(self.islands.blocks(k));
            let (outcome, kept) = self.solve_island(k, stage, inverse_mass, rules);
            outcomes[k] = Some(outcome);
            if let Some(all) = &mut self.kept {
                all.extend(kept);
            }
        }
        self.outcomes.extend(outcomes.into_iter().flatten());
        stage.loose.sort_unstable();
    }

    /// Solves those islands of a part that are not solved yet. `false` if contacts that were left
    /// out would be closed: the part holds them now, and their islands wait.
    fn solve_part(
        &mut self,
        part: &mut Part,
        stage: &mut Stage,
        inverse_mass: &[Vec3],
        rules: &Rules,
    ) -> bool {
        let taken: Vec<u32> = (0..stage.blocks.len() as u32)
            .filter(|&i| part.taken[i as usize])
            .collect();
        if taken.len() < stage.blocks.len() || part.round > 0 {
            (self.islands).build_of(inverse_mass.len(), &taken, &stage.rows);
        }
        for k in 0..self.islands.len() {
            let members = self.islands.blocks(k);
            let spent = match part.begin(members, stage) {
                Begin::Stands => continue,
                Begin::Anew(spent) => spent,
            };
            let first = members[0];
            let (mut outcome, kept) = self.solve_island(k, stage, inverse_mass, rules);
            for earlier in spent {
                outcome.report = outcome.report.after(&earlier);
            }
            part.keep(first, outcome, kept);
        }
        if taken.len() == stage.blocks.len() {
            return true;
        }
        stage.end_velocities(inverse_mass);
        part.take_closed(stage)
    }

    fn solve_island(
        &mut self,
        k: usize,
        stage: &mut Stage,
        inverse_mass: &[Vec3],
        rules: &Rules,
    ) -> (IslandOutcome, Option<SolvedProblem>) {
        let members = &self.islands.blocks(k).to_vec();
        let Work {
            mut problem,
            mut warm,
            mut impulses,
            mut velocities,
            mut blocks,
        } = std::mem::take(&mut self.work);
        stage.island_problem(members, inverse_mass, &mut problem);
        warm.clear();
        warm.extend(members.iter().map(|&i| stage.impulses[i as usize]));
        impulses.clone_from(&warm);
        self.clock.lap(|t| &mut t.assembly);
        let mut report = self.solve_on(stage, members, &problem, &mut impulses);
        let mut joints_capped = false;
        if rules.corrects_gaps() {
            let held = cap_joints(
                self.solver.as_mut(),
                &mut problem,
                stage,
                members,
                inverse_mass,
                &mut impulses,
                report,
                self.tolerance,
            );
            (report, joints_capped) = (held.report, held.capped);
        }
        let kept = self.kept.is_some().then(|| SolvedProblem {
            problem: problem.clone(),
            impulses: impulses.clone(),
            report,
        });
        blocks.clear();
        blocks.extend(
            members
                .iter()
                .map(|&i| cap_block(&stage.blocks[i as usize])),
        );
        let mut outcome = IslandOutcome {
            report,
            capped: false,
            relaxed: false,
            joints_capped,
            redundant: false,
            gain: 0.0,
        };
        let mut known = false;
        let staggered = rules.scheme == Scheme::Staggered;
        if staggered && !report.solved() && (contradicts(&blocks, &report) || hopeless(&report)) {
            drop_pushes(&mut problem, &mut blocks);
            let again = self.solver.solve(&problem, &mut warm, self.tolerance);
            if again.residual.velocity < report.residual.velocity {
                impulses.copy_from_slice(&warm);
                outcome.report = again.after(&report);
                outcome.relaxed = true;
            } else {
                outcome.report = report.after(&again);
            }
            // a solve that is almost there is better than one that gives way
            if !again.solved() && hopeless(&outcome.report) {
                self.give_way(&problem, &mut impulses, &mut outcome);
            }
        } else if staggered && report.solved() && rules.law == ImpactLaw::Capped {
            let solver = self.solver.as_mut();
            problem.velocities(&impulses, &mut velocities);
            let capped = cap(
                solver,
                &problem,
                &blocks,
                (&mut impulses, &velocities),
                report,
                self.tolerance,
            );
            outcome.report = capped.report;
            outcome.capped = capped.capped;
            known = !capped.capped;
        }
        if !known {
            problem.velocities(&impulses, &mut velocities);
        }
        if blocks.iter().any(|b| b.impact) {
            outcome.gain = work(&blocks, &impulses, &velocities).max(0.0);
        }
        let residual = &outcome.report.residual;
        let resolution = 10.0 * (self.tolerance * residual.velocity_scale).max(residual.velocity);
        outcome.redundant = redundant(&problem, &impulses, &velocities, resolution);
        if outcome.redundant && rules.shares == Shares::MinimumNorm {
            let (changed, work) = self.sharing.least(&problem, &mut impulses, self.tolerance);
            outcome.report.factorisations += work;
            if changed {
                outcome.report.residual = natural_map(&problem, &impulses);
            }
        }
        for (&i, &p) in members.iter().zip(&impulses) {
            stage.impulses[i as usize] = p;
            stage.resolution[i as usize] = resolution;
        }
        self.work = Work {
            problem,
            warm,
            impulses,
            velocities,
            blocks,
        };
        self.clock.lap(|t| &mut t.solve);
        (outcome, kept)
    }

    /// Solves the problem of an island of a step with what it carried from the last one.
    fn solve_on(
        &mut self,
        stage: &Stage,
        members: &[u32],
        problem: &ContactProblem,
        impulses: &mut [Vec2],
    ) -> SolveReport {
        if members.len() < CARRIES || !stage.whole {
            return self.solver.solve(problem, impulses, self.tolerance);
        }
        let key = stage.key(members[0] as usize);
        let earlier = self.carried_next.remove(&key);
        let earlier = earlier.or_else(|| self.carried.remove(&key));
        let mut carried = earlier.unwrap_or_default();
        let report = (self.solver).solve_on(problem, impulses, self.tolerance, &mut carried);
        if !carried.is_empty() {
            self.carried_next.insert(key, carried);
        }
        report
    }

    /// Lets the contacts of a problem that has no solution give way, as of a body between two
    /// plates that are driven together: what a solver has tried last may be of any size there.
    ///
    /// With `ξ_N + R P_N`, `R = SOFTNESS G_NN`, there is a solution whatever is asked (the operator
    /// is strictly copositive), and it is bounded. The island still counts as unsolved.
    fn give_way(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        outcome: &mut IslandOutcome,
    ) {
        let mut soft = problem.clone();
        for (i, law) in soft.laws.iter_mut().enumerate() {
            if let Law::Contact { compliance, .. } = law
                && *compliance == 0.0
            {
                *compliance = SOFTNESS * problem.operator.diagonal(i)[(0, 0)];
            }
        }
        let mut found = vec![Vec2::zeros(); impulses.len()];
        let report = self.solver.solve(&soft, &mut found, self.tolerance);
        let worse = outcome.report;
        if report.solved() {
            impulses.copy_from_slice(&found);
            outcome.report = SolveReport::judged(problem, impulses, self.tolerance).after(&report);
            outcome.relaxed = true;
        }
        outcome.report = outcome.report.after(&worse);
        outcome.report.status = SolveStatus::Unsolved;
    }
}

/// Share of the island's own velocities beyond which the best impulses leave a problem unsolved that
/// may have no solution: one without leaves about all of them.
const HOPELESS: f64 = 0.01;

/// Whether an island may have no solution at all.
pub(super) fn hopeless(report: &SolveReport) -> bool {
    let left = &report.residual;
    !report.solved() && left.velocity > HOPELESS * left.velocity_scale
}

/// Share of the largest push that the best impulses leave unsolved at least where pushes contradict
/// each other: much less is a solver's trouble, which another problem as large does not end.
const CONTRADICTION: f64 = 1e-3;

/// Whether rules may have added what no motion of the bodies is able to undo.
fn contradicts(blocks: &[CapBlock], report: &SolveReport) -> bool {
    let push = |b: &CapBlock| b.free.y.abs().max(-b.free.x);
    let pushes = blocks.iter().filter(|b| b.rigid).map(push);
    let largest = pushes.fold(0.0, f64::max);
    largest > 0.0 && report.residual.velocity > CONTRADICTION * largest
}

/// Share of a contact's own inverse mass by which it gives way where no impulses solve its island:
/// a body at rest then sinks by a hundredth of what it would fall.
const SOFTNESS: f64 = 0.01;

/// Push-outs that contradict each other, as of a block that overlaps walls on both sides, go, and
/// with them what else a rule added that no motion of the bodies can undo.
fn drop_pushes(problem: &mut ContactProblem, blocks: &mut [CapBlock]) {
    for (b, block) in problem.free.iter_mut().zip(blocks) {
        if block.rigid {
            let push = Vec2::new(block.free.x.min(0.0), block.free.y);
            *b -= push;
            block.free -= push;
        }
    }
}

fn cap_block(block: &Block) -> CapBlock {
    CapBlock {
        gamma_a: block.gamma_a,
        free: block.free - block.gamma_f,
        rigid: is_rigid(&block.law),
        held: block.held,
        impact: block.impact,
    }
}
