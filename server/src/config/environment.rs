//! Environment variables: `SIMD_` and a key's path, in capitals, with `_` for the dot.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::ConfigError;
use super::draft::{Draft, Origin};
use super::keys::{KEYS, TABLES};

/// Variables of clients with a prefix of the daemon's tables.
const OF_CLIENTS: [&str; 3] = ["SIMD_TLS_CA", "SIMD_TLS_CLIENT_CERT", "SIMD_TLS_CLIENT_KEY"];

/// Returns the folder for files that the daemon keeps: the folder that a service manager gives it, else `$XDG_STATE_HOME/simd`,
/// else `~/.local/state/simd`. `None` without a home.
pub(super) fn state_folder(variables: &[(OsString, OsString)]) -> Option<PathBuf> {
    let folder = |wanted: &str| {
        let value = variables.iter().find(|(name, _)| name == wanted)?.1.to_str()?;
        // systemd lists several folders with colons.
        let first = Path::new(value.split(':').next()?);
        first.is_absolute().then(|| first.to_owned())
    };
    let of_user = || {
        Some(folder("XDG_STATE_HOME").or_else(|| Some(folder("HOME")?.join(".local/state")))?.join("simd"))
    };
    folder("STATE_DIRECTORY").or_else(of_user)
}

/// Puts the values of variables over the draft. Variables of clients, such as `SIMD_TOKEN`, are skipped. A variable that
/// begins like a table's, without a key of it, is a mistake.
pub(super) fn apply(
    draft: &mut Draft,
    variables: impl IntoIterator<Item = (OsString, OsString)>,
) -> Result<(), ConfigError> {
    let mut said: Vec<(String, OsString)> = Vec::new();
    for (name, value) in variables {
        let is_ours = |name: &&str| name.starts_with("SIMD_") && !OF_CLIENTS.contains(name);
        let Some(name) = name.to_str().filter(is_ours) else { continue };
        said.push((name.to_owned(), value));
    }
    for key in KEYS.iter() {
        let variable = key.variable();
        let Some(index) = said.iter().position(|(name, _)| *name == variable) else { continue };
        let (name, value) = said.swap_remove(index);
        let origin = Origin::Variable(name);
        let text = value.to_str().ok_or_else(|| origin.mistake("it is not UTF-8"))?;
        let value = key.parse(text).map_err(|sentence| origin.mistake(&format!("it {sentence}")))?;
        draft.set(key, value, origin)?;
    }
    let of_table = |name: &str| {
        TABLES.iter().find(|(table, _)| {
            !table.is_empty() && name.starts_with(&format!("SIMD_{}_", table.to_ascii_uppercase()))
        })
    };
    said.sort();
    match said.iter().find_map(|(name, _)| Some((name, of_table(name)?))) {
        Some((name, (table, _))) => Err(Origin::Variable(name.clone()).mistake(&format!(
            "it is not a key of the configuration; the keys of {table} are {}",
            super::file::names(table).join(", ")
        ))),
        None => Ok(()),
    }
}
