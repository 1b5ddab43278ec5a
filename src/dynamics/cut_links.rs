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
//! and `k`, `I`, `m r²` as in (2) there, `k` without contacts as far as they do not outweigh the pins: half the
//! limit of stability, and the limit with contacts. The forces of each part tell the
//! length of the next, as the tension may rise within the step. An island that needs more than half of
//! [`PARTS`] keeps the added inertia, and gets it back for as long as parts are not stable.
//! One that was cut is cut in the following steps too, as long as it has links under tension: the change
//! from one inertia to the other would brake the links. Crowds are not cut, for their cost.
//!
//! # Source
//! Own construction.

use super::contact_cache::PulledLink;
use super::interval::{Interval, Source, movable};
use super::midpoint_gaps::least_size;
use super::overlapping::LARGE_OVERLAP;
use super::pulled_links::StiffLink;
use super::solution::Solution;
use super::wide_turns::wide_turns;
use crate::contact::{NO_BODY, Vec3};

/// Most parts of a step.
const PARTS: f64 = 32.0;

/// How many times longer than in (1) a part may be and still be stable.
const TO_STABILITY: f64 = 1.4;

/// A link whose island is stepped in parts.
#[derive(Debug, Clone, Copy)]
pub(super) struct CutLink {
    pub link: StiffLink,
    /// The same for the next step.
    pub next: PulledLink,
}

impl CutLink {
    pub fn of(body: usize, link: PulledLink, inverse_mass: &[Vec3]) -> CutLink {
        let inertia = 1.0 / inverse_mass[body].z;
        CutLink {
            link: StiffLink::in_parts(body, link.stiffness, inertia),
            next: PulledLink {
                inertia,
                cut: true,
                in_parts: true,
                ..link
            },
        }
    }
}

/// Whether the parts of a step are short enough for all links that are stepped in parts: for stability,
/// or well below that if they were not in the last step. Forces of impacts do not count.
pub(super) fn parts_suffice(links: &[PulledLink], step: f64) -> bool {
    let most = |link: &PulledLink| PARTS * if link.in_parts { TO_STABILITY } else { 0.5 };
    let mut cut = links.iter().filter(|link| link.cut);
    cut.all(|link| link.lasting * step <= most(link))
}

/// Length \[s\] of the first of the equal parts of a `rest` of the step that (1) asks for.
pub(super) fn part_length(links: &[CutLink], rest: f64, step: f64) -> f64 {
    let rate = links.iter().map(|cut| cut.next.rate).fold(0.0, f64::max);
    let most = (rest * PARTS / step).round();
    rest / (rest * rate).ceil().min(most).max(1.0)
}

/// Whether an interval is long enough for its pin forces to be those of the links, and not of gaps that
/// are closed in it.
pub(super) fn is_telling(length: f64, step: f64) -> bool {
    length > 0.5 * step / PARTS
}

/// The `links` of islands that are stepped in parts. `start` are the velocities at the start of the step
/// and `inverse_mass` the masses, both without added inertia. `in_parts` tells whether islands that were cut are cut again.
pub(super) fn links_to_cut(
    links: &[(usize, PulledLink)],
    interval: &Interval,
    solution: &Solution,
    (start, inverse_mass): (&[Vec3], &[Vec3]),
    in_parts: bool,
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
        let start = joint.distance_after(-half * joint.rows.velocity(start));
        let end = joint.distance_after(half * joint.rows.velocity(&solution.end));
        let opened = joint.distance().max(end) - start;
        if opened > LARGE_OVERLAP * least_size(&joint.rows, inverse_mass) {
            mark(&mut wide, interval.sides[i]);
        }
    }
    let mut cuts = Vec::new();
    for (k, outcome) in solution.outcomes.iter().enumerate() {
        let sides = |i: &u32| movable(interval.blocks[*i as usize].bodies, inverse_mass);
        let bodies: Vec<u32> = solution.islands.blocks(k).iter().flat_map(sides).collect();
        let is_wide = |b: &u32| wide.get(*b as usize) == Some(&true);
        let own = |body: &usize| bodies.contains(&(*body as u32));
        let all = || links.iter().filter(|(b, _)| own(b));
        // few links are cut, and to look for one among the bodies takes long
        let before = in_parts && links.iter().any(|(b, link)| link.cut && own(b));
        if !before && (outcome.crowd || !bodies.iter().any(is_wide)) {
            continue;
        }
        let of = |(b, link): &(usize, PulledLink)| CutLink::of(*b, *link, inverse_mass);
        let new: Vec<CutLink> = all().map(of).collect();
        // half of the parts, as the tension may rise
        if before
            || new
                .iter()
                .all(|cut| cut.next.rate * interval.length <= 0.5 * PARTS)
        {
            cuts.extend(new);
        }
    }
    // a body that dominates another may be in the islands of both
    cuts.sort_by_key(|cut| cut.link.body);
    cuts.dedup_by_key(|cut| cut.link.body);
    cuts
}

fn mark(wide: &mut [bool], bodies: [u32; 2]) {
    for body in bodies.into_iter().filter(|b| *b != NO_BODY) {
        wide[body as usize] = true;
    }
}
