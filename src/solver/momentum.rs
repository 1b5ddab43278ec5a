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

/// `β` of (1).
pub(super) fn share(count: u32) -> f64 {
    let count = f64::from(count);
    (count / (count + 3.0)).min(MOST)
}

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
        fours.extrapolate(share(self.count), &mut self.before);
        fours.store(&mut self.start);
    }
}

#[cfg(test)]
mod tests {
    use super::super::four_sweep::FourSweep;
    use super::*;
    use crate::contact::examples::heap;
    use crate::contact::{Delassus, Judge, Vec2};
    use fearless_simd::Level;

    /// A step of momentum moves impulses and the velocities of the bodies alike: these stay
    /// `M⁻¹ Jᵀ P`.
    #[test]
    fn velocities_follow_the_impulses() {
        let problem = heap(9, 7, 0.4, 1.0, 5).problem();
        let Delassus::Bodies(op) = &problem.operator else {
            unreachable!()
        };
        let judge = Judge::new(&problem);
        let mut fours = FourSweep::default();
        assert!(fours.arrange(&problem, op));
        let mut impulses = vec![Vec2::zeros(); problem.len()];
        let still = vec![crate::contact::Vec3::zeros(); op.inverse_mass.len()];
        fours.gather(&problem, op, judge.diagonal(), &impulses, &still);
        let mut momentum = Momentum::default();
        momentum.start(&fours);
        for sweep in 0..12 {
            if sweep > 0 && sweep % 2 == 0 {
                momentum.step(&mut fours, op);
            }
            fours.sweep(Level::new(), &problem, op, judge.diagonal(), sweep % 2 == 1);
        }
        momentum.step(&mut fours, op);
        assert!(momentum.count > 0);
        fours.write(&mut impulses);
        let mut expected = still;
        for (rows, p) in op.rows.iter().zip(&impulses) {
            rows.push(*p, &op.inverse_mass, &mut expected);
        }
        let scale = expected.iter().map(|u| u.amax()).fold(0.0, f64::max);
        for (found, expected) in fours.velocities().zip(&expected) {
            assert!((found - expected).amax() <= 1e-12 * scale);
        }
    }
}
