//! The command line.

use std::ffi::OsString;
use std::net::SocketAddr;
use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::{CommandFactory as _, Parser};
use glamx::DVec3;
use simd_core::simulation::command::PhysicsChange;

use super::{Config, ConfigError, IntegratorName, Robot, TlsFiles};
use crate::log::LogFormat;

/// A robot physics daemon without a screen.
///
/// It owns one world of robots, steps it in real time, and serves it over gRPC, to browsers and over Zenoh.
#[derive(Debug, Parser)]
#[command(name = "simd", version, after_help = AFTER_HELP, disable_help_subcommand = true)]
pub(super) struct Flags {
    /// Reads this configuration file (TOML) first; flags beat it
    #[arg(long, value_name = "PATH")]
    pub(super) config: Option<PathBuf>,
    /// Where to serve gRPC and the viewer; port 0 takes a free one [default: 127.0.0.1:7400]
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub(super) listen: Option<SocketAddr>,
    /// Where to listen for Zenoh, or off; port 0 takes a free one. Repeatable [default:
    /// tcp/127.0.0.1:7447, or nowhere with --zenoh-connect]
    #[arg(long, value_name = "LOCATOR")]
    zenoh: Vec<String>,
    /// A Zenoh router to join. Repeatable
    #[arg(long, value_name = "LOCATOR")]
    zenoh_connect: Vec<String>,
    /// Puts settings of Zenoh's own (JSON5) over those of the daemon
    #[arg(long, value_name = "PATH")]
    zenoh_config: Option<PathBuf>,
    /// What the daemon is called on the network [default: simd]
    #[arg(long)]
    name: Option<String>,
    /// Loads a robot before the first step: a .urdf, or a package's folder. Repeatable
    #[arg(long, value_name = "PATH")]
    load: Vec<PathBuf>,
    /// Clients may name robots on this disk that lie below this folder. Repeatable
    #[arg(long, value_name = "FOLDER")]
    asset_root: Vec<PathBuf>,
    /// Browsers may ask for the daemon under this name too, beside its addresses and localhost.
    /// Repeatable
    #[arg(long, value_name = "NAME")]
    allow_host: Vec<String>,
    /// Starts paused
    #[arg(long)]
    paused: bool,
    /// Seconds that a step advances, 0.000001 to 0.1 [default: 0.001]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = number)]
    time_step: Option<f64>,
    /// The method of a step: of second order, or MuJoCo's Euler [default: leapfrog]
    #[arg(long, value_enum)]
    integrator: Option<IntegratorName>,
    /// m/s^2 along the world's axes [default: 0,0,-9.81]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = gravity)]
    gravity: Option<DVec3>,
    /// Simulated seconds to a wall second, 0.001 to 1000 [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true, value_parser = number)]
    rtf: Option<f64>,
    /// Steps follow each other at once
    #[arg(long)]
    as_fast_as_possible: bool,
    /// What to log on stderr: a level, or filters like simd_server=debug [default: info]
    #[arg(long, value_name = "FILTER")]
    log: Option<String>,
    /// How to write it: text for people, or json for programs [default: text]
    #[arg(long, value_name = "FORMAT", value_parser = super::log_format)]
    log_format: Option<LogFormat>,
    /// The daemon's certificate (PEM): gRPC and the viewer are served over TLS. Read again at SIGHUP
    #[arg(long, value_name = "PATH", requires = "tls_key")]
    tls_certificate: Option<PathBuf>,
    /// The private key of --tls-certificate (PEM)
    #[arg(long, value_name = "PATH", requires = "tls_certificate")]
    tls_key: Option<PathBuf>,
    /// Clients need a certificate of one of these authorities (PEM)
    #[arg(long, value_name = "PATH", requires = "tls_certificate")]
    tls_client_authorities: Option<PathBuf>,
    /// Clients need one of the tokens in this file, which `simctl token` writes. Read again when it changes
    #[arg(long, value_name = "PATH")]
    tokens: Option<PathBuf>,
    /// Allows --listen and --zenoh on an address that others can reach without TLS and tokens: anyone who reaches the
    /// port commands the robots
    #[arg(long)]
    insecure: bool,
    /// Drains when stdin closes: for a program that starts a daemon of its own, which
    /// then ends with it, however the program ends
    #[arg(long)]
    until_stdin_closes: bool,
    /// Writes the manual page, as roff, to stdout
    #[arg(long, hide = true, exclusive = true)]
    pub(super) man: bool,
}

const AFTER_HELP: &str = "\
Configuration file (all keys are optional; relative paths begin at its folder):
  name = \"simd\"
  listen = \"127.0.0.1:7400\"
  allow_hosts = [\"lab.example\"]   # names for browsers, beside addresses and localhost
  insecure = false
  tokens = \"tokens\"               # clients need one of them; `simctl token` writes the file
  log = \"info\"
  log_format = \"text\"            # or \"json\"
  asset_roots = [\"/srv/robots\"]
  paused = false

  [tls]                           # of gRPC and the viewer; `simd tls init` makes the files
  certificate = \"server.pem\"
  key = \"server.key\"
  # client_authorities = \"ca.pem\"  # clients need a certificate of one of these

  [zenoh]
  enabled = true
  listen = [\"tcp/127.0.0.1:7447\"]
  connect = []                    # routers to join
  state_rate = 100                # joint states published a second at the most; 0 is none
  # config = \"zenoh.json5\"        # any settings of Zenoh's own

  [physics]
  gravity = [0, 0, -9.81]
  time_step = 0.001
  substeps = 1
  integrator = \"leapfrog\"         # or \"euler\"
  real_time_factor = 1.0
  as_fast_as_possible = false

  [limits]                        # of descriptions: see urdf.md for all of them
  links = 1000
  xml_nodes = 250000
  seconds = 60

  [connections]                   # of gRPC and HTTP: see daemon.md for all of them
  max = 512
  max_per_peer = 128              # of one IPv4 address, or one IPv6 /64
  loopback_reserve = 64           # only for 127.0.0.1 and ::1
  idle_seconds = 300              # without a call

  [[robots]]
  path = \"/srv/robots/arm\"        # required: a .urdf, or a package's folder
  name = \"arm\"
  xyz = [0, 0, 0]                 # metres
  rpy = [0, 0, 0]                 # radians, as in URDF
  fixed = true                    # left out: fixed where the root link is called world
  passive = false
  positions = { shoulder = 0.5 }  # rad or m
  scale = 1.0
  strict = false                  # refuse the robot where its report has a warning

Exit codes:
  0  drained after SIGTERM, SIGINT or, where asked for, the end of stdin
  1  anything else, such as a fault of the physics thread or a second signal
  2  a mistake in the flags
  3  a mistake in the configuration file
  4  the address cannot be listened on, for instance because it is in use
  5  a robot cannot be loaded at the start
  6  a daemon of the same name is on the Zenoh network";

impl Flags {
    pub(super) fn read(args: impl IntoIterator<Item = OsString>) -> Result<Self, ConfigError> {
        Self::try_parse_from(args).map_err(|error| match error.kind() {
            ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
                ConfigError::HelpOrVersion(error.to_string())
            }
            _ => ConfigError::Usage(sentence(&error.to_string())),
        })
    }

    /// Of section 1, as roff.
    pub(super) fn manual() -> String {
        let mut page = Vec::new();
        // Memory takes all of it.
        let _ = clap_mangen::Man::new(Self::command()).render(&mut page);
        String::from_utf8_lossy(&page).into_owned()
    }

    /// Whether anything is said about Zenoh.
    pub(super) fn has_zenoh(&self) -> bool {
        !self.zenoh.is_empty() || !self.zenoh_connect.is_empty() || self.zenoh_config.is_some()
    }

    /// Puts what was said over the configuration.
    pub(super) fn apply(self, config: &mut Config) -> Result<(), String> {
        if let Some(listen) = self.listen {
            config.listen = listen;
        }
        if let Some(name) = self.name {
            config.change_name(name)?;
        }
        if let Some(log) = self.log {
            config.change_log(log)?;
        }
        if let Some(format) = self.log_format {
            config.log_format = format;
        }
        if !self.zenoh.is_empty() {
            config.zenoh.set_listen(self.zenoh)?;
        }
        if !self.zenoh_connect.is_empty() {
            config.zenoh.set_connect(self.zenoh_connect)?;
        }
        if self.zenoh_config.is_some() {
            config.zenoh.file = self.zenoh_config;
        }
        let change = PhysicsChange {
            gravity: self.gravity,
            time_step: self.time_step,
            substeps: None,
            integrator: self.integrator.map(Into::into),
        };
        config.change_physics(change)?;
        config.change_pace(self.rtf, self.as_fast_as_possible)?;
        if self.paused {
            config.pause();
        }
        config.insecure |= self.insecure;
        if let (Some(certificate), Some(key)) = (self.tls_certificate, self.tls_key) {
            config.tls = Some(TlsFiles { certificate, key, client_authorities: self.tls_client_authorities });
        }
        if self.tokens.is_some() {
            config.tokens = self.tokens;
        }
        config.until_stdin_closes = self.until_stdin_closes;
        for name in self.allow_host {
            config.add_allowed_host(name)?;
        }
        for folder in self.asset_root {
            config.add_asset_root(folder)?;
        }
        config.robots.extend(self.load.into_iter().map(Robot::at));
        Ok(())
    }
}

fn number(text: &str) -> Result<f64, String> {
    text.trim().parse().map_err(|_error| "it must be a number".into())
}

fn gravity(text: &str) -> Result<DVec3, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|number| number.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) => Ok(DVec3::new(x, y, z)),
        Ok(_) | Err(_) => Err("it must be three numbers with commas, for instance 0,0,-9.81".into()),
    }
}

/// The first paragraph of what clap says, which names the flag; the rest is usage.
fn sentence(message: &str) -> String {
    let first = message.split("\n\n").next().unwrap_or(message);
    let words: Vec<&str> = first.trim_start_matches("error: ").split_whitespace().collect();
    format!("{}; see simd --help", words.join(" "))
}
