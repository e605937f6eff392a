//! Given numbers: their limits, and their form in sentences.

use std::fmt::Display;

/// Length above which a number is shortened: a double takes 24 characters with all of its digits.
const LONGEST: usize = 24;

/// Largest magnitude of a given number, in its unit. Results may be a million times larger and can still be
/// computed with.
pub const LARGEST_GIVEN: f64 = 1e12;

/// Formats a given value for a sentence. Numbers with hundreds of zeros become `1e300`, also in lists; other
/// values do not change.
pub fn shown(value: impl Display) -> String {
    let text = value.to_string();
    match text.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
        Some(list) => format!("[{}]", list.split(", ").map(shortened).collect::<Vec<_>>().join(", ")),
        None => shortened(&text),
    }
}

fn shortened(text: &str) -> String {
    match text.parse::<f64>() {
        Ok(number) if text.len() > LONGEST => format!("{number:e}"),
        _ => text.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_of_hundreds_of_digits_is_shown_by_its_exponent() {
        assert_eq!(shown(1e300), "1e300");
        assert_eq!(shown(-2.5e-300), "-2.5e-300");
        assert_eq!(shown(1e300.to_string()), "1e300");
        assert_eq!(shown(format!("[0, {}, -0.5]", 1e300)), "[0, 1e300, -0.5]");
    }

    #[test]
    fn all_else_is_shown_as_it_is() {
        assert_eq!(shown(f64::NAN), "NaN");
        assert_eq!(shown(-0.123_456_789_012_345_6), "-0.1234567890123456");
        assert_eq!(shown(u64::MAX), u64::MAX.to_string());
        let rays = "18446744065119617025 rays with the vertical ones";
        assert_eq!(shown(rays), rays);
    }
}
