//! Scales impulses that add energy. Scaled impulses stay in the friction cone.

use super::constraint_work::work;
use super::island_problem::IslandProblem;
use crate::contact::Vec2;

/// Work that contacts of a crowd may add, as a share of `P · G P`: sweeps leave residuals.
const ROUND: f64 = 1e-9;

/// Scales the impulses `P` of the rigid contacts of a crowd so that they add no energy:
///
/// ```text
/// W(s P) = s W(P) − s (1 − s) q/2 ≤ 0,   q = P · G P,   s = 1 − 2 W(P)/q          (1)
/// ```
///
/// with `W` of (1) of [`bound_contacts`](super::energy_bound::bound_contacts). Scaled impulses stay in the friction cone; bodies may close by
/// a share `1 − s` of what the impulses hold off. `velocities` is `G P + b`. Returns whether it changed
/// anything.
pub(super) fn bound_swept(
    island: &IslandProblem,
    impulses: &mut [Vec2],
    velocities: &[Vec2],
) -> bool {
    let work = work(island, impulses, velocities);
    if work <= 0.0 {
        return false;
    }
    let terms = &island.terms;
    let rigid = |i: usize, p: &Vec2| if terms[i].rigid { *p } else { Vec2::zeros() };
    let own: Vec<Vec2> = (impulses.iter().enumerate())
        .map(|(i, p)| rigid(i, p))
        .collect();
    let mut change = Vec::new();
    island.problem.velocities(&own, &mut change);
    let of = |i: usize| own[i].dot(&(change[i] - island.problem.free[i]));
    let product: f64 = (0..own.len()).map(of).sum();
    if work <= ROUND * product {
        return false;
    }
    let share = match product > 0.0 {
        true => (1.0 - 2.0 * work / product).max(0.0),
        false => 0.0,
    };
    for (i, p) in impulses.iter_mut().enumerate() {
        if terms[i].rigid {
            *p *= share;
        }
    }
    true
}
