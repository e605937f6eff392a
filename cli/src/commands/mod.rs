//! The command line: the list of commands, one file per noun, and their connection.

pub(crate) mod camera;
pub(crate) mod claim;
pub(crate) mod constraint;
pub(crate) mod contact;
pub(crate) mod context;
pub(crate) mod daemon;
pub(crate) mod doctor;
pub(crate) mod event;
pub(crate) mod joint;
pub(crate) mod marker;
#[cfg(feature = "mcp")]
mod mcp;
pub(crate) mod parameter;
pub(crate) mod record;
pub(crate) mod robot;
pub(crate) mod rollout;
pub(crate) mod sensor;
pub(crate) mod server;
pub(crate) mod sim;
pub(crate) mod state;
pub(crate) mod token;
#[cfg_attr(not(feature = "top"), allow(dead_code, unused_imports))]
pub(crate) mod top;

use std::path::PathBuf;

use anyhow::Context as _;
#[cfg(feature = "mcp")]
use anyhow::bail;
use clap::{CommandFactory as _, Parser, Subcommand};
use simd_client::{Client, Error};

use crate::{
    complete,
    context::choose,
    credentials,
    options::Options,
    output::{Output, write_bytes},
};

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
#[command(name = "simctl", version = simd_client::PROGRAM_VERSION.as_str(), after_long_help = AFTER_HELP)]
pub(crate) struct Arguments {
    #[command(flatten)]
    pub(crate) options: Options,
    #[command(subcommand)]
    pub(crate) command: Command,
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
    /// Serves tools for an agent over stdin and stdout (Model Context Protocol)
    #[cfg(feature = "mcp")]
    Mcp(mcp::Mcp),
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

/// Runs the command of the arguments.
pub(crate) async fn run(arguments: Arguments) -> anyhow::Result<()> {
    let Arguments { options, command } = arguments;
    match command {
        #[cfg(feature = "mcp")]
        Command::Mcp(arguments) => mcp::run(&arguments, options).await,
        command => perform(command, &options).await,
    }
}

/// Runs a command other than `mcp`.
async fn perform(command: Command, options: &Options) -> anyhow::Result<()> {
    let output = Output::new(options.format());
    match command {
        #[cfg(feature = "mcp")]
        Command::Mcp(_) => bail!("a tool cannot serve tools"),
        Command::Sim(command) => sim::run(command, &connect(options).await?, output).await,
        // Needs no daemon.
        Command::Robot(robot::Robot::Validate(arguments)) => robot::validate::run(&arguments, output),
        Command::Robot(robot::Robot::Convert(arguments)) => robot::convert::run(&arguments, output),
        Command::Robot(command) => robot::run(command, &connect(options).await?, output).await,
        Command::Joint(command) => joint::run(command, &connect(options).await?, output).await,
        Command::Claim(command) => claim::run(command, &connect(options).await?, output).await,
        Command::Constraint(command) => constraint::run(command, &connect(options).await?, output).await,
        Command::Contact(command) => contact::run(command, &connect(options).await?, output).await,
        Command::Parameter(command) => parameter::run(command, &connect(options).await?, output).await,
        Command::Marker(command) => marker::run(command, &connect(options).await?, output).await,
        Command::Camera(command) => camera::run(command, &connect(options).await?, output).await,
        Command::Record(record::Record::Export(arguments)) => record::export(&arguments, output),
        Command::Record(command) => record::run(command, &connect(options).await?, output).await,
        Command::Rollout(arguments) => rollout::run(arguments, &connect(options).await?, output).await,
        Command::Sensor(command) => sensor::run(command, &connect(options).await?, output).await,
        Command::Server(command) => server::run(command, &connect(options).await?, output).await,
        Command::State(command) => state::run(command, &connect(options).await?, output).await,
        Command::Event(command) => event::run(command, &connect(options).await?, output).await,
        Command::Daemon(command) => daemon::run(command, options, output).await,
        Command::Context(command) => context::run(&command, options, output),
        Command::Token(command) => token::run(&command, output),
        Command::Top(arguments) => top::run(arguments, options, output).await,
        Command::Doctor(arguments) => doctor::run(arguments, options, output).await,
        Command::Completions { shell } => write_bytes(&complete::script(shell)?),
        Command::Man { folder } => clap_mangen::generate_to(Arguments::command(), &folder)
            .with_context(|| format!("cannot write manual pages into {}", folder.display())),
    }
}

async fn connect(options: &Options) -> anyhow::Result<Client> {
    let choice = choose(options)?;
    let client = credentials::connect(options, &choice).await?;
    let claim = options.claim.clone().or_else(|| std::env::var("SIMD_CLAIM").ok());
    Ok(client.with_claim(&claim.unwrap_or_default()))
}

/// Returns a field that the schema promises but the type does not.
fn present<T>(field: Option<T>, name: &str) -> Result<T, Error> {
    field.ok_or_else(|| Error::Answer { reason: format!("it lacks `{name}`") })
}

/// Returns the client, which may also take over things of other owners if requested.
fn taking_over(client: &Client, takes_over: bool) -> Client {
    if takes_over { client.clone().taking_over() } else { client.clone() }
}

/// Returns the error of a watch that ended early: its daemon shuts down.
fn ended(client: &Client) -> Error {
    Error::StreamEnded { endpoint: client.endpoint().to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::Format;

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
