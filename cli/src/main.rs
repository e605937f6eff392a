//! simctl: controls simd from a shell. This file goes from arguments to an exit code.
//!
//! From the top to the bottom:
//!
//! * `commands`: the command line, and one file per noun with its arguments and actions.
//! * `complete`: completion in shells.
//! * `credentials`: selection of the token. `context`: selection of the daemon.
//! * `options`: options of every command. `candidates`: words of a completion.
//! * `configuration`: the file of contexts. `failure`: exit codes, and remedies for refusals.
//! * `typed`: rules for all arguments. `mistakes`: words for wrong ones.
//! * `target`, `quantity`, `pose`: parsers of arguments.
//! * `output`: tables for people, JSON for programs.

mod candidates;
mod commands;
mod complete;
mod configuration;
mod context;
mod credentials;
mod failure;
mod mistakes;
mod options;
mod output;
mod pose;
mod quantity;
mod target;
mod text_file;
mod typed;

use std::process::ExitCode;

use commands::Arguments;

fn main() -> ExitCode {
    complete::answer::<Arguments>();
    let arguments = typed::read();
    // Zenoh needs this flavor; one worker suffices, since it mostly waits.
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
    let result = match runtime {
        Ok(runtime) => runtime.block_on(commands::run(arguments)),
        Err(error) => Err(error.into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => failure::report(&error),
    }
}
