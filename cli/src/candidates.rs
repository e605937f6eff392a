//! Candidates of a completion in a shell, in its quotes; contexts of the configuration file.

use std::ffi::OsStr;

use clap_complete::engine::{ArgValueCompleter, CompletionCandidate};
use simd_client::is_printable;

use crate::configuration::{configuration_path, read};

/// Variable with the typed word in bash, including its quotes: only bash inserts candidates unchanged.
pub(crate) const WORD: &str = "SIMCTL_COMPLETE_WORD";
/// Maximum number of candidates: more fill a screen.
const MAX_CANDIDATES: usize = 2_000;

/// Completes the name of a context.
pub(crate) fn contexts() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| {
        let configuration = read(configuration_path().as_deref()).unwrap_or_default();
        candidates(current, configuration.contexts.into_keys())
    })
}

/// Returns the matching candidates; leaves out names that control a terminal.
pub(crate) fn candidates(
    current: &OsStr,
    names: impl IntoIterator<Item = String>,
) -> Vec<CompletionCandidate> {
    let begin = if is_bash() {
        unquoted(current.to_str().unwrap_or_default())
    } else {
        current.to_string_lossy().into()
    };
    let may_be = |name: &String| name.starts_with(&begin) && name.chars().all(is_printable);
    let names = names.into_iter().filter(may_be).take(MAX_CANDIDATES);
    names
        .map(|name| CompletionCandidate::new(if is_bash() { quoted(&name, open_quote()) } else { name }))
        .collect()
}

pub(crate) fn is_bash() -> bool {
    std::env::var_os(WORD).is_some()
}

/// Returns the quote of the word, if one is open.
fn open_quote() -> Option<char> {
    let word = std::env::var(WORD).ok()?;
    word.chars().next().filter(|first| matches!(first, '\'' | '"'))
}

/// Returns a word without its quotes.
pub(crate) fn unquoted(word: &str) -> String {
    let mut plain = String::with_capacity(word.len());
    let mut quote = None;
    let mut chars = word.chars();
    while let Some(c) = chars.next() {
        match (quote, c) {
            (None, '\'' | '"') => quote = Some(c),
            (Some(begin), c) if begin == c => quote = None,
            (None | Some('"'), '\\') => plain.extend(chars.next()),
            (_, c) => plain.push(c),
        }
    }
    plain
}

/// Quotes a name for bash as one word, or as the rest of one that began with a quote.
fn quoted(name: &str, quote: Option<char>) -> String {
    let is_open = quote.is_some_and(|quote| !name.contains([quote, '$', '`', '\\']));
    if is_open {
        return name.to_owned();
    }
    let mut word = String::with_capacity(name.len());
    for c in name.chars() {
        if !c.is_alphanumeric() && !"_-./=:,+@%".contains(c) {
            word.push('\\');
        }
        word.push(c);
    }
    word
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quotes_around_a_word_are_not_part_of_its_name() {
        for name in ["shoulder joint", "a\\b", "it's", "a$(b)\"c", "肩", "ns:a/b=1"] {
            assert_eq!(unquoted(&quoted(name, None)), name);
        }
        assert_eq!(quoted("two links", None), "two\\ links");
        assert_eq!(quoted("two links", Some('"')), "two links");
        for typed in ["two\\ li", "'two li", "\"two li", "two' 'li"] {
            assert_eq!(unquoted(typed), "two li");
        }
        assert_eq!(unquoted("a\\"), "a");
    }

    #[test]
    fn names_that_a_terminal_obeys_are_not_offered() {
        let names = ["arm", "arm\u{1b}[31m", "arm\nleg", "leg"].map(str::to_owned);
        let offered: Vec<_> = candidates(OsStr::new("a"), names)
            .into_iter()
            .map(|candidate| candidate.get_value().to_string_lossy().into_owned())
            .collect();
        assert_eq!(offered, ["arm"]);
    }
}
