//! Scales impulses that add energy. Scaled impulses stay in the friction cone.

use super::constraint_work::work;
use super::island_problem::IslandProblem;
use crate::contact::{ContactProblem, Vec2};

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

/// Scales the impulses of an island so that its pins and locked axes give at most `room` \[J\],
///
/// ```text
/// W(s P) = s Σ Pᵀ (γ_A + γ_F)/2 + s² Σ Pᵀ G P/2                                   (1)
/// ```
///
/// with the sums over their blocks. In a nearly singular problem, such as that of a taut bridge, a residual
/// of round-off can do more work than the step has energy. Where the residual gives no more than `room` nothing is
/// scaled. `problem` is the one that the impulses solve, without closing velocities. Returns whether it changed
/// anything.
pub(super) fn scale_joints(
    problem: &ContactProblem,
    island: &IslandProblem,
    impulses: &mut [Vec2],
    room: f64,
) -> bool {
    let mut velocities = Vec::new();
    problem.velocities(impulses, &mut velocities);
    let (mut first, mut second, mut left) = (0.0, 0.0, 0.0);
    for own in &island.bilateral {
        let k = own.block;
        let (p, terms) = (0.5 * impulses[k], &island.terms[k]);
        first += p.dot(&(terms.gamma_a + terms.gamma_f));
        second += p.dot(&(velocities[k] - problem.free[k]));
        left += p.dot(&velocities[k]);
    }
    if left <= room || first + second <= room {
        return false;
    }
    // W(0) = 0 and W(1) > room: one crossing in between
    let root = (first * first + 4.0 * second * room).max(0.0).sqrt();
    let scale = match first > 0.0 {
        true => 2.0 * room / (root + first),
        false => (root - first) / (2.0 * second),
    };
    for p in impulses {
        *p *= scale.clamp(0.0, 1.0);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::super::contact_cache::JointEnergy;
    use super::super::island_problem::{BilateralJoint, Terms};
    use super::*;
    use crate::contact::{BodyOperator, Delassus, Law, NO_BODY, Rows, Vec3};

    /// A body of 1 kg on a pin, moved by `speed` \[m/s\], to which the solver gave an impulse of `p` [N s].
    fn pinned(speed: f64, p: f64) -> (IslandProblem, Vec<Vec2>) {
        let gamma = Vec2::new(speed, 0.0);
        let rows = Rows {
            bodies: [NO_BODY, 0],
            jacobian: [[Vec3::zeros(); 2], [Vec3::x(), Vec3::y()]],
        };
        let island = IslandProblem {
            problem: ContactProblem {
                operator: Delassus::Bodies(BodyOperator {
                    inverse_mass: vec![Vec3::new(1.0, 1.0, 0.0)],
                    rows: vec![rows],
                }),
                free: vec![gamma],
                laws: vec![Law::Pin],
            },
            terms: vec![Terms {
                gamma_a: gamma,
                gamma_f: gamma,
                bias: gamma,
                rigid: false,
                bilateral: true,
                impact: false,
                pressed_before: false,
            }],
            bilateral: vec![BilateralJoint {
                block: 0,
                joint: 0,
                energy: JointEnergy::default(),
            }],
            ..IslandProblem::default()
        };
        (island, vec![Vec2::new(p, 0.0)])
    }

    /// The kinetic energy after the step, m (v + s P)²/2, is at most that before it and the room.
    #[test]
    fn joints_give_no_more_than_their_room() {
        for (speed, impulse, room, after) in [
            (-1.0, 1.0, 0.0, 0.0),  // the pin stops the body
            (-1.0, 1.5, 0.0, 0.5),  // too much, but it takes energy
            (-1.0, 4.0, 0.0, 1.0),  // thrown back with its own speed
            (-1.0, 4.0, 1.5, 2.0),  // and with the room
            (1.0, 4.0, 1.5, 2.0),   // pushed on
            (1.0, 4.0, 0.0, 1.0),   // not at all
            (1.0, 4.0, 100.0, 5.0), // there is room for all of it
        ] {
            let (island, mut impulses) = pinned(speed, impulse);
            let changed = scale_joints(&island.problem, &island, &mut impulses, room);
            let speed = f64::abs(speed + impulses[0].x);
            assert!((speed - after).abs() < 1e-12, "{speed} m/s, not {after}");
            assert_eq!(changed, impulses[0].x != impulse);
        }
    }
}
