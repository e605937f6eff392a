//! The options that every command has, and the list of commands.

use std::{path::PathBuf, time::Duration};

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::commands::{
    camera, claim, constraint, contact, context, daemon, doctor, event, joint, marker, parameter, record,
    robot, rollout, sensor, server, sim, state, token, top,
};
use crate::complete;
use crate::quantity;

const AFTER_HELP: &str = "\
Which daemon: --endpoint, else --context, else $SIMD_ENDPOINT, else the context in the
configuration file, else 127.0.0.1:7400. The file is $XDG_CONFIG_HOME/simd/config.toml or
~/.config/simd/config.toml:

  context = \"lab\"
  [contexts.lab]
  endpoint = \"https://10.0.0.7:7400\"
  token = \"simd_...\"             # --token-file and $SIMD_TOKEN beat it
  tls_authorities = \"ca.pem\"     # --tls-ca and $SIMD_TLS_CA beat it

A token: --token-file, else $SIMD_TOKEN, else that of the context. Where a daemon asks for one and
none is given, a person at a terminal is asked for it; a pipe or a script is not.

Exit codes:
  0   done; also a watch that was ended by Ctrl-C or by a closed pipe
  1   a failure on this side, for instance a file that cannot be read
  2   wrong usage
  64+ the daemon refused: 64 plus the gRPC status code. 67 invalid argument, 68 no answer
      in time, 69 not found, 70 already exists, 71 not allowed, 72 a limit or a full mailbox,
      73 wrong state, 74 aborted, 75 out of range, 76 not implemented, 77 internal,
      78 unreachable, 80 no token, or one that is not known";

/// Controls simd, the robot physics daemon.
#[derive(Debug, Parser)]
#[command(name = "simctl", version, after_long_help = AFTER_HELP)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(crate) options: Options,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// What every command takes.
#[derive(Args, Debug)]
pub(crate) struct Options {
    /// The daemon: host, host:port, http://host:port, unix:PATH, or for Zenoh tcp/host:port[#NAME]
    #[arg(short, long, global = true, value_name = "ADDRESS", help_heading = "Options everywhere")]
    pub(crate) endpoint: Option<String>,
    /// The daemon, by its name in the configuration file
    #[arg(long, global = true, value_name = "NAME", help_heading = "Options everywhere", add = complete::contexts())]
    pub(crate) context: Option<String>,
    /// For https and tls/: the authority that signed the daemon's certificate (PEM), else $SIMD_TLS_CA
    #[arg(long, global = true, value_name = "PATH", help_heading = "Options everywhere")]
    pub(crate) tls_ca: Option<PathBuf>,
    /// For a daemon that asks its clients for certificates: that of this client (PEM), else $SIMD_TLS_CLIENT_CERT
    #[arg(long, global = true, value_name = "PATH", help_heading = "Options everywhere")]
    pub(crate) tls_client_cert: Option<PathBuf>,
    /// The private key of that certificate (PEM), else $SIMD_TLS_CLIENT_KEY
    #[arg(long, global = true, value_name = "PATH", help_heading = "Options everywhere")]
    pub(crate) tls_client_key: Option<PathBuf>,
    /// For a daemon that asks for a token: a file with it in its first line, else $SIMD_TOKEN
    #[arg(long, global = true, value_name = "PATH", help_heading = "Options everywhere")]
    pub(crate) token_file: Option<PathBuf>,
    /// The claim that calls come with, by its secret; else $SIMD_CLAIM
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
    /// The same as --output json
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
    /// How results are written.
    pub(crate) fn format(&self) -> Format {
        if self.json { Format::Json } else { self.output }
    }
}

/// How results are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// Aligned columns
    Table,
    /// One JSON document; for a watch, the same as jsonl
    Json,
    /// One JSON document a line
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
    /// Who may change what, where that is not everybody: take, release, list
    #[command(subcommand)]
    Claim(claim::Claim),
    /// What holds links together beside joints: create, list, change, delete
    #[command(subcommand)]
    Constraint(constraint::Constraint),
    /// What touches what: list, ray, distance, overlaps, cast, bounds, surfaces, set
    #[command(subcommand)]
    Contact(contact::Contact),
    /// What robots feel and see: add, list, read, watch, delete
    #[command(subcommand)]
    Sensor(sensor::Sensor),
    /// What pages draw beside the world: add, list, delete
    #[command(subcommand)]
    Marker(marker::Marker),
    /// Cameras of robots and of open pages: list, view, get, set
    #[command(subcommand)]
    Camera(camera::Camera),
    /// Recordings of the world, on the daemon's disk: start, stop, list, info, download, export, delete
    #[command(subcommand)]
    Record(record::Record),
    /// What copies of the world come to that run on from it, with the targets of a file
    Rollout(rollout::Rollout),
    /// The daemon: info, ping
    #[command(subcommand)]
    Server(server::Server),
    /// States of the world to go back to: save, restore, list, delete, export, import
    #[command(subcommand)]
    State(state::State),
    /// What happens: watch
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
    /// Shows worlds, robots and clients as they are, over and over
    Top(top::Top),
    /// Looks for what is wrong with an installation, and says what to do
    Doctor(doctor::Doctor),
    /// Prints a completion script, which asks the daemon for names of robots and joints
    Completions {
        /// The shell it is for
        shell: clap_complete::Shell,
    },
    /// Writes the manual pages, one for each command, into a folder
    #[command(hide = true)]
    Man {
        /// Where to; it has to be there
        folder: PathBuf,
    },
}

/// The folder of a ROS package that a URDF names.
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
