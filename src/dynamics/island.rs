//! Solves one island of an interval. The [`Worker`] sets up its contact problem, solves it, bounds
//! the energy that it adds, and judges the solution, in this order.

use super::closings::settle_closings;
use super::constraint_work::{joint_work, work};
use super::crowd::simplify;
use super::energy_bound::{bound_contacts, bound_joints, hopeless, joint_energies};
use super::interval::Interval;
use super::island_problem::{IslandProblem, LARGE, restore_pushes};
use super::outcome::{IslandOutcome, IslandResult, SolvedProblem};
use super::phases::PhaseClock;
use super::redundancy::redundant;
use super::reserve::{debt, reserve_after};
use super::rules::{Effort, ImpactLaw, Rules, Scheme};
use super::scaled::bound_swept;
use super::solution::Solution;
use crate::contact::{ContactProblem, Law, Residual, Vec2, Vec3, natural_map};
use crate::solver::{Crowd, FactorCache, ImpulseSolver, Shares, Sharing, SolveReport, SolveStatus};

/// A solver with the buffers for one island after the other.
pub(super) struct Worker {
    pub solver: Box<dyn ImpulseSolver>,
    pub crowd: Crowd,
    sharing: Sharing,
    /// Reuses its memory.
    island: IslandProblem,
    answer: Answer,
}

impl Worker {
    pub fn new(solver: Box<dyn ImpulseSolver>) -> Worker {
        Worker {
            solver,
            crowd: Crowd::default(),
            sharing: Sharing::default(),
            island: IslandProblem::default(),
            answer: Answer::none(),
        }
    }
}

/// Input of an island's solve. `solution` has the results of islands of higher dominance and of
/// earlier rounds.
#[derive(Clone, Copy)]
pub(super) struct Task<'a> {
    pub interval: &'a Interval,
    pub solution: &'a Solution,
    pub inverse_mass: &'a [Vec3],
    pub rules: &'a Rules,
    pub tolerance: f64,
    /// Whether to store the problems.
    pub store_problems: bool,
}

/// Impulses of an island, and the data that the solver returned with them.
struct Answer {
    impulses: Vec<Vec2>,
    report: SolveReport,
    /// `G P + b`, and `M⁻¹ Wᵀ P` of the bodies, if known.
    velocities: Vec<Vec2>,
    change: Vec<Vec3>,
    velocities_known: bool,
    change_known: bool,
    contacts_bounded: bool,
    joints_bounded: bool,
    relaxed: bool,
    crowd: bool,
    /// See [`IslandResult`].
    bias: Option<Vec<Vec2>>,
    problem: Option<Box<SolvedProblem>>,
}

/// Before the first solve.
const NO_REPORT: SolveReport = SolveReport {
    status: SolveStatus::Unsolved,
    sweeps: 0,
    factorisations: 0,
    pivots: 0,
    residual: Residual {
        absolute: 0.0,
        relative: 0.0,
        velocity: 0.0,
        velocity_scale: 0.0,
        round_off: 0.0,
    },
};

impl Answer {
    fn none() -> Answer {
        Answer {
            impulses: Vec::new(),
            report: NO_REPORT,
            velocities: Vec::new(),
            change: Vec::new(),
            velocities_known: false,
            change_known: false,
            contacts_bounded: false,
            joints_bounded: false,
            relaxed: false,
            crowd: false,
            bias: None,
            problem: None,
        }
    }

    /// Starts from the warm impulses of the island.
    fn begin(&mut self, island: &IslandProblem) {
        self.impulses.clone_from(&island.warm);
        (self.contacts_bounded, self.joints_bounded) = (false, false);
        (self.relaxed, self.crowd) = (false, false);
        (self.velocities_known, self.change_known) = (false, false);
        (self.bias, self.problem) = (None, None);
        self.report = NO_REPORT;
    }

    /// Computes `velocities` unless they are those of `problem` at the present impulses already.
    fn know_velocities(&mut self, problem: &ContactProblem) {
        if !self.velocities_known {
            problem.velocities(&self.impulses, &mut self.velocities);
            self.velocities_known = true;
        }
    }
}

/// Velocity residual, as a share of the velocity scale, up to which the impulses of a large island
/// that is not certified stay as they are. Sweeps leave a hundred times as much of a heap that tumbles.
const CLOSE: f64 = 1e-4;

/// Whether a solve missed its tolerance, but left little.
fn close(report: &SolveReport) -> bool {
    report.residual.velocity <= CLOSE * report.residual.velocity_scale
}

/// The `b` of the step. It includes the push-outs, which may be `dropped` from the problem.
fn original_bias(island: &IslandProblem, dropped: bool) -> Vec<Vec2> {
    let mut bias = island.problem.free.clone();
    if dropped {
        restore_pushes(&mut bias, &island.terms);
    }
    bias
}

impl Worker {
    /// Impulses of the island solved last.
    pub fn impulses(&self) -> &[Vec2] {
        &self.answer.impulses
    }

    /// Solves the island of these blocks. [`Worker::impulses`] then returns its impulses. `crowd` says
    /// whether it was a crowd in the last step: see [`super::crowd`].
    pub fn solve_island(
        &mut self,
        members: &[u32],
        (factors, crowd): (Option<&mut FactorCache>, bool),
        task: Task,
        clock: &mut PhaseClock,
    ) -> IslandResult {
        let rules = task.rules;
        self.island
            .set_up(task.interval, task.solution, members, task.inverse_mass);
        self.answer.begin(&self.island);
        clock.lap(|t| &mut t.assembly);
        let staggered = rules.scheme == Scheme::Staggered;
        // other methods are to show what they do by themselves
        let own = !matches!(self.solver.name(), "auto" | "direct");
        let large = staggered && !own && members.len() > LARGE && self.island.has_rigid();
        if large && crowd {
            self.solve_crowd(members, None, task);
            return self.judge(task);
        }
        self.solve_rigid(factors, task.tolerance);
        self.settle_closings(task.tolerance);
        if rules.corrects_gaps() {
            self.bound_joints(task.tolerance);
        }
        self.store_problem(members, task);
        self.island.count_added();
        let report = self.answer.report;
        if report.solved() || large && close(&report) {
            if staggered && rules.law != ImpactLaw::Newton {
                self.bound_contacts(task.tolerance);
            }
            if !report.solved() {
                self.bound_sweeps(task.tolerance);
            }
        } else if large {
            let attempt = std::mem::take(&mut self.answer.impulses);
            self.solve_crowd(members, Some(attempt), task);
        } else if staggered
            && (self.island.contradicts(report.residual.velocity) || hopeless(&report))
        {
            self.solve_without_pushes(!own, task.tolerance);
        }
        self.judge(task)
    }

    /// Solves the problem of the step.
    fn solve_rigid(&mut self, factors: Option<&mut FactorCache>, tolerance: f64) {
        let Worker {
            solver,
            island,
            answer,
            ..
        } = self;
        let (problem, impulses) = (&island.problem, &mut answer.impulses);
        answer.report = match factors {
            Some(factors) => solver.solve_next(problem, impulses, tolerance, factors),
            None => solver.solve(problem, impulses, tolerance),
        };
        answer.velocities_known = answer.report.solved() && {
            answer.velocities.clear();
            answer.change.clear();
            if let Some(found) = solver.velocities() {
                answer.velocities.extend_from_slice(found.blocks);
                answer.change.extend_from_slice(found.bodies);
            }
            answer.velocities.len() == island.terms.len()
        };
        answer.change_known = answer.velocities_known;
    }

    /// Solves an island as a crowd, see [`super::crowd`]. `attempt` has the impulses of the exact attempt
    /// of this step, which are used if they leave a smaller velocity residual than the sweeps.
    fn solve_crowd(&mut self, members: &[u32], attempt: Option<Vec<Vec2>>, task: Task) {
        let earlier = self.answer.report;
        let Worker {
            solver,
            crowd,
            island,
            answer,
            ..
        } = self;
        simplify(island, members, task.interval, task.inverse_mass);
        answer.begin(island);
        answer.crowd = true;
        let (problem, impulses) = (&island.problem, &mut answer.impulses);
        let mut report = match task.interval.driven_from {
            Some(first) => {
                let from = members.partition_point(|i| *i < first);
                crowd.solve_more(problem, impulses, from, task.tolerance)
            }
            None => crowd.solve(problem, impulses, task.tolerance),
        };
        if task.rules.effort == Effort::Exact && !report.solved() {
            // the sweeps' impulses that hold each other in balance mislead the solver
            island.warm.fill(Vec2::zeros());
            let found = solver.solve(problem, &mut island.warm, task.tolerance);
            report = match found.residual.velocity < report.residual.velocity {
                true => {
                    impulses.copy_from_slice(&island.warm);
                    found.after(&report)
                }
                false => report.after(&found),
            };
        }
        if let Some(attempt) = attempt {
            let found = SolveReport::judged(problem, &attempt, task.tolerance);
            if found.residual.velocity < report.residual.velocity {
                *impulses = attempt;
                report = found.after(&report);
            }
        }
        answer.report = report.after(&earlier);
        self.store_problem(members, task);
        self.bound_crowd(task);
    }

    /// Bounds the energy of joints and contacts of a crowd.
    fn bound_crowd(&mut self, task: Task) {
        let Worker {
            crowd,
            island,
            answer,
            ..
        } = self;
        let (report, tolerance) = (answer.report, task.tolerance);
        answer.know_velocities(&island.problem);
        let (problem, first) = (
            &island.problem,
            (&mut answer.impulses[..], &answer.velocities[..]),
        );
        if let Some((report, bias)) =
            bound_joints(crowd, problem, island, first, (report, false), tolerance)
        {
            answer.velocities_known = false;
            (answer.report, answer.joints_bounded) = (report, true);
            island.problem.free = bias;
            island.count_added();
            answer.bias = Some(original_bias(island, true));
        }
        answer.know_velocities(&island.problem);
        if island.impact() && task.rules.law != ImpactLaw::Newton {
            let first = (&mut answer.impulses[..], &answer.velocities[..]);
            if let Some(report) = bound_contacts(crowd, island, first, answer.report, tolerance) {
                (answer.report, answer.contacts_bounded) = (report, true);
                answer.velocities_known = false;
            }
        }
        self.bound_sweeps(tolerance);
    }

    /// Replaces closing velocities of joints that contradict each other, see [`settle_closings`].
    fn settle_closings(&mut self, tolerance: f64) {
        let Worker { island, answer, .. } = self;
        let report = settle_closings(island, &answer.impulses, &answer.report, tolerance);
        if let Some(report) = report {
            answer.report = report;
            answer.bias = Some(original_bias(island, false));
        }
    }

    /// Bounds the energy of joints, see [`bound_joints`].
    fn bound_joints(&mut self, tolerance: f64) {
        let Worker {
            solver,
            island,
            answer,
            ..
        } = self;
        if island.bilateral.is_empty() {
            return;
        }
        answer.know_velocities(&island.problem);
        let bounded = bound_joints(
            solver.as_mut(),
            &island.problem,
            island,
            (&mut answer.impulses, &answer.velocities),
            (answer.report, hopeless(&answer.report)),
            tolerance,
        );
        if let Some((report, bias)) = bounded {
            answer.report = report;
            answer.joints_bounded = true;
            (answer.velocities_known, answer.change_known) = (false, false);
            island.problem.free = bias;
            answer.bias = Some(original_bias(island, false));
        }
    }

    fn store_problem(&mut self, members: &[u32], task: Task) {
        let keys = members.iter().map(|&i| task.interval.key(i as usize));
        self.answer.problem = task.store_problems.then(|| {
            Box::new(SolvedProblem {
                problem: self.island.problem.clone(),
                keys: keys.collect(),
                impulses: self.answer.impulses.clone(),
                report: self.answer.report,
            })
        });
    }

    /// Solves an island again without push-outs. Sweeps from zero if the result is hopeless and `sweeps`
    /// is set: they find impulses that are never worse than none.
    fn solve_without_pushes(&mut self, sweeps: bool, tolerance: f64) {
        let Worker {
            solver,
            crowd,
            island,
            answer,
            ..
        } = self;
        island.drop_pushes();
        answer.velocities_known = false;
        let (problem, impulses) = (&island.problem, &mut answer.impulses);
        let again = solver.solve(problem, &mut island.warm, tolerance);
        if again.residual.velocity < answer.report.residual.velocity {
            impulses.copy_from_slice(&island.warm);
            answer.report = again.after(&answer.report);
            answer.relaxed = true;
        } else {
            answer.report = answer.report.after(&again);
        }
        if sweeps && !again.solved() && hopeless(&answer.report) {
            island.warm.fill(Vec2::zeros());
            let found = crowd.solve(problem, &mut island.warm, tolerance);
            answer.report = match found.residual.velocity < answer.report.residual.velocity {
                true => {
                    impulses.copy_from_slice(&island.warm);
                    answer.relaxed = true;
                    found.after(&answer.report)
                }
                false => answer.report.after(&found),
            };
            self.bound_sweeps(tolerance);
        }
    }

    /// Scales down impulses of sweeps that add energy, see [`bound_swept`].
    fn bound_sweeps(&mut self, tolerance: f64) {
        let Worker { island, answer, .. } = self;
        answer.know_velocities(&island.problem);
        if bound_swept(island, &mut answer.impulses, &answer.velocities) {
            let judged = SolveReport::judged(&island.problem, &answer.impulses, tolerance);
            answer.report = judged.after(&answer.report);
            answer.contacts_bounded = true;
            answer.velocities_known = false;
        }
    }

    /// Bounds the energy of contacts, see [`bound_contacts`].
    fn bound_contacts(&mut self, tolerance: f64) {
        let Worker {
            solver,
            island,
            answer,
            ..
        } = self;
        answer.know_velocities(&island.problem);
        let first = (&mut answer.impulses[..], &answer.velocities[..]);
        let bounded = bound_contacts(solver.as_mut(), island, first, answer.report, tolerance);
        answer.contacts_bounded = bounded.is_some();
        answer.velocities_known = bounded.is_none();
        answer.change_known &= bounded.is_none();
        answer.report = bounded.unwrap_or(answer.report);
    }

    /// Judges the solution. Replaces redundant impulses by those of minimum norm, if the settings
    /// ask for it.
    fn judge(&mut self, task: Task) -> IslandResult {
        let Worker {
            sharing,
            island,
            answer,
            ..
        } = self;
        answer.know_velocities(&island.problem);
        let (problem, impulses) = (&island.problem, &mut answer.impulses);
        let mut outcome = IslandOutcome {
            report: answer.report,
            unknowns: problem.laws.iter().map(Law::rows).sum(),
            contacts_bounded: answer.contacts_bounded,
            joints_bounded: answer.joints_bounded,
            relaxed: answer.relaxed,
            redundant: false,
            crowd: answer.crowd,
            bodies: island.local.bodies.len(),
            reserve: 0.0,
            debt: 0.0,
            gain: 0.0,
        };
        if island.impact() {
            let joints = joint_work(island, impulses, &answer.velocities);
            let contacts = work(island, impulses, &answer.velocities);
            // what pins took, in this step or before, is no gain
            if contacts + joints > island.reserve.max(0.0) {
                outcome.gain = contacts.max(0.0);
            }
        }
        let residual = &outcome.report.residual;
        let resolution = 10.0 * (task.tolerance * residual.velocity_scale).max(residual.velocity);
        outcome.redundant = redundant(problem, impulses, &answer.velocities, resolution);
        if outcome.redundant && task.rules.shares == Shares::MinimumNorm {
            let (changed, work) = sharing.least(problem, impulses, task.tolerance);
            outcome.report.factorisations += work;
            answer.change_known &= !changed;
            if changed {
                outcome.report.residual = natural_map(problem, impulses);
            }
        }
        outcome.reserve = reserve_after(island, impulses, &answer.velocities);
        outcome.debt = debt(island, outcome.reserve, task.tolerance);
        let energies = match task.rules.corrects_gaps() {
            true => joint_energies(island, impulses, &answer.velocities),
            false => Vec::new(),
        };
        let own = &island.local.bodies;
        let change = (answer.change_known && answer.change.len() == own.len()).then(|| {
            own.iter()
                .copied()
                .zip(answer.change.iter().copied())
                .collect()
        });
        let unclosed = island.bilateral.iter().filter(|_| outcome.joints_bounded);
        IslandResult {
            outcome,
            problem: answer.problem.take(),
            resolution,
            bias: answer.bias.take(),
            change,
            energies,
            unclosed: unclosed.map(|bilateral| bilateral.joint).collect(),
        }
    }
}
