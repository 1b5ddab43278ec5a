use super::best::Best;
use super::interior_point::InteriorPoint;
use super::response::Response;
use super::status_newton::StatusNewton;
use crate::contact::examples::Lcg;
use crate::contact::{ContactProblem, Judge, Law, Vec2};

/// Follows a solution from an easy problem to the one that is asked.
///
/// `s` falls from 1 to nothing, each solution starting the next, in steps as long as Newton's method
/// or the interior point can follow:
///
/// ```text
/// compliance  ξ_N = (G P + b)_N + (R + s G_NN) P_N   soft contacts hardly feel each other   (1)
/// friction    μ → (1 − s) μ                          without friction the problem is convex (2)
/// ```
///
/// Where statuses must change one after the other, which no start from afar gets right at once,
/// this finds them in their order. Where one path ends, at a fold, another may lead round it.
///
/// # Source
/// Allgower & Georg, *Introduction to Numerical Continuation Methods* (2003), for the step control.
#[derive(Debug, Clone, Default)]
pub(super) struct Continuation {
    best: Best,
    here: Vec<Vec2>,
}

/// What makes the problem easy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Path {
    Compliance,
    Friction,
    /// As the first, but `s G_NN` times a factor of a tenth to ten, another one for every contact.
    UnevenCompliance,
}

impl Path {
    /// In the order in which they are tried.
    pub const ALL: [Path; 3] = [Path::Compliance, Path::Friction, Path::UnevenCompliance];
}

/// First step of `s`, as a factor, and the longest.
const FIRST: f64 = 0.1;
const LONGEST: f64 = 0.01;
/// A step shorter than this leads nowhere.
const SHORTEST: f64 = 0.9;
/// Below it `s` is round-off.
const END: f64 = 1e-13;
/// Factorisations of a run.
const BUDGET: usize = 300;
/// Newton steps at a point of the path, and at the problem that is asked.
const STEPS: usize = 10;
/// Merit at which a point of the path is solved.
const ON_PATH: f64 = 1e-7;
/// The problem that is asked is tried from points of the path below this merit.
const POLISH_BELOW: f64 = 1e-2;

/// What solves the points of a path.
pub(super) struct Tools<'a> {
    pub judge: &'a mut Judge,
    pub response: &'a mut Response,
    pub newton: &'a mut StatusNewton,
    pub interior: &'a mut InteriorPoint,
}

impl Continuation {
    /// One run from no impulses at all; iterates are offered to `best`, judged by `problem` itself.
    /// Returns the number of factorisations.
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

    /// Solves `easy` from the point before it.
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
            let near = (!cold).then_some(&self.here[..]);
            *work += interior.run(easy, judge, response, newton, near, best);
        }
        best.solved()
    }
}

/// Makes `easy` the problem at `s` of the path.
fn ease(easy: &mut ContactProblem, problem: &ContactProblem, path: Path, judge: &Judge, s: f64) {
    let mut random = Lcg(1);
    let own = problem.laws.iter().zip(judge.diagonal());
    for (law, (asked, block)) in easy.laws.iter_mut().zip(own) {
        let (
            Law::Contact {
                friction,
                compliance,
            },
            Law::Contact {
                friction: mu,
                compliance: r,
            },
        ) = (law, *asked)
        else {
            continue;
        };
        match path {
            Path::Compliance => *compliance = r + s * block[(0, 0)],
            Path::UnevenCompliance => {
                *compliance = r + s * 100f64.powf(random.next() - 0.5) * block[(0, 0)];
            }
            // a block without friction has one row: it keeps both
            Path::Friction if mu > 0.0 => *friction = (mu * (1.0 - s)).max(1e-9 * mu),
            Path::Friction => {}
        }
    }
}
