use super::SolveStatus;
use crate::contact::{Residual, Vec2};

/// The best impulses met in a solve, with the judge's word on them.
#[derive(Debug, Clone, Default)]
pub(super) struct Best {
    pub impulses: Vec<Vec2>,
    pub residual: Residual,
    tolerance: f64,
}

impl Best {
    /// Starts anew from `impulses`.
    pub fn start(&mut self, impulses: &[Vec2], residual: Residual, tolerance: f64) {
        self.impulses.clear();
        self.impulses.extend_from_slice(impulses);
        self.residual = residual;
        self.tolerance = tolerance;
    }

    /// Keeps `impulses` if they are better; whether it does. NaN never is.
    pub fn offer(&mut self, impulses: &[Vec2], residual: Residual) -> bool {
        let merit = self.residual.merit();
        let better = residual.merit() < merit || (merit.is_nan() && !residual.merit().is_nan());
        if better {
            self.impulses.copy_from_slice(impulses);
            self.residual = residual;
        }
        better
    }

    /// Goes on with another tolerance.
    pub fn ask(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    /// Whether the judge certified them.
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
