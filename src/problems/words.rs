use super::FileError;

/// The words of a text, separated by white space, with their lines.
#[derive(Clone, Copy)]
pub(super) struct Words<'a> {
    rest: &'a str,
    line: usize,
}

impl<'a> Words<'a> {
    pub fn new(text: &'a str) -> Self {
        Words {
            rest: text,
            line: 1,
        }
    }

    /// The line, from 1, of the word last read.
    pub fn line(&self) -> usize {
        self.line
    }

    /// The next word; `None` at the end, where the line is that of the last word.
    pub fn word(&mut self) -> Option<&'a str> {
        let start = self.rest.trim_start();
        let word = start.split_whitespace().next()?;
        let skipped = &self.rest[..self.rest.len() - start.len()];
        self.line += skipped.matches('\n').count();
        self.rest = &start[word.len()..];
        Some(word)
    }

    /// The next word, parsed by `parse`.
    pub fn parsed<T>(
        &mut self,
        expected: impl FnOnce() -> String,
        parse: impl FnOnce(&str) -> Option<T>,
    ) -> Result<T, FileError> {
        let word = self.word();
        word.and_then(parse).ok_or_else(|| FileError::Expected {
            line: self.line,
            expected: expected(),
            found: match word {
                // a word may be a megabyte long
                Some(word) => format!("`{}`", word.chars().take(40).collect::<String>()),
                None => "the end of the file".to_owned(),
            },
        })
    }

    /// A whole number ≥ 0.
    pub fn count(&mut self, expected: impl FnOnce() -> String) -> Result<usize, FileError> {
        let whole = || format!("{} (a whole number)", expected());
        self.parsed(whole, |word| word.parse().ok())
    }

    /// A finite number.
    pub fn real(&mut self, expected: impl FnOnce() -> String) -> Result<f64, FileError> {
        let finite = || format!("{} (a finite number)", expected());
        self.parsed(finite, |word| {
            word.parse().ok().filter(|x: &f64| x.is_finite())
        })
    }

    /// `count` numbers; errors call the k-th `name[k]`.
    pub fn reals(&mut self, count: usize, name: &str) -> Result<Vec<f64>, FileError> {
        (0..count)
            .map(|k| self.real(|| format!("{name}[{k}], one of {count}")))
            .collect()
    }

    /// The word `word`, perhaps with more text behind it.
    pub fn literal(&mut self, word: &str) -> Result<(), FileError> {
        self.parsed(
            || format!("`{word}`"),
            |found| found.starts_with(word).then_some(()),
        )
    }

    /// Skips the rest of the line of the last word.
    pub fn skip_line(&mut self) {
        let end = self.rest.find('\n').unwrap_or(self.rest.len());
        self.rest = &self.rest[end..];
    }
}
