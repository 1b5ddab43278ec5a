//! Lemke's method for contact problems, as linear complementarity problems.

mod path;
mod pivot;
mod reduction;

#[cfg(test)]
pub(crate) use path::solve_basis;
pub use path::{LcpError, LcpOptions, LcpSolution, LcpStatus};
#[allow(unused_imports)] // for the other paths of `oracles`
pub(crate) use path::{Search, first_path, mean_diagonal};
#[allow(unused_imports)] // as above
pub(crate) use pivot::{PathEnd, Tableau};

use super::impulse_solver::{ImpulseSolver, SolveReport};
use crate::contact::{ContactProblem, Vec2};
use reduction::{Form, Rows};

/// Lemke's complementary pivoting on the contact problem as an LCP: an oracle and a fallback.
///
/// Bilateral constraints are eliminated by a Schur complement. The LCP of size 3n (Glocker &
/// Studer) is tried first. If its residual does not certify it, the LCP of size 4n follows (Stewart
/// & Trinkle, Anitescu & Potra), whose matrix is copositive for every μ ≥ 0: except for round-off
/// it is solved whenever `b` lies in the range of `Wᵀ` (static surfaces, one restitution for all).
/// If neither is certified, the better of the two is returned (or zeros, if both are worse than
/// zeros).
///
/// The method cannot use a warm start: it ignores `impulses` on entry. Where impulses are not
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
            // the second form is the fallback after a ray of the first
            options: LcpOptions {
                fallbacks: false,
                ..LcpOptions::default()
            },
            max_blocks: 400,
        }
    }
}

impl Lemke {
    /// Impulses and pivots of one form; `None` if the data overflow.
    fn attempt(&self, rows: &Rows, form: Form) -> Option<(Vec<Vec2>, usize)> {
        let lcp = rows.complementarity(form);
        let solution = first_path(&lcp.matrix, &lcp.q, &self.options).ok()?;
        let solution = solution.into_solution(None, false);
        Some((rows.impulses(&lcp, &solution.z), solution.pivots))
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
            let Some((candidate, taken)) = self.attempt(&rows, form) else {
                continue;
            };
            pivots += taken;
            factorisations += usize::from(taken > 0);
            let report = SolveReport::judged(problem, &candidate, tolerance);
            if report.solved() || report.residual.merit() < best.residual.merit() {
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
pub(crate) mod tests {
    use super::*;
    use crate::contact::{
        BodyOperator, Delassus, Law, NO_BODY, Rows as BlockRows, Vec3, natural_map,
    };
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

        pub fn below(&mut self, n: usize) -> usize {
            self.between(0.0, n as f64) as usize
        }
    }

    /// The laws of a random problem.
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
            let draw = random.between(0.0, 1.0);
            laws.push(match mix {
                Mix::Joints if draw < 0.12 => Law::Pin,
                Mix::Joints if draw < 0.2 => Law::Bounded {
                    lower: f64::NEG_INFINITY,
                    upper: f64::INFINITY,
                    compliance: 0.0,
                },
                Mix::Joints if draw < 0.35 => {
                    let lower = random.between(-0.5, 0.1);
                    Law::Bounded {
                        lower,
                        upper: lower + random.between(-0.1, 1.0).max(0.0),
                        compliance: (draw - 0.27).max(0.0),
                    }
                }
                Mix::Joints if draw < 0.4 => Law::Bounded {
                    lower: 0.0,
                    upper: f64::INFINITY,
                    compliance: 0.0,
                },
                Mix::Compliant if draw < 0.5 => Law::Contact {
                    friction,
                    compliance: 10f64.powf(random.between(-3.0, 1.0)),
                },
                _ => contact(friction),
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

    /// Both forms, each on its own. Measured: all 600 certified by either, in 19 (3n) and 30 (4n)
    /// pivots a problem; the 5 % are margin for round-off of another processor.
    #[test]
    fn random_hyperstatic_problems_are_certified_by_either_form() {
        let solver = Lemke::default();
        for mix in [Mix::Frictional, Mix::Joints, Mix::Compliant] {
            for form in [Form::Three, Form::Four] {
                let mut random = Random(1);
                let (total, mut solved, mut pivots) = (200, 0, 0);
                for _ in 0..total {
                    let problem = random_problem(&mut random, mix);
                    problem.validate().unwrap();
                    let (p, taken) = solver.attempt(&Rows::new(&problem), form).unwrap();
                    assert!(p.iter().all(|p| p.x.is_finite() && p.y.is_finite()));
                    solved += usize::from(natural_map(&problem, &p).certified(1e-9));
                    pivots += taken;
                }
                assert!(solved * 100 >= total * 95, "{mix:?} {form:?}: {solved}");
                // an oracle that needs hundreds of pivots on 5 to 20 blocks is broken
                assert!(pivots < 50 * total, "{mix:?} {form:?}: {pivots}");
            }
        }
    }

    fn dense(matrix: &[f64], free: &[Vec2], laws: &[Law]) -> ContactProblem {
        let n = 2 * laws.len();
        ContactProblem {
            operator: Delassus::dense(DMatrix::from_row_slice(n, n, matrix)),
            free: free.to_vec(),
            laws: laws.to_vec(),
        }
    }

    fn contact(friction: f64) -> Law {
        Law::Contact {
            friction,
            compliance: 0.0,
        }
    }

    /// Unit box of 1 kg (inertia 1/6) landing at 1 m/s while sliding at `slide`; corners at ±0.5.
    fn box_on_floor(slide: f64) -> ContactProblem {
        let corner = |x: f64| BlockRows {
            bodies: [NO_BODY, 0],
            jacobian: [
                [Vec3::zeros(); 2],
                [Vec3::new(0.0, 1.0, x), Vec3::new(-1.0, 0.0, -0.5)],
            ],
        };
        let rows = vec![corner(-0.5), corner(0.5)];
        let velocity = [Vec3::new(slide, -1.0, 0.0)];
        ContactProblem {
            free: rows.iter().map(|r| r.velocity(&velocity)).collect(),
            operator: Delassus::Bodies(BodyOperator {
                inverse_mass: vec![Vec3::new(1.0, 1.0, 6.0)],
                rows,
            }),
            laws: vec![contact(0.5); 2],
        }
    }

    /// 4 rows on 3 coordinates: the impulse distribution is not unique, the wrench is. Momentum:
    /// ΣP_N = 1 N s; sticking takes ΣP_T = −(−0.1), sliding μ ΣP_N.
    #[test]
    fn box_on_floor_gets_the_right_wrench_in_a_pinned_number_of_pivots() {
        for (slide, friction) in [(0.1, 0.1), (3.0, 0.5)] {
            let (p, report) = solve(&box_on_floor(slide), 1e-12);
            assert!(report.solved());
            // round-off of unit numbers
            assert!((p[0].x + p[1].x - 1.0).abs() < 1e-14);
            assert!((p[0].y + p[1].y - friction).abs() < 1e-14);
        }
        assert_eq!(solve(&box_on_floor(0.1), 1e-12).1.pivots, 6);
        assert_eq!(solve(&box_on_floor(3.0), 1e-12).1.pivots, 7);
    }

    #[test]
    fn painleve_block_is_solved_by_both_forms() {
        let block = [1.6, -1.2, -1.2, 3.4];
        // about to touch (three solutions), touching, approaching
        for approach in [0.05, 0.0, -0.05] {
            let problem = dense(&block, &[Vec2::new(approach, -3.0)], &[contact(2.0)]);
            let rows = Rows::new(&problem);
            for form in [Form::Three, Form::Four] {
                let (p, _) = Lemke::default().attempt(&rows, form).unwrap();
                // round-off of a 2 x 2 solve
                assert!(natural_map(&problem, &p).certified(1e-14), "{form:?} {p:?}");
            }
        }
    }

    /// A block of unit mass on a motor: a bound that an engine uses as infinite costs no digits, a
    /// short one saturates, an interval of zero width gives its impulse.
    #[test]
    fn bounds_far_near_and_closed() {
        let far = f64::from(f32::MAX);
        for (lower, upper, expected) in [
            (-far, far, 3.0),
            (-f64::MAX, f64::MAX, 3.0),
            (f64::NEG_INFINITY, far, 3.0),
            (-0.5, 0.5, 0.5),
            (0.25, 0.25, 0.25),
            (4.0, 9.0, 4.0),
        ] {
            let law = Law::Bounded {
                lower,
                upper,
                compliance: 0.0,
            };
            let problem = dense(&[1.0, 0.0, 0.0, 1.0], &[Vec2::new(-3.0, 0.0)], &[law]);
            let (p, report) = solve(&problem, 1e-14);
            assert!(report.solved(), "{lower} {upper}");
            // round-off of 3
            assert!((p[0].x - expected).abs() < 1e-15, "{lower} {upper}");
        }
    }

    #[test]
    fn redundant_pins_share_and_contradicting_pins_stay_unsolved_and_finite() {
        // the same pin twice on a unit mass
        let twice = DMatrix::from_fn(4, 4, |i, j| f64::from(u8::from(i % 2 == j % 2)));
        let mut problem = ContactProblem {
            operator: Delassus::dense(twice),
            free: vec![Vec2::new(-2.0, 4.0); 2],
            laws: vec![Law::Pin; 2],
        };
        let (p, report) = solve(&problem, 1e-14);
        assert!(report.solved());
        // least impulses: halves, to round-off
        assert!((p[0] - Vec2::new(1.0, -2.0)).norm() < 1e-14 && (p[1] - p[0]).norm() < 1e-14);
        problem.free[1].x = 2.0;
        let (p, report) = solve(&problem, 1e-9);
        assert!(!report.solved() && p.iter().all(|p| p.x.is_finite() && p.y.is_finite()));
    }

    #[test]
    fn start_is_ignored_and_too_many_blocks_are_left_alone() {
        let problem = box_on_floor(0.1);
        let (cold, _) = solve(&problem, 1e-12);
        let mut warm = vec![Vec2::new(7.0, -1.0); 2];
        Lemke::default().solve(&problem, &mut warm, 1e-12);
        assert_eq!(warm, cold);
        let mut small = Lemke {
            max_blocks: 1,
            ..Lemke::default()
        };
        let report = small.solve(&problem, &mut warm, 1e-12);
        assert!(!report.solved() && report.pivots == 0 && warm[0] == Vec2::zeros());
    }

    /// Heavy or light, the box is solved; where numbers overflow the result stays finite. Not
    /// beyond 1e±150: the residual squares impulses.
    #[test]
    fn extreme_masses_neither_panic_nor_give_nan() {
        for (factor, representable) in [(1e-100, true), (1e100, true), (1e308, false)] {
            let mut problem = box_on_floor(0.1);
            if let Delassus::Bodies(operator) = &mut problem.operator {
                operator.inverse_mass[0] *= factor;
            }
            let mut p = vec![Vec2::zeros(); 2];
            let report = Lemke::default().solve(&problem, &mut p, 1e-12);
            assert!(p.iter().all(|p| p.x.is_finite() && p.y.is_finite()));
            assert!(report.solved() || !representable, "{factor:e}");
        }
    }
}
