use super::FileError;
use crate::contact::BlockMatrix;
use crate::linalg::{BlockLdu, MOST_FILL};
use nalgebra::DVector;

/// Largest `|W_ij − W_ji| / √(W_ii W_jj)` that counts as rounding, no unit: listings of six digits
/// have up to 1e-6. The root bounds `|W_ij|`, so that the test is valid for light bodies next to
/// heavy ones.
pub const ASYMMETRY: f64 = 1e-5;

/// A smaller asymmetry is round-off of a product `Jᵀ M⁻¹ J` and is not changed, bit for bit.
const ROUND_OFF: f64 = 1e-12;

/// Two numbers of a matrix that should be equal.
pub(super) struct Mirrored {
    /// Row and column of the first number.
    pub place: (usize, usize),
    pub upper: f64,
    pub lower: f64,
    /// `√(W_ii W_jj)`.
    pub root: f64,
}

/// Whether a matrix must be replaced by its symmetric part, because the numbers of a pair differ by
/// more than round-off; adds a warning.
///
/// # Errors
/// [`FileError::Asymmetric`] above [`ASYMMETRY`].
pub(super) fn is_asymmetric(
    pairs: impl Iterator<Item = Mirrored>,
    name: &'static str,
    warnings: &mut Vec<String>,
) -> Result<bool, FileError> {
    let mut worst = 0.0;
    let mut pair = None;
    for next in pairs {
        // 0/0 of an empty row is no asymmetry; the next check finds a negative diagonal
        let relative = (next.upper - next.lower).abs() / next.root;
        if relative > worst {
            worst = relative;
            pair = Some(next);
        }
    }
    let Some(pair) = pair.filter(|_| worst > ROUND_OFF) else {
        return Ok(false);
    };
    let (row, column) = pair.place;
    if worst > ASYMMETRY {
        return Err(FileError::Asymmetric {
            matrix: name,
            row,
            column,
            upper: pair.upper,
            lower: pair.lower,
            relative: worst,
        });
    }
    warnings.push(format!(
        "{name} was symmetrised: [{row}, {column}] and [{column}, {row}] differ by \
         {worst:.1e} of the root of both diagonal entries"
    ));
    Ok(true)
}

/// Replaces `matrix` by its symmetric part if [`is_asymmetric`] returns true, and then returns the
/// matrix as it was.
///
/// # Errors
/// [`FileError::Asymmetric`].
pub(super) fn symmetrise(
    matrix: &mut BlockMatrix,
    name: &'static str,
    warnings: &mut Vec<String>,
) -> Result<Option<BlockMatrix>, FileError> {
    if !is_asymmetric(mirrored(matrix), name, warnings)? {
        return Ok(None);
    }
    let as_read = matrix.clone();
    matrix.symmetrise();
    Ok(Some(as_read))
}

/// All pairs of numbers, except those of blocks that are not stored.
fn mirrored(matrix: &BlockMatrix) -> impl Iterator<Item = Mirrored> {
    let root = diagonal(matrix).map(f64::sqrt);
    let above = |j: usize| matrix.column(j).filter(move |(i, _)| *i <= j);
    let pairs = (0..matrix.size()).flat_map(move |j| above(j).map(move |(i, m)| (i, j, m)));
    pairs.flat_map(move |(i, j, upper)| {
        let lower = matrix.block(j, i);
        // a diagonal block has one pair
        let count = if i == j { 1 } else { 4 };
        let pair = |(r, c)| Mirrored {
            place: (2 * i + r, 2 * j + c),
            upper: upper[(r, c)],
            lower: lower[(c, r)],
            root: root[2 * i + r] * root[2 * j + c],
        };
        let pairs = [(0, 1), (0, 0), (1, 0), (1, 1)].map(pair);
        pairs.into_iter().take(count)
    })
}

/// Whether a symmetric matrix, scaled to a unit diagonal, has no eigenvalue below −[`ASYMMETRY`].
/// Adds that number to its diagonal and checks that all pivots of a factorisation are positive.
///
/// # Errors
/// [`FileError::Indefinite`]; [`FileError::Content`] if the factors would take too much memory, as
/// they would in a solver.
pub(super) fn check_semidefinite(
    matrix: &BlockMatrix,
    name: &'static str,
) -> Result<(), FileError> {
    let indefinite = FileError::Indefinite {
        matrix: name,
        how: "semidefinite",
    };
    let diagonal = diagonal(matrix);
    // a row of zeros, of a contact without friction, is valid
    let scale = diagonal.map(|x| if x == 0.0 { 0.0 } else { 1.0 / x.sqrt() });
    let mut factor = BlockLdu::<2>::default();
    if factor.prepare(matrix.size(), &matrix.pairs()).is_err() {
        return Err(FileError::Content(format!(
            "the factors of {name} would have more than {MOST_FILL} blocks of 2 x 2"
        )));
    }
    factor.clear(true);
    for j in 0..matrix.size() {
        for (i, block) in matrix.column(j) {
            let mut scaled = *block;
            for (r, c) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let (row, column) = (2 * i + r, 2 * j + c);
                let x = block[(r, c)];
                if x != 0.0 && (diagonal[row] == 0.0 || diagonal[column] == 0.0) {
                    return Err(indefinite);
                }
                // in this order, as the product of both roots may overflow
                scaled[(r, c)] = x * scale[row] * scale[column];
                if row == column {
                    scaled[(r, c)] = if x == 0.0 { 1.0 } else { 1.0 + ASYMMETRY };
                    if x < 0.0 {
                        return Err(indefinite);
                    }
                }
            }
            if i == j {
                factor.add_diagonal(j, &scaled);
            } else {
                factor.add(factor.place(i, j), &scaled);
            }
        }
    }
    if factor.factorise() && factor.is_positive() {
        Ok(())
    } else {
        Err(indefinite)
    }
}

/// All numbers of the diagonal.
fn diagonal(matrix: &BlockMatrix) -> DVector<f64> {
    let pair = |k: usize| {
        let block = matrix.block(k, k);
        [block[(0, 0)], block[(1, 1)]]
    };
    DVector::from_iterator(2 * matrix.size(), (0..matrix.size()).flat_map(pair))
}
