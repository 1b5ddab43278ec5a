//! Solves one island of an interval. The [`Worker`] sets up its contact problem, solves it, bounds
//! the energy that it adds, and judges the solution, in this order.

use super::closings::settle_closings;
use super::energy_bound::{bound_contacts, bound_joints, joint_energies, work};
use super::fallback::{self, ENOUGH, Fallback, LARGE, hopeless};
use super::interval::Interval;
use super::island_problem::{IslandProblem, restore_pushes};
use super::outcome::{IslandOutcome, IslandResult, SolvedProblem};
use super::phases::PhaseClock;
use super::redundancy::redundant;
use super::rules::{ImpactLaw, Rules, Scheme};
use super::solution::Solution;
use crate::contact::{Residual, Vec2, Vec3, natural_map};
use crate::solver::{FactorCache, ImpulseSolver, Shares, Sharing, SolveReport, SolveStatus};

/// A solver with the buffers for one island after the other.
pub(super) struct Worker {
    pub solver: Box<dyn ImpulseSolver>,
    sharing: Sharing,
    /// Reuses its memory.
    island: IslandProblem,
    answer: Answer,
}

impl Worker {
    pub fn new(solver: Box<dyn ImpulseSolver>) -> Worker {
        Worker {
            solver,
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
    /// See [`IslandResult`].
    bias: Option<Vec<Vec2>>,
    problem: Option<SolvedProblem>,
}

impl Answer {
    fn none() -> Answer {
        Answer {
            impulses: Vec::new(),
            report: SolveReport {
                status: SolveStatus::Unsolved,
                sweeps: 0,
                factorisations: 0,
                pivots: 0,
                residual: Residual::default(),
            },
            velocities: Vec::new(),
            change: Vec::new(),
            velocities_known: false,
            change_known: false,
            contacts_bounded: false,
            joints_bounded: false,
            relaxed: false,
            bias: None,
            problem: None,
        }
    }
}

/// Which form of the rigid problem of an island to solve.
#[derive(Clone, Copy, PartialEq)]
enum Attempt {
    /// The original problem.
    Original,
    /// The problem without push-outs. The last step used the fallback, and in heaps wedged together
    /// push-outs contradict each other.
    WithoutPushes,
    /// None: the rigid problem has failed too often.
    None,
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

    /// Solves the island of these blocks. [`Worker::impulses`] then returns its impulses.
    pub fn solve_island(
        &mut self,
        members: &[u32],
        (factors, fallback): (Option<&mut FactorCache>, Fallback),
        task: Task,
        clock: &mut PhaseClock,
    ) -> (IslandResult, Fallback) {
        let Task {
            interval, rules, ..
        } = task;
        self.island
            .set_up(interval, task.solution, members, task.inverse_mass);
        clock.lap(|t| &mut t.assembly);
        let staggered = rules.scheme == Scheme::Staggered;
        let large = staggered && members.len() > LARGE;
        let fallback = if large { fallback } else { Fallback::default() };
        let attempt = match (fallback.skips_rigid(), interval.whole && fallback.active()) {
            (true, _) => Attempt::None,
            (false, true) => Attempt::WithoutPushes,
            (false, false) => Attempt::Original,
        };
        self.solve_rigid(attempt, factors, task);
        if attempt != Attempt::None {
            self.settle_closings(task.tolerance);
        }
        // without a rigid solve there are no impulses to bound yet: `solve_regularised` bounds its
        // own
        if rules.corrects_gaps() && attempt != Attempt::None {
            self.bound_joints(attempt, task.tolerance);
        }
        self.store_problem(task);
        self.island.count_added();
        let report = self.answer.report;
        let fallback = if large {
            fallback.after(&report)
        } else {
            fallback
        };
        if fallback.active() {
            self.solve_regularised(members, attempt, task);
        } else if staggered && !report.solved() {
            if self.island.contradicts(report.residual.velocity) || hopeless(&report) {
                self.solve_without_pushes(task.tolerance);
            }
        } else if staggered && rules.law != ImpactLaw::Newton {
            self.bound_contacts(task.tolerance);
        }
        (self.judge(task), fallback)
    }

    /// Solves the form of the rigid problem that `attempt` names.
    fn solve_rigid(&mut self, attempt: Attempt, factors: Option<&mut FactorCache>, task: Task) {
        let Worker {
            solver,
            island,
            answer,
            ..
        } = self;
        answer.impulses.clone_from(&island.warm);
        (answer.contacts_bounded, answer.joints_bounded) = (false, false);
        (answer.bias, answer.problem) = (None, None);
        answer.relaxed = attempt == Attempt::WithoutPushes;
        if answer.relaxed {
            island.count_added();
            island.drop_pushes();
        }
        let (problem, impulses) = (&island.problem, &mut answer.impulses);
        answer.report = match factors {
            _ if attempt == Attempt::None => SolveReport::judged(problem, impulses, task.tolerance),
            Some(factors) => solver.solve_next(problem, impulses, task.tolerance, factors),
            None => solver.solve(problem, impulses, task.tolerance),
        };
        answer.velocities_known = answer.report.solved() && attempt != Attempt::None && {
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

    /// Replaces closing velocities of joints that contradict each other, see [`settle_closings`].
    fn settle_closings(&mut self, tolerance: f64) {
        let Worker { island, answer, .. } = self;
        let report = settle_closings(island, &answer.impulses, &answer.report, tolerance);
        if let Some(report) = report {
            answer.report = report;
            answer.bias = Some(original_bias(island, answer.relaxed));
        }
    }

    /// Bounds the energy of joints, see [`bound_joints`].
    fn bound_joints(&mut self, attempt: Attempt, tolerance: f64) {
        let Worker {
            solver,
            island,
            answer,
            ..
        } = self;
        let impulses = &mut answer.impulses;
        let bounded = bound_joints(
            solver.as_mut(),
            &island.problem,
            island,
            impulses,
            answer.report,
            tolerance,
        );
        if let Some((report, bias)) = bounded {
            answer.report = report;
            answer.joints_bounded = true;
            (answer.velocities_known, answer.change_known) = (false, false);
            island.problem.free = bias;
            answer.bias = Some(original_bias(island, attempt == Attempt::WithoutPushes));
        }
    }

    fn store_problem(&mut self, task: Task) {
        self.answer.problem = task.store_problems.then(|| SolvedProblem {
            problem: self.island.problem.clone(),
            impulses: self.answer.impulses.clone(),
            report: self.answer.report,
        });
    }

    /// Solves the regularised problem of a large island.
    fn solve_regularised(&mut self, members: &[u32], attempt: Attempt, task: Task) {
        let Worker {
            solver,
            island,
            answer,
            ..
        } = self;
        if attempt == Attempt::WithoutPushes {
            island.restore_pushes();
            island.count_added();
        }
        let mut regularised = fallback::regularised(&island.problem);
        if attempt == Attempt::WithoutPushes || attempt == Attempt::None && task.interval.whole {
            fallback::push_back(&mut regularised, island, task.interval, members);
        }
        let tolerance = task.tolerance.max(ENOUGH);
        let found = solver.solve(&regularised, &mut island.warm, tolerance);
        let mut total = found.after(&answer.report);
        if task.rules.corrects_gaps() && attempt == Attempt::None {
            let mut impulses = std::mem::take(&mut island.warm);
            let bounded = bound_joints(
                solver.as_mut(),
                &regularised,
                island,
                &mut impulses,
                found,
                tolerance,
            );
            island.warm = impulses;
            total = found.after(&answer.report);
            if let Some((report, bias)) = bounded {
                total = report.after(&answer.report);
                answer.joints_bounded = true;
                let changes = bias
                    .iter()
                    .zip(&regularised.free)
                    .map(|(now, old)| now - old);
                let free = island.problem.free.iter_mut();
                free.zip(changes).for_each(|(b, change)| *b += change);
                answer.bias = Some(island.problem.free.clone());
                island.count_added();
            }
        }
        let (problem, found) = (&island.problem, &island.warm);
        let impulses = &mut answer.impulses;
        answer.report =
            fallback::choose_regularised(problem, &total, found, impulses, task.tolerance);
        (answer.velocities_known, answer.change_known) = (false, false);
        answer.relaxed = true;
        if let Some(stored) = (answer.problem.as_mut()).filter(|_| attempt == Attempt::None) {
            stored.impulses.copy_from_slice(&answer.impulses);
            stored.report = answer.report;
        }
    }

    /// Solves an island again without push-outs. Regularises it if the result is hopeless.
    fn solve_without_pushes(&mut self, tolerance: f64) {
        let Worker {
            solver,
            island,
            answer,
            ..
        } = self;
        island.drop_pushes();
        let (problem, impulses) = (&island.problem, &mut answer.impulses);
        let again = solver.solve(problem, &mut island.warm, tolerance);
        if again.residual.velocity < answer.report.residual.velocity {
            impulses.copy_from_slice(&island.warm);
            answer.report = again.after(&answer.report);
            answer.relaxed = true;
        } else {
            answer.report = answer.report.after(&again);
        }
        // nearly solved rigid impulses are better than regularised ones
        if !again.solved() && hopeless(&answer.report) {
            let regularised = fallback::regularised(problem);
            island.warm.fill(Vec2::zeros());
            let found = solver.solve(&regularised, &mut island.warm, tolerance);
            let total = found.after(&answer.report);
            answer.report =
                fallback::choose_regularised(problem, &total, &island.warm, impulses, tolerance);
            answer.relaxed = true;
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
        if !answer.velocities_known {
            (island.problem).velocities(&answer.impulses, &mut answer.velocities);
        }
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
        let (problem, impulses) = (&island.problem, &mut answer.impulses);
        if !answer.velocities_known {
            problem.velocities(impulses, &mut answer.velocities);
        }
        let mut outcome = IslandOutcome {
            report: answer.report,
            contacts_bounded: answer.contacts_bounded,
            joints_bounded: answer.joints_bounded,
            relaxed: answer.relaxed,
            redundant: false,
            gain: 0.0,
        };
        if island.impact() {
            outcome.gain = work(island, impulses, &answer.velocities).max(0.0);
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
