use super::anderson::Anderson;
use super::best::Best;
use super::block_status::Status;
use super::factor_cache::{FactorCache, Newton, PROXIMAL};
use super::response::Response;
use crate::contact::{ContactProblem, Delassus, Judge, Law, Mat2, Vec2, Vec3, project_onto_cone};

/// Newton's method on the natural map, by the status of every block.
///
/// The status follows from `z = P − ρ ξ`: open if `z_N ≤ 0`, stick if `|z_T| ≤ μ z_N`, else slip
/// with the sign of `z_T`; a bounded row is at a bound or free. A step solves the linear system of
/// those statuses. A proximal term makes redundant rows no obstacle:
///
/// ```text
/// ξ(P⁺) + ε (P⁺ − P) = 0 on the active rows,  P_T⁺ = s μ P_N⁺ on slipping ones,
/// ε = ε₀ tr(G_ii)/2, ε₀ = 1e−6 or less                                      (1)
/// ```
///
/// There is no line search: the method converges within a few steps, or it cycles and stops. While the
/// statuses stay the same, (1) is a linear iteration, which is slow where `G` is nearly singular: in a
/// taut bridge an impulse of 1e6 N s changes a velocity by 1e-6 m/s. Then `ε₀` falls, and when it
/// can fall no more [`Anderson`] extrapolates.
///
/// With a smaller `ε₀` a step ends where the first contact would leave its cone. Two boxes beside each other on a
/// floor stick to each other, but gaps of 1e-10 m move them apart by 1e-8 m/s: then some contact slides, with all of
/// its friction, and full steps of a light `ε₀` leave every cone near it.
///
/// # Source
/// Alart & Curnier (1991) for the statuses; Parikh & Boyd (2014) for the proximal term.
#[derive(Debug, Clone, Default)]
pub(super) struct StatusNewton {
    current: Vec<Vec2>,
    inside: Vec<Vec2>,
    gains: Vec<Mat2>,
    /// `r + g` of (1) of [`Response`] \[N s\].
    targets: Vec<Vec2>,
    /// Velocity change of the bodies in a chord step.
    change: Vec<Vec3>,
    proximal: f64,
    /// Extrapolates the steps with the lightest proximal term, and where the last step started.
    anderson: Anderson,
    before: Vec<Vec2>,
    /// The first weight of the proximal term; 0 for [`PROXIMAL`].
    pub first: f64,
    /// All status vectors so far, one after the other.
    history: Vec<Status>,
    /// Statuses, gains and proximal weight of the last factors, and the number of factorisations
    /// when they were made.
    statuses: Vec<Status>,
    made_gains: Vec<Mat2>,
    made: usize,
    made_proximal: f64,
}

/// Most chord steps with factors of another problem.
const CHORDS: usize = 4;
/// See [`StatusNewton::chord`].
const CHANGED: usize = 10;

/// If a step with unchanged statuses leaves more than this share of the residual, the weight falls
/// by [`LIGHTER`], not below [`LIGHTEST`]. Large mass ratios need this.
const SLOW: f64 = 0.1;
const LIGHTER: f64 = 1e-2;
const LIGHTEST: f64 = 0.9e-10;
/// Distance from a bound that counts as none, as a share of the impulse.
const ROUND_OFF: f64 = 1e-12;
/// Most steps that are extrapolated.
const EXTRAPOLATED: usize = 8;

impl StatusNewton {
    /// Takes at most `steps` Newton steps from `start`. Offers the iterates to `best`, extrapolated ones only if
    /// their velocities are smaller than before. Returns the number of factorisations.
    ///
    /// The first step uses the statuses of `guess`, if given. While the statuses do not change, the
    /// factors are reused. The method stops when
    ///
    /// - `best` is solved,
    /// - a status vector occurs for the third time,
    /// - more than a tenth of the statuses change in a step, and not clearly fewer than in the step
    ///   before,
    /// - extrapolated steps with the lightest proximal weight do not solve it either, or
    /// - the system is singular.
    #[allow(clippy::too_many_arguments)]
    pub fn run(
        &mut self,
        problem: &ContactProblem,
        judge: &mut Judge,
        response: &mut Response,
        start: &[Vec2],
        guess: Option<&[Status]>,
        steps: usize,
        best: &mut Best,
    ) -> usize {
        let n = problem.len();
        self.current.clear();
        self.current.extend_from_slice(start);
        self.history.clear();
        let (mut changed_before, mut merit_before) = (n, f64::INFINITY);
        let (mut step, mut lighter) = (0, false);
        let (mut extrapolated, mut slowest) = (0, f64::INFINITY);
        self.anderson.clear();
        let first = if self.first > 0.0 {
            self.first
        } else {
            PROXIMAL
        };
        self.proximal = first;
        loop {
            response.start(problem, &self.current);
            let guess = guess.filter(|_| step == 0);
            let velocity = |i: usize| response.velocity(i) + problem.free[i];
            self.linearise(problem, judge, velocity, guess);
            let (seen, now) = self.history.split_at(self.history.len() - n);
            let changed = match seen.chunks_exact(n).next_back() {
                Some(last) => last.iter().zip(now).filter(|(a, b)| a != b).count(),
                None => n,
            };
            if changed == 0 && !lighter {
                // the same system: reuse its factors, only the proximal centre changes
                self.history.truncate(self.history.len() - n);
            } else {
                lighter = false;
                let cycles = changed > 0 && seen.chunks_exact(n).filter(|s| *s == now).count() >= 2;
                let wanders = step >= 2 && 10 * changed > n && 5 * changed > 4 * changed_before;
                if step == steps || cycles || wanders {
                    return step;
                }
                step += 1;
                self.statuses.clear();
                if !response.factorise(problem, &self.gains) {
                    return step;
                }
                if self.proximal == first {
                    self.statuses
                        .extend_from_slice(&self.history[self.history.len() - n..]);
                    self.made_gains.clone_from(&self.gains);
                    self.made = response.count();
                    self.made_proximal = first;
                }
                changed_before = changed;
            }
            let shortened = self.advance(problem, response, self.proximal < first);
            let residual = judge.natural_map(problem, &self.inside);
            let merit = residual.merit();
            if changed > 0 {
                self.anderson.clear();
            }
            // where rows contradict each other, impulses grow without end: their residual does not fall, but the
            // round-off that is granted to them rises
            if extrapolated == 0 || residual.velocity < slowest {
                best.offer(&self.inside, residual);
            }
            if best.solved() || merit.is_nan() {
                return step;
            }
            // neither 0 nor infinity decreases any more
            let slow = merit >= SLOW * merit_before || !self.anderson.is_empty();
            if changed == 0 && slow {
                // the proximal term limits the last digits, or round-off does
                if self.proximal * LIGHTER >= LIGHTEST {
                    self.proximal *= LIGHTER;
                    lighter = true;
                } else if extrapolated < EXTRAPOLATED {
                    slowest = slowest.min(residual.velocity);
                    extrapolated += 1;
                    match shortened {
                        true => self.anderson.clear(),
                        false => self.anderson.next(&self.before, &mut self.current),
                    }
                } else {
                    return step;
                }
            }
            merit_before = merit;
        }
    }

    /// Takes a step with the present factors, as far as to the first bound if `bounded`. Returns whether that
    /// shortened it.
    fn advance(
        &mut self,
        problem: &ContactProblem,
        response: &mut Response,
        bounded: bool,
    ) -> bool {
        self.before.clone_from(&self.current);
        response.solve(problem, &self.targets);
        for (i, p) in self.current.iter_mut().enumerate() {
            *p = self.targets[i] - self.gains[i] * response.change(i);
        }
        let shortened = bounded && self.stop_at_first_bound(&problem.laws);
        self.inside.clear();
        self.inside
            .extend((self.current.iter().zip(&problem.laws)).map(|(&p, l)| inside(p, l)));
        shortened
    }

    /// Shortens the step from `before` to `current` so that it ends where the first block meets a bound
    /// of its status: a closed contact that of its cone, a sliding one `P_N = 0`, a free row its bounds.
    /// Returns whether it has shortened it. What is at a bound already, but for round-off, may leave it.
    fn stop_at_first_bound(&mut self, laws: &[Law]) -> bool {
        let statuses = &self.history[self.history.len() - laws.len()..];
        let mut share: f64 = 1.0;
        for (i, law) in laws.iter().enumerate() {
            // how far the impulse is inside its bounds
            let inside = |p: Vec2| match (statuses[i], *law) {
                (Status::Closed, Law::Contact { friction, .. }) => {
                    [friction * p.x - p.y, friction * p.x + p.y, p.x]
                }
                (Status::Closed, Law::Bounded { lower, upper, .. }) => {
                    [p.x - lower, upper - p.x, 0.0]
                }
                (Status::SlipPlus | Status::SlipMinus, _) => [p.x; 3],
                _ => [0.0; 3],
            };
            let both = [&self.before, &self.current].map(|all| inside(all[i]));
            for (now, then) in both[0].into_iter().zip(both[1]) {
                let off = now > ROUND_OFF * self.before[i].amax();
                if off && then < 0.0 && then.is_finite() {
                    share = share.min(now / (now - then));
                }
            }
        }
        if share < 1.0 {
            for (from, to) in self.before.iter().zip(&mut self.current) {
                *to = from.lerp(to, share);
            }
        }
        share < 1.0
    }

    /// Takes chord steps with the factors and statuses of `newton`, from the impulses that the
    /// judge evaluated last. Stops when a step leaves more than a tenth of the residual. Offers
    /// every iterate to `best`. Returns whether `best` stored the last iterate: the judge then has
    /// its velocities.
    ///
    /// A contact on the border of two statuses, such as a foot of an arch, can have either one.
    /// Both linear systems give its solution, so a different status from round-off does no harm. If
    /// more than one in [`CHANGED`] blocks has another status, the factors are outdated.
    pub fn chord(
        &mut self,
        problem: &ContactProblem,
        judge: &mut Judge,
        start: &[Vec2],
        newton: &mut Newton,
        best: &mut Best,
    ) -> bool {
        let Delassus::Bodies(op) = &problem.operator else {
            return false;
        };
        let mut last = false;
        self.current.clear();
        self.current.extend_from_slice(start);
        self.proximal = newton.proximal;
        let mut merit_before = best.residual.merit();
        for _ in 0..CHORDS {
            self.history.clear();
            let velocity = |i: usize| judge.velocities()[i];
            let changed = self.linearise(problem, judge, velocity, Some(&newton.statuses));
            if CHANGED * changed > problem.len() {
                return last;
            }
            let (targets, change) = (&self.targets, &mut self.change);
            (newton.factored).solve(op, judge.bodies(), targets, change);
            let (targets, gains, change) = (&self.targets, &self.gains, &self.change);
            let residual = judge.natural_map_of(problem, op, &mut self.current, |i, rows| {
                inside(
                    targets[i] - gains[i] * rows.velocity(change),
                    &problem.laws[i],
                )
            });
            let merit = residual.merit();
            last = best.offer(&self.current, residual);
            if best.solved() {
                newton.drop_open_contacts();
            }
            if best.solved() || merit.is_nan() || merit >= SLOW * merit_before {
                break;
            }
            merit_before = merit;
        }
        last
    }

    /// Starts a new problem: factors of earlier problems are not stored in the cache.
    pub fn begin(&mut self) {
        self.statuses.clear();
    }

    /// Moves the last factors into `cache`. Empties `cache` if they have been replaced, or are of
    /// no use for another problem.
    pub fn store_factors(&mut self, response: &mut Response, cache: &mut FactorCache) {
        if self.statuses.is_empty() || self.made != response.count() {
            *cache = FactorCache::default();
            return;
        }
        let newton = cache.0.get_or_insert_default();
        response.exchange(&mut newton.factored);
        newton.bodies.clear();
        (newton.bodies).extend(newton.factored.rows.iter().map(|r| r.bodies));
        std::mem::swap(&mut newton.factored.gains, &mut self.made_gains);
        newton.closed_only = false;
        newton.proximal = self.made_proximal;
        std::mem::swap(&mut newton.statuses, &mut self.statuses);
        self.statuses.clear();
    }

    /// Computes statuses, gains and targets of (1) at the current impulses, with `velocity` their
    /// `G P + b`. Uses the statuses `guess` instead, if given, and returns how many of them differ
    /// from the computed ones.
    fn linearise(
        &mut self,
        problem: &ContactProblem,
        judge: &Judge,
        velocity: impl Fn(usize) -> Vec2,
        guess: Option<&[Status]>,
    ) -> usize {
        let mut changed = 0;
        self.gains.clear();
        self.targets.clear();
        for (i, law) in problem.laws.iter().enumerate() {
            let (p, compliance) = (self.current[i], law.compliance());
            let mut xi = velocity(i);
            xi.x += compliance * p.x;
            let two = law.rows() == 2;
            let half = half(law, judge, i);
            let own = Status::of(law, p - xi / (half + compliance));
            let status = guess.map_or(own, |guess| guess[i]);
            changed += usize::from(status != own);
            self.history.push(status);
            let epsilon = self.proximal * half;
            let rate = 1.0 / (compliance + epsilon);
            let slip = |ratio: f64| {
                let normal = -rate * xi.x;
                (
                    Mat2::new(rate, 0.0, ratio * rate, 0.0),
                    Vec2::new(normal, ratio * (normal + p.x) - p.y),
                )
            };
            let (gain, offset) = match (status, *law) {
                (Status::SlipPlus, Law::Contact { friction, .. }) => slip(friction),
                (Status::SlipMinus, Law::Contact { friction, .. }) => slip(-friction),
                (Status::Lower, Law::Bounded { lower: bound, .. })
                | (Status::Upper, Law::Bounded { upper: bound, .. }) => {
                    (Mat2::zeros(), Vec2::new(bound, 0.0) - p)
                }
                (Status::Closed, _) if two => (
                    Mat2::new(rate, 0.0, 0.0, 1.0 / epsilon),
                    Vec2::new(-rate * xi.x, -xi.y / epsilon),
                ),
                (Status::Closed, _) => slip(0.0),
                _ => (Mat2::zeros(), -p),
            };
            self.gains.push(gain);
            self.targets.push(p + offset);
        }
        changed
    }
}

/// `tr(G_ii)/2` of a block of two rows, `G_ii` of one [1/kg].
fn half(law: &Law, judge: &Judge, i: usize) -> f64 {
    let block = &judge.diagonal()[i];
    if law.rows() == 2 {
        block.trace() / 2.0
    } else {
        block[(0, 0)]
    }
}

/// A point of the law's set near `p`. A wrong status can leave the set, but the judge must get a
/// point in it.
fn inside(p: Vec2, law: &Law) -> Vec2 {
    match *law {
        Law::Contact { friction, .. } => {
            let n = p.x.max(0.0);
            let bound = friction * n;
            if p.x < 0.0 || !(p.x + p.y).is_finite() {
                project_onto_cone(p, friction)
            } else {
                Vec2::new(n, p.y.clamp(-bound, bound))
            }
        }
        Law::Pin => p,
        Law::Bounded { lower, upper, .. } => Vec2::new(p.x.clamp(lower, upper), 0.0),
    }
}
