use crate::contact::{Law, Vec2};
use serde::{Deserialize, Serialize};

/// Which rows of a block are active.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Status {
    /// No impulse.
    Open,
    /// All rows are active: a sticking or frictionless contact, a pin, a bounded row within its
    /// bounds.
    Closed,
    /// Sliding, `P_T = μ P_N` and `P_T = −μ P_N`.
    SlipPlus,
    SlipMinus,
    /// A bounded row at its lower and upper bound.
    Lower,
    Upper,
}

impl Status {
    /// Status of a block with this law at `z = P − ρ ξ`.
    pub fn of(law: &Law, z: Vec2) -> Status {
        match *law {
            Law::Contact { friction, .. } => {
                if z.x <= 0.0 {
                    Status::Open
                } else if friction == 0.0 || z.y.abs() <= friction * z.x {
                    Status::Closed
                } else if z.y > 0.0 {
                    Status::SlipPlus
                } else {
                    Status::SlipMinus
                }
            }
            Law::Pin => Status::Closed,
            Law::Bounded { lower, upper, .. } => {
                if z.x <= lower {
                    Status::Lower
                } else if z.x >= upper {
                    Status::Upper
                } else {
                    Status::Closed
                }
            }
        }
    }
}
