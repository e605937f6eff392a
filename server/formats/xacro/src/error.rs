//! Errors of an expansion.

use std::path::PathBuf;

/// An error with its file and line. Displays as a sentence.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{message}", location(file, *line))]
pub struct Error {
    /// Fault, as a fragment or a sentence.
    pub message: String,
    /// File, if any.
    pub file: Option<PathBuf>,
    /// Line, from 1; 0 if it does not apply.
    pub line: u32,
}

fn location(file: &Option<PathBuf>, line: u32) -> String {
    match (file, line) {
        (None, 0) => String::new(),
        (None, line) => format!("line {line}: "),
        (Some(file), 0) => format!("{}: ", file.display()),
        (Some(file), line) => format!("{}:{line}: ", file.display()),
    }
}

/// Fault before its place is known, as a fragment or a sentence.
pub(crate) type Fault = String;

/// Makes the fault for a feature of Python or xacro that is not supported.
pub(crate) fn not_supported(what: &str) -> Fault {
    format!("not supported: {what}")
}

/// Quotes a word of a file for an error, and shortens it.
pub(crate) fn shown(word: &str) -> String {
    const MAX: usize = 60;
    match word.char_indices().nth(MAX) {
        Some((end, _)) => format!("{:?}...", word.get(..end).unwrap_or_default()),
        None => format!("{word:?}"),
    }
}
