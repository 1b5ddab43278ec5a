//! Reference solvers: slower than those of [`crate::solver`], and independent of them.
//!
//! | solver | for |
//! |---|---|
//! | [`solve_lcp`] | any linear complementarity problem: Lemke's method, a proof that none exists, a search |
//! | [`Prox`] | the published study's own method, for reference |

mod lcp;
mod prox;

pub use lcp::{complementarity_residual, proves_infeasible, solve_lcp};
pub use prox::Prox;

use crate::solver::{self, ImpulseSolver};

/// Names of all solvers, first those of [`solver::SOLVERS`], in the order of the help.
pub const SOLVERS: [&str; 6] = ["auto", "enumeration", "nsgs", "direct", "lemke", "prox"];

/// The solver of that name, of [`crate::solver`] or of this module, or `None`.
pub fn solver_by_name(name: &str) -> Option<Box<dyn ImpulseSolver>> {
    Some(match name {
        "prox" => Box::new(Prox::default()),
        _ => return solver::solver_by_name(name),
    })
}
