/// The law of one block of rows. A block has two rows (n, t) or one (n).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// Unilateral contact with Coulomb friction, `0 ≤ P_N ⟂ ξ_N ≥ 0`, `−P_T ∈ μ P_N Sgn(ξ_T)`.
    ///
    /// With `friction = 0` the block has one row. `compliance` is `R ≥ 0` [1/kg] of a
    /// visco-elastic contact, `ξ_N = (G P + b)_N + R P_N`.
    Contact { friction: f64, compliance: f64 },
    /// Two bilateral rows, `ξ = 0`: a pin.
    Pin,
    /// One row with a bounded impulse, `−ξ ∈ N_{[lower, upper]}(P)` [N s]: a motor with a torque
    /// limit, a friction row of known normal load, and with infinite bounds one bilateral row.
    ///
    /// `compliance` is `R ≥ 0` [1/kg] of a spring or a damper, `ξ = (G P + b) + R P`.
    Bounded {
        lower: f64,
        upper: f64,
        compliance: f64,
    },
}

impl Law {
    /// Number of rows, 1 or 2.
    pub fn rows(&self) -> usize {
        match self {
            Law::Contact { friction, .. } if *friction > 0.0 => 2,
            Law::Pin => 2,
            _ => 1,
        }
    }

    /// Whether the law holds its rows whatever the impulse: a problem of such laws alone is linear.
    pub(crate) fn is_bilateral(&self) -> bool {
        match self {
            Law::Pin => true,
            Law::Bounded { lower, upper, .. } => {
                *lower == f64::NEG_INFINITY && *upper == f64::INFINITY
            }
            Law::Contact { .. } => false,
        }
    }

    /// `R` [1/kg], zero for a pin.
    pub fn compliance(&self) -> f64 {
        match self {
            Law::Contact { compliance, .. } | Law::Bounded { compliance, .. } => *compliance,
            Law::Pin => 0.0,
        }
    }
}
