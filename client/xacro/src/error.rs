//! Why a file is not expanded.

use std::path::PathBuf;

/// A sentence with the file and the line.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{message}", location(file, *line))]
pub struct Error {
    /// What was wrong.
    pub message: String,
    /// The file, where there is one.
    pub file: Option<PathBuf>,
    /// From 1; 0 where it does not apply.
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

/// What is wrong, before it is known where. A fragment or a sentence.
pub(crate) type Fault = String;

/// Of what Python and xacro have and this does not.
pub(crate) fn not_supported(what: &str) -> Fault {
    format!("not supported: {what}")
}

/// A word of a file as an error shows it: quoted, and not long.
pub(crate) fn shown(word: &str) -> String {
    const MOST: usize = 60;
    match word.char_indices().nth(MOST) {
        Some((end, _)) => format!("{:?}...", word.get(..end).unwrap_or_default()),
        None => format!("{word:?}"),
    }
}
