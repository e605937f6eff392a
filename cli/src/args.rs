//! Options of every command, and the list of commands.

use std::{path::PathBuf, time::Duration};

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::commands::{
    camera, claim, constraint, contact, context, daemon, doctor, event, joint, marker, parameter, record,
    robot, rollout, sensor, server, sim, state, token, top,
};
use crate::complete;
use crate::quantity;

const AFTER_HELP: &str = "\
Daemon: --endpoint, else --context, else $SIMD_ENDPOINT, else the context in the
configuration file, else 127.0.0.1:7400. The file is $XDG_CONFIG_HOME/simd/config.toml or
~/.config/simd/config.toml:

  context = \"lab\"
  [contexts.lab]
  endpoint = \"https://10.0.0.7:7400\"
  token = \"simd_...\"             # --token-file and $SIMD_TOKEN override it
  tls_authorities = \"ca.pem\"     # --tls-ca and $SIMD_TLS_CA override it

Token: --token-file, else $SIMD_TOKEN, else the context's. If the daemon asks for one and none is
given, simctl asks for it on a terminal, but not in a pipe or a script.

Exit codes:
  0   success; also a watch that Ctrl-C or a closed pipe ended
  1   a local failure, for instance a file that cannot be read
  2   wrong usage
  64+ the daemon refused: 64 plus the gRPC status code. 67 invalid argument, 68 no answer
      in time, 69 not found, 70 already exists, 71 not allowed, 72 a limit or a full mailbox,
      73 wrong state, 74 aborted, 75 out of range, 76 not implemented, 77 internal,
      78 unreachable, 80 no token, or an unknown one";

/// Controls simd, the robot physics daemon.
#[derive(Debug, Parser)]
#[command(name = "simctl", version, after_long_help = AFTER_HELP)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(crate) options: Options,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// Options of every command.
#[derive(Args, Debug)]
pub(crate) struct Options {
    /// Daemon by its address: host, host:port, http://host:port, unix:PATH, or for Zenoh tcp/host:port[#NAME]
    #[arg(short, long, global = true, value_name = "ADDRESS", help_heading = "Options everywhere")]
    pub(crate) endpoint: Option<String>,
    /// Daemon by its name in the configuration file
    #[arg(long, global = true, value_name = "NAME", help_heading = "Options everywhere", add = complete::contexts())]
    pub(crate) context: Option<String>,
    /// For https and tls/: authority that signed the daemon's certificate (PEM), else $SIMD_TLS_CA
    #[arg(long, global = true, value_name = "PATH", help_heading = "Options everywhere")]
    pub(crate) tls_ca: Option<PathBuf>,
    /// Certificate of this client (PEM), for a daemon that asks its clients for one, else
    /// $SIMD_TLS_CLIENT_CERT
    #[arg(long, global = true, value_name = "PATH", help_heading = "Options everywhere")]
    pub(crate) tls_client_cert: Option<PathBuf>,
    /// Private key of that certificate (PEM), else $SIMD_TLS_CLIENT_KEY
    #[arg(long, global = true, value_name = "PATH", help_heading = "Options everywhere")]
    pub(crate) tls_client_key: Option<PathBuf>,
    /// File with a token in its first line, for a daemon that asks for one, else $SIMD_TOKEN
    #[arg(long, global = true, value_name = "PATH", help_heading = "Options everywhere")]
    pub(crate) token_file: Option<PathBuf>,
    /// Secret of the claim that calls use, else $SIMD_CLAIM
    #[arg(long, global = true, value_name = "SECRET", help_heading = "Options everywhere")]
    pub(crate) claim: Option<String>,
    /// Tables for people, or JSON for programs
    #[arg(
        short,
        long,
        global = true,
        value_enum,
        default_value_t = Format::Table,
        value_name = "FORMAT",
        help_heading = "Options everywhere"
    )]
    pub(crate) output: Format,
    /// Short for --output json
    #[arg(long, global = true, conflicts_with = "output", help_heading = "Options everywhere")]
    pub(crate) json: bool,
    /// Seconds to wait for an answer
    #[arg(
        long,
        global = true,
        value_parser = seconds,
        default_value = "10",
        value_name = "SECONDS",
        help_heading = "Options everywhere"
    )]
    pub(crate) timeout: Duration,
}

impl Options {
    /// Returns the format of results.
    pub(crate) fn format(&self) -> Format {
        if self.json { Format::Json } else { self.output }
    }
}

/// Format of results.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// Aligned columns
    Table,
    /// One JSON document; for a watch, the same as jsonl
    Json,
    /// One JSON document per line
    Jsonl,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// The world: play, pause, step, reset, physics
    #[command(subcommand)]
    Sim(sim::Sim),
    /// Robots: load, shape, validate, convert, reload, list, info, filter, links, ik, delete
    #[command(subcommand)]
    Robot(robot::Robot),
    /// Joints: list, get, set, play, trajectories, properties, reset, watch, hz
    #[command(subcommand)]
    Joint(joint::Joint),
    /// Sliders and buttons for people and programs: list, get, add, set, press, watch, remove
    #[command(subcommand)]
    Parameter(parameter::Parameter),
    /// Exclusive rights of a client to robots, joints or the world: take, release, list
    #[command(subcommand)]
    Claim(claim::Claim),
    /// Constraints between links: create, list, change, delete
    #[command(subcommand)]
    Constraint(constraint::Constraint),
    /// Contacts, distances and surfaces: list, ray, distance, overlaps, cast, bounds, surfaces, set
    #[command(subcommand)]
    Contact(contact::Contact),
    /// Sensors of robots: add, list, read, watch, delete
    #[command(subcommand)]
    Sensor(sensor::Sensor),
    /// Drawings in the viewer's pages: add, list, delete
    #[command(subcommand)]
    Marker(marker::Marker),
    /// Cameras of robots and of open pages: list, view, get, set
    #[command(subcommand)]
    Camera(camera::Camera),
    /// Recordings of the world, on the daemon's disk: start, stop, list, info, download, export, delete
    #[command(subcommand)]
    Record(record::Record),
    /// Runs copies of the world with the targets of a file
    Rollout(rollout::Rollout),
    /// The daemon: info, ping
    #[command(subcommand)]
    Server(server::Server),
    /// Saved states of the world: save, restore, list, delete, export, import
    #[command(subcommand)]
    State(state::State),
    /// Events in the world: watch
    #[command(subcommand)]
    Event(event::Event),
    /// Daemons of a Zenoh network: list
    #[command(subcommand)]
    Daemon(daemon::Daemon),
    /// Daemons of the configuration file: list, show, use
    #[command(subcommand)]
    Context(context::Context),
    /// Tokens in the file of a daemon on this machine: add, list, revoke
    #[command(subcommand)]
    Token(token::Token),
    /// Shows worlds, robots and clients live
    Top(top::Top),
    /// Checks an installation, and gives advice
    Doctor(doctor::Doctor),
    /// Prints a completion script, which asks the daemon for names of robots and joints
    Completions {
        /// Shell of the script
        shell: clap_complete::Shell,
    },
    /// Writes the manual pages, one for each command, into a folder
    #[command(hide = true)]
    Man {
        /// Output folder (must exist)
        folder: PathBuf,
    },
}

/// Folder of a ROS package that a URDF names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct PackageFolder {
    pub(crate) name: String,
    pub(crate) folder: PathBuf,
}

/// Reads `NAME=FOLDER`.
pub(crate) fn package_folder(text: &str) -> Result<PackageFolder, String> {
    match text.split_once('=') {
        Some((name, folder)) if !name.is_empty() && !folder.is_empty() => {
            Ok(PackageFolder { name: name.to_owned(), folder: PathBuf::from(folder) })
        }
        _ => Err("must be NAME=FOLDER".to_owned()),
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = quantity::SECONDS.read(text)?;
    match Duration::try_from_secs_f64(seconds) {
        Ok(duration) if !duration.is_zero() => Ok(duration),
        _ => Err("must be above zero".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    #[test]
    fn the_command_line_is_well_formed() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn options_may_stand_before_and_after_the_command() {
        for line in ["simctl -e lab -o json robot list", "simctl robot list -o json -e lab"] {
            let parsed = Arguments::try_parse_from(line.split(' ')).unwrap();
            assert_eq!(parsed.options.endpoint.as_deref(), Some("lab"));
            assert_eq!(parsed.options.output, Format::Json);
        }
    }

    #[test]
    fn a_negative_number_is_a_value_and_no_flag() {
        for line in [
            "simctl sim physics --gravity -1,0,-9.81",
            "simctl robot load a.urdf --pose -1,0,0.5",
            "simctl robot load a.urdf --position elbow=-0.5",
            "simctl joint set arm elbow=-0.5",
            "simctl parameter add speed -1 1 -0.5",
            "simctl parameter set speed=-0.5",
            "simctl sensor add lidar arm --range 0.1,30 --horizontal 3,-1,1 --pose -1,0,0",
        ] {
            Arguments::try_parse_from(line.split(' ')).unwrap();
        }
    }
}
