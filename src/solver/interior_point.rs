use super::best::Best;
use super::block_status::Status;
use super::pairs::{Block, Direction, PAIRS, Size};
use super::response::Response;
use super::status_newton::StatusNewton;
use crate::contact::{ContactProblem, Delassus, Judge, Law, Mat2, Vec2};

/// Interior point on the Stewart-Trinkle form of Coulomb friction, with status-Newton polish.
///
/// A frictional contact has four complementary pairs, a frictionless one only the first:
///
/// ```text
/// P_N ⟂ ξ_N,  β₁ ⟂ λ + ξ_T,  β₂ ⟂ λ − ξ_T,  λ ⟂ μ P_N − β₁ − β₂,  P_T = β₁ − β₂   (1)
/// ```
///
/// A bounded row has one pair per finite bound; a pin has none. Mehrotra's predictor and corrector
/// act on `x w = σ τ`, with one step length for all. A proximal term `δ = 1e−8 tr(G_ii)` centres
/// the impulses, so that redundant rows are no obstacle and the limit is exact. Friction is exact
/// from the first iteration, without an outer loop. The drawback: the form is not monotone, and one
/// run in ten stalls. A run from another start then helps.
///
/// The convex problem has `w_N = ξ_N − μ λ` in place of `ξ_N` in (1): a contact that slides opens. Its
/// form is monotone, and its velocities are unique. If one of its solutions has `ξ = 0` at every
/// contact that carries load, and `ξ_N ≥ μ |ξ_T|` at the others, then each has, and solves (1) as
/// well. So a run on the convex problem finds a state of rest that other starts may miss.
///
/// # Source
/// Stewart & Trinkle (1996) for (1); Anitescu (2006) for the convex problem; Mehrotra (1992); Wright, *Primal-Dual
/// Interior-Point Methods*
/// (1997) for the step rules.
#[derive(Debug, Clone, Default)]
pub(super) struct InteriorPoint {
    blocks: Vec<Block>,
    impulses: Vec<Vec2>,
    xi: Vec<Vec2>,
    gains: Vec<Mat2>,
    targets: Vec<Vec2>,
    predictor: Vec<Direction>,
    direction: Vec<Direction>,
    statuses: Vec<Status>,
}

/// Most Newton steps of a run.
const MAX_STEPS: usize = 80;
/// Proximal weight relative to `tr(G_ii)`; a tenth of this value solves fewer problems.
const PROXIMAL: f64 = 1e-8;
/// Share of the way to the boundary that a step may take.
const TO_BOUNDARY: f64 = 0.95;
/// Smallest `x w / (σ τ)` after a step: how far a pair may leave the central path.
const NEIGHBOURHOOD: f64 = 0.1;
/// A step shorter than this counts as stalled. The run ends at the fifth such step in a row.
const SHORT_STEP: f64 = 0.03;
const SHORT_STEPS: usize = 5;
/// The complementarity gap must at least halve over this many steps.
const WATCH: usize = 20;
/// The same on the convex problem: at rest the gap falls faster.
const WATCH_CONVEX: usize = 5;
/// A run on the convex problem ends where the mean product is below [`CLOSED`] times the scales of
/// impulse and velocity, and a step leaves more than [`SETTLED`] of what slides under load: its
/// solution does not rest.
const CLOSED: f64 = 1e-3;
const SETTLED: f64 = 0.7;
/// Newton's polish is tried below this merit, and again at a tenth of the merit where it failed.
const POLISH_BELOW: f64 = 1e-3;
const POLISH_STEPS: usize = 8;
/// On the convex problem a polish that does not fit at once waits for the next point, which is near.
const POLISH_CONVEX: usize = 2;

/// Where a run starts.
#[derive(Debug, Clone, Copy)]
pub(super) enum Start<'a> {
    /// At the free velocity, with the same point for all contacts.
    Same,
    /// Near these impulses.
    Near(&'a [Vec2]),
    /// As `Same`, on the convex problem.
    Convex,
}

impl InteriorPoint {
    /// Runs once from `start`. Offers every iterate to `best`. Returns the number of factorisations.
    pub fn run(
        &mut self,
        problem: &ContactProblem,
        judge: &mut Judge,
        response: &mut Response,
        polish: &mut StatusNewton,
        start: Start,
        best: &mut Best,
    ) -> usize {
        let mut work = 0;
        let size = self.begin(problem, judge, response, start);
        let pairs: usize = self.blocks.iter().map(|b| b.pairs()).sum();
        if !(size.impulse > 0.0 && size.velocity > 0.0) {
            return work;
        }
        // products below this are round-off of the velocities
        let floor = 1e-26 * size.impulse * size.velocity;
        let mut slide = f64::INFINITY;
        let convex = matches!(start, Start::Convex);
        let watch = if convex { WATCH_CONVEX } else { WATCH };
        let newton = if convex { POLISH_CONVEX } else { POLISH_STEPS };
        let (mut short, mut polish_below, mut watched) = (0, POLISH_BELOW, f64::INFINITY);
        for steps in 0..MAX_STEPS {
            self.read(problem, response);
            let residual = judge.natural_map(problem, &self.impulses);
            best.offer(&self.impulses, residual);
            if best.solved() || residual.merit().is_nan() {
                return work;
            }
            if residual.merit() < polish_below {
                self.statuses.clear();
                self.statuses
                    .extend(self.blocks.iter().map(|b| b.status(size)));
                let guess = Some(&self.statuses[..]);
                response.store();
                work += polish.run(
                    problem,
                    judge,
                    response,
                    &self.impulses,
                    guess,
                    newton,
                    best,
                );
                if best.solved() {
                    return work;
                }
                response.restore();
                polish_below = 0.1 * residual.merit();
            }
            let tau = self.blocks.iter().map(Block::product).sum::<f64>() / pairs.max(1) as f64;
            if convex {
                let now = self.blocks.iter().map(Block::slide).sum();
                let earlier = std::mem::replace(&mut slide, now);
                let close = tau <= CLOSED * size.impulse * size.velocity;
                if close && slide > SETTLED * earlier {
                    return work;
                }
            }
            // a stalled run shows as a gap that no longer falls, even if single steps are long
            if steps % watch == 0 {
                if tau > 0.5 * watched {
                    return work;
                }
                watched = tau;
            }
            let Some((step, sigma)) = self.step(problem, judge, response, [tau, floor], pairs)
            else {
                return work;
            };
            work += 1;
            if !step.is_finite() {
                return work;
            }
            short = if step < SHORT_STEP { short + 1 } else { 0 };
            if short >= SHORT_STEPS {
                return work;
            }
            response.advance(step);
            let least = NEIGHBOURHOOD * sigma.max(1e-3) * tau;
            for (block, d) in self.blocks.iter_mut().zip(&self.direction) {
                block.advance(d, step, least, size);
            }
        }
        work
    }

    /// Factorises, and computes the directions of a predictor and a corrector step at the mean
    /// product `tau`. Returns the step length and `σ`; `None` if the system is singular.
    fn step(
        &mut self,
        problem: &ContactProblem,
        judge: &Judge,
        response: &mut Response,
        [tau, floor]: [f64; 2],
        pairs: usize,
    ) -> Option<(f64, f64)> {
        // predictor: aims directly at the solution
        let zero = Direction::default();
        self.predictor.clear();
        self.predictor.resize(self.blocks.len(), zero);
        self.linearise(judge, 0.0, false);
        if !response.factorise(problem, &self.gains) {
            return None;
        }
        let step = self.solve(problem, judge, response, 0.0, false);
        let reached = (self.blocks.iter().zip(&self.direction))
            .map(|(b, d)| b.product_after(d, step))
            .sum::<f64>()
            / pairs.max(1) as f64;
        let mut sigma = if pairs == 0 {
            0.0
        } else {
            (reached / tau).max(0.0).powi(3).clamp(1e-8, 1.0)
        };
        let second_order = step > 0.1;
        if !second_order {
            sigma = sigma.max(0.5);
        }
        if sigma * tau < floor {
            sigma = (floor / tau).min(1.0);
        }
        // corrector: back to the central path
        std::mem::swap(&mut self.predictor, &mut self.direction);
        self.linearise(judge, sigma * tau, second_order);
        let boundary = self.solve(problem, judge, response, sigma * tau, second_order);
        let step = if pairs == 0 {
            1.0
        } else {
            (TO_BOUNDARY * boundary).min(1.0)
        };
        Some((step, sigma))
    }

    /// The first point, and the scales of impulse and velocity that measure it.
    fn begin(
        &mut self,
        problem: &ContactProblem,
        judge: &Judge,
        response: &mut Response,
        start: Start,
    ) -> Size {
        let n = problem.len();
        let near = match start {
            Start::Near(impulses) => Some(impulses),
            Start::Same | Start::Convex => None,
        };
        let convex = matches!(start, Start::Convex);
        let velocity = (problem.free.iter().zip(&problem.laws))
            .map(|(b, law)| b.x.abs().max(if law.rows() == 2 { b.y.abs() } else { 0.0 }))
            .fold(0.0, f64::max);
        let full = mass(problem, judge) * velocity;
        let mut size = Size {
            impulse: 0.5 * full,
            velocity,
        };
        self.impulses.clear();
        match near {
            None => self.impulses.resize(n, Vec2::zeros()),
            Some(near) => self.impulses.extend_from_slice(near),
        }
        response.start(problem, &self.impulses);
        self.xi.clear();
        for i in 0..n {
            let mut xi = response.velocity(i) + problem.free[i];
            xi.x += problem.laws[i].compliance() * self.impulses[i].x;
            self.xi.push(xi);
        }
        if near.is_some() {
            let (mut p2, mut v2, mut contacts) = (0.0, 0.0, 0usize);
            for i in 0..n {
                if matches!(problem.laws[i], Law::Contact { .. }) {
                    contacts += 1;
                    p2 += self.impulses[i].x.powi(2);
                    v2 += self.xi[i].norm_squared();
                }
            }
            let contacts = contacts.max(1) as f64;
            size.impulse = (2.0 * (p2 / contacts).sqrt()).max(1e-6 * full);
            size.velocity = (0.5 * (v2 / contacts).sqrt()).max(1e-4 * velocity);
        }
        self.blocks.clear();
        for i in 0..n {
            let near = near.map(|near| (near[i], self.xi[i]));
            let block = Block::start(&problem.laws[i], near, size, convex);
            self.blocks.push(block);
        }
        size
    }

    /// Impulses and local velocities of the current point.
    fn read(&mut self, problem: &ContactProblem, response: &Response) {
        for (i, block) in self.blocks.iter().enumerate() {
            let p = block.impulse();
            let mut xi = response.velocity(i) + problem.free[i];
            xi.x += problem.laws[i].compliance() * p.x;
            self.impulses[i] = p;
            self.xi[i] = xi;
        }
    }

    /// Gains `A` and targets `r + g` for `x w = aim`.
    fn linearise(&mut self, judge: &Judge, aim: f64, second_order: bool) {
        self.gains.clear();
        self.targets.clear();
        for (i, block) in self.blocks.iter().enumerate() {
            let correction = second_order.then_some(&self.predictor[i]);
            let proximal = PROXIMAL * judge.diagonal()[i].trace();
            let (gain, offset) = block.respond(self.xi[i], aim, correction, proximal);
            self.gains.push(gain);
            self.targets.push(self.impulses[i] + offset);
        }
    }

    /// Computes the directions of all pairs. Returns the longest step that keeps them positive.
    fn solve(
        &mut self,
        problem: &ContactProblem,
        judge: &Judge,
        response: &mut Response,
        aim: f64,
        second_order: bool,
    ) -> f64 {
        response.solve(problem, &self.targets);
        let mut step = 1.0f64;
        self.direction.clear();
        for (i, block) in self.blocks.iter().enumerate() {
            let h = response.change(i);
            let dr = self.targets[i] - self.impulses[i] - self.gains[i] * h;
            let proximal = PROXIMAL * judge.diagonal()[i].trace();
            let correction = second_order.then_some(&self.predictor[i]);
            let d = block.direction(self.xi[i], h, dr, aim, correction, proximal);
            for k in 0..PAIRS {
                if d.x[k] < 0.0 {
                    step = step.min(-block.x[k] / d.x[k]);
                }
                if d.w[k] < 0.0 {
                    step = step.min(-block.w[k] / d.w[k]);
                }
            }
            self.direction.push(d);
        }
        step
    }
}

/// An upper bound on the mass that impulses can act on \[kg\].
fn mass(problem: &ContactProblem, judge: &Judge) -> f64 {
    let bodies: f64 = match &problem.operator {
        Delassus::Bodies(op) => op
            .inverse_mass
            .iter()
            .filter(|w| w.x > 0.0)
            .map(|w| 1.0 / w.x)
            .sum(),
        Delassus::Blocks(_) => 0.0,
    };
    if bodies > 0.0 {
        return bodies;
    }
    judge.diagonal().iter().map(|g| 2.0 / g.trace()).sum()
}
