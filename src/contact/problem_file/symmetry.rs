use super::FileError;
use nalgebra::DMatrix;

/// Largest `|W_ij − W_ji| / √(W_ii W_jj)` that passes for rounding, no unit: listings of six digits
/// leave up to 1e-6. The root bounds `|W_ij|`, and so light bodies next to heavy ones are seen.
pub const ASYMMETRY: f64 = 1e-5;

/// A smaller asymmetry is round-off of a product `Jᵀ M⁻¹ J` and stays as it is, bit for bit.
const ROUND_OFF: f64 = 1e-12;

/// Replaces `matrix` by its symmetric part, and warns of it, where they differ by more than
/// round-off.
///
/// # Errors
/// [`FileError::Asymmetric`] above [`ASYMMETRY`].
pub(super) fn symmetrise(
    matrix: &mut DMatrix<f64>,
    name: &'static str,
    warnings: &mut Vec<String>,
) -> Result<(), FileError> {
    let root = matrix.diagonal().map(f64::sqrt);
    let (mut worst, mut place) = (0.0, (0, 0));
    for column in 0..matrix.ncols() {
        for row in 0..column {
            let (upper, lower) = (matrix[(row, column)], matrix[(column, row)]);
            // 0/0 of an empty row is no asymmetry; a negative diagonal is for the next check
            let relative = (upper - lower).abs() / (root[row] * root[column]);
            if relative > worst {
                (worst, place) = (relative, (row, column));
            }
        }
    }
    let (row, column) = place;
    if worst > ASYMMETRY {
        return Err(FileError::Asymmetric {
            matrix: name,
            row,
            column,
            upper: matrix[(row, column)],
            lower: matrix[(column, row)],
            relative: worst,
        });
    }
    if worst > ROUND_OFF {
        *matrix = 0.5 * &*matrix + 0.5 * matrix.transpose();
        warnings.push(format!(
            "{name} was symmetrised: [{row}, {column}] and [{column}, {row}] differ by \
             {worst:.1e} of the root of both diagonal entries"
        ));
    }
    Ok(())
}

/// Whether a symmetric matrix, scaled to a unit diagonal, has no eigenvalue below −[`ASYMMETRY`]:
/// `W + ASYMMETRY diag(W)` then has a Cholesky factor.
///
/// # Errors
/// [`FileError::Indefinite`].
pub(super) fn check_semidefinite(
    matrix: &DMatrix<f64>,
    name: &'static str,
) -> Result<(), FileError> {
    let mut shifted = matrix.clone();
    for i in 0..matrix.nrows() {
        // a row of zeros, of a contact without friction, is no fault
        shifted[(i, i)] += (ASYMMETRY * matrix[(i, i)]).max(f64::MIN_POSITIVE);
    }
    match shifted.cholesky() {
        Some(_) => Ok(()),
        None => Err(FileError::Indefinite {
            matrix: name,
            how: "semidefinite",
        }),
    }
}
