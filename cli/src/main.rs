//! simctl: simd from a shell. This file is the way from arguments to an exit code.
//!
//! * `args`: the options that every command has, and the list of commands.
//! * `commands`: one file per noun, its arguments beside what they do.
//! * `typed`: rules for whatever is typed. `target`, `quantity`, `pose`: parses what is typed.
//! * `context`: which daemon. `credentials`: with which token.
//! * `complete`: candidates for shells that complete a line.
//! * `output`: tables for people, JSON for programs.
//! * `failure`: exit codes, and the remedy for a refusal.

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
    // Zenoh needs this flavor; one worker is enough for one who mostly waits.
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
