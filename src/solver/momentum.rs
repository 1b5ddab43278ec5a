use super::four_sweep::{FourState, FourSweep};
use crate::contact::BodyOperator;

/// Nesterov's momentum for pairs of sweeps, one forward and one backward.
///
/// ```text
/// P_k+1 = sweeps(Q_k)       Q_k+1 = P_k+1 + β (P_k+1 − P_k)                 (1)
/// β = min(j/(j + 3), 0.9)   after j pairs since the last restart
/// ```
///
/// `Q` need not be admissible: a sweep computes each impulse anew. It restarts, `j = 0`, where a pair
/// of sweeps turns back:
///
/// ```text
/// (u(Q_k) − u(P_k+1))ᵀ M (u(P_k+1) − u(P_k)) > 0                            (2)
/// ```
///
/// The test is made in velocities, because impulses that hold each other in balance may grow without
/// any motion.
///
/// # Source
/// Nesterov (1983); O'Donoghue & Candès, *Adaptive restart for accelerated gradient schemes* (2015);
/// Mazhar et al., *Using Nesterov's method to accelerate multibody dynamics with friction and contact*
/// (2015), for contact problems.
#[derive(Debug, Clone, Default)]
pub(super) struct Momentum {
    /// At `P_k`.
    before: FourState,
    /// At `Q_k`.
    start: FourState,
    count: u32,
}

/// Largest β. Above it impulses in balance run away.
const MOST: f64 = 0.9;

impl Momentum {
    /// Starts from the present impulses.
    pub fn start(&mut self, fours: &FourSweep) {
        fours.store(&mut self.before);
        fours.store(&mut self.start);
        self.count = 0;
    }

    /// The step (1) after a pair of sweeps.
    pub fn step(&mut self, fours: &mut FourSweep, op: &BodyOperator) {
        let turns = fours.turn(op, [&self.start, &self.before]) > 0.0;
        self.count = if turns { 0 } else { self.count + 1 };
        let count = f64::from(self.count);
        fours.extrapolate((count / (count + 3.0)).min(MOST), &mut self.before);
        fours.store(&mut self.start);
    }
}
