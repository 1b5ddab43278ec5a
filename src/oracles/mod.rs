//! Reference solvers: slower than those of [`crate::solver`], and independent of them.
//!
//! | solver | for |
//! |---|---|
//! | [`Lemke`] | up to some 100 blocks: complementary pivoting, an oracle independent of `direct` |
//! | [`Prox`] | the published study's own method, for reference |

mod lemke;
mod prox;

pub use lemke::{
    LcpError, LcpOptions, LcpSolution, LcpStatus, Lemke, complementarity_residual,
    proves_infeasible, solve_lcp,
};
pub use prox::Prox;

use crate::solver::{self, ImpulseSolver};

/// Names of all solvers, first those of [`solver::SOLVERS`], in the order of the help.
pub const SOLVERS: [&str; 6] = ["auto", "enumeration", "nsgs", "direct", "lemke", "prox"];

/// The solver of that name, of [`crate::solver`] or of this module, or `None`.
pub fn solver_by_name(name: &str) -> Option<Box<dyn ImpulseSolver>> {
    Some(match name {
        "lemke" => Box::new(Lemke::default()),
        "prox" => Box::new(Prox::default()),
        _ => return solver::solver_by_name(name),
    })
}
