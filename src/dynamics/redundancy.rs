//! Whether the shares of load in an island are unique.

use crate::contact::{ContactProblem, Delassus, Law, NO_BODY, Vec2};

/// Whether closed rigid rows outnumber coordinates, of the island or of the motion of two bodies
/// against each other: their shares are then not unique. A cheap test, which can miss self-stress
/// that takes more bodies to see; [`crate::solver::Uniqueness`] does not.
///
/// Closed is what the `velocities` `G P + b` say, `|ξ| ≤ resolution`, not which rows a solver chose to load.
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
    // rows of the island, and of the pair of bodies that the last blocks join
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
