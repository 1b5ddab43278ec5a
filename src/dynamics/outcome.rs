//! How an island was solved.

use super::contact_cache::JointEnergy;
use super::model::ContactKey;
use super::record::StepRecord;
use crate::contact::{ContactProblem, Vec2, Vec3};
use crate::solver::{SMALL, SolveReport};

/// How one island was solved.
#[derive(Debug, Clone, Copy)]
pub(super) struct IslandOutcome {
    pub report: SolveReport,
    /// Rows of its problem.
    pub unknowns: usize,
    /// Whether the energy of its contacts, and of its joints, was bounded.
    pub contacts_bounded: bool,
    pub joints_bounded: bool,
    /// Whether push-outs were dropped.
    pub relaxed: bool,
    /// Whether the island is a crowd, see [`super::crowd`].
    pub crowd: bool,
    pub redundant: bool,
    /// Number of its bodies.
    pub bodies: usize,
    /// Its reserve after the step, and below 0 the part that is no round-off \[J\].
    pub reserve: f64,
    pub debt: f64,
    /// Energy that an impact added \[J\], 0 or more.
    pub gain: f64,
}

/// Velocity residual above which an island that is not certified has failed, as a share of its velocity
/// scale. An island without a solution leaves about the scale itself, one whose sweeps stop early some
/// hundredths.
const FAILED: f64 = 0.1;

impl IslandOutcome {
    /// Whether the impulses do not even keep the rigid law within a tenth of the velocities at stake.
    fn failed(&self) -> bool {
        let residual = &self.report.residual;
        // NaN fails
        let bounded = residual.velocity <= FAILED * residual.velocity_scale;
        !self.report.solved() && !bounded
    }

    /// Adds the work of the solve, even if the result is not used.
    pub fn count_work(&self, record: &mut StepRecord) {
        record.unknowns += self.unknowns;
        record.sweeps += self.report.sweeps;
        record.factorisations += self.report.factorisations;
        record.pivots += self.report.pivots;
    }

    /// Adds the outcome of an island of so many contacts and joint rows, if the result is used.
    pub fn count(&self, blocks: usize, record: &mut StepRecord) {
        record.small_islands += usize::from(blocks <= SMALL && !self.crowd);
        record.largest_island = record.largest_island.max(blocks);
        record.unsolved += usize::from(!self.report.solved());
        record.failed += usize::from(self.failed());
        record.residual = record.residual.max(self.report.residual.relative);
        record.residual_velocity = record.residual_velocity.max(self.report.residual.velocity);
        record.islands += 1;
        record.capped += usize::from(self.contacts_bounded);
        record.crowds += usize::from(self.crowd);
        record.relaxed += usize::from(self.relaxed);
        record.joints_capped += usize::from(self.joints_bounded);
        record.redundant += usize::from(self.redundant);
        record.impact_gain += self.gain;
    }
}

/// The contact problem of an island in a step, with the solver's result.
#[derive(Debug, Clone)]
pub struct SolvedProblem {
    pub problem: ContactProblem,
    /// The contact or joint of each block.
    pub keys: Vec<ContactKey>,
    pub impulses: Vec<Vec2>,
    pub report: SolveReport,
}

/// The result of an island, except its impulses.
pub(super) struct IslandResult {
    pub outcome: IslandOutcome,
    pub problem: Option<Box<SolvedProblem>>,
    /// Velocity resolution of the solve \[m/s\].
    pub resolution: f64,
    /// `b` of all blocks, if the bound on joints changed it.
    pub bias: Option<Vec<Vec2>>,
    /// `M⁻¹ Wᵀ P` of its bodies, if the solver returned it.
    pub change: Option<Vec<(u32, Vec3)>>,
    /// Joints of the detection: the energy each has added so far, and those whose gaps the bound
    /// did not close fully.
    pub energies: Vec<(usize, JointEnergy)>,
    pub unclosed: Vec<usize>,
}
