//! The command line: flags of the keys that have one, `--set` for each key, and the other flags.

use std::ffi::OsString;
use std::path::PathBuf;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};

use super::draft::{Draft, Origin};
use super::key::Key;
use super::keys::{self, KEYS};
use super::{ConfigError, Robot};

const AFTER_HELP: &str = "\
Each key of the configuration can be set by a flag (--set PATH=VALUE for any key), by an environment variable (SIMD_ and its
path: SIMD_PHYSICS_TIME_STEP) and in the file. Flags override variables, which override the file.
  simd config default          prints a file with every key, its default and its meaning
  simd config check FILE       checks whether the daemon would start with a file
  simd config show [FLAGS]     prints the values in force, with their sources
Other commands:
  simd tls init FOLDER         makes certificates
  simd tls client FOLDER NAME  makes the certificate of a client
  simd zenoh-acl               prints the access control of a Zenoh router
  simd replay FILE...          runs a recording again and compares each step

Exit codes:
  0  drained after SIGTERM, SIGINT or, if enabled, the end of stdin
  1  any other failure, such as a fault of the physics thread or a second signal
  2  a mistake in the flags or the environment
  3  a mistake in the configuration file
  4  the daemon cannot listen on the address, for instance because it is in use
  5  a robot cannot be loaded at the start
  6  a daemon with the same name is on the Zenoh network";

/// Parsed command line.
#[derive(Debug)]
pub(super) struct Flags {
    matches: ArgMatches,
}

/// Returns the flags of a command with this name.
pub(super) fn command(name: &'static str) -> Command {
    let arguments = KEYS.iter().filter_map(|key| key.flag.map(|flag| argument(key, flag)));
    Command::new(name)
        .version(simd_proto::PROGRAM_VERSION.as_str())
        .about("A headless robot physics daemon")
        .long_about(
            "A headless robot physics daemon.\n\nIt owns one world of robots, steps it in real time, and \
             serves it over gRPC, to browsers and over Zenoh.",
        )
        .after_help(AFTER_HELP)
        .arg(
            path("config", "PATH")
                .help("Reads this configuration file (TOML) first; variables and flags override it"),
        )
        .args(arguments)
        .arg(
            Arg::new("set")
                .long("set")
                .value_name("KEY=VALUE")
                .action(ArgAction::Append)
                .help("Sets any key of the configuration: --set service.robots=50. Repeatable"),
        )
        .arg(path("load", "PATH").action(ArgAction::Append).help(
            "Loads a robot before the first step: a .urdf, or a package's folder. Repeatable; the file has more options",
        ))
        .arg(
            Arg::new("until-stdin-closes").long("until-stdin-closes").action(ArgAction::SetTrue).help(
                "Drains when stdin closes: for a program that starts a daemon, which then ends with the program in \
                 any case",
            ),
        )
        .arg(
            Arg::new("man")
                .long("man")
                .action(ArgAction::SetTrue)
                .exclusive(true)
                .hide(true)
                .help("Writes the manual page, as roff, to stdout"),
        )
}

/// Returns the manual page of section 1, as roff.
fn manual() -> String {
    let mut page = Vec::new();
    // Writing to memory does not fail.
    let _ = clap_mangen::Man::new(command("simd")).render(&mut page);
    String::from_utf8_lossy(&page).into_owned()
}

fn path(name: &'static str, value: &'static str) -> Arg {
    Arg::new(name).long(name).value_name(value).value_parser(value_parser!(PathBuf))
}

fn argument(key: &'static Key, flag: &'static str) -> Arg {
    let mut help = key.meaning.replace('`', "");
    if let Some(first) = help.get(..1).map(str::to_ascii_uppercase) {
        help.replace_range(..1, &first);
    }
    if key.is_list() {
        help += ". Repeatable";
    }
    let argument = Arg::new(key.path).long(flag);
    if key.is_switch() {
        return argument.action(ArgAction::SetTrue).help(help);
    }
    if let Some(default) = key.value(&mut Draft::default()) {
        help += &format!(" [default: {}]", default.replace(['"', '[', ']', ' '], ""));
    }
    let action = if key.is_list() { ArgAction::Append } else { ArgAction::Set };
    argument
        .action(action)
        .allow_hyphen_values(true)
        .value_parser(value)
        .value_name(key.value_name())
        .help(help)
}

/// Accepts a value, which may begin with a minus, as `-1,0,0` does. A text that begins with two is the next
/// flag.
fn value(text: &str) -> Result<String, String> {
    if text.starts_with("--") {
        return Err("it is a flag, and the value is missing".to_owned());
    }
    Ok(text.to_owned())
}

impl Flags {
    pub(super) fn read(
        command: Command,
        arguments: impl IntoIterator<Item = OsString>,
    ) -> Result<Self, ConfigError> {
        let matches = command.try_get_matches_from(arguments).map_err(|error| match error.kind() {
            ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
                ConfigError::HelpOrVersion(error.to_string())
            }
            ErrorKind::UnknownArgument => ConfigError::Usage(unknown(&error)),
            _ => ConfigError::Usage(sentence(&error.to_string())),
        })?;
        match matches.get_flag("man") {
            true => Err(ConfigError::HelpOrVersion(manual())),
            false => Ok(Self { matches }),
        }
    }

    /// Returns the path of the configuration file.
    pub(super) fn file(&self) -> Option<&PathBuf> {
        self.matches.get_one("config")
    }

    /// Applies the flags to the draft.
    pub(super) fn apply(&self, draft: &mut Draft) -> Result<(), ConfigError> {
        for key in KEYS.iter() {
            let Some(flag) = key.flag else { continue };
            let origin = Origin::Flag(format!("--{flag}"));
            if key.is_switch() {
                if self.matches.get_flag(key.path) {
                    draft.set(key, super::key::Value::Switch(true), origin)?;
                }
                continue;
            }
            let said: Vec<&String> = self.matches.get_many(key.path).into_iter().flatten().collect();
            if !said.is_empty() {
                let text = said.into_iter().map(String::as_str).collect::<Vec<_>>().join(",");
                let value = key.parse(&text).map_err(|error| origin.mistake(&format!("it {error}")))?;
                draft.set(key, value, origin)?;
            }
        }
        for said in self.matches.get_many::<String>("set").into_iter().flatten() {
            let origin = Origin::Flag("--set".into());
            let (path, text) =
                said.split_once('=').ok_or_else(|| origin.mistake(&format!("{said:?} is not KEY=VALUE")))?;
            let key = keys::find(path.trim()).ok_or_else(|| {
                origin.mistake(&format!("there is no key {path:?}; `simd config default` prints all"))
            })?;
            let value = key.parse(text).map_err(|error| origin.mistake(&format!("{path} {error}")))?;
            draft.set(key, value, origin)?;
        }
        draft.config.until_stdin_closes = self.matches.get_flag("until-stdin-closes");
        let load = self.matches.get_many::<PathBuf>("load").into_iter().flatten();
        draft.config.robots.extend(load.cloned().map(Robot::at));
        Ok(())
    }
}

/// Returns the sentence about a flag that does not exist, with the key or the flag that may be meant.
fn unknown(error: &clap::Error) -> String {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.as_str()),
        _ => None,
    };
    let typed = text(ContextKind::InvalidArg).unwrap_or_default();
    let name = typed.trim_start_matches('-').split('=').next().unwrap_or_default().replace('-', "_");
    let keys: Vec<_> = KEYS.iter().filter(|key| !name.is_empty() && key.table_and_name().1 == name).collect();
    let advice = match (keys.as_slice(), text(ContextKind::SuggestedArg)) {
        ([], Some(near)) => format!("; perhaps {near}"),
        ([], None) if !typed.starts_with('-') => "; --load PATH loads a robot".to_owned(),
        ([], None) => String::new(),
        (keys, _) => {
            let ways: Vec<_> = keys.iter().map(|key| format!("--set {}=VALUE", key.path)).collect();
            format!("; a key has the name: {}", ways.join(", "))
        }
    };
    format!("unexpected argument '{typed}' found{advice}; see simd --help")
}

/// Returns the first paragraph of clap's message, which names the flag; the rest is usage.
fn sentence(message: &str) -> String {
    let first = message.split("\n\n").next().unwrap_or(message);
    let words: Vec<&str> = first.trim_start_matches("error: ").split_whitespace().collect();
    format!("{}; see simd --help", words.join(" "))
}
