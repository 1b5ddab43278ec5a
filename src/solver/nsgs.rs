use super::best::Best;
use super::{ImpulseSolver, SolveReport};
use crate::contact::{
    ContactProblem, Judge, Law, Mat2, SweepState, Vec2, project_onto_cone, solve_local,
};

/// What a sweep makes of one block: from `G_ii`, `ξ_i − G_ii P_i`, `P_i` and the law.
pub(super) type LocalStep = fn(&Mat2, Vec2, Vec2, &Law) -> Vec2;

/// Nonsmooth Gauss-Seidel: block after block, each solved exactly with the others frozen.
///
/// ```text
/// P_i ← Π_i(P_i + ω (solve_local(G_ii, ξ_i − G_ii P_i) − P_i))              (1)
/// ```
///
/// with the projection `Π_i` on what the law of the block admits, where ω is not 1. Sweeps
/// alternate in direction, which carries a load through a stack twice as fast. Right for large,
/// well-conditioned islands; slow for good on towers and mass ratios. What is returned is never worse
/// than the start.
///
/// # Source
/// Jean & Moreau (1992); Acary, Brémond & Huber, *On solving contact problems with Coulomb
/// friction* (2018).
#[derive(Debug, Clone)]
pub struct Nsgs {
    /// Most sweeps a solve may take.
    pub max_sweeps: usize,
    /// ω in (0, 2); above 1 is over-relaxation, which may oscillate.
    pub relaxation: f64,
    step: LocalStep,
    state: SweepState,
    judge: Judge,
    best: Best,
}

impl Default for Nsgs {
    fn default() -> Self {
        Nsgs::with_budget(2000)
    }
}

impl Nsgs {
    /// A solver that stops after `max_sweeps`.
    pub fn with_budget(max_sweeps: usize) -> Self {
        Nsgs::with_step(max_sweeps, |block, free, _, law| {
            solve_local(block, free, law)
        })
    }

    /// Sweeps of another step.
    pub(super) fn with_step(max_sweeps: usize, step: LocalStep) -> Self {
        Nsgs {
            max_sweeps,
            relaxation: 1.0,
            step,
            state: SweepState::default(),
            judge: Judge::default(),
            best: Best::default(),
        }
    }

    /// Runs up to `sweeps` sweeps from `impulses`; stops early once the judge certifies them.
    /// Returns the number of sweeps done. `judge` is prepared for `problem`.
    pub(super) fn sweep(
        &mut self,
        problem: &ContactProblem,
        judge: &mut Judge,
        impulses: &mut [Vec2],
        tolerance: f64,
        sweeps: usize,
    ) -> usize {
        let n = problem.len();
        let operator = &problem.operator;
        operator.restart(impulses, &mut self.state);
        let mut since_check = 0;
        for sweep in 0..sweeps {
            // the largest change of a local velocity, and the largest velocity it compares with
            let (mut change, mut scale) = (0.0f64, 0.0f64);
            for k in 0..n {
                let i = if sweep % 2 == 0 { k } else { n - 1 - k };
                let (block, law) = (&judge.diagonal()[i], &problem.laws[i]);
                let old = impulses[i];
                let free = operator.read(i, &self.state) + problem.free[i] - block * old;
                let mut new = (self.step)(block, free, old, law);
                if self.relaxation != 1.0 {
                    new = admitted(old + self.relaxation * (new - old), law);
                }
                let delta = new - old;
                let trace = block.trace();
                if delta != Vec2::zeros() {
                    operator.push(i, delta, &mut self.state);
                    impulses[i] = new;
                    change = change.max(delta.amax() * trace);
                }
                scale = scale.max(new.amax() * trace).max(problem.free[i].amax());
            }
            since_check += 1;
            if change == 0.0 {
                return sweep + 1;
            }
            // the change of a sweep is a cheap hint; only the judge decides
            if change <= tolerance * scale || since_check == 50 {
                since_check = 0;
                if judge.natural_map(problem, impulses).certified(tolerance) {
                    return sweep + 1;
                }
            }
        }
        sweeps
    }
}

/// The nearest impulse that a law admits.
fn admitted(p: Vec2, law: &Law) -> Vec2 {
    match *law {
        Law::Contact { friction, .. } => project_onto_cone(p, friction),
        Law::Pin => p,
        Law::Bounded { lower, upper, .. } => Vec2::new(p.x.clamp(lower, upper), 0.0),
    }
}

impl ImpulseSolver for Nsgs {
    fn name(&self) -> &'static str {
        "nsgs"
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
    ) -> SolveReport {
        // a start that is not finite is no start
        if impulses.iter().any(|p| !p.iter().all(|x| x.is_finite())) {
            impulses.fill(Vec2::zeros());
        }
        let mut judge = std::mem::take(&mut self.judge);
        judge.prepare(problem);
        let residual = judge.natural_map(problem, impulses);
        self.best.start(impulses, residual, tolerance);
        let mut sweeps = 0;
        if !self.best.solved() {
            sweeps = self.sweep(problem, &mut judge, impulses, tolerance, self.max_sweeps);
            // sweeps may diverge, until products of masses and arms overflow
            self.best
                .offer(impulses, judge.natural_map(problem, impulses));
            impulses.copy_from_slice(&self.best.impulses);
        }
        self.judge = judge;
        SolveReport {
            sweeps,
            ..SolveReport::of(self.best.residual, tolerance)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::examples::{pyramid, tower};
    use crate::solver::Prox;
    use crate::solver::solve_cold;

    /// What the impulses do is unique where friction holds everything, and both methods find it.
    #[test]
    fn relaxed_and_split_sweeps_find_the_same_velocities() {
        for bodies in [tower(4, 0.5, |_| 1.0), pyramid(4, 0.5)] {
            let problem = bodies.problem();
            let (exact, report) = solve_cold::<Nsgs>(&problem, 1e-6);
            assert!(report.solved(), "{report:?}");
            let end = problem.local_velocity(&exact);
            for relaxation in [0.7, 1.4] {
                let mut impulses = vec![Vec2::zeros(); problem.len()];
                let mut relaxed = Nsgs {
                    relaxation,
                    ..Nsgs::default()
                };
                let report = relaxed.solve(&problem, &mut impulses, 1e-6);
                assert!(report.solved(), "{relaxation}: {report:?}");
                // the tolerance, times the size of the operator's rows
                let apart = |a: &Vec2, b: &Vec2| (a - b).amax();
                let found = problem.local_velocity(&impulses);
                let worst = end
                    .iter()
                    .zip(&found)
                    .map(|(a, b)| apart(a, b))
                    .fold(0.0, f64::max);
                assert!(worst < 1e-5, "{relaxation}: {worst}");
            }
            let (_, report) = solve_cold::<Prox>(&problem, 1e-6);
            assert!(report.solved(), "prox: {report:?}");
        }
    }
}
