//! Restores the angular momentum that a correction of positions changes.
//!
//! Bodies that are displaced by `d_i` at constant velocities change the angular momentum of their
//! island by `ΔL = Σ m_i d_i × v_i`. An island that nothing supports must keep it. With the centre of
//! mass `X`, its velocity `V`, the arms `r_i` from `X` and the moment of inertia `J` about `X`, a
//! rigid rotation about `X` restores `L`,
//!
//! ```text
//! v_i = V + Ω × r_i + s w_i,   ω_i = Ω + s η_i,   Ω = L/J                        (1)
//! ```
//!
//! where `w_i`, `η_i` are the velocities relative to the rigid motion. They have no momentum, so that
//! any share `s` of them conserves both momenta. A rotation that becomes faster needs energy. It is
//! taken from the relative motion, as far as there is enough:
//!
//! ```text
//! s² = 1 − ΔT/T_w,   ΔT = (L² − (L + ΔL)²)/2J, T_w = Σ (m w² + I η²)/2           (2)
//! ```
//!
//! # Source
//! Own construction.

use super::islands::Islands;
use super::joint_recovery::Closed;
use super::model::MultibodyModel;
use crate::contact::{NO_BODY, Vec2, Vec3};

/// Applies (1) to the velocities at the end of a step, for every island without support that
/// `closed` moved. Returns the change of kinetic energy \[J\].
pub(super) fn restore_angular_momentum<M: MultibodyModel + ?Sized>(
    model: &M,
    closed: &Closed,
    inverse_mass: &[Vec3],
    end: &mut [Vec3],
) -> f64 {
    let mut islands = Islands::default();
    islands.build(end.len(), closed.sides.iter().copied());
    let mut change = 0.0;
    for k in 0..islands.len() {
        let sides = || {
            let blocks = islands.blocks(k).iter();
            blocks.flat_map(|&i| closed.sides[i as usize])
        };
        if sides().any(|b| b == NO_BODY) {
            continue;
        }
        let mut bodies: Vec<u32> = sides().collect();
        bodies.sort_unstable();
        bodies.dedup();
        let free: Option<Vec<Body>> = (bodies.iter())
            .map(|&b| Body::new(model, b as usize, closed, inverse_mass))
            .collect();
        if let Some(free) = free.filter(|all| all.iter().any(|b| b.moved != Vec2::zeros())) {
            change += restore(&free, end);
        }
    }
    change
}

/// A body of an island without support.
struct Body {
    index: usize,
    mass: f64,
    inertia: f64,
    centre: Vec2,
    moved: Vec2,
}

impl Body {
    /// `None` if not all its coordinates are free: then it has a support.
    fn new<M: MultibodyModel + ?Sized>(
        model: &M,
        index: usize,
        closed: &Closed,
        inverse_mass: &[Vec3],
    ) -> Option<Body> {
        let w = inverse_mass[index];
        let free = w.x > 0.0 && w.x == w.y && w.z > 0.0;
        Some(Body {
            index,
            mass: 1.0 / w.x,
            inertia: 1.0 / w.z,
            centre: model.centre(index).filter(|_| free)?,
            moved: closed.moved[index],
        })
    }
}

fn restore(bodies: &[Body], end: &mut [Vec3]) -> f64 {
    let (mut mass, mut centre, mut momentum) = (0.0, Vec2::zeros(), Vec2::zeros());
    for own in bodies {
        mass += own.mass;
        centre += own.mass * own.centre;
        momentum += own.mass * end[own.index].xy();
    }
    let (centre, drift) = (centre / mass, momentum / mass);
    // L + ΔL and ΔL, both about the centre of mass
    let (mut inertia, mut now, mut change) = (0.0, 0.0, 0.0);
    for own in bodies {
        let (r, u) = (own.centre - centre, end[own.index]);
        let v = u.xy() - drift;
        inertia += own.mass * r.norm_squared() + own.inertia;
        now += own.mass * r.perp(&v) + own.inertia * u.z;
        change += own.mass * own.moved.perp(&v);
    }
    let before = now - change;
    let rigid = |own: &Body, spin: f64| {
        let r = own.centre - centre;
        Vec3::new(drift.x - spin * r.y, drift.y + spin * r.x, spin)
    };
    let (mut relative, mut kinetic) = (0.0, 0.0);
    let energy =
        |own: &Body, u: &Vec3| 0.5 * (own.mass * u.xy().norm_squared() + own.inertia * u.z * u.z);
    for own in bodies {
        let u = end[own.index];
        relative += energy(own, &(u - rigid(own, now / inertia)));
        kinetic -= energy(own, &u);
    }
    let needed = (before * before - now * now) / (2.0 * inertia);
    let share = match needed > 0.0 && relative > 0.0 {
        true => (1.0 - needed / relative).max(0.0).sqrt(),
        false => 1.0,
    };
    for own in bodies {
        let u = &mut end[own.index];
        let w = *u - rigid(own, now / inertia);
        *u = rigid(own, before / inertia) + w * share;
        kinetic += energy(own, u);
    }
    kinetic
}
