//! Numbers as text in a page: five characters each, read back exactly as rounded.

use super::markup::six_digits;

/// The 64 digits, from 0 to 63.
const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
/// What is added to a mantissa and to an exponent so that neither is negative.
const MANTISSA: i64 = 1 << 20;
const EXPONENT: i64 = 1 << 8;
/// Characters of a number.
const LENGTH: usize = 5;

/// Appends `value`, rounded to six significant digits, as `m 10^e`.
///
/// The number `(m + 2^20) 2^9 + e + 2^8` is written in base 64, its highest digit first. What is not
/// finite has the code 0. Values below 1e-250 are 0; above 1e250 nothing is told apart from infinity.
pub(super) fn pack(value: f64, out: &mut String) {
    let mut code = match parts(value) {
        Some((mantissa, exponent)) => ((mantissa + MANTISSA) << 9) + exponent + EXPONENT,
        None => 0,
    };
    let mut digits = [0; LENGTH];
    for digit in digits.iter_mut().rev() {
        *digit = DIGITS[(code & 63) as usize];
        code >>= 6;
    }
    out.extend(digits.map(char::from));
}

/// Mantissa of at most six digits, and exponent.
fn parts(value: f64) -> Option<(i64, i64)> {
    let value = six_digits(value);
    if value.abs() < 1e-250 {
        return Some((0, 0));
    }
    let text = format!("{value:.5e}");
    let (mantissa, exponent) = text.split_once('e')?;
    let mantissa: i64 = mantissa.replace('.', "").parse().ok()?;
    let exponent: i64 = exponent.parse().ok()?;
    (exponent < 250).then_some((mantissa, exponent - 5))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unpack(text: &str) -> f64 {
        let digit = |c: u8| DIGITS.iter().position(|d| *d == c).unwrap() as i64;
        let code = text.bytes().fold(0, |code, c| code * 64 + digit(c));
        let (mantissa, exponent) = ((code >> 9) - MANTISSA, (code & 511) - EXPONENT);
        match code {
            0 => f64::NAN,
            _ => format!("{mantissa}e{exponent}").parse().unwrap(),
        }
    }

    #[test]
    fn six_digits_come_back_exactly() {
        for value in [
            0.0,
            1.0,
            -1.0 / 3.0,
            123_456.7,
            9.999_999e-200,
            -6.02e23,
            1e249,
        ] {
            let mut text = String::new();
            pack(value, &mut text);
            assert_eq!(text.len(), LENGTH);
            assert_eq!(unpack(&text), six_digits(value), "{value}");
        }
        for value in [f64::NAN, f64::INFINITY, -1e300] {
            let mut text = String::new();
            pack(value, &mut text);
            assert!(unpack(&text).is_nan(), "{value}");
        }
        let mut text = String::new();
        pack(5e-324, &mut text);
        assert_eq!(unpack(&text), 0.0);
    }
}
