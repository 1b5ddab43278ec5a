//! Records an interval: energy, contacts, joints and their cache entries.

use super::contact_cache::{CachedContact, CachedContacts, JointEnergy, Left};
use super::interval::{Interval, Source};
use super::kinetic::mobile_sum;
use super::model::{ContactPoint, JointKind, NormalLaw};
use super::record::{ContactRecord, ContactStatus, JointRecord, StepRecord};
use super::solution::Solution;
use crate::contact::{NO_BODY, Rows, Vec2, Vec3};

/// Gap, over the distance of a contact from the centre of a body, from which two bodies are apart.
const APART: f64 = 1e-3;

/// `(u_A + u_E)/2` of all bodies, on which the impulses of an interval do work: 0 for motion that is
/// prescribed.
pub(super) fn working_velocities(
    interval: &Interval,
    solution: &Solution,
    inverse_mass: &[Vec3],
) -> Vec<Vec3> {
    let velocities = interval.start.iter().zip(&solution.end).zip(inverse_mass);
    let mobile = |v: f64, w: f64| if w > 0.0 { v } else { 0.0 };
    let mean = velocities.map(|((a, e), w)| (0.5 * (a + e)).zip_map(w, mobile));
    mean.collect()
}

/// Adds the work and the contacts of some blocks to `record`, and their entries to `cache`. `mean`
/// are the [`working_velocities`].
pub(super) fn record_interval(
    interval: &Interval,
    solution: &Solution,
    blocks: impl Iterator<Item = usize>,
    mean: &[Vec3],
    time: f64,
    record: &mut StepRecord,
    cache: &mut CachedContacts,
) {
    for i in blocks {
        let (block, p) = (&interval.blocks[i], solution.impulses[i]);
        // no work on a side that receives no impulse
        let side_velocity = |rows: &Rows| {
            let (bodies, jacobian) = (interval.sides[i], rows.jacobian);
            Rows { bodies, jacobian }.velocity(mean)
        };
        match block.source {
            Source::Joint(index) => {
                let joint = &interval.detection.joints[index];
                let own = side_velocity(&joint.rows);
                let work = p.dot(&own);
                record.joint_gap = record.joint_gap.max(joint.distance());
                match joint.kind {
                    JointKind::Pin { .. } | JointKind::Lock { .. } | JointKind::Limit { .. } => {
                        record.energy.joints += work;
                        record.constraint_work += relative_work(interval, solution, &joint.rows, p);
                    }
                    JointKind::Motor { .. } | JointKind::Spring(_) => record.energy.motors += work,
                }
                record.joints.push(JointRecord {
                    time,
                    joint: joint.joint,
                    part: joint.part,
                    bodies: joint.rows.bodies,
                    impulse: p,
                    work,
                });
                let entry = CachedContact {
                    impulse: p,
                    dt: interval.length,
                    stuck: false,
                    left: None,
                    rebounded: false,
                    energy: solution.energies[index],
                };
                cache.push(joint.key, entry);
            }
            Source::Contact(index) => {
                let contact = &interval.detection.contacts[index];
                // the whole impulse, including a given load
                let impulse = match contact.law {
                    NormalLaw::Load { force } => Vec2::new(force * interval.length, p.x),
                    _ => p,
                };
                let work = side_velocity(&contact.rows);
                record.energy.contact_n += impulse.x * work.x;
                record.energy.contact_t += impulse.y * work.y;
                let entry = record_contact(interval, solution, i, contact, impulse, time, record);
                cache.push(contact.key, entry);
            }
        }
    }
}

/// Records a contact. Returns its cache entry.
fn record_contact(
    interval: &Interval,
    solution: &Solution,
    i: usize,
    contact: &ContactPoint,
    impulse: Vec2,
    time: f64,
    record: &mut StepRecord,
) -> CachedContact {
    let block = &interval.blocks[i];
    let surface = Vec2::new(0.0, contact.surface_velocity);
    let gamma_e = contact.rows.velocity(&solution.end) + surface;
    let gamma_a = if block.loaded {
        contact.rows.velocity(&interval.start) + surface
    } else {
        block.gamma_a
    };
    let gamma_mean = 0.5 * (gamma_a + gamma_e);
    // a smaller one is what a step leaves between bodies that touch
    let levers = contact.rows.jacobian.map(|[n, t]| n.z * n.z + t.z * t.z);
    let far = levers[0].max(levers[1]);
    if contact.gap > 0.0 && contact.gap * contact.gap > APART * APART * far {
        let least = record.least_gap.unwrap_or(f64::INFINITY);
        record.least_gap = Some(contact.gap.min(least));
    }
    if let NormalLaw::Rigid { .. } = contact.law {
        record.constraint_work += impulse.dot(&gamma_mean);
    }
    // the velocity in the friction law, up to the resolution of the solve: on the border of the
    // cone a contact may stick, inside it it must. What debts take afterwards is no matter of the law
    let solved = contact.rows.velocity(solution.solved_end()).y + surface.y;
    let added = solution.bias[i] - solution.gamma_f(interval, i);
    let added = match contact.law {
        NormalLaw::Load { .. } => added.x,
        _ => added.y,
    };
    let sticks = contact.friction > 0.0
        && impulse.x > 0.0
        && (solved + added).abs() <= solution.resolution[i];
    let instant = interval.length == 0.0;
    if impulse.x > 0.0 || contact.gap <= 0.0 && !instant {
        let slip_velocity = if sticks && block.stuck_before {
            0.0
        } else {
            gamma_mean.y
        };
        record.contacts.push(ContactRecord {
            time,
            bodies: contact.bodies,
            surfaces: contact.surfaces,
            places: contact.places,
            position: contact.position,
            normal: contact.normal,
            gap: contact.gap,
            impulse_n: impulse.x,
            impulse_t: impulse.y,
            moments: [0, 1].map(|side| {
                let [n, t] = contact.rows.jacobian[side];
                let receives = interval.sides[i][side] != NO_BODY;
                receives.then_some(n.z * impulse.x + t.z * impulse.y)
            }),
            slip: interval.length * slip_velocity,
            load_slip: impulse.x * slip_velocity.abs(),
            friction_work: -impulse.y * slip_velocity,
            normal_work: impulse.x * gamma_mean.x,
            stiffness: contact.law.stiffness(),
            status: status(impulse.x, block.impact || instant, sticks, solved),
        });
    }
    if !interval.known_overlaps.contains(contact.key.pair) {
        let impact = block.impact || instant;
        let rigid = matches!(contact.law, NormalLaw::Rigid { .. });
        if impact || rigid && impulse.x > 0.0 && !block.continues {
            record.penetration_impact = record.penetration_impact.max(-contact.gap);
        }
        if !impact {
            let end_gap = end_gap(interval, solution, i, contact);
            record.penetration = record.penetration.max(-end_gap);
        }
    }
    CachedContact {
        impulse,
        dt: interval.length,
        stuck: sticks,
        left: (impulse.x > 0.0).then_some(Left {
            gamma: gamma_e,
            ago: 0.5 * interval.length,
            turning: block.turning,
            on_surface: block.on_surface,
            held: {
                // no deeper than it lies
                let depth = -(contact.gap + interval.length * gamma_e.x);
                block.held[0].min(depth).max(block.held[1])
            },
        }),
        rebounded: block.impact,
        energy: JointEnergy::default(),
    }
}

/// The gap \[m\] of the contact of block `i` at the end of the interval.
pub(super) fn end_gap(
    interval: &Interval,
    solution: &Solution,
    i: usize,
    contact: &ContactPoint,
) -> f64 {
    let (h, block) = (interval.length, &interval.blocks[i]);
    let turning = block.turning.filter(|_| block.on_surface);
    let bend = turning.map_or(0.0, |c| 0.125 * c.x * h * h);
    contact.gap + 0.5 * h * contact.rows.velocity(&solution.end).x + bend
}

/// `P · (γ_A + γ_E)/2` \[J\] with the velocities of both sides, prescribed or not.
fn relative_work(interval: &Interval, solution: &Solution, rows: &Rows, impulse: Vec2) -> f64 {
    let mean = 0.5 * (rows.velocity(&interval.start) + rows.velocity(&solution.end));
    impulse.dot(&mean)
}

/// Work \[J\] of an interval's forces on the bodies that `of` returns.
pub(super) fn forces_work(
    interval: &Interval,
    solution: &Solution,
    inverse_mass: &[Vec3],
    of: impl Fn(usize) -> bool,
) -> f64 {
    (0..interval.forces.len())
        .filter(|&k| of(k))
        .map(|k| {
            let mean = 0.5 * (interval.start[k] + solution.end[k]);
            let of = |i: usize| interval.length * interval.forces[k][i] * mean[i];
            mobile_sum(&inverse_mass[k], of)
        })
        .sum()
}

fn status(impulse_n: f64, impact: bool, sticks: bool, end_velocity: f64) -> ContactStatus {
    if impulse_n <= 0.0 {
        ContactStatus::Open
    } else if impact {
        ContactStatus::Impact
    } else if sticks {
        ContactStatus::Stick
    } else if end_velocity < 0.0 {
        ContactStatus::SlipMinus
    } else {
        ContactStatus::SlipPlus
    }
}
