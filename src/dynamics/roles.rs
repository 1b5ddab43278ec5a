//! What bodies differ in beyond their masses: dominance, and how closely they are followed in time.

use crate::contact::{NO_BODY, Vec2, Vec3};

/// How closely a body's motion within a step is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Thinnest extent \[m\]: what moves less than half of it in a step passes through nothing.
    /// Infinite for a body that is not followed.
    pub thickness: f64,
    /// Against all bodies, not only those that nothing moves.
    pub all: bool,
}

impl Sweep {
    /// Of a body that is not followed.
    pub const NONE: Sweep = Sweep {
        thickness: f64::INFINITY,
        all: false,
    };
}

/// One entry a body; a list is empty where no body differs.
///
/// # Dominance
/// In a contact of bodies of different dominance the lower one alone takes the impulse, as if the
/// other moved on its own. The contact problem is block triangular then: the higher bodies are
/// solved first, and the lower ones meet them with their velocities at the end of the step.
/// Joints know no dominance.
///
/// # Sweeps
/// A contact that closes by more than half the thickness of a followed body in a step is located
/// in time, as by [`super::settings::StepperSettings::events`]; others stay as they are.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BodyRoles {
    pub dominance: Vec<i16>,
    pub sweeps: Vec<Sweep>,
}

impl BodyRoles {
    /// Those of the `movable` ones of two bodies that take impulses: those that are not above the other.
    #[inline]
    pub(super) fn receiving(&self, bodies: [u32; 2], movable: [u32; 2]) -> [u32; 2] {
        let mut own = movable;
        if let (false, [a, b]) = (self.dominance.is_empty(), bodies)
            && a != NO_BODY
            && b != NO_BODY
        {
            match self.dominance[a as usize].cmp(&self.dominance[b as usize]) {
                std::cmp::Ordering::Greater => own[0] = NO_BODY,
                std::cmp::Ordering::Less => own[1] = NO_BODY,
                std::cmp::Ordering::Equal => {}
            }
        }
        own
    }

    /// Thickness \[m\] of that one of two touching bodies that is followed against the other, if one is.
    pub(super) fn followed(&self, bodies: [u32; 2], inverse_mass: &[Vec3]) -> Option<f64> {
        if self.sweeps.is_empty() {
            return None;
        }
        let [a, b] = bodies;
        let still = |k: u32| k == NO_BODY || inverse_mass[k as usize] == Vec3::zeros();
        let of = |own: u32, other: u32| {
            let sweep = self.sweeps.get(own as usize)?;
            (sweep.all || still(other)).then_some(sweep.thickness)
        };
        match (of(a, b), of(b, a)) {
            (Some(one), Some(two)) => Some(one.min(two)),
            (one, two) => one.or(two),
        }
    }

    /// Whether a contact of two bodies with relative velocity `gamma` \[m/s\] is to be located in a step of
    /// `dt` \[s\].
    pub(super) fn swept(
        &self,
        bodies: [u32; 2],
        gamma: Vec2,
        dt: f64,
        inverse_mass: &[Vec3],
    ) -> bool {
        let thickness = self.followed(bodies, inverse_mass);
        thickness.is_some_and(|thickness| gamma.x.abs() * dt > 0.5 * thickness)
    }
}
