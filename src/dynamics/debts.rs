//! Takes back the energy that islands in debt have given.
//!
//! A reserve below 0 is a debt, see [`super::reserve`]. It is paid from the end velocities,
//!
//! ```text
//! u_E ← u_E − ε w,   ε = −R / max(ū · M w, w · M w / 2) ≤ 0.05,   ū = (u_A + u_E)/2    (1)
//! ```
//!
//! `w` is `u_E` of an island with a support. Where all its supports are smooth and have one normal, the
//! momentum along them is kept: `w` is then `u_E` less the velocity of the centre of mass along them. An
//! island without a support has both momenta to keep: `w` is its motion relative to a rigid one. Rows
//! that are at rest at the end of the step stay so. The record has the impulses that this takes. Of a
//! debt that remains, up to X is paid in later steps.
//!
//! Islands with a motor, or with a support or a surface that moves, pay nothing, because (1) would
//! slow what drives them. Nor do islands without support whose bodies are not all free, or any where
//! bodies dominate others.

use super::angular_momentum::relative_motion;
use super::first_step::is_driven;
use super::interval::{Interval, Source};
use super::model::{JointKind, MultibodyModel};
use super::record::StepRecord;
use super::solution::Solution;
use crate::contact::{NO_BODY, Vec2, Vec3};

/// Largest `ε` of (1).
const MOST: f64 = 0.05;
/// Normals that differ by less [rad] are one: those of a face in rapier's `f32` are.
const PARALLEL: f64 = 1e-6;

/// Lets islands in debt pay.
pub(super) struct Debtors<'a> {
    pub model: &'a dyn MultibodyModel,
    pub interval: &'a Interval,
    pub inverse_mass: &'a [Vec3],
    /// Whether they pay now, or keep their debts for a later interval: bodies that are at its end already
    /// have been moved with the velocities that they owe.
    pub pays: bool,
}

impl Debtors<'_> {
    /// Lets all islands pay whose blocks are all `used`, and shares out their reserves equally among
    /// their bodies.
    pub fn settle(
        &self,
        solution: &mut Solution,
        used: impl Fn(usize) -> bool,
        reserves: &mut Vec<f64>,
        record: &mut StepRecord,
    ) {
        reserves.clone_from(&self.interval.reserves);
        reserves.resize(solution.end.len(), 0.0);
        for k in 0..solution.outcomes.len() {
            let members = solution.islands.blocks(k);
            // what was released until it is located did no work
            let idle = |i: &u32| solution.impulses[*i as usize] == Vec2::zeros();
            if members.iter().all(idle) || !members.iter().all(|&i| used(i as usize)) {
                continue;
            }
            let own = &solution.outcomes[k];
            let (mut reserve, bodies) = (own.reserve, own.bodies as f64);
            if self.pays && own.debt > 0.0 && self.is_passive(members) {
                if solution.unpaid.is_empty() {
                    solution.unpaid.clone_from(&solution.end);
                }
                let work = self.pay(&mut solution.end, members, own.debt, &mut record.drag);
                reserve -= work;
                record.energy.returned += work;
                record.constraint_work += work;
            }
            let share = reserve / bodies;
            let sides = members
                .iter()
                .flat_map(|&i| self.interval.sides[i as usize]);
            for body in sides.filter(|b| *b != NO_BODY) {
                reserves[body as usize] = share;
            }
        }
    }

    /// Returns the work \[J\], 0 or less.
    fn pay(
        &self,
        end: &mut [Vec3],
        members: &[u32],
        debt: f64,
        drag: &mut Vec<(u32, Vec3)>,
    ) -> f64 {
        let Debtors {
            model,
            interval,
            inverse_mass,
            ..
        } = *self;
        let mut bodies: Vec<u32> = (members.iter())
            .flat_map(|&i| interval.sides[i as usize])
            .collect();
        bodies.sort_unstable();
        bodies.dedup();
        let supported = bodies.pop_if(|b| *b == NO_BODY).is_some();
        let motion: Vec<Vec3> = match supported {
            true => {
                let drift = self.drift(members, &bodies, end);
                bodies.iter().map(|&b| end[b as usize] - drift).collect()
            }
            false => match relative_motion(model, &bodies, inverse_mass, end) {
                Some(motion) => motion,
                None => return 0.0,
            },
        };
        // u · M v, over the coordinates that move
        let product = |body: u32, u: &Vec3, v: &Vec3| -> f64 {
            let w = &inverse_mass[body as usize];
            let mobile = (0..3).filter(|&i| w[i] > 0.0);
            mobile.map(|i| u[i] * v[i] / w[i]).sum()
        };
        let power = |end: &[Vec3]| -> f64 {
            let each = bodies.iter().zip(&motion).map(|(&b, w)| {
                let mean = 0.5 * (interval.start[b as usize] + end[b as usize]);
                product(b, &mean, w)
            });
            each.sum()
        };
        let own: f64 = (bodies.iter().zip(&motion))
            .map(|(&b, w)| product(b, w, w))
            .sum();
        let first = power(end);
        if first <= 0.0 {
            return 0.0;
        }
        // where the motion turns back within the step a debt would cost much more than itself
        let share = (debt / first.max(0.5 * own)).min(MOST);
        for (&b, w) in bodies.iter().zip(&motion) {
            let mobile = w.zip_map(
                &inverse_mass[b as usize],
                |w, m| if m > 0.0 { w } else { 0.0 },
            );
            end[b as usize] -= share * mobile;
            let mass = inverse_mass[b as usize].map(|m| if m > 0.0 { 1.0 / m } else { 0.0 });
            drag.push((b, -share * mobile.component_mul(&mass)));
        }
        -share * power(end)
    }

    /// Velocity of the centre of mass of `bodies` along the supports of their island, if these are
    /// smooth and have one normal: they take no momentum in this direction. Otherwise 0.
    fn drift(&self, members: &[u32], bodies: &[u32], end: &[Vec3]) -> Vec3 {
        let Some(normal) = self.smooth_support(members) else {
            return Vec3::zeros();
        };
        let (mut mass, mut momentum) = (0.0, Vec2::zeros());
        for &b in bodies {
            let w = self.inverse_mass[b as usize];
            // without a centre the coordinates are no translations
            if w.x <= 0.0 || w.x != w.y || self.model.centre(b as usize).is_none() {
                return Vec3::zeros();
            }
            mass += 1.0 / w.x;
            momentum += end[b as usize].xy() / w.x;
        }
        let along = Vec2::new(-normal.y, normal.x);
        let drift = momentum.dot(&along) / mass * along;
        Vec3::new(drift.x, drift.y, 0.0)
    }

    /// The normal of the supports of an island, if they are contacts without friction that have one.
    fn smooth_support(&self, members: &[u32]) -> Option<Vec2> {
        let Interval {
            detection,
            blocks,
            sides,
            ..
        } = self.interval;
        let mut normal: Option<Vec2> = None;
        for &i in members {
            if !sides[i as usize].contains(&NO_BODY) {
                continue;
            }
            let Source::Contact(index) = blocks[i as usize].source else {
                return None;
            };
            let contact = &detection.contacts[index];
            let first = *normal.get_or_insert(contact.normal);
            if contact.friction > 0.0 || first.perp(&contact.normal).abs() > PARALLEL {
                return None;
            }
        }
        normal
    }

    /// Whether nothing drives an island.
    fn is_passive(&self, members: &[u32]) -> bool {
        let Interval {
            detection,
            blocks,
            driven,
            start,
            ..
        } = self.interval;
        let moves = |b: &u32| start.get(*b as usize).is_some_and(|u| *u != Vec3::zeros());
        let given = |b: &u32| self.inverse_mass.get(*b as usize) == Some(&Vec3::zeros());
        let passive = |&i: &u32| match blocks[i as usize].source {
            Source::Contact(index) => {
                let contact = &detection.contacts[index];
                let carried = *driven && is_driven(contact, start, self.inverse_mass);
                contact.surface_velocity == 0.0 && !carried
            }
            Source::Joint(index) => {
                let joint = &detection.joints[index];
                let motor = match joint.kind {
                    JointKind::Motor { .. } => true,
                    JointKind::Spring(spring) => spring.speed != 0.0,
                    _ => false,
                };
                !motor && !joint.rows.bodies.iter().any(|b| given(b) && moves(b))
            }
        };
        self.interval.roles.dominance.is_empty() && members.iter().all(passive)
    }
}
