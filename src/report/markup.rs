//! Text for SVG and HTML, and numbers short enough for pictures.

/// `text` with the characters that have a meaning in SVG and HTML replaced, and without control
/// characters, which have no place in XML.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars().filter(|c| !c.is_control()) {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c => out.push(c),
        }
    }
    out
}

/// JSON for a script element: no `</script>` and no `<!--` can stand in it.
pub(super) fn in_script(json: &str) -> String {
    json.replace('<', "\\u003c")
}

/// `value` rounded to six significant decimal digits; NaN where it is not finite.
///
/// An `f32` holds any number of six digits so that it is read back from it exactly.
pub(super) fn six_digits(value: f64) -> f64 {
    if !value.is_finite() {
        return f64::NAN;
    }
    format!("{value:.5e}").parse().unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_ends_its_element() {
        assert_eq!(
            escaped("a<b & 'c'\u{7}\""),
            "a&lt;b &amp; &#39;c&#39;&quot;"
        );
        let json = in_script("{\"title\":\"</script><!--\"}");
        assert!(!json.contains('<'), "{json}");
        let back: serde_json::Value = serde_json::from_str(&json).unwrap();
        assert_eq!(back["title"], "</script><!--");
    }

    #[test]
    fn six_digits_are_kept_by_single_precision() {
        for value in [1.0 / 3.0, -2.5e-7, 9.999_995e12, 0.0, 123_456.5] {
            let rounded = six_digits(value);
            assert!((rounded - value).abs() <= 5.1e-6 * value.abs(), "{value}");
            let single = rounded as f32;
            assert_eq!(six_digits(f64::from(single)), rounded, "{value}");
        }
        assert!(six_digits(f64::INFINITY).is_nan());
    }
}
