//! The blocks of rows that take part in a step, and the contact problem of an island.

use super::model::{ContactKey, Detection, JointKind, MultibodyModel, NormalLaw};
use super::rules::{Rule, Scheme, Situation, reference_acceleration, rule};
use crate::contact::{BodyOperator, ContactProblem, Delassus, Law, NO_BODY, Rows, Vec2, Vec3};
use std::collections::HashMap;

/// What is kept of a contact from one step to the next.
#[derive(Debug, Clone, Copy)]
pub(super) struct Memory {
    /// [N s], of a step of length `dt`.
    pub impulse: Vec2,
    pub dt: f64,
    /// Tangential velocity at the end of the step, if it stuck.
    pub stuck: Option<f64>,
}

/// One block of rows that takes part in the step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub source: Source,
    /// All rows, those of bodies that move on their own included.
    pub rows: Rows,
    pub law: Law,
    pub free: Vec2,
    pub gamma_a: Vec2,
    pub impact: bool,
    pub stuck_before: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Source {
    Contact(usize),
    Joint(usize),
}

#[derive(Default)]
pub(super) struct Scratch {
    pub start: Vec<Vec3>,
    pub forces: Vec<Vec3>,
    pub accelerations: Vec<Vec3>,
    pub free: Vec<Vec3>,
    pub end: Vec<Vec3>,
    pub blocks: Vec<Block>,
    /// Of each block, the rows of movable sides only.
    pub rows: Vec<Rows>,
    pub impulses: Vec<Vec2>,
    pub resolution: Vec<f64>,
    pub local_of: Vec<u32>,
}

impl Scratch {
    /// Chooses the rule of every contact and joint of the detection.
    pub fn collect(
        &mut self,
        detection: &Detection,
        memory: &HashMap<ContactKey, Memory>,
        scheme: Scheme,
        inverse_mass: &[Vec3],
        dt: f64,
    ) {
        let s = self;
        s.blocks.clear();
        s.rows.clear();
        s.impulses.clear();
        let staggered = scheme == Scheme::Staggered;
        for (index, contact) in detection.contacts.iter().enumerate() {
            if movable(&contact.rows, inverse_mass).bodies == [NO_BODY, NO_BODY] {
                continue;
            }
            let surface = Vec2::new(0.0, contact.surface_velocity);
            let memory = memory.get(&contact.key);
            let now = Situation {
                dt,
                gamma_a: contact.rows.velocity(&s.start) + surface,
                gamma_f: contact.rows.velocity(&s.free) + surface,
                acceleration: reference_acceleration(contact, &s.start, &s.accelerations),
                carried: memory.is_some_and(|m| m.impulse.x > 0.0),
                stuck: memory.and_then(|m| m.stuck),
            };
            let Some(Rule { free, law, impact }) = rule(scheme, contact, &now) else {
                continue;
            };
            let mut rows = contact.rows;
            let mut warm = memory.map_or(Vec2::zeros(), |m| m.impulse * (dt / m.dt));
            let (mut gamma_f, mut gamma_a) = (now.gamma_f, now.gamma_a);
            if let NormalLaw::Load { .. } = contact.law {
                // the friction row takes the place of the normal one
                for side in &mut rows.jacobian {
                    *side = [side[1], Vec3::zeros()];
                }
                (warm, gamma_f, gamma_a) = (
                    Vec2::new(warm.y, 0.0),
                    Vec2::new(gamma_f.y, 0.0),
                    Vec2::new(gamma_a.y, 0.0),
                );
            }
            s.blocks.push(Block {
                source: Source::Contact(index),
                rows,
                law,
                free: gamma_f + free,
                gamma_a,
                impact,
                stuck_before: now.stuck.is_some(),
            });
            s.impulses.push(warm);
        }
        for (index, joint) in detection.joints.iter().enumerate() {
            if movable(&joint.rows, inverse_mass).bodies == [NO_BODY, NO_BODY] {
                continue;
            }
            let mut rows = joint.rows;
            let (law, free) = match joint.kind {
                // gap/Δt keeps the drift at second order; the published rule corrects no gap
                JointKind::Pin { gap } => {
                    (Law::Pin, if staggered { gap / dt } else { Vec2::zeros() })
                }
                JointKind::Motor { speed, max_force } => {
                    rows.jacobian
                        .iter_mut()
                        .for_each(|side| side[1] = Vec3::zeros());
                    let bound = max_force * dt;
                    let law = Law::Bounded {
                        lower: -bound,
                        upper: bound,
                    };
                    (law, Vec2::new(-speed, 0.0))
                }
            };
            let warm = memory
                .get(&joint.key)
                .map_or(Vec2::zeros(), |m| m.impulse * (dt / m.dt));
            s.blocks.push(Block {
                source: Source::Joint(index),
                rows,
                law,
                free: rows.velocity(&s.free) + free,
                gamma_a: rows.velocity(&s.start),
                impact: false,
                stuck_before: false,
            });
            s.impulses.push(warm);
        }
        s.rows
            .extend(s.blocks.iter().map(|b| movable(&b.rows, inverse_mass)));
    }

    /// `γ_F` of block `i`, without what its rule added.
    pub fn gamma_free(&self, i: usize, detection: &Detection) -> Vec2 {
        let block = &self.blocks[i];
        let gamma = block.rows.velocity(&self.free);
        match block.source {
            Source::Contact(c) => match detection.contacts[c].law {
                NormalLaw::Load { .. } => {
                    gamma + Vec2::new(detection.contacts[c].surface_velocity, 0.0)
                }
                _ => gamma + Vec2::new(0.0, detection.contacts[c].surface_velocity),
            },
            Source::Joint(_) => gamma,
        }
    }
}

/// `u_F = u_A + M⁻¹ (h Δt + W_N P_N)` with the normal impulses that are given.
pub(super) fn free_velocities<M: MultibodyModel + ?Sized>(
    model: &M,
    detection: &Detection,
    time: f64,
    dt: f64,
    s: &mut Scratch,
) {
    let inverse_mass = model.inverse_mass();
    s.forces.clear();
    s.forces.resize(s.start.len(), Vec3::zeros());
    model.forces(time + 0.5 * dt, &mut s.forces);
    s.accelerations.clear();
    s.accelerations.extend(
        s.forces
            .iter()
            .zip(inverse_mass)
            .map(|(f, w)| f.component_mul(w)),
    );
    s.free.clear();
    s.free.extend(
        s.start
            .iter()
            .zip(&s.accelerations)
            .map(|(u, a)| u + a * dt),
    );
    for contact in &detection.contacts {
        if let NormalLaw::Load { force } = contact.law {
            let impulse = Vec2::new(force * dt, 0.0);
            contact.rows.push(impulse, inverse_mass, &mut s.free);
        }
    }
}

/// `rows` without the sides that move on their own: they join no islands and take no impulse.
pub(super) fn movable(rows: &Rows, inverse_mass: &[Vec3]) -> Rows {
    let mut rows = *rows;
    for body in &mut rows.bodies {
        if *body != NO_BODY && inverse_mass[*body as usize] == Vec3::zeros() {
            *body = NO_BODY;
        }
    }
    rows
}

/// The contact problem of one island, over its own bodies.
pub(super) fn island_problem(
    members: &[u32],
    s: &mut Scratch,
    inverse_mass: &[Vec3],
) -> ContactProblem {
    let mut operator = BodyOperator::default();
    let mut problem_free = Vec::with_capacity(members.len());
    let mut laws = Vec::with_capacity(members.len());
    let mut touched = Vec::new();
    for &i in members {
        let block = &s.blocks[i as usize];
        let mut rows = s.rows[i as usize];
        for body in &mut rows.bodies {
            if *body == NO_BODY {
                continue;
            }
            let global = *body as usize;
            if s.local_of[global] == NO_BODY {
                s.local_of[global] = operator.inverse_mass.len() as u32;
                operator.inverse_mass.push(inverse_mass[global]);
                touched.push(global);
            }
            *body = s.local_of[global];
        }
        operator.rows.push(rows);
        problem_free.push(block.free);
        laws.push(block.law);
    }
    for global in touched {
        s.local_of[global] = NO_BODY;
    }
    ContactProblem {
        operator: Delassus::Bodies(operator),
        free: problem_free,
        laws,
    }
}
