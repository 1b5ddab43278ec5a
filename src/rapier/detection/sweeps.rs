//! Contacts of fast parts, found where they first touch in a step.
//!
//! At the midpoint of a step a fast part may already be deep inside another, or beyond it. Its
//! direction of least depth then points anywhere, and one-sided segments show it their back. Of one that slid
//! far over a low step in a floor, it points up: the step would lift it. Such parts are followed from the
//! start of the step by conservative advancement: a lower bound of their distance over their closing speed is
//! a time in which they cannot meet. The contacts of the instant
//! at which they touch are then moved to the midpoint,
//!
//! ```text
//! g_M = g(t) + (Δt/2 − t) γ_n                                       0 ≤ t ≤ Δt/2
//! ```
//!
//! Source: Mirtich, *Impulse-based Dynamic Simulation of Rigid Body Systems* (1996), §2.3.

use super::super::kernels::{Core, Part, Sight, Touch, touches, with_axes};
use super::couple::Couple;
use super::pairs::Finder;
use crate::contact::Vec2;
use crate::dynamics::Pose64;

/// Depth at the midpoint, as a share of the thinner part, up to which the midpoint's contacts hold.
/// Half of it is the depth at which the nearest surface may be that of the far side.
const SHALLOW: f64 = 0.1;

/// Depth at the start of a step, as a share of the thinner part, up to which the nearest surface is that through which
/// the two came.
const DEEP: f64 = 0.5;

/// Cosine of 45 degrees: directions within it count as the same.
const NEARLY: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Most instants that a pair is looked at in a step. A faster pair takes longer strides, and may
/// then start as deep as they are long.
const MOST: f64 = 500.0;

/// Thickness of the thinner part \[m\]; of two segments the length of the shorter one.
fn thickness(parts: [&Part; 2]) -> f64 {
    let of = |part: &Part| match &part.core {
        Core::Ball(radius) => Some(2.0 * radius),
        Core::Box(half) => Some(2.0 * half.min()),
        Core::Polygon(polygon) => Some(polygon.thickness),
        _ => None,
    };
    let rounded = |part: &Part| of(part).map(|t| t + 2.0 * part.rounding);
    let length = |part: &Part| match &part.core {
        Core::Edge(edge) => edge.length().max(2.0 * part.rounding),
        _ => f64::INFINITY,
    };
    match parts.map(rounded) {
        [Some(one), Some(two)] => one.min(two),
        [one, two] => one
            .or(two)
            .unwrap_or_else(|| length(parts[0]).min(length(parts[1]))),
    }
}

impl Finder<'_> {
    /// Replaces the contacts at the midpoint of two parts that are deep in each other there, and met
    /// within the first half of the step. `bound` is that of their gap there \[m\]. Returns whether it did.
    #[inline]
    pub(super) fn meet_fast(&self, couple: &Couple, bound: f64, found: &mut Vec<Touch>) -> bool {
        let speed = couple.closing();
        let way = 0.5 * self.step * speed;
        // a speed that is not finite is reported elsewhere. In half a step the parts do not meet
        if !self.midpoint || !speed.is_finite() || bound > 2.0 * way {
            return false;
        }
        let shallow = SHALLOW * thickness(couple.parts);
        // they get no deeper than a shallow depth
        if way <= shallow {
            return false;
        }
        self.meet_first(couple, (speed, shallow), found)
    }

    #[inline(never)]
    fn meet_first(
        &self,
        couple: &Couple,
        (speed, shallow): (f64, f64),
        found: &mut Vec<Touch>,
    ) -> bool {
        let Couple { parts, bodies, .. } = *couple;
        let (half, noise) = (0.5 * self.step, couple.noise(found));
        let (touching, deep) = (1e-2 * shallow, shallow * DEEP / SHALLOW);
        let finest = speed * half / MOST;
        let stride = finest.max(0.5 * shallow);
        // chains choose among their own faces
        let is_chain = |i: usize| {
            matches!(parts[i].core, Core::Edge(_)) && (bodies[i].immovable || parts[i].is_sheet())
        };
        let chain = is_chain(0) || is_chain(1);
        let passed = !chain && couple.may_have_passed(self.step, noise, found);
        let flush = if chain { touching } else { noise };
        let mut early = Vec::new();
        let mut time = 0.0;
        while time < half {
            let poses = couple.poses_at(time - half);
            let sight = Sight::default();
            let Some(bound) = touches([&poses[0], &poses[1]], parts, &sight, touching, &mut early)
            else {
                return false;
            };
            let rest = half - time;
            let velocity = |touch: &Touch, i: usize| {
                let r = touch.point - (bodies[i].center - rest * bodies[i].velocity.xy());
                let u = bodies[i].velocity;
                u.xy() + u.z * Vec2::new(-r.y, r.x)
            };
            for touch in &mut early {
                let [u1, u2] = [velocity(touch, 0), velocity(touch, 1)];
                let opens = rest * touch.normal.dot(&(u2 - u1));
                // overlap that they start with is not of this step, unless they go on into each other and the
                // midpoint shows no contact of it
                let known = !found.is_empty() || opens > -shallow || touch.gap < -deep;
                if time == 0.0 && touch.gap < -shallow && known {
                    return false;
                }
                touch.gap += opens;
                touch.point += 0.5 * rest * (u1 + u2);
            }
            // the midpoint tells the gap exactly, if it tells the direction
            let told = !found.is_empty() && agree(&early, found);
            let closes = |depth: f64| early.iter().any(|touch| touch.gap < -depth);
            if closes(shallow) || passed && closes(noise) && !told {
                let depths = [flush, touching, shallow];
                if told || slides_past(couple, &poses, early[0].normal, depths) {
                    return false;
                }
                std::mem::swap(found, &mut early);
                return true;
            }
            early.clear();
            // the first contact tells the direction of those that may have passed
            let least = match passed && bound > touching {
                true => finest,
                false => stride,
            };
            // near enough for the touching contacts to be found there
            time += (bound - 0.5 * touching).max(least) / speed;
        }
        false
    }
}

/// Whether all `found` contacts have about the direction of the `early` ones.
fn agree(early: &[Touch], found: &[Touch]) -> bool {
    let agrees = |touch: &Touch| touch.normal.dot(&early[0].normal) > NEARLY;
    early.is_empty() || found.iter().all(agrees)
}

/// Whether parts that touch at the `poses` with a `normal` slide along each other, and pass: they then meet at
/// the corners of a seam. Depths \[m\] along another direction: `flush` at these poses, and at the midpoint
/// the `shallow` one, or of a sheet, which has no depth, the `touching` one.
fn slides_past(
    couple: &Couple,
    poses: &[Pose64; 2],
    normal: Vec2,
    [flush, touching, shallow]: [f64; 3],
) -> bool {
    let (now, sight) = (couple.poses(), Sight::default());
    let passes = with_axes(couple.parts, poses, (normal, Some(&sight)), |axes| {
        let most = if axes.with_sheet() { touching } else { shallow };
        axes.all().any(|axis| {
            let apart = |at| axes.separation(at, axes.direction(at, axis));
            axes.direction(poses, axis).dot(&normal) <= NEARLY
                && apart(poses) >= -flush
                && apart(&now) >= -most
        })
    });
    passes == Some(true)
}
