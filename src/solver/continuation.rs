use super::best::Best;
use super::interior_point::{InteriorPoint, Start};
use super::response::Response;
use super::status_newton::StatusNewton;
use crate::contact::examples::Lcg;
use crate::contact::{ContactProblem, Judge, Law, Vec2};

/// Follows a path of solutions from an easy problem to the given one.
///
/// `s` falls from 1 to 0. Each solution is the start for the next one. Steps are as long as
/// Newton's method or the interior point can follow:
///
/// ```text
/// compliance  ξ_N = (G P + b)_N + (R + s G_NN) P_N   soft contacts are almost decoupled     (1)
/// friction    μ → (1 − s) μ                          without friction the problem is convex (2)
/// ```
///
/// Some problems need statuses to change one after the other; no distant start gets them all right
/// at once. Continuation changes them in order. Where one path ends at a fold, another path may
/// lead around it.
///
/// # Source
/// Allgower & Georg, *Introduction to Numerical Continuation Methods* (2003), for the step control.
#[derive(Debug, Clone, Default)]
pub(super) struct Continuation {
    best: Best,
    here: Vec<Vec2>,
}

/// How the easy problem differs from the given one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Path {
    Compliance,
    Friction,
    /// Like `Compliance`, but with `s G_NN` times a random factor from 0.1 to 10 for each contact.
    UnevenCompliance,
}

impl Path {
    /// The order in which the solver tries the paths.
    pub const ALL: [Path; 3] = [Path::Compliance, Path::Friction, Path::UnevenCompliance];
}

/// The first step multiplies `s` by `FIRST`; the longest step multiplies it by `LONGEST`.
const FIRST: f64 = 0.1;
const LONGEST: f64 = 0.01;
/// The run ends where even a step by this factor fails.
const SHORTEST: f64 = 0.9;
/// Below this value `s` is round-off.
const END: f64 = 1e-13;
/// Most factorisations of a run.
const BUDGET: usize = 300;
/// Newton steps at a point of the path, and for the given problem.
const STEPS: usize = 10;
/// Merit at which a point of the path is solved.
const ON_PATH: f64 = 1e-7;
/// From a point of the path below this merit, Newton's method tries the given problem.
const POLISH_BELOW: f64 = 1e-2;

/// The solvers of the points of a path.
pub(super) struct Tools<'a> {
    pub judge: &'a mut Judge,
    pub response: &'a mut Response,
    pub newton: &'a mut StatusNewton,
    pub interior: &'a mut InteriorPoint,
}

impl Continuation {
    /// Runs once from zero impulses. Offers every iterate to `best`, with its residual in
    /// `problem`. Returns the number of factorisations.
    pub fn run(
        &mut self,
        problem: &ContactProblem,
        path: Path,
        tools: &mut Tools,
        best: &mut Best,
    ) -> usize {
        let mut easy = problem.clone();
        self.here.clear();
        self.here.resize(problem.len(), Vec2::zeros());
        let (mut s, mut ratio, mut work, mut on_path) = (1.0, FIRST, 0, false);
        while work < BUDGET && ratio < SHORTEST {
            let next = if on_path { s * ratio } else { s };
            if next < END {
                break;
            }
            ease(&mut easy, problem, path, tools.judge, next);
            if !self.point(&easy, tools, &mut work) {
                if !on_path {
                    break;
                }
                ratio = ratio.sqrt();
                continue;
            }
            if on_path {
                ratio = (ratio * ratio).max(LONGEST);
            }
            (s, on_path) = (next, true);
            self.here.copy_from_slice(&self.best.impulses);
            let residual = tools.judge.natural_map(problem, &self.here);
            best.offer(&self.here, residual);
            if !best.solved() && residual.merit() < POLISH_BELOW {
                let Tools {
                    judge,
                    response,
                    newton,
                    ..
                } = tools;
                work += newton.run(problem, judge, response, &self.here, None, STEPS, best);
            }
            if best.solved() {
                break;
            }
        }
        work
    }

    /// Solves `easy` from the solution of the point before.
    fn point(&mut self, easy: &ContactProblem, tools: &mut Tools, work: &mut usize) -> bool {
        let Tools {
            judge,
            response,
            newton,
            interior,
        } = tools;
        let best = &mut self.best;
        best.start(&self.here, judge.natural_map(easy, &self.here), ON_PATH);
        if !best.solved() {
            *work += newton.run(easy, judge, response, &self.here, None, STEPS, best);
        }
        if !best.solved() {
            let cold = self.here.iter().all(|p| *p == Vec2::zeros());
            let start = match cold {
                true => Start::Same,
                false => Start::Near(&self.here),
            };
            *work += interior.run(easy, judge, response, newton, start, best);
        }
        best.solved()
    }
}

/// Sets `easy` to the problem at `s` of the path.
fn ease(easy: &mut ContactProblem, problem: &ContactProblem, path: Path, judge: &Judge, s: f64) {
    let mut random = Lcg(1);
    let own = problem.laws.iter().zip(judge.diagonal());
    for (law, (given, block)) in easy.laws.iter_mut().zip(own) {
        let (
            Law::Contact {
                friction,
                compliance,
            },
            Law::Contact {
                friction: mu,
                compliance: r,
            },
        ) = (law, *given)
        else {
            continue;
        };
        match path {
            Path::Compliance => *compliance = r + s * block[(0, 0)],
            Path::UnevenCompliance => {
                *compliance = r + s * 100f64.powf(random.next() - 0.5) * block[(0, 0)];
            }
            // a contact without friction has only one row: both rows stay
            Path::Friction if mu > 0.0 => *friction = (mu * (1.0 - s)).max(1e-9 * mu),
            Path::Friction => {}
        }
    }
}
