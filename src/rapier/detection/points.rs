//! Builds contact points from geometry: rows, keys, laws.

use super::super::engine::geometry::ContactManifold;
use super::super::engine::prelude::*;
use super::super::kernels::{Core, Touch};
use super::Present;
use super::leaves::Leaf;
use crate::contact::{NO_BODY, Rows, Vec2, Vec3};
use crate::dynamics::{ContactKey, ContactPoint, NormalLaw, Pose64, SurfacePoint};
use crate::rapier::parry::query::TrackedContact;

/// The data that all contacts of a pair of colliders share.
#[derive(Clone, Copy)]
pub(super) struct Pair {
    pub numbers: [u32; 2],
    pub surfaces: [u32; 2],
    /// Identifies the two colliders for good: a new collider may reuse the number of a removed one.
    pub key: u64,
    pub law: NormalLaw,
    pub friction: f64,
    pub belt: f64,
    pub size: f64,
    pub radii: [f64; 2],
    /// See [`ContactPoint::rolls_on`].
    pub rolls_on: [f64; 2],
}

impl Pair {
    /// The contact law of a foundation over `length` \[m\] of surface.
    pub fn over(mut self, length: f64) -> Pair {
        if let NormalLaw::ViscoElastic { stiffness, damping } = &mut self.law {
            *stiffness *= length;
            *damping *= length;
        }
        self
    }

    #[inline]
    pub fn point(
        &self,
        sides: [&Present; 2],
        touch: &Touch,
        places: [SurfacePoint; 2],
        feature: u64,
        exact: bool,
    ) -> ContactPoint {
        let n = touch.normal;
        let t = Vec2::new(-n.y, n.x);
        let movable = sides.map(|body| !body.immovable);
        // Across an open gap both impulses act half way, to conserve the angular momentum of the
        // two bodies. If only one body moves, the impulse acts on its own surface, to give friction
        // the right lever arm.
        let p = match movable {
            [true, false] => touch.point - 0.5 * touch.gap * n,
            [false, true] => touch.point + 0.5 * touch.gap * n,
            _ => touch.point,
        };
        // both sides without a loop, which would keep the arrays in memory
        let rows = |side: usize, sign: f64| {
            if self.numbers[side] == NO_BODY {
                return (0.0, [Vec3::zeros(); 2]);
            }
            let r = p - sides[side].center;
            let row = |d: Vec2| Vec3::new(sign * d.x, sign * d.y, sign * (r.x * d.y - r.y * d.x));
            (sides[side].coordinate, [row(n), row(t)])
        };
        let ((far1, rows1), (far2, rows2)) = (rows(0, -1.0), rows(1, 1.0));
        let jacobian = [rows1, rows2];
        let coordinate = p.amax().max(far1).max(far2);
        // resolution of detection: see `stepping_scheme.md`, "dead band"
        let (relative, ulp) = if exact || cfg!(feature = "f64") {
            (1e-12, f64::EPSILON)
        } else {
            (2e-6, f64::from(Real::EPSILON))
        };
        ContactPoint {
            key: ContactKey {
                pair: self.key,
                feature,
            },
            rows: Rows {
                bodies: self.numbers,
                jacobian,
            },
            bodies: self.numbers,
            surfaces: self.surfaces,
            places,
            position: p,
            normal: n,
            gap: touch.gap,
            gap_noise: (relative * self.size).max(4.0 * ulp * coordinate),
            radii: self.radii,
            rolls_on: self.rolls_on,
            friction: self.friction,
            law: self.law,
            surface_velocity: self.belt,
        }
    }
}

/// See [`ContactPoint::rolls_on`].
#[inline]
pub(super) fn rolls_on(sides: [&Leaf; 2], touch: &Touch) -> [f64; 2] {
    let on = |own: usize| match &sides[1 - own].part {
        disc if !matches!(disc.core, Core::Ball(_)) => 0.0,
        disc => {
            let flat = sides[own]
                .part
                .is_face(sides[own].pose.unrotate(touch.normal));
            f64::from(u8::from(flat)) * disc.radius()
        }
    };
    [on(0), on(1)]
}

/// Where a contact of two parts lies on each.
#[inline]
pub(super) fn places(sides: [&Leaf; 2], touch: &Touch) -> [SurfacePoint; 2] {
    let half = 0.5 * touch.gap * touch.normal;
    let on = |leaf: &Leaf, half: Vec2| {
        let at = match &leaf.part.core {
            Core::Edge(segment) => segment.fraction(leaf.pose.apply_inverse(touch.point + half)),
            _ => 0.0,
        };
        SurfacePoint { edge: leaf.sub, at }
    };
    [on(sides[0], -half), on(sides[1], half)]
}

/// Points of a parry manifold as touches, nearer than `reach`.
pub(super) fn parry_points(
    manifold: &ContactManifold,
    poses: &[Pose64; 2],
    reach: f64,
    deepest_only: bool,
    mut push: impl FnMut(Touch, [u32; 4]),
) {
    let part = |pose: &Pose64, sub: Option<&Pose>| match sub {
        Some(sub) => pose.compose(&Pose64::from_rapier(sub)),
        None => *pose,
    };
    let w1 = part(&poses[0], manifold.subshape_pos1());
    let w2 = part(&poses[1], manifold.subshape_pos2());
    let wide = |v: Vector| Vec2::new(f64::from(v.x), f64::from(v.y));
    let normal = w1.rotate(wide(manifold.local_n1)).normalize();
    if !normal.x.is_finite() {
        return;
    }
    let mut give = |p: &TrackedContact<ContactData>, features: [u32; 2]| {
        let gap = f64::from(p.dist);
        if gap <= reach {
            let touch = Touch {
                normal,
                point: 0.5 * (w1.apply(wide(p.local_p1)) + w2.apply(wide(p.local_p2))),
                gap,
                feature: 0,
            };
            let [f1, f2] = features;
            push(touch, [manifold.subshape1, manifold.subshape2, f1, f2]);
        }
    };
    if deepest_only {
        let deepest = manifold
            .points
            .iter()
            .min_by(|a, b| a.dist.total_cmp(&b.dist));
        // one point per segment: its feature must not flicker between the two ends
        deepest.iter().for_each(|p| give(p, [0, 0]));
    } else {
        for p in &manifold.points {
            give(p, [p.fid1.0, p.fid2.0]);
        }
    }
}

/// Whether a touch repeats a known contact: two segments of a polyline both report their common
/// end.
pub(super) fn same_place(known: &ContactPoint, touch: &Touch, size: f64) -> bool {
    (known.position - touch.point).norm() < 1e-4 * size && known.normal.dot(&touch.normal) > 0.9999
}

pub(super) fn mix(order: [u32; 4]) -> u64 {
    order
        .iter()
        .fold(0xcbf2_9ce4_8422_2325, |hash: u64, &word| {
            (hash ^ u64::from(word)).wrapping_mul(0x0000_0100_0000_01b3)
        })
}
