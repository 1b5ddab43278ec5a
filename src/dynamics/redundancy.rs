//! Whether the impulse distribution of an island is unique.

use crate::contact::{ContactProblem, Delassus, Law, NO_BODY, Vec2};

/// Whether closed rigid rows outnumber the coordinates, of the island or of the relative motion of
/// two bodies. Their impulse distribution is then not unique. This cheap test can miss self-stress
/// that involves more bodies; [`crate::solver::Uniqueness`] finds it.
///
/// A row is closed if its velocity in `velocities`, `G P + b`, satisfies `|ξ| ≤ resolution`,
/// whether or not the solver loaded it.
pub(super) fn redundant(
    problem: &ContactProblem,
    impulses: &[Vec2],
    velocities: &[Vec2],
    resolution: f64,
) -> bool {
    let Delassus::Bodies(op) = &problem.operator else {
        return false;
    };
    let own = |body: u32| match op.inverse_mass.get(body as usize) {
        Some(w) => w.iter().filter(|x| **x > 0.0).count(),
        None => 0,
    };
    // rows of the island, and of the current pair of bodies
    let (mut rows, mut pair, mut of_pair) = (0, [NO_BODY; 2], 0);
    for (i, (law, p)) in problem.laws.iter().zip(impulses).enumerate() {
        let mut xi = velocities[i];
        xi.x += law.compliance() * p.x;
        let closed = match *law {
            Law::Contact {
                compliance,
                friction,
            } => {
                let closed = compliance == 0.0 && xi.x <= resolution;
                let sticks = friction > 0.0 && p.x > 0.0 && xi.y.abs() <= resolution;
                usize::from(closed) + usize::from(sticks)
            }
            Law::Pin => 2,
            Law::Bounded {
                lower,
                upper,
                compliance,
            } => usize::from(compliance == 0.0 && p.x > lower && p.x < upper),
        };
        if op.rows[i].bodies != pair {
            (pair, of_pair) = (op.rows[i].bodies, 0);
        }
        of_pair += closed;
        rows += closed;
        if of_pair > (own(pair[0]) + own(pair[1])).min(3) {
            return true;
        }
    }
    rows > (0..op.inverse_mass.len() as u32).map(own).sum()
}
