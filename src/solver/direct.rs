use super::best::Best;
use super::continuation::{Continuation, Path, Tools};
use super::factor_cache::FactorCache;
use super::interior_point::{InteriorPoint, Start};
use super::nsgs::{ALONE, FAST, Plan, START};
use super::response::Response;
use super::status_newton::StatusNewton;
use super::{ImpulseSolver, Nsgs, SolveReport, Velocities, drop_unless_finite};
use crate::contact::{ContactProblem, Delassus, Judge, Law, Vec2};

/// Newton and interior point for hard islands: towers, mass ratios, sliding heaps, impacts.
///
/// Each stage runs only if no earlier stage solved the problem:
///
/// 1. Certify the start impulses. If this fails, take up to four chord steps with the factors of
///    the island's last Newton step, as long as nine in ten statuses are unchanged
///    ([`FactorCache`]). They aim at a residual of 1e-11, or a thousandth of the tolerance, even if the
///    start impulses are certified: what is left of an error grows in the next steps, makes towers
///    lean, and leaves gaps that ask for another solve.
/// 2. Up to four status-Newton steps from the start impulses, unless the residual times the number of
///    blocks is large: then so many statuses have changed that Newton hardly ever converges. If the
///    start impulses are all zero and a contact has friction: the interior point on the convex
///    problem instead, for a state of rest. Other stages can find another solution, or none: without
///    this one a rope of 64 links round a drum, 3 % below the load that friction can hold, slips at
///    each of seven step lengths, in double precision.
/// 3. If there are no joints and the impulses are unique, that is if the contacts that carry load have
///    no more rows than the bodies have coordinates: Gauss-Seidel sweeps with momentum ([`Nsgs`]), up
///    to sixty, until ten of them change no status, and up to eight Newton steps; then the same with up
///    to a hundred more. In a drum of discs this halves the factorisations. In heaps of boxes it helps
///    nothing, and leaves impulses that hold each other in balance. Problems of fewer than 32 blocks
///    are swept without momentum.
/// 4. Twenty Gauss-Seidel sweeps, up to eight Newton steps, and the interior point from near the
///    swept impulses, with Newton as polish. Then eighty more sweeps and the same again.
/// 5. The interior point with the same start for all contacts.
/// 6. If the start impulses were not zero: stage 4 from zero.
/// 7. Continuation from an easy problem: from soft contacts, from no friction, from unevenly soft
///    contacts.
/// 8. From the best impulses found, 100, 300, 600 and 900 sweeps that turn every ten, each with up to
///    eight Newton steps. Turning after each sweep, 1900 sweeps could not end a step of the thresher
///    that the others end in 1150. Up to 500 blocks 4000 more follow where a tenth of the residual is
///    certified: one step in 117 000 of the thresher needs them.
///
/// A problem of pins and rows without bounds alone is linear, and has no statuses: one Newton step solves it
/// from anywhere, and stage 2 is never left out. Where it fails, twenty sweeps and Newton steps follow, and
/// nothing else: if the rows contradict each other, no method solves it.
///
/// Above 250 blocks stage 7 is left out with a warm start. In heaps of 250 to 500 contacts in motion it solved 5 of 400
/// problems that stages 2 to 6 had not, and took four fifths of the work.
///
/// Above 500 blocks:
///
/// - Start impulses that leave a larger velocity residual than zero impulses are dropped after
///   stage 1. In a jammed heap they would grow from step to step.
/// - If all contacts are compliant, stage 5 also runs before stage 3, because it hardly ever fails
///   there.
/// - Stage 7 is left out. With a warm start the second interior point of stage 4 and all of stages
///   5 and 6 are left out too. In heaps of 700 to 1700 contacts stage 7 and the second interior
///   points solved 5 of 344 problems and took two thirds of the work. In jammed heaps of 9000
///   contacts the interior point ends at the same residual from every start, and the remaining
///   stages reach it in a quarter of the time.
/// - With a cold start the second interior point of stage 4 stays: its load distribution leaves less
///   work for the next steps than that of stage 5.
///
/// Returns the best impulses found. Where velocities are not unique, the order of the stages and
/// their starts choose the solution, and the choice repeats bit for bit.
///
/// Newton's systems are factorised in velocity space, `K = M + Jᵀ A J`, which is sparse and linear
/// in a chain. An explicit operator gives `I + G A`, sparse over the contacts that share a body.
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
    /// Start of stage 3, which must not change the impulses of the other stages, and of Newton steps.
    trial: Vec<Vec2>,
    /// Whether the judge last evaluated the impulses that were returned.
    judged_last: bool,
}

/// Relative residual to which impulses of an island at rest are computed, see stage 1 of [`Direct`],
/// and its largest share of the tolerance. What is left of a residual adds up from contact to
/// contact: 1e-9 m/s in a tower of 50 boxes were 1e-6 m/s at its top, and under constant impulses it
/// grows. From round-off it takes ten steps to grow to this value. It does not follow a looser
/// tolerance, so that a pile comes to rest at any.
const EXACT: f64 = 1e-11;
const EXACT_SHARE: f64 = 1e-3;
/// Growth of that residual until certified impulses get chord steps again.
const GROWN: f64 = 10.0;
/// Velocity up to which a contact rests, as a share of the velocity scale of its island. A looser
/// tolerance takes its place.
const AT_REST: f64 = 1e-6;
/// Weight of the proximal term for the factors of an island at rest.
const LIGHT: f64 = 1e-9;
const WARM_STEPS: usize = 4;
/// Residual times number of blocks above which stage 2 is left out. In drums of 400 contacts stage
/// 2 then solves one problem in fifty.
const FAR: f64 = 20.0;
/// Problems with more blocks leave out the stages that hardly ever help them.
const LARGE: usize = 500;
/// With a warm start, stage 7 is left out above so many blocks.
const PATHS: usize = 250;
const SWEEPS_FAST: [usize; 2] = [60, 100];
const SWEEPS_FIRST: [usize; 2] = [20, 80];
const SWEEPS_LAST: [usize; 4] = [100, 300, 600, 900];
/// More sweeps, where the residual is at most so many times the tolerance: a problem without a
/// solution stays farther away.
const SWEEPS_MORE: usize = 4000;
const NEAR: f64 = 10.0;
const NEWTON_STEPS: usize = 8;

/// The tolerance for an island at rest.
pub(super) fn exact(tolerance: f64) -> f64 {
    EXACT.min(EXACT_SHARE * tolerance)
}

/// Whether the problem is of contacts alone, and those that carry load have no more rows than the
/// bodies have coordinates, so that their impulses are unique. All contacts count if none carries
/// load yet.
fn unique_contacts(problem: &ContactProblem, impulses: &[Vec2]) -> bool {
    let Delassus::Bodies(op) = &problem.operator else {
        return false;
    };
    let loaded = |p: &Vec2| *p != Vec2::zeros();
    let none = !impulses.iter().any(loaded);
    let blocks = problem.laws.iter().zip(impulses);
    let active = blocks.filter(|(_, p)| none || loaded(p));
    let rows: usize = active.map(|(law, _)| law.rows()).sum();
    let contacts = |law: &Law| matches!(law, Law::Contact { .. });
    rows <= 3 * op.inverse_mass.len() && problem.laws.iter().all(contacts)
}

/// Whether all contacts are compliant. Such a problem always has a solution.
fn compliant(problem: &ContactProblem) -> bool {
    problem.laws.iter().all(|law| match law {
        Law::Contact { compliance, .. } => *compliance > 0.0,
        _ => true,
    })
}

/// Whether a contact has friction.
fn rough(problem: &ContactProblem) -> bool {
    let rough = |law: &Law| matches!(law, Law::Contact { friction, .. } if *friction > 0.0);
    problem.laws.iter().any(rough)
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
        cache: &mut FactorCache,
    ) -> SolveReport {
        self.run(problem, impulses, tolerance, Some(cache))
    }

    fn velocities(&self) -> Option<Velocities<'_>> {
        self.judged_last.then(|| Velocities::of(&self.judge))
    }
}

impl Direct {
    /// Both solves of the trait.
    pub(super) fn run(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        mut cache: Option<&mut FactorCache>,
    ) -> SolveReport {
        drop_unless_finite(impulses);
        self.newton.begin();
        let mut residual = self.judge.begin(problem, impulses);
        let mut report = SolveReport::of(residual, tolerance);
        let solved = report.solved();
        self.judged_last = solved;
        let large = problem.len() > LARGE;
        let light = cache.as_ref().is_some_and(|c| c.is_light());
        let inexact = !residual.certified(GROWN * exact(tolerance));
        let factors = cache.as_mut().filter(|_| inexact);
        let newton = factors.and_then(|c| c.of(problem));
        if solved && newton.is_none() {
            return report;
        }
        let rests = light || solved;
        let enough = if rests { exact(tolerance) } else { tolerance };
        self.best.start(impulses, residual, enough);
        if let Some(newton) = newton {
            let (judge, best) = (&mut self.judge, &mut self.best);
            self.judged_last = self.newton.chord(problem, judge, impulses, newton, best);
            self.best.set_tolerance(tolerance);
            if self.best.solved() {
                if !self.judged_last {
                    self.judge.natural_map(problem, &self.best.impulses);
                    self.judged_last = true;
                }
                return self.found(impulses, report);
            }
            self.judged_last = false;
            newton.light_failed |= light;
        }
        self.best.set_tolerance(tolerance);
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
        let linear = problem.laws.iter().all(Law::is_bilateral);
        if linear || warm && residual.merit() * problem.len() as f64 <= FAR {
            self.polish(problem, impulses, WARM_STEPS, &mut report);
        }
        if large && compliant(problem) {
            self.interior_point(problem, Start::Same, &mut report);
        }
        if linear {
            let few = (SWEEPS_FIRST[0], &START);
            self.sweep_and_polish(problem, impulses, few, tolerance, &mut report);
            if let Some(cache) = cache {
                self.newton.store_factors(&mut self.response, cache);
            }
            return self.found(impulses, report);
        }
        if !warm && rough(problem) {
            self.rest(problem, tolerance, &mut report);
        }
        if !self.best.solved() && unique_contacts(problem, impulses) {
            self.accelerate(problem, impulses, tolerance, &mut report);
        }
        self.approach(problem, impulses, warm, tolerance, &mut report);
        let large_warm = warm && large;
        if !large_warm {
            self.interior_point(problem, Start::Same, &mut report);
        }
        if warm && !large_warm && !self.best.solved() {
            // the impulses of the last step can be a bad start
            impulses.fill(Vec2::zeros());
            self.approach(problem, impulses, warm, tolerance, &mut report);
        }
        if !warm || problem.len() <= PATHS {
            self.follow_paths(problem, &mut report);
        }
        self.sweep_last(problem, impulses, tolerance, &mut report);
        if let Some(cache) = cache {
            let solved = report.factorisations > 0 && self.best.solved();
            if solved && !large && !cache.light_failed() {
                self.refine(problem, impulses, tolerance, &mut report);
            }
            self.newton.store_factors(&mut self.response, cache);
        }
        self.found(impulses, report)
    }

    /// Factorises once more, with a light proximal term, for an island that rests. These factors
    /// also correct what the usual ones hardly see: a lean of all bodies of a tower. They are given
    /// up for an island where they failed once: its contacts may be on the border of two statuses.
    fn refine(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        report: &mut SolveReport,
    ) {
        impulses.copy_from_slice(&self.best.impulses);
        self.judge.natural_map(problem, impulses);
        let still = AT_REST.max(tolerance) * self.best.residual.velocity_scale;
        if self.judge.velocities().iter().any(|u| u.norm() > still) {
            return;
        }
        self.best.set_tolerance(exact(tolerance));
        self.newton.first = LIGHT;
        self.polish(problem, impulses, 1, report);
        self.newton.first = 0.0;
        self.best.set_tolerance(tolerance);
    }

    /// Writes the best impulses found and completes the report.
    fn found(&self, impulses: &mut [Vec2], mut report: SolveReport) -> SolveReport {
        impulses.copy_from_slice(&self.best.impulses);
        report.status = self.best.status();
        report.residual = self.best.residual;
        report
    }

    /// Stage 2 from zero impulses, see [`Direct`]: looks for a state of rest, and makes it exact, as
    /// what is left of a residual would ask for a solve in the next steps.
    fn rest(&mut self, problem: &ContactProblem, tolerance: f64, report: &mut SolveReport) {
        if self.best.solved() {
            return;
        }
        self.interior_point(problem, Start::Convex, report);
        if !self.best.solved() {
            // no factors of a guess that failed
            self.newton.begin();
            return;
        }
        let mut found = std::mem::take(&mut self.trial);
        found.clone_from(&self.best.impulses);
        self.best.set_tolerance(exact(tolerance));
        if !self.best.solved() {
            self.polish(problem, &found, WARM_STEPS, report);
        }
        self.best.set_tolerance(tolerance);
        self.trial = found;
    }

    /// Stage 3, see [`Direct`].
    fn accelerate(
        &mut self,
        problem: &ContactProblem,
        impulses: &[Vec2],
        tolerance: f64,
        report: &mut SolveReport,
    ) {
        let mut trial = std::mem::take(&mut self.trial);
        trial.clear();
        trial.extend_from_slice(impulses);
        for sweeps in SWEEPS_FAST {
            self.sweep_and_polish(problem, &mut trial, (sweeps, &FAST), tolerance, report);
        }
        self.trial = trial;
    }

    /// Stage 4, see [`Direct`].
    fn approach(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        warm: bool,
        tolerance: f64,
        report: &mut SolveReport,
    ) {
        for (k, sweeps) in SWEEPS_FIRST.into_iter().enumerate() {
            self.sweep_and_polish(problem, impulses, (sweeps, &START), tolerance, report);
            if k == 0 || problem.len() <= LARGE || !warm {
                self.interior_point(problem, Start::Near(impulses), report);
            }
        }
    }

    /// Stage 8, see [`Direct`].
    fn sweep_last(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
        report: &mut SolveReport,
    ) {
        if !self.best.solved() {
            impulses.copy_from_slice(&self.best.impulses);
        }
        for sweeps in SWEEPS_LAST {
            self.sweep_and_polish(problem, impulses, (sweeps, &ALONE), tolerance, report);
        }
        if problem.len() <= LARGE && self.best.residual.merit() <= NEAR * tolerance {
            let more = (SWEEPS_MORE, &ALONE);
            self.sweep_and_polish(problem, impulses, more, tolerance, report);
        }
    }

    /// Stage 7, see [`Direct`].
    fn follow_paths(&mut self, problem: &ContactProblem, report: &mut SolveReport) {
        for path in Path::ALL {
            if self.best.solved() || problem.len() > LARGE {
                return;
            }
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

    /// Sweeps from `impulses`, then runs Newton from the result. Does nothing once the problem is
    /// solved.
    fn sweep_and_polish(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        (sweeps, plan): (usize, &Plan),
        tolerance: f64,
        report: &mut SolveReport,
    ) {
        if self.best.solved() {
            return;
        }
        let judge = &mut self.judge;
        report.sweeps += (self.nsgs).run(problem, judge, impulses, tolerance, sweeps, plan);
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

    fn interior_point(&mut self, problem: &ContactProblem, start: Start, report: &mut SolveReport) {
        if self.best.solved() {
            return;
        }
        report.factorisations += self.interior.run(
            problem,
            &mut self.judge,
            &mut self.response,
            &mut self.newton,
            start,
            &mut self.best,
        );
    }
}
