use super::{ImpulseSolver, SolveReport};
use crate::contact::{ContactProblem, Judge, SweepState, Vec2, solve_local};

/// Nonsmooth Gauss-Seidel: block after block, each solved exactly with the others frozen.
///
/// ```text
/// P_i ← solve_local(G_ii, ξ_i − G_ii P_i)                                   (1)
/// ```
///
/// Sweeps alternate in direction, which carries a load through a stack twice as fast. Right for
/// large, well-conditioned islands; slow for good on towers and mass ratios.
///
/// # Source
/// Jean & Moreau (1992); Acary, Brémond & Huber, *On solving contact problems with Coulomb
/// friction* (2018).
#[derive(Debug, Clone)]
pub struct Nsgs {
    /// Most sweeps a solve may take.
    pub max_sweeps: usize,
    state: SweepState,
    judge: Judge,
}

impl Default for Nsgs {
    fn default() -> Self {
        Nsgs::with_budget(2000)
    }
}

impl Nsgs {
    /// A solver that stops after `max_sweeps`.
    pub fn with_budget(max_sweeps: usize) -> Self {
        Nsgs {
            max_sweeps,
            state: SweepState::default(),
            judge: Judge::default(),
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
                let new = solve_local(block, free, law);
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
        let mut judge = std::mem::take(&mut self.judge);
        judge.prepare(problem);
        let sweeps = self.sweep(problem, &mut judge, impulses, tolerance, self.max_sweeps);
        if impulses
            .iter()
            .any(|p| !(p.x.is_finite() && p.y.is_finite()))
        {
            // products of masses and arms overflowed
            impulses.fill(Vec2::zeros());
        }
        let residual = judge.natural_map(problem, impulses);
        self.judge = judge;
        SolveReport {
            sweeps,
            ..SolveReport::of(residual, tolerance)
        }
    }
}
