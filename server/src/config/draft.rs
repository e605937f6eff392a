//! A configuration while it is read: layers of values, each over the previous one, and checks across values.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use super::key::{Key, Value};
use super::{Autosave, Config, ConfigError, TlsFiles};

/// Source of a value. A later variant overrides an earlier one.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Origin {
    /// Line of the configuration file.
    File(PathBuf, usize),
    /// Environment variable.
    Variable(String),
    /// Flag of the command line.
    Flag(String),
}

impl std::fmt::Display for Origin {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(path, line) => write!(formatter, "{}: line {line}", path.display()),
            Self::Variable(name) => formatter.write_str(name),
            Self::Flag(flag) => formatter.write_str(flag),
        }
    }
}

impl Origin {
    /// Returns the error for a mistake in this source.
    pub(super) fn mistake(&self, sentence: &str) -> ConfigError {
        match self {
            Self::File(..) => ConfigError::File(format!("{self}: {sentence}")),
            Self::Variable(_) => ConfigError::Usage(format!("{self}: {sentence}")),
            Self::Flag(_) => ConfigError::Usage(format!("{self}: {sentence}; see simd --help")),
        }
    }

    /// Returns the error for a refused value. A flag or a variable of the key takes the place of its path.
    fn refused(&self, key: &Key, sentence: &str) -> ConfigError {
        let is_own = match self {
            Self::File(..) => false,
            Self::Variable(_) => true,
            Self::Flag(flag) => key.flag.is_some_and(|own| flag.strip_prefix("--") == Some(own)),
        };
        match sentence.strip_prefix(key.path).filter(|rest| is_own && rest.starts_with(" is ")) {
            Some(rest) => ConfigError::Usage(match self {
                Self::Flag(_) => format!("{self}{rest}; see simd --help"),
                Self::Variable(_) | Self::File(..) => format!("{self}{rest}"),
            }),
            None => self.mistake(sentence),
        }
    }
}

/// A configuration while it is read.
#[derive(Clone, Debug)]
pub(super) struct Draft {
    pub(super) config: Config,
    /// The folder for files that the daemon keeps.
    pub(super) state: Option<PathBuf>,
    pub(super) autosave_enabled: bool,
    pub(super) autosave_file: Option<PathBuf>,
    pub(super) autosave_every: Duration,
    pub(super) autosave_restore: bool,
    pub(super) certificate: Option<PathBuf>,
    pub(super) key: Option<PathBuf>,
    pub(super) client_authorities: Option<PathBuf>,
    /// Base folder of relative paths in the present layer.
    pub(super) folder: PathBuf,
    origins: BTreeMap<&'static str, Origin>,
}

impl Default for Draft {
    fn default() -> Self {
        let (config, state, autosave_file, certificate, key, client_authorities, folder, origins) =
            Default::default();
        let (autosave_enabled, autosave_every, autosave_restore) = (false, Duration::from_secs(60), false);
        Self {
            config,
            state,
            autosave_enabled,
            autosave_file,
            autosave_every,
            autosave_restore,
            certificate,
            key,
            client_authorities,
            folder,
            origins,
        }
    }
}

impl Draft {
    /// The defaults, with a folder for files that the daemon keeps.
    pub(super) fn beginning(state: Option<PathBuf>) -> Self {
        Self { state, ..Self::default() }
    }

    /// Puts a value over what was there.
    pub(super) fn set(&mut self, key: &Key, value: Value, origin: Origin) -> Result<(), ConfigError> {
        key.set(self, value).map_err(|sentence| origin.refused(key, &sentence))?;
        self.origins.insert(key.path, origin);
        Ok(())
    }

    /// Returns the source of a key's value; `None` for the default.
    pub(super) fn origin(&self, path: &str) -> Option<&Origin> {
        self.origins.get(path)
    }

    /// Finishes the draft: sets defaults that follow from other values, and checks values together.
    pub(super) fn finish(mut self) -> Result<Self, ConfigError> {
        self.settle_shares();
        let recording = &mut self.config.recording;
        if recording.directory.is_none() {
            recording.directory = self.state.as_ref().map(|folder| folder.join("recordings"));
            recording.is_made = true;
        }
        let autosave = ["autosave.enabled", "autosave.restore"];
        self.config.autosave = self.autosave().map_err(|sentence| self.mistake(&autosave, &sentence))?;
        let tls = ["tls.certificate", "tls.key", "tls.client_authorities"];
        self.config.tls = self.tls_files().map_err(|sentence| self.mistake(&tls, &sentence))?;
        let shares = ["max", "max_per_peer", "loopback_reserve", "max_http1"]
            .map(|name| format!("connections.{name}"));
        let shares: Vec<&str> = shares.iter().map(String::as_str).collect();
        self.config.connections.check().map_err(|sentence| self.mistake(&shares, &sentence))?;
        self.config.check_exposure().map_err(|sentence| self.mistake(&["listen"], &sentence))?;
        self.config.zenoh.tls.clone_from(&self.config.tls);
        let (insecure, has_tokens) = (self.config.insecure, self.config.tokens.is_some());
        let zenoh = self.config.zenoh.check(insecure, has_tokens);
        let said = ["zenoh.listen", "zenoh.config", "zenoh.connect"];
        zenoh.map_err(|sentence| self.mistake(&said, &sentence))?;
        let ros2 = self.config.ros2.check(&self.config.zenoh, insecure);
        let said = ["ros2.enabled", "ros2.router", "zenoh.listen"];
        ros2.map_err(|sentence| self.mistake(&said, &sentence))?;
        Ok(self)
    }

    /// Returns the error for a mistake in some keys together. It names the source that set one of them last,
    /// or the flags if none did.
    fn mistake(&self, paths: &[&str], sentence: &str) -> ConfigError {
        match paths.iter().filter_map(|path| self.origin(path)).max() {
            Some(origin) => origin.mistake(sentence),
            None => ConfigError::Usage(sentence.to_owned()),
        }
    }

    /// Sets limits that follow from others, unless they are given.
    fn settle_shares(&mut self) {
        let is_said = |path: &str| self.origins.contains_key(path);
        let connections = &mut self.config.connections;
        if !is_said("connections.max_per_peer") {
            connections.max_per_peer = connections.max_per_peer.min(connections.max);
        }
        if !is_said("connections.loopback_reserve") {
            connections.loopback_reserve = connections.loopback_reserve.min(connections.max / 2);
        }
        if !is_said("connections.max_http1") {
            connections.max_http1 = connections.max_http1.min(connections.max);
        }
        let limits = &mut self.config.limits;
        // A client may send at most as much as can be read.
        limits.description_bytes = limits.description_bytes.min(limits.reading.urdf_bytes as u64);
        limits.asset_bytes = limits.asset_bytes.min(limits.reading.mesh_bytes as u64);
        limits.links = u32::try_from(limits.reading.links).unwrap_or(u32::MAX);
    }

    fn autosave(&self) -> Result<Option<Autosave>, String> {
        let (every, restore) = (self.autosave_every, self.autosave_restore);
        let (file, is_made) = match (&self.autosave_file, &self.state) {
            (Some(file), _) => (file.clone(), false),
            (None, _) if !self.autosave_enabled && !restore => return Ok(None),
            (None, Some(folder)) => (folder.join(format!("{}.simdstate", self.config.name)), true),
            (None, None) => {
                return Err(
                    "there is no home directory for the autosave: give autosave.file, or set XDG_STATE_HOME"
                        .into(),
                );
            }
        };
        Ok(Some(Autosave { file, every, restore, is_made }))
    }

    fn tls_files(&self) -> Result<Option<TlsFiles>, String> {
        let client_authorities = self.client_authorities.clone();
        match (self.certificate.clone(), self.key.clone()) {
            (Some(certificate), Some(key)) => Ok(Some(TlsFiles { certificate, key, client_authorities })),
            (Some(_), None) => {
                Err("a certificate is given without its key: give tls.key (--tls-key) too".into())
            }
            (None, Some(_)) => {
                Err("a key is given without its certificate: give tls.certificate (--tls-certificate) too"
                    .into())
            }
            (None, None) if client_authorities.is_some() => {
                Err("tls.client_authorities is given without the \
                 daemon's own certificate: give tls.certificate and tls.key too"
                    .into())
            }
            (None, None) => Ok(None),
        }
    }
}
