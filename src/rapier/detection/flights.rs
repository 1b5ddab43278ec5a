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

use super::super::kernels::{Axes, Axis, Core, Part, Touch, with_axes};
use super::couple::Couple;
use super::pairs::Finder;
use super::seams::FLUSH;
use crate::dynamics::Pose64;

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
        let motion = couple.speed() * self.step;
        let size = couple.size();
        let flies = bound > if found.is_empty() { 0.0 } else { FLUSH * size };
        let sharp = |part: &Part| {
            part.rounding == 0.0 && matches!(part.core, Core::Box(_) | Core::Polygon(_))
        };
        if flies && bound < motion && couple.parts.into_iter().all(sharp) {
            self.meet_last(couple, [1e-7 * size, reach], found);
        }
    }

    #[inline(never)]
    fn meet_last(&self, couple: &Couple, [noise, reach]: [f64; 2], found: &mut Vec<Touch>) {
        let (now, next) = (couple.poses(), couple.poses_at(self.step));
        let toward = couple.bodies[1].center - couple.bodies[0].center;
        with_axes(couple.parts, &now, (toward, None), |axes| {
            let Some(axis) = last_axis(axes, [&now, &next]) else {
                return;
            };
            let direction = axes.direction(&now, axis);
            let same = |t: &Touch| t.normal.dot(&direction) > 1.0 - 1e-9;
            if !found.first().is_some_and(same)
                && let Some(touch) = axes.touch(&now, axis, noise)
            {
                found.clear();
                found.push(touch);
                let second = axes.second(&now, axis, &touch, noise);
                found.extend(second.filter(|second| second.gap <= reach));
            }
        });
    }
}

/// The axis of equation (1); `None` if one separates the two polygons at the end as well. It may be the
/// wrong one where the polygons slide along each other: see [`super::seams`].
fn last_axis(axes: &Axes, [now, next]: [&[Pose64; 2]; 2]) -> Option<Axis> {
    let mut last: Option<(f64, Axis)> = None;
    for axis in axes.all() {
        let gap = |poses| axes.separation(poses, axes.direction(poses, axis));
        let left = gap(next);
        if left >= 0.0 {
            return None;
        }
        let apart = gap(now);
        let time = apart / (apart - left);
        if apart > 0.0 && last.is_none_or(|(latest, _)| time > latest) {
            last = Some((time, axis));
        }
    }
    last.map(|(_, axis)| axis)
}
