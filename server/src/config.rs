//! What the operator can say: flags beat variables of the environment, which beat the configuration file, which beats the
//! defaults. Everything is checked before a port is bound.
//!
//! * `keys`: the table of keys, from which everything else here is made; `key` is one of them.
//! * `file`, `environment`, `flags`: the layers, each put over a `draft`.
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
pub use self::ros2::{Distro, NO_ROS2, Ros2};
pub use self::zenoh::{NO_ZENOH, Zenoh};
use crate::log::LogFormat;
use simd_world::driver;
use simd_world::handle::{DaemonLimits, Pace};
use simd_world::recording;

/// Everything that a daemon is started with.
#[derive(Clone, Debug)]
pub struct Config {
    /// What it is called on the network: `[A-Za-z0-9_-]+`.
    pub name: String,
    /// Where gRPC is served; port 0 takes a free one.
    pub listen: SocketAddr,
    /// A Unix socket at which the same is served, without TLS.
    pub unix_socket: Option<PathBuf>,
    /// How it is reached over Zenoh.
    pub zenoh: Zenoh,
    /// A node on a graph of ROS 2.
    pub ros2: Ros2,
    /// Names under which browsers may ask for the daemon, beside addresses and `localhost`.
    pub allow_hosts: Vec<String>,
    /// Origins of sites that may have the page in a frame, as `https://lab.example`.
    pub frame_ancestors: Vec<String>,
    /// Allows an address that others can reach without TLS and tokens.
    pub insecure: bool,
    /// The certificate and its key, where gRPC and the viewer are served over TLS.
    pub tls: Option<TlsFiles>,
    /// The file of tokens, where clients need one.
    pub tokens: Option<PathBuf>,
    /// Ends when stdin does, so that a program's own daemon does not outlive it.
    pub until_stdin_closes: bool,
    /// What is logged, as `tracing_subscriber::EnvFilter` reads it.
    pub log: String,
    /// How it is written.
    pub log_format: LogFormat,
    /// Folders below which clients may name robots on this disk.
    pub asset_roots: Vec<PathBuf>,
    /// Robots to load before the first step.
    pub robots: Vec<Robot>,
    /// Gravity, time step, substeps, integrator, how surfaces combine.
    pub physics: PhysicsSettings,
    /// Pace, and whether the world plays once the robots are loaded.
    pub driver: driver::Config,
    /// Where the world is saved as it runs, where it is.
    pub autosave: Option<Autosave>,
    /// What requests must stay within.
    pub limits: DaemonLimits,
    /// What connections of gRPC and HTTP must stay within.
    pub connections: Connections,
    /// Where recordings are kept.
    pub recording: recording::Settings,
}

/// How the world is saved as it runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Autosave {
    /// Where; a file that is written beside it takes its place.
    pub file: PathBuf,
    /// How often, where the world has changed since.
    pub every: Duration,
    /// Whether the daemon starts with the world that is there, and not with the robots of its configuration.
    pub restore: bool,
}

/// What TLS is served with, each a file of PEM.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TlsFiles {
    /// The certificate of the daemon, and what is between it and its authority.
    pub certificate: PathBuf,
    /// Its private key.
    pub key: PathBuf,
    /// Authorities, of one of which clients must have a certificate.
    pub client_authorities: Option<PathBuf>,
}

/// A robot to load at the start.
#[derive(Clone, Debug, PartialEq)]
pub struct Robot {
    /// A `.urdf`, or a package's folder.
    pub path: PathBuf,
    /// Empty: the name in the URDF.
    pub name: String,
    /// `world_from_root`.
    pub pose: DPose3,
    /// `None` fixes a root link called `world`.
    pub fixed: Option<bool>,
    /// Joints are not actuated, instead of holding their position.
    pub passive: bool,
    /// Positions to start from, rad or m, by joint.
    pub positions: BTreeMap<String, f64>,
    /// Lengths are multiplied by it.
    pub scale: f64,
    /// Refuse a robot whose report has a warning.
    pub strict: bool,
}

/// What is wrong, in one sentence.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// With the flags or the environment.
    #[error("{0}")]
    Usage(String),
    /// With the configuration file.
    #[error("{0}")]
    File(String),
    /// Nothing: help or the version was asked for, and this is it.
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
    /// A robot at the origin, as its description has it.
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
    /// From a command line, the program's name first, without an environment.
    ///
    /// # Errors
    /// One sentence for the first mistake. The help and the version come this way too.
    pub fn from_args(args: impl IntoIterator<Item = OsString>) -> Result<Self, ConfigError> {
        Self::read(args, [])
    }

    /// From a command line, the program's name first, and variables of the environment.
    ///
    /// # Errors
    /// One sentence for the first mistake. The help and the version come this way too.
    pub fn read(
        args: impl IntoIterator<Item = OsString>,
        variables: impl IntoIterator<Item = (OsString, OsString)>,
    ) -> Result<Self, ConfigError> {
        Ok(read(args, variables)?.config)
    }

    /// Who reaches the port commands the robots, unless tokens are asked for; who sees the packets has the tokens, unless
    /// there is TLS.
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
             init` and `simctl token add` make them), listen on 127.0.0.1, or say --insecure",
            self.listen
        ))
    }

    /// Changes physics settings, where the world would accept them.
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
        EnvFilter::try_new(&log).map_err(|error| {
            format!(
                "log is {log:?}; it must be a level like \"info\" or filters like \"simd=debug\" ({error})"
            )
        })?;
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

/// All layers, each over the last.
fn read(
    args: impl IntoIterator<Item = OsString>,
    variables: impl IntoIterator<Item = (OsString, OsString)>,
) -> Result<draft::Draft, ConfigError> {
    let flags = flags::Flags::read(flags::command("simd"), args)?;
    let mut draft = draft::Draft::default();
    if let Some(path) = flags.file() {
        file::apply(&mut draft, path)?;
    }
    environment::apply(&mut draft, variables)?;
    flags.apply(&mut draft)?;
    draft.finish()
}
