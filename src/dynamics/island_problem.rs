//! The contact problem of one island of an interval, and data of its blocks.

use super::contact_cache::JointEnergy;
use super::interval::{Interval, Source};
use super::kinetic::kinetic_of;
use super::solution::Solution;
use crate::contact::{BodyOperator, ContactProblem, Delassus, Law, LocalBodies, Vec2, Vec3};

/// Islands with more blocks, some of them rigid contacts, become crowds where the solver leaves much, see
/// [`super::crowd`].
pub(super) const LARGE: usize = 500;

/// Data of a block of the island.
#[derive(Debug, Clone, Copy)]
pub(super) struct Terms {
    /// Relative velocity at the start of the step, and without impulses \[m/s\].
    pub gamma_a: Vec2,
    pub gamma_f: Vec2,
    /// The original `b` \[m/s\].
    pub bias: Vec2,
    /// A rigid unilateral contact. All other blocks may store or feed energy: no bound applies to
    /// them.
    pub rigid: bool,
    /// A pin or locked axis.
    pub bilateral: bool,
    /// A rebounding impact.
    pub impact: bool,
    /// Whether it had an impulse in the step before.
    pub pressed_before: bool,
}

/// A pin or locked axis of the island.
#[derive(Debug, Clone, Copy)]
pub(super) struct BilateralJoint {
    pub block: usize,
    /// Its number in the detection.
    pub joint: usize,
    /// Energy it added in earlier steps.
    pub energy: JointEnergy,
}

/// The problem of an island. `problem` is the solver's input; later stages may change its `b`.
#[derive(Default)]
pub(super) struct IslandProblem {
    pub problem: ContactProblem,
    pub terms: Vec<Terms>,
    /// Velocity that the rules add to `γ_F` in `problem`: `b − γ_F` \[m/s\].
    pub added: Vec<Vec2>,
    /// Start impulses.
    pub warm: Vec<Vec2>,
    pub bilateral: Vec<BilateralJoint>,
    /// Energy \[J\] that its constraints may give, see [`super::reserve`].
    pub reserve: f64,
    /// Kinetic energy \[J\] of the bodies at the start, and that of the velocities that forces alone
    /// would give them.
    pub kinetic: f64,
    pub forced: f64,
    pub local: LocalBodies,
}

impl IslandProblem {
    /// Sets up the problem of the island of these blocks. `solution` has the results of islands of
    /// higher dominance and of earlier rounds.
    pub fn set_up(
        &mut self,
        interval: &Interval,
        solution: &Solution,
        members: &[u32],
        inverse_mass: &[Vec3],
    ) {
        let ContactProblem {
            operator,
            free,
            laws,
        } = &mut self.problem;
        let mut op = match std::mem::take(operator) {
            Delassus::Bodies(op) => op,
            Delassus::Blocks(_) => BodyOperator::default(),
        };
        (self.local).operator(members, |i| interval.rows(i), inverse_mass, &mut op);
        *operator = Delassus::Bodies(op);
        free.clear();
        free.extend(members.iter().map(|&i| solution.bias[i as usize]));
        laws.clear();
        laws.extend(members.iter().map(|&i| interval.laws[i as usize]));
        self.warm.clear();
        (self.warm).extend(members.iter().map(|&i| solution.impulses[i as usize]));
        self.terms.clear();
        self.terms.extend(members.iter().map(|&i| {
            let i = i as usize;
            let block = &interval.blocks[i];
            Terms {
                gamma_a: block.gamma_a,
                gamma_f: solution.gamma_f(interval, i),
                bias: solution.bias[i],
                rigid: is_rigid(&interval.laws[i]),
                bilateral: block.bilateral,
                impact: block.impact,
                pressed_before: block.pressed_before,
            }
        }));
        self.bilateral.clear();
        if !interval.detection.joints.is_empty() {
            self.pose_bilateral(interval, members);
        }
        (self.kinetic, self.forced, self.reserve) = (0.0, 0.0, 0.0);
        for &body in &self.local.bodies {
            let (body, dt) = (body as usize, interval.length);
            let of = |u: &Vec3| kinetic_of(u, &inverse_mass[body]);
            self.kinetic += of(&interval.start[body]);
            self.forced += of(&(interval.accelerations[body] * dt));
            self.reserve += interval.reserves.get(body).unwrap_or(&0.0);
        }
    }

    fn pose_bilateral(&mut self, interval: &Interval, members: &[u32]) {
        for (block, &i) in members.iter().enumerate() {
            let own = &interval.blocks[i as usize];
            if let (Source::Joint(joint), true) = (own.source, own.bilateral) {
                self.bilateral.push(BilateralJoint {
                    block,
                    joint,
                    energy: interval.energies[joint],
                });
            }
        }
    }

    /// Computes `added` for the present `b`.
    pub fn count_added(&mut self) {
        self.added.clear();
        let blocks = self.problem.free.iter().zip(&self.terms);
        self.added
            .extend(blocks.map(|(b, terms)| b - terms.gamma_f));
    }

    /// Drops the push-outs of the rules. They can contradict each other, so that no motion
    /// satisfies all of them: for example if a block overlaps walls on both sides.
    pub fn drop_pushes(&mut self) {
        let blocks = self.problem.free.iter_mut().zip(&mut self.added);
        for ((b, added), _) in blocks.zip(&self.terms).filter(|(_, terms)| terms.rigid) {
            let push = Vec2::new(added.x.min(0.0), added.y);
            *b -= push;
            *added -= push;
        }
    }

    /// Whether the rules may have added velocities that no motion of the bodies satisfies.
    /// `velocity` \[m/s\] is the velocity residual of the best impulses.
    pub fn contradicts(&self, velocity: f64) -> bool {
        let rigid = self.added.iter().zip(&self.terms).filter(|(_, t)| t.rigid);
        let pushes = rigid.map(|(added, _)| added.y.abs().max(-added.x));
        let largest = pushes.fold(0.0, f64::max);
        let small = self.terms.len() <= SMALL;
        largest > 0.0 && (small || velocity > CONTRADICTION * largest)
    }

    /// Whether the island has a rigid contact.
    pub fn has_rigid(&self) -> bool {
        self.terms.iter().any(|t| t.rigid)
    }

    /// Whether the island has a rebounding impact.
    pub fn impact(&self) -> bool {
        self.terms.iter().any(|t| t.impact)
    }
}

/// Gives rigid contacts their original `b`.
pub(super) fn restore_pushes(free: &mut [Vec2], terms: &[Terms]) {
    for (b, terms) in free.iter_mut().zip(terms).filter(|(_, t)| t.rigid) {
        *b = terms.bias;
    }
}

/// Least velocity residual of contradictory pushes, as a share of the largest push. A much smaller
/// residual is a difficulty of the solver, which another problem of the same size does not solve.
const CONTRADICTION: f64 = 1e-3;
/// Up to this number of blocks the problem without pushes costs little: it is always tried.
const SMALL: usize = 130;

/// Whether a law is a rigid unilateral contact.
pub(super) fn is_rigid(law: &Law) -> bool {
    matches!(law, Law::Contact { compliance, .. } if *compliance == 0.0)
}
