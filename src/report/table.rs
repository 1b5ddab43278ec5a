use std::fmt;

/// Which edge of its column a cell keeps to: text left, numbers right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    Left,
    Right,
}

/// A plain aligned table for the terminal: a header, a rule, rows. Units belong in the header.
#[derive(Debug, Clone)]
pub struct Table {
    columns: Vec<(String, Align)>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// An empty table with these column titles.
    pub fn new<T: Into<String>>(columns: impl IntoIterator<Item = (T, Align)>) -> Self {
        Table {
            columns: columns.into_iter().map(|(t, a)| (t.into(), a)).collect(),
            rows: Vec::new(),
        }
    }

    /// Adds a row. Missing cells stay blank; cells beyond the header get columns without a title.
    pub fn push<T: Into<String>>(&mut self, cells: impl IntoIterator<Item = T>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let titles: Vec<String> = self.columns.iter().map(|(t, _)| t.clone()).collect();
        let lines = || std::iter::once(&titles).chain(&self.rows);
        let count = lines().map(Vec::len).max().unwrap_or(0);
        let mut widths = vec![0; count];
        for line in lines() {
            for (width, cell) in widths.iter_mut().zip(line) {
                *width = cell.chars().count().max(*width);
            }
        }
        for (i, line) in lines().enumerate() {
            let mut text = String::new();
            for (c, &width) in widths.iter().enumerate() {
                let cell = line.get(c).map_or("", String::as_str);
                let gap = if c == 0 { "" } else { "  " };
                match self.columns.get(c).map_or(Align::Left, |column| column.1) {
                    Align::Left => text += &format!("{gap}{cell:<width$}"),
                    Align::Right => text += &format!("{gap}{cell:>width$}"),
                }
            }
            writeln!(f, "{}", text.trim_end())?;
            if i == 0 {
                let rule: Vec<String> = widths.iter().map(|&w| "-".repeat(w)).collect();
                writeln!(f, "{}", rule.join("  "))?;
            }
        }
        Ok(())
    }
}

/// `value` to `significant` digits as an engineer writes it: 7.62, 0.0031, 12800, 1.2e-9.
///
/// Plain from 1e-3 up to 1e6, where the digits before the point are never cut; with an exponent
/// outside. NaN and the infinities are spelled out.
pub fn number(value: f64, significant: usize) -> String {
    let digits = significant.clamp(1, 17);
    if !value.is_finite() {
        return format!("{value}");
    }
    if value == 0.0 {
        return "0".into();
    }
    // The exponent after rounding, so that 9.999 becomes 10.0 and not 10.00.
    let exponent = exponent(value, digits);
    if (-3..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        format!("{value:.decimals$}")
    } else {
        format!("{value:.*e}", digits - 1)
    }
}

/// A number with its noun: "1 joint", "2 joints".
pub fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// `value` with an SI prefix before `unit`: `quantity(0.00762, "m", 3)` is "7.62 mm".
///
/// # Arguments
/// - `value`: in `unit`, which carries no prefix itself (g, not kg) and no power.
/// - `significant`: digits, as in [`number`].
pub fn quantity(value: f64, unit: &str, significant: usize) -> String {
    const PREFIXES: [(i32, &str); 7] = [
        (-9, "n"),
        (-6, "µ"),
        (-3, "m"),
        (0, ""),
        (3, "k"),
        (6, "M"),
        (9, "G"),
    ];
    let exponent = exponent(value, significant.clamp(1, 17));
    let engineering = exponent.div_euclid(3) * 3;
    match PREFIXES.iter().find(|(e, _)| *e == engineering) {
        Some((e, prefix)) if value != 0.0 => {
            // Division by an exact power keeps the last digit right.
            let scaled = if *e < 0 {
                value * 10f64.powi(-e)
            } else {
                value / 10f64.powi(*e)
            };
            format!("{} {prefix}{unit}", number(scaled, significant))
        }
        _ => format!("{} {unit}", number(value, significant)),
    }
}

/// A value with its error, to two digits of the error: `plus_minus(61.2345, 1.83)` is "61.2 ± 1.8".
///
/// An error of 0 (an exact value) or NaN (an unknown error) is not written; every other error is.
pub fn plus_minus(value: f64, error: f64) -> String {
    if error == 0.0 || error.is_nan() || !value.is_finite() {
        return number(value, 4);
    }
    let text = number(error, 2);
    let last = exponent(error, 2) - 1;
    let value = match text.contains('e') && last > 0 {
        // both with an exponent; a value below the error's last digit keeps one digit
        true => {
            let digits = exponent(value, 17) - last + 1;
            number(value, digits.max(1) as usize)
        }
        false if error.is_finite() => {
            let decimals = (-last).clamp(0, 9) as usize;
            format!("{value:.decimals$}")
        }
        false => number(value, 4),
    };
    format!("{value} ± {text}")
}

/// Power of ten of a number's first digit, after rounding to `significant` digits; 0 of one that
/// has none.
fn exponent(value: f64, significant: usize) -> i32 {
    let scientific = format!("{value:.*e}", significant - 1);
    let power = scientific.split_once('e').map(|(_, e)| e.parse());
    power.and_then(Result::ok).unwrap_or(0)
}

/// A step length \[s\] as people write it: 1/60 s, or 0.0167 s where it is no whole fraction.
pub fn step_length(dt: f64) -> String {
    let per_second = dt.recip().round();
    if per_second > 1.0 && (dt * per_second - 1.0).abs() < 1e-9 {
        format!("1/{per_second} s")
    } else {
        format!("{} s", number(dt, 3))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up() {
        let mut table = Table::new([("engine", Align::Left), ("depth [µm]", Align::Right)]);
        table.push(["moreau", "7620"]);
        table.push(["rapier-stiff", "17070"]);
        table.push(["box2d"]);
        table.push(["x", "1", "beyond"]);
        let expected = "\
engine        depth [µm]
------------  ----------  ------
moreau              7620
rapier-stiff       17070
box2d
x                      1  beyond
";
        assert_eq!(table.to_string(), expected);
    }

    #[test]
    fn numbers_as_engineers_write_them() {
        for (value, digits, text) in [
            (7.62, 3, "7.62"),
            (1.2e-9, 2, "1.2e-9"),
            (9.999, 3, "10.0"),
            (0.0031, 2, "0.0031"),
            (0.00099, 2, "9.9e-4"),
            (12800.0, 3, "12800"),
            (999_999.9, 3, "1.00e6"),
            (-0.5, 1, "-0.5"),
            (0.0, 3, "0"),
            (f64::NAN, 3, "NaN"),
            (f64::NEG_INFINITY, 3, "-inf"),
        ] {
            assert_eq!(number(value, digits), text);
        }
    }

    #[test]
    fn a_value_is_written_with_its_error_whatever_its_size() {
        for (value, error, text) in [
            (61.2345, 1.83, "61.2 ± 1.8"),
            (61.2345, 12.0, "61 ± 12"),
            (61.2345, 0.999, "61.2 ± 1.0"),
            (61.2345, 0.00045, "61.23450 ± 4.5e-4"),
            (1234.5, 1234.0, "1234 ± 1234"),
            // errors of 1e6 and more were left out
            (6.123e7, 1.83e6, "6.12e7 ± 1.8e6"),
            (61.2345, 2e6, "61 ± 2.0e6"),
            (61.2345, f64::INFINITY, "61.23 ± inf"),
            (61.2345, 0.0, "61.23"),
            (61.2345, f64::NAN, "61.23"),
            (0.0, 1e7, "0 ± 1.0e7"),
            (f64::NAN, 1.0, "NaN"),
        ] {
            assert_eq!(plus_minus(value, error), text);
        }
    }

    #[test]
    fn step_lengths_are_fractions_where_they_are() {
        assert_eq!(step_length(1.0 / 60.0), "1/60 s");
        assert_eq!(step_length(2e-3), "1/500 s");
        assert_eq!(step_length(0.0167), "0.0167 s");
        // more than a second: no fraction
        assert_eq!(step_length(3.0), "3.00 s");
        assert_eq!(step_length(1.0), "1.00 s");
    }

    #[test]
    fn quantities_take_the_prefix_that_reads_best() {
        for (value, text) in [
            (0.00762, "7.62 mm"),
            (0.0188, "18.8 mm"),
            (0.25, "250 mm"),
            (3.1e-7, "310 nm"),
            (0.0009999, "1.00 mm"),
            (1500.0, "1.50 km"),
            (1e-15, "1.00e-15 m"),
            (0.0, "0 m"),
        ] {
            assert_eq!(quantity(value, "m", 3), text);
        }
    }
}
