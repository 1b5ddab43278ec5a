//! The study's literal reading: the rotor stalls, and the impulse distribution over the cells is
//! not unique.

use super::blocks::{Study, Tooth, Update};
use super::study_rotor::Levers;
use crate::contact::{
    BodyOperator, ContactProblem, Delassus, Law, NO_BODY, Rows, Vec2, Vec3, natural_map,
};
use crate::experiment::RunError;

/// Results of the literal reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stall {
    /// Steps of a cycle in which anything wears, the most of all operating points.
    pub wearing_steps: usize,
    /// Speed after the first step with a closed contact \[rad/s\], largest of all.
    pub speed_after: f64,
    /// Exponents of wear per cycle in torque and in speed, fitted over all operating points.
    pub torque_exponent: f64,
    pub speed_exponent: f64,
    /// How many single-cell loadings the residual certifies, of how many.
    pub single_cell: (usize, usize),
}

/// Mean slope of ln(wear) against ln(x) over the points that share `other`.
pub(super) fn exponent(
    points: &[(f64, f64, f64)],
    x: impl Fn(&(f64, f64, f64)) -> f64,
    other: impl Fn(&(f64, f64, f64)) -> f64,
) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for (i, p) in points.iter().enumerate() {
        for q in &points[i + 1..] {
            if other(p) == other(q) && x(p) != x(q) {
                sum += (q.2 / p.2).ln() / (x(q) / x(p)).ln();
                count += 1.0;
            }
        }
    }
    sum / count
}

/// How many of the loadings in which one cell alone stops the rotor the residual certifies.
///
/// Rank one: with `P_N,i = J u_F / (a_i + μ b_i)` on cell i and zero elsewhere the end velocity is
/// 0 and every law holds, for any i.
pub(super) fn single_cells(
    study: &Study,
    tooth: &Tooth,
    torque: f64,
    speed: f64,
    dt: f64,
) -> Result<(usize, usize), RunError> {
    let profile = tooth.profile()?;
    let levers = Levers::of(&profile, study.axis_distance, Update::Quadratic)?;
    let free = speed + torque * dt / study.inertia;
    let mut problem = ContactProblem {
        operator: Delassus::Bodies(BodyOperator {
            inverse_mass: vec![Vec3::new(0.0, 0.0, 1.0 / study.inertia)],
            rows: Vec::new(),
        }),
        free: Vec::new(),
        laws: Vec::new(),
    };
    for (a, b) in levers.closing.iter().zip(&levers.sliding) {
        let spin = |lever: f64| Vec3::new(0.0, 0.0, lever);
        if let Delassus::Bodies(op) = &mut problem.operator {
            op.rows.push(Rows {
                bodies: [NO_BODY, 0],
                jacobian: [[Vec3::zeros(); 2], [spin(-a), spin(*b)]],
            });
        }
        problem.free.push(Vec2::new(-a, *b) * free);
        problem.laws.push(Law::Contact {
            friction: study.friction,
            compliance: 0.0,
        });
    }
    let n = problem.len();
    let certified = (0..n)
        .filter(|&i| {
            let stop = levers.closing[i] + study.friction * levers.sliding[i];
            let mut impulses = vec![Vec2::zeros(); n];
            let normal = study.inertia * free / stop;
            impulses[i] = Vec2::new(normal, -study.friction * normal);
            stop > 0.0 && natural_map(&problem, &impulses).certified(1e-12)
        })
        .count();
    Ok((certified, n))
}
