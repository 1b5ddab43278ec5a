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
pub(super) fn restore_angular_momentum(
    model: &dyn MultibodyModel,
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
            .map(|&b| Body::new(model, b as usize, closed.moved[b as usize], inverse_mass))
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
    fn new(
        model: &dyn MultibodyModel,
        index: usize,
        moved: Vec2,
        inverse_mass: &[Vec3],
    ) -> Option<Body> {
        let w = inverse_mass[index];
        let free = w.x > 0.0 && w.x == w.y && w.z > 0.0;
        Some(Body {
            index,
            mass: 1.0 / w.x,
            inertia: 1.0 / w.z,
            centre: model.centre(index).filter(|_| free)?,
            moved,
        })
    }
}

/// The rigid motion of an island without support that has its momenta.
struct Rigid {
    /// The centre of the first body, and the centre of mass from there \[m\]: far from the origin the
    /// round-off of an arm from a centre of mass would be a momentum `m Ω × r`.
    first: Vec2,
    centre: Vec2,
    drift: Vec2,
    /// `J` [kg m²] and `L` [kg m²/s].
    inertia: f64,
    momentum: f64,
}

impl Rigid {
    fn of(bodies: &[Body], velocities: &[Vec3]) -> Rigid {
        let (mut mass, mut centre, mut momentum) = (0.0, Vec2::zeros(), Vec2::zeros());
        let first = bodies.first().map_or(Vec2::zeros(), |own| own.centre);
        for own in bodies {
            mass += own.mass;
            centre += own.mass * (own.centre - first);
            momentum += own.mass * velocities[own.index].xy();
        }
        let mut rigid = Rigid {
            first,
            centre: centre / mass,
            drift: momentum / mass,
            inertia: 0.0,
            momentum: 0.0,
        };
        for own in bodies {
            let (r, u) = (rigid.arm(own), velocities[own.index]);
            rigid.inertia += own.mass * r.norm_squared() + own.inertia;
            rigid.momentum += own.mass * r.perp(&(u.xy() - rigid.drift)) + own.inertia * u.z;
        }
        rigid
    }

    /// `r` of a body \[m\].
    fn arm(&self, body: &Body) -> Vec2 {
        (body.centre - self.first) - self.centre
    }

    /// Velocity of a body at the angular momentum `momentum`.
    fn velocity(&self, body: &Body, momentum: f64) -> Vec3 {
        let (r, spin) = (self.arm(body), momentum / self.inertia);
        Vec3::new(self.drift.x - spin * r.y, self.drift.y + spin * r.x, spin)
    }
}

/// The motion of `bodies` relative to the rigid one that has their momenta. `None` if not all their
/// coordinates are free.
pub(super) fn relative_motion(
    model: &dyn MultibodyModel,
    bodies: &[u32],
    inverse_mass: &[Vec3],
    velocities: &[Vec3],
) -> Option<Vec<Vec3>> {
    let own = (bodies.iter()).map(|&b| Body::new(model, b as usize, Vec2::zeros(), inverse_mass));
    let own: Vec<Body> = own.collect::<Option<_>>()?;
    let rigid = Rigid::of(&own, velocities);
    let relative = |b: &Body| velocities[b.index] - rigid.velocity(b, rigid.momentum);
    Some(own.iter().map(relative).collect())
}

fn restore(bodies: &[Body], end: &mut [Vec3]) -> f64 {
    let rigid = Rigid::of(bodies, end);
    let now = rigid.momentum;
    let of = |own: &Body| own.mass * own.moved.perp(&(end[own.index].xy() - rigid.drift));
    let change: f64 = bodies.iter().map(of).sum();
    let before = now - change;
    let (mut relative, mut kinetic) = (0.0, 0.0);
    let energy =
        |own: &Body, u: &Vec3| 0.5 * (own.mass * u.xy().norm_squared() + own.inertia * u.z * u.z);
    for own in bodies {
        let u = end[own.index];
        relative += energy(own, &(u - rigid.velocity(own, now)));
        kinetic -= energy(own, &u);
    }
    let needed = (before * before - now * now) / (2.0 * rigid.inertia);
    let share = match needed > 0.0 && relative > 0.0 {
        true => (1.0 - needed / relative).max(0.0).sqrt(),
        false => 1.0,
    };
    for own in bodies {
        let u = &mut end[own.index];
        let w = *u - rigid.velocity(own, now);
        *u = rigid.velocity(own, before) + w * share;
        kinetic += energy(own, u);
    }
    kinetic
}
