use super::SolveStatus;
use crate::contact::{Residual, Vec2};

/// The best impulses found in a solve, with their residual.
#[derive(Debug, Clone, Default)]
pub(super) struct Best {
    pub impulses: Vec<Vec2>,
    pub residual: Residual,
    tolerance: f64,
}

impl Best {
    /// Starts a new search from `impulses`.
    pub fn start(&mut self, impulses: &[Vec2], residual: Residual, tolerance: f64) {
        self.impulses.clear();
        self.impulses.extend_from_slice(impulses);
        self.residual = residual;
        self.tolerance = tolerance;
    }

    /// Stores `impulses` if their residual is smaller; a NaN residual never is. Returns whether it
    /// stored them.
    pub fn offer(&mut self, impulses: &[Vec2], residual: Residual) -> bool {
        let merit = self.residual.merit();
        let better = residual.merit() < merit || (merit.is_nan() && !residual.merit().is_nan());
        if better {
            self.impulses.copy_from_slice(impulses);
            self.residual = residual;
        }
        better
    }

    /// Changes the tolerance.
    pub fn set_tolerance(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    /// Whether the residual is certified at the tolerance.
    pub fn solved(&self) -> bool {
        self.residual.certified(self.tolerance)
    }

    /// The status to report.
    pub fn status(&self) -> SolveStatus {
        if self.solved() {
            SolveStatus::Solved
        } else {
            SolveStatus::Unsolved
        }
    }
}
