//! One island of a stage: its contact problem posed, solved, capped and judged.

use super::cap::{CapBlock, cap, is_rigid, work};
use super::contact_cache::JointEnergy;
use super::jam::{self, Jam, LARGE, SOFTNESS, soften};
use super::joint_cap::cap_joints;
use super::local_bodies::LocalBodies;
use super::outcome::redundant;
use super::phases::PhaseClock;
use super::record::StepRecord;
use super::rules::{ImpactLaw, Rules, Scheme};
use super::stage::{Source, Stage};
use crate::contact::{ContactProblem, Vec2, Vec3, natural_map};
use crate::solver::{Carried, ImpulseSolver, Shares, Sharing, SolveReport, SolveStatus};

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

/// What islands are solved with, one for each thread. Nothing of an island is left in it that
/// another would notice.
pub(super) struct Worker {
    pub solver: Box<dyn ImpulseSolver>,
    sharing: Sharing,
    local: LocalBodies,
    work: Work,
}

impl Worker {
    pub fn new(solver: Box<dyn ImpulseSolver>) -> Worker {
        Worker {
            solver,
            sharing: Sharing::default(),
            local: LocalBodies::default(),
            work: Work::default(),
        }
    }
}

/// What the islands of a stage have in common.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub inverse_mass: &'a [Vec3],
    pub rules: &'a Rules,
    pub tolerance: f64,
    /// Whether problems are kept.
    pub keep: bool,
}

/// What the solve of an island makes of it, beside impulses: nothing in the stage is changed by it.
pub(super) struct Solved {
    outcome: IslandOutcome,
    kept: Option<SolvedProblem>,
    resolution: f64,
    /// `b` of all blocks, where a cap on joints changed it.
    free: Option<Vec<Vec2>>,
    /// `M⁻¹ Wᵀ P` of its bodies, where the solver had it at hand.
    given: Option<Vec<(u32, Vec3)>>,
    accounts: Vec<(u32, JointEnergy)>,
    loose: Vec<usize>,
}

impl Solved {
    /// Writes the results of an island of these blocks into its stage.
    pub fn settle(
        self,
        members: &[u32],
        impulses: &[Vec2],
        stage: &mut Stage,
    ) -> (IslandOutcome, Option<SolvedProblem>) {
        for (&i, &p) in members.iter().zip(impulses) {
            stage.impulses[i as usize] = p;
            stage.resolution[i as usize] = self.resolution;
        }
        stage.take_given(members, self.given.as_deref());
        for (&i, &b) in members.iter().zip(self.free.iter().flatten()) {
            stage.asked[i as usize] = b;
        }
        for (i, account) in self.accounts {
            if let Source::Joint(index) = stage.blocks[i as usize].source {
                stage.accounts[index] = account;
            }
        }
        stage.loose.extend(self.loose);
        (self.outcome, self.kept)
    }
}

/// What the solve of an island fills, kept for the next one.
#[derive(Default)]
struct Work {
    problem: ContactProblem,
    warm: Vec<Vec2>,
    impulses: Vec<Vec2>,
    /// `G P + b`, and `M⁻¹ Jᵀ P` of the bodies.
    velocities: Vec<Vec2>,
    bodies: Vec<Vec3>,
    blocks: Vec<CapBlock>,
}

impl Worker {
    /// Impulses of the island solved last.
    pub fn impulses(&mut self) -> &mut Vec<Vec2> {
        &mut self.work.impulses
    }

    /// Solves, caps and judges the island of these blocks; its impulses are in
    /// [`Worker::impulses`] then.
    pub fn solve_island(
        &mut self,
        members: &[u32],
        (carried, jam): (Option<&mut Carried>, &mut Jam),
        stage: &Stage,
        task: Task,
        clock: &mut PhaseClock,
    ) -> Solved {
        let Task {
            inverse_mass,
            rules,
            tolerance,
            keep,
        } = task;
        let Work {
            mut problem,
            mut warm,
            mut impulses,
            mut velocities,
            mut bodies,
            mut blocks,
        } = std::mem::take(&mut self.work);
        stage.island_problem(members, inverse_mass, &mut self.local, &mut problem);
        warm.clear();
        warm.extend(members.iter().map(|&i| stage.impulses[i as usize]));
        impulses.clone_from(&warm);
        clock.lap(|t| &mut t.assembly);
        let staggered = rules.scheme == Scheme::Staggered;
        // the methods that are asked for by another name are to show what they do by themselves
        let own = matches!(self.solver.name(), "auto" | "direct");
        let large = staggered && own && members.len() > LARGE;
        if !large {
            *jam = Jam::default();
        }
        // an interval within a step pushes nothing out that the whole of it does
        let (gave, waits) = (stage.whole && jam.jammed(), large && jam.waits());
        // what gave way is asked to be pushed out again, which heaps that wedge each other in contradict
        let posed = (gave && large && !waits).then(|| {
            cap_blocks(&mut blocks, stage, members, &problem.free);
            let posed = problem.free.clone();
            drop_pushes(&mut problem, &mut blocks);
            posed
        });
        let mut report = match carried {
            _ if waits => SolveReport::judged(&problem, &impulses, tolerance),
            Some(carried) => (self.solver).solve_on(&problem, &mut impulses, tolerance, carried),
            None => self.solver.solve(&problem, &mut impulses, tolerance),
        };
        // what waits was not solved just now
        let mut known = report.solved() && !waits && {
            velocities.clear();
            bodies.clear();
            if let Some(found) = self.solver.velocities() {
                velocities.extend_from_slice(found.blocks);
                bodies.extend_from_slice(found.bodies);
            }
            velocities.len() == members.len()
        };
        // what bodies are given stands with the impulses as they were returned only
        let mut told = known;
        let (mut joints_capped, mut accounts, mut loose) = (false, Vec::new(), Vec::new());
        // of what waits to be solved nothing is known yet: it is capped as it gives way
        if rules.corrects_gaps() && !waits {
            let held = cap_joints(
                self.solver.as_mut(),
                &mut problem,
                stage,
                members,
                inverse_mass,
                &mut impulses,
                report,
                tolerance,
            );
            (report, joints_capped) = (held.report, held.capped);
            known &= !joints_capped;
            told &= !joints_capped;
            (accounts, loose) = (held.accounts, held.loose);
        }
        // what the stage is to hold of it: pushes may be dropped from the problem yet
        let mut free = joints_capped.then(|| {
            let mut free = problem.free.clone();
            ask_again(&mut free, &blocks, posed.as_deref());
            free
        });
        let mut kept = keep.then(|| SolvedProblem {
            problem: problem.clone(),
            impulses: impulses.clone(),
            report,
        });
        cap_blocks(&mut blocks, stage, members, &problem.free);
        let mut outcome = IslandOutcome {
            report,
            capped: false,
            relaxed: false,
            joints_capped,
            redundant: false,
            gain: 0.0,
        };
        outcome.relaxed = posed.is_some();
        if large && jam.note(&report) {
            ask_again(&mut problem.free, &blocks, posed.as_deref());
            cap_blocks(&mut blocks, stage, members, &problem.free);
            let mut soft = problem.clone();
            soften(&mut soft, SOFTNESS);
            if gave {
                jam::push_back(&mut soft, stage, members, |i| stage.before[i as usize]);
            }
            let asked = soft.free.clone();
            let found = (self.solver).solve(&soft, &mut warm, tolerance.max(jam::ENOUGH));
            let mut spent = found.after(&report);
            if rules.corrects_gaps() && waits {
                let held = cap_joints(
                    self.solver.as_mut(),
                    &mut soft,
                    stage,
                    members,
                    inverse_mass,
                    &mut warm,
                    found,
                    tolerance.max(jam::ENOUGH),
                );
                spent = held.report.after(&report);
                (accounts, loose) = (held.accounts, held.loose);
                outcome.joints_capped = held.capped;
                if held.capped {
                    let change = soft.free.iter().zip(&asked).map(|(now, asked)| now - asked);
                    problem
                        .free
                        .iter_mut()
                        .zip(change)
                        .for_each(|(b, d)| *b += d);
                    free = Some(problem.free.clone());
                    cap_blocks(&mut blocks, stage, members, &problem.free);
                }
            }
            outcome.report = jam::yield_to(&problem, &spent, &warm, &mut impulses, tolerance);
            (known, told) = (false, false);
            outcome.relaxed = true;
            if let Some(kept) = kept.as_mut().filter(|_| waits) {
                kept.impulses.copy_from_slice(&impulses);
                kept.report = outcome.report;
            }
        } else if staggered
            && !report.solved()
            && (contradicts(&blocks, &report) || hopeless(&report))
        {
            drop_pushes(&mut problem, &mut blocks);
            let again = self.solver.solve(&problem, &mut warm, tolerance);
            if again.residual.velocity < report.residual.velocity {
                impulses.copy_from_slice(&warm);
                outcome.report = again.after(&report);
                outcome.relaxed = true;
            } else {
                outcome.report = report.after(&again);
            }
            // a solve that is almost there is better than one that gives way
            if !again.solved() && hopeless(&outcome.report) {
                self.give_way(&problem, &mut impulses, tolerance, &mut outcome);
            }
        } else if staggered && report.solved() && rules.law == ImpactLaw::Capped {
            let solver = self.solver.as_mut();
            if !known {
                problem.velocities(&impulses, &mut velocities);
            }
            let capped = cap(
                solver,
                &problem,
                &blocks,
                (&mut impulses, &velocities),
                report,
                tolerance,
            );
            outcome.report = capped.report;
            outcome.capped = capped.capped;
            known = !capped.capped;
            told &= known;
        }
        if !known {
            problem.velocities(&impulses, &mut velocities);
        }
        if blocks.iter().any(|b| b.impact) {
            outcome.gain = work(&blocks, &impulses, &velocities).max(0.0);
        }
        let residual = &outcome.report.residual;
        let resolution = 10.0 * (tolerance * residual.velocity_scale).max(residual.velocity);
        outcome.redundant = redundant(&problem, &impulses, &velocities, resolution);
        if outcome.redundant && rules.shares == Shares::MinimumNorm {
            let (changed, work) = self.sharing.least(&problem, &mut impulses, tolerance);
            outcome.report.factorisations += work;
            told &= !changed;
            if changed {
                outcome.report.residual = natural_map(&problem, &impulses);
            }
        }
        let own = &self.local.bodies;
        let given = (told && bodies.len() == own.len())
            .then(|| own.iter().copied().zip(bodies.iter().copied()).collect());
        self.work = Work {
            problem,
            warm,
            impulses,
            velocities,
            bodies,
            blocks,
        };
        Solved {
            outcome,
            kept,
            resolution,
            free,
            given,
            accounts,
            loose,
        }
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
        tolerance: f64,
        outcome: &mut IslandOutcome,
    ) {
        let mut soft = problem.clone();
        soften(&mut soft, SOFTNESS);
        let mut found = vec![Vec2::zeros(); impulses.len()];
        let report = self.solver.solve(&soft, &mut found, tolerance);
        let worse = outcome.report;
        if report.solved() {
            impulses.copy_from_slice(&found);
            outcome.report = SolveReport::judged(problem, impulses, tolerance).after(&report);
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
/// Blocks up to which the other problem costs little: it is tried anyhow.
const SMALL: usize = 130;

/// Whether rules may have added what no motion of the bodies is able to undo.
fn contradicts(blocks: &[CapBlock], report: &SolveReport) -> bool {
    let push = |b: &CapBlock| b.free.y.abs().max(-b.free.x);
    let pushes = blocks.iter().filter(|b| b.rigid).map(push);
    let largest = pushes.fold(0.0, f64::max);
    let small = blocks.len() <= SMALL;
    largest > 0.0 && (small || report.residual.velocity > CONTRADICTION * largest)
}

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

/// Takes back what [`drop_pushes`] did to `free`, as it was posed.
fn ask_again(free: &mut [Vec2], blocks: &[CapBlock], posed: Option<&[Vec2]>) {
    let rigid = |(_, block): &(_, &CapBlock)| block.rigid;
    let asked = posed.unwrap_or_default().iter();
    for ((b, _), asked) in free
        .iter_mut()
        .zip(blocks)
        .zip(asked)
        .filter(|(x, _)| rigid(x))
    {
        *b = *asked;
    }
}

/// Blocks for which the problem has `free`.
fn cap_blocks(blocks: &mut Vec<CapBlock>, stage: &Stage, members: &[u32], free: &[Vec2]) {
    blocks.clear();
    let of = |(&i, b): (&u32, _)| cap_block(stage, i as usize, b);
    blocks.extend(members.iter().zip(free).map(of));
}

/// A block, for which its problem has `b`.
fn cap_block(stage: &Stage, i: usize, b: &Vec2) -> CapBlock {
    let block = &stage.blocks[i];
    CapBlock {
        gamma_a: block.gamma_a,
        free: b - block.gamma_f,
        rigid: is_rigid(&stage.laws[i]),
        held: block.held,
        impact: block.impact,
    }
}
