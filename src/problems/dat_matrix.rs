use super::words::Words;
use super::{FileError, MOST_ROWS};
use crate::contact::{BlockMatrix, Mat2};
use nalgebra::DMatrix;

/// A matrix of a text file, as stored.
pub(super) struct Matrix {
    pub rows: usize,
    pub columns: usize,
    values: Values,
}

enum Values {
    /// All numbers, column by column.
    Full(Vec<f64>),
    /// (row, column, value); entries at the same position add up.
    Entries(Vec<(usize, usize, f64)>),
}

impl Matrix {
    /// Reads `storage rows columns` and the numbers; messages call the matrix `name`.
    ///
    /// # Errors
    /// [`FileError::Expected`], [`FileError::Value`].
    pub fn read(words: &mut Words, name: &str) -> Result<Matrix, FileError> {
        let storage = words.count(|| format!("the storage of {name}: 0, 1 or 2"))?;
        let at = words.line();
        let rows = words.count(|| format!("the rows of {name}"))?;
        let columns = words.count(|| format!("the columns of {name}"))?;
        if rows == 0 || columns == 0 {
            return Err(FileError::Value {
                line: at,
                reason: format!("{name} is {rows} x {columns}: empty"),
            });
        }
        let values = match storage {
            0 => full(words, name, rows, columns)?,
            1 => blocks(words, name, rows, columns)?,
            2 => sparse(words, name, rows, columns)?,
            _ => {
                return Err(FileError::Value {
                    line: at,
                    reason: format!(
                        "the storage of {name} is {storage}, must be 0 (dense), 1 (sparse blocks) \
                         or 2 (sparse)"
                    ),
                });
            }
        };
        Ok(Matrix {
            rows,
            columns,
            values,
        })
    }

    /// Calls `show` with every entry (row, column, value), except zeros of a full matrix.
    pub fn for_each(&self, mut show: impl FnMut(usize, usize, f64)) {
        match &self.values {
            Values::Full(values) => {
                for (k, &value) in values.iter().enumerate().filter(|(_, x)| **x != 0.0) {
                    show(k % self.rows, k / self.rows, value);
                }
            }
            Values::Entries(entries) => {
                for &(row, column, value) in entries {
                    show(row, column, value);
                }
            }
        }
    }

    /// The 2 × 2 blocks of a square matrix with an even number of rows.
    pub fn blocks(self) -> BlockMatrix {
        let entries = match self.values {
            Values::Full(values) => {
                let full = DMatrix::from_vec(self.rows, self.columns, values);
                return BlockMatrix::from_dense(&full);
            }
            Values::Entries(entries) => entries.into_iter(),
        };
        let block = |(row, column, value)| {
            let mut block = Mat2::zeros();
            block[(row % 2, column % 2)] = value;
            ((row / 2) as u32, (column / 2) as u32, block)
        };
        BlockMatrix::from_blocks(self.rows / 2, entries.map(block).collect())
    }

    /// All numbers, as a dense matrix.
    ///
    /// # Errors
    /// [`FileError::Content`] if it is sparse and too large.
    pub fn dense(self, name: &str) -> Result<DMatrix<f64>, FileError> {
        let (rows, columns) = (self.rows, self.columns);
        match self.values {
            Values::Full(values) => Ok(DMatrix::from_vec(rows, columns, values)),
            Values::Entries(_) if rows.max(columns) > MOST_ROWS => Err(FileError::Content(
                format!("{name} is {rows} x {columns}, at most {MOST_ROWS} rows become dense"),
            )),
            Values::Entries(entries) => {
                let mut dense = DMatrix::zeros(rows, columns);
                for (row, column, value) in entries {
                    dense[(row, column)] += value;
                }
                Ok(dense)
            }
        }
    }
}

/// Reads a number that must equal `expected`.
fn must_be(words: &mut Words, expected: usize, what: &str) -> Result<(), FileError> {
    let found = words.count(|| format!("{what}, {expected}"))?;
    if found == expected {
        return Ok(());
    }
    Err(FileError::Expected {
        line: words.line(),
        expected: format!("{what}, {expected}"),
        found: found.to_string(),
    })
}

/// An index below `end`.
fn index(words: &mut Words, end: usize, what: impl Fn() -> String) -> Result<usize, FileError> {
    let found = words.count(|| format!("{} below {end}", what()))?;
    if found < end {
        return Ok(found);
    }
    Err(FileError::Expected {
        line: words.line(),
        expected: format!("{} below {end}", what()),
        found: found.to_string(),
    })
}

fn full(words: &mut Words, name: &str, rows: usize, columns: usize) -> Result<Values, FileError> {
    must_be(words, rows, &format!("the rows of {name} again"))?;
    must_be(words, columns, &format!("the columns of {name} again"))?;
    let mut values = Vec::new();
    for column in 0..columns {
        for row in 0..rows {
            values.push(words.real(|| format!("{name}[{row}, {column}] of {rows} x {columns}"))?);
        }
    }
    Ok(Values::Full(values))
}

fn blocks(words: &mut Words, name: &str, rows: usize, columns: usize) -> Result<Values, FileError> {
    let count = words.count(|| format!("the number of blocks of {name}"))?;
    let block_rows = words.count(|| format!("the block rows of {name}"))?;
    let block_columns = words.count(|| format!("the block columns of {name}"))?;
    let row_ends = ends(
        words,
        block_rows,
        rows,
        &format!("the row after block row {name}"),
    )?;
    let column_ends = ends(
        words,
        block_columns,
        columns,
        &format!("the column after block column {name}"),
    )?;
    let pointers = block_rows.saturating_add(1);
    must_be(
        words,
        pointers,
        &format!("the length of {name}'s row pointer"),
    )?;
    must_be(
        words,
        count,
        &format!("the number of {name}'s column indices"),
    )?;
    let mut pointer = Vec::new();
    let mut least = 0;
    for k in 0..pointers {
        let what = || format!("{name}'s row pointer [{k}], from {least}");
        let p = index(words, count.saturating_add(1), what)?;
        let wrong = p < least || (k == 0 && p != 0) || (k == block_rows && p != count);
        if wrong {
            return Err(FileError::Value {
                line: words.line(),
                reason: format!(
                    "{name}'s row pointer must rise from 0 to {count}; its [{k}] is {p}"
                ),
            });
        }
        least = p;
        pointer.push(p);
    }
    let mut places = Vec::new();
    for k in 0..count {
        let what = || format!("the block column of {name}'s block {k}");
        places.push(index(words, block_columns, what)?);
    }
    let mut entries = Vec::new();
    let start = |ends: &[usize], k: usize| if k == 0 { 0 } else { ends[k - 1] };
    for block_row in 0..block_rows {
        let range = start(&row_ends, block_row)..row_ends[block_row];
        let first = pointer[block_row];
        for (k, &block_column) in places[first..pointer[block_row + 1]].iter().enumerate() {
            let block = first + k;
            must_be(words, block, &format!("the number of {name}'s next block"))?;
            for column in start(&column_ends, block_column)..column_ends[block_column] {
                for row in range.clone() {
                    let what = || format!("{name}[{row}, {column}] of block {block}");
                    entries.push((row, column, words.real(what)?));
                }
            }
        }
    }
    Ok(Values::Entries(entries))
}

/// Cumulative sizes that increase to `total`; no block is empty.
fn ends(
    words: &mut Words,
    count: usize,
    total: usize,
    what: &str,
) -> Result<Vec<usize>, FileError> {
    let mut ends = Vec::new();
    let mut last = 0;
    for k in 0..count {
        let end = words.count(|| format!("{what} {k}"))?;
        if end <= last || end > total || (k + 1 == count && end != total) {
            return Err(FileError::Value {
                line: words.line(),
                reason: format!("{what} {k} is {end}; they must rise to {total}"),
            });
        }
        last = end;
        ends.push(end);
    }
    if last != total {
        return Err(FileError::Value {
            line: words.line(),
            reason: format!("{what}: there is none; they must rise to {total}"),
        });
    }
    Ok(ends)
}

/// A listing of triplets or compressed columns, as Siconos prints it.
fn sparse(words: &mut Words, name: &str, rows: usize, columns: usize) -> Result<Values, FileError> {
    let origin = words.count(|| format!("the origin of {name}: 1 or 2"))?;
    if origin != 1 && origin != 2 {
        return Err(FileError::Value {
            line: words.line(),
            reason: format!(
                "the origin of {name} is {origin}, must be 1 (triplets) or 2 (compressed columns)"
            ),
        });
    }
    words.literal("CSparse")?;
    words.skip_line();
    // the header may contain `triplet:`, sizes, `nzmax:`, and then the count
    loop {
        match words.word() {
            Some("nnz:") => break,
            Some(_) => {}
            None => words.literal("nnz:")?,
        }
    }
    let count: usize = words.parsed(
        || format!("the number of entries of {name}"),
        |word| word.trim_end_matches(',').parse().ok(),
    )?;
    words.skip_line();
    if origin == 2 {
        return compressed_columns(words, name, (rows, columns), count);
    }
    let mut entries = Vec::new();
    for k in 0..count {
        let row = index(words, rows, || format!("the row of {name}'s entry {k}"))?;
        let column = index(words, columns, || {
            format!("the column of {name}'s entry {k}")
        })?;
        words.literal(":")?;
        let value = words.real(|| format!("{name}[{row}, {column}]"))?;
        entries.push((row, column, value));
    }
    Ok(Values::Entries(entries))
}

/// The columns of a compressed listing with `count` entries.
fn compressed_columns(
    words: &mut Words,
    name: &str,
    (rows, columns): (usize, usize),
    count: usize,
) -> Result<Values, FileError> {
    let mut entries = Vec::new();
    for column in 0..columns {
        words.literal("col")?;
        must_be(words, column, &format!("the column of {name}"))?;
        words.literal(":")?;
        words.literal("locations")?;
        must_be(
            words,
            entries.len(),
            &format!("the first entry of {name}'s column"),
        )?;
        words.literal("to")?;
        // an empty column prints the position before its first
        let last: i64 = words.parsed(
            || format!("the last entry of {name}'s column"),
            |word| word.parse().ok(),
        )?;
        let end = usize::try_from(last.saturating_add(1)).unwrap_or(0);
        if end < entries.len() || end > count {
            return Err(FileError::Value {
                line: words.line(),
                reason: format!(
                    "column {column} of {name} ends at entry {last}, must be {} to {}",
                    entries.len() as i64 - 1,
                    count as i64 - 1
                ),
            });
        }
        while entries.len() < end {
            let row = index(words, rows, || format!("a row of {name}'s column {column}"))?;
            words.literal(":")?;
            let value = words.real(|| format!("{name}[{row}, {column}]"))?;
            entries.push((row, column, value));
        }
    }
    if entries.len() != count {
        return Err(FileError::Value {
            line: words.line(),
            reason: format!(
                "{name} has {} entries, its header says {count}",
                entries.len()
            ),
        });
    }
    Ok(Values::Entries(entries))
}
