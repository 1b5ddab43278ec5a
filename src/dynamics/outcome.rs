//! What a step did: energy, contacts, what is remembered, and whether a solve can be believed.

use super::blocks::{Memory, Scratch, Source};
use super::model::{ContactKey, Detection, JointKind, NormalLaw};
use super::record::{ContactRecord, ContactStatus, StepRecord};
use crate::contact::{ContactProblem, Delassus, Law, NO_BODY, Rows, Vec2, Vec3};
use crate::solver::SolveReport;
use std::collections::HashMap;

/// Energy, contacts and memory from the impulses and both velocities.
pub(super) fn fill_record(
    s: &Scratch,
    detection: &Detection,
    inverse_mass: &[Vec3],
    dt: f64,
    record: &mut StepRecord,
    memory: &mut HashMap<ContactKey, Memory>,
) {
    let energy = &mut record.energy;
    energy.kinetic_start = kinetic(&s.start, inverse_mass);
    energy.kinetic_end = kinetic(&s.end, inverse_mass);
    let mean: Vec<Vec3> = s
        .start
        .iter()
        .zip(&s.end)
        .map(|(a, e)| 0.5 * (a + e))
        .collect();
    energy.forces = forces_work(&s.forces, &mean, inverse_mass, dt);
    memory.clear();
    for (i, (block, &p)) in s.blocks.iter().zip(&s.impulses).enumerate() {
        let own = mobile_velocity(&block.rows, &mean, inverse_mass);
        match block.source {
            Source::Joint(index) => {
                let joint = detection.joints[index];
                match joint.kind {
                    JointKind::Pin { .. } => energy.joints += p.dot(&own),
                    JointKind::Motor { .. } => energy.motors += p.x * own.x,
                }
                memory.insert(
                    joint.key,
                    Memory {
                        impulse: p,
                        dt,
                        stuck: None,
                    },
                );
            }
            Source::Contact(index) => {
                let contact = detection.contacts[index];
                // the whole impulse, with the given load where friction alone was solved
                let (impulse, mu) = match contact.law {
                    NormalLaw::Load { force } => (Vec2::new(force * dt, p.x), contact.friction),
                    _ => (p, contact.friction),
                };
                let work = mobile_velocity(&contact.rows, &mean, inverse_mass);
                energy.contact_n += impulse.x * work.x;
                energy.contact_t += impulse.y * work.y;
                let surface = Vec2::new(0.0, contact.surface_velocity);
                let gamma_e = contact.rows.velocity(&s.end) + surface;
                let gamma_mean = contact.rows.velocity(&mean) + surface;
                // the velocity that the friction law sees, within what the solve resolves:
                // on the border of the cone a contact may stick, inside it it must
                let added = block.free - s.gamma_free(i, detection);
                let added = match contact.law {
                    NormalLaw::Load { .. } => added.x,
                    _ => added.y,
                };
                let sticks =
                    mu > 0.0 && impulse.x > 0.0 && (gamma_e.y + added).abs() <= s.resolution[i];
                let kept = Memory {
                    impulse,
                    dt,
                    stuck: sticks.then_some(gamma_e.y),
                };
                memory.insert(contact.key, kept);
                if impulse.x > 0.0 || contact.gap <= 0.0 {
                    let slip = if sticks && block.stuck_before {
                        0.0
                    } else {
                        dt * gamma_mean.y
                    };
                    let slip_velocity = slip / dt;
                    record.contacts.push(ContactRecord {
                        bodies: contact.bodies,
                        surfaces: contact.surfaces,
                        cell: contact.cell,
                        position: contact.position,
                        normal: contact.normal,
                        gap: contact.gap,
                        impulse_n: impulse.x,
                        impulse_t: impulse.y,
                        slip,
                        load_slip: impulse.x * slip_velocity.abs(),
                        friction_work: -impulse.y * slip_velocity,
                        normal_work: impulse.x * gamma_mean.x,
                        status: status(impulse.x, block.impact, sticks, gamma_e.y),
                    });
                }
                if !block.impact {
                    let end_gap = contact.gap + 0.5 * dt * gamma_e.x;
                    record.penetration = record.penetration.max(-end_gap);
                } else {
                    record.penetration_impact = record.penetration_impact.max(-contact.gap);
                }
            }
        }
    }
}

/// Whether certified impulses are self-stress without bound.
///
/// Where friction and restitution wedge bodies, impulses can grow until any residual is small
/// beside them. What then stays open as a velocity is large beside the velocities that the bodies
/// have, by a thousandth and more; a true solution misses them by the tolerance.
pub(super) fn ran_away(report: &SolveReport, members: &[u32], s: &Scratch) -> bool {
    let open = report.residual.velocity;
    // [m/s], far below any motion that matters and far above round-off
    if open <= 1e-9 {
        return false;
    }
    let own = members
        .iter()
        .map(|&i| &s.blocks[i as usize])
        .fold(0.0f64, |v, b| v.max(b.gamma_a.amax()).max(b.free.amax()));
    open > 1e-3 * own
}

/// Whether the closed rigid rows outnumber the coordinates: their shares are then not unique.
///
/// Closed is what the velocity says, `|ξ| ≤ resolution`, not which rows a solver chose to load.
pub(super) fn redundant(problem: &ContactProblem, impulses: &[Vec2], resolution: f64) -> bool {
    let Delassus::Bodies(op) = &problem.operator else {
        return false;
    };
    let coordinates: usize = op
        .inverse_mass
        .iter()
        .map(|w| w.iter().filter(|x| **x > 0.0).count())
        .sum();
    let rows: usize = problem
        .laws
        .iter()
        .zip(impulses)
        .zip(problem.local_velocity(impulses))
        .map(|((law, p), xi)| match *law {
            Law::Contact {
                compliance,
                friction,
            } => {
                let closed = compliance == 0.0 && xi.x <= resolution;
                let sticks = friction > 0.0 && p.x > 0.0 && xi.y.abs() <= resolution;
                usize::from(closed) + usize::from(sticks)
            }
            Law::Pin => 2,
            Law::Bounded { lower, upper } => usize::from(p.x > lower && p.x < upper),
        })
        .sum();
    rows > coordinates
}

pub(super) fn count(record: &mut StepRecord, report: &SolveReport) {
    record.sweeps += report.sweeps;
    record.factorisations += report.factorisations;
    record.pivots += report.pivots;
    record.unsolved += usize::from(!report.solved());
    record.residual = record.residual.max(report.residual.relative);
    record.residual_velocity = record.residual_velocity.max(report.residual.velocity);
}

fn kinetic(velocities: &[Vec3], inverse_mass: &[Vec3]) -> f64 {
    velocities
        .iter()
        .zip(inverse_mass)
        .map(|(u, w)| {
            (0..3)
                .filter(|&i| w[i] > 0.0)
                .map(|i| 0.5 * u[i] * u[i] / w[i])
                .sum::<f64>()
        })
        .sum()
}

fn forces_work(forces: &[Vec3], mean: &[Vec3], inverse_mass: &[Vec3], dt: f64) -> f64 {
    (0..forces.len())
        .map(|k| {
            (0..3)
                .filter(|&i| inverse_mass[k][i] > 0.0)
                .map(|i| dt * forces[k][i] * mean[k][i])
                .sum::<f64>()
        })
        .sum()
}

/// `W ū` over the coordinates that can move: impulses do no work on what moves on its own.
fn mobile_velocity(rows: &Rows, mean: &[Vec3], inverse_mass: &[Vec3]) -> Vec2 {
    let mut gamma = Vec2::zeros();
    for side in 0..2 {
        if rows.bodies[side] == NO_BODY {
            continue;
        }
        let body = rows.bodies[side] as usize;
        let u = mean[body].zip_map(&inverse_mass[body], |v, w| if w > 0.0 { v } else { 0.0 });
        gamma.x += rows.jacobian[side][0].dot(&u);
        gamma.y += rows.jacobian[side][1].dot(&u);
    }
    gamma
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
