//! Work of the constraints of an island in a step.

use super::island_problem::{BilateralJoint, IslandProblem, Terms};
use crate::contact::Vec2;

/// `W` of equation (1) of [`bound_contacts`](super::energy_bound::bound_contacts) \[J\].
pub(super) fn work_of(
    terms: &[Terms],
    impulses: &[Vec2],
    gamma_end: impl Fn(usize) -> Vec2,
) -> f64 {
    (0..impulses.len())
        .filter(|&i| terms[i].rigid)
        .map(|i| 0.5 * impulses[i].dot(&(terms[i].gamma_a + gamma_end(i))))
        .sum()
}

/// Energy \[J\] that the rigid contacts of an island add, with impulses that give the velocities
/// `G P + b`.
pub(super) fn work(island: &IslandProblem, impulses: &[Vec2], velocities: &[Vec2]) -> f64 {
    work_of(&island.terms, impulses, |i| velocities[i] - island.added[i])
}

/// The same of its pins and locked axes.
pub(super) fn joint_work(island: &IslandProblem, impulses: &[Vec2], velocities: &[Vec2]) -> f64 {
    let of = |own: &BilateralJoint| {
        let k = own.block;
        let gamma_end = velocities[k] - island.added[k];
        0.5 * impulses[k].dot(&(island.terms[k].gamma_a + gamma_end))
    };
    island.bilateral.iter().map(of).sum()
}
