//! Numbers and names as text that every reader of our files understands.

/// The shortest text that reads back as the same `f64`, in the form that pandas, VTK and
/// spreadsheets read: plain digits in the middle range, an exponent outside, `NaN`, `inf`, `-inf`.
pub(crate) fn number(value: f64) -> String {
    let magnitude = value.abs();
    let plain = magnitude == 0.0 || (1e-4..1e16).contains(&magnitude) || !value.is_finite();
    if plain { format!("{value}") } else { format!("{value:e}") }
}

/// A number for people: at most `digits` significant digits, no trailing zeros, a true minus sign.
pub(crate) fn readable(value: f64, digits: usize) -> String {
    let rounded: f64 = format!("{value:.*e}", digits.saturating_sub(1)).parse().unwrap_or(value);
    let plain = rounded == 0.0 || (1e-3..1e6).contains(&rounded.abs()) || !rounded.is_finite();
    let text = if plain { format!("{rounded}") } else { format!("{rounded:e}") };
    text.replace('-', "−")
}

/// Text as the value of an XML attribute in double quotes.
pub(crate) fn xml_attribute(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            // XML 1.0 cannot hold control characters at all, not even escaped.
            other if other.is_control() => escaped.push('\u{fffd}'),
            other => escaped.push(other),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_as_the_same_bits() {
        for value in [0.0, -0.0, 1.0, 0.1, 1.0 / 3.0, 1e-4, 9.9e-5, 1e16, -1.5e300, 5e-324, f64::MAX, f64::MIN_POSITIVE]
        {
            let text = number(value);
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{text}");
            assert!(text.len() < 25, "{text} is not short");
        }
        assert_eq!(number(f64::NAN), "NaN");
        assert_eq!(number(f64::NEG_INFINITY), "-inf");
        assert_eq!(number(12.0), "12");
        assert_eq!(number(2.5e-7), "2.5e-7");
    }

    #[test]
    fn numbers_for_people_are_short() {
        assert_eq!(readable(1.0 / 3.0, 4), "0.3333");
        assert_eq!(readable(0.25, 4), "0.25");
        assert_eq!(readable(-1.234_56e-7, 3), "−1.23e−7");
        assert_eq!(readable(214_249_000.0, 4), "2.142e8");
        assert_eq!(readable(f64::NAN, 4), "NaN");
    }

    #[test]
    fn names_cannot_break_the_markup() {
        assert_eq!(xml_attribute("a<b & \"c\"\n"), "a&lt;b &amp; &quot;c&quot;\u{fffd}");
    }
}
