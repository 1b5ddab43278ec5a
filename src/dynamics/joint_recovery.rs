//! Closes gaps of joints and passed limits by position, where velocities would add energy.

use super::interval::{Interval, diagonal, movable};
use super::joint_rules::joint_impact_rule;
use super::model::{JointKind, JointRow, ModelError, MultibodyModel, NormalLaw};
use super::recovery::displacements;
use super::solution::Solution;
use super::solve::IslandSolver;
use crate::contact::{Law, NO_BODY, Rows, Vec2, Vec3};

/// Most Newton steps; from a gap of half an arm three or four reach round-off.
const STEPS: usize = 8;

/// Gap \[m\] that counts as closed.
const CLOSED: f64 = 1e-12;

/// Largest turn of a body in one Newton step \[rad\].
const TURN: f64 = 0.5;

/// What [`close_joints`] did.
pub(super) struct Closed {
    /// Displacement of the centre of mass of each body \[m\].
    pub moved: Vec<Vec2>,
    /// The movable bodies of each row.
    pub sides: Vec<[u32; 2]>,
}

/// Closes the joint gaps that a step left open, at its end, by Newton's method. The displacements
/// `d` have minimum kinetic norm under
///
/// ```text
/// J d = −g   of these joints      J d = 0   of all others
/// J d ≥ −g   of these limits      J d ≥ −max(g, 0)   of contacts and other limits   (1)
/// ```
///
/// Velocities stay as they are, which changes the angular momentum: see
/// [`super::angular_momentum`]. Returns the displacement of every body, and the rows that coupled
/// them.
///
/// # Errors
/// Those of the model.
pub(super) fn close_joints<M: MultibodyModel + ?Sized>(
    model: &mut M,
    interval: &Interval,
    solution: &Solution,
    inverse_mass: &[Vec3],
    solver: &mut IslandSolver,
) -> Result<Closed, ModelError> {
    let mut contacts = contacts_at_end(interval, solution, inverse_mass);
    let mut found = Vec::new();
    let mut closed = Closed {
        moved: vec![Vec2::zeros(); inverse_mass.len()],
        sides: Vec::new(),
    };
    for _ in 0..STEPS {
        found.clear();
        model.detect_joints(interval.length, &mut found)?;
        let open = |k: usize| solution.unclosed.binary_search(&k).is_ok();
        let joints = found.iter().enumerate();
        let worst = joints
            .filter(|(k, _)| open(*k))
            .map(|(_, joint)| match joint.kind {
                JointKind::Limit { gap } => (-gap).max(0.0),
                _ => gap(joint).norm(),
            })
            .fold(0.0, f64::max);
        if worst <= CLOSED {
            break;
        }
        let (mut rows, mut free, mut laws) = (Vec::new(), Vec::new(), Vec::new());
        for (own, left) in &contacts {
            rows.push(*own);
            free.push(Vec2::new(left.max(0.0), 0.0));
            laws.push(Law::Contact {
                friction: 0.0,
                compliance: 0.0,
            });
        }
        for (k, joint) in found.iter().enumerate() {
            let own = Rows {
                bodies: movable(joint.rows.bodies, inverse_mass),
                ..joint.rows
            };
            let Some((_, law)) = joint_impact_rule(joint, true) else {
                continue;
            };
            if own.bodies == [NO_BODY; 2] || diagonal(joint, inverse_mass) <= 0.0 {
                continue;
            }
            rows.push(own);
            free.push(match joint.kind {
                JointKind::Limit { gap } if open(k) => Vec2::new(gap, 0.0),
                JointKind::Limit { gap } => Vec2::new(gap.max(0.0), 0.0),
                _ if open(k) => gap(joint),
                _ => Vec2::zeros(),
            });
            laws.push(law);
        }
        closed.sides.clear();
        closed.sides.extend(rows.iter().map(|r| r.bodies));
        let (tolerance, far) = (solver.tolerance, f64::INFINITY);
        let way = (far, &mut false);
        let moves = displacements(&rows, &free, &laws, inverse_mass, solver, tolerance, way);
        let turn = moves.iter().map(|(_, d)| d.z.abs()).fold(0.0, f64::max);
        let share = (TURN / turn).min(1.0);
        let mut all = vec![Vec3::zeros(); inverse_mass.len()];
        for &(body, d) in &moves {
            model.shift(body as usize, &(d * share), 1.0);
            all[body as usize] = d * share;
            closed.moved[body as usize] += d.xy() * share;
        }
        for (own, left) in &mut contacts {
            *left += own.velocity(&all).x;
        }
        if moves.is_empty() {
            break;
        }
    }
    Ok(closed)
}

/// Rows of rigid contacts, and their gaps \[m\] at the end of the interval.
fn contacts_at_end(
    interval: &Interval,
    solution: &Solution,
    inverse_mass: &[Vec3],
) -> Vec<(Rows, f64)> {
    let half = 0.5 * interval.length;
    let contacts = interval.detection.contacts.iter();
    let rigid = contacts.filter(|c| matches!(c.law, NormalLaw::Rigid { .. }));
    let of = rigid.map(|c| {
        let own = Rows {
            bodies: movable(c.rows.bodies, inverse_mass),
            ..c.rows
        };
        (own, c.gap + half * c.rows.velocity(&solution.end).x)
    });
    of.filter(|(rows, _)| rows.bodies != [NO_BODY; 2]).collect()
}

/// The gap of a pin or locked axis.
fn gap(joint: &JointRow) -> Vec2 {
    match joint.kind {
        JointKind::Pin { gap } => gap,
        JointKind::Lock { gap } => Vec2::new(gap, 0.0),
        _ => Vec2::zeros(),
    }
}
