//! Errors of calls: refusals of the daemon, and failures of the connection.

use std::{collections::BTreeMap, fmt, io, path::PathBuf, time::Duration};

use simd_proto::v1::{self, ErrorReason};
use tonic::{Code, Status};
use tonic_types::StatusExt as _;

/// Reason why a call has no result. Displays as one sentence.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The daemon refused the call.
    #[error("{0}")]
    Refused(Refusal),
    /// No daemon listens there, or the connection broke.
    #[error("no daemon answers at {endpoint}; start one with `simd`, or name the endpoint of another")]
    Unreachable {
        /// Endpoint as it was given.
        endpoint: String,
        /// Message of the network.
        reason: String,
    },
    /// A daemon answers, but the certificates of the two sides do not match.
    #[error("{sentence}")]
    Untrusted {
        /// Endpoint as it was given.
        endpoint: String,
        /// The fault, and the file or variable that repairs it.
        sentence: String,
        /// Message of TLS.
        reason: String,
    },
    /// A file of certificates on this disk is not usable.
    #[error("{reason}")]
    Certificate {
        /// A sentence that names it.
        reason: String,
    },
    /// The address does not say which of several daemons is meant.
    #[error("several daemons answer at {endpoint}: choose one of {}, as {endpoint}#{}", names.join(", "), names.first().map_or("NAME", String::as_str))]
    SeveralDaemons {
        /// Endpoint as it was given.
        endpoint: String,
        /// Names of the daemons behind it.
        names: Vec<String>,
    },
    /// The daemon did not answer in time. The call may or may not have taken effect.
    #[error("the daemon at {endpoint} did not answer within {} s", .after.as_secs_f64())]
    TimedOut {
        /// Endpoint as it was given.
        endpoint: String,
        /// Time that the client waited.
        after: Duration,
    },
    /// The daemon ended an open stream: it is shutting down.
    #[error("the daemon at {endpoint} ended the stream")]
    StreamEnded {
        /// Endpoint as it was given.
        endpoint: String,
    },
    /// The text is not an address of a daemon.
    #[error("`{endpoint}` is not an endpoint: {reason}")]
    Endpoint {
        /// Endpoint as it was given.
        endpoint: String,
        /// A fragment of a sentence.
        reason: String,
    },
    /// A file on this disk cannot be read.
    #[error("cannot read {}: {reason}", .path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Message of the system. No `source`: a printed chain would repeat it.
        reason: io::Error,
    },
    /// A file on this disk cannot be written.
    #[error("cannot write {}: {reason}", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Message of the system. No `source`: a printed chain would repeat it.
        reason: io::Error,
    },
    /// A path on this disk has no robot.
    #[error(transparent)]
    NoUrdf(#[from] simd_assets::NoUrdf),
    /// A xacro file on this disk cannot be expanded.
    #[error(transparent)]
    Xacro(#[from] simd_xacro::Error),
    /// The answer violates the schema.
    #[error("the daemon's answer cannot be understood: {reason}")]
    Answer {
        /// Fault of the answer.
        reason: String,
    },
    /// The robot was reloaded or respawned since its layout was fetched: fetch it again.
    #[error("the joints of robot `{robot}` are no longer those of the layout that was fetched")]
    LayoutChanged {
        /// Name of the robot.
        robot: String,
    },
    /// The last answer of a [`Control`](crate::Control) stream was not read.
    #[error("the answer to the last request was not read; call `next` before `send`")]
    CreditInUse,
}

impl Error {
    /// Returns the canonical gRPC code, if the daemon or the network is the cause.
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

    /// Returns the daemon's reason, if it refused the call.
    pub fn reason(&self) -> Option<ErrorReason> {
        match self {
            Self::Refused(refusal) => Some(refusal.reason),
            _ => None,
        }
    }

    /// Makes the error of a failed connection: about certificates, if the reason is about them.
    pub(crate) fn unreachable(endpoint: &str, reason: String) -> Self {
        let endpoint = endpoint.to_owned();
        match crate::tls::sentence(&endpoint, &reason) {
            Some(sentence) => Self::Untrusted { endpoint, sentence, reason },
            None => Self::Unreachable { endpoint, reason },
        }
    }

    /// Converts the status of a failed call from tonic.
    pub(crate) fn from_status(status: &Status, endpoint: &str) -> Self {
        let details = status.get_error_details();
        // All refusals of the daemon carry an ErrorInfo. Statuses that tonic makes when a connection breaks
        // have none.
        let is_transport = std::error::Error::source(status).is_some() || status.code() == Code::Unavailable;
        if details.error_info().is_none() && is_transport {
            // Without a source, the status itself has the message.
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

/// A refusal of the daemon.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// The canonical gRPC code.
    pub code: Code,
    /// Reason, for programs. `Unspecified` if this client does not know the daemon's reason.
    pub reason: ErrorReason,
    /// The daemon's own sentence, for people.
    pub message: String,
    /// Details of the reason, by the keys of the schema: `robot`, `joint`, ...
    pub metadata: BTreeMap<String, String>,
    /// Faulty fields of the request, each with its description.
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

/// Returns the reason of this name; the wire leaves out the enum's prefix.
fn reason_named(name: &str) -> ErrorReason {
    ErrorReason::from_str_name(&format!("ERROR_REASON_{name}")).unwrap_or(ErrorReason::Unspecified)
}

/// Returns the last error of the chain, which says what happened: "connection refused" and not "transport
/// error".
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
