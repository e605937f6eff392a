//! The operator's settings: flags override environment variables, which override the configuration file,
//! which overrides the defaults. Everything is checked before a port is bound.
//!
//! * `keys`: the table of keys, from which everything else here is made; `key` is one of them.
//! * `file`, `environment`, `flags`: the layers, each applied to a `draft`.
//! * `command` and `text`: `simd config`, the default file and the document.

mod command;
mod connections;
mod draft;
mod environment;
mod file;
mod flags;
mod key;
mod keys;
mod ros2;
#[cfg(test)]
mod tests;
mod text;
mod zenoh;

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::time::Duration;

use glamx::DPose3;
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::PhysicsChange;
use simd_core::{Command, PhysicsSettings, Simulation};
use tracing_subscriber::EnvFilter;

pub use self::command::{Asked, run};
pub use self::connections::Connections;
pub use self::ros2::{Distro, NO_ROS2, PlainNames, Ros2};
pub use self::zenoh::{NO_ZENOH, Zenoh};
use crate::log::LogFormat;
use simd_world::driver;
use simd_world::handle::{DaemonLimits, Pace};
use simd_world::recording;

/// Complete configuration of a daemon.
#[derive(Clone, Debug)]
pub struct Config {
    /// Name on the network: `[A-Za-z0-9_-]+`.
    pub name: String,
    /// Address of gRPC; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Unix socket that serves the same without TLS.
    pub unix_socket: Option<PathBuf>,
    /// Zenoh.
    pub zenoh: Zenoh,
    /// Node on a ROS 2 graph.
    pub ros2: Ros2,
    /// Names by which browsers may address the daemon, in addition to addresses and `localhost`.
    pub allow_hosts: Vec<String>,
    /// Origins of sites that may show the page in a frame, as `https://lab.example`.
    pub frame_ancestors: Vec<String>,
    /// Whether an address that others can reach is allowed without TLS and tokens.
    pub insecure: bool,
    /// Certificate and key, if gRPC and the viewer are served over TLS.
    pub tls: Option<TlsFiles>,
    /// File of tokens, if clients need one.
    pub tokens: Option<PathBuf>,
    /// Whether the daemon ends when stdin does, so that it does not outlive the program that started it.
    pub until_stdin_closes: bool,
    /// Log filter, as `tracing_subscriber::EnvFilter` reads it.
    pub log: String,
    /// Format of the log.
    pub log_format: LogFormat,
    /// Folders below which clients may name robots on this disk.
    pub asset_roots: Vec<PathBuf>,
    /// Robots to load before the first step.
    pub robots: Vec<Robot>,
    /// Gravity, time step, substeps, integrator, and combination of surfaces.
    pub physics: PhysicsSettings,
    /// Pace, and whether the world plays once the robots are loaded.
    pub driver: driver::Config,
    /// Autosave, if enabled.
    pub autosave: Option<Autosave>,
    /// Limits of requests.
    pub limits: DaemonLimits,
    /// Limits of gRPC and HTTP connections.
    pub connections: Connections,
    /// Recordings.
    pub recording: recording::Settings,
}

/// Settings of the autosave.
#[derive(Clone, Debug, PartialEq)]
pub struct Autosave {
    /// File, which is replaced as a whole.
    pub file: PathBuf,
    /// Time between two saves of a changed world.
    pub every: Duration,
    /// Whether the daemon starts with the saved world, and not with the robots of its configuration.
    pub restore: bool,
    /// Whether the daemon chose the file, and makes its folder.
    pub is_made: bool,
}

/// PEM files for TLS.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TlsFiles {
    /// Certificate of the daemon, with intermediate certificates.
    pub certificate: PathBuf,
    /// Private key.
    pub key: PathBuf,
    /// Authorities for certificates of clients; if given, clients must have one.
    pub client_authorities: Option<PathBuf>,
}

/// A robot to load at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// Path of a `.urdf`, or of a package's folder.
    pub path: PathBuf,
    /// Name; if empty, the name in the URDF.
    pub name: String,
    /// `world_from_root`.
    pub pose: DPose3,
    /// Whether the base is fixed; `None` fixes a root link called `world`.
    pub fixed: Option<bool>,
    /// Whether joints have no actuators, instead of holding their position.
    pub passive: bool,
    /// Initial positions, rad or m, by joint.
    pub positions: BTreeMap<String, f64>,
    /// Factor of all lengths.
    pub scale: f64,
    /// Whether to refuse a robot whose report has a warning.
    pub strict: bool,
}

/// Fault in the configuration, in one sentence.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// Fault in the flags or the environment.
    #[error("{0}")]
    Usage(String),
    /// Fault in the configuration file.
    #[error("{0}")]
    File(String),
    /// No fault: the requested help or version.
    #[error("{0}")]
    HelpOrVersion(String),
}

impl Default for Config {
    fn default() -> Self {
        Self {
            name: simd_proto::keys::DEFAULT_NAME.into(),
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, simd_proto::DEFAULT_PORT)),
            unix_socket: None,
            zenoh: Zenoh::default(),
            ros2: Ros2::default(),
            allow_hosts: Vec::new(),
            frame_ancestors: Vec::new(),
            insecure: false,
            tls: None,
            tokens: None,
            until_stdin_closes: false,
            log: "info".into(),
            log_format: LogFormat::Text,
            asset_roots: Vec::new(),
            robots: Vec::new(),
            physics: PhysicsSettings::default(),
            driver: driver::Config::default(),
            autosave: None,
            limits: DaemonLimits::default(),
            connections: Connections::default(),
            recording: recording::Settings::default(),
        }
    }
}

impl Robot {
    /// Makes a robot at the origin, with its description's defaults.
    pub fn at(path: PathBuf) -> Self {
        Self {
            path,
            name: String::new(),
            pose: DPose3::IDENTITY,
            fixed: None,
            passive: false,
            positions: BTreeMap::new(),
            scale: 1.0,
            strict: false,
        }
    }
}

impl Config {
    /// Reads a command line, with the program's name first, without an environment.
    ///
    /// # Errors
    /// Returns one sentence for the first mistake, or the help or the version.
    pub fn from_args(args: impl IntoIterator<Item = OsString>) -> Result<Self, ConfigError> {
        Self::read(args, [])
    }

    /// Reads a command line, with the program's name first, and environment variables.
    ///
    /// # Errors
    /// Returns one sentence for the first mistake, or the help or the version.
    pub fn read(
        args: impl IntoIterator<Item = OsString>,
        variables: impl IntoIterator<Item = (OsString, OsString)>,
    ) -> Result<Self, ConfigError> {
        Ok(read(args, variables)?.config)
    }

    /// Refuses an exposed address without protection. Without tokens, every client that reaches the port
    /// commands the robots; without TLS, everyone who sees the packets has the tokens.
    fn check_exposure(&self) -> Result<(), String> {
        if self.listen.ip().is_loopback() || self.insecure {
            return Ok(());
        }
        let lack = match (&self.tls, &self.tokens) {
            (Some(_), Some(_)) => return Ok(()),
            (None, None) => "without TLS and tokens, anyone who reaches it commands the robots",
            (Some(_), None) => "without tokens, anyone who reaches it commands the robots",
            (None, Some(_)) => "without TLS, anyone who sees the packets has the tokens",
        };
        Err(format!(
            "{} can be reached from other machines: {lack}; give --tls-certificate, --tls-key and --tokens (`simd tls \
             init` and `simctl token add` make them), listen on 127.0.0.1, or use --insecure",
            self.listen
        ))
    }

    /// Changes physics settings, if the world would accept them.
    fn change_physics(&mut self, change: PhysicsChange) -> Result<(), String> {
        let limits = WorldLimits { robots: 0, saved_states: 0 };
        let mut world = Simulation::new(self.physics, limits);
        world.apply(&Command::SetPhysics(change)).map_err(|refused| refused.to_string())?;
        self.physics = *world.settings();
        Ok(())
    }

    fn change_pace(&mut self, pace: Pace) -> Result<(), String> {
        pace.check().map_err(|refused| refused.to_string())?;
        self.driver.pace = pace;
        Ok(())
    }

    fn change_name(&mut self, name: String) -> Result<(), String> {
        if !simd_proto::keys::is_daemon_name(&name) {
            return Err(format!("name is {name:?}; it must be 1 to 64 of the characters A-Z a-z 0-9 _ -"));
        }
        self.name = name;
        Ok(())
    }

    fn change_log(&mut self, log: String) -> Result<(), String> {
        let refused = |why: &str| {
            format!("log is {log:?}; it must be a level like \"info\" or filters like \"simd=debug\" ({why})")
        };
        EnvFilter::try_new(&log).map_err(|error| refused(&error.to_string()))?;
        // It would be taken for the name of a program's part, and nothing would be logged.
        let is_level = |word: &str| word.parse::<tracing_subscriber::filter::LevelFilter>().is_ok();
        let words = log.split(',').map(str::trim);
        let mut names = words.filter(|word| !word.contains(['=', '[']) && !is_level(word));
        if let Some(name) = names.next() {
            return Err(refused(&format!("{name:?} is not a level")));
        }
        self.log = log;
        Ok(())
    }

    fn add_allowed_host(&mut self, name: String) -> Result<(), String> {
        let is_part = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'-' | b'_');
        if name.is_empty() || !name.bytes().all(is_part) {
            return Err(format!(
                "allowed host is {name:?}; it must be a name like lab.example, without a port"
            ));
        }
        self.allow_hosts.push(name);
        Ok(())
    }

    fn set_frame_ancestors(&mut self, origins: Vec<String>) -> Result<(), String> {
        let is_part = |byte: u8| {
            byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'-' | b'_' | b':' | b'[' | b']')
        };
        for origin in &origins {
            let site = origin.strip_prefix("https://").or_else(|| origin.strip_prefix("http://"));
            if !site.is_some_and(|site| !site.is_empty() && site.bytes().all(is_part)) {
                return Err(format!(
                    "frame ancestor is {origin:?}; it must be an origin like https://lab.example or \
                     http://localhost:8888, without a path"
                ));
            }
        }
        self.frame_ancestors = origins;
        Ok(())
    }

    fn add_asset_root(&mut self, folder: PathBuf) -> Result<(), String> {
        let unreadable = |error| format!("asset root {}: {error}", folder.display());
        std::fs::read_dir(&folder).map_err(unreadable)?;
        self.asset_roots.push(folder);
        Ok(())
    }
}

/// Reads all layers, each over the previous one.
fn read(
    args: impl IntoIterator<Item = OsString>,
    variables: impl IntoIterator<Item = (OsString, OsString)>,
) -> Result<draft::Draft, ConfigError> {
    let flags = flags::Flags::read(flags::command("simd"), args)?;
    let variables: Vec<(OsString, OsString)> = variables.into_iter().collect();
    let mut draft = draft::Draft::beginning(environment::state_folder(&variables));
    if let Some(path) = flags.file() {
        file::apply(&mut draft, path)?;
    }
    environment::apply(&mut draft, variables)?;
    flags.apply(&mut draft)?;
    draft.finish()
}
