use crate::contact::{ContactProblem, Law, Mat2, Vec2};
use crate::solver::{ImpulseSolver, Nsgs, SolveReport};

/// Augmented Lagrangian fixed point by proximal points, relaxed one row after the other.
///
/// ```text
/// P_N ← prox_{[0, ∞)}(P_N − r_N ξ_N),             r_N = 1/(G_NN + R)
/// P_T ← prox_{[−μ P_N, μ P_N]}(P_T − r_T ξ_T),    r_T = 1/G_TT               (1)
/// ```
///
/// and without bounds for a pin. The method of the thresher study; a fixed point is an exact
/// solution. It projects normal and tangent separately where [`Nsgs`] solves both at once: slower
/// and no more robust, included for comparison.
///
/// # Source
/// Alart & Curnier (1991); Leine & Nijmeijer, *Dynamics and Bifurcations of Non-Smooth Mechanical
/// Systems* (2004), ch. 5; Schindler, Nguyen & Trinkle (2011) for the relaxation row by row.
#[derive(Debug, Clone)]
pub struct Prox {
    sweeps: Nsgs,
}

impl Default for Prox {
    /// At most 20 000 sweeps.
    fn default() -> Self {
        Prox {
            sweeps: Nsgs::with_local_step(20_000, step),
        }
    }
}

/// One relaxation of a block, from `G_ii`, `ξ_i − G_ii P_i`, `P_i` and the law.
#[inline]
fn step(block: &Mat2, free: Vec2, old: Vec2, law: &Law) -> Vec2 {
    // a row of zero gain keeps its impulse
    let row = |free: f64, gain: f64, old: f64| if gain > 0.0 { -free / gain } else { old };
    let (nn, nt, tt) = (
        block[(0, 0)] + law.compliance(),
        block[(0, 1)],
        block[(1, 1)],
    );
    // P − ξ/G, with ξ = free + G P
    let normal = row(free.x + nt * old.y, nn, old.x);
    let tangent = |normal: f64| row(free.y + nt * normal, tt, old.y);
    match *law {
        Law::Contact { friction, .. } => {
            let normal = normal.max(0.0);
            let bound = friction * normal;
            Vec2::new(normal, tangent(normal).clamp(-bound, bound))
        }
        Law::Pin => Vec2::new(normal, tangent(normal)),
        Law::Bounded { lower, upper, .. } => Vec2::new(normal.clamp(lower, upper), 0.0),
    }
}

impl ImpulseSolver for Prox {
    fn name(&self) -> &'static str {
        "prox"
    }

    fn solve(
        &mut self,
        problem: &ContactProblem,
        impulses: &mut [Vec2],
        tolerance: f64,
    ) -> SolveReport {
        self.sweeps.solve(problem, impulses, tolerance)
    }
}
