//! Keeps the rotation of links under tension stable.
//!
//! A step uses the rows of pins at its midpoint, so it integrates the rotation of a link explicitly.
//! Forces `F_j` that pull a body apart at the arms `r_j` of its n pins resist a rotation of the body
//! with the geometric stiffness
//!
//! ```text
//! k = Σ F_j · r_j − (Σ F) · (Σ r) / n + Σ N_c (R_c + d_c)                          (1)
//! ```
//!
//! for a body on several pins, 0 on one. The last term is that of flat sides that slip on discs of radius
//! R, at the distance d from the body's centre towards the disc: as the body turns, the contact moves along
//! the side by (R + d) times the angle.
//!
//! In a belt under tension T the links of length L swing as a zigzag with `ω² = k/I`: `k = T L`, and
//! twice that round a pulley, whatever its radius, since `N (R + d) = T L` there.
//! The explicit integration is stable only for `Δt² k < 4 I`. A step therefore uses a larger inertia,
//!
//! ```text
//! Ĩ = max(I, Δt² k/3 − m r²)                                                    (2)
//! ω̃_A = ω_A √(Ĩ_before / Ĩ)                   where Ĩ grows                      (3)
//! ```
//!
//! with the forces of the previous step; the first step of a simulation is solved twice instead. A body
//! pinned to the world at the arm r swings about this pin, with the inertia `I + m r²`. Because of (3) a
//! growing inertia adds no energy. `k` may rise at any rate, but falls by at most 1 % per step: if it
//! oscillated, it would excite the swing.
//!
//! Energies and position corrections use the true inertia. The energy that the added inertia takes
//! and returns counts as work of the pins, see [`StiffLink::added_work`].
//!
//! # Source
//! Own construction. The limit is that of the leapfrog method.

use super::contact_cache::PulledLink;
use super::interval::{Interval, Source};
use super::model::{ContactKey, JointCoordinate, JointKind, JointPart};
use super::solution::Solution;
use crate::contact::{NO_BODY, Vec2, Vec3};

/// `Δt² k / Ĩ` of a stiffened link; 4 is the limit of stability.
const STABLE: f64 = 3.0;

/// Least share of the stiffness that counts for the parts of a step, see [`super::cut_links`]: with the
/// pins alone a part is at half the limit of stability, with all contacts it may be at the limit.
const OF_PARTS: f64 = 0.5;

/// Least stiffness of a link in the next step, as a share of its present one.
const FADES: f64 = 0.99;

/// The same of a link that is stepped in parts, whose inertia does not change with it. The less is kept,
/// the fewer parts follow an impact, and the more often a tension rises above what the last part has told.
const CUT_FADES: f64 = 0.9;

/// A link in a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct StiffLink {
    pub body: usize,
    stiffness: f64,
    /// `I` and `Ĩ` [kg m²].
    inertia: [f64; 2],
    /// `ω_A` and `ω̃_A` \[rad/s\].
    spin: [f64; 2],
    /// See [`PulledLink::cut`].
    cut: bool,
    /// Whether it is stepped in parts now.
    in_parts: bool,
}

/// Applies (2) and (3) to the bodies of a step that has just detected its joints. With `in_parts` it leaves
/// out links whose island is stepped in parts.
pub(super) fn stiffen(
    links: &[PulledLink],
    in_parts: bool,
    interval: &mut Interval,
    inverse_mass: &mut [Vec3],
    dt: f64,
) -> Vec<StiffLink> {
    let mut stiff = Vec::new();
    if links.is_empty() {
        return stiff;
    }
    for joint in &interval.detection.joints {
        for (side, &body) in joint.rows.bodies.iter().enumerate() {
            let named = links.binary_search_by_key(&(joint.key, side), PulledLink::name);
            let (Ok(found), Some(w)) = (named, inverse_mass.get_mut(body as usize)) else {
                continue;
            };
            if w.z <= 0.0 {
                continue;
            }
            let (link, own, body) = (&links[found], 1.0 / w.z, body as usize);
            let in_parts = link.cut && in_parts;
            let inertia = match in_parts {
                true => own,
                false => own.max(dt * dt * link.stiffness / STABLE - link.support),
            };
            let before = own.max(link.inertia);
            let spin = interval.start[body].z;
            if inertia > before {
                interval.start[body].z *= (before / inertia).sqrt();
            }
            if inertia > own {
                w.z = 1.0 / inertia;
            }
            stiff.push(StiffLink {
                body,
                stiffness: link.stiffness,
                inertia: [own, inertia],
                spin: [spin, interval.start[body].z],
                cut: link.cut,
                in_parts,
            });
        }
    }
    stiff
}

impl StiffLink {
    /// A link that keeps its inertia, as its island is stepped in parts.
    pub fn in_parts(body: usize, stiffness: f64, inertia: f64) -> StiffLink {
        StiffLink {
            body,
            stiffness,
            inertia: [inertia; 2],
            spin: [0.0; 2],
            cut: true,
            in_parts: true,
        }
    }

    /// Writes the true spin at the start of the step.
    pub fn restore(&self, start: &mut [Vec3]) {
        start[self.body].z = self.spin[0];
    }

    /// Kinetic energy at the end with the true inertia minus that with the added inertia \[J\].
    pub fn correction(&self, end: &[Vec3]) -> f64 {
        0.5 * (self.inertia[0] - self.inertia[1]) * end[self.body].z.powi(2)
    }

    /// True change of kinetic energy minus the change that the impulses of the step cause \[J\].
    pub fn added_work(&self, end: &[Vec3]) -> f64 {
        let change =
            |k: usize| 0.5 * self.inertia[k] * (end[self.body].z.powi(2) - self.spin[k].powi(2));
        change(0) - change(1)
    }
}

/// Sums over the pins of a body, and over its contacts.
#[derive(Debug, Clone, Copy, Default)]
struct Pins {
    first: Option<(ContactKey, usize)>,
    count: f64,
    pull: f64,
    /// `Σ N (R + d)` \[N m\].
    press: f64,
    force: Vec2,
    arm: Vec2,
    /// Largest squared arm of a pin to the world \[m²\].
    support: f64,
    /// Whether a joint locks its angle: such a body does not swing by itself.
    held: bool,
}

/// Finds the links that the next step stiffens, with their bodies, from the pin forces of this interval.
/// `inverse_mass` has the true masses, `step` is the length of the next step \[s\].
pub(super) fn find_links(
    stiff: &[StiffLink],
    interval: &Interval,
    solution: &Solution,
    inverse_mass: &[Vec3],
    step: f64,
) -> Vec<(usize, PulledLink)> {
    if interval.detection.joints.is_empty() {
        return Vec::new();
    }
    let pins = sum_pins(interval, solution, inverse_mass);
    let mut stiff_of = vec![None; if stiff.is_empty() { 0 } else { pins.len() }];
    for link in stiff {
        stiff_of[link.body].get_or_insert(link);
    }
    let mut supported = None;
    let mut links = Vec::new();
    for (body, (own, w)) in pins.iter().zip(inverse_mass).enumerate() {
        let Some((pin, side)) = own.first.filter(|_| !own.held && w.x > 0.0 && w.z > 0.0) else {
            continue;
        };
        let before = stiff_of.get(body).copied().flatten();
        let faded = |link: &StiffLink| {
            let fades = if link.cut { CUT_FADES } else { FADES };
            fades.powf(interval.length / step) * link.stiffness
        };
        let of_pins = own.pull - own.force.dot(&own.arm) / own.count;
        // on one pin a contact holds what swings
        let press = if own.count > 1.0 { own.press } else { 0.0 };
        let pull = of_pins + press;
        let stiffness = match before {
            // the whole step is none of its parts, and may be unstable
            Some(link) if link.in_parts && interval.whole => link.stiffness,
            Some(link) => pull.max(faded(link)),
            None => pull,
        };
        let (support, inertia) = (own.support / w.x, 1.0 / w.z);
        let pulled = step * step * stiffness / STABLE - support > inertia;
        let bodies = pins.len();
        if pulled && supported.get_or_insert_with(|| supports(bodies, interval, solution))[body] {
            let share = match pull > 0.0 {
                true => (of_pins / pull).clamp(OF_PARTS, 1.0),
                false => 1.0,
            };
            let rate = |stiffness: f64| (0.5 * share * stiffness / (inertia + support)).sqrt();
            let link = PulledLink {
                pin,
                side,
                stiffness,
                support,
                inertia: before.map_or(inertia, |link| link.inertia[1]),
                rate: rate(stiffness),
                lasting: rate(pull.max(0.0)),
                cut: before.is_some_and(|link| link.cut),
                in_parts: before.is_some_and(|link| link.in_parts),
            };
            links.push((body, link));
        }
    }
    links
}

/// The sums of all bodies, with the forces of this interval.
fn sum_pins(interval: &Interval, solution: &Solution, inverse_mass: &[Vec3]) -> Vec<Pins> {
    let (joints, dt) = (&interval.detection.joints, interval.length);
    let mut pins = vec![Pins::default(); inverse_mass.len()];
    let blocks = interval.blocks.iter().zip(&interval.sides);
    for ((block, sides), &impulse) in blocks.zip(&solution.impulses) {
        let index = match block.source {
            Source::Joint(index) => index,
            Source::Contact(index) => {
                let contact = &interval.detection.contacts[index];
                for side in (0..2).filter(|_| !block.loaded && impulse.x > 0.0) {
                    let (body, radius) = (sides[side] as usize, contact.rolls_on[side]);
                    if let Some(own) = pins.get_mut(body).filter(|_| radius > 0.0) {
                        let [_, t] = contact.rows.jacobian[side];
                        own.press += impulse.x / dt * (radius - t.z);
                    }
                }
                continue;
            }
        };
        let joint = &joints[index];
        let bodies = joint.rows.bodies;
        let fixed = |body: u32| inverse_mass.get(body as usize).is_none_or(|w| w.x <= 0.0);
        for side in (0..2).filter(|&side| bodies[side] != NO_BODY) {
            let own = &mut pins[bodies[side] as usize];
            own.held |= joint.part == JointPart::Lock(JointCoordinate::Angle);
            if !matches!(joint.kind, JointKind::Pin { .. }) {
                continue;
            }
            // rows (±1, 0, ∓r_y) and (0, ±1, ±r_x)
            let [n, t] = joint.rows.jacobian[side];
            let force = (n.xy() * impulse.x + t.xy() * impulse.y) / dt;
            let arm = Vec2::new(t.y * t.z, -n.x * n.z);
            own.first.get_or_insert((joint.key, side));
            own.count += 1.0;
            own.pull += force.dot(&arm);
            own.force += force;
            own.arm += arm;
            if fixed(bodies[1 - side]) {
                own.support = own.support.max(arm.norm_squared());
            }
        }
    }
    pins
}

/// Whether the island of each body touches a body that no impulse moves, or is pinned to one. Scaling
/// spins changes the angular momentum, which an island without support must keep. Of a body in several
/// islands, as it dominates another, the first counts.
fn supports(bodies: usize, interval: &Interval, solution: &Solution) -> Vec<bool> {
    let mut supported = vec![None; bodies];
    for k in 0..solution.islands.len() {
        let sides = |i: &u32| interval.sides[*i as usize];
        let blocks = solution.islands.blocks(k);
        let touches = blocks.iter().any(|i| sides(i).contains(&NO_BODY));
        for body in blocks.iter().flat_map(sides) {
            if let Some(own) = supported.get_mut(body as usize) {
                own.get_or_insert(touches);
            }
        }
    }
    supported.into_iter().map(|s| s == Some(true)).collect()
}
