//! Lemke's method: a plain LCP solver, and contact problems through it.

mod pivot;
mod reduction;

pub use pivot::{LcpError, LcpOptions, LcpSolution, LcpStatus, solve_lcp};

use super::{ImpulseSolver, SolveReport};
use crate::contact::{ContactProblem, Vec2};
use reduction::{Form, Rows};

/// Lemke's complementary pivoting on the contact problem as an LCP: an oracle and a fallback.
///
/// Bilateral rows are eliminated by a Schur complement. The LCP of size 3n (Glocker & Studer) is
/// tried first; if the judge does not certify it, the one of size 4n (Stewart & Trinkle, Anitescu
/// & Potra), whose matrix is copositive for every μ ≥ 0. If neither is certified, the better of
/// the two is returned (or zeros, if they are worse still).
///
/// The method has no use for a warm start: `impulses` on entry is ignored. Where impulses are not
/// unique it returns a basic solution, with many contacts at 0.
///
/// # Source
/// Glocker & Studer, Multibody Syst. Dyn. 13 (2005); Stewart & Trinkle, Int. J. Numer. Methods
/// Eng. 39 (1996); Anitescu & Potra, Nonlinear Dyn. 14 (1997).
#[derive(Debug, Clone, PartialEq)]
pub struct Lemke {
    /// Settings of every LCP.
    pub options: LcpOptions,
    /// Problems of more blocks are returned unsolved, with zero impulses: the tableau is dense.
    pub max_blocks: usize,
}

impl Default for Lemke {
    fn default() -> Self {
        Lemke {
            options: LcpOptions::default(),
            max_blocks: 400,
        }
    }
}

impl ImpulseSolver for Lemke {
    fn name(&self) -> &'static str {
        "lemke"
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
    ) -> SolveReport {
        impulses.fill(Vec2::zeros());
        let mut best = SolveReport::judged(problem, impulses, tolerance);
        if best.solved() || problem.len() > self.max_blocks {
            return best;
        }
        let rows = Rows::new(problem);
        let mut pivots = 0;
        let mut factorisations = usize::from(rows.has_bilateral());
        for form in [Form::Three, Form::Four] {
            let lcp = rows.complementarity(form);
            // refused only where the data overflow; then the zeros stand
            let Ok(solution) = solve_lcp(&lcp.matrix, &lcp.q, &self.options) else {
                continue;
            };
            pivots += solution.pivots;
            factorisations += usize::from(solution.pivots > 0);
            let candidate = rows.impulses(&lcp, &solution.z);
            let report = SolveReport::judged(problem, &candidate, tolerance);
            if report.solved() || report.residual.relative < best.residual.relative {
                impulses.copy_from_slice(&candidate);
                best = report;
            }
            if best.solved() {
                break;
            }
        }
        SolveReport {
            pivots,
            factorisations,
            ..best
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::contact::{BodyOperator, Delassus, Law, NO_BODY, Rows as BlockRows, Vec3};
    use nalgebra::DMatrix;

    /// Knuth's MMIX generator: fixed problems without a crate.
    pub struct Random(pub u64);

    impl Random {
        pub fn between(&mut self, low: f64, high: f64) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
        }

        fn below(&mut self, n: usize) -> usize {
            self.between(0.0, n as f64) as usize
        }
    }

    /// Which laws a random problem holds.
    #[derive(Clone, Copy, PartialEq, Debug)]
    enum Mix {
        Frictional,
        Joints,
        Compliant,
    }

    /// Random bodies and blocks, more rows than coordinates in most draws; the free velocities
    /// come from body velocities, so a solution exists.
    fn random_problem(random: &mut Random, mix: Mix) -> ContactProblem {
        let bodies = 3 + random.below(6);
        let blocks = 5 + random.below(16);
        let inverse_mass = (0..bodies)
            .map(|_| {
                let mass = 10f64.powf(random.between(-1.0, 1.0));
                let inertia = mass * random.between(0.05, 0.5);
                Vec3::new(1.0 / mass, 1.0 / mass, 1.0 / inertia)
            })
            .collect();
        let velocities: Vec<Vec3> = (0..bodies)
            .map(|_| Vec3::from_fn(|_, _| random.between(-1.0, 1.0)))
            .collect();
        let mut operator = BodyOperator {
            inverse_mass,
            rows: Vec::new(),
        };
        let (mut laws, mut free) = (Vec::new(), Vec::new());
        for _ in 0..blocks {
            let second = random.below(bodies);
            let first = random.below(bodies + 1);
            let first = if first == second { bodies } else { first };
            let angle = random.between(0.0, std::f64::consts::TAU);
            let (n, t) = ((angle.cos(), angle.sin()), (-angle.sin(), angle.cos()));
            let mut side = |sign: f64| {
                let r = (random.between(-1.0, 1.0), random.between(-1.0, 1.0));
                let row = |d: (f64, f64)| Vec3::new(d.0, d.1, r.0 * d.1 - r.1 * d.0) * sign;
                [row(n), row(t)]
            };
            let rows = BlockRows {
                bodies: [
                    if first == bodies {
                        NO_BODY
                    } else {
                        first as u32
                    },
                    second as u32,
                ],
                jacobian: [side(-1.0), side(1.0)],
            };
            free.push(rows.velocity(&velocities));
            operator.rows.push(rows);
            let friction = random.between(-0.1, 1.0).max(0.0);
            let contact = |compliance| Law::Contact {
                friction,
                compliance,
            };
            let draw = random.between(0.0, 1.0);
            laws.push(match mix {
                Mix::Joints if draw < 0.12 => Law::Pin,
                Mix::Joints if draw < 0.2 => Law::Bounded {
                    lower: f64::NEG_INFINITY,
                    upper: f64::INFINITY,
                },
                Mix::Joints if draw < 0.35 => {
                    let lower = random.between(-0.5, 0.1);
                    Law::Bounded {
                        lower,
                        upper: lower + random.between(-0.1, 1.0).max(0.0),
                    }
                }
                Mix::Joints if draw < 0.4 => Law::Bounded {
                    lower: 0.0,
                    upper: f64::INFINITY,
                },
                Mix::Compliant if draw < 0.5 => contact(10f64.powf(random.between(-3.0, 1.0))),
                _ => contact(0.0),
            });
        }
        ContactProblem {
            operator: Delassus::Bodies(operator),
            free,
            laws,
        }
    }

    fn solve(problem: &ContactProblem, tolerance: f64) -> (Vec<Vec2>, SolveReport) {
        problem.validate().unwrap();
        let mut impulses = vec![Vec2::zeros(); problem.len()];
        let report = Lemke::default().solve(problem, &mut impulses, tolerance);
        (impulses, report)
    }

    /// The share certified is the measure; mechanics of the 4n form promise all but round-off.
    #[test]
    fn random_hyperstatic_problems_are_certified() {
        for mix in [Mix::Frictional, Mix::Joints, Mix::Compliant] {
            let mut random = Random(1);
            let (total, mut solved, mut pivots, mut most, mut second) = (400, 0, 0, 0, 0);
            for _ in 0..total {
                let problem = random_problem(&mut random, mix);
                let (impulses, report) = solve(&problem, 1e-9);
                assert!(impulses.iter().all(|p| p.x.is_finite() && p.y.is_finite()));
                solved += usize::from(report.solved());
                pivots += report.pivots;
                most = most.max(report.pivots);
                let mut three = vec![Vec2::zeros(); problem.len()];
                let rows = Rows::new(&problem);
                let lcp = rows.complementarity(Form::Three);
                let s = solve_lcp(&lcp.matrix, &lcp.q, &LcpOptions::default()).unwrap();
                three.copy_from_slice(&rows.impulses(&lcp, &s.z));
                let r3 = SolveReport::judged(&problem, &three, 1e-9);
                second += usize::from(!r3.solved());
                if !report.solved() {
                    let lcp = rows.complementarity(Form::Four);
                    let s4 = solve_lcp(&lcp.matrix, &lcp.q, &LcpOptions::default()).unwrap();
                    println!(
                        "{:?} {} | {:?} {:e} {} | {:?} {:e} {}",
                        report.residual,
                        problem.len(),
                        s.status,
                        s.residual,
                        s.pivots,
                        s4.status,
                        s4.residual,
                        s4.pivots
                    );
                }
            }
            println!(
                "{mix:?}: {solved}/{total}, mean pivots {:.1}, most {most}, 3n failed {second}",
                pivots as f64 / total as f64
            );
            assert!(solved * 100 >= total * 95, "{mix:?}: {solved} of {total}");
        }
    }
}
