use super::dat_matrix::Matrix;
use super::global::reduce;
use super::words::Words;
use super::{FileError, Loaded};
use crate::contact::{ContactProblem, Delassus, Law, Vec2};
use nalgebra::DVector;

/// Reads a text file of any of the three kinds.
pub(super) fn read(text: &str) -> Result<Loaded, FileError> {
    let mut words = Words::new(text);
    if is_lcp(words)? {
        return lcp(&mut words);
    }
    let dimension = words.count(|| "the dimension, 2".to_owned())?;
    if dimension == 3 {
        return Err(FileError::Value {
            line: words.line(),
            reason: "a three-dimensional problem: only planar ones (dimension 2) are solved"
                .to_owned(),
        });
    }
    contacts(&mut words)
}

/// Whether the leading numbers are `n storage n n` of an LCP, not `dimension contacts storage rows
/// columns`.
///
/// Only `2 1 2 2 2` can be both: in a contact problem a listing follows.
fn is_lcp(mut words: Words) -> Result<bool, FileError> {
    let start = words;
    let head: Vec<&str> = std::iter::from_fn(|| words.word()).take(7).collect();
    let number = |k: usize| head.get(k).and_then(|word| word.parse::<usize>().ok());
    let (first, second, third) = (number(0), number(1), number(2));
    let exact = first.is_some() && first == third && first == number(3);
    let lcp = second.is_some_and(|storage| storage <= 2);
    let contact = matches!(first, Some(2 | 3))
        && second.is_some_and(|contacts| contacts > 0)
        && third.is_some_and(|storage| storage <= 2);
    let listing = head.get(6).is_some_and(|word| word.starts_with("CSparse"));
    match (lcp, contact) {
        (true, true) => Ok(exact && !listing),
        (true, false) => Ok(true),
        (false, true) => Ok(false),
        (false, false) => {
            let mut line = start;
            line.word();
            let begins = head.join(" ").chars().take(60).collect::<String>();
            Err(FileError::Kind {
                line: line.line(),
                reason: format!(
                    "neither JSON nor an LCP (n, storage, n, n, ...) nor a contact problem (2, \
                     contacts, storage, rows, columns, ...): the file begins with `{begins}`"
                ),
            })
        }
    }
}

fn lcp(words: &mut Words) -> Result<Loaded, FileError> {
    let n = words.count(|| "the size of the LCP".to_owned())?;
    let matrix = sized(words, "M", (n, n))?;
    let q = words.reals(n, "q")?;
    Ok(Loaded::lcp(matrix.dense("M")?, DVector::from_vec(q), None))
}

/// A matrix of the given size.
fn sized(words: &mut Words, name: &str, size: (usize, usize)) -> Result<Matrix, FileError> {
    let mut ahead = *words;
    ahead.word();
    let found = [ahead.word(), ahead.word()];
    // checked before the numbers, so that a wrong size is not reported as a missing number
    if let [Some(rows), Some(columns)] = found.map(|w| w.and_then(|w| w.parse::<usize>().ok()))
        && (rows, columns) != size
    {
        return Err(wrong_size(ahead.line(), name, (rows, columns), size));
    }
    Matrix::read(words, name)
}

fn wrong_size(line: usize, name: &str, found: (usize, usize), size: (usize, usize)) -> FileError {
    FileError::Expected {
        line,
        expected: format!("{name} of {} x {}", size.0, size.1),
        found: format!("{} x {}", found.0, found.1),
    }
}

/// Reads from the number of contacts on, local or global.
fn contacts(words: &mut Words) -> Result<Loaded, FileError> {
    let contacts = words.count(|| "the number of contacts".to_owned())?;
    let size = contacts.saturating_mul(2);
    let mut at = *words;
    let matrix = Matrix::read(words, "W (or M)")?;
    at.word();
    let (rows, columns) = (matrix.rows, matrix.columns);
    if rows != columns {
        return Err(wrong_size(at.line(), "W", (rows, columns), (size, size)));
    }
    if is_matrix(*words, (rows, size), contacts) {
        return global(words, matrix, contacts);
    }
    if rows != size {
        return Err(wrong_size(at.line(), "W", (rows, columns), (size, size)));
    }
    let free = words.reals(size, "q")?;
    let laws = friction(words, contacts)?;
    let problem = ContactProblem {
        operator: Delassus::Blocks(matrix.blocks()),
        free: pairs(&free),
        laws,
    };
    Loaded::contact(problem, None)
}

/// Whether H of `size` follows, not q and μ: q and μ are `3 contacts` numbers, H has more.
fn is_matrix(mut words: Words, size: (usize, usize), contacts: usize) -> bool {
    let head = [words.word(), words.word(), words.word()];
    let numbers = head.map(|w| w.and_then(|w| w.parse::<usize>().ok()));
    if size.0 != size.1 {
        // no W: if this is no H either, the error should be about H
        return numbers[1] == Some(size.0);
    }
    if numbers[1..] != [Some(size.0), Some(size.1)] {
        return false;
    }
    let mut after = words;
    after.word();
    let listing = (after.word()).is_some_and(|word| word.starts_with("CSparse"));
    let local = contacts.saturating_mul(3);
    let count = std::iter::from_fn(|| words.word())
        .take(local)
        .take_while(|word| word.parse::<f64>().is_ok())
        .count();
    listing || head.len() + count > local
}

/// Reads from H on.
fn global(words: &mut Words, mass: Matrix, contacts: usize) -> Result<Loaded, FileError> {
    let size = contacts.saturating_mul(2);
    let coordinates = mass.rows;
    let h = sized(words, "H", (coordinates, size))?;
    let q = words.reals(coordinates, "q")?;
    let b = words.reals(size, "b")?;
    let laws = friction(words, contacts)?;
    let mut warnings = Vec::new();
    let (operator, free) = reduce(&mass, &h, &q, b, &mut warnings)?;
    let problem = ContactProblem {
        operator: Delassus::Blocks(operator),
        free: pairs(&free),
        laws,
    };
    let mut loaded = Loaded::contact(problem, None)?;
    loaded.warnings.splice(0..0, warnings);
    Ok(loaded)
}

fn pairs(numbers: &[f64]) -> Vec<Vec2> {
    numbers
        .chunks_exact(2)
        .map(|pair| Vec2::new(pair[0], pair[1]))
        .collect()
}

/// μ of every contact.
fn friction(words: &mut Words, contacts: usize) -> Result<Vec<Law>, FileError> {
    let mut laws = Vec::new();
    for k in 0..contacts {
        let friction = words.real(|| format!("mu[{k}], one of {contacts}"))?;
        if friction < 0.0 {
            return Err(FileError::Value {
                line: words.line(),
                reason: format!("mu[{k}] is {friction}, must be at least 0"),
            });
        }
        laws.push(Law::Contact {
            friction,
            compliance: 0.0,
        });
    }
    Ok(laws)
}
