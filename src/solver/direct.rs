use super::best::Best;
use super::continuation::{Continuation, Path, Tools};
use super::factor_cache::FactorCache;
use super::interior_point::InteriorPoint;
use super::response::Response;
use super::status_newton::StatusNewton;
use super::{ImpulseSolver, Nsgs, SolveReport, Velocities, drop_unless_finite};
use crate::contact::{ContactProblem, Judge, Law, Vec2};

/// Newton and interior point for hard islands: towers, mass ratios, sliding heaps, impacts.
///
/// Each stage runs only if the ones before it did not solve the problem:
///
/// 1. Certify the impulses given; failing that, up to four chord steps with the factors of the
///    island's last Newton step, where nine in ten of its statuses are still the same ([`FactorCache`]).
///    Of more than 500 blocks, impulses that were just solved for are solved for once more, to a
///    tenth of the tolerance, though they are certified: what is left of them would be the next
///    steps' disturbance, and a pile that comes to rest wholly needs no solve in most steps. (Of few
///    blocks a solve costs little, and a tower that rests for long leans by more in the end.)
/// 2. Up to four status-Newton steps from them, unless all are zero, or so many statuses have
///    changed since (the residual times the number of blocks says it) that these hardly ever help.
/// 3. Twenty Gauss-Seidel sweeps from them, up to eight Newton steps, and the interior point from
///    near them, with Newton as polish; then eighty sweeps more and the same.
/// 4. The interior point with all contacts alike.
/// 5. If impulses were given, 3 from none.
/// 6. Continuation from an easy problem: from soft contacts, from no friction, from unevenly soft
///    contacts.
/// 7. From the best impulses met, 100, 300, 600 and 900 sweeps, each with up to eight Newton steps.
///
/// Of more than 500 blocks, impulses given that leave more velocity unsolved than none at all are
/// dropped after 1: in a jammed heap they would grow from step to step. Where all contacts of so many
/// are compliant, 4 comes before 3: it hardly ever fails there. Besides, 6 is left out, and where
/// impulses were given the second interior point of 3 and all of 4 and 5: in heaps of 700 to 1700
/// contacts 6 and the second ones solved 5 of 344 problems, at two thirds of all the work; in jammed
/// heaps of 9000 the interior point ends where it did at first, whatever it starts from, and the rest
/// gets as near in a quarter of the time. A large pyramid that is met for the first time is solved by
/// the second interior point of 3, with loads shared out so that the next steps have less to do than
/// after 4.
///
/// The best impulses met are returned. Where velocities are not unique, this order and these
/// starts choose the branch, and the choice repeats bit for bit.
///
/// Newton's systems are factorised in velocity space, `K = M + Jᵀ A J`, sparse and linear in a
/// chain; from an explicit operator as `I + G A`, sparse over the contacts that share a body.
///
/// # Source
/// Alart & Curnier (1991) for the status Newton; Stewart & Trinkle (1996) for the form of friction
/// in the interior point. The order of the stages was chosen by measurement.
#[derive(Debug, Clone, Default)]
pub struct Direct {
    nsgs: Nsgs,
    judge: Judge,
    response: Response,
    newton: StatusNewton,
    interior: InteriorPoint,
    continuation: Continuation,
    best: Best,
    /// Whether the judge's last word is of the impulses returned.
    judged_last: bool,
}

/// Share of the tolerance at which what was moved comes to rest: see 1 of [`Direct`].
const REST: f64 = 0.1;
const WARM_STEPS: usize = 4;
/// Residual times blocks above which Newton's method from the last step's impulses is left out: in
/// drums of 400 contacts it then solves one problem in fifty.
const FAR: f64 = 20.0;
/// Blocks above which what hardly ever helps is left out.
const LARGE: usize = 500;
const SWEEPS_FIRST: [usize; 2] = [20, 80];
const SWEEPS_LAST: [usize; 4] = [100, 300, 600, 900];
const NEWTON_STEPS: usize = 8;

/// Whether all contacts give way: whatever is asked of them there is a solution then.
fn compliant(problem: &ContactProblem) -> bool {
    problem.laws.iter().all(|law| match law {
        Law::Contact { compliance, .. } => *compliance > 0.0,
        _ => true,
    })
}

impl ImpulseSolver for Direct {
    fn name(&self) -> &'static str {
        "direct"
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
    ) -> SolveReport {
        self.run(problem, impulses, tolerance, None)
    }

    fn solve_next(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        carried: &mut FactorCache,
    ) -> SolveReport {
        self.run(problem, impulses, tolerance, Some(carried))
    }

    fn velocities(&self) -> Option<Velocities<'_>> {
        self.judged_last.then(|| Velocities::of(&self.judge))
    }
}

impl Direct {
    /// Both of the trait's solves.
    pub(super) fn run(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        mut carried: Option<&mut FactorCache>,
    ) -> SolveReport {
        drop_unless_finite(impulses);
        self.newton.begin();
        let mut residual = self.judge.begin(problem, impulses);
        let mut report = SolveReport::of(residual, tolerance);
        let solved = report.solved();
        self.judged_last = solved;
        let large = problem.len() > LARGE;
        let factors = (carried.as_mut()).filter(|c| !solved || large && c.settles());
        let newton = factors.and_then(|c| c.of(problem));
        if solved && newton.is_none() {
            return report;
        }
        let enough = if solved { REST * tolerance } else { tolerance };
        self.best.start(impulses, residual, enough);
        if let Some(newton) = newton {
            newton.settles = !solved;
            if self.best.solved() {
                return report;
            }
            let (judge, best) = (&mut self.judge, &mut self.best);
            self.judged_last = self.newton.chord(problem, judge, impulses, newton, best);
            self.best.ask(tolerance);
            if self.best.solved() {
                return self.found(impulses, report);
            }
            self.judged_last = false;
            if solved {
                return report;
            }
        }
        if large {
            let none = vec![Vec2::zeros(); problem.len()];
            let nothing = self.judge.natural_map(problem, &none);
            if residual.velocity > nothing.velocity {
                residual = nothing;
                impulses.copy_from_slice(&none);
                self.best.start(impulses, residual, tolerance);
            }
        }
        self.response.prepare(problem);
        let warm = impulses.iter().any(|p| *p != Vec2::zeros());
        if warm && residual.merit() * problem.len() as f64 <= FAR {
            self.polish(problem, impulses, WARM_STEPS, &mut report);
        }
        if large && compliant(problem) {
            self.interior_point(problem, None, &mut report);
        }
        self.approach(problem, impulses, warm, tolerance, &mut report);
        let jammed = warm && problem.len() > LARGE;
        if !jammed {
            self.interior_point(problem, None, &mut report);
        }
        if warm && !jammed && !self.best.solved() {
            // impulses of the last step can lead astray
            impulses.fill(Vec2::zeros());
            self.approach(problem, impulses, warm, tolerance, &mut report);
        }
        for path in Path::ALL {
            if !self.best.solved() && problem.len() <= LARGE {
                let tools = &mut Tools {
                    judge: &mut self.judge,
                    response: &mut self.response,
                    newton: &mut self.newton,
                    interior: &mut self.interior,
                };
                let best = &mut self.best;
                report.factorisations += self.continuation.run(problem, path, tools, best);
            }
        }
        if !self.best.solved() {
            impulses.copy_from_slice(&self.best.impulses);
        }
        for sweeps in SWEEPS_LAST {
            self.sweep_and_polish(problem, impulses, sweeps, tolerance, &mut report);
        }
        if let Some(carried) = carried {
            self.newton.hand_over(&mut self.response, carried);
        }
        self.found(impulses, report)
    }

    /// The best impulses met, with what was done.
    fn found(&self, impulses: &mut [Vec2], mut report: SolveReport) -> SolveReport {
        impulses.copy_from_slice(&self.best.impulses);
        report.status = self.best.status();
        report.residual = self.best.residual;
        report
    }

    /// Stage 3.
    fn approach(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        warm: bool,
        tolerance: f64,
        report: &mut SolveReport,
    ) {
        for (k, sweeps) in SWEEPS_FIRST.into_iter().enumerate() {
            self.sweep_and_polish(problem, impulses, sweeps, tolerance, report);
            if k == 0 || problem.len() <= LARGE || !warm {
                self.interior_point(problem, Some(impulses), report);
            }
        }
    }

    /// Sweeps from `impulses`, then Newton from where they ended; nothing once solved.
    fn sweep_and_polish(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        sweeps: usize,
        tolerance: f64,
        report: &mut SolveReport,
    ) {
        if self.best.solved() {
            return;
        }
        let judge = &mut self.judge;
        report.sweeps += self.nsgs.sweep(problem, judge, impulses, tolerance, sweeps);
        self.best
            .offer(impulses, judge.natural_map(problem, impulses));
        if !self.best.solved() {
            self.polish(problem, impulses, NEWTON_STEPS, report);
        }
    }

    fn polish(
        &mut self,
        problem: &ContactProblem,
        impulses: &[Vec2],
        steps: usize,
        report: &mut SolveReport,
    ) {
        report.factorisations += self.newton.run(
            problem,
            &mut self.judge,
            &mut self.response,
            impulses,
            None,
            steps,
            &mut self.best,
        );
    }

    fn interior_point(
        &mut self,
        problem: &ContactProblem,
        near: Option<&[Vec2]>,
        report: &mut SolveReport,
    ) {
        if self.best.solved() {
            return;
        }
        report.factorisations += self.interior.run(
            problem,
            &mut self.judge,
            &mut self.response,
            &mut self.newton,
            near,
            &mut self.best,
        );
    }
}
