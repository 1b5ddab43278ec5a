use super::{FileError, StoredProblem};
use crate::contact::{ContactProblem, Law};
use nalgebra::DMatrix;
use std::fmt::Write;

/// How [`to_dat`] stores the matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DatStorage {
    /// Storage 0: every number.
    Dense,
    /// Storage 1: the 2 × 2 blocks of an operator (of an LCP the numbers) that are not zero.
    Blocks,
}

/// Writes the text format with 17 digits: an LCP, or a frictional contact problem with its operator
/// made explicit. A stored solution has no place in it.
///
/// # Errors
/// [`FileError::NoPlace`] for a pin, a bounded row or compliance; [`FileError::Contact`],
/// [`FileError::Content`] for a problem that is none.
pub fn to_dat(problem: &StoredProblem, storage: DatStorage) -> Result<String, FileError> {
    problem.check()?;
    let mut text = String::new();
    match problem {
        StoredProblem::Lcp { matrix, q, .. } => {
            text.push_str(&format!("{}\n", q.len()));
            write_matrix(&mut text, matrix, storage, 1);
            write_line(&mut text, q.iter().copied());
        }
        StoredProblem::Contact { problem, .. } => {
            let friction = friction(problem)?;
            text.push_str(&format!("2\n{}\n", problem.len()));
            write_matrix(&mut text, &problem.operator.explicit(), storage, 2);
            write_line(&mut text, problem.free.iter().flat_map(|b| [b.x, b.y]));
            write_line(&mut text, friction.into_iter());
        }
    }
    Ok(text)
}

fn friction(problem: &ContactProblem) -> Result<Vec<f64>, FileError> {
    let of = |(block, law): (usize, &Law)| {
        let what = match *law {
            Law::Contact {
                friction,
                compliance: 0.0,
            } => return Ok(friction),
            Law::Contact { .. } => "compliance",
            Law::Pin => "a pin",
            Law::Bounded { .. } => "a bounded row",
        };
        Err(FileError::NoPlace { block, what })
    };
    problem.laws.iter().enumerate().map(of).collect()
}

fn write_line(text: &mut String, numbers: impl Iterator<Item = f64>) {
    let mut between = "";
    for x in numbers {
        // writing to a string cannot fail
        let _ = write!(text, "{between}{x:.16e}");
        between = " ";
    }
    text.push('\n');
}

fn write_matrix(text: &mut String, matrix: &DMatrix<f64>, storage: DatStorage, block: usize) {
    let (rows, columns) = matrix.shape();
    match storage {
        DatStorage::Dense => {
            text.push_str(&format!("0 {rows} {columns}\n{rows} {columns}\n"));
            for column in matrix.column_iter() {
                write_line(text, column.iter().copied());
            }
        }
        DatStorage::Blocks => {
            let blocks = rows / block;
            let at = |i: usize, j: usize| matrix.view((i * block, j * block), (block, block));
            let mut places = Vec::new();
            let mut pointer = vec![0];
            for i in 0..blocks {
                places.extend(
                    (0..blocks)
                        .filter(|&j| at(i, j).amax() > 0.0)
                        .map(|j| (i, j)),
                );
                pointer.push(places.len());
            }
            let sizes: Vec<usize> = (1..=blocks).map(|k| k * block).collect();
            let count = places.len();
            let lines = [
                words([1, rows, columns]),
                words([count]),
                words([blocks, blocks]),
                words(sizes.iter().copied()),
                words(sizes.iter().copied()),
                words([blocks + 1, count]),
                words(pointer),
                words(places.iter().map(|(_, j)| *j)),
            ];
            text.push_str(&lines.concat());
            for (k, &(i, j)) in places.iter().enumerate() {
                text.push_str(&words([k]));
                write_line(text, at(i, j).iter().copied());
            }
        }
    }
}

/// A line of whole numbers.
fn words(numbers: impl IntoIterator<Item = usize>) -> String {
    let words: Vec<String> = numbers.into_iter().map(|n| n.to_string()).collect();
    words.join(" ") + "\n"
}
