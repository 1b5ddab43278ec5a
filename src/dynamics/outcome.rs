//! What a step did: energy, contacts, what is remembered, and whether its shares are unique.

use super::contact_cache::{CachedContact, CachedContacts, JointEnergy};
use super::model::{ContactPoint, JointKind, NormalLaw};
use super::record::{ContactRecord, ContactStatus, JointRecord, StepRecord};
use super::stage::{Source, Stage};
use crate::contact::{ContactProblem, Delassus, Law, NO_BODY, Rows, Vec2, Vec3};

/// Adds work, contacts and memory of those blocks of a stage that `used` keeps.
pub(super) fn record_stage(
    stage: &Stage,
    used: impl Fn(usize) -> bool,
    inverse_mass: &[Vec3],
    time: f64,
    record: &mut StepRecord,
    memory: &mut CachedContacts,
) {
    // impulses do no work on what moves on its own
    let velocities = stage.start.iter().zip(&stage.end).zip(inverse_mass);
    let mobile = |v: f64, w: f64| if w > 0.0 { v } else { 0.0 };
    let mean = velocities.map(|((a, e), w)| (0.5 * (a + e)).zip_map(w, mobile));
    let mean: Vec<Vec3> = mean.collect();
    record.contacts.reserve(stage.blocks.len());
    for (i, (block, &p)) in stage.blocks.iter().zip(&stage.impulses).enumerate() {
        if !used(i) {
            continue;
        }
        // no work where no impulse arrives
        let takes = |rows: &Rows| {
            let (bodies, jacobian) = (stage.sides[i], rows.jacobian);
            Rows { bodies, jacobian }.velocity(&mean)
        };
        match block.source {
            Source::Joint(index) => {
                let joint = &stage.detection.joints[index];
                let own = takes(&joint.rows);
                let work = p.dot(&own);
                record.joint_gap = record.joint_gap.max(joint.distance());
                match joint.kind {
                    JointKind::Pin { .. } | JointKind::Lock { .. } | JointKind::Limit { .. } => {
                        record.energy.joints += work;
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
                let kept = CachedContact {
                    impulse: p,
                    dt: stage.length,
                    stuck: None,
                    rebounded: false,
                    energy: stage.accounts[index],
                };
                memory.push(joint.key, kept);
            }
            Source::Contact(index) => {
                let contact = &stage.detection.contacts[index];
                // the whole impulse, with the given load where friction alone was solved
                let impulse = match contact.law {
                    NormalLaw::Load { force } => Vec2::new(force * stage.length, p.x),
                    _ => p,
                };
                let work = takes(&contact.rows);
                record.energy.contact_n += impulse.x * work.x;
                record.energy.contact_t += impulse.y * work.y;
                let kept = record_contact(stage, i, contact, impulse, time, record);
                memory.push(contact.key, kept);
            }
        }
    }
}

/// Writes what a contact did, and says what is to be remembered of it.
fn record_contact(
    stage: &Stage,
    i: usize,
    contact: &ContactPoint,
    impulse: Vec2,
    time: f64,
    record: &mut StepRecord,
) -> CachedContact {
    let block = &stage.blocks[i];
    let surface = Vec2::new(0.0, contact.surface_velocity);
    let gamma_e = contact.rows.velocity(&stage.end) + surface;
    let gamma_a = if block.loaded {
        contact.rows.velocity(&stage.start) + surface
    } else {
        block.gamma_a
    };
    let gamma_mean = 0.5 * (gamma_a + gamma_e);
    // the velocity that the friction law sees, within what the solve resolves: on the border of
    // the cone a contact may stick, inside it it must
    let added = stage.asked[i] - block.gamma_f;
    let added = match contact.law {
        NormalLaw::Load { .. } => added.x,
        _ => added.y,
    };
    let sticks = contact.friction > 0.0
        && impulse.x > 0.0
        && (gamma_e.y + added).abs() <= stage.resolution[i];
    let instant = stage.length == 0.0;
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
            cell: contact.cell,
            position: contact.position,
            normal: contact.normal,
            gap: contact.gap,
            impulse_n: impulse.x,
            impulse_t: impulse.y,
            moments: [0, 1].map(|side| {
                let [n, t] = contact.rows.jacobian[side];
                let takes = stage.sides[i][side] != NO_BODY;
                takes.then_some(n.z * impulse.x + t.z * impulse.y)
            }),
            slip: stage.length * slip_velocity,
            load_slip: impulse.x * slip_velocity.abs(),
            friction_work: -impulse.y * slip_velocity,
            normal_work: impulse.x * gamma_mean.x,
            status: status(impulse.x, block.impact || instant, sticks, gamma_e.y),
        });
    }
    if block.impact || instant {
        record.penetration_impact = record.penetration_impact.max(-contact.gap);
    } else if !stage.excused.contains(&contact.key.pair) {
        let end_gap = contact.gap + 0.5 * stage.length * gamma_e.x;
        record.penetration = record.penetration.max(-end_gap);
    }
    CachedContact {
        impulse,
        dt: stage.length,
        stuck: sticks.then_some(gamma_e.y),
        rebounded: block.impact,
        energy: JointEnergy::default(),
    }
}

/// Whether closed rigid rows outnumber coordinates, of the island or of the motion of two bodies
/// against each other: their shares are then not unique. A cheap test, which can miss self-stress
/// that takes more bodies to see; [`crate::solver::Uniqueness`] does not.
///
/// Closed is what the `velocities` `G P + b` say, `|ξ| ≤ resolution`, not which rows a solver chose to load.
pub(super) fn redundant(
    problem: &ContactProblem,
    impulses: &[Vec2],
    velocities: &[Vec2],
    resolution: f64,
) -> bool {
    let Delassus::Bodies(op) = &problem.operator else {
        return false;
    };
    let own = |body: u32| match op.inverse_mass.get(body as usize) {
        Some(w) => w.iter().filter(|x| **x > 0.0).count(),
        None => 0,
    };
    // rows of the island, and of the pair of bodies that the last blocks join
    let (mut rows, mut pair, mut of_pair) = (0, [NO_BODY; 2], 0);
    for (i, (law, p)) in problem.laws.iter().zip(impulses).enumerate() {
        let mut xi = velocities[i];
        xi.x += law.compliance() * p.x;
        let closed = match *law {
            Law::Contact {
                compliance,
                friction,
            } => {
                let closed = compliance == 0.0 && xi.x <= resolution;
                let sticks = friction > 0.0 && p.x > 0.0 && xi.y.abs() <= resolution;
                usize::from(closed) + usize::from(sticks)
            }
            Law::Pin => 2,
            Law::Bounded {
                lower,
                upper,
                compliance,
            } => usize::from(compliance == 0.0 && p.x > lower && p.x < upper),
        };
        if op.rows[i].bodies != pair {
            (pair, of_pair) = (op.rows[i].bodies, 0);
        }
        of_pair += closed;
        rows += closed;
        if of_pair > (own(pair[0]) + own(pair[1])).min(3) {
            return true;
        }
    }
    rows > (0..op.inverse_mass.len() as u32).map(own).sum()
}

/// `T` \[J\] of everything movable.
pub(super) fn kinetic(velocities: &[Vec3], inverse_mass: &[Vec3]) -> f64 {
    velocities
        .iter()
        .zip(inverse_mass)
        .map(|(u, w)| kinetic_of(u, w))
        .sum()
}

/// The same of one body.
pub(super) fn kinetic_of(u: &Vec3, w: &Vec3) -> f64 {
    (0..3)
        .filter(|&i| w[i] > 0.0)
        .map(|i| 0.5 * u[i] * u[i] / w[i])
        .sum()
}

/// Work \[J\] of a stage's forces on the bodies that `of` names.
pub(super) fn forces_work(stage: &Stage, inverse_mass: &[Vec3], of: impl Fn(usize) -> bool) -> f64 {
    (0..stage.forces.len())
        .filter(|&k| of(k))
        .map(|k| {
            let mean = 0.5 * (stage.start[k] + stage.end[k]);
            (0..3)
                .filter(|&i| inverse_mass[k][i] > 0.0)
                .map(|i| stage.length * stage.forces[k][i] * mean[i])
                .sum::<f64>()
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
