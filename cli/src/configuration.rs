//! The configuration file of contexts.

use std::{
    collections::BTreeMap,
    env, io,
    path::{Path, PathBuf},
};

use anyhow::Context as _;
use serde::Deserialize;

use crate::text_file;

/// The configuration file. Unknown keys are refused, so that typing errors are found.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Configuration {
    /// Default context.
    pub(crate) context: Option<String>,
    /// Daemons by name.
    #[serde(default)]
    pub(crate) contexts: BTreeMap<String, Daemon>,
}

/// One daemon of the configuration file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Daemon {
    pub(crate) endpoint: String,
    /// Token for a daemon that asks for one.
    pub(crate) token: Option<String>,
    /// Authorities (PEM) that check its certificate; relative to the file's folder.
    pub(crate) tls_authorities: Option<PathBuf>,
}

/// Returns `$XDG_CONFIG_HOME/simd/config.toml`, or `~/.config/simd/config.toml`.
pub(crate) fn configuration_path() -> Option<PathBuf> {
    let folder = |variable| env::var_os(variable).map(PathBuf::from).filter(|path| path.is_absolute());
    let base = folder("XDG_CONFIG_HOME").or_else(|| folder("HOME").map(|home| home.join(".config")))?;
    Some(base.join("simd").join("config.toml"))
}

/// Reads the configuration; an empty one if there is no file.
pub(crate) fn read(path: Option<&Path>) -> anyhow::Result<Configuration> {
    let Some(path) = path else { return Ok(Configuration::default()) };
    let text = match text_file::read_whole(path) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Configuration::default()),
        Err(error) => return Err(error).with_context(|| format!("cannot read {}", path.display())),
    };
    let mut configuration: Configuration =
        toml::from_str(&text).with_context(|| format!("{} is not a configuration", path.display()))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    for authorities in
        configuration.contexts.values_mut().filter_map(|daemon| daemon.tls_authorities.as_mut())
    {
        *authorities = folder.join(&*authorities);
    }
    Ok(configuration)
}
