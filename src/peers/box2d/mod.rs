//! Box2D v3 on a copy of a rapier world: a peer in comparisons, with the feature `box2d`.

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

/// Settings of Box2D's solver that determine how stiff its contacts are.
///
/// Its contacts are damped springs as rapier's are ([`super::BaselineSettings`]). It divides the
/// step Δt into `substeps` of `h = Δt / substeps`, each with one sweep that reduces penetrations
/// and one that does not. It uses no higher frequency than `1 / (8 h)`, and twice that at fixed
/// bodies; the damping ratio is 10.
///
/// # What Box2D copies from a world
/// Bodies, colliders and joints are copied once from rapier. Box2D steps its copy, and poses and
/// velocities are written back after each step, so that every measurement reads the same world.
/// Box2D does not see changes of the rapier world after the copy.
///
/// Copied: poses, velocities, mass and inertia, gravity and its scale, damping, collision groups,
/// which bodies are swept against moving ones too, friction, restitution and the rules that combine
/// them (through Box2D's callbacks if its own rules, the root of the product and the larger, give
/// another number), belts, and the step length. Nothing sleeps, as in all comparisons.
///
/// Box2D's defaults: a metre is one of its units, so that its linear slop is 5 mm and contacts
/// begin 20 mm apart; penetrations are reduced at 3 m/s at most; there is no restitution below 1
/// m/s; a substep rotates no body by more than 45 degrees; nothing moves faster than 400 m/s;
/// joints are springs of 60 Hz; dynamic bodies are swept against fixed ones; contacts of pairs that
/// hardly move are recycled; four contacts are solved at a time (SSE2, Neon).
///
/// What Box2D does not have is refused by name: shapes other than balls, boxes, capsules, segments,
/// polylines and convex polygons of at most eight corners that Box2D does not change; joints other
/// than pins, sliders, welds, pin-slots, ropes, and springs between centres of mass; driving
/// springs; compliant and one-way surfaces, contact skin, sensors and hooks; dominance, user
/// forces, position-based kinematic bodies.
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
    /// Box2D's defaults.
    pub const DEFAULT: Box2dSettings = Box2dSettings {
        contact_frequency: 30.0,
        substeps: 4,
    };

    /// The highest frequency that Box2D uses at steps of `dt` \[s\]: an eighth of the substep rate
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

/// All settings, as tables and charts print them.
impl fmt::Display for Box2dSettings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} Hz up to 1/8 of the substeps' rate, x2 at fixed bodies, {} substeps",
            self.contact_frequency, self.substeps
        )
    }
}
