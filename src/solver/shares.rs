//! Impulse distributions that are not unique: how many there are, and the one of minimum norm.

use super::response::Response;
use crate::contact::{ContactProblem, Delassus, Judge, Law, Mat2, NO_BODY, Vec2};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// How redundant contacts share a load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shares {
    /// The impulses that the solver found.
    #[default]
    Found,
    /// The impulses of minimum norm, see [`Sharing::least`].
    MinimumNorm,
}

impl Shares {
    /// The name in scene files and settings.
    pub fn name(self) -> &'static str {
        match self {
            Shares::Found => "found",
            Shares::MinimumNorm => "minimum-norm",
        }
    }
}

/// The part of a solution that is not determined.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Uniqueness {
    /// Dimension of the self-stress: independent changes of the closed contacts' impulses that move
    /// no body while the contacts keep their statuses. `None` above [`Uniqueness::MOST_ROWS`].
    pub self_stress: Option<usize>,
    /// Contacts with so much friction that each alone can have two solutions, `μ ≥ G_NN / |G_NT|`
    /// (Painlevé).
    pub steep: Vec<usize>,
}

impl Uniqueness {
    /// Most closed rows for which the rank is computed; the work is cubic in their number.
    pub const MOST_ROWS: usize = 1500;

    /// Analyses a solution.
    ///
    /// The self-stress is the number of closed rows less the rank of their Delassus operator.
    /// `P_T = ±μ P_N` of a sliding contact counts as one row.
    ///
    /// # Arguments
    /// - `impulses`: certified [N s]; they decide which contacts are closed.
    pub fn of(problem: &ContactProblem, impulses: &[Vec2]) -> Uniqueness {
        let mut judge = Judge::new(problem);
        let free = closed_rows(problem, &mut judge, impulses);
        let rows: Vec<(usize, Vec2)> = (free.iter().enumerate())
            .flat_map(|(i, f)| f.directions().into_iter().map(move |d| (i, d)))
            .collect();
        let steep = (problem.laws.iter().zip(judge.diagonal()).enumerate())
            .filter(|(_, (law, g))| match law {
                Law::Contact { friction, .. } if *friction > 0.0 => {
                    friction * g[(0, 1)].abs() >= g[(0, 0)]
                }
                _ => false,
            })
            .map(|(i, _)| i)
            .collect();
        let self_stress =
            (rows.len() <= Uniqueness::MOST_ROWS).then(|| rows.len() - rank(problem, &rows));
        Uniqueness { self_stress, steep }
    }
}

/// The directions in which a block's impulse may change while all velocities stay the same.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Free {
    /// No direction.
    None,
    /// The only row of a block, or the normal row.
    Normal,
    Both,
    /// Along `(1, ratio)`: a sliding contact.
    Along(f64),
}

impl Free {
    fn directions(self) -> Vec<Vec2> {
        match self {
            Free::None => vec![],
            Free::Normal => vec![Vec2::x()],
            Free::Both => vec![Vec2::x(), Vec2::y()],
            Free::Along(ratio) => vec![Vec2::new(1.0, ratio).normalize()],
        }
    }

    /// The projection of `p` on these directions.
    fn part(self, p: Vec2) -> Vec2 {
        self.directions().iter().map(|d| d * d.dot(&p)).sum()
    }
}

/// For each block the directions of its closed rigid rows, by the velocities. A compliant contact
/// has a unique impulse.
fn closed_rows(problem: &ContactProblem, judge: &mut Judge, impulses: &[Vec2]) -> Vec<Free> {
    let residual = judge.natural_map(problem, impulses);
    let resolution = (10.0 * residual.velocity).max(1e-9 * residual.velocity_scale);
    let xi = problem.local_velocity(impulses);
    let free = |((law, xi), p): ((&Law, Vec2), &Vec2)| match *law {
        Law::Contact { compliance, .. } | Law::Bounded { compliance, .. } if compliance > 0.0 => {
            Free::None
        }
        Law::Contact { .. } if xi.x > resolution => Free::None,
        Law::Contact { friction: 0.0, .. } => Free::Normal,
        Law::Contact { friction, .. } if xi.y.abs() > resolution => {
            Free::Along(-friction * xi.y.signum())
        }
        Law::Contact { .. } | Law::Pin => Free::Both,
        Law::Bounded { lower, upper, .. } if p.x > lower && p.x < upper => Free::Normal,
        Law::Bounded { .. } => Free::None,
    };
    problem
        .laws
        .iter()
        .zip(xi)
        .zip(impulses)
        .map(free)
        .collect()
}

/// Rank of the operator's rows `(block, direction)`.
fn rank(problem: &ContactProblem, rows: &[(usize, Vec2)]) -> usize {
    let matrix = match &problem.operator {
        Delassus::Bodies(op) => {
            // G = B Bᵀ: the factor B is narrower, and its rank is better conditioned
            let mut touched: Vec<u32> = (rows.iter())
                .flat_map(|&(i, _)| op.rows[i].bodies)
                .filter(|body| *body != NO_BODY)
                .collect();
            touched.sort_unstable();
            touched.dedup();
            let mut factor = DMatrix::zeros(3 * touched.len(), rows.len());
            for (column, &(i, d)) in rows.iter().enumerate() {
                for (j, body) in op.rows[i].jacobian.iter().zip(op.rows[i].bodies) {
                    // all other sides have infinite mass
                    let Ok(place) = touched.binary_search(&body) else {
                        continue;
                    };
                    let weight = &op.inverse_mass[body as usize];
                    let row = (j[0] * d.x + j[1] * d.y).component_mul(&weight.map(f64::sqrt));
                    for k in 0..3 {
                        factor[(3 * place + k, column)] += row[k];
                    }
                }
            }
            factor
        }
        operator => DMatrix::from_fn(rows.len(), rows.len(), |a, b| {
            let ((i, d), (j, e)) = (rows[a], rows[b]);
            d.dot(&(operator.block(i, j) * e))
        }),
    };
    let mut matrix = matrix;
    for mut column in matrix.column_iter_mut() {
        let norm = column.norm();
        if norm > 0.0 {
            column /= norm;
        }
    }
    let r = matrix.col_piv_qr().unpack_r();
    // columns have length one: a pivot of a dependent column is round-off
    (0..r.nrows().min(r.ncols()))
        .filter(|&i| r[(i, i)].abs() > 1e-9)
        .count()
}

/// Finds the impulses of minimum norm. Reuses its buffers.
#[derive(Debug, Clone, Default)]
pub struct Sharing {
    judge: Judge,
    response: Response,
    gains: Vec<Mat2>,
    targets: Vec<Vec2>,
}

/// Weight of the norm against the wrench in a step. Steps repeat until the wrench is exact.
const WEIGHT: f64 = 1e-6;
const REPEATS: usize = 12;
/// Most rounds of releasing contacts that would pull.
const ROUNDS: usize = 20;

impl Sharing {
    /// Distributes the load anew. With all velocities unchanged,
    ///
    /// ```text
    /// Σ tr(G_ii) |P_i|²  is least                                            (1)
    /// ```
    ///
    /// among the impulses of closed rigid contacts that the laws admit; a block of one row has
    /// weight `G_NN`. This is the limit of contacts whose compliances go to zero in proportion to
    /// these weights, as long as no contact would pull or leave its cone. Contacts that would pull
    /// are released, and contacts that would leave the cone stay on its border, one round after the
    /// other. The result of these rounds need not be the overall minimum.
    ///
    /// # Arguments
    /// - `impulses`: certified at `tolerance`; unchanged if no better ones are found.
    ///
    /// # Returns
    /// Whether the impulses were changed, and the number of factorisations.
    pub fn least(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
    ) -> (bool, usize) {
        self.judge.prepare(problem);
        self.response.prepare(problem);
        let mut free = closed_rows(problem, &mut self.judge, impulses);
        let given = impulses.to_vec();
        for round in 1..=ROUNDS {
            let Some(found) = self.round(problem, &given, &free) else {
                return (false, round);
            };
            let mut stays = true;
            for (i, law) in problem.laws.iter().enumerate() {
                let p = found[i];
                let next = match (*law, free[i]) {
                    (_, Free::None) | (Law::Pin, _) => continue,
                    (Law::Contact { .. }, _) if p.x < 0.0 => Free::None,
                    (Law::Contact { friction, .. }, Free::Both) if p.y.abs() > friction * p.x => {
                        Free::Along(friction * p.y.signum())
                    }
                    // a bounded row must stay within its bounds
                    (Law::Bounded { lower, upper, .. }, _) if p.x < lower || p.x > upper => {
                        return (false, round);
                    }
                    _ => continue,
                };
                free[i] = next;
                stays = false;
            }
            if stays {
                let better = self.norm(problem, &found) < self.norm(problem, &given);
                let certified = self.judge.natural_map(problem, &found).certified(tolerance);
                if better && certified {
                    impulses.copy_from_slice(&found);
                }
                return (better && certified, round);
            }
        }
        (false, ROUNDS)
    }

    /// The impulses of minimum norm in the directions `free` that act on the bodies as `given`
    /// does.
    fn round(
        &mut self,
        problem: &ContactProblem,
        given: &[Vec2],
        free: &[Free],
    ) -> Option<Vec<Vec2>> {
        self.gains.clear();
        for ((f, law), block) in free.iter().zip(&problem.laws).zip(self.judge.diagonal()) {
            let rate = 2.0 / (WEIGHT * weight(law, block));
            let gain = f.directions().into_iter().map(|d| d * d.transpose() * rate);
            self.gains.push(gain.sum());
        }
        // blocks without directions keep their impulse; released contacts pass theirs to the others
        let fixed: Vec<Vec2> = (problem.laws.iter().zip(given).zip(free))
            .map(|((law, p), f)| match (law, f) {
                (Law::Contact { compliance, .. }, Free::None) if *compliance == 0.0 => {
                    Vec2::zeros()
                }
                (_, Free::None) => *p,
                _ => Vec2::zeros(),
            })
            .collect();
        self.response.start(problem, given);
        let target: Vec<Vec2> = (0..given.len())
            .map(|i| self.response.velocity(i))
            .collect();
        if !self.response.factorise(problem, &self.gains) {
            return None;
        }
        let mut found = fixed;
        self.response.start(problem, &found);
        for _ in 0..REPEATS {
            self.targets.clear();
            for (i, p) in found.iter().enumerate() {
                let open = self.response.velocity(i) - target[i];
                self.targets.push(p - self.gains[i] * open);
            }
            self.response.solve(problem, &self.targets);
            for (i, p) in found.iter_mut().enumerate() {
                let next = self.targets[i] - self.gains[i] * self.response.change(i);
                // removes round-off outside the free directions
                *p += free[i].part(next - *p);
            }
            self.response.start(problem, &found);
        }
        found
            .iter()
            .all(|p| p.x.is_finite() && p.y.is_finite())
            .then_some(found)
    }

    /// The norm (1) of [`Sharing::least`].
    fn norm(&self, problem: &ContactProblem, impulses: &[Vec2]) -> f64 {
        let blocks = problem.laws.iter().zip(self.judge.diagonal());
        let weighted = |(p, (law, g)): (&Vec2, (&Law, &Mat2))| weight(law, g) * p.norm_squared();
        impulses.iter().zip(blocks).map(weighted).sum()
    }
}

/// `tr(G_ii)` of the block's own rows [1/kg].
fn weight(law: &Law, block: &Mat2) -> f64 {
    match law.rows() {
        1 => block[(0, 0)],
        _ => block.trace(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::Vec3;
    use crate::contact::examples::{Bodies, heap, pyramid};
    use crate::solver::{Direct, ImpulseSolver, Nsgs};

    /// A box of 1 kg under a weight of 1 N s on feet at `xs`, its centre above 0.
    fn feet(xs: &[f64], friction: f64, velocity: Vec3) -> ContactProblem {
        let mut bodies = Bodies::default();
        let id = bodies.add(1.0, 1.0 / 6.0, Vec2::new(0.0, 0.5), velocity);
        for &x in xs {
            bodies.touch([NO_BODY, id], Vec2::new(x, 0.0), Vec2::y(), friction);
        }
        bodies.problem()
    }

    fn solved<S: ImpulseSolver + Default>(problem: &ContactProblem) -> Vec<Vec2> {
        let mut impulses = vec![Vec2::zeros(); problem.len()];
        let report = S::default().solve(problem, &mut impulses, 1e-12);
        assert!(report.solved(), "{report:?}");
        impulses
    }

    /// Minimum under ΣP = 1 and ΣxP = 0 with weights w: P_i = (a + b x_i) / w_i. The weight of one
    /// row is G_NN = 1/m + x²/J.
    #[test]
    fn feet_in_a_row_share_by_their_weight() {
        let xs = [-0.5, -0.3, -0.1, 0.1, 0.3, 0.5];
        let problem = feet(&xs, 0.0, Vec3::new(0.0, -1.0, 0.0));
        let mut impulses = solved::<Nsgs>(&problem);
        let (changed, _) = Sharing::default().least(&problem, &mut impulses, 1e-12);
        assert!(changed);
        let weight = |x: f64| 1.0 + 6.0 * x * x;
        let sum: f64 = xs.iter().map(|x| 1.0 / weight(*x)).sum();
        for (p, x) in impulses.iter().zip(xs) {
            // symmetric: b = 0; the tolerance is round-off over the weight of the norm
            assert!((p.x - 1.0 / weight(x) / sum).abs() < 1e-9, "{p}");
        }
        let unique = Uniqueness::of(&problem, &impulses);
        // six rows, two of them independent
        assert_eq!(unique.self_stress, Some(4));
        assert!(unique.steep.is_empty());
    }

    /// The distribution of minimum norm does not depend on the solver.
    #[test]
    fn least_shares_do_not_depend_on_the_solver() {
        for problem in [
            feet(&[-0.5, -0.2, 0.1, 0.5], 0.5, Vec3::new(0.02, -1.0, 0.01)),
            feet(&[-0.5, -0.2, 0.1, 0.5], 0.2, Vec3::new(3.0, -1.0, 0.0)),
            pyramid(4, 0.5).problem(),
        ] {
            let mut a = solved::<Direct>(&problem);
            let mut b = vec![Vec2::zeros(); problem.len()];
            // another start leads to another distribution
            b[0] = Vec2::new(0.3, 0.0);
            let report = Nsgs::with_budget(20_000).solve(&problem, &mut b, 1e-12);
            assert!(report.solved(), "{report:?}");
            let mut sharing = Sharing::default();
            assert!(sharing.least(&problem, &mut a, 1e-10).0);
            assert!(sharing.least(&problem, &mut b, 1e-10).0);
            let apart = a
                .iter()
                .zip(&b)
                .map(|(a, b)| (a - b).norm())
                .fold(0.0, f64::max);
            // both are certified at 1e-12 of about 1 m/s; the distribution amplifies the error
            assert!(apart < 1e-8, "{apart}");
        }
    }

    /// A unique distribution does not change.
    #[test]
    fn unique_shares_are_left_alone() {
        let problem = feet(&[-0.5, 0.5], 0.0, Vec3::new(0.0, -1.0, 0.1));
        let mut impulses = solved::<Direct>(&problem);
        let before = impulses.clone();
        assert_eq!(Uniqueness::of(&problem, &impulses).self_stress, Some(0));
        Sharing::default().least(&problem, &mut impulses, 1e-12);
        for (a, b) in impulses.iter().zip(before) {
            assert!((a - b).norm() < 1e-12);
        }
    }

    #[test]
    fn least_shares_of_a_heap_stay_certified_and_are_less() {
        let problem = heap(6, 4, 0.5, 0.0, 3).problem();
        let mut impulses = solved::<Direct>(&problem);
        let mut sharing = Sharing::default();
        let (changed, _) = sharing.least(&problem, &mut impulses, 1e-9);
        let residual = crate::contact::natural_map(&problem, &impulses);
        assert!(residual.certified(1e-9), "{changed} {residual:?}");
    }
}
