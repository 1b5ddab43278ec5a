//! Finds the pairs that overlap, at the start of a step and after it.

use super::contact_cache::Overlaps;
use super::ends::{Ends, is_exempt};
use super::interval::{Interval, movable};
use super::midpoint_gaps::{STRIDE, least_size, opening};
use super::model::{ContactPoint, Detection, ModelError, NormalLaw};
use super::pair_set::KnownPairs;
use super::rules::{reference_acceleration, rest_velocity};
use super::solution::Solution;
use crate::contact::{NO_BODY, Vec2, Vec3};
use rustc_hash::FxHashSet;

/// Duration \[s\] from which an overlap counts as lasting.
pub const LASTING: f64 = 0.25;

/// Lasting overlap, over the size of the smaller body, above which a scene has not held by default.
pub const LARGE_OVERLAP: f64 = 1e-3;

/// Least share of an overlap that a step corrects, see [`share`].
const SHARE: f64 = 0.2;

/// Overlap above which a *late* pair is moved apart, in multiples of its slop; late pairs did not
/// overlap when first seen. The limit is larger for a pair that moves: its overlap may be an error
/// of one step that the next step undoes.
const TRIGGER: f64 = 10.0;
const TRIGGER_AT_REST: f64 = 2.0;

/// Slop of a pair at rest, as a share of the slop of a moving pair.
const SLOP_AT_REST: f64 = 0.01;

/// Speed below which a pair is at rest, as a share of the speed that the reference acceleration
/// gives in a step.
const REST: f64 = 0.1;

/// Surface pairs that overlapped when first seen, and those that [`find_late`] found in earlier
/// steps.
///
/// A new pair overlaps at the start if it does so along the normal of the midpoint. Bodies that pass each other turn
/// that normal: what is open at the midpoint, or rebounds, or with `events`, must be seen to overlap at the start. `at_start` finds the
/// contacts there of pairs of surfaces, and of bodies.
///
/// # Errors
/// Those of `at_start`.
pub(super) fn find_overlaps(
    last: &Overlaps,
    interval: &Interval,
    inverse_mass: &[Vec3],
    events: bool,
    at_start: impl FnOnce(&[[u32; 2]], Vec<u32>) -> Result<Detection, ModelError>,
) -> Result<Overlaps, ModelError> {
    let rigid = |c: &&ContactPoint| {
        matches!(c.law, NormalLaw::Rigid { .. })
            && movable(c.rows.bodies, inverse_mass) != [NO_BODY; 2]
    };
    let seen = interval.pairs.clone();
    let (mut open, mut late) = (last.open.clone(), last.late.clone());
    // in most steps the pairs do not change
    if seen != last.seen {
        let mut known = KnownPairs::new(&last.seen);
        let (mut moving, mut bodies): (Vec<[u32; 2]>, Vec<u32>) = (Vec::new(), Vec::new());
        for contact in interval.detection.contacts.iter().filter(rigid) {
            let pair = contact.key.pair;
            if known.contains(pair) {
                continue;
            }
            let opening = contact.rows.velocity(&interval.start);
            let at_start = contact.gap - 0.5 * interval.length * opening.x;
            if at_start >= -slop(contact, interval) {
                continue;
            }
            let looks = events || contact.gap > 0.0 || contact.law.restitution() > 0.0;
            if opening == Vec2::zeros() || !looks {
                open.insert(pair);
            } else {
                moving.push(contact.surfaces);
                bodies.extend(contact.rows.bodies.iter().filter(|b| **b != NO_BODY));
            }
        }
        if !moving.is_empty() {
            moving.dedup();
            let found = at_start(&moving, bodies)?;
            let overlaps = |c: &&ContactPoint| c.gap < -slop(c, interval);
            for contact in found.contacts.iter().filter(rigid).filter(overlaps) {
                open.insert(contact.key.pair);
            }
        }
        // forget pairs that are gone
        for own in [&mut open, &mut late]
            .into_iter()
            .filter(|own| !own.is_empty())
        {
            let now: FxHashSet<u64> = seen.iter().copied().collect();
            own.retain(|pair| now.contains(&pair));
        }
    }
    Ok(Overlaps { seen, open, late })
}

/// Adds the pairs that overlap after a step by more than the trigger of [`limits`], for example after
/// an impact. Such overlaps can persist, because contacts push bodies out no faster than they came in.
///
/// Contacts without impulse that open by themselves, impacts of this step, and contacts of `exempt`
/// bodies (see [`exempt_bodies`]) do not count. Of [`Ends`] all that overlap do. What slides far past a body that an impact
/// located in the step `struck` must be seen to overlap: `at_end` finds the contacts at the end of pairs of surfaces.
///
/// # Errors
/// Those of `at_end`.
pub(super) fn find_late(
    overlaps: &mut Overlaps,
    interval: &Interval,
    solution: &Solution,
    ends: &Ends,
    inverse_mass: &[Vec3],
    (exempt, struck): (&[bool], &[bool]),
    at_end: impl FnOnce(&[[u32; 2]]) -> Result<Detection, ModelError>,
) -> Result<(), ModelError> {
    let path = ends.path;
    let mut unsure: Vec<&ContactPoint> = Vec::new();
    for (index, contact) in interval.detection.contacts.iter().enumerate() {
        let pair = contact.key.pair;
        if contact.gap >= -2.0 * contact.gap_noise
            || !matches!(contact.law, NormalLaw::Rigid { .. })
            || overlaps.open.contains(pair)
            || overlaps.late.contains(pair)
            || movable(contact.rows.bodies, inverse_mass) == [NO_BODY; 2]
            || is_exempt(contact, exempt)
            || is_exempt(contact, &ends.turned)
        {
            continue;
        }
        let turned = turned((index, contact), interval, solution, path);
        let opening = opening(contact, interval, solution, path) + turned;
        let [trigger, _] = limits(
            (Some(index), contact, false),
            interval,
            solution,
            inverse_mass,
        );
        if -(contact.gap + opening) <= trigger {
            continue;
        }
        let block = interval.block_of(index);
        // on a path of located impacts a contact may open up to one of them, and stay
        let parting = interval.length * contact.rows.velocity(&solution.end).x + turned;
        let parts = parting > -share(interval.length) * contact.gap;
        let stays = match block {
            Some(i) if interval.blocks[i].impact => false,
            Some(i) => solution.impulses[i].x > 0.0 || !parts,
            None => !parts,
        };
        let far = |path| slides_past(contact, interval, solution, path, inverse_mass);
        if stays && is_exempt(contact, struck) && path.is_some_and(far) {
            unsure.push(contact);
        } else if stays {
            overlaps.late.insert(pair);
        }
    }
    for (index, contact) in &ends.contacts {
        let pair = contact.key.pair;
        let [trigger, _] = limits((*index, contact, true), interval, solution, inverse_mass);
        let rigid = matches!(contact.law, NormalLaw::Rigid { .. })
            && movable(contact.rows.bodies, inverse_mass) != [NO_BODY; 2];
        let known = overlaps.open.contains(pair) || is_exempt(contact, exempt);
        if rigid && !known && -contact.gap > trigger {
            overlaps.late.insert(pair);
        }
    }
    if !unsure.is_empty() {
        let pairs: Vec<[u32; 2]> = unsure.iter().map(|c| c.surfaces).collect();
        for found in at_end(&pairs)?.contacts {
            let known = unsure.iter().any(|c| c.key.pair == found.key.pair);
            if known && found.gap < -TRIGGER * slop(&found, interval) {
                overlaps.late.insert(found.key.pair);
            }
        }
    }
    Ok(())
}

/// Whether the bodies of a contact slide so far along each other, on a `path` of located impacts, that its normal
/// does not tell their gap at the end.
fn slides_past(
    contact: &ContactPoint,
    interval: &Interval,
    solution: &Solution,
    path: &[Vec3],
    inverse_mass: &[Vec3],
) -> bool {
    let [mean, end] = [path, &solution.end].map(|u| contact.rows.velocity(u));
    let way = interval.length * mean.y.abs().max(end.y.abs());
    mean != end && way > STRIDE * least_size(&contact.rows, inverse_mass)
}

/// Share of an overlap that a step corrects. The deepest overlap that a step may take up at once,
/// [`STRIDE`], falls to [`LARGE_OVERLAP`] within [`LASTING`]; at small steps the share is a fifth.
pub(super) fn share(dt: f64) -> f64 {
    SHARE.max(1.0 - (LARGE_OVERLAP / STRIDE).powf(dt / LASTING))
}

/// Whether a contact, by its index in the detection, acts in this step, had no impulse in the step before, and is no
/// deeper than it closes in a step at the start velocity. It closes by half of that up to the midpoint; the rest is for
/// bodies that turn. Such a contact has passed the surface at which it should have stopped, and all of that is
/// taken back at once: what slides over one corner after the other lands anew in every second step, and would never lose
/// its overlap by shares.
///
/// What is deeper came through another side. Of a low step in a floor the top is seen first: moved out over it at once,
/// a body would never meet the face of the step.
pub(super) fn landed((index, contact): (usize, &ContactPoint), interval: &Interval) -> bool {
    let came = -interval.length * contact.rows.velocity(&interval.start).x;
    -contact.gap < came + slop(contact, interval)
        && interval
            .block_of(index)
            .is_some_and(|i| !interval.blocks[i].continues)
}

/// Overlaps \[m\] of a late pair: the trigger above which it is moved apart, and the slop down to
/// which it is moved.
///
/// Both begin at the depth at which the scheme holds a contact on a curved path, or has held it
/// before: moved out of it, the contact sinks in again, and gains energy each time. What is known to sink is left less. A pair at rest
/// is moved all the same.
///
/// Above that depth they scale with the motion that the scheme does not resolve, up to
/// [`LARGE_OVERLAP`] of a body with the contact on its border. A contact [at the end](Ends) that persists on its turning
/// path keeps as much too: it would come back in each step.
pub(super) fn limits(
    (index, contact, at_end): (Option<usize>, &ContactPoint, bool),
    interval: &Interval,
    solution: &Solution,
    inverse_mass: &[Vec3],
) -> [f64; 2] {
    let whole = slop(contact, interval);
    let slop_at_rest = (2.0 * contact.gap_noise).max(SLOP_AT_REST * whole);
    let acceleration = reference_acceleration(contact, &interval.start, &interval.accelerations);
    let slow = REST * acceleration * interval.length;
    // a body that rolls moves, though its contact point does not
    let speed = |u: &Vec<Vec3>| {
        let centre = |body: u32| u.get(body as usize).map_or(Vec2::zeros(), |u| u.xy());
        let [a, b] = contact.rows.bodies.map(centre);
        contact.rows.velocity(u).norm().max((b - a).norm())
    };
    let ends = [speed(&interval.start), speed(&solution.end)];
    if ends[0].max(ends[1]) > slow {
        let block = index.and_then(|index| interval.block_of(index));
        let block = block.map(|i| &interval.blocks[i]);
        let held = block.map_or(0.0, |block| block.held[0].max(block.held[1]));
        let large = || LARGE_OVERLAP * least_size(&contact.rows, inverse_mass);
        // what touches for the first time may have come deeper in one step
        let most = block.map_or(f64::INFINITY, |_| large());
        let slop = whole.min(most / TRIGGER).max(slop_at_rest);
        let left = match at_end && block.is_some_and(|block| block.continues) {
            true => held + large(),
            false => held,
        };
        return [left + TRIGGER * slop, left + slop];
    }
    [TRIGGER_AT_REST * slop_at_rest, slop_at_rest]
}

/// What the turning of its rows adds \[m\] to the [`opening`] of a contact that [sinks](super::rules::Situation). On
/// a `path` of located impacts it is not known.
pub(super) fn turned(
    (index, contact): (usize, &ContactPoint),
    interval: &Interval,
    solution: &Solution,
    path: Option<&[Vec3]>,
) -> f64 {
    let normal = |u: &[Vec3]| contact.rows.velocity(u).x;
    if path.is_some_and(|path| normal(path) != normal(&solution.end)) {
        return 0.0;
    }
    let block = interval.block_of(index).map(|i| &interval.blocks[i]);
    let turning = block.filter(|b| b.sinks).and_then(|b| b.turning);
    turning.map_or(0.0, |c| 0.5 * c.x * interval.length * interval.length)
}

/// Bodies whose late overlaps are not corrected in this step: those of islands whose push-outs were dropped, those
/// of crowds, which have a correction of their own, and those that [wait](Ends::waits).
pub(super) fn exempt_bodies(ends: &Ends, interval: &Interval, solution: &Solution) -> Vec<bool> {
    let mut exempt = ends.waits.clone();
    exempt.resize(interval.start.len(), false);
    for (k, outcome) in solution.outcomes.iter().enumerate() {
        if outcome.relaxed || outcome.crowd {
            let sides = |i: &u32| interval.sides[*i as usize];
            for body in solution.islands.blocks(k).iter().flat_map(sides) {
                if let Some(exempt) = exempt.get_mut(body as usize) {
                    *exempt = true;
                }
            }
        }
    }
    exempt
}

/// Overlap \[m\] that is not corrected: noise, or a hundredth of the distance that the reference
/// acceleration covers in a step.
pub(super) fn slop(contact: &ContactPoint, interval: &Interval) -> f64 {
    let acceleration = reference_acceleration(contact, &interval.start, &interval.accelerations);
    let fall = rest_velocity(acceleration, interval.length) * interval.length;
    (2.0 * contact.gap_noise).max(0.01 * fall)
}
