//! One rapier body as the stepper stores it.

use super::engine::dynamics::RigidBodyAdditionalMassProps;
use super::engine::prelude::*;
use super::widen::widen;
use crate::contact::{Vec2, Vec3};
use crate::dynamics::Pose64;

/// One rapier body as the stepper stores it.
#[derive(Debug, Clone)]
pub(super) struct Shadow {
    pub handle: RigidBodyHandle,
    pub pose: Pose64,
    /// Pose and velocity that are shown, where they are not those of the state: see
    /// [`Shown`](crate::dynamics::Shown).
    pub shown: Option<(Pose64, Vec3)>,
    /// Centre of mass in the body frame \[m\].
    pub center: Vec2,
    /// Distance of the farthest collider point from the centre of mass \[m\].
    pub radius: f64,
    /// Number of parts of its colliders.
    pub parts: usize,
    /// Thinnest extent of its colliders \[m\]; `None` until it is measured.
    pub thickness: Option<f64>,
    /// `M⁻¹` of the body, without the effect of damping.
    pub inverse_mass: Vec3,
    /// Forces on the body in this step.
    pub load: Load,
    pub settings: Option<Settings>,
    /// Target pose of a position-based kinematic body in this step.
    pub target: Option<Pose>,
    pub kind: RigidBodyType,
    /// Pose last written to rapier; a different one there was set by the user.
    pub written_pose: Pose,
    pub written_velocity: (Vector, Real),
    /// rapier's mass when it was last read; `None` before that, and after an exact mass was set.
    pub mass_seen: Option<(Real, Real, Vector, LockedAxes)>,
    pub added_mass: Option<RigidBodyAdditionalMassProps>,
    pub seen: bool,
    /// Number of the island in which the body sleeps, or 0.
    pub group: u32,
    /// Pose of a step ago.
    pub last: Pose64,
}

/// Forces and damping that the user sets on a body.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Load {
    /// Force \[N\] and torque [N m].
    pub force: Vec2,
    pub torque: f64,
    /// Factor on gravity.
    pub scale: f64,
    /// Linear and angular [1/s].
    pub damping: (f64, f64),
}

/// A [`Load`] in rapier's types.
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

    /// Whether mass and kind of a body are unchanged since they were last read.
    pub fn has_kind_and_mass_of(&self, body: &RigidBody) -> bool {
        let added = body.mass_properties().additional_local_mprops.as_deref();
        self.mass_seen == Some(mass_of(body))
            && self.kind == body.body_type()
            && self.added_mass.as_ref() == added
    }

    /// The pose that is shown.
    pub fn shown_pose(&self) -> Pose64 {
        self.shown.map_or(self.pose, |(pose, _)| pose)
    }

    /// Makes the pose that is shown that of the state, for a body that stays there.
    pub fn adopt_shown(&mut self) {
        if let Some((pose, _)) = self.shown.take() {
            self.pose = pose;
        }
    }

    /// The velocity that is shown, with that of the state.
    pub fn shown_velocity(&self, own: Vec3) -> Vec3 {
        self.shown.map_or(own, |(_, velocity)| velocity)
    }

    /// Pose and velocity last written to rapier.
    pub fn written(&self) -> (Pose, (Vector, Real)) {
        (self.written_pose, self.written_velocity)
    }

    /// Stores rapier's velocity as the last one written.
    pub fn note_velocity(&mut self, body: &RigidBody) {
        self.written_velocity = (body.linvel(), body.angvel());
    }

    /// A body that has not been read yet, with its velocity and inverse mass.
    pub fn unread(handle: RigidBodyHandle) -> (Self, Vec3, Vec3) {
        let shadow = Shadow {
            handle,
            pose: Pose64::new(Vec2::zeros(), 0.0),
            shown: None,
            center: Vec2::zeros(),
            radius: 0.0,
            parts: 0,
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

/// Inverse mass, inverse inertia, centre of mass and locked axes in rapier.
pub(super) fn mass_of(body: &RigidBody) -> (Real, Real, Vector, LockedAxes) {
    let local = &body.mass_properties().local_mprops;
    (
        local.inv_mass,
        local.inv_principal_inertia,
        local.local_com,
        body.locked_axes(),
    )
}

/// `M⁻¹` with zeros for the locked axes.
pub(super) fn locked(axes: LockedAxes, inverse_mass: f64, inverse_inertia: f64) -> Vec3 {
    let free = |axis, value: f64| if axes.contains(axis) { 0.0 } else { value };
    Vec3::new(
        free(LockedAxes::TRANSLATION_LOCKED_X, inverse_mass),
        free(LockedAxes::TRANSLATION_LOCKED_Y, inverse_mass),
        free(LockedAxes::ROTATION_LOCKED, inverse_inertia),
    )
}

/// Half the thinnest extent \[m\] of a shape, the radius of a disc; infinite for meshes, which rapier does not sweep
/// either.
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
