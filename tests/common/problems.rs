//! Contact problems made from a solution chosen first, and what leaves a problem the same.

use super::Random;
use moreau2d::contact::{
    BodyOperator, ContactProblem, Delassus, Law, NO_BODY, Rows, Vec2, Vec3, natural_map,
};
use nalgebra::{DMatrix, DVector};

/// A problem with one of its solutions.
#[derive(Debug, Clone)]
pub struct Known {
    pub problem: ContactProblem,
    pub impulses: Vec<Vec2>,
}

impl Known {
    /// `b = ξ − G P − R P_N` with impulses and velocities that obey the laws: contacts open, stick or
    /// slip at random, friction from `friction`.
    fn solved_by_choice(
        random: &mut Random,
        operator: Delassus,
        compliant: bool,
        mut friction: impl FnMut(&mut Random) -> f64,
    ) -> Known {
        let n = operator.blocks();
        let (mut laws, mut impulses, mut velocities) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..n {
            let friction = friction(random);
            let soft = compliant && random.below(3) == 0;
            let compliance = if soft { random.between(0.1, 2.0) } else { 0.0 };
            laws.push(Law::Contact {
                friction,
                compliance,
            });
            let sign = if random.below(2) == 0 { 1.0 } else { -1.0 };
            let load = random.between(0.1, 1.0);
            let (p, xi) = match random.below(3) {
                0 => {
                    let xi = Vec2::new(random.between(0.1, 1.0), random.between(-1.0, 1.0));
                    (Vec2::zeros(), xi)
                }
                1 => {
                    let share = random.between(-0.95, 0.95);
                    (Vec2::new(load, share * friction * load), Vec2::zeros())
                }
                _ => (
                    Vec2::new(load, -sign * friction * load),
                    Vec2::new(0.0, sign * random.between(0.1, 1.0)),
                ),
            };
            impulses.push(p);
            velocities.push(xi);
        }
        let moved = operator.apply(&impulses);
        let free = (0..n).map(|i| {
            let soft = Vec2::new(laws[i].compliance() * impulses[i].x, 0.0);
            velocities[i] - moved[i] - soft
        });
        Known {
            problem: ContactProblem {
                free: free.collect(),
                operator,
                laws,
            },
            impulses,
        }
    }

    /// Several contacts on each of a few bodies: shares are not unique, nor need velocities be.
    pub fn redundant(random: &mut Random) -> Known {
        let bodies = 2 + random.below(4);
        let contacts = 2 + random.below(9);
        Known::redundant_of(random, bodies, contacts)
    }

    /// The same with so many bodies and contacts.
    pub fn redundant_of(random: &mut Random, bodies: usize, contacts: usize) -> Known {
        let operator = bodies_and_rows(
            random,
            bodies,
            |random, _| {
                let first = random.below(bodies) as u32;
                let other = random.below(bodies + 1) as u32;
                let ground = other == first || other == bodies as u32;
                [if ground { NO_BODY } else { other }, first]
            },
            contacts,
        );
        let friction = |random: &mut Random| match random.below(4) {
            0 => 0.0,
            _ => random.between(0.05, 2.0),
        };
        Known::solved_by_choice(random, operator, true, friction)
    }

    /// A problem with one solution only: a chain of bodies, each on the one before.
    ///
    /// For a given shift `μ |ξ_T|` the problem is that of a strictly convex function, whose minimum
    /// moves by at most `1/λ_min` of the shift, and `ξ_T` by `λ_max/λ_min = κ` of it: with `μ κ < 1`
    /// the shift is the fixed point of a contraction.
    pub fn unique(random: &mut Random) -> Known {
        let n = 2 + random.below(3);
        let ground = |_: &mut Random, k: usize| {
            let below = if k == 0 { NO_BODY } else { k as u32 - 1 };
            [below, k as u32]
        };
        let operator = bodies_and_rows(random, n, ground, n);
        let spread = condition(&operator.explicit());
        let friction = |random: &mut Random| random.between(0.1, 0.9) / spread;
        Known::solved_by_choice(random, operator, false, friction)
    }

    /// The same of an explicit operator near the identity: friction up to 0.5.
    pub fn unique_explicit(random: &mut Random) -> Known {
        let n = 2 + random.below(3);
        let l = DMatrix::from_fn(2 * n, 2 * n, |_, _| random.between(-1.0, 1.0));
        let square = &l * l.transpose();
        let matrix = DMatrix::identity(2 * n, 2 * n) + &square * (0.7 / square.norm());
        let spread = condition(&matrix);
        let operator = Delassus::dense(matrix);
        let friction = |random: &mut Random| random.between(0.1, 0.9) / spread;
        Known::solved_by_choice(random, operator, false, friction)
    }
}

/// `λ_max/λ_min` of a symmetric positive definite matrix.
fn condition(matrix: &DMatrix<f64>) -> f64 {
    let values: DVector<f64> = matrix.symmetric_eigenvalues();
    values.max() / values.min()
}

/// Bodies of 0.3 to 3 kg, a metre in size, and `contacts` contacts of the sides that `sides` names.
pub fn bodies_and_rows(
    random: &mut Random,
    bodies: usize,
    mut sides: impl FnMut(&mut Random, usize) -> [u32; 2],
    contacts: usize,
) -> Delassus {
    let inverse_mass = (0..bodies)
        .map(|_| {
            let mass = random.between(0.3, 3.0);
            let inertia = mass * random.between(0.1, 0.4);
            Vec3::new(1.0 / mass, 1.0 / mass, 1.0 / inertia)
        })
        .collect();
    let rows = (0..contacts)
        .map(|k| {
            let bodies = sides(random, k);
            let angle: f64 = random.between(0.0, std::f64::consts::TAU);
            let normal = Vec2::new(angle.cos(), angle.sin());
            let tangent = Vec2::new(-normal.y, normal.x);
            let mut side = |body: u32, sign: f64| {
                if body == NO_BODY {
                    return [Vec3::zeros(); 2];
                }
                let arm = Vec2::new(random.between(-0.5, 0.5), random.between(-0.5, 0.5));
                [normal, tangent].map(|d| sign * Vec3::new(d.x, d.y, arm.perp(&d)))
            };
            Rows {
                jacobian: [side(bodies[0], -1.0), side(bodies[1], 1.0)],
                bodies,
            }
        })
        .collect();
    Delassus::Bodies(BodyOperator { inverse_mass, rows })
}

/// What turns a problem into another one whose solution is known from the first.
#[derive(Debug, Clone)]
pub enum Change {
    /// Blocks in another order: block k of the new problem is block `order[k]` of the old.
    Blocks(Vec<usize>),
    /// Body k of the new problem is body `order[k]` of the old, and both sides of all contacts swap.
    Bodies(Vec<usize>),
    /// The plane turned by an angle \[rad\].
    Turn(f64),
    /// x → −x.
    Mirror,
    /// All masses times a factor.
    Mass(f64),
    /// All velocities times a factor.
    Velocity(f64),
}

impl Change {
    /// One of each kind for a problem from bodies.
    pub fn all(random: &mut Random, problem: &ContactProblem) -> Vec<Change> {
        let Delassus::Bodies(op) = &problem.operator else {
            panic!("from bodies")
        };
        vec![
            Change::Blocks(shuffled(random, problem.len())),
            Change::Bodies(shuffled(random, op.inverse_mass.len())),
            Change::Turn(random.between(-3.0, 3.0)),
            Change::Mirror,
            Change::Mass(10f64.powf(random.between(-3.0, 3.0))),
            Change::Velocity(10f64.powf(random.between(-3.0, 3.0))),
        ]
    }

    /// The other problem.
    pub fn problem(&self, problem: &ContactProblem) -> ContactProblem {
        let mut new = problem.clone();
        let (Delassus::Bodies(op), Delassus::Bodies(old)) = (&mut new.operator, &problem.operator)
        else {
            panic!("from bodies")
        };
        let columns = |op: &mut BodyOperator, change: &dyn Fn(Vec3) -> Vec3| {
            let vectors = op
                .rows
                .iter_mut()
                .flat_map(|r| r.jacobian.iter_mut().flatten());
            vectors.for_each(|j| *j = change(*j));
        };
        match self {
            Change::Blocks(order) => {
                for (to, &from) in order.iter().enumerate() {
                    op.rows[to] = old.rows[from];
                    new.free[to] = problem.free[from];
                    new.laws[to] = problem.laws[from];
                }
            }
            Change::Bodies(order) => {
                let mut number = vec![0; order.len()];
                for (to, &from) in order.iter().enumerate() {
                    op.inverse_mass[to] = old.inverse_mass[from];
                    number[from] = to as u32;
                }
                let named = |b: u32| if b == NO_BODY { b } else { number[b as usize] };
                for rows in &mut op.rows {
                    rows.bodies = [named(rows.bodies[1]), named(rows.bodies[0])];
                    rows.jacobian.swap(0, 1);
                }
            }
            Change::Turn(angle) => {
                let (sin, cos) = angle.sin_cos();
                columns(op, &|j| {
                    Vec3::new(cos * j.x - sin * j.y, sin * j.x + cos * j.y, j.z)
                });
            }
            Change::Mirror => {
                columns(op, &|j| Vec3::new(-j.x, j.y, -j.z));
                for side in op.rows.iter_mut().flat_map(|r| r.jacobian.iter_mut()) {
                    side[1] = -side[1];
                }
                new.free.iter_mut().for_each(|b| b.y = -b.y);
            }
            Change::Mass(factor) => {
                op.inverse_mass.iter_mut().for_each(|w| *w /= *factor);
                for law in &mut new.laws {
                    if let Law::Contact { compliance, .. } = law {
                        *compliance /= factor;
                    }
                }
            }
            Change::Velocity(factor) => new.free.iter_mut().for_each(|b| *b *= *factor),
        }
        new
    }

    /// What impulses of the old problem are in the new one.
    pub fn impulses(&self, old: &[Vec2]) -> Vec<Vec2> {
        match self {
            Change::Blocks(order) => order.iter().map(|&from| old[from]).collect(),
            Change::Bodies(_) | Change::Turn(_) => old.to_vec(),
            Change::Mirror => old.iter().map(|p| Vec2::new(p.x, -p.y)).collect(),
            Change::Mass(factor) | Change::Velocity(factor) => {
                old.iter().map(|p| *factor * p).collect()
            }
        }
    }

    /// By how much impulses and velocities grow.
    pub fn growth(&self) -> (f64, f64) {
        match self {
            Change::Mass(factor) => (*factor, 1.0),
            Change::Velocity(factor) => (*factor, *factor),
            _ => (1.0, 1.0),
        }
    }
}

fn shuffled(random: &mut Random, n: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        order.swap(i, random.below(i + 1));
    }
    order
}

/// The largest number of any impulse.
pub fn largest(impulses: &[Vec2]) -> f64 {
    impulses.iter().map(|p| p.amax()).fold(0.0, f64::max)
}

/// The largest difference of any number.
pub fn apart(a: &[Vec2], b: &[Vec2]) -> f64 {
    let differences = a.iter().zip(b).map(|(a, b)| (a - b).amax());
    differences.fold(0.0, f64::max)
}

/// Asserts what a certificate implies for every contact, to the accuracy that it states.
///
/// With `Q = P − F` in the cone and `û' = û − F/ρ` in its dual, `Q ⟂ û'` exactly. So
/// `Q_T û'_T ≤ 0` and `Q_N (û'_N − μ |û'_T|) = 0`, and `P`, `ξ` are off by `|F|` and `|F|/ρ`.
#[track_caller]
pub fn assert_laws(problem: &ContactProblem, impulses: &[Vec2]) {
    let r = natural_map(problem, impulses);
    let velocities = problem.local_velocity(impulses);
    for (i, law) in problem.laws.iter().enumerate() {
        let Law::Contact { friction, .. } = *law else {
            continue;
        };
        let (p, xi) = (impulses[i], velocities[i]);
        let shifted = xi.norm() + friction * xi.y.abs();
        // a few roundings of the numbers that the residual is made of
        let (f, v) = (
            r.absolute + 1e-15 * (p.norm() + r.velocity_scale.min(1.0) * 1e-3),
            r.velocity + 1e-14 * (r.velocity_scale + shifted),
        );
        assert!(p.x >= -f, "{i}: P_N = {}", p.x);
        let off = p.y.abs() - friction * p.x;
        assert!(off <= (1.0 + friction) * f, "{i}: {off} outside the cone");
        assert!(xi.x >= -(1.0 + friction) * v, "{i}: ξ_N = {}", xi.x);
        let gap = (p.x.abs() + f) * (1.0 + friction) * v + f * xi.x.abs();
        assert!((p.x * xi.x).abs() <= gap, "{i}: P_N ξ_N = {}", p.x * xi.x);
        let gain = f * (shifted + v) + (p.norm() + f) * v + f * v;
        assert!(p.y * xi.y <= gain, "{i}: P_T ξ_T = {} > {gain}", p.y * xi.y);
    }
}
