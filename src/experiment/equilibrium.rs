//! Decides whether an assembly of rigid blocks can stand, by a linear programme without time
//! stepping.

use crate::contact::Vec2;
use microlp::{ComparisonOp, LinearExpr, OptimizationDirection, Problem, SolveOptions, Variable};
use thiserror::Error;

/// A force on a block \[N\] and a point of its line of action \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    pub force: Vec2,
    pub at: Vec2,
}

/// A point at which two blocks touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// The two blocks, as in the list of loads; `None` is the ground.
    pub bodies: [Option<usize>; 2],
    /// \[m\]
    pub position: Vec2,
    /// Unit normal from the first to the second.
    pub normal: Vec2,
    /// Coulomb's coefficient.
    pub friction: f64,
}

/// Why the equilibrium could not be decided.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum EquilibriumError {
    /// A joint names a block that has no load.
    #[error("joint {joint} names block {body} of {blocks}")]
    Body {
        joint: usize,
        body: usize,
        blocks: usize,
    },
    /// The linear programme was not solved.
    #[error("the linear programme of the equilibrium was not solved: {0}")]
    Programme(String),
}

/// Whether forces in the friction cones of the joints can balance the loads (3 equations a block):
/// a force `N n + T t` on the second block of each joint and its reverse on the first,
/// `|T| ≤ μ N`, so that with every load the sum of forces and of moments vanishes.
///
/// Solves `max λ ≤ 1` subject to `Σ contact + λ load = 0`, which always has the solution 0. The
/// maximum is 1 or 0, because cones can be scaled. An edge contact is modelled by its two ends.
///
/// The condition is necessary. With friction, an assembly that satisfies it may still fall, because
/// friction is not associated (sliding does not dilate); an assembly that violates it cannot stand.
///
/// # Arguments
/// - `loads`: one for each block, as a rule its weight at its centre of mass.
/// - `joints`: see [`Joint`].
///
/// # Returns
/// `true` if it can stand; sharp to 1e-6 of the loads.
///
/// # Errors
/// [`EquilibriumError::Body`]; [`EquilibriumError::Programme`] if the solver of the linear programme
/// fails.
///
/// # Source
/// Livesley, *Limit analysis of structures formed from rigid blocks*, Int. J. Numer. Methods Eng.
/// 12 (1978).
pub fn stands(loads: &[Load], joints: &[Joint]) -> Result<bool, EquilibriumError> {
    // scale loads and lengths to size one
    let force = loads.iter().map(|l| l.force.norm()).fold(0.0, f64::max);
    if force == 0.0 {
        return Ok(true);
    }
    let arm = |joint: &Joint, body: usize| joint.position - loads[body].at;
    let mut size: f64 = 0.0;
    for (index, joint) in joints.iter().enumerate() {
        for body in joint.bodies.into_iter().flatten() {
            if body >= loads.len() {
                return Err(EquilibriumError::Body {
                    joint: index,
                    body,
                    blocks: loads.len(),
                });
            }
            size = size.max(arm(joint, body).norm());
        }
    }
    let mut programme = Problem::new(OptimizationDirection::Maximize);
    let factor = programme.add_var(1.0, (0.0, 1.0));
    // moments are about the point of each load, so that the load itself has no moment
    let mut rows: Vec<[LinearExpr; 3]> = loads
        .iter()
        .map(|load| {
            let mut row = [(); 3].map(|()| LinearExpr::empty());
            row[0].add(factor, load.force.x / force);
            row[1].add(factor, load.force.y / force);
            row
        })
        .collect();
    for joint in joints {
        let tangent = Vec2::new(-joint.normal.y, joint.normal.x);
        for slope in edges(joint.friction) {
            // a force along one edge of the cone, of any size
            let edge = joint.normal + tangent * slope;
            let share: Variable = programme.add_var(0.0, (0.0, f64::INFINITY));
            for (body, sign) in joint.bodies.into_iter().zip([-1.0, 1.0]) {
                let Some(body) = body else { continue };
                let moment = arm(joint, body).perp(&edge) / size;
                for (row, part) in rows[body].iter_mut().zip([edge.x, edge.y, moment]) {
                    if part != 0.0 {
                        row.add(share, sign * part);
                    }
                }
            }
        }
    }
    for row in rows.into_iter().flatten() {
        programme.add_constraint(row, ComparisonOp::Eq, 0.0);
    }
    let fail = |error: &dyn std::fmt::Display| EquilibriumError::Programme(error.to_string());
    let mut options = SolveOptions::default();
    options.tolerances.feasibility = 1e-9;
    let outcome = programme.solve_with(options).map_err(|e| fail(&e))?;
    let solution = outcome
        .into_solution()
        .map_err(|_| fail(&"it stopped without a solution"))?;
    Ok(solution.objective() > 0.5)
}

/// The slopes of the edges of a friction cone; one if the cone is a half line.
fn edges(friction: f64) -> impl Iterator<Item = f64> {
    let second = (friction > 0.0).then_some(-friction);
    [friction].into_iter().chain(second)
}

#[cfg(test)]
#[path = "equilibrium_tests.rs"]
mod tests;
