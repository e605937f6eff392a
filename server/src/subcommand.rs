//! Words after `simd` that make it do something else than run a daemon.

use std::ffi::OsString;

use clap::Parser;

/// What the arguments ask for where they begin with this word; or, for help and mistakes, what to print.
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
