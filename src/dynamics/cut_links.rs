//! Islands whose links turn too far for one interval.
//!
//! The added inertia of [`super::pulled_links`] keeps links under tension stable at any step length, but
//! then they follow what pulls them late: pins open, and links press into the pulley that they run onto.
//! Where a pin of such an island is open by more than [`LARGE_OVERLAP`] of the smaller body, or a lasting
//! contact overlaps by more, the island is stepped again, with the true inertia, in equal parts of the
//! length h with
//!
//! ```text
//! h² k / (I + m r²) ≤ 2                                                          (1)
//! ```
//!
//! and `k`, `I`, `m r²` as in (2) there: half the limit of stability. The forces of each part tell the
//! length of the next, as the tension may rise within the step. An island that needs more than [`PARTS`]
//! parts keeps the added inertia. One that was cut is cut in the following steps too, as long as it has
//! links under tension: the change from one inertia to the other would brake the links.
//!
//! # Source
//! Own construction.

use super::contact_cache::PulledLink;
use super::interval::{Interval, Source, movable};
use super::midpoint_gaps::least_size;
use super::pulled_links::StiffLink;
use super::recovery::LARGE_OVERLAP;
use super::solution::Solution;
use super::wide_turns::wide_turns;
use crate::contact::{NO_BODY, Vec3};

/// Most parts of a step.
const PARTS: f64 = 32.0;

/// A link whose island is stepped in parts.
#[derive(Debug, Clone, Copy)]
pub(super) struct CutLink {
    pub link: StiffLink,
    /// The same for the next step.
    pub next: PulledLink,
    /// `√(k / (2 (I + m r²)))` [1/s].
    rate: f64,
}

impl CutLink {
    pub fn of(body: usize, link: PulledLink, inverse_mass: &[Vec3]) -> CutLink {
        let inertia = 1.0 / inverse_mass[body].z;
        CutLink {
            link: StiffLink::cut(body, link.stiffness, inertia),
            next: PulledLink {
                inertia,
                cut: true,
                ..link
            },
            rate: (0.5 * link.stiffness / (inertia + link.support)).sqrt(),
        }
    }
}

/// Length \[s\] of the first of the equal parts of a `rest` of the step that (1) asks for.
pub(super) fn part_length(links: &[CutLink], rest: f64, step: f64) -> f64 {
    let rate = links.iter().map(|link| link.rate).fold(0.0, f64::max);
    (rest / (rest * rate).ceil().max(1.0)).max(step / PARTS)
}

/// The `links` of islands that are stepped in parts. `inverse_mass` has the true masses.
pub(super) fn links_to_cut(
    links: &[(usize, PulledLink)],
    interval: &Interval,
    solution: &Solution,
    inverse_mass: &[Vec3],
) -> Vec<CutLink> {
    if links.is_empty() {
        return Vec::new();
    }
    let mut wide = vec![false; inverse_mass.len()];
    for turn in wide_turns(interval, solution, inverse_mass, |_| true) {
        mark(&mut wide, turn.bodies);
    }
    for (i, block) in interval.blocks.iter().enumerate() {
        let Source::Joint(index) = block.source else {
            continue;
        };
        let (joint, half) = (&interval.detection.joints[index], 0.5 * interval.length);
        // what was open before the step is not opened by it
        let start = joint.distance_after(-half * block.gamma_a);
        let end = joint.distance_after(half * joint.rows.velocity(&solution.end));
        let opened = joint.distance().max(end) - start;
        if opened > LARGE_OVERLAP * least_size(&joint.rows, inverse_mass) {
            mark(&mut wide, interval.sides[i]);
        }
    }
    let mut cuts = Vec::new();
    for k in 0..solution.islands.len() {
        let sides = |i: &u32| movable(interval.blocks[*i as usize].bodies, inverse_mass);
        let bodies: Vec<u32> = solution.islands.blocks(k).iter().flat_map(sides).collect();
        let is_wide = |b: &u32| wide.get(*b as usize) == Some(&true);
        let own = links.iter().filter(|(b, _)| bodies.contains(&(*b as u32)));
        if !bodies.iter().any(is_wide) && !own.clone().any(|(_, link)| link.cut) {
            continue;
        }
        let own: Vec<_> = own
            .map(|(b, link)| CutLink::of(*b, *link, inverse_mass))
            .collect();
        if own.iter().all(|cut| cut.rate * interval.length <= PARTS) {
            cuts.extend(own);
        }
    }
    cuts
}

fn mark(wide: &mut [bool], bodies: [u32; 2]) {
    for body in bodies.into_iter().filter(|b| *b != NO_BODY) {
        wide[body as usize] = true;
    }
}
