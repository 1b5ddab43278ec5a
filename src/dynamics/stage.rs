//! One interval of time, or one instant, for some of the bodies: the blocks of rows that take
//! part, their rules, and the contact problem of an island.

use super::contact_cache::{CachedContacts, JointEnergy};
use super::joint_rules::{JointSituation, joint_impact_rule, joint_rule};
use super::local_bodies::LocalBodies;
use super::model::{
    ContactKey, ContactPoint, Detection, JointKind, JointRow, ModelError, MultibodyModel, NormalLaw,
};
use super::rules::{
    Choice, Rule, Rules, Situation, applied_acceleration, centripetal, impact_rule, rule,
};
use super::standing::Standing;
use crate::contact::{BodyOperator, ContactProblem, Delassus, Law, NO_BODY, Rows, Vec2, Vec3};
use std::collections::BTreeSet;

/// Lengths of time that rules need \[s\].
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    /// Of the whole step: what thresholds are made of.
    pub step: f64,
    /// Of this interval; 0 for an instant.
    pub length: f64,
    /// From this midpoint to the next one: over it gaps are closed.
    pub horizon: f64,
}

impl Span {
    /// A step that is not divided.
    pub fn whole(dt: f64) -> Span {
        Span {
            step: dt,
            length: dt,
            horizon: dt,
        }
    }
}

/// One block of rows that takes part.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub source: Source,
    /// Of all sides, those that move on their own included.
    pub bodies: [u32; 2],
    pub gamma_a: Vec2,
    /// `γ_F`, with what the step gave to a body above.
    pub gamma_f: Vec2,
    pub impact: bool,
    /// A pin or locked axis.
    pub held: bool,
    /// Of a contact under a given load: friction alone is solved, in the place of the normal row.
    pub loaded: bool,
    /// Carried an impulse, and stuck, in the interval before.
    pub carried_before: bool,
    pub stuck_before: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Source {
    Contact(usize),
    Joint(usize),
}

/// The velocities at both ends of an interval, and what happens in between.
#[derive(Default)]
pub(super) struct Stage {
    pub length: f64,
    /// Whether it is a whole step of all bodies.
    pub whole: bool,
    pub standing: Standing,
    pub start: Vec<Vec3>,
    pub forces: Vec<Vec3>,
    pub accelerations: Vec<Vec3>,
    pub free: Vec<Vec3>,
    pub end: Vec<Vec3>,
    pub detection: Detection,
    pub blocks: Vec<Block>,
    /// Of each block: the bodies that take impulses, `b` \[m/s\], law, impulse.
    pub sides: Vec<[u32; 2]>,
    pub asked: Vec<Vec2>,
    pub laws: Vec<Law>,
    pub impulses: Vec<Vec2>,
    /// Whether what its impulse gives to bodies is in `given` \[m/s, rad/s\], one a body.
    pub told: Vec<bool>,
    pub given: Vec<Vec3>,
    /// Of each joint of the detection: its share of what its island's joints have put in.
    pub accounts: Vec<JointEnergy>,
    /// Those of the last step \[N s\], where an island gave way in it.
    pub before: Vec<Vec2>,
    /// Velocity that the solve of a block's island resolves \[m/s\].
    pub resolution: Vec<f64>,
    /// Pairs of surfaces of the rigid contacts met, movable ones, in their order.
    pub pairs: Vec<u64>,
    /// Contacts of the detection left out until they are located in time.
    pub waiting: Vec<usize>,
    /// Joints of the detection whose gaps were closed by less than asked, and limits that are passed
    /// farther than their bend explains; ascending once solved.
    pub loose: Vec<usize>,
    /// Pairs whose penetration is no fault of the step: they started overlapped.
    pub excused: BTreeSet<u64>,
    /// Of each body, whether it is in a crowd: see [`super::events::find_crowds`].
    pub crowded: Vec<bool>,
}

impl Stage {
    /// Finds all contacts at the present configuration that may close within `dt` \[s\].
    ///
    /// # Errors
    /// Those of the model.
    pub fn detect<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        dt: f64,
    ) -> Result<(), ModelError> {
        self.detection.clear();
        model.detect(dt, &mut self.detection)
    }

    /// Finds the contacts of some pairs of surfaces only, and all joints.
    ///
    /// # Errors
    /// Those of the model.
    pub fn detect_pairs<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &mut M,
        pairs: &[[u32; 2]],
        dt: f64,
    ) -> Result<(), ModelError> {
        self.detection.clear();
        model.detect_pairs(pairs, dt, &mut self.detection)?;
        model.detect_joints(dt, &mut self.detection.joints)
    }

    /// `u_F = u_A + M⁻¹ (h Δt + W_N P_N)` with the normal impulses that are given.
    pub fn free_velocities<M: MultibodyModel + ?Sized>(
        &mut self,
        model: &M,
        time: f64,
        length: f64,
    ) {
        let inverse_mass = model.inverse_mass();
        self.length = length;
        self.forces.clear();
        self.forces.resize(self.start.len(), Vec3::zeros());
        model.forces(time, &mut self.forces);
        self.accelerations.clear();
        self.accelerations.extend(
            self.forces
                .iter()
                .zip(inverse_mass)
                .map(|(f, w)| f.component_mul(w)),
        );
        self.free.clear();
        self.free.extend(
            self.start
                .iter()
                .zip(&self.accelerations)
                .map(|(u, a)| u + a * length),
        );
        for contact in &self.detection.contacts {
            if let NormalLaw::Load { force } = contact.law {
                let impulse = Vec2::new(force * length, 0.0);
                contact.rows.push(impulse, inverse_mass, &mut self.free);
            }
        }
    }

    /// Chooses the rule of every contact and joint among `members` (all bodies if `None`).
    pub fn collect(
        &mut self,
        rules: &Rules,
        memory: &CachedContacts,
        members: Option<&[bool]>,
        inverse_mass: &[Vec3],
        span: Span,
    ) {
        self.clear_blocks();
        let contacts = std::mem::take(&mut self.detection.contacts);
        for (index, contact) in contacts.iter().enumerate() {
            let movable = movable(contact.rows.bodies, inverse_mass);
            let rigid = matches!(contact.law, NormalLaw::Rigid { .. });
            if rigid && movable != [NO_BODY; 2] && self.pairs.last() != Some(&contact.key.pair) {
                self.pairs.push(contact.key.pair);
            }
            let Some(sides) = self.receiving(contact, movable, members) else {
                continue;
            };
            let surface = Vec2::new(0.0, contact.surface_velocity);
            let gamma_a = contact.rows.velocity(&self.start) + surface;
            let swept = rules.sweeps
                && self
                    .standing
                    .swept(contact, gamma_a, span.step, inverse_mass);
            let known = memory.get(&contact.key);
            let located = rules.events || swept;
            // what neither rebounds nor waits is told from nothing by how fast it is
            let bounces =
                matches!(contact.law, NormalLaw::Rigid { restitution } if restitution > 0.0);
            let (mut applied, mut acceleration) = (0.0, 0.0);
            if located || bounces {
                applied = applied_acceleration(contact, &self.accelerations);
                acceleration = centripetal(contact, &self.start).max(applied);
            }
            let now = Situation {
                span,
                gamma_a,
                gamma_f: contact.rows.velocity(&self.free) + surface,
                acceleration,
                applied,
                carried: known.is_some_and(|m| m.impulse.x > 0.0),
                stuck: known.and_then(|m| m.stuck),
                rebounded: known.is_some_and(|m| m.rebounded),
                located,
                crowded: !swept
                    && contact
                        .rows
                        .bodies
                        .iter()
                        .any(|b| self.crowded.get(*b as usize).is_some_and(|c| *c)),
            };
            let Rule { free, law, impact } = match rule(rules, contact, &now) {
                Choice::Out => continue,
                Choice::Wait => {
                    self.waiting.push(index);
                    continue;
                }
                Choice::In(rule) => rule,
            };
            let mut warm = known.map_or(Vec2::zeros(), |m| m.impulse * (span.length / m.dt));
            let (mut gamma_f, mut gamma_a) = (now.gamma_f, now.gamma_a);
            let loaded = matches!(contact.law, NormalLaw::Load { .. });
            if loaded {
                (warm, gamma_f, gamma_a) = (
                    Vec2::new(warm.y, 0.0),
                    Vec2::new(gamma_f.y, 0.0),
                    Vec2::new(gamma_a.y, 0.0),
                );
            }
            let block = Block {
                source: Source::Contact(index),
                bodies: contact.rows.bodies,
                gamma_a,
                gamma_f,
                impact,
                held: false,
                loaded,
                carried_before: now.carried,
                stuck_before: now.stuck.is_some(),
            };
            self.push(block, sides, gamma_f + free, law, warm);
        }
        self.detection.contacts = contacts;
        self.collect_joints(rules, memory, members, inverse_mass, span);
    }

    /// The blocks of an instant: joints, and the contacts to which `restitution` gives a
    /// coefficient; no forces. A limit takes part if it touches or `carried` an impulse.
    pub fn collect_impact(
        &mut self,
        rules: &Rules,
        members: &[bool],
        inverse_mass: &[Vec3],
        restitution: impl Fn(usize) -> Option<f64>,
        carried: impl Fn(&ContactKey) -> bool,
    ) {
        self.length = 0.0;
        self.free.clone_from(&self.start);
        self.clear_blocks();
        let found = std::mem::take(&mut self.detection);
        for (index, contact) in found.contacts.iter().enumerate() {
            let (NormalLaw::Rigid { .. }, Some(in_force)) = (contact.law, restitution(index))
            else {
                continue;
            };
            let movable = movable(contact.rows.bodies, inverse_mass);
            let Some(sides) = self.receiving(contact, movable, Some(members)) else {
                continue;
            };
            let surface = Vec2::new(0.0, contact.surface_velocity);
            let gamma = contact.rows.velocity(&self.start) + surface;
            let Rule { free, law, impact } = impact_rule(rules, contact, gamma, in_force);
            let block = Block {
                source: Source::Contact(index),
                bodies: contact.rows.bodies,
                gamma_a: gamma,
                gamma_f: gamma,
                impact,
                held: false,
                loaded: false,
                carried_before: false,
                stuck_before: false,
            };
            self.push(block, sides, gamma + free, law, Vec2::zeros());
        }
        self.open_accounts(found.joints.len());
        for (index, joint) in found.joints.iter().enumerate() {
            if !belongs(joint.rows.bodies, Some(members), inverse_mass)
                || diagonal(joint, inverse_mass) <= 0.0
            {
                continue;
            }
            if let Some((free, law)) = joint_impact_rule(joint, carried(&joint.key)) {
                let gamma = joint.rows.velocity(&self.start);
                let block = joint_block(index, joint, [gamma; 2]);
                let sides = movable(joint.rows.bodies, inverse_mass);
                self.push(block, sides, gamma + free, law, Vec2::zeros());
            }
        }
        self.detection = found;
    }

    fn collect_joints(
        &mut self,
        rules: &Rules,
        memory: &CachedContacts,
        members: Option<&[bool]>,
        inverse_mass: &[Vec3],
        span: Span,
    ) {
        let joints = std::mem::take(&mut self.detection.joints);
        self.open_accounts(joints.len());
        for (index, joint) in joints.iter().enumerate() {
            let diagonal = diagonal(joint, inverse_mass);
            // a row that nothing can move is none
            if !belongs(joint.rows.bodies, members, inverse_mass) || diagonal <= 0.0 {
                continue;
            }
            let sides = side_velocities(&joint.rows, &self.start);
            let now = JointSituation {
                span,
                gamma_a: joint.rows.velocity(&self.start),
                gamma_f: joint.rows.velocity(&self.free),
                bend: joint.bend.after(sides, span.horizon),
                diagonal,
            };
            let Some((free, law)) = joint_rule(rules, joint, &now) else {
                continue;
            };
            if let JointKind::Limit { gap } = joint.kind
                && rules.corrects_gaps()
                && gap < -now.bend.norm() - LOOSE * (1.0 + joint.bend.reach())
            {
                self.loose.push(index);
            }
            let known = memory.get(&joint.key);
            let warm = known.map_or(Vec2::zeros(), |m| m.impulse * (span.length / m.dt));
            self.accounts[index] = known.map_or(JointEnergy::default(), |m| m.energy);
            let block = joint_block(index, joint, [now.gamma_a, now.gamma_f]);
            let sides = movable(joint.rows.bodies, inverse_mass);
            self.push(block, sides, now.gamma_f + free, law, warm);
        }
        self.detection.joints = joints;
    }

    fn open_accounts(&mut self, joints: usize) {
        self.accounts.clear();
        self.accounts.resize(joints, JointEnergy::default());
    }

    /// Takes in a block that asks for `b` and starts from an impulse.
    pub fn push(&mut self, block: Block, sides: [u32; 2], asked: Vec2, law: Law, impulse: Vec2) {
        self.blocks.push(block);
        self.sides.push(sides);
        self.asked.push(asked);
        self.laws.push(law);
        self.impulses.push(impulse);
        self.told.push(false);
        self.resolution.push(0.0);
    }

    /// Takes out everything that was collected.
    pub fn clear_blocks(&mut self) {
        self.blocks.clear();
        self.sides.clear();
        self.asked.clear();
        self.laws.clear();
        self.impulses.clear();
        self.told.clear();
        self.given.clear();
        self.resolution.clear();
        self.pairs.clear();
        self.waiting.clear();
        self.loose.clear();
    }

    /// `u_E = u_F + M⁻¹ W P` from the impulses alone, so that the energy balance closes to
    /// round-off.
    pub fn end_velocities(&mut self, inverse_mass: &[Vec3]) {
        self.end.clear();
        self.end.extend_from_slice(&self.free);
        for (end, given) in self.end.iter_mut().zip(&self.given) {
            *end += given;
        }
        for i in 0..self.blocks.len() {
            let impulse = self.impulses[i];
            if !self.told[i] && impulse != Vec2::zeros() {
                let rows = of(&self.detection, &self.blocks[i], self.sides[i]);
                rows.push(impulse, inverse_mass, &mut self.end);
            }
        }
    }

    /// Takes what the impulses of these blocks, all of an island, give to its bodies: where it is
    /// told, it need not be found again.
    pub fn take_given(&mut self, members: &[u32], told: Option<&[(u32, Vec3)]>) {
        self.given.resize(self.free.len(), Vec3::zeros());
        for &i in members {
            self.told[i as usize] = told.is_some();
            if told.is_none() {
                for body in self.sides[i as usize].into_iter().filter(|b| *b != NO_BODY) {
                    self.given[body as usize] = Vec3::zeros();
                }
            }
        }
        for &(body, given) in told.into_iter().flatten() {
            self.given[body as usize] = given;
        }
    }

    /// Adds to some blocks what the bodies above have been given in the step: those must be
    /// solved, and [`Stage::end_velocities`] up to date.
    pub fn look_up(&mut self, members: &[u32]) {
        for &i in members {
            let i = i as usize;
            let mut above = self.all_rows(i);
            for (side, own) in self.sides[i].iter().enumerate() {
                if *own != NO_BODY {
                    above.bodies[side] = NO_BODY;
                }
            }
            let given = above.velocity(&self.end) - above.velocity(&self.free);
            self.blocks[i].gamma_f += given;
            self.asked[i] += given;
        }
    }

    /// What tells a block from step to step.
    pub fn key(&self, block: usize) -> ContactKey {
        match self.blocks[block].source {
            Source::Contact(index) => self.detection.contacts[index].key,
            Source::Joint(index) => self.detection.joints[index].key,
        }
    }

    /// Those `movable` sides of a contact that take its impulse, if any does and all are among
    /// `members`.
    #[inline]
    fn receiving(
        &self,
        contact: &ContactPoint,
        movable: [u32; 2],
        members: Option<&[bool]>,
    ) -> Option<[u32; 2]> {
        let sides = self.standing.receiving(contact.rows.bodies, movable);
        (are_among(movable, members) && sides != [NO_BODY; 2]).then_some(sides)
    }

    /// The rows of a block, with the sides that take impulses only.
    pub fn rows(&self, block: usize) -> Rows {
        of(&self.detection, &self.blocks[block], self.sides[block])
    }

    /// The same with all sides, those that move on their own included.
    pub fn all_rows(&self, block: usize) -> Rows {
        let block = &self.blocks[block];
        of(&self.detection, block, block.bodies)
    }

    /// Writes the contact problem of one island, over its own bodies.
    pub fn island_problem(
        &self,
        members: &[u32],
        inverse_mass: &[Vec3],
        local: &mut LocalBodies,
        problem: &mut ContactProblem,
    ) {
        let ContactProblem {
            operator,
            free,
            laws,
        } = problem;
        let mut op = match std::mem::take(operator) {
            Delassus::Bodies(op) => op,
            Delassus::Blocks(_) => BodyOperator::default(),
        };
        local.operator(members, |i| self.rows(i), inverse_mass, &mut op);
        free.clear();
        free.extend(members.iter().map(|&i| self.asked[i as usize]));
        laws.clear();
        laws.extend(members.iter().map(|&i| self.laws[i as usize]));
        *operator = Delassus::Bodies(op);
    }
}

/// Gap \[m or rad\], and share of its arm, by which a limit may be passed before it is closed by
/// position.
const LOOSE: f64 = 1e-9;

/// The rows of a block of `found`, of these sides.
fn of(found: &Detection, block: &Block, bodies: [u32; 2]) -> Rows {
    let mut jacobian = match block.source {
        Source::Contact(index) => found.contacts[index].rows.jacobian,
        Source::Joint(index) => found.joints[index].rows.jacobian,
    };
    if block.loaded {
        for side in &mut jacobian {
            *side = [side[1], Vec3::zeros()];
        }
    }
    Rows { bodies, jacobian }
}

fn joint_block(index: usize, joint: &JointRow, [gamma_a, gamma_f]: [Vec2; 2]) -> Block {
    Block {
        source: Source::Joint(index),
        bodies: joint.rows.bodies,
        gamma_a,
        gamma_f,
        impact: false,
        held: matches!(joint.kind, JointKind::Pin { .. } | JointKind::Lock { .. }),
        loaded: false,
        carried_before: false,
        stuck_before: false,
    }
}

/// `G_nn` of one row, the trace of both of a pin [1/kg].
pub(super) fn diagonal(joint: &JointRow, inverse_mass: &[Vec3]) -> f64 {
    let block = joint.rows.diagonal(inverse_mass);
    match joint.kind {
        JointKind::Pin { .. } => block.trace(),
        _ => block[(0, 0)],
    }
}

/// Velocities of both sides of `rows`, 0 for the world.
pub(super) fn side_velocities(rows: &Rows, velocities: &[Vec3]) -> [Vec3; 2] {
    rows.bodies
        .map(|b| velocities.get(b as usize).copied().unwrap_or_default())
}

/// Both `bodies` but those that move on their own: these join no islands and take no impulse.
#[inline]
pub(super) fn movable(bodies: [u32; 2], inverse_mass: &[Vec3]) -> [u32; 2] {
    bodies.map(|body| match inverse_mass.get(body as usize) {
        Some(w) if *w != Vec3::zeros() => body,
        _ => NO_BODY,
    })
}

/// Whether something is movable, and all that is movable is among `members`.
pub(super) fn belongs(bodies: [u32; 2], members: Option<&[bool]>, inverse_mass: &[Vec3]) -> bool {
    are_among(movable(bodies, inverse_mass), members)
}

#[inline]
fn are_among(sides: [u32; 2], members: Option<&[bool]>) -> bool {
    let mut real = sides.iter().filter(|b| **b != NO_BODY).peekable();
    real.peek().is_some() && real.all(|b| members.is_none_or(|m| m[*b as usize]))
}
