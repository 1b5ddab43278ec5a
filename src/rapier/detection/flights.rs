//! Contacts of sharp polygons that are about to meet in flight.
//!
//! The kernels take the axis that separates two polygons the most at the midpoint, and clip a face of
//! one to a face of the other. Where each lies beside the faces of the other nothing is left, and
//! they would have no contact until they overlap, by up to half of the way that they go in a step. If
//! two polygons will overlap at the next midpoint, they meet along the axis that is crossed last. Of
//! all axes `k` that separate them now, this is the one with the largest
//!
//! ```text
//! t_k = g_k(q_M) / (g_k(q_M) − g_k(q_M + Δt u_A)) < 1.                             (1)
//! ```
//!
//! Source: Eberly, *Intersection of Convex Objects: The Method of Separating Axes* (2001), on objects
//! with constant velocity.

use super::super::kernels::{Axes, Axis, Part, Touch, with_axes};
use super::couple::Couple;
use super::pairs::Finder;
use super::seams::FLUSH;
use crate::dynamics::Pose64;
use std::f64::consts::FRAC_1_SQRT_2;

impl Finder<'_> {
    /// Replaces the contacts of two sharp polygons in flight that are about to meet along another axis.
    /// Their distance is at least `bound` \[m\]; contacts beyond `reach` \[m\] do not count.
    #[inline]
    pub(super) fn meet_in_flight(
        &self,
        couple: &Couple,
        (bound, reach): (f64, f64),
        found: &mut Vec<Touch>,
    ) {
        // beyond that they are apart at the next midpoint too
        let motion = couple.closing() * self.step;
        let size = couple.size();
        let flies = bound > if found.is_empty() { 0.0 } else { FLUSH * size };
        // a floor's own contacts tell the direction at its seams
        let free = couple.bodies.iter().all(|body| !body.immovable);
        let sharp = |part: &Part| {
            let corner = || part.is_one_sided() && part.has_sharp_corner();
            part.is_sharp_polygon() || free && part.rounding == 0.0 && corner()
        };
        if flies && bound < motion && couple.parts.into_iter().all(sharp) {
            self.meet_last(couple, [1e-7 * size, reach], found);
        }
    }

    #[inline(never)]
    pub(super) fn meet_last(
        &self,
        couple: &Couple,
        [noise, reach]: [f64; 2],
        found: &mut Vec<Touch>,
    ) {
        let (now, next) = (couple.poses(), couple.poses_at(self.step));
        let toward = couple.bodies[1].center - couple.bodies[0].center;
        with_axes(couple.parts, &now, (toward, None), |axes| {
            let Some(axis) = last_axis(axes, [&now, &next], 0.0) else {
                return;
            };
            let direction = axes.direction(&now, axis);
            let Some(touch) = axes.touch(&now, axis, noise) else {
                return;
            };
            let same = |t: &Touch| t.normal.dot(&direction) > 1.0 - 1e-9;
            let edges = couple.parts.iter().any(|part| part.is_one_sided());
            let nearly = |t: &Touch| t.normal.dot(&direction) > FRAC_1_SQRT_2;
            // beside the faces that lie over each other a corner of a segment may be nearer
            let meets = |t: &Touch| match edges {
                true => nearly(t) && t.gap <= 2.0 * touch.gap + FLUSH * couple.size(),
                false => same(t),
            };
            if !found.iter().any(meets) {
                found.retain(|t| edges && nearly(t));
                found.insert(0, touch);
                let second = axes.second(&now, axis, &touch, noise);
                found.extend(second.filter(|second| second.gap <= reach));
            }
        });
    }
}

/// The axis of equation (1); `None` if one separates the two polygons at the end as well, or they can meet along none. It may be the
/// wrong one where the polygons slide along each other: see [`super::seams`]. Two that overlap by no more than
/// `little` \[m\] count as apart, now and at the end.
pub(super) fn last_axis(axes: &Axes, [now, next]: [&[Pose64; 2]; 2], little: f64) -> Option<Axis> {
    let mut last: Option<([f64; 2], Axis)> = None;
    for axis in axes.all() {
        let gap = |poses| axes.separation(poses, axes.direction(poses, axis));
        let left = gap(next);
        if left >= -little {
            return None;
        }
        let apart = gap(now);
        // of axes that are crossed now the one with the least overlap
        let time = [apart.max(0.0) / (apart.max(0.0) - left), apart.min(0.0)];
        let later = last.is_none_or(|(latest, _)| time > latest);
        if apart > -little && later && axes.is_open(now, axis) {
            last = Some((time, axis));
        }
    }
    last.map(|(_, axis)| axis)
}
