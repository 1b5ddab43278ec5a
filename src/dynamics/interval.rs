//! One interval of time, or one instant, for all or some of the bodies: the data of its contact
//! problems.

use super::contact_cache::JointEnergy;
use super::model::{
    ContactKey, ContactPoint, Detection, JointKind, JointRow, ModelError, MultibodyModel, NormalLaw,
};
use super::pair_set::PairSet;
use super::roles::BodyRoles;
use crate::contact::{Law, NO_BODY, Rows, Vec2, Vec3};
use rustc_hash::FxHashMap;

/// One block of rows that takes part.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub source: Source,
    /// Bodies of both sides, including those with prescribed motion.
    pub bodies: [u32; 2],
    pub gamma_a: Vec2,
    pub gamma_f: Vec2,
    pub impact: bool,
    /// A pin or locked axis.
    pub bilateral: bool,
    /// A contact with a given normal load. Only its friction is solved, in the place of the normal
    /// row.
    pub loaded: bool,
    /// Whether it had an impulse, and whether it stuck, in the interval before.
    pub pressed_before: bool,
    pub stuck_before: bool,
    /// Whether the contact touched at the start of the interval.
    pub continues: bool,
    /// See [`Left`](super::contact_cache::Left); `turning` is that of this interval.
    pub on_surface: bool,
    /// See [`Situation`](super::rules::Situation).
    pub sinks: bool,
    /// Depth \[m\] at which the scheme holds the contact on a curved path: in this step, and the
    /// largest so far, see [`Left`](super::contact_cache::Left).
    pub held: [f64; 2],
    pub turning: Option<Vec2>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Source {
    Contact(usize),
    Joint(usize),
}

/// An interval before its solution. Solving it changes nothing here; the result is a
/// [`Solution`](super::solution::Solution).
#[derive(Default)]
pub(super) struct Interval {
    pub length: f64,
    /// Whether it is a whole step of all bodies.
    pub whole: bool,
    pub roles: BodyRoles,
    pub start: Vec<Vec3>,
    /// Whether any body moves as prescribed.
    pub driven: bool,
    pub forces: Vec<Vec3>,
    pub accelerations: Vec<Vec3>,
    /// For each body its share of the reserve of its island \[J\]; empty for 0.
    pub reserves: Vec<f64>,
    /// Velocity of each body that counts as zero, see [`super::gap_resolution`]; empty for 0.
    pub noise: Vec<f64>,
    pub free: Vec<Vec3>,
    pub detection: Detection,
    pub blocks: Vec<Block>,
    /// For each block: the bodies that receive impulses, `b = γ_F +` the velocity its rule adds
    /// \[m/s\], its law, and its start impulse.
    pub sides: Vec<[u32; 2]>,
    pub bias: Vec<Vec2>,
    pub laws: Vec<Law>,
    pub warm: Vec<Vec2>,
    /// For each joint of the detection.
    pub energies: Vec<JointEnergy>,
    /// Surface pairs of all rigid contacts with a movable body, in order.
    pub pairs: Vec<u64>,
    /// Contacts of the detection deferred until they are located in time.
    pub deferred: Vec<usize>,
    /// Contacts of the detection with restitution that rebound in the interval, or take no part in it.
    pub rebounding: Vec<usize>,
    /// Joints of the detection whose limit is passed farther than its bend explains.
    pub passed_limits: Vec<usize>,
    /// Pairs that overlapped when first seen; their penetration does not count as an error of the
    /// step.
    pub known_overlaps: PairSet,
    /// For each body, the number of bodies of its crowd, 0 outside crowds: see [`super::events::find_crowds`].
    pub crowded: Vec<u32>,
    /// For each body, whether its fast contacts take the rule of all others: see [`super::events::find_plain`].
    pub plain: Vec<bool>,
    /// The pair of surfaces whose landing is located: no crowd keeps it from closing.
    pub sought: Option<[u32; 2]>,
    /// Whether the simulation starts with it, and `c` \[m/s²\] from its midpoint to its end of the
    /// contacts that [`super::first_step`] has followed.
    pub first: bool,
    pub ahead: FxHashMap<ContactKey, Vec2>,
    /// The first block of the contacts of [`super::driven`], if it is solved again with these.
    pub driven_from: Option<u32>,
    /// The first of the contacts whose blocks come behind those of the joints: see [`Interval::collect_more`].
    pub later: Option<usize>,
    /// What threads collect, kept to reuse its memory.
    pub parts: Vec<Collected>,
}

/// The blocks of some contacts, in the fields of [`Interval`].
#[derive(Default)]
pub(super) struct Collected {
    pub blocks: Vec<Block>,
    pub sides: Vec<[u32; 2]>,
    pub bias: Vec<Vec2>,
    pub laws: Vec<Law>,
    pub warm: Vec<Vec2>,
    pub pairs: Vec<u64>,
    pub deferred: Vec<usize>,
    pub rebounding: Vec<usize>,
}

impl Collected {
    /// Adds a block with its `b` and its start impulse.
    #[inline]
    pub fn push(&mut self, block: Block, sides: [u32; 2], bias: Vec2, law: Law, warm: Vec2) {
        self.blocks.push(block);
        self.sides.push(sides);
        self.bias.push(bias);
        self.laws.push(law);
        self.warm.push(warm);
    }

    /// Takes over the blocks of the contacts that follow.
    pub fn append(&mut self, next: &mut Collected) {
        // a pair is listed once, also if its contacts are in both
        let again = !next.pairs.is_empty() && self.pairs.last() == next.pairs.first();
        self.pairs
            .extend(next.pairs.drain(..).skip(usize::from(again)));
        self.blocks.append(&mut next.blocks);
        self.sides.append(&mut next.sides);
        self.bias.append(&mut next.bias);
        self.laws.append(&mut next.laws);
        self.warm.append(&mut next.warm);
        self.deferred.append(&mut next.deferred);
        self.rebounding.append(&mut next.rebounding);
    }
}

impl Interval {
    /// Detects all contacts at the present configuration that may close within `dt` \[s\].
    ///
    /// # Errors
    /// Those of the model.
    pub fn detect(&mut self, model: &mut dyn MultibodyModel, dt: f64) -> Result<(), ModelError> {
        self.detection.clear();
        model.detect(dt, &mut self.detection)
    }

    /// Detects the contacts of some pairs of surfaces, and all joints.
    ///
    /// # Errors
    /// Those of the model.
    pub fn detect_pairs(
        &mut self,
        model: &mut dyn MultibodyModel,
        pairs: &[[u32; 2]],
        dt: f64,
    ) -> Result<(), ModelError> {
        self.detection.clear();
        model.detect_pairs(pairs, dt, &mut self.detection)?;
        model.detect_joints(dt, &mut self.detection.joints)
    }

    /// Reads the forces `h` of the interval, and `M⁻¹ h`. `time` is that of its midpoint.
    pub fn apply_forces(&mut self, model: &dyn MultibodyModel, inverse_mass: &[Vec3], time: f64) {
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
    }

    /// `u_F = u_A + M⁻¹ (h Δt + W_N P_N)` with the impulses of given normal loads. `h` is that of
    /// [`Interval::apply_forces`].
    pub fn free_velocities(&mut self, inverse_mass: &[Vec3], length: f64) {
        self.length = length;
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

    /// Exchanges all blocks with those of `other`.
    pub fn swap_blocks(&mut self, other: &mut Collected) {
        std::mem::swap(&mut self.blocks, &mut other.blocks);
        std::mem::swap(&mut self.sides, &mut other.sides);
        std::mem::swap(&mut self.bias, &mut other.bias);
        std::mem::swap(&mut self.laws, &mut other.laws);
        std::mem::swap(&mut self.warm, &mut other.warm);
        std::mem::swap(&mut self.pairs, &mut other.pairs);
        std::mem::swap(&mut self.deferred, &mut other.deferred);
        std::mem::swap(&mut self.rebounding, &mut other.rebounding);
    }

    /// Removes all collected blocks.
    pub fn clear_blocks(&mut self) {
        self.blocks.clear();
        self.sides.clear();
        self.bias.clear();
        self.laws.clear();
        self.warm.clear();
        self.pairs.clear();
        self.deferred.clear();
        self.rebounding.clear();
        self.passed_limits.clear();
        self.driven_from = None;
        self.later = None;
    }

    /// The block of a contact of the detection, if it has one.
    pub fn block_of(&self, contact: usize) -> Option<usize> {
        let is_later = |contact| self.later.is_some_and(|later| contact >= later);
        let order = |source| match source {
            Source::Contact(contact) => (is_later(contact), contact),
            Source::Joint(_) => (false, usize::MAX),
        };
        let wanted = order(Source::Contact(contact));
        (self
            .blocks
            .binary_search_by_key(&wanted, |b| order(b.source)))
        .ok()
    }

    /// Identifies a block from step to step.
    pub fn key(&self, block: usize) -> ContactKey {
        match self.blocks[block].source {
            Source::Contact(index) => self.detection.contacts[index].key,
            Source::Joint(index) => self.detection.joints[index].key,
        }
    }

    /// The `movable` sides of a contact that receive its impulse; `None` if there are none, or one
    /// is not among `members`.
    #[inline]
    pub fn receiving(
        &self,
        contact: &ContactPoint,
        movable: [u32; 2],
        members: Option<&[bool]>,
    ) -> Option<[u32; 2]> {
        let sides = self.roles.receiving(contact.rows.bodies, movable);
        (are_among(movable, members) && sides != [NO_BODY; 2]).then_some(sides)
    }

    /// Whether a block is recorded with the interval: none of its bodies is in a cluster.
    pub fn is_used(&self, block: usize, in_cluster: &[bool]) -> bool {
        let mut sides = self.sides[block].iter().filter(|b| **b != NO_BODY);
        sides.all(|b| !in_cluster[*b as usize])
    }

    /// The rows of a block, with only the sides that receive impulses.
    pub fn rows(&self, block: usize) -> Rows {
        block_rows(&self.detection, &self.blocks[block], self.sides[block])
    }

    /// The rows of a block with both sides, including those with prescribed motion.
    pub fn all_rows(&self, block: usize) -> Rows {
        let block = &self.blocks[block];
        block_rows(&self.detection, block, block.bodies)
    }
}

/// Calls `run` with the rows of a block of `found`, with these sides, without a copy where it can.
#[inline]
pub(super) fn with_block_rows<R>(
    found: &Detection,
    block: &Block,
    bodies: [u32; 2],
    run: impl FnOnce(&Rows) -> R,
) -> R {
    match block.source {
        Source::Contact(index) if !block.loaded && found.contacts[index].rows.bodies == bodies => {
            run(&found.contacts[index].rows)
        }
        _ => run(&block_rows(found, block, bodies)),
    }
}

/// The rows of a block of `found`, with these sides.
pub(super) fn block_rows(found: &Detection, block: &Block, bodies: [u32; 2]) -> Rows {
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

/// The `bodies` with NO_BODY in place of those with prescribed motion, which join no islands and
/// receive no impulse.
#[inline]
pub(super) fn movable(bodies: [u32; 2], inverse_mass: &[Vec3]) -> [u32; 2] {
    bodies.map(|body| match inverse_mass.get(body as usize) {
        Some(w) if *w != Vec3::zeros() => body,
        _ => NO_BODY,
    })
}

/// Whether at least one body is movable, and all movable ones are among `members`.
pub(super) fn belongs(bodies: [u32; 2], members: Option<&[bool]>, inverse_mass: &[Vec3]) -> bool {
    are_among(movable(bodies, inverse_mass), members)
}

#[inline]
fn are_among(sides: [u32; 2], members: Option<&[bool]>) -> bool {
    let mut real = sides.iter().filter(|b| **b != NO_BODY).peekable();
    real.peek().is_some() && real.all(|b| members.is_none_or(|m| m[*b as usize]))
}
