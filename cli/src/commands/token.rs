//! `simctl token`: the token file of a daemon on this machine. The daemon reads it again automatically.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context as _, bail};
use clap::{Args, Subcommand};
use prost_types::Timestamp;
use serde::Serialize;
use simd_client::access::{Role, TOKEN_BYTES, TokenEntry, parse_tokens, token, token_hash, write_tokens};

use crate::{
    configuration::configuration_path,
    output::{
        Output, View,
        table::{Column, Page, Table},
    },
    text_file,
};

/// Longest wait for another simctl that changes the file, and interval of the checks.
const LOCK: Duration = Duration::from_secs(3);
const CHECK_INTERVAL: Duration = Duration::from_millis(10);

#[derive(Debug, Subcommand)]
pub(crate) enum Token {
    /// Makes a token, and prints it: it is not kept, and cannot be shown again
    Add {
        /// Name of the holder: letters, digits, _ - . @
        name: String,
        /// Rights: viewer reads, operator commands robots and parameters, admin does all
        #[arg(long, value_name = "ROLE")]
        role: Role,
        /// Time until it expires, for instance 90d, 12h, or never
        #[arg(long, value_name = "TIME", default_value = "never", value_parser = lifetime)]
        expires: Lifetime,
        /// Robot that the token may change; it then cannot change the whole world. May be repeated
        #[arg(long = "robot", value_name = "ROBOT")]
        robots: Vec<String>,
        #[command(flatten)]
        file: TokenFile,
    },
    /// Shows the holders of tokens
    List {
        #[command(flatten)]
        file: TokenFile,
    },
    /// Removes a token: calls with it are refused within a second, and its streams end
    Revoke {
        /// Name of the holder
        name: String,
        #[command(flatten)]
        file: TokenFile,
    },
}

#[derive(Args, Debug)]
pub(crate) struct TokenFile {
    /// File of the daemon's flag --tokens [default: $XDG_CONFIG_HOME/simd/tokens or ~/.config/simd/tokens]
    #[arg(long, value_name = "PATH")]
    file: Option<PathBuf>,
}

/// Seconds for which a token is valid; `None` means forever.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Lifetime(Option<i64>);

pub(crate) fn run(command: &Token, output: Output) -> anyhow::Result<()> {
    match command {
        Token::Add { name, role, expires, robots, file } => {
            add(&file.path()?, name, *role, *expires, robots, output)
        }
        Token::List { file } => {
            let entries = read(&file.path()?)?;
            output.list(&entries.iter().map(TokenView::from).collect::<Vec<_>>(), list)
        }
        Token::Revoke { name, file } => {
            let path = file.path()?;
            change(&path, |entries| {
                let known = entries.len();
                entries.retain(|entry| entry.name != *name);
                if entries.len() == known {
                    bail!("there is no token called {name} in {}", path.display());
                }
                Ok(())
            })?;
            output.one(&Revoked { revoked: name.clone() })
        }
    }
}

fn add(
    path: &Path,
    name: &str,
    role: Role,
    expires: Lifetime,
    robots: &[String],
    output: Output,
) -> anyhow::Result<()> {
    if !TokenEntry::is_name(name) {
        bail!("{name:?} is not a valid name; it must be 1 to 64 of A-Z a-z 0-9 _ - . @");
    }
    if let Some(robot) = robots.iter().find(|robot| !TokenEntry::is_robot(robot)) {
        bail!("a token cannot be for a robot called {robot:?}: names in the file have no spaces or commas");
    }
    let mut random = [0; TOKEN_BYTES];
    getrandom::fill(&mut random)
        .map_err(|error| anyhow::anyhow!("the system has no random numbers: {error}"))?;
    let text = token(&random);
    let hash = token_hash(&text).context("a token that was made is none")?;
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    let expires = expires.0.map(|seconds| Timestamp {
        seconds: i64::try_from(now).unwrap_or(i64::MAX).saturating_add(seconds),
        nanos: 0,
    });
    let entry = TokenEntry { name: name.to_owned(), role, hash, expires, robots: robots.to_vec() };
    let view = TokenView::from(&entry);
    change(path, |entries| {
        if entries.iter().any(|known| known.name == name) {
            bail!("there is a token called {name} already: revoke it first, or take another name");
        }
        entries.push(entry);
        // Checked as the daemon reads it.
        parse_tokens(&write_tokens(entries)).map(drop).map_err(anyhow::Error::msg)
    })?;
    output.one(&NewToken { view, token: text })
}

impl TokenFile {
    fn path(&self) -> anyhow::Result<PathBuf> {
        let default = || configuration_path().map(|path| path.with_file_name("tokens"));
        self.file
            .clone()
            .or_else(default)
            .context("there is no home directory for the file of tokens: give --file")
    }
}

fn read(path: &Path) -> anyhow::Result<Vec<TokenEntry>> {
    let text = text_file::read_whole(path).with_context(|| format!("cannot read {}", path.display()))?;
    parse_tokens(&text).map_err(|error| anyhow::anyhow!("{}: {error}", path.display()))
}

/// Writes a new file and renames it to the old one, so that a daemon never reads half of it. The
/// new file is also a lock: otherwise two concurrent changes would lose one of them.
fn change(
    path: &Path,
    change: impl FnOnce(&mut Vec<TokenEntry>) -> anyhow::Result<()>,
) -> anyhow::Result<()> {
    let mut name = path.as_os_str().to_owned();
    name.push(".new");
    let new = PathBuf::from(name);
    if let Some(folder) = path.parent().filter(|folder| !folder.as_os_str().is_empty()) {
        fs::create_dir_all(folder).with_context(|| format!("cannot make {}", folder.display()))?;
    }
    let mut file = locked(&new)?;
    let changed = (|| {
        let mut entries = if path.exists() { read(path)? } else { Vec::new() };
        change(&mut entries)?;
        file.write_all(write_tokens(&entries).as_bytes())?;
        file.sync_all()?;
        fs::rename(&new, path).with_context(|| format!("cannot write {}", path.display()))
    })();
    if changed.is_err() {
        let _ = fs::remove_file(&new);
    }
    changed
}

/// Opens the new file, once no other simctl has it.
fn locked(path: &Path) -> anyhow::Result<File> {
    let until = Instant::now() + LOCK;
    loop {
        match private(path) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists && Instant::now() < until => {
                std::thread::sleep(CHECK_INTERVAL);
            }
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                let path = path.display();
                bail!("{path} exists: another simctl is changing the tokens; if not, delete the file")
            }
            outcome => return outcome.with_context(|| format!("cannot write {}", path.display())),
        }
    }
}

/// Returns a new file that others can neither read nor write.
fn private(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(path)
}

fn lifetime(text: &str) -> Result<Lifetime, String> {
    let expected = || format!("{text:?} must be like 90d, 12h, 30m, or never");
    if text == "never" {
        return Ok(Lifetime(None));
    }
    let (number, unit) = text.split_at(text.len() - text.chars().last().map_or(0, char::len_utf8));
    let seconds: i64 = match unit {
        "d" => 86_400,
        "h" => 3_600,
        "m" => 60,
        "s" => 1,
        _ => return Err(expected()),
    };
    let number: u32 = number.parse().map_err(|_| expected())?;
    Ok(Lifetime(Some(i64::from(number) * seconds)))
}

#[derive(Serialize)]
struct TokenView {
    name: String,
    role: &'static str,
    /// As in RFC 3339; null is never.
    expires: Option<String>,
    /// Robots that it may change; empty means all of them, and the world.
    robots: Vec<String>,
}

#[derive(Serialize)]
struct NewToken {
    #[serde(flatten)]
    view: TokenView,
    token: String,
}

impl View for NewToken {
    /// Prints only the token, so that a shell can use it.
    fn page(&self) -> Page {
        Page::new().line(self.token.clone())
    }
}

#[derive(Serialize)]
struct Revoked {
    revoked: String,
}

impl View for Revoked {
    fn page(&self) -> Page {
        Page::new().line(format!("revoked the token of {}", self.revoked))
    }
}

impl From<&TokenEntry> for TokenView {
    fn from(entry: &TokenEntry) -> Self {
        let expires = entry.expires.map(|expires| expires.to_string());
        Self { name: entry.name.clone(), role: entry.role.name(), expires, robots: entry.robots.clone() }
    }
}

fn list(tokens: &[TokenView]) -> Page {
    let columns = ["NAME", "ROLE", "EXPIRES", "ROBOTS"].map(Column::left).into();
    let row = |token: &TokenView| {
        let expires = token.expires.clone().unwrap_or_else(|| "never".to_owned());
        let robots = if token.robots.is_empty() { "all".to_owned() } else { token.robots.join(",") };
        vec![token.name.clone(), token.role.to_owned(), expires, robots]
    };
    Page::new().table(Table::new(columns, tokens.iter().map(row).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lifetime_is_a_number_and_a_unit() {
        assert_eq!(lifetime("90d"), Ok(Lifetime(Some(90 * 86_400))));
        assert_eq!(lifetime("30m"), Ok(Lifetime(Some(1_800))));
        assert_eq!(lifetime("never"), Ok(Lifetime(None)));
        for text in ["", "d", "90", "-1d", "1w", "1.5h", "9ü"] {
            assert!(lifetime(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_file_that_another_changes_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tokens");
        fs::write(folder.path().join("tokens.new"), "").unwrap();
        let refused = change(&path, |_| Ok(())).unwrap_err().to_string();
        assert!(refused.contains("another simctl") && !path.exists(), "{refused}");
        fs::remove_file(folder.path().join("tokens.new")).unwrap();
        assert!(change(&path, |_| bail!("no")).is_err());
        change(&path, |_| Ok(())).unwrap();
        assert!(path.exists() && !folder.path().join("tokens.new").exists());
    }
}
