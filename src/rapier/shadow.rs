//! One rapier body as the stepper sees it.

use super::engine::dynamics::RigidBodyAdditionalMassProps;
use super::engine::prelude::*;
use super::widen::widen;
use crate::contact::{Vec2, Vec3};
use crate::dynamics::Pose64;

/// One rapier body as the stepper sees it.
#[derive(Debug, Clone)]
pub(super) struct Shadow {
    pub handle: RigidBodyHandle,
    pub pose: Pose64,
    /// Centre of mass in the body frame \[m\].
    pub center: Vec2,
    /// Farthest collider point from it \[m\].
    pub radius: f64,
    /// Thinnest extent of its colliders \[m\]; `None` until it is measured again.
    pub thickness: Option<f64>,
    /// `M⁻¹` of the body by itself: without what damping adds.
    pub inverse_mass: Vec3,
    /// What acts on it in this step, and what it was read from.
    pub load: Load,
    pub settings: Option<Settings>,
    /// Where the user sends a position-driven body in this step.
    pub target: Option<Pose>,
    pub kind: RigidBodyType,
    /// What rapier was last given; anything else found there was put there by the user.
    pub written_pose: Pose,
    pub written_velocity: (Vector, Real),
    /// `None` until it is first read, and again when an exact mass was given.
    pub mass_seen: Option<(Real, Real, Vector, LockedAxes)>,
    pub added_mass: Option<RigidBodyAdditionalMassProps>,
    pub seen: bool,
    /// The island it sleeps in, or 0.
    pub group: u32,
    /// Where it stood a step ago.
    pub last: Pose64,
}

/// What the user puts on a body.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Load {
    /// \[N\], [N m].
    pub force: Vec2,
    pub torque: f64,
    /// Factor on gravity.
    pub scale: f64,
    /// Linear and angular [1/s].
    pub damping: (f64, f64),
}

/// A [`Load`] as rapier has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Settings {
    force: Vector,
    torque: Real,
    scale: Real,
    damping: [Real; 2],
}

impl Settings {
    #[inline]
    pub fn of(body: &RigidBody) -> Settings {
        Settings {
            force: body.user_force(),
            torque: body.user_torque(),
            scale: body.gravity_scale(),
            damping: [body.linear_damping(), body.angular_damping()],
        }
    }

    pub fn load(&self) -> Load {
        let [linear, angular] = self.damping.map(widen);
        Load {
            force: Vec2::new(widen(self.force.x), widen(self.force.y)),
            torque: widen(self.torque),
            scale: widen(self.scale),
            damping: (linear, angular),
        }
    }
}

impl Shadow {
    /// Whether the user has moved, changed or switched a body since the last step.
    pub fn differs(&self, body: &RigidBody) -> bool {
        let added = body.mass_properties().additional_local_mprops.as_deref();
        *body.position() != self.written_pose
            || body.body_type() != self.kind
            || added != self.added_mass.as_ref()
            || self
                .mass_seen
                .is_none_or(|seen| seen.3 != body.locked_axes())
    }

    /// Whether its mass and kind are as they were read.
    pub fn has_kind_and_mass_of(&self, body: &RigidBody) -> bool {
        let added = body.mass_properties().additional_local_mprops.as_deref();
        self.mass_seen == Some(mass_of(body))
            && self.kind == body.body_type()
            && self.added_mass.as_ref() == added
    }

    /// What rapier was given last.
    pub fn written(&self) -> (Pose, (Vector, Real)) {
        (self.written_pose, self.written_velocity)
    }

    /// Takes the velocity that rapier holds for our own.
    pub fn note_velocity(&mut self, body: &RigidBody) {
        self.written_velocity = (body.linvel(), body.angvel());
    }

    /// With the velocity and inverse mass that go with it.
    pub fn unseen(handle: RigidBodyHandle) -> (Self, Vec3, Vec3) {
        let shadow = Shadow {
            handle,
            pose: Pose64::new(Vec2::zeros(), 0.0),
            center: Vec2::zeros(),
            radius: 0.0,
            thickness: None,
            inverse_mass: Vec3::zeros(),
            load: Load::default(),
            settings: None,
            target: None,
            kind: RigidBodyType::Fixed,
            written_pose: Pose::IDENTITY,
            written_velocity: (Vector::ZERO, 0.0),
            mass_seen: None,
            added_mass: None,
            seen: false,
            group: 0,
            last: Pose64::new(Vec2::zeros(), 0.0),
        };
        (shadow, Vec3::zeros(), Vec3::zeros())
    }
}

/// Inverses of mass and inertia, centre of mass and what is locked, as rapier has them.
pub(super) fn mass_of(body: &RigidBody) -> (Real, Real, Vector, LockedAxes) {
    let local = &body.mass_properties().local_mprops;
    (
        local.inv_mass,
        local.inv_principal_inertia,
        local.local_com,
        body.locked_axes(),
    )
}

/// `M⁻¹` with what is locked.
pub(super) fn locked(axes: LockedAxes, inverse_mass: f64, inverse_inertia: f64) -> Vec3 {
    let free = |axis, value: f64| if axes.contains(axis) { 0.0 } else { value };
    Vec3::new(
        free(LockedAxes::TRANSLATION_LOCKED_X, inverse_mass),
        free(LockedAxes::TRANSLATION_LOCKED_Y, inverse_mass),
        free(LockedAxes::ROTATION_LOCKED, inverse_inertia),
    )
}

/// Thinnest extent \[m\] of a shape; of a mesh none, as rapier does not follow those either.
pub(super) fn thickness(shape: &dyn Shape) -> f64 {
    match shape.shape_type() {
        ShapeType::TriMesh | ShapeType::Polyline | ShapeType::HeightField | ShapeType::Voxels => {
            f64::INFINITY
        }
        _ => f64::from(shape.ccd_thickness()),
    }
}

/// `M⁻¹` of a damped body, `w / (1 + θ x)`, `x = d Δt`, `θ = 1/(1 − e⁻ˣ) − 1/x`.
///
/// With the drag `−d m u_A` as a force it makes of `m u̇ = F − d m u + P` the step
///
/// ```text
/// m (u_E − u_A) = F Δt − d m Δt ((1 − θ) u_A + θ u_E) + P                      (1)
/// ```
///
/// exact in free motion, `u_E = u_A e⁻ˣ + (F/m d)(1 − e⁻ˣ)`, at rest, and stable for any `x`.
///
/// # Source
/// Exponential fitting: Liniger & Willoughby, *SIAM J. Numer. Anal.* 7 (1970).
pub(super) fn damped(own: Vec3, (linear, angular): (f64, f64), dt: f64) -> Vec3 {
    let factor = |d: f64| {
        let x = d * dt;
        // 1 + θ x = x / (1 − e⁻ˣ)
        if x == 0.0 { 1.0 } else { -(-x).exp_m1() / x }
    };
    let (a, b) = (factor(linear), factor(angular));
    own.component_mul(&Vec3::new(a, a, b))
}
