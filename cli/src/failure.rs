//! Converts an error to one sentence, a remedy and an exit code.

use std::{
    fmt,
    io::{self, IsTerminal as _, Write as _},
    process::ExitCode,
};

use simd_client::{Error, printable_lines, proto::ErrorReason};

use crate::output::{capture, has_colour};
use crate::{mistakes, typed};

/// Exit code of a local failure.
const OWN: u8 = 1;
/// Exit code of clap.
const USAGE: u8 = 2;
/// Base of the exit code of a refused call, to which its gRPC status code is added.
const REFUSED: u8 = 64;

/// Invalid combination of options that clap cannot check.
#[derive(Debug)]
pub(crate) struct Usage(pub(crate) String);

impl fmt::Display for Usage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Usage {}

/// Writes the error to stderr and returns the exit code.
pub(crate) fn report(error: &anyhow::Error) -> ExitCode {
    if is_closed_pipe(error) {
        // The reader has read enough: `simctl joint watch arm | head`.
        return ExitCode::SUCCESS;
    }
    let mut stderr = io::stderr().lock();
    // Begins like clap's own refusals.
    let name = if error.is::<Usage>() { "error:" } else { "simctl:" };
    let (begin, end) = if has_colour(stderr.is_terminal()) { ("\x1b[31m", "\x1b[0m") } else { ("", "") };
    // If stderr is closed, the error cannot be reported.
    let _ = writeln!(stderr, "{begin}{name}{end} {}", printable_lines(&sentence(error)));
    if let Some(remedy) = remedy(error) {
        let _ = writeln!(stderr, "        {}", printable_lines(&remedy));
    }
    ExitCode::from(code(error))
}

/// Returns the sentence of an error and its remedy, for a reader without a terminal.
#[cfg(feature = "mcp")]
pub(crate) fn text(error: &anyhow::Error) -> String {
    let lines = [Some(sentence(error)), remedy(error)];
    lines.into_iter().flatten().map(|line| printable_lines(&line).to_string()).collect::<Vec<_>>().join("\n")
}

/// Sentence of an error, with the fields of a request as they were typed.
fn sentence(error: &anyhow::Error) -> String {
    let sentence = mistakes::plain(&format!("{error:#}"));
    match error.downcast_ref::<Error>() {
        Some(Error::Refused(refusal)) => {
            typed::renamed(&sentence, refusal.fields.iter().map(|(field, _)| field.clone()))
        }
        _ => sentence,
    }
}

/// Prints one line to stderr about a result that may not be intended.
pub(crate) fn warn(sentence: &str) {
    say("warning", sentence);
}

/// Prints one line to stderr for newcomers.
pub(crate) fn hint(sentence: &str) {
    say("hint", sentence);
}

fn say(kind: &str, sentence: &str) {
    if capture(format!("{kind}: {}\n", printable_lines(sentence)).as_bytes()) {
        return;
    }
    let mut stderr = io::stderr().lock();
    let (begin, end) = if has_colour(stderr.is_terminal()) { ("\x1b[33m", "\x1b[0m") } else { ("", "") };
    // If stderr is closed, the line cannot be reported.
    let _ = writeln!(stderr, "{begin}simctl: {kind}:{end} {}", printable_lines(sentence));
}

fn is_closed_pipe(error: &anyhow::Error) -> bool {
    error.downcast_ref::<io::Error>().is_some_and(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

fn code(error: &anyhow::Error) -> u8 {
    if error.is::<Usage>() {
        return USAGE;
    }
    let Some(error) = error.downcast_ref::<Error>() else { return OWN };
    match (error, error.code()) {
        (Error::Endpoint { .. } | Error::SeveralDaemons { .. }, _) => USAGE,
        (_, Some(code)) => u8::try_from(i32::from(code)).map_or(OWN, |code| REFUSED.saturating_add(code)),
        (_, None) => OWN,
    }
}

/// Returns a remedy that the daemon cannot know: the command that helps.
fn remedy(error: &anyhow::Error) -> Option<String> {
    let refusal = match error.downcast_ref::<Error>()? {
        Error::Refused(refusal) => refusal,
        // "Connection refused" and an unknown host need different remedies.
        Error::Unreachable { endpoint, reason } => {
            // A TLS daemon answers HTTP/2 in one of these two ways.
            let is_cut = reason.contains("frame with invalid size") || reason.contains("broken pipe");
            let is_tls = is_cut && !endpoint.contains("https://");
            let hint = if is_tls { "; perhaps it speaks TLS: https://HOST:PORT" } else { "" };
            return Some(format!("network error: {}{hint}", mistakes::plain(reason)));
        }
        Error::Untrusted { sentence, .. } if sentence.contains("SIMD_TLS_CLIENT_CERT") => {
            return Some("--tls-client-cert and --tls-client-key name them too".to_owned());
        }
        Error::Untrusted { sentence, .. } if sentence.contains("SIMD_TLS_CA") => {
            return Some("--tls-ca names it too, and `tls_authorities` of a context".to_owned());
        }
        Error::SeveralDaemons { .. } => return Some("`simctl daemon list` shows what they do".to_owned()),
        _ => return None,
    };
    let about = |key: &str| refusal.metadata.get(key).map(|value| quoted(value));
    match refusal.reason {
        ErrorReason::RobotNotFound => Some(match refusal.metadata.get("robot").and_then(|it| it.split_once('/')) {
            Some((robot, part)) => format!(
                "here a joint or a link is a separate word, as in `{} {}`; `simctl robot list` lists the robots",
                quoted(robot),
                quoted(part)
            ),
            None => "`simctl robot list` lists the robots".to_owned(),
        }),
        ErrorReason::JointNotFound => {
            let robot = about("robot").unwrap_or_else(|| "ROBOT".to_owned());
            Some(format!("`simctl joint list {robot}` shows its joints"))
        }
        ErrorReason::LinkNotFound => {
            let robot = about("robot").unwrap_or_else(|| "ROBOT".to_owned());
            Some(format!("`simctl robot links {robot}` shows its links"))
        }
        ErrorReason::RobotExists => Some(
            "give another name with --name, have one made up with --rename, or use `simctl robot reload`"
                .into(),
        ),
        ErrorReason::TargetBeyondLimit => {
            Some("`simctl joint set` takes the limit instead, without --refuse-beyond-limits".to_owned())
        }
        ErrorReason::WrongState => {
            Some("`simctl sim pause` stops time, `simctl sim play` lets it run".to_owned())
        }
        ErrorReason::PathNotAllowed => {
            Some("without --on-daemon the file is sent from this machine".to_owned())
        }
        ErrorReason::SavedStateNotFound => Some("`simctl state list` lists the saved states".to_owned()),
        ErrorReason::ConstraintNotFound => Some("`simctl constraint list` lists the constraints".to_owned()),
        ErrorReason::SensorNotFound => Some("`simctl sensor list` lists the sensors".to_owned()),
        ErrorReason::ParameterNotFound => Some("`simctl parameter list` lists the parameters".to_owned()),
        ErrorReason::RecordingNotFound => Some("`simctl record list` lists the recordings".to_owned()),
        ErrorReason::JointClaimed | ErrorReason::RobotClaimed | ErrorReason::WorldClaimed => Some(
            "its holder passes --claim or sets SIMD_CLAIM; `simctl claim list` shows who holds what"
                .to_owned(),
        ),
        ErrorReason::WorldNotClaimed => Some(
            "`simctl claim take --world` claims the world; `simctl claim list` shows who holds what"
                .to_owned(),
        ),
        ErrorReason::Unauthenticated => {
            Some("set SIMD_TOKEN, or `token` of the context in the configuration file".to_owned())
        }
        ErrorReason::ClaimNotFound => Some(
            "`simctl claim take` takes one; --claim and SIMD_CLAIM name it, and are left out without a claim".to_owned(),
        ),
        ErrorReason::InvalidDescription => Some(
            "`simctl robot validate PATH` shows the whole report; a robot is a URDF, xacro, SDF or MJCF, or a folder with one"
                .to_owned(),
        ),
        ErrorReason::RequestIdReused => Some("send a new id with each new request".to_owned()),
        ErrorReason::ParameterExists => {
            Some("--replace puts the new one in its place, --rename gives it another name".to_owned())
        }
        _ => None,
    }
}

/// Quotes a name for a shell as one word.
fn quoted(name: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | '/');
    if !name.is_empty() && name.chars().all(is_plain) {
        name.to_owned()
    } else {
        format!("'{}'", name.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use simd_client::{Code, Refusal};

    use super::*;

    fn refused(code: Code, reason: ErrorReason) -> anyhow::Error {
        let metadata = [("robot".to_owned(), "my arm".to_owned())].into();
        let refusal = Refusal { code, reason, message: "no".into(), metadata, fields: Vec::new() };
        Error::Refused(refusal).into()
    }

    #[test]
    fn a_refusal_exits_with_64_plus_its_status() {
        assert_eq!(code(&refused(Code::NotFound, ErrorReason::RobotNotFound)), 69);
        let unreachable = Error::Unreachable { endpoint: "lab".into(), reason: "refused".into() };
        assert_eq!(code(&unreachable.into()), 78);
        let timed_out = Error::TimedOut { endpoint: "lab".into(), after: std::time::Duration::from_secs(1) };
        assert_eq!(code(&timed_out.into()), 68);
    }

    #[test]
    fn own_failures_exit_with_1_and_wrong_usage_with_2() {
        assert_eq!(code(&anyhow::anyhow!("no")), OWN);
        let file = anyhow::Error::from(Error::File { path: "a".into(), reason: io::Error::other("no") });
        assert_eq!((code(&file), format!("{file:#}")), (OWN, "cannot read a: no".to_owned()));
        let endpoint = Error::Endpoint { endpoint: "a b".into(), reason: "no".into() };
        assert_eq!(code(&endpoint.into()), USAGE);
        let options = anyhow::Error::from(Usage("no".into()));
        assert_eq!((code(&options), format!("{options:#}")), (USAGE, "no".to_owned()));
    }

    #[test]
    fn a_remedy_names_a_command_that_can_be_pasted() {
        let remedy = remedy(&refused(Code::NotFound, ErrorReason::JointNotFound)).unwrap();
        assert_eq!(remedy, "`simctl joint list 'my arm'` shows its joints");
    }

    #[test]
    fn a_closed_pipe_is_not_a_failure() {
        assert!(is_closed_pipe(&io::Error::from(io::ErrorKind::BrokenPipe).into()));
        assert!(!is_closed_pipe(&anyhow::anyhow!("no")));
    }
}
