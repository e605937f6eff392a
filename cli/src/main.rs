//! simctl: controls simd from a shell. This file goes from arguments to an exit code.
//!
//! * `args`: options of every command, and the list of commands.
//! * `commands`: one file per noun, with its arguments and actions.
//! * `typed`: rules for all arguments. `target`, `quantity`, `pose`: parsers of arguments.
//! * `context`: selection of the daemon. `credentials`: selection of the token.
//! * `complete`: completion in shells.
//! * `output`: tables for people, JSON for programs.
//! * `failure`: exit codes, and remedies for refusals.

mod args;
mod commands;
mod complete;
mod context;
mod credentials;
mod failure;
mod output;
mod pose;
mod quantity;
mod target;
mod text_file;
mod typed;

use std::process::ExitCode;

fn main() -> ExitCode {
    complete::answer();
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
