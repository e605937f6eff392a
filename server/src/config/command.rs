//! `simd config`: shows or checks the configuration without a daemon.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::{Arg, Command, value_parser};

use super::{Config, ConfigError, flags, text};

/// Request of `simd config`.
#[derive(Debug)]
pub enum Asked {
    /// Text to print.
    Text(String),
    /// File to check: whether a daemon could start with it.
    Check(PathBuf, Box<Config>),
}

/// Reads the arguments if they begin with `config`; returns their request.
///
/// # Errors
/// Returns help, usage, or the first mistake of a file.
pub fn run(
    arguments: &[OsString],
    variables: impl IntoIterator<Item = (OsString, OsString)>,
) -> Option<Result<Asked, ConfigError>> {
    arguments.get(1).filter(|word| *word == "config")?;
    let file = Arg::new("file").value_name("FILE").required(true).value_parser(value_parser!(PathBuf));
    let command = Command::new("simd config")
        .bin_name("simd config")
        .about("The configuration of the daemon")
        .subcommand_required(true)
        .arg_required_else_help(true)
        .disable_help_subcommand(true)
        .subcommand(
            Command::new("default").about("Prints a file with every key, its default and its meaning"),
        )
        .subcommand(
            Command::new("check").about("Checks whether the daemon would start with a file").arg(file),
        )
        .subcommand(
            flags::command("show").about("Prints the values in force with these flags, with their sources"),
        )
        .subcommand(Command::new("document").hide(true));
    let matches = match command.try_get_matches_from(arguments.iter().skip(1)) {
        Ok(matches) => matches,
        Err(said) if said.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            return Some(Err(ConfigError::Usage(format!(
                "it must be simd config default, show or check FILE\n\n{said}"
            ))));
        }
        Err(said) if said.use_stderr() => {
            let said = said.to_string();
            return Some(Err(ConfigError::Usage(said.trim_start_matches("error: ").trim_end().to_owned())));
        }
        Err(said) => return Some(Ok(Asked::Text(said.to_string()))),
    };
    Some(match matches.subcommand() {
        Some(("default", _)) => Ok(Asked::Text(text::default_file())),
        Some(("document", _)) => Ok(Asked::Text(text::document())),
        Some(("check", matches)) => {
            let file = matches.get_one::<PathBuf>("file").cloned().unwrap_or_default();
            let flags = [OsString::from("simd"), "--config".into(), file.clone().into()];
            super::read(flags, []).map(|draft| Asked::Check(file, Box::new(draft.config)))
        }
        _ => {
            let draft = super::read(arguments.iter().skip(2).cloned(), variables);
            draft.map(|mut draft| Asked::Text(text::show(&mut draft)))
        }
    })
}
