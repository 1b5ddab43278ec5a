//! Checks of the bodies of a rapier world.

use super::changes::finite;
use super::engine::prelude::*;
use crate::dynamics::ModelError;

/// Index and generation of a handle, for messages.
pub(super) fn body_id(handle: RigidBodyHandle) -> (u32, u32) {
    handle.into_raw_parts()
}

pub(super) fn not_there(handle: RigidBodyHandle) -> ModelError {
    let id = body_id(handle);
    ModelError::Invalid(format!("body (handle {id:?}) is not in the world"))
}

/// Whether pose, target and velocity of a body are finite. `false` may come from an overflow of
/// their sum; [`refuse_bad`] then checks each.
#[inline]
pub(super) fn is_surely_finite(body: &RigidBody) -> bool {
    let (at, next, v) = (body.position(), body.next_position(), body.linvel());
    let turns = (at.rotation.re + at.rotation.im) + (next.rotation.re + next.rotation.im);
    let places = (at.translation.x + at.translation.y) + (next.translation.x + next.translation.y);
    ((turns + places) + (v.x + v.y + body.angvel())).is_finite()
}

/// Refuses a body with a number that is not finite.
pub(super) fn refuse_bad(body: &RigidBody, name: impl Fn() -> String) -> Result<(), ModelError> {
    let (v, f) = (body.linvel(), body.user_force());
    let fields = [
        ("position [m]", body.position().translation.x),
        ("position [m]", body.position().translation.y),
        ("rotation", body.rotation().re),
        ("rotation", body.rotation().im),
        ("velocity [m/s]", v.x),
        ("velocity [m/s]", v.y),
        ("spin [rad/s]", body.angvel()),
        ("force [N]", f.x),
        ("force [N]", f.y),
        ("torque [N m]", body.user_torque()),
        ("gravity scale", body.gravity_scale()),
        ("linear damping [1/s]", body.linear_damping()),
        ("angular damping [1/s]", body.angular_damping()),
    ];
    // one branch for the usual case
    let sum: f64 = fields.iter().map(|(_, x)| f64::from(*x)).sum();
    if sum.is_finite() && finite(body.next_position()) {
        return Ok(());
    }
    let bad = fields.iter().find(|(_, x)| !x.is_finite());
    let (field, value) = bad.unwrap_or(&("target position [m]", Real::NAN));
    Err(ModelError::Invalid(format!(
        "{}: {field} is {value}, which is not finite",
        name()
    )))
}

/// Checks the mass of a dynamic body. Without one it moves at its velocity as in rapier: no force or
/// impulse changes it.
pub(super) fn check_mass(body: &RigidBody, name: impl Fn() -> String) -> Result<(), ModelError> {
    let local = &body.mass_properties().local_mprops;
    let (mass, inertia) = (local.inv_mass, local.inv_principal_inertia);
    let bad = |what: &str, inverse: Real| {
        Err(ModelError::Invalid(format!(
            "{}: {what} is {}, must be finite and above 0",
            name(),
            1.0 / inverse
        )))
    };
    if !(mass.is_finite() && mass >= 0.0) {
        return bad("mass [kg]", mass);
    }
    if !(inertia.is_finite() && inertia >= 0.0) {
        return bad("inertia [kg m2]", inertia);
    }
    if !local.local_com.is_finite() {
        return Err(ModelError::Invalid(format!(
            "{}: centre of mass is {}, which is not finite",
            name(),
            local.local_com
        )));
    }
    Ok(())
}
