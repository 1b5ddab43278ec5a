//! Chooses the face at which two parts touch that are corner to corner.
//!
//! Several directions separate two such parts. If a box slides over the seam of two flush boxes, the
//! largest separation at the midpoint of a step is often that along its path. The box would then hit
//! an edge that does not exist (rapier's issues 142 and 669).
//!
//! A direction `k` in which the two touch at the start of the step, `−noise ≤
//! g_k(q_A) ≤ flush`, can take the place of the present one; any that separates the two, `g_k(q_A) ≥
//! −noise`, if the present one does not. Of these the contact takes the direction with the largest
//! separation two steps after the midpoint, `max g_k(q_M + 2 Δt u_A)`. In front of a real step in
//! the floor the parts overlap along the floor's normal at the start, so the step stops the box.
//!
//! Parts at rest, and those that land, see [`super::ties`].

use super::super::kernels::{Axes, Axis, Touch, with_axes};
use super::couple::Couple;
use super::pairs::Finder;
use crate::contact::Vec2;
use crate::dynamics::Pose64;
use std::f64::consts::FRAC_1_SQRT_2;

/// Time after the midpoint at which directions are compared, in steps. It is longer than the one step
/// in which gaps close, because a body that gains speed in the step moves farther than with `u_A`.
pub(super) const AHEAD: f64 = 2.0;

/// Height over a face, as a share of the smaller part's size, up to which a part slides on it. A part
/// that flies past corners higher up meets what it meets.
pub(super) const FLUSH: f64 = 1e-3;

impl Finder<'_> {
    /// Replaces the contacts of two moving parts if the parts meet along another direction than that
    /// of the contacts. Returns whether the two move, and no kernel of a chain chooses the direction.
    #[inline]
    pub(super) fn meet_moving(&self, couple: &Couple, reach: f64, found: &mut Vec<Touch>) -> bool {
        let Couple { parts, bodies, .. } = *couple;
        let dt = self.step;
        let size = couple.size();
        let motion = couple.speed() * dt;
        if motion < 1e-7 * size {
            return false; // at rest
        }
        // the kernel of a chain chooses the face within it; at its ends and sharp corners another
        // part may lie flush, and a moving chain may slide over seams of other parts. The two ends of a
        // sheet that slides on a chain may lie on either side of it by rounding
        let chain =
            |i: usize| bodies[i].immovable && parts[i].goes_on() && !parts[1 - i].is_sheet();
        if chain(0) || chain(1) {
            return false;
        }
        // a contact may have the wrong direction if it may close while forces accelerate the bodies,
        // or if it overlapped at the start of the step
        let noise = couple.noise(found);
        if couple.may_have_passed(dt, noise, found) {
            return true;
        }
        let misled = |t: &Touch| {
            let u = bodies[1].velocity_at(t.point) - bodies[0].velocity_at(t.point);
            let way = dt * t.normal.dot(&u);
            way < -1e-9 * size && t.gap + AHEAD * way < 0.0 || t.gap - 0.5 * way < -noise
        };
        let misled = found.iter().any(misled);
        if misled {
            self.meet_another(couple, reach, noise, found);
        }
        true
    }

    /// Adds the contacts of two moving parts that came into each other since the start of the step, at a
    /// sharp corner of a chain that each of its two segments left to the other: deeper under the one than
    /// under the other, whose face the part did not come through. `bound` is that of their gap \[m\].
    #[inline]
    pub(super) fn meet_at_corner(
        &self,
        couple: &Couple,
        (bound, reach): (f64, f64),
        found: &mut Vec<Touch>,
    ) {
        if bound >= 0.0 || !couple.parts.iter().any(|part| part.has_sharp_corner()) {
            return;
        }
        let size = couple.size();
        let motion = couple.speed() * self.step;
        if !(1e-7 * size..=0.5 * size).contains(&motion) || motion < -bound {
            return;
        }
        let noise = couple.noise(found);
        if bound < -noise {
            self.meet_another(couple, reach, noise, found);
        }
    }

    #[inline(never)]
    fn meet_another(&self, couple: &Couple, reach: f64, noise: f64, found: &mut Vec<Touch>) {
        let bodies = couple.bodies;
        let (now, dt) = (couple.poses(), self.step);
        let (start, next) = (couple.poses_at(-0.5 * dt), couple.poses_at(AHEAD * dt));
        let present = found.first().map(|touch| touch.normal);
        let toward = present.unwrap_or_else(|| bodies[1].center - bodies[0].center);
        let size = couple.size();
        let flush = noise.max(FLUSH * size);
        let view = (toward, Some(&couple.sight));
        let better = with_axes(couple.parts, &now, view, |axes| {
            let slide = (0.5 + AHEAD) * couple.speed() * dt;
            // an impact is located at the instant of touching: what lies deeper then was crossed before
            let least = match self.midpoint {
                true => f64::NEG_INFINITY,
                false => present.map_or(0.0, |n| axes.separation(&now, n).min(0.0)) - flush,
            };
            // parts so fast that they may pass each other in a step slide, or are left as they are
            let highest = match 2.0 * self.step * couple.speed() <= size {
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
}

/// The contact along the axis that will separate two parts most, of the `present` one and those
/// along which they touch at the start; of all that separate them at the start if the present one
/// does not, or if there is none. `None` if the `present` direction is that one, or if the corner that
/// touches lies farther beyond the face than the parts `slide` \[m\]: nearly parallel faces then meet
/// elsewhere. Of fast parts, with the `flush` as the highest separation, only those along which they touch.
/// No contact if a neighbour of a segment has it. Directions with a separation below `least` \[m\] now do
/// not count. Poses of the start, now, and of the time to come. The contacts are at most two.
fn best_axis(
    axes: &Axes,
    [start, now, next]: [&[Pose64; 2]; 3],
    present: Option<Vec2>,
    [noise, flush, highest, slide, least]: [f64; 5],
) -> Option<[Option<Touch>; 2]> {
    let (mut own, highest) = match present {
        Some(n) if axes.separation(start, n) >= -noise => (axes.separation(next, n), flush),
        _ if highest == flush => return None,
        _ => (f64::NEG_INFINITY, highest),
    };
    let same = |way: Vec2| present.is_some_and(|n| way.dot(&n) > 1.0 - 1e-9);
    let mut best: Option<(f64, Axis, f64)> = None;
    for axis in axes.open(now) {
        let before = axes.separation(start, axes.direction(start, axis));
        if !(-noise..=highest).contains(&before) {
            continue;
        }
        if axes.separation(now, axes.direction(now, axis)) < least {
            continue;
        }
        let later = axes.separation(next, axes.direction(next, axis));
        if same(axes.direction(now, axis)) {
            own = own.max(later);
        } else if best.is_none_or(|(most, ..)| later > most) {
            best = Some((later, axis, before));
        }
    }
    let (later, axis, before) = best?;
    if later <= own + 1e-2 * noise {
        return None;
    }
    // what an axis separates at all times does not meet
    let parted = own == f64::NEG_INFINITY && later >= -noise;
    match axes.touch(now, axis, noise) {
        Some(touch) if axes.beyond(now, axis, touch.point) > slide => {
            (parted && touch.gap >= -noise).then_some([None; 2])
        }
        Some(touch) => Some([Some(touch), axes.second(now, axis, &touch, noise)]),
        // a round part meets the neighbour's face as well
        None if axes.is_round() => Some([None; 2]),
        None => {
            let direction = axes.direction(now, axis);
            // what meets a corner nearly along the face beside it, or lies over several segments of a chain
            // that hardly turns, keeps its contact: each segment would leave it to the next
            let turns = present.is_none_or(|n| n.dot(&direction) < FRAC_1_SQRT_2);
            // so does what comes down on a sheet: on the far side nothing would stop it
            let apart = parted || axes.separation(now, direction) >= -noise;
            let leaves = before <= flush || apart || !axes.with_sheet();
            (leaves && turns).then_some([None; 2])
        }
    }
}
