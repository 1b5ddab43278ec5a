//! The contact problem as a plain value, and the judge of its solutions.
//!
//! # Sign convention
//!
//! A contact joins side 1 to side 2. Its normal `n` points from 1 to 2, its tangent is the normal
//! turned by +90 degrees, and every pair of numbers is ordered (n, t). The local velocity is
//! `γ = v₂ − v₁` at the contact point, plus the velocity of a moving surface; the impulse
//! `P = (P_N ≥ 0, P_T)` acts on side 2 and `−P` on side 1; a gap `g_N > 0` is open.
//!
//! # The problem
//!
//! With the Delassus operator `G = W^T M⁻¹ W` [1/kg] and the free term `b` \[m/s\],
//!
//! ```text
//! ξ = G P + b (+ R P_N on compliant rows)                                    (1)
//! 0 ≤ P_N ⟂ ξ_N ≥ 0,   −P_T ∈ μ P_N Sgn(ξ_T)                                 (2)
//! ```
//!
//! The stepper adds Newton's restitution, surface motion and gap terms to `b`. Joints are rows of
//! the same problem: see [`Law`].
//!
//! # Sources
//!
//! Moreau (1988); De Saxcé & Feng (1998); Glocker & Studer, Multibody Syst. Dyn. 13 (2005);
//! Acary & Brogliato, *Numerical Methods for Nonsmooth Dynamical Systems* (2008).

mod blocks;
mod cone;
pub mod examples;
mod law;
mod local;
mod local_bodies;
mod local_four;
mod operator;
mod problem;
mod residual;

pub use blocks::BlockMatrix;
pub use cone::project_onto_cone;
pub use law::Law;
pub use local::solve_local;
pub(crate) use local_bodies::LocalBodies;
#[cfg(test)]
pub(crate) use local_four::levels;
pub(crate) use local_four::{Four, FourContacts, Slip, load_four, solve_four};
pub use operator::{BodyOperator, Delassus, NO_BODY, Rows, SweepState};
pub use problem::{ContactError, ContactProblem};
pub(crate) use residual::feasibility;
pub use residual::{Judge, Residual, natural_map};

/// A pair (n, t).
pub type Vec2 = nalgebra::Vector2<f64>;
/// A 2 × 2 block in (n, t).
pub type Mat2 = nalgebra::Matrix2<f64>;
/// Generalised velocity of one body: (v_x, v_y, ω) in m/s and rad/s.
pub type Vec3 = nalgebra::Vector3<f64>;
