use super::best::Best;
use super::block_status::Status;
use super::four_sweep::FourSweep;
use super::momentum::Momentum;
use super::{ImpulseSolver, SolveReport};
use crate::contact::{
    ContactProblem, Delassus, Judge, Law, Mat2, SweepState, Vec2, project_onto_cone, solve_local,
};
use fearless_simd::Level;

/// New impulse of one block, from `G_ii`, `ξ_i − G_ii P_i`, the old impulse `P_i` and the law.
pub type LocalStep = fn(&Mat2, Vec2, Vec2, &Law) -> Vec2;

/// Nonsmooth Gauss-Seidel: solves one block after the other exactly, with the others frozen.
///
/// ```text
/// P_i ← Π_i(P_i + ω (solve_local(G_ii, ξ_i − G_ii P_i) − P_i))              (1)
/// ```
///
/// where `Π_i` projects on the set that the law of the block admits, if ω is not 1. Suits large,
/// well-conditioned islands; slow on towers and mass ratios. The result is never worse than the
/// start.
///
/// # Order
/// Ten sweeps go from the first block to the last, ten back, and so on. Of the problems that
/// `moreau2d bench --solvers` measures this solves 100 to 1e-4. Turning after each sweep solves 95,
/// and never turning 93. On the problems that all of them solve, turning every ten sweeps needs
/// 0.72 times the sweeps of turning after each (0.64 to 1e-8; geometric means). [`super::Direct`]
/// starts from a few sweeps and turns after each one: in the catalogue's scenes no order was best
/// throughout for it. Its last, long sweeps turn every ten.
///
/// # Momentum
/// [`super::Direct`] starts problems with unique impulses from sweeps by fours that have Nesterov's
/// momentum. In a drum of 280 contacts it then needs half the factorisations.
///
/// # Cost
/// Frictional contacts are solved four at a time, in groups that change nothing but the time: the
/// blocks of each body stay in order, and every number is the same to the last bit. In a pyramid of
/// 5050 boxes a core makes 88 million contact-sweeps a second, the judge included. One block at a
/// time makes 30 million
/// (`moreau2d bench large-pyramid --solver nsgs --tolerance 1e-9 --settle 1 --steps 2`). In drums
/// and smaller pyramids, which stay in the processor's caches, sweeps alone make 90 to 145 million.
/// Towers and arches, where each block waits for the one before, problems with fewer than 32
/// blocks, and explicit operators are swept one block at a time. Groups of eight are no faster.
/// Stored inverses would be 1.3 times as fast, with other last bits.
///
/// # Source
/// Jean & Moreau (1992); Acary, Brémond & Huber, *On solving contact problems with Coulomb
/// friction* (2018).
#[derive(Debug, Clone)]
pub struct Nsgs {
    /// Most sweeps of a solve.
    pub max_sweeps: usize,
    /// ω in (0, 2); above 1 is over-relaxation, which may oscillate.
    pub relaxation: f64,
    /// `None`: the exact solution of the block.
    step: Option<LocalStep>,
    state: SweepState,
    fours: FourSweep,
    momentum: Momentum,
    /// At the last comparison.
    statuses: Vec<Status>,
    judge: Judge,
    best: Best,
}

/// Order of the sweeps of a solve and frequency of its checks, see [`Nsgs`].
pub(super) struct Plan {
    /// Number of sweeps in one direction before the direction turns.
    turn: usize,
    /// Least pause between two checks by the judge, as a share of all sweeps so far.
    pause: f64,
    /// Whether sweeps by fours get momentum.
    momentum: bool,
    /// Whether to stop early, once ten sweeps change no status.
    settles: bool,
}

/// For a solve by sweeps alone, and the last sweeps of a hard problem. Slow sweeps change little, so
/// that without a pause the judge would be called after each of them. It costs about three sweeps by
/// fours.
pub(super) const ALONE: Plan = Plan {
    turn: 10,
    pause: 1.0 / 16.0,
    momentum: false,
    settles: false,
};

/// For a few sweeps that provide a start.
pub(super) const START: Plan = Plan {
    turn: 1,
    pause: 0.0,
    momentum: false,
    settles: false,
};

/// For sweeps until Newton's method can take over.
pub(super) const FAST: Plan = Plan {
    momentum: true,
    settles: true,
    ..START
};

/// Number of sweeps between two comparisons of the statuses.
const COMPARED: usize = 10;
/// Distance from the edge of the friction cone within which a contact slips, as a share of the cone's
/// width.
const EDGE: f64 = 1e-9;

/// Least number of blocks for groups of four.
const LEAST_BLOCKS_FOR_FOURS: usize = 32;

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
            relaxation: 1.0,
            step: None,
            state: SweepState::default(),
            fours: FourSweep::default(),
            momentum: Momentum::default(),
            statuses: Vec::new(),
            judge: Judge::default(),
            best: Best::default(),
        }
    }

    /// A solver whose sweeps use `step` for each block instead of the exact local solution.
    pub fn with_local_step(max_sweeps: usize, step: LocalStep) -> Self {
        Nsgs {
            step: Some(step),
            ..Nsgs::with_budget(max_sweeps)
        }
    }

    /// Runs up to `sweeps` sweeps from `impulses`, in alternating directions. Stops early once the
    /// judge certifies the impulses. Returns the number of sweeps done. `judge` must be prepared
    /// for `problem`.
    pub(super) fn run(
        &mut self,
        problem: &ContactProblem,
        judge: &mut Judge,
        impulses: &mut [Vec2],
        tolerance: f64,
        sweeps: usize,
        plan: &Plan,
    ) -> usize {
        let operator = &problem.operator;
        operator.restart(impulses, &mut self.state);
        let by_four = match operator {
            Delassus::Bodies(op)
                if self.takes_fours(problem) && self.fours.arrange(problem, op) =>
            {
                let (diagonal, bodies) = (judge.diagonal(), self.state.bodies());
                (self.fours).gather(problem, op, diagonal, impulses, bodies);
                Some(op)
            }
            _ => None,
        };
        let level = Level::new();
        let mut since_check = 0;
        let accelerated = by_four.filter(|_| plan.momentum);
        self.statuses.clear();
        for sweep in 0..sweeps {
            match accelerated {
                Some(_) if sweep == 0 => self.momentum.start(&self.fours),
                Some(op) if sweep % 2 == 0 => self.momentum.step(&mut self.fours, op),
                _ => {}
            }
            let backwards = sweep / plan.turn % 2 == 1;
            let diagonal = judge.diagonal();
            let [change, scale] = match by_four {
                Some(op) => self.fours.sweep(level, problem, op, diagonal, backwards),
                None => self.one_by_one(problem, diagonal, impulses, backwards),
            };
            since_check += 1;
            let rests = change == 0.0;
            let hint = change <= tolerance * scale;
            let checks = rests || plan.checks(hint, since_check, sweep);
            let compares = plan.settles && (sweep + 1) % COMPARED == 0;
            if by_four.is_some() && (checks || compares || sweep + 1 == sweeps) {
                self.fours.write(impulses);
            }
            if rests {
                return sweep + 1;
            }
            if compares && self.settled(problem, impulses) {
                return sweep + 1;
            }
            if checks {
                since_check = 0;
                if judge.natural_map(problem, impulses).certified(tolerance) {
                    return sweep + 1;
                }
            }
        }
        sweeps
    }

    /// Whether no block has changed its status since the last call.
    fn settled(&mut self, problem: &ContactProblem, impulses: &[Vec2]) -> bool {
        let blocks = problem.laws.iter().zip(impulses);
        let now = blocks.map(|(law, p)| Status::of(law, Vec2::new(p.x, (1.0 + EDGE) * p.y)));
        let same = now.clone().eq(self.statuses.iter().copied());
        if !same {
            self.statuses.clear();
            self.statuses.extend(now);
        }
        same
    }

    /// Whether to try the groups of [`FourSweep`] on `problem`.
    fn takes_fours(&self, problem: &ContactProblem) -> bool {
        self.step.is_none() && self.relaxation == 1.0 && problem.len() >= LEAST_BLOCKS_FOR_FOURS
    }

    /// One sweep, one block at a time. Returns the largest change of a local velocity, and the
    /// largest velocity to compare it with \[m/s\].
    fn one_by_one(
        &mut self,
        problem: &ContactProblem,
        diagonal: &[Mat2],
        impulses: &mut [Vec2],
        backwards: bool,
    ) -> [f64; 2] {
        let n = problem.len();
        let operator = &problem.operator;
        let (mut change, mut scale) = (0.0f64, 0.0f64);
        for k in 0..n {
            let i = if backwards { n - 1 - k } else { k };
            let (block, law) = (&diagonal[i], &problem.laws[i]);
            let old = impulses[i];
            let free = operator.read(i, &self.state) + problem.free[i] - block * old;
            let mut new = match self.step {
                None => solve_local(block, free, law),
                Some(step) => step(block, free, old, law),
            };
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
        [change, scale]
    }
}

impl Plan {
    /// Whether to call the judge. The change of a sweep is a cheap hint; only the judge decides.
    fn checks(&self, hint: bool, since_check: usize, sweep: usize) -> bool {
        since_check == 50 || hint && since_check as f64 > self.pause * sweep as f64
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
        // a start that is not finite is replaced by zero
        if impulses.iter().any(|p| !p.iter().all(|x| x.is_finite())) {
            impulses.fill(Vec2::zeros());
        }
        let mut judge = std::mem::take(&mut self.judge);
        judge.prepare(problem);
        let residual = judge.natural_map(problem, impulses);
        self.best.start(impulses, residual, tolerance);
        let mut sweeps = 0;
        if !self.best.solved() {
            let budget = self.max_sweeps;
            sweeps = self.run(problem, &mut judge, impulses, tolerance, budget, &ALONE);
            // sweeps may diverge until products of masses and arms overflow
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
#[path = "nsgs_tests.rs"]
pub(crate) mod tests;
