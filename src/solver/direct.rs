use super::sparse::BlockLdu;
use super::{ImpulseSolver, Nsgs, SolveReport};
use crate::contact::{
    BodyOperator, ContactProblem, Delassus, Law, NO_BODY, Vec2, Vec3, natural_map,
    project_onto_cone,
};
use nalgebra::{DMatrix, DVector, Matrix3};

/// Status Newton on the natural map, alternating with Gauss-Seidel.
///
/// 1. Certify the impulses given.
/// 2. Up to six Newton steps from them, without line search.
/// 3. Up to twenty cycles of twenty Gauss-Seidel sweeps and eight Newton steps.
/// 4. The rest of the sweep budget.
///
/// A Newton step reads the status of every block off `z = P − ρ ξ` (open if `z_N ≤ 0`, stick if
/// `|z_T| ≤ μ z_N`, else slip with the sign of `z_T`) and solves the linear system of that status
/// with a proximal term, so that redundant rows are no obstacle:
///
/// ```text
/// ξ(P⁺) + ε (P⁺ − P) = 0 on the active rows,  P_T⁺ = s μ P_N⁺ on slipping ones,
/// ε = 1e−8 tr(G_ii)/2                                                        (1)
/// ```
///
/// From bodies the system is factorised in velocity space, `K = M + Jᵀ A J`, sparse and linear in
/// a chain; from an explicit operator it is dense.
///
/// The interior point that makes this complete on violent problems comes with a later version.
///
/// # Source
/// Alart & Curnier (1991) for the status Newton; Parikh & Boyd (2014) for the proximal term.
#[derive(Debug, Clone, Default)]
pub struct Direct {
    nsgs: Nsgs,
    factor: BlockLdu,
    pairs: Vec<(u32, u32)>,
    rhs: Vec<Vec3>,
    statuses: Vec<Status>,
}

const PROXIMAL: f64 = 1e-8;
const WARM_STEPS: usize = 6;
const POLISH_STEPS: usize = 8;
const CYCLES: usize = 20;
const SWEEPS_PER_CYCLE: usize = 20;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Status {
    /// Impulse known: zero, or the bound of a bounded row.
    Fixed(f64),
    /// Only the normal row is active.
    Normal,
    /// Both rows are active.
    Both,
    /// Sliding, `P_T = ratio P_N`.
    Slip(f64),
}

impl Status {
    fn of(law: &Law, z: Vec2) -> Status {
        match *law {
            Law::Contact { friction, .. } => {
                if z.x <= 0.0 {
                    Status::Fixed(0.0)
                } else if friction == 0.0 {
                    Status::Normal
                } else if z.y.abs() <= friction * z.x {
                    Status::Both
                } else {
                    Status::Slip(friction * z.y.signum())
                }
            }
            Law::Pin => Status::Both,
            Law::Bounded { lower, upper } => {
                if z.x <= lower {
                    Status::Fixed(lower)
                } else if z.x >= upper {
                    Status::Fixed(upper)
                } else {
                    Status::Normal
                }
            }
        }
    }
}

/// The best impulses met, with the judge's word on them.
struct Best {
    impulses: Vec<Vec2>,
    report: SolveReport,
}

impl Direct {
    /// Newton from `best`, at most `steps`; keeps the best iterate.
    fn newton(&mut self, problem: &ContactProblem, best: &mut Best, tolerance: f64, steps: usize) {
        let mut current = best.impulses.clone();
        let mut history: Vec<Vec<Status>> = Vec::new();
        for _ in 0..steps {
            let xi = problem.local_velocity(&current);
            self.statuses.clear();
            for (i, law) in problem.laws.iter().enumerate() {
                let block = problem.operator.diagonal(i);
                let rho = if law.rows() == 2 {
                    2.0 / (block.trace() + 2.0 * law.compliance())
                } else {
                    1.0 / (block[(0, 0)] + law.compliance())
                };
                self.statuses
                    .push(Status::of(law, current[i] - rho * xi[i]));
            }
            if history.iter().filter(|s| **s == self.statuses).count() >= 2 {
                return;
            }
            history.push(self.statuses.clone());
            best.report.factorisations += 1;
            let solved = match &problem.operator {
                Delassus::Bodies(op) => self.body_step(problem, op, &mut current),
                Delassus::Dense(matrix) => self.dense_step(problem, matrix, &mut current),
            };
            if !solved || current.iter().any(|p| !p.x.is_finite() || !p.y.is_finite()) {
                return;
            }
            // a wrong status can leave the cone; what is judged must lie in it
            let inside: Vec<Vec2> = current
                .iter()
                .zip(&problem.laws)
                .map(|(&p, law)| match *law {
                    Law::Contact { friction, .. } => {
                        let n = p.x.max(0.0);
                        let bound = friction * n;
                        if p.x < -bound * friction {
                            project_onto_cone(p, friction)
                        } else {
                            Vec2::new(n, p.y.clamp(-bound, bound))
                        }
                    }
                    Law::Pin => p,
                    Law::Bounded { lower, upper } => Vec2::new(p.x.clamp(lower, upper), 0.0),
                })
                .collect();
            let residual = natural_map(problem, &inside);
            if residual.relative < best.report.residual.relative {
                let work = best.report;
                best.report = SolveReport::judged(problem, &inside, tolerance).after(&work);
                best.impulses.copy_from_slice(&inside);
                if best.report.solved() {
                    return;
                }
            }
        }
    }

    /// One step of (1) in velocity space. `false` if the system is singular.
    fn body_step(
        &mut self,
        problem: &ContactProblem,
        op: &BodyOperator,
        impulses: &mut [Vec2],
    ) -> bool {
        let n = op.inverse_mass.len();
        self.pairs.clear();
        for rows in &op.rows {
            let [a, b] = rows.bodies;
            if a != NO_BODY && b != NO_BODY && a != b {
                self.pairs.push((a.min(b), a.max(b)));
            }
        }
        self.pairs.sort_unstable();
        self.pairs.dedup();
        self.factor.reset(n, &self.pairs);
        self.rhs.clear();
        self.rhs.resize(n, Vec3::zeros());
        for (k, w) in op.inverse_mass.iter().enumerate() {
            // a locked coordinate keeps its velocity: identity row, Jacobian column dropped
            let mass = Vec3::from_fn(|i, _| if w[i] > 0.0 { 1.0 / w[i] } else { 1.0 });
            self.factor.add_diagonal(k, &Matrix3::from_diagonal(&mass));
        }
        for (i, rows) in op.rows.iter().enumerate() {
            let gain = Gain::of(problem, i, self.statuses[i], impulses[i]);
            for row in 0..2 {
                let Some(Row {
                    direction,
                    rate,
                    known,
                }) = gain.rows[row]
                else {
                    continue;
                };
                for a in 0..2 {
                    let body_a = rows.bodies[a];
                    if body_a == NO_BODY {
                        continue;
                    }
                    let free = op.inverse_mass[body_a as usize].map(|w| f64::from(w > 0.0));
                    let push = (rows.jacobian[a][0] * direction.x
                        + rows.jacobian[a][1] * direction.y)
                        .component_mul(&free);
                    self.rhs[body_a as usize] += push * known;
                    if rate == 0.0 {
                        continue;
                    }
                    for b in 0..2 {
                        let body_b = rows.bodies[b];
                        if body_b == NO_BODY {
                            continue;
                        }
                        let free = op.inverse_mass[body_b as usize].map(|w| f64::from(w > 0.0));
                        let read = rows.jacobian[b][row].component_mul(&free);
                        let block = push * read.transpose() * rate;
                        if body_a == body_b {
                            self.factor.add_diagonal(body_a as usize, &block);
                        } else {
                            self.factor.add(body_a as usize, body_b as usize, &block);
                        }
                    }
                }
            }
        }
        if !self.factor.factorise() {
            return false;
        }
        self.factor.solve(&mut self.rhs);
        for (body, w) in op.inverse_mass.iter().enumerate() {
            self.rhs[body] = self.rhs[body].zip_map(w, |v, w| if w > 0.0 { v } else { 0.0 });
        }
        for (i, rows) in op.rows.iter().enumerate() {
            let velocity = rows.velocity(&self.rhs);
            impulses[i] = Gain::of(problem, i, self.statuses[i], impulses[i]).impulse(velocity);
        }
        true
    }

    /// One step of (1) with the explicit operator, eliminating the velocity.
    fn dense_step(
        &mut self,
        problem: &ContactProblem,
        matrix: &DMatrix<f64>,
        impulses: &mut [Vec2],
    ) -> bool {
        // unknown: the scalar impulse along each active row's direction
        let mut active: Vec<(usize, usize, Row)> = Vec::new();
        let mut fixed = vec![Vec2::zeros(); problem.len()];
        for i in 0..problem.len() {
            for (row, entry) in Gain::of(problem, i, self.statuses[i], impulses[i])
                .rows
                .iter()
                .enumerate()
            {
                match entry {
                    Some(r) if r.rate > 0.0 => active.push((i, row, *r)),
                    Some(r) => fixed[i] += r.direction * r.known,
                    None => {}
                }
            }
        }
        let base = problem.operator.apply(&fixed);
        // p = known − rate (J v), J v = base + G p  ⇒  (1/rate + G) p = known/rate − base
        let m = active.len();
        let system = DMatrix::from_fn(m, m, |x, y| {
            let ((i, row, r), (j, _, c)) = (active[x], active[y]);
            let g = matrix.fixed_view::<2, 2>(2 * i, 2 * j) * c.direction;
            g[row] + if x == y { 1.0 / r.rate } else { 0.0 }
        });
        let rhs = DVector::from_fn(m, |x, _| {
            let (i, row, r) = active[x];
            r.known / r.rate - base[i][row]
        });
        let Some(p) = system.lu().solve(&rhs) else {
            return false;
        };
        impulses.copy_from_slice(&fixed);
        for (x, (i, _, r)) in active.iter().enumerate() {
            impulses[*i] += r.direction * p[x];
        }
        true
    }
}

/// One scalar unknown: its impulse acts along `direction` and is `known − rate · (J v)_row`.
#[derive(Debug, Clone, Copy)]
struct Row {
    direction: Vec2,
    rate: f64,
    known: f64,
}

/// The rows of one block under its status.
struct Gain {
    rows: [Option<Row>; 2],
}

impl Gain {
    fn of(problem: &ContactProblem, i: usize, status: Status, center: Vec2) -> Gain {
        let law = &problem.laws[i];
        let block = problem.operator.diagonal(i);
        let epsilon = PROXIMAL
            * if law.rows() == 2 {
                block.trace() / 2.0
            } else {
                block[(0, 0)]
            };
        let b = problem.free[i];
        let row = |direction: Vec2, center: f64, b: f64, compliance: f64| Row {
            direction,
            rate: 1.0 / (compliance + epsilon),
            known: (epsilon * center - b) / (compliance + epsilon),
        };
        let normal = |ratio: f64| row(Vec2::new(1.0, ratio), center.x, b.x, law.compliance());
        let rows = match status {
            Status::Fixed(value) => [
                Some(Row {
                    direction: Vec2::x(),
                    rate: 0.0,
                    known: value,
                }),
                None,
            ],
            Status::Normal => [Some(normal(0.0)), None],
            Status::Slip(ratio) => [Some(normal(ratio)), None],
            Status::Both => [Some(normal(0.0)), Some(row(Vec2::y(), center.y, b.y, 0.0))],
        };
        Gain { rows }
    }

    fn impulse(&self, velocity: Vec2) -> Vec2 {
        let mut p = Vec2::zeros();
        for (row, entry) in self.rows.iter().enumerate() {
            if let Some(r) = entry {
                p += r.direction * (r.known - r.rate * velocity[row]);
            }
        }
        p
    }
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
        let mut best = Best {
            impulses: impulses.to_vec(),
            report: SolveReport::judged(problem, impulses, tolerance),
        };
        if !best.report.solved() {
            self.newton(problem, &mut best, tolerance, WARM_STEPS);
        }
        let mut swept = best.impulses.clone();
        for _ in 0..CYCLES {
            if best.report.solved() {
                break;
            }
            let sweeps = self
                .nsgs
                .sweep(problem, &mut swept, tolerance, SWEEPS_PER_CYCLE);
            best.report.sweeps += sweeps;
            // Newton starts from the sweeps, even where they look worse than the best so far
            let mut trial = Best {
                impulses: swept.clone(),
                report: SolveReport::judged(problem, &swept, tolerance),
            };
            if !trial.report.solved() {
                self.newton(problem, &mut trial, tolerance, POLISH_STEPS);
            }
            let work = best.report;
            let better = trial.report.residual.relative < best.report.residual.relative;
            if better || trial.report.solved() {
                best.report = trial.report.after(&work);
                best.impulses = trial.impulses;
            } else {
                best.report.factorisations += trial.report.factorisations;
            }
        }
        if !best.report.solved() {
            let left = self.nsgs.max_sweeps.saturating_sub(best.report.sweeps);
            let sweeps = self.nsgs.sweep(problem, &mut swept, tolerance, left);
            let report = SolveReport::judged(problem, &swept, tolerance);
            let work = best.report;
            if report.residual.relative < work.residual.relative {
                best.report = report.after(&work);
                best.impulses = swept;
            }
            best.report.sweeps += sweeps;
        }
        impulses.copy_from_slice(&best.impulses);
        best.report
    }
}
