//! Chooses the face at which two parts touch that are corner to corner.
//!
//! Several directions separate two such parts. If a box slides over the seam of two flush boxes, the
//! largest separation at the midpoint of a step is often that along its path. The box would then hit
//! an edge that does not exist (rapier's issues 142 and 669). Two rules choose the face.
//!
//! Moving parts: a direction `k` in which the two touch at the start of the step, `−noise ≤
//! g_k(q_A) ≤ flush`, can take the place of the present one; any that separates the two, `g_k(q_A) ≥
//! −noise`, if the present one does not. Of these the contact takes the direction with the largest
//! separation two steps after the midpoint, `max g_k(q_M + 2 Δt u_A)`. In front of a real step in
//! the floor the parts overlap along the floor's normal at the start, so the step stops the box.
//!
//! Parts at rest, `|g| ≤ noise`, and a body that comes down on one that cannot move: the contact takes the
//! direction of another contact of one of the two bodies in the same plane, if the two parts are apart
//! along it at the start. They then slide on one surface that consists of several parts.

use super::super::kernels::{Axes, Axis, Touch, with_axes};
use super::Present;
use super::leaves::Leaf;
use super::pairs::Finder;
use super::points::Pair;
use crate::contact::NO_BODY;
use crate::dynamics::{ContactPoint, Pose64};

/// Time after the midpoint at which directions are compared, in steps. It is longer than the one step
/// in which gaps close, because a body that gains speed in the step moves farther than with `u_A`.
const AHEAD: f64 = 2.0;

/// Height over a face, as a share of the smaller part's size, up to which a part slides on it. A part
/// that flies past corners higher up meets what it meets.
pub(super) const FLUSH: f64 = 1e-3;

/// A contact at a corner that could as well be met along other directions.
pub(super) struct Tie {
    /// Its index among all contacts.
    pub contact: usize,
    /// Whether it is stored twice, as two contacts at the same point.
    twice: bool,
    setting: Pair,
    sides: [u32; 2],
    /// The same contact along the other directions, and a second one where the parts lie flat.
    others: Vec<(Touch, Option<Touch>)>,
    noise: f64,
    /// Whether a body comes down on one that cannot move.
    lands: bool,
}

/// Resolution of positions \[m\]: the larger of 1e-7 of the smaller part's size, and the resolution
/// of the user's coordinates in `f32`.
fn noise(sides: [&Leaf; 2], bodies: [&Present; 2], found: &[Touch]) -> f64 {
    let far = bodies[0].coordinate.max(bodies[1].coordinate);
    let far = found.iter().map(|t| t.point.amax()).fold(far, f64::max);
    (1e-7 * sides[0].surface.size.min(sides[1].surface.size))
        .max(4.0 * f64::from(f32::EPSILON) * far)
}

/// Whether two parts that move by `motion` \[m\] in a step may have passed each other before its midpoint:
/// sweeps handle these. `size` \[m\] is that of the smaller one.
fn passed(motion: f64, size: f64, noise: f64, found: &[Touch]) -> bool {
    motion > 0.5 * size && found.iter().any(|touch| touch.gap < -noise)
}

/// Poses of two parts at another time, by their present velocities.
pub(super) fn poses_at(sides: [&Leaf; 2], bodies: [&Present; 2], time: f64) -> [Pose64; 2] {
    [0, 1].map(|i: usize| {
        let mut pose = sides[i].pose;
        let center = pose.apply_inverse(bodies[i].center);
        pose.advance(&bodies[i].velocity, center, time);
        pose
    })
}

impl Finder<'_> {
    /// Replaces the contacts of two moving parts if the parts meet along another direction than that
    /// of the contacts.
    #[inline]
    pub(super) fn meet_moving(
        &self,
        sides: [&Leaf; 2],
        bodies: [&Present; 2],
        reach: f64,
        found: &mut Vec<Touch>,
    ) {
        let dt = self.step;
        let size = sides[0].surface.size.min(sides[1].surface.size);
        let motion = (bodies[0].speed + bodies[1].speed) * dt;
        if motion < 1e-7 * size {
            return; // at rest
        }
        // the kernel of a chain chooses the face within it; at its ends and sharp corners another
        // part may lie flush, and a moving chain may slide over seams of other parts
        if (0..2).any(|i| bodies[i].immovable && sides[i].part.goes_on()) {
            return;
        }
        // a contact may have the wrong direction if it may close while forces accelerate the bodies,
        // or if it overlapped at the start of the step
        let noise = noise(sides, bodies, found);
        if passed(motion, size, noise, found) {
            return;
        }
        let misled = |t: &Touch| {
            let u = bodies[1].velocity_at(t.point) - bodies[0].velocity_at(t.point);
            let way = dt * t.normal.dot(&u);
            way < -1e-9 * size && t.gap + AHEAD * way < 0.0 || t.gap - 0.5 * way < -noise
        };
        if found.iter().any(misled) {
            self.meet_another(sides, bodies, reach, noise, found);
        }
    }

    #[inline(never)]
    fn meet_another(
        &self,
        sides: [&Leaf; 2],
        bodies: [&Present; 2],
        reach: f64,
        noise: f64,
        found: &mut Vec<Touch>,
    ) {
        let at = |time| poses_at(sides, bodies, time);
        let (now, dt) = (sides.map(|leaf| leaf.pose), self.step);
        let (start, next) = (at(-0.5 * dt), at(AHEAD * dt));
        let present = found[0].normal;
        let size = sides[0].surface.size.min(sides[1].surface.size);
        let flush = noise.max(FLUSH * size);
        let better = with_axes(sides.map(|leaf| &leaf.part), &now, present, |axes| {
            let slide = (0.5 + AHEAD) * (bodies[0].speed + bodies[1].speed) * dt;
            // an impact is located at the instant of touching: what lies deeper then was crossed before
            let least = match self.midpoint {
                true => f64::NEG_INFINITY,
                false => axes.separation(&now, present).min(0.0) - flush,
            };
            // parts so fast that they may pass each other in a step slide, or are left as they are
            let highest = match 2.0 * self.step * (bodies[0].speed + bodies[1].speed) <= size {
                true => f64::INFINITY,
                false => flush,
            };
            let sizes = [noise, flush, highest, slide, least];
            best_axis(axes, [&start, &now, &next], present, sizes)
        });
        if let Some(Some(touches)) = better {
            found.clear();
            let touches = touches.into_iter().flatten();
            found.extend(touches.filter(|touch| touch.gap <= reach));
        }
    }

    /// The [`Tie`] of two parts: at rest, if their only contact has the same gap along other directions;
    /// of a body that lands on one that cannot move, if other directions separate the two at the start.
    /// `contact` is its index.
    #[inline]
    pub(super) fn tie(
        &self,
        sides: [&Leaf; 2],
        leaves: [u32; 2],
        setting: &Pair,
        found: &[Touch],
        contact: usize,
    ) -> Option<Tie> {
        let size = sides[0].surface.size;
        let lone = match found {
            [_] => true,
            [a, b] => (a.point - b.point).norm() <= 1e-3 * size,
            _ => false,
        };
        let bodies = sides.map(|leaf| self.present(leaf));
        let first = found[0];
        let on_still = bodies.iter().filter(|body| body.immovable).count() == 1;
        if !on_still && (!lone || first.gap.abs() > 1e-3 * size) {
            return None;
        }
        let noise = noise(sides, bodies, found);
        let u = bodies[1].velocity_at(first.point) - bodies[0].velocity_at(first.point);
        let lands = u.norm() * self.step > noise;
        let smaller = size.min(sides[1].surface.size);
        let fast = u.norm() * self.step > 0.5 * smaller;
        let apart = |t: &Touch| t.gap.abs() > noise || (t.point - first.point).norm() > noise;
        let now = sides.map(|leaf| leaf.pose);
        let at = match lands {
            false if !lone || found.iter().any(apart) => return None,
            false => now,
            true => {
                let closes = |t: &Touch| t.gap + AHEAD * self.step * t.normal.dot(&u) < 0.0;
                if !on_still || fast || !found.iter().any(closes) {
                    return None;
                }
                poses_at(sides, bodies, -0.5 * self.step)
            }
        };
        let slide = (0.5 + AHEAD) * (bodies[0].speed + bodies[1].speed) * self.step;
        let others = with_axes(sides.map(|leaf| &leaf.part), &now, first.normal, |axes| {
            let other = |axis: Axis| {
                let direction = axes.direction(&now, axis);
                if direction.dot(&first.normal) >= 1.0 - 1e-9 {
                    return None;
                }
                let gap = axes.separation(&at, axes.direction(&at, axis));
                let touches = match lands {
                    true => gap >= -noise,
                    false => gap.abs() <= noise,
                };
                let touch = axes.touch(&now, axis, noise).filter(|_| touches)?;
                // a face that the body does not get to
                if lands && axes.beyond(&now, axis, touch.point) > slide {
                    return None;
                }
                let second = axes.second(&now, axis, &touch, noise);
                Some((touch, second.filter(|_| lands)))
            };
            axes.all().filter_map(other).collect::<Vec<_>>()
        })?;
        (!others.is_empty()).then_some(Tie {
            contact,
            twice: found.len() > 1,
            setting: *setting,
            sides: leaves,
            others,
            noise,
            lands,
        })
    }

    /// Gives contacts at corners the direction of another contact in the same plane.
    pub(super) fn break_ties(&self, ties: &[Tie], out: &mut [ContactPoint]) {
        if ties.is_empty() {
            return;
        }
        let mut known = Known::new(self.present.len(), ties, out);
        for tie in ties {
            let own = out[tie.contact];
            // it lands on a plane with another contact already
            if tie.lands && self.is_told(tie, &own, &known, out) {
                known.decide(tie);
                continue;
            }
            let parts = tie.sides.map(|leaf| self.leaves.get(leaf));
            let chosen = tie.others.iter().find(|(touch, _)| {
                let wanted = self.point(&tie.setting, parts, touch);
                self.is_told(tie, &wanted, &known, out)
            });
            let Some((touch, second)) = chosen else {
                continue;
            };
            known.decide(tie);
            out[tie.contact] = self.point(&tie.setting, parts, touch);
            if tie.twice {
                let again = Touch {
                    feature: touch.feature ^ 1 << 28,
                    ..*touch
                };
                let second = second.unwrap_or(again);
                out[tie.contact + 1] = self.point(&tie.setting, parts, &second);
            }
        }
    }

    /// Whether another contact of one of the bodies has the direction of `wanted`, in the same plane.
    fn is_told(
        &self,
        tie: &Tie,
        wanted: &ContactPoint,
        known: &Known,
        out: &[ContactPoint],
    ) -> bool {
        let own = out[tie.contact];
        let edges = |c: &ContactPoint| c.places.map(|place| place.edge);
        let bodies = tie.setting.numbers.into_iter().enumerate();
        let moves = |body: u32| body != NO_BODY && !self.present[body as usize].immovable;
        bodies.filter(|(_, body)| moves(*body)).any(|(mine, body)| {
            let mut contacts = known.of_body[body as usize].iter();
            contacts.any(|&k| {
                let c = &out[k as usize];
                let sign = if c.bodies[mine] == body { 1.0 } else { -1.0 };
                let other = c.bodies[usize::from(c.bodies[0] == body)];
                let still = other == NO_BODY || self.present[other as usize].immovable;
                (c.key.pair, edges(c)) != (own.key.pair, edges(&own))
                    && (still || !tie.lands)
                    && sign * c.normal.dot(&wanted.normal) > 1.0 - 1e-9
                    && match tie.lands {
                        true => {
                            (!known.open[k as usize] || (c.gap - wanted.gap).abs() <= tie.noise)
                                && in_one_plane(wanted, c, mine, tie.noise)
                        }
                        false => {
                            let off = c.normal.dot(&(c.position - wanted.position));
                            off.abs().max(c.gap.abs()) <= 2.0 * tie.noise
                        }
                    }
            })
        })
    }
}

/// Whether two contacts of a body, which is side `mine` of the first, are on one plane of bodies that cannot
/// move. Contacts then lie on the body's own surface.
fn in_one_plane(a: &ContactPoint, b: &ContactPoint, mine: usize, noise: f64) -> bool {
    let up = if mine == 1 { a.normal } else { -a.normal };
    let height = |c: &ContactPoint| up.dot(&c.position) - c.gap;
    (height(a) - height(b)).abs() <= 2.0 * noise
}

/// What tells the directions of ties.
struct Known {
    /// The indices of the contacts of each body.
    of_body: Vec<Vec<u32>>,
    /// Contacts of a landing that may still take another direction. They tell nothing of others, unless the
    /// body's own surface goes on there: their gap is the same then. The inner face between two parts of a
    /// body may face the side of a tile far ahead.
    open: Vec<bool>,
}

impl Known {
    fn new(bodies: usize, ties: &[Tie], contacts: &[ContactPoint]) -> Known {
        let mut known = Known {
            of_body: vec![Vec::new(); bodies],
            open: vec![false; contacts.len()],
        };
        for (k, contact) in contacts.iter().enumerate() {
            for body in contact.bodies.iter().filter(|b| **b != NO_BODY) {
                known.of_body[*body as usize].push(k as u32);
            }
        }
        for tie in ties.iter().filter(|tie| tie.lands) {
            known.set_open(tie, true);
        }
        known
    }

    fn set_open(&mut self, tie: &Tie, open: bool) {
        self.open[tie.contact] = open;
        if tie.twice {
            self.open[tie.contact + 1] = open;
        }
    }

    /// The direction of its contact is that of another one.
    fn decide(&mut self, tie: &Tie) {
        self.set_open(tie, false);
    }
}

/// The contact along the axis that will separate two parts most, of the `present` one and those
/// along which they touch at the start; of all that separate them at the start if the present one
/// does not. `None` if the `present` direction is that one, or if the corner that touches lies
/// farther beyond the face than the parts `slide` \[m\]: nearly parallel faces then meet elsewhere. Of
/// fast parts, with the `flush` as the highest separation, only those along which they touch.
/// No contact if a neighbour of a segment has it. Directions with a separation below `least` \[m\] now do
/// not count. Poses of the start, now, and of the time
/// to come. The contacts are at most two.
fn best_axis(
    axes: &Axes,
    [start, now, next]: [&[Pose64; 2]; 3],
    present: crate::contact::Vec2,
    [noise, flush, highest, slide, least]: [f64; 5],
) -> Option<[Option<Touch>; 2]> {
    let (mut own, highest) = match axes.separation(start, present) >= -noise {
        true => (axes.separation(next, present), flush),
        false if highest == flush => return None,
        false => (f64::NEG_INFINITY, highest),
    };
    let mut best: Option<(f64, Axis)> = None;
    for axis in axes.all() {
        if !(-noise..=highest).contains(&axes.separation(start, axes.direction(start, axis))) {
            continue;
        }
        if axes.separation(now, axes.direction(now, axis)) < least {
            continue;
        }
        let later = axes.separation(next, axes.direction(next, axis));
        if axes.direction(now, axis).dot(&present) > 1.0 - 1e-9 {
            own = own.max(later);
        } else if best.is_none_or(|(most, _)| later > most) {
            best = Some((later, axis));
        }
    }
    let (later, axis) = best?;
    if later <= own + 1e-2 * noise {
        return None;
    }
    match axes.touch(now, axis, noise) {
        Some(touch) if axes.beyond(now, axis, touch.point) > slide => None,
        Some(touch) => Some([Some(touch), axes.second(now, axis, &touch, noise)]),
        None => Some([None; 2]),
    }
}
