//! Contacts that the velocities at the end of a step make necessary.
//!
//! A step keeps gaps open to first order, along the directions of its midpoint, and between parts that are
//! about to meet by their velocities at its start. Two sharp polygons can overlap at the next midpoint
//! all the same: if others push them past a corner, or if they turn by a large angle within the step. With
//! the velocities `u` at the end of the step, the overlap at the next midpoint is known exactly. The
//! contact is that of the axis which the two cross last ([`super::flights`]), at the place where they then
//! overlap. Its gap makes the row of this midpoint tell the overlap of the next,
//!
//! ```text
//! g = g(q_M + Δt u) − Δt J u.                                                      (1)
//! ```

use super::super::kernels::{Touch, with_axes};
use super::couple::Couple;
use super::flights::last_axis;
use super::hooks::Hooks;
use super::leaves::Leaf;
use super::output::Group;
use super::pairs::{Finder, Pairs};
use super::terms::Terms;
use super::{Detector, Present, present};
use crate::contact::{Vec2, Vec3};
use crate::dynamics::{ContactPoint, Detection, NormalLaw};

/// Overlap at the next midpoint, as a share of the smaller part's size, that is left as it is: the
/// position pass moves it apart. Less of it costs further solves.
const LITTLE: f64 = 1e-2;

/// Marks the features of these contacts: a part may have another one at the same corner.
const DRIVEN: u32 = 1 << 31;

impl Detector {
    /// Adds the contacts (1) of pairs that the last [`Detector::detect`] has found near each other, with the
    /// contacts `known`. `ends` are the velocities at the end of the step, `dt` \[s\] its length.
    pub fn detect_driven(
        &mut self,
        hooks: Hooks,
        (ends, dt): (&[Vec3], f64),
        known: &[ContactPoint],
        out: &mut Detection,
    ) {
        let Some(least) = self.leaves.least_sharp else {
            return;
        };
        let speed = |(body, end): (&Present, &Vec3)| end.xy().norm() + end.z.abs() * body.radius;
        let speeds = self.present.iter().zip(ends).map(speed);
        if 2.0 * dt * speeds.fold(0.0, f64::max) <= LITTLE * least {
            return;
        }
        let moved = |(body, end): (&Present, &Vec3)| Present {
            speed: end.xy().norm() + end.z.abs() * body.radius,
            velocity: *end,
            ..*body
        };
        let present: Vec<Present> = self.present.iter().zip(ends).map(moved).collect();
        let mut pairs = std::mem::take(&mut self.pairs);
        let finder = Finder {
            present: &present,
            step: dt,
            ..self.finder(hooks, self.span)
        };
        pairs.driven(&finder, (&self.present, known), out);
        self.pairs = pairs;
    }
}

impl Pairs {
    /// `before` are the bodies with their velocities at the start of the step.
    fn driven(
        &mut self,
        finder: &Finder,
        (before, known): (&[Present], &[ContactPoint]),
        out: &mut Detection,
    ) {
        let leaves = finder.leaves;
        let mut group = Group::default();
        let ahead = |body: &Present| (body.center + finder.step * body.velocity.xy(), body.radius);
        let circles: Vec<(Vec2, f64)> = finder.present.iter().map(ahead).collect();
        for row in self.rows.iter() {
            let [a, b] = row.leaves.map(|leaf| leaf as usize);
            let own = [a, b].map(|leaf| leaves.names[leaf].body);
            if are_apart(own.map(|body| circles.get(body as usize))) {
                continue;
            }
            let bodies = own.map(|body| present(finder.present, body));
            let way = bodies[0].closing(bodies[1]) * finder.step;
            let least = row.budget - leaves.travel[a] - leaves.travel[b];
            if way <= least.max(0.0) {
                continue;
            }
            let sides = row.leaves.map(|leaf| leaves.get(leaf));
            let little = LITTLE * sides[0].surface.size.min(sides[1].surface.size);
            if way <= little.max(least + little) || !finder.may_be_driven(sides, bodies) {
                continue;
            }
            let contact = contact_of(known, sides);
            if contact.is_some_and(|contact| bend(contact, bodies, finder) <= little) {
                continue;
            }
            let setting = finder.plain_setting(sides);
            // to rebound, a contact would have to know how fast it is driven
            if !matches!(setting.law, NormalLaw::Rigid { restitution } if restitution == 0.0) {
                continue;
            }
            let couple = Couple::new(finder, row.leaves, sides, bodies, self.faces_now());
            // what is stored of pairs out of reach depends on earlier steps
            let start = own.map(|body| present(before, body));
            let reach = finder
                .span
                .reach(start, sides.map(|leaf| leaf.surface.size));
            if let Some(touch) = finder.touch_ahead(&couple, little, reach) {
                finder.give(setting, sides, &Terms::default(), &mut group, &[touch], out);
            }
        }
    }
}

/// Whether circles about two bodies are apart; the world has none.
fn are_apart(circles: [Option<&(Vec2, f64)>; 2]) -> bool {
    let [Some((one, of_one)), Some((two, of_two))] = circles else {
        return false;
    };
    (one - two).norm_squared() > (of_one + of_two).powi(2)
}

/// Estimate of what a gap changes in a step beyond the first order \[m\]: points of turning bodies go on
/// circles, and the direction of the contact turns while its sides slide along each other.
fn bend(contact: &ContactPoint, bodies: [&Present; 2], finder: &Finder) -> f64 {
    let [u1, u2] = bodies.map(|body| body.velocity_at(contact.position));
    let radius = bodies[0].radius.min(bodies[1].radius);
    let [w1, w2] = bodies.map(|body| body.velocity.z);
    let slide = contact.normal.perp(&(u2 - u1)).abs() + 2.0 * (w2 - w1).abs() * radius;
    let (turn, way) = (w1.abs().max(w2.abs()) * finder.step, slide * finder.step);
    turn * (0.5 * turn * radius + way)
}

/// A contact of two colliders among those `known`, which are sorted by colliders.
fn contact_of<'a>(known: &'a [ContactPoint], sides: [&Leaf; 2]) -> Option<&'a ContactPoint> {
    let slots = sides.map(|leaf| leaf.slot);
    let at = known.partition_point(|contact| contact.surfaces < slots);
    known.get(at).filter(|contact| contact.surfaces == slots)
}

impl Finder<'_> {
    /// Two sharp polygons of bodies that can move, and have no other part. (With floors too, 300 boxes that land
    /// overlapped no less.)
    fn may_be_driven(&self, sides: [&Leaf; 2], bodies: [&Present; 2]) -> bool {
        let plain = |leaf: &&Leaf| leaf.surface.plain && leaf.part.is_sharp_polygon();
        sides.iter().all(plain)
            && (bodies.iter()).all(|body| body.single && !body.immovable && !body.asleep)
            && !self.is_apart(sides)
    }

    /// The contact (1) of two parts that are apart, by `reach` \[m\] at most, and overlap at the next midpoint by
    /// more than `little` \[m\].
    fn touch_ahead(&self, couple: &Couple, little: f64, reach: f64) -> Option<Touch> {
        let (now, next) = (couple.poses(), couple.poses_at(self.step));
        let toward = couple.bodies[1].center - couple.bodies[0].center;
        with_axes(couple.parts, &now, (toward, None), |axes| {
            let axis = last_axis(axes, [&now, &next], little)?;
            let apart = |axis| axes.separation(&now, axes.direction(&now, axis));
            if axes.all().any(|axis| apart(axis) > reach) {
                return None;
            }
            let ahead = axes.touch(&next, axis, 1e-7 * couple.size())?;
            // the material points that overlap then, half way between each other
            let back = |i: usize| now[i].apply(next[i].apply_inverse(ahead.point));
            let point = 0.5 * (back(0) + back(1));
            let [u1, u2] = couple.bodies.map(|body| body.velocity_at(point));
            let gap = ahead.gap - self.step * ahead.normal.dot(&(u2 - u1));
            Some(Touch {
                point,
                // they are apart now, or overlap by little
                gap: gap.max(0.0),
                feature: ahead.feature | DRIVEN,
                ..ahead
            })
        })?
    }
}
