//! Builds our record from a peer's step of the rapier world.

use crate::contact::{NO_BODY, Vec2};
use crate::dynamics::Pose64;
use crate::dynamics::record::{ContactRecord, ContactStatus, StepEnergy, StepRecord, SurfacePoint};
use crate::rapier::engine::prelude::*;

/// A record without contacts. All values that a peer does not report are NaN
/// ([`StepRecord::accounted`]).
///
/// # Arguments
/// - `time`, `dt`: end and length of the step \[s\].
/// - `start`: [`energies`] before it.
pub(super) fn record(world: &PhysicsWorld, time: f64, dt: f64, start: [f64; 2]) -> StepRecord {
    let end = energies(world);
    StepRecord {
        time,
        dt,
        energy: StepEnergy {
            kinetic_start: start[0],
            kinetic_end: end[0],
            potential_start: start[1],
            potential_end: end[1],
            forces: f64::NAN,
            contact_n: f64::NAN,
            contact_t: f64::NAN,
            joints: f64::NAN,
            motors: f64::NAN,
            returned: f64::NAN,
            recovery: f64::NAN,
        },
        residual: f64::NAN,
        residual_velocity: f64::NAN,
        joint_gap: f64::NAN,
        impact_gain: f64::NAN,
        penetration_impact: f64::NAN,
        accounted: false,
        ..StepRecord::default()
    }
}

/// Kinetic and potential energy of all dynamic bodies \[J\].
pub(super) fn energies(world: &PhysicsWorld) -> [f64; 2] {
    let moving = world.bodies.iter().map(|(_, b)| b);
    moving.filter(|b| b.is_dynamic()).fold([0.0; 2], |sum, b| {
        let height = f64::from(world.gravity.dot(b.center_of_mass()));
        let potential = -f64::from(b.mass()) * f64::from(b.gravity_scale()) * height;
        [sum[0] + f64::from(b.kinetic_energy()), sum[1] + potential]
    })
}

/// A contact point in the world.
#[derive(Clone, Copy)]
pub(super) struct Touch {
    /// \[m\]
    pub place: Vector,
    /// From the first collider to the second.
    pub normal: Vec2,
    /// \[m\]
    pub gap: f64,
}

/// One side of a contact point, as a peer found it, possibly in an earlier step.
pub(super) struct Surface {
    /// Present pose of the shape.
    pub pose: Pose,
    /// Index of the shape among the parts of its collider.
    pub part: u32,
    /// Point on the shape, in its frame \[m\].
    pub point: Vector,
    /// Outward normal of the shape there, in its frame.
    pub normal: Vector,
}

/// Moves a contact point with both shapes to their present poses.
///
/// A shape that is round about a core (ball, capsule, round corners) touches at its present nearest
/// point, however it has rotated since. The gap is that of the cores `c` along the normal, less
/// both radii `r` and the contact skins `s`,
/// ```text
/// g = (c₂ − c₁) · n − r₁ − r₂ − s₁ − s₂
/// ```
/// with the normal of a side that has a face, or of the line between the cores if both are round.
/// The position is half way between the two points, one of which may have slid along the other.
pub(super) fn touch(
    world: &PhysicsWorld,
    colliders: [ColliderHandle; 2],
    sides: [Surface; 2],
) -> Touch {
    let shapes = colliders.map(|handle| &world.colliders[handle]);
    let radii = [0, 1].map(|k| rounding(shapes[k], sides[k].part));
    let poses = [0, 1].map(|k| widened(&sides[k].pose));
    let cores = [0, 1].map(|k| {
        let side = &sides[k];
        poses[k].apply(wide(side.point) - wide(side.normal) * radii[k])
    });
    let [first, second] = [0, 1].map(|k| poses[k].rotate(wide(sides[k].normal)));
    let between = cores[1] - cores[0];
    let normal = match radii {
        [0.0, _] => first,
        [_, 0.0] => -second,
        // for cores that cross, the normal does not change
        _ if between.dot(&first) > 0.0 => between.normalize(),
        _ => first,
    };
    let place = 0.5 * (cores[0] + cores[1] + normal * (radii[0] - radii[1]));
    let skins = shapes.map(|c| f64::from(c.contact_skin()));
    Touch {
        place: Vector::new(place.x as Real, place.y as Real),
        normal,
        gap: between.dot(&normal) - radii[0] - radii[1] - skins[0] - skins[1],
    }
}

/// Radius \[m\] about the core of a part of a collider.
pub(super) fn rounding(collider: &Collider, part: u32) -> f64 {
    let whole = collider.shape();
    let part = whole
        .as_compound()
        .and_then(|c| c.shapes().get(part as usize));
    let shape = part.map_or(whole, |(_, shape)| &**shape);
    f64::from(match shape.as_typed_shape() {
        TypedShape::Ball(ball) => ball.radius,
        TypedShape::Capsule(capsule) => capsule.radius,
        TypedShape::RoundCuboid(round) => round.border_radius,
        TypedShape::RoundTriangle(round) => round.border_radius,
        TypedShape::RoundConvexPolygon(round) => round.border_radius,
        _ => 0.0,
    })
}

/// Present pose of a collider, from the pose of its body.
pub(super) fn pose(world: &PhysicsWorld, handle: ColliderHandle) -> Pose {
    let collider = &world.colliders[handle];
    let body = collider.parent().and_then(|h| world.bodies.get(h));
    match (body, collider.position_wrt_parent()) {
        (Some(body), Some(within)) => body.position() * within,
        _ => *collider.position(),
    }
}

/// The data that a peer reports of a contact point.
pub(super) struct PeerContact {
    pub colliders: [ColliderHandle; 2],
    pub cells: [u32; 2],
    pub touch: Touch,
    /// Impulses on the second collider [N s].
    pub impulse_n: f64,
    pub impulse_t: f64,
    /// Friction coefficient of the pair.
    pub friction: f64,
}

impl PeerContact {
    fn velocity(&self, world: &PhysicsWorld) -> Vec2 {
        let of = |side: usize| {
            let parent = world.colliders[self.colliders[side]].parent();
            parent.map_or(Vec2::zeros(), |handle| {
                wide(world.bodies[handle].velocity_at_point(self.touch.place))
            })
        };
        of(1) - of(0)
    }

    fn tangent(&self) -> Vec2 {
        Vec2::new(-self.touch.normal.y, self.touch.normal.x)
    }

    /// Tangential velocity of the second body's point relative to the first's \[m/s\].
    pub fn slip_velocity(&self, world: &PhysicsWorld) -> f64 {
        self.velocity(world).dot(&self.tangent())
    }

    /// Adds the contact to the record, unless it is open and without impulse.
    pub fn add(self, world: &PhysicsWorld, record: &mut StepRecord) {
        record.penetration = record.penetration.max(-self.touch.gap);
        let (impulse_n, impulse_t) = (self.impulse_n, self.impulse_t);
        if impulse_n <= 0.0 && self.touch.gap > 0.0 {
            return;
        }
        let slip_velocity = self.slip_velocity(world);
        let impulse = self.touch.normal * impulse_n + self.tangent() * impulse_t;
        let colliders = self.colliders.map(|handle| &world.colliders[handle]);
        let moment = |c: &Collider, sign: f64| {
            let body = c.parent().and_then(|h| world.bodies.get(h));
            let body = body.filter(|b| b.is_dynamic())?;
            let arm = wide(self.touch.place) - wide(body.center_of_mass());
            Some(sign * arm.perp(&impulse))
        };
        let number = |c: &Collider| c.parent().map_or(NO_BODY, |h| h.into_raw_parts().0);
        record.contacts.push(ContactRecord {
            time: record.time,
            bodies: colliders.map(number),
            surfaces: self.colliders.map(|h| h.into_raw_parts().0),
            places: self.cells.map(SurfacePoint::on),
            position: wide(self.touch.place),
            normal: self.touch.normal,
            gap: self.touch.gap,
            impulse_n,
            impulse_t,
            moments: [moment(colliders[0], -1.0), moment(colliders[1], 1.0)],
            slip: record.dt * slip_velocity,
            load_slip: impulse_n * slip_velocity.abs(),
            friction_work: -impulse_t * slip_velocity,
            normal_work: impulse_n * self.velocity(world).dot(&self.touch.normal),
            // the engine regularises its contacts in its own way
            stiffness: f64::INFINITY,
            status: if impulse_n <= 0.0 {
                ContactStatus::Open
            } else if impulse_t.abs() < 0.999 * self.friction * impulse_n {
                ContactStatus::Stick
            } else if slip_velocity > 0.0 {
                ContactStatus::SlipPlus
            } else {
                ContactStatus::SlipMinus
            },
        });
    }
}

/// A peer's pose in `f64`, number by number.
fn widened(pose: &Pose) -> Pose64 {
    Pose64 {
        translation: wide(pose.translation),
        cos: f64::from(pose.rotation.re),
        sin: f64::from(pose.rotation.im),
    }
}

pub(super) fn wide(v: Vector) -> Vec2 {
    Vec2::new(v.x.into(), v.y.into())
}
