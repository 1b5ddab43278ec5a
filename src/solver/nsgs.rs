use super::best::Best;
use super::four_sweep::FourSweep;
use super::{ImpulseSolver, SolveReport, prox};
use crate::contact::{
    ContactProblem, Delassus, Judge, Law, Mat2, SweepState, Vec2, project_onto_cone, solve_local,
};
use fearless_simd::Level;

/// What a sweep makes of one block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum LocalStep {
    /// The solution with all other blocks frozen.
    Exact,
    /// That of [`super::Prox`].
    Prox,
}

/// Nonsmooth Gauss-Seidel: block after block, each solved exactly with the others frozen.
///
/// ```text
/// P_i ← Π_i(P_i + ω (solve_local(G_ii, ξ_i − G_ii P_i) − P_i))              (1)
/// ```
///
/// with the projection `Π_i` on what the law of the block admits, where ω is not 1. Right for large,
/// well-conditioned islands; slow for good on towers and mass ratios. What is returned is never worse
/// than the start.
///
/// # Order
/// Ten sweeps go from the first block to the last, ten back, and so on. Of the problems that
/// `moreau2d bench --solvers` measures this solves 100 to 1e-4, where a turn after each sweep solves 95
/// and none 93; of those solved by all it takes 0.72 times the sweeps of a turn after each (0.64 to
/// 1e-8; geometric means). [`super::Direct`], which starts from a few sweeps, turns after each: its
/// work in the scenes of the catalogue has no order that is best throughout.
///
/// # Cost
/// Frictional contacts are taken four at a time, in groups that change nothing but the time: each
/// body meets its blocks in the same order, and every number is the same to the last bit. On one core
/// 90 to 145 million contacts a second, where block after block makes 30 to 60 (drum of 300, box drum of
/// 5900, pyramids of 200 to 30 000 contacts; one by one in towers and arches, where each block waits
/// for the one before, below 32 blocks, and of an operator without bodies). Groups of eight are no
/// faster, and colours that share no body are, but need up to three and a half times the sweeps.
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
    fours: FourSweep,
    judge: Judge,
    best: Best,
}

/// Sweeps in one direction, see [`Nsgs`].
const TURN: usize = 10;

/// Blocks from which on groups of four are tried.
const FEWEST_IN_FOURS: usize = 32;

impl Default for Nsgs {
    fn default() -> Self {
        Nsgs::with_budget(2000)
    }
}

impl Nsgs {
    /// A solver that stops after `max_sweeps`.
    pub fn with_budget(max_sweeps: usize) -> Self {
        Nsgs::with_step(max_sweeps, LocalStep::Exact)
    }

    /// Sweeps of another step.
    pub(super) fn with_step(max_sweeps: usize, step: LocalStep) -> Self {
        Nsgs {
            max_sweeps,
            relaxation: 1.0,
            step,
            state: SweepState::default(),
            fours: FourSweep::default(),
            judge: Judge::default(),
            best: Best::default(),
        }
    }

    /// Runs up to `sweeps` sweeps from `impulses`, by turns forwards and backwards; stops early once
    /// the judge certifies them. Returns the number of sweeps done. `judge` is prepared for `problem`.
    pub(super) fn sweep(
        &mut self,
        problem: &ContactProblem,
        judge: &mut Judge,
        impulses: &mut [Vec2],
        tolerance: f64,
        sweeps: usize,
    ) -> usize {
        self.run(problem, judge, impulses, tolerance, sweeps, 1)
    }

    /// [`Nsgs::sweep`] with `turn` sweeps in one direction before as many in the other.
    fn run(
        &mut self,
        problem: &ContactProblem,
        judge: &mut Judge,
        impulses: &mut [Vec2],
        tolerance: f64,
        sweeps: usize,
        turn: usize,
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
        for sweep in 0..sweeps {
            let backwards = sweep / turn % 2 == 1;
            let diagonal = judge.diagonal();
            let [change, scale] = match by_four {
                Some(op) => self.fours.sweep(level, problem, op, diagonal, backwards),
                None => self.one_by_one(problem, diagonal, impulses, backwards),
            };
            since_check += 1;
            let rests = change == 0.0;
            let asks = rests || asks(change <= tolerance * scale, since_check, sweep);
            if by_four.is_some() && (asks || sweep + 1 == sweeps) {
                self.fours.write(impulses);
            }
            if rests {
                return sweep + 1;
            }
            if asks {
                since_check = 0;
                if judge.natural_map(problem, impulses).certified(tolerance) {
                    return sweep + 1;
                }
            }
        }
        sweeps
    }

    /// Whether sweeps of `problem` are worth the groups of [`FourSweep`].
    fn takes_fours(&self, problem: &ContactProblem) -> bool {
        self.step == LocalStep::Exact && self.relaxation == 1.0 && problem.len() >= FEWEST_IN_FOURS
    }

    /// One sweep, block after block: the largest change of a local velocity, and the largest
    /// velocity it compares with \[m/s\].
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
                LocalStep::Exact => solve_local(block, free, law),
                LocalStep::Prox => prox::step(block, free, old, law),
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

/// Whether to ask the judge: the change of a sweep is a cheap hint, only the judge decides. It costs
/// some three sweeps by fours, and is not asked again before another 16th of all sweeps is done:
/// slow sweeps change little, and would ask each time.
fn asks(hint: bool, since_check: usize, sweep: usize) -> bool {
    since_check == 50 || hint && 16 * since_check > sweep
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
            let budget = self.max_sweeps;
            sweeps = self.run(problem, &mut judge, impulses, tolerance, budget, TURN);
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
    use crate::contact::examples::{Lcg, heap, pyramid, tower};
    use crate::contact::levels;
    use crate::contact::problem_file::{StoredProblem, read};
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

    fn stored(name: &str) -> ContactProblem {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/problems");
        let bytes = std::fs::read(folder.join(name)).expect("a problem file");
        match read(&bytes).expect("a problem").problem {
            StoredProblem::Contact { problem, .. } => problem,
            StoredProblem::Lcp { .. } => panic!("an LCP"),
        }
    }

    fn bits(impulses: &[Vec2]) -> Vec<[u64; 2]> {
        impulses
            .iter()
            .map(|p| [p.x.to_bits(), p.y.to_bits()])
            .collect()
    }

    /// Sweeps of four contacts at a time against block after block, forwards and backwards, from
    /// impulses of all kinds: the same impulses, change and scale to the last bit.
    #[test]
    fn four_at_a_time_is_block_after_block() {
        let mut soft = heap(9, 7, 0.4, 1.0, 5).problem();
        for (k, law) in soft.laws.iter_mut().enumerate() {
            // smooth, rough and steep, hard and soft
            *law = Law::Contact {
                friction: [0.0, 0.3, 1.0, 30.0][k % 4],
                compliance: [0.0, 0.0, 0.5][k % 3],
            };
        }
        // bodies that one axis is locked of, and rows that are no contact's between points
        let mut odd = heap(9, 7, 0.4, 1.0, 6).problem();
        if let Delassus::Bodies(op) = &mut odd.operator {
            op.inverse_mass[7].x = 0.0;
            op.inverse_mass[20].y = 0.0;
            op.rows[30].jacobian[1][1] *= 0.5;
            op.rows[50].jacobian[0][0].x += 0.1;
            op.rows[60].bodies[0] = op.rows[60].bodies[1];
        }
        for (name, problem, alone) in [
            ("odd", odd, 0),
            ("pyramid", pyramid(9, 0.5).problem(), 0),
            ("heap", heap(12, 8, 0.5, 2.0, 1).problem(), 0),
            ("soft", soft, 0),
            ("all laws", stored("heap-all-laws.json"), 47),
            ("drum", stored("drum-mu0.5-step400.json"), 0),
            ("hit", stored("left-hit-heap-804.json"), 0),
        ] {
            let Delassus::Bodies(op) = &problem.operator else {
                panic!("bodies");
            };
            let others = |law: &&Law| !matches!(law, Law::Contact { .. });
            assert_eq!(problem.laws.iter().filter(others).count(), alone, "{name}");
            let judge = Judge::new(&problem);
            let diagonal = judge.diagonal();
            let mut random = Lcg(11);
            let mut one = Nsgs::default();
            let mut impulses = vec![Vec2::zeros(); problem.len()];
            for (p, law) in impulses.iter_mut().zip(&problem.laws) {
                if law.rows() == 2 && random.next() < 0.5 {
                    *p = Vec2::new(random.next(), random.next() - 0.5);
                }
            }
            problem.operator.restart(&impulses, &mut one.state);
            let (start, bodies) = (impulses.clone(), one.state.bodies().to_vec());
            let wanted: Vec<_> = (0..60)
                .map(|sweep| {
                    let figures = one.one_by_one(&problem, diagonal, &mut impulses, sweep % 2 == 1);
                    (figures.map(f64::to_bits), bits(&impulses))
                })
                .collect();
            let mut four = FourSweep::default();
            for level in levels() {
                four.arrange(&problem, op);
                four.gather(&problem, op, diagonal, &start, &bodies);
                let mut by_four = vec![Vec2::zeros(); problem.len()];
                for (sweep, wanted) in wanted.iter().enumerate() {
                    let figures = four.sweep(level, &problem, op, diagonal, sweep % 2 == 1);
                    four.write(&mut by_four);
                    let found = (figures.map(f64::to_bits), bits(&by_four));
                    assert!(found == *wanted, "{name}, sweep {sweep}, {level:?}");
                }
            }
        }
    }

    /// A turn after every tenth sweep takes fewer of them than a turn after each, whichever end the
    /// blocks are numbered from.
    #[test]
    fn ten_sweeps_in_one_direction_need_fewer() {
        for name in ["pyramid-scene-step60.json", "drum-mu0.5-step400.json"] {
            let problem = stored(name);
            let mut turned = problem.clone();
            turned.free.reverse();
            turned.laws.reverse();
            if let Delassus::Bodies(op) = &mut turned.operator {
                op.rows.reverse();
            }
            for problem in [problem, turned] {
                let mut impulses = vec![Vec2::zeros(); problem.len()];
                let mut judge = Judge::new(&problem);
                let each = Nsgs::default().sweep(&problem, &mut judge, &mut impulses, 1e-7, 20_000);
                let (_, tenth) = solve_cold::<Nsgs>(&problem, 1e-7);
                assert!(tenth.solved());
                assert!(
                    10 * tenth.sweeps < 9 * each,
                    "{name}: {} {each}",
                    tenth.sweeps
                );
            }
        }
    }

    /// A hint that was refused is not heard in each sweep that follows.
    #[test]
    fn the_judge_is_asked_ever_more_seldom() {
        let asked = |from: usize| {
            let mut since_check = 0;
            let refused = (from..from + 1000).filter(|&sweep| {
                since_check += 1;
                let asks = asks(true, since_check, sweep);
                since_check *= usize::from(!asks);
                asks
            });
            refused.count()
        };
        assert!((0..16).all(|sweep| asks(true, 1, sweep)));
        assert!(asked(0) < 80, "{}", asked(0));
        // each fiftieth whatever the hint
        assert_eq!(asked(10_000), 20);
        assert!(!asks(false, 49, 0) && asks(false, 50, 0));
    }

    /// A solve by fours ends where the same sweeps block after block do, with as many of them, on
    /// whatever the solver was used for before.
    #[test]
    fn a_solve_by_fours_is_the_solve() {
        let mut used = Nsgs::with_budget(120);
        for problem in [
            heap(12, 8, 0.5, 0.1, 1).problem(),
            stored("heap-all-laws.json"),
            tower(30, 0.5, |_| 1.0).problem(),
            pyramid(9, 0.5).problem(),
        ] {
            let mut impulses = vec![Vec2::zeros(); problem.len()];
            let report = used.solve(&problem, &mut impulses, 1e-5);
            let mut judge = Judge::new(&problem);
            let mut plain = Nsgs::default();
            let mut wanted = vec![Vec2::zeros(); problem.len()];
            problem.operator.restart(&wanted, &mut plain.state);
            let mut best = vec![Vec2::zeros(); problem.len()];
            for sweep in 0..report.sweeps {
                let diagonal = judge.diagonal().to_vec();
                plain.one_by_one(&problem, &diagonal, &mut wanted, sweep / 10 % 2 == 1);
            }
            let end = judge.natural_map(&problem, &wanted).merit();
            if end < judge.natural_map(&problem, &best).merit() {
                best.copy_from_slice(&wanted);
            }
            assert!(report.sweeps > 1);
            assert_eq!(bits(&impulses), bits(&best));
        }
    }
}
