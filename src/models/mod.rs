//! Multibody models without an engine: small and exact, for closed forms and for systems that
//! rapier cannot represent.

mod linear;
mod planar;
mod planar_shape;
mod rotor;
mod visco_elastic;

pub use linear::{Linear, LinearContact, LinearSystem};
pub use planar::{Oscillation, Pivot, Planar, PlanarBody};
pub use planar_shape::PlanarShape;
pub use rotor::{Rotor, RotorContact, RotorMotor};
pub use visco_elastic::damping_for_restitution;
