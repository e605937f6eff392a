//! Files of an installation: configurations, and tokens and keys that others must not read.

#[cfg(test)]
#[cfg(unix)]
mod tests;

use std::{
    fs::{self, Metadata},
    io,
    path::{Path, PathBuf},
    time::SystemTime,
};

use simd_client::access::parse_tokens;

use super::{Finding, away, unix_seconds};
use crate::configuration::read;

/// Maximum size of a file that a daemon reads.
const MAX_BYTES: u64 = 1 << 20;

/// Files of a daemon on this machine, from its configuration file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct DaemonFiles {
    pub(super) tokens: Option<PathBuf>,
    pub(super) certificate: Option<PathBuf>,
    pub(super) key: Option<PathBuf>,
}

/// Checks the configuration file of simctl.
pub(super) fn configuration(path: Option<&Path>) -> Vec<Finding> {
    const CHECK: &str = "configuration";
    let Some(path) = path else {
        return vec![Finding::ok(CHECK, "there is no home directory for a configuration file")];
    };
    let configuration = match read(Some(path)) {
        Ok(configuration) => configuration,
        Err(error) => {
            let advice = "correct the file; docs/simctl.md has an example";
            return vec![Finding::problem(CHECK, format!("{error:#}"), advice)];
        }
    };
    let Ok(metadata) = fs::metadata(path) else {
        return vec![Finding::ok(CHECK, format!("{} is not there: defaults are used", path.display()))];
    };
    let mut all = vec![match &configuration.context {
        Some(name) if !configuration.contexts.contains_key(name) => Finding::problem(
            CHECK,
            format!("{} chooses the context {name}, which it does not have", path.display()),
            "`simctl context use NAME` chooses another",
        ),
        _ => Finding::ok(
            CHECK,
            format!(
                "{} has {}",
                path.display(),
                crate::output::number::count(configuration.contexts.len(), "context")
            ),
        ),
    }];
    if configuration.contexts.values().any(|context| context.token.is_some()) {
        all.push(private("tokens of contexts", path, &metadata));
    }
    all
}

/// Checks a daemon's configuration file, and returns the files that it names.
pub(super) fn daemon(path: &Path) -> (Vec<Finding>, DaemonFiles) {
    const CHECK: &str = "daemon's file";
    let bad = |sentence: String| {
        let advice = "correct the file, or name another by --config; `simd config default` prints an example";
        (vec![Finding::problem(CHECK, sentence, advice)], DaemonFiles::default())
    };
    let text = match bounded(path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {
            let found = format!("{} cannot be read by this user", path.display());
            let advice =
                "run `simctl doctor` as the daemon's user to have its tokens and certificates checked";
            return (vec![Finding::warning(CHECK, found, advice)], DaemonFiles::default());
        }
        Err(error) => return bad(format!("{} cannot be read: {error}", path.display())),
    };
    let table: toml::Table = match toml::from_str(&text) {
        Ok(table) => table,
        Err(error) => return bad(format!("{} is not valid TOML: {}", path.display(), error.message())),
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let file = |value: Option<&toml::Value>| Some(folder.join(value?.as_str()?));
    let tls = table.get("tls");
    let files = DaemonFiles {
        tokens: file(table.get("tokens")),
        certificate: file(tls.and_then(|tls| tls.get("certificate"))),
        key: file(tls.and_then(|tls| tls.get("key"))),
    };
    (vec![Finding::ok(CHECK, format!("{} can be read", path.display()))], files)
}

/// Checks a daemon's token file.
pub(super) fn tokens(path: &Path, now: SystemTime) -> Vec<Finding> {
    const CHECK: &str = "file of tokens";
    let text = match bounded(path) {
        Ok(text) => text,
        Err(error) => return vec![unreadable(CHECK, path, &error)],
    };
    let mut all = Vec::new();
    if let Ok(metadata) = fs::metadata(path) {
        all.push(private(CHECK, path, &metadata));
    }
    match parse_tokens(&text) {
        Err(error) => all.push(Finding::problem(
            CHECK,
            format!("{}: {error}", path.display()),
            "correct the line, or make a new file with `simctl token add`",
        )),
        Ok(entries) if entries.is_empty() => all.push(Finding::warning(
            CHECK,
            format!("{} has no token: no client can call the daemon", path.display()),
            "`simctl token add NAME --role ROLE` makes one",
        )),
        Ok(entries) => {
            let now = unix_seconds(now);
            let expired: Vec<&str> = entries
                .iter()
                .filter(|entry| entry.is_expired(now))
                .map(|entry| entry.name.as_str())
                .collect();
            if !expired.is_empty() {
                all.push(Finding::warning(
                    CHECK,
                    format!("the tokens of {} have expired", expired.join(", ")),
                    "`simctl token revoke NAME` removes one, `simctl token add` makes another",
                ));
            }
            let next = entries
                .iter()
                .filter_map(|entry| Some((entry.expires?.seconds - now, &entry.name)))
                .filter(|(left, _)| *left > 0)
                .min();
            let next = next.map(|(left, name)| format!("; the one of {name} expires {}", away(left)));
            let tokens = crate::output::number::count(entries.len(), "token");
            all.push(Finding::ok(CHECK, format!("{tokens}{}", next.unwrap_or_default())));
        }
    }
    all
}

/// Checks that others can neither read nor change a file.
pub(super) fn private(check: &'static str, path: &Path, metadata: &Metadata) -> Finding {
    match mode(metadata) {
        Some(mode) if mode & 0o077 != 0 => Finding::problem(
            check,
            format!("others can read or change {} (its mode is {mode:04o})", path.display()),
            format!("chmod 600 {}", path.display()),
        ),
        Some(mode) => {
            Finding::ok(check, format!("only its owner can access {} ({mode:04o})", path.display()))
        }
        None => Finding::ok(check, format!("{} is there; this system has no modes", path.display())),
    }
}

#[cfg(unix)]
fn mode(metadata: &Metadata) -> Option<u32> {
    use std::os::unix::fs::PermissionsExt as _;
    Some(metadata.permissions().mode() & 0o777)
}

#[cfg(not(unix))]
fn mode(_metadata: &Metadata) -> Option<u32> {
    None
}

/// Reads a text of bounded length, and not from a pipe, which would block.
pub(super) fn bounded(path: &Path) -> io::Result<String> {
    let metadata = fs::metadata(path)?;
    if !metadata.is_file() {
        return Err(io::Error::other("it is not a file"));
    }
    if metadata.len() > MAX_BYTES {
        return Err(io::Error::other(format!("it has more than {MAX_BYTES} bytes")));
    }
    fs::read_to_string(path)
}

/// Returns the finding of a required but unreadable file. A file with the correct permissions may be
/// unreadable for this user.
pub(super) fn unreadable(check: &'static str, path: &Path, error: &io::Error) -> Finding {
    let found = format!("{} cannot be read: {error}", path.display());
    match error.kind() {
        io::ErrorKind::PermissionDenied => {
            Finding::warning(check, found, "run `simctl doctor` as the daemon's user to have it checked")
        }
        _ => Finding::problem(check, found, "name a file that exists, in folders that can be entered"),
    }
}
