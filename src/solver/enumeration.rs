use super::{ImpulseSolver, SolveReport, Velocities, drop_unless_finite};
use crate::contact::{ContactProblem, Judge, Law, Mat2, Vec2, solve_local};
use nalgebra::{DMatrix, DVector};

/// Exact solution of a small island by trying every combination of statuses.
///
/// A frictional contact is open, sticks, or slips either way; a frictionless one is open or
/// closed; a bounded row is free or at a bound; a pin is always closed. Each combination is one
/// linear system. The solver takes the first one whose impulses the judge certifies.
///
/// # Which solution
/// If there are several solutions: first the statuses of the start impulses (the last step's), then
/// the order open, stick, slip+, slip− with the last block changing fastest. Redundant rows get the
/// impulses closest to the start in the minimum norm.
///
/// # Range
/// Up to [`Enumeration::max_combinations`] combinations. A larger problem is returned unsolved.
#[derive(Debug, Clone)]
pub struct Enumeration {
    /// Most combinations to try: 256 is four frictional contacts.
    pub max_combinations: usize,
    judge: Judge,
    /// Whether the impulses returned last are those judged last.
    judged_last: bool,
}

impl Default for Enumeration {
    fn default() -> Self {
        Enumeration {
            max_combinations: 256,
            judge: Judge::default(),
            judged_last: false,
        }
    }
}

/// Tikhonov term of a singular system, relative to the mean diagonal; two refinements follow.
const REGULARISATION: f64 = 1e-9;
const REFINEMENTS: usize = 3;

impl Enumeration {
    /// Number of combinations of statuses, saturating.
    pub fn combinations(laws: &[Law]) -> usize {
        laws.iter()
            .fold(1usize, |product, law| product.saturating_mul(choices(law)))
    }
}

fn choices(law: &Law) -> usize {
    match law {
        Law::Contact { friction, .. } if *friction > 0.0 => 4,
        Law::Contact { .. } => 2,
        Law::Pin => 1,
        Law::Bounded { lower, upper, .. } if lower.is_infinite() && upper.is_infinite() => 1,
        Law::Bounded { .. } => 3,
    }
}

/// For each row the direction of its unknown impulse, if any, and the known impulse, of one choice of status.
fn status(law: &Law, choice: usize) -> ([Option<Vec2>; 2], Vec2) {
    let (none, zero) = ([None; 2], Vec2::zeros());
    let both = [Some(Vec2::x()), Some(Vec2::y())];
    match *law {
        Law::Contact { friction, .. } => match choice {
            0 => (none, zero),
            1 if friction > 0.0 => (both, zero),
            1 => ([Some(Vec2::x()), None], zero),
            // slip+ has ξ_T > 0 and therefore P_T = −μ P_N
            2 => ([Some(Vec2::new(1.0, -friction)), None], zero),
            _ => ([Some(Vec2::new(1.0, friction)), None], zero),
        },
        Law::Pin => (both, zero),
        Law::Bounded { lower, upper, .. } => match choice {
            0 => ([Some(Vec2::x()), None], zero),
            1 => (none, Vec2::new(lower, 0.0)),
            _ => (none, Vec2::new(upper, 0.0)),
        },
    }
}

fn choice_of(law: &Law, p: Vec2) -> usize {
    match *law {
        Law::Contact { friction, .. } => {
            if p.x <= 0.0 {
                0
            } else if friction == 0.0 || p.y.abs() < friction * p.x * (1.0 - 1e-12) {
                1
            } else if p.y < 0.0 {
                2
            } else {
                3
            }
        }
        Law::Pin => 0,
        Law::Bounded { lower, upper, .. } => {
            if p.x <= lower {
                1
            } else if p.x >= upper {
                2
            } else {
                0
            }
        }
    }
}

impl ImpulseSolver for Enumeration {
    fn name(&self) -> &'static str {
        "enumeration"
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
    ) -> SolveReport {
        let n = problem.len();
        drop_unless_finite(impulses);
        self.judge.prepare(problem);
        self.judged_last = true;
        if n == 1 {
            impulses[0] = solve_local(&self.judge.diagonal()[0], problem.free[0], &problem.laws[0]);
            let residual = self.judge.natural_map(problem, impulses);
            return SolveReport::of(residual, tolerance);
        }
        let judged = |judge: &mut Judge, impulses: &[Vec2]| {
            SolveReport::of(judge.natural_map(problem, impulses), tolerance)
        };
        let total = Enumeration::combinations(&problem.laws);
        if total > self.max_combinations {
            return judged(&mut self.judge, impulses);
        }
        self.judged_last = false;
        let block = |k: usize| problem.operator.block(k / n, k % n);
        let blocks: Vec<Mat2> = (0..n * n).map(block).collect();
        let start = impulses.to_vec();
        let guess: Vec<usize> = problem
            .laws
            .iter()
            .zip(&start)
            .map(|(law, &p)| choice_of(law, p))
            .collect();
        let mut choice = vec![0; n];
        // the start is judged once it may be the best
        let (mut best, mut tried) = (None, 0);
        // the statuses of the warm start first, then all combinations in order
        for k in 0..=total {
            if k == 0 {
                choice.copy_from_slice(&guess);
            } else {
                let mut rest = k - 1;
                for i in (0..n).rev() {
                    choice[i] = rest % choices(&problem.laws[i]);
                    rest /= choices(&problem.laws[i]);
                }
                if choice == guess {
                    continue;
                }
            }
            tried += 1;
            let Some(trial) = candidate(problem, &blocks, &choice, &start) else {
                continue;
            };
            let report = judged(&mut self.judge, &trial);
            if report.solved() {
                impulses.copy_from_slice(&trial);
                self.judged_last = true;
                return SolveReport {
                    factorisations: tried,
                    ..report
                };
            }
            let known = best.get_or_insert_with(|| judged(&mut self.judge, &start));
            if known.solved() {
                break;
            }
            if report.residual.merit() < known.residual.merit() {
                *known = report;
                impulses.copy_from_slice(&trial);
            }
        }
        let best = best.unwrap_or_else(|| judged(&mut self.judge, &start));
        SolveReport {
            factorisations: tried,
            ..best
        }
    }

    fn velocities(&self) -> Option<Velocities<'_>> {
        // the stepper adds up the impulses of each body itself: their order counts in the last bits
        self.judged_last.then(|| Velocities {
            blocks: self.judge.velocities(),
            bodies: &[],
        })
    }
}

/// Impulses of one combination, or `None` if they leave the cone by more than round-off. `blocks` are the
/// `G_ij` in rows.
fn candidate(
    problem: &ContactProblem,
    blocks: &[Mat2],
    choice: &[usize],
    start: &[Vec2],
) -> Option<Vec<Vec2>> {
    let n = problem.len();
    let mut active: Vec<(usize, usize, Vec2)> = Vec::with_capacity(2 * n);
    let mut impulses = vec![Vec2::zeros(); n];
    for (i, law) in problem.laws.iter().enumerate() {
        let (directions, known) = status(law, choice[i]);
        impulses[i] = known;
        let rows = directions.into_iter().enumerate();
        active.extend(rows.filter_map(|(row, d)| Some((i, row, d?))));
    }
    let m = active.len();
    if m > 0 {
        let g = |x: usize, y: usize| {
            let ((i, row, _), (j, _, d)) = (active[x], active[y]);
            let block = &blocks[i * n + j];
            let compliance = if i == j && row == 0 {
                problem.laws[i].compliance()
            } else {
                0.0
            };
            block[(row, 0)] * d.x + block[(row, 1)] * d.y + compliance * d.x
        };
        let exact = DMatrix::from_fn(m, m, g);
        let shift = REGULARISATION * exact.trace().abs() / m as f64;
        let on_diagonal = |x, y| if x == y { shift } else { 0.0 };
        let factor = DMatrix::from_fn(m, m, |x, y| exact[(x, y)] + on_diagonal(x, y)).lu();
        let any = impulses.iter().any(|p| *p != Vec2::zeros());
        let known = any.then(|| problem.operator.apply(&impulses));
        let rhs = DVector::from_fn(m, |x, _| {
            let (i, row, _) = active[x];
            let known = known.as_ref().map_or(0.0, |known| known[i][row]);
            -(problem.free[i][row] + known)
        });
        // start from the given impulses, so that redundant rows stay near them
        let mut p = DVector::from_fn(m, |x, _| {
            let (i, row, _) = active[x];
            if choice_of(&problem.laws[i], start[i]) == choice[i] {
                start[i][row]
            } else {
                0.0
            }
        });
        for _ in 0..REFINEMENTS {
            let mut change = &rhs - &exact * &p;
            if !factor.solve_mut(&mut change) {
                return None;
            }
            p += change;
        }
        for (x, (i, _, d)) in active.iter().enumerate() {
            impulses[*i] += d * p[x];
        }
    }
    let scale = impulses.iter().fold(0.0f64, |s, p| s.max(p.amax()));
    let slack = 1e-9 * scale;
    for (p, law) in impulses.iter_mut().zip(&problem.laws) {
        match *law {
            Law::Contact { friction, .. } => {
                if p.x < -slack || p.y.abs() > friction * p.x + slack {
                    return None;
                }
                p.x = p.x.max(0.0);
                p.y = p.y.clamp(-friction * p.x, friction * p.x);
            }
            Law::Bounded { lower, upper, .. } => {
                if p.x < lower - slack || p.x > upper + slack {
                    return None;
                }
                p.x = p.x.clamp(lower, upper);
            }
            Law::Pin => {}
        }
    }
    impulses
        .iter()
        .all(|p| p.x.is_finite() && p.y.is_finite())
        .then_some(impulses)
}
