//! Numbers for people: a fixed number of decimals, so that columns line up.

/// Replaces a missing value.
pub(crate) const ABSENT: &str = "-";

/// Formats a number with fixed decimals; with a power of ten if that would be too long, and without the sign
/// of a zero.
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    if !value.is_finite() {
        return match value {
            value if value.is_nan() => "nan".to_owned(),
            value if value > 0.0 => "inf".to_owned(),
            _ => "-inf".to_owned(),
        };
    }
    if value.abs() >= 1e7 {
        return format!("{value:.3e}");
    }
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(digits) if digits.chars().all(|c| matches!(c, '0' | '.')) => digits.to_owned(),
        _ => text,
    }
}

/// Formats a number with as few decimals as possible, for settings, which are round.
pub(crate) fn exact(value: f64) -> String {
    if value != 0.0 && (value.abs() < 1e-6 || value.abs() >= 1e9) {
        format!("{value:e}")
    } else {
        format!("{value}")
    }
}

/// Formats several numbers with fixed decimals, separated by spaces.
pub(crate) fn several(values: &[f64], decimals: usize) -> String {
    match values {
        [] => ABSENT.to_owned(),
        values => values.iter().map(|value| fixed(*value, decimals)).collect::<Vec<_>>().join(" "),
    }
}

/// Formats a number that may be absent.
pub(crate) fn optional(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(|| ABSENT.to_owned(), |value| fixed(value, decimals))
}

/// Formats a count: `1 joint`, `2 joints`.
pub(crate) fn count(number: usize, noun: &str) -> String {
    if number == 1 { format!("1 {noun}") } else { format!("{number} {noun}s") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_have_fixed_decimals_and_no_negative_zero() {
        assert_eq!(fixed(0.123_456, 4), "0.1235");
        assert_eq!(fixed(-0.000_01, 4), "0.0000");
        assert_eq!(fixed(-1.0, 2), "-1.00");
        assert_eq!(fixed(1.5e9, 4), "1.500e9");
        assert_eq!(fixed(f64::INFINITY, 4), "inf");
        assert_eq!(optional(None, 4), "-");
        assert_eq!(several(&[1.0, -2.0], 1), "1.0 -2.0");
    }

    #[test]
    fn settings_are_shown_as_they_were_typed() {
        assert_eq!(exact(0.001), "0.001");
        assert_eq!(exact(-9.81), "-9.81");
        assert_eq!(exact(1e-7), "1e-7");
        assert_eq!(exact(0.0), "0");
    }
}
