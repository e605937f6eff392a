//! What the daemon refused and why, or why it did not answer.

use std::{collections::BTreeMap, fmt, io, path::PathBuf, time::Duration};

use simd_proto::v1::{self, ErrorReason};
use tonic::{Code, Status};
use tonic_types::StatusExt as _;

/// Why a call has no result. Displays as one sentence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The daemon answered, and said no.
    #[error("{0}")]
    Refused(Refusal),
    /// Nothing listens there, or the connection broke.
    #[error("no daemon answers at {endpoint}; start one with `simd`, or name the endpoint of another")]
    Unreachable {
        /// As it was given.
        endpoint: String,
        /// What the network said.
        reason: String,
    },
    /// A daemon is there, and the certificates of the two are not such that they talk.
    #[error("{sentence}")]
    Untrusted {
        /// As it was given.
        endpoint: String,
        /// What is wrong, and which file or variable repairs it.
        sentence: String,
        /// What TLS said.
        reason: String,
    },
    /// A file of certificates on this disk cannot be used.
    #[error("{reason}")]
    Certificate {
        /// A sentence that names it.
        reason: String,
    },
    /// The address leaves open which daemon is meant.
    #[error("several daemons answer at {endpoint}: say which of {} is meant, as {endpoint}#{}", names.join(", "), names.first().map_or("NAME", String::as_str))]
    SeveralDaemons {
        /// As it was given.
        endpoint: String,
        /// Of those that are there.
        names: Vec<String>,
    },
    /// The daemon did not answer in time. Whether the call took effect is not known.
    #[error("the daemon at {endpoint} did not answer within {} s", .after.as_secs_f64())]
    TimedOut {
        /// As it was given.
        endpoint: String,
        /// How long the client waited.
        after: Duration,
    },
    /// The daemon ended a stream that was to go on: it is shutting down.
    #[error("the daemon at {endpoint} ended the stream")]
    StreamEnded {
        /// As it was given.
        endpoint: String,
    },
    /// The text is not the address of a daemon.
    #[error("`{endpoint}` is not an endpoint: {reason}")]
    Endpoint {
        /// As it was given.
        endpoint: String,
        /// A fragment of a sentence.
        reason: String,
    },
    /// A file on this disk cannot be read.
    #[error("cannot read {}: {reason}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said. No `source`: a printed chain would have it twice.
        reason: io::Error,
    },
    /// A file on this disk cannot be written.
    #[error("cannot write {}: {reason}", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said. No `source`: a printed chain would have it twice.
        reason: io::Error,
    },
    /// A path on this disk stands for no robot.
    #[error(transparent)]
    NoUrdf(#[from] simd_assets::NoUrdf),
    /// A xacro file on this disk cannot be expanded.
    #[error(transparent)]
    Xacro(#[from] simd_xacro::Error),
    /// The daemon answered something that its schema does not allow.
    #[error("the daemon's answer cannot be understood: {reason}")]
    Answer {
        /// What is wrong with it.
        reason: String,
    },
    /// The robot was reloaded or respawned since its layout was fetched: fetch it again.
    #[error("the joints of robot `{robot}` are no longer those of the layout that was fetched")]
    LayoutChanged {
        /// Its name.
        robot: String,
    },
    /// A [`Control`](crate::Control) stream has an answer that was not read.
    #[error("the answer to the last request was not read; call `next` before `send`")]
    CreditInUse,
}

impl Error {
    /// The canonical gRPC code, where the daemon or the network is the cause.
    pub fn code(&self) -> Option<Code> {
        match self {
            Self::Refused(refusal) => Some(refusal.code),
            Self::Unreachable { .. } | Self::Untrusted { .. } | Self::StreamEnded { .. } => {
                Some(Code::Unavailable)
            }
            Self::TimedOut { .. } => Some(Code::DeadlineExceeded),
            Self::Answer { .. } => Some(Code::Internal),
            Self::LayoutChanged { .. } => Some(Code::Aborted),
            Self::Endpoint { .. }
            | Self::SeveralDaemons { .. }
            | Self::Certificate { .. }
            | Self::File { .. }
            | Self::Write { .. }
            | Self::NoUrdf(_)
            | Self::Xacro(_)
            | Self::CreditInUse => None,
        }
    }

    /// The daemon's reason, where it refused.
    pub fn reason(&self) -> Option<ErrorReason> {
        match self {
            Self::Refused(refusal) => Some(refusal.reason),
            _ => None,
        }
    }

    /// No connection: because of certificates, where what was said is of those.
    pub(crate) fn unreachable(endpoint: &str, reason: String) -> Self {
        let endpoint = endpoint.to_owned();
        match crate::tls::sentence(&endpoint, &reason) {
            Some(sentence) => Self::Untrusted { endpoint, sentence, reason },
            None => Self::Unreachable { endpoint, reason },
        }
    }

    /// From what tonic gives for a failed call.
    pub(crate) fn from_status(status: &Status, endpoint: &str) -> Self {
        let details = status.get_error_details();
        // The daemon's refusals all carry an ErrorInfo, so that what tonic makes up
        // itself when a connection breaks can be distinguished from them.
        let is_transport = std::error::Error::source(status).is_some() || status.code() == Code::Unavailable;
        if details.error_info().is_none() && is_transport {
            // Without a cause of its own the status has the words.
            let reason = match std::error::Error::source(status) {
                Some(_) => root_cause(status),
                None => status.message().to_owned(),
            };
            return Self::unreachable(endpoint, reason);
        }
        let (reason, metadata) = match details.error_info() {
            Some(info) => {
                (reason_named(&info.reason), info.metadata.clone().into_iter().collect::<BTreeMap<_, _>>())
            }
            None => (ErrorReason::Unspecified, BTreeMap::new()),
        };
        let fields = details.bad_request().map(|bad| bad.field_violations.as_slice()).unwrap_or_default();
        Self::Refused(Refusal {
            code: status.code(),
            reason,
            message: status.message().to_owned(),
            metadata,
            fields: fields.iter().map(|f| (f.field.clone(), f.description.clone())).collect(),
        })
    }
}

/// Why the daemon said no.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// The canonical gRPC code.
    pub code: Code,
    /// What programs act on. `Unspecified` where the daemon gave a reason that
    /// this client does not know.
    pub reason: ErrorReason,
    /// The daemon's own sentence, for people.
    pub message: String,
    /// What the reason is about, by the keys that the schema gives: `robot`, `joint`, ...
    pub metadata: BTreeMap<String, String>,
    /// Fields of the request that are at fault, each with its description.
    pub fields: Vec<(String, String)>,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.message.is_empty() {
            write!(f, "the daemon refused the call: {}", self.code.description())
        } else {
            f.write_str(&self.message)
        }
    }
}

impl From<v1::Refusal> for Refusal {
    fn from(refusal: v1::Refusal) -> Self {
        Self {
            code: Code::from(refusal.code),
            reason: refusal.reason(),
            message: refusal.message,
            metadata: refusal.metadata,
            fields: Vec::new(),
        }
    }
}

/// The wire has the enum's names without their prefix.
fn reason_named(name: &str) -> ErrorReason {
    ErrorReason::from_str_name(&format!("ERROR_REASON_{name}")).unwrap_or(ErrorReason::Unspecified)
}

/// The last of the chain says what happened: "connection refused" and not "transport error".
pub(crate) fn root_cause(error: &dyn std::error::Error) -> String {
    let mut cause = error;
    while let Some(source) = cause.source() {
        cause = source;
    }
    cause.to_string()
}

#[cfg(test)]
mod tests {
    use tonic_types::ErrorDetails;

    use super::*;

    #[test]
    fn a_refusal_shows_the_daemons_own_sentence_and_keeps_its_reason() {
        let mut details = ErrorDetails::with_error_info(
            "ROBOT_NOT_FOUND",
            simd_proto::ERROR_DOMAIN,
            [("robot".to_owned(), "arm".to_owned())],
        );
        details.add_bad_request_violation("robots[0].robot", "no such robot");
        let status = Status::with_error_details(Code::NotFound, "no robot is named `arm`", details);
        let error = Error::from_status(&status, "lab:1");
        assert_eq!(error.to_string(), "no robot is named `arm`");
        assert_eq!(error.code(), Some(Code::NotFound));
        assert_eq!(error.reason(), Some(ErrorReason::RobotNotFound));
        let Error::Refused(refusal) = error else { panic!("{error:?}") };
        assert_eq!(refusal.metadata["robot"], "arm");
        assert_eq!(refusal.fields, [("robots[0].robot".to_owned(), "no such robot".to_owned())]);
    }

    #[test]
    fn a_daemon_that_is_shutting_down_is_not_unreachable() {
        let details = ErrorDetails::with_error_info("SHUTTING_DOWN", simd_proto::ERROR_DOMAIN, []);
        let status = Status::with_error_details(Code::Unavailable, "the daemon is shutting down", details);
        assert_eq!(Error::from_status(&status, "lab:1").reason(), Some(ErrorReason::ShuttingDown));
    }

    #[test]
    fn a_broken_connection_says_where_and_what_to_do() {
        let error = Error::from_status(&Status::unavailable("tcp connect error"), "lab:1");
        let sentence = "no daemon answers at lab:1; start one with `simd`, or name the endpoint of another";
        assert_eq!(error.to_string(), sentence);
        assert_eq!(error.code(), Some(Code::Unavailable));
    }

    #[test]
    fn a_reason_from_a_newer_daemon_is_unspecified_but_keeps_its_sentence() {
        let details = ErrorDetails::with_error_info("TOO_PURPLE", simd_proto::ERROR_DOMAIN, []);
        let status = Status::with_error_details(Code::InvalidArgument, "too purple", details);
        let error = Error::from_status(&status, "lab:1");
        assert_eq!(error.reason(), Some(ErrorReason::Unspecified));
        assert_eq!(error.to_string(), "too purple");
    }
}
