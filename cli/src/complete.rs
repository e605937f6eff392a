//! Completion in shells: robots, joints and parameters of the line's daemon.
//!
//! A shell starts `simctl` with the typed words at each press of Tab. Any failure then has no candidates and
//! no message, and a daemon has at most [`WAIT`] to answer.

use std::{ffi::OsStr, io, sync::OnceLock, time::Duration};

use clap::{ArgMatches, Command, CommandFactory, FromArgMatches as _};
use clap_complete::{
    Shell,
    engine::ArgValueCompleter,
    env::{CompleteEnv, Shells},
};
use simd_client::Client;

use crate::{
    candidates::{WORD, candidates, is_bash, unquoted},
    context::choose,
    credentials::connect_options,
    options::Options,
};

/// Variable that a shell sets to its name for a request.
const VARIABLE: &str = "SIMCTL_COMPLETE";
/// Timeout of connecting and all answers together.
const WAIT: Duration = Duration::from_millis(300);

/// The command line that is completed.
static COMMAND: OnceLock<fn() -> Command> = OnceLock::new();

/// Answers a request of a shell, and exits.
pub(crate) fn answer<A: CommandFactory>() {
    CompleteEnv::with_factory(COMMAND.get_or_init(|| A::command)).var(VARIABLE).complete();
}

/// Returns the script that makes a shell send requests.
pub(crate) fn script(shell: Shell) -> io::Result<Vec<u8>> {
    let name = shell.to_string();
    let mut script = Vec::new();
    let shells = Shells::builtins();
    let of_shell = shells.completer(&name).ok_or_else(|| io::Error::other(format!("{name} is not known")))?;
    of_shell.write_registration(VARIABLE, "simctl", "simctl", "simctl", &mut script)?;
    let mut script = String::from_utf8(script).map_err(io::Error::other)?;
    match shell {
        Shell::Bash => {
            let asks = format!("{VARIABLE}=\"bash\"");
            script = script.replace(&asks, &format!("{WORD}=\"${{COMP_WORDS[COMP_CWORD]}}\" {asks}"));
        }
        // Zsh reads a package's script at the first press of Tab, and expects it to answer that one too.
        Shell::Zsh => {
            script.push_str("[ \"$funcstack[1]\" != _simctl ] || _clap_dynamic_completer_simctl \"$@\"\n");
        }
        _ => {}
    }
    Ok(script.into_bytes())
}

/// Completes the name of a robot.
pub(crate) fn robots() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| {
        candidates(current, asked(async |client, _| robot_names(client).await))
    })
}

/// Completes the name of a joint of the robot that was typed before it.
pub(crate) fn joints() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| candidates(current, asked(joints_of_typed)))
}

/// Completes the joint of `JOINT=VALUE`, without the value.
pub(crate) fn assignments() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| {
        let names = asked(joints_of_typed);
        candidates(current, names.into_iter().map(|name| format!("{name}=")))
    })
}

/// Completes `ROBOT[/JOINT]`: the joints of a robot once its slash was typed.
pub(crate) fn robots_or_joints() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| {
        let robot = current.to_str().and_then(|text| text.split_once('/')).map(|(robot, _)| robot.to_owned());
        let names = asked(async move |client, _| match robot {
            Some(robot) => {
                let joints = joint_names(client, &robot).await;
                joints.into_iter().map(|joint| format!("{robot}/{joint}")).collect()
            }
            None => robot_names(client).await,
        });
        candidates(current, names)
    })
}

/// Completes the name of a sensor of the robot that was typed before it.
pub(crate) fn sensors() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| {
        let names = asked(async |client, line| match typed_robot(&line) {
            Some(robot) => {
                let sensors = client.sensors(Some(&robot)).await.unwrap_or_default();
                sensors.into_iter().filter_map(|info| Some(info.sensor?.name)).collect()
            }
            None => Vec::new(),
        });
        candidates(current, names)
    })
}

/// Completes the name of a parameter.
pub(crate) fn parameters() -> ArgValueCompleter {
    ArgValueCompleter::new(|current: &OsStr| {
        let names = asked(async |client, _| {
            let list = client.parameters(Vec::new()).await.map(|list| list.parameters).unwrap_or_default();
            list.into_iter().map(|parameter| parameter.name).collect()
        });
        candidates(current, names)
    })
}

async fn robot_names(client: Client) -> Vec<String> {
    client.robots().await.unwrap_or_default().into_iter().map(|robot| robot.name).collect()
}

async fn joint_names(client: Client, robot: &str) -> Vec<String> {
    let joints = client.joint_layout(robot).await.map(|layout| layout.joints).unwrap_or_default();
    joints.into_iter().map(|joint| joint.name).collect()
}

async fn joints_of_typed(client: Client, line: ArgMatches) -> Vec<String> {
    match typed_robot(&line) {
        Some(robot) => joint_names(client, &robot).await,
        None => Vec::new(),
    }
}

/// Returns the robot that the line names.
fn typed_robot(line: &ArgMatches) -> Option<String> {
    let mut of = line;
    while let Some((_, inner)) = of.subcommand() {
        of = inner;
    }
    of.try_get_one::<String>("robot").ok().flatten().cloned()
}

/// Asks the line's daemon, within the timeout.
fn asked(question: impl AsyncFnOnce(Client, ArgMatches) -> Vec<String>) -> Vec<String> {
    let Some((line, options)) = typed(std::env::args().collect()) else { return Vec::new() };
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build();
    let Ok(runtime) = runtime else { return Vec::new() };
    let answer = runtime.block_on(async {
        let ask = async {
            let choice = choose(&options).ok()?;
            // No token is requested in the middle of a line.
            let connect = connect_options(&options, &choice).ok()?;
            let client = Client::connect_with(&choice.endpoint, connect).await.ok()?;
            Some(question(client, line).await)
        };
        tokio::time::timeout(WAIT, ask).await.ok().flatten()
    });
    // Zenoh's shutdown is not awaited either.
    runtime.shutdown_background();
    answer.unwrap_or_default()
}

/// Returns the typed arguments of the words `simctl -- simctl NOUN VERB ...`.
fn typed(words: Vec<String>) -> Option<(ArgMatches, Options)> {
    let plain = |word: String| if is_bash() { unquoted(&word) } else { word };
    let line = words.into_iter().skip_while(|word| word != "--").skip(1).map(plain);
    let matches = COMMAND.get()?().ignore_errors(true).try_get_matches_from(line).ok()?;
    let options = Options::from_arg_matches(&matches).ok()?;
    Some((matches, options))
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::commands::Arguments;

    #[test]
    fn the_line_so_far_says_which_daemon_and_which_robot() {
        COMMAND.get_or_init(|| Arguments::command);
        let words = |line: &str| format!("simctl -- simctl {line}").split(' ').map(str::to_owned).collect();
        let (line, options) = typed(words("-e lab:1 joint get arm --rate 5 sh")).unwrap();
        assert_eq!(options.endpoint.as_deref(), Some("lab:1"));
        let (_, joint) = line.subcommand().unwrap();
        let (_, get) = joint.subcommand().unwrap();
        assert_eq!(get.get_one::<String>("robot").map(String::as_str), Some("arm"));
        let (_, options) = typed(words("joint set --context sea arm elb")).unwrap();
        assert_eq!(options.context.as_deref(), Some("sea"));
    }
}
