use super::{FileError, StoredProblem};
use crate::contact::{ContactProblem, Law, Mat2};
use nalgebra::DMatrix;
use std::fmt::Write;

/// How [`to_dat`] stores the matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DatStorage {
    /// Storage 0: every number.
    Dense,
    /// Storage 1: the nonzero 2 × 2 blocks of an operator (for an LCP, the nonzero numbers).
    Blocks,
}

/// Writes the text format with 17 digits: an LCP, or a frictional contact problem with an explicit
/// operator. The format has no place for a solution.
///
/// # Errors
/// [`FileError::NoPlace`] for a pin, a bounded row or compliance; [`FileError::Contact`],
/// [`FileError::Content`] for an invalid problem.
pub fn to_dat(problem: &StoredProblem, storage: DatStorage) -> Result<String, FileError> {
    problem.check()?;
    let mut text = String::new();
    match problem {
        StoredProblem::Lcp { matrix, q, .. } => {
            let n = q.len();
            text.push_str(&format!("{n}\n"));
            match storage {
                DatStorage::Dense => write_dense(&mut text, matrix),
                DatStorage::Blocks => {
                    let of_row = |i| (0..n).map(move |j| (j, [matrix[(i, j)]]));
                    write_blocks(&mut text, n, 1, of_row);
                }
            }
            write_line(&mut text, q.iter().copied());
        }
        StoredProblem::Contact { problem, .. } => {
            let friction = friction(problem)?;
            text.push_str(&format!("2\n{}\n", problem.len()));
            match storage {
                DatStorage::Dense => write_dense(&mut text, &problem.operator.explicit()),
                DatStorage::Blocks => {
                    let blocks = problem.operator.to_blocks();
                    let of_row = |i| {
                        let values = |block: Mat2| block.data.0.concat();
                        blocks.row(i).map(move |(j, block)| (j, values(block)))
                    };
                    write_blocks(&mut text, problem.len(), 2, of_row);
                }
            }
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

fn write_dense(text: &mut String, matrix: &DMatrix<f64>) {
    let (rows, columns) = matrix.shape();
    text.push_str(&format!("0 {rows} {columns}\n{rows} {columns}\n"));
    for column in matrix.column_iter() {
        write_line(text, column.iter().copied());
    }
}

/// A square matrix of `count` block rows of `block` rows each. `of_row` returns the block columns
/// of a row, ascending, with their numbers, column by column. Blocks of zeros are omitted.
fn write_blocks<V: AsRef<[f64]>, I: Iterator<Item = (usize, V)>>(
    text: &mut String,
    count: usize,
    block: usize,
    of_row: impl Fn(usize) -> I,
) {
    let mut blocks = Vec::new();
    let mut pointer = vec![0];
    for i in 0..count {
        let filled = of_row(i).filter(|(_, values)| values.as_ref().iter().any(|x| *x != 0.0));
        blocks.extend(filled);
        pointer.push(blocks.len());
    }
    let size = count * block;
    let lines = [
        words([1, size, size]),
        words([blocks.len()]),
        words([count, count]),
        words((1..=count).map(|k| k * block)),
        words((1..=count).map(|k| k * block)),
        words([count + 1, blocks.len()]),
        words(pointer),
        words(blocks.iter().map(|(j, _)| *j)),
    ];
    text.push_str(&lines.concat());
    for (k, (_, values)) in blocks.iter().enumerate() {
        text.push_str(&words([k]));
        write_line(text, values.as_ref().iter().copied());
    }
}

/// A line of whole numbers.
fn words(numbers: impl IntoIterator<Item = usize>) -> String {
    let words: Vec<String> = numbers.into_iter().map(|n| n.to_string()).collect();
    words.join(" ") + "\n"
}
