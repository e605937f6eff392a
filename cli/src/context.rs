//! Which daemon: flags, environment, configuration file.

use std::{
    collections::BTreeMap,
    env, fs, io,
    path::{Path, PathBuf},
};

use anyhow::{Context as _, bail};
use serde::Deserialize;

use crate::args::Options;

/// The daemon's address if none is given.
const DEFAULT_HOST: &str = "127.0.0.1";

/// The configuration file. Unknown keys are refused, so that a slip is found.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Configuration {
    /// The context to use where nothing else is said.
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
    /// For a daemon that asks for one.
    pub(crate) token: Option<String>,
    /// The authorities (PEM) by which its certificate is checked; relative to the file's folder.
    pub(crate) tls_authorities: Option<PathBuf>,
}

/// An endpoint, and who chose it.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Choice {
    pub(crate) endpoint: String,
    /// Of the context.
    pub(crate) token: Option<String>,
    /// Of the context.
    pub(crate) tls_authorities: Option<PathBuf>,
    /// `--endpoint`, `SIMD_ENDPOINT`, `context NAME` or `default`.
    pub(crate) source: String,
}

/// The daemon that this call is for. Reads the configuration file only where
/// nothing before it decides.
pub(crate) fn choose(options: &Options) -> anyhow::Result<Choice> {
    let environment = env::var("SIMD_ENDPOINT").ok().filter(|endpoint| !endpoint.is_empty());
    choose_from(options, environment, || read(configuration_path().as_deref()))
}

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
    match configuration.contexts.get(name) {
        Some(Daemon { endpoint, token, tls_authorities }) => Ok(Choice {
            token: token.clone(),
            tls_authorities: tls_authorities.clone(),
            ..chosen(endpoint, &format!("context {name}"))?
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

/// `$XDG_CONFIG_HOME/simd/config.toml`, else `~/.config/simd/config.toml`.
pub(crate) fn configuration_path() -> Option<PathBuf> {
    let folder = |variable| env::var_os(variable).map(PathBuf::from).filter(|path| path.is_absolute());
    let base = folder("XDG_CONFIG_HOME").or_else(|| folder("HOME").map(|home| home.join(".config")))?;
    Some(base.join("simd").join("config.toml"))
}

/// The configuration; an empty one where there is no file.
pub(crate) fn read(path: Option<&Path>) -> anyhow::Result<Configuration> {
    let Some(path) = path else { return Ok(Configuration::default()) };
    let text = match fs::read_to_string(path) {
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

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::args::Arguments;

    const FILE: &str =
        "context = \"lab\"\n[contexts.lab]\nendpoint = \"lab:1\"\n[contexts.sea]\nendpoint = \"sea:2\"\n";

    fn choice(flags: &str, environment: Option<&str>, file: &str) -> anyhow::Result<(String, String)> {
        let line = format!("simctl robot list {flags}");
        let arguments = Arguments::try_parse_from(line.split_whitespace()).unwrap();
        let choice =
            choose_from(&arguments.options, environment.map(str::to_owned), || Ok(toml::from_str(file)?))?;
        Ok((choice.endpoint, choice.source))
    }

    #[test]
    fn the_flag_beats_the_environment_which_beats_the_file() {
        for (flags, environment, file, endpoint, source) in [
            ("-e here:9", Some("env:3"), FILE, "here:9", "--endpoint"),
            ("--context sea", Some("env:3"), FILE, "sea:2", "context sea"),
            ("", Some("env:3"), FILE, "env:3", "SIMD_ENDPOINT"),
            ("", None, FILE, "lab:1", "context lab"),
            ("", None, "", "127.0.0.1:7400", "default"),
        ] {
            let expected = (endpoint.to_owned(), source.to_owned());
            assert_eq!(choice(flags, environment, file).unwrap(), expected);
        }
    }

    #[test]
    fn an_unknown_context_lists_those_there_are() {
        let error = choice("--context moon", None, FILE).unwrap_err().to_string();
        assert_eq!(error, "there is no context `moon`; there is lab, sea");
        assert!(choice("--context moon", None, "").is_err());
    }

    #[test]
    fn a_slip_in_the_file_is_an_error_that_names_the_file() {
        let dir = tempfile::TempDir::new().unwrap();
        let path = dir.path().join("config.toml");
        fs::write(&path, "contxt = \"lab\"\n").unwrap();
        let error = format!("{:#}", read(Some(&path)).unwrap_err());
        assert!(error.contains("config.toml is not a configuration") && error.contains("contxt"), "{error}");
        assert!(read(Some(&dir.path().join("none.toml"))).unwrap().contexts.is_empty());
    }
}
