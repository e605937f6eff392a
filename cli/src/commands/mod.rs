//! The commands, one file per noun, and what they share: the connection.

pub(crate) mod claim;
pub(crate) mod contact;
pub(crate) mod context;
pub(crate) mod daemon;
pub(crate) mod event;
pub(crate) mod joint;
pub(crate) mod parameter;
pub(crate) mod robot;
pub(crate) mod server;
pub(crate) mod sim;
pub(crate) mod state;
pub(crate) mod token;

use anyhow::Context as _;
use clap::CommandFactory as _;
use simd_client::{Client, ConnectOptions, Error, Token};

use crate::{
    args::{Arguments, Command, Options},
    context::{Choice, choose},
    output::{Output, write_bytes},
};

/// Does what the arguments say.
pub(crate) async fn run(arguments: Arguments) -> anyhow::Result<()> {
    let options = &arguments.options;
    let output = Output::new(options.output);
    match arguments.command {
        Command::Sim(command) => sim::run(command, &connect(options).await?, output).await,
        // Needs no daemon.
        Command::Robot(robot::Robot::Validate(arguments)) => robot::validate::run(&arguments, output),
        Command::Robot(command) => robot::run(command, &connect(options).await?, output).await,
        Command::Joint(command) => joint::run(command, &connect(options).await?, output).await,
        Command::Claim(command) => claim::run(command, &connect(options).await?, output).await,
        Command::Contact(command) => contact::run(command, &connect(options).await?, output).await,
        Command::Parameter(command) => parameter::run(command, &connect(options).await?, output).await,
        Command::Server(command) => server::run(command, &connect(options).await?, output).await,
        Command::State(command) => state::run(command, &connect(options).await?, output).await,
        Command::Event(command) => event::run(command, &connect(options).await?, output).await,
        Command::Daemon(command) => daemon::run(command, options, output).await,
        Command::Context(command) => context::run(command, options, output),
        Command::Token(command) => token::run(&command, output),
        Command::Completions { shell } => {
            // Into memory first: the generator panics where its writer fails.
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "simctl", &mut script);
            write_bytes(&script)
        }
        Command::Man { folder } => clap_mangen::generate_to(Arguments::command(), &folder)
            .with_context(|| format!("cannot write manual pages into {}", folder.display())),
    }
}

async fn connect(options: &Options) -> anyhow::Result<Client> {
    let choice = choose(options)?;
    let client = Client::connect_with(&choice.endpoint, connect_options(options, &choice)).await?;
    let claim = options.claim.clone().or_else(|| std::env::var("SIMD_CLAIM").ok());
    Ok(client.with_claim(&claim.unwrap_or_default()))
}

/// What is said on the command line and by the environment beats the context.
fn connect_options(options: &Options, choice: &Choice) -> ConnectOptions {
    let default = ConnectOptions::default();
    let authorities = options.tls_ca.clone().or(default.tls_authorities);
    ConnectOptions {
        token: default.token.or(choice.token.clone().map(Token::from)),
        tls_authorities: authorities.or(choice.tls_authorities.clone()),
        connect_timeout: options.timeout.min(default.connect_timeout),
        timeout: options.timeout,
    }
}

/// A field that the schema promises and the type cannot.
fn present<T>(field: Option<T>, name: &str) -> Result<T, Error> {
    field.ok_or_else(|| Error::Answer { reason: format!("it lacks `{name}`") })
}

/// What a watch fails with that was not to end yet: its daemon shuts down.
fn ended(client: &Client) -> Error {
    Error::StreamEnded { endpoint: client.endpoint().to_owned() }
}
