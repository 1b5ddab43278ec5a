use super::judged::Judged;
use super::{Auto, Direct, Enumeration, ImpulseSolver, Lemke, Nsgs};

/// Names of all solvers here, in the order the help shows them.
pub const SOLVERS: [&str; 5] = ["auto", "enumeration", "nsgs", "direct", "lemke"];

/// A table of solvers by name: [`solver_by_name`], or one of the user's own.
pub type SolverTable = fn(&str) -> Option<Box<dyn ImpulseSolver>>;

/// The solver of that name, or `None`.
pub fn solver_by_name(name: &str) -> Option<Box<dyn ImpulseSolver>> {
    Some(match name {
        "auto" => Box::new(Auto::default()),
        "enumeration" => Box::new(Enumeration::default()),
        "direct" => Box::new(Direct::default()),
        "nsgs" => Box::new(Nsgs::default()),
        "lemke" => Box::new(Lemke::default()),
        _ => return None,
    })
}

/// The solver of that name: one of the core, else that of `table`, whose results the judge checks.
pub(crate) fn find_solver(name: &str, table: SolverTable) -> Option<Box<dyn ImpulseSolver>> {
    solver_by_name(name).or_else(|| Some(Box::new(Judged::new(table(name)?))))
}
