//! Selection of the daemon: flags, environment, configuration file.

#[cfg(test)]
mod tests;

use std::{
    env, fs,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, bail};
use simd_client::replace_file;

use crate::configuration::{Configuration, Daemon, configuration_path, read};
use crate::{failure, options::Options, text_file};

/// The daemon's address if none is given.
const DEFAULT_HOST: &str = "127.0.0.1";

/// An endpoint, and its source.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Choice {
    pub(crate) endpoint: String,
    /// From the context.
    pub(crate) token: Option<String>,
    /// From the context.
    pub(crate) tls_authorities: Option<PathBuf>,
    /// `--endpoint`, `SIMD_ENDPOINT`, `context NAME` or `default`.
    pub(crate) source: String,
}

/// Selects the daemon of this call. Reads the configuration file only if flags and environment do not decide.
pub(crate) fn choose(options: &Options) -> anyhow::Result<Choice> {
    let environment = env::var("SIMD_ENDPOINT").ok().filter(|endpoint| !endpoint.is_empty());
    let path = configuration_path();
    let choice = choose_from(options, environment, || read(path.as_deref()))?;
    if let Some(path) = path.filter(|_| choice.token.is_some()) {
        warn_of_readers(&path);
    }
    Ok(choice)
}

/// Warns if other users can read or change a file with a token.
#[cfg(unix)]
fn warn_of_readers(path: &Path) {
    use std::os::unix::fs::PermissionsExt as _;
    let Ok(metadata) = fs::metadata(path) else { return };
    let mode = metadata.permissions().mode() & 0o777;
    if mode & 0o077 != 0 {
        let path = path.display();
        failure::warn(&format!(
            "{path} has a token, and others can read or change it (its mode is {mode:04o}): chmod 600 {path}"
        ));
    }
}

#[cfg(not(unix))]
fn warn_of_readers(_path: &Path) {}

fn choose_from(
    options: &Options,
    environment: Option<String>,
    configuration: impl Fn() -> anyhow::Result<Configuration>,
) -> anyhow::Result<Choice> {
    let chosen = |endpoint: &str, source: &str| {
        let (endpoint, source) = (endpoint.to_owned(), source.to_owned());
        Ok(Choice { endpoint, token: None, tls_authorities: None, source })
    };
    if let Some(endpoint) = &options.endpoint {
        return chosen(endpoint, "--endpoint");
    }
    if options.context.is_none()
        && let Some(endpoint) = environment
    {
        return chosen(&endpoint, "SIMD_ENDPOINT");
    }
    let configuration = configuration()?;
    let Some(name) = options.context.as_ref().or(configuration.context.as_ref()) else {
        return chosen(&format!("{DEFAULT_HOST}:{}", simd_client::DEFAULT_PORT), "default");
    };
    of_context(&configuration, name)
}

/// Returns the daemon of a context.
pub(crate) fn of_context(configuration: &Configuration, name: &str) -> anyhow::Result<Choice> {
    match configuration.contexts.get(name) {
        Some(Daemon { endpoint, token, tls_authorities }) => Ok(Choice {
            endpoint: endpoint.clone(),
            token: token.clone(),
            tls_authorities: tls_authorities.clone(),
            source: format!("context {name}"),
        }),
        None if configuration.contexts.is_empty() => {
            bail!("there is no context `{name}`: the configuration file names none")
        }
        None => {
            let names: Vec<&str> = configuration.contexts.keys().map(String::as_str).collect();
            bail!("there is no context `{name}`; there is {}", names.join(", "))
        }
    }
}

/// Selects a default context, and returns its endpoint. The rest of the file does not change, including
/// comments.
pub(crate) fn use_context(path: &Path, name: &str) -> anyhow::Result<String> {
    let before = read(Some(path))?;
    let endpoint = of_context(&before, name)?.endpoint;
    // A link continues to point to the file.
    let path = fs::canonicalize(path).with_context(|| format!("cannot read {}", path.display()))?;
    let text = text_file::read_whole(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let changed = with_context(&text, name);
    let after: Configuration = toml::from_str(&changed).unwrap_or_default();
    // Only unusual TOML, such as `"context" = ...`, gets here.
    if after.context.as_deref() != Some(name) || !after.contexts.keys().eq(before.contexts.keys()) {
        bail!("{} cannot be edited by simctl: set `context = {name:?}` in it by hand", path.display());
    }
    // Keeps its permissions: it may have tokens.
    replace_file(&path, changed.as_bytes()).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(endpoint)
}

/// Returns the text with another `context` key, which comes before the first table.
fn with_context(text: &str, name: &str) -> String {
    let line = format!("context = {}\n", toml::Value::from(name));
    let is_key = |line: &str| {
        line.trim_start().strip_prefix("context").is_some_and(|rest| rest.trim_start().starts_with('='))
    };
    let head = text.split_inclusive('\n').take_while(|line| !line.trim_start().starts_with('['));
    let mut at = 0;
    for old in head {
        if is_key(old) {
            return format!("{}{line}{}", &text[..at], &text[at + old.len()..]);
        }
        at += old.len();
    }
    format!("{line}{text}")
}
