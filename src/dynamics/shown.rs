//! The poses that a step shows at its end: those with the joints closed.
//!
//! Joints are closed at midpoints. From there to the end of the step a body moves straight, while the joint
//! would lead its points along arcs. A pin is open there by `r (ω Δt)²/8`: an error of second order, like the
//! others of the scheme, but one that is seen. To close it in the state would give or take energy, see
//! [`super::joint_rules`]. It is closed in what the step shows alone. The next step goes on from the state.

use super::angular_momentum::restore_angular_momentum;
use super::asked::Asked;
use super::interval::{Interval, movable, side_velocities};
use super::islands::Islands;
use super::joint_recovery::{Closed, contacts_at_end, gap};
use super::model::{JointKind, JointRow, ModelError, MultibodyModel, Shown};
use super::solution::Solution;
use crate::contact::{
    ContactProblem, Delassus, LocalBodies, NO_BODY, Rows, Vec2, Vec3, solve_local,
};
use crate::solver::{Direct, ImpulseSolver};

/// Gap that counts as closed, over the longest arm of the joint.
const CLOSED: f64 = 1e-9;

/// Relative residual at which the displacements count as solved, what a contact may close further, over its
/// longer arm, and how much a motor may be off its speed, over the larger spin.
const ENOUGH: f64 = 1e-6;

/// Largest displacement of a body, as a multiple of the sum of the gaps. Only next to a singular
/// configuration would bodies move farther.
const FARTHEST: f64 = 10.0;

/// Most solves: each further one has the contacts that the one before would close.
const ROUNDS: usize = 4;

/// Finds what a step shows of bodies with joints. It stores nothing from step to step but memory, and the
/// order in which the solver eliminates rows.
#[derive(Default)]
pub(super) struct Shows {
    solver: Direct,
    joints: Vec<JointRow>,
    /// `s g` of (1) of [`Shows::find`].
    wanted: Vec<Vec2>,
    asked: Asked,
    islands: Islands,
    local: LocalBodies,
    problem: ContactProblem,
    impulses: Vec<Vec2>,
    /// `d` of every body.
    moved: Vec<Vec3>,
}

impl Shows {
    /// Displacements `d` from the poses at the end of the step of `interval` to those to be shown. They have
    /// minimum kinetic norm under
    ///
    /// ```text
    /// J d = −s g   of joints, and of limits with g < 0       s = min(1, n/|g|)
    /// J d = 0   of motors that run at their speed            n = |n(u_A, Δt/2)| + |n(u_E, Δt/2)|
    /// J d ≥ −max(g, 0)   of other limits, and of contacts                                       (1)
    /// ```
    ///
    /// with the bend `n` of the joint in half a step ([`Bend`](super::joint_frames::Bend)): a gap that
    /// turning does not explain stays open, and is seen. Bodies without joints stay where they are. So do
    /// those of an island in which (1) has no solution, for example between walls.
    ///
    /// Without contacts and motors, (1) projects the poses on those with closed joints, in the metric of the
    /// masses. This brings them no farther from any such poses, the true ones among them, up to terms of
    /// fourth order.
    ///
    /// Where nothing supports the bodies, velocities change by a rigid rotation, so that also what is shown
    /// keeps the angular momentum: see [`super::angular_momentum`].
    ///
    /// # Errors
    /// Those of the model.
    pub fn find<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        interval: &Interval,
        solution: &Solution,
        path: Option<&[Vec3]>,
        inverse_mass: &[Vec3],
    ) -> Result<Vec<Shown>, ModelError> {
        let (half, both) = (0.5 * interval.length, [&interval.start, &solution.end]);
        let bends = |joint: &JointRow| {
            let enough = CLOSED * joint.bend.reach();
            enough > 0.0 && bend(joint, both, half, enough) > enough
        };
        if !interval.detection.joints.iter().any(bends) {
            return Ok(Vec::new());
        }
        self.joints.clear();
        model.detect_joints(interval.length, &mut self.joints)?;
        let wanted = |joint: &JointRow| wanted(joint, both, half);
        self.wanted.clear();
        self.wanted.extend(self.joints.iter().map(wanted));
        let sum: f64 = self.wanted.iter().map(Vec2::norm).sum();
        if sum == 0.0 {
            return Ok(Vec::new());
        }
        self.ask(inverse_mass, &solution.end);
        let mut contacts = contacts_at_end(interval, solution, path, inverse_mass);
        let mut joined = vec![false; inverse_mass.len()];
        for body in self.asked.rows.iter().flat_map(|rows| rows.bodies) {
            if body != NO_BODY {
                joined[body as usize] = true;
            }
        }
        contacts.retain_mut(|(rows, left)| {
            let inside = |b: u32| {
                joined
                    .get(b as usize)
                    .map_or(NO_BODY, |own| if *own { b } else { NO_BODY })
            };
            rows.bodies = rows.bodies.map(inside);
            *left = left.max(0.0);
            rows.bodies != [NO_BODY; 2] && *left <= FARTHEST * sum
        });
        for _ in 0..ROUNDS {
            let free = self.solve(inverse_mass);
            if self.moved.iter().any(|d| d.xy().norm() > FARTHEST * sum) {
                break;
            }
            let before = contacts.len();
            contacts.retain(|(rows, left)| {
                let stays = left + rows.velocity(&self.moved).x >= -ENOUGH * arm(rows);
                if !stays {
                    self.asked.contact(*rows, *left, 0.0);
                }
                stays
            });
            if contacts.len() == before {
                return Ok(self.shown(model, free, inverse_mass, &solution.end));
            }
        }
        Ok(Vec::new())
    }

    /// The rows of the joints in (1).
    fn ask(&mut self, inverse_mass: &[Vec3], end: &[Vec3]) {
        let asked = &mut self.asked;
        asked.clear();
        for (joint, wanted) in self.joints.iter().zip(&self.wanted) {
            let bodies = movable(joint.rows.bodies, inverse_mass);
            match joint.kind {
                JointKind::Motor { speed, .. } => {
                    let spins = side_velocities(&joint.rows, end).map(|u| u.z.abs());
                    let most = spins.into_iter().fold(speed.abs(), f64::max);
                    if (joint.rows.velocity(end).x - speed).abs() <= ENOUGH * most {
                        asked.held(joint, bodies, inverse_mass);
                    }
                }
                JointKind::Limit { gap } if gap > 0.0 => {
                    asked.joint(joint, bodies, Vec2::new(gap, 0.0), inverse_mass);
                }
                _ => asked.joint(joint, bodies, *wanted, inverse_mass),
            }
        }
    }

    /// Solves (1) on every island. Returns whether one that moves has no support.
    fn solve(&mut self, inverse_mass: &[Vec3]) -> bool {
        let Asked { rows, free, laws } = &self.asked;
        self.moved.clear();
        self.moved.resize(inverse_mass.len(), Vec3::zeros());
        let sides = rows.iter().map(|rows| rows.bodies);
        self.islands.build(inverse_mass.len(), sides);
        let (mut floats, problem) = (false, &mut self.problem);
        for k in 0..self.islands.len() {
            let members = self.islands.blocks(k);
            let of = |i: &u32| *i as usize;
            let asks = |i: &u32| match laws[of(i)].is_bilateral() {
                true => free[of(i)] != Vec2::zeros(),
                false => free[of(i)].x < 0.0,
            };
            if !members.iter().any(asks) {
                continue;
            }
            if let Delassus::Bodies(op) = &mut problem.operator {
                self.local.operator(members, |i| rows[i], inverse_mass, op);
            }
            problem.free.clear();
            problem.free.extend(members.iter().map(|i| free[of(i)]));
            problem.laws.clear();
            problem.laws.extend(members.iter().map(|i| laws[of(i)]));
            let push = &mut self.impulses;
            push.clear();
            push.resize(members.len(), Vec2::zeros());
            match members.len() {
                1 => {
                    push[0] = solve_local(
                        &problem.operator.diagonal(0),
                        problem.free[0],
                        &problem.laws[0],
                    )
                }
                _ if self.solver.solve(problem, push, ENOUGH).solved() => {}
                _ => continue,
            }
            for (i, p) in members.iter().zip(push) {
                rows[of(i)].push(*p, inverse_mass, &mut self.moved);
            }
            floats |= !members
                .iter()
                .any(|i| rows[of(i)].bodies.contains(&NO_BODY));
        }
        floats
    }

    /// What is shown, with the velocities of islands that `float` without support.
    fn shown<M: MultibodyModel + ?Sized>(
        &self,
        model: &mut M,
        float: bool,
        inverse_mass: &[Vec3],
        end: &[Vec3],
    ) -> Vec<Shown> {
        let some = |(_, d): &(u32, Vec3)| *d != Vec3::zeros();
        let found = || (0..).zip(self.moved.iter().copied()).filter(some);
        let mut shown: Vec<Shown> = found()
            .map(|(body, displacement)| Shown {
                body,
                displacement,
                velocity: Vec3::zeros(),
            })
            .collect();
        if float {
            let state: Vec<_> = found()
                .map(|(body, _)| model.configuration(body as usize))
                .collect();
            found().for_each(|(body, d)| model.shift(body as usize, &d, 1.0));
            let closed = Closed {
                moved: self.moved.iter().map(|d| d.xy()).collect(),
                sides: self.asked.rows.iter().map(|r| r.bodies).collect(),
            };
            let mut velocities = end.to_vec();
            restore_angular_momentum(model, &closed, inverse_mass, &mut velocities);
            for (own, place) in shown.iter_mut().zip(&state) {
                let body = own.body as usize;
                model.set_configuration(body, place);
                own.velocity = velocities[body] - end[body];
            }
        }
        shown
    }
}

/// `s g` of (1).
fn wanted(joint: &JointRow, velocities: [&Vec<Vec3>; 2], half: f64) -> Vec2 {
    let gap = match joint.kind {
        JointKind::Limit { gap } => Vec2::new(gap.min(0.0), 0.0),
        _ => gap(joint),
    };
    let size = gap.norm();
    if size <= CLOSED * joint.bend.reach() {
        return Vec2::zeros();
    }
    gap * (bend(joint, velocities, half, f64::NEG_INFINITY) / size).min(1.0)
}

/// `n` of (1), or a bound of it that is at most `enough`.
fn bend(joint: &JointRow, velocities: [&Vec<Vec3>; 2], half: f64, enough: f64) -> f64 {
    let sides = velocities.map(|u| side_velocities(&joint.rows, u));
    let most: f64 = sides.iter().map(|u| joint.bend.most(*u, half)).sum();
    match most <= enough {
        true => most,
        false => sides
            .iter()
            .map(|u| joint.bend.after(*u, half).norm())
            .sum(),
    }
}

/// The longer arm of a contact \[m\].
fn arm(rows: &Rows) -> f64 {
    let of = |[n, t]: &[Vec3; 2]| n.z.hypot(t.z);
    rows.jacobian.iter().map(of).fold(0.0, f64::max)
}
