use super::best::Best;
use super::block_status::Status;
use super::factor_cache::{FactorCache, Newton};
use super::response::Response;
use crate::contact::{ContactProblem, Delassus, Judge, Law, Mat2, Vec2, Vec3, project_onto_cone};

/// Newton's method on the natural map, by the status of every block.
///
/// The status is read off `z = P − ρ ξ`: open if `z_N ≤ 0`, stick if `|z_T| ≤ μ z_N`, else slip
/// with the sign of `z_T`; a bounded row is at a bound or free. A step solves the linear system of
/// those statuses with a proximal term, so that redundant rows are no obstacle:
///
/// ```text
/// ξ(P⁺) + ε (P⁺ − P) = 0 on the active rows,  P_T⁺ = s μ P_N⁺ on slipping ones,
/// ε = ε₀ tr(G_ii)/2, ε₀ = 1e−6 or less                                      (1)
/// ```
///
/// No line search: it either lands within a few steps or cycles, and then stops.
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
    /// Of the bodies, in a chord step.
    change: Vec<Vec3>,
    proximal: f64,
    /// All status vectors met, one after the other.
    history: Vec<Status>,
    /// What the factors last made are of, and the count of factorisations then.
    statuses: Vec<Status>,
    made_gains: Vec<Mat2>,
    made: usize,
}

/// Chord steps tried with factors of another problem.
const CHORDS: usize = 4;
/// See [`StatusNewton::chord`].
const CHANGED: usize = 10;

/// First weight of the proximal term: a smaller one loses digits in the stiff system.
const PROXIMAL: f64 = 1e-6;
/// Where a step with unchanged statuses leaves more than this share of the residual, the weight
/// falls by [`LIGHTER`], not below [`LIGHTEST`]: great mass ratios need it.
const SLOW: f64 = 0.1;
const LIGHTER: f64 = 1e-2;
const LIGHTEST: f64 = 0.9e-10;

impl StatusNewton {
    /// At most `steps` Newton steps from `start`; every iterate is offered to `best`.
    ///
    /// `guess` takes the place of the statuses in the first step. While the statuses stand, the
    /// factors are used again. Stops when `best` is solved, when a status vector comes up for the
    /// third time, when more than a tenth of the statuses change in a step and not clearly fewer
    /// than in the one before, when the lightest proximal weight brings nothing more, or when the
    /// system is singular. Returns the number of factorisations.
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
        self.proximal = PROXIMAL;
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
                // the same system: its factors serve, and the proximal centre moves on
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
                if self.proximal == PROXIMAL {
                    self.statuses
                        .extend_from_slice(&self.history[self.history.len() - n..]);
                    self.made_gains.clone_from(&self.gains);
                    self.made = response.count();
                }
                changed_before = changed;
            }
            response.solve(problem, &self.targets);
            for i in 0..n {
                self.current[i] = self.targets[i] - self.gains[i] * response.change(i);
            }
            self.inside.clear();
            self.inside
                .extend((self.current.iter().zip(&problem.laws)).map(|(&p, l)| inside(p, l)));
            let residual = judge.natural_map(problem, &self.inside);
            let merit = residual.merit();
            best.offer(&self.inside, residual);
            if best.solved() || merit.is_nan() {
                return step;
            }
            // neither 0 nor infinity comes down any more
            if changed == 0 && merit >= SLOW * merit_before {
                // the proximal term holds the last digits back, or round-off does
                self.proximal *= LIGHTER;
                lighter = true;
                if self.proximal < LIGHTEST {
                    return step;
                }
            }
            merit_before = merit;
        }
    }

    /// Chord steps with the factors of `newton`, and the statuses they are of, from the impulses
    /// that the judge saw last, as long as each leaves a tenth of the residual; every iterate is
    /// offered to `best`. Whether the last one was kept: the judge has its velocities then.
    ///
    /// A contact on the border of two statuses, as the feet of an arch are, has either: the
    /// solution of the other's system serves as well, and which one round-off asks for costs
    /// nothing. Where more than one in [`CHANGED`] blocks asks for another status the factors are
    /// of another time.
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
        self.proximal = PROXIMAL;
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
                newton.serve_again();
            }
            if best.solved() || merit.is_nan() || merit >= SLOW * merit_before {
                break;
            }
            merit_before = merit;
        }
        last
    }

    /// Forgets whose factors were made: those of another problem are not handed over.
    pub fn begin(&mut self) {
        self.statuses.clear();
    }

    /// Puts the factors last made into `carried`; empties it if they are no longer there, or of no
    /// use to another problem.
    pub fn hand_over(&mut self, response: &mut Response, carried: &mut FactorCache) {
        if self.statuses.is_empty() || self.made != response.count() {
            *carried = FactorCache::default();
            return;
        }
        let newton = carried.0.get_or_insert_default();
        response.exchange(&mut newton.factored);
        newton.bodies.clear();
        (newton.bodies).extend(newton.factored.rows.iter().map(|r| r.bodies));
        std::mem::swap(&mut newton.factored.gains, &mut self.made_gains);
        (newton.lean, newton.settles) = (false, true);
        std::mem::swap(&mut newton.statuses, &mut self.statuses);
        self.statuses.clear();
    }

    /// Statuses, gains and targets of (1) at the current impulses, of which `velocity` is `G P + b`;
    /// `guess` in place of the statuses. Returns how many of it are not theirs.
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

/// The point of the law's set that stands for `p`: a wrong status can leave the set, and what is
/// judged must lie in it.
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
