//! Reduces the global form of a contact problem to the local form.

use super::dat_matrix::Matrix;
use super::symmetry::{Mirrored, is_asymmetric};
use super::{FileError, MOST_ROWS};
use crate::contact::{BlockMatrix, Mat2};
use crate::linalg::MOST_FILL;
use nalgebra::{DMatrix, DVector};

/// Reduces `M v = q + H r`, `u = Hᵀ v + b` to `u = W r + Hᵀ M⁻¹ q + b`, `W = Hᵀ M⁻¹ H`; returns W
/// and the free term.
///
/// M consists of parts that it does not couple with each other, each a body or a mechanism, and
/// `W = Σ Yᵀ Y` over them, `Y = L⁻¹ H`, `M = L Lᵀ`.                              (1)
///
/// # Errors
/// [`FileError::Asymmetric`] and [`FileError::Indefinite`] of M; [`FileError::Content`] if the
/// parts have more numbers than a matrix of [`MOST_ROWS`] rows, or W more than [`MOST_FILL`]
/// blocks.
pub(super) fn reduce(
    mass: &Matrix,
    h: &Matrix,
    q: &[f64],
    b: Vec<f64>,
    warnings: &mut Vec<String>,
) -> Result<(BlockMatrix, Vec<f64>), FileError> {
    let mut parts = Part::all(mass)?;
    if is_asymmetric(parts.iter().flat_map(Part::pairs), "M", warnings)? {
        for part in &mut parts {
            part.matrix = 0.5 * &part.matrix + 0.5 * part.matrix.transpose();
        }
    }
    let mut place = vec![(0, 0); mass.rows];
    for (number, part) in parts.iter().enumerate() {
        for (k, &coordinate) in part.coordinates.iter().enumerate() {
            place[coordinate] = (number, k);
        }
    }
    let mut rows: Vec<Vec<(usize, usize, f64)>> = vec![Vec::new(); parts.len()];
    h.for_each(|row, column, value| {
        let (part, k) = place[row];
        rows[part].push((k, column, value));
    });
    let contacts: Vec<Vec<usize>> = rows.iter().map(|rows| touched(rows)).collect();
    let blocks: f64 = contacts.iter().map(|c| (c.len() as f64).powi(2)).sum();
    if blocks > MOST_FILL as f64 {
        return Err(FileError::Content(format!(
            "W would be the sum of {blocks:e} blocks of 2 x 2, at most {MOST_FILL} are stored"
        )));
    }
    let mut free = b;
    let mut blocks = Vec::new();
    for ((part, rows), contacts) in parts.into_iter().zip(rows).zip(contacts) {
        let root = part.matrix.cholesky().ok_or(FileError::Indefinite {
            matrix: "M",
            how: "definite",
        })?;
        let load = part.coordinates.iter().map(|&c| q[c]);
        let velocity = root.solve(&DVector::from_iterator(part.coordinates.len(), load));
        let mut y = DMatrix::zeros(part.coordinates.len(), 2 * contacts.len());
        for (k, column, value) in rows {
            free[column] += value * velocity[k];
            let contact = contacts.partition_point(|&c| c < column / 2);
            y[(k, 2 * contact + column % 2)] += value;
        }
        root.l_dirty().solve_lower_triangular_mut(&mut y);
        let w = y.tr_mul(&y);
        for (j, &column) in contacts.iter().enumerate() {
            for (i, &row) in contacts.iter().enumerate() {
                let block: Mat2 = w.fixed_view::<2, 2>(2 * i, 2 * j).into_owned();
                blocks.push((row as u32, column as u32, block));
            }
        }
    }
    Ok((BlockMatrix::from_blocks(free.len() / 2, blocks), free))
}

/// The contacts whose columns have entries, ascending.
fn touched(rows: &[(usize, usize, f64)]) -> Vec<usize> {
    let mut contacts: Vec<usize> = rows.iter().map(|(_, column, _)| column / 2).collect();
    contacts.sort_unstable();
    contacts.dedup();
    contacts
}

/// Coordinates that M couples with each other and with no others.
struct Part {
    coordinates: Vec<usize>,
    matrix: DMatrix<f64>,
}

impl Part {
    fn all(mass: &Matrix) -> Result<Vec<Part>, FileError> {
        let mut parent: Vec<usize> = (0..mass.rows).collect();
        mass.for_each(|row, column, _| {
            let (a, b) = (root(&mut parent, row), root(&mut parent, column));
            parent[a.max(b)] = a.min(b);
        });
        // the root is the least coordinate of its part
        let mut number = vec![0; mass.rows];
        let mut coordinates: Vec<Vec<usize>> = Vec::new();
        let mut local = Vec::new();
        for k in 0..mass.rows {
            let root = root(&mut parent, k);
            if root == k {
                number[k] = coordinates.len();
                coordinates.push(Vec::new());
            }
            number[k] = number[root];
            local.push(coordinates[number[k]].len());
            coordinates[number[k]].push(k);
        }
        let numbers: f64 = coordinates.iter().map(|c| (c.len() as f64).powi(2)).sum();
        if numbers > (MOST_ROWS as f64).powi(2) {
            return Err(FileError::Content(format!(
                "the parts of M that it does not couple have {numbers:e} numbers, at most those of \
                 {MOST_ROWS} x {MOST_ROWS} are stored"
            )));
        }
        let part = |coordinates: Vec<usize>| Part {
            matrix: DMatrix::zeros(coordinates.len(), coordinates.len()),
            coordinates,
        };
        let mut parts: Vec<Part> = coordinates.into_iter().map(part).collect();
        mass.for_each(|row, column, value| {
            parts[number[row]].matrix[(local[row], local[column])] += value;
        });
        Ok(parts)
    }

    fn pairs(&self) -> impl Iterator<Item = Mirrored> {
        let (m, at) = (&self.matrix, &self.coordinates);
        let pair = move |row: usize, column: usize| Mirrored {
            place: (at[row], at[column]),
            upper: m[(row, column)],
            lower: m[(column, row)],
            root: m[(row, row)].sqrt() * m[(column, column)].sqrt(),
        };
        (0..at.len()).flat_map(move |column| (0..column).map(move |row| pair(row, column)))
    }
}

/// The root of `k` in union-find, with path halving.
fn root(parent: &mut [usize], mut k: usize) -> usize {
    while parent[k] != k {
        parent[k] = parent[parent[k]];
        k = parent[k];
    }
    k
}
