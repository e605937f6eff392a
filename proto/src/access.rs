//! Tokens: how a client identifies itself, and the format of the daemon's token file.
//!
//! A token is `simd_` and 64 hexadecimal digits, which are 32 random bytes. A client sends it as
//! `authorization: Bearer TOKEN`, in the header of that name or, over Zenoh, in a line of the attachment. The
//! file has only the SHA-256 of each token. Tokens are random: their hashes can be looked up directly, and a
//! reader of the file cannot recover a token.
//!
//! The file is text, one token per line:
//!
//! ```text
//! # NAME ROLE SHA256 EXPIRES [robots=A,B]
//! alice operator 2bb80d537b1da3e38bd30361aa855686bde0eacd7162fef6a25fe97bf527a25b 2027-01-31T00:00:00Z
//! page viewer 9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08 never
//! bob operator 60303ae22b998861bce3b28f33eec1be758a213c86c93c076dbe9f558c11c752 never robots=arm,gripper
//! ```

use std::fmt;
use std::str::FromStr;

use prost_types::Timestamp;
use sha2::{Digest as _, Sha256};

use crate::hex;

/// Header (gRPC metadata, a line of Zenoh's attachment) that has the token after `Bearer `.
pub const TOKEN_HEADER: &str = "authorization";

/// Cookie in which the page in the browser keeps the token.
pub const TOKEN_COOKIE: &str = "simd_token";

/// Prefix of each token.
const PREFIX: &str = "simd_";

/// Random bytes of a token.
pub const TOKEN_BYTES: usize = 32;

/// Maximum number of tokens in a file.
pub const MAX_TOKENS: usize = 1_000;

/// Prefix of the list of robots that a token is limited to.
const ROBOTS: &str = "robots=";

/// Maximum number of characters of a token's name.
const MAX_NAME: usize = 64;

/// Rights of a token. Each role includes the roles before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// Reads states and descriptions.
    Viewer,
    /// Commands robots, and sets parameters.
    Operator,
    /// Loads and deletes robots, changes physics, saves and restores worlds.
    Admin,
}

impl Role {
    /// All roles, in ascending order.
    pub const ALL: [Self; 3] = [Self::Viewer, Self::Operator, Self::Admin];

    /// Returns its name in the file and in sentences.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viewer => "viewer",
            Self::Operator => "operator",
            Self::Admin => "admin",
        }
    }
}

impl FromStr for Role {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|role| role.name() == text);
        found.ok_or_else(|| format!("{text:?} is not a role; it must be viewer, operator or admin"))
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A line of the token file.
#[derive(Clone, Debug, PartialEq)]
pub struct TokenEntry {
    /// Name of the holder: 1 to 64 of `A-Z a-z 0-9 _ - . @`.
    pub name: String,
    /// Rights of the token.
    pub role: Role,
    /// SHA-256 of the token as text.
    pub hash: [u8; 32],
    /// Time from which it is refused; `None` is never.
    pub expires: Option<Timestamp>,
    /// Robots that it may change; empty means all of them, and the world.
    pub robots: Vec<String>,
}

impl TokenEntry {
    /// Returns whether the text is a valid name of a token.
    pub fn is_name(text: &str) -> bool {
        let is_part = |byte: u8| byte.is_ascii_alphanumeric() || b"_-.@".contains(&byte);
        (1..=MAX_NAME).contains(&text.len()) && text.bytes().all(is_part)
    }

    /// Returns whether a token can be limited to a robot of this name, which may have no spaces or commas.
    pub fn is_robot(text: &str) -> bool {
        !text.is_empty() && !text.contains([' ', ',']) && text.chars().all(|part| part.is_ascii_graphic())
    }

    /// Returns whether it has expired at this time, in seconds since 1970.
    pub fn is_expired(&self, now: i64) -> bool {
        self.expires.is_some_and(|expires| expires.seconds <= now)
    }
}

impl fmt::Display for TokenEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { name, role, hash, expires, robots } = self;
        let expires = expires.map_or_else(|| "never".to_owned(), |expires| expires.to_string());
        write!(f, "{name} {role} {} {expires}", hex::text(hash))?;
        match robots.is_empty() {
            true => Ok(()),
            false => write!(f, " {ROBOTS}{}", robots.join(",")),
        }
    }
}

impl FromStr for TokenEntry {
    type Err = String;

    fn from_str(line: &str) -> Result<Self, String> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        let (&[name, role, hash, expires], robots) = (match words.as_slice() {
            [first @ .., last] if last.starts_with(ROBOTS) => (first, Some(last)),
            all => (all, None),
        }) else {
            return Err("it must be a name, a role, a SHA-256, and a time or \"never\"".to_owned());
        };
        let robots: Vec<String> = match robots.and_then(|robots| robots.strip_prefix(ROBOTS)) {
            Some(robots) => robots.split(',').map(str::to_owned).collect(),
            None => Vec::new(),
        };
        if robots.iter().any(String::is_empty) {
            return Err(format!("after {ROBOTS} there must be names of robots, with commas"));
        }
        if !Self::is_name(name) {
            return Err(format!("{name:?} is not a valid name; it must be 1 to 64 of A-Z a-z 0-9 _ - . @"));
        }
        let hash = hex::bytes(hash).ok_or("its third word is not a SHA-256 in hexadecimal")?;
        let expires = match expires {
            "never" => None,
            time => Some(time.parse().map_err(|_| {
                format!("{time:?} is not a time; it must be like 2027-01-31T00:00:00Z, or \"never\"")
            })?),
        };
        Ok(Self { name: name.to_owned(), role: role.parse()?, hash, expires, robots })
    }
}

/// Parses the text of a token file. The error is the rest of a sentence that begins with the file's name.
pub fn parse_tokens(text: &str) -> Result<Vec<TokenEntry>, String> {
    let mut entries: Vec<TokenEntry> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let entry: TokenEntry = line.parse().map_err(|error| format!("line {number}: {error}"))?;
        if entries.iter().any(|known| known.name == entry.name) {
            return Err(format!("line {number}: there is a token called {} already", entry.name));
        }
        if entries.len() >= MAX_TOKENS {
            return Err(format!("line {number}: there are more than {MAX_TOKENS} tokens"));
        }
        entries.push(entry);
    }
    Ok(entries)
}

/// Returns the text of a token file.
pub fn write_tokens(entries: &[TokenEntry]) -> String {
    let mut text = "# NAME ROLE SHA256 EXPIRES [robots=A,B]\n".to_owned();
    entries.iter().for_each(|entry| text.push_str(&format!("{entry}\n")));
    text
}

/// Returns the token of these random bytes.
pub fn token(random: &[u8; TOKEN_BYTES]) -> String {
    format!("{PREFIX}{}", hex::text(random))
}

/// Returns the hash of a token, as in the file. `None` if the text is not a token.
pub fn token_hash(token: &str) -> Option<[u8; 32]> {
    hex::bytes::<TOKEN_BYTES>(token.strip_prefix(PREFIX)?)?;
    Some(Sha256::digest(token.as_bytes()).into())
}

/// Returns the value of [`TOKEN_HEADER`].
pub fn bearer(token: &str) -> String {
    format!("Bearer {token}")
}

/// Returns the token in a value of [`TOKEN_HEADER`].
pub fn parse_bearer(value: &str) -> Option<&str> {
    let (scheme, token) = value.trim().split_once(' ')?;
    scheme.eq_ignore_ascii_case("bearer").then(|| token.trim())
}

/// Returns the token in the values of a `cookie` header.
pub fn parse_cookie(value: &str) -> Option<&str> {
    value.split(';').find_map(|pair| pair.trim().strip_prefix(TOKEN_COOKIE)?.strip_prefix('='))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(name: &str) -> TokenEntry {
        let hash = token_hash(&token(&[7; TOKEN_BYTES])).unwrap();
        TokenEntry { name: name.into(), role: Role::Operator, hash, expires: None, robots: Vec::new() }
    }

    #[test]
    fn a_file_is_read_as_it_was_written() {
        let expires = Some("2027-01-31T12:30:00Z".parse().unwrap());
        let of_robots = TokenEntry { robots: vec!["arm".into(), "gripper_2".into()], ..entry("bob") };
        let entries =
            [entry("alice"), of_robots, TokenEntry { expires, role: Role::Admin, ..entry("lab.page@here") }];
        let text = write_tokens(&entries);
        assert_eq!(parse_tokens(&text).unwrap(), entries);
        assert!(!text.contains(&token(&[7; TOKEN_BYTES])), "the token itself is not kept");
        assert_eq!(parse_tokens("\n # nothing\n").unwrap(), []);
    }

    #[test]
    fn a_slip_in_the_file_is_named_by_its_line() {
        let good = entry("alice").to_string();
        for (text, expected) in [
            (format!("{good}\nbob operator"), "line 2: it must be a name"),
            (good.replace("operator", "king"), "line 1: \"king\" is not a role"),
            (good.replace("alice", "a/b"), "line 1: \"a/b\" is not a valid name"),
            (good.replace("never", "tomorrow"), "line 1: \"tomorrow\" is not a time"),
            (format!("{good}\n\n{good}"), "line 3: there is a token called alice already"),
            (good.replace("never", "never again"), "line 1: it must be a name"),
            (format!("{good} robots=a,,b"), "line 1: after robots= there must be names"),
        ] {
            let refused = parse_tokens(&text).unwrap_err();
            assert!(refused.starts_with(expected), "{refused}");
        }
        let many: String = (0..=MAX_TOKENS).map(|i| format!("{}\n", entry(&format!("n{i}")))).collect();
        assert!(parse_tokens(&many).unwrap_err().contains("more than 1000"));
    }

    #[test]
    fn other_texts_than_tokens_have_no_hash() {
        let good = token(&[200; TOKEN_BYTES]);
        assert!(token_hash(&good).is_some());
        let upper = format!("simd_{}", good["simd_".len()..].to_uppercase());
        for text in ["", "simd_", &good[1..], &good[..good.len() - 1], &format!("{good}0"), upper.as_str()] {
            assert_eq!(token_hash(text), None, "{text}");
        }
    }

    #[test]
    fn a_token_is_found_in_its_header_and_in_its_cookie() {
        assert_eq!(parse_bearer("Bearer simd_1"), Some("simd_1"));
        assert_eq!(parse_bearer(" bearer  simd_1 "), Some("simd_1"));
        assert_eq!(parse_bearer("Basic simd_1"), None);
        assert_eq!(parse_bearer("simd_1"), None);
        assert_eq!(parse_cookie("theme=dark; simd_token=simd_1; a=b"), Some("simd_1"));
        assert_eq!(parse_cookie("xsimd_token=simd_1; simd_tokens=2"), None);
    }

    #[test]
    fn a_token_expires_at_its_time() {
        let at = TokenEntry { expires: Some("1970-01-01T00:01:00Z".parse().unwrap()), ..entry("a") };
        assert!(!at.is_expired(59) && at.is_expired(60) && !entry("b").is_expired(i64::MAX));
    }
}
