//! Event location: the instant inside a step at which a fast contact closes.
//!
//! Contacts that close fast are deferred (see [`super::rules`]). Without event location only those of swept bodies
//! are, in large crowds only where they rebound or get deep, and all of small clusters with
//! [late rebounds](super::late_rebounds) or [deep contacts](super::deep_impacts). A trial step without them gives
//! every body a path, `q(t) = q_A + t u_A + t² (u_E − u_A)/(2h)`. On it the gap of a deferred
//! contact is a parabola. Where the gap falls through zero, the bodies of the contact's cluster are
//! stepped again by themselves: to that instant, through an impact of zero duration, and on. All
//! other bodies keep the result of the trial, so that an event costs only as much as its own
//! cluster.

use super::cluster::LATE;
use super::contact_cache::CachedContacts;
use super::interval::{Interval, Source, movable};
use super::islands::Islands;
use super::model::{
    Configuration, ContactPoint, Detection, ModelError, MultibodyModel, NearWanted, NormalLaw,
};
use super::rules::{Rules, reference_acceleration, rest_velocity, resting_speed, turning};
use super::solution::Solution;
use crate::contact::{NO_BODY, Vec3};

/// Gap \[m\] below which surfaces touch: the resolution of the detection, or the distance that the
/// reference acceleration closes in a hundredth of a step.
pub(super) fn touch_tolerance(contact: &ContactPoint, interval: &Interval, step: f64) -> f64 {
    let acceleration = reference_acceleration(contact, &interval.start, &interval.accelerations);
    let fall = rest_velocity(acceleration, step) * step;
    (2.0 * contact.gap_noise).max(1e-4 * fall)
}

/// Time after the start of `interval` at which a contact closes; `None` if it does not.
///
/// With `g(t) = c₀ + γ_A t + (γ_E − γ_A) t²/(2h)`, `c₀ = g_M − γ_A h/2`: the first root with
/// falling gap, or 0 where the surfaces touch and close at the start.
pub(super) fn crossing(
    interval: &Interval,
    solution: &Solution,
    contact: &ContactPoint,
    step: f64,
) -> Option<f64> {
    let h = interval.length;
    let c1 = contact.rows.velocity(&interval.start).x;
    let c2 = (contact.rows.velocity(&solution.end).x - c1) / (2.0 * h);
    let c0 = contact.gap - 0.5 * h * c1;
    if c1 < 0.0 && c0 <= touch_tolerance(contact, interval, step) {
        return Some(0.0);
    }
    let c0 = c0.max(0.0);
    let square = c1 * c1 - 4.0 * c0 * c2;
    if square <= 0.0 {
        return None;
    }
    let root = square.sqrt();
    let time = if c1 < 0.0 {
        2.0 * c0 / (root - c1)
    } else if c2 < 0.0 {
        -(c1 + root) / (2.0 * c2)
    } else {
        return None;
    };
    (time <= h).then_some(time)
}

/// Whether a contact may close on the path of `interval` although its parabola does not. Rotation
/// of bodies, or sliding along curved surfaces, changes the gap to second order in the step.
pub(super) fn may_close(interval: &Interval, solution: &Solution, contact: &ContactPoint) -> bool {
    let h = interval.length;
    let gamma = contact.rows.velocity(&interval.start);
    let (mut turn, mut spin, mut arms) = (0.0, 0.0f64, 0.0);
    for (omega, arm) in turning(contact, &interval.start) {
        turn += omega * omega * arm;
        spin += omega.abs();
        arms += arm;
    }
    let slide = gamma.y.abs();
    let curve = if arms > 0.0 {
        slide * slide / arms
    } else {
        0.0
    };
    let bend = 0.5 * h * h * (turn + slide * spin + curve);
    let end = contact.gap + 0.5 * h * contact.rows.velocity(&solution.end).x;
    let start = contact.gap - 0.5 * h * gamma.x;
    end.min(start) <= bend
}

/// Whether a contact lands with little rebound.
pub(super) fn lands(contact: &ContactPoint) -> bool {
    matches!(contact.law, NormalLaw::Rigid { restitution } if restitution < 0.5)
}

/// Least number of linked bodies that form a crowd.
const CROWD: usize = 5;

/// Most bodies of a crowd in which a landing is located that the last step did not see. Each costs
/// some solves of the whole crowd; without them such a landing overlaps by up to half of its way in
/// the step.
pub(super) const LOCATED_CROWD: u32 = 64;

/// Finds the crowds: groups of many bodies linked by contacts that may close within the step.
///
/// A crowd has too many landings without rebound to locate each of them. Its near contacts are kept
/// from closing instead, as without events. Only a landing that the last step did not see is located,
/// and in a crowd of more than [`LOCATED_CROWD`] bodies not even that.
pub(super) fn find_crowds(interval: &mut Interval, inverse_mass: &[Vec3]) {
    let contacts = interval.detection.contacts.iter();
    let links: Vec<[u32; 2]> = contacts
        .map(|c| movable(c.rows.bodies, inverse_mass))
        .filter(|bodies| !bodies.contains(&NO_BODY))
        .collect();
    let mut islands = Islands::default();
    islands.build(inverse_mass.len(), links.iter().copied());
    interval.crowded.clear();
    interval.crowded.resize(inverse_mass.len(), 0);
    for k in 0..islands.len() {
        let blocks = islands.blocks(k);
        let mut bodies: Vec<u32> = blocks.iter().flat_map(|&i| links[i as usize]).collect();
        bodies.sort_unstable();
        bodies.dedup();
        if bodies.len() >= CROWD {
            let count = bodies.len() as u32;
            for body in bodies {
                interval.crowded[body as usize] = count;
            }
        }
    }
}

/// Finds the bodies of large crowds that are swept although nobody asked for it, and whose fast contacts the rule of all
/// others holds as well: by the midpoint none of them overlaps by more than half of [`Sweep`](super::Sweep::thickness).
///
/// To locate such a landing, a heap of hundreds would be stepped again and again. Where its solves were used up, what
/// was left of the step drove grains of 4 cm up to 33 mm into each other. The choice holds for a whole step: a body that
/// gets deep into one of a row has to stop at the first of them.
pub(super) fn find_plain(interval: &mut Interval, inverse_mass: &[Vec3], dt: f64) {
    let Interval {
        crowded,
        plain,
        roles,
        start,
        detection,
        ..
    } = interval;
    let asked = |body: usize| roles.sweeps.get(body).is_some_and(|sweep| sweep.all);
    let crowd = crowded.iter().enumerate();
    plain.clear();
    plain.extend(crowd.map(|(body, size)| *size as usize > LATE && !asked(body)));
    for contact in &detection.contacts {
        let bodies = contact.rows.bodies;
        let thickness = roles.swept_thickness(bodies, inverse_mass);
        let deep = thickness.is_some_and(|thickness| contact.gap < -0.5 * thickness);
        if deep && roles.swept(bodies, contact.rows.velocity(start), dt, inverse_mass) {
            for body in movable(bodies, inverse_mass) {
                if let Some(plain) = plain.get_mut(body as usize) {
                    *plain = false;
                }
            }
        }
    }
}

/// Also defers a rebounding contact of two bodies that touch nothing else, however slowly it
/// closes. Such bodies need no solve, so that every bounce can be followed.
pub(super) fn release_lone(
    interval: &Interval,
    solution: &mut Solution,
    rules: &Rules,
    inverse_mass: &[Vec3],
    step: f64,
) {
    for k in 0..solution.islands.len() {
        let &[i] = solution.islands.blocks(k) else {
            continue;
        };
        let block = &interval.blocks[i as usize];
        let (Source::Contact(index), false) = (block.source, block.pressed_before) else {
            continue;
        };
        let contact = &interval.detection.contacts[index];
        let NormalLaw::Rigid { restitution: e } = contact.law else {
            continue;
        };
        let swept = || {
            let roles = &interval.roles;
            roles.swept(contact.rows.bodies, block.gamma_a, step, inverse_mass)
        };
        if !rules.events && !swept() {
            continue;
        }
        let speed = contact.rows.velocity(&interval.start).x;
        let at_start = contact.gap - 0.5 * interval.length * speed;
        let a = reference_acceleration(contact, &interval.start, &interval.accelerations);
        let rests = at_start <= touch_tolerance(contact, interval, step)
            && speed.abs() <= resting_speed(contact, a, step);
        if e > 0.0 && !rests && solution.impulses[i as usize].x > 0.0 {
            solution.release(interval, i, index);
        }
    }
}

/// Replaces contacts with thin bodies that another body passed before the midpoint. At the midpoint
/// they show their far side and seem to open. They are detected at the start of the step instead,
/// and moved to the midpoint.
pub(super) fn see_from_the_start(
    model: &mut dyn MultibodyModel,
    interval: &mut Interval,
    cache: &CachedContacts,
    rules: &Rules,
    start: impl Fn(u32) -> Option<Configuration>,
    length: f64,
    step: f64,
) -> Result<(), ModelError> {
    let mut pairs: Vec<[u32; 2]> = Vec::new();
    let mut bodies: Vec<u32> = Vec::new();
    for contact in &interval.detection.contacts {
        // a swept body cannot have been deep inside: it has passed through
        let (roles, w) = (&interval.roles, model.inverse_mass());
        let thickness = match rules.sweeps {
            true => roles.swept_thickness(contact.rows.bodies, w),
            false => None,
        };
        if !rules.events && thickness.is_none() {
            continue;
        }
        let gamma = contact.rows.velocity(&interval.start);
        let rigid = matches!(contact.law, NormalLaw::Rigid { .. });
        let at_start = contact.gap - 0.5 * length * gamma.x;
        if !rigid || gamma.x <= 0.0 || at_start >= -2.0 * contact.gap_noise {
            continue;
        }
        let pressed = || cache.get(&contact.key).is_some_and(|m| m.impulse.x > 0.0);
        let through =
            thickness.is_some_and(|least| gamma.x * step > 0.5 * least || at_start < -0.5 * least);
        if through || rules.events && !pressed() {
            pairs.push(contact.surfaces);
            bodies.extend(contact.rows.bodies.iter().filter(|b| **b != NO_BODY));
        }
    }
    if pairs.is_empty() {
        return Ok(());
    }
    pairs.dedup();
    let mut found = detect_at(model, &pairs, bodies, &start, step)?;
    // what the straight normals of the start say is looked at on the path: bodies may pass beside each other
    let mut meet: Vec<[u32; 2]> = Vec::new();
    for contact in &found.contacts {
        let closing = -contact.rows.velocity(&interval.start).x;
        if contact.gap < 0.5 * length * closing
            && !meet.contains(&contact.surfaces)
            && meets_on_path(model, interval, contact, &start, 0.5 * length, step)?
        {
            meet.push(contact.surfaces);
        }
    }
    let w = model.inverse_mass();
    // a swept body may have been left in a shallow overlap
    let least = |contact: &ContactPoint| {
        let thickness = interval.roles.swept_thickness(contact.rows.bodies, w);
        let thickness = thickness.filter(|_| rules.sweeps);
        thickness.map_or(0.0, |thickness| -0.5 * thickness)
    };
    let overlaps = |c: &ContactPoint| c.gap < least(c) - touch_tolerance(c, interval, step);
    let held = held_from_the_start(&found.contacts, &interval.detection.contacts, overlaps);
    let holds = |c: &ContactPoint| held.contains(&parts_of(c));
    let mut passed: Vec<[u32; 2]> = Vec::new();
    found.contacts.retain_mut(|contact| {
        let closing = -contact.rows.velocity(&interval.start).x;
        let in_front = contact.gap > least(contact) && !holds(contact);
        let touches = contact.gap <= touch_tolerance(contact, interval, step);
        contact.gap -= 0.5 * length * closing;
        let passes = in_front && contact.gap < 0.0 && meet.contains(&contact.surfaces);
        if passes {
            passed.push(contact.surfaces);
        }
        passes || in_front && touches
    });
    // contacts of such a pair that touch at the start may be pressed, though they open
    found.contacts.retain(|c| passed.contains(&c.surfaces));
    let replaced = |c: &ContactPoint| found.contacts.iter().any(|f| f.surfaces == c.surfaces);
    // another contact of the two that closes is not the far side of anything: it was far away before
    let known = |c: &ContactPoint| found.contacts.iter().any(|f| f.key == c.key);
    let closes = |c: &ContactPoint| c.rows.velocity(&interval.start).x < 0.0 && !known(c);
    let contacts = &mut interval.detection.contacts;
    contacts.retain(|c| !replaced(c) || holds(c) || closes(c));
    contacts.append(&mut found.contacts);
    Ok(())
}

/// Least share of a path by which the search along it advances, and most steps of it: Newton's are shorter.
const STRIDE: f64 = 1.0 / 64.0;
const SEARCHES: usize = 256;

/// Whether the surfaces of a contact, which is that at the `start`, touch before a time `until` \[s\] if the bodies
/// go on with their velocities. Advances as far as the bound of their distance allows, or to where a contact closes.
fn meets_on_path(
    model: &mut dyn MultibodyModel,
    interval: &Interval,
    contact: &ContactPoint,
    start: impl Fn(u32) -> Option<Configuration>,
    until: f64,
    step: f64,
) -> Result<bool, ModelError> {
    let bodies = contact.rows.bodies.into_iter().filter(|b| *b != NO_BODY);
    let bodies: Vec<u32> = bodies.collect();
    let mut time = 0.0;
    for _ in 0..SEARCHES {
        if time >= until {
            return Ok(false);
        }
        let mut places = Vec::new();
        for &body in &bodies {
            let Some(place) = start(body) else {
                continue;
            };
            let here = model.configuration(body as usize);
            model.set_configuration(body as usize, &place);
            model.shift(body as usize, &interval.start[body as usize], time);
            places.push((body, model.configuration(body as usize)));
            model.set_configuration(body as usize, &here);
        }
        let place = |body: u32| places.iter().find(|p| p.0 == body).map(|p| p.1);
        let found = detect_at(model, &[contact.surfaces], bodies.clone(), place, step)?;
        let touches = |c: &ContactPoint| c.gap <= touch_tolerance(c, interval, step);
        let Some(near) = found.near.first().filter(|near| near.bound > 0.0) else {
            return Ok(true);
        };
        if found.contacts.iter().any(touches) {
            return Ok(true);
        }
        let u = |side: usize| interval.start.get(near.bodies[side] as usize).copied();
        let [a, b] = [u(0), u(1)].map(Option::unwrap_or_default);
        let turning = a.z.abs() * near.radii[0] + b.z.abs() * near.radii[1];
        let free = near.bound / ((b - a).xy().norm() + turning);
        let closes = |c: &ContactPoint| c.gap / -c.rows.velocity(&interval.start).x;
        let closing = found.contacts.iter().map(closes).filter(|time| *time > 0.0);
        time += closing.fold(free.max(STRIDE * until), f64::min);
    }
    // what is so near for so long is not passed beside
    Ok(true)
}

/// The surfaces and the parts of them that touch in a contact.
fn parts_of(contact: &ContactPoint) -> [[u32; 2]; 2] {
    [contact.surfaces, contact.places.map(|place| place.edge)]
}

/// The parts with an overlap at the start of the step, in the direction of that at its midpoint: they
/// passed through nothing in between.
fn held_from_the_start(
    start: &[ContactPoint],
    midpoint: &[ContactPoint],
    overlaps: impl Fn(&ContactPoint) -> bool,
) -> Vec<[[u32; 2]; 2]> {
    let agrees = |a: &ContactPoint, b: &ContactPoint| {
        parts_of(a) == parts_of(b) && a.normal.dot(&b.normal) > std::f64::consts::FRAC_1_SQRT_2
    };
    let held = start.iter().filter(|c| overlaps(c));
    let held = held.filter(|c| midpoint.iter().any(|m| agrees(c, m)));
    held.map(parts_of).collect()
}

/// Contacts between `pairs` of surfaces with `bodies` at the poses that `start` returns. The bodies
/// are then where they were.
pub(super) fn detect_at(
    model: &mut dyn MultibodyModel,
    pairs: &[[u32; 2]],
    mut bodies: Vec<u32>,
    start: impl Fn(u32) -> Option<Configuration>,
    step: f64,
) -> Result<Detection, ModelError> {
    bodies.sort_unstable();
    bodies.dedup();
    let moved: Vec<(usize, Configuration)> = bodies
        .iter()
        .filter(|&&b| start(b).is_some())
        .map(|&b| (b as usize, model.configuration(b as usize)))
        .collect();
    for &(body, _) in &moved {
        if let Some(place) = start(body as u32) {
            model.set_configuration(body, &place);
        }
    }
    let mut found = Detection {
        wants_near: NearWanted::All,
        ..Detection::default()
    };
    let result = model.detect_pairs(pairs, step, &mut found);
    for (body, place) in &moved {
        model.set_configuration(*body, place);
    }
    result.map(|()| found)
}
