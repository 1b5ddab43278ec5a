//! Problem files: a contact problem, or a plain LCP, as a value that is stored and solved again.
//!
//! [`read`] detects the format by content, not by file name.
//!
//! # JSON
//!
//! Floats are written so that they read back bit for bit. Unknown keys are refused.
//!
//! ```json
//! {
//!   "kind": "contact",
//!   "units": {"operator": "1/kg", "free": "m/s", "compliance": "1/kg", "impulse": "N s"},
//!   "operator": {"dense": [[1.6, -1.2], [-1.2, 3.4]]},
//!   "free": [[0.05, -3.0]],
//!   "laws": [{"contact": {"friction": 2.0, "compliance": 0.0}}],
//!   "solution": [[0.0, 0.0]]
//! }
//! ```
//!
//! - `units` states the units and may be omitted, in whole or in part; other units are refused.
//! - `operator`, the Delassus operator G, is one of three. `dense` is a list of rows, two per
//!   block. `blocks` is a list of `[i, j, [[G_nn, G_nt], [G_tn, G_tt]]]`, the 2 × 2 blocks that are
//!   not zero, each once, with its block row and block column, from 0, on both sides of the
//!   diagonal. `bodies` is `G = J M⁻¹ Jᵀ` with `inverse_mass`, (1/m, 1/m, 1/J) per body in 1/kg and
//!   1/(kg m²), and `rows`,
//!   for each block `{"bodies": [side 1, side 2], "jacobian": [side][row][coordinate]}`; bodies
//!   count from 0, `null` is a side of infinite mass. Rows are ordered (n, t).
//! - `free`: b, a pair (n, t) per block; it includes restitution, surface motion and gaps.
//! - `laws`, one per block: `{"contact": {"friction": μ, "compliance": R}}` (R may be omitted: 0),
//!   `"pin"`, or `{"bounded": {"lower": l, "upper": u, "compliance": R}}` in N s, where an omitted
//!   bound is infinite and an omitted R is 0.
//! - `solution`: impulses, a pair per block; optional.
//!
//! A linear complementarity problem is `{"kind": "lcp", "matrix": [rows of M], "q": [...]}`, with
//! an optional `"solution": [z]`; it has no units of its own.
//!
//! # Text (`.dat`)
//!
//! The format of the Siconos numerics library: numbers separated by white space, indices from 0.
//! Text after the last number is a comment.
//!
//! | kind | content |
//! |---|---|
//! | LCP | n, M, q: find z ≥ 0, w = M z + q ≥ 0, zᵀ w = 0 |
//! | frictional contact | dimension (2), contacts nc, W, q (n, t a contact), μ a contact |
//! | global frictional contact | dimension (2), nc, M, H, q, b, μ |
//!
//! The global form `M v = q + H r`, `u = Hᵀ v + b` becomes `W = Hᵀ M⁻¹ H` with the free term
//! `Hᵀ M⁻¹ q + b`. A matrix is `storage rows columns` and then
//!
//! - storage 0, dense: rows and columns again, then all numbers, column by column;
//! - storage 1, sparse blocks: number of blocks, block rows, block columns, the row after each
//!   block row, the column after each block column, length of the row pointer and of the column
//!   indices, both lists, then for each block its number and its numbers, column by column;
//! - storage 2, sparse: origin (1 triplets, 2 compressed columns) and a listing of six digits that
//!   begins with a line `CSparse ...`.
//!
//! # What is refused
//!
//! Three dimensions; numbers that are not finite; wrong counts and shapes; negative friction; a
//! contact operator that is asymmetric by more than [`ASYMMETRY`], or indefinite by as much. An
//! operator with a smaller asymmetry is symmetrised, with a warning; its solution is judged with
//! the operator of the file, [`Loaded::as_read`]. An LCP may have any matrix.
//!
//! Also what would take too much memory: a contact operator whose sparse factors would have more
//! than 25 million blocks (as many as a full one of 7000 contacts); a sparse matrix of an LCP with
//! more than 10 000 rows, which is made dense; a global form whose M couples so many coordinates.

mod dat;
mod dat_matrix;
mod dat_write;
mod global;
mod json;
mod symmetry;
mod words;

#[cfg(test)]
mod explicit_tests;
#[cfg(test)]
mod refused_tests;
#[cfg(test)]
mod round_trip_tests;
#[cfg(test)]
mod solver_tests;
#[cfg(test)]
mod sparse_tests;
#[cfg(test)]
mod tests;

pub use dat_write::{DatStorage, to_dat};
pub use json::to_json;
pub use symmetry::ASYMMETRY;

use crate::contact::{BlockMatrix, ContactError, ContactProblem, Delassus, Vec2};
use nalgebra::{DMatrix, DVector};
use symmetry::{check_semidefinite, symmetrise};
use thiserror::Error;

/// A problem as stored in a file.
#[derive(Debug, Clone, PartialEq)]
pub enum StoredProblem {
    /// A frictional contact problem, and impulses [N s] that the file states as its solution.
    Contact {
        problem: ContactProblem,
        solution: Option<Vec<Vec2>>,
    },
    /// Find `z ≥ 0` with `w = M z + q ≥ 0` and `zᵀ w = 0`; and a `z` that the file states as a
    /// solution.
    Lcp {
        matrix: DMatrix<f64>,
        q: DVector<f64>,
        solution: Option<DVector<f64>>,
    },
}

/// Result of [`read`].
#[derive(Debug, Clone, PartialEq)]
pub struct Loaded {
    pub problem: StoredProblem,
    /// The operator of the file, if `problem` has its symmetric part instead. Solutions are judged
    /// with this one.
    pub as_read: Option<BlockMatrix>,
    /// Changes made in reading, as text.
    pub warnings: Vec<String>,
}

/// Most rows and columns of a sparse matrix that is made dense.
const MOST_ROWS: usize = 10_000;

/// Errors of a problem file.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FileError {
    /// Bytes that are no UTF-8 text.
    #[error("line {line}: not text (UTF-8)")]
    NotText { line: usize },
    /// An HDF5 container (FCLib).
    #[error("an HDF5 file; FCLib problems are not read: JSON and .dat text are")]
    Hdf5,
    /// The file begins like none of the kinds.
    #[error("line {line}: {reason}")]
    Kind { line: usize, reason: String },
    /// Malformed JSON, an unknown or missing key, a value of another type or out of range.
    #[error("line {line}, column {column}: {reason}")]
    Json {
        line: usize,
        column: usize,
        reason: String,
    },
    /// Other text, or none, in place of `expected`.
    #[error("line {line}: expected {expected}, found {found}")]
    Expected {
        line: usize,
        expected: String,
        found: String,
    },
    /// A value that is invalid in a contact problem, or unsupported.
    #[error("line {line}: {reason}")]
    Value { line: usize, reason: String },
    /// Parts that do not fit together.
    #[error("{0}")]
    Content(String),
    /// The operator is not symmetric.
    #[error(
        "{matrix}[{row}, {column}] = {upper:e} and [{column}, {row}] = {lower:e}: asymmetric by \
         {relative:.1e} of the root of both diagonal entries, at most {ASYMMETRY:e} is allowed"
    )]
    Asymmetric {
        matrix: &'static str,
        row: usize,
        column: usize,
        upper: f64,
        lower: f64,
        relative: f64,
    },
    /// The operator has a negative eigenvalue, or the mass matrix one that is not positive.
    #[error("{matrix} is not positive {how}")]
    Indefinite {
        matrix: &'static str,
        how: &'static str,
    },
    /// The output format cannot represent a law of the problem.
    #[error("block {block}: {what} has no place in the .dat format; JSON has one")]
    NoPlace { block: usize, what: &'static str },
    #[error(transparent)]
    Contact(#[from] ContactError),
}

/// Reads a problem file of any format: JSON if it begins with a brace, else text. Skips a byte
/// order mark.
///
/// # Errors
/// [`FileError`], with the position in the file if the error has one. Never panics. Allocates no
/// memory for numbers that are not in the file, except for a matrix that is made dense and for the
/// factors of an operator, both with a bound.
pub fn read(bytes: &[u8]) -> Result<Loaded, FileError> {
    if bytes.starts_with(b"\x89HDF\r\n\x1a\n") {
        return Err(FileError::Hdf5);
    }
    let text = std::str::from_utf8(bytes).map_err(|e| FileError::NotText {
        line: line_of(&bytes[..e.valid_up_to()]),
    })?;
    // Windows editors write a byte order mark first
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if text.trim().is_empty() {
        return Err(FileError::Content("the file is empty".to_owned()));
    }
    if text.trim_start().starts_with('{') {
        json::read(text)
    } else {
        dat::read(text)
    }
}

/// The line, from 1, on which `before` ends.
fn line_of(before: &[u8]) -> usize {
    1 + before.iter().filter(|b| **b == b'\n').count()
}

impl StoredProblem {
    /// Number of contacts and other blocks, or of rows of an LCP.
    pub fn len(&self) -> usize {
        match self {
            StoredProblem::Contact { problem, .. } => problem.len(),
            StoredProblem::Lcp { q, .. } => q.len(),
        }
    }

    /// Whether there is nothing to solve.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Checks shapes and numbers.
    fn check(&self) -> Result<(), FileError> {
        let (solved, finite) = match self {
            StoredProblem::Contact { problem, solution } => {
                problem.validate()?;
                let pairs = problem.free.iter().chain(solution.iter().flatten());
                let mut numbers = pairs.flat_map(|p| [p.x, p.y]);
                (solution.as_ref().map(Vec::len), numbers.all(f64::is_finite))
            }
            StoredProblem::Lcp {
                matrix,
                q,
                solution,
            } => {
                let n = q.len();
                if matrix.shape() != (n, n) {
                    let (rows, columns) = matrix.shape();
                    return Err(FileError::Content(format!(
                        "q has {n} numbers and the matrix is {rows} x {columns}"
                    )));
                }
                let solution = solution.as_ref();
                let z = solution.map_or(&[][..], |z| z.as_slice());
                let mut numbers = matrix.iter().chain(q.iter()).chain(z);
                let finite = numbers.all(|x| x.is_finite());
                (solution.map(|z| z.len()), finite)
            }
        };
        if !finite {
            return Err(FileError::Content("a number is not finite".to_owned()));
        }
        match solved.filter(|length| *length != self.len()) {
            Some(length) => Err(FileError::Content(format!(
                "the solution has {length} entries, must have {}",
                self.len()
            ))),
            None => Ok(()),
        }
    }
}

impl Loaded {
    /// Checks a contact problem; symmetrises an explicit operator.
    fn contact(
        mut problem: ContactProblem,
        solution: Option<Vec<Vec2>>,
    ) -> Result<Loaded, FileError> {
        problem.validate()?;
        let mut warnings = Vec::new();
        let mut as_read = None;
        if let Delassus::Blocks(matrix) = &mut problem.operator {
            as_read = symmetrise(matrix, "W", &mut warnings)?;
            check_semidefinite(matrix, "W")?;
        }
        Ok(Loaded {
            problem: StoredProblem::Contact { problem, solution },
            as_read,
            warnings,
        })
    }

    fn lcp(matrix: DMatrix<f64>, q: DVector<f64>, solution: Option<DVector<f64>>) -> Loaded {
        Loaded {
            problem: StoredProblem::Lcp {
                matrix,
                q,
                solution,
            },
            as_read: None,
            warnings: Vec::new(),
        }
    }
}
