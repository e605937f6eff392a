//! Subcommands of `simd`, which replace the daemon.

use std::ffi::OsString;

use clap::Parser;

/// Parses the arguments if they begin with this word. The error is a text to print: `Ok` for help, `Err` for a
/// mistake.
pub(crate) fn read<A: Parser>(
    word: &str,
    arguments: &[OsString],
) -> Option<Result<A, Result<String, String>>> {
    arguments.get(1).filter(|first| *first == word)?;
    Some(A::try_parse_from(arguments).map_err(|said| match said.use_stderr() {
        true => Err(said.to_string()),
        false => Ok(said.to_string()),
    }))
}
