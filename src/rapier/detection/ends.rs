//! The ends of a flat side that lies on a large disc, as contacts of their own.
//!
//! The nearest point moves from one end of the side to the other when it turns by a part of a degree. Where a
//! step does not resolve that, the side would fall into the disc beside the point, or rock higher and higher.

use super::super::kernels::{Core, Touch};
use super::couple::Couple;
use super::pairs::Finder;

/// Least cosine of the angle between the normal of the contact and that of its side, or the direction of an end.
const NEARLY: f64 = 0.87;

/// Longest side, as a multiple of the radius. On a smaller disc the side rocks slowly enough.
const LONGEST: f64 = 0.5;

/// Least distance of an end from the nearest point, as a share of the side.
const APART: f64 = 0.05;

/// Features of the two ends; that of the nearest point is lower.
const FEATURES: [u32; 2] = [8, 9];

impl Finder<'_> {
    /// Adds the ends of the flat side of a part on which, or at an end of which, its only contact with a disc lies.
    ///
    /// An end at the distance `s` from the nearest point has the gap `s²/2R`. While the side rolls or slides, the
    /// point comes nearer to it by the stride `l` in a step, and the gap goes to `(s − l)²/2R ≥ 0`, not to the
    /// `(s² − 2 s l)/2R` of a straight line. The difference `l²/2R` is added to an open gap; a stride by turning
    /// counts up to half the side. What turns the side more than that, such as a landing, stops at the end.
    #[inline]
    pub(super) fn add_ends(&self, couple: &Couple, reach: f64, found: &mut Vec<Touch>) {
        let [touch] = found[..] else {
            return;
        };
        let radius = |i: usize| match couple.parts[i].core {
            Core::Ball(radius) => Some((i, radius)),
            _ => None,
        };
        if let Some(disc) = radius(0).or_else(|| radius(1)) {
            self.add_ends_on(disc, touch, couple, reach, found);
        }
    }

    fn add_ends_on(
        &self,
        (disc, radius): (usize, f64),
        touch: Touch,
        couple: &Couple,
        reach: f64,
        found: &mut Vec<Touch>,
    ) {
        let flat = 1 - disc;
        let (part, round) = (couple.parts[flat], couple.parts[disc].rounding);
        let [centre, pose] = [disc, flat].map(|i| couple.sides[i].pose);
        let centre = centre.translation;
        let sign = if flat == 0 { 1.0 } else { -1.0 };
        let normal = sign * touch.normal;
        let Some(ends) = part.face_towards(pose.unrotate(normal), NEARLY) else {
            return;
        };
        let ends = ends.map(|end| pose.apply(end));
        let (side, both) = (ends[1] - ends[0], radius + round + part.rounding);
        let length = side.norm();
        // the link of a chain does not rock by itself
        if length > LONGEST * both || couple.bodies[flat].joints > 1 {
            return;
        }
        let along = (side.dot(&(centre - ends[0])) / (length * length)).clamp(0.0, 1.0);
        let nearest = ends[0] + side * along;
        let [u_disc, u_flat] = [disc, flat].map(|i| couple.bodies[i]);
        let slides = u_disc.velocity_at(centre) - u_flat.velocity_at(nearest);
        let slides = self.step * slides.dot(&side) / length;
        let turned = self.step * both * u_flat.velocity.z;
        let stride = slides.abs() + turned.abs().min(0.5 * length);
        for (end, feature) in ends.into_iter().zip(FEATURES) {
            let away = centre - end;
            let distance = away.norm();
            let gap = match distance - both {
                open if open > 0.0 => open + 0.5 * stride * stride / both,
                deep => deep,
            };
            // of a disc whose centre is in the part, or near it, an end may face anywhere
            let faces = away.dot(&normal) > NEARLY * distance;
            if faces && gap <= reach && (end - nearest).norm() >= APART * length {
                let outward = away / distance;
                found.push(Touch {
                    normal: sign * outward,
                    point: end + outward * (part.rounding + 0.5 * gap),
                    gap,
                    feature,
                });
            }
        }
    }
}
