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
use super::joint_rules::UNILATERAL;
use super::model::{JointKind, JointRow, ModelError, MultibodyModel, Shown};
use super::solution::Solution;
use crate::contact::{
    ContactProblem, Delassus, LocalBodies, NO_BODY, Rows, Vec2, Vec3, solve_local,
};
use crate::solver::{Direct, ImpulseSolver};

/// Gap that counts as closed, over the longest arm of the joint.
const CLOSED: f64 = 1e-9;

/// Relative residual at which the displacements count as solved, what a contact may close further, over its
/// longer arm, and how much a motor may be off its speed, over the speeds at stake.
const ENOUGH: f64 = 1e-6;

/// Largest displacement of a body, as a multiple of the sum of its island's gaps. Only next to a singular
/// configuration would bodies move farther.
const FARTHEST: f64 = 10.0;

/// Most solves of an island: each further one has the contacts that the one before would close.
const ROUNDS: usize = 4;

/// Finds what a step shows of bodies with joints. It stores nothing from step to step but memory, and the
/// order in which the solver eliminates rows.
#[derive(Default)]
pub(super) struct Shows {
    solver: Direct,
    joints: Vec<JointRow>,
    asked: Asked,
    islands: Islands,
    local: LocalBodies,
    problem: ContactProblem,
    impulses: Vec<Vec2>,
    /// `d` of every body.
    moved: Vec<Vec3>,
}

/// A row that an island may not close by more than is `left` \[m\]: a contact, or a limit that is open.
#[derive(Clone, Copy)]
struct Guard {
    island: usize,
    rows: Rows,
    left: f64,
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
    /// bodies that joints connect if (1) has no solution for them, for example between walls; all others are
    /// immovable for them.
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
    pub fn find(
        &mut self,
        model: &mut dyn MultibodyModel,
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
        let mut guards = self.ask(both, half, inverse_mass);
        if self.asked.free.iter().all(|g| *g == Vec2::zeros()) {
            return Ok(Vec::new());
        }
        guards.extend(contacts_at_end(interval, solution, path, inverse_mass));
        let guards = self.guards(&guards, inverse_mass.len());
        self.moved.clear();
        self.moved.resize(inverse_mass.len(), Vec3::zeros());
        let mut floating = Vec::new();
        for k in 0..self.islands.len() {
            let range = guards.partition_point(|g| g.island < k)..;
            let own = guards[range].iter().take_while(|g| g.island == k);
            self.solve(k, own.copied().collect(), inverse_mass, &mut floating);
        }
        Ok(self.shown(model, floating, inverse_mass, &solution.end))
    }

    /// Sets up the rows of joints in (1), and their islands. Returns the limits that are open, with how far.
    fn ask(
        &mut self,
        velocities: [&Vec<Vec3>; 2],
        half: f64,
        inverse_mass: &[Vec3],
    ) -> Vec<(Rows, f64)> {
        let (asked, mut limits) = (&mut self.asked, Vec::new());
        asked.clear();
        for joint in &self.joints {
            let bodies = movable(joint.rows.bodies, inverse_mass);
            match joint.kind {
                JointKind::Motor { speed, .. } if runs_at(speed, joint, velocities[1]) => {
                    asked.held(joint, bodies, inverse_mass);
                }
                JointKind::Motor { .. } | JointKind::Spring(_) => {}
                JointKind::Limit { gap } if gap > 0.0 => {
                    let rows = joint.rows;
                    limits.push((Rows { bodies, ..rows }, gap));
                }
                _ => {
                    let wanted = wanted(joint, velocities, half);
                    asked.joint(joint, bodies, wanted, inverse_mass);
                }
            }
        }
        let sides = asked.rows.iter().map(|rows| rows.bodies);
        self.islands.build(inverse_mass.len(), sides);
        limits
    }

    /// Contacts and limits by the islands of joints that can close them, one for each side.
    fn guards(&self, all: &[(Rows, f64)], bodies: usize) -> Vec<Guard> {
        let mut island = vec![usize::MAX; bodies];
        for k in 0..self.islands.len() {
            let rows = (self.islands.blocks(k).iter()).map(|i| &self.asked.rows[*i as usize]);
            for body in rows.flat_map(|rows| rows.bodies) {
                if let Some(own) = island.get_mut(body as usize) {
                    *own = k;
                }
            }
        }
        let of = |body: u32| {
            island
                .get(body as usize)
                .copied()
                .filter(|k| *k != usize::MAX)
        };
        let mut guards = Vec::new();
        for (rows, left) in all {
            let own = rows.bodies.map(of);
            for side in 0..2 {
                let Some(k) = own[side].filter(|_| side == 0 || own[0] != own[1]) else {
                    continue;
                };
                let inside = |other: usize| match own[other] == Some(k) {
                    true => rows.bodies[other],
                    false => NO_BODY,
                };
                let bodies = [inside(0), inside(1)];
                guards.push(Guard {
                    island: k,
                    rows: Rows { bodies, ..*rows },
                    left: left.max(0.0),
                });
            }
        }
        guards.sort_by_key(|g| g.island);
        guards
    }

    /// Solves (1) on island `k`. Adds the sides of its rows to `floating` if it moves and has no support.
    fn solve(
        &mut self,
        k: usize,
        mut guards: Vec<Guard>,
        inverse_mass: &[Vec3],
        floating: &mut Vec<[u32; 2]>,
    ) {
        let Asked { rows, free, laws } = &self.asked;
        let members = self.islands.blocks(k);
        let own = || members.iter().map(|i| *i as usize);
        let sum: f64 = own().map(|i| free[i].norm()).sum();
        if sum == 0.0 {
            return;
        }
        let mut all: Vec<Rows> = own().map(|i| rows[i]).collect();
        let (problem, push) = (&mut self.problem, &mut self.impulses);
        problem.free.clear();
        problem.free.extend(own().map(|i| free[i]));
        problem.laws.clear();
        problem.laws.extend(own().map(|i| laws[i]));
        for _ in 0..ROUNDS {
            let Delassus::Bodies(op) = &mut problem.operator else {
                return;
            };
            let blocks: Vec<u32> = (0..all.len() as u32).collect();
            self.local.operator(&blocks, |i| all[i], inverse_mass, op);
            push.clear();
            push.resize(all.len(), Vec2::zeros());
            let solved = match all.len() {
                1 => {
                    let block = problem.operator.diagonal(0);
                    push[0] = solve_local(&block, problem.free[0], &problem.laws[0]);
                    true
                }
                _ => self.solver.solve(problem, push, ENOUGH).solved(),
            };
            for body in &self.local.bodies {
                self.moved[*body as usize] = Vec3::zeros();
            }
            for (rows, p) in all.iter().zip(push.iter()) {
                rows.push(*p, inverse_mass, &mut self.moved);
            }
            let moved = &self.moved;
            let way = |body: &u32| moved[*body as usize].xy().norm();
            if !solved
                || self
                    .local
                    .bodies
                    .iter()
                    .any(|body| way(body) > FARTHEST * sum)
            {
                break;
            }
            let before = guards.len();
            guards.retain(|guard| {
                let stays = guard.left + guard.rows.velocity(moved).x >= -ENOUGH * arm(&guard.rows);
                if !stays {
                    all.push(guard.rows);
                    problem.free.push(Vec2::new(guard.left, 0.0));
                    problem.laws.push(UNILATERAL);
                }
                stays
            });
            if guards.len() == before {
                if !all.iter().any(|rows| rows.bodies.contains(&NO_BODY)) {
                    floating.extend(all.iter().map(|rows| rows.bodies));
                }
                return;
            }
        }
        for body in &self.local.bodies {
            self.moved[*body as usize] = Vec3::zeros();
        }
    }

    /// What is shown, with the velocities of islands that float: `floating` has the sides of their rows.
    fn shown(
        &self,
        model: &mut dyn MultibodyModel,
        floating: Vec<[u32; 2]>,
        inverse_mass: &[Vec3],
        end: &[Vec3],
    ) -> Vec<Shown> {
        let moved = (0..).zip(self.moved.iter().copied());
        let moved = || moved.clone().filter(|(_, d)| *d != Vec3::zeros());
        let of = |(body, displacement)| Shown {
            body,
            displacement,
            velocity: Vec3::zeros(),
        };
        if floating.is_empty() {
            return moved().map(of).collect();
        }
        let state: Vec<_> = moved()
            .map(|(body, _)| model.configuration(body as usize))
            .collect();
        moved().for_each(|(body, d)| model.shift(body as usize, &d, 1.0));
        let closed = Closed {
            moved: self.moved.iter().map(|d| d.xy()).collect(),
            sides: floating,
        };
        let mut velocities = end.to_vec();
        restore_angular_momentum(model, &closed, inverse_mass, &mut velocities);
        for ((body, _), place) in moved().zip(&state) {
            model.set_configuration(body as usize, place);
        }
        let all = (0..).zip(&self.moved).zip(velocities.iter().zip(end));
        let all = all.map(|((body, d), (u, before))| Shown {
            velocity: u - before,
            ..of((body, *d))
        });
        all.filter(|own| own.displacement != Vec3::zeros() || own.velocity != Vec3::zeros())
            .collect()
    }
}

/// Whether a motor has its speed at the end of the step.
fn runs_at(speed: f64, joint: &JointRow, end: &[Vec3]) -> bool {
    let sides = side_velocities(&joint.rows, end);
    let shares = [0, 1].map(|side| joint.rows.jacobian[side][0].dot(&sides[side]).abs());
    let scale = speed.abs() + shares[0] + shares[1];
    (joint.rows.velocity(end).x - speed).abs() <= ENOUGH * scale
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
