//! Answers that mechanics knows in closed form, and the order at which the scheme reaches them.
//!
//! Gates at steps of 1/60 s, the scheme `staggered`; orders over 1/30 ... 1/1000 s. Shapes whose gaps
//! parry forms in `f32` (capsules, polygons) may add 3e-7 of their size.

mod events;
mod impacts;
mod pivots;
mod sliding;
mod statics;
mod study;

/// Friction of the catalogue's scenes and gravity.
pub const MU: f64 = 0.5;
pub const G: f64 = 9.81;
/// Step of the gates.
pub const DT: f64 = 1.0 / 60.0;
/// Constant accelerations are integrated exactly: what is left is one rounding of 1.1e-16 a step
/// over some hundred steps, and the few of the closed form.
pub const ROUND_OFF: f64 = 1e-12;
