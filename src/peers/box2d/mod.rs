//! Box2D v3 on what a rapier world holds: a peer in comparisons, with the feature `box2d`.

#[cfg(not(feature = "box2d"))]
mod absent;
#[cfg(feature = "box2d")]
mod joints;
#[cfg(feature = "box2d")]
mod shapes;
#[cfg(feature = "box2d")]
mod world;

#[cfg(not(feature = "box2d"))]
pub use absent::Box2d;
#[cfg(feature = "box2d")]
pub use world::Box2d;

use std::fmt;

/// Why there is no Box2D in a build without it.
pub const BOX2D_MISSING: &str =
    "not built in: needs the cargo feature `box2d` (cargo build --release --features box2d)";

/// Box2D's solver settings that decide how stiff its contacts are.
///
/// Its contacts are damped springs as rapier's are ([`super::BaselineSettings`]): of the step Δt it
/// makes `substeps` of `h = Δt / substeps`, each with one sweep that pushes penetrations out and one
/// without the push. It uses no higher frequency than `1 / (8 h)`, and twice that at fixed bodies;
/// the damping ratio is 10.
///
/// # What Box2D is given of a world
/// Bodies, colliders and joints are copied once, as rapier has them; Box2D steps its copy, and
/// poses and velocities are written back after each step, so that every measure reads the same
/// world whoever stepped it. What is changed in the rapier world later than the copy is not seen.
///
/// The same: poses, velocities, mass and inertia, gravity and its scale, damping, collision groups,
/// which bodies are swept against moving ones too, friction, restitution and the rules that combine them (through Box2D's callbacks where its own
/// rules, the root of the product and the larger, give another number), belts, length of step.
/// Nothing sleeps, as in all comparisons.
///
/// Box2D's own and left as it comes: a metre is one of its units, so that its linear slop is 5 mm
/// and contacts begin 20 mm apart; penetrations are pushed out at 3 m/s at most; there is no
/// restitution below 1 m/s; a substep turns no body by more than 45 degrees; nothing moves faster
/// than 400 m/s; joints are springs of 60 Hz; dynamic bodies are swept against fixed ones; contacts
/// of pairs that hardly move are kept; four contacts are solved at a time (SSE2, Neon).
///
/// What it has not is refused by name: other shapes than balls, boxes, capsules, segments,
/// polylines and convex polygons of at most eight corners that Box2D leaves as they are; joints
/// other than pins, sliders, welds, pin-slots, ropes, and springs between centres of mass; driving
/// springs; compliant and one-way surfaces, contact skin, sensors and hooks; dominance, forces set
/// by the user, bodies that are told their poses.
///
/// # Source
/// Box2D 3.2 through the crate boxdd 0.6: `b2DefaultWorldDef`, `constants.h`, `contact_solver.c`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Box2dSettings {
    /// Natural frequency \[Hz\] of contacts between moving bodies.
    pub contact_frequency: f64,
    /// Substeps of a step.
    pub substeps: usize,
}

impl Box2dSettings {
    /// Box2D as it comes.
    pub const DEFAULT: Box2dSettings = Box2dSettings {
        contact_frequency: 30.0,
        substeps: 4,
    };

    /// The highest frequency that Box2D uses at steps of `dt` \[s\]: an eighth of the substeps' rate
    /// \[Hz\].
    pub fn highest(substeps: usize, dt: f64) -> f64 {
        substeps as f64 / (8.0 * dt)
    }
}

impl Default for Box2dSettings {
    fn default() -> Self {
        Box2dSettings::DEFAULT
    }
}

/// Every setting, as tables and charts spell it.
impl fmt::Display for Box2dSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} Hz up to 1/8 of the substeps' rate, x2 at fixed bodies, {} substeps",
            self.contact_frequency, self.substeps
        )
    }
}
