//! Properties of bodies other than their masses: dominance, and sweeps for event location.

use crate::contact::{NO_BODY, Vec2, Vec3};

/// Whether the motion of a body within a step is swept, so that it passes through nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// Half the thinnest extent \[m\], the radius of a disc: a body that moves less than half of it in a step
    /// cannot pass through another. Infinite for a body that is not swept.
    pub thickness: f64,
    /// Whether the sweep is against all bodies, or only against fixed and kinematic ones.
    pub all: bool,
}

impl Sweep {
    /// For a body that is not swept.
    pub const NONE: Sweep = Sweep {
        thickness: f64::INFINITY,
        all: false,
    };
}

/// One entry per body; a list is empty if all its entries would be the default.
///
/// # Dominance
/// In a contact of two bodies with different dominance only the lower one receives the impulse, as
/// if the motion of the other were prescribed. This makes the contact problem block triangular: the
/// higher bodies are solved first, and the lower ones meet them with their velocities at the end of
/// the step. Joints ignore dominance.
///
/// # Sweeps
/// A contact that closes by more than half the thickness of a swept body in a step is located in
/// time, as with [`super::settings::StepperSettings::events`]. In clusters of more than 32 bodies that is so only if it
/// closes by as much in a quarter of the step; else the cluster is stepped in four parts. All other contacts are treated
/// as usual. So are those without rebound with fixed and kinematic bodies in a crowd of more than 32 bodies, linked by
/// contacts that may close in the step, unless a body overlaps by more than half the thickness at the midpoint: the
/// usual rule holds them as well, and a heap that is stepped again and again costs more and is left with more overlap.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct BodyRoles {
    pub dominance: Vec<i16>,
    pub sweeps: Vec<Sweep>,
}

impl BodyRoles {
    /// The `movable` sides that receive impulses: those that do not dominate the other side.
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

    /// Thickness \[m\] of the body of two touching ones that is swept against the other; `None` if
    /// neither is.
    pub(super) fn swept_thickness(&self, bodies: [u32; 2], inverse_mass: &[Vec3]) -> Option<f64> {
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

    /// Whether a contact of two bodies with relative velocity `gamma` \[m/s\] must be located in a
    /// step of `dt` \[s\].
    pub(super) fn swept(
        &self,
        bodies: [u32; 2],
        gamma: Vec2,
        dt: f64,
        inverse_mass: &[Vec3],
    ) -> bool {
        let thickness = self.swept_thickness(bodies, inverse_mass);
        thickness.is_some_and(|thickness| gamma.x.abs() * dt > 0.5 * thickness)
    }
}
