//! The commands, one file per noun, and their connection.

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

use anyhow::Context as _;
use clap::CommandFactory as _;
use simd_client::{Client, Error};

use crate::{
    args::{Arguments, Command, Options},
    complete,
    context::choose,
    credentials,
    output::{Output, write_bytes},
};

/// Runs the command of the arguments.
pub(crate) async fn run(arguments: Arguments) -> anyhow::Result<()> {
    let options = &arguments.options;
    let output = Output::new(options.format());
    match arguments.command {
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
