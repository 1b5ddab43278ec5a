//! Which parts come near each other: boxes with a margin in a tree.
//!
//! A part's box is looked at only when it may have left its fat one: every body carries the length
//! of the way that any of its points can have gone, and a fat box says up to which length it
//! holds. Source of the tree: parry's `Bvh`.

use super::super::engine::math::{Real, Vector};
use super::super::engine::parry::bounding_volume::Aabb;
use super::super::engine::parry::partitioning::{Bvh, BvhBuildStrategy, BvhWorkspace};

/// Low x, low y, high x, high y \[m\].
type Box4 = [f64; 4];

/// A box that overlaps none.
const NOWHERE: Box4 = [
    f64::INFINITY,
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::NEG_INFINITY,
];

fn overlap(a: &Box4, b: &Box4) -> bool {
    a[0] <= b[2] && b[0] <= a[2] && a[1] <= b[3] && b[1] <= a[3]
}

#[derive(Default)]
pub(super) struct Tree {
    bvh: Bvh,
    workspace: BvhWorkspace,
    fat: Vec<Box4>,
    /// Way \[m\] up to which the fat box of a leaf holds it.
    limit: Vec<f64>,
    /// Leaves of this call and of the last one whose fat boxes are new.
    changed: Vec<u32>,
    previous: Vec<u32>,
    /// Of each leaf, the call in which its fat box was made.
    stamp: Vec<u32>,
    call: u32,
    /// Boxes changed since the tree was last improved.
    debt: usize,
    leaves: usize,
    /// Leaves came or went, so that a partial refit is not enough.
    rebuilt: bool,
}

impl Tree {
    pub fn remove(&mut self, leaf: u32) {
        if self.limit[leaf as usize] > f64::NEG_INFINITY {
            self.bvh.remove(leaf);
            self.leaves -= 1;
            self.rebuilt = true;
        }
        self.limit[leaf as usize] = f64::NEG_INFINITY;
        self.fat[leaf as usize] = NOWHERE;
    }

    /// Starts a call over leaves numbered below `count`.
    pub fn begin(&mut self, count: usize) {
        self.call = self.call.wrapping_add(1);
        self.changed.clear();
        self.limit.resize(count, f64::NEG_INFINITY);
        self.fat.resize(count, NOWHERE);
        self.stamp.resize(count, 0);
    }

    /// Whether a leaf that has gone the way `way` and looks `growth` \[m\] ahead is still within
    /// its fat box.
    pub fn holds(&self, leaf: usize, way: f64, growth: f64) -> bool {
        way + growth <= self.limit[leaf]
    }

    /// Sees to it that the fat box of `leaf` holds `tight` grown by `growth`; `ahead` \[m\] is
    /// where it moves in the next steps.
    pub fn place(&mut self, leaf: usize, tight: Box4, way: f64, growth: f64, ahead: [f64; 2]) {
        let new = self.limit[leaf] == f64::NEG_INFINITY;
        let fat = self.fat[leaf];
        let slack = (tight[0] - fat[0])
            .min(tight[1] - fat[1])
            .min(fat[2] - tight[2])
            .min(fat[3] - tight[3]);
        if !new && slack >= growth {
            self.limit[leaf] = way + slack;
            return;
        }
        let size = (tight[2] - tight[0]).max(tight[3] - tight[1]);
        let margin = growth + 0.08 * size.min(1e3);
        // room for the rounding of the tree's numbers
        let far = tight.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let round = 1e-6 * far;
        let low = |k: usize| (tight[k] - margin - round + ahead[k].min(0.0)) as Real;
        let high = |k: usize| (tight[k + 2] + margin + round + ahead[k].max(0.0)) as Real;
        let aabb = Aabb::new(Vector::new(low(0), low(1)), Vector::new(high(0), high(1)));
        // 0 would leave the change unmarked
        self.bvh
            .insert_or_update_partially(aabb, leaf as u32, Real::MIN_POSITIVE);
        self.fat[leaf] = [aabb.mins.x, aabb.mins.y, aabb.maxs.x, aabb.maxs.y].map(f64::from);
        self.limit[leaf] = way + margin;
        self.stamp[leaf] = self.call;
        self.changed.push(leaf as u32);
        if new {
            self.leaves += 1;
            self.rebuilt = true;
        }
    }

    /// Whether the fat box of a leaf is of this call.
    pub fn moved(&self, leaf: u32) -> bool {
        self.stamp[leaf as usize] == self.call
    }

    /// Whether two fat boxes overlap.
    pub fn overlap(&self, a: u32, b: u32) -> bool {
        overlap(&self.fat[a as usize], &self.fat[b as usize])
    }

    /// Calls `found` for all pairs of leaves whose fat boxes have come to overlap in this call;
    /// others may come as well.
    pub fn pairs(&mut self, mut found: impl FnMut(u32, u32)) {
        if self.changed.is_empty() && !self.rebuilt {
            return;
        }
        self.debt += self.changed.len();
        if self.rebuilt && 2 * self.changed.len() > self.leaves {
            self.bvh
                .rebuild(&mut self.workspace, BvhBuildStrategy::Binned);
            self.bvh.refit(&mut self.workspace);
            self.bvh
                .traverse_bvtt_single_tree::<false>(&mut self.workspace, &mut found);
            self.debt = 0;
        } else {
            if 4 * self.debt > self.leaves {
                self.debt = 0;
                self.bvh.optimize_incremental(&mut self.workspace);
                self.bvh.refit(&mut self.workspace);
            } else if self.rebuilt || 16 * (self.changed.len() + self.previous.len()) > self.leaves
            {
                self.bvh.refit(&mut self.workspace);
            } else {
                self.bvh.refit_partial(&self.previous, &self.changed);
            }
            self.bvh
                .traverse_bvtt_single_tree::<true>(&mut self.workspace, &mut found);
        }
        self.rebuilt = false;
        std::mem::swap(&mut self.previous, &mut self.changed);
    }
}
