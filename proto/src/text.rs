//! Printable names. Names come from untrusted files and programs. A terminal, a log or a page would obey a
//! control character in them, show them backwards, or not show them at all.

use std::borrow::Cow;

/// Unicode's category Cf ("format"): zero-width characters, and characters that change the direction of text.
const FORMAT: &[(char, char)] = &[
    ('\u{ad}', '\u{ad}'),
    ('\u{600}', '\u{605}'),
    ('\u{61c}', '\u{61c}'),
    ('\u{6dd}', '\u{6dd}'),
    ('\u{70f}', '\u{70f}'),
    ('\u{890}', '\u{891}'),
    ('\u{8e2}', '\u{8e2}'),
    ('\u{180e}', '\u{180e}'),
    ('\u{200b}', '\u{200f}'),
    ('\u{202a}', '\u{202e}'),
    ('\u{2060}', '\u{2064}'),
    ('\u{2066}', '\u{206f}'),
    ('\u{feff}', '\u{feff}'),
    ('\u{fff9}', '\u{fffb}'),
    ('\u{110bd}', '\u{110bd}'),
    ('\u{110cd}', '\u{110cd}'),
    ('\u{13430}', '\u{1343f}'),
    ('\u{1bca0}', '\u{1bca3}'),
    ('\u{1d173}', '\u{1d17a}'),
    ('\u{e0001}', '\u{e0001}'),
    ('\u{e0020}', '\u{e007f}'),
];

/// Returns whether the character is printable: in none of Unicode's categories Cc (control), Cf (format), Zl
/// and Zp (line and paragraph separators).
pub fn is_printable(c: char) -> bool {
    let is_format = || FORMAT.iter().any(|&(first, last)| (first..=last).contains(&c));
    !c.is_control() && !matches!(c, '\u{2028}' | '\u{2029}') && (c.is_ascii() || !is_format())
}

/// Escapes characters that are not printable, as `\u{202e}`.
pub fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, is_printable)
}

/// Like [`printable`], for text of several lines: line breaks stay.
pub fn printable_lines(text: &str) -> Cow<'_, str> {
    escaped(text, |c| c == '\n' || is_printable(c))
}

/// Removes the system's numbers of errors, as in `No such file or directory (os error 2)`.
pub fn without_error_numbers(text: &str) -> Cow<'_, str> {
    const BEFORE: &str = " (os error ";
    let mut plain = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once(BEFORE) {
        plain += before;
        let digits = after.len() - after.trim_start_matches(|c: char| c.is_ascii_digit()).len();
        rest = match after[digits..].strip_prefix(')') {
            Some(after) if digits > 0 => after,
            _ => {
                plain += BEFORE;
                after
            }
        };
    }
    if rest.len() == text.len() { Cow::Borrowed(text) } else { Cow::Owned(plain + rest) }
}

/// Escapes characters that may not stay, as `\u{202e}`.
pub fn escaped(text: &str, may_stay: impl Fn(char) -> bool) -> Cow<'_, str> {
    if text.chars().all(&may_stay) {
        return Cow::Borrowed(text);
    }
    let mut clean = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if may_stay(c) { clean.push(c) } else { clean.extend(c.escape_unicode()) }
    }
    Cow::Owned(clean)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invisible_characters_are_written_out() {
        assert_eq!(printable("bras/épaule 1 肩"), "bras/épaule 1 肩");
        assert_eq!(printable("a\u{202e}b\u{200b}c"), r"a\u{202e}b\u{200b}c");
        assert_eq!(printable("\x1b[31m\n"), r"\u{1b}[31m\u{a}");
        assert_eq!(printable_lines("one\ntwo\r\u{2028}"), "one\ntwo\\u{d}\\u{2028}");
        assert_eq!(printable("tag\u{e0041}"), r"tag\u{e0041}");
    }

    #[test]
    fn numbers_of_errors_are_removed_and_nothing_else() {
        for (text, plain) in [
            ("a: No such file (os error 2)", "a: No such file"),
            ("a (os error 2): b (os error 111) c", "a: b c"),
            ("a (os error x) b (os error ) c (os error 2", "a (os error x) b (os error ) c (os error 2"),
            ("", ""),
        ] {
            assert_eq!(without_error_numbers(text), plain);
        }
    }

    #[test]
    fn the_table_is_in_order() {
        assert!(FORMAT.iter().all(|(first, last)| first <= last));
        assert!(FORMAT.windows(2).all(|pair| pair[0].1 < pair[1].0));
    }
}
