//! The token of a client, and files that hold one.

use std::{
    fmt,
    fs::File,
    io::{self, Read as _},
    path::{Path, PathBuf},
};

/// Maximum size of a token file.
const MAX_FILE: u64 = 4096;

/// A token. Its value is never printed.
#[derive(Clone)]
pub struct Token(pub(crate) String);

/// Reason why a file gives no token.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TokenFileError {
    /// The file cannot be read.
    #[error("cannot read the token in {}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        #[source]
        error: io::Error,
    },
    /// The first line is empty, or the file is longer than a token.
    #[error("{} has no token: it must be the first line", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
}

impl Token {
    /// Reads the token in the first line of a file.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, or has no token.
    pub fn from_file(path: &Path) -> Result<Self, TokenFileError> {
        let mut text = String::new();
        let read = File::open(path).and_then(|file| file.take(MAX_FILE + 1).read_to_string(&mut text));
        read.map_err(|error| TokenFileError::Unreadable { path: path.to_owned(), error })?;
        let token = text.lines().next().unwrap_or_default().trim();
        if token.is_empty() || text.len() as u64 > MAX_FILE {
            return Err(TokenFileError::Empty { path: path.to_owned() });
        }
        Ok(Self(token.to_owned()))
    }
}

impl From<String> for Token {
    fn from(text: String) -> Self {
        Self(text)
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_has_the_token_in_its_first_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("token");
        std::fs::write(&path, "simd_1\nand more\n").unwrap();
        assert_eq!(Token::from_file(&path).unwrap().0, "simd_1");
        for text in [String::new(), "\n".to_owned(), "a".repeat(5000)] {
            std::fs::write(&path, text).unwrap();
            assert!(Token::from_file(&path).unwrap_err().to_string().contains("has no token"));
        }
        let unreadable = Token::from_file(folder.path()).unwrap_err().to_string();
        assert!(unreadable.contains("cannot read the token"), "{unreadable}");
    }
}
