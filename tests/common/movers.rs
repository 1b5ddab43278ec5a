//! Bodies that move on their own and belts: what they give to the others.

use moreau2d::contact::{NO_BODY, Vec2, Vec3};
use moreau2d::dynamics::record::StepRecord;
use moreau2d::experiment::Engine;
use moreau2d::scene::{Body, BodyKind, Built, Scene};

/// A body that moves on its own, or whose surface does.
pub struct Mover {
    /// By the record.
    number: u32,
    place: Vec2,
    velocity: Vec2,
    spin: f64,
    surface: f64,
}

pub fn movers(scene: &Scene, built: &Built, engine: Engine) -> Vec<Mover> {
    let moves = |body: &Body| body.kind == BodyKind::Kinematic || body.surface_velocity != 0.0;
    scene
        .bodies
        .iter()
        .enumerate()
        .filter(|(_, body)| moves(body))
        .map(|(k, body)| {
            let (pose, u) = engine.state(built, k).unwrap();
            let own = match body.kind {
                BodyKind::Kinematic => u,
                _ => Vec3::zeros(),
            };
            Mover {
                number: built.number(k).unwrap(),
                place: pose.translation,
                velocity: own.xy(),
                spin: own.z,
                surface: body.surface_velocity,
            }
        })
        .collect()
}

/// The movers half way between two instants.
pub fn between(before: Vec<Mover>, after: Vec<Mover>) -> Vec<Mover> {
    let mean = |(a, b): (Mover, Mover)| Mover {
        place: 0.5 * (a.place + b.place),
        velocity: 0.5 * (a.velocity + b.velocity),
        spin: 0.5 * (a.spin + b.spin),
        ..b
    };
    before.into_iter().zip(after).map(mean).collect()
}

/// What bodies that move on their own and belts gave to the others \[J\]: impulse times the
/// velocity of their surface at the contact point of the midpoint.
pub fn driven(record: &StepRecord, movers: &[Mover]) -> f64 {
    let mut work = 0.0;
    for contact in &record.contacts {
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            assert!(contact.bodies[side] != NO_BODY || side == 0);
            let mover = movers.iter().find(|m| m.number == contact.bodies[side]);
            if let Some(m) = mover {
                let arm = contact.position - m.place;
                let v = m.velocity + Vec2::new(-arm.y, arm.x) * m.spin;
                let tangent = Vec2::new(-contact.normal.y, contact.normal.x);
                let p = contact.normal * contact.impulse_n + tangent * contact.impulse_t;
                // counter-clockwise round body 1 is along +t, round body 2 along −t
                work += sign * p.dot(&v) + contact.impulse_t * m.surface;
            }
        }
    }
    work
}
