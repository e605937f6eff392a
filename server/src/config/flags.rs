//! The command line.

use std::ffi::OsString;
use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Parser;
use clap::error::ErrorKind;
use glamx::DVec3;
use simd_core::simulation::command::PhysicsChange;

use super::{Config, ConfigError, Robot};

/// A robot physics daemon without a screen.
///
/// It owns one world of robots, steps it in real time, and serves it over gRPC.
#[derive(Debug, Parser)]
#[command(name = "simd", version, after_help = AFTER_HELP, disable_help_subcommand = true)]
pub(super) struct Flags {
    /// Reads this configuration file (TOML) first; flags beat it
    #[arg(long, value_name = "PATH")]
    pub(super) config: Option<PathBuf>,
    /// Where to serve gRPC; port 0 takes a free one [default: 127.0.0.1:7400]
    #[arg(long, value_name = "ADDRESS:PORT")]
    pub(super) listen: Option<SocketAddr>,
    /// What the daemon is called on the network [default: simd]
    #[arg(long)]
    name: Option<String>,
    /// Loads a robot before the first step: a .urdf, or a package's folder. Repeatable
    #[arg(long, value_name = "PATH")]
    load: Vec<PathBuf>,
    /// Clients may name robots on this disk that lie below this folder. Repeatable
    #[arg(long, value_name = "FOLDER")]
    asset_root: Vec<PathBuf>,
    /// Does not play until it is told to
    #[arg(long)]
    paused: bool,
    /// Seconds that a step advances, 0.000001 to 0.1 [default: 0.001]
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    time_step: Option<f64>,
    /// m/s^2 along the world's axes [default: 0,0,-9.81]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = gravity)]
    gravity: Option<DVec3>,
    /// Simulated seconds to a wall second, 0.001 to 1000 [default: 1]
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true)]
    rtf: Option<f64>,
    /// Steps follow each other at once
    #[arg(long)]
    as_fast_as_possible: bool,
    /// What to log on stderr: a level, or filters like simd_server=debug [default: info]
    #[arg(long, value_name = "FILTER")]
    log: Option<String>,
    /// Allows --listen on an address that others can reach. There is no TLS and
    /// no token yet: anyone who reaches the port commands the robots
    #[arg(long)]
    insecure: bool,
}

const AFTER_HELP: &str = "\
Configuration file (all keys are optional; relative paths begin at its folder):
  name = \"simd\"
  listen = \"127.0.0.1:7400\"
  insecure = false
  log = \"info\"
  asset_roots = [\"/srv/robots\"]
  paused = false

  [physics]
  gravity = [0, 0, -9.81]
  time_step = 0.001
  substeps = 1
  real_time_factor = 1.0
  as_fast_as_possible = false

  [limits]                        # of descriptions: see urdf.md for all of them
  links = 1000
  xml_nodes = 250000
  seconds = 60

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
  0  drained after SIGTERM or SIGINT
  1  anything else, such as a fault of the physics thread or a second signal
  2  a mistake in the flags
  3  a mistake in the configuration file
  4  the address cannot be listened on, for instance because it is in use
  5  a robot cannot be loaded at the start";

impl Flags {
    pub(super) fn read(args: impl IntoIterator<Item = OsString>) -> Result<Self, ConfigError> {
        Self::try_parse_from(args).map_err(|error| match error.kind() {
            ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => ConfigError::Shown(error.to_string()),
            _ => ConfigError::Usage(sentence(&error.to_string())),
        })
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
        let change = PhysicsChange { gravity: self.gravity, time_step: self.time_step, substeps: None };
        config.change_physics(change)?;
        config.change_pace(self.rtf, self.as_fast_as_possible)?;
        if self.paused {
            config.pause();
        }
        config.insecure |= self.insecure;
        for folder in self.asset_root {
            config.add_asset_root(folder)?;
        }
        config.robots.extend(self.load.into_iter().map(Robot::at));
        Ok(())
    }
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
