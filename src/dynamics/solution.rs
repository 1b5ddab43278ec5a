//! The solution of an interval.

use super::contact_cache::JointEnergy;
use super::interval::{Interval, with_block_rows};
use super::islands::Islands;
use super::outcome::{IslandOutcome, IslandResult, SolvedProblem};
use crate::contact::{NO_BODY, Vec2, Vec3};

/// The solution of an [`Interval`]. Lists have one entry per block, unless stated otherwise.
#[derive(Default)]
pub(super) struct Solution {
    pub impulses: Vec<Vec2>,
    /// `b` \[m/s\] of the solved problem; the energy bound on joints may have reduced it.
    pub bias: Vec<Vec2>,
    /// Velocity that bodies of higher dominance add to `γ_F` \[m/s\]; empty if all have the same
    /// dominance.
    above: Vec<Vec2>,
    /// Velocity resolution of the solve of a block's island \[m/s\].
    pub resolution: Vec<f64>,
    /// Whether `change` already includes the impulse.
    counted: Vec<bool>,
    /// `M⁻¹ W P` of islands whose solver returned it [m/s, rad/s], one per body.
    change: Vec<Vec3>,
    /// `u_E`, one per body.
    pub end: Vec<Vec3>,
    /// `u_E` as the problem was solved, if energy was taken back from `end` since; else empty.
    pub unpaid: Vec<Vec3>,
    /// For each joint of the detection.
    pub energies: Vec<JointEnergy>,
    /// Joints of the detection whose gaps must be closed by position, ascending.
    pub unclosed: Vec<usize>,
    /// Contacts of the detection deferred until they are located in time.
    pub deferred: Vec<usize>,
    pub islands: Islands,
    /// One per island; problems only if they are stored.
    pub outcomes: Vec<IslandOutcome>,
    pub problems: Vec<SolvedProblem>,
}

impl Solution {
    /// Starts from the impulses of the interval.
    pub fn begin(&mut self, interval: &Interval) {
        self.clear();
        self.impulses.extend_from_slice(&interval.warm);
        self.bias.extend_from_slice(&interval.bias);
        self.resolution.resize(interval.blocks.len(), 0.0);
        self.counted.resize(interval.blocks.len(), false);
        self.energies.extend_from_slice(&interval.energies);
        self.unclosed.extend_from_slice(&interval.passed_limits);
        self.deferred.extend_from_slice(&interval.deferred);
    }

    /// Clears the solution, for an interval without blocks.
    pub fn clear(&mut self) {
        self.impulses.clear();
        self.bias.clear();
        self.above.clear();
        self.resolution.clear();
        self.counted.clear();
        self.change.clear();
        self.unpaid.clear();
        self.energies.clear();
        self.unclosed.clear();
        self.deferred.clear();
        self.outcomes.clear();
        self.problems.clear();
    }

    /// `γ_F` of a block, including the velocity that bodies of higher dominance add to it.
    pub fn gamma_f(&self, interval: &Interval, block: usize) -> Vec2 {
        let own = interval.blocks[block].gamma_f;
        self.above.get(block).map_or(own, |above| own + above)
    }

    /// `u_E = u_F + M⁻¹ W P` from the impulses alone, so that the energy balance is exact up to
    /// round-off.
    pub fn end_velocities(&mut self, interval: &Interval, inverse_mass: &[Vec3]) {
        self.end.clear();
        self.end.extend_from_slice(&interval.free);
        for (end, change) in self.end.iter_mut().zip(&self.change) {
            *end += change;
        }
        for (i, &impulse) in self.impulses.iter().enumerate() {
            if !self.counted[i] && impulse != Vec2::zeros() {
                let (block, sides) = (&interval.blocks[i], interval.sides[i]);
                with_block_rows(&interval.detection, block, sides, |rows| {
                    rows.push(impulse, inverse_mass, &mut self.end);
                });
            }
        }
    }

    /// `u_E` as the problem was solved, in which the laws of the contacts hold.
    pub fn solved_end(&self) -> &[Vec3] {
        if self.unpaid.is_empty() {
            &self.end
        } else {
            &self.unpaid
        }
    }

    /// Stores the impulses of an island, which may still be a part of a larger one.
    pub fn store(
        &mut self,
        interval: &Interval,
        members: &[u32],
        impulses: &[Vec2],
        result: &IslandResult,
    ) {
        for (&i, &p) in members.iter().zip(impulses) {
            self.impulses[i as usize] = p;
        }
        self.store_change(interval, members, result.change.as_deref());
    }

    /// Stores the rest of the results, one for each of `islands`.
    pub fn finish<'a>(&mut self, results: impl Iterator<Item = &'a IslandResult>) {
        for (k, result) in results.enumerate() {
            let members = self.islands.blocks(k);
            for (&i, &b) in members.iter().zip(result.bias.iter().flatten()) {
                self.bias[i as usize] = b;
            }
            for &i in members {
                self.resolution[i as usize] = result.resolution;
            }
            for &(joint, energy) in &result.energies {
                self.energies[joint] = energy;
            }
            self.unclosed.extend(&result.unclosed);
            self.outcomes.push(result.outcome);
            let problem = result.problem.clone();
            self.problems.extend(problem.map(|problem| *problem));
        }
        self.unclosed.sort_unstable();
    }

    /// Stores the velocity change of an island's bodies. If `None`, it is computed from the
    /// impulses later.
    fn store_change(
        &mut self,
        interval: &Interval,
        members: &[u32],
        change: Option<&[(u32, Vec3)]>,
    ) {
        self.change.resize(interval.free.len(), Vec3::zeros());
        for &i in members {
            self.counted[i as usize] = change.is_some();
            if change.is_none() {
                let sides = interval.sides[i as usize].into_iter();
                for body in sides.filter(|b| *b != NO_BODY) {
                    self.change[body as usize] = Vec3::zeros();
                }
            }
        }
        for &(body, change) in change.into_iter().flatten() {
            self.change[body as usize] = change;
        }
    }

    /// Leaves a contact without an impulse until it is located in time. It is an island of its own.
    pub fn release(&mut self, interval: &Interval, block: u32, contact: usize) {
        self.impulses[block as usize] = Vec2::zeros();
        self.store_change(interval, &[block], None);
        self.deferred.push(contact);
    }

    /// Adds the velocities of bodies of higher dominance to some blocks. Those bodies must be
    /// solved, and [`Solution::end_velocities`] must be up to date.
    pub fn add_higher(&mut self, interval: &Interval, members: &[u32]) {
        self.above.resize(interval.blocks.len(), Vec2::zeros());
        for &i in members {
            let i = i as usize;
            let mut rows = interval.all_rows(i);
            for (side, own) in interval.sides[i].iter().enumerate() {
                if *own != NO_BODY {
                    rows.bodies[side] = NO_BODY;
                }
            }
            let above = rows.velocity(&self.end) - rows.velocity(&interval.free);
            self.above[i] = above;
            self.bias[i] += above;
        }
    }
}
